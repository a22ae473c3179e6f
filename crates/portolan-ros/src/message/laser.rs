//! `LaserScan` and `MultiEchoLaserScan`.

use super::header::Header;
use super::values::Record;
use crate::Result;

/// A scan of a planar laser, in the sensor's own numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScan {
    /// The time of the first ray, and the laser's frame: rays are in its plane of x and y, angles from x to y.
    pub header: Header,
    /// The angle of the first ray (radians).
    pub angle_min: f64,
    /// The angle of the last ray (radians), as declared: drivers round it, so that `angle_min + i * angle_increment` counts.
    pub angle_max: f64,
    /// From ray to ray (radians); negative for a scanner that turns clockwise.
    pub angle_increment: f64,
    /// From ray to ray (seconds); 0 where the driver does not say it.
    pub time_increment: f64,
    /// From scan to scan (seconds); 0 where the driver does not say it.
    pub scan_time: f64,
    /// Readings below this are invalid (meters).
    pub range_min: f64,
    /// Readings of this or more are no echo (meters).
    pub range_max: f64,
    /// Readings (meters) as they are: infinity is "no echo", NaN is invalid *(ROS REP 117)*.
    pub ranges: Vec<f32>,
}

/// Which echo of a ray is taken, where a laser hears several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EchoChoice {
    /// The nearest. A ray ends there for certain: what lies behind was seen through glass, leaves, or past an edge.
    #[default]
    First,
    /// The strongest, by the intensities; the first where the message has none.
    Strongest,
}

impl LaserScan {
    /// Reads a `sensor_msgs/LaserScan`.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for fields that are missing or no numbers.
    pub fn of(message: &Record<'_>) -> Result<Self> {
        Self::with_ranges(message, message.numbers("ranges")?.iter().map(|r| r as f32).collect())
    }

    /// Reads a `sensor_msgs/MultiEchoLaserScan`: one echo a ray. A ray without an echo reads infinity.
    ///
    /// # Errors
    /// As [`LaserScan::of`].
    pub fn of_echoes(message: &Record<'_>, choice: EchoChoice) -> Result<Self> {
        let mut intensities = message.records("intensities")?.iter();
        let mut ranges = Vec::new();
        for ray in message.records("ranges")?.iter() {
            let strengths: Option<Vec<f64>> = match intensities.next() {
                Some(echoes) => Some(echoes?.numbers("echoes")?.iter().collect()),
                None => None,
            };
            let echoes: Vec<f64> = ray?.numbers("echoes")?.iter().collect();
            ranges.push(chosen(&echoes, strengths.as_deref(), choice) as f32);
        }
        Self::with_ranges(message, ranges)
    }

    fn with_ranges(message: &Record<'_>, ranges: Vec<f32>) -> Result<Self> {
        let number = |name: &str| message.number(name);
        Ok(Self {
            header: Header::of(message)?,
            angle_min: number("angle_min")?,
            angle_max: number("angle_max")?,
            angle_increment: number("angle_increment")?,
            time_increment: number("time_increment")?,
            scan_time: number("scan_time")?,
            range_min: number("range_min")?,
            range_max: number("range_max")?,
            ranges,
        })
    }
}

fn chosen(echoes: &[f64], strengths: Option<&[f64]>, choice: EchoChoice) -> f64 {
    let usable = || echoes.iter().copied().filter(|r| r.is_finite());
    let first = || usable().fold(f64::INFINITY, f64::min);
    match (choice, strengths) {
        (EchoChoice::Strongest, Some(strengths)) if strengths.len() == echoes.len() => {
            let pairs = echoes.iter().zip(strengths).filter(|(r, s)| r.is_finite() && s.is_finite());
            pairs
                .fold(
                    (f64::INFINITY, f64::NEG_INFINITY),
                    |best, (r, s)| if *s > best.1 { (*r, *s) } else { best },
                )
                .0
        }
        _ => first(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Decoder;
    use super::super::decoder::tests::{Writer, topic};
    use super::*;
    use crate::container::{DefinitionFormat, Encoding};

    const ROS1: &str = "Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\n\
        float32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

    #[test]
    fn scans_of_ros_1_and_2_are_one() {
        let write = |mut w: Writer| {
            w.header((1_700_000_000, 250_000_000), "/laser");
            [1.5, -1.5, -0.25, 1e-4, 0.1, 0.05, 30.0].into_iter().for_each(|v| {
                w.f32(v);
            });
            w.f32s(&[1.0, f32::INFINITY, f32::NAN]).f32s(&[]);
            w.bytes
        };
        let read = |encoding, format, text: &str, bytes: Vec<u8>| {
            let decoder = Decoder::new(&topic("sensor_msgs/LaserScan", encoding, format, text)).unwrap();
            LaserScan::of(&decoder.decode(&bytes).unwrap().record).unwrap()
        };
        for scan in [
            read(Encoding::Ros1, DefinitionFormat::Ros1Msg, ROS1, write(Writer::ros1())),
            read(Encoding::Cdr, DefinitionFormat::Missing, "", write(Writer::cdr(false))),
            read(Encoding::Cdr, DefinitionFormat::Missing, "", write(Writer::cdr(true))),
        ] {
            assert_eq!(scan.header, Header { stamp: 1_700_000_000_250_000_000, frame: "laser".into() });
            assert_eq!((scan.angle_min, scan.angle_increment, scan.range_max), (1.5, -0.25, 30.0));
            assert!(scan.ranges[2].is_nan() && scan.ranges[..2] == [1.0, f32::INFINITY]);
            assert_eq!(scan.time_increment, f64::from(1e-4f32));
        }
    }

    /// The definition decides: fields may come in another order, with others between.
    #[test]
    fn a_changed_scan_is_read_by_its_definition() {
        let text = "float32[] ranges\nuint8 flag\nfloat64 angle_increment\nHeader header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 time_increment\n\
            float32 scan_time\nfloat32 range_min\nfloat32 range_max\n===\nMSG: std_msgs/Header\ntime stamp\nstring frame_id\n";
        let mut w = Writer::ros1();
        w.f32s(&[2.0, 3.0]).u8(1).f64(0.125).u32(5).u32(0).text("l");
        (1..7).for_each(|v| {
            w.f32(v as f32);
        });
        let decoder =
            Decoder::new(&topic("sensor_msgs/LaserScan", Encoding::Ros1, DefinitionFormat::Ros1Msg, text))
                .unwrap();
        let scan = LaserScan::of(&decoder.decode(&w.bytes).unwrap().record).unwrap();
        assert_eq!((scan.ranges, scan.angle_increment, scan.angle_min), (vec![2.0, 3.0], 0.125, 1.0));
        assert_eq!((scan.range_min, scan.range_max, scan.header.stamp), (5.0, 6.0, 5_000_000_000));
    }

    #[test]
    fn of_several_echoes_one_is_taken() {
        let mut w = Writer::cdr(false);
        w.header((1, 0), "l");
        (0..7).for_each(|_| {
            w.f32(0.5);
        });
        w.u32(3).f32s(&[2.0, 1.0, f32::INFINITY]).f32s(&[]).f32s(&[4.0]);
        w.u32(2).f32s(&[9.0, 1.0, 2.0]).f32s(&[]);
        let decoder = Decoder::new(&topic(
            "sensor_msgs/msg/MultiEchoLaserScan",
            Encoding::Cdr,
            DefinitionFormat::Missing,
            "",
        ))
        .unwrap();
        let message = decoder.decode(&w.bytes).unwrap();
        let first = LaserScan::of_echoes(&message.record, EchoChoice::First).unwrap();
        assert_eq!(first.ranges, [1.0, f32::INFINITY, 4.0]);
        let strongest = LaserScan::of_echoes(&message.record, EchoChoice::Strongest).unwrap();
        assert_eq!(strongest.ranges, [2.0, f32::INFINITY, 4.0]);
    }
}
