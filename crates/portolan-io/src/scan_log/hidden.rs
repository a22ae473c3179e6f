//! Whether a cloud can be one scan from where its rays are to begin: one scan sees nothing behind what it sees.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use portolan::geom::vector::{dot, norm, scale, sub};

/// Points that are looked at, and whose rays are followed. Thinning makes surfaces seem coarser, so that more points seem
/// hidden at their edges.
const LOOKED_AT: usize = 200_000;
const RAYS: usize = 1500;
/// Fewer points tell nothing.
const FEWEST: usize = 200;
/// A point is hidden by one that is nearer than this share of its range,
const NEARER: f64 = 0.75;
/// and whose surface its ray passes within the distance to the second nearest point on it, up to this angle.
const WIDEST: f64 = 0.1;
/// Scans have up to 6 % of such points, at edges and in leaves; fused maps 15 % or more.
pub(super) const FUSED_FROM: f64 = 0.1;

/// The share of points that lie behind others, seen from `origin`; `None` where there are too few to say.
/// O(points log points + rays x points): some 0.2 s for a lidar's scan.
pub(super) fn hidden_share(count: usize, point: impl Fn(usize) -> [f64; 3], origin: [f64; 3]) -> Option<f64> {
    let step = count.div_ceil(LOOKED_AT).max(1);
    let about = (0..count).step_by(step).map(|i| sub(point(i), origin));
    let points: Vec<[f64; 3]> =
        about.filter(|p| norm(*p) > 1e-9 && p.iter().all(|v| v.is_finite())).collect();
    if points.len() < FEWEST {
        return None;
    }
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&points).ok()?;
    // The point itself, and two beside it.
    let three = NonZero::new(3)?;
    let seen: Vec<Seen> = points.iter().map(|&p| Seen::of(p, spacing(&tree, p, three))).collect();
    let step = seen.len().div_ceil(RAYS).max(1);
    let rays = seen.iter().step_by(step);
    let (mut hidden, mut all) = (0, 0);
    for ray in rays {
        all += 1;
        hidden += usize::from(seen.iter().any(|other| other.hides(ray)));
    }
    Some(hidden as f64 / f64::from(all))
}

fn spacing(tree: &ImmutableKdTree<f64, 3>, p: [f64; 3], three: NonZero<usize>) -> f64 {
    let near = tree.query(&p).nearest_n::<SquaredEuclidean<f64>>(three).execute();
    near.into_iter().last().map_or(0.0, |last| last.distance.sqrt())
}

/// A point as the origin sees it.
struct Seen {
    direction: [f64; 3],
    range: f64,
    /// Cosine of the angle within which it hides what is behind.
    cosine: f64,
}

impl Seen {
    fn of(p: [f64; 3], spacing: f64) -> Self {
        let range = norm(p);
        let cosine = (spacing / range).min(WIDEST).cos();
        Self { direction: scale(p, 1.0 / range), range, cosine }
    }

    fn hides(&self, other: &Self) -> bool {
        self.range < NEARER * other.range && dot(self.direction, other.direction) > self.cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, real_data};

    /// Points on the walls of a box of 8 x 6 x 3 m about zero, with a column in it: as one scan from `at` sees them, or all.
    fn room(at: Option<[f64; 3]>) -> Vec<[f64; 3]> {
        let mut random = Random(5);
        let mut points = Vec::new();
        let boxes = [([-4.0, -3.0, -1.5], [4.0, 3.0, 1.5]), ([1.0, 1.0, -1.5], [1.6, 1.6, 1.5])];
        if let Some(o) = at {
            for i in 0..20_000 {
                let (ring, step) = (i % 40, i / 40);
                let (el, az) = (f64::from(ring) * 0.02 - 0.4, f64::from(step) * 0.01257);
                let d = [el.cos() * az.cos(), el.cos() * az.sin(), el.sin()];
                // Inside of the room, outside of the column.
                let far =
                    (0..3).map(|k| ((if d[k] > 0.0 { boxes[0].1[k] } else { boxes[0].0[k] }) - o[k]) / d[k]);
                let far = far.fold(f64::INFINITY, f64::min);
                let (mut near, mut out) = (0.0f64, f64::INFINITY);
                for k in 0..3 {
                    let (a, b) = ((boxes[1].0[k] - o[k]) / d[k], (boxes[1].1[k] - o[k]) / d[k]);
                    near = near.max(a.min(b));
                    out = out.min(a.max(b));
                }
                let t = if near < out && near > 0.0 { near.min(far) } else { far };
                points.push([0, 1, 2].map(|k| o[k] + t * d[k]));
            }
            return points;
        }
        // The room next door, too, which a map has and a scan has not.
        let next = ([-6.0, -5.0, -2.0], [6.0, 5.0, 2.0]);
        for i in 0..20_000 {
            let (low, high) = [boxes[0], boxes[1], next][i % 3];
            let mut p: [f64; 3] = std::array::from_fn(|k| low[k] + random.unit() * (high[k] - low[k]));
            let axis = random.below(3);
            p[axis] = if random.below(2) == 0 { low[axis] } else { high[axis] };
            points.push(p);
        }
        points
    }

    #[test]
    fn one_scan_hides_nothing_from_where_it_was_taken() {
        let share = |points: &[[f64; 3]], o| hidden_share(points.len(), |i| points[i], o).unwrap();
        let scan = room(Some([0.0; 3]));
        assert!(share(&scan, [0.0; 3]) < 0.02, "{}", share(&scan, [0.0; 3]));
        let at = [2.5, -1.0, 0.2];
        let moved = room(Some(at));
        // The column hides what is behind it; rings far apart make its edges look wide.
        assert!(share(&moved, at) < 0.06, "{}", share(&moved, at));
        let all = room(None);
        assert!(share(&all, [0.0; 3]) > FUSED_FROM, "{}", share(&all, [0.0; 3]));
        assert_eq!(hidden_share(10, |_| [1.0; 3], [0.0; 3]), None);
    }

    #[test]
    fn maps_and_scans_of_users() {
        for (name, is_fused) in [
            ("clouds_users/immlio_scans.pcd", true),
            ("clouds_users/source.ply", false),
            ("clouds_users/target.ply", false),
            ("lidar3d_balm_hall/full12.pcd", false),
            ("lidar3d_balm_hall/full16.pcd", false),
            ("e57_las_ptx/bunnyInt19.e57", true),
            ("clouds_users/milk_cartoon_all_small_clorox.pcd", false),
        ] {
            let Some(path) = real_data(name) else { continue };
            let cloud = crate::read_points(path).unwrap();
            let share = hidden_share(cloud.points.len(), |i| cloud.position(i), [0.0; 3]).unwrap();
            assert_eq!(share > FUSED_FROM, is_fused, "{name}: {share}");
        }
    }
}
