//! One closure in ten is false: with a kernel the truth comes out, without it does not.

#![allow(clippy::unwrap_used, reason = "helpers of tests are tests too")]

mod common;

use common::{laps, position_error};
use portolan_graph::{Approach, Kernel, Settings};

fn recovers<const D: usize>() {
    for seed in [1, 2, 3] {
        let laps = laps::<D>(seed, 1, 1.0);
        let mut plain = laps.graph.clone();
        plain.optimize(&Settings::default()).unwrap();
        let (mean, _) = position_error(&plain, &laps.truth);
        assert!(mean > 0.3, "seed {seed}: least squares is misled, mean error {mean}");

        // 99 % of good edges have a smaller chi-square than k² (3 and 6 degrees of freedom).
        let k = if D == 2 { 3.4 } else { 4.1 };
        for kernel in [Kernel::Cauchy(k), Kernel::Dcs(k), Kernel::GemanMcClure(k)] {
            let mut graph = laps.graph.clone();
            let settings = Settings { kernel, ..Settings::default() };
            graph.optimize(&settings).unwrap();
            let (mean, worst) = position_error(&graph, &laps.truth);
            assert!(mean < 0.05 && worst < 0.12, "D {D} seed {seed} {kernel:?}: mean {mean}, worst {worst}");

            // And the false ones are known by their weights.
            for (s, bad) in graph.edge_chi_squares().iter().zip(&laps.false_closures) {
                assert_eq!(kernel.cost_and_weight(*s).1 < 0.05, *bad, "D {D} {kernel:?}: chi-square {s}");
            }
        }
    }
}

#[test]
fn in_the_plane() {
    recovers::<2>();
}

#[test]
fn in_space() {
    recovers::<3>();
}

#[test]
fn without_false_closures_a_kernel_costs_little() {
    let laps = laps::<2>(4, 0, 1.0);
    let (mut plain, mut robust) = (laps.graph.clone(), laps.graph.clone());
    plain.optimize(&Settings::default()).unwrap();
    let kernel = Kernel::Dcs(3.4);
    robust.optimize(&Settings { kernel, ..Settings::default() }).unwrap();
    let apart = plain.vertices().iter().zip(robust.vertices());
    let apart = apart.map(|(a, b)| a.world_from_vertex.translation_to(&b.world_from_vertex));
    assert!(apart.fold(0.0, f64::max) < 0.01);
}

#[test]
fn huber_halves_the_harm_at_least() {
    let laps = laps::<2>(5, 1, 1.0);
    let (mut plain, mut huber) = (laps.graph.clone(), laps.graph.clone());
    plain.optimize(&Settings::default()).unwrap();
    huber.optimize(&Settings { kernel: Kernel::Huber(3.4), ..Settings::default() }).unwrap();
    let errors = [&plain, &huber].map(|graph| position_error(graph, &laps.truth).0);
    assert!(errors[1] < 0.5 * errors[0], "{errors:?}");
}

/// Odometry six times worse: from there a bounded kernel takes true closures for false ones, unless it starts wide.
#[test]
fn both_approaches_together_are_as_good_as_the_better_one() {
    let laps = laps::<2>(0, 1, 6.0);
    let kernel = Kernel::GemanMcClure(3.4);
    let [direct, graduated, better] =
        [Approach::Direct, Approach::Graduated, Approach::Better].map(|approach| {
            let mut graph = laps.graph.clone();
            let report = graph.optimize(&Settings { kernel, approach, ..Settings::default() }).unwrap();
            assert_eq!(*report.chi_square.last().unwrap(), graph.chi_square());
            (*report.cost.last().unwrap(), position_error(&graph, &laps.truth).0)
        });
    assert!(direct.1 > 1.0, "{direct:?}");
    assert!(graduated.1 < 0.3, "{graduated:?}");
    assert_eq!(better, graduated);
    assert!(graduated.0 < direct.0);
}
