//! Batches give the bits of single points.

use super::*;
use crate::cell::{DistanceBrick, SignedDistance};
use crate::field::{EsdfMethod, EsdfSettings};
use crate::geom::{Grid, Lattice, block_cells};
use crate::store::{Bricks, Store};

const R: f64 = 0.1;

fn answers<const D: usize>(
    points: &[[f64; D]],
    run: impl Fn(FieldSlots<'_, D>),
) -> Vec<(Status, f64, [f64; D])> {
    let mut distance = vec![0.0; points.len()];
    let mut gradient = vec![[0.0; D]; points.len()];
    let mut status = vec![Status::default(); points.len()];
    run(FieldSlots { distance: &mut distance, gradient: &mut gradient, status: &mut status });
    (0..points.len()).map(|i| (status[i], distance[i], gradient[i])).collect()
}

fn points<const D: usize>(n: usize, edge: f64) -> Vec<[f64; D]> {
    let at =
        |i: usize, k: usize| (i as f64 * [0.618_034, 0.754_878, 0.569_840][k]).fract() * (edge + 4.0) - 2.0;
    let mut points: Vec<_> = (0..n).map(|i| std::array::from_fn(|k| at(i, k))).collect();
    points.extend([[f64::NAN; D], [1e12; D], [-1e300; D], [f64::INFINITY; D]]);
    points
}

/// Every answer of a batch beside the single one; `seen` counts them by status.
fn is_what_single_points_get<const D: usize>(
    points: &[[f64; D]],
    batch: impl Fn(Interpolation, FieldSlots<'_, D>),
    linear: impl Fn([f64; D]) -> Answer<(f64, [f64; D])>,
    smooth: impl Fn([f64; D]) -> Answer<Smooth<D>>,
) -> [[usize; 4]; 2] {
    let mut seen = [[0; 4]; 2];
    for (n, interpolation) in [Interpolation::Linear, Interpolation::Cubic].into_iter().enumerate() {
        for (&p, got) in points.iter().zip(answers(points, |out| batch(interpolation, out))) {
            let want = match interpolation {
                Interpolation::Linear => linear(p),
                Interpolation::Cubic => smooth(p).map(|s| (s.distance, s.gradient)),
            };
            seen[n][got.0 as usize] += 1;
            assert_eq!(got.0, want.status(), "{p:?} {interpolation:?}");
            match want {
                Answer::Known(w) | Answer::Saturated(w) => assert_eq!((got.1, got.2), w, "{p:?}"),
                _ => assert!(got.1.is_nan() && got.2.iter().all(|g| g.is_nan())),
            }
        }
    }
    seen
}

fn ball<const D: usize>(p: [f64; D], edge: f64) -> f64 {
    vector::distance(p, [0.5 * edge; D]) - 0.8
}

fn dense_batches<const D: usize>() {
    let n = 30;
    let grid = Grid::new([0.0; D], R, [n; D]);
    let value = |i: usize| {
        if i % 97 == 5 { f32::NAN } else { ball(grid.lattice.center(grid.cell(i)), 3.0) as f32 }
    };
    let esdf = EsdfGrid::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
    let seen = is_what_single_points_get(
        &points::<D>(6000, 3.0),
        |interpolation, out| esdf.distances_and_gradients(&points::<D>(6000, 3.0), interpolation, out),
        |p| esdf.distance_and_gradient(p),
        |p| esdf.smooth(p),
    );
    // What is unknown is so for both.
    assert_eq!(seen[0], seen[1]);
    assert!(seen[0][0] > 50 && seen[0][1] > 200 && seen[0][3] > 1000, "{seen:?}");
}

#[test]
fn dense_batches_are_what_single_points_get() {
    dense_batches::<2>();
    dense_batches::<3>();
}

/// A ball in observed bricks, some cells of them unobserved.
fn sparse<const D: usize>(max_distance: f64) -> Esdf<D> {
    let mut store = Bricks::<SignedDistance, D>::new(Lattice::new([0.0; D], R));
    for n in 0..5usize.pow(D as u32) {
        let key = BlockKey(std::array::from_fn(|k| (n / 5usize.pow(k as u32) % 5) as i32));
        let cells: Vec<_> = (0..block_cells::<D>()).map(|i| store.lattice().center(key.cell(i))).collect();
        let values: Vec<f32> = cells.iter().map(|&p| ball(p, 4.0).clamp(-0.3, 0.3) as f32).collect();
        let weights: Vec<f32> =
            (0..cells.len()).map(|i| if (i + n) % 251 == 9 { 0.0 } else { 1.0 }).collect();
        store.insert(key, DistanceBrick::from_parts(&values, &weights).unwrap()).unwrap();
    }
    let method = EsdfMethod::Seeded { band_cells: 1.5 };
    Esdf::of(&store, &EsdfSettings { max_distance, method, ..Default::default() })
}

fn sparse_batches<const D: usize>() {
    let esdf = sparse::<D>(0.7);
    let seen = is_what_single_points_get(
        &points::<D>(6000, 4.0),
        |interpolation, out| esdf.distances_and_gradients(&points::<D>(6000, 4.0), interpolation, out),
        |p| esdf.distance_and_gradient(p),
        |p| esdf.smooth(p),
    );
    assert!(seen.iter().flatten().all(|&n| n > 50), "{seen:?}");
    assert_eq!((seen[0][0], seen[0][3]), (seen[1][0], seen[1][3]));
}

#[test]
fn sparse_batches_are_what_single_points_get() {
    sparse_batches::<2>();
    sparse_batches::<3>();
}

/// Bricks and array hold the same samples: they answer alike, across the faces of bricks, too.
fn bricks_are_the_array<const D: usize>() {
    let bricks = sparse::<D>(9.0);
    let grid = Grid::new([0.0; D], R, [40; D]);
    let value = |i: usize| bricks.cell(grid.cell(i)).known().unwrap_or(f32::NAN);
    let dense = EsdfGrid::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
    let mut known = 0;
    for p in points::<D>(6000, 4.0) {
        if let Answer::Known(want) = dense.smooth(p) {
            let got = bricks.smooth(p).known().unwrap();
            // They agree on the place in a cell to rounding.
            assert!((got.distance - want.distance).abs() < 1e-12);
            assert!(vector::distance(got.gradient, want.gradient) < 1e-9);
            known += 1;
        }
    }
    assert!(known > 500, "{known}");
}

#[test]
fn bricks_are_the_array_2d_and_3d() {
    bricks_are_the_array::<2>();
    bricks_are_the_array::<3>();
}

/// Off its center a ball's distance has a gradient of length one and curvatures of one over the radius: the spline has
/// them to the square of the cell, and its gradient is nearer to the truth than the linear one's.
#[test]
fn a_ball_bends_as_it_should() {
    let n = 40;
    let grid = Grid::new([0.0; 3], R, [n; 3]);
    let value = |i: usize| ball(grid.lattice.center(grid.cell(i)), 4.0) as f32;
    let esdf = EsdfGrid::from_samples(grid, (0..grid.len()).map(value).collect()).unwrap();
    let (mut cubic, mut linear): (f64, f64) = (0.0, 0.0);
    for p in points::<3>(4000, 4.0) {
        let offset = vector::sub(p, [2.0; 3]);
        let radius = vector::norm(offset);
        let Answer::Known(got) = esdf.smooth(p) else { continue };
        if !(0.8..1.6).contains(&radius) {
            continue;
        }
        let outward = vector::scale(offset, 1.0 / radius);
        cubic = cubic.max(vector::distance(got.gradient, outward));
        linear = linear.max(vector::distance(esdf.gradient(p).known().unwrap(), outward));
        let trace: f64 = (0..3).map(|k| got.hessian[k][k]).sum();
        // 2 / radius; second derivatives of a cubic are wrong by the cell times third derivatives.
        assert!((trace - 2.0 / radius).abs() < 1.5 * R / radius.powi(2) * 2.0, "{trace} {radius}");
    }
    assert!(cubic < 0.012 && linear > 4.0 * cubic, "{cubic} {linear}");
}
