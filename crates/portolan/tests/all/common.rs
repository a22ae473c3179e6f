//! The Apartment's log and maps, made once for the tests of a file.

use portolan::geom::{Grid, Pose};
use portolan::map::{BeamSweep, Tsdf2, TsdfConfig};
use portolan::scan::Scan;
use portolan_sim::{Lap, World};
use std::sync::OnceLock;

pub(crate) struct Apartment {
    pub(crate) world: World,
    pub(crate) log: Lap,
}

/// The lap of every figure: 200 scans, seed 0xC0FFEE.
pub(crate) fn apartment() -> &'static Apartment {
    static APARTMENT: OnceLock<Apartment> = OnceLock::new();
    APARTMENT.get_or_init(|| {
        let world = portolan_sim::apartment().world;
        let log = portolan_sim::lap(&world, &Default::default());
        Apartment { world, log }
    })
}

/// The grid of every figure: 240 x 180 cells of 5 cm.
pub(crate) fn grid() -> Grid<2> {
    Grid::new([0.0; 2], 0.05, [240, 180])
}

pub(crate) fn tsdf(sweep: BeamSweep, carve: bool, log: &[(Pose<2>, Scan<2>)]) -> Tsdf2 {
    let config = TsdfConfig { beams: sweep, carve, ..TsdfConfig::textbook() };
    let mut tsdf = Tsdf2::covering(&grid(), config).unwrap();
    for (pose, scan) in log {
        tsdf.integrate(pose, scan).unwrap();
    }
    tsdf
}

/// Points of a low-discrepancy sequence in the Apartment's box.
pub(crate) fn points(n: usize) -> impl Iterator<Item = [f64; 2]> {
    (1..=n).map(|i| {
        let u = |a: f64| (0.5 + i as f64 * a).fract();
        [12.0 * u(0.754_877_666_246_692_7), 9.0 * u(0.569_840_290_998_053_2)]
    })
}

/// Quantile of a list.
pub(crate) fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}
