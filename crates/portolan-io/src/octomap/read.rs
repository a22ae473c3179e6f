//! Reading the nodes.

use std::fmt::Display;
use std::io::{BufRead, ErrorKind};
use std::path::Path;

use portolan::cell::{LogOdds32, LogOddsValue};
use portolan::store::{Slot, Tree, TreeRecords};

use super::header::{Header, Kind};
use super::stored::Stored;
use super::{
    DEPTH, HALF, MOST_MEMORY_PACKED, MOST_MEMORY_PLAIN, NODE_MEMORY, OCTOMAP_FREE, OCTOMAP_OCCUPIED,
    OctomapTree, STORED_MEMORY,
};
use crate::bytes::read_failed;
use crate::error::shown;
use crate::{Compression, IoError, Result};

/// Reads a file of either kind.
pub(super) fn read(reader: impl BufRead, packed: Compression, path: &Path) -> Result<OctomapTree> {
    let memory = if packed == Compression::Plain { MOST_MEMORY_PLAIN } else { MOST_MEMORY_PACKED };
    read_within(reader, packed, path, memory)
}

/// [`read`] within so much memory (bytes).
pub(super) fn read_within(
    mut reader: impl BufRead,
    packed: Compression,
    path: &Path,
    memory: u64,
) -> Result<OctomapTree> {
    let header = Header::read(&mut reader, packed, path)?;
    let color = header.kind == Kind::Ot && header.class == "ColorOcTree";
    if header.kind == Kind::Ot && !color && !["OcTree", "OcTreeStamped"].contains(&header.class.as_str()) {
        let advice = "OcTree, OcTreeStamped and ColorOcTree are read; write it as .bt with OctoMap";
        return Err(IoError::binary(path, 0, "the class (id)", shown(header.class), advice));
    }
    let mut nodes = Nodes {
        path,
        packed,
        offset: header.len(),
        reader,
        announced: header.size,
        nodes: 0,
        inner: 0,
        leaves: [0; 2],
        color,
        memory,
        records: TreeRecords::new(),
        stored: Stored::default(),
    };
    if header.size > 0 {
        let root = match header.kind {
            Kind::Bt => {
                nodes.count(nodes.offset)?;
                nodes.bt(DEPTH)?
            }
            Kind::Ot => nodes.ot(DEPTH)?.0,
        };
        nodes.stored.root_open = matches!(root, Slot::Leaf(_)) && nodes.inner > 0;
        nodes.records.set_root(root);
    }
    nodes.end()?;
    let resolution = header.resolution;
    let origin = [f64::from(-HALF) * resolution; 3];
    let tree = Tree::from_records(origin, resolution, DEPTH, &nodes.records);
    let tree = tree
        .map_err(|e| IoError::binary(path, nodes.offset, "the tree", e, "copy or download the file again"))?;
    let mut stored = nodes.stored;
    stored.sort();
    let [free, occupied] = nodes.leaves;
    Ok(OctomapTree { tree, header, stored, free, occupied, colors_left_out: color })
}

struct Nodes<'a, R> {
    path: &'a Path,
    packed: Compression,
    reader: R,
    offset: u64,
    /// Nodes that the header announces.
    announced: u64,
    /// Nodes so far.
    nodes: u64,
    /// Inner nodes so far.
    inner: u32,
    /// Free and occupied leaves so far.
    leaves: [u64; 2],
    color: bool,
    /// What the nodes may take (bytes).
    memory: u64,
    records: TreeRecords<LogOdds32>,
    stored: Stored,
}

impl<R: BufRead> Nodes<'_, R> {
    fn bad<T>(&self, offset: u64, field: &str, value: impl Display, advice: &str) -> Result<T> {
        Err(IoError::binary(self.path, offset, field, value, advice))
    }

    /// The next `N` bytes.
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        let mut got = 0;
        while got < N {
            let buffer = match self.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(e) => return Err(read_failed(self.path, self.packed, self.offset, e)),
            };
            let n = buffer.len().min(N - got);
            if n == 0 {
                let (value, announced) = (format!("{} so far", self.nodes), self.announced);
                let advice = format!("the file ends, but its header announces {announced}: it is cut off");
                return self.bad(self.offset, "the number of nodes", value, &advice);
            }
            bytes[got..got + n].copy_from_slice(&buffer[..n]);
            self.reader.consume(n);
            got += n;
            self.offset += n as u64;
        }
        Ok(bytes)
    }

    fn count(&mut self, offset: u64) -> Result<()> {
        self.nodes += 1;
        if self.nodes > self.announced {
            let advice = format!("the header announces {}: the file is damaged", self.announced);
            return self.bad(offset, "the number of nodes", format!("at least {}", self.nodes), &advice);
        }
        Ok(())
    }

    /// The number of a new inner node and its record. What it takes is charged first.
    fn inner(&mut self, offset: u64) -> Result<(u32, usize)> {
        let beside = (self.stored.open.len() + self.stored.values.len()) as u64;
        let taken = (self.records.masks.len() as u64 + 1) * NODE_MEMORY + beside * STORED_MEMORY;
        if taken > self.memory {
            let value = format!("more than {} MiB", self.memory >> 20);
            let advice = match self.packed {
                Compression::Plain => "that is the limit; split the tree, or make it coarser",
                _ => "that is the limit of a packed file; unpack it first (a plain one may take 16 GiB)",
            };
            return self.bad(offset, "the memory of the nodes", value, advice);
        }
        let number = self.inner;
        self.inner += 1;
        Ok((number, self.records.begin::<3>()))
    }

    fn leaf(&mut self, value: f32) -> Slot<LogOdds32> {
        self.leaves[usize::from(value >= 0.0)] += 1;
        Slot::Leaf(LogOdds32(value))
    }

    fn too_deep<T>(&self, offset: u64) -> Result<T> {
        self.bad(offset, "the depth of a node", "17", "a tree has 16 levels: the file is damaged")
    }

    /// An inner node of a `.bt`, `height` levels above the finest.
    fn bt(&mut self, height: u32) -> Result<Slot<LogOdds32>> {
        let offset = self.offset;
        let word = u16::from_le_bytes(self.take()?);
        if word == 0 {
            return self.bad(offset, "the number of children of an inner node", "0", "the file is damaged");
        }
        let (number, record) = self.inner(offset)?;
        let mut merged = 0;
        for c in 0..8 {
            let kind = word >> (2 * c) & 3;
            if kind == 0 {
                continue;
            }
            self.count(offset)?;
            let slot = match kind {
                1 => self.leaf(OCTOMAP_FREE),
                2 => self.leaf(OCTOMAP_OCCUPIED),
                _ if height == 1 => return self.too_deep(offset),
                _ => {
                    let slot = self.bt(height - 1)?;
                    merged |= u8::from(slot != Slot::Inner) << c;
                    slot
                }
            };
            self.records.set::<3>(record, c, slot);
        }
        if merged != 0 {
            self.stored.open.push((number, merged));
        }
        Ok(self.records.end::<3>(record))
    }

    /// A node of an `.ot`, `height` levels above the finest: what it is, its value (of an inner node the largest below),
    /// and whether it is an inner node in the file.
    fn ot(&mut self, height: u32) -> Result<(Slot<LogOdds32>, LogOdds32, bool)> {
        let offset = self.offset;
        self.count(offset)?;
        let value = f32::from_le_bytes(self.take()?);
        if self.color {
            self.take::<3>()?;
        }
        let [children] = self.take()?;
        if children == 0 {
            if !value.is_finite() {
                return self.bad(offset, "the log odds of a leaf", value, "give finite numbers");
            }
            return Ok((self.leaf(value), LogOdds32(value), false));
        }
        if height == 0 {
            return self.too_deep(offset);
        }
        let (number, record) = self.inner(offset)?;
        let (mut merged, mut above) = (0, LogOdds32::UNOBSERVED);
        for c in (0..8).filter(|c| children >> c & 1 != 0) {
            let (slot, below, inner) = self.ot(height - 1)?;
            merged |= u8::from(inner && slot != Slot::Inner) << c;
            if above.is_unobserved() || below > above {
                above = below;
            }
            self.records.set::<3>(record, c, slot);
        }
        if merged != 0 {
            self.stored.open.push((number, merged));
        }
        if value.to_bits() != above.0.to_bits() {
            self.stored.values.push((number, value.to_bits()));
        }
        Ok((self.records.end::<3>(record), above, true))
    }

    /// Checks that the file ends with the tree.
    fn end(&mut self) -> Result<()> {
        if self.nodes != self.announced {
            let advice = format!("the header announces {}: the file is damaged", self.announced);
            return self.bad(self.offset, "the number of nodes", self.nodes, &advice);
        }
        match self.reader.fill_buf() {
            Ok([]) => Ok(()),
            Ok(rest) => {
                let value = shown(&rest[..rest.len().min(16)]);
                let advice = "the tree ends before it: cut it off";
                self.bad(self.offset, "the data after the last node", value, advice)
            }
            Err(e) => Err(read_failed(self.path, self.packed, self.offset, e)),
        }
    }
}
