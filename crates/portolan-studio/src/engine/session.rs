//! One tab's engine.

use std::sync::Arc;

use super::clearance::Clearance;
use super::fusion::Fusion;
use super::gallery::Gallery;
use super::protocol::{Message, Refusal, Reply, View, Wire, encode};
use super::radiance::Radiance;
use super::view3d::View3d;
use super::{Clock, Logs, about};

/// What one session may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of all its maps together.
    pub memory: usize,
}

impl Default for Limits {
    /// 2 GiB.
    fn default() -> Self {
        Self { memory: 2 << 30 }
    }
}

/// Whether a tab can open these logs with the settings that it begins with.
///
/// # Errors
/// Where the map would not fit into the limits, or its extent is empty.
pub fn check(logs: &Arc<Logs>, limits: Limits) -> Result<(), Refusal> {
    Fusion::new(logs, limits, &Clock::new(|| 0.0)).tsdf().map(|_| ())
}

/// The maps of one tab of the browser and what the page has of them. Dropping it frees them.
pub struct Session {
    limits: Limits,
    logs: Arc<Logs>,
    fusion: Fusion,
    gallery: Gallery,
    clearance: Clearance,
    radiance: Radiance,
    view3d: View3d,
}

impl Session {
    /// Nothing fused yet.
    pub fn new(logs: &Arc<Logs>, limits: Limits, clock: &Clock) -> Self {
        Self {
            limits,
            logs: logs.clone(),
            fusion: Fusion::new(logs, limits, clock),
            gallery: Gallery::new(limits, clock),
            clearance: Clearance::new(limits, clock),
            radiance: Radiance::new(clock),
            view3d: View3d::new(logs, limits, clock),
        }
    }

    /// Answers one message of the page, whatever it is: what cannot be answered is refused in words.
    pub fn answer(&mut self, message: &str) -> Wire {
        match serde_json::from_str::<Message>(message) {
            Ok(message) => encode(Some(message.id), self.dispatch(&message)),
            Err(error) => encode(id_of(message), Err(error.into())),
        }
    }

    fn dispatch(&mut self, message: &Message) -> Result<Reply, Refusal> {
        let ask = message.ask.get();
        let reply = match message.view {
            View::Studio => about::answer(&serde_json::from_str(ask)?, &self.logs),
            View::Fusion => self.fusion.ask(serde_json::from_str(ask)?),
            View::Gallery => self.gallery.ask(serde_json::from_str(ask)?, &mut self.fusion),
            View::Clearance => self.clearance.ask(serde_json::from_str(ask)?, &mut self.fusion),
            View::Radiance => self.radiance.ask(&serde_json::from_str(ask)?),
            View::ThreeD => self.view3d.ask(serde_json::from_str(ask)?),
        }?;
        let held = self.memory_bytes();
        if held > self.limits.memory {
            // Views check before they allocate; this is the net below them.
            self.forget(message.view);
            let (held, limit) = (held >> 20, self.limits.memory >> 20);
            return Err(Refusal::new(format!(
                "the maps of this tab take {held} MiB of the {limit} MiB that it may have, and are given up; \
                 choose larger cells"
            )));
        }
        Ok(reply)
    }

    /// Bytes of all maps of this tab.
    pub fn memory_bytes(&self) -> usize {
        self.fusion.memory_bytes()
            + self.gallery.memory_bytes()
            + self.clearance.memory_bytes()
            + self.radiance.memory_bytes()
            + self.view3d.memory_bytes()
    }

    fn forget(&mut self, view: View) {
        match view {
            View::Studio => {}
            View::Fusion => self.fusion.forget(),
            View::Gallery => self.gallery.forget(),
            View::Clearance => self.clearance.forget(),
            View::Radiance => self.radiance.forget(),
            View::ThreeD => self.view3d.forget(),
        }
    }
}

/// The number of a message that cannot be read otherwise.
fn id_of(message: &str) -> Option<u32> {
    let value: serde_json::Value = serde_json::from_str(message).ok()?;
    value.get("id")?.as_u64()?.try_into().ok()
}
