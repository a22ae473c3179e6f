//! ROS map_server maps: a yaml file that names an image, and the image (`P5`/`P2` gray map, or PNG).
//!
//! A pixel `v` of a map with white `w` has the occupancy `p = (w - v) / w`, or `v / w` with `negate`. Modes:
//!
//! | mode | occupied | free | else |
//! |---|---|---|---|
//! | `trinary` | `p > occupied_thresh` | `p < free_thresh` | unknown |
//! | `scale` | the same | the same | unknown, with an occupancy that runs from 0 to 1 between the thresholds |
//! | `raw` | the same, where `p` is `v` percent | the same | unknown, with `p` where `v` is at most 100 |
//!
//! The first row of the image is the top of the map; the grids here have y up.

use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};

use portolan::geom::{Grid, Pose};

use crate::bytes::{Input, Lines, open, parse_f64, prepare};
use crate::error::shown;
use crate::map_picture::read_map_picture;
use crate::{IoError, Pgm, Result};

/// The state of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapCell {
    /// Free space.
    Free,
    /// An obstacle.
    Occupied,
    /// Unknown, or between the thresholds.
    Unknown,
}

/// How pixels become cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapMode {
    /// Free, occupied, or unknown.
    Trinary,
    /// What lies between the thresholds is a probability.
    Scale,
    /// A pixel is a percentage.
    Raw,
}

/// The settings of a yaml file.
#[derive(Clone, Debug, PartialEq)]
pub struct MapServerInfo {
    /// The image, as written in the file (relative to it); empty for an image alone.
    pub image: PathBuf,
    /// Edge of a pixel (meters).
    pub resolution: f64,
    /// Pose of the lower left corner of the lower left pixel: x, y (meters), yaw (radians). A yaw that is no number, as some
    /// savers write it, is NaN.
    pub origin: [f64; 3],
    /// Whether white means occupied.
    pub negate: bool,
    /// More than this is occupied.
    pub occupied_thresh: f64,
    /// Less than this is free.
    pub free_thresh: f64,
    /// How pixels become cells.
    pub mode: MapMode,
}

impl MapServerInfo {
    /// Settings for an image that has no yaml file: the lower left corner at zero, thresholds 0.65 and 0.15.
    /// (The usual 0.196 would call the gray 206 free that some tools write for unknown.)
    pub fn of_image(resolution: f64) -> Self {
        Self {
            image: PathBuf::new(),
            resolution,
            origin: [0.0; 3],
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.15,
            mode: MapMode::Trinary,
        }
    }

    /// Reads the yaml file alone: `key: value` lines, of which those of map_server count.
    ///
    /// # Errors
    /// [`IoError::Text`] for a value that is not allowed or a missing `image` or `resolution`.
    pub fn parse(input: Input) -> Result<Self> {
        yaml(Lines::of(input))
    }
}

/// A map of ROS's map_server.
#[derive(Clone, Debug, PartialEq)]
pub struct MapServerMap {
    /// The cells in the map's own frame, whose axes are the image's, y up.
    pub grid: Grid<2>,
    /// How much the grid is turned about its origin corner (radians); 0 for nearly all maps.
    pub yaw: f64,
    /// One per cell, x fastest, y up.
    pub cells: Vec<MapCell>,
    /// Occupancy of each cell from 0 to 1; NaN where unknown.
    pub occupancy: Vec<f32>,
    /// How many cells have the gray 205 or 206 that map_saver and others write for unknown, but count as free
    /// because the file's `free_thresh` is above 0.196 (Nav2's own `depot.yaml` is such a file). They are
    /// free here as they are for ROS; a careful caller warns.
    pub unknown_gray_taken_for_free: usize,
    /// What was taken for granted, a sentence each.
    pub notes: Vec<String>,
}

impl MapServerMap {
    /// Reads a yaml file and its image.
    ///
    /// # Errors
    /// [`IoError`] of the yaml file or of the image.
    pub fn read(yaml: impl AsRef<Path>) -> Result<Self> {
        let yaml = yaml.as_ref();
        let info = MapServerInfo::parse(open(yaml)?)?;
        let (image, moved) = place_of_image(yaml, &info.image);
        let mut map = Self::from_image(&read_map_picture(&image)?, &info);
        if moved {
            let named = info.image.display();
            map.notes
                .push(format!("{named} is not there: {} beside the yaml file is taken", image.display()));
        }
        Ok(map)
    }

    /// The map of an image with these settings (an image alone: [`MapServerInfo::of_image`]).
    pub fn from_image(image: &Pgm, info: &MapServerInfo) -> Self {
        let [x, y, yaw] = info.origin;
        let (yaw, notes) = match yaw.is_nan() {
            true => {
                (0.0, vec!["the yaw of the origin is no number: the map is taken as not turned".to_owned()])
            }
            false => (yaw, Vec::new()),
        };
        let grid = Grid::new([x, y], info.resolution, [image.width, image.height]);
        let table: Vec<_> = (0..=image.max_value).map(|v| cell(v, image.max_value, info)).collect();
        let rows = image.pixels.chunks(image.width.max(1)).rev();
        let (cells, occupancy) = rows.flatten().map(|&v| table[usize::from(v)]).unzip();
        let gray = image.pixels.iter().filter(|v| image.max_value == 255 && matches!(v, 205 | 206));
        let as_free = |v: &&u16| table[usize::from(**v)].0 == MapCell::Free && info.mode == MapMode::Trinary;
        let unknown_gray_taken_for_free = gray.filter(as_free).count();
        Self { grid, yaw, cells, occupancy, unknown_gray_taken_for_free, notes }
    }

    /// The pose that turns the grid's frame into the world: the identity without yaw.
    pub fn world_from_grid(&self) -> Pose<2> {
        let [x, y] = self.grid.lattice.origin;
        let turned = Pose::<2>::new(0.0, 0.0, self.yaw).rotate([x, y]);
        Pose::<2>::new(x - turned[0], y - turned[1], self.yaw)
    }
}

/// Where the image of a yaml file is, and whether that is not where the file says: an absolute path of another machine, whose picture
/// lies beside the yaml file.
fn place_of_image(yaml: &Path, image: &Path) -> (PathBuf, bool) {
    let named = yaml.with_file_name(image);
    let text = image.to_string_lossy();
    // A path of the other kind of system is not absolute here.
    let is_elsewhere = image.is_absolute() || text.contains('\\');
    let last = text.rsplit(['/', '\\']).next().filter(|name| !name.is_empty());
    match last.map(|name| yaml.with_file_name(name)) {
        Some(beside) if is_elsewhere && !named.exists() && beside.is_file() => (beside, true),
        _ => (named, false),
    }
}

fn cell(value: u16, white: u16, info: &MapServerInfo) -> (MapCell, f32) {
    const UNKNOWN: (MapCell, f32) = (MapCell::Unknown, f32::NAN);
    let shade = f64::from(value) / f64::from(white);
    let decide = |p: f64| match p {
        _ if p > info.occupied_thresh => MapCell::Occupied,
        _ if p < info.free_thresh => MapCell::Free,
        _ => MapCell::Unknown,
    };
    if info.mode == MapMode::Raw {
        // A percentage is the byte itself; images of other depths are scaled to bytes first.
        let p = (shade * 255.0).round() / 100.0;
        return if p <= 1.0 { (decide(p), p as f32) } else { UNKNOWN };
    }
    let p = if info.negate { shade } else { 1.0 - shade };
    match (decide(p), info.mode) {
        (MapCell::Unknown, MapMode::Scale) => {
            let scaled = (p - info.free_thresh) / (info.occupied_thresh - info.free_thresh);
            (MapCell::Unknown, scaled as f32)
        }
        (MapCell::Unknown, _) => UNKNOWN,
        (decided, _) => (decided, p as f32),
    }
}

/// Writes a trinary map: the yaml file, and beside it the image under the same name with `.pgm` (254 free,
/// 205 unknown, 0 occupied, as map_saver writes them).
///
/// `cells` has one entry per cell of `grid`, x fastest, y up.
///
/// # Errors
/// [`IoError::Unwritable`] where the lengths differ or the resolution is not positive, else as
/// [`crate::write_atomic`].
pub fn write_map_server(yaml: impl AsRef<Path>, grid: &Grid<2>, cells: &[MapCell]) -> Result<()> {
    let gray = |c: &MapCell| match c {
        MapCell::Free => 254,
        MapCell::Unknown => 205,
        MapCell::Occupied => 0,
    };
    let pixels: Vec<u16> = cells.iter().map(gray).collect();
    write_pair(yaml.as_ref(), grid, &pixels, MapMode::Trinary, 0.65, 0.196, "unknown cells are unknown")
}

/// Writes the yaml file and the image of pixels up to 255, one per cell of `grid`, x fastest, y up. The note is a comment of
/// the yaml file.
pub(crate) fn write_pair(
    yaml: &Path,
    grid: &Grid<2>,
    pixels: &[u16],
    mode: MapMode,
    occupied_thresh: f64,
    free_thresh: f64,
    note: &str,
) -> Result<()> {
    let [width, height] = grid.shape;
    let [x, y] = grid.lattice.origin;
    let resolution = grid.lattice.resolution;
    if grid.checked_len() != Some(pixels.len()) || pixels.is_empty() {
        let value = format!("{width} x {height} for {} cells", pixels.len());
        let advice = "give one value per cell, at least one";
        return Err(IoError::unwritable(yaml, "the map size", value, advice));
    }
    if !(resolution > 0.0 && resolution.is_finite() && x.is_finite() && y.is_finite()) {
        let value = format!("{resolution} at {x} {y}");
        return Err(IoError::unwritable(yaml, "the resolution", value, "give finite values, above zero"));
    }
    let pixels = pixels.chunks(width).rev().flatten().copied().collect();
    let image_path = yaml.with_extension("pgm");
    let name = image_path.file_name().unwrap_or_default().to_string_lossy().replace('\'', "''");
    if name.chars().any(char::is_control) {
        return Err(IoError::unwritable(yaml, "the image name", shown(name), "choose a plain name"));
    }
    let image = Pgm { width, height, max_value: 255, pixels }.prepare(&image_path)?;
    let mode = match mode {
        MapMode::Trinary => "trinary",
        MapMode::Scale => "scale",
        MapMode::Raw => "raw",
    };
    let note = note.replace(char::is_control, " ");
    let text = prepare(yaml, |w| {
        writeln!(w, "# {note}")?;
        writeln!(w, "image: '{name}'\nmode: {mode}\nresolution: {resolution}\norigin: [{x}, {y}, 0.0]")?;
        writeln!(w, "negate: 0\noccupied_thresh: {occupied_thresh}\nfree_thresh: {free_thresh}")
    })?;
    // Whoever reads the pair begins with the yaml file: without one there is no map, and never an image of one map with the
    // place of another, whenever this run is killed.
    if let Ok(old) = std::fs::canonicalize(yaml)
        && old.is_file()
    {
        std::fs::remove_file(old).map_err(|e| IoError::os(yaml, "replace it", e))?;
    }
    image.publish()?;
    text.publish()
}

fn yaml(mut lines: Lines<Input>) -> Result<MapServerInfo> {
    let path = lines.path().to_owned();
    let mut info = MapServerInfo { free_thresh: 0.196, ..MapServerInfo::of_image(f64::NAN) };
    let mut list: Option<Vec<f64>> = None;
    while let Some((number_of_line, line)) = lines.next_numbered()? {
        let line = String::from_utf8_lossy(without_comment(line)).into_owned();
        let bad = |field: &str, value: &str, advice: &str| {
            Err(IoError::text(&path, number_of_line, field, shown(value), advice))
        };
        // `origin:` may be followed by a list of `- value` lines.
        if let (Some(list), Some(item)) = (&mut list, line.trim_start().strip_prefix("- ")) {
            match parse_f64(item.trim().as_bytes()).filter(|v| !v.is_infinite()) {
                Some(value) if list.len() < 2 && value.is_finite() || list.len() == 2 => list.push(value),
                _ => return bad("origin", item, "write three finite numbers: x, y, yaw"),
            }
            if let [x, y, yaw] = list[..] {
                info.origin = [x, y, yaw];
            }
            continue;
        }
        let Some((key, raw)) = line.split_once(':').map(|(key, raw)| (key, raw.trim())) else { continue };
        let value = unquoted(raw);
        let value = value.as_ref();
        let number_in = |low: f64, high: f64, field: &str, advice: &str| {
            let number = parse_f64(value.as_bytes()).filter(|v| (low..=high).contains(v));
            number.ok_or_else(|| IoError::text(&path, number_of_line, field, shown(value), advice))
        };
        const SHARE: &str = "write a number from 0 to 1";
        match unquoted(key.trim()).as_ref() {
            "image" if value.is_empty() => return bad("image", value, "name the image file"),
            "image" => info.image = PathBuf::from(value),
            "resolution" => {
                let advice = "write metres per pixel, above zero, like 0.05";
                info.resolution = number_in(1e-6, 1e6, "resolution", advice)?;
            }
            "origin" if value.is_empty() => list = Some(Vec::new()),
            "origin" => match origin(value) {
                Some(v) => info.origin = v,
                None => return bad("origin", value, "write [x, y, yaw], finite numbers"),
            },
            "negate" => match value {
                "0" | "false" | "False" | "no" => info.negate = false,
                "1" | "true" | "True" | "yes" => info.negate = true,
                _ => return bad("negate", value, "write 0 or 1"),
            },
            "occupied_thresh" => info.occupied_thresh = number_in(0.0, 1.0, "occupied_thresh", SHARE)?,
            "free_thresh" => info.free_thresh = number_in(0.0, 1.0, "free_thresh", SHARE)?,
            "mode" => match value {
                "trinary" => info.mode = MapMode::Trinary,
                "scale" => info.mode = MapMode::Scale,
                "raw" => info.mode = MapMode::Raw,
                _ => return bad("mode", value, "write trinary, scale or raw"),
            },
            _ => {}
        }
    }
    let last = lines.number();
    let missing = |field, advice| Err(IoError::text(&path, last, field, "missing", advice));
    if info.image.as_os_str().is_empty() {
        return missing("image", "add a line `image: map.pgm`");
    }
    if info.resolution.is_nan() {
        return missing("resolution", "add a line `resolution: 0.05` (metres per pixel)");
    }
    if list.is_some_and(|l| l.len() != 3) {
        return missing("origin", "write three numbers: x, y, yaw");
    }
    if info.free_thresh > info.occupied_thresh {
        let value = format!("{} above occupied_thresh {}", info.free_thresh, info.occupied_thresh);
        return Err(IoError::text(&path, last, "free_thresh", value, "make it the smaller one"));
    }
    Ok(info)
}

/// A `#` at the start of a word, outside of quotes, starts a comment.
fn without_comment(line: &[u8]) -> &[u8] {
    let mut quote: Option<u8> = None;
    let mut i = 0;
    while i < line.len() {
        let starts_word = i == 0 || line[i - 1].is_ascii_whitespace();
        match (quote, line[i]) {
            (Some(b'"'), b'\\') => i += 1,
            (Some(b'\''), b'\'') if line.get(i + 1) == Some(&b'\'') => i += 1,
            (Some(open), b) if b == open => quote = None,
            (Some(_), _) => {}
            (None, b @ (b'"' | b'\'')) if starts_word => quote = Some(b),
            (None, b'#') if starts_word => return &line[..i],
            (None, _) => {}
        }
        i += 1;
    }
    line
}

/// The text of a value: within single quotes a quote is written twice, within double quotes a backslash escapes.
fn unquoted(value: &str) -> Cow<'_, str> {
    let inner = |q| value.strip_prefix(q).and_then(|v: &str| v.strip_suffix(q));
    if let Some(text) = inner('\'') {
        return Cow::Owned(text.replace("''", "'"));
    }
    let Some(text) = inner('"') else { return Cow::Borrowed(value) };
    let mut escaped = false;
    // `\\` and `\"`: other escapes do not occur in names.
    let kept = |c: &char| {
        let was = escaped;
        escaped = *c == '\\' && !was;
        !escaped
    };
    Cow::Owned(text.chars().filter(kept).collect())
}

fn origin(value: &str) -> Option<[f64; 3]> {
    let inner = value.strip_prefix('[')?.strip_suffix(']')?;
    let mut numbers = inner.split(',').map(|w| parse_f64(w.trim().as_bytes()).filter(|v| !v.is_infinite()));
    let [x, y, yaw] = [numbers.next()??, numbers.next()??, numbers.next()??];
    (numbers.next().is_none() && x.is_finite() && y.is_finite()).then_some([x, y, yaw])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, no_panic, real_data, says, temporary};
    use MapCell::*;

    fn parse(text: impl Into<Vec<u8>>) -> Result<MapServerInfo> {
        MapServerInfo::parse(Input::from_reader(std::io::Cursor::new(text.into()), "m.yaml".as_ref())?)
    }

    const GOOD: &str = "# a map\nimage: \"a b.pgm\" # here\nresolution: 0.050000\norigin: [-7.14, -7.83, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\nmode: scale\nother: 1\n";

    #[test]
    fn yaml_is_understood() {
        let info = parse(GOOD).unwrap();
        let expected = MapServerInfo {
            image: "a b.pgm".into(),
            resolution: 0.05,
            origin: [-7.14, -7.83, 0.5],
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.25,
            mode: MapMode::Scale,
        };
        assert_eq!(info, expected);
        let listed = parse("image: m.pgm\norigin:\n- 1\n  - 2.5\n- -3e0\nresolution: 1\n").unwrap();
        assert_eq!(
            (listed.origin, listed.mode, listed.free_thresh),
            ([1.0, 2.5, -3.0], MapMode::Trinary, 0.196)
        );
    }

    #[test]
    fn quotes_hold_anything_and_a_yaw_may_be_no_number() {
        let image = |line: &str| parse(format!("image: {line}\nresolution: 1\n")).unwrap().image;
        for (line, expected) in [
            ("'map #2.pgm' # here", "map #2.pgm"),
            ("\"a # \\\"b\\\" \\\\.pgm\"", "a # \"b\" \\.pgm"),
            ("'it''s # one.pgm'", "it's # one.pgm"),
            ("a#b.pgm # c", "a#b.pgm"),
        ] {
            assert_eq!(image(line), PathBuf::from(expected), "{line}");
        }
        assert_eq!(parse("\u{feff}image: a\nresolution: 1\n").unwrap().image, PathBuf::from("a"));
        let turned = parse("image: a\nresolution: 1\norigin: [1, 2, -nan]\n").unwrap();
        let map =
            MapServerMap::from_image(&Pgm { width: 1, height: 1, max_value: 1, pixels: vec![0] }, &turned);
        assert!(map.yaw == 0.0 && map.notes[0].contains("yaw"), "{:?}", map.notes);
        says(parse("image: a\norigin: [nan, 2, 0]\n"), "origin is");
    }

    #[test]
    fn a_picture_of_another_machine_is_looked_for_beside_the_yaml() {
        let (folder, yaml) = temporary("m.yaml");
        let pgm = Pgm { width: 1, height: 1, max_value: 1, pixels: vec![0] };
        pgm.write(folder.path().join("a.pgm")).unwrap();
        for (image, notes) in [("/home/none/a.pgm", 1), ("C:\\\\maps\\\\a.pgm", 1), ("a.pgm", 0)] {
            std::fs::write(&yaml, format!("image: \"{image}\"\nresolution: 1\n")).unwrap();
            let map = MapServerMap::read(&yaml).unwrap();
            assert_eq!(map.notes.len(), notes, "{image}: {:?}", map.notes);
        }
        // A name that is relative is meant: nothing else is taken for it.
        std::fs::write(&yaml, "image: maps/a.pgm\nresolution: 1\n").unwrap();
        assert!(MapServerMap::read(&yaml).is_err());
    }

    #[test]
    fn errors_name_the_place_and_no_bytes_make_it_panic() {
        for (text, part) in [
            ("resolution: 0.05\n", "m.yaml: line 1: image is missing; add a line"),
            ("image: a\n", "resolution is missing"),
            ("image: a\nresolution: -1\n", "line 2: resolution is \"-1\"; write metres"),
            ("resolution: nan\n", "line 1: resolution is \"nan\""),
            ("origin: [1, 2]\n", "line 1: origin is \"[1, 2]\""),
            ("negate: 2\n", "negate is \"2\""),
            ("mode: fast\n", "mode is \"fast\""),
            ("free_thresh: 7\n", "free_thresh is \"7\""),
            ("image: a\nresolution: 1\nfree_thresh: 0.9\n", "free_thresh is 0.9 above"),
            ("image: a\nresolution: 1\norigin:\n- 1\n", "origin is missing"),
        ] {
            says(parse(text), part);
        }
        no_panic(GOOD.as_bytes(), 11, 3000, parse);
    }

    #[test]
    fn pixels_become_cells_from_the_bottom_up() {
        let image = Pgm { width: 2, height: 2, max_value: 255, pixels: vec![0, 205, 254, 128] };
        let info = MapServerInfo { origin: [1.0, 2.0, 0.0], ..MapServerInfo::of_image(0.5) };
        let map = MapServerMap::from_image(&image, &info);
        assert_eq!(map.cells, [Free, Unknown, Occupied, Unknown]);
        assert_eq!(map.grid.index_of([1.1, 2.1]), Some(0));
        assert!(map.occupancy[1].is_nan() && map.occupancy[2] == 1.0);
        let scale = MapServerInfo { mode: MapMode::Scale, ..info.clone() };
        let map = MapServerMap::from_image(&image, &scale);
        let half = ((127.0 / 255.0 - 0.15) / 0.5) as f32;
        assert!((map.occupancy[1] - half).abs() < 1e-6 && map.cells[1] == Unknown);
        let raw = MapServerInfo { mode: MapMode::Raw, negate: true, ..info.clone() };
        let pixels = vec![0, 100, 50, 101];
        let map = MapServerMap::from_image(&Pgm { pixels, ..image.clone() }, &raw);
        assert_eq!(map.cells, [Unknown, Unknown, Free, Occupied]);
        assert!(map.occupancy[0] == 0.5 && map.occupancy[1].is_nan());
        let negated = MapServerInfo { negate: true, ..info };
        assert_eq!(MapServerMap::from_image(&image, &negated).cells, [Occupied, Unknown, Free, Occupied]);
    }

    #[test]
    fn yaw_turns_about_the_lower_left_corner() {
        let image = Pgm { width: 1, height: 1, max_value: 1, pixels: vec![0] };
        let info = MapServerInfo { origin: [3.0, 4.0, 1.0], ..MapServerInfo::of_image(0.5) };
        let pose = MapServerMap::from_image(&image, &info).world_from_grid();
        let corner = pose.transform_point([3.0, 4.0]);
        assert!((corner[0] - 3.0).abs() < 1e-12 && (corner[1] - 4.0).abs() < 1e-12);
        assert!((pose.theta() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn round_trips() {
        let (_folder, path) = temporary("it's a map.yaml");
        let grid = Grid::new([-3.2, 1.0e6], 0.05, [5, 3]);
        let mut random = Random(2);
        let cells: Vec<_> = (0..15).map(|_| [Free, Occupied, Unknown][random.below(3)]).collect();
        write_map_server(&path, &grid, &cells).unwrap();
        let map = MapServerMap::read(&path).unwrap();
        assert_eq!((map.grid, map.cells, map.yaw), (grid, cells, 0.0));
        assert!(write_map_server(&path, &grid, &[]).is_err());
    }

    #[test]
    fn real_maps_are_read() {
        for (name, shape, resolution) in [("depot", [604, 307], 0.05), ("map", [384, 384], 0.05)] {
            let Some(path) = real_data(&format!("maps_2d/{name}.yaml")) else { continue };
            let map = MapServerMap::read(path).unwrap();
            assert_eq!((map.grid.shape, map.grid.lattice.resolution), (shape, resolution));
            for kind in [Free, Occupied] {
                assert!(map.cells.iter().filter(|c| **c == kind).count() > 500, "{name} {kind:?}");
            }
        }
        if let Some(path) = real_data("maps_2d/depot.yaml") {
            assert_eq!(MapServerMap::read(path).unwrap().unknown_gray_taken_for_free, 8894);
        }
        let Some(path) = real_data("maps_2d/willow-full.pgm") else { return };
        let map = MapServerMap::from_image(&Pgm::read(path).unwrap(), &MapServerInfo::of_image(0.1));
        let share = |kind| map.cells.iter().filter(|c| **c == kind).count() as f64 / map.cells.len() as f64;
        assert!(share(Unknown) > 0.2 && share(Free) > 0.2 && share(Occupied) > 0.01);
    }
}
