//! The number types of binary formats, and numbers in the middle of bytes.

/// The order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Endian {
    Little,
    Big,
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of a number.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Whether numbers are whole.
    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The number at the start of `bytes`, as the nearest double; NaN where too few bytes are there.
    #[inline(always)]
    pub(crate) fn read(self, bytes: &[u8], endian: Endian) -> f64 {
        macro_rules! number {
            ($type:ty) => {
                match (bytes.first_chunk(), endian) {
                    (Some(b), Endian::Little) => <$type>::from_le_bytes(*b) as f64,
                    (Some(b), Endian::Big) => <$type>::from_be_bytes(*b) as f64,
                    (None, _) => f64::NAN,
                }
            };
        }
        match self {
            Self::I8 => number!(i8),
            Self::U8 => number!(u8),
            Self::I16 => number!(i16),
            Self::U16 => number!(u16),
            Self::I32 => number!(i32),
            Self::U32 => number!(u32),
            Self::I64 => number!(i64),
            Self::U64 => number!(u64),
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        }
    }
}

/// The little-endian number at a place of bytes that are there.
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]))
}

/// See [`u32_at`].
pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_orders_and_short_bytes() {
        let bytes = 0x0102_0304u32.to_be_bytes();
        assert_eq!(Scalar::U32.read(&bytes, Endian::Big), f64::from(0x0102_0304));
        assert_eq!(Scalar::U32.read(&bytes, Endian::Little), f64::from(0x0403_0201));
        assert_eq!(Scalar::I8.read(&[0xff], Endian::Little), -1.0);
        assert_eq!(Scalar::F64.read(&0.1f64.to_be_bytes(), Endian::Big), 0.1);
        assert!(Scalar::F32.read(&bytes[..3], Endian::Big).is_nan());
    }
}
