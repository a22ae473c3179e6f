//! Space: a log is fused frame by frame, and its mesh follows brick by brick.
//!
//! [`ask`] is what can be asked, [`settings`] and [`source`] what is fused and how, [`state`] the maps and what they are
//! at; [`drawn`] is what the page has of the mesh, laid out in ranges by [`ranges`] and coloured by [`shade`]; [`slice`]
//! cuts the fields, [`voxel`] and [`history`] look at one cell.

mod ask;
mod drawn;
mod export;
mod history;
mod made;
mod ranges;
mod settings;
mod shade;
mod slice;
mod source;
mod state;
#[cfg(test)]
mod tests;
mod voxel;

pub(super) use state::Space;
