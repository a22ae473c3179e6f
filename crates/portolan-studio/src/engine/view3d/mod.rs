//! 3-D: a log is fused frame by frame, and its mesh follows brick by brick.
//!
//! | module | what |
//! |---|---|
//! | [`ask`], [`answer`], [`queries`] | what can be asked, and the answers |
//! | [`settings`], [`source`] | the settings of a run, and its frames |
//! | [`state`], [`maps`] | the view, and the maps of a run |
//! | [`mesh_buffers`], [`ranges`], [`shade`] | the page's copy of the mesh, its layout and its colors |
//! | [`slice`], [`voxel`], [`history`] | a layer of a field, one cell, and what each frame did to it |
//! | [`export`] | files to save |

mod answer;
mod ask;
mod export;
mod history;
mod maps;
mod mesh_buffers;
mod queries;
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
