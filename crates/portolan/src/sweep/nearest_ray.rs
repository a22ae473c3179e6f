//! Cell centers against the nearest beam, for scans that do not know which beams are neighbours.

use super::clip;
use super::touched::Touched;
use crate::cell::{DistanceObservation, Distances, Evidence};
use crate::geom::vector::{along, dot, sub};
use crate::geom::{Aabb, BlockKey, Lattice, RayWalk};

/// A ray in the world: a beam where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray<const D: usize> {
    pub origin: [f64; D],
    /// Unit vector.
    pub direction: [f64; D],
    /// Meters: to the surface, or up to where there is none.
    pub range: f64,
    pub hit: bool,
    pub weight: f32,
}

/// Distances, and how far aside of each cell's center the beam passed that they come from, and which it was.
#[derive(Clone, Debug)]
pub(super) struct NearestBeam {
    pub distances: Distances,
    aside_sq: Box<[f32]>,
    pub ray: Box<[u32]>,
}

/// Bytes of a touched cell: distance, weight, how far aside, and which ray.
pub(super) const CELL_BYTES: usize = 3 * size_of::<f32>() + size_of::<u32>();

impl Evidence for NearestBeam {
    type One = DistanceObservation;

    fn silent(cells: usize) -> Self {
        Self {
            distances: Distances::silent(cells),
            aside_sq: vec![0.0; cells].into(),
            ray: vec![0; cells].into(),
        }
    }

    fn clear(&mut self) {
        self.distances.clear();
    }

    fn one(&self, i: usize) -> Option<DistanceObservation> {
        self.distances.one(i)
    }

    fn observed(&self) -> usize {
        self.distances.observed()
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        self.distances.keep(inside);
    }
}

/// Walks every beam through the cells exactly; a cell listens to the beam that passes nearest to its center,
/// and gets that beam's distance at the center. Ties go to the earlier beam.
pub(super) type NearestRay<const D: usize> = Touched<NearestBeam, D>;

impl<const D: usize> NearestRay<D> {
    /// Stops where more than `most` blocks are touched, and says so with `false`.
    pub(super) fn plan(
        &mut self,
        rays: impl Iterator<Item = Ray<D>>,
        (lattice, bounds): (&Lattice<D>, &Aabb<D>),
        (tau, carve_weight): (f64, f32),
        most: usize,
    ) -> bool {
        self.clear();
        let carve = carve_weight > 0.0;
        for (number, ray) in rays.enumerate() {
            let (origin, direction, z) = (ray.origin, ray.direction, ray.range);
            if z <= 0.0 || (!ray.hit && !carve) {
                continue;
            }
            let length = if ray.hit { z + tau } else { z };
            let Some((near, far)) = clip(bounds, origin, direction, length) else { continue };
            let near = if carve { near } else { near.max(z - tau) };
            let Some(mut walk) = RayWalk::new(lattice, along(origin, direction, near), direction) else {
                continue;
            };
            loop {
                let cell = walk.cell();
                let offset = sub(lattice.center(cell), origin);
                let s = dot(offset, direction);
                let d = if ray.hit {
                    z - s
                } else if s <= z - tau {
                    tau
                } else {
                    f64::NEG_INFINITY
                };
                let free = if d > tau || !ray.hit { carve_weight } else { 1.0 };
                let w = ray.weight * free * (1.0 + d / tau).clamp(0.0, 1.0) as f32;
                if w > 0.0 && (carve || d <= tau) {
                    let aside_sq = (dot(offset, offset) - s * s) as f32;
                    let i = BlockKey::offset(cell);
                    let evidence = self.of_cell(cell);
                    if !evidence.distances.is_set(i) || aside_sq < evidence.aside_sq[i] {
                        evidence
                            .distances
                            .set(i, DistanceObservation { distance: d.min(tau) as f32, weight: w });
                        evidence.aside_sq[i] = aside_sq;
                        evidence.ray[i] = number as u32;
                    }
                    // Here, since one ray alone may be long enough.
                    if self.keys().len() > most {
                        return false;
                    }
                }
                if near + walk.exit() >= far {
                    break;
                }
                walk.advance();
            }
        }
        self.sort();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_ray_cannot_touch_more_than_it_may() {
        let ray = Ray { origin: [0.05; 3], direction: [1.0, 0.0, 0.0], range: 1e4, hit: true, weight: 1.0 };
        let (lattice, all) = (Lattice::new([0.0; 3], 0.1), Aabb::new([-1e9; 3], [1e9; 3]));
        let mut rays = NearestRay::<3>::new();
        assert!(!rays.plan([ray].into_iter(), (&lattice, &all), (0.3, 1.0), 10));
        assert_eq!(rays.keys().len(), 11);
        let short = Ray { range: 7.0, ..ray };
        assert!(rays.plan([short].into_iter(), (&lattice, &all), (0.3, 1.0), 10));
        assert_eq!(rays.keys().len(), 10);
    }
}
