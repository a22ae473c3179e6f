//! What the optimizer promises apart from a good minimum.

#![allow(clippy::unwrap_used, reason = "helpers of tests are tests too")]

mod common;

use common::{laps, pose, position_error};
use portolan::geom::Pose;
use portolan_graph::{
    Chain, Edge, EdgeKind, GraphError, Information, Kernel, PoseGraph, Settings, Stop, read_g2o,
};

fn edge(i: u64, j: u64, i_from_j: Pose<2>, sigma: f64) -> Edge<2> {
    let information = Information::from_sigmas(sigma, sigma).unwrap();
    Edge { i, j, i_from_j, information, kind: EdgeKind::Closure }
}

#[test]
fn noise_averages_out() {
    fn check<const D: usize>() {
        let mut laps = laps::<D>(7, 0, 1.0);
        let (before, _) = position_error(&laps.graph, &laps.truth);
        let report = laps.graph.optimize(&Settings::default()).unwrap();
        let (after, _) = position_error(&laps.graph, &laps.truth);
        assert!(after < 0.5 * before, "D {D}: {before} to {after}");
        // Chi-square of a right model: degrees of freedom, +- 6 deviations.
        let n = (D * (D + 1) / 2) as f64;
        let freedom = n * (laps.graph.edges().len() - laps.graph.vertices().len() + 1) as f64;
        let last = report.chi_square.last().unwrap();
        let plane_noise = if D == 2 { 1.0 } else { 0.9 }; // no roll noise in 3-D
        assert!((last - freedom * plane_noise).abs() < 0.15 * freedom, "D {D}: {last} for {freedom}");
        assert!(report.cost.windows(2).all(|w| w[1] <= w[0]));
    }
    check::<2>();
    check::<3>();
}

#[test]
fn parts_are_held_and_said_or_refused() {
    let mut graph = PoseGraph::<2>::new();
    for id in [10, 11, 20, 21, 30] {
        graph.add_vertex(id, Pose::<2>::new(id as f64, 0.0, 0.0)).unwrap();
    }
    graph.add_edge(edge(10, 11, Pose::<2>::new(2.0, 0.0, 0.0), 1.0)).unwrap();
    graph.add_edge(edge(21, 20, Pose::<2>::new(0.0, 3.0, 1.0), 1.0)).unwrap();
    graph.set_fixed(21, true).unwrap();
    let strict = Settings { require_connected: true, ..Settings::default() };
    assert_eq!(graph.clone().optimize(&strict), Err(GraphError::Disconnected { components: 3 }));
    let report = graph.optimize(&Settings::default()).unwrap();
    assert_eq!((report.components, &report.held[..]), (3, &[10, 30][..]));
    assert!((graph.pose(11).unwrap().translation[0] - 12.0).abs() < 1e-9);
    assert!((graph.pose(20).unwrap().translation[1] - 3.0).abs() < 1e-9);
    assert_eq!(graph.pose(21).unwrap().translation, [21.0, 0.0]);
}

#[test]
fn nothing_to_move_is_not_an_error() {
    let mut graph = PoseGraph::<3>::new();
    assert_eq!(graph.optimize(&Settings::default()).unwrap().stop, Stop::NothingToMove);
    graph.add_vertex(1, Pose::IDENTITY).unwrap();
    graph.start_from_tree(Chain::Odometry);
    graph.start_from_chordal().unwrap();
    let report = graph.optimize(&Settings::default()).unwrap();
    assert_eq!((report.stop, report.chi_square), (Stop::NothingToMove, vec![0.0]));
}

#[test]
fn overflow_and_absurd_scales_are_errors_or_finite() {
    let mut graph = PoseGraph::<2>::new();
    graph.add_vertex(0, Pose::IDENTITY).unwrap();
    graph.add_vertex(1, Pose::<2>::new(1e200, 0.0, 0.0)).unwrap();
    graph.add_edge(edge(0, 1, Pose::IDENTITY, 1e-3)).unwrap();
    let before = graph.clone();
    assert_eq!(graph.optimize(&Settings::default()), Err(GraphError::NotFinite));
    assert_eq!(graph.vertices(), before.vertices());

    let text = "EDGE_SE2 0 1 1e150 0 3 1e-300 0 0 1e300 0 1\nEDGE_SE2 1 2 1 1 1 1e300 0 0 1e300 0 1e300\n\
                EDGE_SE2 2 0 1 1 1 1e-300 0 0 1e-300 0 1e-300\n";
    let portolan_graph::AnyGraph::Se2(graph) = read_g2o(text.as_bytes(), "absurd").unwrap().graph else {
        panic!("not 2-D")
    };
    for chordal in [false, true] {
        let mut graph = graph.clone();
        if chordal {
            let _ = graph.start_from_chordal();
        }
        let _ = graph.optimize(&Settings::default());
        assert!(graph.vertices().iter().all(|v| v.world_from_vertex.is_rigid()));
    }
}

#[test]
fn a_singular_system_is_an_error() {
    let mut graph = PoseGraph::<2>::new();
    for id in 0..3 {
        graph.add_vertex(id, Pose::<2>::new(id as f64, 0.3, 0.1)).unwrap();
    }
    // The weak edge is lost in the rounding of the strong one.
    graph.add_edge(edge(0, 1, Pose::IDENTITY, 1e100)).unwrap();
    graph.add_edge(edge(1, 2, Pose::IDENTITY, 1e-100)).unwrap();
    let before = graph.clone();
    assert_eq!(graph.start_from_chordal(), Err(GraphError::Singular { iteration: 0 }));
    assert_eq!(graph.vertices(), before.vertices());
    // Damping makes it solvable: the strong edge holds.
    graph.optimize(&Settings::default()).unwrap();
    let (one, two) = (graph.pose(1).unwrap(), graph.pose(2).unwrap());
    assert!(one.translation_to(two) < 1e-12);
}

#[test]
fn settings_are_checked() {
    let mut graph = laps::<2>(1, 0, 1.0).graph;
    let refused = |settings: Settings, graph: &mut PoseGraph<2>| match graph.optimize(&settings) {
        Err(GraphError::Setting { name, .. }) => Some(name),
        _ => None,
    };
    let fine = Settings { max_iterations: 1, ..Settings::default() };
    assert_eq!(refused(Settings { kernel: Kernel::Dcs(-1.0), ..fine }, &mut graph), Some("kernel"));
    assert_eq!(refused(Settings { damping: f64::NAN, ..fine }, &mut graph), Some("damping"));
    assert_eq!(refused(Settings { relative_tolerance: 1.0, ..fine }, &mut graph), Some("relative_tolerance"));
    let report = graph.optimize(&fine).unwrap();
    assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, 1));
}

/// Moving the whole graph moves the answer with it: nothing depends on where the world's zero is.
#[test]
fn a_rigid_motion_commutes_with_the_optimiser() {
    fn check<const D: usize>(far: f64) {
        let here = laps::<D>(3, 0, 1.0);
        let motion = pose::<D>([5e5 * far, 4e6 * far, 1e3 * far], 2.0, 0.7);
        let mut there = here.graph.clone();
        for vertex in here.graph.vertices() {
            there.set_pose(vertex.id, motion * vertex.world_from_vertex).unwrap();
        }
        let mut here = here.graph;
        here.optimize(&Settings::default()).unwrap();
        there.optimize(&Settings::default()).unwrap();
        for (a, b) in here.vertices().iter().zip(there.vertices()) {
            let off = (motion * a.world_from_vertex).translation_to(&b.world_from_vertex);
            // Doubles at 4e6 m are 5e-10 m apart; chained over 240 poses.
            assert!(off < 1e-6 * (1.0 + far), "D {D}: {off}");
        }
    }
    check::<2>(0.0);
    check::<3>(0.0);
    check::<2>(1.0);
    check::<3>(1.0);
}

#[test]
fn chordal_solves_a_graph_without_noise_exactly() {
    fn check<const D: usize>() {
        let laps = laps::<D>(9, 0, 1.0);
        let mut graph = PoseGraph::<D>::new();
        for k in 0..laps.truth.len() {
            graph.add_vertex(k as u64, Pose::IDENTITY).unwrap();
        }
        graph.set_pose(0, laps.truth[0]).unwrap();
        for edge in laps.graph.edges() {
            let i_from_j = laps.truth[edge.i as usize].inverse() * laps.truth[edge.j as usize];
            graph.add_edge(Edge { i_from_j, ..*edge }).unwrap();
        }
        let mut tree = graph.clone();
        tree.start_from_tree(Chain::Shortest);
        assert!(position_error(&tree, &laps.truth).1 < 1e-12);
        graph.start_from_chordal().unwrap();
        assert!(position_error(&graph, &laps.truth).1 < 1e-10);
        assert!(graph.chi_square() < 1e-12);
    }
    check::<2>();
    check::<3>();
}
