//! Fields as numpy arrays, in the layouts of planners.

use std::path::Path;

use anyhow::bail;
use portolan::field::EsdfGrid;
use portolan::handover::{CuroboGrid, CuroboVersion, Filled, Gpmp2Field, KnotGrid, c_order, f16_from_f32};
use portolan_io::{NpyArray, NpyValues, write_npy, write_npz};

use super::field::Field;
use crate::arguments::length;
use crate::error::bad_call;
use crate::unknown::UnknownCells;

/// Layout of the arrays: whose they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Layout {
    /// distance, status, origin, resolution, shape: indexed [x, y, z]
    #[default]
    Plain,
    /// GPMP2: data with a row for every y, a column for every x, a matrix for every z; origin is the center of cell 0
    Gpmp2,
    /// CasADi and acados: values for `interpolant`, the first axis fastest, and the knots x, y, z
    Casadi,
    /// cuRobo from 0.8 on: feature_tensor, dims, pose, voxel_size; x slowest, half precision
    Curobo,
    /// cuRobo up to 0.7: the same, positive inside obstacles
    Curobo07,
}

/// Order of a plain array in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Order {
    /// The last axis fastest
    #[default]
    C,
    /// The first axis fastest (Fortran), which is portolan's own
    F,
}

/// Precision of distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Precision {
    F16,
    F32,
    F64,
}

/// Options of .npz and .npy.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Arrays (.npz, .npy)")]
pub(crate) struct ArrayArgs {
    /// Layout of the arrays
    #[arg(long, value_enum, default_value_t)]
    layout: Layout,
    /// Order in memory, for --layout plain [default: c]
    #[arg(long, value_enum)]
    order: Option<Order>,
    /// What unknown cells count as, without a step of the distance at their border. In layers of 3-D maps (--z) pessimistic
    /// makes a column unknown that is so in part; optimistic looks only at its known part [default: pessimistic]
    #[arg(long, value_enum)]
    pub(super) unknown: Option<UnknownCells>,
    /// Largest distance to write (meters); larger ones are cut to it [default: the largest of the field]
    #[arg(long, value_name = "M", value_parser = length)]
    far: Option<f64>,
    /// Precision of the distances [default: f32; gpmp2 and casadi f64, curobo f16]
    #[arg(long, value_enum)]
    precision: Option<Precision>,
}

impl ArrayArgs {
    /// Whether one of them was given.
    pub(super) fn asked(&self) -> bool {
        let Self { layout, order, unknown: _, far, precision } = self;
        *layout != Layout::Plain || order.is_some() || far.is_some() || precision.is_some()
    }

    /// Writes the field as .npz, or its main array as .npy.
    pub(super) fn write(&self, field: &Field, out: &Path) -> anyhow::Result<()> {
        let arrays = match field {
            Field::Two(field) => self.arrays(field)?,
            Field::Three(field) => match self.layout {
                Layout::Curobo | Layout::Curobo07 => self.curobo(&self.filled(field)?),
                _ => self.arrays(field)?,
            },
        };
        let Some((_, main)) = arrays.first() else { bail!("the field has no array") };
        if out.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
            write_npy(out, main)?;
        } else {
            let list: Vec<_> = arrays.iter().map(|(name, array)| (*name, array)).collect();
            write_npz(out, &list)?;
        }
        Ok(())
    }

    /// The arrays with their names, the main one first.
    fn arrays<const D: usize>(&self, field: &EsdfGrid<D>) -> anyhow::Result<Vec<(&'static str, NpyArray)>> {
        if self.order.is_some() && self.layout != Layout::Plain {
            return Err(bad_call("--order is only for --layout plain; the other layouts fix the order"));
        }
        let mut arrays = match self.layout {
            Layout::Plain => return self.plain(field),
            Layout::Gpmp2 => {
                let given = Gpmp2Field::of(&self.filled(field)?);
                let shape = [given.layers, given.rows, given.columns];
                let data = self.distances(&given.values, Precision::F64);
                vec![
                    ("data", NpyArray::c(&shape[3 - D..], data)),
                    ("origin", NpyArray::vector(&given.origin)),
                    ("cell_size", NpyArray::number(given.cell_size)),
                ]
            }
            Layout::Casadi => {
                let given = KnotGrid::of(&self.filled(field)?);
                let values = self.distances(&given.values, Precision::F64);
                let mut arrays = vec![("values", NpyArray::c([given.values.len()], values))];
                let knots = given.knots.iter().map(|k| NpyArray::vector(k));
                arrays.extend(["x", "y", "z"].into_iter().zip(knots));
                arrays
            }
            Layout::Curobo | Layout::Curobo07 => {
                bail!("cuRobo's grids are 3-D; the map is 2-D")
            }
        };
        arrays.extend(self.labels());
        Ok(arrays)
    }

    fn plain<const D: usize>(&self, field: &EsdfGrid<D>) -> anyhow::Result<Vec<(&'static str, NpyArray)>> {
        let distances = match self.unknown {
            Some(UnknownCells::Nan) => {
                let far = self.far.map_or(f32::INFINITY, |far| far as f32);
                field.samples().iter().map(|d| d.clamp(-far, far)).collect()
            }
            _ => self.filled(field)?.values,
        };
        let shape = field.grid().shape;
        let as_doubles = |values: &[f32]| values.iter().map(|d| f64::from(*d)).collect::<Vec<_>>();
        let (distance, status) = match self.order.unwrap_or_default() {
            Order::C => (
                NpyArray::c(shape, self.distances(&as_doubles(&c_order(&distances, shape)), Precision::F32)),
                NpyArray::c(shape, NpyValues::U8(c_order(&field.status_bytes(), shape))),
            ),
            Order::F => (
                NpyArray::fortran(shape, self.distances(&as_doubles(&distances), Precision::F32)),
                NpyArray::fortran(shape, NpyValues::U8(field.status_bytes())),
            ),
        };
        let mut arrays = vec![
            ("distance", distance),
            ("status", status),
            ("origin", NpyArray::vector(&field.grid().lattice.origin)),
            ("resolution", NpyArray::number(field.grid().lattice.resolution)),
            ("shape", NpyArray::c([D], NpyValues::I64(shape.iter().map(|n| *n as i64).collect()))),
            ("order", NpyArray::text(if self.order == Some(Order::F) { "F" } else { "C" })),
        ];
        arrays.extend(self.labels());
        Ok(arrays)
    }

    fn curobo(&self, field: &Filled<3>) -> Vec<(&'static str, NpyArray)> {
        let version =
            if self.layout == Layout::Curobo07 { CuroboVersion::UpTo07 } else { CuroboVersion::From08 };
        let grid = CuroboGrid::of(field, version);
        let values: Vec<f64> = grid.values.iter().map(|d| f64::from(*d)).collect();
        let mut arrays = vec![
            ("feature_tensor", NpyArray::c(grid.shape, self.distances(&values, Precision::F16))),
            ("dims", NpyArray::vector(&grid.dims)),
            ("pose", NpyArray::vector(&grid.pose)),
            ("voxel_size", NpyArray::number(grid.voxel_size)),
        ];
        arrays.extend(self.labels());
        arrays
    }

    /// Names of the layout and of what unknown cells count as, as arrays.
    fn labels(&self) -> [(&'static str, NpyArray); 2] {
        let layout = match self.layout {
            Layout::Plain => "plain",
            Layout::Gpmp2 => "gpmp2",
            Layout::Casadi => "casadi",
            Layout::Curobo => "curobo",
            Layout::Curobo07 => "curobo07",
        };
        let unknown = UnknownCells::word(self.unknown);
        [("layout", NpyArray::text(layout)), ("unknown_as", NpyArray::text(unknown))]
    }

    /// The field without unknown.
    fn filled<const D: usize>(&self, field: &EsdfGrid<D>) -> anyhow::Result<Filled<D>> {
        let Some(space) = UnknownCells::space(self.unknown) else {
            return Err(bad_call("--unknown nan is only for --layout plain: planners take no NaN"));
        };
        let largest = field.samples().iter().filter(|d| d.is_finite()).fold(0.0f32, |m, d| m.max(d.abs()));
        let far = self.far.unwrap_or(f64::from(largest).max(field.grid().lattice.resolution));
        Ok(Filled::new(field.grid(), field.samples(), space, far)?)
    }

    fn distances(&self, values: &[f64], usual: Precision) -> NpyValues {
        match self.precision.unwrap_or(usual) {
            Precision::F16 => NpyValues::F16(values.iter().map(|d| f16_from_f32(*d as f32)).collect()),
            Precision::F32 => NpyValues::F32(values.iter().map(|d| *d as f32).collect()),
            Precision::F64 => NpyValues::F64(values.to_vec()),
        }
    }
}
