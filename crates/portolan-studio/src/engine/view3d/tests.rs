//! What the view answers against what the library computes.

use std::collections::BTreeSet;
use std::sync::Arc;

use portolan::mapper::{Mapper, MapperSettings};
use portolan::store::Store;
use portolan::surface::{MeshSettings, marching_cubes};
use portolan::uncertainty::SurfaceSigma;
use portolan_sim::building::{BuildingConfig, BuildingSensor, SpinningLidar, building_log};
use serde_json::{Value, json};

use super::state::View3d;
use crate::engine::{BesideMap, Clock, Limits, Logs, Refusal, Reply, Session, Source3d, Values, Wire};

fn view() -> View3d {
    View3d::new(&Arc::new(Logs::default()), Limits::default(), &Clock::new(|| 0.0))
}

fn ask(view: &mut View3d, ask: Value) -> Result<Reply, Refusal> {
    view.ask(serde_json::from_value(ask)?)
}

fn coarse() -> Value {
    json!({ "op": "set", "settings": { "resolution": 0.2, "truncation": 0.6, "w_max": 64.0, "carve": true, "occupancy": true, "sensor": "lidar" } })
}

/// The page: it writes what it gets where the answer puts it.
#[derive(Default)]
struct Page {
    positions: Vec<f32>,
    shades: Vec<u8>,
    indices: Vec<u32>,
}

impl Page {
    fn take(&mut self, reply: &Reply) {
        let mesh = &reply.body["mesh"];
        if mesh["fresh"] == true {
            *self = Self::default();
        }
        self.positions.resize(3 * mesh["vertices"].as_u64().unwrap() as usize, f32::NAN);
        self.shades.resize(4 * mesh["vertices"].as_u64().unwrap() as usize, 0);
        self.indices.resize(mesh["indices"].as_u64().unwrap() as usize, 0);
        let array = |name: &str| &reply.arrays.iter().find(|a| a.name == name).unwrap().values;
        let (Values::U32(holes), Values::U32(runs)) = (array("holes"), array("runs")) else { panic!() };
        let (Values::F32(positions), Values::U16(pieces)) = (array("positions"), array("indices")) else {
            panic!()
        };
        let (Values::U8(shades), Values::I8(normals)) = (array("shades"), array("normals")) else { panic!() };
        assert_eq!((4 * positions.len() / 3, normals.len()), (shades.len(), shades.len()));
        for hole in holes.chunks(2) {
            self.indices[hole[0] as usize..(hole[0] + hole[1]) as usize].fill(0);
        }
        let (mut v, mut t) = (0, 0);
        for run in runs.chunks(5) {
            let [v0, vertices, t0, indices, room] =
                [run[0], run[1], run[2], run[3], run[4]].map(|n| n as usize);
            self.positions[3 * v0..3 * (v0 + vertices)]
                .copy_from_slice(&positions[3 * v..3 * (v + vertices)]);
            self.shades[4 * v0..4 * (v0 + vertices)].copy_from_slice(&shades[4 * v..4 * (v + vertices)]);
            for k in 0..indices {
                self.indices[t0 + k] = (v0 + usize::from(pieces[t + k])) as u32;
            }
            self.indices[t0 + indices..t0 + room].fill(0);
            (v, t) = (v + vertices, t + indices);
        }
        assert_eq!((3 * v, t), (positions.len(), pieces.len()));
    }

    /// Corners of all triangles that are some, sorted.
    fn triangles(&self) -> Vec<[[u32; 3]; 3]> {
        let place = |i: u32| [0, 1, 2].map(|k| self.positions[3 * i as usize + k].to_bits());
        let all = self.indices.chunks(3).filter(|t| t[0] != t[1] || t[1] != t[2]);
        let mut all: Vec<_> = all.map(|t| [place(t[0]), place(t[1]), place(t[2])]).collect();
        all.sort_unstable();
        all
    }
}

/// Asks until nothing is pending.
fn drain(view: &mut View3d, page: &mut Page, first: Reply) -> Reply {
    let mut reply = first;
    page.take(&reply);
    while reply.body["mesh"]["pending"] != 0 {
        reply = ask(view, json!({ "op": "mesh" })).unwrap();
        page.take(&reply);
    }
    reply
}

fn whole(view: &View3d) -> Vec<[[u32; 3]; 3]> {
    let maps = view.maps_for_tests();
    let mesh = marching_cubes(maps.tsdf(), None, &MeshSettings::default());
    // The same operations with another corner: places differ by rounding only where the corner does.
    let shift: [f64; 3] = std::array::from_fn(|k| mesh.origin[k] - maps.origin[k]);
    assert!(shift.iter().all(|s| s.is_finite()));
    let first = maps.first;
    let mut all = Vec::new();
    for key in maps.mesh.keys() {
        let piece = maps.mesh.piece(key, first);
        all.extend(piece.triangles.iter().map(|t| t.map(|v| piece.vertices[v as usize].map(f32::to_bits))));
    }
    assert_eq!(all.len(), mesh.triangles.len());
    all.sort_unstable();
    all
}

#[test]
fn what_the_page_has_is_the_mesh() {
    let (mut view, mut page) = (view(), Page::default());
    let reply = ask(&mut view, json!({ "op": "open" })).unwrap();
    assert_eq!(reply.body["at"], 0);
    drain(&mut view, &mut page, reply);
    let reply = ask(&mut view, coarse()).unwrap();
    drain(&mut view, &mut page, reply);
    for frames in [1, 2, 3] {
        let reply = ask(&mut view, json!({ "op": "step", "frames": frames })).unwrap();
        let reply = drain(&mut view, &mut page, reply);
        let triangles = page.triangles();
        assert!(triangles.len() > 1000);
        assert_eq!(reply.body["mesh"]["triangles"], triangles.len());
        assert!(triangles == whole(&view));
    }
    // Back, and again from the beginning for a new page.
    let reply = ask(&mut view, json!({ "op": "seek", "frame": 2 })).unwrap();
    assert_eq!((reply.body["at"].as_u64(), reply.body["mesh"]["fresh"].as_bool()), (Some(2), Some(true)));
    drain(&mut view, &mut page, reply);
    assert!(page.triangles() == whole(&view));
    let (mut other, reply) = (Page::default(), ask(&mut view, json!({ "op": "open" })).unwrap());
    let reply = drain(&mut view, &mut other, reply);
    assert_eq!(reply.body["mesh"]["triangles"], other.triangles().len());
    assert!(other.triangles() == page.triangles());
    // Other colors in the same places.
    for by in ["weight", "error", "height"] {
        let reply = ask(&mut view, json!({ "op": "color", "by": by })).unwrap();
        assert_eq!(reply.body["color"]["by"], by);
        drain(&mut view, &mut page, reply);
        assert!(page.triangles() == other.triangles());
        let known = page.shades.chunks(4).filter(|s| s[3] == 255).count();
        assert_eq!(known > 0, by != "height", "{by}");
    }
    assert!(ask(&mut view, json!({ "op": "color", "by": "color" })).is_err());
}

#[test]
fn a_saved_map_is_colored_by_what_lies_beside_it() {
    let lidar = SpinningLidar { rings: 32, columns: 256, ..SpinningLidar::default() };
    let config = BuildingConfig { scans: 3, sensor: BuildingSensor::Lidar(lidar), ..Default::default() };
    let mut mapper = Mapper::with(MapperSettings { origin: Some([0.0; 3]), ..MapperSettings::<3>::new(0.2) });
    for (pose, frame) in &building_log(&config).scans {
        mapper.integrate(pose, frame).unwrap();
    }
    let (tsdf, attenuation) = (mapper.tsdf().unwrap().clone(), mapper.attenuation().unwrap().clone());
    let sigma = SurfaceSigma::through([[1.0, 0.02], [100.0, 0.002]]).unwrap();
    let beside = BesideMap {
        sigma: Some(sigma.clone()),
        movers: vec![[1.0, 2.0, 0.5]; 3],
        attenuation: Some(attenuation.clone()),
    };
    let beside = Box::new(beside);
    let (name, up) = ("a map".to_owned(), [0.0, 0.0, 1.0]);
    let source_3d = Source3d::Map { name, tsdf: Box::new(tsdf.clone()), up, beside };
    let logs = Arc::new(Logs { source_3d, ..Logs::default() });
    let (mut view, mut page) = (View3d::new(&logs, Limits::default(), &Clock::new(|| 0.0)), Page::default());
    let reply = ask(&mut view, json!({ "op": "open" })).unwrap();
    let origin = [0, 1, 2].map(|k| reply.body["all"]["origin"][k].as_f64().unwrap());
    assert_eq!(reply.body["all"]["movers"], 3);
    let moved = &reply.arrays.iter().find(|a| a.name == "movers").unwrap().values;
    let expected = [0, 1, 2].map(|k| ([1.0, 2.0, 0.5][k] - origin[k]) as f32);
    assert!(matches!(moved, Values::F32(all) if all[..] == expected.repeat(3)));
    drain(&mut view, &mut page, reply);

    let known = |share: f64| [(255.0 * share).round().clamp(0.0, 255.0) as u8, 0, 0, 255];
    let by_sigma = |p: [f64; 3]| {
        let at = sigma.of_distance(tsdf.store(), p, 0.0, [0.0; 3])?;
        Some(known((at / 0.002).ln() / 10f64.ln()))
    };
    let by_passed = |p: [f64; 3]| {
        let stopped = attenuation.opacity(attenuation.store().lattice().cell_of(p)?)?;
        Some(known(1.0 - stopped))
    };
    for (by, expected) in
        [("sigma", &by_sigma as &dyn Fn([f64; 3]) -> Option<[u8; 4]>), ("passed", &by_passed)]
    {
        let reply = ask(&mut view, json!({ "op": "color", "by": by })).unwrap();
        drain(&mut view, &mut page, reply);
        let (mut right, mut some) = (0, 0);
        let places = page.positions.chunks(3).zip(page.shades.chunks(4)).filter(|(p, _)| p[0].is_finite());
        let all = places.clone().count();
        for (p, shade) in places {
            let p = [0, 1, 2].map(|k| origin[k] + f64::from(p[k]));
            right += usize::from(shade == expected(p).unwrap_or([0; 4]));
            some += usize::from(shade[3] == 255);
        }
        // A place on the border of two cells may be in either, by rounding.
        assert!(all > 1000 && 100 * right > 99 * all && 2 * some > all, "{by}: {right}, {some} of {all}");
    }
    for by in ["sigma", "passed"] {
        assert!(ask(&mut self::view(), json!({ "op": "color", "by": by })).is_err());
    }
}

#[test]
fn a_slice_holds_what_the_map_says() {
    let mut view = view();
    assert!(
        ask(&mut view, json!({ "op": "slice", "slice": { "field": "tsdf", "axis": 2, "at": 0.0 } })).is_err()
    );
    ask(&mut view, coarse()).unwrap();
    ask(&mut view, json!({ "op": "step", "frames": 3 })).unwrap();
    for (field, axis) in [("tsdf", 2), ("esdf", 1), ("occupancy", 0)] {
        let slice = json!({ "field": field, "axis": axis, "at": 0.3 });
        let reply = ask(&mut view, json!({ "op": "slice", "slice": slice })).unwrap();
        let Values::F32(values) = &reply.arrays[0].values else { panic!() };
        let shape = [0, 1].map(|i| reply.body["shape"][i].as_u64().unwrap() as usize);
        assert_eq!(values.len(), shape[0] * shape[1]);
        let maps = view.maps_for_tests();
        let lattice = maps.tsdf().lattice();
        let axes = [0, 1].map(|i| reply.body["axes"][i].as_u64().unwrap() as usize);
        let corner: [f64; 3] = std::array::from_fn(|k| reply.body["corner"][k].as_f64().unwrap());
        let mut known = 0;
        for (i, value) in values.iter().enumerate() {
            let mut p: [f64; 3] = std::array::from_fn(|k| corner[k] + maps.origin[k]);
            p[axes[0]] += (0.5 + (i % shape[0]) as f64) * lattice.resolution;
            p[axes[1]] += (0.5 + (i / shape[0]) as f64) * lattice.resolution;
            let expected = match field {
                "tsdf" => {
                    maps.tsdf().signed_distance(p).known().or(saturated(maps.tsdf().signed_distance(p)))
                }
                "esdf" => {
                    let cell = maps.esdf.as_ref().unwrap().cell(lattice.cell_of(p).unwrap());
                    cell.known().or(saturated(cell)).map(f64::from)
                }
                _ => maps.occupancy().unwrap().probability(p).known(),
            };
            known += usize::from(expected.is_some());
            assert_eq!(expected.map(|v| v as f32), (!value.is_nan()).then_some(*value), "{field} {i}");
        }
        assert!(known > 500, "{field} {known}");
    }
    for slice in
        [json!({ "field": "tsdf", "axis": 3, "at": 0.3 }), json!({ "field": "tsdf", "axis": 0, "at": null })]
    {
        assert!(ask(&mut view, json!({ "op": "slice", "slice": slice })).is_err());
    }
}

fn saturated<T>(answer: portolan::Answer<T>) -> Option<T> {
    match answer {
        portolan::Answer::Saturated(v) => Some(v),
        _ => None,
    }
}

/// A ray from outside through a wall's back finds a surface; the voxel's past, fused again, ends where the map is.
#[test]
fn the_history_of_a_voxel_ends_at_its_state() {
    let mut view = view();
    ask(&mut view, coarse()).unwrap();
    ask(&mut view, json!({ "op": "step", "frames": 6 })).unwrap();
    let reply = ask(&mut view, json!({ "op": "mesh" })).unwrap();
    let [low, high] = [0, 1]
        .map(|i| -> [f64; 3] { std::array::from_fn(|k| reply.body["surface"][i][k].as_f64().unwrap()) });
    let mut found = BTreeSet::new();
    for i in 0..40 {
        let share = (f64::from(i) + 0.5) / 40.0;
        let origin = [low[0] + share * (high[0] - low[0]), low[1] + 0.5 * (high[1] - low[1]), high[2] + 5.0];
        let ray = json!({ "op": "pick", "origin": origin, "direction": [0.1, 0.02, -1.0], "slice": null });
        let met = ask(&mut view, ray).unwrap().body;
        let Some(cell) = met["cell"].as_array() else { continue };
        let cell = std::array::from_fn::<_, 3, _>(|k| cell[k].as_i64().unwrap() as i32);
        let maps = view.maps_for_tests();
        let point: [f64; 3] = std::array::from_fn(|k| met["point"][k].as_f64().unwrap() + maps.origin[k]);
        assert_eq!(maps.tsdf().lattice().cell_of(point), Some(cell));
        if maps.tsdf().signed_distance(point).known().is_some_and(|d| d.abs() < 0.3) {
            found.insert(cell);
        }
    }
    assert!(found.len() > 5);
    for cell in found {
        let body = ask(&mut view, json!({ "op": "voxel", "cell": cell })).unwrap().body;
        let maps = view.maps_for_tests();
        let state = portolan::store::Store::cell(maps.tsdf().store(), cell).unwrap();
        assert_eq!(body["distance"].as_f64(), Some(f64::from(state.distance)));
        assert_eq!(body["weight"].as_f64(), Some(f64::from(state.weight)));
        let center = maps.tsdf().lattice().center(cell);
        let truth = true_distance(&view, center);
        assert_eq!(body["truth"].as_f64(), Some(truth));
        let history = loop {
            let history = ask(&mut view, json!({ "op": "history" })).unwrap().body;
            if history["looked_at"].is_null() {
                break history;
            }
        };
        let last = history["events"].as_array().unwrap().last().unwrap().clone();
        assert_eq!(last[5].as_f64().map(|v| v as f32), Some(state.distance));
        assert_eq!(last[6].as_f64().map(|v| v as f32), Some(state.weight));
        // It goes on while it is watched.
        ask(&mut view, json!({ "op": "step", "frames": 1 })).unwrap();
        let after = ask(&mut view, json!({ "op": "history" })).unwrap().body;
        let state = portolan::store::Store::cell(view.maps_for_tests().tsdf().store(), cell).unwrap();
        let last = after["events"].as_array().unwrap().last().unwrap().clone();
        assert_eq!(last[5].as_f64().map(|v| v as f32), Some(state.distance));
    }
}

fn true_distance(view: &View3d, p: [f64; 3]) -> f64 {
    view.world_for_tests().unwrap().signed_distance(p)
}

#[test]
fn files_are_those_of_the_command_line() {
    let mut view = view();
    ask(&mut view, coarse()).unwrap();
    ask(&mut view, json!({ "op": "step", "frames": 2 })).unwrap();
    let mut first = |file: &str| {
        let reply = ask(&mut view, json!({ "op": "export", "file": file })).unwrap();
        let Values::U8(bytes) = &reply.arrays[0].values else { panic!() };
        assert!(bytes.len() > 1000);
        String::from_utf8_lossy(&bytes[..8]).into_owned()
    };
    assert!(first("ply").starts_with("ply"));
    assert!(first("glb").starts_with("glTF"));
    assert_eq!(first("esdf"), "PORTESDF");
    assert!(first("octree").starts_with("# Octoma"));
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let mut session = Session::new(&Arc::new(Logs::default()), Limits::default(), &Clock::new(|| 0.0));
    for (ask, words) in [
        (
            json!({ "op": "set", "settings": { "resolution": 0.0, "truncation": 0.6, "w_max": 64.0, "carve": true, "occupancy": true, "sensor": "lidar" } }),
            "resolution",
        ),
        (
            json!({ "op": "set", "settings": { "resolution": 0.1, "truncation": 9.0, "w_max": 64.0, "carve": true, "occupancy": true, "sensor": "lidar" } }),
            "truncation",
        ),
        (json!({ "op": "pick", "origin": [0, 0, 0], "direction": [0, 0, 0], "slice": null }), "direction"),
        (json!({ "op": "voxel", "cell": [i32::MAX, 0, i32::MIN] }), "no cell"),
        (json!({ "op": "dance" }), "dance"),
    ] {
        let message = json!({ "id": 1, "view": "3d", "ask": ask }).to_string();
        let Wire::Text(text) = session.answer(&message) else { panic!("{message}") };
        let answer: Value = serde_json::from_str(&text).unwrap();
        assert!(answer["error"].as_str().is_some_and(|e| e.contains(words)), "{text}");
    }
}

#[test]
fn too_little_memory_ends_the_run_in_words() {
    let limits = Limits { memory: 12 << 20 };
    let mut view = View3d::new(&Arc::new(Logs::default()), limits, &Clock::new(|| 0.0));
    let mut reply = ask(&mut view, json!({ "op": "step", "frames": 1 })).unwrap();
    for _ in 0..3 {
        reply = ask(&mut view, json!({ "op": "step", "frames": 1 })).unwrap();
    }
    let why = reply.body["full"].as_str().unwrap();
    assert!(why.contains("MiB") || why.contains("memory") || why.contains("bytes"), "{why}");
    assert!(view.memory_bytes() <= limits.memory, "{}", view.memory_bytes());
}
