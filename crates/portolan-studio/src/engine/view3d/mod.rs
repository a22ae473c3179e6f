//! View3d: a log is fused frame by frame, and its mesh follows brick by brick.
//!
//! [`ask`] is what can be asked, [`settings`] and [`source`] what is fused and how, [`state`] the maps and what they are
//! at; [`buffers`] is what the page has of the mesh, laid out in ranges by [`ranges`] and coloured by [`shade`]; [`slice`]
//! cuts the fields, [`voxel`] and [`history`] look at one cell.

mod ask;
mod export;
mod history;
mod maps;
mod mesh_buffers;
mod ranges;
mod settings;
mod shade;
mod slice;
mod source;
mod state;
#[cfg(test)]
mod tests;
mod voxel;

pub(super) use state::View3d;
