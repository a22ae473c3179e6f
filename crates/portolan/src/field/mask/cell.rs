//! Cells of masks.

/// A cell of a mask: set or not.
pub trait MaskCell: Copy + Send + Sync {
    /// Whether distances are measured to this cell.
    fn is_set(self) -> bool;
}

impl MaskCell for bool {
    #[inline(always)]
    fn is_set(self) -> bool {
        self
    }
}

/// Any value but 0 is set.
impl MaskCell for u8 {
    #[inline(always)]
    fn is_set(self) -> bool {
        self != 0
    }
}
