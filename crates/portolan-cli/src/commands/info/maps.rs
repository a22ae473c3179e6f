//! `info` of a map.portolan.

use portolan::cell::{Cell, HitLengthPlanes, Planes};
use portolan::store::{Bricks, Store};
use portolan_io::{MapFile, MapHeader};
use serde_json::{Value, json};

use crate::json;
use crate::mapping::brick_extent;
use crate::up::Up;

fn of_header(dimension: usize, header: &MapHeader, poses: usize, maps: Value) -> Value {
    json!({
        "dimension": dimension,
        "logs": header.logs,
        "scans": header.scans,
        "hold_out": header.hold_out,
        "every": header.every,
        "settings": header.settings,
        "statistics": header.statistics,
        "poses": poses,
        "maps": maps,
    })
}

pub(super) fn of_2d(file: &MapFile<2>) -> Value {
    let mut maps = json!({});
    if let Some(map) = &file.grid {
        maps["grid"] = json!({
            "cell": "log odds, one byte",
            "extent": json::grid(map.store().grid()),
            "observed": map.observed_cells(),
            "bytes": map.memory_bytes(),
        });
    }
    if let Some(map) = &file.tree {
        maps["tree"] = json!({
            "cell": "log odds, one byte",
            "extent": json::aabb(&map.store().grid().aabb()),
            "depth": map.store().depth(),
            "nodes": map.store().nodes(),
            "bytes": map.memory_bytes(),
        });
    }
    if let Some(map) = &file.tsdf {
        maps["tsdf"] = json!({
            "cell": "signed distance and weight, f32",
            "extent": json::grid(map.grid()),
            "truncation": map.config().truncation,
            "w_max": map.config().w_max.is_finite().then_some(map.config().w_max),
            "observed": map.observed_cells(0.0),
            "bytes": map.memory_bytes(),
        });
    }
    maps_of_hits(&mut maps, file);
    sums(&mut maps, file);
    of_header(2, &file.header, file.poses.len(), maps)
}

pub(super) fn of_3d(file: &MapFile<3>) -> Value {
    let mut maps = json!({});
    if let Some(map) = &file.occupancy_bricks {
        maps["tree"] = of_bricks("log odds, one byte", &map.store);
    }
    if let Some(map) = &file.tsdf_bricks {
        maps["tsdf"] = of_bricks("signed distance and weight, f32", &map.store);
        maps["tsdf"]["truncation"] = json!(map.truncation);
        maps["tsdf"]["w_max"] = json!(map.w_max.is_finite().then_some(map.w_max));
    }
    if let Some(map) = &file.color_bricks {
        maps["colors"] = of_bricks("red, green, blue, weight, 16 bits each", &map.store);
    }
    maps_of_hits(&mut maps, file);
    sums(&mut maps, file);
    let mut about = of_header(3, &file.header, file.poses.len(), maps);
    let up = Up::of_header(&file.header);
    about["up"] = json!(up.unwrap_or(Up::Z).words());
    about["up_is_assumed"] = json!(up.is_none().then_some(true));
    about
}

/// What a map of sums holds, from which the others follow.
fn sums<const D: usize>(maps: &mut Value, file: &MapFile<D>) {
    let Some(ledger) = &file.ledger else { return };
    let logs = ledger.scans().logs().map(|log| {
        let scans = ledger.scans().iter().filter(|(name, ..)| *name == log).count();
        json!({ "log": log, "scans": scans })
    });
    maps["sums"] = json!({
        "cell": "sums of whole numbers, 16, 32 or 64 bits",
        "logs": logs.collect::<Vec<_>>(),
        "bytes": ledger.memory_bytes(),
    });
}

fn maps_of_hits<const D: usize>(maps: &mut Value, file: &MapFile<D>) {
    if let Some(map) = &file.attenuation {
        maps["attenuation"] = of_bricks("hits, length of beams and looks, whole numbers", &map.store);
        maps["attenuation"]["half_life"] = json!(map.rule.half_life);
        let hits = |planes: &HitLengthPlanes| planes.hits().iter().map(|h| u64::from(*h)).sum::<u64>();
        let all = map.store.bricks_by_age().map(|(_, brick)| hits(&brick.planes()));
        maps["attenuation"]["hits"] = json!(all.sum::<u64>());
    }
}

fn of_bricks<C: Cell, const D: usize>(cell: &str, store: &Bricks<C, D>) -> Value {
    let observed = |brick: &C::Brick| (0..brick.len()).filter(|&i| brick.get(i).is_some()).count();
    let extent = brick_extent(store);
    json!({
        "cell": cell,
        "resolution": store.lattice().resolution,
        "origin": store.lattice().origin.to_vec(),
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
        "bricks": store.len(),
        "observed": store.bricks_by_age().map(|(_, brick)| observed(brick)).sum::<usize>(),
        "bytes": store.memory_bytes(),
    })
}
