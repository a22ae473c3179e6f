//! Rendering as a measurement model: a radiance field on a line, fitted through its renderer.
//!
//! Not a map to plan with. A fit by gradient descent gives a point and no posterior uncertainty (there is
//! no closed form of one), so nothing here offers any; its depth is biased by construction, its optimum
//! depends on the start, and density behind an opaque bin is never corrected. Where ranges are measured, a
//! [`scan`](portolan::scan) fused into a map is the better estimate. This module shows the mechanism that
//! radiance fields and splats share, where it can be seen whole: on a line.
//!
//! A renderer that can be differentiated is a measurement model, and fitting a field to what was measured
//! is estimation of the maximum of the posterior: `p(θ | z) ∝ Π p(z_r | θ) p(θ)` with Gaussian noise on
//! what a ray renders.
//!
//! ```text
//!  Line (θ, φ) --samples--> render --z, c--> residual / s² = Upstream
//!       ^                                          |
//!       +---- Optimizer <---- SampleGradient <---- backward
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `ray` | the integral along one ray and its gradient; in samples, not in bins: a field of any dimension can use it |
//! | `line` | the field: bins on a line, and how a ray cuts them into samples |
//! | `model` | noise, prior, parametrisation, measured channels |
//! | `fit` | gradient descent and Adam |
//! | `explain` | the factors of one bin's gradient, ray by ray |
//! | `scene`, `experiment` | the toy: a corridor, ten rays, random starts, named seeds |
//!
//! ```
//! use portolan_chapter::radiance::{Channels, Experiment, PARKED};
//! let experiment = Experiment { steps: 2_000, ..Experiment::default() };
//! let outcome = experiment.run(PARKED.seed, Channels::DepthReflectance)?;
//! assert!(outcome.last().training.depth < outcome.curve[0].training.depth);
//! # Ok::<(), portolan_chapter::radiance::FitError>(())
//! ```
//!
//! Sources: Mildenhall et al. 2020 (section 4), Max 1995 (doi:10.1109/2945.468400), Kingma & Ba 2015.

mod experiment;
mod explain;
mod fit;
mod line;
mod model;
mod ray;
mod scene;
mod settings;

pub use experiment::{
    AMBIGUOUS, Experiment, LUCKY, NAMED_SEEDS, NamedSeed, OPAQUE, Outcome, PARKED, Progress, TWO_NOT_ENOUGH,
    transmittance,
};
pub use explain::{Sum, Term, Terms};
pub use fit::{Fit, Report, Residuals};
pub use line::{COLORS, Crossing, Far, Line, LineRay};
pub use model::{Channels, Measurement, Noise, Prior, logistic, softplus, softplus_inverse};
pub use ray::{Background, Passage, Rendered, Sample, SampleGradient, Upstream, backward, opacity, render};
pub use scene::{Body, Scene};
pub use settings::{FitError, Optimizer, Settings};
