//! The tree against frames whose motion is known, and what is told of trees that contradict themselves.

use portolan::geom::vector::distance;
use portolan::geom::{NoPose, Pose};
use proptest::prelude::*;

use super::{FrameTree, FrameTreeBuilder, NoTransform};
use crate::message::{Header, RawTransform, StampedTransform};

const SECOND: i64 = 1_000_000_000;

fn stamped(parent: &str, child: &str, seconds: f64, raw: RawTransform) -> StampedTransform {
    let header = Header { stamp: (seconds * 1e9).round() as i64, frame: parent.into() };
    StampedTransform { header, child: child.into(), transform: raw }
}

fn at_x(x: f64) -> RawTransform {
    RawTransform { translation: [x, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] }
}

/// `parent > child`, static or not, `(seconds, x)`.
type Row<'a> = (&'a str, &'a str, bool, &'a [(f64, f64)]);

fn tree_of(edges: &[Row<'_>]) -> FrameTree {
    let mut builder = FrameTreeBuilder::default();
    for (parent, child, is_static, poses) in edges {
        for (time, x) in *poses {
            builder.add(&stamped(parent, child, *time, at_x(*x)), *is_static, "/tf");
        }
    }
    builder.finish().unwrap()
}

type Matrix = [[f64; 4]; 4];

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The matrix exponential of a twist times `t`: by its series, of a small part that is squared again and again.
fn exponential(omega: [f64; 3], velocity: [f64; 3], t: f64) -> Matrix {
    let s = t / 1024.0;
    let [x, y, z] = omega.map(|v| v * s);
    let [u, v, w] = velocity.map(|v| v * s);
    let generator = [[0.0, -z, y, u], [z, 0.0, -x, v], [-y, x, 0.0, w], [0.0; 4]];
    let mut all: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let mut term = all;
    for k in 1..12 {
        term = multiply(&term, &generator).map(|row| row.map(|v| v / f64::from(k)));
        all = std::array::from_fn(|i| std::array::from_fn(|j| all[i][j] + term[i][j]));
    }
    (0..10).for_each(|_| all = multiply(&all, &all));
    all
}

fn raw_of(m: &Matrix) -> RawTransform {
    // Not Shepperd's way: the test keeps rotations below half a turn.
    let w = (1.0 + m[0][0] + m[1][1] + m[2][2]).max(0.0).sqrt() / 2.0;
    let q = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]].map(|v| v / (4.0 * w));
    RawTransform { translation: [m[0][3], m[1][3], m[2][3]], quaternion: [q[0], q[1], q[2], w] }
}

proptest! {
    /// A random tree, whose edges rest or move at constant twist, against products of matrices along the way that a search over
    /// all edges finds.
    #[test]
    fn the_pose_of_any_frame_in_any_other(
        parents in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 1..7),
        twists in prop::collection::vec((prop::array::uniform3(-0.4..0.4f64), prop::array::uniform3(-3.0..3.0f64)), 7),
        time in 0.0..2.0f64, target in 0..8usize, source in 0..8usize, slash in any::<bool>(),
    ) {
        let n = parents.len() + 1;
        let (target, source) = (target % n, source % n);
        let name = |i: usize| format!("f{i}");
        let mut builder = FrameTreeBuilder::default();
        let mut edges = Vec::new();
        for (i, (parent, moves)) in parents.iter().enumerate() {
            let (child, parent) = (i + 1, parent.index(i + 1));
            let (omega, velocity) = twists[i];
            let pose = move |t: f64| exponential(omega, velocity, if *moves { t } else { 1.0 });
            for k in 0..21 {
                if *moves || k == 20 {
                    let t = 0.1 * f64::from(k);
                    // Static ones may come last, and with any stamp.
                    let stamp = if *moves { t } else { 1e6 };
                    let parent_name = if slash { format!("/{}", name(parent)) } else { name(parent) };
                    let parent_name = crate::message::frame_name(&parent_name).to_owned();
                    builder.add(&stamped(&parent_name, &name(child), stamp, raw_of(&pose(t))), !moves, "/tf");
                }
            }
            edges.push((parent, child, pose(time)));
        }
        let tree = builder.finish().unwrap();
        prop_assert_eq!(tree.roots(), ["f0"]);
        let found = tree.lookup(&name(target), &name(source), (time * 1e9).round() as i64, 0.0).unwrap();
        // Depth first over edges in both directions, carrying a point of the source.
        let p = [0.3, -1.2, 2.0];
        let mut stack = vec![(source, [p[0], p[1], p[2], 1.0], usize::MAX)];
        let mut expected = None;
        while let Some((at, point, from)) = stack.pop() {
            if at == target {
                expected = Some(point);
            }
            for (parent, child, m) in &edges {
                if *child == at && *parent != from {
                    stack.push((*parent, std::array::from_fn(|i| (0..4).map(|k| m[i][k] * point[k]).sum()), at));
                } else if *parent == at && *child != from {
                    let d: [f64; 3] = std::array::from_fn(|i| point[i] - m[i][3]);
                    let back: [f64; 3] = std::array::from_fn(|j| (0..3).map(|i| m[i][j] * d[i]).sum());
                    stack.push((*child, [back[0], back[1], back[2], 1.0], at));
                }
            }
        }
        let expected = expected.unwrap();
        let apart = distance(found.transform_point(p), [expected[0], expected[1], expected[2]]);
        // The stamp is rounded to nanoseconds; motion is at most some 5 m/s times six edges.
        prop_assert!(apart < 1e-7, "{} m", apart);
    }
}

#[test]
fn refusals_name_the_edge_and_the_gap() {
    let tree = tree_of(&[
        ("map", "odom", true, &[(9e9, 1.0)]),
        ("odom", "base", false, &[(0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (5.0, 5.0), (5.1, 5.1)]),
        ("base", "laser", true, &[(0.0, 0.5)]),
        ("other", "lonely", true, &[(0.0, 0.5)]),
    ]);
    let at = |t: f64, tolerance: f64| tree.lookup("map", "laser", (t * 1e9) as i64, tolerance);
    assert!((at(0.15, 0.0).unwrap().translation[0] - 1.65).abs() < 1e-9);
    assert!((at(-0.015, 0.02).unwrap().translation[0] - 1.485).abs() < 1e-9);
    let refused = |r: Result<Pose<3>, NoTransform>| r.unwrap_err().to_string();
    assert_eq!(refused(at(-0.03, 0.02)), "transform odom > base: it is 0.030 s before the first pose");
    assert_eq!(refused(at(5.5, 0.02)), "transform odom > base: it is 0.400 s after the last pose");
    assert_eq!(refused(at(3.0, 0.02)), "transform odom > base: the poses around it are 4.800 s apart");
    assert!(matches!(at(3.0, 0.02), Err(NoTransform::Time { cause: NoPose::Gap(_), .. })));
    assert_eq!(refused(tree.lookup("map", "lidar", 0, 0.0)), "no transform names the frame lidar");
    assert_eq!(
        refused(tree.lookup("map", "lonely", 0, 0.0)),
        "no chain of transforms leads from lonely to map"
    );
    assert_eq!(tree.lookup("x", "x", 0, 0.0), Ok(Pose::IDENTITY));
    assert!(tree.notes().iter().any(|n| n.contains("2 roots: map, other")), "{:?}", tree.notes());
    assert_eq!((tree.root_of("laser"), tree.chain("laser").len()), ("map", 3));
}

#[test]
fn what_contradicts_itself_is_told() {
    let notes = |edges: &[Row<'_>]| tree_of(edges).notes().join("\n");
    let said = |notes: String, part: &str| assert!(notes.contains(part), "{notes:?} without {part:?}");
    let way: &[(f64, f64)] = &[(0.0, 0.0), (0.1, 0.1), (0.2, 0.2)];
    assert_eq!(notes(&[("map", "base", false, way)]), "");
    said(
        notes(&[("map", "base", false, way), ("odom", "base", false, way)]),
        "base: it has 2 parents (map, odom)",
    );
    said(
        notes(&[("a", "b", true, &[(0.0, 1.0), (1.0, 1.5)])]),
        "a > b: static transforms that differ by up to 0.5000",
    );
    said(
        notes(&[("a", "b", true, &[(0.0, 1.0)]), ("a", "b", false, way)]),
        "a > b: it is both static and moving",
    );
    said(
        notes(&[("a", "b", false, &[(1.0, 0.0), (2.0, 0.0), (0.5, 0.0)])]),
        "stamps go back 1 times, by up to 1.500 s",
    );
    said(
        notes(&[("a", "b", false, &[(1.0, 0.0), (1.0, 0.25), (2.0, 0.0)])]),
        "1 times there are two poses of one stamp that differ, by up to 0.250",
    );
    let both: Vec<(f64, f64)> =
        (0..40).map(|k| (0.01 * f64::from(k), if k % 2 == 0 { 0.0 } else { 0.4 })).collect();
    said(notes(&[("a", "b", false, &both)]), "a > b: poses jump to and fro by 0.40 m");
    let mut builder = FrameTreeBuilder::default();
    let turn = |q: [f64; 4]| RawTransform { translation: [0.0; 3], quaternion: q };
    for (q, x) in [
        ([0.0; 4], 0.0),
        ([f64::NAN, 0.0, 0.0, 1.0], 0.0),
        ([0.0, 0.0, 0.0, 2.0], 0.0),
        ([0.0, 0.0, 0.0, 1.0], f64::INFINITY),
    ] {
        let raw = RawTransform { translation: [x, 0.0, 0.0], ..turn(q) };
        builder.add(&stamped("a", "b", 1.0, raw), false, "/tf");
        builder.add(&stamped("a", "c", 1.0, raw), true, "/tf_static");
    }
    builder.add(&stamped("a", "a", 1.0, at_x(0.0)), false, "/tf");
    builder.add(&stamped("a", "c", 1.0, at_x(0.0)), true, "/tf by other");
    let tree = builder.finish().unwrap();
    let notes = tree.notes().join("\n");
    for part in [
        "a > b: 3 poses refused",
        "a > b: 1 quaternions were not of length 1",
        "a > c: 3 static transforms refused",
        "a > c: 1 quaternions were not of length 1",
        "a > c: several publishers: /tf by other, /tf_static",
        "1 transforms of a frame in itself",
    ] {
        assert!(notes.contains(part), "{notes}: {part}");
    }
    // Two ways up: that to the frame which was asked for.
    let two = tree_of(&[("map", "base", true, &[(0.0, 1.0)]), ("odom", "base", true, &[(0.0, 2.0)])]);
    assert_eq!(two.lookup("odom", "base", 0, 0.0).unwrap().translation[0], 2.0);
    assert_eq!(two.lookup("map", "base", 0, 0.0).unwrap().translation[0], 1.0);
}

#[test]
fn circles_are_refused() {
    let mut builder = FrameTreeBuilder::default();
    for (parent, child) in [("map", "odom"), ("odom", "base"), ("base", "odom"), ("base", "laser")] {
        builder.add(&stamped(parent, child, 0.0, at_x(1.0)), false, "/tf");
    }
    let error = builder.finish().unwrap_err().to_string();
    assert!(error.contains("a frame's parent is its own child:") && error.contains("base > odom"), "{error}");
}

#[test]
fn a_frame_that_rests_needs_no_transforms_in_between() {
    let tree = tree_of(&[("map", "odom", false, &[(0.0, 2.0), (60.0, 2.0)])]);
    assert_eq!(tree.lookup("map", "odom", 30 * SECOND, 0.0).unwrap().translation[0], 2.0);
    let one = tree_of(&[("map", "odom", false, &[(1.0, 2.0)])]);
    assert_eq!(one.lookup("map", "odom", SECOND + 10_000_000, 0.02).unwrap().translation[0], 2.0);
    assert!(one.lookup("map", "odom", SECOND + 30_000_000, 0.02).is_err());
    // Slow transforms are interpolated by their own pace, lost ones are not.
    let slow: Vec<(f64, f64)> = (0..10).map(|k| (f64::from(k), f64::from(k))).collect();
    let tree = tree_of(&[("map", "odom", false, &slow)]);
    assert!((tree.lookup("map", "odom", 2_500_000_000, 0.0).unwrap().translation[0] - 2.5).abs() < 1e-9);
}
