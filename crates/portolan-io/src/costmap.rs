//! Costs of Nav2 as a map_server map: the yaml file and its image.
//!
//! What map_server makes of each pixel, and Nav2's static layer of that:
//!
//! | mode | pixel | cell of the `OccupancyGrid` | what is lost |
//! |---|---|---|---|
//! | [`MapMode::Trinary`] | 0, 254, 205 | 100, 0, -1 | the decay: lethal and inscribed are occupied, all else is free |
//! | [`MapMode::Scale`] | shades of gray | 0 to 100 | unknown cells, which have no gray value: refused |
//! | [`MapMode::Raw`] | 0 to 100, 255 | the same, -1 | nothing but steps of 2.6 of 252 |
//!
//! Percents are those in which Nav2 publishes costmaps ([`Inflation::percent`]). A static layer takes them as costs with
//! `trinary_costmap: false` (`254 p / 100`: lethal stays 254, inscribed becomes 251); with `track_unknown_space: true`
//! unknown stays unknown.

use std::path::Path;

use portolan::geom::Grid;
use portolan::handover::{Inflation, cost};

use crate::map_server::write_pair;
use crate::{IoError, MapMode, Result};

/// Writes costs (one byte per cell, x fastest, y up: [`Inflation::costs`]) as a yaml file, and beside it the image under
/// the same name with `.pgm`. The note becomes a comment of the yaml file: what unknown space counts as, say.
///
/// # Errors
/// [`IoError::Unwritable`] where the lengths differ, the resolution is not positive, or the mode cannot hold unknown
/// cells that are there; else as [`crate::write_atomic`].
pub fn write_costmap(
    yaml: impl AsRef<Path>,
    grid: &Grid<2>,
    costs: &[u8],
    mode: MapMode,
    note: &str,
) -> Result<()> {
    let yaml = yaml.as_ref();
    let unknown = costs.iter().filter(|c| **c == cost::NO_INFORMATION).count();
    if mode == MapMode::Scale && unknown > 0 {
        let value = format!("{unknown} cells");
        let advice = "mode scale has no gray value for unknown; use raw or trinary";
        return Err(IoError::unwritable(yaml, "unknown space", value, advice));
    }
    let pixel = |c: &u8| match (mode, Inflation::percent(*c)) {
        (MapMode::Trinary, None) => 205,
        (MapMode::Trinary, Some(_)) if *c >= cost::INSCRIBED => 0,
        (MapMode::Trinary, Some(_)) => 254,
        (MapMode::Scale, p) => {
            let free = 100 - u32::from(p.unwrap_or(0));
            ((255 * free + 50) / 100) as u16
        }
        (MapMode::Raw, p) => p.map_or(255, u16::from),
    };
    let pixels: Vec<u16> = costs.iter().map(pixel).collect();
    // Inscribed and lethal (99 and 100) are occupied to readers that decide by thresholds.
    let (occupied, free) = match mode {
        MapMode::Trinary => (0.65, 0.196),
        // map_server stretches what lies between: nearly all of it, so that percents come back as they were.
        MapMode::Scale => (0.999, 0.001),
        MapMode::Raw => (0.985, 0.984),
    };
    write_pair(yaml, grid, &pixels, mode, occupied, free, note)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MapCell, MapServerInfo, MapServerMap, Pgm, open};

    /// The cell that Nav2's `loadMapFromFile` makes of a pixel: -1 unknown.
    fn loaded(pixel: u16, info: &MapServerInfo) -> i8 {
        let shade = f64::from(pixel) / 255.0;
        let occ = 1.0 - shade;
        match info.mode {
            _ if info.mode != MapMode::Raw && info.occupied_thresh < occ => 100,
            _ if info.mode != MapMode::Raw && occ < info.free_thresh => 0,
            MapMode::Trinary => -1,
            MapMode::Scale => {
                let part = (occ - info.free_thresh) / (info.occupied_thresh - info.free_thresh);
                (part * 100.0).round_ties_even() as i8
            }
            MapMode::Raw => match (shade * 255.0).round() {
                p if p <= 100.0 => p as i8,
                _ => -1,
            },
        }
    }

    fn round_trip(costs: &[u8], mode: MapMode) -> (Vec<i8>, MapServerMap) {
        let folder = tempfile::tempdir().unwrap();
        let yaml = folder.path().join("costs.yaml");
        let grid = Grid::new([-1.0, 2.0], 0.05, [costs.len() / 3, 3]);
        write_costmap(&yaml, &grid, costs, mode, "a\nnote").unwrap();
        assert!(std::fs::read_to_string(&yaml).unwrap().starts_with("# a note\n"));
        let info = MapServerInfo::parse(open(&yaml).unwrap()).unwrap();
        assert_eq!(info.mode, mode);
        let image = Pgm::read(folder.path().join("costs.pgm")).unwrap();
        let rows = image.pixels.chunks(image.width).rev();
        let cells = rows.flatten().map(|p| loaded(*p, &info)).collect();
        let map = MapServerMap::read(&yaml).unwrap();
        assert_eq!(map.grid, grid);
        (cells, map)
    }

    #[test]
    fn map_server_finds_what_nav2_would_publish() {
        // 252 values in three rows, and the three with a name.
        let costs: Vec<u8> = (0..=254).collect();
        let published: Vec<i8> =
            costs.iter().map(|c| Inflation::percent(*c).map_or(-1, |p| p as i8)).collect();
        for mode in [MapMode::Raw, MapMode::Scale] {
            assert_eq!(round_trip(&costs, mode).0, published, "{mode:?}");
        }
        let with_unknown = [0, 100, 255, 253, 254, 1];
        let (cells, map) = round_trip(&with_unknown, MapMode::Raw);
        assert_eq!(cells, [0, 39, -1, 99, 100, 1]);
        use MapCell::{Free, Occupied, Unknown};
        assert_eq!(map.cells, [Free, Free, Unknown, Occupied, Occupied, Free]);
        let (cells, map) = round_trip(&with_unknown, MapMode::Trinary);
        assert_eq!(cells, [0, 0, -1, 100, 100, 0]);
        assert_eq!(map.cells, [Free, Free, Unknown, Occupied, Occupied, Free]);
    }

    #[test]
    fn what_cannot_be_held_is_refused() {
        let grid = Grid::new([0.0; 2], 0.05, [2, 1]);
        let refused =
            |costs: &[u8], mode| write_costmap("never.yaml", &grid, costs, mode, "").unwrap_err().to_string();
        assert!(refused(&[0, 255], MapMode::Scale).contains("unknown space is 1 cells"));
        assert!(refused(&[0], MapMode::Raw).contains("the map size"));
    }
}
