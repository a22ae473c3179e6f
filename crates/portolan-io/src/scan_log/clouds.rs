//! A folder of clouds, one a scan, with a file of poses; a folder of clouds that are in the world's frame already; a single
//! cloud.
//!
//! Which poses: those of `--poses`, else those of the only file in the folder whose name speaks of poses (`pose`, `traj`,
//! `groundtruth`, `odom`). Without either, PCD files with viewpoints that differ are taken as **points in the world's frame
//! seen from the viewpoint**: that is how the Point Cloud Library means it. `--pose-convention world-from-sensor` declares them to be in the sensor's frame
//! and that the viewpoints are its poses. What is assumed is checked on a few scans: where the other reading
//! fits at least twice as well, opening fails with that advice.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use portolan::geom::Pose;
use portolan::geom::vector::norm;

use super::ScanLogOptions;
use super::agreement::{Placed, disagreement};
use super::cloud_frames::{CloudFrames, Rays};
use super::files::{has_extension, has_name, names_in, number_in};
use super::hidden::{FUSED_FROM, hidden_share};
use super::matching::contradiction;
use super::parts::{LayoutPoses, Parts, ScanId};
use super::scanner;
use crate::pcd::read_viewpoint;
use crate::points::{PointCloudFile, PointFormat, Viewpoint, has_poses, point_format, read_points_as};
use crate::poses3::{PoseConvention, RawPose, TimedPoses, TrackPose, read_poses_3d};
use crate::{IoError, Result};

/// The endings of clouds, in the order in which they are tried where a folder has as many of one as of another.
const ENDINGS: [(&str, PointFormat); 13] = [
    ("pcd", PointFormat::Pcd),
    ("ply", PointFormat::Ply),
    ("bin", PointFormat::KittiBin),
    ("e57", PointFormat::E57),
    ("ptx", PointFormat::Ptx),
    ("las", PointFormat::Las),
    ("laz", PointFormat::Las),
    ("xyz", PointFormat::Xyz),
    ("xyzi", PointFormat::Xyz),
    ("xyzrgb", PointFormat::Xyz),
    ("xyzn", PointFormat::Xyz),
    ("pts", PointFormat::Xyz),
    ("asc", PointFormat::Xyz),
];
/// Endings of many kinds of files: clouds only where the caller chooses that format.
const TEXT_ENDINGS: [(&str, PointFormat); 3] =
    [("csv", PointFormat::Xyz), ("txt", PointFormat::Xyz), ("dat", PointFormat::Xyz)];
/// Folders below that clouds may be in.
const FOLDERS: [&str; 6] = ["pcd", "scans", "clouds", "lidar", "points", "velodyne"];
/// What a file of poses is called.
const POSE_WORDS: [&str; 4] = ["pose", "traj", "groundtruth", "odom"];
const POSE_ENDINGS: [&str; 6] = ["txt", "csv", "tum", "log", "freiburg", "kitti"];
/// How many scans are read to check what viewpoints mean.
const LOOKED_AT: usize = 12;

pub(super) fn is_it(path: &Path) -> bool {
    if path.is_file() {
        return is_cloud(path);
    }
    folder_of(path, &ENDINGS).is_some()
}

/// Whether a file is a cloud, and neither a mesh nor any data with such an ending.
fn is_cloud(path: &Path) -> bool {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    match ending_of(name) {
        Some((_, PointFormat::Ply)) => !crate::ply::has_faces(path),
        Some((_, PointFormat::Ptx)) => !head_of(path).contains(&0),
        Some((_, PointFormat::KittiBin)) => crate::kitti_bin::may_be_scan(path),
        Some(_) => true,
        // Endings that many things have.
        None => {
            let head = head_of(path);
            let is_known =
                head.starts_with(crate::e57_file::MAGIC) || head.starts_with(crate::las_file::MAGIC);
            is_known
                || ["txt", "csv", "dat"].iter().any(|e| name.contains(&format!(".{e}")))
                    && crate::xyz::may_be_points(path)
        }
    }
}

fn head_of(path: &Path) -> Vec<u8> {
    crate::bytes::open(path).and_then(|mut input| input.read_up_to(4096)).unwrap_or_default()
}

/// The ending of a file of points, `.gz` and `.bz2` behind it aside.
fn ending_of(name: &str) -> Option<(&'static str, PointFormat)> {
    ending_among(&ENDINGS, name)
}

fn ending_among(endings: &[(&'static str, PointFormat)], name: &str) -> Option<(&'static str, PointFormat)> {
    let packed = ["gz", "bz2"].iter().find(|e| has_extension(name, e));
    let name = packed.map_or(name, |e| &name[..name.len() - e.len() - 1]);
    endings.iter().copied().find(|(ending, _)| has_extension(name, ending))
}

/// The folder with clouds: this one or one below.
fn folder_of(path: &Path, endings: &[(&'static str, PointFormat)]) -> Option<PathBuf> {
    let has_clouds = |folder: &Path| has_name(folder, |name| is_one_of(endings, name));
    if has_clouds(path) {
        return Some(path.into());
    }
    FOLDERS.iter().map(|name| path.join(name)).find(|folder| has_clouds(folder))
}

pub(super) fn open(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    if path.is_file() {
        return open_file(path, options);
    }
    let asked = options.format.is_some();
    let endings = if asked && folder_of(path, &ENDINGS).is_none() { &TEXT_ENDINGS[..] } else { &ENDINGS[..] };
    let Some(folder) = folder_of(path, endings) else {
        let advice = "give a folder of .pcd, .ply, .bin or .xyz files";
        return Err(IoError::layout(path, "the number of clouds", "0", advice));
    };
    let found = clouds_in(&folder, endings)?;
    let files = found.names.iter().map(|name| folder.join(name)).collect();
    let mut parts = in_folder(path, &folder, files, found.format, options)?;
    parts.stats.warnings.extend(found.others);
    Ok(parts)
}

fn in_folder(
    path: &Path,
    folder: &Path,
    files: Vec<PathBuf>,
    format: PointFormat,
    options: &ScanLogOptions,
) -> Result<Parts> {
    if has_poses(format) {
        return scanner::open(path, &files, format, options);
    }
    if format == PointFormat::Las && options.origin.is_none() {
        return survey(path, files, options);
    }
    let pose_file = match &options.poses {
        Some(_) => None,
        None => pose_file(path, folder)?,
    };
    let (poses, rays) = match (&options.poses, pose_file) {
        // The caller's poses replace these.
        (Some(_), _) => (LayoutPoses::Missing(String::new()), from_zero(&files, options)),
        (None, Some(file)) => (LayoutPoses::File(read_poses_3d(file)?), from_zero(&files, options)),
        (None, None) => viewpoints(&files, format, options)?,
    };
    let source = CloudFrames::new(files.clone(), Some(format), rays)?;
    let scan = |file: &PathBuf| {
        let name = file.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        ScanId { path: file.clone(), number: number_in(name), time: time_in(name) }
    };
    Ok(parts(path, source, files.iter().map(scan).collect(), poses))
}

fn parts(path: &Path, source: CloudFrames, scans: Vec<ScanId>, poses: LayoutPoses) -> Parts {
    let posed_from_sensor = source.files_from_frames();
    Parts { posed_from_sensor, ..Parts::new(path, source, scans, poses) }
}

/// A single cloud: at the pose of `--poses`, else where it is, seen from `--origin`, the viewpoint or zero.
fn open_file(path: &Path, options: &ScanLogOptions) -> Result<Parts> {
    let by_name = path.file_name().and_then(|n| ending_of(n.to_str()?)).map(|(_, format)| format);
    let format = by_name.or_else(|| point_format(path, &head_of(path)));
    let files = vec![path.to_owned()];
    match format {
        Some(format) if has_poses(format) => return scanner::open(path, &files, format, options),
        Some(PointFormat::Las) if options.origin.is_none() => return survey(path, files, options),
        _ => {}
    }
    let (poses, rays) = match format {
        Some(PointFormat::Pcd) if options.poses.is_none() => viewpoints(&files, PointFormat::Pcd, options)?,
        _ => (in_place(&files), from_zero(&files, options)),
    };
    // Neither the file nor the caller says where it was seen from.
    let has_viewpoint = format == Some(PointFormat::Pcd) && !matches!(poses, LayoutPoses::Missing(_));
    let is_assumed = !has_viewpoint && options.origin.is_none() && options.poses.is_none();
    // Who wants no rays has no use for what speaks against them.
    let is_assumed = is_assumed && !options.points_only;
    let poses = if matches!(poses, LayoutPoses::Missing(_)) { in_place(&files) } else { poses };
    let rays = options.origin.map_or(rays, |origin| Rays::From(vec![origin]));
    let mut source = CloudFrames::new(files, format, rays)?;
    let mut notes = Vec::new();
    if is_assumed {
        match assumed(path, || read_points_as(path, format), source.base())? {
            Assumed::Zero(note) => notes.extend(note),
            Assumed::Nowhere(note) => {
                notes.push(note);
                source = source.without_rays();
            }
        }
    }
    let scan = ScanId { path: path.into(), number: None, time: None };
    let parts = parts(path, source, vec![scan], poses);
    Ok(Parts { stats: super::ScanLogStats { warnings: notes, ..parts.stats }, ..parts })
}

/// What is made of a cloud that does not say where it was seen from.
pub(super) enum Assumed {
    /// It was seen from zero. With what speaks against it.
    Zero(Option<String>),
    /// Nobody knows: there are no rays. Why.
    Nowhere(String),
}

/// What to do about clouds without rays.
const ADVICE: &str = "give --origin x,y,z for one scan from there, or scans with --poses";

/// Whether a cloud may have been seen from zero: not where it lies kilometers away, as surveys do. `base`: its offset.
///
/// # Errors
/// Those of reading it.
pub(super) fn assumed(
    path: &Path,
    cloud: impl FnOnce() -> Result<PointCloudFile>,
    base: [f64; 3],
) -> Result<Assumed> {
    let shown = path.display();
    if base != [0.0; 3] {
        let far = norm(base) / 1000.0;
        return Ok(Assumed::Nowhere(format!(
            "{shown} does not say where its points were seen from, and they lie {far:.0} km from 0,0,0: they are taken \
             as points without rays, so that free space stays unknown; {ADVICE}"
        )));
    }
    let cloud = cloud()?;
    let share = hidden_share(cloud.points.len(), |i| cloud.position(i), [0.0; 3]);
    // Rows and columns are those of one scan.
    Ok(Assumed::Zero(share.filter(|share| *share > FUSED_FROM && cloud.grid.is_none()).map(|share| {
        format!(
            "{shown} looks like a fused map and not like one scan: seen from 0,0,0, which is assumed, {:.0} % of its \
             points lie behind others, and rays from there free what nobody looked through; give --points-only to \
             insert its points without rays, or {}",
            100.0 * share,
            &ADVICE["give ".len()..]
        )
    })))
}

/// Clouds of a survey, which say nothing of the scanner: points without rays, or seen along the caller's poses.
fn survey(path: &Path, files: Vec<PathBuf>, options: &ScanLogOptions) -> Result<Parts> {
    let mut notes = Vec::new();
    let rays = way_of_scanner(options, &mut notes)?;
    if matches!(rays, Rays::Unknown) && !options.points_only {
        notes.push(format!(
            "{}: LAS does not say where points were seen from: they are taken as points without rays, so that free space \
             stays unknown; give --poses FILE with the scanner's poses at the points' GPS times, or --origin x,y,z",
            path.display()
        ));
    }
    if let Some(file) = files.iter().find(|file| crate::las_file::is_in_feet(file)) {
        notes.push(format!(
            "{} says that its coordinates are feet: every length here counts them as meters (--resolution 1 is one foot); \
             convert the file to meters to mix it with others",
            file.display()
        ));
    }
    let uses_named_poses = !matches!(rays, Rays::Unknown);
    let source = CloudFrames::new(files.clone(), Some(PointFormat::Las), rays)?;
    let poses = in_place(&files);
    let scan = |file: &PathBuf| ScanId { path: file.clone(), number: None, time: None };
    let parts = parts(path, source, files.iter().map(scan).collect(), poses);
    Ok(Parts { stats: super::ScanLogStats { warnings: notes, ..parts.stats }, uses_named_poses, ..parts })
}

/// Where the scanner of a survey was.
fn way_of_scanner(options: &ScanLogOptions, notes: &mut Vec<String>) -> Result<Rays> {
    let Some(file) = &options.poses else { return Ok(Rays::Unknown) };
    let read = read_poses_3d(file)?;
    let mut track = Vec::new();
    let mut refused = Vec::new();
    for raw in &read.poses {
        let pose = raw.resolve(options.pose_convention.unwrap_or(PoseConvention::WorldFromSensor));
        let pose = pose.map_err(|fault| refused.push(format!("line {}: {fault}", raw.line)));
        track.push(TrackPose { pose: pose.ok().map(|(pose, _)| pose), time: raw.time, number: raw.number });
    }
    if let Some(first) = refused.first() {
        let file = read.path.display();
        notes.push(format!("{} poses of {file} could not be used (first: {first})", refused.len()));
    }
    let timed = TimedPoses::new(&track).map_err(|error| contradiction(&read.path, &error))?;
    match timed.filter(|poses| poses.span().is_some()) {
        Some(poses) => Ok(Rays::Along(Arc::new(poses), options.time_tolerance)),
        None => {
            let advice = "give poses with times (t tx ty tz qx qy qz qw): points of a LAS have GPS times";
            Err(IoError::layout(&read.path, "the times of the poses", "missing", advice))
        }
    }
}

/// Whether a file has one of the endings and is not called like poses.
fn is_one_of(endings: &[(&'static str, PointFormat)], name: &str) -> bool {
    ending_among(endings, name).is_some() && !is_poses(name)
}

/// The clouds of one kind in a folder.
struct CloudsIn {
    /// In natural order.
    names: Vec<String>,
    format: PointFormat,
    /// What is said of clouds of other kinds beside them.
    others: Option<String>,
}

/// The clouds of the most frequent ending.
fn clouds_in(folder: &Path, endings: &[(&'static str, PointFormat)]) -> Result<CloudsIn> {
    let names = names_in(folder, |name| is_one_of(endings, name))?;
    let ending = |name: &String| ending_among(endings, name).map(|(ending, _)| ending);
    let count = |wanted: &str| names.iter().filter(|n| ending(n) == Some(wanted)).count();
    // The first of equals wins: the order of endings.
    let mut best = endings[0];
    for candidate in endings {
        if count(candidate.0) > count(best.0) {
            best = *candidate;
        }
    }
    let (wanted, other): (Vec<String>, Vec<String>) =
        names.into_iter().partition(|name| ending_among(endings, name).map(|(e, _)| e) == Some(best.0));
    let others = other.first().map(|first| {
        format!(
            "{} files of {} are of another kind than its {} files *.{}, and were left out (first: {first})",
            other.len(),
            folder.display(),
            wanted.len(),
            best.0
        )
    });
    Ok(CloudsIn { names: wanted, format: best.1, others })
}

fn is_poses(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    POSE_ENDINGS.iter().any(|e| has_extension(name, e)) && POSE_WORDS.iter().any(|w| lower.contains(w))
}

/// The time that a name is: seconds with a dot (`1630577758.569.pcd`), sixteen digits of microseconds or nineteen of
/// nanoseconds.
fn time_in(name: &str) -> Option<f64> {
    let ending = ending_of(name).or_else(|| ending_among(&TEXT_ENDINGS, name))?.0;
    let stem = name.get(..name.rfind(ending)?)?.strip_suffix('.')?;
    if !stem.bytes().all(|b| b.is_ascii_digit() || b == b'.') {
        return None;
    }
    let unit = match (stem.contains('.'), stem.len()) {
        (true, _) => 1.0,
        (false, 16) => 1e-6,
        (false, 19) => 1e-9,
        _ => return None,
    };
    stem.parse::<f64>().ok().map(|t| t * unit)
}

/// The only file that is called like poses, in the log's folder or that of its scans.
fn pose_file(path: &Path, folder: &Path) -> Result<Option<PathBuf>> {
    for place in [path, folder] {
        let names = names_in(place, is_poses)?;
        match &names[..] {
            [] => {}
            [one] => return Ok(Some(place.join(one))),
            _ => {
                let advice = "name the one with --poses";
                return Err(IoError::layout(place, "the pose file", names.join(" or "), advice));
            }
        }
    }
    Ok(None)
}

/// Rays from the zero of the sensor's frame, or from the caller's origin.
fn from_zero(files: &[PathBuf], options: &ScanLogOptions) -> Rays {
    Rays::From(vec![options.origin.unwrap_or([0.0; 3]); files.len()])
}

/// Clouds where they are.
fn in_place(files: &[PathBuf]) -> LayoutPoses {
    let unmoved = RawPose::new(Pose::<3>::IDENTITY.rotation, [0.0; 3], 1);
    LayoutPoses::PerScan(files.iter().map(|file| Some((file.clone(), unmoved.clone()))).collect())
}

/// The poses that the viewpoints of PCD files give, in a folder without pose files.
fn viewpoints(
    files: &[PathBuf],
    format: PointFormat,
    options: &ScanLogOptions,
) -> Result<(LayoutPoses, Rays)> {
    let missing = || {
        let endings = POSE_ENDINGS.join(", ");
        let looked =
            format!("a file with \"pose\", \"traj\", \"groundtruth\" or \"odom\" in its name ({endings})");
        (LayoutPoses::Missing(looked), from_zero(files, options))
    };
    if format != PointFormat::Pcd {
        return Ok(missing());
    }
    let mut found: Vec<Result<Option<Viewpoint>>> = files.iter().map(|f| read_viewpoint(f)).collect();
    let Some(good) = found.iter().find_map(|read| read.as_ref().ok().copied()) else {
        return found.pop().map_or_else(|| Ok(missing()), |damaged| damaged.map(|_| missing()));
    };
    // A file that cannot be read is a scan less: whoever asks for it is told. Until then it may be anywhere.
    let found = found.into_iter().map(|read| read.unwrap_or(good));
    let Some(all) = found.collect::<Option<Vec<Viewpoint>>>() else { return Ok(missing()) };
    let all_equal = all.windows(2).all(|w| w[0] == w[1]);
    if all_equal && (all.len() > 1 || all.first() == Some(&Viewpoint::NONE)) {
        return Ok(missing());
    }
    if options.pose_convention.is_some() {
        let raw = |(file, v): (&PathBuf, &Viewpoint)| {
            Some((file.clone(), RawPose::from_quaternion(v.position, v.quaternion, 1)))
        };
        return Ok((
            LayoutPoses::PerScan(files.iter().zip(&all).map(raw).collect()),
            from_zero(files, options),
        ));
    }
    check_viewpoints(files, &all)?;
    Ok((in_place(files), Rays::From(all.iter().map(|v| v.position).collect())))
}

/// Fails where scans agree much better when viewpoints are applied as poses.
fn check_viewpoints(files: &[PathBuf], viewpoints: &[Viewpoint]) -> Result<()> {
    let (mut in_place, mut moved) = (Vec::new(), Vec::new());
    for i in (0..files.len()).step_by(files.len().div_ceil(LOOKED_AT).max(1)) {
        let Ok(cloud) = read_points_as(&files[i], None) else { continue };
        let Some(pose) = viewpoints[i].pose() else { return Ok(()) };
        let (count, position) = (cloud.points.len(), pose.translation);
        in_place.push(Placed::thinned(count, |k| cloud.position(k), position));
        moved.push(Placed::thinned(count, |k| pose.transform_point(cloud.position(k)), position));
    }
    if let (Some(unmoved), Some(posed)) = (disagreement(&in_place), disagreement(&moved))
        && unmoved > 2.0 * posed
    {
        let value = format!(
            "{unmoved:.3} m between scans taken as points of the world's frame, {posed:.3} m with viewpoints as poses"
        );
        let advice = "give --pose-convention world-from-sensor to apply the viewpoints, or --poses";
        let folder = files[0].parent().unwrap_or(Path::new("."));
        return Err(IoError::layout(folder, "the median distance", value, advice));
    }
    Ok(())
}
