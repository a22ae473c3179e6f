//! A `.bt` or `.ot` in memory.

use std::path::Path;

use portolan::cell::LogOdds32;
use portolan::store::Tree;

use super::header::{Header, Kind};
use super::read;
use super::stored::Stored;
use crate::{Compression, Result};

/// An OctoMap file: the tree of log odds, and the rest of the file.
///
/// The tree is the smallest that has the file's cells: where eight equal leaves stand side by side in the file, they
/// are one here. Which they were, and values of inner nodes that are not the largest of their children's (trees
/// written after `lazy_eval` have them), is kept beside the tree: written again in the format that it was read from, the
/// file has the same bytes. (Except a `ColorOcTree` in an `.ot`: its colors are passed over.)
#[derive(Clone, Debug)]
pub struct OctomapTree {
    pub(super) tree: Tree<LogOdds32, 3>,
    pub(super) header: Header,
    pub(super) stored: Stored,
    pub(super) free: u64,
    pub(super) occupied: u64,
    pub(super) colors_left_out: bool,
}

impl OctomapTree {
    /// Reads a `.bt` or `.ot`; the first line decides which. gzip and bzip2 files are read, too.
    ///
    /// A `.bt` may have any class name. In an `.ot` the class defines the layout of a node: `OcTree`, `OcTreeStamped` (whose
    /// stamps are not in the file) and `ColorOcTree` (whose colors are passed over) are read.
    ///
    /// # Errors
    /// [`crate::IoError`] where a field is wrong, a log odds is not finite, the number of nodes differs from the header's, they
    /// would take more than 4 GiB (a file that is not packed: 16 GiB), or bytes are missing or left over.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let input = crate::open(&path)?;
        let packed = input.compression();
        read::read(input, packed, path.as_ref())
    }

    /// Reads a file in memory; errors name it `name`.
    ///
    /// # Errors
    /// As [`OctomapTree::read`].
    pub fn parse(bytes: &[u8], name: &Path) -> Result<Self> {
        read::read(bytes, Compression::Plain, name)
    }

    /// The cells: log odds as they are in an `.ot`; in a `.bt` [`super::OCTOMAP_FREE`] and [`super::OCTOMAP_OCCUPIED`].
    /// Its cell 0 is the world's cell -32,768; the depth is 16.
    pub fn tree(&self) -> &Tree<LogOdds32, 3> {
        &self.tree
    }

    /// The cells alone.
    pub fn into_tree(self) -> Tree<LogOdds32, 3> {
        self.tree
    }

    /// Whether it was a `.bt`: free and occupied only.
    pub fn is_binary(&self) -> bool {
        self.header.kind == Kind::Bt
    }

    /// Name of the tree's class.
    pub fn class(&self) -> &str {
        &self.header.class
    }

    /// Meters per cell.
    pub fn resolution(&self) -> f64 {
        self.header.resolution
    }

    /// Leaves of the file that are free (log odds below 0, as OctoMap has it) and occupied.
    pub fn leaves(&self) -> (u64, u64) {
        (self.free, self.occupied)
    }

    /// Inner nodes of the file.
    pub fn inner_nodes(&self) -> u64 {
        self.header.size - self.free - self.occupied
    }

    /// Inner nodes of the file whose leaves are all equal, so that OctoMap's `prune` would make them leaves.
    pub fn prunable_nodes(&self) -> u64 {
        self.stored.open_nodes()
    }

    /// Whether the file had colors, which are not kept.
    pub fn colors_left_out(&self) -> bool {
        self.colors_left_out
    }
}
