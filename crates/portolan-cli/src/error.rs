//! How a failed run ends.

use std::io::{self, Write};

use crate::stop::Signal;

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

/// A signal ended the run, which says what it leaves.
#[derive(Debug)]
struct Stopped(Signal, String);

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ended by {}: {}", self.0.name(), self.1)
    }
}

impl std::error::Error for Stopped {}

/// An error that ends the run with the status of a signal: what it leaves.
pub(crate) fn stopped(signal: Signal, leaves: impl Into<String>) -> anyhow::Error {
    Stopped(signal, leaves.into()).into()
}

/// What was wrong with a call, in one line: the rest of what clap says is the usage of the command line.
pub(crate) fn in_words(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    first.strip_prefix("error: ").unwrap_or(first).to_owned()
}

/// Prints to stderr, in one line, what went wrong; gives the exit status.
pub(crate) fn report(error: &anyhow::Error) -> u8 {
    // Whoever reads the output may stop early (`head`): not an error.
    if error.chain().any(|e| e.downcast_ref::<io::Error>().is_some_and(closed)) {
        return 0;
    }
    let text: String = format!("{error:#}").chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Without a stderr the text goes nowhere.
    let _ = writeln!(io::stderr(), "portolan: {text}");
    match error.downcast_ref::<Stopped>() {
        Some(Stopped(signal, _)) => signal.exit_status(),
        None if error.is::<BadCall>() => 2,
        None => 1,
    }
}

fn closed(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::BrokenPipe
}
