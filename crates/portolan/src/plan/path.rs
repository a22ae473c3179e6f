//! The certified check of a path.

use super::Curve;
use super::demand::{Cause, Demand, Verdict};
use crate::field::{Clearance, ClearanceField};

/// The result of [`check_path`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathCheck {
    /// Every point of the path has the clearance demanded.
    Certified(PathClearance),
    /// A part of the path is not certified.
    Violated(PathViolation),
}

impl PathCheck {
    /// Whether the whole path is certified.
    pub fn is_certified(&self) -> bool {
        matches!(self, Self::Certified(_))
    }
}

/// Bounds of the least clearance along a path (meters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathClearance {
    /// Lower bound, at least the demand. A larger demand makes shorter steps and so a tighter bound.
    pub lower: f64,
    /// Upper bound; infinite where no obstacle is within the range of the field.
    pub upper: f64,
    /// The parameter of the point with the upper bound: for [`Waypoints`](super::Waypoints) its arc length (meters).
    pub at: f64,
}

/// A part of a path that is not certified, in parameters of the curve: for [`Waypoints`](super::Waypoints) arc
/// lengths (meters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathViolation {
    /// The path is certified up to here, from its start or from the part before; 0 where the start is not certified.
    pub from: f64,
    /// The next parameter checked that is certified again, else the end of the path.
    pub to: f64,
    /// The first cause between `from` and `to` other than [`Cause::Undecided`], which is given only where it is the only one.
    pub cause: Cause,
}

/// Checks every point of a path by conservative advancement *(Mirtich 1996, section 2.3)*: from a point with certified
/// clearance `c` under a demand `m`, the next `c - m` meters are free. That is the length of each step, with one query per
/// step: few in open space, at most `1 / tolerance` per meter.
///
/// A certified path has the demanded distance to the surface (and to unknown space where that is an obstacle) everywhere,
/// also between the points queried.
///
/// ```
/// use portolan::field::{Esdf, EsdfSettings};
/// use portolan::geom::Grid;
/// use portolan::map::{DenseTsdf, Tsdf2, TsdfConfig};
/// use portolan::plan::{Cause, Demand, PathCheck, Waypoints, check_path};
///
/// // A wall at x = 4 m; the space before it was observed.
/// let mut tsdf = Tsdf2::covering(&Grid::new([0.0; 2], 0.05, [84, 60]), TsdfConfig::default())?;
/// for i in 0..tsdf.grid().len() {
///     let cell = tsdf.grid().cell(i);
///     tsdf.fuse(cell, 4.0 - tsdf.grid().lattice.center(cell)[0], 1.0);
/// }
/// let settings = EsdfSettings { unknown: true, ..Default::default() };
/// let field = Esdf::of(&tsdf, &settings);
///
/// // A robot of 30 cm may drive along it ...
/// let path = Waypoints::new(vec![[1.0, 1.0], [3.5, 1.0], [3.5, 2.0]])?;
/// let PathCheck::Certified(least) = check_path(&field, &path, &Demand::new(0.3)) else { panic!("free") };
/// assert!(least.lower <= 0.5 && least.upper >= 0.4999);
///
/// // ... and not into it.
/// let path = Waypoints::new(vec![[1.0, 1.0], [4.1, 1.0]])?;
/// let PathCheck::Violated(first) = check_path(&field, &path, &Demand::new(0.3)) else { panic!("a wall") };
/// assert!((first.from - 2.7).abs() < 5e-3 && first.cause == Cause::TooNear);
///
/// // The same in 3-D.
/// let grid = Grid::new([0.0; 3], 0.1, [44, 20, 20]);
/// let mut tsdf = DenseTsdf::covering(&grid, TsdfConfig::default())?;
/// for i in 0..tsdf.grid().len() {
///     let cell = tsdf.grid().cell(i);
///     tsdf.fuse(cell, 4.0 - tsdf.grid().lattice.center(cell)[0], 1.0);
/// }
/// let field = Esdf::of(&tsdf, &settings);
/// let path = Waypoints::new(vec![[1.0, 1.0, 0.5], [3.5, 1.0, 1.5]])?;
/// assert!(check_path(&field, &path, &Demand::new(0.3)).is_certified());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check_path<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    path: &(impl Curve<D> + ?Sized),
    demand: &Demand,
) -> PathCheck {
    let mut walk = Walk::<_, _, D> { field, path, demand, end: path.end(), queries: demand.max_queries };
    match walk.free(0.0) {
        Ok(least) => PathCheck::Certified(least),
        Err(stop) => PathCheck::Violated(walk.violation(stop)),
    }
}

/// All parts of a path that are not certified, in ascending order, none where [`check_path`] certifies it: what lies between them
/// is certified. The first is that of [`check_path`]. The limit of queries is for all of them together; where it ends, the last part
/// goes on to the end of the path.
pub fn path_violations<const D: usize>(
    field: &(impl ClearanceField<D> + ?Sized),
    path: &(impl Curve<D> + ?Sized),
    demand: &Demand,
) -> Vec<PathViolation> {
    let mut walk = Walk::<_, _, D> { field, path, demand, end: path.end(), queries: demand.max_queries };
    let (mut all, mut from) = (Vec::new(), 0.0);
    while let Err(stop) = walk.free(from) {
        let found = walk.violation(stop);
        all.push(found);
        from = found.to;
        if from >= walk.end {
            break;
        }
    }
    all
}

/// A check in progress.
pub(super) struct Walk<'a, F: ?Sized, C: ?Sized, const D: usize> {
    pub(super) field: &'a F,
    pub(super) path: &'a C,
    pub(super) demand: &'a Demand,
    /// No further than this parameter.
    pub(super) end: f64,
    /// Queries left.
    pub(super) queries: usize,
}

/// Where certified space ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub(super) at: f64,
    pub(super) cause: Cause,
    reach: f64,
}

impl<F: ClearanceField<D> + ?Sized, C: Curve<D> + ?Sized, const D: usize> Walk<'_, F, C, D> {
    /// Advances in certified steps from a parameter to the end.
    pub(super) fn free(&mut self, from: f64) -> Result<PathClearance, Stop> {
        let tolerance = self.demand.tolerance_in(self.field);
        let mut least = PathClearance { lower: f64::INFINITY, upper: f64::INFINITY, at: from };
        let mut t = from;
        // Clearance where the step began, and its length.
        let mut step: Option<(f64, f64)> = None;
        loop {
            let (found, room) = match self.look(t) {
                Verdict::Free(found) => (found, self.room(t, found)),
                Verdict::Refused { cause, reach } => return Err(Stop { at: t, cause, reach }),
            };
            if let Some((lower, length)) = step.filter(|s| s.1.is_finite()) {
                // Clearance is 1-Lipschitz: the lowest point that both ends of the step allow.
                least.lower = least.lower.min(0.5 * (lower + found.lower - length));
            }
            least.lower = least.lower.min(found.lower);
            if found.upper < least.upper {
                (least.upper, least.at) = (found.upper, t);
            }
            if t >= self.end {
                return Ok(least);
            }
            let undecided = Stop { at: t, cause: Cause::Undecided, reach: 0.0 };
            if room < tolerance {
                return Err(undecided);
            }
            step = Some((found.lower, room));
            t = self.ahead(t, room).ok_or(undecided)?;
        }
    }

    /// Where what is not certified ends, and why it is not.
    pub(super) fn violation(&mut self, stop: Stop) -> PathViolation {
        let tolerance = self.demand.tolerance_in(self.field);
        let mut found = PathViolation { from: stop.at, to: self.end, cause: stop.cause };
        let Stop { at: mut t, mut cause, mut reach } = stop;
        while t < self.end && self.queries > 0 {
            // In unknown space short steps find nothing more.
            let least = match cause {
                Cause::Unknown | Cause::Outside => tolerance.max(0.25 * self.field.resolution()),
                Cause::TooNear | Cause::Undecided => tolerance,
            };
            let Some(next) = self.ahead(t, reach.max(least)) else { break };
            t = next;
            match self.look(t) {
                Verdict::Free(clearance) if self.room(t, clearance) >= tolerance => {
                    found.to = t;
                    break;
                }
                Verdict::Free(_) => (cause, reach) = (Cause::Undecided, 0.0),
                Verdict::Refused { cause: c, reach: r } => (cause, reach) = (c, r),
            }
            if found.cause == Cause::Undecided {
                found.cause = cause;
            }
        }
        found
    }

    fn look(&mut self, t: f64) -> Verdict {
        match self.queries.checked_sub(1) {
            Some(left) => {
                self.queries = left;
                self.demand.at(self.field, self.path.point(t))
            }
            None => Verdict::Refused { cause: Cause::Undecided, reach: 0.0 },
        }
    }

    /// Length of the certified step from a free point, less the rounding errors of points and parameters.
    fn room(&self, t: f64, found: Clearance) -> f64 {
        let scale = self.path.point(t).iter().fold(t.abs(), |m, v| m.max(v.abs()));
        (found.lower - self.demand.clearance) * (1.0 - 1e-9) - 16.0 * f64::EPSILON * scale
    }

    /// `None` where the parameter does not move.
    fn ahead(&self, t: f64, length: f64) -> Option<f64> {
        let next = self.path.advance(t, length).min(self.end);
        (next > t).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::UnknownSpace;
    use crate::plan::testing::{Scene, point, scenes};
    use crate::plan::{SpeedLimited, Spline, Waypoints};
    use proptest::prelude::*;

    /// Compares a check with many places of the path, whose clearance is known.
    pub(crate) fn is_true<const D: usize>(scene: &Scene<D>, path: &impl Curve<D>, demand: &Demand) -> bool {
        const SAMPLES: u32 = 4000;
        let truth = |t: f64| scene.truth(path.point(t), demand.unknown);
        let free_from = |from: f64, to: f64, least: f64| {
            for i in 0..=SAMPLES {
                let t = from + (to - from) * f64::from(i) / f64::from(SAMPLES);
                let d = truth(t);
                assert!(d.is_some_and(|d| d >= least), "{d:?} at {t} of {to}, demanded {demand:?}");
            }
        };
        match check_path(scene, path, demand) {
            PathCheck::Certified(least) => {
                assert!(least.lower >= demand.clearance);
                // Rounding of coordinates of up to five meters.
                free_from(0.0, path.end(), least.lower - 1e-14);
                assert!(truth(least.at).is_some_and(|d| d <= least.upper));
                true
            }
            PathCheck::Violated(found) => {
                assert!(found.from <= found.to && (0.0..=path.end()).contains(&found.to));
                if found.from > 0.0 {
                    free_from(0.0, found.from, demand.clearance - 1e-14);
                }
                let outside = !scene.bounds.grown(-1e-9).contains(path.point(found.from));
                let ahead = path.advance(found.from, 1e-9);
                let room = [found.from, ahead].map(|t| truth(t).map_or(0.0, |d| d - demand.clearance));
                // It stops only where bounds that are off by the slack might be short of the demand by the tolerance.
                let most = 2.0 * scene.slack + demand.tolerance + 1e-6;
                assert!(
                    outside || room[0] <= most || scene.most <= demand.clearance + most,
                    "{room:?} {found:?}"
                );
                // The cause is that of some place of the part.
                let some = |of: &dyn Fn(f64, Option<f64>) -> bool| {
                    (0..=SAMPLES).any(|i| {
                        let t = found.from + (found.to - found.from) * f64::from(i) / f64::from(SAMPLES);
                        of(t, truth(t))
                    })
                };
                let surface = |t: f64| scene.signed(path.point(t));
                // Samples miss the very place by half their distance.
                let apart = 10.0 / f64::from(SAMPLES) + 2.0 * demand.tolerance;
                match found.cause {
                    Cause::TooNear => assert!(some(&|t, _| surface(t) < demand.clearance + apart)),
                    Cause::Unknown => {
                        assert!(some(&|_, d| d.is_none_or(|d| d < demand.clearance + apart)));
                    }
                    Cause::Outside => {
                        let beyond = |t, _| !scene.bounds.grown(-apart).contains(path.point(t));
                        assert!(some(&beyond));
                    }
                    Cause::Undecided => {}
                }
                false
            }
        }
    }

    fn demand(clearance: f64, optimistic: bool) -> Demand {
        let demand = Demand::new(clearance);
        if optimistic { demand.optimistic() } else { demand }
    }

    fn legs_and_splines<const D: usize>(scene: &Scene<D>, points: &[[f64; 3]], demand: &Demand) {
        let points: Vec<[f64; D]> = points.iter().map(|p| point(*p)).collect();
        is_true(scene, &Waypoints::new(points.clone()).unwrap(), demand);
        all_parts_are_found(scene, &Waypoints::new(points.clone()).unwrap(), demand);
        if points.len() > 1 {
            let spline = Spline::catmull_rom(&points).unwrap();
            is_true(scene, &spline, demand);
            all_parts_are_found(scene, &spline, demand);
        }
    }

    /// Between the parts, before and after them, every place is free; the first is that of the check.
    fn all_parts_are_found<const D: usize>(scene: &Scene<D>, path: &impl Curve<D>, demand: &Demand) {
        let all = path_violations(scene, path, demand);
        match check_path(scene, path, demand) {
            PathCheck::Certified(_) => assert!(all.is_empty()),
            PathCheck::Violated(first) => assert_eq!(all.first(), Some(&first)),
        }
        assert!(all.iter().all(|part| part.from <= part.to && part.to <= path.end()));
        assert!(all.windows(2).all(|w| w[0].to <= w[1].from && w[0].from < w[1].from));
        for i in 0..=2000 {
            let t = path.end() * (f64::from(i) / 2000.0);
            let free = || {
                let truth = scene.truth(path.point(t), demand.unknown);
                truth.is_some_and(|d| d >= demand.clearance - 1e-14)
            };
            assert!(all.iter().any(|part| (part.from..=part.to).contains(&t)) || free(), "{t} of {all:?}");
        }
    }

    #[test]
    fn every_obstacle_on_the_way_is_a_part_of_its_own() {
        let mut scene = Scene::<2>::empty();
        scene.balls = vec![([-2.0, 0.0], 0.5), ([0.0, 0.2], 0.5), ([3.0, 3.0], 0.2), ([2.0, -0.1], 0.5)];
        let path = Waypoints::new(vec![[-4.0, 0.0], [4.0, 0.0]]).unwrap();
        let demand = Demand::new(0.1);
        let parts = path_violations(&scene, &path, &demand);
        let middles: Vec<f64> = parts.iter().map(|part| (0.5 * (part.from + part.to)).round()).collect();
        assert_eq!(middles, [2.0, 4.0, 6.0]);
        assert!(parts.iter().all(|part| part.cause == Cause::TooNear && part.to - part.from > 1.0));
        assert!(
            path_violations(&scene, &Waypoints::new(vec![[-4.0, 2.0], [4.0, 2.0]]).unwrap(), &demand)
                .is_empty()
        );
        // Few queries: what was not looked at counts as not certified.
        let few = Demand { max_queries: 12, ..demand };
        let parts = path_violations(&scene, &path, &few);
        assert_eq!(parts.last().map(|part| part.to), Some(path.end()));
    }

    proptest! {
        #[test]
        fn what_is_certified_is_free_2d_and_3d(
            flat in scenes::<2>(), scene in scenes::<3>(),
            p in prop::collection::vec(prop::array::uniform3(-5.0..5.0f64), 1..5),
            clearance in prop_oneof![Just(0.0), 0.0..0.6f64], optimistic in any::<bool>(),
        ) {
            legs_and_splines(&flat, &p, &demand(clearance, optimistic));
            legs_and_splines(&scene, &p, &demand(clearance, optimistic));
        }
    }

    #[test]
    fn passes_between_balls_where_there_is_room_and_not_where_there_is_none() {
        // A gap of 0.6 m between two balls of one meter.
        let mut scene = Scene::<3>::empty();
        scene.balls = vec![([0.0, 1.3, 0.0], 1.0), ([0.0, -1.3, 0.0], 1.0)];
        let through = Waypoints::new(vec![[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]]).unwrap();
        assert!(is_true(&scene, &through, &Demand::new(0.298)));
        assert!(!is_true(&scene, &through, &Demand::new(0.301)));
        let PathCheck::Violated(found) = check_path(&scene, &through, &Demand::new(0.4)) else { panic!() };
        // Where sqrt(x^2 + 1.3^2) - 1 is 0.4.
        let half = (1.4f64 * 1.4 - 1.3 * 1.3).sqrt();
        assert_eq!(found.cause, Cause::TooNear);
        assert!(
            (found.from - (3.0 - half)).abs() < 5e-3 && (found.to - (3.0 + half)).abs() < 5e-3,
            "{found:?}"
        );
        // Around them on a circle, as a function with a promise.
        let circle = |t: f64| [2.5 * t.cos(), 2.5 * t.sin(), 0.0];
        let circle = SpeedLimited::new(circle, std::f64::consts::TAU, 2.5).unwrap();
        assert!(
            is_true(&scene, &circle, &Demand::new(0.19)) && !is_true(&scene, &circle, &Demand::new(0.21))
        );
    }

    #[test]
    fn the_first_cause_is_named() {
        let mut scene = Scene::<2>::empty();
        scene.balls = vec![([3.0, 0.0], 0.5)];
        scene.hole = crate::geom::Aabb::new([0.0, -1.0], [1.0, 1.0]);
        let path = Waypoints::new(vec![[-2.0, 0.0], [4.0, 0.0]]).unwrap();
        let cause = |demand: Demand| match check_path(&scene, &path, &demand) {
            PathCheck::Violated(found) => (found.cause, (found.from * 10.0).round() / 10.0),
            PathCheck::Certified(_) => panic!("a ball is in the way"),
        };
        assert_eq!(cause(Demand::new(0.2)), (Cause::Unknown, 1.8));
        assert_eq!(cause(Demand::new(0.2).optimistic()), (Cause::TooNear, 4.3));
        let out = Waypoints::new(vec![[-2.0, 2.0], [-2.0, 9.0], [-2.0, 2.0]]).unwrap();
        for (clearance, cause) in [(0.2, Cause::Unknown), (0.0, Cause::Outside)] {
            let PathCheck::Violated(found) = check_path(&scene, &out, &Demand::new(clearance)) else {
                panic!()
            };
            assert_eq!(found.cause, cause);
            let off = [found.from - (3.0 - clearance), found.to - (11.0 + clearance)];
            assert!(off.iter().all(|o| o.abs() < 0.02), "{found:?}");
        }
        // Beyond what is maintained nothing is known.
        scene.most = 0.1;
        let short = Waypoints::new(vec![[-2.0, 2.0], [-1.0, 2.0]]).unwrap();
        let PathCheck::Violated(found) = check_path(&scene, &short, &Demand::new(0.2)) else { panic!() };
        assert_eq!((found.cause, found.from, found.to), (Cause::Undecided, 0.0, 1.0));
    }

    #[test]
    fn along_a_wall_at_the_limit_the_check_ends() {
        // A ball so large that it is a wall, 0.3 m away, over ten kilometers.
        let mut scene = Scene::<2>::empty();
        scene.bounds = crate::geom::Aabb::new([-1e9; 2], [1e9; 2]);
        let circle = |r: f64| SpeedLimited::new(move |t: f64| [r * t.cos(), r * t.sin()], 6.0, r).unwrap();
        scene.balls = vec![([0.0; 2], 100.0)];
        assert!(is_true(&scene, &circle(100.3), &Demand::new(0.2985)));
        assert!(!is_true(&scene, &circle(100.3), &Demand::new(0.2995)));
        let few = Demand { max_queries: 100, ..Demand::new(0.2985) };
        let PathCheck::Violated(found) = check_path(&scene, &circle(100.3), &few) else { panic!() };
        assert_eq!((found.cause, found.to), (Cause::Undecided, 6.0));
        assert!(found.from > 0.0);
    }

    #[test]
    fn nonsense_is_refused_and_ends() {
        let scene = Scene::<2>::empty();
        let path = Waypoints::new(vec![[0.0, 0.0], [1.0, 0.0]]).unwrap();
        for clearance in [f64::NAN, -0.1, f64::INFINITY] {
            let PathCheck::Violated(found) = check_path(&scene, &path, &Demand::new(clearance)) else {
                panic!()
            };
            // Less than infinite clearance is known everywhere: to the end of the map.
            let cause = if clearance > 0.0 { Cause::Unknown } else { Cause::Undecided };
            assert_eq!((found.cause, found.from), (cause, 0.0));
        }
        let strange = Demand { tolerance: f64::NAN, ..Demand::new(0.1) };
        assert!(check_path(&scene, &path, &strange).is_certified());
        let point = Waypoints::new(vec![[1.0, 1.0]]).unwrap();
        assert!(check_path(&scene, &point, &Demand::new(0.1)).is_certified());
        // A path that leaves the map for the end of the world.
        let far = Waypoints::new(vec![[0.0, 0.0], [1e150, 0.0]]).unwrap();
        let PathCheck::Violated(found) = check_path(&scene, &far, &Demand::new(0.1)) else { panic!() };
        assert_eq!((found.cause, found.to), (Cause::Unknown, 1e150));
        // A point that is NaN is refused without a query.
        let lost = SpeedLimited::new(|t: f64| [t, (0.5 - t).sqrt()], 1.0, 2.0).unwrap();
        let near = Scene::<2> { most: 0.3, ..scene };
        let PathCheck::Violated(found) = check_path(&near, &lost, &Demand::new(0.1)) else { panic!() };
        assert_eq!((found.cause, found.to), (Cause::Outside, 1.0));
        // Rounding leaves no room to move at 1e17 m.
        let rim = Scene::<2> {
            bounds: crate::geom::Aabb::new([-1e18; 2], [1e18; 2]),
            balls: vec![([1e17, 0.0], 1.0)],
            ..near
        };
        let path = Waypoints::new(vec![[1e17, 64.0], [1e17, 1e17]]).unwrap();
        assert!(!check_path(&rim, &path, &Demand::new(0.1)).is_certified());
    }

    #[test]
    fn unknown_space_counts_as_the_demand_says() {
        let mut scene = Scene::<3>::empty();
        scene.hole = crate::geom::Aabb::new([0.0; 3], [1.0; 3]);
        let path = Waypoints::new(vec![[-1.0, 0.5, 0.5], [2.0, 0.5, 0.5]]).unwrap();
        assert!(check_path(&scene, &path, &Demand::new(0.1).optimistic()).is_certified());
        assert!(!check_path(&scene, &path, &Demand::new(0.1)).is_certified());
        assert_eq!(Demand::new(0.1).unknown, UnknownSpace::Pessimistic);
    }
}
