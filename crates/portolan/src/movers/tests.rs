//! Rooms in which somebody comes and goes, and rooms in which nobody does.

use super::*;
use crate::scan::{RangeLimits, Scan};

const BEAMS: usize = 720;

fn bearings() -> Vec<f64> {
    (0..BEAMS).map(|i| (i as f64 / 2.0 - 180.0).to_radians()).collect()
}

/// The scan of a room of 6 m x 6 m from `at`, with somebody (a circle of 20 cm) in it or nobody.
fn scan(at: [f64; 2], person: Option<[f64; 2]>) -> Scan<2> {
    let range = |b: &f64| {
        let d = [b.cos(), b.sin()];
        let to_wall = |k: usize| ((if d[k] > 0.0 { 3.0 } else { -3.0 }) - at[k]) / d[k];
        let wall = to_wall(0).min(to_wall(1));
        let seen = person.and_then(|p| {
            let [x, y] = [p[0] - at[0], p[1] - at[1]];
            let along = x * d[0] + y * d[1];
            let inside = 0.04 - (x * x + y * y - along * along);
            (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt())
        });
        seen.unwrap_or(wall).min(wall)
    };
    let ranges: Vec<f64> = bearings().iter().map(range).collect();
    Scan::from_laser(&bearings(), &ranges, &RangeLimits::default())
}

/// Numbers from -1 to 1, the same on every run.
fn noise(i: usize) -> f64 {
    (i as f64 * 12.9898 + 4.1).sin() * 43758.5453 % 1.0
}

/// Of scans with errors of poses of `sigma` or so, the share of returns that is taken for movers: of people, of the rest.
fn removed(scans: &[(Pose<2>, Scan<2>, Option<[f64; 2]>)]) -> [f64; 2] {
    let mut movers = Movers::<2>::new(0.02, [0.0; 2], usize::MAX).unwrap();
    for (pose, scan, _) in scans {
        movers.look(pose, scan).unwrap();
    }
    let mut counts = [[0usize; 2]; 2];
    for (pose, scan, person) in scans {
        for p in scan.hits_world(pose) {
            let on = person.is_some_and(|q| (p[0] - q[0]).hypot(p[1] - q[1]) < 0.3);
            counts[usize::from(!on)][0] += usize::from(movers.moved(p));
            counts[usize::from(!on)][1] += 1;
        }
    }
    counts.map(|[moved, all]| moved as f64 / all.max(1) as f64)
}

fn walk(n: usize, person: impl Fn(usize) -> Option<[f64; 2]>) -> Vec<(Pose<2>, Scan<2>, Option<[f64; 2]>)> {
    let one = |i: usize| {
        let at = [noise(3 * i), 0.5 * noise(3 * i + 1)];
        let person = person(i).filter(|p| (p[0] - at[0]).hypot(p[1] - at[1]) > 0.4);
        let off = [noise(7 * i), noise(7 * i + 2)].map(|v| 0.03 * v);
        (Pose::<2>::new(at[0] + off[0], at[1] + off[1], 0.0), scan(at, person), person)
    };
    (0..n).map(one).collect()
}

#[test]
fn a_walker_is_told_from_the_walls() {
    let scans = walk(100, |i| Some([2.2 - 0.04 * i as f64, 1.5]));
    let [people, rest] = removed(&scans);
    assert!(people > 0.99 && rest < 0.002, "{people} {rest}");
}

/// Whatever comes first: the empty place, or who stood there.
#[test]
fn what_left_and_what_came_are_both_told() {
    for there in [0..40, 60..100] {
        let scans = walk(100, |i| there.contains(&i).then_some([1.8, -1.5]));
        let [people, rest] = removed(&scans);
        assert!(people > 0.99 && rest < 0.002, "{people} {rest}");
    }
}

#[test]
fn what_nearly_always_stood_there_belongs_to_the_map() {
    let scans = walk(100, |i| (i % 10 > 0).then_some([1.8, -1.5]));
    let [people, rest] = removed(&scans);
    assert!(people < 0.02 && rest < 0.002, "{people} {rest}");
}

#[test]
fn one_look_at_a_place_moves_nothing() {
    let scans = walk(1, |_| Some([1.8, -1.5]));
    assert_eq!(removed(&scans), [0.0, 0.0]);
    assert_eq!(removed(&[]), [0.0, 0.0]);
}

/// A laser that sees nothing between its beams says nothing about what is there.
#[test]
fn space_between_beams_is_not_open() {
    let bearings: Vec<f64> = (0..20).map(|i| f64::from(i) * 0.3).collect();
    let far = Scan::from_laser(&bearings, &[4.0; 20], &RangeLimits::default());
    let mut movers = Movers::<2>::new(0.02, [0.0; 2], usize::MAX).unwrap();
    for _ in 0..10 {
        movers.look(&Pose::<2>::IDENTITY, &far).unwrap();
    }
    let near = Scan::from_laser(&bearings, &[2.0; 20], &RangeLimits::default());
    movers.look(&Pose::<2>::IDENTITY, &near).unwrap();
    assert_eq!(movers.split(&Pose::<2>::IDENTITY, near.clone()), (near, vec![]));
}

#[test]
fn what_cannot_be_is_refused() {
    for sigma in [0.0, -0.01, f64::NAN, f64::INFINITY] {
        assert!(Movers::<3>::new(sigma, [0.0; 3], usize::MAX).is_err(), "{sigma}");
    }
    let mut movers = Movers::<2>::new(0.02, [0.0; 2], 1000).unwrap();
    let full = movers.look(&Pose::<2>::IDENTITY, &scan([0.0; 2], None));
    assert!(matches!(full, Err(MapError::Full(_))), "{full:?}");
    // Far from zero cells are counted from nearby.
    let mut far = Movers::<2>::new(0.02, [4.5e6, 3.2e5], usize::MAX).unwrap();
    let pose = Pose::<2>::new(4.5e6, 3.2e5, 0.0);
    for _ in 0..2 {
        far.look(&pose, &scan([0.0; 2], None)).unwrap();
    }
    assert!(far.looks_at([4.5e6 + 1.0, 3.2e5]).is_some_and(|looks| looks.misses == 2 && looks.hits == 0));
}
