//! Depth images as scans, with the camera and the colors that belong to them.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use portolan::scan::{Pinhole, RangeImage};
use portolan_ros::container::MessageRef;
use portolan_ros::message::{CameraInfo, Compressed, CompressedImage, Header, Image, MessageKind};

use super::contents::Decoders;
use super::frames::ScanMessage;
use super::{BagLogStats, Contents};
use crate::scan_log::{
    Camera, CameraFrom, Distortion, ScanLogOptions, decode_color, decode_depth, decode_gray16, given_camera,
    nearest_in_time,
};
use crate::{IoError, Result};

/// Units of depth that a whole number of a meter has, as ROS has it (REP 118).
const UNITS_PER_METRE: f64 = 1000.0;

/// How the pictures of a bag are read.
#[derive(Default)]
pub(super) struct Pictures {
    cameras: BTreeMap<u32, Camera>,
    units_per_metre: f64,
    /// Color pictures by their stamps (seconds), by the topic of the depth they belong to.
    colors: BTreeMap<u32, ColorTopic>,
    tolerance: f64,
    sources: Mutex<Sources>,
}

/// The pixels of pictures without distortion in those of the lens, by topic and size.
type Sources = BTreeMap<(u32, [usize; 2]), Option<Arc<[Option<u32>]>>>;

struct ColorTopic {
    decoders: Decoders,
    stamped: Vec<(f64, MessageRef)>,
}

/// Depth in meters.
struct Depth {
    columns: usize,
    rows: usize,
    values: Vec<f32>,
}

impl Pictures {
    /// Finds the camera of each topic with depth, and the colors that are registered to it.
    pub(super) fn new(
        contents: &Contents,
        names: &[String],
        scans: &[ScanMessage],
        decoders: &Decoders,
        options: &ScanLogOptions,
        stats: &mut BagLogStats,
    ) -> Result<Self> {
        let other_camera = [
            (options.color_intrinsics.is_some() || options.color_distortion.is_some(), "--color-intrinsics"),
            (options.color_from_depth.is_some(), "--color-from-depth"),
            (options.scale_intrinsics, "--scale-intrinsics"),
        ];
        if let Some((_, option)) = other_camera.iter().find(|(given, _)| *given) {
            let advice = "in a bag colors are those that are registered to the depth images; leave it out";
            return Err(IoError::layout(&contents.path, "the option", *option, advice));
        }
        let units_per_metre = options.depth_scale.unwrap_or(UNITS_PER_METRE);
        let mut pictures = Self { units_per_metre, tolerance: options.time_tolerance, ..Self::default() };
        for name in names {
            for number in contents.numbers(name) {
                let is_picture =
                    matches!(contents.kind(number), Some(MessageKind::Image | MessageKind::CompressedImage));
                let Some(first) = scans.iter().find(|s| s.message.topic == number).filter(|_| is_picture)
                else {
                    continue;
                };
                let depth = pictures.depth(contents, decoders, first)?;
                let camera = match given_camera(options)? {
                    Some(camera) => camera,
                    None => camera_of(contents, name, &first.header, stats)?,
                };
                let camera = Camera { distortion: options.distortion.unwrap_or(camera.distortion), ..camera };
                camera.check_size(&contents.path, [depth.columns, depth.rows])?;
                pictures.cameras.insert(number, camera);
                if options.color
                    && let Some(colors) = colors_of(contents, name, &first.header, stats)?
                {
                    pictures.colors.insert(number, colors);
                }
            }
        }
        Ok(pictures)
    }

    /// The camera; the first, where there are several.
    pub(super) fn camera(&self) -> Option<&Camera> {
        self.cameras.values().next()
    }

    /// Reads a scan, and why its colors could not be read.
    pub(super) fn frame(
        &self,
        contents: &Contents,
        decoders: &Decoders,
        scan: &ScanMessage,
    ) -> Result<(RangeImage, Option<IoError>)> {
        let depth = self.depth(contents, decoders, scan)?;
        let camera = self.cameras.get(&scan.message.topic).ok_or_else(|| {
            IoError::layout(&contents.path, "the camera", "unknown", "give fx,fy,cx,cy with --intrinsics")
        })?;
        let size = [depth.columns, depth.rows];
        camera.check_size(&contents.path, size)?;
        let (colors, unread) = match self.color(contents, scan, size) {
            Ok(colors) => (colors, None),
            Err(error) => (Vec::new(), Some(error)),
        };
        let Some(sources) = self.sources(scan.message.topic, camera, size) else {
            let image = RangeImage::from_depth(camera.pinhole, depth.columns, depth.rows, depth.values);
            return Ok((image.with_colors(colors), unread));
        };
        let values: Vec<f32> = sources.iter().map(|s| s.map_or(0.0, |s| depth.values[s as usize])).collect();
        let image = RangeImage::from_depth(camera.pinhole, depth.columns, depth.rows, values);
        // Colors are registered to the depth: they are of the same lens.
        let colors = match colors.is_empty() {
            true => Vec::new(),
            false => sources.iter().map(|s| s.map(|s| colors[s as usize])).collect(),
        };
        Ok((image.with_some_colors(colors), unread))
    }

    /// Where the pixels of a picture without distortion are in one of the lens; `None` where it does not distort.
    fn sources(&self, topic: u32, camera: &Camera, size: [usize; 2]) -> Option<Arc<[Option<u32>]>> {
        let mut known = self.sources.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.entry((topic, size)).or_insert_with(|| camera.lens().sources(size).map(Into::into));
        found.clone()
    }

    fn depth(&self, contents: &Contents, decoders: &Decoders, scan: &ScanMessage) -> Result<Depth> {
        let path = &contents.path;
        let no_depth = || {
            let name = &contents.bag.topics()[scan.message.topic as usize].name;
            IoError::layout(path, format!("the pictures of {name}"), "colors", "name a topic with depth")
        };
        if contents.kind(scan.message.topic) != Some(MessageKind::CompressedImage) {
            let found = contents.read(&scan.message, decoders, |record| {
                let image = Image::of(record)?;
                Ok((image.width, image.height, image.depth(self.units_per_metre)))
            })?;
            let (columns, rows, values) = found;
            return Ok(Depth { columns, rows, values: values.ok_or_else(no_depth)? });
        }
        contents.read(&scan.message, decoders, |record| {
            let found = match CompressedImage::of(record)?.content {
                Compressed::Color(_) => Err(no_depth()),
                Compressed::DepthMillimeters(png) => decode_depth(path, png, self.units_per_metre)
                    .map(|d| Depth { columns: d.columns, rows: d.rows, values: d.values }),
                Compressed::DepthInverse(png, inverse) => {
                    decode_gray16(path, png).map(|([columns, rows], raw)| {
                        let values = raw.into_iter().map(|v| inverse.depth(v)).collect();
                        Depth { columns, rows, values }
                    })
                }
            };
            Ok(found)
        })?
    }

    /// The colors that belong to a depth image; none where there are none near in time.
    fn color(&self, contents: &Contents, scan: &ScanMessage, size: [usize; 2]) -> Result<Vec<[u8; 3]>> {
        let Some(topic) = self.colors.get(&scan.message.topic) else { return Ok(Vec::new()) };
        let time = scan.header.stamp as f64 * 1e-9;
        let Some(message) = nearest_in_time(&topic.stamped, time, self.tolerance) else {
            return Ok(Vec::new());
        };
        let path = &contents.path;
        let compressed = contents.kind(message.topic) == Some(MessageKind::CompressedImage);
        contents.read(message, &topic.decoders, |record| {
            if compressed {
                return Ok(match CompressedImage::of(record)?.content {
                    Compressed::Color(bytes) => decode_color(path, bytes, size),
                    _ => Ok(Vec::new()),
                });
            }
            let image = Image::of(record)?;
            Ok(if [image.width, image.height] == size {
                Ok(image.colors().unwrap_or_default())
            } else {
                let value = format!("{} x {}", image.width, image.height);
                let advice =
                    format!("the depth image is {} x {}; register the colors to it", size[0], size[1]);
                Err(IoError::layout(path, "the size of the color picture", value, advice))
            })
        })?
    }
}

/// The camera that the bag declares for a topic: `camera_info` beside it, else one of the same frame.
fn camera_of(contents: &Contents, name: &str, header: &Header, stats: &mut BagLogStats) -> Result<Camera> {
    let all = contents.topics_of(|kind| kind == MessageKind::CameraInfo);
    // `/camera/depth/image_rect/compressedDepth` has `/camera/depth/camera_info`.
    let beside = (0..2).scan(name, |at, _| {
        *at = at.rsplit_once('/')?.0;
        Some(format!("{at}/camera_info"))
    });
    let beside: Vec<String> = beside.filter(|n| all.iter().any(|(known, _)| known == n)).collect();
    let others = all.iter().map(|(n, _)| n.clone()).filter(|n| !beside.contains(n));
    for (i, info_name) in beside.iter().cloned().chain(others).enumerate() {
        let numbers = contents.numbers(&info_name);
        let decoders = contents.decoders(&numbers)?;
        let Some(first) = contents.bag.messages(&numbers).first().copied() else { continue };
        let Ok(info) = contents.read(&first, &decoders, CameraInfo::of) else { continue };
        if i >= beside.len() && info.header.frame != header.frame {
            continue;
        }
        let rectified = name.contains("rect");
        let p = info.p;
        let projected = (p[0] > 0.0 && p[5] > 0.0).then_some([p[0], p[5], p[2], p[6]]);
        let Some([fx, fy, cx, cy]) = (if rectified { projected } else { None }).or_else(|| info.pinhole())
        else {
            continue;
        };
        let distortion = match info.is_distorted() && !rectified {
            false => Distortion::None,
            true => Distortion::of_model(&info.distortion_model, &info.d).unwrap_or_else(|why| {
                stats.notes.push(format!("{name}: the lens distortion of {info_name} is not undone: {why}"));
                Distortion::None
            }),
        };
        if i >= beside.len() {
            stats.guesses.push(format!("the camera of {name} is {info_name}, which has the same frame"));
        }
        let pinhole = Pinhole { fx, fy, cx, cy };
        let size = (info.width > 0 && info.height > 0).then_some([info.width, info.height]);
        let from = CameraFrom::File(PathBuf::from(&info_name));
        return Ok(Camera { distortion, ..Camera::new(pinhole, from, size) });
    }
    let advice = "the bag has no CameraInfo for it; give fx,fy,cx,cy with --intrinsics";
    Err(IoError::layout(&contents.path, format!("the camera of {name}"), "unknown", advice))
}

/// The topic with colors of the same optical frame, whose pixels are therefore those of the depth.
fn colors_of(
    contents: &Contents,
    name: &str,
    header: &Header,
    stats: &mut BagLogStats,
) -> Result<Option<ColorTopic>> {
    let pictures = |kind| matches!(kind, MessageKind::Image | MessageKind::CompressedImage);
    let mut others = Vec::new();
    for (color, _) in contents.topics_of(pictures).into_iter().filter(|(n, _)| n != name) {
        let numbers = contents.numbers(&color);
        let decoders = contents.decoders(&numbers)?;
        let Some(first) = contents.bag.messages(&numbers).first().copied() else { continue };
        let compressed = contents.kind(first.topic) == Some(MessageKind::CompressedImage);
        let about = contents.read(&first, &decoders, |record| {
            let is_color = match compressed {
                true => matches!(CompressedImage::of(record)?.content, Compressed::Color(_)),
                false => !Image::of(record)?.format.is_depth(),
            };
            Ok((is_color, Header::of(record)?.frame))
        });
        match about {
            Ok((true, frame)) if frame == header.frame => {
                let mut stamped = Vec::new();
                let visited = contents.bag.for_each(&numbers, |message, bytes| {
                    let decoded = decoders
                        .find(message.topic)
                        .map(|d| d.decode(bytes).and_then(|m| Header::of(&m.record)));
                    if let Some(Ok(header)) = decoded {
                        stamped.push((header.stamp as f64 * 1e-9, message));
                    }
                    Ok::<(), portolan_ros::BagError>(())
                });
                visited.map_err(IoError::bag(&contents.path))?;
                stamped.sort_by(|a, b| a.0.total_cmp(&b.0));
                stats
                    .guesses
                    .push(format!("colors of {name} are those of {color}, which has the same frame"));
                return Ok(Some(ColorTopic { decoders, stamped }));
            }
            Ok((true, frame)) => others.push(format!("{color} (frame {frame})")),
            _ => {}
        }
    }
    if !others.is_empty() {
        stats.notes.push(format!(
            "colors are left out: {} is not registered to the depth of frame {}",
            others.join(", "),
            header.frame
        ));
    }
    Ok(None)
}
