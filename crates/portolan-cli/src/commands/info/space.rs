//! `info` of what has three dimensions.

use portolan::cell::{Cell, Planes};
use portolan::store::{Bricks, Store};
use portolan_io::MapFile;
use portolan_io::scan_log::{CameraFrom, ScanLog};
use serde_json::{Value, json};

use crate::json;
use crate::space::brick_extent;

pub(super) fn of_map(file: &MapFile<3>) -> Value {
    let header = &file.header;
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
    json!({
        "dimension": 3,
        "logs": header.logs,
        "scans": header.scans,
        "hold_out": header.hold_out,
        "every": header.every,
        "settings": header.settings,
        "statistics": header.statistics,
        "poses": file.poses.len(),
        "maps": maps,
    })
}

fn of_bricks<C: Cell>(cell: &str, store: &Bricks<C, 3>) -> Value {
    let observed = |brick: &C::Brick| (0..brick.len()).filter(|&i| brick.get(i).is_some()).count();
    let extent = brick_extent(store);
    json!({
        "cell": cell,
        "resolution": store.lattice().resolution,
        "extent": (!extent.is_empty()).then(|| json::aabb(&extent)),
        "bricks": store.len(),
        "observed": store.bricks_by_age().map(|(_, brick)| observed(brick)).sum::<usize>(),
        "bytes": store.memory_bytes(),
    })
}

pub(super) fn of_log(log: &ScanLog) -> Value {
    let camera = log.camera().map(|camera| {
        let p = &camera.pinhole;
        let from = match &camera.from {
            CameraFrom::Caller => "the caller".to_owned(),
            CameraFrom::File(path) => path.display().to_string(),
            CameraFrom::DataSet(name) => (*name).to_owned(),
        };
        json!({ "fx": p.fx, "fy": p.fy, "cx": p.cx, "cy": p.cy, "from": from })
    });
    json!({
        "scans": log.len(),
        "path_length": log.path_length(),
        "extent_of_poses": json::aabb(&log.extent()),
        "time_span": log.time_span().map(|(first, last)| [first, last]),
        "camera": camera,
        "log": json::space_log_stats(log.stats()),
    })
}
