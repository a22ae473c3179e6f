//! What the tests of containers share: runs to write, what a bag holds, real data.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::super::unpack::Packing;
use super::super::{Bag, BagOptions, BytesSource, Source};
use crate::Result;

/// A message that was written: topic, log time, bytes.
pub(super) type Written = (String, i64, Vec<u8>);

/// Messages of two topics, times not in order and some equal.
pub(super) fn run(count: usize) -> Vec<Written> {
    let message = |i: usize| {
        let name = if i.is_multiple_of(3) { "/tf" } else { "/scan" };
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend((0..(i * 37) % 700).map(|k| (i * 7 + k / 3) as u8));
        (name.to_owned(), 1_700_000_000_000_000_000 + ((i * 5) % count / 2) as i64, bytes)
    };
    (0..count).map(message).collect()
}

/// In the order in which a bag gives them.
pub(super) fn in_order(run: &[Written]) -> Vec<Written> {
    let mut sorted = run.to_vec();
    sorted.sort_by_key(|m| m.1);
    sorted
}

pub(super) fn open(files: &[&[u8]], allow_truncated: bool) -> Result<Bag> {
    let source = |(i, bytes): (usize, &&[u8])| {
        Box::new(BytesSource::new(format!("file{i}"), bytes.to_vec())) as Box<dyn Source>
    };
    Bag::from_sources(files.iter().enumerate().map(source).collect(), &BagOptions { allow_truncated })
}

/// All messages by their places, in the order of times; one pass must give the same.
pub(super) fn content(bag: &Bag) -> Result<Vec<Written>> {
    let topics: Vec<u32> = (0..bag.topics().len() as u32).collect();
    let name = |topic: u32| bag.topics()[topic as usize].name.clone();
    let (mut all, mut data) = (Vec::new(), Vec::new());
    for message in bag.messages(&topics) {
        bag.read(&message, &mut data)?;
        all.push((name(message.topic), message.log_time, data.clone()));
    }
    let mut pass = Vec::new();
    bag.for_each(&topics, |m, bytes| -> Result<()> {
        pass.push((name(m.topic), m.log_time, bytes.to_vec()));
        Ok(())
    })?;
    pass.sort_by_key(|m| m.1);
    assert!(all == pass, "one pass and reading by place differ");
    let counts: u64 = bag.counts().iter().map(|c| c.messages).sum();
    assert_eq!(counts, all.len() as u64);
    Ok(all)
}

#[track_caller]
pub(super) fn holds(bag: &Bag, run: &[Written]) {
    assert!(content(bag).unwrap() == in_order(run), "{:?}", bag.notes());
}

/// Asserts an error of one line that has this part.
#[track_caller]
pub(super) fn says<T>(result: Result<T>, part: &str) {
    let error = result.err().unwrap().to_string();
    assert!(error.contains(part) && !error.contains('\n'), "{error}");
}

/// Packs by the libraries' own writers.
pub(super) fn pack(packing: Option<Packing>, bytes: &[u8]) -> Vec<u8> {
    match packing {
        None => bytes.to_vec(),
        Some(Packing::Zstd) => zstd::stream::encode_all(bytes, 1).unwrap(),
        Some(Packing::Bz2) => {
            let mut writer = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            writer.write_all(bytes).unwrap();
            writer.finish().unwrap()
        }
        Some(Packing::Lz4) => {
            // With a checksum, as ROS 1 writes it.
            let about = lz4_flex::frame::FrameInfo::new().content_checksum(true);
            let mut writer = lz4_flex::frame::FrameEncoder::with_frame_info(about, Vec::new());
            writer.write_all(bytes).unwrap();
            writer.finish().unwrap()
        }
    }
}

/// A file of the real data, or `None` with a loud line where it is not there.
pub(super) fn real_data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("PORTOLAN_DATA").map(PathBuf::from);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = folder.unwrap_or_else(beside).join(name);
    if path.exists() {
        return Some(path);
    }
    skipped(&format!("{} is not there (set PORTOLAN_DATA to the folder of real data)", path.display()));
    None
}

/// Says that a test was skipped. Not by `eprintln!`, which the test harness swallows: it must be seen.
fn skipped(why: &str) {
    writeln!(std::io::stderr(), "SKIPPED: {why}").unwrap();
}

/// What a script writes, by the Python of `PORTOLAN_PYTHON`, else `python3`, if it has the package; without it a loud
/// line is printed and the test is skipped.
pub(super) fn python(package: &str, script: &str, arguments: &[&Path]) -> Option<String> {
    let named = std::env::var_os("PORTOLAN_PYTHON").map(PathBuf::from);
    let python: PathBuf = named.unwrap_or_else(|| "python3".into());
    let run = |script: &str, arguments: &[&Path]| {
        std::process::Command::new(&python).arg("-c").arg(script).args(arguments).output()
    };
    if !run(&format!("import {package}"), &[]).is_ok_and(|o| o.status.success()) {
        skipped(&format!("{} has no {package} (set PORTOLAN_PYTHON to a Python that has)", python.display()));
        return None;
    }
    let output = run(script, arguments).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}
