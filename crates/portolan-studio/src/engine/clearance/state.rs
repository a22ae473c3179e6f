//! The fields of the map that fusion is at.

use portolan::field::ObstacleCells;
use portolan::map::Tsdf2;
use serde_json::json;

use super::ask::{Ask, Which};
use super::fields::Fields;
use super::meter::{Meter, meter};
use super::path::check;
use super::{arrows, probe, rings};
use crate::engine::fusion::{Fusion, frame};
use crate::engine::{Clock, Limits, Refusal, Reply};

/// Bytes of a cell: bricks of both distances, both fields as arrays, the answer on its way.
const BYTES_PER_CELL: usize = 56;

/// The view of clearance.
pub(in crate::engine) struct Clearance {
    limits: Limits,
    clock: Clock,
    made: Option<MapFields>,
}

/// What was made of a map.
struct MapFields {
    /// Of the map.
    revision: u64,
    fields: Fields,
    meter: Meter,
    /// That it took.
    seconds: f64,
}

impl Clearance {
    pub(in crate::engine) fn new(limits: Limits, clock: &Clock) -> Self {
        Self { limits, clock: clock.clone(), made: None }
    }

    /// Answers about the map of fusion; all of the log is fused where nothing was.
    pub(in crate::engine) fn ask(&mut self, ask: Ask, fusion: &mut Fusion) -> Result<Reply, Refusal> {
        fusion.finish_if_new()?;
        let made = self.follow(fusion)?;
        let fields = &made.fields;
        let mut reply = match ask {
            Ask::Open { have } if have == Some(made.revision) => Reply::of(json!({ "unchanged": true })),
            Ask::Open { .. } => made.open(fusion),
            Ask::Rings { field, spacing } => rings::rings(fields, field, spacing),
            Ask::Arrows { field, bounds, spacing } => arrows::arrows(fields, field, bounds, spacing),
            Ask::Probe { at, unknown } => {
                let (tsdf, beside) = fusion.with_beside()?;
                Reply::of(probe::answer(tsdf, beside, fields, at, unknown.space())?)
            }
            Ask::Path { points, clearance, unknown } => {
                check(&fields.euclidean, points, clearance, unknown.space())
            }
        }?;
        // The page asks for everything again where it has drawn another.
        reply.body["revision"] = json!(made.revision);
        Ok(reply)
    }

    /// The fields of the map as it is now.
    fn follow(&mut self, fusion: &mut Fusion) -> Result<&MapFields, Refusal> {
        let clock = self.clock.clone();
        fusion.tsdf()?;
        let revision = fusion.revision();
        let made = match self.made.take().filter(|m| m.revision == revision) {
            Some(made) => made,
            None => {
                let (tsdf, beside) = fusion.with_beside()?;
                MapFields::of(tsdf, beside.cells(), revision, &self.limits, &clock)?
            }
        };
        Ok(self.made.insert(made))
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        self.made.as_ref().map_or(0, |m| m.fields.memory_bytes())
    }

    /// Gives the fields up.
    pub(in crate::engine) fn forget(&mut self) {
        self.made = None;
    }
}

impl MapFields {
    fn of(
        tsdf: &Tsdf2,
        cells: &ObstacleCells<2>,
        revision: u64,
        limits: &Limits,
        clock: &Clock,
    ) -> Result<Self, Refusal> {
        let wanted = BYTES_PER_CELL.saturating_mul(tsdf.grid().len());
        if wanted > limits.memory {
            return Err(Refusal::new(format!(
                "the distance fields of this map would take {} MiB of the {} MiB that a tab may have; choose larger cells",
                wanted >> 20,
                limits.memory >> 20
            )));
        }
        let (fields, seconds) = clock.time(|| Fields::of(tsdf, cells));
        let fields = fields.map_err(Refusal::new)?;
        Ok(Self { revision, meter: meter(&fields), fields, seconds })
    }

    /// All that is drawn of the map itself.
    fn open(&self, fusion: &mut Fusion) -> Result<Reply, Refusal> {
        let (at, config) = (fusion.at(), *fusion.tsdf()?.config());
        let contour = frame::contour(fusion.tsdf()?);
        let grid = frame::grid(self.fields.grid());
        let way = way(fusion);
        let body = json!({
            "name": fusion.scans().name(),
            "at": at,
            "grid": grid,
            "truncation": config.truncation,
            "usual_length": self.fields.usual_length(),
            "seconds": self.seconds,
            "bytes": self.fields.memory_bytes(),
            "meter": self.meter,
            "start": way.get(way.len() / 2),
            "way": way,
            "truth": fusion.scans().world(at).map(frame::truth),
        });
        Ok(Reply::of(body)?
            .with("truncated", self.fields.samples(Which::Truncated).to_vec())
            .with("pessimistic", self.fields.samples(Which::Pessimistic).to_vec())
            .with("euclidean", self.fields.samples(Which::Euclidean).to_vec())
            .with("contour", contour.points)
            .with("lines", contour.starts)
            .with("obstacles", self.fields.obstacles()))
    }
}

/// Points of the driven way, at most about: as many as a path may have.
const WAY_POINTS: usize = 900;

/// Where the sensor was, once around: a path that was free.
fn way(fusion: &Fusion) -> Vec<[f64; 2]> {
    let scans = fusion.scans().first(fusion.at().min(fusion.scans().lap_length()));
    let step = scans.len().div_ceil(WAY_POINTS).max(1);
    let last = scans.len().saturating_sub(1);
    let some = scans.iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last);
    some.map(|(_, (pose, _))| pose.translation).collect()
}
