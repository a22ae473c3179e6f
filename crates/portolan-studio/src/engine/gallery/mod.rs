//! The same log in every representation: what each costs, how true its answers are, who wins which workload.

mod answers;
mod ask;
mod built;
mod picture;
mod report;
mod state;
#[cfg(test)]
mod tests;

pub(super) use state::Gallery;
