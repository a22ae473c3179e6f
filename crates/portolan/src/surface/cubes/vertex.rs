//! The vertices of a brick: crossings of edges, and centers of cubes.

use super::numbering::edge_start;
use super::samples::Samples;

/// The attributes of vertices beside their position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Attributes {
    pub(super) normals: bool,
    pub(super) colors: bool,
    /// [`Samples::range`].
    pub(super) ranges: bool,
}

/// Least distance of a crossing from both nodes (cells): with values of exactly zero there are still no triangles without
/// area and no two vertices in one place. It moves a vertex by 1/256 of a cell at most.
pub(super) const MARGIN: f32 = 1.0 / 256.0;

/// Color of a vertex between nodes without color.
const NO_COLOR: [u8; 3] = [128; 3];

#[derive(Clone, Copy, Default)]
pub(super) struct Vertex {
    pub(super) position: [f32; 3],
    pub(super) gradient: [f32; 3],
    pub(super) color: [u8; 3],
    pub(super) range: f32,
}

/// Position of the zero crossing between two nodes with these values of different sign, in cells from the lower one.
#[inline(always)]
pub(crate) fn crossing_place(a: f32, b: f32) -> f32 {
    crossing_beyond(MARGIN, a, b)
}

/// [`crossing_place`] with another distance from both nodes: 0, and zeros are crossings in a node.
#[inline(always)]
pub(super) fn crossing_beyond(margin: f32, a: f32, b: f32) -> f32 {
    (a / (a - b)).clamp(margin, 1.0 - margin)
}

/// The crossing of the edge that starts at `node`: linear between its ends, from the lower one to the upper one, so
/// that every cube at the edge computes the same bits.
#[inline(always)]
pub(super) fn crossing(samples: &impl Samples, node: [i32; 3], axis: usize, want: Attributes) -> Vertex {
    let mut end = node;
    end[axis] += 1;
    let (a, b) = (samples.value(node), samples.value(end));
    let t = crossing_beyond(samples.margin(), a, b);
    let mut vertex =
        Vertex { position: [node[0] as f32, node[1] as f32, node[2] as f32], ..Vertex::default() };
    vertex.position[axis] += t;
    if want.normals {
        let (ga, gb) = (samples.gradient(node), samples.gradient(end));
        for k in 0..3 {
            vertex.gradient[k] = ga[k] + t * (gb[k] - ga[k]);
        }
    }
    if want.colors {
        vertex.color = color(samples, node, end, t);
    }
    if want.ranges {
        vertex.range = samples.range(node, axis);
    }
    vertex
}

/// The color between two nodes, each weighted by its weight and its nearness.
fn color(samples: &impl Samples, node: [i32; 3], end: [i32; 3], t: f32) -> [u8; 3] {
    let ends = [(samples.color(node), 1.0 - t), (samples.color(end), t)];
    let (mut sum, mut total) = ([0.0f32; 3], 0.0);
    for (c, near) in ends.into_iter().filter_map(|(c, near)| Some((c?, near))) {
        let w = f32::from(c.weight) * near;
        total += w;
        (0..3).for_each(|k| sum[k] += w * f32::from(c.rgb[k]));
    }
    if total > 0.0 { sum.map(|s| (s / total / 257.0 + 0.5) as u8) } else { NO_COLOR }
}

/// The mean of some crossings of a cube.
pub(super) fn centre(around: &[u8], at: [i32; 3], samples: &impl Samples, want: Attributes) -> Vertex {
    let mut mean = Vertex::default();
    let mut color = [0u32; 3];
    let share = 1.0 / around.len() as f32;
    if want.ranges {
        mean.range = samples.cube_range(at).unwrap_or(0.0);
    }
    let want = Attributes { ranges: false, ..want };
    for &edge in around {
        let (axis, c) = edge_start(edge);
        let node = std::array::from_fn(|k| at[k] + i32::from(c >> k & 1));
        let v = crossing(samples, node, axis, want);
        for k in 0..3 {
            mean.position[k] += share * v.position[k];
            mean.gradient[k] += share * v.gradient[k];
            color[k] += u32::from(v.color[k]);
        }
    }
    mean.color = color.map(|sum| (sum / around.len() as u32) as u8);
    mean
}
