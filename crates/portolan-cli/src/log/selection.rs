//! Which scans of a log are used.

/// Scans of a log: which are fused and which are left out for evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Selection {
    /// Only every so many-th scan of the log.
    pub(crate) every: Option<u64>,
    /// Of these, every so many-th is left out.
    pub(crate) hold_out: Option<u64>,
}

impl Selection {
    /// Indices of the scans to fuse and of those held out.
    pub(crate) fn split(&self, scans: usize) -> (Vec<usize>, Vec<usize>) {
        let every = self.every.unwrap_or(1).max(1) as usize;
        let taken = (0..scans).step_by(every).enumerate();
        let (mut fused, mut held_out) = (Vec::new(), Vec::new());
        for (nth, i) in taken {
            // The last of each group, so that the first scan of a log is always fused.
            let out = self.hold_out.is_some_and(|n| (nth as u64 + 1).is_multiple_of(n.max(1)));
            if out { held_out.push(i) } else { fused.push(i) }
        }
        (fused, held_out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tenth_is_held_out() {
        let all = Selection::default();
        assert_eq!(all.split(3), (vec![0, 1, 2], vec![]));
        let some = Selection { every: Some(2), hold_out: Some(3) };
        assert_eq!(some.split(12), (vec![0, 2, 6, 8], vec![4, 10]));
    }
}
