//! What a log says of the error of its surface by itself, against the true walls: poses off by 2 cm, the same for all scans of a visit.

use portolan::cell::DistanceSum;
use portolan::geom::Pose;
use portolan::store::Bricks;
use portolan::uncertainty::{SurfaceSigma, displacements};
use portolan::{Ledger, MapperSettings};
use portolan_sim::Random;
use portolan_sim::building::{BuildingConfig, BuildingSensor, SpinningLidar, building_log};

use super::vertices;

const SCANS: usize = 100;
const POSE_SIGMA: f64 = 0.02;
/// The way through the building is gone so often, with errors of their own every few scans.
const LAPS: usize = 5;
/// Scans with one error.
const TOGETHER: usize = 4;

/// Share of what is within 1.96 standard deviations of zero, by quarters of the deviation.
fn quarters(mut all: Vec<[f64; 2]>) -> [f64; 4] {
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    std::array::from_fn(|k| {
        let part = &all[all.len() * k / 4..all.len() * (k + 1) / 4];
        part.iter().filter(|[sigma, error]| error.abs() <= 1.96 * sigma).count() as f64 / part.len() as f64
    })
}

/// Nothing but the log tells how far its surface is off: from its beginning and its end a standard deviation is fitted, and it must
/// cover the true walls, which the fit has never seen.
#[test]
fn the_standard_deviation_of_a_log_covers_the_true_walls() {
    let lidar = SpinningLidar { rings: 32, columns: 256, ..SpinningLidar::default() };
    let config = BuildingConfig { scans: SCANS, sensor: BuildingSensor::Lidar(lidar), ..Default::default() };
    let lap = building_log(&config);
    let settings = MapperSettings {
        occupancy: None,
        attenuation: None,
        origin: Some([0.0; 3]),
        ..MapperSettings::<3>::new(0.05)
    };
    let mut ledger = Ledger::new(settings).unwrap();
    let mut random = Random::stream(5, 2);
    let (mut parts, mut off): (Vec<Bricks<DistanceSum, 3>>, [f64; 3]) = (Vec::new(), [0.0; 3]);
    for i in 0..SCANS {
        if i % TOGETHER == 0 {
            off = std::array::from_fn(|_| POSE_SIGMA * random.normal());
        }
        // Every lap sees the building from other places.
        let (pose, frame) = &lap.scans[i % (SCANS / LAPS) * LAPS + i / (SCANS / LAPS)];
        let translation = std::array::from_fn(|k| pose.translation[k] + off[k]);
        ledger.add("log", i as u64, &Pose { translation, ..*pose }, frame).unwrap();
        if [2, 3].map(|fifths| fifths * SCANS / 5).contains(&(i + 1)) {
            parts.extend(ledger.distance_sums().cloned());
        }
    }
    let whole = ledger.distance_sums().unwrap();
    let found = displacements([&parts[0], &parts[1], whole], ledger.settings().truncation());
    let sigma = SurfaceSigma::fitted(found.iter().filter(|d| d.fitted).copied()).unwrap();
    let mapper = ledger.mapper().unwrap();
    let map = mapper.tsdf().unwrap();
    let errors: Vec<[f64; 2]> = vertices(map)
        .into_iter()
        .filter_map(|p| {
            Some([sigma.of_distance(map.store(), p, 0.0, [0.0; 3])?, lap.world.signed_distance(p)])
        })
        .collect();
    let count = errors.len();
    let [low, high] = [sigma.of(1e9), sigma.of(1.0)].map(|sigma| 1e3 * sigma);
    let covered = quarters(errors);
    println!(
        "{} displacements, {low:.1} to {high:.1} mm; of {count} vertices within 95 % of the true walls, by quarters: {covered:?}",
        found.len()
    );
    assert!(count > 10_000);
    assert!(covered.iter().all(|share| (0.9..=1.0).contains(share)), "{covered:?}");
}
