//! The elements of the cells of one brick.

use super::cube::{CellSurface, edge_start};
use super::nodes::Nodes;
use crate::cell::SignedDistance;
use crate::geom::{BlockKey, block_cells};
use crate::sets::{bits, bits_of};
use crate::store::Bricks;

/// A crossing that the cells of a brick use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UsedEdge {
    /// `axis * 8^D +` the place, in its brick, of the cell where the edge starts.
    pub(super) at: u16,
    pub(super) place: f32,
    /// Height of the parabola, as far as this brick's cells say.
    pub(super) height: f32,
}

/// Segments or triangles of the cells whose lowest node is one of a brick's.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BrickElements<const D: usize> {
    /// Cells with surface, 64 a word, x fastest.
    cells: [u64; 8],
    /// How many cells with surface come before each word.
    rank: [u16; 8],
    /// First simplex of every cell with surface, and the end of the last.
    starts: Box<[u16]>,
    simplices: Box<[[[f32; D]; D]]>,
    /// Crossings of the brick and of its upper neighbours that the simplices use, by octant of the brick.
    edges: Box<[UsedEdge]>,
    octants: [u16; 9],
}

/// What [`BrickElements::of`] needs for its work, used again for every brick.
pub(super) struct Scratch<const D: usize> {
    nodes: Nodes<D>,
    cell: CellSurface<D>,
    /// Number of the edge in `edges`, by octant and place; `NONE`.
    numbers: Vec<u16>,
    edges: Vec<(u16, UsedEdge)>,
}

const NONE: u16 = u16::MAX;

impl<const D: usize> Scratch<D> {
    pub(super) fn new() -> Self {
        Self {
            nodes: Nodes::new(),
            cell: CellSurface::default(),
            numbers: vec![NONE; (D * block_cells::<D>()) << D],
            edges: Vec::new(),
        }
    }

    /// Counts the crossings of the cell at `x`, `row` of the brick in.
    fn use_edges(&mut self, x: usize, row: usize) {
        for edge in bits(self.cell.crossed.into()) {
            let (axis, corner) = edge_start::<D>(edge);
            let [x, y, z] = [x + (corner & 1), (row & 7) + (corner >> 1 & 1), (row >> 3) + (corner >> 2)];
            let octant = x >> 3 | (y >> 3) << 1 | (z >> 3) << 2;
            let at = axis * block_cells::<D>() + (x & 7 | (y & 7) << 3 | (z & 7) << 6);
            let height = height::<D>(self.cell.radius_sq[edge]);
            let number = &mut self.numbers[octant * D * block_cells::<D>() + at];
            match self.edges.get_mut(usize::from(*number)) {
                Some((_, used)) => used.height = used.height.min(height),
                None => {
                    *number = self.edges.len() as u16;
                    let used = UsedEdge { at: at as u16, place: self.cell.place[edge], height };
                    self.edges.push((octant as u16, used));
                }
            }
        }
    }
}

/// `D / 4` less a squared radius, never more than that in spite of rounding, and not negative.
fn height<const D: usize>(radius_sq: f64) -> f32 {
    let exact = 0.25 * D as f64 - radius_sq;
    ((exact - 1e-7) as f32).max(0.0)
}

impl<const D: usize> BrickElements<D> {
    /// The elements of a brick; `None` where it has none.
    pub(super) fn of(
        store: &Bricks<SignedDistance, D>,
        key: BlockKey<D>,
        threshold: f32,
        scratch: &mut Scratch<D>,
    ) -> Option<Self> {
        if !scratch.nodes.read(store, key, threshold) {
            return None;
        }
        let (mut cells, mut starts, mut simplices) = ([0u64; 8], Vec::new(), Vec::new());
        let rows: Vec<_> = scratch.nodes.rows().collect();
        for row in rows {
            cells[row.row >> 3] |= u64::from(row.active) << (8 * (row.row & 7));
            for x in (0..8).filter(|x| row.active >> x & 1 == 1) {
                starts.push(simplices.len() as u16);
                scratch.cell.set(&scratch.nodes.corners(x, row.row));
                simplices.extend_from_slice(&scratch.cell.simplices);
                scratch.use_edges(x, row.row);
            }
        }
        if starts.is_empty() {
            return None;
        }
        starts.push(simplices.len() as u16);
        let mut rank = [0; 8];
        for word in 1..8 {
            rank[word] = rank[word - 1] + cells[word - 1].count_ones() as u16;
        }
        for (octant, edge) in &scratch.edges {
            scratch.numbers[usize::from(*octant) * D * block_cells::<D>() + usize::from(edge.at)] = NONE;
        }
        scratch.edges.sort_unstable_by_key(|(octant, edge)| (*octant, edge.at));
        let first = |octant: u16| scratch.edges.partition_point(|(o, _)| *o < octant) as u16;
        let octants = std::array::from_fn(|o| first(o as u16));
        let edges = scratch.edges.drain(..).map(|(_, edge)| edge).collect();
        Some(Self { cells, rank, starts: starts.into(), simplices: simplices.into(), edges, octants })
    }

    /// Simplices of the cell at a place of the brick, in cells from its lowest node.
    #[inline]
    pub(crate) fn cell(&self, at: usize) -> &[[[f32; D]; D]] {
        let (word, bit) = (at >> 6, at & 63);
        let cells = self.cells[word & 7];
        if cells >> bit & 1 == 0 {
            return &[];
        }
        let n = usize::from(self.rank[word & 7]) + (cells & ((1 << bit) - 1)).count_ones() as usize;
        &self.simplices[usize::from(self.starts[n])..usize::from(self.starts[n + 1])]
    }

    /// The cells with surface (places in the brick, ascending), and their simplices.
    pub(crate) fn cells(&self) -> impl Iterator<Item = (usize, &[[[f32; D]; D]])> {
        let ranges = self.starts.windows(2).map(|s| usize::from(s[0])..usize::from(s[1]));
        bits_of(&self.cells).zip(ranges).map(|(at, range)| (at, &self.simplices[range]))
    }

    /// Cells with surface in a row of the brick (`y + 8 z`), a bit each.
    #[inline]
    pub(crate) fn row(&self, row: usize) -> u8 {
        (self.cells[row >> 3 & 7] >> (8 * (row & 7))) as u8
    }

    /// The crossings that its cells use of the neighbour in this octant (0: of the brick itself).
    pub(super) fn used_edges(&self, octant: usize) -> &[UsedEdge] {
        &self.edges[usize::from(self.octants[octant])..usize::from(self.octants[octant + 1])]
    }

    /// Bytes held.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(&*self.starts)
            + size_of_val(&*self.simplices)
            + size_of_val(&*self.edges)
    }
}
