//! Interpolation at nodes and on the lines between them, where not all nodes around a point have a value.

use crate::answer::Answer;

/// So near to a node along an axis (cells), a point is on it: coordinates are rounded when they are written.
const ON: f64 = 1e-6;

/// Value and slope (per cell) at a place in cells from the center of cell 0, where it lies on nodes along some axes: nodes
/// beside it along those axes do not count. `None` where it lies on none, or a node that counts has no value.
///
/// Along an axis on which the point is on nodes, the slope is that to the next node above, or to the one below where that has
/// no value; 0 where neither has. `sample` is a node's value, and whether it stands for more.
pub(super) fn on_nodes<const D: usize>(
    place: [f64; D],
    sample: impl Fn([i32; D]) -> Option<(f64, bool)>,
) -> Option<Answer<(f64, [f64; D])>> {
    let nearest = place.map(f64::round);
    let on: [bool; D] = std::array::from_fn(|k| (place[k] - nearest[k]).abs() <= ON);
    let fits = nearest.iter().all(|v| v.abs() < f64::from(i32::MAX));
    if !fits || !on.contains(&true) {
        return None;
    }
    let base: [i32; D] =
        std::array::from_fn(|k| if on[k] { nearest[k] as i32 } else { place[k].floor() as i32 });
    // The value on the line, square or node that the point lies on, moved along one axis, and its slopes.
    let value = |axis: usize, step: i32| {
        let (mut sum, mut slopes, mut saturated) = (0.0, [0.0; D], false);
        for c in 0..1usize << D {
            if (0..D).any(|k| on[k] && c >> k & 1 == 1) {
                continue;
            }
            let mut node: [i32; D] = std::array::from_fn(|k| base[k] + (c >> k & 1) as i32);
            node[axis] += step;
            let (v, more) = sample(node)?;
            saturated |= more;
            let share = |k: usize| match (on[k], c >> k & 1) {
                (true, _) => 1.0,
                (_, 1) => place[k] - f64::from(base[k]),
                _ => 1.0 - (place[k] - f64::from(base[k])),
            };
            sum += v * (0..D).map(share).product::<f64>();
            for k in (0..D).filter(|&k| !on[k]) {
                let sign = if c >> k & 1 == 1 { 1.0 } else { -1.0 };
                slopes[k] += sign * v * (0..D).filter(|&j| j != k).map(share).product::<f64>();
            }
        }
        Some((sum, slopes, saturated))
    };
    let (here, mut slopes, saturated) = value(0, 0)?;
    for k in (0..D).filter(|&k| on[k]) {
        let above = value(k, 1).map(|(v, ..)| v - here);
        slopes[k] = above.or_else(|| value(k, -1).map(|(v, ..)| here - v)).unwrap_or(0.0);
    }
    let answer = (here, slopes);
    Some(if saturated { Answer::Saturated(answer) } else { Answer::Known(answer) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum of the indices, known in the box from 0 to 2.
    fn known<const D: usize>(node: [i32; D]) -> Option<(f64, bool)> {
        let inside = node.iter().all(|v| (0..3).contains(v));
        inside.then(|| (node.iter().map(|v| f64::from(*v)).sum(), false))
    }

    #[test]
    fn what_does_not_count_may_be_unknown() {
        let ask = |p| on_nodes::<2>(p, known).and_then(Answer::known);
        assert_eq!(ask([2.0, 2.0]), Some((4.0, [1.0, 1.0])));
        assert_eq!(ask([0.0, 0.0]), Some((0.0, [1.0, 1.0])));
        let (value, slope) = ask([2.0 + 1e-9, 1.25]).unwrap();
        assert!((value - 3.25).abs() < 1e-12 && slope == [1.0, 1.0]);
        assert_eq!(ask([2.0, 2.25]), None);
        assert_eq!(ask([1.5, 1.5]), None);
        assert_eq!(ask([f64::NAN, 1.0]), None);
        let lone = |node: [i32; 3]| (node == [5, 5, 5]).then_some((0.5, true));
        assert_eq!(on_nodes([5.0, 5.0, 5.0], lone), Some(Answer::Saturated((0.5, [0.0; 3]))));
    }
}
