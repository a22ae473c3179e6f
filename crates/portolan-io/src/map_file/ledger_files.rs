//! Ledgers in files added up without being held: bricks are read, summed and written one after the other.

use std::collections::VecDeque;
use std::path::Path;

use portolan::cell::{ColorSum, DistanceSum, HitLengthSum, HitMissSum, Sign, SumBrick, SumCell, SumPlanes};
use portolan::geom::{BlockKey, block_cells};
use portolan::ledger::{LedgerError, LedgerScans, check_settings};
use portolan::mapper::MapperSettings;
use serde_json::{Value, json};

use super::ledger::{
    ATTENUATION, COLORS, DISTANCES, FIELD, OCCUPANCY, SumParts, brick, bytes_of, header, write_scans,
};
use super::reading::{AGAIN, Reading};
use super::{MapHeader, VERSION, part_name};
use crate::error::shown;
use crate::{Container, ContainerWriter, IoError, Result};

/// A ledger in a file: its settings and scans in memory, its sums on the disk.
#[derive(Debug)]
pub struct LedgerFile<const D: usize> {
    /// What the writer noted.
    pub header: MapHeader,
    /// What shapes the sums.
    pub settings: MapperSettings<D>,
    /// The scans.
    pub scans: LedgerScans<D>,
    container: Container,
}

impl<const D: usize> LedgerFile<D> {
    /// Opens a file; `None` where it holds no ledger. Header and scans may take `memory` bytes.
    ///
    /// # Errors
    /// As [`MapFile::from_container`](super::MapFile::from_container).
    pub fn open(path: impl AsRef<Path>, memory: u64) -> Result<Option<Self>> {
        let container = Container::open(path)?;
        let mut reading = Reading::new(&container, memory)?;
        reading.maps(D)?;
        let Some(field) = reading.field(FIELD) else { return Ok(None) };
        let settings = reading.ledger_settings(field)?;
        let scans = reading.scans()?;
        let header = reading.header_alone()?;
        Ok(Some(Self { header, settings, scans, container }))
    }

    fn cursor<const K: usize>(&self, tag: &'static str, sign: Sign) -> Cursor<'_, D, K> {
        Cursor { container: &self.container, tag, sign, part: 0, bricks: VecDeque::new(), last: None }
    }
}

/// Adds files up into another one, and takes others out, with memory for some bricks of each. The first must be added. `header`
/// is what is noted in the sum, whose file is that of the sum made in memory, byte for byte.
///
/// # Errors
/// Where settings differ, a scan is there twice or not at all, sums become such as no observations have; and as for reading
/// and writing. No file is left then.
pub fn add_ledger_files<const D: usize>(
    files: &[(LedgerFile<D>, Sign)],
    header: &MapHeader,
    path: &Path,
) -> Result<()> {
    let Some(((first, Sign::Plus), _)) = files.split_first() else {
        return Err(IoError::unwritable(path, "the number of maps", 0, "give one at least"));
    };
    let scans = scans_of_sum(files)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut writer = ContainerWriter::spooled(folder)?;
    let text = header_text(&first.settings, header)
        .map_err(|e| IoError::unwritable(path, "the header", e, "give finite numbers"))?;
    writer.chunk("HEAD", "", text.as_bytes())?;
    write_scans(&scans, &mut writer)?;
    if first.settings.occupancy.is_some() {
        add_sums::<HitMissSum, D, 2>(files, OCCUPANCY, &mut writer)?;
    }
    if first.settings.distances {
        add_sums::<DistanceSum, D, 2>(files, DISTANCES, &mut writer)?;
    }
    if first.settings.color {
        add_sums::<ColorSum, D, 4>(files, COLORS, &mut writer)?;
    }
    if first.settings.attenuation.is_some() {
        add_sums::<HitLengthSum, D, 3>(files, ATTENUATION, &mut writer)?;
    }
    writer.write(path)
}

/// The scans of the sum of these files.
///
/// # Errors
/// Where settings differ, or a scan is there twice or not at all.
pub fn scans_of_sum<const D: usize>(files: &[(LedgerFile<D>, Sign)]) -> Result<LedgerScans<D>> {
    let mut scans = LedgerScans::default();
    for (file, sign) in files {
        let failed =
            |error: LedgerError| IoError::Ledger { path: file.container.path().into(), cause: error };
        check_settings(&files[0].0.settings, &file.settings).map_err(failed)?;
        match sign {
            Sign::Plus => scans.merge(&file.scans).map_err(failed)?,
            Sign::Minus => scans.take_out(&file.scans).map_err(failed)?,
        }
    }
    Ok(scans)
}

fn header_text<const D: usize>(
    settings: &MapperSettings<D>,
    noted: &MapHeader,
) -> serde_json::Result<String> {
    let mut value = serde_json::to_value(noted)?;
    value["version"] = json!(VERSION);
    value["dimension"] = json!(D);
    value["maps"] = Value::Array(Vec::new());
    value[FIELD] = header(settings)?;
    serde_json::to_string(&value)
}

fn add_sums<C, const D: usize, const K: usize>(
    files: &[(LedgerFile<D>, Sign)],
    tag: &'static str,
    writer: &mut ContainerWriter,
) -> Result<()>
where
    C: SumCell<Brick = SumBrick<K>>,
    SumBrick<K>: SumPlanes<C>,
{
    let mut cursors: Vec<Cursor<'_, D, K>> =
        files.iter().map(|(file, sign)| file.cursor(tag, *sign)).collect();
    let mut parts = SumParts::new(tag);
    loop {
        let mut next: Option<BlockKey<D>> = None;
        for cursor in &mut cursors {
            if let Some(key) = cursor.peek()? {
                next = Some(next.map_or(key, |least| least.min(key)));
            }
        }
        let Some(key) = next else { return parts.finish(writer) };
        let mut sum = SumBrick::<K>::zero(block_cells::<D>());
        for cursor in &mut cursors {
            if let Some(more) = cursor.take(key)
                && !(sum.add(&more, cursor.sign) && sum.is_possible())
            {
                let block = key.0.to_vec();
                let path = cursor.container.path().into();
                return Err(IoError::Ledger { path, cause: LedgerError::Sums { block } });
            }
        }
        parts.push(key, &sum, writer)?;
    }
}

/// The bricks of a map of sums in a file, in ascending order.
struct Cursor<'a, const D: usize, const K: usize> {
    container: &'a Container,
    tag: &'static str,
    sign: Sign,
    part: usize,
    bricks: VecDeque<(BlockKey<D>, SumBrick<K>)>,
    last: Option<BlockKey<D>>,
}

impl<const D: usize, const K: usize> Cursor<'_, D, K> {
    /// The key of the next brick; `None`: there is none.
    fn peek(&mut self) -> Result<Option<BlockKey<D>>> {
        while self.bricks.is_empty() {
            if !self.read_part()? {
                return Ok(None);
            }
        }
        Ok(self.bricks.front().map(|(key, _)| *key))
    }

    /// The next brick, if it has this key.
    fn take(&mut self, key: BlockKey<D>) -> Option<SumBrick<K>> {
        let is_next = self.bricks.front().is_some_and(|(next, _)| *next == key);
        if is_next { self.bricks.pop_front().map(|(_, brick)| brick) } else { None }
    }

    /// Reads the next part; `false`: there is none.
    fn read_part(&mut self) -> Result<bool> {
        let get = |name: &str| self.container.get(self.tag, &part_name(name, self.part));
        let Some(keys) = get("keys")? else { return Ok(false) };
        let (Some(widths), Some(sums)) = (get("width")?, get("sums")?) else { return Err(self.uneven()) };
        let cells = block_cells::<D>();
        if keys.len() != 4 * D * widths.len() {
            return Err(self.uneven());
        }
        let mut rest = &sums[..];
        for (bytes, &width) in keys.chunks_exact(4 * D).zip(&widths) {
            let number = |k: usize| i32::from_le_bytes(std::array::from_fn(|i| bytes[4 * k + i]));
            let key = BlockKey(std::array::from_fn(number));
            let ascends = self.last.is_none_or(|last| last < key);
            let fits = bytes_of::<K>(width, cells).is_some_and(|length| length <= rest.len());
            let Some(made) = (ascends && fits).then(|| brick::<K>(&mut rest, width, cells)).flatten() else {
                let (field, tag) = (format!("brick {:?}", key.0), shown(self.tag));
                let value = format!("damaged in chunk {tag}");
                return Err(IoError::binary(self.container.path(), 32, field, value, AGAIN));
            };
            self.last = Some(key);
            self.bricks.push_back((key, made));
        }
        self.part += 1;
        if rest.is_empty() { Ok(true) } else { Err(self.uneven()) }
    }

    fn uneven(&self) -> IoError {
        let field = format!("the division of chunk {} into parts", shown(self.tag));
        IoError::binary(self.container.path(), 32, field, "uneven", AGAIN)
    }
}
