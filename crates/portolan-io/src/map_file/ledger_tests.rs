//! Ledgers in files, 2-D and 3-D.

use portolan::Ledger;
use portolan::cell::Sign;
use portolan::geom::{Aabb, Pose, block_cells};
use portolan::mapper::MapperSettings;
use portolan::scan::{Beam, BeamKind, PointScan, Scan};
use serde_json::{Value, json};

use super::*;
use crate::testing::bad_bytes;
use crate::{Container, Result};

macro_rules! in_2d_and_3d {
    ($($test:ident)*) => {
        mod in_2d { $(#[test] fn $test() { super::$test::<2>(); })* }
        mod in_3d { $(#[test] fn $test() { super::$test::<3>(); })* }
    };
}

in_2d_and_3d! {
    equal_ledgers_make_equal_files
    what_comes_back_goes_on
    settings_survive
    claims_are_checked
    memory_is_limited
    no_bytes_make_it_panic
    files_add_up_without_being_held
}

fn settings<const D: usize>() -> MapperSettings<D> {
    MapperSettings { origin: Some([0.0; D]), ..MapperSettings::new(0.1) }
}

/// Beams from a place onto a wall at x = 2 and through open space.
fn scan<const D: usize>(i: u64) -> (Pose<D>, Scan<D>) {
    let beam = |k: usize| {
        let angle = 0.02 * k as f64 - 0.6;
        let direction = std::array::from_fn(|axis| [angle.cos(), angle.sin(), 0.1 * angle][axis]);
        let kind = if k.is_multiple_of(7) { BeamKind::MaxRange } else { BeamKind::Hit };
        Beam { direction, range: 2.0 / angle.cos() - 0.1 * i as f64, kind }
    };
    let place = std::array::from_fn(|axis| [0.1 * i as f64, 0.05, 0.02 * i as f64][axis]);
    (Pose { translation: place, ..Pose::IDENTITY }, Scan::from_beams((0..60).map(beam)))
}

fn fused<const D: usize>(settings: MapperSettings<D>, which: &[u64]) -> Ledger<D> {
    let mut ledger = Ledger::new(settings).unwrap();
    for &i in which {
        let (pose, scan) = scan::<D>(i);
        ledger.add(if i % 2 == 0 { "even.log" } else { "odd.log" }, i, &pose, &scan).unwrap();
    }
    ledger
}

fn file<const D: usize>(ledger: Ledger<D>) -> MapFile<D> {
    MapFile { ledger: Some(ledger), ..Default::default() }
}

fn bytes<const D: usize>(ledger: Ledger<D>) -> Vec<u8> {
    file(ledger).to_bytes().unwrap()
}

fn parse<const D: usize>(bytes: Vec<u8>) -> Result<MapFile<D>> {
    MapFile::parse(bytes, "m".as_ref())
}

fn equal_ledgers_make_equal_files<const D: usize>() {
    let whole = bytes(fused::<D>(settings(), &[0, 1, 2, 3, 4, 5]));
    assert!(bytes(fused::<D>(settings(), &[5, 3, 1, 0, 4, 2])) == whole);
    let mut merged = fused::<D>(settings(), &[4, 1]);
    merged.merge(&fused(settings(), &[5, 0, 3, 2])).unwrap();
    assert!(bytes(merged.clone()) == whole);
    assert!(bytes(fused::<D>(settings(), &[0, 1, 2, 3, 4])) != whole);
    // Bricks that hold nothing any more do not show, nor does the width that they once needed.
    for i in 0..6 {
        let log = if i % 2 == 0 { "even.log" } else { "odd.log" };
        merged.subtract(log, i, &scan::<D>(i).1).unwrap();
    }
    let empty = bytes(Ledger::<D>::new(settings()).unwrap());
    assert!(bytes(merged) == empty);
    assert!(parse::<D>(empty.clone()).unwrap().to_bytes().unwrap() == empty);
}

fn what_comes_back_goes_on<const D: usize>() {
    let bytes = bytes(fused::<D>(settings(), &[0, 1, 2]));
    let back = parse::<D>(bytes.clone()).unwrap();
    assert!(back.to_bytes().unwrap() == bytes);
    assert_eq!(back.poses.len(), 3);
    let mut ledger = back.ledger.unwrap();
    assert!(ledger == fused(settings(), &[0, 1, 2]));
    let (pose, scan) = scan::<D>(3);
    ledger.add("odd.log", 3, &pose, &scan).unwrap();
    ledger.subtract("even.log", 0, &super::ledger_tests::scan::<D>(0).1).unwrap();
    assert!(ledger == fused(settings(), &[1, 2, 3]));
    assert!(ledger.add("even.log", 2, &pose, &scan).is_err());
}

fn settings_survive<const D: usize>() {
    let bounds = Aabb { min: [-1.0; D], max: [3.0; D] };
    for how in [
        MapperSettings { bounds: Some(bounds), carve_weight: 0.37, exact: true, ..settings() },
        MapperSettings { occupancy: None, truncation: Some(0.45), ..settings() },
        MapperSettings { distances: false, ..settings() },
        MapperSettings { attenuation: None, carve: false, origin: Some([0.05; D]), ..settings() },
    ] {
        let ledger = fused::<D>(how, &[0, 1]);
        let back = parse::<D>(bytes(ledger.clone())).unwrap().ledger.unwrap();
        // Equality looks at all that shapes sums.
        assert!(back == ledger);
        assert!(back != fused(settings(), &[0, 1]));
        assert_eq!(back.settings().truncation(), how.truncation());
    }
}

/// `read`, or the error of reading a file with another content of one chunk.
fn with_chunk<const D: usize>(tag: &str, name: &str, edit: impl FnOnce(&mut Vec<u8>)) -> String {
    let good = bytes(fused::<D>(settings(), &[0, 1, 2]));
    let container = Container::parse(good, "m".as_ref()).unwrap();
    let mut content = container.get(tag, name).unwrap().unwrap();
    edit(&mut content);
    let mut writer = container.writer(|c| c.tag != tag || c.name != name).unwrap();
    writer.chunk(tag, name, &content).unwrap();
    parse::<D>(writer.to_bytes()).map_or_else(|e| e.to_string(), |_| "read".into())
}

fn claims_are_checked<const D: usize>() {
    assert_eq!(with_chunk::<D>("TSUMS", "sums", |_| {}), "read");
    let header = |pointer: &str, value: Value| {
        with_chunk::<D>("HEAD", "", |bytes| {
            let mut header: Value = serde_json::from_slice(bytes).unwrap();
            *header.pointer_mut(pointer).unwrap() = value;
            *bytes = header.to_string().into_bytes();
        })
    };
    for (part, error) in [
        ("truncation", header("/ledger/truncation", json!(-1))),
        ("resolution is 0", header("/ledger/resolution", json!(0))),
        ("the origin is [1.0]", header("/ledger/origin", json!([1.0]))),
        ("the units of the ledger", header("/ledger/weight_units", json!(255))),
        ("the weight model of map ledger", header("/ledger/weights", json!("heavy"))),
        ("the sweep of map ledger", header("/ledger/sweep", json!("zigzag"))),
        ("the bounds of the ledger", header("/ledger/bounds", json!([[0.0], [1.0]]))),
        ("map ledger", header("/ledger/model/p_hit", json!(2))),
        ("map ledger", header("/ledger/distances", json!("yes"))),
        ("width", with_chunk::<D>("OSUMS", "width", |w| w[0] = 3)),
        (
            "the length of chunk \"OSUMS\" width",
            with_chunk::<D>("OSUMS", "width", |w| w.truncate(w.len() - 1)),
        ),
        ("the length of chunk \"TSUMS\" sums", with_chunk::<D>("TSUMS", "sums", |s| s.extend([0; 4]))),
        ("key 1 of chunk", with_chunk::<D>("TSUMS", "keys", |k| k.copy_within(4 * D..8 * D, 0))),
        ("the list of logs", with_chunk::<D>("SCANS", "logs", |text| *text = b"[[3]]".to_vec())),
        (
            "the number of scans",
            with_chunk::<D>("SCANS", "logs", |t| *t = format!("[[\"a\",{}]]", u64::MAX).into()),
        ),
        ("there twice", with_chunk::<D>("SCANS", "index", |i| i[8..16].copy_from_slice(&0u64.to_le_bytes()))),
        ("not rigid", with_chunk::<D>("SCANS", "sensor", |p| p[..8].copy_from_slice(&9f64.to_le_bytes()))),
    ] {
        assert!(error.contains(part) && !error.contains('\n'), "{part}: {error}");
    }
    // Sums that no observations have: the last of a brick's numbers, a weight or a count, is negative.
    for tag in ["TSUMS", "OSUMS"] {
        let error = with_chunk::<D>(tag, "sums", |sums| {
            let last = sums.len() - 1;
            sums[last] = 0xff;
        });
        assert!(error.contains("not possible (in block"), "{tag}: {error}");
    }
}

fn memory_is_limited<const D: usize>() {
    let container = Container::parse(bytes(fused::<D>(settings(), &[0, 1, 2])), "m".as_ref()).unwrap();
    let content: u64 = container.chunks().iter().map(|c| c.length).sum();
    for memory in [100, content / 2, content] {
        let error = MapFile::<D>::from_container(&container, memory).err().unwrap().to_string();
        assert!(error.contains("allow more"), "{error}");
    }
    let keys = ["OSUMS", "TSUMS", "ASUMS"].map(|tag| container.get(tag, "keys").unwrap().unwrap().len());
    let bricks = keys.iter().sum::<usize>() / (4 * D);
    assert!(bricks * block_cells::<D>() > 100);
    MapFile::<D>::from_container(&container, content + 112 * bricks as u64).unwrap();
}

fn no_bytes_make_it_panic<const D: usize>() {
    let container = Container::parse(bytes(fused::<D>(settings(), &[0, 1])), "m".as_ref()).unwrap();
    for chunk in container.chunks() {
        let content = container.unpack(chunk).unwrap();
        for bytes in bad_bytes(&content, 35, 40) {
            let mut writer = container.writer(|c| c != chunk).unwrap();
            writer.chunk(&chunk.tag, &chunk.name, &bytes).unwrap();
            let _ = parse::<D>(writer.to_bytes());
        }
    }
}

fn files_add_up_without_being_held<const D: usize>() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let write = |name: &str, which: &[u64]| file(fused::<D>(settings(), which)).write(at(name)).unwrap();
    write("a", &[0, 3]);
    write("b", &[4]);
    write("c", &[1, 2, 5]);
    write("whole", &[0, 1, 2, 3, 4, 5]);
    let open = |name: &str| LedgerFile::<D>::open(at(name), 1 << 30).unwrap().unwrap();
    let add = |names: &[(&str, Sign)]| {
        let files: Vec<_> = names.iter().map(|(name, sign)| (open(name), *sign)).collect();
        add_ledger_files(&files, &MapHeader::default(), &at("sum"))
    };
    let read = |name: &str| std::fs::read(at(name)).unwrap();
    add(&[("c", Sign::Plus), ("a", Sign::Plus), ("b", Sign::Plus)]).unwrap();
    assert!(read("sum") == read("whole"));
    write("rest", &[0, 3, 4]);
    add(&[("whole", Sign::Plus), ("c", Sign::Minus)]).unwrap();
    assert!(read("sum") == read("rest"));
    add(&[("whole", Sign::Plus), ("whole", Sign::Minus)]).unwrap();
    assert!(read("sum") == bytes(Ledger::<D>::new(settings()).unwrap()));
    // What does not fit leaves no file.
    std::fs::remove_file(at("sum")).unwrap();
    for (names, part) in [
        (&[("whole", Sign::Plus), ("c", Sign::Plus)][..], "is in the map already"),
        (&[("a", Sign::Plus), ("c", Sign::Minus)], "is not in the map"),
        (&[("a", Sign::Minus)], "the number of maps"),
        (&[], "the number of maps"),
    ] {
        let error = add(names).err().unwrap().to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
    file(fused::<D>(MapperSettings { carve_weight: 0.3, ..settings() }, &[4])).write(at("other")).unwrap();
    assert!(
        add(&[("a", Sign::Plus), ("other", Sign::Plus)]).err().unwrap().to_string().contains("free space")
    );
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 6, "{names:?}");
    // A damaged part is told.
    let container = Container::open(at("whole")).unwrap();
    let mut writer = container.writer(|c| c.tag != "TSUMS" || c.name != "width").unwrap();
    writer.chunk("TSUMS", "width", &[4]).unwrap();
    writer.write(at("bad")).unwrap();
    assert!(add(&[("bad", Sign::Plus)]).err().unwrap().to_string().contains("the division of chunk"));
}

/// Scans of points with colors into a ledger that keeps them.
fn colored(which: &[u64]) -> Ledger<3> {
    let mut ledger = Ledger::new(MapperSettings { color: true, ..settings() }).unwrap();
    for &i in which {
        let points = (0..40u8).map(|k| [2.0, 0.05 * f32::from(k) - 1.0, 0.1 * i as f32]);
        let mut scan = PointScan::new(points, [0.0; 3]);
        scan.colors = (0..40).map(|k| [k, 200 - k, i as u8]).collect();
        ledger.add("points.ply", i, &Pose::IDENTITY, &scan).unwrap();
    }
    ledger
}

#[test]
fn colors_survive_and_add_up() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let whole = bytes(colored(&[0, 1, 2, 3]));
    assert!(bytes(colored(&[3, 1, 0, 2])) == whole);
    let back = parse::<3>(whole.clone()).unwrap().ledger.unwrap();
    assert!(back == colored(&[0, 1, 2, 3]) && back.settings().color);
    assert!(back.color_sums().is_some_and(|sums| !sums.is_empty()));
    let wall = [1.95, 0.05, 0.15];
    let color = |ledger: &Ledger<3>| ledger.mapper().unwrap().tsdf().unwrap().color(wall);
    assert!(color(&back).is_some() && color(&back) == color(&colored(&[0, 1, 2, 3])));
    assert_ne!(color(&back), color(&colored(&[1])));
    // Without colors a file is what it was before there could be any.
    let plain = bytes(Ledger::<3>::new(settings()).unwrap());
    let container = Container::parse(plain, "m".as_ref()).unwrap();
    assert!(container.chunks().iter().all(|chunk| chunk.tag != "CSUMS"));
    let head = String::from_utf8(container.get("HEAD", "").unwrap().unwrap()).unwrap();
    assert!(!head.contains("color"), "{head}");

    file(colored(&[0, 2])).write(at("a")).unwrap();
    file(colored(&[1, 3])).write(at("b")).unwrap();
    let files =
        ["b", "a"].map(|name| (LedgerFile::<3>::open(at(name), 1 << 30).unwrap().unwrap(), Sign::Plus));
    add_ledger_files(&files, &MapHeader::default(), &at("sum")).unwrap();
    assert!(std::fs::read(at("sum")).unwrap() == whole);

    let container = Container::parse(whole, "m".as_ref()).unwrap();
    let edited = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut content = container.get("CSUMS", "sums").unwrap().unwrap();
        edit(&mut content);
        let mut writer = container.writer(|c| c.tag != "CSUMS" || c.name != "sums").unwrap();
        writer.chunk("CSUMS", "sums", &content).unwrap();
        parse::<3>(writer.to_bytes()).map_or_else(|e| e.to_string(), |_| "read".into())
    };
    assert_eq!(edited(&|_| {}), "read");
    let brighter = edited(&|sums| sums[..4].copy_from_slice(&i32::MAX.to_le_bytes()));
    assert!(brighter.contains("not possible (in block"), "{brighter}");
    assert!(edited(&|sums| sums.truncate(sums.len() - 1)).contains("CSUMS"));
}
