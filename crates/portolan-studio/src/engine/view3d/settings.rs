//! What the page's sliders set.

use portolan::MapperSettings;
use portolan::cell::OccupancyModel;
use serde::{Deserialize, Serialize};

use crate::engine::Refusal;
use crate::engine::recipe::within;

/// How frames are made and fused.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(in crate::engine) struct Settings {
    /// Edge of a cell (meters).
    pub(super) resolution: f64,
    /// Truncation (meters).
    pub(super) truncation: f64,
    /// Clamp of the weight.
    pub(super) w_max: f64,
    /// Whether free space is fused, too.
    pub(super) carve: bool,
    /// Whether a map that is occupied or free is made beside that of distances; it takes three times as long.
    pub(super) occupancy: bool,
    /// What is carried through the simulated building; does nothing to recorded logs.
    pub(super) sensor: Sensor,
}

/// What is carried through the simulated building.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum Sensor {
    /// Sees all around.
    #[default]
    Lidar,
    /// Sees colors.
    Camera,
}

impl Default for Settings {
    /// Those of `map`: 5 cm, truncation three cells, W_max 128, with carving.
    fn default() -> Self {
        let usual = MapperSettings::<3>::new(0.05);
        Self {
            resolution: usual.resolution,
            truncation: usual.truncation(),
            w_max: usual.w_max.into(),
            carve: true,
            occupancy: false,
            sensor: Sensor::default(),
        }
    }
}

impl Settings {
    /// As the mapper takes them.
    ///
    /// # Errors
    /// Names the setting that is out of its range.
    pub(super) fn mapper(&self, color: bool) -> Result<MapperSettings<3>, Refusal> {
        let resolution = within("resolution", self.resolution, 0.005, 1.0)?;
        let truncation = within("truncation", self.truncation, resolution, 20.0 * resolution)?;
        let w_max = within("w_max", self.w_max, 0.5, 1e6)?;
        Ok(MapperSettings {
            truncation: Some(truncation),
            w_max: w_max as f32,
            carve: self.carve,
            occupancy: self.occupancy.then(OccupancyModel::default),
            attenuation: None,
            color,
            ..MapperSettings::new(resolution)
        })
    }
}
