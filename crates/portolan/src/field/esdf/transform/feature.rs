//! Which crossing of the surface is nearest to a cell, in one word.

/// An edge of the lattice with a crossing, as seen from a cell: the axis along which it runs, and how many cells its
/// lower node is away along each axis.
///
/// Relative, so that the word does not depend on where the map begins or on how bricks are numbered; additive, so that a
/// pass along an axis adds its step. Up to [`Feature::REACH`] cells along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Feature(pub(crate) u32);

impl Feature {
    /// No crossing within reach.
    pub(crate) const NONE: Self = Self(u32::MAX);
    /// Cells along one axis that a feature may be away.
    pub(crate) const REACH: i32 = 510;

    /// The edge along `axis` whose lower node is `offset` cells away.
    #[inline(always)]
    pub(crate) fn new<const D: usize>(axis: usize, offset: [i32; D]) -> Self {
        let mut word = (axis as u32) << 30;
        for k in 0..D {
            word |= ((offset[k] + 512) as u32) << (10 * k);
        }
        Self(word)
    }

    /// What to add (wrapping) to the word of the cell `step` cells further along `axis` to get the word of this cell.
    #[inline(always)]
    pub(crate) fn step(axis: usize, step: i32) -> u32 {
        (step as u32).wrapping_shl(10 * axis as u32)
    }

    /// Axis of the edge.
    #[inline(always)]
    pub(crate) fn axis(self) -> usize {
        (self.0 >> 30) as usize
    }

    /// Where the edge's lower node is, in cells from the cell.
    #[inline(always)]
    pub(crate) fn offset<const D: usize>(self) -> [i32; D] {
        std::array::from_fn(|k| (self.0 >> (10 * k) & 1023) as i32 - 512)
    }

    /// `None` for [`Feature::NONE`].
    #[inline(always)]
    pub(crate) fn known(self) -> Option<Self> {
        (self != Self::NONE).then_some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_add_up() {
        let from =
            |at: [i32; 3]| Feature::new(2, std::array::from_fn::<_, 3, _>(|k| [7, -300, 510][k] - at[k]));
        let seen = from([0; 3]);
        assert_eq!((seen.axis(), seen.offset::<3>()), (2, [7, -300, 510]));
        // The cell five further along y has the crossing in its word; from five before, it is five further away.
        assert_eq!(from([0, -200, 0]).0.wrapping_add(Feature::step(1, -5)), from([0, -195, 0]).0);
        assert_eq!(from([1, 2, 3]).0.wrapping_add(Feature::step(0, 1)), from([0, 2, 3]).0);
        assert_eq!(Feature::new(1, [-4, 9]).offset::<2>(), [-4, 9]);
        assert!(Feature::NONE.known().is_none() && seen.known().is_some());
    }
}
