//! Contours as GeoJSON: one `Feature` with a `MultiLineString`.
//!
//! Coordinates are meters of the map's own frame, not degrees as RFC 7946 has it; as the property `units` states.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use serde::Deserialize;
use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde_json::value::RawValue;

use crate::bytes::{Input, open, write_atomic};
use crate::error::shown;
use crate::{IoError, Polyline, Result};

/// The longest file that is read (bytes).
const LONGEST: u64 = 256 << 20;

/// Writes polylines (meters, in order; a closed one repeats its first point).
///
/// # Errors
/// [`IoError::Unwritable`] for a coordinate that is not finite, else as [`write_atomic`].
pub fn write_geojson(path: impl AsRef<Path>, lines: &[Polyline]) -> Result<()> {
    let path = path.as_ref();
    check_finite(path, lines)?;
    write_atomic(path, |w| write_to(w, lines))
}

/// The same as bytes in memory.
///
/// # Errors
/// [`IoError::Unwritable`] for a coordinate that is not finite.
pub fn geojson_to_bytes(lines: &[Polyline]) -> Result<Vec<u8>> {
    let name = Path::new("contour.geojson");
    check_finite(name, lines)?;
    let mut bytes = Vec::new();
    write_to(&mut bytes, lines).map_err(|e| IoError::os(name, "write it", e))?;
    Ok(bytes)
}

/// Refuses coordinates that no text format can hold.
pub(crate) fn check_finite(path: &Path, lines: &[Polyline]) -> Result<()> {
    match lines.iter().flatten().find(|p| !p.iter().all(|v| v.is_finite())) {
        Some(p) => Err(IoError::unwritable(path, "a point", format!("{p:?}"), "give finite coordinates")),
        None => Ok(()),
    }
}

fn write_to(w: &mut impl Write, lines: &[Polyline]) -> io::Result<()> {
    w.write_all(b"{\"type\":\"Feature\",\"properties\":{\"units\":\"metres\"},\"geometry\":")?;
    w.write_all(b"{\"type\":\"MultiLineString\",\"coordinates\":[")?;
    for (i, line) in lines.iter().enumerate() {
        w.write_all(if i == 0 { b"\n[" } else { b",\n[" })?;
        for (k, [x, y]) in line.iter().enumerate() {
            write!(w, "{}[{x},{y}]", if k == 0 { "" } else { "," })?;
        }
        w.write_all(b"]")?;
    }
    w.write_all(b"\n]}}\n")
}

/// Reads the lines of a GeoJSON file: `LineString`, `MultiLineString` and the rings of `Polygon` and
/// `MultiPolygon`, alone, as a `Feature` or in a `FeatureCollection`; points are passed over, and so is
/// everything but x and y.
///
/// # Errors
/// [`IoError::Text`] where the file is not GeoJSON or longer than 256 MiB.
pub fn read_geojson(path: impl AsRef<Path>) -> Result<Vec<Polyline>> {
    parse_geojson(open(path)?)
}

/// [`read_geojson`] from any input.
///
/// # Errors
/// As [`read_geojson`].
pub fn parse_geojson(mut input: Input) -> Result<Vec<Polyline>> {
    let bytes = input.read_all(LONGEST)?;
    let failed = |e: serde_json::Error| {
        let value = shown(e.to_string());
        let advice = "write lines as a Feature or geometry";
        IoError::text(input.path(), e.line() as u64, "the GeoJSON", value, advice)
    };
    let mut lines = Vec::new();
    let top: Object = serde_json::from_slice(&bytes).map_err(failed)?;
    top.collect(&mut lines, 0).map_err(failed)?;
    if let Some(i) = lines.iter().position(|l| !l.iter().flatten().all(|v| v.is_finite())) {
        let field = format!("a coordinate of line string {i}");
        return Err(IoError::text(input.path(), 1, field, "not finite", "write finite numbers"));
    }
    Ok(lines)
}

/// Any GeoJSON object; `coordinates` stay text until the type is known.
#[derive(Deserialize)]
struct Object<'a> {
    #[serde(rename = "type")]
    kind: String,
    #[serde(borrow, default)]
    coordinates: Option<&'a RawValue>,
    #[serde(borrow, default)]
    geometry: Option<&'a RawValue>,
    #[serde(borrow, default)]
    geometries: Option<Vec<&'a RawValue>>,
    #[serde(borrow, default)]
    features: Option<Vec<&'a RawValue>>,
}

impl Object<'_> {
    fn collect(&self, lines: &mut Vec<Polyline>, depth: u32) -> serde_json::Result<()> {
        use serde::de::Error;
        // Collections in collections: the raw values are parsed level by level, so that the parser's own limit
        // does not count them.
        if depth > 8 {
            return Err(Error::custom("nested too deeply"));
        }
        let text = || self.coordinates.map(RawValue::get).ok_or_else(|| Error::missing_field("coordinates"));
        let inner = |raw: &RawValue, lines: &mut Vec<Polyline>| {
            serde_json::from_str::<Object>(raw.get())?.collect(lines, depth + 1)
        };
        let found: Vec<Vec<Position>> = match self.kind.as_str() {
            "Feature" => return self.geometry.map_or(Ok(()), |g| inner(g, lines)),
            "FeatureCollection" => return self.features.iter().flatten().try_for_each(|f| inner(f, lines)),
            "GeometryCollection" => {
                return self.geometries.iter().flatten().try_for_each(|g| inner(g, lines));
            }
            "Point" | "MultiPoint" => return Ok(()),
            "LineString" => vec![serde_json::from_str(text()?)?],
            "MultiLineString" | "Polygon" => serde_json::from_str(text()?)?,
            "MultiPolygon" => {
                let polygons: Vec<Vec<Vec<Position>>> = serde_json::from_str(text()?)?;
                polygons.into_iter().flatten().collect()
            }
            other => return Err(Error::custom(format!("the type {other} is not GeoJSON"))),
        };
        lines.extend(found.into_iter().map(|line| line.into_iter().map(|p| p.0).collect()));
        Ok(())
    }
}

/// x and y; further numbers are allowed and ignored.
struct Position([f64; 2]);

impl<'de> Deserialize<'de> for Position {
    fn deserialize<T: serde::Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        struct Numbers;
        impl<'de> Visitor<'de> for Numbers {
            type Value = Position;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a position [x, y]")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Position, A::Error> {
                let mut next = |k| {
                    seq.next_element::<f64>()?
                        .ok_or_else(|| serde::de::Error::invalid_length(k, &"two numbers"))
                };
                let p = [next(0)?, next(1)?];
                while seq.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Position(p))
            }
        }
        deserializer.deserialize_seq(Numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, no_panic, says, temporary};

    fn parse(text: impl Into<Vec<u8>>) -> Result<Vec<Polyline>> {
        parse_geojson(Input::from_reader(io::Cursor::new(text.into()), "c.geojson".as_ref())?)
    }

    #[test]
    fn round_trips_to_the_bit() {
        let mut random = Random(8);
        let mut point = || [random.unit() * 4e6, -random.unit() * 1e-7];
        let lines: Vec<Polyline> = (0..9).map(|n| (0..n).map(|_| point()).collect()).collect();
        let (_folder, path) = temporary("c.geojson");
        write_geojson(&path, &lines).unwrap();
        assert_eq!(read_geojson(&path).unwrap(), lines);
        write_geojson(&path, &[]).unwrap();
        assert!(read_geojson(&path).unwrap().is_empty());
        assert!(write_geojson(&path, &[vec![[f64::NAN, 0.0]]]).is_err());
    }

    #[test]
    fn other_shapes_are_understood() {
        let expected: Vec<Polyline> = vec![vec![[1.0, 2.0], [3.0, 4.5]]];
        for text in [
            r#"{"coordinates":[[1,2,9],[3,4.5]],"type":"LineString"}"#,
            r#"{"type":"Polygon","coordinates":[[[1,2],[3,4.5]]],"x":{"y":[]}}"#,
            r#"{"type":"FeatureCollection","features":[{"type":"Feature","geometry":{"type":"Point","coordinates":[1,2]}},{"type":"Feature","geometry":null},{"type":"Feature","geometry":{"type":"MultiPolygon","coordinates":[[[[1,2],[3,4.5]]]]}}]}"#,
        ] {
            assert_eq!(parse(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn errors_name_the_place() {
        for (text, part) in [
            ("{\"type\":\n\"Circle\"}", "the type Circle is not GeoJSON"),
            ("{\"type\":\"LineString\"}", "missing field `coordinates`"),
            ("{\"type\":\"LineString\",\n\"coordinates\":[[1]]}", "the GeoJSON is"),
            ("", "c.geojson: line 1: the GeoJSON is \"EOF"),
        ] {
            says(parse(text), part);
        }
        let deep = "{\"type\":\"GeometryCollection\",\"geometries\":[".repeat(1000);
        assert!(parse(deep).is_err());
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good =
            br#"{"type":"Feature","geometry":{"type":"MultiLineString","coordinates":[[[1,2],[3,4]]]}}"#;
        no_panic(good, 12, 4000, parse);
    }
}
