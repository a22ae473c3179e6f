//! Marching squares over cell centers.

use super::Contour;
use crate::geom::{BLOCK_EDGE, Grid, Lattice};
use crate::map::DistanceMap;
use crate::store::Store;

/// Treatment of ambiguous squares: those whose diagonal corners have equal signs and neighboring corners different ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ambiguity {
    /// The sign of the bilinear field at its saddle decides (asymptotic decider, Nielson & Hamann 1991),
    /// computed exactly.
    #[default]
    Decide,
    /// The inside corners are always kept apart, as with a fixed table of 16 cases.
    FixedTable,
}

/// Settings of [`marching_squares`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContourSettings {
    /// Cells of smaller weight are unknown; a square with an unknown corner gets no segment. `None`: what fits the map
    /// ([`DistanceMap::min_weight`](crate::map::DistanceMap::min_weight)).
    pub min_weight: Option<f32>,
    /// Treatment of ambiguous squares.
    pub ambiguity: Ambiguity,
}

impl ContourSettings {
    /// The default, with the weight that fits a map written out.
    pub fn of(map: &impl DistanceMap<2>) -> Self {
        Self { min_weight: Some(map.min_weight()), ..Self::default() }
    }
}

const NONE: u32 = u32::MAX;

/// Vertices on the lattice edges around one row of squares; each crossing is made once and shared.
struct RowEdges {
    /// Along x, at the row's lower centers and at its upper ones.
    below: Vec<u32>,
    above: Vec<u32>,
    /// Along y, between the two.
    side: Vec<u32>,
}

/// A row of samples at cell centers.
struct Row {
    values: Vec<f32>,
    observed: Vec<bool>,
}

impl Row {
    fn new(width: usize) -> Self {
        Self { values: vec![0.0; width], observed: vec![false; width] }
    }
}

/// The zero level set of signed distances as oriented segments, free space on the left. `map` is a TSDF, or the cells of
/// one in bricks.
///
/// The corners of a square are the centers of four neighboring cells; a vertex is placed on an edge by linear interpolation,
/// `t = D_a / (D_a - D_b)`. Negative is inside, zero is free. O(cells of the box around what was observed).
pub fn marching_squares(map: &impl DistanceMap<2>, settings: &ContourSettings) -> Contour {
    let min_weight = settings.min_weight.unwrap_or(map.min_weight());
    let is_observed = |weight: f32| weight > 0.0 && weight >= min_weight;
    if let Some(dense) = map.dense() {
        let planes = dense.planes();
        let weight = planes.weights();
        return level_set(dense.grid(), planes.distances(), |i| is_observed(weight[i]), settings.ambiguity);
    }
    let bricks = map.bricks();
    let keys = bricks.keys();
    let (Some(low), Some(high)) = (keys.first(), keys.last()) else { return Contour::default() };
    let columns = keys.iter().fold([i32::MAX, i32::MIN], |[a, b], key| [a.min(key.0[0]), b.max(key.0[0])]);
    let edge = BLOCK_EDGE as i32;
    let first = [columns[0] * edge, low.0[1] * edge];
    let shape = [columns[1] - columns[0] + 1, high.0[1] - low.0[1] + 1].map(|n| n as usize * BLOCK_EDGE);
    // Keys ascend along y, then along x.
    let load = |y: usize, row: &mut Row| {
        row.observed.fill(false);
        let (line, from) = (low.0[1] + (y / BLOCK_EDGE) as i32, y % BLOCK_EDGE * BLOCK_EDGE);
        let start = keys.partition_point(|key| key.0[1] < line);
        for key in keys[start..].iter().take_while(|key| key.0[1] == line) {
            let Some(brick) = bricks.brick(*key) else { continue };
            let to = (key.0[0] - columns[0]) as usize * BLOCK_EDGE;
            row.values[to..to + BLOCK_EDGE].copy_from_slice(&brick.distances()[from..from + BLOCK_EDGE]);
            let weights = &brick.weights()[from..from + BLOCK_EDGE];
            row.observed[to..].iter_mut().zip(weights).for_each(|(o, &w)| *o = is_observed(w));
        }
    };
    extract(&Samples { lattice: bricks.lattice(), first, shape }, load, settings.ambiguity)
}

/// [`marching_squares`] over any samples at cell centers, x fastest; a square with a corner that is not `observed` gets no
/// segment.
pub fn level_set(
    grid: &Grid<2>,
    samples: &[f32],
    observed: impl Fn(usize) -> bool,
    ambiguity: Ambiguity,
) -> Contour {
    let width = grid.shape[0];
    let load = |y: usize, row: &mut Row| {
        row.values.copy_from_slice(&samples[y * width..][..width]);
        row.observed.iter_mut().enumerate().for_each(|(x, o)| *o = observed(y * width + x));
    };
    extract(&Samples { lattice: &grid.lattice, first: [0; 2], shape: grid.shape }, load, ambiguity)
}

/// Where a box of samples lies.
struct Samples<'a> {
    lattice: &'a Lattice<2>,
    /// Its lowest cell.
    first: [i32; 2],
    /// Cells along each axis.
    shape: [usize; 2],
}

/// The level set of samples that are loaded row by row.
fn extract(samples: &Samples<'_>, load: impl Fn(usize, &mut Row), ambiguity: Ambiguity) -> Contour {
    let [width, height] = samples.shape;
    let mut contour = Contour::default();
    if width < 2 || height < 2 {
        return contour;
    }
    let mut edges = RowEdges { below: vec![NONE; width], above: vec![NONE; width], side: vec![NONE; width] };
    let (mut lower, mut upper) = (Row::new(width), Row::new(width));
    load(0, &mut upper);
    for y in 0..height - 1 {
        std::mem::swap(&mut lower, &mut upper);
        load(y + 1, &mut upper);
        std::mem::swap(&mut edges.below, &mut edges.above);
        edges.above.fill(NONE);
        edges.side.fill(NONE);
        for x in 0..width - 1 {
            // Corners counter-clockwise from the lower left.
            let d = [lower.values[x], lower.values[x + 1], upper.values[x + 1], upper.values[x]];
            let code = d.iter().enumerate().fold(0, |code, (n, &v)| code | usize::from(v < 0.0) << n);
            if code == 0 || code == 15 {
                continue;
            }
            let known = [lower.observed[x], lower.observed[x + 1], upper.observed[x + 1], upper.observed[x]];
            if known != [true; 4] {
                continue;
            }
            for &[from, to] in segments(code, &d, ambiguity) {
                let ends = [from, to].map(|edge| vertex(&mut contour, &mut edges, samples, [x, y], &d, edge));
                contour.segments.push(ends);
            }
        }
    }
    contour.vertices.shrink_to_fit();
    contour.segments.shrink_to_fit();
    contour
}

/// Pairs of edges to join: from the edge where, counter-clockwise, the inside begins to the one where it ends.
/// Edge `n` runs from corner `n` to corner `n + 1`.
pub(crate) fn segments(code: usize, d: &[f32; 4], ambiguity: Ambiguity) -> &'static [[u8; 2]] {
    const TABLE: [&[[u8; 2]]; 16] = [
        &[],
        &[[3, 0]],
        &[[0, 1]],
        &[[3, 1]],
        &[[1, 2]],
        &[[3, 0], [1, 2]],
        &[[0, 2]],
        &[[3, 2]],
        &[[2, 3]],
        &[[2, 0]],
        &[[0, 1], [2, 3]],
        &[[2, 1]],
        &[[1, 3]],
        &[[1, 0]],
        &[[0, 3]],
        &[],
    ];
    // The saddle lies inside where the product of the inside corners is the larger one; products of two f32
    // are exact in f64, and so is the sign of their difference.
    let [a, b, c, e] = d.map(f64::from);
    match (code, ambiguity) {
        (5, Ambiguity::Decide) if a * c > b * e => &[[3, 2], [1, 0]],
        (10, Ambiguity::Decide) if b * e > a * c => &[[0, 3], [2, 1]],
        _ => TABLE[code],
    }
}

fn vertex(
    contour: &mut Contour,
    edges: &mut RowEdges,
    samples: &Samples<'_>,
    [x, y]: [usize; 2],
    d: &[f32; 4],
    edge: u8,
) -> u32 {
    // Interpolate from the lower end to the upper one, so that both squares at an edge compute the same bits.
    let (slot, low, axis, da, db) = match edge {
        0 => (&mut edges.below[x], [x, y], 0, d[0], d[1]),
        1 => (&mut edges.side[x + 1], [x + 1, y], 1, d[1], d[2]),
        2 => (&mut edges.above[x], [x, y + 1], 0, d[3], d[2]),
        _ => (&mut edges.side[x], [x, y], 1, d[0], d[3]),
    };
    if *slot == NONE {
        let lattice = samples.lattice;
        let mut p = lattice.center([0, 1].map(|k| samples.first[k] + low[k] as i32));
        p[axis] += crossing_place(da, db) * lattice.resolution;
        *slot = contour.vertices.len() as u32;
        contour.vertices.push(p);
    }
    *slot
}

/// Position of the zero crossing between two cell centers with these values of different sign, in cells from the lower one.
#[inline]
pub(crate) fn crossing_place(a: f32, b: f32) -> f64 {
    let (a, b) = (f64::from(a), f64::from(b));
    a / (a - b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::{distance, sub};
    use crate::map::Tsdf2;
    use crate::store::Bricks;
    use proptest::prelude::*;

    /// A field with these values at the centers, observed where the value is not NaN.
    pub(crate) fn field(shape: [usize; 2], value: impl Fn([f64; 2]) -> f64) -> Tsdf2 {
        crate::testing::tsdf(Grid::new([0.0; 2], 1.0, shape), 1e6, value)
    }

    #[test]
    fn a_circle_is_closed_and_round_and_oriented() {
        let tsdf = field([40, 40], |p| distance(p, [20.3, 19.8]) - 11.7);
        let contour = marching_squares(&tsdf, &ContourSettings::default());
        let lines = contour.polylines();
        assert_eq!(lines.len(), 1);
        assert!(lines[0].closed);
        assert!(contour.vertices.iter().all(|&v| (distance(v, [20.3, 19.8]) - 11.7).abs() < 0.02));
        assert!((contour.length() - std::f64::consts::TAU * 11.7).abs() < 0.2);
        for s in &contour.segments {
            let [a, b] = s.map(|i| contour.vertices[i as usize]);
            let outward = sub(a, [20.3, 19.8]);
            let along = sub(b, a);
            // Free space, which is outside, on the left: the circle runs clockwise around its inside.
            assert!(outward[0] * along[1] - outward[1] * along[0] < 0.0);
        }
    }

    #[test]
    fn unobserved_corners_give_no_geometry() {
        let tsdf = field([20, 20], |p| if p[1] > 10.0 { f64::NAN } else { p[0] - 9.9 });
        let contour = marching_squares(&tsdf, &ContourSettings::default());
        assert_eq!(contour.segments.len(), 9);
        assert!(!contour.polylines()[0].closed);
        let strict = ContourSettings { min_weight: Some(1.5), ..Default::default() };
        assert!(marching_squares(&tsdf, &strict).segments.is_empty());
    }

    #[test]
    fn the_saddle_decides_ambiguous_squares() {
        // Inside at the lower left and upper right; f(x, y) = bilinear.
        let corners = |a: f64, b: f64, c: f64, e: f64| {
            field([2, 2], move |p| match (p[0] > 1.0, p[1] > 1.0) {
                (false, false) => a,
                (true, false) => b,
                (true, true) => c,
                (false, true) => e,
            })
        };
        let joined = |tsdf: &Tsdf2, ambiguity| {
            let contour = marching_squares(tsdf, &ContourSettings { ambiguity, ..Default::default() });
            assert_eq!(contour.segments.len(), 2);
            // A segment around the lower left corner alone keeps the inside apart.
            let first = contour.segments[0].map(|i| contour.vertices[i as usize]);
            !first.iter().all(|v| v[0] + v[1] < 2.0)
        };
        let deep = corners(-3.0, 1.0, -3.0, 1.0);
        let shallow = corners(-1.0, 3.0, -1.0, 3.0);
        assert!(joined(&deep, Ambiguity::Decide));
        assert!(!joined(&shallow, Ambiguity::Decide));
        assert!(!joined(&deep, Ambiguity::FixedTable));
        assert!(!joined(&corners(-1.0, 1.0, -1.0, 1.0), Ambiguity::Decide));
    }

    proptest! {
        #[test]
        fn contours_of_anything_are_chains_that_end_only_at_the_border(
            values in prop::collection::vec(-1.0..1.0f64, 144), zeros: bool,
        ) {
            let tsdf = field([12, 12], |p| {
                let v = values[p[0] as usize + 12 * p[1] as usize];
                if zeros && v.abs() < 0.2 { 0.0 } else { v }
            });
            let contour = marching_squares(&tsdf, &ContourSettings::default());
            let mut starts = vec![0; contour.vertices.len()];
            let mut ends = vec![0; contour.vertices.len()];
            for s in &contour.segments {
                starts[s[0] as usize] += 1;
                ends[s[1] as usize] += 1;
            }
            for (i, v) in contour.vertices.iter().enumerate() {
                prop_assert!(starts[i] <= 1 && ends[i] <= 1);
                let at_border = v.iter().any(|&c| c == 0.5 || c == 11.5);
                prop_assert!(at_border || starts[i] + ends[i] == 2);
            }
            let joined: usize = contour.polylines().iter().map(|l| l.vertices.len() - usize::from(!l.closed)).sum();
            prop_assert_eq!(joined, contour.segments.len());
        }
    }

    proptest! {
        /// The same cells in bricks have the same contour, vertex by vertex.
        #[test]
        fn bricks_have_the_contour_of_an_array(
            shape in [2usize..30, 2usize..30],
            values in prop::collection::vec(prop_oneof![4 => -1.0..1.0f64, 1 => Just(f64::NAN)], 900),
            far in any::<bool>(),
        ) {
            let at = |p: [f64; 2]| values[(p[1] as usize * 30 + p[0] as usize) % 900];
            let tsdf = field(shape, at);
            let settings = ContourSettings::of(&tsdf);
            // Another cell 0 moves the borders of the bricks, but not the cells.
            let origin = if far { [-3.0, -21.0] } else { [0.0; 2] };
            let bricks = Bricks::of_dense(tsdf.store(), Lattice::new(origin, 1.0)).unwrap();
            prop_assert_eq!(marching_squares(&bricks, &settings), marching_squares(&tsdf, &settings));
        }
    }
}
