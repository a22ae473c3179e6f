//! The information gain of a view: how many unknown cells a sensor would see from a pose.

use super::cells::{Known, Reader};
use super::follow::{End, follow};
use crate::cell::SignedDistance;
use crate::geom::vector::unit;
use crate::geom::{Aabb, BlockKey, Pose};
use crate::map::DistanceMap;
use crate::parallel;
use crate::store::{Bricks, Store};
use rustc_hash::FxHashMap;

/// Settings of [`expected_gain`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainSettings<const D: usize> {
    /// Cells of smaller weight are unknown.
    pub min_weight: Option<f32>,
    /// Range of the sensor (meters). Infinite is limited to 100,000 cells, the longest ray.
    pub max_range: f64,
    /// Depth to which a ray is expected to see into unknown space (meters, summed along the ray); infinite for the whole
    /// range. Unknown space may be occupied: with more than the typical depth of a room, the gain counts mostly walls.
    pub penetration: f64,
    /// Rays end where they leave this box (world), so that nothing outside it is counted. `None` for no bounds.
    pub bounds: Option<Aabb<D>>,
}

impl<const D: usize> Default for GainSettings<D> {
    /// A weight of 0.5, half an observation; a range of 5 m; a penetration of 1 m; no bounds.
    fn default() -> Self {
        Self { min_weight: None, max_range: 5.0, penetration: 1.0, bounds: None }
    }
}

impl<const D: usize> GainSettings<D> {
    /// The default, with the weight that fits a map ([`DistanceMap::min_weight`](crate::map::DistanceMap::min_weight)).
    pub fn of(map: &impl DistanceMap<D>) -> Self {
        Self { min_weight: Some(map.min_weight()), ..Self::default() }
    }
}

/// The expected gain of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewGain {
    /// Area or volume of the unknown cells that rays cross (square or cubic meters); each cell counts once.
    pub volume: f64,
    /// Number of these cells.
    pub cells: usize,
    /// Rays that end at an occupied cell.
    pub hit: usize,
    /// Rays that end in unknown space, at the penetration depth or at the largest range.
    pub unknown: usize,
    /// Rays that leave the bounds or the index range of the lattice.
    pub outside: usize,
    /// Rays that end in free space at the largest range.
    pub free: usize,
    /// Directions that are zero or not finite.
    pub refused: usize,
}

/// Casts rays (directions of any length in the sensor's frame) from a pose and counts the unknown cells that they cross
/// *(after Bircher et al. 2016, who sum the volume in a frustum)*.
///
/// A ray runs through free cells until it meets an occupied one. Unknown cells are counted, up to a total length of
/// [`GainSettings::penetration`] in them. O(cells crossed). With a map of hits per meter at hand,
/// [`expected_gain_through`](super::expected_gain_through) looks past what stops only a part of the beams.
///
/// ```
/// use portolan::cell::DistanceBrick;
/// use portolan::explore::{GainSettings, expected_gain, fan};
/// use portolan::geom::{BlockKey, Lattice, Pose};
/// use portolan::store::Bricks;
///
/// // 8 x 8 free cells of 10 cm; everything else is unknown.
/// let mut store = Bricks::new(Lattice::new([0.0, 0.0], 0.1));
/// store.insert(BlockKey([0, 0]), DistanceBrick::from_parts(&[0.3; 64], &[1.0; 64]).expect("sane"))?;
/// // A single ray to the right crosses 2 unknown cells in 15 cm.
/// let world_from_sensor = Pose::<2>::new(0.45, 0.45, 0.0);
/// let settings = GainSettings { penetration: 0.15, ..Default::default() };
/// let gain = expected_gain(&store, &world_from_sensor, &fan(0.0, 0.0, 1), &settings);
/// assert_eq!((gain.cells, gain.unknown), (2, 1));
/// assert!((gain.volume - 0.02).abs() < 1e-12);
/// # Ok::<(), portolan::store::StoreFull>(())
/// ```
pub fn expected_gain<const D: usize>(
    store: &Bricks<SignedDistance, D>,
    world_from_sensor: &Pose<D>,
    directions_sensor: &[[f64; D]],
    settings: &GainSettings<D>,
) -> ViewGain {
    let mut view = View {
        origin: world_from_sensor.translation,
        reader: Reader::new(store, settings.min_weight.unwrap_or(0.0)),
        store,
        settings,
        seen: CellSet::new(),
    };
    let mut gain = ViewGain::default();
    for direction in directions_sensor {
        let count = match unit(world_from_sensor.rotate(*direction)).map(|d| view.cast(d)) {
            None => &mut gain.refused,
            Some(End::Hit) => &mut gain.hit,
            Some(End::Unknown) => &mut gain.unknown,
            Some(End::Outside) => &mut gain.outside,
            Some(End::Free) => &mut gain.free,
        };
        *count += 1;
    }
    gain.cells = view.seen.count;
    gain.volume = gain.cells as f64 * store.lattice().resolution.powi(D as i32);
    gain
}

/// [`expected_gain`] from many poses (world from sensor), each by itself, in their order. Runs on all cores with the feature
/// `parallel`; results do not depend on it.
pub fn expected_gains<const D: usize>(
    store: &Bricks<SignedDistance, D>,
    poses: &[Pose<D>],
    directions_sensor: &[[f64; D]],
    settings: &GainSettings<D>,
) -> Vec<ViewGain> {
    parallel::map(poses, 1, |pose| expected_gain(store, pose, directions_sensor, settings))
}

/// All rays of one pose.
struct View<'a, const D: usize> {
    origin: [f64; D],
    reader: Reader<'a, D>,
    store: &'a Bricks<SignedDistance, D>,
    settings: &'a GainSettings<D>,
    seen: CellSet<D>,
}

impl<const D: usize> View<'_, D> {
    fn cast(&mut self, direction: [f64; D]) -> End {
        let mut passed = 0.0;
        follow(self.store.lattice(), self.origin, direction, self.settings, |cell, stretch| {
            let found = self.reader.at(cell);
            if found == Known::Occupied {
                return Err(End::Hit);
            }
            if found == Known::Unknown && stretch.counts {
                if passed >= self.settings.penetration {
                    return Err(End::Unknown);
                }
                self.seen.insert(cell);
                passed += stretch.inside;
            }
            Ok(found)
        })
    }
}

/// A set of cells: a bit each, brick by brick.
struct CellSet<const D: usize> {
    slots: FxHashMap<BlockKey<D>, usize>,
    bits: Vec<[u64; 8]>,
    /// The brick of the last cell inserted.
    last: Option<(BlockKey<D>, usize)>,
    count: usize,
}

impl<const D: usize> CellSet<D> {
    fn new() -> Self {
        Self { slots: FxHashMap::default(), bits: Vec::new(), last: None, count: 0 }
    }

    #[inline]
    fn insert(&mut self, cell: [i32; D]) {
        let key = BlockKey::of_cell(cell);
        let slot = match self.last {
            Some((last, slot)) if last == key => slot,
            _ => {
                let slot = *self.slots.entry(key).or_insert(self.bits.len());
                if slot == self.bits.len() {
                    self.bits.push([0; 8]);
                }
                self.last = Some((key, slot));
                slot
            }
        };
        let i = BlockKey::offset(cell);
        let (word, bit) = (&mut self.bits[slot][i >> 6], 1u64 << (i & 63));
        self.count += usize::from(*word & bit == 0);
        *word |= bit;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explore::testing::{Edit, Stretch, cells_in_range, edits, put, stretches};
    use crate::explore::{fan, spherical};
    use crate::geom::Lattice;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn store<const D: usize>(edits: &[Edit]) -> Bricks<SignedDistance, D> {
        let mut store = Bricks::new(Lattice::new([100.0; D], 0.1));
        edits.iter().for_each(|edit| put(&mut store, edit));
        store
    }

    /// What the rays see, found from the box of every cell in range: the stretch of the ray inside it, nearest first.
    fn by_every_cell<const D: usize>(
        store: &Bricks<SignedDistance, D>,
        pose: &Pose<D>,
        directions: &[[f64; D]],
        settings: &GainSettings<D>,
    ) -> (BTreeSet<[i32; D]>, [usize; 4]) {
        let lattice = store.lattice();
        let cells = cells_in_range(lattice, pose, settings.max_range);
        let (mut seen, mut ends) = (BTreeSet::new(), [0; 4]);
        for d in directions {
            let (crossed, leave) = stretches(lattice, &cells, pose, *d, settings);
            let (mut how, mut in_unknown) = (None, false);
            for Stretch { counts, cell, .. } in crossed {
                match store.cell(cell).filter(|c| Some(c.weight) >= settings.min_weight) {
                    Some(c) if c.distance <= 0.0 => {
                        how = Some(0);
                        break;
                    }
                    Some(_) => in_unknown = false,
                    None => {
                        in_unknown = true;
                        if counts {
                            seen.insert(cell);
                        }
                    }
                }
            }
            let ended = if leave < settings.max_range { 2 } else { [3, 1][usize::from(in_unknown)] };
            ends[how.unwrap_or(ended)] += 1;
        }
        (seen, ends)
    }

    fn sees_what_every_cell_says<const D: usize>(
        store: &Bricks<SignedDistance, D>,
        pose: &Pose<D>,
        directions: &[[f64; D]],
        settings: &GainSettings<D>,
    ) {
        let gain = expected_gain(store, pose, directions, settings);
        let (seen, ends) = by_every_cell(store, pose, directions, settings);
        assert_eq!([gain.hit, gain.unknown, gain.outside, gain.free], ends);
        assert_eq!((gain.cells, gain.refused), (seen.len(), 0));
        assert!((gain.volume - gain.cells as f64 * 0.1f64.powi(D as i32)).abs() < 1e-12);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, ..Default::default() })]
        #[test]
        fn sees_what_every_cell_says_2d(edits in edits(), x in 99.0..101.5f64, y in 99.0..101.5f64, bounded in any::<bool>()) {
            let bounds = bounded.then(|| Aabb::new([98.0; 2], [102.0; 2]));
            let settings = GainSettings { max_range: 1.7, penetration: f64::INFINITY, bounds, ..Default::default() };
            sees_what_every_cell_says(&store(&edits), &Pose::<2>::new(x, y, 0.3), &fan(-3.0, 3.0, 61), &settings);
        }
        #[test]
        fn sees_what_every_cell_says_3d(edits in edits(), p in prop::array::uniform3(99.0..101.5f64)) {
            let pose = Pose { translation: p, ..Pose::IDENTITY };
            let rays = spherical([-3.0, 3.0], 9, [-1.2, 1.3], 5);
            let settings = GainSettings { max_range: 1.2, penetration: f64::INFINITY, ..Default::default() };
            sees_what_every_cell_says::<3>(&store(&edits), &pose, &rays, &settings);
        }
    }

    /// A free strip of 16 x 8 cells, a wall in its last column.
    fn strip() -> Bricks<SignedDistance, 2> {
        let mut store = Bricks::new(Lattice::new([0.0; 2], 0.1));
        for x in 0..2 {
            let distance = |i| if x == 1 && i % 8 == 7 { -0.1 } else { 0.3 };
            store.insert(BlockKey([x, 0]), crate::testing::brick::<2>(|i| Some((distance(i), 1.0)))).unwrap();
        }
        store
    }

    #[test]
    fn rays_are_counted_by_how_they_end() {
        let store = strip();
        let at = Pose::<2>::new(0.85, 0.45, 0.0);
        let directions = [[1.0, 0.0], [-3.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.0, 0.0], [f64::NAN, 1.0]];
        let settings = GainSettings { max_range: 0.6, ..Default::default() };
        let gain = expected_gain(&store, &at, &directions, &settings);
        // To the wall; not to the end of the strip; 0.25 m and 0.15 m of the unknown above and below.
        assert_eq!((gain.hit, gain.free, gain.unknown, gain.outside, gain.refused), (0, 2, 2, 0, 2));
        assert_eq!(gain.cells, 3 + 2);
        let far = GainSettings { max_range: 5.0, penetration: 0.25, ..Default::default() };
        let gain = expected_gain(&store, &at, &directions, &far);
        assert_eq!((gain.hit, gain.free, gain.unknown, gain.cells), (1, 0, 3, 9));
        let none = expected_gain(&store, &at, &directions, &GainSettings { penetration: 0.0, ..far });
        assert_eq!((none.cells, none.unknown), (0, 3));
        let bounds = Some(Aabb::new([0.0; 2], [1.6, 1.0]));
        let gain = expected_gain(&store, &at, &directions, &GainSettings { bounds, ..far });
        assert_eq!((gain.hit, gain.outside, gain.cells), (1, 3, 2));
        // From outside of the bounds, what lies before them does not count, but hides.
        let away = Pose::<2>::new(0.85, 3.05, 0.0);
        let gain =
            expected_gain(&store, &away, &[[0.0, -1.0]], &GainSettings { bounds, penetration: 9.0, ..far });
        assert_eq!((gain.outside, gain.cells), (1, 2));
    }

    #[test]
    fn absurd_ranges_end() {
        let store = strip();
        let settings =
            GainSettings { max_range: f64::INFINITY, penetration: f64::INFINITY, ..Default::default() };
        let diagonal = [[1.0, 1.0], [-1.0, 0.3]];
        let gain = expected_gain(&store, &Pose::<2>::new(0.5, 0.5, 0.0), &diagonal, &settings);
        assert_eq!(gain.unknown, 2);
        assert!(gain.cells < 400_000);
        let nan = GainSettings { max_range: f64::NAN, penetration: f64::NAN, ..Default::default() };
        assert_eq!(expected_gain(&store, &Pose::<2>::new(0.5, 0.5, 0.0), &diagonal, &nan).unknown, 2);
        let lost = Pose::<2>::new(f64::NAN, 1e300, 0.0);
        assert_eq!(expected_gain(&store, &lost, &diagonal, &settings).outside, 2);
    }

    #[test]
    #[cfg(feature = "parallel")]
    fn many_views_are_the_same_on_any_number_of_threads() {
        let store = strip();
        let poses: Vec<_> = (0..40).map(|i| Pose::<2>::new(0.04 * f64::from(i), 0.4, 0.1)).collect();
        let gains = || expected_gains(&store, &poses, &fan(-3.0, 3.0, 90), &GainSettings::default());
        let of = |threads| crate::testing::with_threads(threads, gains);
        assert_eq!(of(1), of(3));
    }
}
