//! The toy: a corridor seen along a line, ten rays, and starts to be lucky or unlucky with.

use super::line::{Line, LineRay};
use super::model::{Measurement, Noise};
use portolan_sim::Random;
use serde::Serialize;

/// An opaque body on the line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Body {
    /// Its lower end, m.
    pub low: f64,
    /// Its upper end, m.
    pub high: f64,
    /// Reflectance of its lower face.
    pub low_face: f64,
    /// Reflectance of its upper face.
    pub high_face: f64,
}

/// A line with bodies on it, as it really is.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Length of the line from 0, m.
    pub length: f64,
    /// Number of bins in which it is to be estimated.
    pub bins: usize,
    /// The bodies, in order.
    pub bodies: Vec<Body>,
    /// Rays to learn from.
    pub training: Vec<LineRay>,
    /// Rays that are held out.
    pub held_out: Vec<LineRay>,
}

impl Scene {
    /// The scene of the textbook's toy: 80 bins over 8 m, a wall at either end, a pillar between, seven rays
    /// to learn from and three held out, from ten origins, looking either way.
    ///
    /// The room on the left has a dark wall and a bright one, near the ends of what can be reflected: no
    /// mixture of other colors makes them. The walls of the room on the right, and the far plane, are
    /// gray, and gray can be mixed.
    pub fn corridor() -> Self {
        let ray = |origin, ascending| LineRay { origin, ascending };
        Self {
            length: 8.0,
            bins: 80,
            bodies: vec![
                Body { low: 0.0, high: 0.4, low_face: 0.05, high_face: 0.05 },
                Body { low: 4.6, high: 5.0, low_face: 0.95, high_face: 0.5 },
                Body { low: 7.6, high: 8.0, low_face: 0.5, high_face: 0.5 },
            ],
            training: vec![
                ray(0.55, true),
                ray(1.05, true),
                ray(3.95, false),
                ray(4.45, false),
                ray(5.15, true),
                ray(5.65, true),
                ray(7.45, false),
            ],
            held_out: vec![ray(2.85, true), ray(2.15, false), ray(6.65, true)],
        }
    }

    /// The distance to the first face on a ray, and its reflectance; `None` when the ray leaves the line.
    pub fn first_face(&self, ray: &LineRay) -> Option<(f64, f64)> {
        let mut faces: Vec<(f64, f64)> = Vec::new();
        for body in &self.bodies {
            if ray.ascending && body.low >= ray.origin {
                faces.push((body.low - ray.origin, body.low_face));
            } else if !ray.ascending && body.high <= ray.origin {
                faces.push((ray.origin - body.high, body.high_face));
            }
        }
        faces.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// What a sensor measures along the training and the held-out rays, with Gaussian noise drawn from
    /// `seed`. Rays that meet no body are left out.
    pub fn measure(&self, noise: &Noise, seed: u64) -> (Vec<Measurement>, Vec<Measurement>) {
        let mut rng = stream(seed, 1);
        let mut measure = |rays: &[LineRay]| -> Vec<Measurement> {
            let hit = |ray: &LineRay| self.first_face(ray).map(|face| (*ray, face));
            let noisy = |(ray, (depth, reflectance)): (LineRay, (f64, f64))| Measurement {
                ray,
                depth: depth + noise.depth * rng.normal(),
                reflectance: reflectance + noise.reflectance * rng.normal(),
                second_moment: depth * depth + noise.second_moment * rng.normal(),
            };
            rays.iter().filter_map(hit).map(noisy).collect()
        };
        (measure(&self.training), measure(&self.held_out))
    }

    /// The bins with all surfaces of the scene more than `margin` meters away from their center, outside of
    /// bodies.
    pub fn empty_bins(&self, margin: f64) -> impl Iterator<Item = usize> + '_ {
        let line = self.uniform(0.0);
        (0..self.bins).filter(move |bin| {
            let x = line.centre(*bin);
            self.bodies.iter().all(|b| x < b.low - margin || x > b.high + margin)
        })
    }

    /// Optical depth `Σ σδ` that a field has in bins from which every surface of the scene is more than
    /// `margin` meters away: matter where there is none.
    pub fn misplaced(&self, line: &Line, margin: f64) -> f64 {
        self.empty_bins(margin).map(|bin| line.density[bin] * line.resolution).sum()
    }

    /// The bin with the most density of those that [`Scene::misplaced`] counts.
    pub fn worst_bin(&self, line: &Line, margin: f64) -> Option<usize> {
        self.empty_bins(margin).max_by(|a, b| line.density[*a].total_cmp(&line.density[*b]))
    }

    /// The field that an opaque scene has: `σδ` = 10 in every bin whose center lies in a body.
    pub fn truth(&self) -> Line {
        let mut line = self.uniform(0.0);
        for bin in 0..line.bins() {
            let x = line.centre(bin);
            if let Some(body) = self.bodies.iter().find(|b| b.low <= x && x < b.high) {
                line.density[bin] = 10.0 / line.resolution;
                let nearer_low = x - body.low < body.high - x;
                line.reflectance[bin] = if nearer_low { body.low_face } else { body.high_face };
            }
        }
        line
    }

    /// A field of one density everywhere, of half reflectance.
    pub fn uniform(&self, density: f64) -> Line {
        Line::uniform(0.0, self.length / self.bins as f64, self.bins, density, 0.5)
    }

    /// A start drawn from `seed`: thin fog and three clumps anywhere, from translucent to solid.
    pub fn random_start(&self, seed: u64) -> Line {
        let mut rng = stream(seed, 2);
        let fog = between(&mut rng, 0.05, 0.4);
        let mut line = self.uniform(fog);
        for _ in 0..3 {
            let centre = between(&mut rng, 0.0, self.length);
            let width = between(&mut rng, 0.1, 0.3);
            // Optical depth of a bin at the peak: 0.1 to 10.
            let peak = libm::pow(10.0, between(&mut rng, -1.0, 1.0)) / line.resolution;
            for bin in 0..line.bins() {
                let u = (line.centre(bin) - centre) / width;
                line.density[bin] += peak * libm::exp(-0.5 * u * u);
            }
        }
        line
    }
}

/// A stream of its own for every seed and purpose: the named seeds are seeds of these.
fn stream(seed: u64, purpose: u64) -> Random {
    let mut random = Random::from_state(seed ^ purpose.wrapping_mul(0xD1B5_4A32_D192_ED03));
    random.bits();
    random
}

/// Uniform in `[low, high)`.
fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corridor_has_ten_rays_that_all_end_at_a_wall() {
        let scene = Scene::corridor();
        assert_eq!((scene.training.len(), scene.held_out.len(), scene.bins), (7, 3, 80));
        let (training, held_out) = scene.measure(&Noise::default(), 3);
        assert_eq!((training.len(), held_out.len()), (7, 3));
        let all: Vec<LineRay> = [scene.training.clone(), scene.held_out.clone()].concat();
        assert!(all.iter().any(|r| r.ascending) && all.iter().any(|r| !r.ascending));
        for (i, ray) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|other| other.origin != ray.origin), "ten different origins");
        }
    }

    #[test]
    fn rays_see_the_nearest_face() {
        let scene = Scene::corridor();
        let face = |origin, ascending| scene.first_face(&LineRay { origin, ascending });
        assert_eq!(face(2.6, true).map(|f| (libm::round(f.0 * 1e9), f.1)), Some((2e9, 0.95)));
        assert_eq!(face(5.5, false).map(|f| f.1), Some(0.5));
        assert_eq!(face(-1.0, false), None);
    }

    #[test]
    fn noise_has_the_stated_size_and_repeats() {
        let scene = Scene::corridor();
        let noise = Noise::default();
        assert_eq!(scene.measure(&noise, 9), scene.measure(&noise, 9));
        let errors: Vec<f64> = (0..300)
            .flat_map(|seed| scene.measure(&noise, seed).0)
            .map(|m| m.depth - scene.first_face(&m.ray).unwrap().0)
            .collect();
        let spread = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        // 2100 draws: the relative standard error of their spread is 1.5 %.
        assert!((spread / noise.depth - 1.0).abs() < 0.05, "{spread}");
    }

    #[test]
    fn truth_is_solid_and_starts_differ_by_seed() {
        let scene = Scene::corridor();
        let truth = scene.truth();
        assert_eq!(truth.density.iter().filter(|d| **d > 0.0).count(), 12);
        assert!(scene.empty_bins(0.0).all(|bin| truth.density[bin] == 0.0));
        assert!(scene.empty_bins(0.3).count() < scene.empty_bins(0.0).count());
        assert_eq!(scene.random_start(1), scene.random_start(1));
        assert_ne!(scene.random_start(1), scene.random_start(2));
    }
}
