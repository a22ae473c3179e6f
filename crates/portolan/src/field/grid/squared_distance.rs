//! The exact Euclidean distance transform of sampled functions.

use super::envelope::{Envelope, lower_envelope};
use crate::parallel;

/// Lines per transposed tile: two tiles of 64 x 64 doubles fit into a level-two cache.
const TILE: usize = 64;

/// Replaces every sample by `min over p of |q - p|^2 + f(p)`, in squared cells, in place (Felzenszwalb &
/// Huttenlocher 2012). `f` is x fastest with `shape` samples along each axis; infinity marks samples that
/// seed nothing. Without any seed everything stays infinite. Theta(samples).
///
/// One pass along each axis; between passes the axes are rotated, so that every pass runs along memory. With
/// the feature `parallel` lines are shared out to all cores; the result is the same bytes.
///
/// # Panics
/// Where the length of `f` is not the product of `shape`.
pub fn squared_distance_transform<const D: usize>(f: &mut [f64], shape: [usize; D]) {
    assert_eq!(f.len(), shape.iter().product::<usize>(), "one sample per cell");
    if f.is_empty() {
        return;
    }
    let mut rotated = vec![0.0; f.len()];
    let mut from: &mut [f64] = f;
    let mut to: &mut [f64] = &mut rotated;
    for &n in &shape {
        lines(from, n);
        rotate(from, to, n);
        std::mem::swap(&mut from, &mut to);
    }
    // After D rotations the axes stand as before; an odd number of them leaves the result in the scratch.
    if D % 2 == 1 {
        to.copy_from_slice(from);
    }
}

fn lines(f: &mut [f64], n: usize) {
    let chunk = n * TILE;
    // Fewer lines than this are not worth another core.
    let chunk = if f.len() < 8 * chunk { f.len().max(1) } else { chunk };
    parallel::for_each(f.chunks_mut(chunk), Envelope::default, |lines, scratch| {
        lines.chunks_exact_mut(n).for_each(|line| lower_envelope(line, scratch));
    });
}

/// Moves the fastest axis, of `n` samples, to be the slowest.
fn rotate(from: &[f64], to: &mut [f64], n: usize) {
    let lines = from.len() / n;
    for line0 in (0..lines).step_by(TILE) {
        for i0 in (0..n).step_by(TILE) {
            for i in i0..(i0 + TILE).min(n) {
                let row = &mut to[i * lines..][..lines];
                for line in line0..(line0 + TILE).min(lines) {
                    row[line] = from[line * n + i];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;
    use proptest::prelude::*;

    fn matches_brute_force<const D: usize>(seeds: &[(usize, f64)], shape: [usize; D]) {
        let grid = Grid::new([0.0; D], 1.0, shape);
        let mut f = vec![f64::INFINITY; grid.len()];
        for &(i, v) in seeds {
            let i = i % grid.len();
            f[i] = f[i].min(v);
        }
        let seeded = f.clone();
        squared_distance_transform(&mut f, shape);
        for (i, &got) in f.iter().enumerate() {
            let want = seeded
                .iter()
                .enumerate()
                .filter(|s| s.1.is_finite())
                .map(|(j, v)| {
                    let (a, b) = (grid.cell(i), grid.cell(j));
                    (0..D).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>() + v
                })
                .fold(f64::INFINITY, f64::min);
            assert!(got == want || (got - want).abs() <= 1e-9 * (1.0 + want), "{i}: {got} {want}");
        }
    }

    proptest! {
        #[test]
        fn matches_brute_force_2d_and_3d(
            seeds in prop::collection::vec((any::<usize>(), prop_oneof![Just(0.0), 0.0..9.0f64, 0.0..900.0f64]), 0..40),
            flat in prop::array::uniform2(1..33usize), shape in prop::array::uniform3(1..11usize),
        ) {
            matches_brute_force(&seeds, flat);
            matches_brute_force(&seeds, shape);
        }
    }

    #[test]
    fn large_maps_are_tiled_and_threaded_and_the_same() {
        let shape = [700, 650];
        let seeds: Vec<usize> = (0..400).map(|i| i * 7919 % (700 * 650)).collect();
        let mut f = vec![f64::INFINITY; 700 * 650];
        seeds.iter().for_each(|&i| f[i] = 0.0);
        squared_distance_transform(&mut f, shape);
        for i in (0..f.len()).step_by(9973) {
            let want = seeds.iter().map(|j| {
                ((i % 700) as f64 - (j % 700) as f64).powi(2) + ((i / 700) as f64 - (j / 700) as f64).powi(2)
            });
            assert_eq!(f[i], want.fold(f64::INFINITY, f64::min));
        }
    }

    #[test]
    fn nothing_stays_nothing() {
        let mut f = vec![f64::INFINITY; 30];
        squared_distance_transform(&mut f, [5, 6]);
        assert!(f.iter().all(|v| *v == f64::INFINITY));
        squared_distance_transform::<2>(&mut [], [0, 7]);
    }
}
