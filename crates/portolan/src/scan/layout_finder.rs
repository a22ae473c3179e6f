//! Rows and columns found once and kept while they explain what the sensor delivers.

use super::{RangeImage, SphericalLayout};

/// Searches are at most this many scans apart.
const LONGEST_REST: u32 = 64;

/// Gives scans of points their rows and columns: searches for a layout in the first scan and keeps it while nine tenths
/// of a scan's points lie in its rows.
///
/// A search costs many times what it costs to use its layout. Where it fails, or finds nothing better than what
/// is there, the next one has to wait for one scan, then two, four and so on: a log of clouds without rows is not searched scan by scan.
#[derive(Clone, Debug, Default)]
pub struct LayoutFinder {
    layout: Option<SphericalLayout>,
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

    /// The range image of points about `origin`, both in the sensor's frame. `None` where the points have no rows and columns:
    /// none were found, or most points do not fit those that were. O(n); O(n log n) where it searches.
    pub fn image(&mut self, points: &[[f32; 3]], origin: [f64; 3]) -> Option<RangeImage> {
        let known = self.layout.as_ref().map(|layout| layout.image_and_placed(points, origin));
        let placed = known.as_ref().map_or(0, |k| k.1);
        if known.is_some() && 10 * placed >= 9 * points.len() {
            return useful(known, points.len());
        }
        if self.rest > 0 {
            self.rest -= 1;
            return useful(known, points.len());
        }
        let found = SphericalLayout::of(points, origin);
        let better = found.map(|layout| (layout.image_and_placed(points, origin), layout));
        match better.filter(|((_, now), _)| *now > placed) {
            Some((image, layout)) => {
                *self = Self::of(layout);
                useful(Some(image), points.len())
            }
            None => {
                self.rest = (1 << self.failed.min(31)).min(LONGEST_REST);
                self.failed += 1;
                useful(known, points.len())
            }
        }
    }
}

/// An image that holds at least half of its points: another sensor's layout does not.
fn useful(image: Option<(RangeImage, usize)>, points: usize) -> Option<RangeImage> {
    image.map(|(image, _)| image).filter(|image| 2 * image.hits() >= points)
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
        assert_eq!(finder.image(&narrow, [0.0; 3]).unwrap().hits(), narrow.len());
        let first = finder.layout().cloned();
        assert!(finder.image(&narrow[..4000], [0.0; 3]).is_some());
        assert_eq!(finder.layout().cloned(), first, "part of a scan");
        let wide = scan(32, 0.6);
        assert_eq!(finder.image(&wide, [0.0; 3]).unwrap().hits(), wide.len());
        assert_eq!(finder.layout().unwrap().spherical().elevations.len(), 32);
    }

    #[test]
    fn what_was_not_found_is_not_searched_for_again_at_once() {
        let mut finder = LayoutFinder::default();
        // Two shells, one behind the other.
        let mut cloud = scan(32, 0.6);
        cloud.extend(cloud.clone().iter().map(|p| p.map(|v| 2.0 * v)));
        let rests: Vec<u32> = (0..8)
            .map(|_| {
                assert!(finder.image(&cloud, [0.0; 3]).is_none());
                finder.rest
            })
            .collect();
        assert_eq!(rests, [1, 0, 2, 1, 0, 4, 3, 2]);
        assert!(finder.layout().is_none());
    }
}
