//! Writing the nodes.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use portolan::cell::{LogOdds32, LogOddsValue};
use portolan::store::{Store, Tree, TreeRecords};

use super::header::{Header, Kind};
use super::place::placed;
use super::stored::{Cursor, Stored};
use super::{OCTOMAP_FREE, OCTOMAP_OCCUPIED, OctomapTree};
use crate::{IoError, Result, write_atomic};

/// Writes a tree as OctoMap's `.bt`: every leaf free or occupied (log odds 0 and above, as OctoMap has it), equal leaves
/// merged.
///
/// # Errors
/// [`IoError::Unwritable`] where the tree's origin is not a multiple of its resolution or something was observed outside
/// of OctoMap's 65,536 cells about the world's zero; else as [`write_atomic`].
pub fn write_octomap_bt<V: LogOddsValue>(path: impl AsRef<Path>, tree: &Tree<V, 3>) -> Result<()> {
    let path = path.as_ref();
    let (header, tree, stored) = bt(tree, path)?;
    write(&header, &tree, &stored, path)
}

/// The same as bytes in memory.
///
/// # Errors
/// [`IoError::Unwritable`] as [`write_octomap_bt`].
pub fn octomap_bt_to_bytes<V: LogOddsValue>(tree: &Tree<V, 3>) -> Result<Vec<u8>> {
    let name = Path::new("octree.bt");
    let (header, tree, stored) = bt(tree, name)?;
    let mut bytes = Vec::new();
    write_to(&mut bytes, &header, &tree, &stored).map_err(|e| IoError::os(name, "write it", e))?;
    Ok(bytes)
}

/// What a `.bt` of a tree holds.
fn bt<V: LogOddsValue>(tree: &Tree<V, 3>, path: &Path) -> Result<(Header, Tree<LogOdds32, 3>, Stored)> {
    let tree = likeliest(tree);
    let moved = match placed(&tree, path)? {
        Cow::Owned(moved) => Some(moved),
        Cow::Borrowed(_) => None,
    };
    let (tree, stored, size) = opened(moved.unwrap_or(tree));
    Ok((Header::new(Kind::Bt, size, tree.lattice().resolution), tree, stored))
}

/// Writes a tree as OctoMap's `.ot`. `quantum` is the log odds of one unit of a value: that of the rule for bytes
/// ([`portolan::cell::LogOddsRule::quantum`]), 1 for floats, of which nothing is lost. The value of an inner node is the
/// largest of its children's.
///
/// # Errors
/// As [`write_octomap_bt`], and where a log odds is not finite.
pub fn write_octomap_ot<V: LogOddsValue>(
    path: impl AsRef<Path>,
    tree: &Tree<V, 3>,
    quantum: f64,
) -> Result<()> {
    let path = path.as_ref();
    let tree = tree.map_values(|v| LogOdds32((v.units() * quantum) as f32));
    let mut infinite = None;
    tree.for_each_leaf(|leaf| {
        if !leaf.value.0.is_finite() {
            infinite = Some(leaf);
        }
    });
    if let Some(leaf) = infinite {
        let value = format!("{} at cell {:?}", leaf.value.0, leaf.cell);
        return Err(IoError::unwritable(path, "a log odds", value, "give finite numbers"));
    }
    let tree = placed(&tree, path)?;
    let header = Header::new(Kind::Ot, tree.nodes() as u64, tree.lattice().resolution);
    write(&header, &tree, &Stored::default(), path)
}

impl OctomapTree {
    /// Writes a `.bt`. Read from a `.bt` it has the same bytes; else every leaf becomes free or occupied and equal leaves
    /// are merged, as OctoMap's `writeBinary` does it. Comments and class name stay.
    ///
    /// # Errors
    /// As [`crate::write_atomic`].
    pub fn write_bt(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        if self.header.kind == Kind::Bt {
            return write(&self.header, &self.tree, &self.stored, path);
        }
        let (tree, stored, size) = opened(likeliest(&self.tree));
        write(&self.header.changed(Kind::Bt, &self.header.class, size), &tree, &stored, path)
    }

    /// Writes an `.ot`. Nodes are those of the file that was read, and read from an `.ot` without colors it has the same
    /// bytes. Comments stay; the class is `OcTree`, or `OcTreeStamped` where it was.
    ///
    /// # Errors
    /// As [`crate::write_atomic`].
    pub fn write_ot(&self, path: impl AsRef<Path>) -> Result<()> {
        let class = if self.header.class == "OcTreeStamped" { "OcTreeStamped" } else { "OcTree" };
        let header = self.header.changed(Kind::Ot, class, self.header.size);
        write(&header, &self.tree, &self.stored, path.as_ref())
    }
}

/// Every leaf at one of two values.
fn likeliest<V: LogOddsValue>(tree: &Tree<V, 3>) -> Tree<LogOdds32, 3> {
    tree.map_values(|v| LogOdds32(if v.units() >= 0.0 { OCTOMAP_OCCUPIED } else { OCTOMAP_FREE }))
}

/// A `.bt` has inner nodes only, so that a root that is a leaf is written with its eight children. With the number of nodes.
fn opened(tree: Tree<LogOdds32, 3>) -> (Tree<LogOdds32, 3>, Stored, u64) {
    let root_open = tree.inner_nodes() == 0 && tree.nodes() == 1;
    let size = tree.nodes() as u64 + if root_open { 8 } else { 0 };
    (tree, Stored { root_open, ..Stored::default() }, size)
}

fn write(header: &Header, tree: &Tree<LogOdds32, 3>, stored: &Stored, path: &Path) -> Result<()> {
    write_atomic(path, |out| write_to(out, header, tree, stored))
}

fn write_to(
    out: &mut impl Write,
    header: &Header,
    tree: &Tree<LogOdds32, 3>,
    stored: &Stored,
) -> io::Result<()> {
    let records = tree.records();
    out.write_all(header.bytes())?;
    let mut nodes = Nodes { out, records: &records, next: 0, cursor: Cursor::of(stored) };
    let root = match (records.masks.is_empty(), stored.root_open) {
        (false, _) => Node::Inner,
        (true, true) => Node::Open,
        (true, false) => Node::Leaf,
    };
    match header.kind {
        _ if header.size == 0 => Ok(()),
        Kind::Bt => nodes.bt(root, records.root_value),
        Kind::Ot => nodes.ot(root, records.root_value),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Node {
    Leaf,
    /// A leaf in memory that is an inner node with equal leaves in the file.
    Open,
    Inner,
}

struct Nodes<'a, W> {
    out: &'a mut W,
    records: &'a TreeRecords<LogOdds32>,
    /// The next record.
    next: usize,
    cursor: Cursor<'a>,
}

impl<W: Write> Nodes<'_, W> {
    /// The children of the next inner node (`None`: never observed), and the bits of its value if that is its own.
    fn children(&mut self, node: Node, value: LogOdds32) -> ([Option<(Node, LogOdds32)>; 8], Option<u32>) {
        let (open, own) = self.cursor.next();
        let leaf = |c: usize| if open >> c & 1 != 0 { Node::Open } else { Node::Leaf };
        if node == Node::Open {
            return (std::array::from_fn(|c| Some((leaf(c), value))), own);
        }
        let record = self.next;
        self.next += 1;
        let mask = self.records.masks[record];
        let children = std::array::from_fn(|c| {
            let value = self.records.values[8 * record + c];
            let node = if mask >> c & 1 != 0 { Node::Inner } else { leaf(c) };
            (!value.is_unobserved()).then_some((node, value))
        });
        (children, own)
    }

    fn bt(&mut self, node: Node, value: LogOdds32) -> io::Result<()> {
        let (children, _) = self.children(node, value);
        let mut word = 0u16;
        for (c, child) in children.iter().enumerate() {
            word |= match child {
                None => 0,
                Some((Node::Leaf, value)) => 1 + u16::from(value.0 >= 0.0),
                Some(_) => 3,
            } << (2 * c);
        }
        self.out.write_all(&word.to_le_bytes())?;
        children.into_iter().flatten().filter(|(n, _)| *n != Node::Leaf).try_for_each(|(n, v)| self.bt(n, v))
    }

    fn ot(&mut self, node: Node, value: LogOdds32) -> io::Result<()> {
        let [a, b, c, d] = value.0.to_le_bytes();
        if node == Node::Leaf {
            return self.out.write_all(&[a, b, c, d, 0]);
        }
        let (children, own) = self.children(node, value);
        let [a, b, c, d] = own.map_or([a, b, c, d], u32::to_le_bytes);
        let mask = (0..8).fold(0, |mask, c| mask | u8::from(children[c].is_some()) << c);
        self.out.write_all(&[a, b, c, d, mask])?;
        children.into_iter().flatten().try_for_each(|(n, v)| self.ot(n, v))
    }
}
