//! The expected gain of a view past what stops only a part of the beams, by a map of hits per meter.

use super::GainSettings;
use super::cells::{Known, Reader};
use super::follow::{End, follow};
use crate::cell::{HitLength, HitLengthBrick, Planes, SignedDistance};
use crate::geom::vector::unit;
use crate::geom::{BlockKey, Pose, block_cells};
use crate::parallel;
use crate::store::{Bricks, Store};
use rustc_hash::FxHashMap;

/// A ray of which fewer than one in so many beams goes on has ended.
const LEAST_SHARE: f64 = 1e-3;

/// The expected gain of a view whose beams get through with the probabilities that a map of hits per meter gives. All numbers
/// but the last are expectations, of beams that each end by themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GainThrough {
    /// Area or volume of the unknown cells that at least one beam reaches (square or cubic meters).
    pub volume: f64,
    /// Number of these cells.
    pub cells: f64,
    /// Rays that end at something.
    pub hit: f64,
    /// Rays that end in unknown space, at the penetration depth or at the largest range.
    pub unknown: f64,
    /// Rays that leave the bounds or the index range of the lattice.
    pub outside: f64,
    /// Rays that end in free space at the largest range.
    pub free: f64,
    /// Directions that are zero or not finite.
    pub refused: usize,
}

/// [`expected_gain`](super::expected_gain) with rays that are weighted by the probability that they get through, instead of
/// ending where a sign says so: behind a fence or a bush that stops a beam in three, two thirds of an unknown cell are still
/// expected to be seen by one beam, and nearly all of it by five.
///
/// Where beams were counted, a ray goes on with `exp(-hits per meter * length)` of what came, as counted
/// ([`Attenuation::attenuation`](crate::map::Attenuation::attenuation)), whatever the sign is. Where none were, as behind
/// walls, it ends at what the signed distances call occupied. What is unknown is said by them alone, and unknown cells are
/// counted up to a total length of [`GainSettings::penetration`] along a ray, each with the probability that at least one ray
/// reaches it. Where less than a thousandth of a ray is left, it has ended. O(cells crossed).
///
/// # Panics
/// Where the two maps have not one lattice.
///
/// ```
/// use portolan::cell::{DistanceBrick, HitLength, HitLengthBrick, LENGTH_UNITS, Planes};
/// use portolan::explore::{GainSettings, expected_gain, expected_gain_through, fan};
/// use portolan::geom::{BlockKey, Lattice, Pose};
/// use portolan::store::Bricks;
///
/// // 8 x 8 cells of 10 cm, free but for a hedge on the right, in which a beam ends per cell's length.
/// let lattice = Lattice::new([0.0, 0.0], 0.1);
/// let (mut distances, mut hits) = (Bricks::new(lattice), Bricks::new(lattice));
/// let hedge = |i: usize| i % 8 == 7;
/// let known: Vec<f32> = (0..64).map(|i| if hedge(i) { -0.1 } else { 0.3 }).collect();
/// distances.insert(BlockKey([0, 0]), DistanceBrick::from_parts(&known, &[1.0; 64]).expect("sane"))?;
/// let mut counts = HitLengthBrick::unobserved(64);
/// let count = |i| HitLength { hits: if hedge(i) { 40 } else { 0 }, length: 40 * LENGTH_UNITS, looks: 40 };
/// (0..64).for_each(|i| counts.set(i, Some(count(i))));
/// hits.insert(BlockKey([0, 0]), counts)?;
///
/// // A single ray to the right ends at the hedge by the sign. A beam in e gets through, to 2 unknown cells in 15 cm.
/// let pose = Pose::<2>::new(0.45, 0.45, 0.0);
/// let (ray, settings) = (fan(0.0, 0.0, 1), GainSettings { penetration: 0.15, ..Default::default() });
/// let sign = expected_gain(&distances, &pose, &ray, &settings);
/// let through = expected_gain_through(&distances, &hits, &pose, &ray, &settings);
/// let passed = (-1.0_f64).exp();
/// assert_eq!((sign.hit, sign.cells), (1, 0));
/// assert!((through.unknown - passed).abs() < 1e-9 && (through.cells - 2.0 * passed).abs() < 1e-9);
/// # Ok::<(), portolan::store::StoreFull>(())
/// ```
pub fn expected_gain_through<const D: usize>(
    store: &Bricks<SignedDistance, D>,
    hits: &Bricks<HitLength, D>,
    world_from_sensor: &Pose<D>,
    directions_sensor: &[[f64; D]],
    settings: &GainSettings<D>,
) -> GainThrough {
    assert_eq!(store.lattice(), hits.lattice(), "both maps have one lattice");
    let mut view = View {
        origin: world_from_sensor.translation,
        reader: Reader::new(store, settings.min_weight.unwrap_or(0.0)),
        counts: Counts { store: hits, last: None },
        store,
        settings,
        seen: Reached::default(),
    };
    let mut gain = GainThrough::default();
    for direction in directions_sensor {
        let Some(direction) = unit(world_from_sensor.rotate(*direction)) else {
            gain.refused += 1;
            continue;
        };
        let (end, through) = view.cast(direction);
        gain.hit += 1.0 - through;
        let share = match end {
            End::Hit => &mut gain.hit,
            End::Unknown => &mut gain.unknown,
            End::Outside => &mut gain.outside,
            End::Free => &mut gain.free,
        };
        *share += through;
    }
    gain.cells = view.seen.expected();
    gain.volume = gain.cells * store.lattice().resolution.powi(D as i32);
    gain
}

/// [`expected_gain_through`] from many poses (world from sensor), each by itself, in their order. Runs on all cores with the
/// feature `parallel`; results do not depend on it.
///
/// # Panics
/// Where the two maps have not one lattice.
pub fn expected_gains_through<const D: usize>(
    store: &Bricks<SignedDistance, D>,
    hits: &Bricks<HitLength, D>,
    poses: &[Pose<D>],
    directions_sensor: &[[f64; D]],
    settings: &GainSettings<D>,
) -> Vec<GainThrough> {
    parallel::map(poses, 1, |pose| expected_gain_through(store, hits, pose, directions_sensor, settings))
}

/// All rays of one pose.
struct View<'a, const D: usize> {
    origin: [f64; D],
    reader: Reader<'a, D>,
    counts: Counts<'a, D>,
    store: &'a Bricks<SignedDistance, D>,
    settings: &'a GainSettings<D>,
    seen: Reached<D>,
}

impl<const D: usize> View<'_, D> {
    /// How a ray ends, and the share of it that gets there.
    fn cast(&mut self, direction: [f64; D]) -> (End, f64) {
        let lattice = self.store.lattice();
        let (mut through, mut passed) = (1.0, 0.0);
        let end = follow(lattice, self.origin, direction, self.settings, |cell, stretch| {
            let found = self.reader.at(cell);
            if found == Known::Unknown && stretch.counts {
                if passed >= self.settings.penetration {
                    return Err(End::Unknown);
                }
                self.seen.reach(cell, through);
                passed += stretch.inside;
            }
            match self.counts.at(cell) {
                Some(c) => through *= (-c.per_cell() * stretch.length / lattice.resolution).exp(),
                None if found == Known::Occupied => return Err(End::Hit),
                None => {}
            }
            if through < LEAST_SHARE { Err(End::Hit) } else { Ok(found) }
        });
        (end, through)
    }
}

/// Reads counts along a ray: the brick is looked up only where it changes.
struct Counts<'a, const D: usize> {
    store: &'a Bricks<HitLength, D>,
    last: Option<(BlockKey<D>, Option<&'a HitLengthBrick>)>,
}

impl<const D: usize> Counts<'_, D> {
    #[inline]
    fn at(&mut self, cell: [i32; D]) -> Option<HitLength> {
        let key = BlockKey::of_cell(cell);
        let brick = match self.last {
            Some((last, brick)) if last == key => brick,
            _ => {
                let brick = self.store.brick(key);
                self.last = Some((key, brick));
                brick
            }
        };
        brick?.get(BlockKey::offset(cell))
    }
}

/// Cells with the probability that no ray has reached them, brick by brick in the order in which they were met.
#[derive(Default)]
struct Reached<const D: usize> {
    slots: FxHashMap<BlockKey<D>, usize>,
    missed: Vec<Box<[f64]>>,
}

impl<const D: usize> Reached<D> {
    fn reach(&mut self, cell: [i32; D], probability: f64) {
        let slot = *self.slots.entry(BlockKey::of_cell(cell)).or_insert(self.missed.len());
        if slot == self.missed.len() {
            self.missed.push(vec![1.0; block_cells::<D>()].into());
        }
        self.missed[slot][BlockKey::offset(cell)] *= 1.0 - probability;
    }

    fn expected(&self) -> f64 {
        self.missed.iter().flatten().map(|missed| 1.0 - missed).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, LENGTH_UNITS};
    use crate::explore::testing::{Edit, cells_in_range, edits, put, stretches};
    use crate::explore::{ViewGain, expected_gain, fan, spherical};
    use crate::geom::{Aabb, Lattice};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    type Maps<const D: usize> = (Bricks<SignedDistance, D>, Bricks<HitLength, D>);

    /// Counts where other edits have distances: what passes everything, a third, next to nothing, and hits without a length.
    fn maps<const D: usize>(signs: &[Edit], counts: &[Edit]) -> Maps<D> {
        let lattice = Lattice::new([100.0; D], 0.1);
        let (mut store, mut spare) = (Bricks::new(lattice), Bricks::new(lattice));
        signs.iter().for_each(|edit| put(&mut store, edit));
        counts.iter().for_each(|edit| put(&mut spare, edit));
        let mut hits = Bricks::<HitLength, D>::new(lattice);
        for key in spare.keys() {
            let mut brick = <HitLength as Cell>::Brick::unobserved(block_cells::<D>());
            for i in 0..block_cells::<D>() {
                let Some(c) = spare.brick(key).unwrap().get(i) else { continue };
                let (hits, cells) = match (c.distance > 0.0, c.weight > 0.5) {
                    (true, true) => (0, 40),
                    (true, false) => (40, 40),
                    (false, _) if c.distance < 0.0 => (90, 30),
                    (false, _) => (1, 0),
                };
                brick.set(i, Some(HitLength { hits, length: cells * LENGTH_UNITS, looks: 9 }));
            }
            hits.insert(key, brick).unwrap();
        }
        (store, hits)
    }

    /// The same from the box of every cell in range, and a product over all rays for each.
    fn by_every_cell<const D: usize>(
        (store, hits): &Maps<D>,
        pose: &Pose<D>,
        directions: &[[f64; D]],
        settings: &GainSettings<D>,
    ) -> (f64, [f64; 4]) {
        let (mut missed, mut ends) = (BTreeMap::<[i32; D], f64>::new(), [0.0; 4]);
        let cells = cells_in_range(store.lattice(), pose, settings.max_range);
        for d in directions {
            let (crossed, leave) = stretches(store.lattice(), &cells, pose, *d, settings);
            let (mut depth, mut in_unknown, mut stopped) = (0.0f64, false, false);
            for s in crossed {
                let sign = store.cell(s.cell).filter(|c| Some(c.weight) >= settings.min_weight);
                in_unknown = sign.is_none();
                if in_unknown && s.counts {
                    *missed.entry(s.cell).or_insert(1.0) *= 1.0 - (-depth).exp();
                }
                match hits.cell(s.cell) {
                    Some(c) => {
                        // A hit without a length has the least that there is.
                        let meters = 0.1 * f64::from(c.length.max(1)) / f64::from(LENGTH_UNITS);
                        depth += f64::from(c.hits) / meters * s.length;
                    }
                    None if sign.is_some_and(|c| c.distance <= 0.0) => depth = f64::INFINITY,
                    None => {}
                }
                stopped = (-depth).exp() < 1e-3;
                if stopped {
                    break;
                }
            }
            let ended = if leave < settings.max_range { 2 } else { [3, 1][usize::from(in_unknown)] };
            ends[if stopped { 0 } else { ended }] += (-depth).exp();
            ends[0] += 1.0 - (-depth).exp();
        }
        (missed.values().map(|m| 1.0 - m).sum(), ends)
    }

    fn is_what_every_cell_says<const D: usize>(
        maps: &Maps<D>,
        pose: &Pose<D>,
        directions: &[[f64; D]],
        settings: &GainSettings<D>,
    ) {
        let gain = expected_gain_through(&maps.0, &maps.1, pose, directions, settings);
        let (cells, ends) = by_every_cell(maps, pose, directions, settings);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * (1.0 + b);
        assert!(close(gain.cells, cells), "{} {cells}", gain.cells);
        let own = [gain.hit, gain.unknown, gain.outside, gain.free];
        assert!(own.iter().zip(ends).all(|(a, b)| close(*a, b)), "{own:?} {ends:?}");
        assert!(close(own.iter().sum(), directions.len() as f64) && gain.refused == 0);
        assert!(close(gain.volume, cells * 0.1f64.powi(D as i32)));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, ..Default::default() })]
        #[test]
        fn is_what_every_cell_says_2d(
            signs in edits(), counts in edits(), x in 99.0..101.5f64, y in 99.0..101.5f64, bounded in any::<bool>(),
        ) {
            let bounds = bounded.then(|| Aabb::new([98.0; 2], [102.0; 2]));
            let settings = GainSettings { max_range: 1.7, penetration: f64::INFINITY, bounds, ..Default::default() };
            is_what_every_cell_says(&maps(&signs, &counts), &Pose::<2>::new(x, y, 0.3), &fan(-3.0, 3.0, 61), &settings);
        }
        #[test]
        fn is_what_every_cell_says_3d(signs in edits(), counts in edits(), p in prop::array::uniform3(99.0..101.5f64)) {
            let pose = Pose { translation: p, ..Pose::IDENTITY };
            let rays = spherical([-3.0, 3.0], 9, [-1.2, 1.3], 5);
            let settings = GainSettings { max_range: 1.2, penetration: f64::INFINITY, ..Default::default() };
            is_what_every_cell_says::<3>(&maps(&signs, &counts), &pose, &rays, &settings);
        }
        /// Without counts rays end at signs, and all is as without a map of them.
        #[test]
        fn without_counts_nothing_changes(signs in edits(), x in 99.0..101.5f64, y in 99.0..101.5f64) {
            let (store, hits) = maps::<2>(&signs, &[]);
            let (pose, rays) = (Pose::<2>::new(x, y, 0.3), fan(-3.0, 3.0, 61));
            let settings = GainSettings { max_range: 1.7, penetration: 0.4, ..Default::default() };
            let through = expected_gain_through(&store, &hits, &pose, &rays, &settings);
            let ViewGain { cells, hit, unknown, outside, free, .. } = expected_gain(&store, &pose, &rays, &settings);
            let whole = [cells, hit, unknown, outside, free].map(|n| n as f64);
            prop_assert_eq!([through.cells, through.hit, through.unknown, through.outside, through.free], whole);
        }
    }

    #[test]
    fn several_beams_see_more_than_one_behind_what_stops_a_part() {
        // Everything is free in 0.8 m, a curtain in its last column, nothing known behind.
        let lattice = Lattice::new([0.0; 2], 0.1);
        let (mut store, mut hits) = (Bricks::new(lattice), Bricks::<HitLength, 2>::new(lattice));
        let distance = |i: usize| if i % 8 == 7 { -0.1 } else { 0.3 };
        store.insert(BlockKey([0, 0]), crate::testing::brick::<2>(|i| Some((distance(i), 1.0)))).unwrap();
        let mut brick = <HitLength as Cell>::Brick::unobserved(64);
        let cell = |hits| HitLength { hits, length: 100 * LENGTH_UNITS, looks: 9 };
        (0..64).for_each(|i| brick.set(i, Some(cell(if i % 8 == 7 { 100 } else { 0 }))));
        hits.insert(BlockKey([0, 0]), brick).unwrap();
        let (pose, e) = (Pose::<2>::new(0.05, 0.45, 0.0), (-1.0f64).exp());
        let settings = GainSettings { max_range: 0.9, ..Default::default() };
        let of = |rays: &[[f64; 2]]| expected_gain_through(&store, &hits, &pose, rays, &settings);
        // A hit a cell's length: e^-1 gets through, to two cells behind.
        let one = of(&[[1.0, 0.0]]);
        assert!((one.cells - 2.0 * e).abs() < 1e-9 && (one.hit - (1.0 - e)).abs() < 1e-9, "{one:?}");
        assert!((one.volume - 0.02 * e).abs() < 1e-9 && (one.unknown - e).abs() < 1e-9);
        let five = of(&[[1.0, 0.0]; 5]);
        assert!((five.cells - 2.0 * (1.0 - (1.0 - e).powi(5))).abs() < 1e-9, "{five:?}");
        assert_eq!(expected_gain(&store, &pose, &[[1.0, 0.0]], &settings).cells, 0);
        assert_eq!(of(&[[0.0, 0.0], [f64::NAN, 1.0]]).refused, 2);
        let views = expected_gains_through(&store, &hits, &[pose, pose], &[[1.0, 0.0]], &settings);
        assert_eq!(views, [one, one]);
    }

    #[test]
    #[should_panic(expected = "one lattice")]
    fn maps_of_other_cells_are_refused() {
        let store = Bricks::<SignedDistance, 2>::new(Lattice::new([0.0; 2], 0.1));
        let hits = Bricks::<HitLength, 2>::new(Lattice::new([0.0; 2], 0.2));
        expected_gain_through(&store, &hits, &Pose::IDENTITY, &[[1.0, 0.0]], &GainSettings::default());
    }
}
