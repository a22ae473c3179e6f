//! How a failed run ends.

use std::io::{self, Write};
use std::process::ExitCode;

/// The call was bad, whatever the files hold: exit status 2.
#[derive(Debug)]
struct BadCall(String);

impl std::fmt::Display for BadCall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadCall {}

/// An error that ends the run with status 2: settings that contradict each other.
pub(crate) fn bad_call(text: impl Into<String>) -> anyhow::Error {
    BadCall(text.into()).into()
}

/// Prints to stderr, in one line, what went wrong; gives the exit status.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    // Whoever reads the output may stop early (`head`): not an error.
    if error.chain().any(|e| e.downcast_ref::<io::Error>().is_some_and(closed)) {
        return ExitCode::SUCCESS;
    }
    let text: String = format!("{error:#}").chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Without a stderr the text goes nowhere.
    let _ = writeln!(io::stderr(), "portolan: {text}");
    ExitCode::from(if error.is::<BadCall>() { 2 } else { 1 })
}

fn closed(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::BrokenPipe
}
