//! Meshes of dense arrays against those of bricks, and on shapes that are known.

use super::*;

use crate::surface::EdgeCounts;
use crate::surface::cubes::testing::bricks;
use crate::surface::{MeshSettings, marching_cubes};
use crate::testing::{Random, with_threads};
use proptest::prelude::*;

fn isosurface(samples: &[f32], shape: [usize; 3], level: f64, normals: bool) -> Mesh {
    let settings = IsosurfaceSettings { level, normals, ..IsosurfaceSettings::default() };
    super::isosurface(samples, shape, &settings).mesh
}

fn field(shape: [usize; 3], mut value: impl FnMut([f64; 3]) -> f64) -> Vec<f32> {
    let at = |i: usize| [i % shape[0], i / shape[0] % shape[1], i / shape[0] / shape[1]];
    (0..shape.iter().product()).map(|i| value(at(i).map(|v| v as f64)) as f32).collect()
}

fn closed(mesh: &Mesh) {
    let counts = mesh.edge_counts();
    assert_eq!((counts.border, counts.faulty), (0, 0));
    assert_eq!(mesh.components().0.len(), mesh.vertices.len());
    let mut used = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u), "a vertex without triangle");
}

#[test]
fn without_holes_it_is_the_same_in_place() {
    let mut random = Random(21);
    let want = Attributes { normals: true, colors: false, ranges: true };
    let shapes = [[2, 2, 2], [9, 8, 3], [17, 16, 15], [33, 7, 20], [20, 40, 30], [3, 300, 17]];
    for (shape, kind) in shapes.into_iter().flat_map(|shape| (0..3).map(move |kind| (shape, kind))) {
        let samples = field(shape, |p| match kind {
            // Every case, values at the level, and one that is smooth.
            0 => f64::from(random.value()),
            1 => (random.next() % 5) as f64 - 2.0,
            _ => (0.4 * p[0]).sin() + (0.3 * p[1]).cos() - (0.5 * p[2]).sin(),
        });
        for (inside, apart) in [(Inside::Below, true), (Inside::Above, false)] {
            let settings = IsosurfaceSettings { inside, apart, level: 0.0, ..IsosurfaceSettings::default() };
            let tiles = Tiles::new(shape);
            let dense = DenseSamples::of(&samples, shape, &settings);
            let below = Below::of(&settings);
            let pieces = with_holes(&tiles, &dense, below, want, usize::MAX);
            for (threads, most) in [(1, usize::MAX), (3, usize::MAX), (3, 2), (3, 1)] {
                let placed = with_threads(threads, || whole::surface(&tiles, &dense, below, want, most));
                let (mesh, ranges) = placed.unwrap();
                assert!(Isosurface { mesh, ranges } == pieces, "{shape:?}, {kind}, {inside:?}");
                let again = with_threads(threads, || with_holes(&tiles, &dense, below, want, most));
                assert!(again == pieces, "{shape:?}, {kind}, {inside:?}");
            }
        }
    }
    let settings = IsosurfaceSettings::default();
    let holed = [f32::NAN, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0];
    let dense = DenseSamples::of(&holed, [2; 3], &settings);
    assert!(whole::surface(&Tiles::new([2; 3]), &dense, Below::of(&settings), want, 1).is_none());
}

#[test]
fn a_sphere_is_a_sphere() {
    let shape = [37, 40, 33];
    let samples = field(shape, |p| {
        ((p[0] - 18.2).powi(2) + (p[1] - 19.1).powi(2) + (p[2] - 16.4).powi(2)).sqrt() - 13.3
    });
    let mesh = isosurface(&samples, shape, 0.0, true);
    closed(&mesh);
    assert_eq!((mesh.euler_characteristic(), mesh.components().1), (2, 1));
    // The chords of cells of 1 at radius 13.3 lie up to 1/(8 r) * 3 inside.
    assert!((mesh.area() / (4.0 * std::f64::consts::PI * 13.3 * 13.3) - 1.0).abs() < 0.005);
    assert!((mesh.volume() / (4.0 / 3.0 * std::f64::consts::PI * 13.3f64.powi(3)) - 1.0).abs() < 0.005);
    for (i, n) in mesh.normals.iter().enumerate() {
        let p = mesh.vertex_world(i);
        let out = [p[0] - 18.2, p[1] - 19.1, p[2] - 16.4].map(|v| v / 13.3);
        let cosine: f64 = (0..3).map(|k| out[k] * f64::from(n[k])).sum();
        assert!(cosine > 0.998, "{cosine}");
    }
    // Another level is another sphere.
    let larger = isosurface(&samples, shape, 1.5, false);
    assert!((larger.area() / (4.0 * std::f64::consts::PI * 14.8 * 14.8) - 1.0).abs() < 0.005);
}

#[test]
fn a_torus_has_a_hole() {
    let shape = [50, 48, 20];
    let samples = field(shape, |p| {
        let ring = (p[0] - 24.6).hypot(p[1] - 23.7) - 15.2;
        ring.hypot(p[2] - 9.9) - 5.1
    });
    let mesh = isosurface(&samples, shape, 0.0, false);
    closed(&mesh);
    assert_eq!((mesh.euler_characteristic(), mesh.components().1), (0, 1));
    let area = 4.0 * std::f64::consts::PI.powi(2) * 15.2 * 5.1;
    assert!((mesh.area() / area - 1.0).abs() < 0.01);
}

/// The gyroid has genus 3 per primitive cell, which is half of the cubic one: characteristic -8 per cubic cell.
/// On a torus of one cell, made by joining the vertices at opposite sides, all of it is there.
#[test]
fn a_gyroid_has_genus_five_per_cell() {
    let n = 24;
    let shape = [n + 1; 3];
    let samples = field(shape, |p| {
        // One period; opposite sides get the same bits.
        let [x, y, z] = p.map(|v| std::f64::consts::TAU * ((v % n as f64) + 0.1) / n as f64);
        x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
    });
    let mesh = isosurface(&samples, shape, 0.0, false);
    assert_eq!(mesh.edge_counts().faulty, 0);
    // Vertices of opposite sides become one.
    let wrapped = |v: [f32; 3]| v.map(|c| if c >= n as f32 { (c - n as f32).to_bits() } else { c.to_bits() });
    let mut names = std::collections::HashMap::new();
    let number: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|v| {
            let next = names.len() as u32;
            *names.entry(wrapped(*v)).or_insert(next)
        })
        .collect();
    let joined = Mesh {
        vertices: vec![[0.0; 3]; names.len()],
        triangles: mesh.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
        ..Mesh::default()
    };
    closed(&joined);
    assert_eq!(joined.euler_characteristic(), -8);
}

/// Noise in a box of positive values: nothing is open, whatever the topology.
fn noise(seed: u64, n: usize, zeros: bool) -> Vec<f32> {
    let mut random = Random(seed);
    field([n; 3], |p| {
        let v = f64::from(random.value());
        let v = if zeros && v.abs() < 0.3 { 0.0 } else { v };
        if p.iter().any(|&c| c == 0.0 || c == (n - 1) as f64) { 1.0 } else { v }
    })
}

#[test]
fn noise_is_a_closed_manifold() {
    for seed in 0..6 {
        let mesh = isosurface(&noise(seed, 27, seed % 2 == 1), [27; 3], 0.0, true);
        closed(&mesh);
        assert!(mesh.triangles.len() > 20_000);
        assert!(mesh.vertices.iter().flatten().all(|v| v.is_finite()));
        // Around every vertex the triangles are one ring: as many corners as there are edges.
        let mut degree = vec![0i64; mesh.vertices.len()];
        mesh.triangles.iter().flatten().for_each(|&v| degree[v as usize] += 1);
        assert!(degree.iter().all(|&d| d >= 3));
    }
}

#[test]
fn zeros_at_nodes_make_no_degenerate_triangles() {
    // Planes, a cone's tip and a cross of zeros, all through nodes.
    for value in [
        (|p: [f64; 3]| p[0] - 8.0) as fn([f64; 3]) -> f64,
        |p| 8.0 - p[1],
        |p| (p[0] - 8.0) * (p[1] - 8.0),
        |p| (p[0] - 8.0).hypot(p[1] - 8.0) - (p[2] - 8.0).abs(),
        |p| (p[0] - 8.0).abs() + (p[1] - 8.0).abs() + (p[2] - 8.0).abs() - 4.0,
    ] {
        let mesh = isosurface(&field([17; 3], value), [17; 3], 0.0, true);
        assert_eq!(mesh.edge_counts().faulty, 0);
        assert!(!mesh.triangles.is_empty());
        for t in &mesh.triangles {
            let n = mesh.area_normal(*t);
            assert!(n.iter().map(|v| v * v).sum::<f64>() > 1e-10, "a triangle without area");
        }
        assert!(mesh.normals.iter().flatten().all(|v| v.is_finite()));
    }
}

#[test]
fn what_is_not_finite_is_a_hole() {
    let shape = [20; 3];
    let samples = field(shape, |p| match p[0] as usize {
        5 if p[1] == 5.0 => f64::NAN,
        9 if p[1] == 9.0 => f64::INFINITY,
        14 if p[1] == 14.0 => f64::NEG_INFINITY,
        _ => p[2] - 9.5,
    });
    let mesh = isosurface(&samples, shape, 0.0, true);
    assert_eq!(mesh.edge_counts().faulty, 0);
    assert_eq!(mesh.triangles.len(), 2 * (19 * 19 - 3 * 4));
    assert!(mesh.vertices.iter().all(|v| v[2] == 9.5));
}

/// The level is not representable in `f32`; the sample nearest to it is beyond it, or not.
#[test]
fn levels_between_two_f32_have_the_right_side() {
    let level = 0.1f64;
    let near = 0.1f32;
    assert!(f64::from(near) > level);
    for (low, surface) in [(near, false), (near.next_down(), true)] {
        let samples = field([4; 3], |p| if p[0] < 2.0 { f64::from(low) } else { 1.0 });
        let mesh = isosurface(&samples, [4; 3], level, false);
        assert_eq!(!mesh.triangles.is_empty(), surface);
        assert!(mesh.vertices.iter().all(|v| v[0] == 1.0 + 1.0 / 256.0));
    }
}

#[test]
fn above_is_below_of_the_negative() {
    let samples = noise(7, 19, true);
    let negative: Vec<f32> = samples.iter().map(|v| -v).collect();
    let settings = IsosurfaceSettings { level: 0.2, ranges: true, ..IsosurfaceSettings::default() };
    let above = IsosurfaceSettings { inside: Inside::Above, level: -0.2, ..settings };
    let found = super::isosurface(&samples, [19; 3], &settings);
    assert!(found.mesh.triangles.len() > 1000 && found.ranges.len() == found.mesh.vertices.len());
    assert_eq!(super::isosurface(&negative, [19; 3], &above), found);
}

#[test]
fn vertices_may_lie_in_nodes() {
    let samples = field([6; 3], |p| p[0] - 2.0);
    let settings = IsosurfaceSettings { apart: false, ..IsosurfaceSettings::default() };
    let mesh = super::isosurface(&samples, [6; 3], &settings).mesh;
    assert_eq!(mesh.triangles.len(), 2 * 25);
    assert!(mesh.vertices.iter().all(|v| v[0] == 2.0));
}

#[test]
fn ranges_are_those_of_the_cubes_around() {
    let (n, holes) = (14, [(3, 4, 5), (0, 9, 9), (8, 8, 2)]);
    for masked in [false, true] {
        let mut samples = noise(2, n, false);
        holes.iter().for_each(|&(x, y, z)| samples[x + n * (y + n * z)] = f32::NAN);
        let flags: Vec<bool> = (0..n * n * n).map(|i| i % 7 != 3).collect();
        let cubes = masked.then_some(&flags[..]);
        let settings =
            IsosurfaceSettings { ranges: true, apart: false, cubes, ..IsosurfaceSettings::default() };
        let Isosurface { mesh, ranges } = super::isosurface(&samples, [n; 3], &settings);
        assert!(ranges.len() == mesh.vertices.len() && ranges.len() > 1000);
        let range = |lowest: [usize; 3]| {
            let node = |c: usize| [0, 1, 2].map(|k| lowest[k] + (c >> k & 1));
            let index = |p: [usize; 3]| p[0] + n * (p[1] + n * p[2]);
            let all: Vec<f32> = (0..8).map(|c| samples[index(node(c))]).collect();
            let allowed = (!masked || flags[index(node(7))]) && all.iter().all(|v| v.is_finite());
            let (least, most) = (all.iter().copied().reduce(f32::min), all.iter().copied().reduce(f32::max));
            allowed.then(|| most.unwrap() - least.unwrap())
        };
        for (v, got) in mesh.vertices.iter().zip(&ranges) {
            let Some(axis) = (0..3).find(|&k| v[k].fract() != 0.0) else { continue };
            if (0..3).any(|k| k != axis && v[k].fract() != 0.0) {
                continue; // in the middle of a cube
            }
            let at = v.map(|c| c as usize);
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = (0..4).filter_map(|i| {
                let mut lowest = at;
                lowest[a] = lowest[a].checked_sub(i & 1)?;
                lowest[b] = lowest[b].checked_sub(i >> 1)?;
                (lowest.iter().all(|&c| c + 1 < n)).then(|| range(lowest))?
            });
            assert_eq!(around.reduce(f32::max), Some(*got), "{v:?}");
        }
    }
}

#[test]
fn cubes_that_are_not_asked_for_have_no_surface() {
    let n = 21;
    let samples = field([n; 3], |p| p[2] - 9.5);
    let flags: Vec<bool> = (0..n * n * n).map(|i| i % n > 4 && i / n % n != 9).collect();
    let settings = IsosurfaceSettings { cubes: Some(&flags), ..IsosurfaceSettings::default() };
    let mesh = super::isosurface(&samples, [n; 3], &settings).mesh;
    assert_eq!(mesh.edge_counts().faulty, 0);
    // 16 columns of cubes along x, 19 rows along y.
    assert_eq!(mesh.triangles.len(), 2 * 16 * 19);
    let mut used = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u) && mesh.vertices.iter().all(|v| v[0] >= 4.0));
}

#[test]
fn empty_and_flat_arrays_have_no_surface() {
    for shape in [[0, 3, 3], [1, 9, 9], [1, 1, 1], [9, 1, 9]] {
        let n = shape.iter().product();
        let samples: Vec<f32> = (0..n).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let mesh = isosurface(&samples, shape, 0.0, true);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (0, 0));
    }
}

/// Counts that do not depend on how the axes are named.
fn counts(mesh: &Mesh) -> (EdgeCounts, usize, usize, Vec<[u32; 3]>) {
    let mut vertices: Vec<_> = mesh.vertices.iter().map(|v| v.map(f32::to_bits)).collect();
    vertices.sort_unstable();
    (mesh.edge_counts(), mesh.triangles.len(), mesh.components().1, vertices)
}

#[test]
fn tiles_leave_no_trace() {
    // Rows so long that not all of them are in one tile.
    let shape = [600, 45, 20];
    assert!(Tiles::new(shape).along > 1);
    let mut random = Random(3);
    let mut hole = Random(4);
    let mut value = || if hole.next().is_multiple_of(50) { f64::NAN } else { random.value().into() };
    let samples = field(shape, |_| value());
    let index = |c: [i32; 3]| (0..3).rev().fold(0, |i, k| i * shape[k] + c[k] as usize);
    let store = bricks(crate::geom::Lattice::new([0.0; 3], 1.0), [0; 3], shape, |c| samples[index(c)]);
    let dense = || isosurface(&samples, shape, 0.0, true);
    let (mesh, sparse) = (dense(), marching_cubes(&store, None, &MeshSettings::default()));
    assert!(mesh.triangles.len() > 500_000 && mesh.triangles == sparse.triangles);
    for (i, v) in mesh.vertices.iter().enumerate() {
        let other = sparse.vertex_world(i);
        assert!((0..3).all(|k| (f64::from(v[k]) + 0.5 - other[k]).abs() < 1e-4));
    }
    #[cfg(feature = "parallel")]
    for threads in [1, 2, 5] {
        assert!(crate::testing::with_threads(threads, dense) == mesh);
    }
}

proptest! {
    #[test]
    fn axes_can_be_exchanged(seed: u64, turn in 0..6usize) {
        let n = 11;
        let samples = noise(seed, n, false);
        let axes = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]][turn];
        let turned = field([n; 3], |p| {
            let q: [usize; 3] = std::array::from_fn(|k| p[axes[k]] as usize);
            f64::from(samples[q[0] + n * (q[1] + n * q[2])])
        });
        let mut mesh = isosurface(&samples, [n; 3], 0.0, false);
        let (edges, triangles, components, _) = counts(&mesh);
        mesh.vertices.iter_mut().for_each(|v| {
            let old = *v;
            (0..3).for_each(|k| v[axes[k]] = old[k]);
        });
        let other = isosurface(&turned, [n; 3], 0.0, false);
        prop_assert_eq!((edges, triangles, components), { let c = counts(&other); (c.0, c.1, c.2) });
        prop_assert!((mesh.volume().abs() - other.volume().abs()).abs() < 0.02 * mesh.volume().abs());
    }

    #[test]
    fn an_axis_can_be_turned_round(seed: u64, axis in 0..3usize) {
        let n = 11;
        let samples = noise(seed, n, false);
        let turned = field([n; 3], |p| {
            let mut q = p.map(|v| v as usize);
            q[axis] = n - 1 - q[axis];
            f64::from(samples[q[0] + n * (q[1] + n * q[2])])
        });
        let (mesh, other) = (isosurface(&samples, [n; 3], 0.0, false), isosurface(&turned, [n; 3], 0.0, false));
        prop_assert_eq!((mesh.edge_counts(), mesh.components().1), (other.edge_counts(), other.components().1));
        prop_assert!((mesh.area() - other.area()).abs() < 0.02 * mesh.area());
    }

    #[test]
    fn bricks_and_arrays_give_one_mesh(seed: u64, first in prop::array::uniform3(-20..20i32)) {
        let n = 19;
        let samples = noise(seed, n, seed % 2 == 0);
        let lattice = crate::geom::Lattice::new([0.0; 3], 1.0);
        let index = |c: [i32; 3]| (0..3).rev().fold(0, |i, k| i * n + (c[k] - first[k]) as usize);
        let store = bricks(lattice, first, [n; 3], |c| samples[index(c)]);
        let settings = MeshSettings { normals: false, ..Default::default() };
        let (dense, sparse) = (isosurface(&samples, [n; 3], 0.0, false), marching_cubes(&store, None, &settings));
        // As sets of triangles, each from its lowest corner on. A corner is named by the place that it is in, which
        // the margin at nodes keeps unique: the cell, and the axes along which it is between nodes.
        let set = |mesh: &Mesh, offset: [f64; 3]| {
            let corner = |v: u32| {
                let p = mesh.vertex_world(v as usize);
                std::array::from_fn::<i64, 3, _>(|k| {
                    let c = p[k] - offset[k];
                    let near = (c - c.round()).abs() < 1e-4;
                    if near { 2 * c.round() as i64 } else { 2 * c.floor() as i64 + 1 }
                })
            };
            let mut all: Vec<_> = mesh.triangles.iter().map(|t| {
                let mut t = t.map(corner);
                let low = (0..3).min_by_key(|&k| (t[k], t[(k + 1) % 3])).unwrap_or(0);
                t.rotate_left(low);
                t
            }).collect();
            all.sort_unstable();
            all
        };
        prop_assert_eq!(dense.vertices.len(), sparse.vertices.len());
        let offset = first.map(|v| f64::from(v) + 0.5);
        prop_assert!(set(&dense, [0.0; 3]) == set(&sparse, offset));
        prop_assert!((dense.area() - sparse.area()).abs() < 1e-5 * dense.area());
    }
}
