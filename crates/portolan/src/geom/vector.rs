//! Operations on plain arrays as vectors: sums, products, lengths.

/// `a + b`.
#[inline(always)]
pub fn add<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// `a - b`.
#[inline(always)]
pub fn sub<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `s * a`.
#[inline(always)]
pub fn scale<const D: usize>(a: [f64; D], s: f64) -> [f64; D] {
    std::array::from_fn(|k| a[k] * s)
}

/// `a + s * b`: the point at arc length `s` along `b` from `a`.
#[inline(always)]
pub fn along<const D: usize>(a: [f64; D], b: [f64; D], s: f64) -> [f64; D] {
    std::array::from_fn(|k| a[k] + s * b[k])
}

/// The inner product.
#[inline(always)]
pub fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += a[k] * b[k];
    }
    sum
}

/// The Euclidean length.
#[inline(always)]
pub fn norm<const D: usize>(a: [f64; D]) -> f64 {
    dot(a, a).sqrt()
}

/// The distance between two points.
#[inline(always)]
pub fn distance<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    norm(sub(a, b))
}

/// `a` scaled to length one; `None` for the zero vector and where the length is not finite.
pub fn unit<const D: usize>(a: [f64; D]) -> Option<[f64; D]> {
    let length = norm(a);
    (length > 0.0 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// z component of the cross product of two 2-D vectors: positive where `b` lies counter-clockwise of `a`.
#[inline(always)]
pub fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The cross product of two 3-D vectors.
#[inline(always)]
pub fn cross3(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Distance from `p` to the segment `a`-`b` (meters), and the parameter in `[0, 1]` of the nearest point.
pub fn point_segment<const D: usize>(p: [f64; D], a: [f64; D], b: [f64; D]) -> (f64, f64) {
    let ab = sub(b, a);
    let length_sq = dot(ab, ab);
    let t = if length_sq > 0.0 { (dot(sub(p, a), ab) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (distance(p, along(a, ab, t)), t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_refuses_zero_and_infinity() {
        assert_eq!(unit([0.0, 0.0]), None);
        assert_eq!(unit([f64::INFINITY, 0.0]), None);
        assert_eq!(unit([3.0, 4.0]), Some([0.6000000000000001, 0.8]));
    }

    #[test]
    fn the_cross_product_is_right_handed() {
        assert_eq!(cross3([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(cross3([0.0, 2.0, 0.0], [0.0, 1.0, 3.0]), [6.0, 0.0, 0.0]);
    }

    #[test]
    fn segment_distance_at_the_ends_and_between() {
        let (a, b) = ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        assert_eq!(point_segment([1.0, 1.0, 0.0], a, b), (1.0, 0.5));
        assert_eq!(point_segment([-3.0, 4.0, 0.0], a, b), (5.0, 0.0));
        assert_eq!(point_segment([5.0, 0.0, 4.0], a, b), (5.0, 1.0));
        assert_eq!(point_segment([0.0, 2.0, 0.0], a, a), (2.0, 0.0));
    }
}
