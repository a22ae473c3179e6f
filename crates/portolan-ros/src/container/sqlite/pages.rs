//! Pages, b-trees of tables, and payloads that run over several pages.

use std::collections::HashSet;
use std::ops::Range;

use super::super::reader::FileReader;
use super::record::varint;
use crate::Result;

/// What the file starts with.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";

/// Kinds of b-tree pages.
const INTERIOR: u8 = 5;
const LEAF: u8 = 13;

/// How text is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TextEncoding {
    Utf8,
    Utf16Le,
    Utf16Be,
}

/// The numbers of the header that reading needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pages {
    size: u64,
    /// Bytes of a page without those reserved for extensions.
    usable: u64,
    /// Pages that the file holds whole.
    pub(super) count: u64,
    /// Pages that its header says it has.
    pub(super) said: u64,
    pub(super) text: TextEncoding,
}

/// A leaf of a table: the last one is kept, for the next row of it.
#[derive(Default)]
pub(crate) struct Leaf {
    number: u64,
    bytes: Vec<u8>,
}

/// A row of a table, in its leaf.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) rowid: i64,
    /// Bytes of the record.
    pub(super) payload: u64,
    /// Those of them that the leaf holds, as places in it.
    local: Range<usize>,
    /// The page with the next ones; 0: there are none.
    overflow: u64,
}

impl Pages {
    /// Reads the header.
    pub(super) fn read(reader: &mut FileReader) -> Result<Self> {
        let mut head = [0; 100];
        reader.read_at(0, &mut head, "the header")?;
        let size = match u16::from_be_bytes([head[16], head[17]]) {
            1 => 65536,
            n => u64::from(n),
        };
        if !size.is_power_of_two() || size < 512 {
            return Err(reader.damaged(16, "the page size", size));
        }
        let usable = size - u64::from(head[20]);
        if usable < 480 || head[21..24] != [64, 32, 32] {
            return Err(reader.damaged(20, "the header", "not that of an sqlite3 database"));
        }
        if head[19] > 2 {
            let advice = "only versions 1 and 2 are read";
            return Err(reader.wrong(19, "the version for reading", head[19], advice));
        }
        let text = match big_u32(&head, 56) {
            0 | 1 => TextEncoding::Utf8,
            2 => TextEncoding::Utf16Le,
            3 => TextEncoding::Utf16Be,
            other => return Err(reader.damaged(56, "the text encoding", other)),
        };
        let count = reader.size() / size;
        // An old writer leaves the number of pages as it was: then the two counters differ.
        let kept = big_u32(&head, 24) == big_u32(&head, 92) && big_u32(&head, 28) != 0;
        let said = if kept { u64::from(big_u32(&head, 28)) } else { count };
        Ok(Self { size, usable, count, said, text })
    }

    /// The first byte of a page, for errors.
    pub(super) fn place(&self, number: u64) -> u64 {
        number.saturating_sub(1).saturating_mul(self.size)
    }

    fn page(&self, reader: &mut FileReader, number: u64, bytes: &mut Vec<u8>) -> Result<()> {
        if number == 0 || number > self.count {
            let value = format!("{number} of a file of {} whole pages", self.count);
            return Err(reader.damaged(self.place(number), "a page number", value));
        }
        reader.bytes_at(self.place(number), self.size, bytes, "a page")
    }

    /// Brings a page of a table into `leaf`.
    pub(super) fn leaf(&self, reader: &mut FileReader, number: u64, leaf: &mut Leaf) -> Result<()> {
        // 0 is the number of a leaf that was never read, and of no page.
        if leaf.number != number || number == 0 {
            leaf.number = 0;
            self.page(reader, number, &mut leaf.bytes)?;
            leaf.number = number;
        }
        Ok(())
    }

    /// The leaves of the table whose root is page `root`, in the order of their rows. `damage` takes pages that cannot
    /// be read, or gives the error back.
    pub(super) fn leaves(
        &self,
        reader: &mut FileReader,
        root: u64,
        mut damage: impl FnMut(crate::BagError) -> Result<()>,
        mut visit: impl FnMut(&mut FileReader, &Leaf, u32) -> Result<()>,
    ) -> Result<()> {
        let (mut stack, mut seen, mut leaf) = (vec![root], HashSet::new(), Leaf::default());
        while let Some(number) = stack.pop() {
            let children = match self.visit_page(reader, number, &mut seen, &mut leaf) {
                Ok(children) => children,
                Err(error) => {
                    damage(error)?;
                    continue;
                }
            };
            match children {
                Children::Rows(rows) => visit(reader, &leaf, rows)?,
                Children::Pages(pages) => stack.extend(pages.into_iter().rev()),
            }
        }
        Ok(())
    }

    fn visit_page(
        &self,
        reader: &mut FileReader,
        number: u64,
        seen: &mut HashSet<u64>,
        leaf: &mut Leaf,
    ) -> Result<Children> {
        self.leaf(reader, number, leaf)?;
        let (place, at) = (self.place(number), leaf.start());
        let wrong = |what: &str, value: &dyn ToString| reader.damaged(place, what, value.to_string());
        if !seen.insert(number) {
            return Err(wrong("a page", &"twice in one table"));
        }
        let bytes = &leaf.bytes;
        let cells = usize::from(u16::from_be_bytes([bytes[at + 3], bytes[at + 4]]));
        match bytes[at] {
            // Two bytes of a pointer and four of a row are the least.
            LEAF if at + 8 + 2 * cells <= self.usable as usize => Ok(Children::Rows(cells as u32)),
            INTERIOR if at + 12 + 2 * cells <= self.usable as usize => {
                let mut pages = Vec::with_capacity(cells + 1);
                for i in 0..cells {
                    let pointer = at + 12 + 2 * i;
                    let cell = usize::from(u16::from_be_bytes([bytes[pointer], bytes[pointer + 1]]));
                    if cell + 4 > self.usable as usize {
                        return Err(wrong("a cell's place", &cell));
                    }
                    pages.push(u64::from(big_u32(bytes, cell)));
                }
                pages.push(u64::from(big_u32(bytes, at + 8)));
                Ok(Children::Pages(pages))
            }
            LEAF | INTERIOR => Err(wrong("the number of cells", &cells)),
            2 | 10 => Err(reader.wrong(
                place,
                "a table",
                "of a kind without row numbers (WITHOUT ROWID)",
                "rosbag2 writes no such tables: copy the messages into a new bag",
            )),
            kind => Err(wrong("the kind of a page", &kind)),
        }
    }

    /// The row `index` of a leaf.
    pub(super) fn cell(&self, reader: &FileReader, leaf: &Leaf, index: u32) -> Result<Cell> {
        let (bytes, at) = (&leaf.bytes, leaf.start());
        let wrong =
            |what: &str| reader.damaged(self.place(leaf.number), format!("{what} of row {index}"), "damaged");
        let cells = u32::from(u16::from_be_bytes([bytes[at + 3], bytes[at + 4]]));
        let pointer = at + 8 + 2 * index as usize;
        if bytes[at] != LEAF || index >= cells || pointer + 2 > self.usable as usize {
            return Err(wrong("the place"));
        }
        let start = usize::from(u16::from_be_bytes([bytes[pointer], bytes[pointer + 1]]));
        let head = bytes[..self.usable as usize].get(start..).ok_or_else(|| wrong("the place"))?;
        let (payload, a) = varint(head).ok_or_else(|| wrong("the size"))?;
        let (rowid, b) = varint(&head[a..]).ok_or_else(|| wrong("the number"))?;
        let payload = u64::try_from(payload).map_err(|_| wrong("the size"))?;
        let first = start + a + b;
        let most = self.usable - 35;
        if payload <= most {
            let local = first..first + payload as usize;
            if local.end > self.usable as usize {
                return Err(wrong("the size"));
            }
            return Ok(Cell { rowid, payload, local, overflow: 0 });
        }
        // No record is larger than the file that holds it.
        reader.check(0, payload, "a row").map_err(|_| wrong("the size"))?;
        let least = (self.usable - 12) * 32 / 255 - 23;
        let kept = least + (payload - least) % (self.usable - 4);
        let local = first..first + if kept <= most { kept } else { least } as usize;
        if local.end + 4 > self.usable as usize {
            return Err(wrong("the size"));
        }
        let overflow = u64::from(big_u32(bytes, local.end));
        Ok(Cell { rowid, payload, local, overflow })
    }

    /// The bytes `range` of the payload of a cell of `leaf`, as the only content of `out`.
    pub(super) fn payload(
        &self,
        reader: &mut FileReader,
        leaf: &Leaf,
        cell: &Cell,
        range: Range<u64>,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        out.clear();
        let place = self.place(leaf.number);
        if range.end > cell.payload || range.start > range.end {
            return Err(reader.damaged(
                place,
                "the length of a column",
                format!("{range:?} of {}", cell.payload),
            ));
        }
        let local = cell.local.len() as u64;
        if range.start < local {
            let end = cell.local.start + range.end.min(local) as usize;
            out.extend_from_slice(&leaf.bytes[cell.local.start + range.start as usize..end]);
        }
        let (mut at, mut next, room) = (local, cell.overflow, self.usable - 4);
        // As the payload is no longer than the file, a chain that loops ends, too.
        while at < range.end {
            if next == 0 || next > self.count {
                let value = format!("{next} of a file of {} whole pages", self.count);
                return Err(reader.damaged(place, "an overflow page", value));
            }
            let page = self.place(next);
            let mut word = [0; 4];
            reader.read_at(page, &mut word, "an overflow page")?;
            let (from, to) = (range.start.max(at) - at, (range.end - at).min(room));
            if from < to {
                let length = out.len();
                out.resize(length + (to - from) as usize, 0);
                reader.read_at(page + 4 + from, &mut out[length..], "an overflow page")?;
            }
            next = u64::from(u32::from_be_bytes(word));
            at += room;
        }
        Ok(())
    }
}

enum Children {
    Rows(u32),
    Pages(Vec<u64>),
}

impl Leaf {
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Where the b-tree's header is: in the first page after the file's.
    fn start(&self) -> usize {
        if self.number == 1 { 100 } else { 0 }
    }
}

fn big_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}
