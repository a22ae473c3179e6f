//! The top of the ladder: a map from a sweep, a cell and a store that are none of the library's, through public API alone.

use portolan::cell::{Cell, Evidence, Planes};
use portolan::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use portolan::map::{MapError, integrate};
use portolan::scan::{RefusedBeams, ScanStats};
use portolan::store::{Bricks, Store, StoreFull};
use portolan::sweep::{PlanError, PlanLimits, Sweep, Swept};
use std::collections::BTreeMap;

/// The cell: how many echoes of a sonar fell into it, up to a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Echoes(u32);

/// The evidence: echoes of one scan.
#[derive(Clone)]
struct Counts(Vec<u32>);

impl Evidence for Counts {
    type One = u32;

    fn silent(cells: usize) -> Self {
        Self(vec![0; cells])
    }

    fn clear(&mut self) {
        self.0.fill(0);
    }

    fn one(&self, i: usize) -> Option<u32> {
        Some(self.0[i]).filter(|n| *n > 0)
    }

    fn observed(&self) -> usize {
        self.0.iter().filter(|n| **n > 0).count()
    }

    fn keep(&mut self, inside: impl Fn(usize) -> bool) {
        self.0.iter_mut().enumerate().filter(|(i, _)| !inside(*i)).for_each(|(_, n)| *n = 0);
    }
}

/// Many cells; 0: never observed.
#[derive(Clone, Debug, PartialEq)]
struct Many(Vec<u32>);

impl Planes<Echoes> for Many {
    fn unobserved(n: usize) -> Self {
        Self(vec![0; n])
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    fn get(&self, i: usize) -> Option<Echoes> {
        Some(Echoes(self.0[i])).filter(|e| e.0 > 0)
    }

    fn set(&mut self, i: usize, cell: Option<Echoes>) {
        self.0[i] = cell.map_or(0, |e| e.0);
    }

    fn bytes(&self) -> usize {
        4 * self.0.capacity()
    }
}

impl Cell for Echoes {
    /// The limit.
    type Rule = u32;
    type Planes = Many;
    type Brick = Many;
    type Evidence = Counts;
    type Event = u32;

    fn fuse(cell: Option<Self>, seen: u32, limit: &u32) -> (Self, u32) {
        let before = cell.map_or(0, |e| e.0);
        let after = (before + seen).min(*limit);
        (Self(after), after.saturating_sub(before))
    }

    fn fuse_run(planes: &mut Many, start: usize, seen: &Counts, from: usize, len: usize, limit: &u32) {
        for i in 0..len {
            if let Some(one) = seen.one(from + i) {
                planes.set(start + i, Some(Self::fuse(planes.get(start + i), one, limit).0));
            }
        }
    }

    fn fuse_brick(brick: &mut Many, seen: &Counts, limit: &u32) {
        Self::fuse_run(brick, 0, seen, 0, brick.len(), limit);
    }
}

/// The scan: places where echoes came from, in the sensor's frame.
type Sonar<const D: usize> = [[f64; D]];

/// The sweep: an echo counts where it came from.
#[derive(Default)]
struct Where<const D: usize> {
    keys: Vec<BlockKey<D>>,
    counts: Vec<Counts>,
}

impl<const D: usize> Swept<D> for Where<D> {
    type Evidence = Counts;
    type Scratch = ();

    fn scratch(&self) {}

    fn blocks(&self) -> &[BlockKey<D>] {
        &self.keys
    }

    fn evidence<'a>(&'a self, i: usize, (): &'a mut ()) -> &'a Counts {
        &self.counts[i]
    }
}

impl<const D: usize> Sweep<D> for Where<D> {
    type Scan = Sonar<D>;

    fn plan(
        &mut self,
        scan: &Sonar<D>,
        world_from_sensor: &Pose<D>,
        lattice: &Lattice<D>,
        limits: &PlanLimits<D>,
    ) -> Result<ScanStats, PlanError> {
        let mut touched: BTreeMap<BlockKey<D>, Counts> = BTreeMap::new();
        let mut stats = ScanStats { scans: 1, ..Default::default() };
        for echo in scan {
            let p = world_from_sensor.transform_point(*echo);
            let Some(cell) = lattice.cell_of(p) else {
                stats.refused += RefusedBeams { not_finite: 1, ..Default::default() };
                continue;
            };
            if limits.bounds.is_some_and(|b: Aabb<D>| !b.contains(p)) {
                stats.hits_outside += 1;
                continue;
            }
            let block = touched.entry(BlockKey::of_cell(cell));
            block.or_insert_with(|| Counts::silent(block_cells::<D>())).0[BlockKey::offset(cell)] += 1;
            stats.beams.hit += 1;
        }
        if touched.len() > limits.most_blocks {
            return Err(PlanError::TooManyBlocks);
        }
        (self.keys, self.counts) = touched.into_iter().unzip();
        Ok(stats)
    }
}

/// The store: a sorted map of cells.
struct Sorted<const D: usize> {
    lattice: Lattice<D>,
    cells: BTreeMap<[i32; D], Echoes>,
}

impl<const D: usize> Store<Echoes, D> for Sorted<D> {
    fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    fn cell(&self, cell: [i32; D]) -> Option<Echoes> {
        self.cells.get(&cell).copied()
    }

    fn apply(&mut self, key: BlockKey<D>, evidence: &Counts, limit: &u32) -> Result<(), StoreFull> {
        for i in 0..block_cells::<D>() {
            if let Some(seen) = evidence.one(i) {
                let cell = key.cell(i);
                let after = Echoes::fuse(self.cell(cell), seen, limit).0;
                self.cells.insert(cell, after);
            }
        }
        Ok(())
    }

    fn memory_bytes(&self) -> usize {
        self.cells.len() * size_of::<([i32; D], Echoes)>()
    }
}

/// Own sweep and cell, in the own store and in the library's bricks.
fn a_map_of_ones_own<const D: usize>() {
    let lattice = Lattice::new([-3.0; D], 0.5);
    let mut own = Sorted { lattice, cells: BTreeMap::new() };
    let mut bricks = Bricks::<Echoes, D>::new(lattice);
    let mut sweep = Where::default();
    let limits = PlanLimits::inside(Aabb::new([-3.0; D], [3.0; D]));
    let mut at = Pose::<D>::IDENTITY;
    at.translation[0] = 1.0;
    let mut echo = [0.1; D];
    let mut far = [9.0; D];
    let nowhere = [f64::NAN; D];
    for limit in [5, 5, 3] {
        let scan = [echo, echo, far, nowhere];
        let stats = integrate(&mut own, &mut sweep, &limit, &limits, &at, &scan).unwrap();
        assert_eq!((stats.scans, stats.beams.hit, stats.cells), (1, 2, 1));
        assert_eq!((stats.hits_outside, stats.refused.not_finite), (1, 1));
        assert_eq!(integrate(&mut bricks, &mut sweep, &limit, &limits, &at, &scan).unwrap(), stats);
        far[0] += 1.0;
    }
    echo[0] += 1.0;
    let cell = lattice.cell_of(echo).unwrap();
    assert_eq!(own.cell(cell), Some(Echoes(3)), "2, 4, then clamped");
    assert_eq!(own.cells.len(), 1);
    assert_eq!((bricks.cell(cell), bricks.len()), (own.cell(cell), 1));

    let tilted = Pose { rotation: [[0.5; D]; D], translation: [0.0; D] };
    let refused = integrate(&mut own, &mut sweep, &5, &limits, &tilted, &[echo][..]).unwrap();
    assert_eq!((refused.scans, refused.refused_poses), (0, 1));
    let none = PlanLimits { most_blocks: 0, ..limits };
    let error = integrate(&mut own, &mut sweep, &5, &none, &at, &[echo][..]).unwrap_err();
    assert!(matches!(error, MapError::TooFar { .. }), "{error}");
}

#[test]
fn a_map_of_ones_own_2d_and_3d() {
    a_map_of_ones_own::<2>();
    a_map_of_ones_own::<3>();
}
