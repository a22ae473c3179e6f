//! What a `map.portolan` holds.

use portolan::cell::{Color, LogOdds8, OccupancyModel, SignedDistance};
use portolan::geom::Pose;
use portolan::map::{OccupancyGrid, TreeMap, Tsdf};
use portolan::store::Bricks;
use portolan::sweep::WeightModel;
use serde_json::{Map, Value};

use super::{MapHeader, UnknownChunk};

/// The content of a `map.portolan` of dimension `D`: at most one map of each kind.
#[derive(Clone, Debug, Default)]
pub struct MapFile<const D: usize> {
    /// What the writer noted about it.
    pub header: MapHeader,
    /// Occupancy in a dense array.
    pub grid: Option<OccupancyGrid<D>>,
    /// Occupancy in a quadtree or octree.
    pub tree: Option<TreeMap<D>>,
    /// The truncated signed distance field in a dense array.
    pub tsdf: Option<DenseTsdf<D>>,
    /// Occupancy in bricks.
    pub occupancy_bricks: Option<OccupancyBricks<D>>,
    /// The truncated signed distance field in bricks.
    pub tsdf_bricks: Option<TsdfBricks<D>>,
    /// Colors of the surface in bricks.
    pub color_bricks: Option<ColorBricks<D>>,
    /// Poses of the sensor at the fused scans, `world_from_sensor`.
    pub poses: Vec<Pose<D>>,
    pub(super) unknown_maps: Vec<Value>,
    pub(super) unknown_chunks: Vec<UnknownChunk>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Container;
    use crate::testing::bad_bytes;
    use portolan::cell::OccupancyModel;
    use portolan::geom::Grid;
    use portolan::map::TsdfConfig;
    use portolan::scan::{RangeLimits, Scan};
    use serde_json::json;

    fn full() -> MapFile {
        let grid = Grid::new([-2.0, -1.5], 0.1, [57, 43]);
        let mut file = MapFile {
            header: MapHeader {
                logs: vec!["a.log".into()],
                scans: 3,
                hold_out: Some(10),
                more: [("studio".to_owned(), json!({"colour": 0.1}))].into_iter().collect(),
                ..Default::default()
            },
            grid: Some(OccupancyGrid::covering(grid, OccupancyModel::default()).unwrap()),
            tree: Some(Quadtree::covering(&grid, OccupancyModel::default()).unwrap()),
            tsdf: Some(
                Tsdf::new(TsdfConfig { truncation: 0.3, ..Default::default() }.with_grid(&grid)).unwrap(),
            ),
            ..Default::default()
        };
        let bearings: Vec<f64> = (0..180).map(|i| f64::from(i) * 0.0349).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| 1.0 + 0.4 * (3.0 * b).sin()).collect();
        let scan = Scan::from_laser(&bearings, &ranges, &RangeLimits::default());
        for k in 0..3 {
            let pose = Pose::<2>::new(0.1 * f64::from(k), 0.0, 0.3);
            file.grid.as_mut().unwrap().integrate(&pose, &scan);
            file.tree.as_mut().unwrap().integrate(&pose, &scan);
            file.tsdf.as_mut().unwrap().integrate(&pose, &scan, true);
            file.poses.push(pose);
        }
        file.unknown_maps.push(json!({"kind": "wavelets", "cell": "i16", "chunk": "WAVE"}));
        let content = vec![1, 2, 3];
        file.unknown_chunks.push(UnknownChunk { tag: "WAVE".into(), name: "x".into(), content });
        file
    }

    #[test]
    fn saved_again_the_bytes_are_the_same() {
        let file = full();
        let bytes = file.to_bytes().unwrap();
        let back = MapFile::parse(bytes.clone(), "m".as_ref()).unwrap();
        assert_eq!(back.to_bytes().unwrap(), bytes);
        assert_eq!(back.header, file.header);
        assert_eq!(back.poses, file.poses);
        assert_eq!(back.grid.unwrap().store(), file.grid.unwrap().store());
        assert_eq!(back.tsdf.as_ref().unwrap().store(), file.tsdf.as_ref().unwrap().store());
        assert_eq!(back.tsdf.unwrap().config(), file.tsdf.unwrap().config());
        assert_eq!(back.tree.unwrap().tree().records(), file.tree.unwrap().tree().records());
        let empty = MapFile::default().to_bytes().unwrap();
        assert_eq!(MapFile::parse(empty.clone(), "m".as_ref()).unwrap().to_bytes().unwrap(), empty);
    }

    #[test]
    fn never_forgetting_survives() {
        let config = TsdfConfig { cells: [4, 4], w_max: f32::INFINITY, ..Default::default() };
        let file = MapFile { tsdf: Some(Tsdf::new(config).unwrap()), ..Default::default() };
        let back = MapFile::parse(file.to_bytes().unwrap(), "m".as_ref()).unwrap();
        assert_eq!(back.tsdf.unwrap().config(), &config);
    }

    /// The file with another header and the same other chunks.
    fn with_header(edit: impl FnOnce(&mut Value)) -> String {
        let container = Container::parse(full().to_bytes().unwrap(), "m".as_ref()).unwrap();
        let mut header: Value = serde_json::from_slice(&container.get("HEAD", "").unwrap().unwrap()).unwrap();
        edit(&mut header);
        let mut writer = container.writer(|c| c.tag != "HEAD").unwrap();
        writer.chunk("HEAD", "", header.to_string().as_bytes()).unwrap();
        match MapFile::parse(writer.to_bytes(), "m".as_ref()) {
            Ok(_) => "read".to_owned(),
            Err(e) => e.to_string(),
        }
    }

    #[test]
    fn claims_are_checked_before_memory_is_taken() {
        assert_eq!(with_header(|_| {}), "read");
        for (part, edit) in [
            ("the shape is [1152921504606846976, 43]", ("/maps/0/shape/0", json!(1u64 << 60))),
            ("the shape is [0, 43]", ("/maps/2/shape/0", json!(0))),
            ("the length of chunk \"GRID\" occupancy is 2451", ("/maps/0/shape/0", json!(58))),
            ("the length of chunk \"HOLE\" occupancy is 0", ("/maps/0/chunk", json!("HOLE"))),
            ("map quadtree is not possible (tree depth 60", ("/maps/1/depth", json!(60))),
            ("map quadtree is not possible", ("/maps/1/depth", json!(4))),
            ("map tsdf is not possible (truncation", ("/maps/2/truncation", json!(-1))),
            ("map tsdf is not possible (resolution", ("/maps/2/resolution", json!(0))),
            ("the sweep is \"zigzag\"", ("/maps/2/sweep", json!("zigzag"))),
            ("map occupancy-grid is not possible", ("/maps/0/model/p_hit", json!(2))),
            ("the dimension is 3", ("/dimension", json!(3))),
            ("the version of the header is 2", ("/version", json!(2))),
            ("the list of maps is missing", ("/maps", json!(7))),
            ("the header is", ("/logs", json!(7))),
        ] {
            let error = with_header(|header| *header.pointer_mut(edit.0).unwrap() = edit.1);
            assert!(error.contains(part) && !error.contains('\n'), "{error}");
        }
        let error = with_header(|header| header["maps"][1] = header["maps"][0].clone());
        assert!(error.contains("there twice"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m");
        full().write(&path).unwrap();
        let error = MapFile::read_within(&path, 3000).unwrap_err().to_string();
        assert!(error.contains("a length of map data") && error.contains("allow more"), "{error}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = full().to_bytes().unwrap();
        for bytes in bad_bytes(&good, 33, 400) {
            let _ = MapFile::parse(bytes, "m".as_ref());
        }
        // The checksums stop nearly all of these; a bad header or tree behind good ones must be stopped, too.
        let container = Container::parse(good, "m".as_ref()).unwrap();
        for tag in ["HEAD", "TREE", "POSES"] {
            let chunk = container.tagged(tag).next().unwrap();
            let content = container.unpack(chunk).unwrap();
            for bytes in bad_bytes(&content, 34, 300) {
                let mut writer = container.writer(|c| c.tag != tag).unwrap();
                writer.chunk(tag, &chunk.name, &bytes).unwrap();
                let _ = MapFile::parse(writer.to_bytes(), "m".as_ref());
            }
        }
    }
}
