//! What became of the beams: whatever is dropped is counted.

use super::{BeamKind, ScanWays, Way};

/// Beams by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BeamCounts {
    /// Ended on a surface.
    pub hit: u64,
    /// Cut at the caller's limit.
    pub max_range: u64,
    /// Came back without an echo.
    pub no_return: u64,
    /// Carry no information.
    pub dropped: u64,
    /// Saw the robot itself.
    pub self_hit: u64,
    /// Saw what was not there at other times. Only scans of beams know them; where points and pixels were taken out as movers, what
    /// is left of them is counted as `max_range`.
    pub mover: u64,
}

impl BeamCounts {
    /// Counts one beam.
    pub fn count(&mut self, kind: BeamKind) {
        *match kind {
            BeamKind::Hit => &mut self.hit,
            BeamKind::MaxRange => &mut self.max_range,
            BeamKind::NoReturn => &mut self.no_return,
            BeamKind::Dropped => &mut self.dropped,
            BeamKind::SelfHit => &mut self.self_hit,
            BeamKind::Mover => &mut self.mover,
        } += 1;
    }

    /// All beams.
    pub fn total(&self) -> u64 {
        self.hit + self.max_range + self.no_return + self.dropped + self.self_hit + self.mover
    }
}

impl std::ops::AddAssign for BeamCounts {
    fn add_assign(&mut self, o: Self) {
        self.hit += o.hit;
        self.max_range += o.max_range;
        self.no_return += o.no_return;
        self.dropped += o.dropped;
        self.self_hit += o.self_hit;
        self.mover += o.mover;
    }
}

impl std::ops::SubAssign for BeamCounts {
    fn sub_assign(&mut self, o: Self) {
        self.hit -= o.hit;
        self.max_range -= o.max_range;
        self.no_return -= o.no_return;
        self.dropped -= o.dropped;
        self.self_hit -= o.self_hit;
        self.mover -= o.mover;
    }
}

/// Readings that could not be used, by cause. They stay in the scan as [`BeamKind::Dropped`], so that their
/// neighbors keep their places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefusedBeams {
    /// NaN or infinite range or direction.
    pub not_finite: u64,
    /// Negative range.
    pub negative: u64,
    /// Nearer than the caller's minimum range (zero readings among them).
    pub too_near: u64,
    /// Further than a map can follow: no cell has such an index, or the ray passes too many cells.
    pub too_far: u64,
}

impl RefusedBeams {
    /// All refused readings.
    pub fn total(&self) -> u64 {
        self.not_finite + self.negative + self.too_near + self.too_far
    }
}

impl std::ops::Add for RefusedBeams {
    type Output = Self;
    fn add(mut self, o: Self) -> Self {
        self += o;
        self
    }
}

impl std::ops::AddAssign for RefusedBeams {
    fn add_assign(&mut self, o: Self) {
        self.not_finite += o.not_finite;
        self.negative += o.negative;
        self.too_near += o.too_near;
        self.too_far += o.too_far;
    }
}

impl std::ops::SubAssign for RefusedBeams {
    fn sub_assign(&mut self, o: Self) {
        self.not_finite -= o.not_finite;
        self.negative -= o.negative;
        self.too_near -= o.too_near;
        self.too_far -= o.too_far;
    }
}

/// What integrating one scan did; sums over scans with `+=`, without one that was taken back with `-=`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanStats {
    /// Scans fused.
    pub scans: u64,
    /// Scans refused whole, because the pose is not rigid or not finite or has no cell index.
    pub refused_poses: u64,
    /// Beams of the fused scans, by kind.
    pub beams: BeamCounts,
    /// Readings that were refused when the scans were built, by cause.
    pub refused: RefusedBeams,
    /// Cell observations applied.
    pub cells: u64,
    /// Hits whose end point lies outside the map's bounds; their beams free what is inside.
    pub hits_outside: u64,
    /// 3-D scans by how they became evidence, and why.
    pub ways: ScanWays,
}

impl ScanStats {
    /// What a scan leaves whose pose is refused.
    pub fn refused_pose() -> Self {
        Self { refused_poses: 1, ..Self::default() }
    }

    /// The same, of a scan that became evidence in this way, if it did.
    pub(crate) fn by(self, way: Way) -> Self {
        let ways = if self.scans > 0 { ScanWays::one(way) } else { ScanWays::default() };
        Self { ways, ..self }
    }

    /// Moves one beam to the dropped ones, because it is too long to be followed.
    pub(crate) fn refuse_far(&mut self, hit: bool) {
        let from = if hit { &mut self.beams.hit } else { &mut self.beams.max_range };
        *from = from.saturating_sub(1);
        self.beams.dropped += 1;
        self.refused.too_far += 1;
    }
}

impl std::ops::AddAssign for ScanStats {
    fn add_assign(&mut self, o: Self) {
        self.scans += o.scans;
        self.refused_poses += o.refused_poses;
        self.beams += o.beams;
        self.refused += o.refused;
        self.cells += o.cells;
        self.hits_outside += o.hits_outside;
        self.ways += o.ways;
    }
}

impl std::ops::SubAssign for ScanStats {
    fn sub_assign(&mut self, o: Self) {
        self.scans -= o.scans;
        self.refused_poses -= o.refused_poses;
        self.beams -= o.beams;
        self.refused -= o.refused;
        self.cells -= o.cells;
        self.hits_outside -= o.hits_outside;
        self.ways -= o.ways;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_in_the_sum() {
        let one = RefusedBeams { not_finite: 1, negative: 2, too_near: 4, too_far: 8 };
        assert_eq!((one.total(), (one + one).total()), (15, 30));
    }
}
