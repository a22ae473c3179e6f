//! Free space through a range image: a cell is free where every beam that looks its way saw farther.

use super::placed_image::PlacedImage;
use super::search::{BlockBox, LONGEST_EDGE, Octants, find_blocks};
use crate::geom::{BlockKey, Lattice, Pose};
use crate::scan::RangeImage;
use crate::sweep::PlanError;

/// Boxes of more blocks than this are not searched: single readings from far away are cheaper as rays.
const MOST_SEARCHED: u64 = 1 << 27;

/// Misses of a scan of rows and columns. A cell is missed where all beams within its width (and at least the four around
/// its center) that had a reading saw beyond it, and the pixel that it is in, or one within its width, had one. That is
/// the smallest of several ranges against one distance: cells on grazing surfaces between two beams are kept, which exact
/// rays carve. It is missed, too, where its center is half a cell or more before the surface through the four readings around
/// it, across that surface. Blocks, and in them octants, that are wholly free or wholly unseen are found by one look at the nearest and
/// the farthest reading in their window.
#[derive(Clone, Debug, Default)]
pub(in crate::sweep) struct ProjectiveMisses {
    image: Option<Box<PlacedImage>>,
    keys: Vec<BlockKey<3>>,
    octants: Vec<Octants>,
}

impl ProjectiveMisses {
    /// Takes an image in that fits together ([`RangeImage::check`]). `world_from_image` is the pose of the frame in which
    /// its pixels look.
    pub(in crate::sweep) fn take(
        &mut self,
        image: &RangeImage,
        world_from_image: &Pose<3>,
        lattice: &Lattice<3>,
    ) {
        let old = self.image.take();
        self.image = Some(Box::new(PlacedImage::new(image, world_from_image, lattice, old)));
    }

    /// Finds the blocks between `first` and `last` (both included) that hold cells which may be free, `most` at most.
    /// Returns whether they were searched for: not in boxes that are too large.
    pub(in crate::sweep) fn find_blocks(
        &mut self,
        first: BlockKey<3>,
        last: BlockKey<3>,
        most: usize,
    ) -> Result<bool, PlanError> {
        self.clear();
        let Some(image) = &self.image else { return Ok(true) };
        let edges = [0, 1, 2].map(|k| (i64::from(last.0[k]) - i64::from(first.0[k]) + 1).max(0));
        let blocks = edges.iter().try_fold(1u64, |n, &edge| n.checked_mul(edge as u64));
        if blocks.is_none_or(|n| n > MOST_SEARCHED) || edges.iter().any(|&edge| edge > LONGEST_EDGE) {
            return Ok(false);
        }
        if blocks == Some(0) {
            return Ok(true);
        }
        let whole = BlockBox { first: first.0, last: last.0 };
        let fits = find_blocks(image.as_ref(), whole, most, &mut self.keys, &mut self.octants);
        if fits { Ok(true) } else { Err(PlanError::TooManyBlocks) }
    }

    /// Forgets the blocks.
    pub(in crate::sweep) fn clear(&mut self) {
        self.keys.clear();
        self.octants.clear();
    }

    /// The blocks that were found, ascending.
    pub(in crate::sweep) fn blocks(&self) -> &[BlockKey<3>] {
        &self.keys
    }

    /// The free cells of the `i`-th block, a bit each.
    pub(in crate::sweep) fn free_cells(&self, i: usize) -> [u64; 8] {
        let (Some(image), octants) = (&self.image, self.octants[i]) else { return [0; 8] };
        if octants.free == 0xff {
            return [u64::MAX; 8];
        }
        let mut words = [0u64; 8];
        let low = self.keys[i].first_cell();
        for octant in 0..8 {
            let corner = [0, 1, 2].map(|k| 4 * (octant >> k & 1));
            let first = [0, 1, 2].map(|k| i64::from(low[k]) + corner[k] as i64);
            let is = |bits: u8| bits >> octant & 1 == 1;
            let bits = match (is(octants.free), is(octants.mixed)) {
                (true, _) => u64::MAX,
                (_, true) => image.free_of_octant(first, is(octants.complete)),
                _ => continue,
            };
            for z in 0..4 {
                let mut layer = 0;
                for y in 0..4 {
                    layer |= (bits >> (16 * z + 4 * y) & 0xf) << (8 * (corner[1] + y) + corner[0]);
                }
                words[corner[2] + z] |= layer;
            }
        }
        words
    }
}
