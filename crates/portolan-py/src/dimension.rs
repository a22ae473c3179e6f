//! A map of either dimension.

/// Of 2-D or of 3-D.
#[derive(Clone, Debug)]
pub(crate) enum Either<A, B> {
    Two(A),
    Three(B),
}

/// The same expression for both dimensions.
macro_rules! either {
    ($of:expr, $name:ident => $body:expr) => {
        match $of {
            $crate::dimension::Either::Two($name) => $body,
            $crate::dimension::Either::Three($name) => $body,
        }
    };
}
pub(crate) use either;

impl<A, B> Either<A, B> {
    /// 2 or 3.
    pub(crate) fn dimension(&self) -> usize {
        if matches!(self, Self::Two(_)) { 2 } else { 3 }
    }
}
