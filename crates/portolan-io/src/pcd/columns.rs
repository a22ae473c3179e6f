//! Values of fields, wherever the layout puts them.

use super::header::{Data, Field, Header};
use crate::bytes::{Endian, Scalar};

/// The values of one field: one per point, `stride` bytes apart.
#[derive(Clone, Copy)]
pub(super) struct Column<'a> {
    bytes: &'a [u8],
    stride: usize,
    pub(super) scalar: Scalar,
}

impl<'a> Column<'a> {
    /// The column of a field in the body of a file that has all its bytes. Packed bodies hold field after field, others
    /// point after point. `None` for a field without values.
    pub(super) fn of(field: &Field, header: &Header, body: &'a [u8]) -> Option<Self> {
        if field.count == 0 {
            return None;
        }
        let (start, stride) = match header.data {
            Data::Compressed => (field.offset * header.points(), field.count * field.scalar.size()),
            _ => (field.offset, header.stride),
        };
        // A cloud without points has columns, too: there is nothing to read in them.
        Some(Self { bytes: body.get(start..).unwrap_or(&[]), stride, scalar: field.scalar })
    }

    /// The value of point `i`.
    #[inline(always)]
    pub(super) fn get(&self, i: usize) -> f64 {
        self.scalar.read(&self.bytes[i * self.stride..], Endian::Little)
    }

    /// The value of point `i` as the bits of a color, whatever type the header calls it.
    #[inline(always)]
    pub(super) fn bits(&self, i: usize) -> u32 {
        match self.scalar.size() {
            4 => Scalar::U32.read(&self.bytes[i * self.stride..], Endian::Little) as u32,
            _ => self.get(i) as u32,
        }
    }
}

/// `0x00RRGGBB` as bytes.
pub(super) fn rgb(bits: u32) -> [u8; 3] {
    [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8]
}
