//! How sure the surface is, by the beginning and the end of the log that it was made of.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use portolan::cell::DistanceSum;
use portolan::store::Bricks;
use portolan::uncertainty::{Coverage, FEWEST_DISPLACEMENTS, SurfaceSigma, displacements};
use portolan_io::write_atomic;
use serde_json::{Value, json};

/// The file of the standard deviation, beside the map.
pub(crate) const SIGMA_FILE: &str = "sigma.json";

/// A standard deviation of the surface, and what it is worth where it was not fitted.
#[derive(Debug)]
pub(crate) struct Calibration {
    sigma: SurfaceSigma,
    coverage: Coverage,
}

impl Calibration {
    /// By the sums of the beginning of a log, of what is before its end, and of all of it.
    ///
    /// # Errors
    /// Why they do not tell.
    pub(super) fn of<const D: usize>(
        sums: [&Bricks<DistanceSum, D>; 3],
        truncation: f64,
    ) -> Result<Self, String> {
        let all = displacements(sums, truncation);
        let fitted = all.iter().filter(|d| d.fitted).count();
        let few = || {
            format!(
                "the first and the last two fifths of the log saw the same surface in {} cells, {fitted} of them to be fitted \
                 to, and {} are needed: it is the log of one visit, or of little surface",
                all.len(),
                FEWEST_DISPLACEMENTS
            )
        };
        let sigma = SurfaceSigma::fitted(all.iter().filter(|d| d.fitted).copied()).ok_or_else(few)?;
        let coverage = Coverage::of(&sigma, &all).ok_or_else(few)?;
        Ok(Self { sigma, coverage })
    }

    pub(super) fn sigma(&self) -> &SurfaceSigma {
        &self.sigma
    }

    pub(crate) fn to_json(&self) -> Value {
        let quarter = |q: &portolan::uncertainty::Quarter| json!({ "sigma": q.sigma, "median": q.median, "within_95": q.within_95 });
        json!({
            "weights": self.sigma.knots().iter().map(|[weight, _]| weight).collect::<Vec<_>>(),
            "sigmas": self.sigma.knots().iter().map(|[_, sigma]| sigma).collect::<Vec<_>>(),
            "displacements": self.coverage.count,
            "within_95": self.coverage.within_95,
            "quarters": self.coverage.quarters.iter().map(quarter).collect::<Vec<_>>(),
        })
    }

    /// For people.
    pub(crate) fn in_words(&self) -> String {
        let knots = self.sigma.knots();
        let ends = [knots.first(), knots.last()]
            .map(|knot| knot.map_or(String::new(), |[_, sigma]| format!("{:.1} mm", 1e3 * sigma)));
        let quarters = self.coverage.quarters.map(|q| format!("{:.1}", 100.0 * q.within_95)).join(", ");
        format!(
            "the surface is known to {} where little was seen of it, to {} where much was (standard deviations): of {} \
             displacements between the beginning and the end of the log {:.1} % are within their 95 % (by quarters of what was predicted \
             {quarters} %)",
            ends[0],
            ends[1],
            self.coverage.count,
            100.0 * self.coverage.within_95
        )
    }

    /// What it is worth, quarter by quarter of what was predicted: a table for people.
    pub(crate) fn table(&self) -> String {
        let mut text = String::from("predicted sigma   median displacement   within 95 %\n");
        for q in &self.coverage.quarters {
            let [sigma, median] = [q.sigma, q.median].map(|v| format!("{:.2} mm", 1e3 * v));
            text += &format!("{sigma:>15}   {median:>19}   {:>9.1} %\n", 100.0 * q.within_95);
        }
        text
    }

    /// Writes the file.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        let document = self.to_json();
        Ok(write_atomic(path, |w| writeln!(w, "{document:#}"))?)
    }
}

/// The standard deviation in a file that `map --ledger` wrote.
pub(crate) fn read_sigma(path: &Path) -> anyhow::Result<SurfaceSigma> {
    let text = std::fs::read(path).with_context(|| {
        format!("{}: cannot be read; `map --ledger` writes it where a log has two visits", path.display())
    })?;
    let value: Value = serde_json::from_slice(&text).with_context(|| path.display().to_string())?;
    let numbers = |key: &str| {
        value[key].as_array().map(|all| all.iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect())
    };
    let knots: Option<(Vec<f64>, Vec<f64>)> = numbers("weights").zip(numbers("sigmas"));
    let curve =
        knots.filter(|(weights, sigmas)| weights.len() == sigmas.len()).and_then(|(weights, sigmas)| {
            SurfaceSigma::through(weights.into_iter().zip(sigmas).map(|(weight, sigma)| [weight, sigma]))
        });
    curve.with_context(|| {
        format!(
            "{}: weights and sigmas are no curve: as many of each, above zero, weights ascending are wanted",
            path.display()
        )
    })
}
