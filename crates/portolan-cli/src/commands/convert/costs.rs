//! Costmaps of Nav2.

use std::path::Path;

use portolan::field::{EsdfGrid, UnknownSpace};
use portolan::handover::{Inflation, lowest_between};
use portolan_io::{MapMode, write_costmap};

use super::field::Field;
use crate::arguments::{heights, length_or_zero};
use crate::error::bad_call;
use crate::esdf::{esdf_of_surface, tsdf_of_samples};
use crate::unknown::UnknownCells;

/// How costs become pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Mode {
    /// Percents as Nav2 publishes them, 255 unknown
    Raw,
    /// Occupied (lethal and inscribed), free, unknown
    Trinary,
    /// Shades of gray, without unknown
    Scale,
}

/// Options of costmaps.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Costmaps of Nav2 (.yaml with its .pgm)")]
pub(crate) struct CostArgs {
    /// Inflation radius (meters), up to which costs decay with the distance; writes a costmap
    #[arg(long, value_name = "M", value_parser = length_or_zero)]
    inflate: Option<f64>,
    /// Inscribed radius of the robot (meters), up to which the cost is 253 [default: 0]
    #[arg(long, value_name = "M", value_parser = length_or_zero, requires = "inflate")]
    inscribed: Option<f64>,
    /// cost_scaling_factor: how fast costs decay (1/m) [default: 3]
    #[arg(long, value_name = "K", value_parser = length_or_zero, requires = "inflate")]
    scaling: Option<f64>,
    /// Mode of map_server [default: raw with --inflate, else trinary]
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// 3-D maps: use the obstacles between these heights, LOW:HIGH (meters), and measure distances in 2-D
    #[arg(long, value_name = "LOW:HIGH", value_parser = heights, allow_hyphen_values = true)]
    z: Option<[f64; 2]>,
}

impl CostArgs {
    /// Whether a layer of a 3-D field is wanted.
    pub(super) fn is_layer(&self) -> bool {
        self.z.is_some()
    }

    /// Whether a costmap is wanted.
    pub(super) fn asked(&self) -> bool {
        self.inflate.is_some() || self.mode.is_some() || self.z.is_some()
    }

    /// Writes the costs of a 2-D field, or of a layer of a 3-D field, with a note in the yaml file.
    pub(super) fn write(
        &self,
        field: &Field,
        unknown: Option<UnknownCells>,
        note: &str,
        yaml: &Path,
    ) -> anyhow::Result<()> {
        let how = Inflation {
            inflation_radius: self.inflate.unwrap_or(0.0),
            inscribed_radius: self.inscribed.unwrap_or(0.0),
            cost_scaling_factor: self.scaling.unwrap_or(Inflation::default().cost_scaling_factor),
        };
        let how = how.validate().map_err(|e| bad_call(e.to_string()))?;
        let (grid, costs) = match (field, self.z) {
            (Field::Two(_), Some(_)) => return Err(bad_call("--z is only for 3-D; the map is 2-D")),
            (Field::Three(_), None) => {
                return Err(bad_call("a costmap is 2-D: give the heights that count with --z LOW:HIGH"));
            }
            (Field::Two(_), None) if unknown.is_some() => {
                return Err(bad_call(
                    "--unknown is for arrays and layers (--z): in a 2-D costmap unknown cells stay unknown",
                ));
            }
            (Field::Two(field), None) => (*field.grid(), how.costs(field.samples())),
            (Field::Three(field), Some(heights)) => {
                let Some(unknown) = UnknownCells::space(unknown) else {
                    return Err(bad_call("--unknown nan is only for plain arrays (.npz, .npy)"));
                };
                let layer = in_2d(field, heights, unknown)?;
                (*layer.grid(), how.costs(layer.samples()))
            }
        };
        let mode = match self.mode {
            Some(Mode::Raw) => MapMode::Raw,
            Some(Mode::Scale) => MapMode::Scale,
            Some(Mode::Trinary) => MapMode::Trinary,
            None if self.inflate.is_some() => MapMode::Raw,
            None => MapMode::Trinary,
        };
        Ok(write_costmap(yaml, &grid, &costs, mode, note)?)
    }
}

/// 2-D distances to what stands between two heights.
fn in_2d(field: &EsdfGrid<3>, heights: [f64; 2], unknown: UnknownSpace) -> anyhow::Result<EsdfGrid<2>> {
    let (grid, lowest) = lowest_between(field.grid(), field.samples(), heights, unknown)?;
    esdf_of_surface(&tsdf_of_samples(grid, &lowest)?)
}
