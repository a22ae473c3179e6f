//! One beam of a scan.

/// What a beam measured; see the table in [`crate::scan`] for what each kind does to a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BeamKind {
    /// A surface at the beam's range.
    Hit,
    /// Nothing up to the beam's range; what lies beyond is not used.
    MaxRange,
    /// No echo. Frees space up to the beam's range, which is zero unless the caller gives another.
    NoReturn,
    /// No information.
    Dropped,
    /// The sensor saw the robot that carries it: no information about the world.
    SelfHit,
    /// Something at the beam's range that was not there at other times ([`crate::movers`]): free up to there.
    Mover,
}

/// A beam in the sensor's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam<const D: usize> {
    /// Unit vector from the sensor.
    pub direction: [f64; D],
    /// Meters; its meaning depends on the kind.
    pub range: f64,
    /// What the beam measured.
    pub kind: BeamKind,
}

impl<const D: usize> Beam<D> {
    /// Whether the beam ends on a surface.
    #[inline(always)]
    pub fn is_hit(&self) -> bool {
        self.kind == BeamKind::Hit
    }

    /// Arc length up to which the beam saw free space (meters); 0 where it has no information.
    #[inline(always)]
    pub fn free_range(&self) -> f64 {
        match self.kind {
            BeamKind::Hit | BeamKind::MaxRange | BeamKind::NoReturn | BeamKind::Mover => self.range,
            BeamKind::Dropped | BeamKind::SelfHit => 0.0,
        }
    }
}
