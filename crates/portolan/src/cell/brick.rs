//! The planes of one brick, shared between snapshots until one of them changes it.

use super::packed::{ARC_HEADER, Packed};
use super::{LogOddsValue, Planes, SignedDistance};
use std::borrow::Cow;
use std::sync::Arc;

/// Log odds of a brick's cells, x fastest. Cold bricks can be packed ([`LogOddsBrick::packed`]): they answer as before and
/// unpack themselves when they are written to.
#[derive(Clone, Debug)]
pub struct LogOddsBrick<V>(Form<V>);

#[derive(Clone, Debug)]
enum Form<V> {
    Flat(Arc<[V]>),
    Packed(Packed<V>),
}

impl<V: LogOddsValue> LogOddsBrick<V> {
    /// The cells, x fastest, marks of never-observed ones included; a copy where the brick is packed.
    pub fn cells(&self) -> Cow<'_, [V]> {
        match &self.0 {
            Form::Flat(cells) => Cow::Borrowed(cells),
            Form::Packed(packed) => Cow::Owned(packed.unpacked().to_vec()),
        }
    }

    /// The cells for writing; unpacked first where they are packed, copied first where a snapshot shares them.
    pub fn cells_mut(&mut self) -> &mut [V] {
        if let Form::Packed(packed) = &self.0 {
            self.0 = Form::Flat(packed.unpacked());
        }
        match &mut self.0 {
            Form::Flat(cells) => Arc::make_mut(cells),
            Form::Packed(_) => &mut [],
        }
    }

    /// The same cells in the fewest bytes: as indices into the values that occur, where a brick of 512 cells has no more
    /// than 16 of them; else as they are. O(cells).
    pub fn packed(&self) -> Self {
        match &self.0 {
            Form::Flat(cells) => Packed::of(cells).map_or_else(|| self.clone(), |p| Self(Form::Packed(p))),
            Form::Packed(_) => self.clone(),
        }
    }

    /// Whether it is packed.
    pub fn is_packed(&self) -> bool {
        matches!(self.0, Form::Packed(_))
    }
}

/// Equal cells, packed or not.
impl<V: LogOddsValue> PartialEq for LogOddsBrick<V> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && (0..self.len()).all(|i| self.get(i) == other.get(i))
    }
}

impl<V: LogOddsValue> Planes<V> for LogOddsBrick<V> {
    fn unobserved(n: usize) -> Self {
        Self(Form::Flat(std::iter::repeat_n(V::UNOBSERVED, n).collect()))
    }

    fn len(&self) -> usize {
        match &self.0 {
            Form::Flat(cells) => cells.len(),
            Form::Packed(packed) => packed.len(),
        }
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<V> {
        let v = match &self.0 {
            Form::Flat(cells) => cells[i],
            Form::Packed(packed) => packed.at(i),
        };
        (!v.is_unobserved()).then_some(v)
    }

    fn set(&mut self, i: usize, cell: Option<V>) {
        self.cells_mut()[i] = cell.unwrap_or(V::UNOBSERVED);
    }

    fn bytes(&self) -> usize {
        match &self.0 {
            Form::Flat(cells) => size_of_val(&**cells) + ARC_HEADER,
            Form::Packed(packed) => packed.bytes(),
        }
    }
}

/// Signed distances and weights of a brick's cells: a plane of distances, then one of weights, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceBrick(Arc<[f32]>);

impl DistanceBrick {
    /// A brick from its two planes. `None` where the lengths differ or a pair is no state of the filter (weight
    /// negative or NaN, distance not finite).
    pub fn from_parts(distance: &[f32], weight: &[f32]) -> Option<Self> {
        let sane = |(&d, &w): (&f32, &f32)| d.is_finite() && w >= 0.0;
        (distance.len() == weight.len() && distance.iter().zip(weight).all(sane))
            .then(|| Self(distance.iter().chain(weight).copied().collect()))
    }

    /// `D` of every cell (meters); meaningless where the weight is 0.
    #[inline(always)]
    pub fn distances(&self) -> &[f32] {
        &self.0[..self.0.len() / 2]
    }

    /// `W` of every cell; 0: never observed.
    #[inline(always)]
    pub fn weights(&self) -> &[f32] {
        &self.0[self.0.len() / 2..]
    }

    /// Both planes for writing; copied first where a snapshot shares them.
    pub fn planes_mut(&mut self) -> (&mut [f32], &mut [f32]) {
        let half = self.0.len() / 2;
        Arc::make_mut(&mut self.0).split_at_mut(half)
    }
}

impl Planes<SignedDistance> for DistanceBrick {
    fn unobserved(n: usize) -> Self {
        // A copy of zeros: gathering from an iterator goes number by number.
        const ZEROS: [f32; 1024] = [0.0; 1024];
        Self(ZEROS.get(..2 * n).map_or_else(|| vec![0.0; 2 * n].into(), Into::into))
    }

    fn len(&self) -> usize {
        self.0.len() / 2
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<SignedDistance> {
        let weight = self.weights()[i];
        (weight > 0.0).then(|| SignedDistance { distance: self.distances()[i], weight })
    }

    fn set(&mut self, i: usize, cell: Option<SignedDistance>) {
        let cell = cell.unwrap_or(SignedDistance { distance: 0.0, weight: 0.0 });
        let (distance, weight) = self.planes_mut();
        distance[i] = cell.distance;
        weight[i] = cell.weight;
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0) + ARC_HEADER
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{LogOdds8, LogOdds32};
    use proptest::prelude::*;

    fn packs_and_unpacks<V: LogOddsValue>(values: &[V], chosen: &[u8]) {
        let mut brick = LogOddsBrick::<V>::unobserved(512);
        for (i, c) in chosen.iter().enumerate() {
            brick.set(i, values.get(usize::from(*c)).copied());
        }
        let packed = brick.packed();
        assert!((0..512).all(|i| packed.get(i) == brick.get(i)));
        assert!(packed == brick && packed.bytes() <= brick.bytes());
        assert_eq!(packed.is_packed(), values.len() < 16);
        assert!(packed.cells().iter().zip(brick.cells().iter()).all(|(a, b)| a.same(*b)));
        let (mut a, mut b) = (packed.clone(), brick.clone());
        a.set(77, Some(values[0]));
        b.set(77, Some(values[0]));
        assert!(a == b && !a.is_packed() && packed == brick);
    }

    proptest! {
        #[test]
        fn packed_bricks_are_the_same(n in 1usize..18, chosen in prop::collection::vec(any::<u8>(), 512)) {
            // All of the values occur, and so does "never observed".
            let chosen: Vec<u8> =
                chosen.iter().enumerate().map(|(i, c)| if i <= n { i as u8 } else { c % (n as u8 + 1) }).collect();
            let bytes: Vec<_> = (0..n).map(|i| LogOdds8(i as i8 * 7 - 60)).collect();
            packs_and_unpacks(&bytes, &chosen);
            let floats: Vec<_> = (0..n).map(|i| LogOdds32(i as f32 * 0.4 - 2.0)).collect();
            packs_and_unpacks(&floats, &chosen);
        }
    }

    #[test]
    fn bytes_of_packed_bricks() {
        let mut brick = LogOddsBrick::<LogOdds8>::unobserved(512);
        let mut sizes = vec![brick.bytes(), brick.packed().bytes()];
        for i in 0..20 {
            brick.set(i, Some(LogOdds8(i as i8)));
            if [0, 2, 14, 19].contains(&i) {
                sizes.push(brick.packed().bytes());
            }
        }
        assert_eq!(sizes, [528, 0, 88, 152, 288, 528]);
    }
}
