//! What a file holds beyond the cells: nodes that could have been merged, values of inner nodes.

/// How the nodes of a file differ from the smallest tree of its cells, so that it can be written again to the byte.
///
/// Inner nodes are numbered in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Stored {
    /// The root is an inner node, though all leaves are equal.
    pub root_open: bool,
    /// Inner nodes with children that are inner nodes, though all leaves below are equal: a bit for each such child.
    pub open: Vec<(u32, u8)>,
    /// Inner nodes whose value is not the largest of their children's, and its bits.
    pub values: Vec<(u32, u32)>,
}

impl Stored {
    /// Puts the lists, which were filled from the leaves up, into the order of the file.
    pub(super) fn sort(&mut self) {
        self.open.sort_unstable();
        self.values.sort_unstable();
    }

    /// Inner nodes that could have been merged into a leaf.
    pub(super) fn open_nodes(&self) -> u64 {
        let below: u64 = self.open.iter().map(|(_, mask)| u64::from(mask.count_ones())).sum();
        below + u64::from(self.root_open)
    }
}

/// Walks through [`Stored`] in the order of the file.
pub(super) struct Cursor<'a> {
    open: &'a [(u32, u8)],
    values: &'a [(u32, u32)],
    number: u32,
}

impl<'a> Cursor<'a> {
    pub(super) fn of(stored: &'a Stored) -> Self {
        Self { open: &stored.open, values: &stored.values, number: 0 }
    }

    /// The next inner node: which of its children that are leaves in memory are inner nodes of the file, and the bits
    /// of its value where that is its own.
    pub(super) fn next(&mut self) -> (u8, Option<u32>) {
        let number = self.number;
        self.number += 1;
        let mask = match self.open.split_first() {
            Some((&(n, mask), rest)) if n == number => {
                self.open = rest;
                mask
            }
            _ => 0,
        };
        let value = match self.values.split_first() {
            Some((&(n, bits), rest)) if n == number => {
                self.values = rest;
                Some(bits)
            }
            _ => None,
        };
        (mask, value)
    }
}
