//! Livox's own message, `CustomMsg` of livox_ros_driver and livox_ros_driver2.

use super::header::Header;
use super::values::Record;
use crate::Result;

/// A point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LivoxPoint {
    /// Position in the sensor's frame (meters). (0, 0, 0): no echo.
    pub position: [f32; 3],
    /// Nanoseconds after the first point.
    pub offset_time: u32,
    /// Reflectivity (0 to 255).
    pub reflectivity: u8,
    /// Number of the laser.
    pub line: u8,
}

/// A scan of a Livox sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct LivoxScan {
    /// The time of the first point.
    pub header: Header,
    /// Its points.
    pub points: Vec<LivoxPoint>,
}

impl LivoxScan {
    /// Reads a `CustomMsg`.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for fields that are missing or of another kind.
    pub fn of(message: &Record<'_>) -> Result<Self> {
        let header = Header::of(message)?;
        let points = message.records("points")?.iter().map(|point| {
            let point = point?;
            let real = |name: &str| Ok(point.number(name)? as f32);
            // The definition has their sizes: these casts lose nothing.
            Ok(LivoxPoint {
                position: [real("x")?, real("y")?, real("z")?],
                offset_time: point.integer("offset_time")? as u32,
                reflectivity: point.integer("reflectivity")? as u8,
                line: point.integer("line")? as u8,
            })
        });
        Ok(Self { header, points: points.collect::<Result<_>>()? })
    }
}
