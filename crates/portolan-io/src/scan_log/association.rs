//! Association files, as the tools around TUM's data set write them, of any name: each line pairs a depth image with a color picture.
//!
//! | words of a line | from |
//! |---|---|
//! | `t rgb/a.png t depth/b.png` and the other way round | `associate.py`, ORB-SLAM, ICL-NUIM |
//! | these, then `tx ty tz qx qy qz qw` or `t tx ty tz qx qy qz qw`, or the pose first | `associate.py` with `groundtruth.txt` |
//! | `rgb/a.png depth/b.png`, with one time before them or none, perhaps with a pose | scripts of all kinds |
//!
//! All lines have the words of the first. The depth image is the one whose file or folder is called so, else the one that is 16-bit gray.

use std::path::{Path, PathBuf};

use super::depth_png::depth_image_size;
use super::files::{has_extension, names_in};
use crate::bytes::{Lines, number_words, open as open_input, parse_f64};
use crate::error::shown;
use crate::poses3::RawPose;
use crate::{IoError, Result};

/// How many files of a folder are looked into.
const LOOKED_INTO: usize = 256;
/// How much of each (bytes).
const HEAD: u64 = 16 << 10;
/// The most lines of a file.
const MOST_LINES: usize = 1 << 21;
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];
/// Endings of what is never a list.
const NO_LISTS: [&str; 16] = [
    "png", "jpg", "jpeg", "pgm", "tif", "pcd", "ply", "bin", "npy", "npz", "bag", "mcap", "db3", "zip",
    "e57", "laz",
];

/// A file that pairs pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Association {
    pub(super) path: PathBuf,
    words: Words,
    /// The depth image is the second of the two pictures.
    depth_second: bool,
}

/// A line of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pair {
    /// The time of the depth image (seconds).
    pub(super) time: Option<f64>,
    pub(super) depth: PathBuf,
    pub(super) color: PathBuf,
    pub(super) pose: Option<RawPose>,
}

/// Where the words of a line are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Words {
    /// Times of the first and of the second picture.
    times: [Option<usize>; 2],
    pictures: [usize; 2],
    /// `tx ty tz qx qy qz qw`.
    pose: Option<usize>,
    pose_time: Option<usize>,
    count: usize,
}

impl Words {
    /// The words of a line; `None` where they are no pair of pictures, with times and poses or not.
    fn of(line: &[u8]) -> Option<Self> {
        let is_picture: Vec<bool> = number_words(line).take(32).map(is_picture).collect();
        let at: Vec<usize> = (0..is_picture.len()).filter(|i| is_picture[*i]).collect();
        let &[first, second] = at.as_slice() else { return None };
        // Numbers before the first picture, between the two, and behind the second.
        let [before, between, behind] = [first, second - first - 1, is_picture.len() - second - 1];
        let own = between;
        let pose = match (before.checked_sub(own), behind) {
            (Some(0), 0) => None,
            (Some(count @ (7 | 8)), 0) => Some((0, count)),
            (Some(0), count @ (7 | 8)) => Some((second + 1, count)),
            // One time before both pictures.
            (Some(1), 0) if own == 0 => None,
            (Some(1), count @ (7 | 8)) if own == 0 => Some((second + 1, count)),
            _ => return None,
        };
        let times = match (own, before) {
            (1, _) => [Some(first - 1), Some(second - 1)],
            (0, 1) => [Some(0), Some(0)],
            (0, _) => [None, None],
            _ => return None,
        };
        let numbers = number_words(line).zip(&is_picture).filter(|(_, is)| !**is);
        if !numbers.into_iter().all(|(word, _)| parse_f64(word).is_some()) {
            return None;
        }
        let pose_time = pose.filter(|(_, count)| *count == 8).map(|(at, _)| at);
        let pose = pose.map(|(at, count)| at + count - 7);
        Some(Self { times, pictures: [first, second], pose, pose_time, count: is_picture.len() })
    }
}

fn is_picture(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|name| PICTURES.iter().any(|ending| has_extension(name, ending)))
}

impl Association {
    /// Looks at the beginning of a file; `None` where it is none, or does not say which picture is the depth image.
    pub(super) fn in_file(path: &Path) -> Option<Self> {
        let head = open_input(path).ok()?.read_up_to(HEAD).ok()?;
        if head.contains(&0) {
            return None;
        }
        let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
        let mut lines = head.split(|b| *b == b'\n').map(<[u8]>::trim_ascii).filter(|line| has_content(line));
        let first = lines.next()?;
        // A line of names, as tables have it.
        let line = if is_header(first) { lines.next()? } else { first };
        let words = Words::of(line)?;
        let pictures = words.pictures.map(|at| word_at(line, at));
        let depth_second = match pictures.map(is_called_depth) {
            [first, second] if first != second => second,
            _ => {
                let folder = path.parent().unwrap_or(Path::new("."));
                let is_depth = |name: &str| depth_image_size(&place(folder, name)).is_ok();
                match pictures.map(is_depth) {
                    [first, second] if first != second => second,
                    _ => return None,
                }
            }
        };
        Some(Self { path: path.into(), words, depth_second })
    }

    /// All in a folder, in the order of their names; of a folder of many files, the first are looked into.
    pub(super) fn all_in(folder: &Path) -> Vec<Self> {
        let may_be = |name: &str| !NO_LISTS.iter().any(|ending| has_extension(name, ending));
        let names = names_in(folder, may_be).unwrap_or_default();
        let files = names.iter().map(|name| folder.join(name)).filter(|file| file.is_file());
        files.take(LOOKED_INTO).filter_map(|file| Self::in_file(&file)).collect()
    }

    pub(super) fn has_poses(&self) -> bool {
        self.words.pose.is_some()
    }

    /// Whether its poses have times of their own.
    pub(super) fn has_times_of_poses(&self) -> bool {
        self.words.pose_time.is_some()
    }

    /// All lines of the file, in its order.
    ///
    /// # Errors
    /// [`IoError::Text`] for a line of other words than the first.
    pub(super) fn read(&self) -> Result<Vec<Pair>> {
        let path = &self.path;
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut lines = Lines::of(open_input(path)?);
        let mut pairs = Vec::new();
        let mut is_first = true;
        while let Some((number, line)) = lines.next_numbered()? {
            let line = line.trim_ascii();
            if !has_content(line) || std::mem::take(&mut is_first) && is_header(line) {
                continue;
            }
            if Words::of(line) != Some(self.words) {
                let advice = format!("give {} words in the order of the lines before", self.words.count);
                return Err(IoError::text(path, number, "the line", shown(line), advice));
            }
            let all: Vec<&[u8]> = number_words(line).collect();
            let names = self.words.pictures.map(|at| word_at(line, at));
            let [color, depth] = if self.depth_second { [0, 1] } else { [1, 0] };
            if is_called_depth(names[color]) && !is_called_depth(names[depth]) {
                let advice = "give the depth image in the place where the lines before have it";
                return Err(IoError::text(path, number, "the color picture", names[color], advice));
            }
            let value = |at: usize| parse_f64(all[at]).unwrap_or(f64::NAN);
            let finite = |at: Option<usize>| {
                let Some(at) = at else { return Ok(None) };
                match value(at) {
                    // Zero has no sign.
                    time if time.is_finite() => Ok(Some(time + 0.0)),
                    _ => Err(IoError::text(path, number, "the time", shown(all[at]), "write seconds")),
                }
            };
            let time = finite(self.words.times[depth])?;
            let pose_time = finite(self.words.pose_time)?;
            let pose = self.words.pose.map(|at| {
                let v: [f64; 7] = std::array::from_fn(|k| value(at + k));
                let pose = RawPose::from_quaternion([v[0], v[1], v[2]], [v[3], v[4], v[5], v[6]], number);
                RawPose { time: pose_time, ..pose }
            });
            IoError::unless_full(path, number, pairs.len(), MOST_LINES, "lines", "file")?;
            let [depth, color] = [depth, color].map(|k| place(folder, names[k]));
            pairs.push(Pair { time, depth, color, pose });
        }
        Ok(pairs)
    }
}

fn has_content(line: &[u8]) -> bool {
    !line.is_empty() && !line.starts_with(b"#")
}

/// Whether a line has no number and no picture.
fn is_header(line: &[u8]) -> bool {
    !number_words(line).any(|word| is_picture(word) || parse_f64(word).is_some())
}

fn word_at(line: &[u8], at: usize) -> &str {
    number_words(line).nth(at).and_then(|word| std::str::from_utf8(word).ok()).unwrap_or("")
}

/// Whether the file or its folder is called so.
fn is_called_depth(name: &str) -> bool {
    name.rsplit(['/', '\\']).take(2).any(|part| part.to_ascii_lowercase().contains("depth"))
}

/// Where a picture is: below the folder, also where the file has the whole path that it had on another machine.
fn place(folder: &Path, name: &str) -> PathBuf {
    let file = folder.join(name);
    let parts: Vec<&str> = name.split(['/', '\\']).collect();
    if file.is_file() || parts.len() < 2 {
        return file;
    }
    let here = folder.join(parts[parts.len() - 2]).join(parts[parts.len() - 1]);
    if here.is_file() { here } else { file }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_log::testing::*;
    use crate::scan_log::{ScanLog, ScanLogKind, ScanLogOptions};
    use crate::testing::{bad_bytes, says};

    /// `rgb/i.png` and `depth/i.png` for `i` below 4, with a file of their camera.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for i in 0..4 {
            write_depth(&folder.path().join(format!("depth/{i}.png")), i, 5000.0);
            write_color(&folder.path().join(format!("rgb/{i}.png")), [i as u8, 0, 0]);
        }
        write(&folder.path().join("calibration.txt"), SMALL_CAMERA.map(|v| v.to_string()).join(" "));
        folder
    }

    fn lines(line: impl Fn(usize) -> String) -> String {
        (0..4).map(|i| line(i) + "\n").collect()
    }

    fn open(path: &Path) -> Result<ScanLog> {
        ScanLog::open(path, &ScanLogOptions::default())
    }

    fn truth() -> String {
        lines(|i| format!("{i} {}", quaternion_text(i)))
    }

    #[test]
    fn every_variant_is_the_same_log_under_any_name() {
        let variants: [(&str, String, bool); 9] = [
            ("both times", lines(|i| format!("{i}.004 rgb/{i}.png {i} depth/{i}.png")), false),
            ("depth first", lines(|i| format!("{i} depth/{i}.png {i}.004 rgb/{i}.png")), false),
            (
                "commas",
                "t,color,t,depth\n".to_owned() + &lines(|i| format!("{i},rgb/{i}.png,{i},depth/{i}.png")),
                false,
            ),
            ("pose", lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png {}", quaternion_text(i))), true),
            (
                "posed at",
                lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png {i} {}", quaternion_text(i))),
                true,
            ),
            (
                "pose first",
                lines(|i| format!("{i} {} {i} depth/{i}.png {i} rgb/{i}.png", quaternion_text(i))),
                true,
            ),
            ("no times", lines(|i| format!("rgb/{i}.png depth/{i}.png {}", quaternion_text(i))), true),
            ("one time", lines(|i| format!("{i} rgb/{i}.png depth/{i}.png {}", quaternion_text(i))), true),
            (
                "elsewhere",
                lines(|i| format!("/home/me/d/rgb/{i}.png /d/depth/{i}.png {}", quaternion_text(i))),
                true,
            ),
        ];
        for (what, text, has_poses) in variants {
            for name in ["associations.txt", "fr1_assoc", "my list.csv"] {
                let folder = folder();
                if !has_poses {
                    write(&folder.path().join("groundtruth.txt"), truth());
                }
                // A comment, the last picture first, and a list of other things beside it.
                let mut reversed: Vec<&str> = text.lines().collect();
                reversed[usize::from(text.starts_with('t'))..].reverse();
                let first = if what == "no times" || what == "elsewhere" {
                    text.clone()
                } else {
                    reversed.join("\r\n")
                };
                let list = folder.path().join(name);
                write(&list, format!("# pairs\n{first}\n\n"));
                write(&folder.path().join("rgb.txt"), lines(|i| format!("{i} rgb/{i}.png")));
                for path in [folder.path(), &list] {
                    let log = open(path).unwrap_or_else(|e| panic!("{what}, {name}: {e}"));
                    assert_eq!((log.kind(), log.len()), (ScanLogKind::TumRgbd, 4), "{what}");
                    for i in 0..4 {
                        assert_is_picture(&log, i, i);
                        assert_eq!(image(&log, i).colors[7], [i as u8, 0, 0], "{what}");
                    }
                    let note = &log.stats().notes[0];
                    assert!(note.starts_with(name) && note.contains("1/5000 m"), "{note}");
                }
            }
        }
    }

    #[test]
    fn what_is_not_clear_is_told() {
        let folder = folder();
        let file = |name: &str| folder.path().join(name);
        let pairs = lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png"));
        let posed = lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png {}", quaternion_text(i)));
        write(&file("a.txt"), &pairs);
        write(&file("b.txt"), &pairs);
        says(open(folder.path()), "not clear (a.txt, b.txt); several files pair pictures: name one of them");
        says(open(&file("a.txt")), "the pose file is missing; looked for groundtruth.txt");
        // One alone has poses.
        write(&file("c.txt"), &posed);
        let log = open(folder.path()).unwrap();
        assert!(log.stats().notes[1].contains("of a.txt, b.txt, c.txt, c.txt was used: it alone has poses"));
        write(&file("groundtruth.txt"), truth());
        says(open(folder.path()), "not clear (a.txt, b.txt, c.txt)");
        assert!(
            open(&file("c.txt")).unwrap().stats().notes[1].contains("those of c.txt, not of groundtruth.txt")
        );
        // TUM's own lists come first.
        write(&file("depth.txt"), lines(|i| format!("{i} depth/{i}.png")));
        let log = open(folder.path()).unwrap();
        assert!(
            log.stats().notes[0].starts_with("a.txt, b.txt, c.txt: pairs pictures, too, and was not used")
        );
    }

    #[test]
    fn poses_of_another_kind_of_log_keep_it_what_it_is() {
        let folder = folder();
        let file = |name: &str| folder.path().join(name);
        let matrices = lines(|i| format!("{i} {i} {}\n{}", i + 1, matrix_text(&camera_pose(i))));
        write(&file("trajectory.log"), matrices);
        write(&file("camera.json"), r#"{"width":8,"height":6,"intrinsic_matrix":[10,0,0,0,12,0,3.5,2.5,1]}"#);
        write(&file("pairs.txt"), lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png")));
        let log = open(folder.path()).unwrap();
        assert_eq!(log.kind(), ScanLogKind::Redwood);
        assert!(log.stats().notes[0].contains("pairs.txt pairs pictures, too, and was not used"));
        write(&file("groundtruth.txt"), truth());
        assert_eq!(open(folder.path()).unwrap().kind(), ScanLogKind::TumRgbd);
    }

    #[test]
    fn the_depth_image_is_told_by_its_name_or_its_pixels() {
        let folder = folder();
        let file = |name: &str| folder.path().join(name);
        for i in 0..4 {
            std::fs::create_dir_all(file("a")).unwrap();
            std::fs::rename(file(&format!("depth/{i}.png")), file(&format!("a/{i}.png"))).unwrap();
        }
        write(&file("pairs"), lines(|i| format!("a/{i}.png rgb/{i}.png {}", quaternion_text(i))));
        let log = open(folder.path()).unwrap();
        (0..4).for_each(|i| assert_is_picture(&log, i, i));
        // Two color pictures, as lists of matches have them, are none.
        write(&file("pairs"), lines(|i| format!("rgb/{i}.png rgb/{i}.png {}", quaternion_text(i))));
        assert_eq!(Association::all_in(folder.path()), []);
        // Places that change, other words, lost files, times that are none.
        let good = "1 rgb/1.png 1 depth/1.png\n";
        for (line, part) in [
            ("2 depth/2.png 2 rgb/2.png", "line 2: the color picture is depth/2.png; give the depth image"),
            ("2 rgb/2.png 2", "line 2: the line is \"2 rgb/2.png 2\"; give 4 words in the order"),
            ("x rgb/2.png 2 depth/2.png", "line 2: the line is"),
            ("2 rgb/2.png inf depth/2.png", "line 2: the time is \"inf\"; write seconds"),
        ] {
            write(&file("pairs"), format!("{good}{line}\n"));
            says(open(&file("pairs")), part);
        }
        write(&file("pairs"), "1 rgb/1.png 1 depth/1.png\n");
        says(open(&file("pairs")), "the number of pictures that are there is 0 of 1");
    }

    #[test]
    fn poses_of_other_times_are_a_trajectory_and_zero_has_no_sign() {
        let folder = folder();
        // The second picture is between the poses of the second and the third line.
        let line = |(i, depth, pose): (usize, &str, &str)| {
            format!("{depth} rgb/{i}.png {depth} depth/{i}.png {pose} {pose} -0.2 0.25 0 0 0 1\n")
        };
        let text: String = [(0, "-0.0", "0"), (1, "0.99", "0.98"), (2, "1", "1")].map(line).concat();
        write(&folder.path().join("pairs.txt"), text);
        let log = open(folder.path()).unwrap();
        assert!((log.pose(1).translation[0] - 0.99).abs() < 1e-9, "{:?}", log.pose(1));
        assert_eq!(log.time_span(), Some((0.0, 1.0)));
        assert_eq!(log.time(0).map(f64::is_sign_negative), Some(false));
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let folder = folder();
        let path = folder.path().join("pairs.txt");
        let good = lines(|i| format!("{i} rgb/{i}.png {i} depth/{i}.png {i} {}", quaternion_text(i)));
        for bytes in bad_bytes(good.as_bytes(), 3, 300) {
            write(&path, bytes);
            if let Some(association) = Association::in_file(&path) {
                let _ = association.read();
            }
        }
    }
}
