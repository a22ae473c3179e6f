//! The distortion of lenses: from where a ray points to where the lens shows it, and back.

use crate::{IoError, Result};
use std::path::Path;

/// How a lens bends rays: a map of the plane at depth 1 in front of the camera, `(x, y) = (X / Z, Y / Z)`, onto itself, before
/// focal lengths and principal point. The models and the order of their coefficients are those of OpenCV, which ROS, COLMAP and
/// nerfstudio use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Distortion {
    /// None: a pinhole.
    #[default]
    None,
    /// `plumb_bob` with `k4` to `k6` zero, else `rational_polynomial` *(Brown 1966; Conrady 1919)*: with `r^2 = x^2 + y^2`
    /// `f = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)`,
    /// `x' = f x + 2 p1 x y + p2 (r^2 + 2 x^2)` and `y' = f y + p1 (r^2 + 2 y^2) + 2 p2 x y`.
    BrownConrady {
        /// `k1` to `k6`.
        radial: [f64; 6],
        /// `p1`, `p2`.
        tangential: [f64; 2],
    },
    /// `equidistant`, or `fisheye` *(Kannala, Brandt 2006)*: with `t = atan(r)` the point is moved along its radius to
    /// `t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8)`. All zero is still a fisheye, not a pinhole.
    Fisheye([f64; 4]),
}

/// Words of models, and how many coefficients each may have.
const MODELS: [(&str, &[usize]); 8] = [
    ("none", &[0]),
    ("plumb_bob", &[4, 5]),
    ("opencv", &[4, 5]),
    ("rational_polynomial", &[8]),
    ("rational", &[8]),
    ("full_opencv", &[8]),
    ("equidistant", &[4]),
    ("fisheye", &[4]),
];

impl Distortion {
    /// Of the name of a model (`plumb_bob`, `opencv`, `rational_polynomial`, `rational`, `full_opencv`, `equidistant`, `fisheye`,
    /// `none`) and its coefficients in OpenCV's order: `k1 k2 p1 p2 [k3]`, `k1 k2 p1 p2 k3 k4 k5 k6`, or `k1 k2 k3 k4`.
    ///
    /// # Errors
    /// In words, for another model, another number of coefficients, or one that is not finite.
    pub fn of_model(model: &str, d: &[f64]) -> std::result::Result<Self, String> {
        let lower = model.to_ascii_lowercase().replace('-', "_");
        let Some((_, counts)) = MODELS.iter().find(|(name, _)| *name == lower) else {
            let names = MODELS.map(|m| m.0).join(", ");
            return Err(format!("the model {model:?} is not known; give one of {names}"));
        };
        if !counts.contains(&d.len()) {
            let counts: Vec<String> = counts.iter().map(ToString::to_string).collect();
            return Err(format!("{model} has {} coefficients, not {}", counts.join(" or "), d.len()));
        }
        if let Some(bad) = d.iter().find(|v| !(v.abs() <= 1e6)) {
            return Err(format!("{bad} is no coefficient of a lens"));
        }
        let k = |i: usize| d.get(i).copied().unwrap_or(0.0);
        Ok(match lower.as_str() {
            "none" => Self::None,
            "equidistant" | "fisheye" => Self::Fisheye([k(0), k(1), k(2), k(3)]),
            _ => Self::brown_conrady([k(0), k(1), k(4), k(5), k(6), k(7)], [k(2), k(3)]),
        })
    }

    /// `MODEL:k1,k2,...`, the value of `--distortion`; see [`Distortion::of_model`].
    ///
    /// # Errors
    /// [`IoError::Layout`] that says what is wrong with the word.
    pub fn from_word(word: &str, option: &str) -> Result<Self> {
        let refuse = |why: String| {
            let advice =
                "write MODEL:k1,k2,p1,p2[,k3[,k4,k5,k6]], as in plumb_bob:0.1,-0.2,0,0 or fisheye:0.1,0,0,0";
            IoError::layout(Path::new(option), "the distortion", format!("{word:?} ({why})"), advice)
        };
        let (model, list) = word.split_once(':').unwrap_or((word, ""));
        let numbers = list.split(',').map(str::trim).filter(|w| !w.is_empty());
        let numbers: Option<Vec<f64>> = numbers.map(|w| crate::bytes::parse_f64(w.as_bytes())).collect();
        let numbers = numbers.ok_or_else(|| refuse("its coefficients are not all numbers".into()))?;
        Self::of_model(model.trim(), &numbers).map_err(refuse)
    }

    /// Brown and Conrady's model; [`Distortion::None`] where all coefficients are zero.
    pub(super) fn brown_conrady(radial: [f64; 6], tangential: [f64; 2]) -> Self {
        match radial.iter().chain(&tangential).all(|v| *v == 0.0) {
            true => Self::None,
            false => Self::BrownConrady { radial, tangential },
        }
    }

    /// Where the lens shows the ray through `(x, y)` at depth 1. `None` where the model has no sense: beyond the radius up to
    /// which it spreads rays out in order, it folds back, and would show one place twice.
    pub fn distort(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        let in_order = ray[0] * ray[0] + ray[1] * ray[1] <= self.largest_radius_sq();
        in_order.then(|| self.bend(ray)).filter(|shown| shown.iter().all(|v| v.is_finite()))
    }

    /// The same without a look at where the model has a sense.
    pub(super) fn bend(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let r2 = x * x + y * y;
        match self {
            Self::None => [x, y],
            Self::BrownConrady { radial, tangential: [p1, p2] } => {
                let f = radial_factor(radial, r2);
                [
                    f * x + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                    f * y + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
                ]
            }
            Self::Fisheye(k) => {
                let r = r2.sqrt();
                let scale = if r > 1e-9 { fisheye_radius(k, r.atan()) / r } else { 1.0 };
                [scale * x, scale * y]
            }
        }
    }

    /// The ray at depth 1 that the lens shows at `(x, y)`: Newton's method on [`Distortion::distort`] from the point itself.
    /// `None` where it does not come to an error below 1e-9, or no ray is shown there.
    pub fn undistort(&self, shown: [f64; 2]) -> Option<[f64; 2]> {
        if *self == Self::None {
            return Some(shown);
        }
        let mut p = match self {
            // Radial: the angle is found on a line, since its tangent goes to infinity.
            Self::Fisheye(k) => {
                let radius = shown[0].hypot(shown[1]);
                let mut t = radius.min(1.5);
                for _ in 0..50 {
                    let step = (fisheye_radius(k, t) - radius) / fisheye_slope(k, t);
                    t = (t - step).clamp(0.0, 1.57);
                    if step.abs() < 1e-15 {
                        break;
                    }
                }
                let scale = if radius > 1e-12 { t.tan() / radius } else { 1.0 };
                shown.map(|v| v * scale)
            }
            _ => shown,
        };
        for _ in 0..50 {
            let at = self.distort(p)?;
            let off = [at[0] - shown[0], at[1] - shown[1]];
            if off[0].hypot(off[1]) < 1e-13 {
                break;
            }
            // Differences: these models are smooth, and this is not where the time goes.
            let h = 1e-6 * (1.0 + p[0].hypot(p[1]));
            let along = |k: usize| {
                let mut q = p;
                q[k] += h;
                self.distort(q).map(|v| [(v[0] - at[0]) / h, (v[1] - at[1]) / h])
            };
            let (dx, dy) = (along(0)?, along(1)?);
            let determinant = dx[0] * dy[1] - dx[1] * dy[0];
            if determinant <= 1e-9 {
                return None;
            }
            p[0] -= (off[0] * dy[1] - off[1] * dy[0]) / determinant;
            p[1] -= (dx[0] * off[1] - dx[1] * off[0]) / determinant;
        }
        let back = self.distort(p)?;
        ((back[0] - shown[0]).hypot(back[1] - shown[1]) < 1e-9).then_some(p)
    }

    /// The square of the radius up to which rays are in order: where the distorted radius stops growing; infinite where it does
    /// not. Found by steps of 1/64 up to a radius of 8 (83 degrees).
    pub(super) fn largest_radius_sq(&self) -> f64 {
        const STEP: f64 = 1.0 / 64.0;
        match self {
            Self::None => f64::INFINITY,
            Self::BrownConrady { radial, .. } => {
                if radial.iter().all(|k| *k == 0.0) {
                    return f64::INFINITY;
                }
                let shown = |i: i32| {
                    let r = f64::from(i) * STEP;
                    r * radial_factor(radial, r * r)
                };
                let mut before = 0.0;
                for i in 1..=512 {
                    let now = shown(i);
                    if !(now > before) {
                        return (f64::from(i - 1) * STEP).powi(2);
                    }
                    before = now;
                }
                f64::INFINITY
            }
            Self::Fisheye(k) => {
                let mut i = 1;
                while i <= 100 {
                    let t = 1.57 * f64::from(i) / 100.0;
                    if fisheye_slope(k, t) <= 0.0 {
                        return (1.57 * f64::from(i - 1) / 100.0).tan().powi(2);
                    }
                    i += 1;
                }
                f64::INFINITY
            }
        }
    }
}

fn radial_factor(k: &[f64; 6], r2: f64) -> f64 {
    (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))) / (1.0 + r2 * (k[3] + r2 * (k[4] + r2 * k[5])))
}

/// The radius at which a fisheye shows a ray at this angle from its axis.
fn fisheye_radius(k: &[f64; 4], t: f64) -> f64 {
    let t2 = t * t;
    t * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
}

/// Its derivative.
fn fisheye_slope(k: &[f64; 4], t: f64) -> f64 {
    let t2 = t * t;
    1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn near(a: Option<[f64; 2]>, b: [f64; 2], tolerance: f64) {
        let a = a.unwrap();
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < tolerance, "{a:?} {b:?}");
    }

    #[test]
    fn figures_worked_out_by_hand() {
        // r^2 = 0.25: 1 + 0.1 * 0.25 - 0.2 * 0.0625 + 0.4 * 0.015625 = 1.01875.
        let plumb_bob = Distortion::of_model("plumb_bob", &[0.1, -0.2, 0.01, -0.02, 0.4]).unwrap();
        // x' = 0.3 * 1.01875 + 2 * 0.01 * 0.12 - 0.02 * (0.25 + 0.18), y' = 0.4 * 1.01875 + 0.01 * (0.25 + 0.32) - 0.04 * 0.12.
        near(plumb_bob.distort([0.3, 0.4]), [0.305625 + 0.0024 - 0.0086, 0.4075 + 0.0057 - 0.0048], 1e-15);
        // 1.01875 / (1 + 0.3 * 0.25 + 0.2 * 0.0625 + 0.1 * 0.015625) = 1.01875 / 1.0890625.
        let rational =
            Distortion::of_model("rational_polynomial", &[0.1, -0.2, 0.0, 0.0, 0.4, 0.3, 0.2, 0.1]).unwrap();
        let f = 1.01875 / 1.0890625;
        near(rational.distort([0.3, 0.4]), [0.3 * f, 0.4 * f], 1e-15);
        // At 45 degrees from the axis, t = pi / 4.
        let t = std::f64::consts::FRAC_PI_4;
        let fisheye = Distortion::of_model("fisheye", &[0.1, 0.0, 0.0, 0.0]).unwrap();
        near(fisheye.distort([0.6, 0.8]), [0.6, 0.8].map(|v| v * t * (1.0 + 0.1 * t * t)), 1e-15);
        // Without coefficients still a fisheye: 45 degrees at pi / 4.
        near(Distortion::Fisheye([0.0; 4]).distort([1.0, 0.0]), [t, 0.0], 1e-15);
        assert_eq!(Distortion::of_model("plumb_bob", &[0.0; 5]), Ok(Distortion::None));
    }

    /// What OpenCV 5.0 gives (`projectPoints` and `fisheye.distortPoints` of three points).
    #[test]
    fn figures_of_another_library() {
        let points = [[0.3, 0.4], [-0.7, 0.25], [0.05, -0.6]];
        for (model, coefficients, theirs) in [
            (
                "plumb_bob",
                &[0.1, -0.2, 0.01, -0.02, 0.4][..],
                [
                    [0.299425, 0.4084],
                    [-0.7773122668749999, 0.2791900953125],
                    [0.04350113281249999, -0.6053885937499999],
                ],
            ),
            (
                "rational",
                &[0.12, -0.21, 0.003, -0.002, 0.05, 0.31, -0.08, 0.02],
                [
                    [0.28443617244392655, 0.38066489659190217],
                    [-0.6191586968511651, 0.22239096316113038],
                    [0.04525259136569127, -0.5506435963882952],
                ],
            ),
            (
                "fisheye",
                &[0.02, -0.01, 0.004, -0.001],
                [
                    [0.2792665087547889, 0.3723553450063853],
                    [-0.6060243995919825, 0.2164372855685652],
                    [0.04523604960335922, -0.5428325952403106],
                ],
            ),
        ] {
            let lens = Distortion::of_model(model, coefficients).unwrap();
            for (p, shown) in points.into_iter().zip(theirs) {
                near(lens.distort(p), shown, 1e-14);
                near(lens.undistort(shown), p, 1e-9);
            }
        }
    }

    proptest! {
        #[test]
        fn what_is_undone_is_done_again(
            radial in prop::array::uniform3(-0.15..0.15f64), more in prop::array::uniform3(-0.1..0.1f64),
            tangential in prop::array::uniform2(-0.01..0.01f64), p in prop::array::uniform2(-0.8..0.8f64),
            k in prop::array::uniform4(-0.05..0.05f64),
        ) {
            let [a, b, c] = radial;
            let [d, e, f] = more;
            for lens in [
                Distortion::brown_conrady([a, b, c, 0.0, 0.0, 0.0], tangential),
                Distortion::brown_conrady([a, b, c, d, e, f], tangential),
                Distortion::Fisheye(k),
            ] {
                let Some(shown) = lens.distort(p) else { continue };
                // Near the fold there may be another ray that is shown there; then it is that one or none.
                if let Some(back) = lens.undistort(shown) {
                    let again = lens.distort(back).unwrap();
                    prop_assert!((again[0] - shown[0]).hypot(again[1] - shown[1]) < 1e-9);
                    if p[0].hypot(p[1]) < 0.5 {
                        prop_assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-6, "{lens:?} {p:?} {back:?}");
                    }
                } else {
                    prop_assert!(p[0].hypot(p[1]) > 0.5, "{lens:?} {p:?}");
                }
            }
        }
    }

    #[test]
    fn beyond_the_fold_nothing_is_shown() {
        // r (1 - r^2 / 3) grows up to r = 1.
        let lens = Distortion::of_model("plumb_bob", &[-1.0 / 3.0, 0.0, 0.0, 0.0]).unwrap();
        assert!(lens.distort([0.98, 0.0]).is_some() && lens.distort([1.02, 0.0]).is_none());
        assert!(lens.undistort([0.7, 0.0]).is_none(), "the lens shows nothing there");
        near(lens.undistort([0.5 * (1.0 - 0.25 / 3.0), 0.0]), [0.5, 0.0], 1e-9);
    }

    #[test]
    fn words_are_read_or_refused() {
        let word = |w: &str| Distortion::from_word(w, "--distortion").map_err(|e| e.to_string());
        assert_eq!(word("fisheye:0.1,0,0,0"), Ok(Distortion::Fisheye([0.1, 0.0, 0.0, 0.0])));
        assert_eq!(word("none"), Ok(Distortion::None));
        assert_eq!(
            word("plumb-bob: 0.1, 0, 0.2, 0"),
            Ok(Distortion::BrownConrady { radial: [0.1, 0.0, 0.0, 0.0, 0.0, 0.0], tangential: [0.2, 0.0] })
        );
        for (text, part) in [
            ("pinhole:1", "the model \"pinhole\" is not known"),
            ("fisheye:1,2", "fisheye has 4 coefficients, not 2"),
            ("plumb_bob:1,2,x,3", "not all numbers"),
            ("plumb_bob:1,2,nan,3", "is no coefficient of a lens"),
        ] {
            let error = word(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
