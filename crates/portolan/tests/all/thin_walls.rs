//! A wall seen from both sides: what the truncation does to it.

use crate::common::quantile;
use portolan::geom::{Grid, Pose};
use portolan::map::{BeamSweep, Tsdf2, TsdfConfig};
use portolan::surface::{ContourSettings, marching_squares, thin_walls};
use portolan_sim::{Lidar, Solid, SolidKind, World, scan_at};

/// A wall of this thickness between two halves of a room, seen from 20 places on either side; returns the
/// extracted thickness (meters) and the length that is reported as too thin.
fn extracted(thickness: f64, sweep: BeamSweep, truncation: f64) -> (f64, f64) {
    let half = 0.5 * thickness;
    let wall = |name: &str, min, max| Solid::rectangle(name, SolidKind::Wall, min, max);
    let world = World::new(vec![
        wall("south", [-3.0, -2.3], [3.0, -2.0]),
        wall("north", [-3.0, 2.0], [3.0, 2.3]),
        wall("west", [-3.3, -2.3], [-3.0, 2.3]),
        wall("east", [3.0, -2.3], [3.3, 2.3]),
        // Off the lattice, so that no face lies on a border of cells.
        wall("between", [0.013 - half, -2.0], [0.013 + half, 2.0]),
    ]);
    let grid = Grid::new([-3.5, -2.5], 0.05, [140, 100]);
    let mut tsdf =
        Tsdf2::covering(&grid, TsdfConfig { beams: sweep, truncation, ..TsdfConfig::textbook() }).unwrap();
    for i in 0..40u32 {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let step = f64::from(i / 2);
        let pose = Pose::<2>::new(side * (0.6 + 0.1 * (step % 7.0)), -1.5 + 0.15 * step, 0.3 * step);
        tsdf.integrate(&pose, &scan_at(&world, &pose, &Lidar::default(), 5, u64::from(i))).unwrap();
    }
    let contour = marching_squares(&tsdf, &ContourSettings::default());
    let mut faces = [vec![], vec![]];
    for v in contour.vertices.iter().filter(|v| v[0].abs() < 0.4 && v[1].abs() < 1.5) {
        faces[usize::from(v[0] > 0.013)].push(v[0]);
    }
    let thin = thin_walls(&tsdf, &contour).thin;
    let [left, right] = &mut faces;
    if left.is_empty() || right.is_empty() {
        return (0.0, thin);
    }
    (quantile(right, 0.5) - quantile(left, 0.5), thin)
}

/// What the truncation does to a wall thinner than 2 tau, measured here: it displaces the faces, outwards. A
/// beam's claim behind the surface is negative and tapers to nothing at tau, so inside the wall the two sides
/// agree, and nothing cancels; but where the wall is thinner than tau a side's claim reaches through and pushes
/// the other face out. (The text expects the two claims to cancel into nothing. With the taper, and with carving
/// from both sides, they do not.) Between tau and 2 tau the claims overlap inside the wall only, and harmlessly.
#[test]
fn walls_of_10_20_and_30_cm_seen_from_both_sides() {
    // tau, thickness, extracted thickness, all in meters; then whether the warning must come.
    let table = [
        (0.15, 0.10, 0.111, true),
        (0.15, 0.20, 0.197, true),
        (0.15, 0.30, 0.297, false),
        (0.30, 0.10, 0.164, true),
        (0.30, 0.20, 0.228, true),
        (0.30, 0.30, 0.300, true),
    ];
    for (tau, thickness, want, warned) in table {
        let (measured, thin) = extracted(thickness, BeamSweep::CellCentre, tau);
        println!(
            "tau {tau} m: a wall of {thickness} m comes out {measured:.3} m thick, {thin:.1} m reported thin"
        );
        assert!((measured - want).abs() < 0.005, "{thickness} m at tau {tau}: {measured}");
        // Both faces of the 4 m wall, but for its ends.
        assert_eq!(thin > 7.0, warned, "{thickness} m at tau {tau}: {thin} m reported");
        assert!(warned || thin == 0.0);
    }
}

/// The march puts surfaces too far away, which makes walls of any thickness thinner: a solid wall of 30 cm
/// loses about 1 cm from either face.
#[test]
fn the_march_moves_both_faces_inwards() {
    let (measured, _) = extracted(0.30, BeamSweep::March, 0.15);
    assert!((measured - 0.281).abs() < 0.005, "{measured}");
}
