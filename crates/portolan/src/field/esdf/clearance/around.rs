//! What a field knows around a point.

use super::interval::Interval;
use crate::answer::Answer;
use crate::field::Esdf;
use crate::field::esdf::bricks::EsdfBrick;
use crate::field::esdf::surface::{cells_around, simplex_distance_sq};
use crate::field::esdf::transform::Feature;
use crate::geom::BlockKey;

/// A point between `2^D` nodes (the centers of cells).
pub(super) struct QueryPoint<const D: usize> {
    /// The lowest of the nodes.
    pub(super) base: [i32; D],
    /// Place between the nodes, 0 to 1 along each axis.
    t: [f64; D],
    /// The cell that holds the point.
    pub(super) holder: [i32; D],
    /// What rounding may have done to a distance, in cells.
    pub(super) margin: f64,
}

impl<const D: usize> QueryPoint<D> {
    /// `None` where no index holds the point.
    pub(super) fn of(field: &Esdf<D>, p_world: [f64; D]) -> Option<Self> {
        let lattice = &field.lattice;
        let holder = lattice.cell_of(p_world)?;
        let cells = lattice.to_cells(p_world);
        let base = cells.map(|c| (c - 0.5).floor() as i32);
        let t = std::array::from_fn(|k| (cells[k] - 0.5 - f64::from(base[k])).clamp(0.0, 1.0));
        // Coordinates of the point and of the surface's vertices, of the lattice's origin, and their differences.
        let size: f64 = (0..D).map(|k| 2.0 * p_world[k].abs() + 2.0 * lattice.origin[k].abs()).sum();
        let world = 4.0 * f64::EPSILON * size / lattice.resolution;
        Some(Self { base, t, holder, margin: world + field.surface.vertex_margin() })
    }

    fn node(&self, i: usize) -> [i32; D] {
        std::array::from_fn(|k| self.base[k] + (i >> k & 1) as i32)
    }

    /// Distance from node `i`, in cells.
    pub(super) fn to_node(&self, i: usize) -> f64 {
        let off = |k: usize| self.t[k] - (i >> k & 1) as f64;
        (0..D).map(|k| off(k) * off(k)).sum::<f64>().sqrt()
    }

    fn weight(&self, i: usize) -> f64 {
        (0..D).map(|k| if i >> k & 1 == 1 { self.t[k] } else { 1.0 - self.t[k] }).product()
    }

    /// A lower bound of the distance to any closed set, from lower bounds of the squared distances of the nodes (those
    /// that have one); `None` if none has.
    pub(super) fn lower_bound(&self, at_node: impl Fn(usize) -> Option<f64>) -> Option<f64> {
        let (mut sum, mut all, mut steep) = (0.0, true, None);
        for i in 0..1 << D {
            let Some(sq) = at_node(i) else {
                all = false;
                continue;
            };
            sum += self.weight(i) * sq;
            let reached = sq.sqrt() - self.to_node(i);
            steep = Some(steep.map_or(reached, |s: f64| s.max(reached)));
        }
        let bend: f64 = self.t.iter().map(|t| t * (1.0 - t)).sum();
        let concave = if all { (sum - bend).max(0.0).sqrt() } else { 0.0 };
        // Sums of squares of up to a few hundred cells in f64.
        steep.map(|s| (s.max(concave) - 1e-9).max(0.0))
    }

    /// The last node along an axis that is not beyond `off` cells from the point.
    pub(super) fn floor(&self, k: usize, off: f64) -> i32 {
        self.base[k] + (self.t[k] + off).floor() as i32
    }

    /// Whether bounds (cells) say on which side of `enough` a distance is: what rounding may have done is taken off afterwards.
    pub(super) fn decides(&self, interval: Interval, enough: f64) -> bool {
        interval.lower - self.margin >= enough || interval.upper + self.margin < enough
    }

    /// The point in cells from a cell's center.
    pub(super) fn relative(&self, cell: [i32; D]) -> [f64; D] {
        std::array::from_fn(|k| self.t[k] + f64::from(self.base[k] - cell[k]))
    }
}

/// The bricks of the nodes around a point.
pub(super) struct NodesAround<'f, const D: usize> {
    bricks: [Option<&'f EsdfBrick>; 8],
    distances: [&'f [f32]; 8],
    places: [usize; 8],
}

impl<'f, const D: usize> NodesAround<'f, D> {
    pub(super) fn of(field: &'f Esdf<D>, point: &QueryPoint<D>) -> Self {
        let mut nodes = Self { bricks: [None; 8], distances: [&[]; 8], places: [0; 8] };
        let mut last = None;
        for i in 0..1 << D {
            let (node, key) = (point.node(i), BlockKey::of_cell(point.node(i)));
            nodes.places[i] = BlockKey::offset(node);
            let (brick, distances) = match last {
                Some((of, found)) if of == key => found,
                _ => (field.slot(key).map(|slot| &field.bricks[slot]), field.brick(key).unwrap_or(&[])),
            };
            (nodes.bricks[i], nodes.distances[i]) = (brick, distances);
            last = Some((key, (brick, distances)));
        }
        nodes
    }

    /// A lower bound of node `i`'s squared distance to the surface, in squared cells.
    pub(super) fn surface_sq(&self, field: &Esdf<D>, i: usize) -> Option<f64> {
        let (brick, at) = (self.bricks[i]?, self.places[i]);
        let reach = field.reach_cells();
        let quarter = 0.25 * D as f64;
        let power = f64::from(brick.nearest.as_ref()?.power[at]).min(reach * reach + quarter);
        // Sums of squares in f32, and their heights.
        let certified = power * (1.0 - 1e-6) - quarter - 4e-6;
        // Up to one cell, a node's own distance is exact; in f32.
        let found = f64::from(self.distances[i][at].abs()) / field.lattice.resolution;
        let exact = if found.is_nan() { 0.0 } else { (found.min(1.0).min(reach) - 1e-5).max(0.0) };
        Some(certified.max(exact * exact))
    }

    /// The squared distance (cells) of node `i` to the nearest unknown cell; `None`: not kept. Where there is no brick,
    /// all is unknown.
    pub(super) fn unknown_at(&self, i: usize) -> Option<f32> {
        match self.bricks[i] {
            Some(brick) => Some(brick.unknown.as_ref()?[self.places[i]]),
            None => Some(0.0),
        }
    }

    /// The squared distance (cells) of node `i` to the nearest point obstacle, infinite beyond the largest distance; `None`:
    /// there is no brick.
    pub(super) fn points_at(&self, i: usize) -> Option<f32> {
        let points = &self.bricks[i]?.points;
        Some(points.as_ref().map_or(f32::INFINITY, |plane| plane[self.places[i]]))
    }

    /// A lower bound of it.
    pub(super) fn points_sq(&self, field: &Esdf<D>, i: usize) -> Option<f64> {
        Some(certified_sq(field, self.points_at(i)?))
    }

    /// A lower bound of [`NodesAround::unknown_at`].
    pub(super) fn unknown_sq(&self, field: &Esdf<D>, i: usize) -> Option<f64> {
        Some(certified_sq(field, self.unknown_at(i)?))
    }

    /// Signed distance (meters) between the nodes that know one: of the side where the point lies.
    pub(super) fn signed(&self, point: &QueryPoint<D>, max_distance: f64) -> f64 {
        let known = (0..1 << D).filter_map(|i| {
            let value = f64::from(*self.distances[i].get(self.places[i])?);
            (!value.is_nan()).then(|| point.weight(i) * value.clamp(-max_distance, max_distance))
        });
        known.sum()
    }
}

/// What a squared distance (cells) to cells is at least: sums in f32, and nothing is known beyond the largest distance.
fn certified_sq<const D: usize>(field: &Esdf<D>, sq: f32) -> f64 {
    let reach = field.reach_cells();
    (f64::from(sq).min(reach * reach) * (1.0 - 1e-6) - 1e-6).max(0.0)
}

impl<const D: usize> Esdf<D> {
    /// Whether something is known of a cell: it was observed, or is an obstacle.
    pub(super) fn observes(&self, cell: [i32; D]) -> bool {
        let brick = self.slot(BlockKey::of_cell(cell)).map(|slot| &self.bricks[slot]);
        brick.is_some_and(|brick| brick.sides.known(BlockKey::offset(cell)))
    }

    /// The answer about a cell that was not observed.
    pub(super) fn unobserved_at<T>(&self, cell: [i32; D]) -> Answer<T> {
        if self.slot(BlockKey::of_cell(cell)).is_some() { Answer::Unknown } else { self.nothing_at(cell) }
    }

    /// Distance (cells) to the nearest element of the `3^D` cells between nodes around the point: of all that are not
    /// further than a cell, and of some that are.
    pub(super) fn to_elements_around(&self, point: &QueryPoint<D>) -> f64 {
        let mut best = f64::INFINITY;
        let mut last = None;
        for n in 0..3usize.pow(D as u32) {
            let cell: [i32; D] =
                std::array::from_fn(|k| point.base[k] + (n / 3usize.pow(k as u32) % 3) as i32 - 1);
            let key = BlockKey::of_cell(cell);
            let brick = match last {
                Some((of, brick)) if of == key => brick,
                _ => self.surface.brick_elements(key),
            };
            last = Some((key, brick));
            let Some(brick) = brick else { continue };
            for simplex in brick.cell(BlockKey::offset(cell)) {
                best = best.min(simplex_distance_sq(point.relative(cell), simplex));
            }
        }
        best.sqrt()
    }

    /// Distance (cells) to the nearest element around the crossings that the nodes found: an upper bound.
    pub(super) fn to_elements_found(&self, point: &QueryPoint<D>, nodes: &NodesAround<'_, D>) -> f64 {
        let mut best = f64::INFINITY;
        let mut seen = [(usize::MAX, [0; D]); 8];
        for i in 0..1 << D {
            let Some(nearest) = nodes.bricks[i].and_then(|b| b.nearest.as_ref()) else { continue };
            let Some(feature) = Feature(nearest.feature[nodes.places[i]]).known() else { continue };
            let (node, offset) = (point.node(i), feature.offset::<D>());
            let edge = (feature.axis(), std::array::from_fn(|k| node[k] + offset[k]));
            if seen.contains(&edge) {
                continue;
            }
            seen[i] = edge;
            let (axis, start) = edge;
            let place = self.surface.brick(BlockKey::of_cell(start));
            let Some(place) = place.map(|b| b.place[axis][BlockKey::offset(start)]) else { continue };
            cells_around(start, axis, place, |cell| {
                for simplex in self.surface.cell(cell) {
                    best = best.min(simplex_distance_sq(point.relative(cell), simplex));
                }
            });
        }
        best.sqrt()
    }

    /// Distance (cells) to the nearest one, as a box, that `is` accepts of the `3^D` cells around that of the point.
    pub(super) fn to_cells_around(&self, point: &QueryPoint<D>, is: impl Fn([i32; D]) -> bool) -> f64 {
        let mut best = f64::INFINITY;
        for n in 0..3usize.pow(D as u32) {
            let cell: [i32; D] =
                std::array::from_fn(|k| point.holder[k] + (n / 3usize.pow(k as u32) % 3) as i32 - 1);
            let off = point.relative(cell).map(|v| (v.abs() - 0.5).max(0.0));
            let sq = off.iter().map(|v| v * v).sum();
            if sq < best && is(cell) {
                best = sq;
            }
        }
        best.sqrt()
    }
}
