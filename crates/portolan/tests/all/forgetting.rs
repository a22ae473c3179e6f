//! A wall that has gone fades in the number of looks that was asked for, whatever they weigh, in 2-D and 3-D.

use portolan::cell::TsdfRule;
use portolan::geom::{Aabb, Grid, Pose};
use portolan::map::{BeamSweep, Tsdf2, Tsdf3, TsdfConfig};
use portolan::scan::{Frame, PointScan, RangeLimits, Scan};
use portolan::store::Store;
use portolan::surface::{ContourSettings, MeshSettings, marching_cubes, marching_squares};
use portolan::sweep::WeightModel;

const R: f64 = 0.1;
const HALF_LIFE: f64 = 10.0;
/// The next wall behind one (meters).
const BEHIND: f64 = 4.0;

/// A map of a wall across the x axis, seen from the origin.
trait Corridor<const D: usize>: Sized {
    fn new(config: TsdfConfig<D>) -> Self;

    /// One look along these tangents, in each direction across the axis, at a wall.
    fn see(&mut self, tangents: &[f64], wall: f64);

    /// `D` of the cell behind the place of a wall.
    fn behind(&self, wall: f64) -> f64;

    /// Whether the surface passes there.
    fn has_surface(&self, wall: f64) -> bool;
}

/// Beams that meet every cell within 25 cm of the axis at a wall, and those behind it at the next one.
fn tangents(wall: f64) -> Vec<f64> {
    let (step, most) = (0.6 * R / (wall + BEHIND), 0.25 / wall);
    let side = (most / step).ceil() as i32;
    (-side..=side).map(|i| step * f64::from(i)).collect()
}

fn any_near<const D: usize>(vertices: &[[f64; D]], wall: f64) -> bool {
    vertices.iter().any(|v| (v[0] - wall).abs() < 0.25)
}

impl Corridor<2> for Tsdf2 {
    fn new(config: TsdfConfig<2>) -> Self {
        Self::covering(&Grid::new([-0.5, -0.5], R, [205, 10]), config).unwrap()
    }

    fn see(&mut self, tangents: &[f64], wall: f64) {
        let bearings: Vec<f64> = tangents.iter().map(|t| t.atan()).collect();
        let ranges: Vec<f64> = bearings.iter().map(|b| wall / b.cos()).collect();
        self.integrate(&Pose::IDENTITY, &Scan::from_laser(&bearings, &ranges, &RangeLimits::default()))
            .unwrap();
    }

    fn behind(&self, wall: f64) -> f64 {
        let cell = self.grid().index_of([wall + 0.5 * R, 0.01]).unwrap();
        self.store().at(cell).unwrap().distance.into()
    }

    fn has_surface(&self, wall: f64) -> bool {
        any_near(&marching_squares(self, &ContourSettings::default()).vertices, wall)
    }
}

impl Corridor<3> for Tsdf3 {
    fn new(config: TsdfConfig<3>) -> Self {
        let mut map = Self::new(config).unwrap();
        map.set_bounds(Some(Aabb::new([-0.5; 3], [20.0, 0.5, 0.5])));
        map
    }

    fn see(&mut self, tangents: &[f64], wall: f64) {
        let at = |t: f64| (wall * t) as f32;
        let points =
            tangents.iter().flat_map(|&y| tangents.iter().map(move |&z| [wall as f32, at(y), at(z)]));
        self.integrate(&Pose::IDENTITY, &Frame::Points(PointScan::new(points, [0.0; 3]))).unwrap();
    }

    fn behind(&self, wall: f64) -> f64 {
        let cell = self.lattice().cell_of([wall + 0.5 * R, 0.01, 0.01]).unwrap();
        self.store().cell(cell).unwrap().distance.into()
    }

    fn has_surface(&self, wall: f64) -> bool {
        let mesh = marching_cubes(self, None, &MeshSettings::default());
        let vertices: Vec<_> = (0..mesh.vertices.len()).map(|i| mesh.vertex_world(i)).collect();
        any_near(&vertices, wall)
    }
}

/// Looks until half of what a cell believed of a wall at `wall` is left, after the wall has gone and the next one is 4 m behind
/// it; interpolated.
fn looks_until_half<const D: usize, M: Corridor<D>>(config: TsdfConfig<D>, wall: f64) -> f64 {
    let (mut map, beams) = (M::new(config), tangents(wall));
    // Until it is saturated by any measure but the sum of its weights.
    for _ in 0..120 {
        map.see(&beams, wall);
    }
    assert!(map.has_surface(wall));
    let error = |map: &M| config.truncation - map.behind(wall);
    let (stale, mut last) = (error(&map), error(&map));
    for n in 1..=4 * HALF_LIFE as usize {
        map.see(&beams, wall + BEHIND);
        let left = error(&map);
        if left <= 0.5 * stale {
            assert!(!map.has_surface(wall), "the surface outlives its distances");
            return n as f64 - (0.5 * stale - left) / (last - left);
        }
        last = left;
    }
    f64::INFINITY
}

fn walls_fade_as_promised<const D: usize, M: Corridor<D>>(beams: BeamSweep) {
    let w_max = TsdfRule::w_max_for_half_life(HALF_LIFE, 1.0) as f32;
    for weights in [
        WeightModel::Constant,
        WeightModel::InverseSquare,
        WeightModel::CosIncidence,
        WeightModel::InverseSquareCosIncidence,
    ] {
        for carve_weight in [1.0, 0.2, 0.02] {
            for wall in [2.0, 5.0, 15.0] {
                let config = TsdfConfig {
                    resolution: R,
                    truncation: 3.0 * R,
                    w_max,
                    weights,
                    carve_weight,
                    beams,
                    ..Default::default()
                };
                let looks = looks_until_half::<D, M>(config, wall);
                assert!(
                    (looks / HALF_LIFE - 1.0).abs() < 0.2,
                    "{weights:?}, free space {carve_weight}, wall at {wall} m: half is left after {looks:.1} looks"
                );
            }
        }
    }
}

#[test]
fn walls_in_2d_fade_as_promised() {
    walls_fade_as_promised::<2, Tsdf2>(BeamSweep::CellCentre);
    walls_fade_as_promised::<2, Tsdf2>(BeamSweep::March);
}

#[test]
fn walls_in_3d_fade_as_promised() {
    walls_fade_as_promised::<3, Tsdf3>(BeamSweep::CellCentre);
}
