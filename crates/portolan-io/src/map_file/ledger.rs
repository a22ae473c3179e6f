//! A ledger in chunks: its settings, its scans, its sums.

use portolan::Ledger;
use portolan::cell::{
    ColorSum, DISTANCE_STEPS, DistanceSum, HitLengthSum, HitMissSum, LENGTH_UNITS, OccupancyModel, SumBrick,
    SumCell, WEIGHT_UNITS,
};
use portolan::geom::{Aabb, BlockKey, Lattice, Pose, block_cells};
use portolan::ledger::{LedgerScans, LedgerSums, ScanRecord};
use portolan::mapper::MapperSettings;
use portolan::store::Bricks;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::part_name;
use super::reading::{AGAIN, Reading};
use super::settings::{Model, sweep_of, sweep_word, weights_of, weights_word};
use crate::error::shown;
use crate::{ContainerWriter, Result};

/// The field of the header.
pub(super) const FIELD: &str = "ledger";
/// Sums are cut into chunks of so many bricks, so that a reader needs no more in memory than one of them.
const BRICKS_PER_PART: usize = 1024;
/// What a brick takes beside its sums (bytes).
const BRICK_OVERHEAD: u64 = 112;

const SCANS: &str = "SCANS";
pub(super) const OCCUPANCY: &str = "OSUMS";
pub(super) const DISTANCES: &str = "TSUMS";
pub(super) const COLORS: &str = "CSUMS";
pub(super) const ATTENUATION: &str = "ASUMS";

/// What the header says of a ledger: all that shapes its sums.
#[derive(Serialize, Deserialize)]
struct Settings {
    origin: Vec<f64>,
    resolution: f64,
    truncation: f64,
    carve: bool,
    carve_weight: f32,
    weights: String,
    sweep: String,
    exact: bool,
    bounds: Option<[Vec<f64>; 2]>,
    /// `None`: no occupancy.
    model: Option<ModelOf>,
    distances: bool,
    /// Not written where there are none: as files were before there could be any.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    color: bool,
    attenuation: bool,
    distance_steps: i32,
    weight_units: i32,
    length_units: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct ModelOf(#[serde(with = "Model")] OccupancyModel);

/// The field of the header for a ledger with these settings.
pub(super) fn header<const D: usize>(s: &MapperSettings<D>) -> serde_json::Result<Value> {
    serde_json::to_value(Settings {
        origin: s.origin.unwrap_or([0.0; D]).to_vec(),
        resolution: s.resolution,
        truncation: s.truncation(),
        carve: s.carve,
        carve_weight: s.carve_weight,
        weights: weights_word(s.weights).into(),
        sweep: sweep_word(s.beams).into(),
        exact: s.exact,
        bounds: s.bounds.map(|b| [b.min.to_vec(), b.max.to_vec()]),
        model: s.occupancy.map(ModelOf),
        distances: s.distances,
        color: s.color,
        attenuation: s.attenuation.is_some(),
        distance_steps: DISTANCE_STEPS,
        weight_units: WEIGHT_UNITS,
        length_units: LENGTH_UNITS,
    })
}

/// Writes scans and sums. Bricks without any observation are left out, numbers are as narrow as they can be, everything is
/// in order: equal ledgers make the same bytes.
pub(super) fn write<const D: usize>(ledger: &Ledger<D>, writer: &mut ContainerWriter) -> Result<()> {
    write_scans(ledger.scans(), writer)?;
    if let Some(sums) = ledger.occupancy_sums() {
        write_sums(writer, OCCUPANCY, sums)?;
    }
    if let Some(sums) = ledger.distance_sums() {
        write_sums(writer, DISTANCES, sums)?;
    }
    if let Some(sums) = ledger.color_sums() {
        write_sums(writer, COLORS, sums)?;
    }
    if let Some(sums) = ledger.attenuation_sums() {
        write_sums(writer, ATTENUATION, sums)?;
    }
    Ok(())
}

pub(super) fn write_scans<const D: usize>(
    scans: &LedgerScans<D>,
    writer: &mut ContainerWriter,
) -> Result<()> {
    let of = |log: &str| scans.iter().filter(|(name, ..)| *name == log).count();
    let logs: Vec<Value> = scans.logs().map(|log| json!([log, of(log)])).collect();
    writer.chunk(SCANS, "logs", json!(logs).to_string().as_bytes())?;
    let words = |word: fn(u64, &ScanRecord<D>) -> u64| -> Vec<u8> {
        scans.iter().flat_map(|(_, index, record)| word(index, record).to_le_bytes()).collect()
    };
    writer.chunk(SCANS, "index", &words(|index, _| index))?;
    writer.chunk(SCANS, "readings", &words(|_, record| record.fingerprint))?;
    let poses: Vec<Pose<D>> = scans.iter().map(|(_, _, record)| record.world_from_sensor).collect();
    writer.chunk(SCANS, "sensor", &super::write::pose_bytes(&poses))
}

fn write_sums<C, const D: usize, const K: usize>(
    writer: &mut ContainerWriter,
    tag: &str,
    sums: &Bricks<C, D>,
) -> Result<()>
where
    C: SumCell<Brick = SumBrick<K>>,
{
    let mut parts = SumParts::new(tag);
    for key in sums.keys() {
        if let Some(brick) = sums.brick(key) {
            parts.push(key, brick, writer)?;
        }
    }
    parts.finish(writer)
}

/// The chunks of a map of sums, written as bricks come, in ascending order.
pub(super) struct SumParts<'a> {
    tag: &'a str,
    part: usize,
    bricks: usize,
    keys: Vec<u8>,
    widths: Vec<u8>,
    sums: Vec<u8>,
}

impl<'a> SumParts<'a> {
    pub(super) fn new(tag: &'a str) -> Self {
        let [keys, widths, sums] = Default::default();
        Self { tag, part: 0, bricks: 0, keys, widths, sums }
    }

    /// Adds a brick; one without any observation is left out.
    pub(super) fn push<const D: usize, const K: usize>(
        &mut self,
        key: BlockKey<D>,
        brick: &SumBrick<K>,
        writer: &mut ContainerWriter,
    ) -> Result<()> {
        let brick = brick.narrowest();
        match brick.all_alike() {
            Some(sums) if sums == [0; K] => return Ok(()),
            Some(sums) => {
                self.widths.push(0);
                self.sums.extend(sums.iter().flat_map(|v| v.to_le_bytes()));
            }
            None => {
                let width = brick.width().bytes();
                self.widths.push(width as u8);
                brick.planes().iter().for_each(|v| self.sums.extend(&v.to_le_bytes()[..width]));
            }
        }
        self.keys.extend(key.0.iter().flat_map(|v| v.to_le_bytes()));
        self.bricks += 1;
        if self.bricks == BRICKS_PER_PART { self.write(writer) } else { Ok(()) }
    }

    /// Writes what is left.
    pub(super) fn finish(mut self, writer: &mut ContainerWriter) -> Result<()> {
        if self.bricks > 0 || self.part == 0 { self.write(writer) } else { Ok(()) }
    }

    fn write(&mut self, writer: &mut ContainerWriter) -> Result<()> {
        let planes = [("keys", &mut self.keys), ("width", &mut self.widths), ("sums", &mut self.sums)];
        for (name, bytes) in planes {
            writer.chunk(self.tag, &part_name(name, self.part), bytes)?;
            bytes.clear();
        }
        self.part += 1;
        self.bricks = 0;
        Ok(())
    }
}

impl Reading<'_> {
    /// The ledger of a file; `None`: it has none.
    pub(super) fn ledger<const D: usize>(&mut self, field: Option<Value>) -> Result<Option<Ledger<D>>> {
        let Some(field) = field else { return Ok(None) };
        let settings = self.ledger_settings::<D>(field)?;
        let lattice = Lattice::new(settings.origin.unwrap_or([0.0; D]), settings.resolution);
        let scans = self.scans()?;
        let sums = LedgerSums {
            occupancy: some_if(settings.occupancy.is_some(), || {
                self.sums::<HitMissSum, D, 2>(OCCUPANCY, lattice)
            })?,
            distances: some_if(settings.distances, || self.sums::<DistanceSum, D, 2>(DISTANCES, lattice))?,
            colors: some_if(settings.color, || self.sums::<ColorSum, D, 4>(COLORS, lattice))?,
            attenuation: some_if(settings.attenuation.is_some(), || {
                self.sums::<HitLengthSum, D, 3>(ATTENUATION, lattice)
            })?,
        };
        let made = Ledger::from_parts(settings, scans, sums);
        self.possible(FIELD, made).map(Some)
    }

    /// What the header says of a ledger.
    pub(super) fn ledger_settings<const D: usize>(&self, field: Value) -> Result<MapperSettings<D>> {
        let s: Settings = self.typed(FIELD, field)?;
        let units = (s.distance_steps, s.weight_units, s.length_units);
        if units != (DISTANCE_STEPS, WEIGHT_UNITS, LENGTH_UNITS) {
            let advice = format!("this program reads {DISTANCE_STEPS}, {WEIGHT_UNITS}, {LENGTH_UNITS}");
            return Err(self.bad("the units of the ledger", format!("{units:?}"), advice));
        }
        let lattice: Lattice<D> = self.lattice_of(FIELD, &s.origin, s.resolution)?;
        let point = |v: &[f64]| <[f64; D]>::try_from(v).ok().filter(|v| v.iter().all(|v| v.is_finite()));
        let bounds = match s.bounds.as_ref().map(|[min, max]| (point(min), point(max))) {
            None => None,
            Some((Some(min), Some(max))) => Some(Aabb { min, max }),
            Some(_) => return Err(self.bad("the bounds of the ledger", "not a box", AGAIN)),
        };
        Ok(MapperSettings::<D> {
            origin: Some(lattice.origin),
            truncation: Some(s.truncation),
            w_max: f32::INFINITY,
            carve: s.carve,
            carve_weight: s.carve_weight,
            weights: self.chosen(FIELD, "weight model", &s.weights, weights_of)?,
            beams: self.chosen(FIELD, "sweep", &s.sweep, sweep_of)?,
            exact: s.exact,
            occupancy: s.model.map(|model| model.0),
            attenuation: s.attenuation.then(Default::default),
            distances: s.distances,
            color: s.color,
            bounds,
            ..MapperSettings::new(s.resolution)
        })
    }

    /// The list of scans.
    pub(super) fn scans<const D: usize>(&mut self) -> Result<LedgerScans<D>> {
        let text = self.plane(SCANS, "logs", self.length(SCANS, "logs"))?;
        let logs: Vec<(String, u64)> = serde_json::from_slice(&text)
            .map_err(|e| self.bad("the list of logs", shown(e.to_string()), AGAIN))?;
        let total = logs.iter().try_fold(0u64, |sum, (_, count)| sum.checked_add(*count));
        let fits = |n: &u64| n.checked_mul(8 * (D * D + D) as u64).is_some_and(|bytes| bytes < 1 << 40);
        let Some(count) = total.filter(fits) else {
            return Err(self.bad("the number of scans", "too large", AGAIN));
        };
        let word = |bytes: &[u8], i: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
        let indices = self.plane(SCANS, "index", 8 * count)?;
        let readings = self.plane(SCANS, "readings", 8 * count)?;
        let poses = self.poses_of::<D>(SCANS, 8 * count * (D * D + D) as u64)?;
        let mut scans = LedgerScans::default();
        let names = logs.iter().flat_map(|(log, count)| (0..*count).map(move |_| log));
        for (i, (log, pose)) in names.zip(poses).enumerate() {
            let record = ScanRecord { world_from_sensor: pose, fingerprint: word(&readings, i) };
            if !scans.insert(log, word(&indices, i), record) {
                return Err(self.bad(format!("scan {i} of {}", shown(log)), "there twice", AGAIN));
            }
        }
        Ok(scans)
    }

    fn sums<C, const D: usize, const K: usize>(
        &mut self,
        tag: &str,
        lattice: Lattice<D>,
    ) -> Result<Bricks<C, D>>
    where
        C: SumCell<Brick = SumBrick<K>>,
    {
        let keys: Vec<BlockKey<D>> = self.keys(tag, BRICK_OVERHEAD)?;
        let widths = self.plane(tag, "width", keys.len() as u64)?;
        let cells = block_cells::<D>();
        let mut lengths = Vec::with_capacity(widths.len());
        for (i, &width) in widths.iter().enumerate() {
            let Some(length) = bytes_of::<K>(width, cells) else {
                let field = format!("width {i} of chunk {tag}");
                return Err(self.bad(field, width, "it must be 0, 2, 4 or 8"));
            };
            lengths.push(length);
        }
        let all = lengths.iter().map(|&l| l as u64).sum();
        let mut store = Bricks::new(lattice);
        let mut bricks = keys.iter().zip(&widths).zip(&lengths).peekable();
        for part in self.parts_of_length(tag, "sums", all)? {
            let content = self.unpack(part)?;
            let mut rest = &content[..];
            while let Some(((key, &width), _)) = bricks.next_if(|(_, length)| **length <= rest.len()) {
                let Some(brick) = brick::<K>(&mut rest, width, cells) else {
                    let field = format!("a sum of brick {:?} in chunk {tag}", key.0);
                    return Err(self.bad(field, "further than 2^62 from zero", AGAIN));
                };
                let stored = store.insert(*key, brick);
                self.possible(FIELD, stored)?;
            }
            if !rest.is_empty() {
                return Err(self.uneven(tag));
            }
        }
        if bricks.next().is_some() { Err(self.uneven(tag)) } else { Ok(store) }
    }
}

/// A part that is there if the settings say so.
fn some_if<T>(there: bool, read: impl FnOnce() -> Result<T>) -> Result<Option<T>> {
    if there { read().map(Some) } else { Ok(None) }
}

/// Bytes of a brick's sums in this width; `None`: there is no such width.
pub(super) fn bytes_of<const K: usize>(width: u8, cells: usize) -> Option<usize> {
    match width {
        0 => Some(8 * K),
        2 | 4 | 8 => Some(K * cells * usize::from(width)),
        _ => None,
    }
}

/// The next brick of a part, which is long enough; `None`: a number is too large.
pub(super) fn brick<const K: usize>(rest: &mut &[u8], width: u8, cells: usize) -> Option<SumBrick<K>> {
    let number = |bytes: &[u8]| {
        // The sign goes on into the bytes that are not there.
        let fill = if bytes.last().is_some_and(|b| b & 0x80 != 0) { 0xff } else { 0 };
        i64::from_le_bytes(std::array::from_fn(|k| bytes.get(k).copied().unwrap_or(fill)))
    };
    if width == 0 {
        let (own, others) = rest.split_at(8 * K);
        *rest = others;
        let sums: Vec<i64> = own.chunks_exact(8).map(number).collect();
        let possible = SumBrick::<K>::of_planes(&sums)?;
        return Some(SumBrick::alike(possible.at(0), cells));
    }
    let (own, others) = rest.split_at(K * cells * usize::from(width));
    *rest = others;
    SumBrick::of_planes(&own.chunks_exact(usize::from(width)).map(number).collect::<Vec<_>>())
}
