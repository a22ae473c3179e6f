//! The renderer on a line: a field of eighty bins, fitted through what ten rays render, step by step.

mod answer;
mod ask;
mod curve;
mod run;
mod selection;
mod state;
#[cfg(test)]
mod tests;

pub(super) use state::Radiance;
