//! The accurate field against brute force, and kept up to date against made anew.

use crate::answer::Answer;
use crate::cell::{Cell, DistanceBrick, LogOdds8, Planes, SignedDistance};
use crate::field::esdf::transform::Feature;
use crate::field::{Esdf, EsdfGrid, EsdfMethod, EsdfSettings, EsdfUpdate, ObstacleCells};
use crate::geom::{BlockKey, Grid, Lattice, block_cells, vector};
use crate::map::DenseTsdf;
use crate::store::{Bricks, Store};
use proptest::prelude::*;
use std::sync::{Mutex, mpsc};

const R: f64 = 0.1;

/// What becomes of a brick: its key, what is seen in it, and a number that says how.
type Change = ([i32; 3], Seen, u32);

#[derive(Clone, Copy, Debug)]
enum Seen {
    Nothing,
    /// All free.
    Free,
    /// A plane through it or beside it.
    Plane,
    /// The plane, with cells that were not observed.
    Holes,
    /// One cell of it anew.
    Cell,
}

fn changes() -> impl Strategy<Value = Vec<Vec<Change>>> {
    let seen = prop_oneof![
        2 => Just(Seen::Nothing), 2 => Just(Seen::Free), 3 => Just(Seen::Plane), 2 => Just(Seen::Holes),
        2 => Just(Seen::Cell),
    ];
    let key = prop_oneof![9 => prop::array::uniform3(-2..3i32), 1 => Just([3_000_000, 0, -1])];
    prop::collection::vec(prop::collection::vec((key, seen, any::<u32>()), 1..8), 1..6)
}

fn apply<const D: usize>(store: &mut Bricks<SignedDistance, D>, &(key, seen, how): &Change) {
    let key = BlockKey(std::array::from_fn(|k| key[k]));
    let empty = || -> DistanceBrick { Planes::unobserved(block_cells::<D>()) };
    let mut brick = match seen {
        Seen::Cell => store.brick(key).cloned().unwrap_or_else(empty),
        _ => empty(),
    };
    let normal: [f64; 3] = std::array::from_fn(|k| f64::from(how >> (8 * k) & 255) / 128.0 - 1.0);
    let part = f64::from(how >> 24);
    for i in 0..block_cells::<D>() {
        let at = BlockKey([0; D]).cell(i);
        let along: f64 = (0..D).map(|k| normal[k] * f64::from(at[k])).sum();
        let distance = match seen {
            Seen::Nothing => f64::NAN,
            Seen::Free => 0.3,
            Seen::Plane | Seen::Cell => (R * (along - 6.0 + part / 32.0)).clamp(-0.3, 0.3),
            Seen::Holes if (i as u32).wrapping_mul(how | 1) >> 28 < 3 => f64::NAN,
            Seen::Holes => (R * (along - 2.0)).clamp(-0.3, 0.3),
        };
        if matches!(seen, Seen::Cell) && i != how as usize % block_cells::<D>() {
            continue;
        }
        let cell = SignedDistance { distance: distance as f32, weight: 1.0 };
        brick.set(i, (!distance.is_nan()).then_some(cell));
    }
    store.insert(key, brick).unwrap();
}

/// What an occupancy map says of a brick: a few cells are occupied, others are not any more.
fn say<const D: usize>(occupancy: &mut Bricks<LogOdds8, D>, &(key, _, how): &Change) {
    let key = BlockKey(std::array::from_fn(|k| key[k]));
    let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>());
    for i in (0..block_cells::<D>()).filter(|&i| (i as u32).wrapping_mul(how | 1) >> 26 == 0) {
        brick.set(i, Some(LogOdds8(if i % 5 == 0 { -20 } else { 20 })));
    }
    occupancy.insert(key, brick).unwrap();
}

/// All that a field holds of its bricks, ascending.
fn held<const D: usize>(esdf: &Esdf<D>) -> Vec<(BlockKey<D>, [Vec<u32>; 5])> {
    let bits = |plane: &[f32]| plane.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    esdf.keys()
        .into_iter()
        .map(|key| {
            let brick = &esdf.bricks[esdf.slot(key).unwrap()];
            let nearest = brick.nearest.as_deref();
            let power = nearest.map_or_else(Vec::new, |n| bits(&n.power));
            let feature = nearest.map_or_else(Vec::new, |n| n.feature.to_vec());
            let unknown = brick.unknown.as_deref().map_or_else(Vec::new, bits);
            let points = brick.points.as_deref().map_or_else(Vec::new, bits);
            (key, [bits(esdf.brick(key).unwrap()), power, feature, unknown, points])
        })
        .collect()
}

fn follows_the_map<const D: usize>(steps: &[Vec<Change>], settings: &EsdfSettings) {
    let mut store = Bricks::new(Lattice::new([500_000.0; D], R));
    let mut occupancy = Bricks::new(*store.lattice());
    let mut cells = ObstacleCells::default();
    let mut esdf = Esdf::of(&store, settings);
    let mut last = held(&Esdf::of(&store, settings));
    for step in steps {
        step.iter().for_each(|change| apply(&mut store, change));
        step.iter().filter(|c| c.2 % 3 == 0).for_each(|change| say(&mut occupancy, change));
        cells.follow_occupancy(&occupancy);
        let before = esdf.clone();
        // Measured before the map went on, or afterwards by the snapshot alone.
        let early = (step.len() % 2 == 0).then(|| held(&before));
        esdf.update_with(&store, &cells);
        let anew = Esdf::with_obstacles(&store, &ObstacleCells::of_occupancy(&occupancy), settings);
        assert!(esdf.point_obstacles().eq(anew.point_obstacles()));
        if step.len() % 3 == 0 {
            esdf.measure();
        }
        assert_eq!(held(&esdf), held(&anew));
        assert_eq!(held(&before), early.unwrap_or_else(|| last.clone()), "a snapshot changed");
        last = held(&anew);
        assert_eq!(esdf.update_with(&store, &cells), EsdfUpdate::default());
    }
}

fn settings() -> impl Strategy<Value = EsdfSettings> {
    let method = prop_oneof![
        8 => Just(EsdfMethod::Accurate), 1 => Just(EsdfMethod::Seeded { band_cells: 1.5 }),
        1 => Just(EsdfMethod::Mask),
    ];
    (0.05..1.8f64, method, any::<bool>()).prop_map(|(max_distance, method, unknown)| EsdfSettings {
        max_distance,
        method,
        unknown,
        min_weight: Some(0.5),
    })
}

proptest! {
    #[test]
    fn follows_the_map_2d_and_3d(steps in changes(), settings in settings()) {
        follows_the_map::<2>(&steps, &settings);
        follows_the_map::<3>(&steps, &settings);
    }
}

fn is_the_nearest_crossing<const D: usize>(steps: &[Vec<Change>], settings: &EsdfSettings) {
    let mut store = Bricks::new(Lattice::new([-7.0; D], R));
    steps.iter().flatten().for_each(|change| apply(&mut store, change));
    let esdf = Esdf::of(&store, settings);
    let limit = (settings.max_distance / R).powi(2) + 0.25 * D as f64;
    let crossings: Vec<([f64; D], f64)> = esdf
        .surface
        .keys()
        .into_iter()
        .flat_map(|key| {
            let brick = esdf.surface.brick(key).unwrap();
            (0..D * block_cells::<D>()).filter_map(move |n| {
                let (axis, i) = (n / block_cells::<D>(), n % block_cells::<D>());
                let (place, height) = (brick.place[axis][i], brick.height[axis][i]);
                let mut at = key.cell(i).map(f64::from);
                at[axis] += f64::from(place);
                height.is_finite().then_some((at, f64::from(height)))
            })
        })
        .collect();
    let points: Vec<[f64; D]> = esdf.point_obstacles().map(|(cell, _)| cell.map(f64::from)).collect();
    let mut observed = 0;
    for key in esdf.keys() {
        let brick = &esdf.bricks[esdf.slot(key).unwrap()];
        let nearest = brick.nearest.as_ref().unwrap();
        for i in 0..block_cells::<D>() {
            let q = key.cell(i).map(f64::from);
            let powers = crossings.iter().map(|(w, h)| vector::distance(q, *w).powi(2) + h);
            let want = powers.fold(f64::INFINITY, f64::min);
            let got = f64::from(nearest.power[i]);
            // Three roundings of squares in f32.
            let tolerance = 4e-7 * want;
            assert!((want - got).abs() <= tolerance || (got.is_infinite() && want >= limit - tolerance));
            assert_eq!(Feature(nearest.feature[i]).known().is_some(), got.is_finite());
            let cell = store.cell(key.cell(i)).filter(|c| Some(c.weight) >= settings.min_weight);
            observed += usize::from(cell.is_some());
            match (esdf.cell(key.cell(i)), cell) {
                (Answer::Unknown, None) => {}
                (Answer::Known(d), Some(cell)) => {
                    assert!(d == 0.0 || (d < 0.0) == (cell.distance < 0.0));
                    let to_point = to_points(q, &points);
                    let found = f64::from(d.abs()) / R;
                    if (found - to_point).abs() < 1e-5 {
                        // As near as the nearest point, and no surface is nearer by more than is certified.
                        assert!(to_point <= (got + 1e-5).sqrt() + 1e-5);
                        continue;
                    }
                    assert!(found < to_point);
                    // The nearest surface is no further than a crossing, and what certifies it holds.
                    // Distances are f32: held against the bound as f32 has it.
                    assert!(d.abs() <= ((got + 1e-5).sqrt() * R) as f32);
                    let d = f64::from(d.abs()) / R;
                    assert!(d * d >= got - 0.25 * D as f64 - 1e-5 * (1.0 + got));
                }
                (Answer::Saturated(d), Some(_)) => {
                    assert!(to_points(q, &points) * R >= settings.max_distance - 1e-6);
                    assert!((f64::from(d.abs()) - settings.max_distance).abs() < 1e-6);
                    assert!(want.sqrt() * R >= settings.max_distance - 1e-6);
                }
                other => panic!("{other:?}"),
            }
        }
    }
    let weights = store.bricks_by_age().flat_map(|(_, brick)| brick.weights());
    assert_eq!(observed, weights.filter(|w| **w >= 0.5).count());
}

/// Distance (cells) to the nearest of some points.
fn to_points<const D: usize>(q: [f64; D], points: &[[f64; D]]) -> f64 {
    points.iter().map(|p| vector::distance(q, *p)).fold(f64::INFINITY, f64::min)
}

proptest! {
    #[test]
    fn is_the_nearest_crossing_2d_and_3d(
        steps in changes(), far in 0.05..1.8f64, max_distance in 0.05..1.0f64,
    ) {
        is_the_nearest_crossing::<2>(&steps, &EsdfSettings { max_distance: far, ..Default::default() });
        is_the_nearest_crossing::<3>(&steps, &EsdfSettings { max_distance, ..Default::default() });
    }
}

#[test]
fn is_the_nearest_crossing_of_two_bricks_that_meet_at_a_corner() {
    let steps = [vec![([0, 0, 0], Seen::Plane, 3_223_972_374), ([1, 1, 0], Seen::Free, 0)]];
    let settings = EsdfSettings { max_distance: 1.5083469574675716, ..Default::default() };
    is_the_nearest_crossing::<2>(&steps, &settings);
    is_the_nearest_crossing::<3>(&steps, &settings);
}

fn is_the_nearest_unknown_box<const D: usize>(steps: &[Vec<Change>], settings: &EsdfSettings) {
    let mut store = Bricks::new(Lattice::new([3.0; D], R));
    steps.iter().flatten().for_each(|change| apply(&mut store, change));
    let esdf = Esdf::of(&store, &EsdfSettings { unknown: true, ..*settings });
    let reach = (settings.max_distance / R) as f32;
    let far = reach as i32 + 2;
    for key in esdf.keys() {
        let plane = esdf.bricks[esdf.slot(key).unwrap()].unknown.as_deref().unwrap();
        // Too many for all of them.
        for i in
            (key.0[0].unsigned_abs() as usize % 7..block_cells::<D>()).step_by(if D == 2 { 3 } else { 61 })
        {
            let cell = key.cell(i);
            let mut want = f32::INFINITY;
            let edge = 2 * far + 1;
            for n in 0..edge.pow(D as u32) {
                let step: [i32; D] = std::array::from_fn(|k| n / edge.pow(k as u32) % edge - far);
                let cost: f32 = step.map(|k| (k.abs() as f32 - 0.5).max(0.0).powi(2)).iter().sum();
                let there = store.cell(std::array::from_fn(|k| cell[k] + step[k]));
                if cost < want && there.is_none_or(|c| Some(c.weight) < settings.min_weight) {
                    want = cost;
                }
            }
            let want = if want <= reach * reach { want } else { f32::INFINITY };
            assert_eq!(plane[i], want, "{cell:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn is_the_nearest_unknown_box_2d_and_3d(steps in changes(), settings in settings()) {
        is_the_nearest_unknown_box::<2>(&steps, &settings);
        let max_distance = settings.max_distance.min(0.9);
        is_the_nearest_unknown_box::<3>(&steps, &EsdfSettings { max_distance, ..settings });
    }
}

/// A ball of 0.8 m in an array that is no multiple of a brick, with a corner that was not observed.
fn ball<const D: usize>() -> DenseTsdf<D> {
    let distance = |p| vector::distance(p, [1.8; D]) - 0.8;
    crate::testing::tsdf(Grid::new([0.0; D], R, [37; D]), 0.3, |p| {
        if p.iter().any(|v| *v > 5.0 * R) { distance(p) } else { f64::NAN }
    })
}

fn a_dense_map_is_its_bricks<const D: usize>() {
    let tsdf = ball::<D>();
    let grid: Grid<D> = *tsdf.grid();
    let field = |method| Esdf::of(&tsdf, &EsdfSettings { max_distance: 5.0, method, ..Default::default() });
    let (accurate, mask) = (field(EsdfMethod::Accurate), field(EsdfMethod::Mask));
    let occupied = |i: usize| tsdf.store().at(i).map(|c| c.distance < 0.0);
    let dense = EsdfGrid::from_mask(grid, occupied);
    for i in 0..grid.len() {
        let cell = grid.cell(i);
        let truth = (vector::distance(grid.lattice.center(cell), [1.8; D]) - 0.8) as f32;
        match (accurate.cell(cell), mask.cell(cell)) {
            (Answer::Known(d), Answer::Known(m)) => {
                // Chords of cells of 0.1 m lie at most r^2 D / 8 R inside of the ball.
                assert!((d - truth).abs() < 0.01, "{d} {truth}");
                assert!((m - dense.samples()[i]).abs() < 1e-6);
            }
            (Answer::Unknown, Answer::Unknown) => assert!(occupied(i).is_none()),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_dense_map_is_its_bricks_2d_and_3d() {
    a_dense_map_is_its_bricks::<2>();
    a_dense_map_is_its_bricks::<3>();
}

/// Readers hold snapshots while the map goes on: each is one state of the map, whole, until it is dropped.
#[test]
fn readers_keep_their_snapshot() {
    let settings = EsdfSettings { max_distance: 0.8, ..Default::default() };
    let mut store = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], R));
    let states = 30u32;
    // Floors at a height that tells the state from all others; crossings keep a little away from the nodes.
    let height = |state: u32| 0.31 + 0.01 * f64::from(state);
    let set = |store: &mut Bricks<SignedDistance, 3>, state: u32| {
        for n in 0..3 * 3 * 2 {
            let key = BlockKey([n % 3, n / 3 % 3, n / 9]);
            let of = |i| (f64::from(key.cell(i)[2]) * R - height(state)).clamp(-0.3, 0.3) as f32;
            store.insert(key, crate::testing::brick::<3>(|i| Some((of(i), 1.0)))).unwrap();
        }
    };
    set(&mut store, 0);
    let mut esdf = Esdf::of(&store, &settings);
    let current = Mutex::new((0, esdf.clone()));
    let (done, seen) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..3 {
            let (done, current) = (done.clone(), &current);
            scope.spawn(move || {
                let mut states_seen = 0;
                let mut last = None;
                loop {
                    let (state, snapshot) = current.lock().unwrap().clone();
                    for _ in 0..2 {
                        for key in snapshot.keys() {
                            for i in (0..512).step_by(37) {
                                let cell = key.cell(i);
                                let want = f64::from(cell[2]) * R - height(state);
                                let got = snapshot.cell(cell).known().map(f64::from);
                                let right = got.map_or(want.abs() > 0.799, |d| (d - want).abs() < 5e-4);
                                assert!(right, "{got:?} {want} in state {state}");
                            }
                        }
                    }
                    states_seen += u32::from(last != Some(state));
                    last = Some(state);
                    if state == states - 1 {
                        break done.send(states_seen).unwrap();
                    }
                }
            });
        }
        for state in 1..states {
            set(&mut store, state);
            esdf.update(&store);
            *current.lock().unwrap() = (state, esdf.clone());
        }
        drop(done);
        assert_eq!(seen.iter().filter(|n| *n > 0).count(), 3);
    });
}
