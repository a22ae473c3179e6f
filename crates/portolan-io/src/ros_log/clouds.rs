//! Clouds and Livox messages as scans.

use std::collections::BTreeMap;

use portolan::geom::Pose;
use portolan::scan::PointScan;
use portolan_ros::message::{ColorFields, LivoxScan, MessageKind, Number, PointCloud, PointTimes, Primitive};

use super::contents::Decoders;
use super::frames::ScanMessage;
use super::{BagLogStats, Contents};
use crate::bytes::Scalar;
use crate::points::{CloudBuilder, PointCloudFile, channel};
use crate::scan_log::{ScanLogOptions, about, file_from_frames, scan_from};
use crate::{IoError, Result};

/// How many scans of a topic are looked at for the meaning of its times, until one says it.
const LOOKED_AT: usize = 8;

/// How the clouds of a bag are read.
#[derive(Default)]
pub(super) struct Clouds {
    /// How the times of points are read, by topic; none: there are none, or they have no meaning.
    times: BTreeMap<u32, PointTimes>,
    colors: bool,
    /// Where rays begin, where the caller said it.
    origin: Option<[f64; 3]>,
    /// Whole meters that are taken off every point, so that an `f32` holds clouds far from zero.
    base: [f64; 3],
}

impl Clouds {
    /// Looks at the first clouds of each topic.
    pub(super) fn new(
        contents: &Contents,
        scans: &[ScanMessage],
        decoders: &Decoders,
        options: &ScanLogOptions,
        stats: &mut BagLogStats,
    ) -> Result<Self> {
        let mut clouds = Self { colors: options.color, origin: options.origin, ..Self::default() };
        let mut of_topic: BTreeMap<u32, Vec<&ScanMessage>> = BTreeMap::new();
        for scan in scans {
            of_topic.entry(scan.message.topic).or_default().push(scan);
        }
        let mut based = false;
        for (number, scans) in of_topic {
            let name = &contents.bag.topics()[number as usize].name;
            match contents.kind(number) {
                Some(MessageKind::Livox) => {
                    let words = format!("{name}: offset_time in nanoseconds after the stamp");
                    add_words(&mut stats.point_times, words);
                    continue;
                }
                Some(MessageKind::PointCloud2) => {}
                _ => continue,
            }
            let period = period_of(&scans);
            let mut why = None;
            for scan in scans.iter().take(LOOKED_AT) {
                let (found, offset) = contents.read(&scan.message, decoders, |record| {
                    let cloud = PointCloud::of(record)?;
                    let offset = build(&cloud, None, false).map(|c| (c.offset, c.points.is_empty()));
                    Ok((PointTimes::infer(&cloud, period), offset))
                })?;
                match offset {
                    Ok((offset, false)) if !based => (clouds.base, based) = (offset, true),
                    Ok(_) => {}
                    Err(missing) => {
                        return Err(IoError::layout(
                            &contents.path,
                            name,
                            missing,
                            "it is no cloud of points",
                        ));
                    }
                }
                match found {
                    None => {}
                    Some(Ok(times)) => {
                        add_words(&mut stats.point_times, format!("{name}: {}", times.describe()));
                        clouds.times.insert(number, times);
                        why = None;
                    }
                    Some(Err(reason)) => why = Some(reason),
                }
                if clouds.times.contains_key(&number) && based {
                    break;
                }
            }
            stats.notes.extend(why.map(|reason| format!("{name}: {reason}: not used")));
        }
        Ok(clouds)
    }

    /// What leads from the frames' points to the messages': the offset. `None` where they are the same.
    pub(super) fn files_from_frames(&self) -> Option<Pose<3>> {
        file_from_frames(self.base)
    }

    /// Where rays begin in the frame of a scan's points (meters).
    pub(super) fn origin(&self, scan: &ScanMessage) -> [f64; 3] {
        let origin = self.origin.or(scan.origin).unwrap_or([0.0; 3]);
        std::array::from_fn(|k| origin[k] - self.base[k])
    }

    /// Reads a scan.
    pub(super) fn frame(
        &self,
        contents: &Contents,
        decoders: &Decoders,
        scan: &ScanMessage,
    ) -> Result<PointScan> {
        let cloud = if contents.kind(scan.message.topic) == Some(MessageKind::Livox) {
            livox(&contents.read(&scan.message, decoders, LivoxScan::of)?, scan.header.stamp)
        } else {
            let times = self.times.get(&scan.message.topic);
            let built = contents.read(&scan.message, decoders, |record| {
                let cloud = PointCloud::of(record)?;
                let seconds = times.map(|t| {
                    let stamp = scan.header.stamp as f64 * 1e-9;
                    t.after_stamp(&cloud).into_iter().map(|s| stamp + s).collect::<Vec<f64>>()
                });
                Ok(build(&cloud, seconds, self.colors))
            })?;
            built.map_err(|missing| {
                IoError::layout(&contents.path, "a cloud", missing, "it is no cloud of points")
            })?
        };
        let origin = self.origin.or(scan.origin).unwrap_or([0.0; 3]);
        Ok(scan_from(about(cloud, self.base, &contents.path)?, origin))
    }
}

fn add_words(all: &mut Option<String>, words: String) {
    *all = Some(match all.take() {
        Some(before) => format!("{before}; {words}"),
        None => words,
    });
}

/// How far scans are apart (seconds): the median.
fn period_of(scans: &[&ScanMessage]) -> Option<f64> {
    let stamps = scans.windows(2).map(|w| (w[1].header.stamp - w[0].header.stamp) as f64 * 1e-9);
    let mut all: Vec<f64> = stamps.filter(|s| *s > 0.0).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// The points of a message; `Err` has what is missing. `seconds`: the time of each (seconds of the clock of stamps).
fn build(cloud: &PointCloud<'_>, seconds: Option<Vec<f64>>, colors: bool) -> Result<PointCloudFile, String> {
    let Some(position) = cloud.position() else {
        let names: Vec<&str> = cloud.fields.iter().map(|f| &*f.name).collect();
        return Err(format!("without x, y, z (it has {})", names.join(", ")));
    };
    let fine = position.iter().any(|f| f.kind.size() > 4 || (f.kind.is_integer() && f.kind.size() == 4));
    let mut builder = CloudBuilder::new(fine);
    if cloud.height > 1 && cloud.width > 1 && u32::try_from(cloud.len()).is_ok() {
        builder.organize(cloud.width, cloud.height);
    }
    let intensity = cloud.field(&["intensity", "intensities", "reflectivity", "i"]);
    let ring = cloud.field(&["ring", "line", "channel", "laser_id"]);
    let color = cloud.color().filter(|_| colors);
    let seconds = seconds.filter(|s| s.len() == cloud.len());
    for (i, point) in cloud.points().enumerate() {
        if !builder.push(i, position.map(|f| f.read(point).to_f64())) {
            continue;
        }
        builder.cloud.intensity.extend(intensity.map(|f| f.read(point).to_f64() as f32));
        builder.cloud.rings.extend(ring.map(|f| f.read(point).to_f64() as u16));
        builder.times.extend(seconds.as_ref().map(|s| s[i]));
        match &color {
            None => {}
            Some(ColorFields::Packed(field)) => {
                let Number::Integer(bits) = field.read(point) else { continue };
                builder.cloud.colors.push([(bits >> 16) as u8, (bits >> 8) as u8, bits as u8]);
            }
            Some(ColorFields::Separate(all)) => {
                let byte = |k: usize| channel(all[k].read(point).to_f64(), scalar(all[k].kind));
                builder.cloud.colors.push([byte(0), byte(1), byte(2)]);
            }
        }
    }
    Ok(builder.finish())
}

fn scalar(kind: Primitive) -> Scalar {
    match kind {
        Primitive::F32 => Scalar::F32,
        Primitive::F64 => Scalar::F64,
        Primitive::U16 => Scalar::U16,
        _ => Scalar::U8,
    }
}

fn livox(scan: &LivoxScan, stamp: i64) -> PointCloudFile {
    let mut builder = CloudBuilder::new(false);
    let start = stamp as f64 * 1e-9;
    for (i, point) in scan.points.iter().enumerate() {
        if builder.push(i, point.position.map(f64::from)) {
            builder.cloud.intensity.push(point.reflectivity.into());
            builder.cloud.rings.push(point.line.into());
            builder.times.push(start + 1e-9 * f64::from(point.offset_time));
        }
    }
    builder.finish()
}
