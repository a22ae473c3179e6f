//! How 3-D scans became evidence, and why.

/// How a 3-D scan became evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Through the rows and columns that it came with.
    Stated,
    /// Through rows and columns that were found in its points.
    Found,
    /// Ray by ray.
    Rays(WhyRays),
    /// As points without rays, which free nothing.
    Points,
}

/// Why a 3-D scan was followed ray by ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhyRays {
    /// That was asked for.
    Asked,
    /// Each point has an origin of its own.
    OwnOrigins,
    /// Points have colors to be fused, which are lost where points become pixels.
    Colors,
    /// Rows and columns were not found: no lidar's rings, or too few points.
    NoRows,
    /// Rows and columns would lose points: too many share a pixel with a nearer one, or have none.
    SharedPixels,
    /// Rows and columns would leave too many pixels without a reading between those with one.
    Gaps,
}

impl Way {
    /// All there are.
    pub const ALL: [Self; 9] = [
        Self::Stated,
        Self::Found,
        Self::Rays(WhyRays::Asked),
        Self::Rays(WhyRays::OwnOrigins),
        Self::Rays(WhyRays::Colors),
        Self::Rays(WhyRays::NoRows),
        Self::Rays(WhyRays::SharedPixels),
        Self::Rays(WhyRays::Gaps),
        Self::Points,
    ];
}

/// 3-D scans by the way in which they became evidence; scans of beams in 2-D are not counted here.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanWays([u64; Way::ALL.len()]);

impl ScanWays {
    /// One scan.
    pub fn one(way: Way) -> Self {
        Self(Way::ALL.map(|w| u64::from(w == way)))
    }

    /// How many scans went a way.
    pub fn count(&self, way: Way) -> u64 {
        Way::ALL.into_iter().zip(self.0).filter(|(w, _)| *w == way).map(|(_, n)| n).sum()
    }
}

impl std::ops::AddAssign for ScanWays {
    fn add_assign(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a += b);
    }
}

impl std::ops::SubAssign for ScanWays {
    fn sub_assign(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a -= b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_is_counted_by_itself() {
        let mut all = ScanWays::default();
        for (n, way) in Way::ALL.into_iter().enumerate() {
            (0..=n).for_each(|_| all += ScanWays::one(way));
        }
        assert_eq!(Way::ALL.map(|way| all.count(way)), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
    }
}
