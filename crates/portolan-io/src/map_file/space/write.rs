//! Writing a `map.portolan` of space.

use std::path::Path;

use portolan::cell::{Cell, LogOdds8, LogOddsValue, Planes};
use portolan::geom::BlockKey;
use portolan::store::Bricks;

use super::super::part_name;
use super::super::writing::{begin, finish};
use super::SpaceMapFile;
use super::entry::Entry;
use crate::{ContainerWriter, IoError};

/// A plane of bricks is cut into chunks of so many bricks, so that only one of them is in memory beside the map.
const BRICKS: usize = 1 << 15;

impl SpaceMapFile {
    /// Writes the file. The same maps make the same bytes, in whatever order their bricks came to be.
    ///
    /// # Errors
    /// As [`crate::write_atomic`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        self.writer()?.write(path)
    }

    /// The file in memory.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where a map does not fit the format.
    pub fn to_bytes(&self) -> Result<Vec<u8>, IoError> {
        Ok(self.writer()?.to_bytes())
    }

    fn writer(&self) -> Result<ContainerWriter, IoError> {
        let mut writer = begin(&self.header, 3, self.entries(), &self.unknown_maps)?;
        if let Some(map) = &self.occupancy {
            write_keys(&mut writer, "OBRICKS", &map.store)?;
            write_plane(&mut writer, "OBRICKS", "occupancy", &map.store, |brick, bytes| {
                let cell = |i| brick.get(i).unwrap_or(LogOdds8::UNOBSERVED).0 as u8;
                bytes.extend((0..brick.len()).map(cell));
            })?;
        }
        if let Some(map) = &self.tsdf {
            let floats = |plane: &[f32], bytes: &mut Vec<u8>| {
                bytes.extend(plane.iter().flat_map(|v| v.to_le_bytes()));
            };
            write_keys(&mut writer, "TBRICKS", &map.store)?;
            write_plane(&mut writer, "TBRICKS", "distance", &map.store, |b, to| floats(b.distances(), to))?;
            write_plane(&mut writer, "TBRICKS", "weight", &map.store, |b, to| floats(b.weights(), to))?;
        }
        if let Some(map) = &self.colors {
            write_keys(&mut writer, "CBRICKS", &map.store)?;
            write_plane(&mut writer, "CBRICKS", "color", &map.store, |brick, bytes| {
                bytes.extend(brick.words().as_flattened().iter().flat_map(|v| v.to_le_bytes()));
            })?;
        }
        finish(&mut writer, &self.poses, &self.unknown_chunks)?;
        Ok(writer)
    }

    fn entries(&self) -> Vec<Entry> {
        let maps = [
            self.occupancy.as_ref().map(Entry::of_occupancy),
            self.tsdf.as_ref().map(Entry::of_tsdf),
            self.colors.as_ref().map(Entry::of_colors),
        ];
        maps.into_iter().flatten().collect()
    }
}

/// Chunks of what `content` says of each key, in the order of the keys.
fn write_parts(
    writer: &mut ContainerWriter,
    tag: &str,
    name: &str,
    keys: &[BlockKey<3>],
    content: impl Fn(BlockKey<3>, &mut Vec<u8>),
) -> Result<(), IoError> {
    if keys.is_empty() {
        return writer.chunk(tag, name, &[]);
    }
    let mut bytes = Vec::new();
    for (part, keys) in keys.chunks(BRICKS).enumerate() {
        bytes.clear();
        keys.iter().for_each(|&key| content(key, &mut bytes));
        writer.chunk(tag, &part_name(name, part), &bytes)?;
    }
    Ok(())
}

fn write_keys<C: Cell>(writer: &mut ContainerWriter, tag: &str, store: &Bricks<C, 3>) -> Result<(), IoError> {
    write_parts(writer, tag, "keys", &store.keys(), |key, bytes| {
        bytes.extend(key.0.iter().flat_map(|v| v.to_le_bytes()));
    })
}

fn write_plane<C: Cell>(
    writer: &mut ContainerWriter,
    tag: &str,
    name: &str,
    store: &Bricks<C, 3>,
    content: impl Fn(&C::Brick, &mut Vec<u8>),
) -> Result<(), IoError> {
    write_parts(writer, tag, name, &store.keys(), |key, bytes| {
        if let Some(brick) = store.brick(key) {
            content(brick, bytes);
        }
    })
}
