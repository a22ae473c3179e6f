//! What scans did to the cell that is looked at, scan by scan.

use std::sync::Arc;

use portolan::cell::FusionEvent;
use portolan::geom::Aabb;
use portolan::map::{Tsdf3, TsdfConfig};
use serde_json::{Value, json};

use super::source::Source;
use crate::engine::fusion::inspect::row;
use crate::engine::{Clock, Refusal};

/// Seconds that one answer spends on what happened before.
const LONGEST: f64 = 0.15;

/// A cell, and the events of its filter.
pub(super) struct Watched {
    pub(super) cell: [i32; 3],
    /// Frames before this one are fused again to see what they did.
    since: usize,
    again: Option<(Tsdf3, usize)>,
    before: Vec<(usize, FusionEvent)>,
    after: Vec<(usize, FusionEvent)>,
}

impl Watched {
    /// Watches from frame `since` on. What came before is found by fusing it again into a map of this cell alone: the
    /// evidence about a cell does not depend on which others are kept.
    pub(super) fn new(cell: [i32; 3], since: usize, config: TsdfConfig<3>) -> Result<Self, Refusal> {
        let mut map = Tsdf3::new(config).map_err(Refusal::new)?;
        let center = map.lattice().center(cell);
        let near = 0.25 * config.resolution;
        map.set_bounds(Some(Aabb::new(center.map(|v| v - near), center.map(|v| v + near))));
        map.watch([cell]);
        let again = (since > 0).then_some((map, 0));
        Ok(Self { cell, since, again, before: Vec::new(), after: Vec::new() })
    }

    /// Fuses some of the earlier frames again.
    pub(super) fn go_on(&mut self, source: &mut Source, clock: &Clock) {
        let start = clock.now();
        while let Some((map, at)) = &mut self.again {
            // A frame that cannot be read now could not be read then.
            if let Ok((pose, frame)) = source.frame(*at) {
                let frame: Arc<_> = frame;
                if map.integrate(&pose, &*frame).is_ok() {
                    self.before.extend(map.events().iter().map(|e| (*at, e.1)));
                }
            }
            *at += 1;
            if *at >= self.since {
                self.again = None;
            }
            if clock.now() - start > LONGEST {
                break;
            }
        }
    }

    /// The map has fused frame `frame`.
    pub(super) fn observe(&mut self, frame: usize, events: &[([i32; 3], FusionEvent)]) {
        self.after.extend(events.iter().filter(|e| e.0 == self.cell).map(|e| (frame, e.1)));
    }

    /// The map begins again.
    pub(super) fn begin(&mut self) {
        (self.since, self.again) = (0, None);
        self.before.clear();
        self.after.clear();
    }

    /// All events; `from` and `to` while those of earlier frames are still being found.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "events": self.before.iter().chain(&self.after).map(row).collect::<Vec<_>>(),
            "looked_at": self.again.as_ref().map(|(_, at)| at),
            "to_look_at": self.since,
        })
    }
}
