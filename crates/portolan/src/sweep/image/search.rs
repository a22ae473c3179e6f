//! The search for the blocks in which an image observes cells: from large cubes of blocks to octants of single ones.

use crate::geom::{BLOCK_EDGE, BlockKey};
use crate::parallel;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What an image shows of the cells of a cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// Nothing: behind all surfaces, or out of sight.
    Nothing,
    /// All cells are free.
    Free,
    /// Cells have to be looked at one by one.
    Mixed,
    /// The same, and all pixels that they may fall on have a reading.
    Complete,
}

/// A cube of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube {
    pub first_cell: [i64; 3],
    /// Cells along an edge: half a block, times a power of two.
    pub edge: i64,
}

impl Cube {
    /// One of its eight halves, x fastest.
    pub(super) fn half(&self, i: usize) -> Self {
        let edge = self.edge / 2;
        Self { first_cell: [0, 1, 2].map(|k| self.first_cell[k] + edge * (i as i64 >> k & 1)), edge }
    }
}

/// An image that can be asked about cubes of cells.
pub(super) trait Classify: Sync {
    /// What the look at a cube leaves for the look at its parts.
    type Known: Copy + Send + Sync;

    /// What is known at first.
    fn nothing_known(&self) -> Self::Known;

    /// The classes of those halves of a cube whose bit is set in `asked`; any class for the others.
    fn classify(&self, cube: Cube, known: Self::Known, asked: u8) -> [(Class, Self::Known); 8];
}

/// What is known of a block beforehand, a bit for each octant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Octants {
    /// All cells are free.
    pub free: u8,
    /// Cells must be looked at.
    pub mixed: u8,
    /// Those among them whose pixels all have a reading.
    pub complete: u8,
}

impl Octants {
    const FREE: Self = Self { free: 0xff, mixed: 0, complete: 0 };

    fn of(classes: impl Iterator<Item = Class>) -> Self {
        let mut octants = Self::default();
        for (bit, class) in classes.enumerate() {
            octants.free |= u8::from(class == Class::Free) << bit;
            octants.mixed |= u8::from(matches!(class, Class::Mixed | Class::Complete)) << bit;
            octants.complete |= u8::from(class == Class::Complete) << bit;
        }
        octants
    }
}

/// Boxes of more blocks along an edge are not searched.
pub(super) const LONGEST_EDGE: i64 = 1 << 20;

/// Blocks from `first` to `last`, both included.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockBox {
    pub first: [i32; 3],
    pub last: [i32; 3],
}

/// The blocks of a box in which the image observes cells, ascending, into `keys`, and their octants; nothing where they are
/// more than `most`. Returns whether they are not. The box is at most [`LONGEST_EDGE`] blocks wide.
pub(super) fn find_blocks<C: Classify>(
    image: &C,
    BlockBox { first, last }: BlockBox,
    most: usize,
    keys: &mut Vec<BlockKey<3>>,
    octants: &mut Vec<Octants>,
) -> bool {
    keys.clear();
    octants.clear();
    // Aligned, so that what is found does not depend on where the box begins.
    let anchor = first.map(|v| i64::from(v).div_euclid(ALIGNED) * ALIGNED);
    let (first, last, found) = (first.map(i64::from), last.map(i64::from), AtomicUsize::new(0));
    let Some(found) = (Search { image, anchor, first, last, most, found }).run() else { return false };
    keys.extend(found.iter().map(|&(packed, _)| {
        let index = |k: usize| (packed >> (BITS * k as u32)) & ((1 << BITS) - 1);
        BlockKey(std::array::from_fn(|k| (anchor[k] + index(k) as i64) as i32))
    }));
    octants.extend(found.iter().map(|(_, octants)| *octants));
    true
}

/// Bits of a packed index, and blocks along an edge of the largest nodes that lie as all others of their size.
const BITS: u32 = 21;
const ALIGNED: i64 = 8;

struct Search<'a, C> {
    image: &'a C,
    /// Block that nodes count from.
    anchor: [i64; 3],
    first: [i64; 3],
    last: [i64; 3],
    most: usize,
    /// By all parts together: each alone would be allowed as much as all.
    found: AtomicUsize,
}

/// A cube of `2^level` octants of blocks from `at`, counted from the anchor.
#[derive(Clone, Copy)]
struct Node {
    at: [i64; 3],
    level: u32,
}

/// The level at which a node is a block.
const BLOCK: u32 = 1;

impl Node {
    fn children(self) -> impl Iterator<Item = Self> {
        let (level, half) = (self.level - 1, 1i64 << (self.level - 1));
        (0..8).map(move |c| Self { at: std::array::from_fn(|k| self.at[k] + half * (c >> k & 1)), level })
    }

    /// Indices of a block, in the order of keys.
    fn packed(self) -> u64 {
        let [x, y, z] = self.at.map(|v| (v >> BLOCK) as u64);
        (z << (2 * BITS)) | (y << BITS) | x
    }
}

/// A block that is seen: its packed indices, and what is known of its octants.
type Found = (u64, Octants);

impl<C: Classify> Search<'_, C> {
    /// In the order of keys; `None` where they are too many.
    fn run(&self) -> Option<Vec<Found>> {
        let span = (0..3).map(|k| self.last[k] - self.anchor[k] + 1).fold(ALIGNED, i64::max);
        let root = Node { at: [0; 3], level: BLOCK + (span as u64).next_power_of_two().ilog2() };
        let mut nodes = vec![(root, Class::Mixed, self.image.nothing_known())];
        // Enough parts for every core, the same ones for any number of them.
        const LEAST: u32 = BLOCK + 2;
        let is_large = |n: &(Node, Class, _)| n.1 != Class::Free && n.0.level > LEAST;
        while nodes.len() < 256 && nodes.iter().any(is_large) {
            let open = |n: (Node, Class, C::Known)| match is_large(&n) {
                true => self.parts(n.0, n.2).collect(),
                false => vec![n],
            };
            nodes = nodes.into_iter().flat_map(open).collect();
        }
        let parts = parallel::map(&nodes, 1, |&(node, class, known)| {
            let mut found = Vec::new();
            self.take(node, class, known, &mut found);
            found
        });
        if self.is_full() {
            return None;
        }
        let mut all = parts.concat();
        all.sort_unstable_by_key(|found| found.0);
        Some(all)
    }

    fn is_full(&self) -> bool {
        self.found.load(Ordering::Relaxed) > self.most
    }

    fn add(&self, node: Node, octants: Octants, found: &mut Vec<Found>) {
        self.found.fetch_add(1, Ordering::Relaxed);
        found.push((node.packed(), octants));
    }

    /// The halves of a node that reach into the box, without those of [`Class::Nothing`].
    #[inline(always)]
    fn parts(&self, node: Node, known: C::Known) -> impl Iterator<Item = (Node, Class, C::Known)> {
        let children = node.children().enumerate();
        let asked = children.fold(0, |bits, (i, child)| bits | u8::from(self.is_inside(child)) << i);
        let classes = self.image.classify(self.cube(node), known, asked);
        let parts = node.children().zip(classes).enumerate();
        parts
            .filter(move |(i, (_, (class, _)))| asked >> i & 1 == 1 && *class != Class::Nothing)
            .map(|(_, (child, (class, known)))| (child, class, known))
    }

    fn take(&self, node: Node, class: Class, known: C::Known, found: &mut Vec<Found>) {
        if self.is_full() {
        } else if class == Class::Free {
            self.take_all(node, found);
        } else if node.level == BLOCK {
            let classes = self.image.classify(self.cube(node), known, 0xff);
            let octants = Octants::of(classes.into_iter().map(|c| c.0));
            if octants != Octants::default() {
                self.add(node, octants, found);
            }
        } else {
            self.parts(node, known).for_each(|(child, class, known)| self.take(child, class, known, found));
        }
    }

    /// All blocks of a node that is free.
    fn take_all(&self, node: Node, found: &mut Vec<Found>) {
        if !self.is_inside(node) || self.is_full() {
        } else if node.level == BLOCK {
            self.add(node, Octants::FREE, found);
        } else {
            node.children().for_each(|child| self.take_all(child, found));
        }
    }

    /// Whether a node reaches into the box.
    #[inline(always)]
    fn is_inside(&self, node: Node) -> bool {
        let blocks = 1i64 << node.level >> BLOCK;
        (0..3).all(|k| {
            let low = self.anchor[k] + (node.at[k] >> BLOCK);
            low <= self.last[k] && low + blocks > self.first[k]
        })
    }

    fn cube(&self, node: Node) -> Cube {
        const OCTANT: i64 = BLOCK_EDGE as i64 / 2;
        let first_cell = [0, 1, 2].map(|k| self.anchor[k] * BLOCK_EDGE as i64 + node.at[k] * OCTANT);
        Cube { first_cell, edge: OCTANT << node.level }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of cells around a cell: free inside of half its radius, mixed up to the radius.
    struct Ball {
        center: [i64; 3],
        radius: i64,
    }

    impl Classify for Ball {
        type Known = ();

        fn nothing_known(&self) {}

        fn classify(&self, cube: Cube, (): (), _: u8) -> [(Class, ()); 8] {
            std::array::from_fn(|i| {
                let Cube { first_cell, edge } = cube.half(i);
                let (mut near, mut far) = (0, 0);
                for k in 0..3 {
                    let (low, high) =
                        (first_cell[k] - self.center[k], first_cell[k] + edge - 1 - self.center[k]);
                    near += if low > 0 { low * low } else { high.min(0).pow(2) };
                    far += low.pow(2).max(high.pow(2));
                }
                let square = self.radius * self.radius;
                let class = match (4 * far < square, near < square) {
                    (true, _) => Class::Free,
                    (_, true) => Class::Mixed,
                    _ => Class::Nothing,
                };
                (class, ())
            })
        }
    }

    #[test]
    fn every_block_is_found_wherever_the_box_begins() {
        let ball = Ball { center: [5, -40, 101], radius: 150 };
        for (first, last) in [([-30; 3], [40; 3]), ([-3, -30, 2], [11, -2, 9]), ([0, -5, 12], [0, -5, 12])] {
            let mut expected = Vec::new();
            for z in first[2]..=last[2] {
                for (y, x) in (first[1]..=last[1]).flat_map(|y| (first[0]..=last[0]).map(move |x| (y, x))) {
                    let cube = Cube { first_cell: [x, y, z].map(|v| 8 * i64::from(v)), edge: 8 };
                    let octants = Octants::of(ball.classify(cube, (), 0xff).into_iter().map(|c| c.0));
                    if octants != Octants::default() {
                        expected.push((BlockKey([x, y, z]), octants));
                    }
                }
            }
            let (mut keys, mut octants) = (Vec::new(), Vec::new());
            let most = expected.len();
            assert!(find_blocks(&ball, BlockBox { first, last }, most, &mut keys, &mut octants));
            let found: Vec<_> = keys.iter().copied().zip(octants.iter().copied()).collect();
            assert_eq!(found, expected);
            let fits = find_blocks(&ball, BlockBox { first, last }, most - 1, &mut keys, &mut octants);
            assert!(!fits && keys.is_empty());
        }
    }
}
