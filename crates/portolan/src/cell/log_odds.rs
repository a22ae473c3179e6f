//! Occupancy as clamped log odds, in a byte or in an `f32`.

use super::model::logit;
use super::{Cell, Endpoint, HitMiss, LogOddsBrick, OccupancyModel, OccupancyModelError, Planes};

/// The clamped log-odds filter: `l <- clamp(l + delta, min, max)`
/// (Moravec & Elfes 1985; the clamp: Yguel et al. 2007, Hornung et al. 2013).
///
/// In a byte, value `v` means log odds `v * quantum` with `quantum = l_max / 127`, so that the upper clamp is
/// exact; the other three numbers are rounded to the nearest multiple. With the default model that is +31 for
/// a hit (0.8485 instead of 0.8473), -15 for a miss (-0.4105 instead of -0.4055), and the range -73 ..= 127
/// (lower clamp p = 0.1194 instead of 0.12).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogOddsRule<V> {
    /// Added for a hit: model minus prior.
    pub hit: V,
    /// Added for a miss: model minus prior; negative.
    pub miss: V,
    /// Lower clamp.
    pub min: V,
    /// Upper clamp.
    pub max: V,
    /// Where an unobserved cell starts.
    pub prior: V,
    /// Log odds per unit of the value; 1 for `f32`.
    pub quantum: f64,
}

/// P(occupied) of every byte: an exponential is ten times as dear as the cell it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbabilityTable(Box<[f64; 256]>);

impl ProbabilityTable {
    /// The table of a rule.
    pub fn new(rule: &LogOddsRule<i8>) -> Self {
        Self(Box::new(std::array::from_fn(|i| LogOdds8(i as u8 as i8).probability(rule))))
    }

    /// P(occupied) of a cell.
    #[inline(always)]
    pub fn of(&self, cell: LogOdds8) -> f64 {
        self.0[usize::from(cell.0 as u8)]
    }
}

impl LogOddsRule<i8> {
    /// The rule of a model, rounded to bytes.
    ///
    /// # Errors
    /// Where the model is not valid, or its lower clamp is further from one half than its upper one.
    pub fn new(model: &OccupancyModel) -> Result<Self, OccupancyModelError> {
        model.validate()?;
        let quantum = logit(model.p_max) / 127.0;
        // Rounding may use up half a unit, and no more may be lost in silence.
        if logit(model.p_min) < -127.5 * quantum {
            return Err(OccupancyModelError::TooSure { p_min: model.p_min, p_max: model.p_max });
        }
        let prior = logit(model.p_prior);
        let byte = |l: f64| (l / quantum).round().clamp(-127.0, 127.0) as i8;
        Ok(Self {
            // At least one unit, or a hit or a miss would say nothing at all.
            hit: byte(logit(model.p_hit) - prior).max(1),
            miss: byte(logit(model.p_miss) - prior).min(-1),
            min: byte(logit(model.p_min)),
            max: 127,
            prior: byte(prior),
            quantum,
        })
    }
}

impl LogOddsRule<f32> {
    /// The rule of a model in `f32`.
    ///
    /// # Errors
    /// Where the model is not valid.
    pub fn new(model: &OccupancyModel) -> Result<Self, OccupancyModelError> {
        model.validate()?;
        let prior = logit(model.p_prior);
        Ok(Self {
            hit: (logit(model.p_hit) - prior) as f32,
            miss: (logit(model.p_miss) - prior) as f32,
            min: logit(model.p_min) as f32,
            max: logit(model.p_max) as f32,
            prior: prior as f32,
            quantum: 1.0,
        })
    }
}

/// One step of a log-odds filter, in the units of the cell's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogOddsEvent<V> {
    /// Value before; `None`: never observed.
    pub before: Option<V>,
    /// What was added.
    pub added: V,
    /// Value after, clamped.
    pub after: V,
}

/// Log odds in a byte. The byte -128 never occurs in a cell: it marks cells that were never observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LogOdds8(pub i8);

/// Log odds in an `f32`, as `.ot` files hold them. NaN never occurs in a cell: it marks cells that were never
/// observed.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct LogOdds32(pub f32);

/// What the two log-odds cells share; lets trees hold either.
pub trait LogOddsValue:
    Cell<
        Planes = Vec<Self>,
        Brick = LogOddsBrick<Self>,
        Evidence = HitMiss,
        Rule: Clone + std::fmt::Debug + Send,
    > + PartialOrd
{
    /// Marks a cell that was never observed. Not a value.
    const UNOBSERVED: Self;

    /// Whether this is the mark of a cell that was never observed.
    fn is_unobserved(self) -> bool;

    /// What makes probabilities of values quickly.
    type Lookup: Clone + std::fmt::Debug + Send + Sync;

    /// The filter's rule for a model.
    ///
    /// # Errors
    /// Where the model is not valid.
    fn rule(model: &OccupancyModel) -> Result<Self::Rule, OccupancyModelError>;

    /// Makes ready for [`LogOddsValue::look_up`].
    fn lookup(rule: &Self::Rule) -> Self::Lookup;

    /// P(occupied) of a value: the same as [`LogOddsValue::probability`], in nanoseconds.
    fn look_up(self, lookup: &Self::Lookup) -> f64;

    /// Whether a value is above P(occupied) = 0.5.
    fn is_occupied(self) -> bool;

    /// P(occupied) of a value.
    fn probability(self, rule: &Self::Rule) -> f64;

    /// The value as a number, in units of the rule's quantum; meaningless for the mark of a never-observed cell.
    fn units(self) -> f64;

    /// The same value, bit for bit, marks included.
    fn same(self, other: Self) -> bool;
}

const UNOBSERVED_BYTE: i8 = i8::MIN;

impl LogOddsValue for LogOdds8 {
    const UNOBSERVED: Self = Self(UNOBSERVED_BYTE);
    type Lookup = ProbabilityTable;

    fn rule(model: &OccupancyModel) -> Result<LogOddsRule<i8>, OccupancyModelError> {
        LogOddsRule::<i8>::new(model)
    }

    fn lookup(rule: &LogOddsRule<i8>) -> ProbabilityTable {
        ProbabilityTable::new(rule)
    }

    #[inline(always)]
    fn look_up(self, lookup: &ProbabilityTable) -> f64 {
        lookup.of(self)
    }

    #[inline(always)]
    fn is_occupied(self) -> bool {
        self.0 > 0
    }

    #[inline(always)]
    fn is_unobserved(self) -> bool {
        self.0 == UNOBSERVED_BYTE
    }

    #[inline(always)]
    fn probability(self, rule: &LogOddsRule<i8>) -> f64 {
        1.0 / (1.0 + (-f64::from(self.0) * rule.quantum).exp())
    }

    #[inline(always)]
    fn units(self) -> f64 {
        f64::from(self.0)
    }

    #[inline(always)]
    fn same(self, other: Self) -> bool {
        self.0 == other.0
    }
}

impl LogOddsValue for LogOdds32 {
    const UNOBSERVED: Self = Self(f32::NAN);
    type Lookup = ();

    fn rule(model: &OccupancyModel) -> Result<LogOddsRule<f32>, OccupancyModelError> {
        LogOddsRule::<f32>::new(model)
    }

    fn lookup(_: &LogOddsRule<f32>) {}

    #[inline(always)]
    fn look_up(self, (): &()) -> f64 {
        1.0 / (1.0 + (-f64::from(self.0)).exp())
    }

    #[inline(always)]
    fn is_occupied(self) -> bool {
        self.0 > 0.0
    }

    #[inline(always)]
    fn is_unobserved(self) -> bool {
        self.0.is_nan()
    }

    #[inline(always)]
    fn probability(self, _: &LogOddsRule<f32>) -> f64 {
        1.0 / (1.0 + (-f64::from(self.0)).exp())
    }

    #[inline(always)]
    fn units(self) -> f64 {
        f64::from(self.0)
    }

    #[inline(always)]
    fn same(self, other: Self) -> bool {
        self.0.to_bits() == other.0.to_bits() || (self.0.is_nan() && other.0.is_nan())
    }
}

impl<V: LogOddsValue> Planes<V> for Vec<V> {
    fn unobserved(n: usize) -> Self {
        vec![V::UNOBSERVED; n]
    }

    fn len(&self) -> usize {
        self.as_slice().len()
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Option<V> {
        let v = self[i];
        (!v.is_unobserved()).then_some(v)
    }

    fn set(&mut self, i: usize, cell: Option<V>) {
        self[i] = cell.unwrap_or(V::UNOBSERVED);
    }

    fn bytes(&self) -> usize {
        self.capacity() * size_of::<V>()
    }
}

/// The filter in its own arithmetic; both cells are this, with another scalar.
macro_rules! log_odds_cell {
    ($cell:ident, $scalar:ty, $step:ident, $brick:path) => {
        impl Cell for $cell {
            type Rule = LogOddsRule<$scalar>;
            type Planes = Vec<Self>;
            type Brick = LogOddsBrick<Self>;
            type Evidence = HitMiss;
            type Event = LogOddsEvent<$scalar>;

            #[inline]
            fn fuse(cell: Option<Self>, o: Endpoint, rule: &Self::Rule) -> (Self, Self::Event) {
                let added = if o == Endpoint::Hit { rule.hit } else { rule.miss };
                let after = $step(cell.map_or(rule.prior, |c| c.0), added, rule);
                (Self(after), LogOddsEvent { before: cell.map(|c| c.0), added, after })
            }

            #[inline]
            fn fuse_run(
                planes: &mut Vec<Self>,
                start: usize,
                evidence: &HitMiss,
                from: usize,
                len: usize,
                rule: &Self::Rule,
            ) {
                Self::fuse_cells(&mut planes[start..start + len], evidence, from, rule);
            }

            #[inline]
            fn fuse_brick(brick: &mut LogOddsBrick<Self>, evidence: &HitMiss, rule: &Self::Rule) {
                $brick(brick.cells_mut(), evidence, rule);
            }
        }

        impl $cell {
            #[inline(always)]
            fn fuse_cells(cells: &mut [Self], evidence: &HitMiss, from: usize, rule: &LogOddsRule<$scalar>) {
                for (row, cells) in cells.chunks_mut(8).enumerate() {
                    let (hit, miss) = evidence.row(from + 8 * row);
                    if hit | miss == 0 {
                        continue;
                    }
                    for (k, cell) in cells.iter_mut().enumerate() {
                        let (hit, miss) = (hit >> k & 1 != 0, miss >> k & 1 != 0);
                        let before = if cell.is_unobserved() { rule.prior } else { cell.0 };
                        let after = $step(before, if hit { rule.hit } else { rule.miss }, rule);
                        *cell = if hit | miss { Self(after) } else { *cell };
                    }
                }
            }
        }
    };
}

#[inline(always)]
fn step_byte(before: i8, added: i8, rule: &LogOddsRule<i8>) -> i8 {
    // Saturating is exact here: a sum beyond a byte is beyond the clamp as well.
    before.saturating_add(added).clamp(rule.min, rule.max)
}

#[inline(always)]
fn step_float(before: f32, added: f32, rule: &LogOddsRule<f32>) -> f32 {
    (before + added).clamp(rule.min, rule.max)
}

log_odds_cell!(LogOdds8, i8, step_byte, fuse_bytes);
log_odds_cell!(LogOdds32, f32, step_float, fuse_floats);

fn fuse_floats(cells: &mut [LogOdds32], evidence: &HitMiss, rule: &LogOddsRule<f32>) {
    LogOdds32::fuse_cells(cells, evidence, 0, rule);
}

/// The byte filter, 64 cells a step.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx2", "x86_64+avx2"))]
fn fuse_bytes(cells: &mut [LogOdds8], evidence: &HitMiss, rule: &LogOddsRule<i8>) {
    const BIT: [u8; 64] = {
        let mut bit = [0; 64];
        let mut k = 0;
        while k < 64 {
            bit[k] = 1 << (k % 8);
            k += 1;
        }
        bit
    };
    for (w, cells) in cells.chunks_exact_mut(64).enumerate() {
        let (hit, miss) = evidence.word(w);
        if hit | miss == 0 {
            continue;
        }
        let (hit, miss) = (spread(hit), spread(miss));
        for k in 0..64 {
            let (hit, miss) = (hit[k] & BIT[k] != 0, miss[k] & BIT[k] != 0);
            let before = if cells[k].0 == UNOBSERVED_BYTE { rule.prior } else { cells[k].0 };
            let after = step_byte(before, if hit { rule.hit } else { rule.miss }, rule);
            cells[k].0 = if hit | miss { after } else { cells[k].0 };
        }
    }
}

/// Every byte eight times.
#[inline(always)]
fn spread(word: u64) -> [u8; 64] {
    let mut bytes = [0; 64];
    for (eight, byte) in bytes.chunks_exact_mut(8).zip(word.to_le_bytes()) {
        eight.copy_from_slice(&(u64::from(byte) * 0x0101_0101_0101_0101).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Evidence;
    use proptest::prelude::*;

    #[test]
    fn a_byte_refuses_a_lower_clamp_that_it_cannot_hold() {
        let sure = OccupancyModel { p_min: 0.001, ..Default::default() };
        let error = LogOddsRule::<i8>::new(&sure).unwrap_err();
        assert_eq!(error, OccupancyModelError::TooSure { p_min: 0.001, p_max: 0.97 });
        assert!((LogOddsRule::<f32>::new(&sure).unwrap().min - (0.001f32 / 0.999).ln()).abs() < 1e-5);
        // As far below as above is held, and comes back.
        let even = OccupancyModel { p_min: 0.03, ..Default::default() };
        let rule = LogOddsRule::<i8>::new(&even).unwrap();
        assert!((LogOdds8(rule.min).probability(&rule) - 0.03).abs() < 1e-9);
    }

    #[test]
    fn the_default_model_in_bytes() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        assert_eq!((rule.hit, rule.miss, rule.min, rule.max, rule.prior), (31, -15, -73, 127, 0));
        assert!((LogOdds8(127).probability(&rule) - 0.97).abs() < 1e-12);
        assert!((LogOdds8(-73).probability(&rule) - 0.12).abs() < 1e-3);
        assert_eq!(LogOdds8(0).probability(&rule), 0.5);
    }

    #[test]
    fn five_misses_saturate_a_cell() {
        let rule = LogOddsRule::<i8>::new(&OccupancyModel::default()).unwrap();
        let mut cell = None;
        for n in 1..=6 {
            let (after, event) = LogOdds8::fuse(cell, Endpoint::Miss, &rule);
            assert_eq!(event.after == rule.min, n >= 5);
            cell = Some(after);
        }
    }

    #[test]
    fn models_out_of_order_are_refused() {
        for model in [
            OccupancyModel { p_hit: 0.4, ..Default::default() },
            OccupancyModel { p_max: 1.0, ..Default::default() },
            OccupancyModel { p_min: f64::NAN, ..Default::default() },
            OccupancyModel { wall_depth: Some(-1.0), ..Default::default() },
        ] {
            assert!(LogOddsRule::<i8>::new(&model).is_err() && LogOddsRule::<f32>::new(&model).is_err());
        }
    }

    fn run_equals_single_steps<C: LogOddsValue>(rule: &C::Rule, scans: &[(Vec<u16>, Vec<u16>)]) {
        let mut planes = Vec::<C>::unobserved(512);
        let mut singles = planes.clone();
        let mut brick = C::Brick::unobserved(512);
        for (hits, misses) in scans {
            let mut e = HitMiss::silent(512);
            hits.iter().for_each(|&i| e.mark_hit(usize::from(i)));
            misses.iter().for_each(|&i| e.mark_miss(usize::from(i)));
            C::fuse_run(&mut planes, 0, &e, 0, 512, rule);
            C::fuse_brick(&mut brick, &e, rule);
            let mut observed = 0;
            for i in 0..512 {
                if let Some(o) = e.one(i) {
                    singles.set(i, Some(C::fuse(singles.get(i), o, rule).0));
                    observed += 1;
                }
            }
            assert_eq!(observed, e.observed());
        }
        assert!(planes.iter().zip(&singles).all(|(a, b)| a.same(*b)));
        assert!((0..512).all(|i| brick.get(i) == singles.get(i)));
    }

    proptest! {
        #[test]
        fn a_run_is_many_single_steps(scans in prop::collection::vec(
            (prop::collection::vec(0..512u16, 0..200), prop::collection::vec(0..512u16, 0..400)), 1..12)) {
            let model = OccupancyModel::default();
            run_equals_single_steps::<LogOdds8>(&LogOddsRule::<i8>::new(&model).unwrap(), &scans);
            run_equals_single_steps::<LogOdds32>(&LogOddsRule::<f32>::new(&model).unwrap(), &scans);
        }
    }
}
