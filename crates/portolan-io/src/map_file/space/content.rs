//! What a `map.portolan` of space holds.

use portolan::cell::{Color, LogOdds8, OccupancyModel, SignedDistance};
use portolan::geom::Pose;
use portolan::store::Bricks;
use portolan::sweep::WeightModel;
use serde_json::{Map, Value};

use super::super::{MapHeader, UnknownChunk};

/// The content of a `map.portolan` of space.
#[derive(Clone, Debug, Default)]
pub struct SpaceMapFile {
    /// What the writer says about it.
    pub header: MapHeader,
    /// Occupancy.
    pub occupancy: Option<OccupancyBricks>,
    /// The truncated signed distance field.
    pub tsdf: Option<TsdfBricks>,
    /// Colours of the surface.
    pub colors: Option<ColorBricks>,
    /// Poses of the sensor at the scans that were fused, `world_from_sensor`.
    pub poses: Vec<Pose<3>>,
    pub(super) unknown_maps: Vec<Value>,
    pub(super) unknown_chunks: Vec<UnknownChunk>,
}

/// Occupancy in bricks, and how it was fused.
#[derive(Clone, Debug)]
pub struct OccupancyBricks {
    /// The cells.
    pub store: Bricks<LogOdds8, 3>,
    /// What a hit and a miss say.
    pub model: OccupancyModel,
    /// Further settings.
    pub more: Map<String, Value>,
}

/// A truncated signed distance field in bricks, and how it was fused.
#[derive(Clone, Debug)]
pub struct TsdfBricks {
    /// The cells.
    pub store: Bricks<SignedDistance, 3>,
    /// Truncation (metres).
    pub truncation: f64,
    /// Clamp of the weight; infinity: never forget.
    pub w_max: f32,
    /// Weight of free space beyond the truncation, times the beam's.
    pub carve_weight: f32,
    /// How much each beam is trusted.
    pub weights: WeightModel,
    /// Further settings.
    pub more: Map<String, Value>,
}

/// Colours in bricks, and how they were fused.
#[derive(Clone, Debug)]
pub struct ColorBricks {
    /// The cells.
    pub store: Bricks<Color, 3>,
    /// Clamp of the weight.
    pub w_max: f32,
    /// Further settings.
    pub more: Map<String, Value>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, bad_bytes};
    use crate::{AnyMapFile, Container, MapFile};
    use portolan::cell::{Cell, ColorBrick, DistanceBrick, Planes};
    use portolan::geom::{BlockKey, Lattice};
    use portolan::store::Store;
    use serde_json::json;

    /// Keys around zero, in an order that depends on the seed.
    fn keys(seed: u64) -> Vec<BlockKey<3>> {
        let mut keys: Vec<_> = (0..27).map(|i| BlockKey([i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])).collect();
        keys.push(BlockKey([-(1 << 27), (1 << 27) - 1, 12_345]));
        let mut random = Random(seed);
        for i in (1..keys.len()).rev() {
            keys.swap(i, random.below(i + 1));
        }
        keys
    }

    fn store<C: Cell>(seed: u64, brick: impl Fn(&mut Random) -> C::Brick) -> Bricks<C, 3> {
        let mut store = Bricks::new(Lattice::new([500_000.0, 4_000_000.0, -3.5], 0.05));
        for key in keys(seed) {
            // A brick's content depends on its key alone.
            let mut random =
                Random(key.0.iter().fold(7, |h: u64, &v| h.wrapping_mul(1_000_003) + u64::from(v as u32)));
            store.insert(key, brick(&mut random)).unwrap();
        }
        store
    }

    fn full(seed: u64) -> SpaceMapFile {
        let occupancy = store(seed, |random| {
            let mut brick = <LogOdds8 as Cell>::Brick::unobserved(512);
            for i in 0..512 {
                brick.set(i, (random.below(3) > 0).then(|| LogOdds8(random.below(201) as i8)));
            }
            brick
        });
        let tsdf = store(seed, |random| {
            let mut distance: Vec<f32> = (0..512).map(|_| random.unit() as f32 - 0.5).collect();
            let mut weight: Vec<f32> =
                (0..512).map(|_| (8.0 * random.unit() - 1.0).max(0.0) as f32).collect();
            (distance[5], weight[6], weight[7]) = (-0.0, f32::INFINITY, f32::MIN_POSITIVE / 8.0);
            DistanceBrick::from_parts(&distance, &weight).unwrap()
        });
        let colors = store(seed, |random| {
            let words: Vec<_> = (0..512).map(|_| [(); 4].map(|()| random.next() as u16)).collect();
            ColorBrick::from_words(&words)
        });
        SpaceMapFile {
            header: MapHeader { logs: vec!["hall".into()], scans: 3, ..Default::default() },
            occupancy: Some(OccupancyBricks {
                store: occupancy,
                model: OccupancyModel { p_hit: 0.8, ..Default::default() },
                more: Map::new(),
            }),
            tsdf: Some(TsdfBricks {
                store: tsdf,
                truncation: 0.15,
                w_max: f32::INFINITY,
                carve_weight: 0.1,
                weights: WeightModel::InverseSquareCosIncidence,
                more: [("drop_off".to_owned(), json!("linear"))].into_iter().collect(),
            }),
            colors: Some(ColorBricks { store: colors, w_max: 64.0, more: Map::new() }),
            poses: vec![
                Pose::IDENTITY,
                Pose::from_quaternion([1e6, -2.5, 0.125], [0.1, 0.2, 0.3, 0.9]).unwrap(),
            ],
            unknown_maps: vec![json!({"kind": "wavelets", "cell": "i16", "chunk": "WAVE"})],
            unknown_chunks: vec![UnknownChunk {
                tag: "WAVE".into(),
                name: "x".into(),
                content: vec![1, 2, 3],
            }],
        }
    }

    fn same_bricks<C: Cell>(a: &Bricks<C, 3>, b: &Bricks<C, 3>) -> bool
    where
        C::Brick: PartialEq,
    {
        a.lattice() == b.lattice()
            && a.keys() == b.keys()
            && a.keys().iter().all(|&k| a.brick(k) == b.brick(k))
    }

    fn parse(bytes: Vec<u8>) -> SpaceMapFile {
        SpaceMapFile::parse(bytes, "m".as_ref()).unwrap()
    }

    #[test]
    fn bricks_come_back_bit_for_bit() {
        let file = full(1);
        let bytes = file.to_bytes().unwrap();
        let back = parse(bytes.clone());
        assert!(same_bricks(
            &file.occupancy.as_ref().unwrap().store,
            &back.occupancy.as_ref().unwrap().store
        ));
        assert!(same_bricks(&file.tsdf.as_ref().unwrap().store, &back.tsdf.as_ref().unwrap().store));
        assert!(same_bricks(&file.colors.as_ref().unwrap().store, &back.colors.as_ref().unwrap().store));
        // Equality of f32 does not tell -0 from 0: the bytes do.
        assert_eq!(back.to_bytes().unwrap(), bytes);
        assert_eq!((&back.header, &back.poses), (&file.header, &file.poses));
        let (a, b) = (file.tsdf.unwrap(), back.tsdf.unwrap());
        assert_eq!(
            (a.truncation, a.w_max, a.carve_weight, a.weights, &a.more),
            (b.truncation, b.w_max, b.carve_weight, b.weights, &b.more)
        );
        assert_eq!(file.occupancy.unwrap().model, back.occupancy.unwrap().model);
        assert_eq!(back.colors.unwrap().w_max, 64.0);
        assert_eq!((&back.unknown_maps, &back.unknown_chunks), (&file.unknown_maps, &file.unknown_chunks));
        let empty = SpaceMapFile::default().to_bytes().unwrap();
        assert_eq!(parse(empty.clone()).to_bytes().unwrap(), empty);
    }

    #[test]
    fn the_order_in_which_bricks_came_to_be_does_not_show() {
        let bytes = full(1).to_bytes().unwrap();
        assert_ne!(keys(1), keys(2));
        assert_eq!(full(2).to_bytes().unwrap(), bytes);
    }

    #[test]
    fn a_map_without_bricks_is_a_map() {
        let empty = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], 0.1));
        let mut file = full(1);
        file.tsdf.as_mut().unwrap().store = empty;
        let back = parse(file.to_bytes().unwrap());
        let store = back.tsdf.unwrap().store;
        assert!(store.is_empty() && store.lattice().resolution == 0.1);
    }

    #[test]
    fn the_file_tells_its_dimension() {
        let space = full(1).to_bytes().unwrap();
        let plane = MapFile::default().to_bytes().unwrap();
        let any = |bytes: &[u8]| AnyMapFile::parse(bytes.to_vec(), "m".as_ref()).unwrap();
        assert!(matches!(any(&space), AnyMapFile::Space(file) if file.poses.len() == 2));
        assert!(matches!(any(&plane), AnyMapFile::Plane(file) if file.poses.is_empty()));
        let error = MapFile::parse(space, "m".as_ref()).unwrap_err().to_string();
        assert!(error.contains("the dimension is 3"), "{error}");
        let error = SpaceMapFile::parse(plane, "m".as_ref()).unwrap_err().to_string();
        assert!(error.contains("the dimension is 2"), "{error}");
    }

    /// What reading says of the file with another header.
    fn with_header(edit: impl FnOnce(&mut Value)) -> String {
        let container = Container::parse(full(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
        let mut header: Value = serde_json::from_slice(&container.get("HEAD", "").unwrap().unwrap()).unwrap();
        edit(&mut header);
        with_chunk("HEAD", "", header.to_string().as_bytes())
    }

    /// What reading says of the file with another content of one chunk.
    fn with_chunk(tag: &str, name: &str, content: &[u8]) -> String {
        let container = Container::parse(full(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
        let mut writer = container.writer(|c| c.tag != tag || c.name != name).unwrap();
        writer.chunk(tag, name, content).unwrap();
        match SpaceMapFile::parse(writer.to_bytes(), "m".as_ref()) {
            Ok(_) => "read".to_owned(),
            Err(e) => e.to_string(),
        }
    }

    #[test]
    fn what_the_header_claims_is_checked() {
        assert_eq!(with_header(|_| {}), "read");
        for (part, pointer, value) in [
            ("the dimension is 4", "/dimension", json!(4)),
            ("map occupancy-bricks is not possible (resolution is -1", "/maps/0/resolution", json!(-1)),
            ("the origin is", "/maps/1/origin/0", json!(1e300)),
            ("map occupancy-bricks is not possible", "/maps/0/model/p_hit", json!(2)),
            ("map tsdf-bricks is not possible (truncation", "/maps/1/truncation", json!(0)),
            ("map tsdf-bricks is not possible (carve_weight", "/maps/1/carve_weight", json!(-1)),
            ("map color-bricks is not possible (w_max", "/maps/2/w_max", json!(0)),
            ("the weights is \"heavy\"", "/maps/1/weights", json!("heavy")),
            ("the length of chunk \"CBRICKS\" distance is 0", "/maps/1/chunk", json!("CBRICKS")),
            ("the length of chunk \"OBRICKS\" color is 0", "/maps/2/chunk", json!("OBRICKS")),
            ("the length of chunk \"HOLE\" keys is missing", "/maps/0/chunk", json!("HOLE")),
        ] {
            let error = with_header(|header| *header.pointer_mut(pointer).unwrap() = value);
            assert!(error.contains(part) && !error.contains('\n'), "{part}: {error}");
        }
        let error = with_header(|header| header["maps"][1] = header["maps"][0].clone());
        assert!(error.contains("there twice"), "{error}");
    }

    #[test]
    fn what_the_chunks_hold_is_checked() {
        let container = Container::parse(full(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
        let keys = container.get("TBRICKS", "keys").unwrap().unwrap();
        assert_eq!(with_chunk("TBRICKS", "keys", &keys), "read");
        assert!(with_chunk("TBRICKS", "keys", &keys[1..]).contains("keys is 335 bytes"));
        assert!(
            with_chunk("TBRICKS", "keys", &keys[12..]).contains("distance is 57344; the header announces")
        );
        let mut twice = keys.clone();
        twice.copy_within(12..24, 0);
        assert!(with_chunk("TBRICKS", "keys", &twice).contains("a key of chunk \"TBRICKS\" is"));
        let mut far = keys;
        far[12 * 27..].fill(0x7f);
        assert!(with_chunk("TBRICKS", "keys", &far).contains("a key of chunk \"TBRICKS\" is"));
        let mut weights = container.get("TBRICKS", "weight").unwrap().unwrap();
        weights[..4].copy_from_slice(&(-1f32).to_le_bytes());
        assert!(with_chunk("TBRICKS", "weight", &weights).contains("a cell of brick"));
    }

    #[test]
    fn parts_hold_the_same_whole_bricks() {
        let container = Container::parse(full(1).to_bytes().unwrap(), "m".as_ref()).unwrap();
        let weights = container.get("TBRICKS", "weight").unwrap().unwrap();
        let cut = |at: usize, both: bool| {
            let cut =
                |c: &crate::Chunk| c.tag == "TBRICKS" && (c.name == "weight" || both && c.name == "distance");
            let mut writer = container.writer(|c| !cut(c)).unwrap();
            writer.chunk("TBRICKS", "weight", &weights[..at]).unwrap();
            writer.chunk("TBRICKS", "weight.1", &weights[at..]).unwrap();
            if both {
                let distances = container.get("TBRICKS", "distance").unwrap().unwrap();
                writer.chunk("TBRICKS", "distance", &distances[..at]).unwrap();
                writer.chunk("TBRICKS", "distance.1", &distances[at..]).unwrap();
            }
            SpaceMapFile::parse(writer.to_bytes(), "m".as_ref())
        };
        assert_eq!(cut(4 * 2048, true).unwrap().to_bytes().unwrap(), full(1).to_bytes().unwrap());
        for file in [cut(4 * 2048, false), cut(4 * 2048 + 4, true)] {
            let error = file.unwrap_err().to_string();
            assert!(error.contains("the parts of chunk \"TBRICKS\""), "{error}");
        }
    }

    #[test]
    fn memory_is_limited() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m");
        full(1).write(&path).unwrap();
        for memory in [2_000, 20_000, 100_000, 250_000] {
            let error = SpaceMapFile::read_within(&path, memory).unwrap_err().to_string();
            assert!(error.contains("a length of map data") && error.contains("allow more"), "{error}");
            assert!(AnyMapFile::read_within(&path, memory).is_err());
        }
        assert!(SpaceMapFile::read_within(&path, 300_000).is_ok());
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = full(1).to_bytes().unwrap();
        for bytes in bad_bytes(&good, 41, 100) {
            let _ = AnyMapFile::parse(bytes, "m".as_ref());
        }
        // The checksums stop nearly all of these; what lies behind good ones must be stopped, too.
        let container = Container::parse(good, "m".as_ref()).unwrap();
        for (tag, name) in [
            ("HEAD", ""),
            ("OBRICKS", "keys"),
            ("OBRICKS", "occupancy"),
            ("TBRICKS", "keys"),
            ("TBRICKS", "weight"),
            ("CBRICKS", "color"),
            ("POSES", "sensor"),
        ] {
            let content = container.get(tag, name).unwrap().unwrap();
            for bytes in bad_bytes(&content, 42, 60) {
                let _ = with_chunk(tag, name, &bytes);
            }
        }
    }
}
