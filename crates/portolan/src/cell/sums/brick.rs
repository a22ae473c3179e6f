//! Some sums for each cell of a brick, in whole numbers as wide as they need to be.

use super::super::packed::ARC_HEADER;
use super::Sign;
use std::sync::Arc;

/// No sum is further from zero.
pub const MOST_SUM: i64 = 1 << 62;

/// The width of a brick's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SumWidth {
    /// 16 bits.
    W16,
    /// 32 bits.
    W32,
    /// 64 bits.
    W64,
}

impl SumWidth {
    /// The narrowest that holds numbers so far from zero.
    fn of(most: i64) -> Self {
        if most <= i64::from(i16::MAX) {
            Self::W16
        } else if most <= i64::from(i32::MAX) {
            Self::W32
        } else {
            Self::W64
        }
    }

    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::W16 => 2,
            Self::W32 => 4,
            Self::W64 => 8,
        }
    }
}

/// `K` sums for each cell of a brick, x fastest, one plane a sum, shared between snapshots until one of them changes it. A
/// brick in which all cells are alike is one cell.
///
/// Numbers have 16, 32 or 64 bits. Before a sum could leave its width the brick gets the next one: nothing wraps.
#[derive(Clone, Debug)]
pub struct SumBrick<const K: usize> {
    form: Form<K>,
    /// No number is further from zero; the numbers may be nearer.
    most: i64,
}

#[derive(Clone, Debug)]
enum Form<const K: usize> {
    Alike { sums: [i64; K], len: usize },
    W16(Arc<[i16]>),
    W32(Arc<[i32]>),
    W64(Arc<[i64]>),
}

/// A brick's planes for writing, one after the other.
pub(super) enum PlanesMut<'a> {
    W16(&'a mut [i16]),
    W32(&'a mut [i32]),
    W64(&'a mut [i64]),
}

/// A number of a plane.
pub(super) trait Number {
    /// The number in this width, which it must fit into.
    fn of(v: i64) -> Self;

    /// Adds to it; the sum must fit.
    fn raise(&mut self, by: i64);
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Number for $number {
            #[inline(always)]
            fn of(v: i64) -> Self {
                v as Self
            }

            #[inline(always)]
            fn raise(&mut self, by: i64) {
                *self += by as Self;
            }
        }
    )*};
}
numbers!(i16, i32, i64);

/// Calls an expression with the planes, whatever their width.
macro_rules! with_planes {
    ($planes:expr, $name:ident => $run:expr) => {
        match $planes {
            $crate::cell::sums::brick::PlanesMut::W16($name) => $run,
            $crate::cell::sums::brick::PlanesMut::W32($name) => $run,
            $crate::cell::sums::brick::PlanesMut::W64($name) => $run,
        }
    };
}
pub(super) use with_planes;

impl<const K: usize> SumBrick<K> {
    /// A brick of `len` cells in which all sums are zero.
    pub fn zero(len: usize) -> Self {
        Self::alike([0; K], len)
    }

    /// A brick of `len` cells with these sums.
    pub fn alike(sums: [i64; K], len: usize) -> Self {
        Self { form: Form::Alike { sums, len }, most: furthest(sums.into_iter()) }
    }

    /// A brick of planes, one after the other; `None` where there are not `K` of one length, or a number is further from
    /// zero than [`MOST_SUM`].
    pub fn of_planes(sums: &[i64]) -> Option<Self> {
        let most = furthest(sums.iter().copied());
        if sums.is_empty() || !sums.len().is_multiple_of(K) || most > MOST_SUM {
            return None;
        }
        Some(Self { form: Form::W64(sums.into()), most }.narrowest())
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        match &self.form {
            Form::Alike { len, .. } => *len,
            Form::W16(planes) => planes.len() / K,
            Form::W32(planes) => planes.len() / K,
            Form::W64(planes) => planes.len() / K,
        }
    }

    /// The sums of cell `i`.
    #[inline(always)]
    pub fn at(&self, i: usize) -> [i64; K] {
        fn pick<T: Copy + Into<i64>, const K: usize>(planes: &[T], i: usize) -> [i64; K] {
            let cells = planes.len() / K;
            std::array::from_fn(|k| planes[k * cells + i].into())
        }
        match &self.form {
            Form::Alike { sums, .. } => *sums,
            Form::W16(planes) => pick(planes, i),
            Form::W32(planes) => pick(planes, i),
            Form::W64(planes) => pick(planes, i),
        }
    }

    /// The sums that all cells have, where the brick is one cell.
    pub fn all_alike(&self) -> Option<[i64; K]> {
        match &self.form {
            Form::Alike { sums, .. } => Some(*sums),
            _ => None,
        }
    }

    /// The width of its numbers; that of one cell is 64 bits.
    pub fn width(&self) -> SumWidth {
        match &self.form {
            Form::W16(_) => SumWidth::W16,
            Form::W32(_) => SumWidth::W32,
            Form::Alike { .. } | Form::W64(_) => SumWidth::W64,
        }
    }

    /// All planes, one after the other.
    pub fn planes(&self) -> Vec<i64> {
        match &self.form {
            Form::Alike { sums, len } => sums.iter().flat_map(|&s| std::iter::repeat_n(s, *len)).collect(),
            Form::W16(planes) => planes.iter().map(|&v| v.into()).collect(),
            Form::W32(planes) => planes.iter().map(|&v| v.into()).collect(),
            Form::W64(planes) => planes.to_vec(),
        }
    }

    /// The same sums in the fewest bytes: one form for one set of sums, however they came about. O(cells).
    pub fn narrowest(&self) -> Self {
        let first = if self.cells() > 0 { self.at(0) } else { [0; K] };
        if (0..self.cells()).all(|i| self.at(i) == first) {
            return Self::alike(first, self.cells());
        }
        let most = self.furthest();
        let mut brick = Self { form: self.form.clone(), most };
        if SumWidth::of(most) != self.width() || matches!(self.form, Form::Alike { .. }) {
            brick.form = form_of(&self.planes(), SumWidth::of(most));
        }
        brick
    }

    /// The sum that is furthest from zero.
    fn furthest(&self) -> i64 {
        match &self.form {
            Form::Alike { sums, .. } => furthest(sums.iter().copied()),
            Form::W16(planes) => furthest(planes.iter().map(|&v| v.into())),
            Form::W32(planes) => furthest(planes.iter().map(|&v| v.into())),
            Form::W64(planes) => furthest(planes.iter().copied()),
        }
    }

    /// Adds these to every cell, where the brick is one cell and stays so; `false`: it is not, and is as before.
    pub(super) fn add_alike(&mut self, more: [i64; K]) -> bool {
        let Form::Alike { sums, .. } = &mut self.form else { return false };
        (0..K).for_each(|k| sums[k] += more[k]);
        self.most = furthest(sums.iter().copied());
        true
    }

    /// The planes for writing numbers that are at most `step` further from zero than now; wide enough for that, at least
    /// `least` wide, and copied first where a snapshot shares them.
    pub(super) fn planes_mut(&mut self, step: i64, least: SumWidth) -> PlanesMut<'_> {
        let far = match &self.form {
            Form::Alike { .. } => i64::MAX,
            Form::W16(_) => i16::MAX.into(),
            Form::W32(_) => i32::MAX.into(),
            Form::W64(_) => i64::MAX,
        };
        if self.most.saturating_add(step) > far {
            self.most = self.furthest();
        }
        let most = self.most.saturating_add(step);
        let width = SumWidth::of(most).max(least);
        let narrow = matches!(self.form, Form::Alike { .. }) || self.width() < width;
        if narrow {
            self.form = form_of(&self.planes(), width);
        }
        self.most = most;
        match &mut self.form {
            Form::W16(planes) => PlanesMut::W16(Arc::make_mut(planes)),
            Form::W32(planes) => PlanesMut::W32(Arc::make_mut(planes)),
            Form::W64(planes) => PlanesMut::W64(Arc::make_mut(planes)),
            Form::Alike { .. } => unreachable!("its planes were made just now"),
        }
    }

    /// Bytes held.
    pub(super) fn held(&self) -> usize {
        match &self.form {
            Form::Alike { .. } => 0,
            form => K * self.cells() * Self { form: form.clone(), most: 0 }.width().bytes() + ARC_HEADER,
        }
    }

    /// Adds or takes away another brick's sums; `false`: one would pass [`MOST_SUM`], nothing was done.
    pub(super) fn add_brick(&mut self, other: &Self, sign: Sign) -> bool {
        let step = other.furthest();
        let fits = |most: i64| most.checked_add(step).is_some_and(|m| m <= MOST_SUM);
        if !fits(self.most) {
            self.most = self.furthest();
            if !fits(self.most) {
                return false;
            }
        }
        let factor = i64::from(sign.factor());
        if let Some(sums) = other.all_alike()
            && (sums == [0; K] || self.add_alike(sums.map(|s| factor * s)))
        {
            return true;
        }
        let cells = self.cells();
        with_planes!(self.planes_mut(step, SumWidth::W16), planes => for i in 0..cells {
            let more = other.at(i);
            for (k, &m) in more.iter().enumerate() {
                planes[k * cells + i].raise(factor * m);
            }
        });
        true
    }

    /// Whether this holds for the sums of every cell.
    pub(super) fn all(&self, holds: impl Fn(&[i64]) -> bool) -> bool {
        match self.all_alike() {
            Some(sums) => holds(&sums),
            None => (0..self.cells()).all(|i| holds(&self.at(i))),
        }
    }
}

fn furthest(numbers: impl Iterator<Item = i64>) -> i64 {
    numbers.fold(0, |most, v| most.max(v.saturating_abs()))
}

fn form_of<const K: usize>(planes: &[i64], width: SumWidth) -> Form<K> {
    match width {
        SumWidth::W16 => Form::W16(planes.iter().map(|&v| v as i16).collect()),
        SumWidth::W32 => Form::W32(planes.iter().map(|&v| v as i32).collect()),
        SumWidth::W64 => Form::W64(planes.into()),
    }
}

/// Equal sums, in any form.
impl<const K: usize> PartialEq for SumBrick<K> {
    fn eq(&self, other: &Self) -> bool {
        self.cells() == other.cells() && (0..self.cells()).all(|i| self.at(i) == other.at(i))
    }
}

/// The parts of `Planes` and `SumPlanes` that are the same for every cell of `K` sums.
macro_rules! planes_of_sums {
    ($cell:ty, $k:literal, $width:expr) => {
        impl crate::cell::Planes<$cell> for SumBrick<$k> {
            fn unobserved(n: usize) -> Self {
                Self::zero(n)
            }

            fn len(&self) -> usize {
                self.cells()
            }

            #[inline(always)]
            fn get(&self, i: usize) -> Option<$cell> {
                <$cell>::of_sums(self.at(i))
            }

            fn set(&mut self, i: usize, cell: Option<$cell>) {
                let sums = cell.map_or([0; $k], <$cell>::sums);
                let cells = self.cells();
                let step = sums.iter().fold(0, |most: i64, s| most.max(s.saturating_abs()));
                $crate::cell::sums::brick::with_planes!(self.planes_mut(step, $width), planes => {
                    sums.iter().enumerate().for_each(|(k, &s)| planes[k * cells + i] = $crate::cell::sums::brick::Number::of(s));
                });
            }

            fn bytes(&self) -> usize {
                self.held()
            }
        }

        impl $crate::cell::SumPlanes<$cell> for SumBrick<$k> {
            fn add(&mut self, other: &Self, sign: $crate::cell::Sign) -> bool {
                self.add_brick(other, sign)
            }

            fn is_zero(&self) -> bool {
                self.all(|sums| sums.iter().all(|s| *s == 0))
            }

            fn is_possible(&self) -> bool {
                self.all(<$cell as $crate::cell::SumCell>::is_possible)
            }
        }
    };
}
pub(super) use planes_of_sums;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Adds and takes away by 128-bit numbers.
    fn oracle(planes: &mut [i128], more: &[i64], sign: Sign) {
        planes.iter_mut().zip(more).for_each(|(p, &m)| *p += i128::from(sign.factor()) * i128::from(m));
    }

    fn number() -> impl Strategy<Value = i64> {
        prop_oneof![
            4 => -3i64..4,
            2 => Just(i64::from(i16::MAX)),
            2 => Just(i64::from(i32::MAX)),
            1 => Just(-i64::from(i32::MAX) - 1),
            1 => -(1i64 << 50)..(1 << 50),
        ]
    }

    proptest! {
        #[test]
        fn nothing_wraps(
            steps in prop::collection::vec((prop::collection::vec(number(), 8), any::<bool>(), any::<bool>()), 1..12),
        ) {
            let mut brick = SumBrick::<2>::zero(4);
            let mut exact = vec![0i128; 8];
            for (numbers, plus, alike) in &steps {
                let numbers: Vec<i64> = if *alike {
                    [numbers[0], numbers[1]].iter().flat_map(|&v| [v; 4]).collect()
                } else {
                    numbers.clone()
                };
                let sign = if *plus { Sign::Plus } else { Sign::Minus };
                let more = SumBrick::<2>::of_planes(&numbers).unwrap();
                prop_assert!(brick.add_brick(&more, sign));
                oracle(&mut exact, &numbers, sign);
                let found: Vec<i128> = brick.planes().iter().map(|&v| v.into()).collect();
                prop_assert_eq!(&found, &exact);
                let narrow = brick.narrowest();
                prop_assert!(narrow == brick && narrow.planes() == brick.planes());
                // One form for one set of sums.
                let again = SumBrick::<2>::of_planes(&brick.planes()).unwrap();
                prop_assert_eq!(narrow.width(), again.width());
                prop_assert_eq!(narrow.all_alike(), again.all_alike());
            }
            for (numbers, plus, alike) in steps.iter().rev() {
                let numbers: Vec<i64> = if *alike {
                    [numbers[0], numbers[1]].iter().flat_map(|&v| [v; 4]).collect()
                } else {
                    numbers.clone()
                };
                let sign = if *plus { Sign::Minus } else { Sign::Plus };
                prop_assert!(brick.add_brick(&SumBrick::of_planes(&numbers).unwrap(), sign));
            }
            prop_assert!(brick == SumBrick::zero(4) && brick.narrowest().all_alike() == Some([0; 2]));
        }
    }

    #[test]
    fn what_would_pass_the_largest_sum_is_refused() {
        let large = SumBrick::<2>::of_planes(&[MOST_SUM, 0, 1, 2]).unwrap();
        let mut brick = large.clone();
        assert!(!brick.add_brick(&large, Sign::Plus));
        assert!(brick == large);
        assert!(brick.add_brick(&large, Sign::Minus) || brick == large);
        assert!(SumBrick::<2>::of_planes(&[MOST_SUM + 1, 0]).is_none());
        assert!(SumBrick::<2>::of_planes(&[i64::MIN, 0]).is_none());
        assert!(SumBrick::<2>::of_planes(&[1, 2, 3]).is_none() && SumBrick::<2>::of_planes(&[]).is_none());
    }
}
