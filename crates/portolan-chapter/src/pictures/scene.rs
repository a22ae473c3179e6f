//! What a picture is made of: the log, the maps made of it and, where it is known, the truth.

use portolan::geom::vector::distance;
use portolan::geom::{Aabb, Pose};
use portolan::scan::Scan;
use portolan_sim::World;

use crate::gallery::{Gallery, Row};

/// One log and everything that was built from it.
pub struct Scene<'a> {
    /// The maps, and what was measured of them.
    pub gallery: &'a Gallery,
    /// Scans and their poses.
    pub log: &'a [(Pose<2>, Scan<2>)],
    /// Where its poses come from: "true poses".
    pub poses: &'static str,
    /// The true world; only the simulator has one.
    pub world: Option<&'a World>,
}

/// Cells shown around everything.
const MARGIN_CELLS: f64 = 4.0;
/// The close-up shows this many cells across.
const CLOSE_UP_CELLS: f64 = 31.0;
/// One in so many end points may be a stray, to each side.
const STRAY: usize = 1000;

impl Scene<'_> {
    /// The box of the pictures: the world, or where nearly all that was measured lies, and a margin. On the lattice of
    /// the maps, so that cells are drawn in whole pixels.
    pub fn shown(&self) -> Aabb<2> {
        let grid = self.gallery.tsdf.grid();
        let (r, origin) = (grid.lattice.resolution, grid.lattice.origin);
        let seen = match self.world {
            Some(world) => world.aabb(),
            None => self.measured().unwrap_or_else(|| grid.aabb()),
        };
        let cell = |p: f64, k: usize| (p - origin[k]) / r;
        let low = [0, 1].map(|k| ((cell(seen.min[k], k) + 1e-6).floor() - MARGIN_CELLS) * r + origin[k]);
        let high = [0, 1].map(|k| ((cell(seen.max[k], k) - 1e-6).ceil() + MARGIN_CELLS) * r + origin[k]);
        Aabb::new(low, high)
    }

    /// The box of the end points and the way, without the few ends that lie far off all others.
    fn measured(&self) -> Option<Aabb<2>> {
        let mut points = self.gallery.cloud.points().to_vec();
        let mut seen = Aabb::EMPTY;
        self.log.iter().for_each(|(pose, _)| seen.include(pose.translation));
        let far = points.len() / STRAY;
        if let Some(last) = points.len().checked_sub(1) {
            let mut ends = [[0.0; 2]; 2];
            for k in 0..2 {
                points.sort_unstable_by(|a, b| a[k].total_cmp(&b[k]));
                (ends[0][k], ends[1][k]) = (points[far][k], points[last - far][k]);
            }
            seen = seen.union(Aabb::new(ends[0], ends[1]));
        }
        (!seen.is_empty()).then_some(seen)
    }

    /// A small box with something in it: the chair, or the surface nearest to the sensor in the middle of the log.
    pub fn close_up(&self) -> Aabb<2> {
        let chair = self.world.and_then(|w| w.solids().iter().find(|s| s.name == "chair")).map(|s| s.aabb());
        let middle = chair.map(|b| [0, 1].map(|k| 0.5 * (b.min[k] + b.max[k])));
        let [x, y] = middle.or_else(|| self.nearest_hit()).unwrap_or([0.0; 2]);
        // As high in proportion as the other pictures.
        let [width, height] = self.shown().extent();
        let half = 0.5 * CLOSE_UP_CELLS * self.gallery.tsdf.config().resolution;
        let half = [half, half * height / width];
        Aabb::new([x - half[0], y - half[1]], [x + half[0], y + half[1]])
    }

    /// A place of the contour near to what the sensor saw nearest in the middle of the log.
    fn nearest_hit(&self) -> Option<[f64; 2]> {
        let (pose, scan) = self.log.get(self.log.len() / 2)?;
        let nearest = scan.beams().filter(|b| b.is_hit()).min_by(|a, b| a.range.total_cmp(&b.range))?;
        let hit = pose.transform_point(nearest.direction.map(|d| d * nearest.range));
        let vertices = self.gallery.contour.vertices.iter().copied();
        vertices.min_by(|&a, &b| distance(a, hit).total_cmp(&distance(b, hit))).or(Some(hit))
    }

    /// The scan whose beams are shown.
    pub fn shown_scan(&self) -> Option<&(Pose<2>, Scan<2>)> {
        self.log.get(self.log.len() * 9 / 100)
    }

    /// The row of the table whose name begins so.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.gallery.rows.iter().find(|row| row.name.starts_with(name))
    }
}
