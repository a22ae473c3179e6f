//! Writing a `map.portolan`.

use std::path::Path;

use portolan::cell::{LENGTH_UNITS, LogOdds8, LogOddsValue, Planes};
use portolan::geom::Pose;
use portolan::store::{Store, Tree};
use serde_json::{Map, Value, json};

use super::bricks::{write_bricks, write_keys};
use super::header::{Entry, Place};
use super::kind::Kind;
use super::ledger;
use super::settings::{
    AttenuationSettings, ColorSettings, OccupancySettings, SWEEP, TsdfSettings, sweep_word,
};
use super::{AttenuationBricks, ColorBricks, MapFile, OccupancyBricks, TsdfBricks, VERSION, part_name};
use crate::{ContainerWriter, IoError, Result};

/// A dense plane is cut into chunks of this many bytes.
const CHUNK: usize = 1 << 30;

impl<const D: usize> MapFile<D> {
    /// Writes the file. The same maps make the same bytes, in whatever order their bricks came to be.
    ///
    /// # Errors
    /// As [`crate::write_atomic`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        self.writer()?.write(path)
    }

    /// The file in memory.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] where a map does not fit the format.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        Ok(self.writer()?.to_bytes())
    }

    fn writer(&self) -> Result<ContainerWriter> {
        let mut writer = ContainerWriter::new();
        let header = self.header_text().map_err(|e| {
            let advice = "give finite numbers";
            IoError::unwritable("map.portolan".as_ref(), "the header", e, advice)
        })?;
        writer.chunk("HEAD", "", header.as_bytes())?;
        if let Some(ledger) = &self.ledger {
            ledger::write(ledger, &mut writer)?;
        } else {
            self.write_dense(&mut writer)?;
            self.write_bricks(&mut writer)?;
            if !self.poses.is_empty() {
                write_plane(&mut writer, "POSES", "sensor", &pose_bytes(&self.poses))?;
            }
        }
        self.unknown_chunks.iter().try_for_each(|c| writer.chunk(&c.tag, &c.name, &c.content))?;
        Ok(writer)
    }

    fn header_text(&self) -> serde_json::Result<String> {
        let mut maps = Vec::new();
        let entries = if self.ledger.is_some() { Vec::new() } else { self.entries()? };
        for entry in entries {
            maps.push(serde_json::to_value(entry)?);
        }
        maps.extend(self.unknown_maps.iter().cloned());
        let mut header = serde_json::to_value(&self.header)?;
        header["version"] = json!(VERSION);
        header["dimension"] = json!(D);
        header["maps"] = Value::Array(maps);
        if let Some(ledger) = &self.ledger {
            header[ledger::FIELD] = ledger::header(ledger.settings())?;
        }
        serde_json::to_string(&header)
    }

    fn entries(&self) -> serde_json::Result<Vec<Entry>> {
        let mut entries = Vec::new();
        if let Some(map) = &self.grid {
            let settings = OccupancySettings { model: *map.model(), more: Map::new() };
            entries.push(Entry::new::<D>(Kind::Grid, Place::of_grid(map.store().grid()), &settings)?);
        }
        if let Some(map) = &self.tree {
            let settings = OccupancySettings { model: *map.model(), more: Map::new() };
            let place = Place::of_lattice(map.store().lattice());
            let place = Place { depth: Some(map.store().depth()), ..place };
            entries.push(Entry::new::<D>(Kind::Tree, place, &settings)?);
        }
        if let Some(map) = &self.tsdf {
            let c = map.config();
            let more = Map::from_iter([(SWEEP.to_owned(), sweep_word(c.beams).into())]);
            let settings = TsdfSettings::new(c.truncation, c.w_max, c.carve_weight, c.weights, more);
            entries.push(Entry::new::<D>(Kind::Tsdf, Place::of_grid(map.store().grid()), &settings)?);
        }
        if let Some(OccupancyBricks { store, model, more }) = &self.occupancy_bricks {
            let settings = OccupancySettings { model: *model, more: more.clone() };
            let place = Place::of_lattice(store.lattice());
            entries.push(Entry::new::<D>(Kind::OccupancyBricks, place, &settings)?);
        }
        if let Some(map) = &self.tsdf_bricks {
            let TsdfBricks { truncation, w_max, carve_weight, weights, ref more, .. } = *map;
            let settings = TsdfSettings::new(truncation, w_max, carve_weight, weights, more.clone());
            let place = Place::of_lattice(map.store.lattice());
            entries.push(Entry::new::<D>(Kind::TsdfBricks, place, &settings)?);
        }
        if let Some(ColorBricks { store, w_max, more }) = &self.color_bricks {
            let settings = ColorSettings { w_max: *w_max, more: more.clone() };
            let place = Place::of_lattice(store.lattice());
            entries.push(Entry::new::<D>(Kind::ColorBricks, place, &settings)?);
        }
        if let Some(AttenuationBricks { store, rule, more }) = &self.attenuation {
            let (half_life, length_units) = (rule.half_life, LENGTH_UNITS);
            let settings = AttenuationSettings { half_life, length_units, more: more.clone() };
            let place = Place::of_lattice(store.lattice());
            entries.push(Entry::new::<D>(Kind::Attenuation, place, &settings)?);
        }
        Ok(entries)
    }

    fn write_dense(&self, writer: &mut ContainerWriter) -> Result<()> {
        if let Some(map) = &self.grid {
            let plane: Vec<u8> = map.store().planes().iter().map(|v| v.0 as u8).collect();
            write_plane(writer, Kind::Grid.names::<D>().chunk, "occupancy", &plane)?;
        }
        if let Some(map) = &self.tree {
            write_plane(writer, Kind::Tree.names::<D>().chunk, "occupancy", &tree_bytes(map.store()))?;
        }
        if let Some(map) = &self.tsdf {
            let planes = map.store().planes();
            for (name, plane) in [("distance", planes.distances()), ("weight", planes.weights())] {
                let mut bytes = Vec::new();
                put_floats(plane, &mut bytes);
                write_plane(writer, Kind::Tsdf.names::<D>().chunk, name, &bytes)?;
            }
        }
        Ok(())
    }

    fn write_bricks(&self, writer: &mut ContainerWriter) -> Result<()> {
        if let Some(map) = &self.occupancy_bricks {
            let tag = Kind::OccupancyBricks.names::<D>().chunk;
            write_keys(writer, tag, &map.store)?;
            write_bricks(writer, tag, "occupancy", &map.store, |brick, bytes| {
                let cell = |i| brick.get(i).unwrap_or(LogOdds8::UNOBSERVED).0 as u8;
                bytes.extend((0..brick.len()).map(cell));
            })?;
        }
        if let Some(map) = &self.tsdf_bricks {
            let tag = Kind::TsdfBricks.names::<D>().chunk;
            write_keys(writer, tag, &map.store)?;
            write_bricks(writer, tag, "distance", &map.store, |b, bytes| put_floats(b.distances(), bytes))?;
            write_bricks(writer, tag, "weight", &map.store, |b, bytes| put_floats(b.weights(), bytes))?;
        }
        if let Some(map) = &self.color_bricks {
            let tag = Kind::ColorBricks.names::<D>().chunk;
            write_keys(writer, tag, &map.store)?;
            write_bricks(writer, tag, "color", &map.store, |brick, bytes| {
                bytes.extend(brick.words().as_flattened().iter().flat_map(|v| v.to_le_bytes()));
            })?;
        }
        if let Some(map) = &self.attenuation {
            let tag = Kind::Attenuation.names::<D>().chunk;
            write_keys(writer, tag, &map.store)?;
            let counts =
                |v: &[u32], bytes: &mut Vec<u8>| bytes.extend(v.iter().flat_map(|v| v.to_le_bytes()));
            write_bricks(writer, tag, "hits", &map.store, |b, bytes| counts(b.planes().hits(), bytes))?;
            write_bricks(writer, tag, "length", &map.store, |b, bytes| counts(b.planes().lengths(), bytes))?;
            write_bricks(writer, tag, "looks", &map.store, |b, bytes| {
                bytes.extend(b.planes().looks().iter().flat_map(|v| v.to_le_bytes()));
            })?;
        }
        Ok(())
    }
}

fn tree_bytes<const D: usize>(tree: &Tree<LogOdds8, D>) -> Vec<u8> {
    let records = tree.records();
    let mut bytes = vec![records.root_value.0 as u8];
    bytes.extend(&records.masks);
    bytes.extend(records.values.iter().map(|v| v.0 as u8));
    bytes
}

pub(super) fn pose_bytes<const D: usize>(poses: &[Pose<D>]) -> Vec<u8> {
    let numbers = poses.iter().flat_map(|p| p.rotation.as_flattened().iter().chain(&p.translation));
    numbers.flat_map(|v| v.to_le_bytes()).collect()
}

fn put_floats(values: &[f32], bytes: &mut Vec<u8>) {
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

fn write_plane(writer: &mut ContainerWriter, tag: &str, name: &str, bytes: &[u8]) -> Result<()> {
    if bytes.is_empty() {
        return writer.chunk(tag, name, bytes);
    }
    bytes.chunks(CHUNK).enumerate().try_for_each(|(i, part)| writer.chunk(tag, &part_name(name, i), part))
}
