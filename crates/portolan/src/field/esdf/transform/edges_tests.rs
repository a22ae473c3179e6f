use super::*;

use crate::field::esdf::transform::{Feature, Witness, bounds};
use crate::geom::block_cells;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Crossings by brick.
#[derive(Clone, Debug, Default)]
struct Map<const D: usize>(BTreeMap<[i32; 3], BrickCrossings<D>>);

/// Axis, lower node of the edge, place on it, height.
type Crossing = (usize, [i32; 3], f32, f32);

impl<const D: usize> Map<D> {
    /// The last of several on one edge counts.
    fn of(crossings: &[Crossing]) -> Self {
        let mut map = Self::default();
        for &(axis, cell, place, height) in crossings {
            let cell: [i32; D] = std::array::from_fn(|k| cell[k]);
            let (key, i) = (BlockKey::of_cell(cell), BlockKey::offset(cell));
            let plane = |v| std::array::from_fn(|_| vec![v; block_cells::<D>()].into());
            let order = std::array::from_fn(|k| if k < D { key.0[D - 1 - k] } else { 0 });
            let empty = || BrickCrossings { place: plane(f32::NAN), height: plane(f32::INFINITY) };
            let brick = map.0.entry(order).or_insert_with(empty);
            brick.place[axis % D][i] = place;
            brick.height[axis % D][i] = height;
        }
        map
    }

    fn key(order: &[i32; 3]) -> BlockKey<D> {
        BlockKey(std::array::from_fn(|k| order[D - 1 - k]))
    }

    fn crossings(&self) -> Vec<(usize, [i32; D], f32, f32)> {
        let bricks = self.0.iter().flat_map(|(key, brick)| {
            (0..D).flat_map(move |axis| {
                (0..block_cells::<D>())
                    .map(move |i| (axis, Self::key(key).cell(i), brick.place[axis][i], brick.height[axis][i]))
            })
        });
        bricks.filter(|c| c.3 < f32::INFINITY).collect()
    }
}

impl<const D: usize> Map<D> {
    fn keys(&self) -> Vec<BlockKey<D>> {
        self.0.keys().map(Self::key).collect()
    }

    fn brick(&self, key: BlockKey<D>) -> Option<&BrickCrossings<D>> {
        self.0.get(&std::array::from_fn(|k| if k < D { key.0[D - 1 - k] } else { 0 }))
    }
}

fn edges<const D: usize>(map: &Map<D>) -> Vec<Edges<'_, D>> {
    let edges = map.keys().into_iter();
    edges.filter_map(|key| map.brick(key).map(|source| Input { key, source })).collect()
}

/// Value and feature of the cells of bricks; what is beyond the limit is `None`.
type Found<const D: usize> = BTreeMap<Vec<i32>, Option<(u32, u32)>>;

/// `bounded`: bricks look no further than their bounds say.
fn solve<const D: usize>(map: &Map<D>, keys: &[BlockKey<D>], limit: f32, bounded: bool) -> Found<D> {
    let edges = edges(map);
    let witnesses =
        keys.iter().map(|&key| map.brick(key).and_then(|b| Witness::of_crossings(key, b))).collect();
    let budgets = if bounded { bounds(keys, witnesses, limit) } else { vec![limit; keys.len()] };
    let outputs = keys.iter().zip(budgets).map(|(&key, budget)| Output { key, budget }).collect();
    let mut found = Found::<D>::new();
    for (key, (values, features)) in edge_distances(&edges, outputs, |_, v, w| (v.to_vec(), w.to_vec())) {
        for i in 0..block_cells::<D>() {
            let inside = (values[i] <= limit).then_some((values[i].to_bits(), features[i]));
            found.insert(key.cell(i).to_vec(), inside);
        }
    }
    found
}

/// Squared distance as the passes sum it up: the first with the root, the others in their order.
fn power<const D: usize>(q: [i32; D], (axis, cell, place, height): (usize, [i32; D], f32, f32)) -> f32 {
    let d = (cell[axis] - q[axis]) as f32 + place;
    let mut sum = d * d + height;
    // Whole squares are exact, their sum with the root is rounded once per pass: of z-edges along y first.
    let order = if axis == 2 { [1, 0, 2] } else { [0, 1, 2] };
    for k in order.into_iter().filter(|&k| k < D && k != axis) {
        let d = (cell[k] - q[k]) as f32;
        sum += d * d;
    }
    sum
}

fn matches_brute_force<const D: usize>(crossings: &[Crossing], bricks: &[[i32; 3]], limit: f32) {
    let map = Map::<D>::of(crossings);
    let keys = keys(bricks);
    let found = solve(&map, &keys, limit, false);
    assert_eq!(found.len(), keys.len() * block_cells::<D>());
    let all = map.crossings();
    for (cell, got) in &found {
        let q: [i32; D] = std::array::from_fn(|k| cell[k]);
        let want = all.iter().map(|&c| power(q, c)).fold(f32::INFINITY, f32::min);
        let Some((bits, feature)) = got else {
            assert!(want > limit, "{want} was not found");
            continue;
        };
        assert_eq!(f32::from_bits(*bits), want, "at {q:?}");
        let feature = Feature(*feature);
        let offset = feature.offset::<D>();
        let edge: [i32; D] = std::array::from_fn(|k| q[k] + offset[k]);
        let brick = map.brick(BlockKey::of_cell(edge)).expect("the brick of a crossing");
        let i = BlockKey::offset(edge);
        let of_edge = (feature.axis(), edge, brick.place[feature.axis()][i], brick.height[feature.axis()][i]);
        assert_eq!(power(q, of_edge), want, "{of_edge:?} seen from {q:?}");
    }
    // As far as bricks need to look, and brick by brick: the same bits.
    assert_eq!(solve(&map, &keys, limit, true), found);
    for some in [&keys[..1], &keys[keys.len() / 2..]] {
        let part = solve(&map, some, limit, false);
        assert!(part.iter().all(|(cell, got)| found[cell] == *got), "a part differs");
    }
    // A larger limit changes nothing inside of the smaller one.
    let far = solve(&map, &keys, 4.0 * limit, true);
    for (cell, got) in &found {
        let inside = far[cell].filter(|(bits, _)| f32::from_bits(*bits) <= limit);
        assert_eq!(inside, *got, "at {cell:?}");
    }
}

/// Sorted, each once.
fn keys<const D: usize>(bricks: &[[i32; 3]]) -> Vec<BlockKey<D>> {
    let mut keys: Vec<BlockKey<D>> = bricks.iter().map(|b| BlockKey(std::array::from_fn(|k| b[k]))).collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

/// The bricks of a box.
fn block(n: i32) -> Vec<[i32; 3]> {
    (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)]).collect()
}

fn crossings() -> impl Strategy<Value = Vec<Crossing>> {
    let at = prop_oneof![3 => -12..28i32, 1 => Just(8), 1 => Just(-1)];
    let place = prop_oneof![3 => 0.0..=1.0f32, 1 => Just(0.0), 1 => Just(1.0), 1 => Just(0.5)];
    let height = prop_oneof![2 => 0.0..=0.75f32, 2 => Just(0.0), 1 => Just(0.75)];
    prop::collection::vec((0..3usize, prop::array::uniform3(at), place, height), 0..60)
}

fn some_bricks() -> impl Strategy<Value = Vec<[i32; 3]>> {
    let far = Just([40_000_000, -3, 7]);
    prop::collection::vec(prop_oneof![9 => prop::array::uniform3(-2..4i32), 1 => far], 1..9)
}

proptest! {
    #[test]
    fn matches_brute_force_2d_and_3d(
        c in crossings(), b in some_bricks(), limit in prop_oneof![0.5f32..30.0, 30.0..2000.0f32],
    ) {
        matches_brute_force::<2>(&c, &b, limit);
        matches_brute_force::<3>(&c, &b, limit);
    }
}

/// Two crossings, one plane of them per axis, a checkerboard of signs: an edge between all neighbours has one.
fn scenes() -> Vec<Vec<Crossing>> {
    let floor = |axis: usize, place: f32| {
        let on = move |i: i32| {
            let (a, b) = (i % 24, i / 24);
            let cell = [[9, a, b], [a, 9, b], [a, b, 9]][axis];
            (axis, cell, place, 0.25)
        };
        (0..24 * 24).map(on).collect::<Vec<_>>()
    };
    let board = (0..3 * 16 * 16 * 16).map(|i| {
        let cell = i / 3;
        ((i % 3) as usize, [cell % 16, cell / 16 % 16, cell / 256], 0.5, 0.0)
    });
    vec![
        vec![],
        vec![(0, [8, 8, 8], 0.0, 0.0)],
        vec![(2, [-1, 7, -1], 1.0, 0.75)],
        // Ends of two edges in the same place.
        vec![(0, [4, 5, 6], 1.0, 0.1), (1, [5, 5, 6], 0.0, 0.1), (2, [5, 5, 5], 1.0, 0.1)],
        floor(0, 0.25),
        floor(1, 0.0),
        floor(2, 1.0),
        board.collect(),
    ]
}

#[test]
fn plain_scenes_match_brute_force() {
    for scene in scenes() {
        for limit in [3.0, 400.75] {
            matches_brute_force::<2>(&scene, &block(2), limit);
            // Without some bricks of the block.
            let holes: Vec<_> = block(3).into_iter().filter(|b| (b[0] + b[1] * b[2]) % 3 != 1).collect();
            matches_brute_force::<3>(&scene, &holes[..7], limit);
        }
    }
}

/// One axis taken for another: the same values, up to the order in which three squares are summed up.
#[test]
fn axes_are_alike() {
    let mut random = 7u64;
    let mut next = |n: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % n
    };
    let scene: Vec<Crossing> = (0..200)
        .map(|_| {
            let cell = [next(30) as i32 - 3, next(30) as i32 - 3, next(30) as i32 - 3];
            (next(3) as usize, cell, next(257) as f32 / 256.0, next(193) as f32 / 256.0)
        })
        .collect();
    let turned: Vec<Crossing> =
        scene.iter().map(|&(axis, [x, y, z], u, h)| ((axis + 1) % 3, [z, x, y], u, h)).collect();
    let (a, b) = (Map::<3>::of(&scene), Map::<3>::of(&turned));
    let keys = keys::<3>(&block(3));
    let (a, b) = (solve(&a, &keys, 2000.0, true), solve(&b, &keys, 2000.0, true));
    for (cell, got) in &a {
        let same = b[&vec![cell[2], cell[0], cell[1]]];
        // Places and heights in parts of 256 make sums below 2^8 exact.
        let value = |v: Option<(u32, u32)>| v.map(|(bits, _)| f32::from_bits(bits));
        match (value(*got), value(same)) {
            (Some(v), Some(w)) => assert!((v - w).abs() <= 2e-7 * v, "{v} {w}"),
            (v, w) => assert_eq!(v, w),
        }
    }
}

/// Every axis by itself through all passes, then the least: the scheme that saves a pass gives the same bits.
fn is_the_least_of_the_axes<const D: usize>(crossings: &[Crossing]) {
    let keys = keys::<D>(&block(2));
    let value = |v: &Option<(u32, u32)>| v.map_or(f32::INFINITY, |(bits, _)| f32::from_bits(bits));
    let merged = solve(&Map::<D>::of(crossings), &keys, 900.0, true);
    let alone: Vec<Found<D>> = (0..D)
        .map(|axis| {
            let own: Vec<_> =
                Map::<D>::of(crossings).crossings().into_iter().filter(|c| c.0 == axis).collect();
            let own: Vec<Crossing> = own
                .into_iter()
                .map(|(a, cell, u, h)| (a, std::array::from_fn(|k| if k < D { cell[k] } else { 0 }), u, h))
                .collect();
            solve(&Map::<D>::of(&own), &keys, 900.0, false)
        })
        .collect();
    for (cell, got) in &merged {
        let least = alone.iter().map(|f| value(&f[cell])).fold(f32::INFINITY, f32::min);
        assert_eq!(value(got), least);
    }
}

proptest! {
    #[test]
    fn is_the_least_of_the_axes_2d_and_3d(crossings in crossings()) {
        is_the_least_of_the_axes::<2>(&crossings);
        is_the_least_of_the_axes::<3>(&crossings);
    }
}
