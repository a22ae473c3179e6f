//! Bricks in chunks: a plane of keys, and a plane for each number of a cell.

use portolan::cell::Cell;
use portolan::geom::{BlockKey, block_cells};
use portolan::store::Bricks;

use super::header::Entry;
use super::part_name;
use super::reading::{AGAIN, Reading};
use crate::error::shown;
use crate::{ContainerWriter, IoError, Result};

/// A plane of bricks is cut into chunks of so many bricks, so that only one of them is in memory beside the map.
const BRICKS_PER_PART: usize = 1 << 15;
/// What a brick takes beside its planes: its slot, its place in the hash table, the planes' counters (bytes).
const BRICK_OVERHEAD: u64 = 96;
/// Keys beyond this would leave the range of cell indices.
const LARGEST_KEY: i32 = 1 << 27;

impl Reading<'_> {
    /// The bricks of a map, each made by `brick` of its part of each plane (name of the plane, bytes of a cell); `None`: a
    /// cell is not possible.
    pub(super) fn bricks<C: Cell, const D: usize, const N: usize>(
        &mut self,
        entry: &Entry,
        planes: [(&str, usize); N],
        brick: impl Fn([&[u8]; N]) -> Option<C::Brick>,
    ) -> Result<Bricks<C, D>> {
        let (lattice, tag) = (self.lattice(entry)?, &*entry.chunk);
        let keys = self.keys(tag, BRICK_OVERHEAD)?;
        let lengths = planes.map(|(_, cell_bytes)| cell_bytes * block_cells::<D>());
        let mut parts = Vec::new();
        for ((name, _), length) in planes.iter().zip(lengths) {
            parts.push(self.parts_of_length(tag, name, (keys.len() * length) as u64)?);
        }
        let mut store = Bricks::new(lattice);
        let mut keys = keys.into_iter();
        for part in 0..parts[0].len() {
            let mut contents = Vec::with_capacity(N);
            for of_plane in &parts {
                let Some(&i) = of_plane.get(part) else { return Err(self.uneven(tag)) };
                contents.push(self.unpack(i)?);
            }
            let bricks = contents[0].len() / lengths[0];
            if contents.iter().zip(lengths).any(|(c, length)| c.len() != bricks * length) {
                return Err(self.uneven(tag));
            }
            for (i, key) in keys.by_ref().take(bricks).enumerate() {
                let of_brick = std::array::from_fn(|k| &contents[k][i * lengths[k]..][..lengths[k]]);
                let Some(brick) = brick(of_brick) else {
                    let field = format!("a cell of brick {:?} in chunk {}", key.0, shown(tag));
                    return Err(self.bad(field, "not finite or negative", AGAIN));
                };
                self.possible(&entry.map, store.insert(key, brick))?;
            }
        }
        Ok(store)
    }

    /// That the parts of a map's planes do not fit together.
    pub(super) fn uneven(&self, tag: &str) -> IoError {
        let advice = "every part of a plane must hold whole bricks, as many as that part of the other planes";
        self.bad(format!("the division of chunk {} into parts", shown(tag)), "uneven", advice)
    }

    /// The keys of a chunk's bricks, in ascending order and within the range of cell indices; `overhead`: what each brick takes
    /// beside its planes (bytes).
    pub(super) fn keys<const D: usize>(&mut self, tag: &str, overhead: u64) -> Result<Vec<BlockKey<D>>> {
        let field = format!("the length of chunk {} keys", shown(tag));
        if self.parts(tag, "keys").is_empty() {
            return Err(self.bad(field, "missing", AGAIN));
        }
        let (length, key_bytes) = (self.length(tag, "keys"), D * size_of::<i32>());
        if !length.is_multiple_of(key_bytes as u64) {
            let advice = format!("give {key_bytes} bytes for each key");
            return Err(self.bad(field, format!("{length} bytes"), advice));
        }
        self.take(length / key_bytes as u64 * overhead)?;
        let bytes = self.plane(tag, "keys", length)?;
        let number = |b: &[u8], k: usize| i32::from_le_bytes(std::array::from_fn(|i| b[4 * k + i]));
        let keys: Vec<BlockKey<D>> =
            bytes.chunks_exact(key_bytes).map(|b| BlockKey(std::array::from_fn(|k| number(b, k)))).collect();
        let in_range = |key: &BlockKey<D>| key.0.iter().all(|&k| (-LARGEST_KEY..LARGEST_KEY).contains(&k));
        let bad = (0..keys.len()).find(|&i| !in_range(&keys[i]) || i > 0 && keys[i - 1] >= keys[i]);
        match bad {
            Some(i) => {
                let field = format!("key {i} of chunk {}", shown(tag));
                let advice = "keys must ascend, the last index first, and lie within 2^27 of zero";
                Err(self.bad(field, format!("{:?}", keys[i].0), advice))
            }
            None => Ok(keys),
        }
    }
}

/// Chunks of the keys of bricks.
pub(super) fn write_keys<C: Cell, const D: usize>(
    writer: &mut ContainerWriter,
    tag: &str,
    store: &Bricks<C, D>,
) -> Result<()> {
    write_parts(writer, tag, "keys", &store.keys(), |key, bytes| {
        bytes.extend(key.0.iter().flat_map(|v| v.to_le_bytes()));
    })
}

/// Chunks of what `content` appends for each brick, in the order of the keys.
pub(super) fn write_bricks<C: Cell, const D: usize>(
    writer: &mut ContainerWriter,
    tag: &str,
    name: &str,
    store: &Bricks<C, D>,
    content: impl Fn(&C::Brick, &mut Vec<u8>),
) -> Result<()> {
    write_parts(writer, tag, name, &store.keys(), |key, bytes| {
        if let Some(brick) = store.brick(key) {
            content(brick, bytes);
        }
    })
}

fn write_parts<const D: usize>(
    writer: &mut ContainerWriter,
    tag: &str,
    name: &str,
    keys: &[BlockKey<D>],
    content: impl Fn(BlockKey<D>, &mut Vec<u8>),
) -> Result<()> {
    if keys.is_empty() {
        return writer.chunk(tag, name, &[]);
    }
    let mut bytes = Vec::new();
    for (part, keys) in keys.chunks(BRICKS_PER_PART).enumerate() {
        bytes.clear();
        keys.iter().for_each(|&key| content(key, &mut bytes));
        writer.chunk(tag, &part_name(name, part), &bytes)?;
    }
    Ok(())
}
