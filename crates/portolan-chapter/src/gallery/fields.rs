//! One distance field by each method.

use super::probes::{Clock, seconds_of};
use portolan::field::{Esdf, EsdfGrid, EsdfMethod, EsdfSettings};
use portolan::geom::vector;
use portolan::map::Tsdf2;
use portolan_sim::ErrorSummary;

/// A distance field of the TSDF, and how far to trust it.
#[derive(Debug)]
pub struct MeasuredField {
    /// How it was made.
    pub method: EsdfMethod,
    /// Distances at the cell centers.
    pub field: EsdfGrid<2>,
    /// Seconds of a full rebuild.
    pub seconds: f64,
    /// Interpolated distance less the exact distance to the extracted contour (meters), at observed free points more than
    /// 5 cm from it.
    pub against_contour: Option<ErrorSummary>,
    /// Interpolated distance less the true one (meters) at observed free points; `None` without a truth.
    pub against_truth: Option<ErrorSummary>,
    /// Median gradient norm at the same points.
    pub gradient: f64,
}

impl MeasuredField {
    /// A name for tables.
    pub fn name(&self) -> &'static str {
        match self.method {
            EsdfMethod::Accurate => "accurate",
            EsdfMethod::Seeded { .. } => "the chapter's seeds",
            EsdfMethod::Mask => "binary mask",
        }
    }
}

/// The field by every method, the accurate one first.
pub(super) fn fields_of(clock: &mut Clock<'_>, tsdf: &Tsdf2, settings: &EsdfSettings) -> [MeasuredField; 3] {
    let max_distance = vector::norm(tsdf.grid().aabb().extent()).max(tsdf.grid().lattice.resolution);
    [EsdfMethod::Accurate, EsdfMethod::TEXTBOOK, EsdfMethod::Mask].map(|method| {
        let how = EsdfSettings { max_distance, method, unknown: false, ..*settings };
        let (seconds, field) = seconds_of(clock, || Esdf::of(tsdf, &how).dense(tsdf.grid()));
        let (against_contour, against_truth, gradient) = (None, None, f64::NAN);
        MeasuredField { method, field, seconds, against_contour, against_truth, gradient }
    })
}

/// Error at these points against their exact distances to the contour, where those are more than 5 cm.
pub(super) fn against_contour(
    field: &EsdfGrid<2>,
    probes: &[[f64; 2]],
    exact: &[Option<f64>],
) -> Option<ErrorSummary> {
    let error = |(&p, exact): (&[f64; 2], &Option<f64>)| {
        let exact = exact.filter(|d| *d > 0.05)?;
        Some(field.distance(p).known()?.abs() - exact)
    };
    ErrorSummary::of(probes.iter().zip(exact).filter_map(error).collect())
}
