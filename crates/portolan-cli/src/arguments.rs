//! Values on the command line: read, checked, refused with a reason (clap then exits with status 2).

use portolan::cell::TsdfRule;
use portolan::geom::{Aabb, Pose};
use portolan::scan::Body;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::bad_call;

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse::<f64>().map_err(|_| "not a number".to_owned())
}

fn number_that(text: &str, fits: impl Fn(f64) -> bool, must_be: &str) -> Result<f64, String> {
    number(text).and_then(|v| if fits(v) { Ok(v) } else { Err(format!("must be {must_be}")) })
}

/// A part of a number of parts, as 3/8.
pub(crate) fn shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text.split_once('/').map(|(part, parts)| (part.trim().parse(), parts.trim().parse()));
    match numbers {
        Some((Ok(part), Ok(parts))) if (1..=parts).contains(&part) && parts <= 1_000_000 => Ok((part, parts)),
        _ => Err("must be a part and a number of parts, like 3/8, counted from 1".to_owned()),
    }
}

/// A length above zero.
pub(crate) fn length(text: &str) -> Result<f64, String> {
    number_that(text, |v| v > 0.0 && v.is_finite(), "a positive, finite length in meters, like 0.05")
}

/// A length of zero or more.
pub(crate) fn length_or_zero(text: &str) -> Result<f64, String> {
    number_that(text, |v| v >= 0.0 && v.is_finite(), "a finite length in meters, not negative")
}

/// A number of standard deviations.
pub(crate) fn sigmas(text: &str) -> Result<f64, String> {
    number_that(text, |v| v > 0.0 && v.is_finite(), "a number of standard deviations above zero, like 3")
}

/// A length, or infinitely far for `off`.
pub(crate) fn length_or_off(text: &str) -> Result<f64, String> {
    if text == "off" { Ok(f64::INFINITY) } else { length(text) }
}

/// Seconds within a day, of either sign.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    number_that(text, |v| v.abs() <= 86_400.0, "seconds, at most a day")
}

/// A weight above zero; `inf` is one.
pub(crate) fn weight(text: &str) -> Result<f32, String> {
    number_that(text, |v| v as f32 > 0.0, "a positive number, or inf to never forget").map(|v| v as f32)
}

/// A weight of zero or more.
pub(crate) fn weight_or_zero(text: &str) -> Result<f32, String> {
    let fits = |v: f64| v as f32 >= 0.0 && (v as f32).is_finite();
    number_that(text, fits, "a finite number, not negative").map(|v| v as f32)
}

/// A share above 0 and at most 1.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    let fits = |v: f64| v as f32 > 0.0 && v as f32 <= 1.0;
    number_that(text, fits, "above 0 and at most 1").map(|v| v as f32)
}

/// A share of beams, or 0.
pub(crate) fn thin(text: &str) -> Result<f64, String> {
    number_that(text, |v| (0.0..1.0).contains(&v), "0, or a share below 1")
}

/// A number of observations; `inf` is one.
pub(crate) fn half_life(text: &str) -> Result<f64, String> {
    number_that(text, |v| v >= 0.1, "a number of observations, 0.1 or more, or inf to never forget")
}

/// How soon distances forget, in either of two units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
pub(crate) struct ForgettingArgs {
    /// Largest weight of a cell, in observations; inf: old ones are never forgotten [default: 128; demo: 64]
    #[arg(long, value_name = "W", value_parser = weight, allow_negative_numbers = true)]
    #[serde(serialize_with = "finite", deserialize_with = "infinite", default = "never")]
    w_max: Option<f32>,
    /// --w-max as a half-life: the number of observations, whatever they weigh, after which half of an outdated distance is
    /// left [default: 89; demo: 45]
    #[arg(long, value_name = "N", value_parser = half_life, allow_negative_numbers = true, conflicts_with = "w_max")]
    #[serde(skip)]
    half_life: Option<f64>,
}

impl ForgettingArgs {
    /// With this largest weight.
    pub(crate) fn of(w_max: f32) -> Self {
        Self { w_max: Some(w_max), half_life: None }
    }

    /// The largest weight, where it was given. A half-life comes first: where both are set, the weight is that of a saved
    /// map.
    pub(crate) fn w_max(&self) -> Option<f32> {
        self.half_life.map(|n| TsdfRule::w_max_for_half_life(n, 1.0) as f32).or(self.w_max)
    }
}

/// The weight of a saved map that never forgets.
fn never() -> Option<f32> {
    Some(f32::INFINITY)
}

fn infinite<'de, D: Deserializer<'de>>(input: D) -> Result<Option<f32>, D::Error> {
    Ok(Option::<f32>::deserialize(input)?.or_else(never))
}

/// `null` for what is not finite or was not given.
pub(crate) fn finite<T: Copy + Into<f64>, S: Serializer>(
    value: &Option<T>,
    out: S,
) -> Result<S::Ok, S::Error> {
    value.map(Into::into).filter(|v: &f64| v.is_finite()).serialize(out)
}

/// 0 for what was not given.
pub(crate) fn or_zero<S: Serializer>(value: &Option<f64>, out: S) -> Result<S::Ok, S::Error> {
    value.unwrap_or(0.0).serialize(out)
}

/// A box of either dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bounds {
    /// x, y
    Two(Aabb<2>),
    /// x, y, z
    Three(Aabb<3>),
}

impl Bounds {
    /// The box in 2-D.
    ///
    /// # Errors
    /// A box in 3-D; `what` is the log or the map.
    pub(crate) fn in_2d(self, what: &str) -> anyhow::Result<Aabb<2>> {
        match self {
            Self::Two(bounds) => Ok(bounds),
            Self::Three(_) => {
                Err(bad_call(format!("{what} is 2-D: --bounds needs four numbers, x0,y0,x1,y1")))
            }
        }
    }

    /// The box in 3-D.
    ///
    /// # Errors
    /// A box in 2-D; `what` is the log or the map.
    pub(crate) fn in_3d(self, what: &str) -> anyhow::Result<Aabb<3>> {
        match self {
            Self::Three(bounds) => Ok(bounds),
            Self::Two(_) => {
                Err(bad_call(format!("{what} is 3-D: --bounds needs six numbers, x0,y0,z0,x1,y1,z1")))
            }
        }
    }
}

impl Serialize for Bounds {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Two(b) => [b.min, b.max].concat().serialize(out),
            Self::Three(b) => [b.min, b.max].concat().serialize(out),
        }
    }
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let values = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    if values.iter().all(|v| v.is_finite()) { Ok(values) } else { Err("must be finite numbers".to_owned()) }
}

fn corners<const D: usize>(min: [f64; D], max: [f64; D]) -> Result<Aabb<D>, String> {
    let ordered = (0..D).all(|k| min[k] < max[k]);
    ordered.then(|| Aabb::new(min, max)).ok_or_else(|| "must have its smaller corner first".to_owned())
}

/// `x0,y0,x1,y1` or `x0,y0,z0,x1,y1,z1` in meters.
pub(crate) fn bounds(text: &str) -> Result<Bounds, String> {
    match numbers(text)?[..] {
        [x0, y0, x1, y1] => corners([x0, y0], [x1, y1]).map(Bounds::Two),
        [x0, y0, z0, x1, y1, z1] => corners([x0, y0, z0], [x1, y1, z1]).map(Bounds::Three),
        _ => Err("must be four or six numbers: x0,y0,x1,y1 or x0,y0,z0,x1,y1,z1 in meters".to_owned()),
    }
}

/// `low:high` in meters.
pub(crate) fn heights(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once(':').ok_or("must be two heights LOW:HIGH in meters")?;
    match [number(low)?, number(high)?] {
        [low, high] if low <= high && low.is_finite() && high.is_finite() => Ok([low, high]),
        _ => Err("must be finite heights, the lower one first".to_owned()),
    }
}

/// `x,y,z` in meters.
pub(crate) fn point3(text: &str) -> Result<[f64; 3], String> {
    match numbers(text)?[..] {
        [x, y, z] => Ok([x, y, z]),
        _ => Err("must be three numbers x,y,z in meters".to_owned()),
    }
}

/// `x,y,z` or `x,y,z,qx,qy,qz,qw` (meters).
pub(crate) fn pose3(text: &str) -> Result<Pose<3>, String> {
    let pose = match numbers(text)?[..] {
        [x, y, z] => Some(Pose { translation: [x, y, z], ..Pose::IDENTITY }),
        [x, y, z, qx, qy, qz, qw] => Pose::<3>::from_quaternion([x, y, z], [qx, qy, qz, qw]),
        _ => None,
    };
    pose.ok_or_else(|| "must be x,y,z or x,y,z,qx,qy,qz,qw with a quaternion that is not zero".to_owned())
}

/// Where the coordinates of a map's cells have their zero.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Shift {
    /// At zero, or near the first scan where that is far.
    Auto,
    /// There (meters).
    At([f64; 3]),
}

/// `auto`, `0` or `x,y,z` in meters.
pub(crate) fn shift(text: &str) -> Result<Shift, String> {
    match text {
        "auto" => Ok(Shift::Auto),
        "0" => Ok(Shift::At([0.0; 3])),
        _ => point3(text)
            .map(Shift::At)
            .map_err(|_| "must be auto, 0 or three numbers x,y,z in meters".to_owned()),
    }
}

/// `x0,y0,z0,x1,y1,z1` in meters.
pub(crate) fn box3(text: &str) -> Result<Aabb<3>, String> {
    match bounds(text) {
        Ok(Bounds::Three(b)) => Ok(b),
        Err(e) => Err(e),
        Ok(Bounds::Two(_)) => Err("must be six numbers x0,y0,z0,x1,y1,z1 in meters".to_owned()),
    }
}

/// A box `x0,y0,z0,x1,y1,z1` or a sphere `x,y,z,radius` in meters.
pub(crate) fn body(text: &str) -> Result<Body, String> {
    body_of(&numbers(text)?)
}

fn body_of(numbers: &[f64]) -> Result<Body, String> {
    match *numbers {
        [x, y, z, radius] if radius > 0.0 => Ok(Body::Sphere { center: [x, y, z], radius }),
        [x0, y0, z0, x1, y1, z1] => corners([x0, y0, z0], [x1, y1, z1]).map(Body::Box),
        _ => Err("must be a box x0,y0,z0,x1,y1,z1 or a sphere x,y,z,radius in meters".to_owned()),
    }
}

/// Boxes and spheres as lists of their numbers.
pub(crate) mod bodies {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(bodies: &[Body], out: S) -> Result<S::Ok, S::Error> {
        out.collect_seq(bodies.iter().map(|body| match body {
            Body::Box(b) => [b.min, b.max].concat(),
            Body::Sphere { center: [x, y, z], radius } => vec![*x, *y, *z, *radius],
        }))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(input: D) -> Result<Vec<Body>, D::Error> {
        let lists = Vec::<Vec<f64>>::deserialize(input)?;
        lists.iter().map(|list| body_of(list).map_err(D::Error::custom)).collect()
    }
}

/// Bytes, with an optional suffix K, M, G or T (powers of 1024).
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let split = text.len() - text.chars().last().map_or(0, |c| if c.is_ascii_alphabetic() { 1 } else { 0 });
    let (digits, suffix) = text.split_at(split);
    let factor = match suffix.to_ascii_uppercase().as_str() {
        "" => 1.0,
        "K" => 1024f64,
        "M" => 1024f64.powi(2),
        "G" => 1024f64.powi(3),
        "T" => 1024f64.powi(4),
        _ => return Err("must be a number of bytes, like 512M or 4G".to_owned()),
    };
    match number(digits).map(|v| v * factor) {
        Ok(v) if (1.0..1e18).contains(&v) => Ok(v as u64),
        _ => Err("must be a number of bytes, like 512M or 4G".to_owned()),
    }
}

pub(crate) use portolan_draw::shown_bytes;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_refused() {
        for bad in ["-1", "0", "nan", "inf", "five", ""] {
            assert!(length(bad).is_err(), "{bad}");
        }
        assert_eq!(length("0.05"), Ok(0.05));
        assert!(length_or_zero("0").is_ok() && length_or_zero("-0.1").is_err());
        assert!(half_life("10").is_ok() && half_life("0").is_err() && half_life("nan").is_err());
        let asked = |n: &str| ForgettingArgs { half_life: half_life(n).ok(), ..Default::default() }.w_max();
        assert_eq!(asked("1"), Some(1.0));
        assert_eq!(asked("inf"), Some(f32::INFINITY));
        assert!(asked("0.1").is_some_and(|w| w > 0.0));
        assert!(weight("inf").is_ok() && weight("nan").is_err() && weight("0").is_err());
    }

    #[test]
    fn boxes_and_bytes() {
        assert_eq!(bounds("-1,-2,3,4.5"), Ok(Bounds::Two(Aabb::new([-1.0, -2.0], [3.0, 4.5]))));
        let space = Aabb::new([-1.0, -2.0, -3.0], [3.0, 4.5, 6.0]);
        assert_eq!(bounds("-1,-2,-3,3,4.5,6"), Ok(Bounds::Three(space)));
        assert_eq!((box3("-1,-2,-3,3,4.5,6"), body("-1,-2,-3,3,4.5,6")), (Ok(space), Ok(Body::Box(space))));
        assert_eq!(body("1,2,3,0.5"), Ok(Body::Sphere { center: [1.0, 2.0, 3.0], radius: 0.5 }));
        assert!(box3("1,2,3,4").is_err() && body("1,2,3,0").is_err() && body("1,2,3").is_err());
        for bad in ["1,2,3", "1,2,1,3", "1,2,nan,3", "a,b,c,d"] {
            assert!(bounds(bad).is_err(), "{bad}");
        }
        assert_eq!(heights("-0.1:1.5"), Ok([-0.1, 1.5]));
        assert!(["1", "2:1", "nan:1", "0:inf", ":"].iter().all(|bad| heights(bad).is_err()));
        assert_eq!(bytes("4G"), Ok(4 << 30));
        assert_eq!(bytes("1.5k"), Ok(1536));
        assert_eq!(bytes("1000"), Ok(1000));
        for bad in ["", "G", "-1", "4X", "nanM", "1e40"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }
}
