//! What a range image says about the centres of a block's cells: 64 lanes at a time.
//!
//! Every loop runs over lanes without calls and without branches, so that it stands in the widest vectors that the
//! processor has; no operation depends on the width, so that all versions give the same bits.

use super::lens::{LANES, Lanes, Lens};
use super::padded_image::PaddedImage;
use multiversion::multiversion;

/// An image and how it is read.
pub(super) struct View<'a> {
    pub lens: &'a Lens,
    pub image: &'a PaddedImage,
    pub truncation: f32,
    /// Weight of free space beyond the truncation; 0: nothing is said of it.
    pub carve_weight: f32,
    /// Weights fall with the square of the range beyond 1 m.
    pub inverse_square: bool,
    /// A ray speaks of surfaces this far aside, where it has no neighbours on the same surface (metres).
    pub aside: f32,
}

/// The centres of a block's cells in the sensor's frame: the first one, and steps along the block's axes (metres).
#[derive(Clone, Copy, Debug)]
pub(super) struct Centres {
    pub first: [f32; 3],
    pub steps: [[f32; 3]; 3],
}

impl Centres {
    /// A layer of 8 x 8 centres.
    #[inline(always)]
    pub(super) fn layer(&self, z: usize) -> [Lanes; 3] {
        let mut p = [[0.0; LANES]; 3];
        for k in 0..3 {
            let start = self.first[k] + z as f32 * self.steps[2][k];
            let (sx, sy) = (self.steps[0][k], self.steps[1][k]);
            for l in 0..LANES {
                p[k][l] = start + (l & 7) as f32 * sx + (l >> 3) as f32 * sy;
            }
        }
        p
    }
}

/// Distance and weight of every cell of a block, in the widest vectors there are.
#[multiversion(targets = "simd")]
pub(super) fn observe_block(view: &View<'_>, centres: &Centres, distance: &mut [f32], weight: &mut [f32]) {
    layers(view, centres, distance, weight);
}

/// The same, compiled for any processor.
#[cfg(test)]
pub(super) fn observe_block_plain(
    view: &View<'_>,
    centres: &Centres,
    distance: &mut [f32],
    weight: &mut [f32],
) {
    layers(view, centres, distance, weight);
}

#[inline(always)]
fn layers(view: &View<'_>, centres: &Centres, distance: &mut [f32], weight: &mut [f32]) {
    let layers = distance.chunks_exact_mut(LANES).zip(weight.chunks_exact_mut(LANES));
    for (z, (distance, weight)) in layers.enumerate() {
        if let (Ok(distance), Ok(weight)) = (distance.try_into(), weight.try_into()) {
            layer(view, &centres.layer(z), distance, weight);
        }
    }
}

/// Where 64 points fall: the pixel left above of each, and how far right below of its centre.
pub(super) struct Places {
    pub index: [u32; LANES],
    pub right: Lanes,
    pub below: Lanes,
}

#[inline(always)]
pub(super) fn places(u: &Lanes, v: &Lanes, stride: usize) -> Places {
    const MAGIC: f32 = 8_388_608.0; // 2^23: adding it leaves the integer in the low bits
    let mut at = Places { index: [0; LANES], right: [0.0; LANES], below: [0.0; LANES] };
    let stride = stride as u32;
    for l in 0..LANES {
        let (iu, iv) = ((u[l] - 0.5).max(0.0) + MAGIC, (v[l] - 0.5).max(0.0) + MAGIC);
        at.right[l] = u[l] - (iu - MAGIC);
        at.below[l] = v[l] - (iv - MAGIC);
        at.index[l] = (iv.to_bits() & 0x7f_ffff) * stride + (iu.to_bits() & 0x7f_ffff);
    }
    at
}

#[inline(always)]
fn layer(view: &View<'_>, p: &[Lanes; 3], distance: &mut Lanes, weight: &mut Lanes) {
    let stride = view.image.stride;
    let seen = view.lens.project(p);
    let at = places(&seen.u, &seen.v, stride);
    let mut corners = [[0.0f32; LANES]; 4];
    let linear = &view.image.linear[..];
    for l in 0..LANES {
        let i = at.index[l] as usize;
        let (above, below) = (&linear[i..i + 2], &linear[i + stride..i + stride + 2]);
        (corners[0][l], corners[1][l], corners[2][l], corners[3][l]) =
            (above[0], above[1], below[0], below[1]);
    }
    let parallel = view.lens.is_parallel();
    let (tau, per_tau, carve) = (view.truncation, 1.0 / view.truncation, view.carve_weight);
    let mut torn = [0u32; LANES];
    for l in 0..LANES {
        torn[l] = corners[0][l].to_bits() >> 31;
        let [a, b, c, d] =
            [corners[0][l].abs(), corners[1][l].abs(), corners[2][l].abs(), corners[3][l].abs()];
        let (above, below) = (a + at.right[l] * (b - a), c + at.right[l] * (d - c));
        let q = above + at.below[l] * (below - above);
        let range = if parallel { q } else { seen.scale[l] / q };
        let d = range - seen.length[l];
        let free = d > tau;
        let w = if free {
            if seen.length[l] >= 0.0 { carve } else { 0.0 }
        } else {
            (1.0 + d * per_tau).clamp(0.0, 1.0)
        };
        let w = if view.inverse_square & !parallel { w / (range.max(1.0) * range.max(1.0)) } else { w };
        distance[l] = d.min(tau);
        weight[l] = if q > 0.0 { w } else { 0.0 };
    }
    if torn.iter().fold(0, |any, t| any | t) != 0 {
        for l in 0..LANES {
            if torn[l] != 0 {
                let spot = Spot {
                    index: at.index[l] as usize,
                    right: at.right[l],
                    below: at.below[l],
                    length: seen.length[l],
                    scale: seen.scale[l],
                };
                (distance[l], weight[l]) = alone(view, &spot);
            }
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

/// One point between four pixels that are not of one surface.
struct Spot {
    index: usize,
    right: f32,
    below: f32,
    length: f32,
    scale: f32,
}

/// The nearest ray speaks of its surface, but only as far aside as half a cell; beyond, what is free is free up to the
/// nearest of the four. A ray that met nothing says that it is free.
#[inline(never)]
fn alone(view: &View<'_>, spot: &Spot) -> (f32, f32) {
    const NOTHING: (f32, f32) = (0.0, 0.0);
    let stride = view.image.stride;
    let value = &view.image.value;
    let pixel = nearest(spot.index, spot.right, spot.below, stride);
    let v = value[pixel];
    let (du, dv) = (spot.right - (spot.right + 0.5).floor(), spot.below - (spot.below + 0.5).floor());
    let aside = view.lens.aside(du, dv, (pixel / stride).saturating_sub(1), spot.length, spot.scale);
    let (value, hit) = if aside <= view.aside {
        (v.abs(), v > 0.0)
    } else {
        let i = spot.index;
        let four = [value[i], value[i + 1], value[i + stride], value[i + stride + 1]];
        (four.into_iter().map(f32::abs).fold(f32::INFINITY, f32::min), false)
    };
    if value == 0.0 {
        return NOTHING;
    }
    let range = value * spot.scale;
    let d = range - spot.length;
    let tau = view.truncation;
    let weight = if d > tau {
        if spot.length >= 0.0 { view.carve_weight } else { 0.0 }
    } else if hit {
        (1.0 + d / tau).clamp(0.0, 1.0)
    } else {
        return NOTHING;
    };
    let squared = view.inverse_square && !view.lens.is_parallel();
    (d.min(tau), if squared { weight / (range.max(1.0) * range.max(1.0)) } else { weight })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Orthographic, Pinhole, Projection, RangeImage, Spherical};
    use crate::sweep::WeightModel;
    use crate::sweep::padded_image::Cleaning;
    use proptest::prelude::*;

    /// The widest vectors give the bits that any processor gives.
    fn same_bits(projection: Projection, values: Vec<f32>, first: [f32; 3], weights: WeightModel) {
        let (columns, rows) = (24, 12);
        let image =
            RangeImage { projection, columns, rows, values, colors: Vec::new(), refused: Default::default() };
        let lens = Lens::of(&image).unwrap();
        let mut padded = PaddedImage::default();
        let how = Cleaning { min_range: 0.0, max_range: 50.0, step: 0.03, weights, colors: false };
        padded.fill(&image, &lens, &how);
        let view = View {
            lens: &lens,
            image: &padded,
            truncation: 0.3,
            carve_weight: 0.5,
            inverse_square: weights.parts().0,
            aside: 0.05,
        };
        let centres = Centres { first, steps: [[0.08, 0.06, 0.0], [-0.06, 0.08, 0.0], [0.0, 0.0, 0.1]] };
        let [mut a, mut b, mut c, mut d] = std::array::from_fn(|_| vec![0.0f32; 512]);
        observe_block(&view, &centres, &mut a, &mut b);
        observe_block_plain(&view, &centres, &mut c, &mut d);
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
