//! The Euclidean signed distance field of a map in bricks.

use super::TOGETHER;
use super::planes::EsdfBrick;
use super::settings::{EsdfMethod, EsdfUpdate, SparseEsdfSettings};
use crate::answer::Answer;
use crate::cell::SignedDistance;
use crate::field::elements::{Refine, SurfaceElements};
use crate::geom::{BLOCK_EDGE, BlockKey, Lattice, interpolate, vector};
use crate::parallel;
use crate::store::{Bricks, Store};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Signed Euclidean distances (metres) at the centres of the cells of a map in bricks, positive in free space, up to a
/// largest distance.
///
/// Every cell that the map observed is known or saturated; all others are unknown. Outside begins where no brick is
/// near: a brick away from every brick of the map.
///
/// A clone is a snapshot that shares all bricks which neither side has solved again since: readers keep one while
/// [`SparseEsdf::update`] follows the map.
#[derive(Clone, Debug)]
pub struct SparseEsdf<const D: usize> {
    pub(super) lattice: Lattice<D>,
    pub(super) settings: SparseEsdfSettings,
    pub(super) max_distance: f32,
    /// Of the map, when it was looked at last.
    pub(super) epoch: u64,
    pub(super) slots: Arc<FxHashMap<BlockKey<D>, u32>>,
    /// In the order of slots, as are the bricks.
    pub(super) keys: Arc<Vec<BlockKey<D>>>,
    pub(super) bricks: Vec<EsdfBrick>,
    /// Of the accurate method.
    pub(super) surface: SurfaceElements<D>,
}

impl<const D: usize> SparseEsdf<D> {
    /// The field over the observed bricks of a map, by [`SparseEsdfSettings::method`].
    ///
    /// Accurate: the exact distance to the crossings of the surface that [`crate::surface`] extracts, and from there to its
    /// segments or triangles ([`SparseEsdf::measure`] says when); up to 509 cells, whatever `max_distance` says. Seeded: what
    /// [`crate::field::esdf_from_tsdf`] makes of a dense map, up to `max_distance`. The sign is that of the cell's own
    /// estimate.
    ///
    /// O(cells of the observed bricks x cells of `max_distance`) at worst, where nothing is near. In parallel with the
    /// feature `parallel`; the result is the same bytes.
    ///
    /// # Panics
    /// Where `max_distance` is not positive.
    pub fn of(store: &Bricks<SignedDistance, D>, settings: &SparseEsdfSettings) -> Self {
        assert!(settings.max_distance > 0.0, "distances are maintained up to a positive length");
        let lattice = *store.lattice();
        let reach = settings.reach_cells(lattice.resolution);
        let mut field = Self {
            lattice,
            settings: *settings,
            max_distance: (reach * lattice.resolution) as f32,
            epoch: 0,
            slots: Arc::default(),
            keys: Arc::default(),
            bricks: Vec::new(),
            surface: SurfaceElements::new(settings.min_weight),
        };
        field.update(store);
        field
    }

    /// Follows the map that the field was made of: afterwards it is what [`SparseEsdf::of`] makes of it, bit for bit.
    /// Only what changed since and what lies within the largest distance of it is solved again, and only where the surface
    /// is not what it was; by the other methods than [`EsdfMethod::Accurate`], everything.
    ///
    /// O(bricks + cells within reach of a change).
    ///
    /// # Panics
    /// Where the map has another lattice.
    pub fn update(&mut self, store: &Bricks<SignedDistance, D>) -> EsdfUpdate {
        assert_eq!(self.lattice, *store.lattice(), "the map that the field was made of");
        if self.settings.method == EsdfMethod::Accurate {
            return self.follow(store);
        }
        let changed = store.changed_since(self.epoch).len();
        if changed > 0 {
            self.solve_cells(store);
        }
        let solved = if changed > 0 { self.keys.len() } else { 0 };
        EsdfUpdate { changed, touched: changed, solved, stale: 0 }
    }

    /// Measures the distances of all bricks that were not read yet, in parallel with the feature `parallel`. Otherwise the
    /// accurate method measures a brick when it is read for the first time, which makes that one query slow (a tenth of a
    /// millisecond) and leaves alone what nobody asks for.
    pub fn measure(&self) {
        let slots: Vec<usize> =
            (0..self.bricks.len()).filter(|&s| self.bricks[s].distance.get().is_none()).collect();
        parallel::map_with(&slots, TOGETHER, Refine::new, |&slot, refine| {
            // A reader may be first.
            let _ = self.bricks[slot].distance.set(self.measured(slot, refine));
        });
    }

    /// How the field is made.
    pub fn settings(&self) -> &SparseEsdfSettings {
        &self.settings
    }

    /// Index to metres.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// Distances are maintained up to here (metres).
    pub fn max_distance(&self) -> f32 {
        self.max_distance
    }

    /// The keys of the bricks that hold an observed cell, ascending. O(n log n).
    pub fn keys(&self) -> Vec<BlockKey<D>> {
        let mut keys = self.keys.to_vec();
        keys.sort_unstable();
        keys
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let bucket = size_of::<(BlockKey<D>, u32)>() + 1;
        self.bricks.iter().map(EsdfBrick::bytes).sum::<usize>()
            + self.keys.capacity() * size_of::<BlockKey<D>>()
            + self.slots.capacity() * 8 / 7 * bucket
            + self.surface.memory_bytes()
            + size_of::<Self>()
    }

    /// Signed distance at the centre of a cell (metres).
    pub fn cell(&self, cell: [i32; D]) -> Answer<f32> {
        match self.value(cell) {
            Some(v) if v.is_nan() => Answer::Unknown,
            Some(v) if v.is_infinite() => Answer::Saturated(self.clamped(v)),
            Some(v) => Answer::Known(v),
            None => self.nothing_at(cell),
        }
    }

    /// Signed distance (metres) at a point, interpolated between the centres around it; its status is the worst of
    /// theirs. Saturated: at least so far, on the side of the sign. O(1).
    #[inline]
    pub fn distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        self.distance_and_gradient(p_world).map(|(value, _)| value)
    }

    /// The exact derivative of [`SparseEsdf::distance`] (per metre): the direction away from the nearest surface. 0
    /// where all around is saturated. O(1).
    #[inline]
    pub fn gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<[f64; D]> {
        self.distance_and_gradient(p_world).map(|(_, gradient)| gradient)
    }

    /// Value and gradient of one interpolant in one call. O(1): a look into one brick, or into up to `2^D` where the
    /// centres around the point lie in several.
    pub fn distance_and_gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<(f64, [f64; D])> {
        let p = p_world.into();
        let shifted: [f64; D] = std::array::from_fn(|k| p[k] - 0.5 * self.lattice.resolution);
        let Some(base) = self.lattice.cell_of(shifted) else { return Answer::Outside };
        let cells = self.lattice.to_cells(p);
        let fraction = std::array::from_fn(|k| (cells[k] - 0.5 - f64::from(base[k])).clamp(0.0, 1.0));
        let Some((corners, saturated)) = self.corners(base) else {
            // A point belongs to the cell that holds it.
            return self.lattice.cell_of(p).map_or(Answer::Outside, |cell| match self.value(cell) {
                Some(_) => Answer::Unknown,
                None => self.nothing_at(cell),
            });
        };
        let (value, slope) = interpolate(&corners, &std::array::from_fn(|k| 1 << k), 0, &fraction);
        let answer = (value, vector::scale(slope, 1.0 / self.lattice.resolution));
        if saturated { Answer::Saturated(answer) } else { Answer::Known(answer) }
    }

    /// The `2^D` values from `base` on, clamped to the largest distance, and whether one of them was; `None` where one
    /// is unknown.
    #[inline]
    pub(in crate::field) fn corners(&self, base: [i32; D]) -> Option<([f32; 8], bool)> {
        let mut corners = [0.0; 8];
        let key = BlockKey::of_cell(base);
        let inside = (0..D).all(|k| (base[k] & 7) < BLOCK_EDGE as i32 - 1);
        let brick = if inside { self.brick(key)? } else { &[] };
        for (c, corner) in corners.iter_mut().enumerate().take(1 << D) {
            let cell: [i32; D] = std::array::from_fn(|k| base[k] + ((c >> k) & 1) as i32);
            *corner = if inside { brick[BlockKey::offset(cell)] } else { self.value(cell)? };
        }
        let used = &corners[..1 << D];
        if used.iter().any(|v| v.is_nan()) {
            return None;
        }
        let saturated = used.iter().any(|v| v.is_infinite());
        Some((corners.map(|v| self.clamped(v)), saturated))
    }

    pub(super) fn clamped(&self, value: f32) -> f32 {
        value.clamp(-self.max_distance, self.max_distance)
    }

    #[inline]
    pub(in crate::field) fn brick(&self, key: BlockKey<D>) -> Option<&[f32]> {
        Some(self.plane(self.slot(key)?))
    }

    /// Signed distances of the brick in a slot, measured if nobody has read them yet.
    #[inline]
    pub(super) fn plane(&self, slot: usize) -> &[f32] {
        self.bricks[slot].distance.get_or_init(|| self.measured(slot, &mut Refine::new()))
    }

    #[inline]
    pub(super) fn slot(&self, key: BlockKey<D>) -> Option<usize> {
        self.slots.get(&key).map(|&slot| slot as usize)
    }

    pub(super) fn add(&mut self, key: BlockKey<D>, brick: EsdfBrick) {
        Arc::make_mut(&mut self.slots).insert(key, self.bricks.len() as u32);
        Arc::make_mut(&mut self.keys).push(key);
        self.bricks.push(brick);
    }

    /// The last brick takes its place.
    pub(super) fn remove(&mut self, key: BlockKey<D>, slot: usize) {
        let (slots, keys) = (Arc::make_mut(&mut self.slots), Arc::make_mut(&mut self.keys));
        slots.remove(&key);
        keys.swap_remove(slot);
        self.bricks.swap_remove(slot);
        if let Some(moved) = keys.get(slot) {
            slots.insert(*moved, slot as u32);
        }
    }

    pub(super) fn clear(&mut self) {
        (self.slots, self.keys) = Default::default();
        self.bricks.clear();
    }

    /// The stored value of a cell; `None` where there is no brick.
    #[inline]
    pub(super) fn value(&self, cell: [i32; D]) -> Option<f32> {
        Some(self.brick(BlockKey::of_cell(cell))?[BlockKey::offset(cell)])
    }

    /// Unknown beside a brick of the map, outside elsewhere.
    pub(super) fn nothing_at<T>(&self, cell: [i32; D]) -> Answer<T> {
        let key = BlockKey::of_cell(cell);
        let near = (0..3usize.pow(D as u32)).any(|n| {
            let step = |k: usize| (n / 3usize.pow(k as u32) % 3) as i32 - 1;
            self.slots.contains_key(&BlockKey(std::array::from_fn(|k| key.0[k] + step(k))))
        });
        if near { Answer::Unknown } else { Answer::Outside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{DistanceBrick, Planes};
    use crate::field::esdf_from_tsdf;
    use crate::geom::Grid;
    use crate::geom::block_cells;
    use crate::map::{DenseTsdf, TsdfConfig};
    use proptest::prelude::*;

    const R: f64 = 0.1;
    const SEEDED: EsdfMethod = EsdfMethod::Seeded { band_cells: 1.5 };

    /// Key, and cells: place, distance, weight.
    type RandomBrick = ([i32; 3], Vec<(usize, f32, f32)>);

    /// Random cells of random bricks: mostly free or unobserved, some within the band.
    fn store<const D: usize>(bricks: &[RandomBrick]) -> Bricks<SignedDistance, D> {
        let mut store = Bricks::new(Lattice::new([500_000.0; D], R));
        for (key, cells) in bricks {
            let key = BlockKey(std::array::from_fn(|k| key[k]));
            let mut brick: DistanceBrick =
                store.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(block_cells::<D>()));
            for &(i, distance, weight) in cells {
                let i = i % block_cells::<D>();
                brick.set(i, (weight > 0.0).then_some(SignedDistance { distance, weight }));
            }
            store.insert(key, brick).unwrap();
        }
        store
    }

    fn bricks() -> impl Strategy<Value = Vec<RandomBrick>> {
        let distance = prop_oneof![4 => 0.2f32..0.3, 1 => -0.3f32..-0.2, 1 => -0.16f32..0.16];
        let cell = (any::<usize>(), distance, prop_oneof![Just(0.0f32), 0.2f32..4.0]);
        let at = prop_oneof![3 => -2..3i32, 1 => Just(40_000_000)];
        prop::collection::vec((prop::array::uniform3(at), prop::collection::vec(cell, 1..60)), 0..12)
    }

    fn matches_brute_force<const D: usize>(
        bricks: &[RandomBrick],
        settings: &SparseEsdfSettings,
        band_cells: f32,
    ) {
        let store = store::<D>(bricks);
        let settings = &SparseEsdfSettings { method: EsdfMethod::Seeded { band_cells }, ..*settings };
        let esdf = SparseEsdf::of(&store, settings);
        let observed: Vec<([i32; D], f32)> = store
            .keys()
            .iter()
            .flat_map(|&key| (0..block_cells::<D>()).map(move |i| key.cell(i)))
            .filter_map(|cell| {
                store.cell(cell).filter(|c| c.weight >= settings.min_weight).map(|c| (cell, c.distance))
            })
            .collect();
        let seeds: Vec<_> = observed.iter().filter(|(_, d)| (d / R as f32).abs() <= band_cells).collect();
        for (cell, d) in &observed {
            let nearest = seeds.iter().map(|(seed, offset)| {
                let sq: f64 = (0..D).map(|k| f64::from(cell[k] - seed[k]).powi(2)).sum();
                sq + (f64::from(*offset) / R).powi(2)
            });
            let want = nearest.fold(f64::INFINITY, f64::min).sqrt() * R;
            let sign = if *d < 0.0 { -1.0 } else { 1.0 };
            // Rounding of squares up to (20 cells)^2 in f32.
            let tolerance = 1e-6 * (1.0 + want);
            match esdf.cell(*cell) {
                Answer::Known(got) => {
                    assert!((f64::from(got) - sign * want).abs() <= tolerance, "{got} {want}")
                }
                Answer::Saturated(got) => {
                    assert!(want >= settings.max_distance - tolerance, "{want} is saturated");
                    assert_eq!(f64::from(got).signum(), sign);
                    assert!((f64::from(got.abs()) - settings.max_distance).abs() < 1e-6);
                }
                other => panic!("{other:?} where {want}"),
            }
        }
        let values = esdf.keys.iter().flat_map(|&key| esdf.brick(key).unwrap());
        let known = values.filter(|v| !v.is_nan()).count();
        assert_eq!(known, observed.len());
    }

    proptest! {
        #[test]
        fn matches_brute_force_2d(bricks in bricks(), max_distance in prop_oneof![Just(0.05), 0.2..4.0f64], band_cells in 0.1..2.0f32) {
            matches_brute_force::<2>(&bricks, &SparseEsdfSettings { max_distance, ..Default::default() }, band_cells);
        }
        #[test]
        fn matches_brute_force_3d(bricks in bricks(), max_distance in prop_oneof![Just(0.05), 0.2..4.0f64], band_cells in 0.1..2.0f32) {
            matches_brute_force::<3>(&bricks, &SparseEsdfSettings { max_distance, ..Default::default() }, band_cells);
        }
    }

    /// A ball in a box of observed cells, dense and in bricks.
    fn ball<const D: usize>(n: usize) -> (DenseTsdf<D>, Bricks<SignedDistance, D>) {
        let config = TsdfConfig { truncation: 0.3, ..Default::default() };
        let mut tsdf = DenseTsdf::covering(&Grid::new([0.0; D], R, [n; D]), config).unwrap();
        let mut bricks = Bricks::new(tsdf.grid().lattice);
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            let d = vector::distance(tsdf.grid().lattice.center(cell), [0.5 * n as f64 * R; D]) - 0.8;
            tsdf.fuse(cell, d, 1.0);
            let key = BlockKey::of_cell(cell);
            let mut brick: DistanceBrick =
                bricks.brick(key).cloned().unwrap_or_else(|| Planes::unobserved(block_cells::<D>()));
            brick.set(BlockKey::offset(cell), tsdf.store().cell(cell));
            bricks.insert(key, brick).unwrap();
        }
        (tsdf, bricks)
    }

    fn is_the_dense_field<const D: usize>() {
        let n = 35;
        let (tsdf, bricks) = ball::<D>(n);
        let dense = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        let seeded = |max_distance| SparseEsdfSettings { max_distance, method: SEEDED, ..Default::default() };
        let (far, near) = (SparseEsdf::of(&bricks, &seeded(10.0)), SparseEsdf::of(&bricks, &seeded(0.6)));
        let mut saturated = 0;
        for i in 0..4000 {
            let p: [f64; D] = std::array::from_fn(|k| {
                (f64::from(i) * [0.618, 0.755, 0.569][k]).fract() * (n as f64 + 2.0) * R - R
            });
            match dense.distance_and_gradient(p) {
                Answer::Known((value, gradient)) => {
                    let (got, slope) = far.distance_and_gradient(p).known().unwrap();
                    assert!((got - value).abs() < 2e-6, "{got} {value}");
                    // Values to 1e-6 m, a tenth of a metre apart.
                    assert!(vector::distance(gradient, slope) < 1e-4);
                    match near.distance(p) {
                        Answer::Known(got) => assert!((got - value).abs() < 2e-6),
                        Answer::Saturated(got) => {
                            assert!(
                                got.abs() <= 0.6 + 1e-6 && got * value > 0.0 && value.abs() > 0.6 - 1.8 * R
                            );
                            saturated += 1;
                        }
                        other => panic!("{other:?}"),
                    }
                }
                // The dense map ends at its cells; the bricks reach on to their own end.
                _ => assert!(matches!(far.distance(p), Answer::Unknown)),
            }
        }
        assert!(saturated > 100);
        assert_eq!(far.distance([-0.5; D]), Answer::Unknown);
        assert_eq!(far.distance([-0.9; D]), Answer::Outside);
        assert_eq!(far.distance([f64::NAN; D]), Answer::Outside);
        assert_eq!(far.distance([1e12; D]), Answer::Outside);
    }

    #[test]
    fn is_the_dense_field_2d_and_3d() {
        is_the_dense_field::<2>();
        is_the_dense_field::<3>();
    }

    #[test]
    #[cfg(feature = "parallel")]
    fn is_the_same_on_any_number_of_threads() {
        let (_, bricks) = ball::<3>(60);
        let of = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| SparseEsdf::of(&bricks, &SparseEsdfSettings::default()))
        };
        let (one, three) = (of(1), of(3));
        assert_eq!(one.keys, three.keys);
        let bits = |esdf: &SparseEsdf<3>| {
            let values = esdf.keys.iter().flat_map(|&key| esdf.brick(key).unwrap());
            values.map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(&one), bits(&three));
    }

    #[test]
    fn nothing_seen_is_unknown_and_nothing_near_is_saturated() {
        let empty = Bricks::<SignedDistance, 3>::new(Lattice::new([0.0; 3], R));
        let esdf = SparseEsdf::of(&empty, &SparseEsdfSettings::default());
        assert_eq!(esdf.distance([0.0; 3]), Answer::Outside);
        let free: Vec<_> = (0..512).map(|i| (i, 0.3, 1.0)).collect();
        let esdf = SparseEsdf::of(&store::<3>(&[([0; 3], free)]), &SparseEsdfSettings::default());
        let p = [500_000.42; 3];
        assert_eq!(esdf.distance_and_gradient(p), Answer::Saturated((1.0, [0.0; 3])));
        assert_eq!(esdf.cell([3; 3]), Answer::Saturated(1.0));
    }
}
