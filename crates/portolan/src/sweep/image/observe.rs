//! Distances at the centers of a block's cells from a range image: 64 lanes at a time.
//!
//! Every loop runs over the 64 lanes of an octant without calls and without branches, so that it stands in the widest vectors that the
//! processor has; no operation depends on the width, so that all versions give the same bits.

use super::lanes::{Gradients, LANES, Lanes, Projected, Steps};
use super::padded_image::PaddedImage;
use super::projector::Projector;
use super::search::Octants;
use crate::geom::block_cells;
use multiversion::multiversion;

/// Cells of a block.
pub(super) const BLOCK: usize = block_cells::<3>();

/// An image and how it is read.
pub(super) struct ImageLookup<'a> {
    pub projector: &'a Projector,
    pub image: &'a PaddedImage,
    pub truncation: f32,
    /// Weight of free space beyond the truncation; 0: it gets nothing.
    pub carve_weight: f32,
    /// Weights fall with the square of the range beyond 1 m.
    pub inverse_square: bool,
    /// A ray counts for surfaces this far aside, where it has no neighbors on the same surface (meters).
    pub aside: f32,
}

/// The centers of a block's cells in the sensor's frame: the first one, and steps along the block's axes (meters).
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockCenters {
    pub first: [f32; 3],
    pub steps: [[f32; 3]; 3],
}

impl BlockCenters {
    /// The centers of an octant, 4 x 4 x 4.
    #[inline(always)]
    pub(super) fn octant(&self, octant: usize) -> [Lanes; 3] {
        let mut p = [[0.0; LANES]; 3];
        let corner: [f32; 3] = std::array::from_fn(|axis| (4 * (octant >> axis & 1)) as f32);
        for k in 0..3 {
            let [sx, sy, sz] = [self.steps[0][k], self.steps[1][k], self.steps[2][k]];
            for l in 0..LANES {
                let (x, y, z) = ((l & 3) as f32, (l >> 2 & 3) as f32, (l >> 4) as f32);
                p[k][l] = self.first[k] + (corner[0] + x) * sx + (corner[1] + y) * sy + (corner[2] + z) * sz;
            }
        }
        p
    }
}

/// Position in its block of cell `lane` of an octant.
#[inline(always)]
pub(super) fn cell_of(octant: usize, lane: usize) -> usize {
    let corner = (octant & 1) * 4 + (octant >> 1 & 1) * 32 + (octant >> 2) * 256;
    corner + (lane & 3) + (lane >> 2 & 3) * 8 + (lane >> 4) * 64
}

/// Distance and weight of every cell of a block, in the widest vectors there are; returns how many have a weight.
#[multiversion(targets = "simd")]
pub(super) fn observe_block(
    view: &ImageLookup<'_>,
    centers: &BlockCenters,
    octants: Octants,
    distance: &mut [f32; BLOCK],
    weight: &mut [f32; BLOCK],
) {
    block(view, centers, octants, distance, weight);
}

#[inline(always)]
fn block(
    view: &ImageLookup<'_>,
    centers: &BlockCenters,
    octants: Octants,
    distance: &mut [f32; BLOCK],
    weight: &mut [f32; BLOCK],
) {
    weight.fill(0.0);
    for octant in 0..8 {
        let (mut d, mut w) = ([view.truncation; LANES], [view.carve_weight; LANES]);
        if octants.mixed >> octant & 1 == 1 {
            observe(view, &centers.octant(octant), &mut d, &mut w);
        } else if octants.free >> octant & 1 == 0 {
            continue;
        }
        for row in 0..LANES / 4 {
            let cell = cell_of(octant, 4 * row);
            distance[cell..cell + 4].copy_from_slice(&d[4 * row..4 * row + 4]);
            weight[cell..cell + 4].copy_from_slice(&w[4 * row..4 * row + 4]);
        }
    }
}

/// Where 64 points fall: the pixel left above of each, and how far right below of its center.
pub(super) struct Places {
    pub index: [u32; LANES],
    /// Row of that pixel, the border counted.
    pub row: [u32; LANES],
    pub right: Lanes,
    pub below: Lanes,
}

#[inline(always)]
pub(super) fn places(u: &Lanes, v: &Lanes, stride: usize) -> Places {
    const MAGIC: f32 = 8_388_608.0; // 2^23: adding it leaves the integer in the low bits
    let mut at = Places { index: [0; LANES], row: [0; LANES], right: [0.0; LANES], below: [0.0; LANES] };
    let stride = stride as u32;
    for l in 0..LANES {
        let (iu, iv) = ((u[l] - 0.5).max(0.0) + MAGIC, (v[l] - 0.5).max(0.0) + MAGIC);
        at.right[l] = u[l] - (iu - MAGIC);
        at.below[l] = v[l] - (iv - MAGIC);
        at.row[l] = iv.to_bits() & 0x7f_ffff;
        at.index[l] = at.row[l] * stride + (iu.to_bits() & 0x7f_ffff);
    }
    at
}

/// What a surface weighs at most beyond the truncation along a ray, where it is met at a slant and is nearer than that across, and
/// what it weighs of free space at least: more than the least weight that counts ([`least_weight`](crate::map::least_weight),
/// half of free space), so that what was seen once is a surface, and less than where it is seen better.
const SLANTED: f32 = 0.15;
const SLANTED_OF_FREE: f32 = 0.52;

/// Weight of a surface at a distance (in truncations): it falls linearly to 0 behind it.
#[inline(always)]
fn taper(d: f32) -> f32 {
    (1.0 + d).clamp(0.0, 1.0)
}

#[inline(always)]
fn observe(view: &ImageLookup<'_>, p: &[Lanes; 3], distance: &mut Lanes, weight: &mut Lanes) {
    let stride = view.image.stride;
    let seen = view.projector.project(p);
    let at = places(&seen.u, &seen.v, stride);
    let mut corners = [[0.0f32; LANES]; 4];
    let linear = &view.image.linear[..];
    // Checked without a way out of the loop, with indices that are seen to have 31 bits: so the loads are gathers.
    let n = linear.len().saturating_sub(stride + 1);
    let (above, below) = (&linear[..n], &linear[stride..][..n]);
    let (above_right, below_right) = (&linear[1..][..n], &linear[stride + 1..][..n]);
    for l in 0..LANES {
        let i = (at.index[l] & 0x3fff_ffff) as usize;
        corners[0][l] = if i < n { above[i] } else { 0.0 };
        corners[1][l] = if i < n { above_right[i] } else { 0.0 };
        corners[2][l] = if i < n { below[i] } else { 0.0 };
        corners[3][l] = if i < n { below_right[i] } else { 0.0 };
    }
    let parallel = view.projector.is_parallel();
    let (tau, per_tau, carve) = (view.truncation, 1.0 / view.truncation, view.carve_weight);
    let slanted = SLANTED.max(SLANTED_OF_FREE * carve);
    let mut torn = [0u32; LANES];
    let mut surface = Gradients { value: [0.0; LANES], right: [0.0; LANES], below: [0.0; LANES] };
    for l in 0..LANES {
        torn[l] = corners[0][l].to_bits() >> 31;
        let [a, b, c, d] =
            [corners[0][l].abs(), corners[1][l].abs(), corners[2][l].abs(), corners[3][l].abs()];
        let (above, below) = (a + at.right[l] * (b - a), c + at.right[l] * (d - c));
        surface.value[l] = above + at.below[l] * (below - above);
        surface.right[l] = (b - a) + at.below[l] * ((d - c) - (b - a));
        surface.below[l] = below - above;
    }
    let cosine = view.projector.cosines(&surface, &seen, &at.row);
    for l in 0..LANES {
        let q = surface.value[l];
        let range = if parallel { q } else { seen.scale[l] / q };
        let d = range - seen.length[l];
        let across = d * cosine[l];
        let head_on = if d > tau { 0.0 } else { taper(d * per_tau) };
        let w = if across > tau {
            if seen.length[l] >= 0.0 { carve } else { 0.0 }
        } else {
            head_on.max(taper(across * per_tau).min(slanted))
        };
        let w = if view.inverse_square & !parallel { w / (range.max(1.0) * range.max(1.0)) } else { w };
        distance[l] = d.max(-tau).min(tau);
        weight[l] = if q > 0.0 { w } else { 0.0 };
    }
    if torn.iter().fold(0, |any, t| any | t) != 0 {
        let (other, other_weight) = alone(view, &seen, &at);
        for l in 0..LANES {
            // Bits, not branches: a choice between two places in memory does not stand in vectors.
            let mask = 0u32.wrapping_sub(torn[l]);
            let choose = |a: f32, b: f32| f32::from_bits(a.to_bits() & mask | b.to_bits() & !mask);
            distance[l] = choose(other[l], distance[l]);
            weight[l] = choose(other_weight[l], weight[l]);
        }
    }
    if !view.image.cosine.is_empty() {
        for l in 0..LANES {
            let nearest = nearest(at.index[l] as usize, at.right[l], at.below[l], stride);
            weight[l] *= view.image.cosine[nearest];
        }
    }
}

/// The pixel nearest to a place.
#[inline(always)]
pub(super) fn nearest(index: usize, right: f32, below: f32, stride: usize) -> usize {
    index + usize::from(right >= 0.5) + if below >= 0.5 { stride } else { 0 }
}

/// Distances and weights as if no point were between pixels of one surface: the nearest ray counts for its surface, but only
/// as far aside as half a cell; beyond, what is free is free up to the nearest of the four. A ray that met nothing is
/// free.
#[inline(always)]
fn alone(view: &ImageLookup<'_>, seen: &Projected, at: &Places) -> (Lanes, Lanes) {
    let stride = view.image.stride;
    let value = &view.image.value[..];
    let mut steps = Steps { right: [0.0; LANES], below: [0.0; LANES], row: [0; LANES] };
    let mut own = [0.0f32; LANES];
    for l in 0..LANES {
        let (right, below) = (u32::from(at.right[l] >= 0.5), u32::from(at.below[l] >= 0.5));
        steps.right[l] = at.right[l] - right as f32;
        steps.below[l] = at.below[l] - below as f32;
        steps.row[l] = (at.row[l] + below).max(1) - 1;
        let i = ((at.index[l] + right + below * stride as u32) & 0x3fff_ffff) as usize;
        own[l] = if i < value.len() { value[i] } else { 0.0 };
    }
    let aside = view.projector.aside(&steps, seen);
    let mut least = [0.0f32; LANES];
    // Where free space gets nothing, the nearest ray is enough.
    if view.carve_weight > 0.0 {
        let n = value.len().saturating_sub(stride + 1);
        let (above, below) = (&value[..n], &value[stride..][..n]);
        let (above_right, below_right) = (&value[1..][..n], &value[stride + 1..][..n]);
        for l in 0..LANES {
            let i = (at.index[l] & 0x3fff_ffff) as usize;
            let a = if i < n { above[i].abs() } else { 0.0 };
            let b = if i < n { above_right[i].abs() } else { 0.0 };
            let c = if i < n { below[i].abs() } else { 0.0 };
            let d = if i < n { below_right[i].abs() } else { 0.0 };
            least[l] = a.min(b).min(c.min(d));
        }
    }
    let squared = view.inverse_square & !view.projector.is_parallel();
    let (tau, carve) = (view.truncation, view.carve_weight);
    let (mut distance, mut weight) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let near = aside[l] <= view.aside;
        let value = if near { own[l].abs() } else { least[l] };
        let range = value * seen.scale[l];
        let d = range - seen.length[l];
        let free = if seen.length[l] >= 0.0 { carve } else { 0.0 };
        let surface = taper(d / tau);
        let surface = if near & (own[l] > 0.0) { surface } else { 0.0 };
        let w = if d > tau { free } else { surface };
        let w = if squared { w / (range.max(1.0) * range.max(1.0)) } else { w };
        distance[l] = d.min(tau);
        weight[l] = if value > 0.0 { w } else { 0.0 };
    }
    (distance, weight)
}

#[cfg(test)]
mod tests {
    use super::super::padded_image::Cleaning;
    use super::*;
    use crate::scan::{Orthographic, Pinhole, Projection, RangeImage, Spherical};
    use crate::sweep::WeightModel;
    use proptest::prelude::*;

    /// The widest vectors give the bits that any processor gives.
    fn same_bits(projection: Projection, values: Vec<f32>, first: [f32; 3], weights: WeightModel) {
        let (columns, rows) = (24, 12);
        let image = RangeImage::new(projection, columns, rows, values);
        let projector = Projector::of(&image);
        let mut padded = PaddedImage::default();
        let how = Cleaning { min_range: 0.0, max_range: 50.0, step: 0.03, weights, colors: false };
        padded.fill(&image, &projector, &how);
        let view = ImageLookup {
            projector: &projector,
            image: &padded,
            truncation: 0.3,
            carve_weight: 0.5,
            inverse_square: weights.parts().0,
            aside: 0.05,
        };
        let centers = BlockCenters { first, steps: [[0.08, 0.06, 0.0], [-0.06, 0.08, 0.0], [0.0, 0.0, 0.1]] };
        let [mut a, mut b, mut c, mut d] = [[0.0f32; BLOCK]; 4];
        let octants = Octants { free: 4, mixed: 0xfb, complete: 0 };
        observe_block(&view, &centers, octants, &mut a, &mut b);
        block(&view, &centers, octants, &mut c, &mut d);
        let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&b), bits(&d));
        let said = |d: &[f32], w: &[f32]| {
            bits(d).into_iter().zip(w.to_vec()).filter(|x| x.1 > 0.0).collect::<Vec<_>>()
        };
        assert_eq!(said(&a, &b), said(&c, &d));
    }

    proptest! {
        #[test]
        fn every_width_gives_the_same_bits(
            values in prop::collection::vec(prop_oneof![4 => 0.5..3.0f32, 4 => 1.0..1.1f32, 1 => Just(0.0f32), 1 => -3.0..-0.5f32], 24 * 12),
            first in prop::array::uniform3(-2.0..2.0f32), cosine in any::<bool>(),
        ) {
            let weights = if cosine { WeightModel::InverseSquareCosIncidence } else { WeightModel::InverseSquare };
            let camera = Pinhole { fx: 20.0, fy: 20.0, cx: 11.5, cy: 5.5 };
            same_bits(Projection::Pinhole(camera), values.clone(), first, weights);
            for bend in [0.0, 0.01] {
                let lidar = Spherical {
                    elevations: (0..12u8).map(|r| 0.6 - 0.1 * f32::from(r) - bend * f32::from(r % 3)).collect(),
                    first_azimuth: 0.3,
                    azimuth_step: std::f64::consts::TAU / 24.0,
                };
                same_bits(Projection::Spherical(lidar), values.clone(), first, weights);
            }
            let rays = Orthographic { first: [-1.0, -1.0], step: [0.1, 0.1] };
            same_bits(Projection::Orthographic { rays, top: 2.0 }, values, first, weights);
        }
    }
}
