//! Ctrl-C and SIGTERM: every command ends in time, and says what it leaves.
//!
//! Commands end at once, unless they have something to save ([`hold`]): then the first signal is a request ([`asked`]), and
//! the second one ends the run at once. The exit status is 128 and the number of the signal, as shells have it. Without
//! [`listen`] (inside of another program) signals are not ours to take.

use std::io::{self, Write};
use std::sync::{Condvar, Mutex, MutexGuard};

/// A request to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Signal {
    /// Ctrl-C.
    Interrupt,
    /// What `kill`, `docker stop` and systemd send.
    Terminate,
}

impl Signal {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Interrupt => "SIGINT",
            Self::Terminate => "SIGTERM",
        }
    }

    /// Of a run that it ended.
    pub(crate) fn exit_status(self) -> u8 {
        match self {
            Self::Interrupt => 128 + 2,
            Self::Terminate => 128 + 15,
        }
    }
}

struct State {
    listens: bool,
    /// Whether a first signal is a request.
    holds: bool,
    asked: Option<Signal>,
    /// What a run that ends here leaves.
    leaves: String,
}

static STATE: Mutex<State> =
    Mutex::new(State { listens: false, holds: false, asked: None, leaves: String::new() });
static ASKED: Condvar = Condvar::new();

fn state() -> MutexGuard<'static, State> {
    // There is nothing in it that a panic could leave half.
    STATE.lock().unwrap_or_else(|held| held.into_inner())
}

/// Takes the signals of this process from here on.
///
/// # Errors
/// Where the system refuses.
#[cfg(unix)]
pub(crate) fn listen() -> io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever() {
            take(if signal == SIGINT { Signal::Interrupt } else { Signal::Terminate });
        }
    })?;
    state().listens = true;
    Ok(())
}

/// Elsewhere the system ends the process.
#[cfg(not(unix))]
pub(crate) fn listen() -> io::Result<()> {
    Ok(())
}

#[cfg(unix)]
fn take(signal: Signal) {
    let mut state = state();
    if state.holds && state.asked.is_none() {
        state.asked = Some(signal);
        ASKED.notify_all();
        return;
    }
    let leaves = if state.leaves.is_empty() { String::new() } else { format!(": {}", state.leaves) };
    // Without a stderr the text goes nowhere.
    let _ = writeln!(io::stderr(), "portolan: ended by {}{leaves}", signal.name());
    std::process::exit(signal.exit_status().into());
}

/// While this is there, the first signal is a request: the command looks for it and ends by itself.
pub(crate) struct Hold(());

/// See [`Hold`].
pub(crate) fn hold() -> Hold {
    state().holds = true;
    Hold(())
}

impl Drop for Hold {
    fn drop(&mut self) {
        state().holds = false;
    }
}

/// The signal that asked to end.
pub(crate) fn asked() -> Option<Signal> {
    state().asked
}

/// What a run that is ended at once leaves, in words, from here on.
pub(crate) fn leaves(words: impl Into<String>) {
    state().leaves = words.into();
}

/// Waits for a signal; `None` at once where they are not ours.
pub(crate) fn wait() -> Option<Signal> {
    let _hold = hold();
    let mut state = state();
    while state.listens && state.asked.is_none() {
        state = ASKED.wait(state).unwrap_or_else(|held| held.into_inner());
    }
    state.asked
}
