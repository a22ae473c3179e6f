//! Bytes of every container changed at random: an error of one line, or messages that can be read.

use proptest::prelude::*;

use super::super::unpack::Packing;
use super::support::{content, open, run};
use super::{mcap, ros1, sqlite};

/// Changes at places given as shares of the length.
fn changed(good: &[u8], edits: &[(f64, u8, u8)], cut: f64) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for (place, kind, value) in edits {
        let at = (place * bytes.len() as f64) as usize;
        match kind % 5 {
            _ if at >= bytes.len() => {}
            0 => bytes[at] ^= 1 << (value % 8),
            1 => bytes[at] = *value,
            2 => bytes.insert(at, *value),
            3 => drop(bytes.remove(at)),
            _ => {
                let end = (at + 8).min(bytes.len());
                bytes[at..end].fill([0xff, 0x7f, 0][*value as usize % 3]);
            }
        }
    }
    if cut < 0.5 {
        bytes.truncate((cut * 2.0 * bytes.len() as f64) as usize);
    }
    bytes
}

fn survives(good: &[u8], edits: &[(f64, u8, u8)], cut: f64) {
    let bytes = changed(good, edits, cut);
    match open(&[&bytes], false).and_then(|bag| content(&bag)) {
        Ok(_) => {}
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
    match open(&[&bytes], true) {
        // What is in the index was read once and can be read again.
        Ok(bag) => {
            content(&bag).unwrap();
            assert!(!bag.notes().iter().any(|n| n.contains('\n')), "{:?}", bag.notes());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}

fn edits() -> impl Strategy<Value = Vec<(f64, u8, u8)>> {
    proptest::collection::vec((0.0..1.0f64, any::<u8>(), any::<u8>()), 0..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn of_mcap(edits in edits(), cut in 0.0..1.0f64, kind in 0usize..4) {
        let run = run(12);
        let good = match kind {
            0 => mcap::by_library(&run, ::mcap::WriteOptions::new().chunk_size(Some(900))),
            1 => mcap::by_library(&run, ::mcap::WriteOptions::new().use_chunks(false)),
            2 => mcap::built(&run, 4, Some(Packing::Zstd)).0,
            _ => mcap::built(&run, 4, Some(Packing::Lz4)).0,
        };
        survives(&good, &edits, cut);
    }

    #[test]
    fn of_ros1(edits in edits(), cut in 0.0..1.0f64, kind in 0usize..4) {
        let packing = [None, None, Some(Packing::Lz4), Some(Packing::Bz2)][kind];
        survives(&ros1::built(&run(12), 4, packing, kind != 1).0, &edits, cut);
    }

    #[test]
    fn of_sqlite(edits in edits(), cut in 0.0..1.0f64) {
        survives(&sqlite::built(&run(30)), &edits, cut);
    }

    #[test]
    fn of_packed_files(edits in edits(), cut in 0.0..1.0f64) {
        let file = zstd::stream::encode_all(&sqlite::built(&run(12))[..], 1).unwrap();
        survives(&file, &edits, cut);
    }
}
