//! The studio in headless Chromium. What every view must do is in `every_view.rs`; each view's own tests are in a file of
//! its name.
#![allow(clippy::unwrap_used, clippy::print_stderr)]
#![allow(dead_code)] // every view's tests use other parts

mod chromium;
mod clearance;
mod every_view;
mod fusion;
mod gallery;
mod keys;
mod page;
mod pictures;
mod radiance;
mod start;
mod true_pictures;
mod view3d;

use portolan_studio::engine::Logs;
use portolan_studio::server::{Server, Settings};

use chromium::Chromium;
use page::{Page, Screen};

/// A browser and a studio of this test's own; `None` where there is no browser.
struct Studio {
    chromium: &'static Chromium,
    server: Server,
}

impl Studio {
    /// With the simulated logs.
    fn start() -> Option<Self> {
        Self::with(Logs::default(), &Settings::default())
    }

    fn with(logs: Logs, settings: &Settings) -> Option<Self> {
        let chromium = chromium::chromium()?;
        Some(Self { chromium, server: Server::start(logs, settings).unwrap() })
    }

    /// A tab with what comes after the `#` of the address: `view=fusion&scan=20`.
    fn open(&self, state: &str) -> Page {
        self.open_on(state, Screen::LIGHT)
    }

    fn open_on(&self, state: &str, screen: Screen) -> Page {
        Page::open(self.chromium, &self.server, state, screen)
    }
}
