//! What every command offers for its output, and how it gets out.

use std::fmt::Display;
use std::io::{self, Write};

use serde_json::Value;

/// Flags that every command has.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct Output {
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Print no progress and no summary
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

impl Output {
    /// Prints the JSON document, or the text for people, or nothing.
    pub(crate) fn print(&self, document: &Value, text: impl Display) -> anyhow::Result<()> {
        let mut out = io::stdout().lock();
        if self.json {
            writeln!(out, "{document:#}")?;
        } else if !self.quiet {
            write!(out, "{text}")?;
        }
        out.flush()?;
        Ok(())
    }
}
