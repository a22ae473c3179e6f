//! A ledger into another one, or out of it.

use super::sum_map::SumMap;
use super::{Ledger, LedgerError};
use crate::cell::{Sign, SumCell, SumPlanes};
use crate::mapper::MapperSettings;
use crate::store::{Bricks, SumStore};

impl<const D: usize> Ledger<D> {
    /// Adds another ledger: this one is then that of the scans of both. O(cells of the other one).
    ///
    /// # Errors
    /// [`LedgerError`]: where settings or lattices differ, or a scan is in both. The ledger is then as before.
    pub fn merge(&mut self, other: &Self) -> Result<(), LedgerError> {
        check_settings(&self.settings, &other.settings)?;
        let mut scans = self.scans.clone();
        scans.merge(&other.scans)?;
        self.add_sums(other, Sign::Plus)?;
        self.scans = scans;
        Ok(())
    }

    /// Takes another ledger away: this one is then as if the scans of the other had never been added. So what is older than
    /// some time is forgotten, if it was kept as a ledger of its own ([`Epochs`](super::Epochs)). O(cells of the other one).
    ///
    /// # Errors
    /// [`LedgerError`]: where settings or lattices differ, or a scan of the other one is not in this one, with the same
    /// readings and at the same pose. The ledger is then as before.
    pub fn take_out(&mut self, other: &Self) -> Result<(), LedgerError> {
        check_settings(&self.settings, &other.settings)?;
        let mut scans = self.scans.clone();
        scans.take_out(&other.scans)?;
        self.add_sums(other, Sign::Minus)?;
        self.scans = scans;
        Ok(())
    }

    /// All maps, or none.
    fn add_sums(&mut self, other: &Self, sign: Sign) -> Result<(), LedgerError> {
        let occupancy = summed(&self.occupancy, &other.occupancy, sign)?;
        let tsdf = summed(&self.tsdf, &other.tsdf, sign)?;
        let attenuation = summed(&self.attenuation, &other.attenuation, sign)?;
        (self.occupancy, self.tsdf, self.attenuation) = (occupancy, tsdf, attenuation);
        Ok(())
    }
}

/// Refuses settings that shape other sums: cells elsewhere, other maps, scans that are read otherwise.
///
/// # Errors
/// [`LedgerError::Different`], with what differs.
pub fn check_settings<const D: usize>(
    a: &MapperSettings<D>,
    b: &MapperSettings<D>,
) -> Result<(), LedgerError> {
    let described = |s: &MapperSettings<D>| {
        [
            ("resolution", format!("{} m", s.resolution)),
            ("origin of the cells", format!("{:?}", s.origin.unwrap_or([0.0; D]))),
            ("truncation", format!("{} m", s.truncation())),
            ("bounds", format!("{:?}", s.bounds)),
            ("free space", format!("{}, {}", s.carve, s.carve_weight)),
            ("weights", format!("{:?}", s.weights)),
            ("sweep", format!("{:?}, exact {}", s.beams, s.exact)),
            ("model of occupancy", format!("{:?}", s.occupancy)),
            ("maps", format!("distances {}, hits per meter {}", s.distances, s.attenuation.is_some())),
            ("colors", String::from(if s.color { "kept" } else { "not kept" })),
        ]
    };
    for ((what, ours), (_, theirs)) in described(a).into_iter().zip(described(b)) {
        if ours != theirs {
            return Err(LedgerError::Different { what, ours, theirs });
        }
    }
    Ok(())
}

/// The sum of two maps; a snapshot costs nothing until its bricks change.
fn summed<M: SumMap<D>, const D: usize>(
    ours: &Option<M>,
    theirs: &Option<M>,
    sign: Sign,
) -> Result<Option<M>, LedgerError> {
    let mut sum = ours.clone();
    if let (Some(sum), Some(theirs)) = (&mut sum, theirs) {
        sum.add(theirs, sign)?;
    }
    Ok(sum)
}

/// Equal scans and equal sums, however they came about and wherever bricks lie.
impl<const D: usize> PartialEq for Ledger<D> {
    fn eq(&self, other: &Self) -> bool {
        self.scans == other.scans
            && check_settings(&self.settings, &other.settings).is_ok()
            && same(self.occupancy.as_ref().map(|m| m.store()), other.occupancy.as_ref().map(|m| m.store()))
            && same(self.tsdf.as_ref().map(|m| m.store()), other.tsdf.as_ref().map(|m| m.store()))
            && same(self.tsdf.as_ref().and_then(|m| m.colors()), other.tsdf.as_ref().and_then(|m| m.colors()))
            && same(
                self.attenuation.as_ref().map(|m| m.store()),
                other.attenuation.as_ref().map(|m| m.store()),
            )
    }
}

fn same<C: SumCell, const D: usize>(a: Option<&SumStore<C, D>>, b: Option<&SumStore<C, D>>) -> bool
where
    C::Brick: PartialEq,
{
    let covers = |a: &Bricks<C, D>, b: &Bricks<C, D>| {
        a.bricks_by_age().all(|(key, brick)| match b.brick(key) {
            Some(other) => brick == other,
            None => brick.is_zero(),
        })
    };
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => covers(a.sums(), b.sums()) && covers(b.sums(), a.sums()),
        _ => false,
    }
}
