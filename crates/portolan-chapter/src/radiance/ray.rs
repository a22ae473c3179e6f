//! The volume rendering integral along one ray, and its gradient in one backward pass.
//!
//! ```text
//!  origin   sample 0    sample 1          sample n-1     far plane
//!    o----|=========|=============|- ... -|========|- - - - - |
//!          T_0 = 1    T_1 = 1-α_0           T_{n-1}     T_n: what gets through
//! ```
//!
//! `α_i = 1 − exp(−σ_i δ_i)`, `T_i = Π_{j<i} (1 − α_j)`, and for anything that a sample has a value `v_i`
//! of (its distance, its color) the ray renders `v = Σ T_i α_i v_i + T_n v_far`: the expectation of `v`
//! over where the ray ends *(Mildenhall et al. 2020, section 4; Max 1995)*. Nothing here knows what a
//! sample was taken from: a field of any dimension hands in samples in the order of the ray and gets
//! gradients back in the same order.

/// A field along one stretch of a ray, with `C` colors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const C: usize> {
    /// Volume density `σ`, 1/m, not negative.
    pub density: f64,
    /// Length `δ` of the stretch, m.
    pub length: f64,
    /// Distance `t` of the stretch from the origin of the ray, m.
    pub depth: f64,
    /// Colors, or any other quantity that is rendered like one.
    pub color: [f64; C],
}

/// What a ray sees that meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background<const C: usize> {
    /// Distance `t_far` of the far plane, m.
    pub depth: f64,
    /// Colors of the far plane.
    pub color: [f64; C],
}

/// The state of a ray at one sample: written by [`render`], read by [`backward`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Passage {
    /// Share `α_i` of the light at the sample that ends in it.
    pub opacity: f64,
    /// Share `T_i` of the light that reaches the sample.
    pub transmittance: f64,
}

/// What a ray renders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rendered<const C: usize> {
    /// Expected distance `Σ T_i α_i t_i + T_n t_far`, m.
    pub depth: f64,
    /// Expected colors.
    pub color: [f64; C],
    /// Share `T_n` that reaches the far plane.
    pub transmittance: f64,
}

/// Derivative of an objective by what the ray rendered: `∂J/∂z` and `∂J/∂c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upstream<const C: usize> {
    /// By the rendered depth.
    pub depth: f64,
    /// By the rendered colors.
    pub color: [f64; C],
}

/// Derivative of an objective by what one sample said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleGradient<const C: usize> {
    /// By the density `σ`.
    pub density: f64,
    /// By the colors.
    pub color: [f64; C],
}

impl<const C: usize> SampleGradient<C> {
    /// No influence.
    pub const ZERO: Self = Self { density: 0.0, color: [0.0; C] };
}

/// `(1 − e^{−x}, e^{−x})` for `x ≥ 0`, both to full relative precision with one transcendental function.
///
/// For small `x` the difference `1 − e^{−x}` cancels, for large `x` the sum `1 + expm1(−x)` does: each side
/// of `x = ln 2` computes the one that the other is safely derived from.
pub fn opacity(x: f64) -> (f64, f64) {
    if x < core::f64::consts::LN_2 {
        let minus = libm::expm1(-x);
        (-minus, 1.0 + minus)
    } else {
        let survival = libm::exp(-x);
        (1.0 - survival, survival)
    }
}

/// Renders a ray from its samples in order; `passages` receives the state that [`backward`] needs.
///
/// Stable for `σδ` from 0 (the sample is not there) to infinity (nothing passes): O(samples), no allocation.
///
/// # Panics
/// When `passages` and `samples` differ in length.
pub fn render<const C: usize>(
    samples: &[Sample<C>],
    background: &Background<C>,
    passages: &mut [Passage],
) -> Rendered<C> {
    assert_eq!(samples.len(), passages.len(), "one passage per sample");
    let mut out = Rendered { depth: 0.0, color: [0.0; C], transmittance: 1.0 };
    for (sample, passage) in samples.iter().zip(passages) {
        let (alpha, survival) = opacity(sample.density * sample.length);
        *passage = Passage { opacity: alpha, transmittance: out.transmittance };
        let weight = out.transmittance * alpha;
        out.depth += weight * sample.depth;
        for c in 0..C {
            out.color[c] += weight * sample.color[c];
        }
        out.transmittance *= survival;
    }
    out.depth += out.transmittance * background.depth;
    for c in 0..C {
        out.color[c] += out.transmittance * background.color[c];
    }
    out
}

/// Gradient of an objective by every sample's density and colors, given that by what the ray rendered.
///
/// With `v_i = ∂J/∂z t_i + ∂J/∂c · c_i`, one pass from the far end carries
/// `B_k = Σ_{i>k} T_i α_i v_i + T_n v_far`:
///
/// ```text
/// ∂J/∂σ_k = δ_k (T_{k+1} v_k − B_k)         ∂J/∂c_k = T_k α_k ∂J/∂c
/// ```
///
/// Both carry the transmittance in front of the sample as a factor: what is hidden gets no gradient.
/// `passages` and `rendered` are those of [`render`] for the same samples. O(samples), no allocation.
///
/// # Panics
/// When the slices differ in length.
pub fn backward<const C: usize>(
    samples: &[Sample<C>],
    background: &Background<C>,
    passages: &[Passage],
    rendered: &Rendered<C>,
    upstream: &Upstream<C>,
    gradients: &mut [SampleGradient<C>],
) {
    assert_eq!(samples.len(), passages.len(), "one passage per sample");
    assert_eq!(samples.len(), gradients.len(), "one gradient per sample");
    let value = |depth: f64, color: &[f64; C]| {
        let colors = upstream.color.iter().zip(color).map(|(u, c)| u * c);
        upstream.depth * depth + colors.sum::<f64>()
    };
    let mut transmittance_after = rendered.transmittance;
    let mut behind = transmittance_after * value(background.depth, &background.color);
    for ((sample, passage), gradient) in samples.iter().zip(passages).zip(gradients).rev() {
        let here = value(sample.depth, &sample.color);
        let weight = passage.transmittance * passage.opacity;
        gradient.density = sample.length * (transmittance_after * here - behind);
        for c in 0..C {
            gradient.color[c] = weight * upstream.color[c];
        }
        behind += weight * here;
        transmittance_after = passage.transmittance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bin(density: f64, depth: f64) -> Sample<0> {
        Sample { density, length: 0.1, depth, color: [] }
    }

    fn depth_of(samples: &[Sample<0>]) -> f64 {
        let mut passages = vec![Passage::default(); samples.len()];
        render(samples, &Background { depth: 10.0, color: [] }, &mut passages).depth
    }

    #[test]
    fn chapter19_opaque_bin_renders_3_047_m() {
        // σδ = 5 at 3 m in front of a far plane at 10 m: 4.7 cm too far, from a wall that counts as solid.
        let depth = depth_of(&[bin(50.0, 3.0)]);
        assert!((depth - 3.047).abs() < 5e-4, "{depth}");
        assert!((depth - (3.0 + 7.0 * (-5.0_f64).exp())).abs() < 1e-14);
    }

    #[test]
    fn bias_of_depth_shrinks_exponentially_with_opacity() {
        for x in [0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0] {
            let bias = depth_of(&[bin(x / 0.1, 3.0)]) - 3.0;
            assert!((bias - 7.0 * (-x).exp()).abs() < 2e-14, "σδ = {x}: {bias}");
        }
    }

    #[test]
    fn both_halves_of_opacity_are_precise() {
        for i in 0..=2000 {
            let x = 10_f64.powf(-12.0 + 16.0 * f64::from(i) / 2000.0);
            let (alpha, survival) = opacity(x);
            let (alpha_std, survival_std) = (-(-x).exp_m1(), (-x).exp());
            assert!((alpha - alpha_std).abs() <= 4e-16 * alpha_std, "{x}");
            assert!((survival - survival_std).abs() <= 4e-16 * survival_std.max(1e-300), "{x}");
        }
        assert_eq!(opacity(0.0), (0.0, 1.0));
        assert_eq!(opacity(1e4), (1.0, 0.0));
        assert_eq!(opacity(f64::INFINITY), (1.0, 0.0));
    }

    #[test]
    fn extremes_stay_finite_and_weights_sum_to_one() {
        for x in [0.0, 1e-300, 1e-12, 1.0, 50.0, 700.0, 1e4] {
            let samples: Vec<_> = (0..80)
                .map(|i| Sample { density: x / 0.1, length: 0.1, depth: 0.1 * i as f64, color: [1.0] })
                .collect();
            let background = Background { depth: 10.0, color: [1.0] };
            let mut passages = vec![Passage::default(); 80];
            let rendered = render(&samples, &background, &mut passages);
            assert!((rendered.color[0] - 1.0).abs() < 1e-13, "σδ = {x}");
            let mut gradients = vec![SampleGradient::ZERO; 80];
            let upstream = Upstream { depth: 1.0, color: [1.0] };
            backward(&samples, &background, &passages, &rendered, &upstream, &mut gradients);
            assert!(gradients.iter().all(|g| g.density.is_finite() && g.color[0].is_finite()));
        }
        assert_eq!(depth_of(&[]), 10.0);
    }

    #[test]
    fn occluded_samples_receive_no_gradient() {
        // A bin of σδ = 800 at index 3: exp(-800) is zero in f64, and so is everything behind it, exactly.
        let mut samples = vec![Sample { density: 2.0, length: 0.1, depth: 0.0, color: [0.5] }; 10];
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.depth = 0.1 * i as f64;
        }
        samples[3].density = 8000.0;
        let background = Background { depth: 10.0, color: [0.0] };
        let mut passages = vec![Passage::default(); 10];
        let rendered = render(&samples, &background, &mut passages);
        let mut gradients = vec![SampleGradient::ZERO; 10];
        let upstream = Upstream { depth: 1.0, color: [1.0] };
        backward(&samples, &background, &passages, &rendered, &upstream, &mut gradients);
        for (i, g) in gradients.iter().enumerate() {
            // The opaque bin itself has no density gradient either: it cannot tell what is behind it.
            assert_eq!(g.density != 0.0, i < 3, "density of {i}");
            assert_eq!(g.color[0] != 0.0, i <= 3, "colour of {i}");
        }
    }

    /// Objective `u_z z + u_c · c` of a ray.
    fn objective(samples: &[Sample<2>], background: &Background<2>, upstream: &Upstream<2>) -> f64 {
        let mut passages = vec![Passage::default(); samples.len()];
        let r = render(samples, background, &mut passages);
        upstream.depth * r.depth + upstream.color[0] * r.color[0] + upstream.color[1] * r.color[1]
    }

    proptest! {
        /// Closed form against central differences, to 1e-6 of each entry; 1e-9 is what rounding does to the
        /// difference of two objectives of order 10 over 2e-4.
        #[test]
        fn gradient_matches_central_differences(
            bins in prop::collection::vec((0.0..30.0_f64, 0.02..0.2_f64, 0.0..1.0_f64, -1.0..1.0_f64), 1..80),
            u in (-2.0..2.0_f64, -2.0..2.0_f64, -2.0..2.0_f64),
        ) {
            let mut t = 0.0;
            let mut samples: Vec<Sample<2>> = bins.iter().map(|&(density, length, a, b)| {
                t += length;
                Sample { density: density * density / 30.0, length, depth: t - 0.5 * length, color: [a, b] }
            }).collect();
            let background = Background { depth: t + 2.0, color: [0.1, -0.3] };
            let upstream = Upstream { depth: u.0, color: [u.1, u.2] };
            let mut passages = vec![Passage::default(); samples.len()];
            let rendered = render(&samples, &background, &mut passages);
            let mut gradients = vec![SampleGradient::ZERO; samples.len()];
            backward(&samples, &background, &passages, &rendered, &upstream, &mut gradients);
            for i in 0..samples.len() {
                let mut difference = |change: &dyn Fn(&mut Sample<2>, f64), h: f64| {
                    let kept = samples[i];
                    change(&mut samples[i], h);
                    let up = objective(&samples, &background, &upstream);
                    samples[i] = kept;
                    change(&mut samples[i], -h);
                    let down = objective(&samples, &background, &upstream);
                    samples[i] = kept;
                    (up - down) / (2.0 * h)
                };
                // The forward model is analytic in σ, also below zero, so the difference may straddle it.
                let numeric = difference(&|s, h| s.density += h, 1e-4);
                let exact = gradients[i].density;
                prop_assert!((numeric - exact).abs() < 1e-6 * exact.abs() + 1e-9, "σ_{} {} {}", i, numeric, exact);
                for c in 0..2 {
                    let numeric = difference(&|s, h| s.color[c] += h, 1e-3);
                    let exact = gradients[i].color[c];
                    prop_assert!((numeric - exact).abs() < 1e-6 * exact.abs() + 1e-10, "c_{} {} {}", i, numeric, exact);
                }
            }
        }
    }
}
