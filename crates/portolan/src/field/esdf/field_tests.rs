//! Fields of cells against brute force, and bricks against dense arrays.

use super::*;
use crate::answer::Answer;
use crate::cell::{DistanceBrick, Planes};
use crate::field::esdf_from_tsdf;
use crate::geom::{block_cells, vector};
use crate::map::DenseTsdf;
use crate::testing::with_threads;
use proptest::prelude::*;

const R: f64 = 0.1;

/// Key, and cells: place, distance, weight.
type RandomBrick = ([i32; 3], Vec<(usize, f32, f32)>);

/// Random cells of random bricks: mostly free or unobserved, some within the band.
fn store<const D: usize>(bricks: &[RandomBrick]) -> Bricks<SignedDistance, D> {
    let mut store = Bricks::new(Lattice::new([500_000.0; D], R));
    for (key, cells) in bricks {
        let key = BlockKey(std::array::from_fn(|k| key[k]));
        let mut brick: DistanceBrick =
            store.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(block_cells::<D>()));
        for &(i, distance, weight) in cells {
            let i = i % block_cells::<D>();
            brick.set(i, (weight > 0.0).then_some(SignedDistance { distance, weight }));
        }
        store.insert(key, brick).unwrap();
    }
    store
}

fn bricks() -> impl Strategy<Value = Vec<RandomBrick>> {
    let distance = prop_oneof![4 => 0.2f32..0.3, 1 => -0.3f32..-0.2, 1 => -0.16f32..0.16];
    let cell = (any::<usize>(), distance, prop_oneof![Just(0.0f32), 0.2f32..4.0]);
    let at = prop_oneof![3 => -2..3i32, 1 => Just(40_000_000)];
    prop::collection::vec((prop::array::uniform3(at), prop::collection::vec(cell, 1..60)), 0..12)
}

fn matches_brute_force<const D: usize>(bricks: &[RandomBrick], settings: &EsdfSettings, band_cells: f32) {
    let store = store::<D>(bricks);
    let settings = &EsdfSettings { method: EsdfMethod::Seeded { band_cells }, ..*settings };
    let esdf = Esdf::of(&store, settings);
    let observed: Vec<([i32; D], f32)> = store
        .keys()
        .iter()
        .flat_map(|&key| (0..block_cells::<D>()).map(move |i| key.cell(i)))
        .filter_map(|cell| {
            store.cell(cell).filter(|c| Some(c.weight) >= settings.min_weight).map(|c| (cell, c.distance))
        })
        .collect();
    let seeds: Vec<_> = observed.iter().filter(|(_, d)| (d / R as f32).abs() <= band_cells).collect();
    for (cell, d) in &observed {
        let nearest = seeds.iter().map(|(seed, offset)| {
            let sq: f64 = (0..D).map(|k| f64::from(cell[k] - seed[k]).powi(2)).sum();
            sq + (f64::from(*offset) / R).powi(2)
        });
        let want = nearest.fold(f64::INFINITY, f64::min).sqrt() * R;
        let sign = if *d < 0.0 { -1.0 } else { 1.0 };
        // Rounding of squares up to (20 cells)^2 in f32.
        let tolerance = 1e-6 * (1.0 + want);
        match esdf.cell(*cell) {
            Answer::Known(got) => {
                assert!((f64::from(got) - sign * want).abs() <= tolerance, "{got} {want}")
            }
            Answer::Saturated(got) => {
                assert!(want >= settings.max_distance - tolerance, "{want} is saturated");
                assert_eq!(f64::from(got).signum(), sign);
                assert!((f64::from(got.abs()) - settings.max_distance).abs() < 1e-6);
            }
            other => panic!("{other:?} where {want}"),
        }
    }
    let values = esdf.keys.iter().flat_map(|&key| esdf.brick(key).unwrap());
    let known = values.filter(|v| !v.is_nan()).count();
    assert_eq!(known, observed.len());
}

proptest! {
    #[test]
    fn matches_brute_force_2d_and_3d(
        bricks in bricks(), max_distance in prop_oneof![Just(0.05), 0.2..4.0f64], band_cells in 0.1..2.0f32,
    ) {
        let settings = EsdfSettings { min_weight: Some(0.5), max_distance, ..Default::default() };
        matches_brute_force::<2>(&bricks, &settings, band_cells);
        matches_brute_force::<3>(&bricks, &settings, band_cells);
    }
}

/// A ball in a box of observed cells, dense and in bricks.
fn ball<const D: usize>(n: usize) -> (DenseTsdf<D>, Bricks<SignedDistance, D>) {
    let (grid, center) = (crate::geom::Grid::new([0.0; D], R, [n; D]), [0.5 * n as f64 * R; D]);
    let tsdf = crate::testing::tsdf(grid, 0.3, |p| vector::distance(p, center) - 0.8);
    let bricks = tsdf.store().into();
    (tsdf, bricks)
}

fn is_the_dense_field<const D: usize>() {
    let n = 35;
    let (tsdf, bricks) = ball::<D>(n);
    let dense = esdf_from_tsdf(&tsdf, 0.5, 1.5);
    let seeded =
        |max_distance| EsdfSettings { max_distance, method: EsdfMethod::TEXTBOOK, ..Default::default() };
    let (far, near) = (Esdf::of(&bricks, &seeded(10.0)), Esdf::of(&bricks, &seeded(0.6)));
    let mut saturated = 0;
    for i in 0..4000 {
        let p: [f64; D] = std::array::from_fn(|k| {
            (f64::from(i) * [0.618, 0.755, 0.569][k]).fract() * (n as f64 + 2.0) * R - R
        });
        match dense.distance_and_gradient(p) {
            Answer::Known((value, gradient)) => {
                let (got, slope) = far.distance_and_gradient(p).known().unwrap();
                assert!((got - value).abs() < 2e-6, "{got} {value}");
                // Values to 1e-6 m, a tenth of a meter apart.
                assert!(vector::distance(gradient, slope) < 1e-4);
                match near.distance(p) {
                    Answer::Known(got) => assert!((got - value).abs() < 2e-6),
                    Answer::Saturated(got) => {
                        assert!(got.abs() <= 0.6 + 1e-6 && got * value > 0.0 && value.abs() > 0.6 - 1.8 * R);
                        saturated += 1;
                    }
                    other => panic!("{other:?}"),
                }
            }
            // The dense map ends at its cells; the bricks reach on to their own end.
            _ => assert!(matches!(far.distance(p), Answer::Unknown)),
        }
    }
    assert!(saturated > 100);
    assert_eq!(far.distance([-0.5; D]), Answer::Unknown);
    assert_eq!(far.distance([-0.9; D]), Answer::Outside);
    assert_eq!(far.distance([f64::NAN; D]), Answer::Outside);
    assert_eq!(far.distance([1e12; D]), Answer::Outside);
}

#[test]
fn is_the_dense_field_2d_and_3d() {
    is_the_dense_field::<2>();
    is_the_dense_field::<3>();
}

#[test]
#[cfg(feature = "parallel")]
fn is_the_same_on_any_number_of_threads() {
    let (_, bricks) = ball::<3>(60);
    let of = |threads| with_threads(threads, || Esdf::of(&bricks, &EsdfSettings::default()));
    let (one, three) = (of(1), of(3));
    assert_eq!(one.keys, three.keys);
    let bits = |esdf: &Esdf<3>| {
        let values = esdf.keys.iter().flat_map(|&key| esdf.brick(key).unwrap());
        values.map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&one), bits(&three));
}

#[test]
fn nothing_seen_is_unknown_and_nothing_near_is_saturated() {
    let empty = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], R));
    let esdf = Esdf::of(&empty, &EsdfSettings::default());
    assert_eq!(esdf.distance([0.0; 3]), Answer::Outside);
    let free: Vec<_> = (0..512).map(|i| (i, 0.3, 1.0)).collect();
    let esdf = Esdf::of(&store::<3>(&[([0; 3], free)]), &EsdfSettings::default());
    let p = [500_000.42; 3];
    assert_eq!(esdf.distance_and_gradient(p), Answer::Saturated((1.0, [0.0; 3])));
    assert_eq!(esdf.cell([3; 3]), Answer::Saturated(1.0));
}
