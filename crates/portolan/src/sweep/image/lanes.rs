//! Points side by side, 64 at a time.

/// Points that are projected together: an octant of a block.
pub(super) const LANES: usize = 64;

/// One number per lane.
pub(super) type Lanes = [f32; LANES];

/// Where 64 points fall, with the image's border of one pixel counted: 0.5 to 1.5 is column 0.
pub(super) struct Projected {
    pub u: Lanes,
    pub v: Lanes,
    /// Length of the ray up to the point (meters).
    pub length: Lanes,
    /// What a pixel's value is multiplied with for the length of the ray up to its surface.
    pub scale: Lanes,
}

/// From pixels to 64 points: columns, rows, and the row of each pixel (without the border).
pub(super) struct Steps {
    pub right: Lanes,
    pub below: Lanes,
    pub row: [u32; LANES],
}

/// The surface that 64 rays meet: what is linear on it ([`super::padded_image::PaddedImage::linear`]), and by how much that grows from
/// one pixel to the next.
pub(super) struct Gradients {
    pub value: Lanes,
    pub right: Lanes,
    pub below: Lanes,
}
