//! Hits per meter: the density of a renderer, in closed form.

use super::{
    Cell, HitLengthBrick, HitLengthObservation, HitLengthPlanes, HitLengths, LENGTH_UNITS, mean_chord,
};
use multiversion::multiversion;

/// How many beams ended in a cell, and how far all beams went inside of it.
///
/// `hits / length` is the density that makes what was observed most likely, if a beam ends in every bit of length with the
/// same probability: the maximum of a volume renderer's likelihood for ranges, without a descent. As a map it is known as
/// "decay rates" *(Schaefer, Luft & Burgard 2017)*. Counts say how much of what came here ended here, which a sign or a
/// clamped log odds cannot: thin things that stop a beam in three stay visible.
///
/// All three are whole numbers: without forgetting they are sums, the same in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HitLength {
    /// Beams that ended here.
    pub hits: u32,
    /// Length of all beams inside of the cell ([`LENGTH_UNITS`] to a cell's edge).
    pub length: u32,
    /// Scans that looked here, as far as they are not forgotten; never 0, and no more than 65535.
    pub looks: u16,
}

impl HitLength {
    /// Length of all beams inside of the cell (cells).
    #[inline]
    pub fn cells(self) -> f64 {
        f64::from(self.length) / f64::from(LENGTH_UNITS)
    }

    /// Beams that end in a cell's length of it, `hits / length` (per cell). Where beams ended that had no length, of one
    /// unit.
    #[inline]
    pub fn per_cell(self) -> f64 {
        f64::from(self.hits) * f64::from(LENGTH_UNITS) / f64::from(self.length.max(1))
    }

    /// The share of beams through the middle of the cell that end in it: `1 - exp(-hits / length * chord)` with the mean
    /// length of lines through a cell of `D` dimensions. 0: none of those that came here.
    #[inline]
    pub fn opacity<const D: usize>(self) -> f64 {
        -(-self.per_cell() * mean_chord::<D>()).exp_m1()
    }

    fn halved(self) -> Self {
        let up = |v: u32| (v >> 1) + (v & 1);
        Self { hits: up(self.hits), length: up(self.length), looks: (self.looks >> 1) + (self.looks & 1) }
    }
}

/// How hits and lengths forget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AttenuationRule {
    /// Scans after which what a cell knew counts half. `None`: never.
    ///
    /// When a cell has been looked at twice as often, its hits, length and looks are halved, rounded up, so that nothing
    /// falls to 0: a single old hit stays one, beside ever the same length.
    pub half_life: Option<u16>,
}

impl AttenuationRule {
    /// Nothing is forgotten.
    pub const NEVER: Self = Self { half_life: None };
    /// The longest half-life (scans).
    pub const LONGEST: u16 = u16::MAX / 2;

    /// A half-life of so many scans, to the nearest that is possible: at least 1, at most [`AttenuationRule::LONGEST`]; without
    /// end where it is infinite or not a number.
    pub fn of_half_life(scans: f64) -> Self {
        let possible = scans.clamp(1.0, f64::from(Self::LONGEST)).round() as u16;
        Self { half_life: scans.is_finite().then_some(possible) }
    }

    /// Refuses half-lives that are not possible.
    ///
    /// # Errors
    /// In words.
    pub fn validate(&self) -> Result<(), String> {
        match self.half_life {
            Some(h) if !(1..=Self::LONGEST).contains(&h) => {
                Err(format!("half_life must be between 1 and {} scans, got {h}", Self::LONGEST))
            }
            _ => Ok(()),
        }
    }

    /// Looks at which a cell is halved.
    #[inline(always)]
    fn due(self) -> Option<u16> {
        self.half_life.map(|h| 2 * h.clamp(1, Self::LONGEST))
    }
}

impl Default for AttenuationRule {
    /// Nothing is forgotten.
    fn default() -> Self {
        Self::NEVER
    }
}

impl Cell for HitLength {
    type Rule = AttenuationRule;
    type Planes = HitLengthPlanes;
    type Brick = HitLengthBrick;
    type Evidence = HitLengths;
    type Event = ();

    /// Adds. Where a sum passes 32 bits, all three are halved first: the ratio stays, nothing wraps.
    #[inline]
    fn fuse(cell: Option<Self>, o: HitLengthObservation, rule: &AttenuationRule) -> (Self, ()) {
        let mut cell = cell.unwrap_or_default();
        let fits =
            |c: &Self| c.hits.checked_add(o.hits).is_some() && c.length.checked_add(o.length).is_some();
        if !fits(&cell) {
            cell = cell.halved();
        }
        cell.hits = cell.hits.saturating_add(o.hits);
        cell.length = cell.length.saturating_add(o.length);
        cell.looks = cell.looks.saturating_add(1);
        let due = rule.due().is_some_and(|due| cell.looks >= due);
        (if due { cell.halved() } else { cell }, ())
    }

    fn fuse_run(
        planes: &mut HitLengthPlanes,
        start: usize,
        evidence: &HitLengths,
        from: usize,
        len: usize,
        rule: &AttenuationRule,
    ) {
        let run = planes.run_mut(start, len);
        match evidence.planes() {
            Some((hits, length)) => {
                fuse_cells(
                    run,
                    Said { hits: &hits[from..from + len], length: &length[from..from + len] },
                    rule,
                );
            }
            None => fuse_even(run, evidence, rule),
        }
    }

    fn fuse_brick(brick: &mut HitLengthBrick, evidence: &HitLengths, rule: &AttenuationRule) {
        let one = evidence.even().map(|length| HitLengthObservation { hits: 0, length });
        match (brick.even_mut(), one) {
            // All cells are alike, and stay so.
            (Some(cell), Some(o)) if o.length > 0 => {
                *cell = Self::fuse((cell.looks > 0).then_some(*cell), o, rule).0;
            }
            (Some(_), Some(_)) => {}
            _ => {
                let planes = brick.planes_mut();
                let run = planes.run_mut(0, planes.looks().len());
                match evidence.planes() {
                    Some((hits, length)) => fuse_cells(run, Said { hits, length }, rule),
                    None => fuse_even(run, evidence, rule),
                }
            }
        }
    }
}

/// The same length for every cell of a run.
fn fuse_even(run: Run<'_>, evidence: &HitLengths, rule: &AttenuationRule) {
    let n = run.hits.len();
    let length = vec![evidence.even().unwrap_or(0); n];
    fuse_cells(run, Said { hits: &vec![0; n], length: &length }, rule);
}

/// Some neighboring cells of planes, for writing.
pub(super) struct Run<'a> {
    pub hits: &'a mut [u32],
    pub length: &'a mut [u32],
    pub looks: &'a mut [u16],
}

/// What a scan says of them.
#[derive(Clone, Copy)]
struct Said<'a> {
    hits: &'a [u32],
    length: &'a [u32],
}

/// [`HitLength::fuse`] over slices of the same length.
fn fuse_cells(run: Run<'_>, said: Said<'_>, rule: &AttenuationRule) {
    if would_pass(&run, said) {
        for i in 0..run.hits.len() {
            let o = HitLengthObservation { hits: said.hits[i], length: said.length[i] };
            if o != HitLengthObservation::default() {
                let looks = run.looks[i];
                let cell = HitLength { hits: run.hits[i], length: run.length[i], looks };
                let (cell, ()) = HitLength::fuse((looks > 0).then_some(cell), o, rule);
                (run.hits[i], run.length[i], run.looks[i]) = (cell.hits, cell.length, cell.looks);
            }
        }
    } else {
        add(run, said, rule);
    }
}

/// Whether any sum passes 32 bits.
#[multiversion(targets = "simd")]
fn would_pass(run: &Run<'_>, said: Said<'_>) -> bool {
    let passes = |a: &[u32], b: &[u32]| a.iter().zip(b).fold(0, |any, (&a, &b)| any | u32::from(a > !b)) != 0;
    passes(run.hits, said.hits) | passes(run.length, said.length)
}

/// Sums that fit, in the widest vectors there are.
#[multiversion(targets = "simd")]
fn add(run: Run<'_>, said: Said<'_>, rule: &AttenuationRule) {
    let n = run.hits.len();
    let (hits, length, looks) = (&mut run.hits[..n], &mut run.length[..n], &mut run.looks[..n]);
    let (more_hits, more_length) = (&said.hits[..n], &said.length[..n]);
    for i in 0..n {
        looks[i] = looks[i].saturating_add(u16::from(more_hits[i] | more_length[i] != 0));
        hits[i] += more_hits[i];
        length[i] += more_length[i];
    }
    let Some(due) = rule.due() else { return };
    if looks.iter().fold(0, |most, &l| most.max(l)) < due {
        return;
    }
    // Cells are halved as soon as they are due, so that those that are due were looked at just now.
    for i in 0..n {
        let half = u16::from(looks[i] >= due);
        let wide = u32::from(half);
        hits[i] = (hits[i] >> wide) + (hits[i] & wide);
        length[i] = (length[i] >> wide) + (length[i] & wide);
        looks[i] = (looks[i] >> half) + (looks[i] & half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Evidence, Planes};
    use proptest::prelude::*;

    /// A scan whose first cell has no hit and an even length says that of all.
    fn evidence(scan: &[(u32, u32)]) -> HitLengths {
        let mut e = HitLengths::silent(scan.len());
        if scan[0].0 == 0 && scan[0].1 % 4 == 2 {
            e.set_even(scan[0].1);
            return e;
        }
        for (i, &(hits, length)) in scan.iter().enumerate() {
            (0..hits).for_each(|_| e.add_hit(i));
            e.add_length(i, length);
        }
        e
    }

    fn scans(most: usize) -> impl Strategy<Value = Vec<Vec<(u32, u32)>>> {
        let length = prop_oneof![3 => Just(0u32), 6 => 0u32..200, 1 => (u32::MAX / 3)..=u32::MAX];
        prop::collection::vec(prop::collection::vec((prop_oneof![0u32..1, 0u32..4], length), 64), 1..most)
    }

    proptest! {
        #[test]
        fn a_run_and_a_brick_are_many_single_steps(
            scans in scans(24), half_life in prop::option::of(1u16..6), len in prop_oneof![Just(64usize), 1usize..64],
        ) {
            let rule = AttenuationRule { half_life };
            let mut planes = HitLengthPlanes::unobserved(64);
            let mut singles = planes.clone();
            let mut brick = HitLengthBrick::unobserved(64);
            for scan in &scans {
                let e = evidence(scan);
                HitLength::fuse_run(&mut planes, 64 - len, &e, 64 - len, len, &rule);
                HitLength::fuse_brick(&mut brick, &e, &rule);
                for i in 0..64 {
                    if let Some(o) = e.one(i) {
                        singles.set(i, Some(HitLength::fuse(singles.get(i), o, &rule).0));
                    }
                }
                for i in 0..64 {
                    let expected = if i < 64 - len { None } else { singles.get(i) };
                    prop_assert_eq!(planes.get(i), expected);
                    prop_assert_eq!(brick.get(i), singles.get(i));
                }
            }
        }

        #[test]
        fn without_forgetting_the_order_does_not_matter(scans in prop::collection::vec(
            prop::collection::vec((0u32..4, (0u32..100).prop_map(|v| 2 * v + 1)), 8), 1..12,
        )) {
            let fused = |order: &mut dyn Iterator<Item = &Vec<(u32, u32)>>| {
                let mut brick = HitLengthBrick::unobserved(8);
                order.for_each(|s| HitLength::fuse_brick(&mut brick, &evidence(s), &AttenuationRule::NEVER));
                brick
            };
            let brick = fused(&mut scans.iter());
            prop_assert!(brick == fused(&mut scans.iter().rev()));
            for i in 0..8 {
                let sum = |f: fn(&(u32, u32)) -> u32| scans.iter().map(|s| f(&s[i])).sum::<u32>();
                let cell = brick.get(i).unwrap_or_default();
                prop_assert_eq!((cell.hits, cell.length), (sum(|s| s.0), sum(|s| s.1)));
            }
        }
    }

    #[test]
    fn what_overflows_is_halved_and_keeps_its_ratio() {
        let full = HitLength { hits: u32::MAX - 3, length: u32::MAX - 2, looks: u16::MAX };
        let (cell, ()) = HitLength::fuse(
            Some(full),
            HitLengthObservation { hits: 9, length: 10 },
            &AttenuationRule::NEVER,
        );
        assert!((cell.per_cell() / f64::from(LENGTH_UNITS) - 1.0).abs() < 1e-8 && cell.hits > u32::MAX / 2);
        let (cell, ()) = HitLength::fuse(
            Some(HitLength { hits: 5, ..full }),
            HitLengthObservation { hits: 1, length: u32::MAX },
            &AttenuationRule::NEVER,
        );
        assert_eq!((cell.hits, cell.length), (4, u32::MAX));
    }

    /// A chair stood here: 60 hits in a length of 60 cells. Then beams pass.
    #[test]
    fn what_has_gone_fades_by_half_each_half_life() {
        let rule = AttenuationRule { half_life: Some(16) };
        let mut cell = None;
        let mut look = |hits, length, times| {
            for _ in 0..times {
                cell = Some(HitLength::fuse(cell, HitLengthObservation { hits, length }, &rule).0);
            }
            cell.unwrap_or_default()
        };
        let stood = look(2, 2 * LENGTH_UNITS, 30).per_cell();
        assert!((stood - 1.0).abs() < 1e-9, "{stood}");
        look(0, 2 * LENGTH_UNITS, 2);
        let mut last = f64::INFINITY;
        for k in 0..5 {
            let now = look(0, 2 * LENGTH_UNITS, 16).per_cell();
            assert!(now < 0.62 * last, "{k} {now} {last}");
            last = now;
        }
        let (cell, looks) = (look(0, 2 * LENGTH_UNITS, 500), 32);
        assert!(cell.hits == 1 && cell.looks <= looks && cell.per_cell() < 0.04, "{cell:?}");
        // One that never forgets still believes in it.
        let o = HitLengthObservation { hits: 0, length: 2 * LENGTH_UNITS };
        let mut kept = HitLength { hits: 60, length: 60 * LENGTH_UNITS, looks: 30 };
        (0..130).for_each(|_| kept = HitLength::fuse(Some(kept), o, &AttenuationRule::NEVER).0);
        assert_eq!(kept.hits, 60);
    }
}
