//! Contours: oriented 2-D segments.

use super::Polyline;
use crate::geom::vector::{distance, point_segment};

/// Segments with shared vertices; free space lies on the left of every segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contour {
    /// World positions (meters).
    pub vertices: Vec<[f64; 2]>,
    /// Pairs of vertex indices, from start to end.
    pub segments: Vec<[u32; 2]>,
}

impl Contour {
    /// Start and end of every segment.
    pub fn ends(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 2]> + '_ {
        self.segments.iter().map(|s| s.map(|i| self.vertices[i as usize]))
    }

    /// Length of all segments (meters).
    pub fn length(&self) -> f64 {
        self.ends().map(|[a, b]| distance(a, b)).sum()
    }

    /// Unsigned distance from a point to the nearest segment (meters). `None` for an empty contour.
    /// O(segments): the contour has no index; for many queries use an ESDF.
    pub fn nearest_distance(&self, p_world: impl Into<[f64; 2]>) -> Option<f64> {
        let p = p_world.into();
        let mut best = f64::INFINITY;
        for [a, b] in self.ends() {
            let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
            let length_sq = ab[0] * ab[0] + ab[1] * ab[1];
            let t = ((ap[0] * ab[0] + ap[1] * ab[1]) / length_sq.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let off = [ap[0] - t * ab[0], ap[1] - t * ab[1]];
            best = best.min(off[0] * off[0] + off[1] * off[1]);
        }
        (best < f64::INFINITY).then(|| best.sqrt())
    }

    /// Index of the nearest segment, and the distance to it (meters). O(segments).
    pub fn nearest_segment(&self, p_world: impl Into<[f64; 2]>) -> Option<(usize, f64)> {
        let p = p_world.into();
        let distances = self.ends().map(|[a, b]| point_segment(p, a, b).0).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether a point lies behind the surface, from the side that the first segment along the ray to the right faces to
    /// it. Needs no closed contour, unlike a crossing number: a building observed only from its rooms has no outer face.
    /// `None` where the ray meets no segment. Through a gap in the contour the next wall decides; unknown space is not
    /// distinguished from free space. O(segments).
    pub fn is_inside(&self, p_world: impl Into<[f64; 2]>) -> Option<bool> {
        let first = self.crossings(p_world.into()).min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Free space lies on the left of a segment: one that runs up has it toward the point.
        Some(!first.1)
    }

    /// Where the ray to the right crosses segments (x), and whether they run upward.
    fn crossings(&self, p: [f64; 2]) -> impl Iterator<Item = (f64, bool)> + '_ {
        self.ends().filter_map(move |[a, b]| {
            // Half-open in y, so that a ray through a vertex counts once.
            if (a[1] > p[1]) == (b[1] > p[1]) {
                return None;
            }
            let x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            (p[0] < x).then_some((x, b[1] > a[1]))
        })
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.vertices.capacity() * size_of::<[f64; 2]>() + self.segments.capacity() * size_of::<[u32; 2]>()
    }

    /// The segments joined end to end.
    pub fn polylines(&self) -> Vec<Polyline> {
        super::polyline::join(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Contour {
        Contour {
            vertices: vec![[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0]],
            segments: vec![[0, 1], [1, 2], [2, 3], [3, 0]],
        }
    }

    /// Odd inside a closed contour that has an outer face.
    fn crossing_number(c: &Contour, p: [f64; 2]) -> usize {
        c.crossings(p).count()
    }

    #[test]
    fn distance_and_crossing_number() {
        let c = square();
        assert_eq!(c.nearest_distance([1.0, 0.5]), Some(0.5));
        assert_eq!(c.nearest_distance([5.0, 6.0]), Some(5.0));
        assert_eq!(c.nearest_segment([1.0, 1.9]).unwrap().0, 1);
        assert_eq!((c.is_inside([1.0, 1.0]), crossing_number(&c, [1.0, 1.0])), (Some(true), 1));
        assert_eq!((c.is_inside([-1.0, 0.0]), crossing_number(&c, [-1.0, 0.0])), (Some(false), 2));
        assert_eq!((c.is_inside([3.0, 1.0]), crossing_number(&c, [3.0, 1.0])), (None, 0));
        // A room observed from inside has no outer face: the count is odd in its free space.
        let mut room = square();
        room.segments.iter_mut().for_each(|s| s.reverse());
        assert_eq!((room.is_inside([1.0, 1.0]), crossing_number(&room, [1.0, 1.0])), (Some(false), 1));
        assert_eq!(c.length(), 8.0);
        assert_eq!(Contour::default().nearest_distance([0.0, 0.0]), None);
        assert_eq!(Contour::default().is_inside([0.0, 0.0]), None);
    }
}
