//! The TSDF in bricks against its definition, cell by cell in f64, for every kind of range image.

use portolan::cell::SignedDistance;
use portolan::geom::{BlockKey, Lattice, Pose, vector};
use portolan::map::{Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Orthographic, Pinhole, Projection, RangeImage, Spherical};
use portolan::store::Store;
use portolan::sweep::WeightModel;
use proptest::prelude::*;
use std::collections::HashMap;

fn image(
    projection: Projection,
    columns: usize,
    rows: usize,
    value: impl Fn(usize, usize) -> f32,
) -> RangeImage {
    let values: Vec<f32> = (0..columns * rows).map(|i| value(i % columns, i / columns)).collect();
    RangeImage::new(projection, columns, rows, values)
}

/// What a cell gets, or that rounding decides it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Said {
    Nothing,
    One(f64, f64),
    Close,
}

/// Column, row (may lie between), length of the ray up to the point, and per unit of value; `None`: not before the lens.
fn project(image: &RangeImage, p: [f64; 3]) -> Option<(f64, f64, f64, f64)> {
    let length = vector::norm(p);
    match &image.projection {
        Projection::Pinhole(c) if p[2] > 0.0 => {
            Some((c.fx * p[0] / p[2] + c.cx, c.fy * p[1] / p[2] + c.cy, length, length / p[2]))
        }
        Projection::Pinhole(_) => None,
        Projection::Spherical(s) => {
            let turn = std::f64::consts::TAU / s.azimuth_step.abs();
            let mut column = ((p[1].atan2(p[0]) - s.first_azimuth) / s.azimuth_step).rem_euclid(turn);
            let elevation = p[2].atan2(p[0].hypot(p[1]));
            let e = |r: usize| f64::from(s.elevations[r]);
            let ring = (0..image.rows - 2).rev().find(|&r| e(r) >= elevation).unwrap_or(0);
            let ring = if image.rows > 2 && e(image.rows - 2) >= elevation { image.rows - 2 } else { ring };
            let closed = (turn - image.columns as f64).abs() < 0.5;
            if !closed && column > image.columns as f64 + (turn - image.columns as f64) / 2.0 {
                column -= turn;
            }
            Some((column, ring as f64 + (e(ring) - elevation) / (e(ring) - e(ring + 1)), length, 1.0))
        }
        Projection::Orthographic { rays, top } => {
            let at = |k: usize| (p[k] - rays.first[k]) / rays.step[k];
            Some((at(0), at(1), top - p[2], 1.0))
        }
    }
}

/// What a cell may get: between the same four pixels in any case but where it lies on a line between fours, and rounding
/// decides which of them it is.
fn said(image: &RangeImage, pose: &Pose<3>, centre: [f64; 3], config: &TsdfConfig<3>) -> Vec<Said> {
    let p = pose.inverse().transform_point(centre);
    let Some(seen) = project(image, p) else { return vec![Said::Nothing] };
    let firsts = |x: f64| {
        let near = (x - x.round()).abs() < 2e-3;
        if near { vec![x.round() as i64 - 1, x.round() as i64] } else { vec![x.floor() as i64] }
    };
    let rows = firsts(seen.1);
    let fours = firsts(seen.0).into_iter().flat_map(|c| rows.iter().map(move |&r| (c, r)));
    fours.map(|four| said_between(image, four, seen, config)).collect()
}

/// The same, with the pixels around it given: column and row of the first of the four.
fn said_between(
    image: &RangeImage,
    (c, r): (i64, i64),
    (u, v, length, scale): (f64, f64, f64, f64),
    config: &TsdfConfig<3>,
) -> Said {
    let (tau, resolution) = (config.truncation, config.resolution);
    let (w, h) = (image.columns as i64, image.rows as i64);
    let (turn, parallel) = match &image.projection {
        Projection::Spherical(s) => {
            ((std::f64::consts::TAU / s.azimuth_step.abs() - image.columns as f64).abs() < 0.5, false)
        }
        Projection::Pinhole(_) => (false, false),
        Projection::Orthographic { .. } => (false, true),
    };
    let value = |c: i64, r: i64| {
        let c = if turn { c.rem_euclid(w) } else { c };
        let inside = (0..w).contains(&c) && (0..h).contains(&r);
        if inside { f64::from(image.values[(r * w + c) as usize]) } else { 0.0 }
    };
    let four = [value(c, r), value(c + 1, r), value(c, r + 1), value(c + 1, r + 1)];
    let near_half = |x: f64| (x - x.floor() - 0.5).abs() < 2e-3;
    let openings = |row: i64| match &image.projection {
        Projection::Pinhole(k) => [1.0 / k.fx.abs(), 1.0 / k.fy.abs()],
        Projection::Spherical(s) => {
            let row = (row.max(0) as usize).min(s.elevations.len() - 2);
            let e = |r: usize| f64::from(s.elevations[r]);
            [e(row).cos() * s.azimuth_step.abs(), e(row) - e(row + 1)]
        }
        Projection::Orthographic { rays, .. } => rays.step.map(f64::abs),
    };
    let step = (0.5 * tau).min(0.03);
    let mut close = false;
    let mut connected = |a: f64, b: f64, opening: f64| {
        let most = match parallel {
            true => 5.67 * opening + step,
            false if opening > 0.2 => -1.0,
            false => 5.67 * opening * a.min(b) + step,
        };
        close |= ((a - b).abs() - most).abs() < 1e-5;
        (a - b).abs() <= most
    };
    let [ax, ay] = openings(r);
    let whole = four.iter().all(|v| *v > 0.0)
        && connected(four[0], four[1], ax)
            & connected(four[2], four[3], ax)
            & connected(four[0], four[2], ay)
            & connected(four[1], four[3], ay);
    if close {
        return Said::Close;
    }
    let mut cosine = 1.0;
    let (range, hit) = if whole {
        let (x, y) = (u - c as f64, v - r as f64);
        let linear = four.map(|v| if parallel { v } else { 1.0 / v });
        let q =
            (1.0 - y) * ((1.0 - x) * linear[0] + x * linear[1]) + y * ((1.0 - x) * linear[2] + x * linear[3]);
        let right = (1.0 - y) * (linear[1] - linear[0]) + y * (linear[3] - linear[2]);
        let below = (1.0 - x) * (linear[2] - linear[0]) + x * (linear[3] - linear[1]);
        cosine = incidence(image, (u, v), scale, [q, right, below], [ax, ay]).clamp(0.4, 1.0);
        (scale * if parallel { q } else { 1.0 / q }, true)
    } else {
        if near_half(u) || near_half(v) {
            return Said::Close;
        }
        let (nu, nv) = (u.round() as i64, v.round() as i64);
        let [ax, ay] = openings(nv);
        let across = match &image.projection {
            Projection::Pinhole(_) => length / scale,
            Projection::Spherical(_) => length,
            Projection::Orthographic { .. } => 1.0,
        };
        let aside = ((u - nu as f64) * ax).hypot((v - nv as f64) * ay) * across;
        if (aside - 0.5 * resolution).abs() < 1e-4 * resolution + 1e-4 * across * ax.max(ay) {
            return Said::Close;
        }
        if aside <= 0.5 * resolution {
            (value(nu, nv).abs() * scale, value(nu, nv) > 0.0)
        } else {
            (four.iter().fold(f64::INFINITY, |m, v| m.min(v.abs())) * scale, false)
        }
    };
    if range == 0.0 {
        return Said::Nothing;
    }
    let d = range - length;
    let across = d * cosine;
    let near = |d: f64, to: f64| (d - to).abs() < 2e-4;
    if near(d, tau) || near(across, tau) || near(across, -tau) || length.abs() < 1e-5 {
        return Said::Close;
    }
    let squared = matches!(config.weights, WeightModel::InverseSquare) && !parallel;
    let by_range = if squared { 1.0 / range.max(1.0).powi(2) } else { 1.0 };
    if across > tau {
        let speaks = config.carve && length >= 0.0;
        return if speaks {
            Said::One(tau, by_range * f64::from(config.carve_weight))
        } else {
            Said::Nothing
        };
    }
    if across < -tau || !hit {
        return Said::Nothing;
    }
    let taper = |d: f64| (1.0 + d / tau).clamp(0.0, 1.0);
    let head_on = if d > tau { 0.0 } else { taper(d) };
    let carve = if config.carve { f64::from(config.carve_weight) } else { 0.0 };
    let slanted = 0.15f64.max(0.52 * carve);
    Said::One(d.clamp(-tau, tau), by_range * head_on.max(taper(across).min(slanted)))
}

/// Cosine of the incidence on the surface between pixels, from what is linear there and by how much it grows to the right and
/// below: by the two tangents of the surface.
fn incidence(
    image: &RangeImage,
    (u, v): (f64, f64),
    scale: f64,
    [q, right, below]: [f64; 3],
    [ax, ay]: [f64; 2],
) -> f64 {
    let Projection::Pinhole(c) = &image.projection else {
        let parallel = image.has_parallel_rays();
        let per = |growth: f64, opening: f64| growth / opening / if parallel { 1.0 } else { q };
        return 1.0 / (1.0 + per(right, ax).powi(2) + per(below, ay).powi(2)).sqrt();
    };
    // The point z (x, y, 1), and how it moves with the column and with the row.
    let (x, y, z) = ((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1.0 / q);
    let moves = |growth: f64, aside: [f64; 2]| {
        let dz = -growth * z * z;
        [dz * x + z * aside[0], dz * y + z * aside[1], dz]
    };
    let (a, b) = (moves(right, [1.0 / c.fx, 0.0]), moves(below, [0.0, 1.0 / c.fy]));
    let normal = vector::cross3(a, b);
    vector::dot(normal, [x, y, 1.0]).abs() / (vector::norm(normal) * scale)
}

/// Whether a cell is what it should be, up to rounding.
fn agrees(said: Said, cell: Option<SignedDistance>) -> bool {
    match (said, cell) {
        (Said::Nothing, None) => true,
        // A weight of rounding is as good as none.
        (Said::One(_, w), None) => w < 1e-3,
        (Said::Nothing, Some(cell)) => cell.weight < 1e-3,
        // Steep surfaces turn the rounding of a place (1e-4 pixels) into more along the ray.
        (Said::One(d, w), Some(cell)) => {
            (f64::from(cell.distance) - d).abs() < 2e-3 && (f64::from(cell.weight) - w).abs() < 0.03
        }
        (Said::Close, _) => false,
    }
}

/// The image with bridges: pixels of a lidar without a reading on the line between the next ones in their row, where both are
/// surfaces of at most 60 degrees of incidence (or within 3 cm), no further apart than twice the wider distance of neighboring rays, or 0.04 radians.
fn bridged(image: &RangeImage) -> RangeImage {
    let mut whole = image.clone();
    let Projection::Spherical(s) = &image.projection else { return whole };
    let mut down: Vec<f64> = s.elevations.windows(2).map(|w| f64::from(w[0]) - f64::from(w[1])).collect();
    down.sort_by(f64::total_cmp);
    let across = s.azimuth_step.abs();
    let most = (1.001 * (2.0 * across.max(down[down.len() / 2])).max(0.04) / across) as i64;
    let n = image.columns as i64;
    for row in 0..image.rows {
        let at = |c: i64| {
            let inside = (0..n).contains(&c) || image.is_full_turn();
            if inside { image.values[row * image.columns + c.rem_euclid(n) as usize] } else { 0.0 }
        };
        for c in (0..n).filter(|&c| at(c) == 0.0) {
            let next = |way: i64| (1..=most).find(|k| at(c + way * k) != 0.0);
            let (Some(left), Some(right)) = (next(-1), next(1)) else { continue };
            let (a, b) = (f64::from(at(c - left)), f64::from(at(c + right)));
            let angle = (left + right) as f64 * across * f64::from(s.elevations[row].cos());
            let of_one = (a - b).abs() <= 1.73 * angle * a.min(b) + 0.03 && angle <= 0.2;
            if left + right <= most && a > 0.0 && b > 0.0 && of_one {
                let share = left as f64 / (left + right) as f64;
                whole.values[row * image.columns + c as usize] =
                    (1.0 / (1.0 / a + share * (1.0 / b - 1.0 / a))) as f32;
            }
        }
    }
    whole
}

/// Every cell of a box around everything, and nothing beyond it.
fn equals_its_definition(image: RangeImage, pose: &Pose<3>, config: &TsdfConfig<3>, reach: f64) {
    let mut map = Tsdf3::new(*config).expect("a valid map");
    let frame = Frame::Image(image.clone());
    map.integrate(pose, &frame).unwrap();
    let image = bridged(&image);
    let lattice = *map.lattice();
    let low = lattice.cell_of(pose.translation.map(|v| v - reach)).unwrap();
    let high = lattice.cell_of(pose.translation.map(|v| v + reach)).unwrap();
    let (mut seen, mut close) = (0usize, 0usize);
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let cell = map.store().cell([x, y, z]);
                seen += usize::from(cell.is_some());
                let may = said(&image, pose, lattice.center([x, y, z]), config);
                if may.contains(&Said::Close) {
                    close += 1;
                    continue;
                }
                assert!(
                    may.iter().any(|said| agrees(*said, cell)),
                    "{:?}: {may:?}, but the map has {cell:?}",
                    [x, y, z]
                );
            }
        }
    }
    assert_eq!(seen, map.observed_cells(0.0), "cells beyond the box");
    let all = (0..3).map(|k| (high[k] - low[k] + 1) as usize).product::<usize>();
    assert!(close * 5 < all, "{close} of {all} cells are left to rounding");
}

/// Flat patches with steps between them, holes, and pixels that saw nothing.
fn patchy(seed: u64, near: f32, far: f32) -> impl Fn(usize, usize) -> f32 {
    move |c, r| {
        let mix = |a: u64| {
            let mut x = a.wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x ^= x >> 29;
            x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (x >> 40) as f32 / (1u64 << 24) as f32
        };
        let patch = (c / 7) as u64 * 31 + (r / 5) as u64 * 17;
        let lone = mix((c * 1009 + r) as u64 + 77);
        let base = near + (far - near) * mix(patch);
        let slope =
            0.02 * (far - near) * (mix(patch + 1000) * (c % 7) as f32 + mix(patch + 2000) * (r % 5) as f32);
        match lone {
            l if l < 0.05 => 0.0,
            l if l < 0.10 => -base,
            l if l < 0.12 => near,
            _ if mix(patch + 3000) < 0.15 => 0.0,
            _ => base + slope,
        }
    }
}

fn tilted(x: f64, y: f64, z: f64, q: [f64; 4]) -> Pose<3> {
    Pose::from_quaternion([x, y, z], q).unwrap()
}

fn poses() -> impl Strategy<Value = Pose<3>> {
    let far = prop_oneof![Just([0.0, 0.0, 0.0]), Just([500_000.0, 4_000_000.0, 100.0])];
    (far, prop::array::uniform3(-1.0..1.0f64), prop::array::uniform4(-1.0..1.0f64)).prop_map(|(far, t, q)| {
        let q = if q.iter().map(|v| v * v).sum::<f64>() < 1e-2 { [0.0, 0.0, 0.0, 1.0] } else { q };
        tilted(far[0] + t[0], far[1] + t[1], far[2] + t[2], q)
    })
}

fn configs(resolution: f64, pose: &Pose<3>, carve: bool, squared: bool) -> TsdfConfig<3> {
    let anchor = pose.translation.map(|v| (v / resolution / 64.0).round() * 64.0 * resolution);
    TsdfConfig {
        resolution,
        origin: anchor,
        truncation: 3.0 * resolution,
        w_max: f32::INFINITY,
        carve,
        carve_weight: 0.5,
        weights: if squared { WeightModel::InverseSquare } else { WeightModel::Constant },
        ..Default::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn depth_images_equal_their_definition(pose in poses(), seed in any::<u64>(), carve in any::<bool>(), squared in any::<bool>()) {
        let camera = Pinhole { fx: 30.0, fy: 35.0, cx: 21.3, cy: 14.2 };
        let image = image(Projection::Pinhole(camera), 43, 31, patchy(seed, 0.5, 1.8));
        equals_its_definition(image, &pose, &configs(0.06, &pose, carve, squared), 3.3);
    }

    #[test]
    fn lidar_images_equal_their_definition(
        pose in poses(), seed in any::<u64>(), carve in any::<bool>(), columns in prop_oneof![Just(90usize), Just(61)],
        uniform in any::<bool>(), step in prop_oneof![Just(-1.0f64), Just(1.0)],
    ) {
        let rings = 18;
        let ring = |r: usize| if uniform { 0.5 - 0.05 * r as f32 } else { 0.4 - 0.05 * r as f32 - 0.03 * ((r * r) % 7) as f32 / 7.0 };
        let lidar = Spherical {
            elevations: (0..rings).map(ring).collect(),
            first_azimuth: 0.4,
            azimuth_step: step * std::f64::consts::TAU / 90.0,
        };
        let image = image(Projection::Spherical(lidar), columns, rings, patchy(seed, 0.6, 2.0));
        equals_its_definition(image, &pose, &configs(0.08, &pose, carve, false), 2.8);
    }

    #[test]
    fn parallel_rays_equal_their_definition(pose in poses(), seed in any::<u64>(), carve in any::<bool>()) {
        let rays = Orthographic { first: [-0.8, 0.7], step: [0.04, -0.05] };
        let image = image(Projection::Orthographic { rays, top: 0.3 }, 40, 30, patchy(seed, 0.1, 1.2));
        equals_its_definition(image, &pose, &configs(0.06, &pose, carve, true), 2.2);
    }
}

#[test]
fn a_map_moves_with_the_scan() {
    // The lattice of the second map is that of the first, carried along by whole turns of a quarter and whole meters.
    let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
    let frame = Frame::Image(image(Projection::Pinhole(camera), 64, 48, patchy(5, 0.8, 2.5)));
    let at = tilted(0.3, -0.2, 0.1, [0.2, -0.5, 0.1, 0.8]);
    let config = configs(0.05, &Pose::IDENTITY, true, false);
    let mut here = Tsdf3::new(config).unwrap();
    here.integrate(&at, &frame).unwrap();
    let turn = Pose::<3> {
        rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [500_000.0, 4_000_000.0, 40.0],
    };
    let mut there = Tsdf3::new(TsdfConfig { origin: turn.translation, ..config }).unwrap();
    there.integrate(&(turn * at), &frame).unwrap();
    let lattice = *there.lattice();
    let (mut cells, mut other) = (0, 0);
    for (key, brick) in here.store().bricks_by_age() {
        for i in 0..512 {
            if brick.weights()[i] <= 0.0 {
                continue;
            }
            cells += 1;
            let p = turn.transform_point(here.lattice().center(key.cell(i)));
            match there.store().cell(lattice.cell_of(p).unwrap()) {
                Some(c) if (c.distance - brick.distances()[i]).abs() < 1e-4 => {}
                _ => other += 1,
            }
        }
    }
    // Rounding decides which pixel is the nearest, and which cells are within half a cell of it.
    assert!(cells > 10_000 && other * 500 < cells, "{other} of {cells}");
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
    let mut depth = image(Projection::Pinhole(camera), 64, 48, patchy(3, 0.8, 2.5));
    depth.colors = (0..64 * 48).map(|i| [(i % 251) as u8, (i % 13) as u8, 7]).collect();
    let frames = [Frame::Image(depth)];
    let config = TsdfConfig { color: true, ..configs(0.04, &Pose::IDENTITY, true, true) };
    let fused = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut map = Tsdf3::new(config).unwrap();
            for k in 0..3 {
                let pose = tilted(0.1 * f64::from(k), 0.0, 0.0, [0.1, 0.05 * f64::from(k), 0.0, 1.0]);
                for frame in &frames {
                    map.integrate(&pose, frame).unwrap();
                }
            }
            map
        })
    };
    let one = fused(1);
    assert!(one.colors().unwrap().len() > 20);
    for threads in [2, 8] {
        let many = fused(threads);
        assert!(one.store().bricks_by_age().eq(many.store().bricks_by_age()));
        assert!(one.colors().unwrap().bricks_by_age().eq(many.colors().unwrap().bricks_by_age()));
    }
}

/// All cells by index.
fn cells(map: &Tsdf3) -> HashMap<[i32; 3], SignedDistance> {
    let of = |key: BlockKey<3>| (0..512).map(move |i| key.cell(i));
    let all = map.store().bricks_by_age().flat_map(|(key, _)| of(key));
    all.filter_map(|cell| Some((cell, map.store().cell(cell)?))).collect()
}

#[test]
fn watched_cells_tell_what_happened() {
    let camera = Pinhole { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5 };
    let frame = Frame::Image(image(Projection::Pinhole(camera), 64, 48, patchy(3, 0.8, 2.5)));
    let mut map =
        Tsdf3::new(TsdfConfig { w_max: 2.0, ..configs(0.05, &Pose::IDENTITY, true, false) }).unwrap();
    map.integrate(&Pose::IDENTITY, &frame).unwrap();
    map.watch((-10..10).flat_map(|x| (0..30).map(move |z| [x, 1, z])));
    for _ in 0..3 {
        let before = cells(&map);
        map.integrate(&Pose::IDENTITY, &frame).unwrap();
        let after = cells(&map);
        assert!(map.events().len() > 100);
        for (cell, event) in map.events() {
            assert_eq!(event.weight_before as f32, before[cell].weight);
            assert_eq!(
                (event.after as f32, event.weight_after as f32),
                (after[cell].distance, after[cell].weight)
            );
        }
    }
}

#[test]
fn lattice_is_the_one_that_was_asked_for() {
    let map = Tsdf3::new(TsdfConfig { resolution: 0.1, origin: [1.0, 2.0, 3.0], ..TsdfConfig::textbook() })
        .unwrap();
    assert_eq!(*map.lattice(), Lattice::new([1.0, 2.0, 3.0], 0.1));
}
