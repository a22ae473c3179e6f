//! Exercise 3: the zero crossing of observations along slanted beams.

use crate::page::{check, mm};
use portolan::geom::Grid;
use portolan::map::{Tsdf2, TsdfConfig};

/// What the map of a wall at `y = 0` believes along the normal when beams of these angles (radians) were fused with these
/// weights, their ranges off by `errors`: cell centers at `(k + 1/2) r`, up to tau on both sides.
fn fused_line(beams: &[(f64, f64, f64)], r: f64, tau: f64) -> Tsdf2 {
    let half = (tau / r).ceil();
    let grid = Grid::new([0.0, -r * half], r, [1, 2 * half as usize]);
    let config = TsdfConfig { truncation: tau, w_max: f32::INFINITY, ..TsdfConfig::textbook() };
    let mut map = Tsdf2::covering(&grid, config).unwrap();
    for j in 0..grid.shape[1] as i32 {
        let y = map.grid().lattice.center([0, j])[1];
        for &(theta, weight, error) in beams {
            let d = y / theta.cos() + error;
            let taper = (1.0 + d / tau).min(1.0);
            if weight * taper > 0.0 {
                map.fuse([0, j], d, weight * taper);
            }
        }
    }
    map
}

/// Where the linear interpolation between the cells next to the wall is zero, and the slope in front of it.
fn crossing_and_slope(map: &Tsdf2) -> (f64, f64) {
    let n = map.grid().shape[1] as i32;
    // Far behind the wall a grazing beam says nothing.
    let at = |j: i32| {
        let cell = map.store().at(map.grid().index([0, j])?)?;
        Some((map.grid().lattice.center([0, j])[1], f64::from(cell.distance)))
    };
    let signs_differ = |j: i32| Some((at(j)?, at(j + 1)?)).filter(|(a, b)| a.1 < 0.0 && b.1 >= 0.0);
    let ((y0, d0), (y1, d1)) = (0..n - 1).find_map(signs_differ).unwrap();
    (y0 + (y1 - y0) * d0 / (d0 - d1), d1 / y1)
}

const TAU: f64 = 0.15;

/// Zero crossing and slope of beams at 0 and 60 degrees, the second of this weight, in cells of `r`.
fn two_beams(r: f64, weight: f64, errors: [f64; 2]) -> (f64, f64) {
    let beams = [(0.0, 1.0, errors[0]), (60f64.to_radians(), weight, errors[1])];
    crossing_and_slope(&fused_line(&beams, r, TAU))
}

/// Variance of the wall by noise of the range alone, over that of the range.
fn variance(weight: f64) -> f64 {
    let off = |errors: [f64; 2]| (two_beams(0.005, weight, errors).0 / 1e-3).powi(2);
    off([1e-3, 0.0]) + off([0.0, 1e-3])
}

/// Exercise 3 (a) and (b): beams at 0 and 60 degrees say `y` and `2 y` about a point `y` in front of a wall. Fused with
/// equal weights that is `1.5 y`: the slope is wrong, the zero is not. What a map's cells add is the taper: behind
/// the wall the steeper beam counts less, the slopes on both sides differ, and the straight line between two cells
/// misses the wall by half a millimeter in 5 cm.
#[test]
fn exercise_3_zero_crossing_of_beams_at_0_and_60_degrees() {
    let (zero, slope) = two_beams(0.05, 1.0, [0.0; 2]);
    println!("equal weights: zero at {:.3} mm, slope {slope:.4}", 1e3 * zero);
    assert!((slope - 1.5).abs() < 1e-6 && zero.abs() < 6e-4);
    // It is the cells: with smaller ones it vanishes, with the square.
    let (fine, _) = two_beams(0.005, 1.0, [0.0; 2]);
    assert!(fine.abs() < 1.2e-2 * zero.abs());
    // One beam alone, however grazing: exactly there.
    for theta in [0.0f64, 0.7, 1.0] {
        let (zero, slope) = crossing_and_slope(&fused_line(&[(theta, 1.0, 0.0)], 0.02, TAU));
        assert!(zero.abs() < 1e-8 && (slope - 1.0 / theta.cos()).abs() < 1e-5);
    }
}

/// Exercise 3 (c): weights of `cos theta` bring the slope nearer to 1 (4/3), and errors that grow with the incidence
/// count less: an error of the bearing moves the end of a beam by `z tan theta` along itself, and at 60 degrees it
/// moves the wall a quarter less. Against noise of the range alone they do not help: there the grazing beam is the
/// better one across the wall.
#[test]
fn exercise_3_what_cos_weighting_does() {
    let sixty = 60f64.to_radians();
    let cosine = sixty.cos();
    let slope = two_beams(0.005, cosine, [0.0; 2]).1;
    assert!((slope - 4.0 / 3.0).abs() < 1e-6);

    // A bearing off by 0.1 degrees at 2 m from the wall: the beam head-on does not notice.
    let z = 2.0 / cosine;
    let error = z * sixty.tan() * 0.1f64.to_radians();
    let [equal, weighted] = [1.0, cosine].map(|w| two_beams(0.005, w, [0.0, error]).0);
    println!("0.1 degrees: range off by {}, wall by {}, with cos {}", mm(error), mm(equal), mm(weighted));
    assert!((equal + error / 3.0).abs() < 5e-4 && (weighted + error / 4.0).abs() < 5e-4);

    // Range noise of sigma on both: 2/9 against 5/16 of sigma squared.
    println!("range noise: variance {:.3} sigma^2, with cos {:.3}", variance(1.0), variance(cosine));
    assert!((variance(1.0) - 2.0 / 9.0).abs() < 0.02 && (variance(cosine) - 5.0 / 16.0).abs() < 0.02);
}

#[test]
fn exercise_3_on_the_page() {
    let sixty = 60f64.to_radians();
    let cosine = sixty.cos();
    let (zero, slope) = two_beams(0.05, 1.0, [0.0; 2]);
    let (fine, _) = two_beams(0.005, 1.0, [0.0; 2]);
    let (alone, steep) = crossing_and_slope(&fused_line(&[(sixty, 1.0, 0.0)], 0.05, TAU));
    let off = 2.0 / cosine * sixty.tan() * 0.1f64.to_radians();
    let wall = |w: f64| two_beams(0.005, w, [0.0, off]).0.abs();
    let rows = [
        ("(a) one beam at 60 degrees: zero crossing off by", mm(alone.abs())),
        ("(a) the slope there", format!("{steep:.3}")),
        ("(b) beams at 0 and 60 degrees, equal weights, cells of 5 cm: zero crossing off by", mm(zero.abs())),
        ("(b) the slope in front of the wall", format!("{slope:.3}")),
        ("(b) the same in cells of 0.5 cm: zero crossing off by", mm(fine.abs())),
        ("(c) the slope with weights of cos theta", format!("{:.3}", two_beams(0.005, cosine, [0.0; 2]).1)),
        (
            "(c) a bearing off by 0.1 degrees at 2 m from the wall: the grazing beam's range is off by",
            mm(off),
        ),
        ("(c) the wall with equal weights", mm(wall(1.0))),
        ("(c) the wall with weights of cos theta", mm(wall(cosine))),
        (
            "(c) variance of the wall by noise of the range, equal weights",
            format!("{:.2} sigma^2", variance(1.0)),
        ),
        ("(c) the same with weights of cos theta", format!("{:.2} sigma^2", variance(cosine))),
    ];
    check(3, &rows);
}
