//! Elements against the extracted surfaces.

use super::SurfaceElements;
use super::testing::{Noise, noise_brick};
use crate::cell::{Planes, SignedDistance};
use crate::geom::{BlockKey, Grid, Lattice, block_cells};
use crate::map::{DenseTsdf, TsdfConfig};
use crate::store::{Bricks, Store};
use crate::surface::{ContourSettings, MeshSettings, marching_cubes, marching_squares};
use crate::testing::{Random, with_threads};
use proptest::prelude::*;
use std::collections::BTreeMap;

fn random_key<const D: usize>(random: &mut Random) -> BlockKey<D> {
    BlockKey(std::array::from_fn(|_| (random.next() % 4) as i32 - 2))
}

/// Every cell with its simplices, in the order in which the extractors go: in world coordinates in cells.
fn all_simplices<const D: usize>(elements: &SurfaceElements<D>, by_brick: bool) -> Vec<[[f64; D]; D]> {
    let mut cells: Vec<[i32; D]> =
        elements.element_keys().iter().flat_map(|key| (0..block_cells::<D>()).map(|i| key.cell(i))).collect();
    if !by_brick {
        cells.sort_by_key(|cell| cell.iter().rev().copied().collect::<Vec<_>>());
    }
    let world = |cell: [i32; D], p: [f32; D]| -> [f64; D] {
        std::array::from_fn(|k| f64::from(cell[k]) + 0.5 + f64::from(p[k]))
    };
    cells.iter().flat_map(|&c| elements.cell(c).iter().map(move |s| s.map(|p| world(c, p)))).collect()
}

fn assert_equal<const D: usize>(got: &[[[f64; D]; D]], want: &[[[f64; D]; D]], tolerance: f64) {
    assert_eq!(got.len(), want.len());
    for (g, w) in got.as_flattened().as_flattened().iter().zip(want.as_flattened().as_flattened()) {
        assert!((g - w).abs() <= tolerance, "{g} {w}");
    }
}

/// Crossings are those of the extracted surface, and their heights let them answer for all simplices at them.
fn crossings_are_those_of_the_simplices<const D: usize>(elements: &SurfaceElements<D>) {
    let mut want: BTreeMap<([i32; D], usize), f64> = BTreeMap::new();
    for key in elements.element_keys() {
        for cell in (0..block_cells::<D>()).map(|i| key.cell(i)) {
            let simplices = elements.cell(cell);
            // A corner with two coordinates away from the nodes is the center of a patch.
            let on_edge = |p: &[f32; D]| p.iter().filter(|v| **v != 0.0 && **v != 1.0).count() <= 1;
            let centres = !simplices.as_flattened().iter().all(on_edge);
            for s in simplices {
                let radius_sq = if centres { 0.25 * D as f64 } else { super::cube::enclosing_radius_sq(s) };
                for p in s.iter().filter(|p| on_edge(p)) {
                    // Exactly at a node the corner does not tell which edge it is of.
                    let Some(axis) = (0..D).find(|&k| p[k] != 0.0 && p[k] != 1.0) else { continue };
                    let start = std::array::from_fn(|k| cell[k] + if k == axis { 0 } else { p[k] as i32 });
                    let most = want.entry((start, axis)).or_insert(0.0);
                    *most = most.max(radius_sq);
                }
            }
        }
    }
    let mut found = 0;
    for key in elements.keys() {
        let brick = elements.brick(key).unwrap();
        for (axis, i) in (0..D).flat_map(|a| (0..block_cells::<D>()).map(move |i| (a, i))) {
            let (height, place) = (brick.height[axis][i], brick.place[axis][i]);
            if height == f32::INFINITY {
                continue;
            }
            assert!((0.0..=0.25 * D as f32).contains(&height) && (0.0..=1.0).contains(&place));
            if place == 0.0 || place == 1.0 {
                continue;
            }
            found += 1;
            let exact = 0.25 * D as f64 - want[&(key.cell(i), axis)];
            assert!(
                f64::from(height) <= exact.max(0.0) && f64::from(height) > exact - 3e-7,
                "{height} {exact}"
            );
        }
    }
    assert_eq!(found, want.len());
}

fn contour(seed: u64, noise: Noise) {
    let mut random = Random(seed);
    let mut store = Bricks::<SignedDistance, 2>::new(Lattice::new([-16.0; 2], 1.0));
    let grid = Grid::new([-16.0; 2], 1.0, [32; 2]);
    let config = TsdfConfig { truncation: 1e3, ..TsdfConfig::textbook() };
    let mut tsdf = DenseTsdf::covering(&grid, config).unwrap();
    for key in (0..16).map(|n| BlockKey([n % 4, n / 4])) {
        let brick = noise_brick::<2>(&mut random, noise);
        for (i, cell) in (0..64).filter_map(|i| Some((i, brick.get(i)?))) {
            tsdf.fuse(key.cell(i), cell.distance.into(), 1.0);
        }
        store.insert(key, brick).unwrap();
    }
    let elements = SurfaceElements::of(&store, 0.5);
    let contour = marching_squares(&tsdf, &ContourSettings::default());
    let want: Vec<_> = contour.ends().map(|s| s.map(|p| p.map(|v| v + 16.0))).collect();
    assert!(want.len() > 100);
    // Places on edges are f32.
    assert_equal(&all_simplices(&elements, false), &want, 1e-7);
    crossings_are_those_of_the_simplices(&elements);
}

fn mesh(seed: u64, noise: Noise) {
    let mut random = Random(seed);
    let mut store = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], 1.0));
    for _ in 0..8 {
        store.insert(random_key(&mut random), noise_brick::<3>(&mut random, noise)).unwrap();
    }
    let elements = SurfaceElements::of(&store, 0.5);
    let mesh = marching_cubes(&store, None, &MeshSettings { normals: false, ..Default::default() });
    let want: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corners_world(t)).collect();
    assert!(want.len() > 1000);
    // Vertices of a mesh of 32 cells in f32.
    assert_equal(&all_simplices(&elements, true), &want, 4e-6);
    crossings_are_those_of_the_simplices(&elements);
}

fn following_equals_starting_again<const D: usize>(seed: u64, noise: Noise) {
    let mut random = Random(seed);
    let mut store = Bricks::<SignedDistance, D>::new(Lattice::new([500_000.0; D], 0.05));
    let mut elements = SurfaceElements::new(0.5);
    let mut seen = 0;
    for round in 0..6 {
        let before = elements.clone();
        for _ in 0..1 + random.next() % 4 {
            let (key, brick) = (random_key(&mut random), noise_brick::<D>(&mut random, noise));
            store.insert(key, brick).unwrap();
        }
        if round % 2 == 1 {
            // One cell alone.
            let key = store.keys()[random.next() as usize % store.len()];
            let mut brick = store.brick(key).unwrap().clone();
            let i = random.next() as usize % block_cells::<D>();
            brick.set(
                i,
                (random.next().is_multiple_of(2)).then_some(SignedDistance { distance: -0.1, weight: 1.0 }),
            );
            store.insert(key, brick).unwrap();
        }
        let touched = elements.update(&store, &store.changed_since(seen));
        seen = store.epoch();
        let again = SurfaceElements::of(&store, 0.5);
        assert_eq!((again.element_keys(), again.keys()), (elements.element_keys(), elements.keys()));
        for key in
            (0..6i32.pow(D as u32)).map(|n| BlockKey(std::array::from_fn(|k| n / 6i32.pow(k as u32) % 6 - 3)))
        {
            let [old, new, fresh] =
                [&before, &elements, &again].map(|e| (e.brick_elements(key), e.brick(key)));
            assert!(new == fresh);
            assert_eq!(touched.contains(&key), new != old, "{key:?}");
        }
        // Nothing changed: nothing is touched.
        let keys = store.keys();
        assert!(elements.update(&store, &keys).is_empty());
    }
}

fn noise() -> impl Strategy<Value = Noise> {
    let some = || prop_oneof![Just(0u64), 1..12u64];
    (some(), prop_oneof![Just(0u64), 5..40u64]).prop_map(|(holes, zeros)| Noise { holes, zeros })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn elements_are_the_contour(seed: u64, noise in noise()) {
        contour(seed, noise);
    }
    #[test]
    fn elements_are_the_mesh(seed: u64, noise in noise()) {
        mesh(seed, noise);
    }
    #[test]
    fn following_equals_starting_again_2d_and_3d(seed: u64, noise in noise()) {
        following_equals_starting_again::<2>(seed, noise);
        following_equals_starting_again::<3>(seed, noise);
    }
}

#[test]
fn light_cells_have_no_surface() {
    let mut store = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], 1.0));
    store.insert(BlockKey([0; 3]), noise_brick::<3>(&mut Random(1), Noise { holes: 0, zeros: 0 })).unwrap();
    assert!(store.cell([0; 3]).is_some());
    assert!(!SurfaceElements::of(&store, 0.0).element_keys().is_empty());
    let strict = SurfaceElements::of(&store, 1.5);
    assert!(strict.element_keys().is_empty() && strict.keys().is_empty() && strict.cell([0; 3]).is_empty());
}

#[cfg(feature = "parallel")]
#[test]
fn threads_do_not_change_a_byte() {
    let mut random = Random(9);
    let mut store = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], 1.0));
    for n in 0..64 {
        let brick = noise_brick::<3>(&mut random, Noise { holes: 2, zeros: 2 });
        store.insert(BlockKey([n % 4, n / 4 % 4, n / 16]), brick).unwrap();
    }
    let with = |threads| with_threads(threads, || SurfaceElements::of(&store, 0.5));
    let (one, three) = (with(1), with(3));
    assert_eq!(one.keys(), three.keys());
    for key in one.keys() {
        assert!(one.brick(key) == three.brick(key) && one.brick_elements(key) == three.brick_elements(key));
    }
}
