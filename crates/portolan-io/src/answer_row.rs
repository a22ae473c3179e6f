//! Rows of answers, as `query` prints them: the distance that a field has at a point, and its certified bounds.

use std::io::{self, Write};

use portolan::field::{ClearanceField, Esdf, SurfaceNoise, UnknownSpace};
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
    /// Certified lower bound (meters) of the distance to obstacles, unknown space among them where it counts as one; negative
    /// inside of obstacles like the distance.
    pub lower: Option<f64>,
    /// Certified upper bound (meters) of the distance to the nearest known obstacle.
    pub upper: Option<f64>,
    /// Gradient of the distance to the nearest known obstacle.
    pub gradient: Option<[f64; D]>,
    /// What unknown space counts as; `None` where nothing is certified.
    pub unknown: Option<UnknownSpace>,
    /// Standard deviation of the distance (meters), where the surface is known to be so sure.
    pub sigma: Option<f64>,
    /// What `lower` would be if every obstacle were nearer by so many of its standard deviations as were asked for (meters).
    pub lower_at: Option<f64>,
}

/// The columns at the end of a row about what the surface itself is uncertain by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SigmaColumns {
    /// None.
    #[default]
    No,
    /// `sigma`.
    Sigma,
    /// `sigma`, and the lower bound at so many standard deviations, which the column's name says.
    LowerAt(f64),
}

impl SigmaColumns {
    /// The name of the column of [`AnswerRow::lower_at`], `lower_at_3_sigma` for three standard deviations, if there is one.
    pub fn lower_at(self) -> Option<String> {
        match self {
            Self::LowerAt(sigmas) => Some(format!("lower_at_{sigmas}_sigma")),
            Self::No | Self::Sigma => None,
        }
    }
}

impl<const D: usize> AnswerRow<D> {
    /// A row about a point: its occupancy, and the distance of a field, in the frame of the point.
    pub fn of(point: [f64; D], occupancy: Option<f64>, distance: Answer<(f64, [f64; D])>) -> Self {
        Self {
            point,
            status: distance.status(),
            occupancy,
            distance: distance.value().map(|(d, _)| d),
            // Nothing is certified; what is saturated is at least so far away, on its side.
            lower: distance
                .value()
                .map(|(d, _)| d)
                .filter(|d| distance.status() == Status::Saturated && *d >= 0.0),
            upper: distance
                .value()
                .map(|(d, _)| d)
                .filter(|d| distance.status() == Status::Saturated && *d < 0.0),
            gradient: distance.known().map(|(_, gradient)| gradient),
            unknown: None,
            sigma: None,
            lower_at: None,
        }
    }

    /// Fills in what is certified; `p` is the row's point in the frame of the field. Afterwards the row is one statement: the
    /// nearest known obstacle is `distance` away, certified to be no more than `upper`, and nothing is nearer than `lower`,
    /// which counts unknown space where that is an obstacle. The distance lies within its bounds, and all three have one
    /// sign. In a cell of which something is known, it is known, though centers beside the point may not be; there is no
    /// gradient then. A magnitude of `limit` meters or more makes the answer saturated.
    pub fn certify(
        &mut self,
        field: &impl ClearanceField<D>,
        p: [f64; D],
        unknown: UnknownSpace,
        limit: f64,
    ) {
        let counts = unknown == UnknownSpace::Pessimistic || !self.status.has_value();
        let pessimistic = counts.then(|| field.clearance(p, UnknownSpace::Pessimistic).value()).flatten();
        if !self.status.has_value() && pessimistic.is_none() {
            return;
        }
        let Some(c) = field.clearance(p, UnknownSpace::Optimistic).value() else { return };
        self.unknown = Some(unknown);
        let lower = c.lower.min(limit);
        // Of what goes on beyond the limit no upper bound is said.
        let upper = Some(c.upper).filter(|u| u.is_finite() && c.lower < limit);
        let interpolated = self.distance.map_or(c.upper, |d| (if c.inside { -d } else { d }).max(0.0));
        let magnitude = upper.map_or(lower, |upper| interpolated.clamp(lower, upper));
        let nearest = match unknown {
            UnknownSpace::Optimistic => lower,
            // In unknown space itself nothing is certain to be farther.
            UnknownSpace::Pessimistic => pessimistic.map_or(0.0, |c| c.lower.min(lower)),
        };
        let signed = |v: f64| if c.inside { 0.0 - v } else { v };
        self.status = if upper.is_some() { Status::Known } else { Status::Saturated };
        self.distance = Some(signed(magnitude));
        let bounds = [Some(signed(nearest)), upper.map(signed)];
        [self.lower, self.upper] = if c.inside { [bounds[1], bounds[0]] } else { bounds };
        if self.status == Status::Saturated {
            self.gradient = None;
        }
    }
}

impl<const D: usize> AnswerRow<D> {
    /// Fills in [`AnswerRow::lower_at`] of a row that [`AnswerRow::certify`] filled in by the same field.
    pub fn less_noise(&mut self, field: &Esdf<D>, noise: &SurfaceNoise<D>, p: [f64; D]) {
        let (Some(lower), Some(unknown)) = (self.lower, self.unknown) else { return };
        let less = |unknown| field.less_noise(noise).clearance(p, unknown).value();
        self.lower_at = match less(UnknownSpace::Optimistic) {
            // What is inside may lie deeper.
            Some(c) if c.inside => Some(lower - noise.margin_within(p, c.upper)),
            Some(c) => Some(match unknown {
                UnknownSpace::Optimistic => c.lower,
                UnknownSpace::Pessimistic => less(UnknownSpace::Pessimistic).map_or(0.0, |c| c.lower),
            })
            // Bounds are given up to a limit.
            .map(|less| less.min(lower)),
            None => None,
        };
    }
}

/// A field is computed this many cells farther than it is reported, so that a saturated answer is certified.
pub const HELD_BACK: f64 = 2.0;

/// Meters up to which a field in bricks certifies: bounds fall short of distances by less than the two cells that are
/// held back.
pub fn certified_reach<const D: usize>(field: &Esdf<D>) -> f64 {
    f64::from(field.max_distance()) - HELD_BACK * field.lattice().resolution
}

/// Writes the header line of [`write_answer`]'s rows with these columns.
///
/// # Errors
/// Those of the writer.
pub fn write_answer_header<const D: usize>(w: &mut impl Write, columns: SigmaColumns) -> io::Result<()> {
    let (z, gz) = if D == 3 { (",z", ",gz") } else { ("", "") };
    write!(w, "x,y{z},status,occupancy,distance,lower,upper,gx,gy{gz},unknown_as")?;
    if columns != SigmaColumns::No {
        write!(w, ",sigma")?;
    }
    match columns.lower_at() {
        Some(name) => writeln!(w, ",{name}"),
        None => writeln!(w),
    }
}

/// Writes one row: `x,y[,z],status,occupancy,distance,lower,upper,gx,gy[,gz],unknown_as[,sigma[,lower_at_K_sigma]]`. Numbers are
/// written so that reading gives the same double.
///
/// # Errors
/// Those of the writer.
pub fn write_answer<const D: usize>(
    w: &mut impl Write,
    row: &AnswerRow<D>,
    columns: SigmaColumns,
) -> io::Result<()> {
    for (k, v) in row.point.iter().enumerate() {
        write!(w, "{}{v}", if k == 0 { "" } else { "," })?;
    }
    write!(w, ",{}", row.status.word())?;
    let gradient = (0..D).map(|k| row.gradient.map(|g| g[k]));
    for field in [row.occupancy, row.distance, row.lower, row.upper].into_iter().chain(gradient) {
        write_number(w, field)?;
    }
    write!(w, ",{}", row.unknown.map_or("", UnknownSpace::word))?;
    if columns != SigmaColumns::No {
        write_number(w, row.sigma)?;
    }
    if let SigmaColumns::LowerAt(_) = columns {
        write_number(w, row.lower_at)?;
    }
    writeln!(w)
}

fn write_number(w: &mut impl Write, v: Option<f64>) -> io::Result<()> {
    match v {
        Some(v) => write!(w, ",{v}"),
        None => write!(w, ","),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::field::Clearance;

    /// A field that answers the same everywhere.
    struct Same {
        free: Answer<Clearance>,
        obstacle: Answer<Clearance>,
    }

    impl ClearanceField<2> for Same {
        fn clearance(&self, _: [f64; 2], unknown: UnknownSpace) -> Answer<Clearance> {
            if unknown == UnknownSpace::Optimistic { self.free } else { self.obstacle }
        }

        fn distance_and_gradient(&self, _: [f64; 2]) -> Answer<(f64, [f64; 2])> {
            Answer::Unknown
        }

        fn resolution(&self) -> f64 {
            0.1
        }
    }

    fn clearance(lower: f64, upper: f64, inside: bool) -> Clearance {
        Clearance { lower, upper, inside }
    }

    fn certified(
        interpolated: Answer<(f64, [f64; 2])>,
        field: &Same,
        unknown: UnknownSpace,
    ) -> (Status, [Option<f64>; 3]) {
        let mut row = AnswerRow::of([0.0; 2], None, interpolated);
        row.certify(field, [0.0; 2], unknown, 1.0);
        (row.status, [row.lower, row.distance, row.upper])
    }

    #[test]
    fn a_row_is_one_statement() {
        use UnknownSpace::{Optimistic, Pessimistic};
        let known = |d| Answer::Known((d, [1.0, 0.0]));
        let free = Same {
            free: Answer::Known(clearance(0.4, 0.5, false)),
            obstacle: Answer::Known(clearance(0.2, 0.25, false)),
        };
        // Interpolated values are taken into the bounds; unknown space lowers what is certain alone.
        for (d, said) in [(0.3, 0.4), (0.45, 0.45), (0.7, 0.5), (-0.1, 0.4)] {
            let row = certified(known(d), &free, Optimistic);
            assert_eq!(row, (Status::Known, [Some(0.4), Some(said), Some(0.5)]));
            let row = certified(known(d), &free, Pessimistic);
            assert_eq!(row, (Status::Known, [Some(0.2), Some(said), Some(0.5)]));
        }
        // Where a center beside the point is unknown, what is certified is known.
        let row = certified(Answer::Unknown, &free, Optimistic);
        assert_eq!(row, (Status::Known, [Some(0.4), Some(0.5), Some(0.5)]));
        // Inside one sign is that of all.
        let at = clearance(0.05, 0.06, true);
        let inside = Same { free: Answer::Known(at), obstacle: Answer::Known(at) };
        let row = certified(known(-0.2), &inside, Pessimistic);
        assert_eq!(row, (Status::Known, [Some(-0.06), Some(-0.06), Some(-0.05)]));
        // Beyond the limit there is no upper bound, and the distance is where it begins.
        let far = Answer::Saturated(clearance(1.2, f64::INFINITY, false));
        let far = Same { free: far, obstacle: Answer::Known(clearance(0.3, 0.4, false)) };
        let row = certified(Answer::Saturated((1.5, [0.0; 2])), &far, Pessimistic);
        assert_eq!(row, (Status::Saturated, [Some(0.3), Some(1.0), None]));
        // A cell that was not observed stays unknown.
        let nothing = Same { free: free.free, obstacle: Answer::Unknown };
        assert_eq!(certified(Answer::Unknown, &nothing, Optimistic), (Status::Unknown, [None; 3]));
    }

    #[test]
    fn missing_answers_are_empty_fields() {
        let mut out = Vec::new();
        write_answer_header::<2>(&mut out, SigmaColumns::No).unwrap();
        let row = AnswerRow {
            point: [0.1, 2.0],
            status: Status::Known,
            occupancy: Some(0.25),
            distance: Some(-1.5),
            lower: Some(-1.6),
            upper: None,
            gradient: Some([0.0, 1.0]),
            unknown: Some(UnknownSpace::Pessimistic),
            sigma: None,
            lower_at: None,
        };
        write_answer(&mut out, &row, SigmaColumns::No).unwrap();
        let none = AnswerRow {
            point: [1.0, 2.0, 3.0],
            status: Status::Outside,
            occupancy: None,
            distance: None,
            lower: None,
            upper: None,
            gradient: None,
            unknown: None,
            sigma: None,
            lower_at: None,
        };
        write_answer_header::<3>(&mut out, SigmaColumns::No).unwrap();
        write_answer(&mut out, &none, SigmaColumns::No).unwrap();
        let expected = "x,y,status,occupancy,distance,lower,upper,gx,gy,unknown_as\n0.1,2,known,0.25,-1.5,-1.6,,0,1,obstacle\n\
                        x,y,z,status,occupancy,distance,lower,upper,gx,gy,gz,unknown_as\n1,2,3,outside,,,,,,,,\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
        let ends = |columns: SigmaColumns, row: &AnswerRow<2>| {
            let mut out = Vec::new();
            write_answer_header::<2>(&mut out, columns).unwrap();
            write_answer(&mut out, row, columns).unwrap();
            let text = String::from_utf8(out).unwrap();
            text.lines()
                .map(|line| line.split(',').skip(10).collect::<Vec<_>>().join(","))
                .collect::<Vec<_>>()
        };
        let sure = AnswerRow { sigma: Some(0.02), lower_at: Some(-0.5), ..row };
        assert_eq!(ends(SigmaColumns::Sigma, &row), ["sigma", ""]);
        assert_eq!(ends(SigmaColumns::Sigma, &sure), ["sigma", "0.02"]);
        assert_eq!(ends(SigmaColumns::LowerAt(2.5), &row), ["sigma,lower_at_2.5_sigma", ","]);
        assert_eq!(ends(SigmaColumns::LowerAt(3.0), &sure), ["sigma,lower_at_3_sigma", "0.02,-0.5"]);
    }
}
