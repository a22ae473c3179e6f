//! Settings of a mapper, before its dimension is known.

use portolan::geom::Aabb;
use portolan::map::BeamSweep;
use portolan::mapper::MapperSettings;
use portolan::sweep::WeightModel;
use pyo3::prelude::*;

use crate::fault::value_error;

/// What was asked for.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    pub(crate) resolution: f64,
    pub(crate) truncation: Option<f64>,
    pub(crate) w_max: Option<f32>,
    pub(crate) carve: bool,
    pub(crate) carve_weight: Option<f32>,
    pub(crate) weights: WeightModel,
    pub(crate) sweep: Option<SweepWord>,
    pub(crate) occupancy: bool,
    pub(crate) attenuation: bool,
    pub(crate) distances: bool,
    pub(crate) color: bool,
    pub(crate) max_distance: f64,
    pub(crate) thin: Option<f64>,
    pub(crate) bounds: Option<Vec<f64>>,
    pub(crate) origin: Option<Vec<f64>>,
    pub(crate) memory: usize,
}

/// How scans become evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SweepWord {
    CellCentre,
    March,
    Auto,
    Exact,
}

/// The word of `weights`.
pub(crate) fn weights_of(word: &str) -> PyResult<WeightModel> {
    Ok(match word {
        "constant" => WeightModel::Constant,
        "range" => WeightModel::InverseSquare,
        "incidence" => WeightModel::CosIncidence,
        "range-incidence" => WeightModel::InverseSquareCosIncidence,
        _ => {
            return Err(value_error(format!(
                "weights: must be constant, range, incidence or range-incidence, got {word:?}"
            )));
        }
    })
}

/// The word of `sweep`.
pub(crate) fn sweep_of(word: &str) -> PyResult<SweepWord> {
    Ok(match word {
        "cell-centre" => SweepWord::CellCentre,
        "march" => SweepWord::March,
        "auto" => SweepWord::Auto,
        "exact" => SweepWord::Exact,
        _ => {
            return Err(value_error(format!(
                "sweep: must be cell-centre or march in 2-D, auto or exact in 3-D, got {word:?}"
            )));
        }
    })
}

impl Options {
    /// The usual ones, for maps that are there already.
    pub(crate) fn usual(resolution: f64) -> Self {
        Self {
            resolution,
            truncation: None,
            w_max: None,
            carve: true,
            carve_weight: None,
            weights: WeightModel::default(),
            sweep: None,
            occupancy: true,
            attenuation: true,
            distances: true,
            color: true,
            max_distance: 1.0,
            thin: None,
            bounds: None,
            origin: None,
            memory: usize::MAX,
        }
    }

    /// Refuses what no dimension can have, before the first scan.
    pub(crate) fn check(&self) -> PyResult<()> {
        let length = |name: &str, v: f64| match v > 0.0 && v.is_finite() {
            true => Ok(()),
            false => {
                Err(value_error(format!("{name}: must be a positive, finite length in meters, got {v}")))
            }
        };
        length("resolution", self.resolution)?;
        self.truncation.map_or(Ok(()), |v| length("truncation", v))?;
        length("max_distance", self.max_distance)?;
        if let Some(w) = self.w_max.filter(|w| !(*w > 0.0)) {
            return Err(value_error(format!("w_max: must be a positive number, got {w}")));
        }
        if let Some(w) = self.carve_weight.filter(|w| !(*w > 0.0 && *w <= 1.0)) {
            return Err(value_error(format!("carve_weight: must be above 0 and at most 1, got {w}")));
        }
        if let Some(share) = self.thin.filter(|share| !(0.0..1.0).contains(share)) {
            return Err(value_error(format!("thin: must be 0 or a share below 1, got {share}")));
        }
        if !(self.occupancy || self.attenuation || self.distances) {
            return Err(value_error("occupancy, attenuation, distances: at least one map must be made"));
        }
        Ok(())
    }

    /// The dimension that a setting asks for, where one does.
    pub(crate) fn dimension(&self) -> PyResult<Option<usize>> {
        let of_sweep = match self.sweep {
            Some(SweepWord::CellCentre | SweepWord::March) => Some(2),
            Some(SweepWord::Auto | SweepWord::Exact) => Some(3),
            None => None,
        };
        let of_bounds = match &self.bounds {
            Some(v) if v.len() == 4 || v.len() == 6 => Some(v.len() / 2),
            Some(v) => {
                return Err(value_error(format!(
                    "bounds: must be x0, y0, x1, y1 or x0, y0, z0, x1, y1, z1, got {} numbers",
                    v.len()
                )));
            }
            None => None,
        };
        let of_origin = match &self.origin {
            Some(v) if v.len() == 2 || v.len() == 3 => Some(v.len()),
            Some(v) => {
                return Err(value_error(format!("origin: must be 2 or 3 numbers, got {}", v.len())));
            }
            None => None,
        };
        let all = [("sweep", of_sweep), ("bounds", of_bounds), ("origin", of_origin)];
        let mut given = all.into_iter().filter_map(|(name, d)| Some((name, d?)));
        let Some((first, d)) = given.next() else { return Ok(None) };
        match given.find(|(_, other)| *other != d) {
            Some((name, other)) => Err(value_error(format!("{name} is for {other}-D and {first} for {d}-D"))),
            None => Ok(Some(d)),
        }
    }

    /// As the library takes them.
    pub(crate) fn settings<const D: usize>(&self) -> PyResult<MapperSettings<D>> {
        if let Some(d) = self.dimension()?.filter(|d| *d != D) {
            return Err(value_error(format!(
                "the scan is {D}-D, and the mapper was made for {d}-D (sweep, bounds, origin)"
            )));
        }
        let bounds = self.bounds.as_deref().map(|v| {
            let corner = |from: usize| std::array::from_fn::<_, D, _>(|k| v[from + k]);
            let (min, max) = (corner(0), corner(D));
            match (0..D).all(|k| min[k] < max[k]) {
                true => Ok(Aabb::new(min, max)),
                false => Err(value_error(format!(
                    "bounds: every lower bound must be below the upper one, got {v:?}"
                ))),
            }
        });
        let usual = MapperSettings::<D>::new(self.resolution);
        Ok(MapperSettings {
            truncation: self.truncation,
            w_max: self.w_max.unwrap_or(usual.w_max),
            carve: self.carve,
            carve_weight: self.carve_weight.unwrap_or(usual.carve_weight),
            weights: self.weights,
            beams: if self.sweep == Some(SweepWord::March) {
                BeamSweep::March
            } else {
                BeamSweep::CellCentre
            },
            exact: self.sweep == Some(SweepWord::Exact),
            occupancy: usual.occupancy.filter(|_| self.occupancy),
            attenuation: usual.attenuation.filter(|_| self.attenuation),
            distances: self.distances,
            color: self.color,
            max_distance: self.max_distance,
            thin: self.thin.unwrap_or(usual.thin),
            bounds: bounds.transpose()?,
            origin: self.origin.as_deref().map(|v| std::array::from_fn(|k| v[k])),
            memory: self.memory,
            ..usual
        })
    }
}
