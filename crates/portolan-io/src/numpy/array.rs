//! An array as numpy's files hold it.

/// The values of an array, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub enum NpyValues {
    /// `|u1`
    U8(Vec<u8>),
    /// `<f2`, as bits
    F16(Vec<u16>),
    /// `<f4`
    F32(Vec<f32>),
    /// `<f8`
    F64(Vec<f64>),
    /// `<i8`
    I64(Vec<i64>),
    /// `<U...`: one word, an array without axes
    Text(String),
}

/// An array: values, shape, and which axis is the fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyArray {
    /// Lengths along the axes; empty for a single value.
    pub shape: Vec<usize>,
    /// The first axis is the fastest (Fortran) and not the last (C).
    pub fortran: bool,
    /// One for each cell of the shape.
    pub values: NpyValues,
}

impl NpyValues {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::Text(_) => 1,
        }
    }

    /// numpy's name of the type.
    pub(super) fn description(&self) -> String {
        match self {
            Self::U8(_) => "|u1".into(),
            Self::F16(_) => "<f2".into(),
            Self::F32(_) => "<f4".into(),
            Self::F64(_) => "<f8".into(),
            Self::I64(_) => "<i8".into(),
            Self::Text(text) => format!("<U{}", text.chars().count().max(1)),
        }
    }
}

impl NpyArray {
    /// An array in C order.
    pub fn c(shape: impl Into<Vec<usize>>, values: NpyValues) -> Self {
        Self { shape: shape.into(), fortran: false, values }
    }

    /// An array in Fortran order.
    pub fn fortran(shape: impl Into<Vec<usize>>, values: NpyValues) -> Self {
        Self { shape: shape.into(), fortran: true, values }
    }

    /// A vector.
    pub fn vector(values: &[f64]) -> Self {
        Self::c([values.len()], NpyValues::F64(values.to_vec()))
    }

    /// A single number.
    pub fn number(value: f64) -> Self {
        Self::c([], NpyValues::F64(vec![value]))
    }

    /// A word.
    pub fn text(word: &str) -> Self {
        Self::c([], NpyValues::Text(word.to_owned()))
    }

    /// Cells of the shape; `None` where they cannot be counted.
    pub(super) fn cells(shape: &[usize]) -> Option<usize> {
        shape.iter().try_fold(1usize, |n, &s| n.checked_mul(s))
    }
}
