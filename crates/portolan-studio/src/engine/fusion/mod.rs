//! The lap, scan by scan: the truncated field, its cells' filters, and the chair's ghost.

mod ask;
mod beside;
mod chair;
pub(super) mod frame;
pub(super) mod inspect;
mod page_copy;
mod scans;
mod settings;
mod state;
#[cfg(test)]
mod tests;

pub(super) use beside::Beside;
pub(super) use state::Fusion;
