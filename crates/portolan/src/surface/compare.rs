//! Comparison of two surfaces: accuracy, completeness and F-score.

use super::{Mesh, NearestSurface};
use crate::geom::vector::{along, cross3, norm, sub};
use crate::parallel;

/// The surface that a map is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Reference<'a> {
    /// Triangles.
    Mesh(&'a Mesh),
    /// Points (meters, about `origin`).
    Points {
        /// World position of the point (0, 0, 0) (meters).
        origin: [f64; 3],
        /// The points.
        points: &'a [[f32; 3]],
    },
}

/// Settings of [`compare_surfaces`].
#[derive(Clone, Debug, PartialEq)]
pub struct CompareSettings {
    /// Largest number of points sampled on each surface.
    pub samples: usize,
    /// Distances (meters) for which shares and F-scores are computed.
    pub thresholds: Vec<f64>,
}

impl Default for CompareSettings {
    /// 200,000 points; 1, 2 and 5 cm.
    fn default() -> Self {
        Self { samples: 200_000, thresholds: vec![0.01, 0.02, 0.05] }
    }
}

/// Statistics of the distances from points of one surface to another surface (meters).
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDistances {
    /// Number of points.
    pub samples: usize,
    /// The mean.
    pub mean: f64,
    /// The median.
    pub median: f64,
    /// The 95th percentile.
    pub p95: f64,
    /// The maximum.
    pub largest: f64,
    /// Share of the points within each threshold.
    pub within: Vec<f64>,
}

/// The distances between two surfaces in both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceComparison {
    /// From the surface of the map to the reference.
    pub accuracy: SurfaceDistances,
    /// From the reference to the surface of the map.
    pub completeness: SurfaceDistances,
    /// For each threshold, the harmonic mean of the two shares within it *(Knapitsch et al. 2017, section 4)*.
    pub f_scores: Vec<f64>,
    /// Number of points of the reference rejected by `keep`.
    pub cropped: usize,
    /// Number of triangles and points of both surfaces skipped because of a coordinate that is not finite.
    pub unusable: usize,
}

/// Compares the surface of a map with a reference: distances from evenly spread points of one to the nearest triangle (or
/// point) of the other, in both directions. Points of the reference are measured only where `keep` is true, to exclude
/// parts that a sensor could not see.
///
/// `None` where a surface is empty, or all points of the reference are rejected. Deterministic.
/// O((samples + elements) log elements).
pub fn compare_surfaces(
    map: &Mesh,
    reference: Reference<'_>,
    settings: &CompareSettings,
    keep: impl Fn([f64; 3]) -> bool,
) -> Option<SurfaceComparison> {
    let (index, mut points) = match reference {
        Reference::Mesh(mesh) => (NearestSurface::of_mesh(mesh), area_samples(mesh, settings.samples)),
        Reference::Points { origin, points } => {
            (NearestSurface::of_points(origin, points), thinned(origin, points, settings.samples))
        }
    };
    let unusable = unusable_triangles(map)
        + match reference {
            Reference::Mesh(mesh) => unusable_triangles(mesh),
            Reference::Points { points, .. } => points.iter().filter(|p| !is_finite(p)).count(),
        };
    let accuracy = distances(&area_samples(map, settings.samples), &index, settings)?;
    let all = points.len();
    points.retain(|p| keep(*p));
    let completeness = distances(&points, &NearestSurface::of_mesh(map), settings)?;
    let f_scores = accuracy.within.iter().zip(&completeness.within).map(|(&precision, &recall)| {
        if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 }
    });
    let f_scores = f_scores.collect();
    Some(SurfaceComparison { accuracy, completeness, f_scores, cropped: all - points.len(), unusable })
}

fn is_finite(p: &[f32; 3]) -> bool {
    p.iter().all(|v| v.is_finite())
}

fn unusable_triangles(mesh: &Mesh) -> usize {
    let usable = |t: &[u32; 3]| t.iter().all(|&v| is_finite(&mesh.vertices[v as usize]));
    mesh.triangles.iter().filter(|t| !usable(t)).count()
}

/// `count` points of a mesh (world), uniform by area: one per equal share of the area in the order of the triangles, placed
/// inside its triangle by a low-discrepancy sequence. Triangles with a corner that is not finite are skipped. Empty for a
/// mesh without area.
pub fn area_samples(mesh: &Mesh, count: usize) -> Vec<[f64; 3]> {
    let areas: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners_world(t);
            let area = 0.5 * norm(cross3(sub(b, a), sub(c, a)));
            if area.is_finite() { area } else { 0.0 }
        })
        .collect();
    let total: f64 = areas.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return Vec::new();
    }
    let mut samples = Vec::with_capacity(count);
    let (mut triangle, mut passed) = (0, 0.0);
    for i in 0..count {
        let at = (i as f64 + 0.5) / count as f64 * total;
        while triangle + 1 < areas.len() && passed + areas[triangle] <= at {
            passed += areas[triangle];
            triangle += 1;
        }
        // The sequence of the plastic number *(Roberts 2018)*, made uniform over the triangle by the root.
        let [u, v] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|a| (0.5 + i as f64 * a).fract());
        let [a, b, c] = mesh.corners_world(mesh.triangles[triangle]);
        let root = u.sqrt();
        samples.push(along(along(a, sub(b, a), root * (1.0 - v)), sub(c, a), root * v));
    }
    samples
}

/// At most `count` of the finite points (world), evenly spaced in their order.
fn thinned(origin: [f64; 3], points: &[[f32; 3]], count: usize) -> Vec<[f64; 3]> {
    let finite: Vec<&[f32; 3]> = points.iter().filter(|p| is_finite(p)).collect();
    let taken = count.min(finite.len());
    let world = |i: usize| -> [f64; 3] {
        let p = finite[(i as u128 * finite.len() as u128 / taken as u128) as usize];
        std::array::from_fn(|k| origin[k] + f64::from(p[k]))
    };
    (0..taken).map(world).collect()
}

fn distances(
    points: &[[f64; 3]],
    to: &NearestSurface,
    settings: &CompareSettings,
) -> Option<SurfaceDistances> {
    let mut sorted = measured(points, to);
    let n = sorted.len();
    if n == 0 {
        return None;
    }
    let mean = sorted.iter().sum::<f64>() / n as f64;
    sorted.sort_unstable_by(f64::total_cmp);
    // The nearest rank, which is always one of the numbers.
    let at = |q: f64| sorted[((q * n as f64).ceil() as usize).clamp(1, n) - 1];
    let share = |t: &f64| sorted.partition_point(|d| d <= t) as f64 / n as f64;
    Some(SurfaceDistances {
        samples: n,
        mean,
        median: at(0.5),
        p95: at(0.95),
        largest: at(1.0),
        within: settings.thresholds.iter().map(share).collect(),
    })
}

/// In the order of the points.
fn measured(points: &[[f64; 3]], to: &NearestSurface) -> Vec<f64> {
    parallel::map(points, 256, |&p| to.distance(p)).into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::distance;

    /// A ball of fine triangles about a far point.
    fn sphere(radius: f64) -> Mesh {
        let (rings, sectors) = (90u32, 180u32);
        let mut mesh = Mesh { origin: [500_000.0, 4_000_000.0, 100.0], ..Default::default() };
        for i in 0..=rings {
            for j in 0..sectors {
                let (polar, azimuth) = (
                    std::f64::consts::PI * f64::from(i) / f64::from(rings),
                    std::f64::consts::TAU * f64::from(j) / f64::from(sectors),
                );
                let p = [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()];
                mesh.vertices.push(p.map(|v| (radius * v) as f32));
            }
        }
        for i in 0..rings {
            for j in 0..sectors {
                let (a, b) = (i * sectors + j, i * sectors + (j + 1) % sectors);
                mesh.triangles.extend([[a, a + sectors, b], [b, a + sectors, b + sectors]]);
            }
        }
        mesh
    }

    fn plane(z: f32, half: f32) -> Mesh {
        Mesh {
            vertices: vec![[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        }
    }

    #[test]
    fn balls_are_as_far_apart_as_their_radii() {
        let settings = CompareSettings { samples: 20_000, ..Default::default() };
        let (map, truth) = (sphere(1.03), sphere(1.0));
        let c = compare_surfaces(&map, Reference::Mesh(&truth), &settings, |_| true).unwrap();
        for way in [&c.accuracy, &c.completeness] {
            assert_eq!(way.samples, 20_000);
            // Chords of two degrees lie 0.15 mm inside of a ball of a meter.
            for d in [way.median, way.mean, way.p95, way.largest] {
                assert!((d - 0.03).abs() < 5e-4, "{d}");
            }
            assert_eq!(way.within, [0.0, 0.0, 1.0]);
        }
        assert_eq!((c.f_scores, c.cropped), (vec![0.0, 0.0, 1.0], 0));
        let points: Vec<[f32; 3]> = truth.vertices.clone();
        let cloud = Reference::Points { origin: truth.origin, points: &points };
        let c = compare_surfaces(&map, cloud, &settings, |_| true).unwrap();
        // Points two degrees apart: up to 25 mm along the surface to the nearest one.
        assert!(c.accuracy.median >= 0.03 && c.accuracy.median < 0.035, "{}", c.accuracy.median);
        assert!((c.completeness.median - 0.03).abs() < 5e-4);
        assert_eq!(c.completeness.samples, points.len());
    }

    #[test]
    fn a_shifted_plane_and_what_it_does_not_cover() {
        let settings = CompareSettings { samples: 40_000, ..Default::default() };
        let (map, truth) = (plane(0.015, 1.0), plane(0.0, 2.0));
        let all = compare_surfaces(&map, Reference::Mesh(&truth), &settings, |_| true).unwrap();
        assert!((all.accuracy.median - 0.015).abs() < 1e-6 && (all.accuracy.largest - 0.015).abs() < 1e-6);
        assert_eq!(all.accuracy.within, [0.0, 1.0, 1.0]);
        // A quarter of the reference lies below the map; the farthest corner is a diagonal meter away.
        assert!((all.completeness.within[1] - 0.25).abs() < 0.01, "{:?}", all.completeness.within);
        assert!((all.completeness.largest - 2f64.sqrt()).abs() < 0.03);
        let f = 2.0 * all.completeness.within[1] / (1.0 + all.completeness.within[1]);
        assert!((all.f_scores[1] - f).abs() < 1e-12);
        let seen = |p: [f64; 3]| p[0].abs() <= 1.0 && p[1].abs() <= 1.0;
        let seen = compare_surfaces(&map, Reference::Mesh(&truth), &settings, seen).unwrap();
        assert_eq!(seen.completeness.within[1], 1.0);
        assert_eq!(seen.cropped + seen.completeness.samples, 40_000);
        assert!(compare_surfaces(&map, Reference::Mesh(&truth), &settings, |_| false).is_none());
        assert!(compare_surfaces(&Mesh::default(), Reference::Mesh(&truth), &settings, |_| true).is_none());
    }

    #[test]
    fn what_is_not_finite_is_skipped_and_counted() {
        let settings = CompareSettings { samples: 5000, ..Default::default() };
        let (map, truth) = (plane(0.015, 1.0), plane(0.0, 2.0));
        let want = compare_surfaces(&map, Reference::Mesh(&truth), &settings, |_| true).unwrap();
        assert_eq!(want.unusable, 0);
        let torn = |mesh: &Mesh| {
            let mut mesh = mesh.clone();
            mesh.vertices.push([0.0, f32::NAN, 0.0]);
            // First, last and in between: the samples must not shift.
            mesh.triangles.insert(0, [0, 1, 4]);
            mesh.triangles.insert(2, [4, 4, 4]);
            mesh.triangles.push([0, 4, 3]);
            mesh
        };
        let got = compare_surfaces(&torn(&map), Reference::Mesh(&torn(&truth)), &settings, |_| true).unwrap();
        assert_eq!(got, SurfaceComparison { unusable: 6, ..want });

        let cloud = |points| {
            compare_surfaces(&map, Reference::Points { origin: [0.0; 3], points }, &settings, |_| true)
        };
        let points: Vec<[f32; 3]> = (0..400).map(|i| [i % 20, i / 20, 0].map(|v| v as f32 * 0.1)).collect();
        let want = cloud(&points).unwrap();
        let mut with = points.clone();
        with.insert(7, [f32::NAN, 0.0, 0.0]);
        with.push([0.0, f32::INFINITY, 0.0]);
        assert_eq!(cloud(&with).unwrap(), SurfaceComparison { unusable: 2, ..want });
        assert!(cloud(&[[f32::NAN; 3]]).is_none());
    }

    #[test]
    fn samples_are_spread_by_area() {
        // Two squares, one of four times the area.
        let (mut mesh, other) = (plane(0.0, 1.0), plane(1.0, 2.0));
        mesh.vertices.extend(&other.vertices);
        mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + 4)));
        let samples = area_samples(&mesh, 5000);
        let upper: Vec<_> = samples.iter().filter(|p| p[2] > 0.5).collect();
        assert_eq!(upper.len(), 4000);
        let middle = upper.iter().fold([0.0; 3], |m, p| along(m, **p, 1.0 / 4000.0));
        assert!(distance(middle, [0.0, 0.0, 1.0]) < 0.02, "{middle:?}");
        let quarter = upper.iter().filter(|p| p[0] < 0.0 && p[1] < 0.0).count();
        assert!((quarter as f64 - 1000.0).abs() < 20.0, "{quarter}");
        assert_eq!(area_samples(&mesh, 5000), samples);
    }
}
