//! The inverse sensor model of occupancy, in probabilities.

/// What a hit and a miss say, and how sure a cell may become.
///
/// Defaults are OctoMap's (Hornung et al. 2013, section 4): hit 0.7, miss 0.4, clamped to [0.12, 0.97].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccupancyModel {
    /// P(occupied) of a cell in which a beam ended, on this evidence alone.
    pub p_hit: f64,
    /// P(occupied) of a cell through which beams passed, on this evidence alone.
    pub p_miss: f64,
    /// Lower clamp of P(occupied).
    pub p_min: f64,
    /// Upper clamp of P(occupied).
    pub p_max: f64,
    /// P(occupied) before any evidence, `l_0` in log odds. Not what an unobserved cell answers.
    pub p_prior: f64,
    /// Depth of what a beam calls occupied (meters), alpha in (Thrun, Burgard & Fox 2005): cells whose center is
    /// within half of it of the range are hit. `None`: one cell edge. The cell that holds the end point is always hit.
    pub wall_depth: Option<f64>,
}

impl Default for OccupancyModel {
    fn default() -> Self {
        Self { p_hit: 0.7, p_miss: 0.4, p_min: 0.12, p_max: 0.97, p_prior: 0.5, wall_depth: None }
    }
}

/// What is wrong with an [`OccupancyModel`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OccupancyModelError {
    /// The probabilities are not in order.
    #[error(
        "occupancy model: need 0 < p_min <= p_miss < p_prior < p_hit <= p_max < 1 and p_min < 0.5 < p_max, got {0:?}"
    )]
    Order(OccupancyModel),
    /// A byte does not hold the lower clamp: it holds log odds as far below zero as above.
    #[error(
        "occupancy model: a byte holds no p_min of {p_min} beside p_max {p_max}; it must be at least 1 - p_max (cells of f32 hold any)"
    )]
    TooSure {
        /// The lower clamp.
        p_min: f64,
        /// The upper one.
        p_max: f64,
    },
    /// The wall depth is negative or not finite.
    #[error("occupancy model: wall_depth must be finite and not negative, got {0}")]
    WallDepth(f64),
}

impl OccupancyModel {
    /// Checks the settings; the constructors of maps call it.
    ///
    /// # Errors
    /// Says which setting is out of order.
    pub fn validate(&self) -> Result<(), OccupancyModelError> {
        let ordered = 0.0 < self.p_min
            && self.p_min <= self.p_miss
            && self.p_miss < self.p_prior
            && self.p_prior < self.p_hit
            && self.p_hit <= self.p_max
            && self.p_max < 1.0
            && self.p_min < 0.5
            && 0.5 < self.p_max;
        if !ordered {
            return Err(OccupancyModelError::Order(*self));
        }
        match self.wall_depth {
            Some(depth) if !(depth.is_finite() && depth >= 0.0) => Err(OccupancyModelError::WallDepth(depth)),
            _ => Ok(()),
        }
    }
}

/// `ln(p / (1 - p))`.
pub(super) fn logit(p: f64) -> f64 {
    (p / (1.0 - p)).ln()
}
