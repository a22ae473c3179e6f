//! A progress bar on stderr.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::arguments::shown_bytes;
use crate::output::Output;

/// A bar over `length` steps; hidden where stderr is not a terminal, and with --quiet. The bar removes
/// itself when it is dropped.
pub(crate) struct Progress {
    bar: ProgressBar,
    what: &'static str,
}

impl Progress {
    pub(crate) fn new(length: usize, what: &'static str, output: Output) -> Self {
        let shown = !output.quiet && std::io::stderr().is_terminal();
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(length as u64), target);
        if let Ok(style) =
            ProgressStyle::with_template("{msg} [{wide_bar}] {pos}/{len} {per_sec} {percent}% eta {eta}")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(what);
        Self { bar, what }
    }

    /// `steps` more are done; may be called from any thread.
    pub(crate) fn add(&self, steps: u64) {
        self.bar.inc(steps);
    }

    /// Shows how many bytes are held now; they are counted only where the bar is shown.
    pub(crate) fn holding(&self, bytes: impl FnOnce() -> usize) {
        if !self.bar.is_hidden() {
            self.bar.set_message(format!("{}, {}", self.what, shown_bytes(bytes() as f64)));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
