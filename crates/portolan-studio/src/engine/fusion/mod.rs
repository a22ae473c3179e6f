//! The lap, scan by scan: the truncated field, its cells' filters, and the chair's ghost.

mod ask;
mod chair;
pub(super) mod frame;
mod inspect;
mod page_copy;
mod scans;
mod settings;
mod state;
#[cfg(test)]
mod tests;

pub(super) use state::Fusion;
