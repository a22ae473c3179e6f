//! Numbers that hold squared distances: whole ones where all axes have one spacing, else `f32`.

/// A squared distance on its way through the passes. Whole numbers count cells; `f32` is in units of the least spacing.
pub(super) trait Number: Copy + PartialOrd + Default + Send + Sync {
    /// Nothing is near.
    const FAR: Self;
    /// Zero.
    const ZERO: Self;

    /// A number of cells; [`Number::FAR`] where it does not fit.
    fn count(k: usize) -> Self;

    /// One cell more; far stays far.
    fn next(self) -> Self;

    /// The squared length of so many cells of a spacing of `unit` (1 for whole numbers), or [`Number::FAR`] where that
    /// does not fit.
    fn squared(self, unit: f64) -> Self;

    /// The sum; not less than [`Number::FAR`] where one of the two is.
    fn plus(self, cost: Self) -> Self;

    /// A signed offset in rows, which fits by the choice of the type. Ordered as the offsets are.
    fn of_offset(k: isize) -> Self;

    /// The offset again.
    fn offset(self) -> isize;

    /// The first where `is`, else the second; without a branch.
    fn choose(is: bool, yes: Self, no: Self) -> Self;

    /// The largest value, below [`Number::FAR`], that is not more than `squared`.
    fn limit(squared: f64) -> Self;

    /// The value.
    fn real(self) -> f32;
}

/// Half the bytes and twice the lanes, for whatever stays below 2^16.
impl Number for u16 {
    const FAR: Self = Self::MAX;
    const ZERO: Self = 0;

    #[inline(always)]
    fn count(k: usize) -> Self {
        Self::try_from(k).unwrap_or(Self::FAR)
    }

    #[inline(always)]
    fn next(self) -> Self {
        self.saturating_add(1)
    }

    #[inline(always)]
    fn squared(self, _: f64) -> Self {
        if self < 256 { self.wrapping_mul(self) } else { Self::FAR }
    }

    #[inline(always)]
    fn plus(self, cost: Self) -> Self {
        self.saturating_add(cost)
    }

    #[inline(always)]
    fn of_offset(k: isize) -> Self {
        (k as i16 ^ i16::MIN) as Self
    }

    #[inline(always)]
    fn offset(self) -> isize {
        (self as i16 ^ i16::MIN) as isize
    }

    #[inline(always)]
    fn choose(is: bool, yes: Self, no: Self) -> Self {
        let mask = Self::from(is).wrapping_neg();
        yes & mask | no & !mask
    }

    #[inline(always)]
    fn limit(squared: f64) -> Self {
        squared.min(f64::from(Self::FAR - 1)) as Self
    }

    #[inline(always)]
    fn real(self) -> f32 {
        f32::from(self)
    }
}

/// The square of this one stays below 2^31.
const LARGEST_ROOT: u32 = super::transform::LARGEST_DIAGONAL as u32;

/// Far is half of what fits, so that sums do not wrap.
impl Number for u32 {
    const FAR: Self = Self::MAX >> 1;
    const ZERO: Self = 0;

    #[inline(always)]
    fn count(k: usize) -> Self {
        Self::try_from(k).unwrap_or(Self::FAR).min(Self::FAR)
    }

    #[inline(always)]
    fn next(self) -> Self {
        self.wrapping_add(1).min(Self::FAR)
    }

    #[inline(always)]
    fn squared(self, _: f64) -> Self {
        if self <= LARGEST_ROOT { self.wrapping_mul(self) } else { Self::FAR }
    }

    #[inline(always)]
    fn plus(self, cost: Self) -> Self {
        self.wrapping_add(cost)
    }

    #[inline(always)]
    fn of_offset(k: isize) -> Self {
        (k as i32 ^ i32::MIN) as Self
    }

    #[inline(always)]
    fn offset(self) -> isize {
        (self as i32 ^ i32::MIN) as isize
    }

    #[inline(always)]
    fn choose(is: bool, yes: Self, no: Self) -> Self {
        let mask = Self::from(is).wrapping_neg();
        yes & mask | no & !mask
    }

    #[inline(always)]
    fn limit(squared: f64) -> Self {
        squared.min(f64::from(Self::FAR - 1)) as Self
    }

    #[inline(always)]
    fn real(self) -> f32 {
        // Below 2^31: the signed conversion is the cheap one.
        self as i32 as f32
    }
}

/// For axes of different spacing, and for lines that are too long for whole numbers.
impl Number for f32 {
    const FAR: Self = Self::INFINITY;
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn count(k: usize) -> Self {
        k as Self
    }

    #[inline(always)]
    fn next(self) -> Self {
        self + 1.0
    }

    #[inline(always)]
    fn squared(self, unit: f64) -> Self {
        let length = f64::from(self) * unit;
        (length * length) as Self
    }

    #[inline(always)]
    fn plus(self, cost: Self) -> Self {
        self + cost
    }

    #[inline(always)]
    fn of_offset(k: isize) -> Self {
        k as Self
    }

    #[inline(always)]
    fn offset(self) -> isize {
        self as isize
    }

    #[inline(always)]
    fn choose(is: bool, yes: Self, no: Self) -> Self {
        if is { yes } else { no }
    }

    #[inline(always)]
    fn limit(squared: f64) -> Self {
        (squared as Self).min(Self::MAX)
    }

    #[inline(always)]
    fn real(self) -> f32 {
        self
    }
}
