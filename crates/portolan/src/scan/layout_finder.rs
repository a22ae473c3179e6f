//! Rows and columns found once and kept while they explain what the sensor delivers.

use super::{RangeImage, SphericalLayout, WhyRays};

/// Searches are at most this many scans apart.
const LONGEST_REST: u32 = 64;

/// Gives scans of points their rows and columns: searches for a layout in the first scan and keeps it while it is good
/// for what comes ([`SphericalLayout`] says when).
///
/// A search costs many times what it costs to use its layout. Where it fails, the next one has to wait for one scan, then two, four and so on: a log of clouds without rows is not searched scan by scan.
#[derive(Clone, Debug, Default)]
pub struct LayoutFinder {
    layout: Option<SphericalLayout>,
    /// Why the last search failed.
    why: Option<WhyRays>,
    failed: u32,
    rest: u32,
}

impl LayoutFinder {
    /// Starts with a known layout.
    pub fn of(layout: SphericalLayout) -> Self {
        Self { layout: Some(layout), ..Self::default() }
    }

    /// The layout that is in use.
    pub fn layout(&self) -> Option<&SphericalLayout> {
        self.layout.as_ref()
    }

    /// The range image of points about `origin`, both in the sensor's frame, for a map with cells of this edge (meters): the
    /// coarser they are, the better rays alone show a surface, and the fewer pixels may be missing. O(n); O(n log n) where it searches.
    ///
    /// # Errors
    /// Why points have to be followed ray by ray: they have no rows and columns, or those would lose what the points show.
    /// Of scans that are not searched, why the last one that was had none.
    pub fn image(&mut self, points: &[[f32; 3]], origin: [f64; 3], cell: f64) -> Result<RangeImage, WhyRays> {
        let known = self.layout.as_ref().map(|layout| layout.good_image(points, origin, cell));
        if let Some(Ok(image)) = known {
            return Ok(image);
        }
        if self.rest > 0 {
            self.rest -= 1;
            return known.unwrap_or(Err(self.why.unwrap_or(WhyRays::NoRows)));
        }
        match SphericalLayout::found(points, origin) {
            Ok(layout) => {
                let image = layout.good_image(points, origin, cell);
                *self = Self::of(layout);
                image
            }
            Err(why) => {
                self.rest = (1 << self.failed.min(31)).min(LONGEST_REST);
                self.failed += 1;
                self.why = Some(why);
                Err(why)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn scan(rings: usize, half: f64) -> Vec<[f32; 3]> {
        let beam = |i: usize| {
            let e = half - 2.0 * half * (i / 512) as f64 / (rings - 1) as f64;
            let a = TAU * (i % 512) as f64 / 512.0;
            [e.cos() * a.cos(), e.cos() * a.sin(), e.sin()].map(|v| (4.0 * v) as f32)
        };
        (0..512 * rings).map(beam).collect()
    }

    #[test]
    fn a_layout_is_kept_while_it_explains_points_and_replaced_when_not() {
        let mut finder = LayoutFinder::default();
        let narrow = scan(16, 0.2);
        assert_eq!(finder.image(&narrow, [0.0; 3], 0.1).unwrap().hits(), narrow.len());
        let first = finder.layout().cloned();
        // In cells that are small beside the distance between points rays alone would show nothing.
        assert!(finder.image(&narrow[..4000], [0.0; 3], 0.05).is_ok());
        assert_eq!(finder.layout().cloned(), first, "part of a scan");
        let wide = scan(32, 0.6);
        assert_eq!(finder.image(&wide, [0.0; 3], 0.1).unwrap().hits(), wide.len());
        assert_eq!(finder.layout().unwrap().spherical().elevations.len(), 32);
    }

    #[test]
    fn a_scan_that_the_layout_would_lose_is_followed_ray_by_ray() {
        let mut finder = LayoutFinder::default();
        let whole = scan(32, 0.6);
        assert!(finder.image(&whole, [0.0; 3], 0.1).is_ok());
        // One point in forty, on all rings: holes everywhere.
        let thin: Vec<_> = whole.iter().copied().step_by(41).collect();
        assert!(finder.image(&thin, [0.0; 3], 0.1).is_err());
        assert!(finder.image(&whole, [0.0; 3], 0.1).is_ok(), "the layout is kept");
    }

    #[test]
    fn what_was_not_found_is_not_searched_for_again_at_once() {
        let mut finder = LayoutFinder::default();
        // Two shells, one behind the other.
        let mut cloud = scan(32, 0.6);
        cloud.extend(cloud.clone().iter().map(|p| p.map(|v| 2.0 * v)));
        let rests: Vec<u32> = (0..8)
            .map(|_| {
                assert_eq!(finder.image(&cloud, [0.0; 3], 0.1), Err(WhyRays::SharedPixels));
                finder.rest
            })
            .collect();
        assert_eq!(rests, [1, 0, 2, 1, 0, 4, 3, 2]);
        assert!(finder.layout().is_none());
    }
}
