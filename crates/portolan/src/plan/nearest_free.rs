//! The search for the nearest free point or pose, for a start in collision.

use super::demand::{Demand, Verdict};
use super::{Body, check_pose};
use crate::field::ClearanceField;
use crate::geom::Pose;
use crate::geom::vector::{add, norm, scale};

/// Limits of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchLimits {
    /// Largest distance from the start (meters).
    pub radius: f64,
    /// Largest number of points checked.
    pub max_points: usize,
}

impl Default for SearchLimits {
    /// 2 m, a million points.
    fn default() -> Self {
        Self { radius: 2.0, max_points: 1_000_000 }
    }
}

/// The result of [`nearest_free`] and [`nearest_free_pose`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NearestFree<const D: usize> {
    /// The start is free.
    Here,
    /// A free point was found.
    At {
        /// The free place: of a point itself, of a body the position of its zero.
        point: [f64; D],
        /// From the place asked about (meters).
        distance: f64,
    },
    /// All points of the search lattice within this distance (meters) are refused. Less than [`SearchLimits::radius`] where
    /// [`SearchLimits::max_points`] was reached; 0 for a start that is not finite.
    NoneWithin(f64),
}

/// The nearest point at which the demanded clearance is certified, for a start in collision.
///
/// Checks the points of a lattice around `p_world` with the resolution of the field, from near to far, and moves the first
/// free one toward the start by bisection while it stays free. No point of the lattice is nearer; a free pocket smaller
/// than a cell may be missed between its points. O(cells of the ball up to the result), at most `limits.max_points`.
///
/// ```
/// use portolan::plan::{Demand, NearestFree, SearchLimits, nearest_free};
/// # use portolan::{Answer, field::{Clearance, ClearanceField, UnknownSpace}};
/// # struct Wall;
/// # impl<const D: usize> ClearanceField<D> for Wall {
/// #     fn clearance(&self, p: [f64; D], _: UnknownSpace) -> Answer<Clearance> {
/// #         let d = 4.0 - p[0];
/// #         Answer::Known(Clearance { lower: d.abs(), upper: d.abs(), inside: d < 0.0 })
/// #     }
/// #     fn distance_and_gradient(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
/// #         Answer::Known((4.0 - p[0], std::array::from_fn(|k| if k == 0 { -1.0 } else { 0.0 })))
/// #     }
/// #     fn resolution(&self) -> f64 { 0.05 }
/// # }
/// # let field = &Wall;
/// // A field with a wall at x = 4 m.
/// let (demand, limits) = (Demand::new(0.3), SearchLimits::default());
/// assert_eq!(nearest_free(field, [3.0, 1.0], &demand, &limits), NearestFree::Here);
/// let NearestFree::At { point, distance } = nearest_free(field, [3.9, 1.0], &demand, &limits) else { panic!("a way back") };
/// assert!(point[0] <= 3.7 && distance < 0.201);
/// // In 3-D, from inside the wall.
/// let NearestFree::At { point, .. } = nearest_free(field, [4.1, 1.0, 2.0], &demand, &limits) else { panic!("a way back") };
/// assert!(point[0] <= 3.7 && point[0] > 3.69);
/// ```
pub fn nearest_free<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    p_world: [f64; D],
    demand: &Demand,
    limits: &SearchLimits,
) -> NearestFree<D> {
    // Nothing nearer than this can be free.
    let reach = match demand.at(field, p_world) {
        Verdict::Free(_) => return NearestFree::Here,
        Verdict::Refused { reach, .. } => reach,
    };
    search(field.resolution(), p_world, reach, limits, |p| {
        matches!(demand.met_at(field, p), Verdict::Free(_))
    })
}

/// The nearest position of a body at which it is certified to be free, with its orientation unchanged. As [`nearest_free`],
/// with [`check_pose`] at every point.
pub fn nearest_free_pose<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    body: &Body<D>,
    world_from_body: &Pose<D>,
    demand: &Demand,
    limits: &SearchLimits,
) -> NearestFree<D> {
    let free = |translation: [f64; D]| {
        check_pose(field, body, &Pose { translation, ..*world_from_body }, demand).is_free()
    };
    if free(world_from_body.translation) {
        return NearestFree::Here;
    }
    search(field.resolution(), world_from_body.translation, 0.0, limits, free)
}

/// Largest number of points of a search, above any limit of the caller: it bounds the memory of one shell.
const MOST: usize = 1 << 26;

fn search<const D: usize>(
    spacing: f64,
    start: [f64; D],
    reach: f64,
    limits: &SearchLimits,
    free: impl Fn([f64; D]) -> bool,
) -> NearestFree<D> {
    let sane = start.iter().all(|v| v.is_finite()) && spacing > 0.0 && spacing.is_finite();
    // Beyond this the squares of integers are not exact in f64.
    let last = (limits.radius / spacing).min(1e6);
    if !sane || !(limits.radius >= 0.0) {
        return NearestFree::NoneWithin(0.0);
    }
    let first = (reach / spacing * (1.0 - 1e-9)).min(last) as i64;
    let mut left = limits.max_points.min(MOST);
    let mut shell: Vec<(i64, [i32; D])> = Vec::new();
    for from in first..=last as i64 {
        // Half open shells of one cell: nearer ones are done before farther ones begin.
        shell.clear();
        let sq = [(from * from).max(1), (from + 1) * (from + 1)];
        if !offsets(sq, left, &mut shell) {
            return NearestFree::NoneWithin(from as f64 * spacing);
        }
        shell.sort_unstable_by_key(|(sq, k)| (*sq, std::array::from_fn::<i32, D, _>(|a| k[D - 1 - a])));
        for (sq, k) in &shell {
            let away = (*sq as f64).sqrt() * spacing;
            if away > limits.radius {
                return NearestFree::NoneWithin(limits.radius);
            }
            let offset_world = scale(k.map(f64::from), spacing);
            if free(add(start, offset_world)) {
                return go_back(start, offset_world, reach, &free);
            }
        }
        left -= shell.len();
    }
    NearestFree::NoneWithin(limits.radius.min(last * spacing))
}

/// All whole offsets with a square in `sq[0]..sq[1]`, or `false` where they are more than `most`.
fn offsets<const D: usize>(sq: [i64; 2], most: usize, found: &mut Vec<(i64, [i32; D])>) -> bool {
    fn axis<const D: usize>(
        k: usize,
        at: &mut [i32; D],
        sum: i64,
        sq: [i64; 2],
        most: usize,
        found: &mut Vec<(i64, [i32; D])>,
    ) -> bool {
        let left = sq[1] - 1 - sum;
        let most_here = left.isqrt();
        // The lowest axis fills the rest: only there does the inner border count.
        let least = if k == 0 && sq[0] > sum { (sq[0] - sum - 1).isqrt() + 1 } else { 0 };
        for v in least..=most_here {
            // Zero has one sign.
            for sign in if v == 0 { 1..2 } else { 0..2 } {
                at[k] = (if sign == 0 { -v } else { v }) as i32;
                let sum = sum + v * v;
                let fits = if k > 0 {
                    axis(k - 1, at, sum, sq, most, found)
                } else {
                    found.push((sum, *at));
                    found.len() <= most
                };
                if !fits {
                    return false;
                }
            }
        }
        true
    }
    axis(D - 1, &mut [0; D], 0, sq, most, found)
}

/// Twelve bisections between a refused point and the free point found: to 1/4096 of their distance.
fn go_back<const D: usize>(
    start: [f64; D],
    offset_world: [f64; D],
    reach: f64,
    free: &impl Fn([f64; D]) -> bool,
) -> NearestFree<D> {
    let at = |share: f64| add(start, scale(offset_world, share));
    let (mut refused, mut found) = ((reach / norm(offset_world)).clamp(0.0, 1.0), 1.0);
    for _ in 0..12 {
        let middle = 0.5 * (refused + found);
        if free(at(middle)) { found = middle } else { refused = middle }
    }
    NearestFree::At { point: at(found), distance: found * norm(offset_world) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;
    use crate::plan::testing::{Scene, point, scenes};
    use proptest::prelude::*;

    /// Every point of the lattice is asked, in no order.
    fn brute_force<const D: usize>(
        scene: &Scene<D>,
        p: [f64; D],
        demand: &Demand,
        radius: f64,
    ) -> Option<f64> {
        let n = (radius / scene.resolution()) as i32 + 1;
        let mut best = None;
        let side = (2 * n + 1) as usize;
        for i in 0..side.pow(D as u32) {
            let k: [f64; D] = std::array::from_fn(|a| f64::from((i / side.pow(a as u32) % side) as i32 - n));
            let away = norm(k) * scene.resolution();
            let q = add(p, scale(k, scene.resolution()));
            if away <= radius
                && best.is_none_or(|b| away < b)
                && matches!(demand.at(scene, q), Verdict::Free(_))
            {
                best = Some(away);
            }
        }
        best
    }

    fn is_the_nearest<const D: usize>(scene: &Scene<D>, p: [f64; D], demand: &Demand, radius: f64) {
        let limits = SearchLimits { radius, ..Default::default() };
        let want = brute_force(scene, p, demand, radius);
        match nearest_free(scene, p, demand, &limits) {
            NearestFree::Here => assert_eq!(want, Some(0.0)),
            NearestFree::At { point, distance: away } => {
                assert!(matches!(demand.at(scene, point), Verdict::Free(_)));
                assert!((distance(p, point) - away).abs() < 1e-12);
                // Only the way back may be shorter.
                let want = want.unwrap();
                assert!(away <= want + 1e-12 && want > 0.0, "{away} {want}");
                let body = Body::of(&[([0.0; D], 0.0)]).unwrap();
                let pose = Pose { translation: p, ..Pose::IDENTITY };
                let NearestFree::At { distance, .. } =
                    nearest_free_pose(scene, &body, &pose, demand, &limits)
                else {
                    panic!("a point is a body")
                };
                // Halving starts elsewhere, and may end in another gap of slack bounds.
                assert!(distance <= want + 1e-12 && (distance - away).abs() <= scene.resolution() * 2.0);
            }
            NearestFree::NoneWithin(searched) => {
                assert_eq!(want, None);
                assert!(searched <= radius && searched > radius - scene.resolution());
            }
        }
    }

    proptest! {
        #[test]
        fn is_the_nearest_2d_and_3d(
            flat in scenes::<2>(), scene in scenes::<3>(), p in prop::array::uniform3(-5.0..5.0f64),
            clearance in 0.0..0.6f64, radius in 0.0..1.5f64,
        ) {
            is_the_nearest(&flat, point(p), &Demand::new(clearance), radius);
            is_the_nearest(&scene, p, &Demand::new(0.66 * clearance), 0.4 * radius);
        }
    }

    #[test]
    fn shells_hold_every_offset_once() {
        let mut all = Vec::new();
        for j in 0..7i64 {
            assert!(offsets::<3>([(j * j).max(1), (j + 1) * (j + 1)], usize::MAX, &mut all));
        }
        let count = (-7..8i64)
            .flat_map(|x| (-7..8i64).flat_map(move |y| (-7..8i64).map(move |z| x * x + y * y + z * z)));
        assert_eq!(all.len(), count.filter(|sq| (1..49).contains(sq)).count());
        let mut cells: Vec<_> = all.iter().map(|(_, k)| *k).collect();
        cells.sort_unstable();
        cells.dedup();
        assert_eq!(cells.len(), all.len());
    }

    #[test]
    fn limits_are_kept_and_said() {
        let mut scene = Scene::<3>::empty();
        scene.hole = crate::geom::Aabb::new([-4.0; 3], [4.0; 3]);
        let demand = Demand::new(0.1);
        let search = |p: [f64; 3], radius, max_points| {
            nearest_free(&scene, p, &demand, &SearchLimits { radius, max_points })
        };
        let NearestFree::NoneWithin(searched) = search([0.0; 3], 1e9, 10_000) else {
            panic!("all is unknown")
        };
        // 4 / 3 pi (13 cells)^3 are 9203.
        assert!((searched - 13.0 * 0.05).abs() < 1e-9, "{searched}");
        assert_eq!(search([f64::NAN; 3], 1.0, 1000), NearestFree::NoneWithin(0.0));
        assert_eq!(search([0.0; 3], f64::NAN, 1000), NearestFree::NoneWithin(0.0));
        assert_eq!(search([0.0; 3], -1.0, 1000), NearestFree::NoneWithin(0.0));
        // The lattice's next point is a cell away.
        assert_eq!(search([0.0; 3], 1.0, 0), NearestFree::NoneWithin(0.05));
        let NearestFree::At { point, .. } = search([3.9, 0.0, 0.0], 1.0, 100_000) else {
            panic!("near the end")
        };
        assert!((point[0] - 4.1).abs() < 1e-3, "{point:?}");
    }
}
