//! Certified clearance: an interval that holds the distance to the extracted surface, at any point.

use super::around::{NodesAround, QueryPoint};
use super::search::FURTHEST;
use crate::answer::Answer;
use crate::field::{Clearance, ClearanceField, Esdf, UnknownSpace};

/// Bounds that are further apart (cells) are tightened by looking at what lies between them.
pub(super) const APART: f64 = 1.0 / 32.0;

/// An interval in cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) lower: f64,
    pub(super) upper: f64,
}

impl Interval {
    fn nearer(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.min(other.upper) }
    }
}

/// Of fields made by [`EsdfMethod::Accurate`](crate::field::EsdfMethod::Accurate); others certify nothing and answer that they do not know.
///
/// The distance meant is that to the nearest obstacle: to the segments or triangles that
/// [`crate::surface::marching_squares`] and [`crate::surface::marching_cubes`] extract with the same `min_weight`, as they
/// are, and to [`Esdf::point_obstacles`]. Not to the true surface, from which
/// noise, truncation and the lattice keep them away. Rounding is paid for: that of the field, of world coordinates, and of
/// the vertices of a [`crate::surface::Mesh`].
///
/// Lower bounds come from the transform: a node's least `|q - w|^2 + h_w` over all crossings is at most its squared
/// distance plus `D / 4`, whatever the surface does between crossings. Between nodes squared distance less `|x|^2` is
/// concave for any closed set, so that multilinear interpolation of lower bounds less `sum t (1 - t)` is one; and no
/// distance changes faster than the point moves. Upper bounds are distances to elements around what the nodes found.
/// Where the lower bound is less than a cell, the elements around the point are looked at: both bounds are then exact up
/// to a distance of one cell. Further away, up to 24 cells, bounds that are more than 1/32 of a cell apart make it look at
/// all elements that lie between them: O(bricks within the distance); O(1) otherwise.
///
/// Pessimistic answers need the distances to unknown cells ([`EsdfSettings::unknown`](crate::field::EsdfSettings::unknown)); without them
/// unknown cells are looked for around the point only, and `lower` is never more than a cell.
impl<const D: usize> ClearanceField<D> for Esdf<D> {
    fn clearance(&self, p_world: [f64; D], unknown: UnknownSpace) -> Answer<Clearance> {
        self.interval(p_world, unknown, None)
    }

    fn clearance_against(&self, p_world: [f64; D], unknown: UnknownSpace, enough: f64) -> Answer<Clearance> {
        self.interval(p_world, unknown, Some(enough / self.lattice.resolution))
    }

    fn distance_and_gradient(&self, p_world: [f64; D]) -> Answer<(f64, [f64; D])> {
        Esdf::distance_and_gradient(self, p_world)
    }

    fn resolution(&self) -> f64 {
        self.lattice.resolution
    }
}

impl<const D: usize> Esdf<D> {
    /// `enough` (cells): bounds need not be tightened that say on which side of it the clearance is.
    fn interval(&self, p_world: [f64; D], unknown: UnknownSpace, enough: Option<f64>) -> Answer<Clearance> {
        let Some(point) = QueryPoint::of(self, p_world) else { return Answer::Outside };
        if unknown == UnknownSpace::Pessimistic && !self.observes(point.holder) {
            return self.unobserved_at(point.holder);
        }
        let mut nodes = NodesAround::of(self, &point);
        let Some((mut interval, signed)) = self.to_surface(&point, &mut nodes, enough) else {
            return self.unobserved_at(point.holder);
        };
        interval = interval.nearer(self.to_points(&point, &nodes, interval.upper, enough));
        let in_loose =
            self.sides_at(point.holder).is_some_and(|(sides, i)| sides.points.has(i) && sides.inside(i));
        if unknown == UnknownSpace::Pessimistic {
            interval = interval.nearer(self.to_unknown(&point, &nodes));
        }
        self.answer(&point, interval, in_loose || signed < 0.0)
    }

    /// How far the nearest cell is that was not observed, at least and at most (meters); cells of bricks that were never
    /// made are among them. 0 in such a cell; saturated beyond the largest distance, and beyond a cell where
    /// [`EsdfSettings::unknown`](crate::field::EsdfSettings::unknown) did not ask for these distances. `inside` is false. O(1).
    pub fn unknown_distance(&self, p_world: impl Into<[f64; D]>) -> Answer<Clearance> {
        let Some(point) = QueryPoint::of(self, p_world.into()) else { return Answer::Outside };
        if !self.observes(point.holder) {
            return match self.unobserved_at::<Clearance>(point.holder) {
                Answer::Outside => Answer::Outside,
                _ => Answer::Known(Clearance { lower: 0.0, upper: 0.0, inside: false }),
            };
        }
        let nodes = NodesAround::of(self, &point);
        self.answer(&point, self.to_unknown(&point, &nodes), false)
    }

    /// In meters, and less and more by what rounding may have done.
    fn answer(&self, point: &QueryPoint<D>, interval: Interval, inside: bool) -> Answer<Clearance> {
        let resolution = self.lattice.resolution;
        let lower = (interval.lower - point.margin).max(0.0) * resolution;
        let upper = (interval.upper + point.margin) * resolution;
        let clearance = Clearance { lower, upper, inside };
        if upper < f64::INFINITY { Answer::Known(clearance) } else { Answer::Saturated(clearance) }
    }

    /// Distance to the extracted surface in cells, and a value whose sign is that of the side; `None` where nothing is
    /// maintained.
    fn to_surface(
        &self,
        point: &QueryPoint<D>,
        nodes: &mut NodesAround<'_, D>,
        enough: Option<f64>,
    ) -> Option<(Interval, f64)> {
        let lower_sq = |i: usize| nodes.surface_sq(self, i);
        let mut interval = Interval { lower: point.lower_bound(lower_sq)?, upper: f64::INFINITY };
        if interval.lower < 1.0 {
            let found = self.to_elements_around(point);
            if found <= 1.0 {
                interval = Interval { lower: found, upper: found };
            } else {
                interval = Interval { lower: 1.0, upper: found };
            }
        }
        if interval.upper > interval.lower {
            interval.upper = interval.upper.min(self.to_elements_found(point, nodes));
            let apart = interval.upper - interval.lower;
            let decided = enough.is_some_and(|e| point.decides(interval, e));
            if apart > APART && interval.upper <= FURTHEST && !decided {
                interval.upper = self.search_elements(point, interval.upper);
                interval.lower = interval.upper;
            }
            // Both are true of one distance, but for rounding.
            interval.upper = interval.upper.max(interval.lower);
        }
        Some((interval, nodes.signed(point, f64::from(self.max_distance))))
    }

    /// Distance to the unknown in cells.
    fn to_unknown(&self, point: &QueryPoint<D>, nodes: &NodesAround<'_, D>) -> Interval {
        let mut interval = Interval { lower: 0.0, upper: f64::INFINITY };
        if let Some(lower) = point.lower_bound(|i| nodes.unknown_sq(self, i)) {
            interval.lower = lower;
            for i in 0..1 << D {
                let at_node = nodes.unknown_at(i).map_or(f64::INFINITY, |sq| f64::from(sq).sqrt());
                interval.upper = interval.upper.min(at_node * (1.0 + 1e-6) + point.to_node(i));
            }
        }
        if interval.lower < 1.0 {
            // Where something stops beams that was never observed, space is unknown all the same.
            let unknown = |cell| self.sides_at(cell).is_none_or(|(sides, i)| !sides.observed(i));
            let found = self.to_cells_around(point, unknown);
            if found <= 1.0 {
                return Interval { lower: found, upper: found };
            }
            interval = Interval { lower: 1.0, upper: interval.upper.min(found) };
        }
        interval
    }
}
