//! How far the surfaces of the beginning and of the end of a log are from each other, cell by cell.

use crate::cell::{DISTANCE_STEPS, DistanceSum, WEIGHT_UNITS};
use crate::geom::{BlockKey, block_cells};
use crate::parallel;
use crate::store::{Bricks, Store};

/// The displacement of the surface near a cell, from the beginning of a log to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// Along the surface's normal (meters).
    pub meters: f64,
    /// Weights of the cell in either.
    pub weights: [f64; 2],
    /// Whether the cell's brick is one of those that are fitted to; the others are for checking.
    pub fitted: bool,
}

/// The displacements of the cells that were seen at the beginning of a log and at its end, and that lie within a cell of the
/// surface. `sums` are those of the scans up to the end of the beginning, up to where the end begins, and of all: what was seen
/// between is left out, or where one flows into the other looks would share the error of a pose. Those that differ by more than
/// the truncation are of other surfaces. O(cells).
pub fn displacements<const D: usize>(
    sums: [&Bricks<DistanceSum, D>; 3],
    truncation: f64,
) -> Vec<Displacement> {
    let [first, until, whole] = sums;
    let edge = whole.lattice().resolution;
    let step = truncation / f64::from(DISTANCE_STEPS);
    let distance = |moment: i64, weight: i64| step * moment as f64 / weight as f64;
    let of_brick = |key: &BlockKey<D>| {
        let (Some(a), Some(before), Some(all)) = (first.brick(*key), until.brick(*key), whole.brick(*key))
        else {
            return Vec::new();
        };
        let of_cell = |i: usize| {
            let ([moment_a, weight_a], [moment, weight]) = (a.at(i), all.at(i));
            let [moment_before, weight_before] = before.at(i);
            let (moment_b, weight_b) = (moment - moment_before, weight - weight_before);
            if weight_a <= 0 || weight_b <= 0 || distance(moment, weight).abs() > edge {
                return None;
            }
            let meters = distance(moment_b, weight_b) - distance(moment_a, weight_a);
            let weights = [weight_a, weight_b].map(|w| w as f64 / f64::from(WEIGHT_UNITS));
            (meters.abs() < truncation).then_some(Displacement { meters, weights, fitted: is_fitted(*key) })
        };
        (0..block_cells::<D>()).filter_map(of_cell).collect()
    };
    parallel::map(&first.keys(), 16, of_brick).concat()
}

/// Half of the bricks, like the squares of one color of a chessboard: what is beside each other is not apart in both.
fn is_fitted<const D: usize>(key: BlockKey<D>) -> bool {
    key.0.iter().fold(0, |sum: i32, k| sum.wrapping_add(*k)).rem_euclid(2) == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell as _, DistanceObservation, Sign, SumTsdfRule};
    use crate::geom::Lattice;

    /// Sums of looks at a cell (distance, so many times), in the brick at zero.
    fn sums(looks: &[(usize, f32, usize)]) -> Bricks<DistanceSum, 2> {
        let mut bricks = Bricks::new(Lattice::new([0.0; 2], 0.1));
        let mut brick = crate::cell::SumBrick::zero(block_cells::<2>());
        for &(cell, distance, times) in looks {
            for _ in 0..times {
                let before = crate::cell::Planes::<DistanceSum>::get(&brick, cell);
                let rule = SumTsdfRule { truncation: 0.3, sign: Sign::Plus };
                let (after, ()) =
                    DistanceSum::fuse(before, DistanceObservation { distance, weight: 1.0 }, &rule);
                crate::cell::Planes::set(&mut brick, cell, Some(after));
            }
        }
        bricks.insert(BlockKey([0; 2]), brick).unwrap();
        bricks
    }

    #[test]
    fn what_lies_between_beginning_and_end_is_in_neither() {
        // Cell 3: 2 looks at the beginning, 5 of something else between, 4 at the end. Cell 4: at the beginning and between only.
        // Cell 5: two surfaces. Cell 6: far from the surface.
        let first = [(3, 0.02, 2), (4, 0.0, 3), (5, -0.2, 1), (6, 0.2, 1)];
        let between = [(3, -0.08, 5), (4, 0.01, 2)];
        let end = [(3, 0.03, 4), (5, 0.2, 1), (6, 0.2, 1)];
        let all = |parts: &[&[(usize, f32, usize)]]| sums(&parts.concat());
        let three = [all(&[&first]), all(&[&first, &between]), all(&[&first, &between, &end])];
        let found = displacements([&three[0], &three[1], &three[2]], 0.3);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].meters - 0.01).abs() < 3e-4 && found[0].weights == [2.0, 4.0], "{found:?}");
    }
}
