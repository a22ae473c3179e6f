//! Whole numbers that hold squared distances.

/// A squared distance (cells) on its way through the passes.
pub(super) trait Integer: Copy + Ord + Default + Send + Sync {
    /// Nothing is near.
    const FAR: Self;
    /// Zero.
    const ZERO: Self;

    /// `k^2`, or [`Integer::FAR`] where that does not fit.
    fn square(k: usize) -> Self;

    /// The sum; not less than [`Integer::FAR`] where one of the two is.
    fn plus(self, cost: Self) -> Self;

    /// A signed offset in rows, which fits by the choice of the type.
    fn of_offset(k: isize) -> Self;

    /// The offset again.
    fn offset(self) -> isize;

    /// The value as a wide one.
    fn wide(self) -> u32;
}

/// Half the bytes and twice the lanes, for whatever stays below 2^16.
impl Integer for u16 {
    const FAR: Self = Self::MAX;
    const ZERO: Self = 0;

    #[inline(always)]
    fn square(k: usize) -> Self {
        k.checked_mul(k).and_then(|sq| Self::try_from(sq).ok()).unwrap_or(Self::FAR)
    }

    #[inline(always)]
    fn plus(self, cost: Self) -> Self {
        self.saturating_add(cost)
    }

    #[inline(always)]
    fn of_offset(k: isize) -> Self {
        k as i16 as Self
    }

    #[inline(always)]
    fn offset(self) -> isize {
        self as i16 as isize
    }

    #[inline(always)]
    fn wide(self) -> u32 {
        u32::from(self)
    }
}

/// Far is half of what fits, so that sums do not wrap.
impl Integer for u32 {
    const FAR: Self = Self::MAX >> 1;
    const ZERO: Self = 0;

    #[inline(always)]
    fn square(k: usize) -> Self {
        k.checked_mul(k).and_then(|sq| Self::try_from(sq).ok()).unwrap_or(Self::FAR).min(Self::FAR)
    }

    #[inline(always)]
    fn plus(self, cost: Self) -> Self {
        self.wrapping_add(cost)
    }

    #[inline(always)]
    fn of_offset(k: isize) -> Self {
        k as i32 as Self
    }

    #[inline(always)]
    fn offset(self) -> isize {
        self as i32 as isize
    }

    #[inline(always)]
    fn wide(self) -> u32 {
        self
    }
}
