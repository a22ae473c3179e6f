//! Rows of answers, as `query` prints them: the distance that a field has at a point, and its certified bounds.

use std::io::{self, Write};

use portolan::field::{ClearanceField, Esdf, UnknownSpace};
use portolan::{Answer, Status};

/// One row of answers; `None` becomes an empty field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnswerRow<const D: usize> {
    /// The query point (meters).
    pub point: [f64; D],
    /// What is known about the distance.
    pub status: Status,
    /// Probability of being occupied.
    pub occupancy: Option<f64>,
    /// Signed distance (meters).
    pub distance: Option<f64>,
    /// Certified lower bound (meters).
    pub lower: Option<f64>,
    /// Certified upper bound (meters).
    pub upper: Option<f64>,
    /// Gradient of the distance.
    pub gradient: Option<[f64; D]>,
}

impl<const D: usize> AnswerRow<D> {
    /// A row about a point: its occupancy, and the distance of a field, in the frame of the point.
    pub fn of(point: [f64; D], occupancy: Option<f64>, distance: Answer<(f64, [f64; D])>) -> Self {
        Self {
            point,
            status: distance.status(),
            occupancy,
            distance: distance.value().map(|(d, _)| d),
            // Bounds are about the magnitude; the side is the distance's sign.
            lower: if distance.status() == Status::Saturated {
                distance.value().map(|(d, _)| d.abs())
            } else {
                None
            },
            upper: None,
            gradient: distance.known().map(|(_, gradient)| gradient),
        }
    }

    /// Fills in the certified bounds, where the row has a distance; `p` is its point in the frame of the field.
    /// A lower bound of `limit` meters or more makes the answer saturated.
    pub fn certify(
        &mut self,
        field: &impl ClearanceField<D>,
        p: [f64; D],
        unknown: UnknownSpace,
        limit: f64,
    ) {
        if !self.status.has_value() {
            return;
        }
        let bounds = |unknown| field.clearance(p, unknown).value();
        let surface = bounds(UnknownSpace::Optimistic);
        let far = surface.is_some_and(|c| c.lower >= limit);
        if far {
            self.status = Status::Saturated;
            self.distance = self.distance.map(|d| limit.copysign(d));
            self.gradient = None;
        }
        let surface_only = unknown == UnknownSpace::Optimistic;
        let asked = if surface_only { surface } else { bounds(unknown) };
        self.lower = asked.map(|c| if far { c.lower.min(limit) } else { c.lower });
        self.upper = asked.map(|c| c.upper).filter(|u| u.is_finite() && !(far && surface_only));
    }
}

/// A field is computed this many cells farther than it is reported, so that a saturated answer is certified.
pub const HELD_BACK: f64 = 2.0;

/// Meters up to which a field in bricks certifies: bounds fall short of distances by less than the two cells that are
/// held back.
pub fn certified_reach<const D: usize>(field: &Esdf<D>) -> f64 {
    f64::from(field.max_distance()) - HELD_BACK * field.lattice().resolution
}

/// Writes the header line of [`write_answer`]'s rows.
///
/// # Errors
/// Those of the writer.
pub fn write_answer_header<const D: usize>(w: &mut impl Write) -> io::Result<()> {
    let (z, gz) = if D == 3 { (",z", ",gz") } else { ("", "") };
    writeln!(w, "x,y{z},status,occupancy,distance,lower,upper,gx,gy{gz}")
}

/// Writes one row: `x,y[,z],status,occupancy,distance,lower,upper,gx,gy[,gz]`. Numbers are written so that
/// reading gives the same double.
///
/// # Errors
/// Those of the writer.
pub fn write_answer<const D: usize>(w: &mut impl Write, row: &AnswerRow<D>) -> io::Result<()> {
    for (k, v) in row.point.iter().enumerate() {
        write!(w, "{}{v}", if k == 0 { "" } else { "," })?;
    }
    write!(w, ",{}", row.status.word())?;
    let gradient = (0..D).map(|k| row.gradient.map(|g| g[k]));
    for field in [row.occupancy, row.distance, row.lower, row.upper].into_iter().chain(gradient) {
        match field {
            Some(v) => write!(w, ",{v}")?,
            None => write!(w, ",")?,
        }
    }
    writeln!(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_answers_are_empty_fields() {
        let mut out = Vec::new();
        write_answer_header::<2>(&mut out).unwrap();
        let row = AnswerRow {
            point: [0.1, 2.0],
            status: Status::Known,
            occupancy: Some(0.25),
            distance: Some(-1.5),
            lower: Some(-1.6),
            upper: None,
            gradient: Some([0.0, 1.0]),
        };
        write_answer(&mut out, &row).unwrap();
        let none = AnswerRow {
            point: [1.0, 2.0, 3.0],
            status: Status::Outside,
            occupancy: None,
            distance: None,
            lower: None,
            upper: None,
            gradient: None,
        };
        write_answer_header::<3>(&mut out).unwrap();
        write_answer(&mut out, &none).unwrap();
        let expected = "x,y,status,occupancy,distance,lower,upper,gx,gy\n0.1,2,known,0.25,-1.5,-1.6,,0,1\n\
                        x,y,z,status,occupancy,distance,lower,upper,gx,gy,gz\n1,2,3,outside,,,,,,,\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }
}
