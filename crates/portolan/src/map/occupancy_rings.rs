//! The nearest occupied cell of a dense map, by search.

use super::Occupancy;
use crate::cell::LogOddsValue;
use crate::geom::vector::distance;
use crate::store::Dense;

impl<const D: usize, V: LogOddsValue> Occupancy<D, V, Dense<V, D>> {
    /// Distance from a point to the center of the nearest occupied cell (meters), found by **searching** ring
    /// by ring up to `limit` meters: the cost grows with the square (in 3-D the cube) of the distance, which
    /// is why this is not called `distance`. `None` where no occupied cell is within the limit, and outside of the grid.
    pub fn search_distance_by_rings(&self, p_world: impl Into<[f64; D]>, limit: f64) -> Option<f64> {
        let p = p_world.into();
        let lattice = &self.store.grid().lattice;
        let centre = lattice.cell_of(p)?;
        self.store.grid().index(centre)?;
        // Beyond the farthest cell of the grid there is nothing to find.
        let farthest =
            (0..D).map(|k| centre[k].abs().max((self.store.grid().shape[k] as i32 - centre[k]).abs()));
        let rings = ((limit / lattice.resolution).ceil().min(1e9) as i32).min(farthest.max().unwrap_or(0));
        let mut best = f64::INFINITY;
        for ring in 0..=rings {
            // Centers on this ring are at least so far away; nothing nearer can follow.
            if (f64::from(ring) - 0.5) * lattice.resolution > best.min(limit) {
                break;
            }
            for_each_on_ring(centre, ring, |cell| {
                if self.is_occupied(cell) == Some(true) {
                    best = best.min(distance(lattice.center(cell), p));
                }
            });
        }
        (best <= limit).then_some(best)
    }
}

/// Calls `visit` with every cell whose largest coordinate distance to `centre` is `ring`.
fn for_each_on_ring<const D: usize>(centre: [i32; D], ring: i32, mut visit: impl FnMut([i32; D])) {
    // Each face of the cube once: along axis k the two faces, where the axes before k stay inside.
    for k in 0..D {
        for side in [-ring, ring] {
            let mut offset = [0i32; D];
            for (j, o) in offset.iter_mut().enumerate() {
                *o = if j < k { -ring + 1 } else { -ring };
            }
            offset[k] = side;
            loop {
                visit(std::array::from_fn(|j| centre[j] + offset[j]));
                let mut j = 0;
                while j < D {
                    if j != k {
                        let (low, high) = if j < k { (-ring + 1, ring - 1) } else { (-ring, ring) };
                        if offset[j] < high {
                            offset[j] += 1;
                            break;
                        }
                        offset[j] = low;
                    }
                    j += 1;
                }
                if j == D {
                    break;
                }
            }
            if ring == 0 {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Answer;
    use crate::cell::OccupancyModel;
    use crate::geom::{Grid, Pose};
    use crate::map::{MapError, OccupancyGrid};
    use crate::scan::{Beam, BeamKind, Scan};

    fn rings_visit_every_cell_once<const D: usize>() {
        let mut seen = std::collections::HashSet::new();
        for ring in 0..4 {
            for_each_on_ring([5; D], ring, |c| {
                assert_eq!(c.iter().map(|v| (v - 5).abs()).max(), Some(ring));
                assert!(seen.insert(c), "{c:?} twice");
            });
        }
        assert_eq!(seen.len(), 7usize.pow(D as u32));
    }

    #[test]
    fn rings_visit_every_cell_once_2d_and_3d() {
        rings_visit_every_cell_once::<2>();
        rings_visit_every_cell_once::<3>();
    }

    fn one_beam<const D: usize>() {
        let mut map =
            OccupancyGrid::<D>::covering(&Grid::new([0.0; D], 0.1, [40; D]), OccupancyModel::default())
                .unwrap();
        let mut direction = [0.0; D];
        direction[0] = 1.0;
        let scan = Scan::from_beams([Beam { direction, range: 2.0, kind: BeamKind::Hit }]);
        let pose = Pose { translation: [1.05; D], ..Pose::IDENTITY };
        let stats = map.integrate(&pose, &scan).unwrap();
        assert_eq!((stats.scans, stats.cells, stats.beams.hit), (1, 21, 1));
        let at = |x: f64| {
            let mut p = [1.05; D];
            p[0] = x;
            p
        };
        assert!((map.probability(at(3.05)).known().unwrap() - 0.7).abs() < 1e-3);
        assert!((map.probability(at(2.0)).known().unwrap() - 0.4).abs() < 1e-2);
        assert_eq!(map.probability(at(3.5)), Answer::Unknown);
        assert_eq!(map.probability(at(5.0)), Answer::Outside);
        let d = map.search_distance_by_rings(at(2.05), 5.0).unwrap();
        assert!((d - 1.0).abs() < 1e-9);
        assert_eq!(map.search_distance_by_rings(at(2.05), 0.9), None);
        assert_eq!(map.search_distance_by_rings(at(1e6), f64::INFINITY), None);

        let tilted = Pose { rotation: [[0.5; D]; D], translation: [1.0; D] };
        assert_eq!(map.integrate(&tilted, &scan).unwrap().refused_poses, 1);
        let lost = Pose { translation: [f64::NAN; D], ..Pose::IDENTITY };
        assert_eq!(map.integrate(&lost, &scan).unwrap().refused_poses, 1);
        let far = Pose { translation: [1e12; D], ..Pose::IDENTITY };
        assert_eq!(map.integrate(&far, &scan).unwrap().refused_poses, 1);
    }

    #[test]
    fn one_beam_2d_and_3d() {
        one_beam::<2>();
        one_beam::<3>();
    }

    #[test]
    fn impossible_maps_are_refused() {
        let new = |r: f64, n: usize| {
            OccupancyGrid::<2>::covering(&Grid::new([0.0; 2], r, [n; 2]), OccupancyModel::default())
        };
        assert!(matches!(new(-0.1, 10), Err(MapError::Resolution(_))));
        assert!(matches!(new(f64::NAN, 10), Err(MapError::Resolution(_))));
        assert!(matches!(new(0.1, 0), Err(MapError::Cells { .. })));
        assert!(matches!(new(0.1, 1 << 30), Err(MapError::Cells { .. })));
        assert!(matches!(new(0.1, usize::MAX), Err(MapError::Cells { .. })));
    }
}
