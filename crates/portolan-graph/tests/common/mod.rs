//! Laps with noise, for tests.

#![allow(dead_code, reason = "each test binary uses its part")]

use portolan::geom::Pose;
use portolan_graph::{Edge, EdgeKind, Information, PoseGraph};

/// Numbers from a seed (SplitMix64).
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Mean 0, deviation `sigma`: the sum of twelve uniform numbers, near enough for a test.
    pub(crate) fn normal(&mut self, sigma: f64) -> f64 {
        sigma * ((0..12).map(|_| self.uniform(0.0, 1.0)).sum::<f64>() - 6.0)
    }
}

/// A pose from a position, a heading, and in 3-D a pitch.
pub(crate) fn pose<const D: usize>(position: [f64; 3], heading: f64, pitch: f64) -> Pose<D> {
    let mut out = Pose::<D>::IDENTITY;
    out.translation.copy_from_slice(&position[..D]);
    if D == 2 {
        let flat = Pose::<2>::new(0.0, 0.0, heading);
        for r in 0..2 {
            out.rotation[r][..2].copy_from_slice(&flat.rotation[r]);
        }
    } else {
        let turn = |axis: usize, angle: f64| {
            let mut q = [0.0, 0.0, 0.0, (0.5 * angle).cos()];
            q[axis] = (0.5 * angle).sin();
            Pose::<3>::from_quaternion([0.0; 3], q).unwrap()
        };
        let both = turn(2, heading) * turn(1, pitch);
        for r in 0..3 {
            out.rotation[r][..3].copy_from_slice(&both.rotation[r]);
        }
    }
    out
}

pub(crate) struct Laps<const D: usize> {
    pub(crate) graph: PoseGraph<D>,
    pub(crate) truth: Vec<Pose<D>>,
    pub(crate) false_closures: Vec<bool>,
}

/// Four laps of 60 poses on an oval of 16 x 8 m (in 3-D one that climbs and dips). Each place is joined with
/// the same place of the next lap; `wrong` of every ten closures are false: random places, random poses.
/// Noise: 1 cm and 2 mrad; `slip` times that for odometry. The initial poses are those of odometry.
pub(crate) fn laps<const D: usize>(seed: u64, wrong: usize, slip: f64) -> Laps<D> {
    const LAP: usize = 60;
    let mut draw = Draw(seed);
    let truth: Vec<Pose<D>> = (0..4 * LAP)
        .map(|k| {
            let a = std::f64::consts::TAU * k as f64 / LAP as f64;
            let position = [8.0 * a.sin(), -4.0 * a.cos(), (2.0 * a).sin()];
            pose(position, (4.0 * a.sin()).atan2(8.0 * a.cos()), 0.2 * a.cos())
        })
        .collect();
    let mut graph = PoseGraph::new();
    let measured = |i: usize, j: usize, draw: &mut Draw, slip: f64| {
        let noise = pose(
            std::array::from_fn(|_| draw.normal(0.01 * slip)),
            draw.normal(0.002 * slip),
            draw.normal(0.002 * slip),
        );
        truth[i].inverse() * truth[j] * noise
    };
    let mut edges = Vec::new();
    let mut guess = truth[0];
    graph.add_vertex(0, guess).unwrap();
    for k in 1..truth.len() {
        let step = measured(k - 1, k, &mut draw, slip);
        guess = guess * step;
        graph.add_vertex(k as u64, guess).unwrap();
        edges.push((k - 1, k, step, EdgeKind::Odometry, false));
    }
    for i in 0..truth.len() - LAP {
        let bad = i % 10 < wrong;
        let (from, to, z) = if bad {
            let from = draw.uniform(0.0, 100.0) as usize;
            let to = 120 + draw.uniform(0.0, 100.0) as usize;
            let at = std::array::from_fn(|_| draw.uniform(-2.0, 2.0));
            (from, to, pose(at, draw.uniform(-3.1, 3.1), draw.uniform(-0.5, 0.5)))
        } else {
            (i, i + LAP, measured(i, i + LAP, &mut draw, 1.0))
        };
        edges.push((from, to, z, EdgeKind::Closure, bad));
    }
    let mut false_closures = Vec::new();
    for (i, j, i_from_j, kind, bad) in edges {
        let slip = if kind == EdgeKind::Odometry { slip } else { 1.0 };
        let information = Information::from_sigmas(0.01 * slip, 0.002 * slip).unwrap();
        graph.add_edge(Edge { i: i as u64, j: j as u64, i_from_j, information, kind }).unwrap();
        false_closures.push(bad);
    }
    Laps { graph, truth, false_closures }
}

/// Mean and largest distance of the positions from the truth (meters).
pub(crate) fn position_error<const D: usize>(graph: &PoseGraph<D>, truth: &[Pose<D>]) -> (f64, f64) {
    let errors: Vec<f64> =
        graph.vertices().iter().zip(truth).map(|(v, t)| v.world_from_vertex.translation_to(t)).collect();
    (errors.iter().sum::<f64>() / errors.len() as f64, errors.iter().copied().fold(0.0, f64::max))
}
