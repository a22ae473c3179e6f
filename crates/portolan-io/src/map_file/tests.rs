//! One body for 2-D and 3-D files.

use portolan::cell::{
    AttenuationRule, Cell, ColorBrick, DistanceBrick, DistancePlanes, HitLengthBrick, HitLengthPlanes,
    LogOdds8, OccupancyModel, Planes, SignedDistance,
};
use portolan::geom::{BlockKey, Grid, Lattice, Pose, block_cells};
use portolan::map::{DenseTsdf, OccupancyGrid, OccupancyTree, TsdfConfig};
use portolan::store::{Bricks, Dense, Store, Tree};
use portolan::sweep::WeightModel;
use serde_json::{Map, Value, json};

use super::*;
use crate::testing::{Random, bad_bytes};
use crate::{Chunk, Container, Result};

/// Runs a test in both dimensions.
macro_rules! in_2d_and_3d {
    ($($test:ident)*) => {
        mod in_2d { $(#[test] fn $test() { super::$test::<2>(); })* }
        mod in_3d { $(#[test] fn $test() { super::$test::<3>(); })* }
    };
}

in_2d_and_3d! {
    saved_again_the_bytes_are_the_same
    the_order_in_which_bricks_came_to_be_does_not_show
    a_map_without_bricks_is_a_map
    infinite_weights_survive
    the_dimension_is_checked
    the_claims_of_the_header_are_checked
    the_content_of_chunks_is_checked
    a_file_without_hits_per_meter_still_reads
    parts_hold_the_same_whole_bricks
    memory_is_limited
    no_bytes_make_it_panic
}

/// Keys around zero and a far one, in an order that depends on the seed.
fn keys<const D: usize>(seed: u64) -> Vec<BlockKey<D>> {
    let near = |i: i32| BlockKey(std::array::from_fn(|k| i / 3i32.pow(k as u32) % 3 - 1));
    let mut keys: Vec<_> = (0..3i32.pow(D as u32)).map(near).collect();
    keys.push(BlockKey(std::array::from_fn(|k| [12_345, -(1 << 27), (1 << 27) - 1][k])));
    let mut random = Random(seed);
    for i in (1..keys.len()).rev() {
        keys.swap(i, random.below(i + 1));
    }
    keys
}

fn store<C: Cell, const D: usize>(seed: u64, brick: impl Fn(&mut Random) -> C::Brick) -> Bricks<C, D> {
    let origin = std::array::from_fn(|k| [500_000.0, 4_000_000.0, -3.5][k]);
    let mut store = Bricks::new(Lattice::new(origin, 0.05));
    for key in keys(seed) {
        // A brick's content depends on its key alone.
        let hash = |h: u64, v: &i32| h.wrapping_mul(1_000_003) + u64::from(*v as u32);
        store.insert(key, brick(&mut Random(key.0.iter().fold(7, hash)))).unwrap();
    }
    store
}

/// Distances and weights of `n` cells, with numbers that only a copy bit by bit keeps.
fn distances(random: &mut Random, n: usize) -> (Vec<f32>, Vec<f32>) {
    let mut distance: Vec<f32> = (0..n).map(|_| random.unit() as f32 - 0.5).collect();
    let mut weight: Vec<f32> = (0..n).map(|_| (8.0 * random.unit() - 1.0).max(0.0) as f32).collect();
    (distance[5], weight[6], weight[7]) = (-0.0, f32::INFINITY, f32::MIN_POSITIVE / 8.0);
    (distance, weight)
}

fn cell(random: &mut Random) -> Option<LogOdds8> {
    (random.below(3) > 0).then(|| LogOdds8(random.below(201) as i8))
}

fn bricks<const D: usize>(seed: u64) -> (OccupancyBricks<D>, TsdfBricks<D>, ColorBricks<D>) {
    let n = block_cells::<D>();
    let occupancy = store(seed, |random| {
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(n);
        (0..n).for_each(|i| brick.set(i, cell(random)));
        brick
    });
    let tsdf = store(seed, |random| {
        let (distance, weight) = distances(random, n);
        DistanceBrick::from_parts(&distance, &weight).unwrap()
    });
    let colors = store(seed, |random| {
        let words: Vec<_> = (0..n).map(|_| [(); 4].map(|()| random.next() as u16)).collect();
        ColorBrick::from_words(&words)
    });
    let model = OccupancyModel { p_hit: 0.8, ..Default::default() };
    let tsdf = TsdfBricks {
        store: tsdf,
        truncation: 0.15,
        w_max: f32::INFINITY,
        carve_weight: 0.1,
        weights: WeightModel::InverseSquareCosIncidence,
        more: [("drop_off".to_owned(), json!("linear"))].into_iter().collect(),
    };
    let occupancy = OccupancyBricks { store: occupancy, model, more: Map::new() };
    (occupancy, tsdf, ColorBricks { store: colors, w_max: 64.0, more: Map::new() })
}

/// Every kind of map, unknown ones too.
fn attenuation<const D: usize>(seed: u64) -> AttenuationBricks<D> {
    let n = block_cells::<D>();
    let store = store(seed, |random| {
        let looks: Vec<u16> = (0..n).map(|_| (random.below(4) * 1000) as u16).collect();
        let mut any = |most: usize| -> Vec<u32> {
            looks.iter().map(|l| if *l > 0 { random.below(most) as u32 } else { 0 }).collect()
        };
        let (hits, length) = (any(7), any(u32::MAX as usize));
        HitLengthBrick::of(HitLengthPlanes::from_parts(hits, length, looks).unwrap())
    });
    AttenuationBricks { store, rule: AttenuationRule { half_life: Some(44) }, more: Map::new() }
}

fn full<const D: usize>(seed: u64) -> MapFile<D> {
    let grid =
        Grid::new(std::array::from_fn(|k| [-2.0, -1.5, 0.25][k]), 0.1, std::array::from_fn(|k| 13 - k));
    let mut random = Random(5);
    let mut dense = Dense::<LogOdds8, D>::new(grid);
    (0..grid.len()).for_each(|i| dense.planes_mut().set(i, cell(&mut random)));
    let (distance, weight) = distances(&mut random, grid.len());
    let planes = DistancePlanes::from_parts(distance, weight).unwrap();
    let mut near = Bricks::<LogOdds8, D>::new(Lattice::new([0.5; D], 0.1));
    for i in 0..3 {
        let mut brick = <LogOdds8 as Cell>::Brick::unobserved(block_cells::<D>());
        (0..block_cells::<D>()).for_each(|i| brick.set(i, cell(&mut random)));
        near.insert(BlockKey([i; D]), brick).unwrap();
    }
    let model = OccupancyModel::default();
    let config = TsdfConfig { truncation: 0.3, weights: WeightModel::CosIncidence, ..TsdfConfig::textbook() };
    let (occupancy, tsdf, colors) = bricks(seed);
    MapFile {
        header: MapHeader {
            logs: vec!["a.log".into()],
            scans: 3,
            hold_out: Some(10),
            more: [("studio".to_owned(), json!({"color": 0.1}))].into_iter().collect(),
            ..Default::default()
        },
        grid: Some(OccupancyGrid::from_store(dense, model).unwrap()),
        tree: Some(OccupancyTree::from_store(Tree::from_bricks(&near).unwrap(), model).unwrap()),
        tsdf: Some(DenseTsdf::from_stores(Dense::from_planes(grid, planes).unwrap(), None, config).unwrap()),
        occupancy_bricks: Some(occupancy),
        tsdf_bricks: Some(tsdf),
        color_bricks: Some(colors),
        attenuation: Some(attenuation(seed)),
        ledger: None,
        poses: vec![
            Pose::IDENTITY,
            Pose { translation: std::array::from_fn(|k| [1e6, -2.5, 0.125][k]), ..Pose::IDENTITY },
        ],
        unknown_maps: vec![json!({"kind": "wavelets", "cell": "i16", "chunk": "WAVE"})],
        unknown_chunks: vec![UnknownChunk { tag: "WAVE".into(), name: "x".into(), content: vec![1, 2, 3] }],
    }
}

fn parse<const D: usize>(bytes: Vec<u8>) -> Result<MapFile<D>> {
    MapFile::parse(bytes, "m".as_ref())
}

fn same_bricks<C: Cell, const D: usize>(a: &Bricks<C, D>, b: &Bricks<C, D>) -> bool
where
    C::Brick: PartialEq,
{
    a.lattice() == b.lattice() && a.keys() == b.keys() && a.keys().iter().all(|&k| a.brick(k) == b.brick(k))
}

fn saved_again_the_bytes_are_the_same<const D: usize>() {
    let file = full::<D>(1);
    let bytes = file.to_bytes().unwrap();
    let folder = tempfile::tempdir().unwrap();
    file.write(folder.path().join("m")).unwrap();
    assert!(std::fs::read(folder.path().join("m")).unwrap() == bytes);
    let back = MapFile::<D>::read(folder.path().join("m")).unwrap();
    // Equality of f32 does not distinguish -0 from 0: the bytes do.
    assert!(back.to_bytes().unwrap() == bytes);
    assert_eq!((&back.header, &back.poses), (&file.header, &file.poses));
    assert_eq!((&back.unknown_maps, &back.unknown_chunks), (&file.unknown_maps, &file.unknown_chunks));

    let (a, b) = (file.tsdf.unwrap(), back.tsdf.unwrap());
    assert_eq!((a.store(), a.config()), (b.store(), b.config()));
    let (a, b) = (file.grid.unwrap(), back.grid.unwrap());
    assert_eq!((a.store(), a.model()), (b.store(), b.model()));
    let (a, b) = (file.tree.unwrap(), back.tree.unwrap());
    assert_eq!((a.store().records(), a.model()), (b.store().records(), b.model()));

    let (a, b) = (file.occupancy_bricks.unwrap(), back.occupancy_bricks.unwrap());
    assert!(same_bricks(&a.store, &b.store) && a.model == b.model);
    let (a, b) = (file.color_bricks.unwrap(), back.color_bricks.unwrap());
    assert!(same_bricks(&a.store, &b.store) && b.w_max == 64.0);
    let (a, b) = (file.attenuation.unwrap(), back.attenuation.unwrap());
    assert!(same_bricks(&a.store, &b.store) && a.rule == b.rule);
    let (a, b) = (file.tsdf_bricks.unwrap(), back.tsdf_bricks.unwrap());
    assert!(same_bricks(&a.store, &b.store));
    assert_eq!(
        (a.truncation, a.w_max, a.carve_weight, a.weights, &a.more),
        (b.truncation, b.w_max, b.carve_weight, b.weights, &b.more)
    );

    let empty = MapFile::<D>::default().to_bytes().unwrap();
    assert_eq!(parse::<D>(empty.clone()).unwrap().to_bytes().unwrap(), empty);
}

fn the_order_in_which_bricks_came_to_be_does_not_show<const D: usize>() {
    assert_ne!(keys::<D>(1), keys(2));
    assert!(full::<D>(2).to_bytes().unwrap() == full::<D>(1).to_bytes().unwrap());
}

fn a_map_without_bricks_is_a_map<const D: usize>() {
    let mut file = full::<D>(1);
    file.tsdf_bricks.as_mut().unwrap().store = Bricks::<SignedDistance, D>::new(Lattice::new([0.0; D], 0.1));
    let store = parse::<D>(file.to_bytes().unwrap()).unwrap().tsdf_bricks.unwrap().store;
    assert!(store.is_empty() && store.lattice().resolution == 0.1);
}

fn infinite_weights_survive<const D: usize>() {
    let config = TsdfConfig { w_max: f32::INFINITY, ..TsdfConfig::textbook() };
    let file = MapFile {
        tsdf: Some(DenseTsdf::covering(&Grid::new([0.0; D], config.resolution, [4; D]), config).unwrap()),
        ..Default::default()
    };
    let back = parse::<D>(file.to_bytes().unwrap()).unwrap();
    assert_eq!(back.tsdf.unwrap().config(), &config);
}

fn the_dimension_is_checked<const D: usize>() {
    let bytes = full::<D>(1).to_bytes().unwrap();
    let container = Container::from_reader(&*bytes, "m".as_ref()).unwrap();
    assert_eq!(map_dimension(&container).unwrap(), D);
    let error = match D {
        2 => parse::<3>(bytes).err().unwrap(),
        _ => parse::<2>(bytes).err().unwrap(),
    };
    let expected = format!("m: byte 32: the dimension is {D}; give a {}-D map", 5 - D);
    assert_eq!(error.to_string(), expected);
}

/// `read`, or the error of reading the file with another content of one chunk.
fn with_chunk<const D: usize>(tag: &str, name: &str, content: &[u8]) -> String {
    let container = Container::parse(full::<D>(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
    let mut writer = container.writer(|c| c.tag != tag || c.name != name).unwrap();
    writer.chunk(tag, name, content).unwrap();
    parse::<D>(writer.to_bytes()).map_or_else(|e| e.to_string(), |_| "read".into())
}

/// `read`, or the error of reading the file with another header.
fn with_header<const D: usize>(edit: impl FnOnce(&mut Value)) -> String {
    let container = Container::parse(full::<D>(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
    let mut header: Value = serde_json::from_slice(&container.get("HEAD", "").unwrap().unwrap()).unwrap();
    edit(&mut header);
    with_chunk::<D>("HEAD", "", header.to_string().as_bytes())
}

fn the_claims_of_the_header_are_checked<const D: usize>() {
    assert_eq!(with_header::<D>(|_| {}), "read");
    let tree = if D == 2 { "quadtree" } else { "octree" };
    let impossible = |map: &str, part: &str| format!("map {map} is not possible ({part}");
    for (part, pointer, value) in [
        ("the shape is [1152921504606846976, 12".into(), "/maps/0/shape/0", json!(1u64 << 60)),
        ("the shape is [0, 12".into(), "/maps/2/shape/0", json!(0)),
        ("the shape is [13]".into(), "/maps/2/shape", json!([13])),
        ("the length of chunk \"GRID\" occupancy is ".into(), "/maps/0/shape/0", json!(58)),
        ("the length of chunk \"HOLE\" occupancy is 0".into(), "/maps/0/chunk", json!("HOLE")),
        (impossible(tree, "tree depth 60"), "/maps/1/depth", json!(60)),
        (impossible(tree, ""), "/maps/1/depth", json!(3)),
        (impossible("tsdf", "truncation"), "/maps/2/truncation", json!(-1)),
        (impossible("tsdf", "resolution is 0: give metres"), "/maps/2/resolution", json!(0)),
        ("the sweep of map tsdf is \"zigzag\"".into(), "/maps/2/sweep", json!("zigzag")),
        ("the sweep of map tsdf is missing".into(), "/maps/2/sweep", json!(null)),
        (impossible("occupancy-grid", ""), "/maps/0/model/p_hit", json!(2)),
        (impossible("occupancy-bricks", "resolution is -1"), "/maps/3/resolution", json!(-1)),
        ("the origin is [1e300".into(), "/maps/4/origin/0", json!(1e300)),
        ("the origin is [1.0]".into(), "/maps/4/origin", json!([1.0])),
        (impossible("occupancy-bricks", ""), "/maps/3/model/p_hit", json!(2)),
        (impossible("tsdf-bricks", "truncation"), "/maps/4/truncation", json!(0)),
        (impossible("tsdf-bricks", "carve_weight"), "/maps/4/carve_weight", json!(-1)),
        (impossible("color-bricks", "w_max"), "/maps/5/w_max", json!(0)),
        (impossible("attenuation-bricks", "half_life"), "/maps/6/half_life", json!(0)),
        ("the length_units of map attenuation-bricks is 9; this".into(), "/maps/6/length_units", json!(9)),
        ("the length of chunk \"TBRICKS\" hits is 0".into(), "/maps/6/chunk", json!("TBRICKS")),
        ("the weight model of map tsdf-bricks is \"heavy\"".into(), "/maps/4/weights", json!("heavy")),
        ("the length of chunk \"CBRICKS\" distance is 0".into(), "/maps/4/chunk", json!("CBRICKS")),
        ("the length of chunk \"OBRICKS\" color is 0".into(), "/maps/5/chunk", json!("OBRICKS")),
        ("the length of chunk \"HOLE\" keys is missing".into(), "/maps/3/chunk", json!("HOLE")),
        ("the dimension is 4; it must be 2 or 3".into(), "/dimension", json!(4)),
        ("the version of the header is 2".into(), "/version", json!(2)),
        ("the list of maps is missing".into(), "/maps", json!(7)),
        ("the header is".into(), "/logs", json!(7)),
    ] {
        let error = with_header::<D>(|header| *header.pointer_mut(pointer).unwrap() = value);
        assert!(error.contains(&part) && !error.contains('\n'), "{part}: {error}");
    }
    for (i, other) in [(1, 0), (4, 3)] {
        let error = with_header::<D>(|header| header["maps"][i] = header["maps"][other].clone());
        assert!(error.contains("there twice"), "{error}");
    }
}

fn the_content_of_chunks_is_checked<const D: usize>() {
    let container = Container::parse(full::<D>(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
    let keys = container.get("TBRICKS", "keys").unwrap().unwrap();
    let key = 4 * D;
    assert_eq!(with_chunk::<D>("TBRICKS", "keys", &keys), "read");
    let error = with_chunk::<D>("TBRICKS", "keys", &keys[1..]);
    assert!(error.contains(&format!("keys is {} bytes; give {key} bytes", keys.len() - 1)), "{error}");
    let error = with_chunk::<D>("TBRICKS", "keys", &keys[key..]);
    let bytes = keys.len() / key * block_cells::<D>() * 4;
    assert!(error.contains(&format!("distance is {bytes}; the header announces")), "{error}");
    let mut twice = keys.clone();
    twice.copy_within(key..2 * key, 0);
    assert!(with_chunk::<D>("TBRICKS", "keys", &twice).contains("key 1 of chunk \"TBRICKS\" is"));
    let mut far = keys;
    let last = far.len() - key;
    far[last..].fill(0x7f);
    assert!(with_chunk::<D>("TBRICKS", "keys", &far).contains("of chunk \"TBRICKS\" is"));
    for (tag, part) in [("TBRICKS", "a cell of brick"), ("TSDF", "a distance or weight")] {
        let mut weights = container.get(tag, "weight").unwrap().unwrap();
        weights[..4].copy_from_slice(&(-1f32).to_le_bytes());
        assert!(with_chunk::<D>(tag, "weight", &weights).contains(part));
    }
}

fn a_file_without_hits_per_meter_still_reads<const D: usize>() {
    let mut file = full::<D>(1);
    file.attenuation = None;
    let back = parse::<D>(file.to_bytes().unwrap()).unwrap();
    assert!(back.attenuation.is_none() && back.tsdf_bricks.is_some());
    // Hits of a cell that was never looked at are no state of the filter.
    let hits = vec![1; full::<D>(1).attenuation.unwrap().store.len() * block_cells::<D>() * 4];
    assert!(with_chunk::<D>("ABRICKS", "hits", &hits).contains("a cell of brick"));
}

fn parts_hold_the_same_whole_bricks<const D: usize>() {
    let container = Container::parse(full::<D>(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
    let weights = container.get("TBRICKS", "weight").unwrap().unwrap();
    let cut = |at: usize, both: bool| {
        let cut = |c: &Chunk| c.tag == "TBRICKS" && (c.name == "weight" || both && c.name == "distance");
        let mut writer = container.writer(|c| !cut(c)).unwrap();
        writer.chunk("TBRICKS", "weight", &weights[..at]).unwrap();
        writer.chunk("TBRICKS", "weight.1", &weights[at..]).unwrap();
        if both {
            let distances = container.get("TBRICKS", "distance").unwrap().unwrap();
            writer.chunk("TBRICKS", "distance", &distances[..at]).unwrap();
            writer.chunk("TBRICKS", "distance.1", &distances[at..]).unwrap();
        }
        parse::<D>(writer.to_bytes())
    };
    let four = 4 * 4 * block_cells::<D>();
    assert!(cut(four, true).unwrap().to_bytes().unwrap() == full::<D>(1).to_bytes().unwrap());
    for file in [cut(four, false), cut(four + 4, true)] {
        let error = file.err().unwrap().to_string();
        assert!(error.contains("the division of chunk \"TBRICKS\""), "{error}");
    }
}

fn memory_is_limited<const D: usize>() {
    let container = Container::parse(full::<D>(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
    // The content of all chunks, and what bricks take beside their planes.
    let content: u64 = container.chunks().iter().map(|c| c.length).sum();
    let needed = content + 4 * 96 * keys::<D>(1).len() as u64;
    let error = |memory| MapFile::<D>::from_container(&container, memory).err().map(|e| e.to_string());
    assert_eq!(error(needed), None);
    for memory in [2_000, needed / 4, needed / 2, needed - 1] {
        let error = error(memory).unwrap();
        assert!(error.contains("a length of map data") && error.contains("allow more"), "{error}");
    }
}

fn no_bytes_make_it_panic<const D: usize>() {
    let good = full::<D>(1).to_bytes().unwrap();
    for bytes in bad_bytes(&good, 33, 100) {
        let _ = parse::<D>(bytes);
    }
    // The checksums stop nearly all of these; a bad content behind good ones must be stopped, too.
    let container = Container::parse(good, "m".as_ref()).unwrap();
    for chunk in container.chunks() {
        let content = container.unpack(chunk).unwrap();
        for bytes in bad_bytes(&content, 34, 60) {
            let mut writer = container.writer(|c| c != chunk).unwrap();
            writer.chunk(&chunk.tag, &chunk.name, &bytes).unwrap();
            let _ = parse::<D>(writer.to_bytes());
        }
    }
}
