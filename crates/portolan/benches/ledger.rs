//! Sums beside clamped cells: the same scans into a `Mapper` and a `Ledger`, all maps; parts merged; scans moved.
//!
//! `cargo bench -p portolan --bench ledger`

use divan::Bencher;
use portolan::geom::Pose;
use portolan::map::ScanKind;
use portolan::scan::{Frame, Scan};
use portolan::{Ledger, Mapper, MapperSettings};
use portolan_sim::building::{BuildingConfig, BuildingSensor, DepthCamera, SpinningLidar, building_log};
use std::sync::LazyLock;

fn main() {
    divan::main();
}

type Scans<const D: usize, S> = Vec<(Pose<D>, S)>;

static APARTMENT: LazyLock<Scans<2, Scan<2>>> =
    LazyLock::new(|| portolan_sim::lap(&portolan_sim::apartment().world, &Default::default()).to_vec());
static LIDAR: LazyLock<Scans<3, Frame>> = LazyLock::new(|| {
    let sensor = BuildingSensor::Lidar(SpinningLidar::default());
    building_log(&BuildingConfig { scans: 12, sensor, ..Default::default() }).scans
});
static CAMERA: LazyLock<Scans<3, Frame>> = LazyLock::new(|| {
    let sensor = BuildingSensor::Camera(DepthCamera::default().scaled(0.5));
    building_log(&BuildingConfig { scans: 12, sensor, ..Default::default() }).scans
});

const APARTMENT_CELL: f64 = 0.05;
const LIDAR_CELL: f64 = 0.1;
const CAMERA_CELL: f64 = 0.05;

fn clamped<const D: usize, S: ScanKind<D> + Sync>(scans: &Scans<D, S>, cell: f64) -> Mapper<D> {
    let mut mapper = Mapper::new(cell);
    assert!(mapper.integrate_all(scans, &|| 0.0).iter().all(Result::is_ok));
    mapper
}

fn ledger<const D: usize, S: ScanKind<D> + Sync>(scans: &Scans<D, S>, cell: f64, from: usize) -> Ledger<D> {
    let mut ledger = Ledger::new(MapperSettings::new(cell)).expect("it is possible");
    for (i, (pose, scan)) in scans.iter().enumerate().skip(from) {
        ledger.add("log", i as u64, pose, scan).expect("it fits");
    }
    ledger
}

macro_rules! pairs {
    ($($module:ident: $scans:ident at $cell:ident)*) => {$(
        mod $module {
            use super::*;

            #[divan::bench]
            fn clamped(bencher: Bencher) {
                bencher.bench(|| super::clamped(&$scans, $cell));
            }

            #[divan::bench]
            fn sums(bencher: Bencher) {
                bencher.bench(|| super::ledger(&$scans, $cell, 0));
            }

            /// The second half of the scans into the first.
            #[divan::bench]
            fn merge(bencher: Bencher) {
                let half = super::ledger(&$scans, $cell, $scans.len() / 2);
                let first: Scans<_, _> = $scans[..$scans.len() / 2].to_vec();
                let first = super::ledger(&first, $cell, 0);
                bencher.with_inputs(|| first.clone()).bench_values(|mut sum| {
                    sum.merge(&half).expect("they fit");
                    sum
                });
            }

            /// Every third scan moved by 10 cm.
            #[divan::bench]
            fn repose(bencher: Bencher) {
                let whole = super::ledger(&$scans, $cell, 0);
                bencher.with_inputs(|| whole.clone()).bench_values(|mut ledger| {
                    for (i, (pose, scan)) in $scans.iter().enumerate().step_by(3) {
                        let mut pose = *pose;
                        pose.translation[0] += 0.1;
                        ledger.repose("log", i as u64, &pose, scan).expect("it is there");
                    }
                    ledger
                });
            }

            /// A third of the scans alone, for [`repose`].
            #[divan::bench]
            fn add_a_third(bencher: Bencher) {
                let whole = super::ledger(&$scans, $cell, 0);
                bencher.with_inputs(|| whole.clone()).bench_values(|mut ledger| {
                    for (i, (pose, scan)) in $scans.iter().enumerate().step_by(3) {
                        ledger.add("again", i as u64, pose, scan).expect("it fits");
                    }
                    ledger
                });
            }

            /// The clamped maps that follow from the sums.
            #[divan::bench]
            fn estimates(bencher: Bencher) {
                let whole = super::ledger(&$scans, $cell, 0);
                bencher.bench(|| whole.mapper().expect("it fits"));
            }
        }
    )*};
}

pairs! {
    lidar_2d: APARTMENT at APARTMENT_CELL
    lidar_3d: LIDAR at LIDAR_CELL
    camera_3d: CAMERA at CAMERA_CELL
}
