//! E57 (ASTM E2807), the format that terrestrial scanners exchange: several scans in one file, each with its pose, most of
//! them with rows and columns.
//!
//! Cartesian and spherical coordinates; points that the file calls invalid are pixels without a reading. Pictures are not
//! read; [`E57About::images`] counts them. Points are in the scan's own frame, whose zero is the scanner.

use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordName};

use crate::bytes::{Compression, Input, open_file, u64_at};
use crate::points::{CloudBuilder, CloudGrid, PosedCloud, most_bytes};
use crate::poses3::RawPose;
use crate::{IoError, Result};

/// The first bytes of every file.
pub(crate) const MAGIC: &[u8] = b"ASTM-E57";
/// The most pixels of a grid for each point: rows and columns of scattered points are none.
const MOST_EMPTY: u64 = 64;
/// The most bytes of a page (usually 1024), of the file's description, and the most points of a scan.
const MOST_PAGE: u64 = 1 << 20;
const MOST_XML: u64 = 1 << 26;
const MOST_POINTS: u64 = 1 << 30;

/// What can be read and jumped about in.
pub(crate) trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

/// An open file.
pub(crate) struct E57File {
    reader: E57Reader<Box<dyn ReadSeek>>,
    scans: Vec<PointCloud>,
    path: std::path::PathBuf,
}

/// What a file holds, without its points.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct E57About {
    /// Scans.
    pub scans: usize,
    /// Pictures, which are not read.
    pub images: usize,
    /// Scans that say when they were taken, or when each point was. Times are not used: a scan is of one place, whatever is between
    /// two of them is no motion of the scanner, and their clock is that of GPS, which poses are not in.
    pub with_times: usize,
    /// Scans with colors.
    pub with_colors: usize,
    /// Scans with colors that call those of some points invalid: these points are black.
    pub with_invalid_colors: usize,
}

impl E57File {
    /// Opens a file, plain or packed.
    ///
    /// # Errors
    /// [`IoError::Layout`] where it is not E57, damaged, or without a point.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = open_file(path)?;
        let mut reader = BufReader::with_capacity(1 << 16, file);
        let mut head = [0; 3];
        let read = reader.read(&mut head).map_err(|e| IoError::os(path, "read it", e))?;
        if Compression::of(&head[..read]) != Compression::Plain {
            return Self::parse(crate::bytes::open(path)?);
        }
        reader.rewind().map_err(|e| IoError::os(path, "read it", e))?;
        Self::of(Box::new(reader), path)
    }

    /// [`E57File::open`] from any input, all of which is kept in memory.
    pub(crate) fn parse(mut input: Input) -> Result<Self> {
        let bytes = input.read_all(most_bytes(&input))?;
        Self::of(Box::new(Cursor::new(bytes)), input.path())
    }

    fn of(mut reader: Box<dyn ReadSeek>, path: &Path) -> Result<Self> {
        check_header(&mut reader, path)?;
        let reader = E57Reader::new(reader).map_err(|e| damaged(path, &e))?;
        let scans = reader.pointclouds();
        let most = reader_length(&reader);
        for (i, scan) in scans.iter().enumerate() {
            if scan.records > MOST_POINTS.min(most.saturating_mul(8)) {
                let field = format!("the number of points of scan {i}");
                let advice = "a file of this length cannot hold them: copy or export it again";
                return Err(IoError::layout(path, field, scan.records, advice));
            }
        }
        if scans.iter().all(|scan| scan.records == 0) {
            let advice = format!("the file has {} scans; give one with points", scans.len());
            return Err(IoError::layout(path, "the number of points", 0, advice));
        }
        Ok(Self { reader, scans, path: path.into() })
    }

    pub(crate) fn about(&self) -> E57About {
        let count = |is: &dyn Fn(&PointCloud) -> bool| self.scans.iter().filter(|scan| is(scan)).count();
        let has_invalid =
            |scan: &PointCloud| scan.prototype.iter().any(|r| r.name == RecordName::IsColorInvalid);
        E57About {
            scans: self.scans.len(),
            images: self.reader.images().len(),
            with_times: count(&|scan| scan.has_timestamp() || scan.acquisition_start.is_some()),
            with_colors: count(&PointCloud::has_color),
            with_invalid_colors: count(&|scan| scan.has_color() && has_invalid(scan)),
        }
    }

    /// Number of scans.
    pub(crate) fn len(&self) -> usize {
        self.scans.len()
    }

    /// Scan `i`, or its first `most` points.
    ///
    /// # Errors
    /// [`IoError::Layout`] where its data is damaged.
    pub(crate) fn scan(&mut self, i: usize, most: usize) -> Result<PosedCloud> {
        let about = &self.scans[i];
        let pose = about.transform.as_ref().map(|t| {
            let (q, at) = (&t.rotation, &t.translation);
            RawPose::from_quaternion([at.x, at.y, at.z], [q.x, q.y, q.z, q.w], 0)
        });
        let (origin, name) = (pose.as_ref().map(|_| [0.0; 3]), about.name.clone());
        // A scan without points has no data to be opened.
        let cloud = if about.records == 0 {
            CloudBuilder::new(true).finish()
        } else {
            let path = &self.path;
            read(&mut self.reader, about, most).map_err(|e| in_scan(path, i, &e))?
        };
        Ok(PosedCloud { cloud, file_from_scan: pose, origin, name })
    }
}

/// Bytes of the file's data, at least as many as points can be in.
fn reader_length(reader: &E57Reader<Box<dyn ReadSeek>>) -> u64 {
    reader.header().phys_length
}

/// The lengths in the header are checked before the library takes memory for them.
fn check_header(reader: &mut Box<dyn ReadSeek>, path: &Path) -> Result<()> {
    let os = |e| IoError::os(path, "read it", e);
    let length = reader.seek(SeekFrom::End(0)).map_err(os)?;
    reader.rewind().map_err(os)?;
    let mut head = Vec::new();
    reader.by_ref().take(48).read_to_end(&mut head).map_err(os)?;
    reader.rewind().map_err(os)?;
    if !head.starts_with(MAGIC) {
        let value = crate::error::shown(&head[..head.len().min(8)]);
        return Err(IoError::binary(path, 0, "the start of the file", value, "give an E57 file"));
    }
    let field = |at: usize| if head.len() >= 48 { u64_at(&head, at) } else { u64::MAX };
    for (at, name, most) in [
        (16, "the length of the file by its header", length),
        (24, "the place of the description", length),
        (32, "the length of the description", length.min(MOST_XML)),
        (40, "the length of a page", length.min(MOST_PAGE)),
    ] {
        let value = field(at);
        if value > most {
            let value = if head.len() < 48 { "missing".to_owned() } else { value.to_string() };
            let advice = format!("the file has {length} bytes: it is cut off or damaged, copy it again");
            return Err(IoError::binary(path, at as u64, name, value, advice));
        }
    }
    Ok(())
}

fn read(
    reader: &mut E57Reader<Box<dyn ReadSeek>>,
    about: &PointCloud,
    most: usize,
) -> e57::Result<crate::PointCloudFile> {
    let mut points = reader.pointcloud_simple(about)?;
    points.apply_pose(false);
    points.spherical_to_cartesian(true);
    points.intensity_to_color(false);
    points.normalize_intensity(false);
    let mut builder = CloudBuilder::new(true);
    let mut places = Vec::new();
    for point in points.take(most) {
        let point = point?;
        let CartesianCoordinate::Valid { x, y, z } = point.cartesian else {
            builder.cloud.refused.no_reading += 1;
            continue;
        };
        if !builder.push(0, [x, y, z]) {
            continue;
        }
        if about.has_intensity() {
            builder.cloud.intensity.push(point.intensity.unwrap_or(0.0));
        }
        if about.has_color() {
            let byte = |v: f32| (255.0 * v).round() as u8;
            builder.cloud.colors.push(point.color.map_or([0; 3], |c| [c.red, c.green, c.blue].map(byte)));
        }
        if about.has_row_column() {
            places.push([point.column, point.row]);
        }
    }
    let mut cloud = builder.finish();
    cloud.grid = grid(&places, cloud.points.len());
    Ok(cloud)
}

/// The rows and columns of points, each with a pixel of its own; `None` where they are none.
fn grid(places: &[[i64; 2]], points: usize) -> Option<CloudGrid> {
    let first = [0, 1].map(|k| places.iter().map(|p| p[k]).min());
    let last = [0, 1].map(|k| places.iter().map(|p| p[k]).max());
    let edge = |k: usize| last[k]?.checked_sub(first[k]?)?.checked_add(1).map(|n| n as u64);
    let (columns, rows) = (edge(0)?, edge(1)?);
    let size = columns.checked_mul(rows)?;
    if columns < 2 || rows < 2 || size > MOST_EMPTY * points as u64 || size > u64::from(u32::MAX) {
        return None;
    }
    let pixel = |p: &[i64; 2]| {
        ((p[1] - first[1].unwrap_or(0)) as u64 * columns + (p[0] - first[0].unwrap_or(0)) as u64) as u32
    };
    let pixels: Vec<u32> = places.iter().map(pixel).collect();
    // Several echoes of one pixel are no image.
    let mut taken = vec![false; size as usize];
    let own = pixels.iter().all(|p| !std::mem::replace(&mut taken[*p as usize], true));
    own.then_some(CloudGrid { columns: columns as usize, rows: rows as usize, pixels })
}

/// An error of the library on one line.
fn words(error: &e57::Error) -> String {
    error.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(400).collect()
}

const ADVICE: &str = "the file is damaged, cut off or of a kind that is not read: copy or export it again";

fn damaged(path: &Path, error: &e57::Error) -> IoError {
    IoError::layout(path, "the E57 data", format!("not readable: {}", words(error)), ADVICE)
}

fn in_scan(path: &Path, i: usize, error: &e57::Error) -> IoError {
    let field = format!("the data of scan {i}");
    IoError::layout(path, field, format!("not readable: {}", words(error)), ADVICE)
}

/// How many scans and pictures an E57 file has.
///
/// # Errors
/// [`IoError::Layout`], [`IoError::Binary`] or [`IoError::Os`] where it cannot be read, or has no points.
pub fn e57_about(path: impl AsRef<Path>) -> Result<E57About> {
    Ok(E57File::open(path.as_ref())?.about())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{bad_bytes, real_data, says};
    use e57::{DateTime, E57Writer, Quaternion, Record, RecordDataType, RecordValue, Transform, Translation};

    const DOUBLE: RecordDataType = RecordDataType::Double { min: None, max: None };

    /// A file with a scan of 4 columns and 3 rows, one pixel invalid, turned by 90 degrees about z and moved; spherical or
    /// Cartesian.
    fn bytes(spherical: bool) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut file, "file").unwrap();
        let names = match spherical {
            true => {
                [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation]
            }
            false => [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ],
        };
        let state =
            if spherical { RecordName::SphericalInvalidState } else { RecordName::CartesianInvalidState };
        let mut prototype: Vec<Record> =
            names.into_iter().map(|name| Record { name, data_type: DOUBLE }).collect();
        let whole = |max| RecordDataType::Integer { min: 0, max };
        prototype.push(Record { name: state, data_type: whole(2) });
        prototype.push(Record { name: RecordName::RowIndex, data_type: whole(2) });
        prototype.push(Record { name: RecordName::ColumnIndex, data_type: whole(3) });
        let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        scan.set_transform(Some(Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 500_000.0, y: 20.0, z: 3.0 },
        }));
        for (row, column) in (0..3i64).flat_map(|row| (0..4i64).map(move |column| (row, column))) {
            let (range, az, el) = (2.0 + row as f64, 0.1 * column as f64, 0.2 * row as f64);
            let at = [range * el.cos() * az.cos(), range * el.cos() * az.sin(), range * el.sin()];
            let place = if spherical { [range, az, el] } else { at };
            let invalid = if (row, column) == (1, 2) { 2 } else { 0 };
            let mut values: Vec<_> = place.map(RecordValue::Double).into();
            values.extend([invalid, row, column].map(RecordValue::Integer));
            scan.add_point(values).unwrap();
        }
        scan.finalize().unwrap();
        writer.finalize().unwrap();
        drop(writer);
        file.into_inner()
    }

    fn read_bytes(bytes: Vec<u8>) -> Result<Vec<PosedCloud>> {
        let mut file = E57File::parse(Input::from_reader(Cursor::new(bytes), "a.e57".as_ref())?)?;
        (0..file.len()).map(|i| file.scan(i, usize::MAX)).collect()
    }

    #[test]
    fn spherical_and_cartesian_are_the_same_scan_with_its_pose_and_pixels() {
        let [plain, angles] = [false, true].map(|spherical| read_bytes(bytes(spherical)).unwrap().remove(0));
        for scan in [&plain, &angles] {
            assert_eq!((scan.cloud.points.len(), scan.cloud.refused.no_reading), (11, 1));
            let grid = scan.cloud.grid.as_ref().unwrap();
            assert_eq!((grid.columns, grid.rows, grid.pixels[6]), (4, 3, 7));
            assert_eq!((scan.origin, scan.cloud.offset), (Some([0.0; 3]), [0.0; 3]));
        }
        for (a, b) in plain.cloud.points.iter().zip(&angles.cloud.points) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-6));
        }
        let moved = plain.in_file().unwrap();
        assert_eq!(moved.offset, [500_000.0, 20.0, 3.0]);
        let p = moved.position(1);
        let want = [500_000.0 - 2.0 * 0.1f64.sin(), 20.0 + 2.0 * 0.1f64.cos(), 3.0];
        assert!((0..3).all(|k| (p[k] - want[k]).abs() < 1e-6), "{p:?}");
    }

    #[test]
    fn colors_are_read_and_what_is_not_used_is_counted() {
        let mut file = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut file, "file").unwrap();
        let whole = |max| RecordDataType::Integer { min: 0, max };
        for times in [false, true] {
            let xyz = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
            let rgb = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
            let mut prototype: Vec<_> = xyz.map(|name| Record { name, data_type: DOUBLE }).into();
            prototype.extend(rgb.map(|name| Record { name, data_type: whole(255) }));
            if times {
                prototype.push(Record { name: RecordName::IsColorInvalid, data_type: whole(1) });
                prototype.push(Record { name: RecordName::TimeStamp, data_type: DOUBLE });
            }
            let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
            // Eight: the library cannot read a packet in which a column of single bits ends no byte.
            for i in 0..8i64 {
                let mut values = [1.0 + i as f64, 2.0, 3.0].map(RecordValue::Double).to_vec();
                values.extend([255 - i, 7, 9].map(RecordValue::Integer));
                if times {
                    let invalid = i64::from(i == 2);
                    values.extend([RecordValue::Integer(invalid), RecordValue::Double(i as f64)]);
                }
                scan.add_point(values).unwrap();
            }
            if times {
                scan.set_acquisition_start(Some(DateTime { gps_time: 1e9, atomic_reference: false }));
            }
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
        drop(writer);
        let (_folder, path) = crate::testing::temporary("a.e57");
        std::fs::write(&path, file.into_inner()).unwrap();
        let about = e57_about(&path).unwrap();
        assert_eq!(
            (about.scans, about.with_times, about.with_colors, about.with_invalid_colors),
            (2, 1, 2, 1)
        );
        let log = crate::scan_log::ScanLog::open(&path, &Default::default()).unwrap();
        let colors = |i: usize| match log.frame(i).unwrap() {
            portolan::scan::Frame::Points(scan) => scan.colors,
            portolan::scan::Frame::Image(_) => panic!("points"),
        };
        assert_eq!(colors(0)[..3], [[255, 7, 9], [254, 7, 9], [253, 7, 9]]);
        assert_eq!(colors(1)[..4], [[255, 7, 9], [254, 7, 9], [0; 3], [252, 7, 9]]);
        let warnings = log.stats().warnings.join("\n");
        assert!(warnings.contains("1 of 2 scans in") && warnings.contains("have times, which are not used"));
        assert!(warnings.contains("1 of 2 scans with colors in"), "{warnings}");
    }

    #[test]
    fn scattered_rows_and_columns_and_echoes_are_no_grid() {
        assert_eq!(grid(&[[0, 0], [1, 1], [1_000_000, 3_000_000]], 3), None);
        assert_eq!(grid(&[[0, 0], [1, 1], [1, 1]], 3), None);
        assert_eq!(grid(&[[i64::MIN, 0], [i64::MAX, 1]], 2), None);
        assert_eq!(grid(&[[5, 7], [6, 8]], 2).unwrap().pixels, [0, 3]);
    }

    #[test]
    fn cut_and_hostile_files_are_refused_in_one_line() {
        says(read_bytes(Vec::new()), "a.e57: byte 0: the start of the file is missing; give an E57 file");
        says(read_bytes(MAGIC.to_vec()), "the length of the file by its header is missing");
        let good = bytes(false);
        says(read_bytes(good[..good.len() - 1024].to_vec()), "it is cut off or damaged");
        // The pages have checksums: a changed byte is found.
        let mut changed = good.clone();
        changed[300] ^= 1;
        says(read_bytes(changed), "not readable");
        for bytes in bad_bytes(&good, 41, 300) {
            if let Err(e) = read_bytes(bytes) {
                assert!(!e.to_string().contains('\n'), "{e}");
            }
        }
    }

    /// Gives every whole page the checksum that it should have.
    fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
        for page in bytes.chunks_exact_mut(1024) {
            let sum = crc32c::crc32c(&page[..1020]);
            page[1020..].copy_from_slice(&sum.to_be_bytes());
        }
        bytes
    }

    #[test]
    fn hostile_bytes_behind_right_checksums_make_no_panic() {
        for spherical in [false, true] {
            let good = bytes(spherical);
            assert_eq!(with_checksums(good.clone()), good);
            for bytes in bad_bytes(&good, 43, 3000) {
                if let Err(e) = read_bytes(with_checksums(bytes)) {
                    assert!(!e.to_string().contains('\n'), "{e}");
                }
            }
        }
        // Points that take no bytes: as many as the file says would be a trap.
        let text = String::from_utf8_lossy(&bytes(false)).into_owned();
        assert!(text.contains("recordCount=\"12\""));
        let at = bytes(false).windows(16).position(|w| w == b"recordCount=\"12\"").unwrap();
        let mut many = bytes(false);
        many[at..at + 16].copy_from_slice(b"recordCount=\"9e\"");
        assert!(read_bytes(with_checksums(many)).is_err());
    }

    #[test]
    fn files_of_others() {
        let scans = |name: &str| {
            let path = real_data(&format!("e57_las_ptx/{name}"))?;
            let mut file = match E57File::open(&path) {
                Ok(file) => file,
                Err(e) => return Some(Err(e)),
            };
            Some((0..file.len()).map(|i| file.scan(i, usize::MAX)).collect::<Result<Vec<_>>>())
        };
        // Number and mean by pye57.
        for (name, points, mean, colored) in [
            ("bunnyInt19.e57", 30_571, [-0.027_512_78, 0.103_078_04, 0.008_643_62], false),
            ("tinyCartesianFloatRgb.e57", 2090, [-8.044_144_66, 6.012_533_22, 297.002_203_65], true),
            ("translationWithoutRotation.e57", 4, [0.5, 0.5, 0.0], false),
        ] {
            let Some(scans) = scans(name) else { continue };
            let scan = scans.unwrap().remove(0);
            assert_eq!((scan.cloud.points.len(), !scan.cloud.colors.is_empty()), (points, colored), "{name}");
            for k in 0..3 {
                let sum: f64 = (0..points).map(|i| scan.cloud.position(i)[k]).sum();
                assert!((sum / points as f64 - mean[k]).abs() < 1e-5, "{name}");
            }
        }
        if let Some(Ok(scans)) = scans("translationWithoutRotation.e57") {
            assert_eq!(scans[0].clone().in_file().unwrap().position(0), [4.0, 5.0, 6.0]);
        }
        if let Some(scans) = scans("tiny_spherical.e57") {
            let cloud = scans.unwrap().remove(0).cloud;
            assert_eq!(cloud.points.len() as u64 + cloud.refused.no_reading, 360);
            assert!(
                cloud.points.iter().all(|p| (p.iter().map(|v| v * v).sum::<f32>().sqrt() - 1.0).abs() < 1e-3)
            );
        }
        if let Some(damaged) = scans("corrupt_crc.e57") {
            says(damaged, "the E57 data is not readable: Failed to read E57");
        }
        if let Some(empty) = scans("empty_pc.e57") {
            says(empty, "the number of points is 0; the file has 1 scans");
        }
    }
}
