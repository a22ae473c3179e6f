//! Questions about a slice, a ray and a voxel.

use portolan::geom::vector::{add, sub};
use serde_json::{Value, json};

use super::ask::{Field, Slice};
use super::history::Watched;
use super::slice::{self, AXES, Extent};
use super::state::View3d;
use super::voxel;
use crate::engine::{Refusal, Reply};

/// Indices of cells that can be asked for lie below this, so that those of their neighbors are in range, too.
const FARTHEST: i32 = 1 << 28;

impl View3d {
    /// The Euclidean field of the map as it is.
    pub(super) fn measure(&mut self) -> Result<f64, Refusal> {
        let room = self.room();
        let clock = self.clock.clone();
        self.maps()?.measure(room, &clock)
    }

    pub(super) fn slice(&mut self, slice: Slice) -> Result<Reply, Refusal> {
        let seconds = if slice.field == Field::Esdf { self.measure()? } else { 0.0 };
        let maps = self.maps()?;
        if slice.field == Field::Occupancy && maps.occupancy().is_none() {
            return Err(Refusal::new("this map holds distances only; switch on occupancy in the settings"));
        }
        let lattice = *maps.tsdf().lattice();
        let Some(extent) = Extent::of(maps.tsdf()) else {
            return Err(Refusal::new("nothing was observed yet, so that there is nothing to cut"));
        };
        let slice = in_world(slice, maps.origin);
        let cell = slice::layer_index(&slice, slice.at, &extent, &lattice)?;
        let value = slice::value_of(slice.field, maps.tsdf(), maps.occupancy(), maps.esdf.as_ref());
        let layer = slice::layer(slice.axis, cell, &extent, &lattice, value);
        let most = match slice.field {
            Field::Tsdf => f64::from(maps.tsdf().rule().truncation),
            Field::Esdf => maps.esdf.as_ref().map_or(0.0, |e| f64::from(e.max_distance())),
            Field::Occupancy => 1.0,
        };
        // The quad runs through the middle of the layer.
        let mut corner = sub(layer.corner, maps.origin);
        corner[slice.axis] = layer.at - maps.origin[slice.axis];
        let side = |i: usize| (layer.shape[i] * layer.step) as f64 * lattice.resolution;
        let reply = Reply::of(json!({
            "cell": layer.cell,
            "at": layer.at - maps.origin[slice.axis],
            "world": layer.at,
            "axes": AXES[slice.axis],
            "shape": layer.shape,
            "step": layer.step,
            "corner": corner,
            "sides": [side(0), side(1)],
            "most": most,
            "seconds": seconds,
            "revision": self.revision,
        }))?;
        Ok(reply.with("values", layer.values))
    }

    pub(super) fn pick(
        &mut self,
        origin: [f64; 3],
        direction: [f64; 3],
        slice: Option<Slice>,
    ) -> Result<Reply, Refusal> {
        let maps = self.maps()?;
        let slice = slice.map(|slice| in_world(slice, maps.origin));
        let met = voxel::pick(maps, add(origin, maps.origin), direction, slice.as_ref())?;
        Reply::of(met.map(
            |met| json!({ "cell": met.cell, "point": sub(met.point, maps.origin), "slice": met.on_slice }),
        ))
    }

    pub(super) fn voxel(&mut self, cell: Option<[i32; 3]>) -> Result<Reply, Refusal> {
        let Some(cell) = cell else {
            self.maps()?.watch(None);
            return Reply::of(Value::Null);
        };
        if !cell.iter().all(|v| v.abs() < FARTHEST) {
            return Err(Refusal::new(format!("there is no cell {cell:?}")));
        }
        // Without the field the rest is still known.
        let trouble = self.measure().err().map(|why| why.to_string());
        let since = self.at();
        let maps = self.maps()?;
        if maps.watched.as_ref().is_none_or(|w| w.cell != cell) {
            let watched = Watched::new(cell, since, *maps.tsdf().config())?;
            maps.watch(Some(watched));
        }
        let Some(maps) = &self.maps else { return Reply::of(Value::Null) };
        let mut body = voxel::describe(maps, &self.source, cell, maps.origin);
        body["trouble"] = json!(trouble);
        body["history"] = json!(maps.watched.as_ref().map(Watched::to_json));
        body["recorded"] = json!(self.source.map().is_none());
        Reply::of(body)
    }
}

/// The slice with its place in the world.
fn in_world(slice: Slice, origin: [f64; 3]) -> Slice {
    Slice { at: slice.at + origin.get(slice.axis).copied().unwrap_or(0.0), ..slice }
}
