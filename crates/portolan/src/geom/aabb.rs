//! Axis-aligned boxes.

/// An axis-aligned box in world coordinates (meters); `min > max` along an axis means empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<const D: usize> {
    /// The corner with the smallest coordinates.
    pub min: [f64; D],
    /// The corner with the largest coordinates.
    pub max: [f64; D],
}

impl<const D: usize> Aabb<D> {
    /// The empty box, which grows with the first point included.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; D], max: [f64::NEG_INFINITY; D] };

    /// The box with these corners.
    pub fn new(min: [f64; D], max: [f64; D]) -> Self {
        Self { min, max }
    }

    /// Grows to contain `p`.
    pub fn include(&mut self, p: [f64; D]) {
        self.min = std::array::from_fn(|k| self.min[k].min(p[k]));
        self.max = std::array::from_fn(|k| self.max[k].max(p[k]));
    }

    /// The smallest box that contains both.
    pub fn union(mut self, other: Self) -> Self {
        if !other.is_empty() {
            self.include(other.min);
            self.include(other.max);
        }
        self
    }

    /// The box of the points that lie in both; empty where there are none.
    pub fn intersection(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].max(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].min(other.max[k])),
        }
    }

    /// The box with every face moved outward by `margin` (meters).
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min.map(|v| v - margin), max: self.max.map(|v| v + margin) }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        (0..D).any(|k| {
            !matches!(
                self.min[k].partial_cmp(&self.max[k]),
                Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)
            )
        })
    }

    /// Whether `p` lies inside or on the border.
    pub fn contains(&self, p: [f64; D]) -> bool {
        (0..D).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// Edge lengths (meters); zero for an empty box.
    pub fn extent(&self) -> [f64; D] {
        std::array::from_fn(|k| (self.max[k] - self.min[k]).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grows_from_empty() {
        let mut b = Aabb::<3>::EMPTY;
        assert!(b.is_empty() && b.extent() == [0.0; 3]);
        b.include([1.0, 2.0, 3.0]);
        b.include([0.0, 5.0, 3.0]);
        assert!(!b.is_empty() && b.contains([0.5, 3.0, 3.0]) && !b.contains([0.5, 3.0, 3.1]));
        assert_eq!(Aabb::EMPTY.union(b), b);
        assert_eq!(b.grown(1.0).extent(), [3.0, 5.0, 2.0]);
    }
}
