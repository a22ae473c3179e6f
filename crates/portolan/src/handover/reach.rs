//! Distances to sets of cells, and extension of values into unknown cells.

use crate::geom::Grid;

/// Distance of every cell's center to the nearest cell of a set, as boxes, in cells, up to `reach`: one pass along each
/// axis of `min over k of f(q + k) + (max(0, |k| - 1/2))^2`. O(cells x reach) at worst; a search ends where it cannot
/// find less.
pub(super) fn distance_to_boxes<const D: usize>(
    shape: [usize; D],
    in_set: impl Fn(usize) -> bool,
    reach: f64,
) -> Vec<f32> {
    let cells: usize = shape.iter().product();
    // A reach beyond the diagonal of the array has the same result as the diagonal, whose square is finite.
    let most = reach.min(shape.iter().map(|&n| n as f64).sum::<f64>());
    let most_sq = (most * most) as f32;
    let mut sq: Vec<f32> = (0..cells).map(|i| if in_set(i) { 0.0 } else { most_sq }).collect();
    let (mut line, mut stride) = (Vec::new(), 1);
    for n in shape {
        for start in (0..cells).filter(|i| (i / stride) % n == 0) {
            line.clear();
            line.extend((0..n).map(|q| sq[start + q * stride]));
            if line.iter().all(|v| *v == most_sq) {
                continue;
            }
            for q in 0..n {
                sq[start + q * stride] = least_along(&line, q);
            }
        }
        stride *= n;
    }
    sq.iter().map(|v| if *v < most_sq { v.sqrt() } else { reach as f32 }).collect()
}

/// `min over k of line(q + k) + (max(0, |k| - 1/2))^2`.
fn least_along(line: &[f32], q: usize) -> f32 {
    let mut best = line[q];
    for k in 1..line.len() {
        let gap = k as f32 - 0.5;
        let cost = gap * gap;
        if cost >= best {
            break;
        }
        if q >= k {
            best = best.min(line[q - k] + cost);
        }
        if q + k < line.len() {
            best = best.min(line[q + k] + cost);
        }
    }
    best
}

/// Replaces every NaN by the least sum of a neighbor's value and the distance to it (meters), at most `most`: sweeps forward
/// and backward until nothing changes (Rosenfeld & Pfaltz 1966, with Euclidean steps).
pub(super) fn extended<const D: usize>(values: &mut [f32], grid: &Grid<D>, most: f32) {
    // Half of the 3^D - 1 neighbors: those before a cell in memory.
    let before: Vec<([i32; D], f32)> = (0..3usize.pow(D as u32) / 2)
        .map(|code| {
            let offset: [i32; D] = std::array::from_fn(|k| (code / 3usize.pow(k as u32) % 3) as i32 - 1);
            let steps: i32 = offset.iter().map(|o| o * o).sum();
            (offset, (f64::from(steps).sqrt() * grid.lattice.resolution) as f32)
        })
        .collect();
    let unknown: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_nan()).collect();
    unknown.iter().for_each(|&i| values[i] = most);
    let mut settle = |i: usize, side: i32| {
        let cell = grid.cell(i);
        let neighbors = before.iter().filter_map(|(offset, step)| {
            let at = grid.index(std::array::from_fn(|k| cell[k] + side * offset[k]))?;
            Some(values[at] + step)
        });
        let best = neighbors.fold(values[i], f32::min);
        let lower = best < values[i];
        values[i] = best;
        lower
    };
    // Two sweeps suffice for convex unknown regions; winding ones take a few more.
    for _ in 0..8 {
        let forward = unknown.iter().fold(false, |any, &i| settle(i, 1) | any);
        let backward = unknown.iter().rev().fold(false, |any, &i| settle(i, -1) | any);
        if !(forward || backward) {
            break;
        }
    }
}
