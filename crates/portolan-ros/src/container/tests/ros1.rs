//! ROS 1 bags, built by bytes.

use std::collections::BTreeMap;

use super::super::unpack::Packing;
use super::super::{ContainerKind, DefinitionFormat, Encoding};
use super::support::{Written, content, holds, in_order, open, pack, run, says};

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| {
        let text = [name.as_bytes(), b"=", value].concat();
        [&(text.len() as u32).to_le_bytes()[..], &text].concat()
    };
    fields.iter().flat_map(field).collect()
}

fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header = fields(header);
    [&(header.len() as u32).to_le_bytes()[..], &header, &(data.len() as u32).to_le_bytes(), data].concat()
}

fn stamp(time: i64) -> Vec<u8> {
    [((time / 1_000_000_000) as u32).to_le_bytes(), ((time % 1_000_000_000) as u32).to_le_bytes()].concat()
}

/// A bag, with an index or as a recorder that was killed leaves it; the places of its chunks.
pub(super) fn built(
    run: &[Written],
    per_chunk: usize,
    packing: Option<Packing>,
    indexed: bool,
) -> (Vec<u8>, Vec<usize>) {
    let mut file = b"#ROSBAG V2.0\n".to_vec();
    let header = |index: u64, connections: u32, chunks: u32| {
        let (index, connections, chunks) =
            (index.to_le_bytes(), connections.to_le_bytes(), chunks.to_le_bytes());
        let fields: [(&str, &[u8]); 4] =
            [("op", &[3]), ("index_pos", &index), ("conn_count", &connections), ("chunk_count", &chunks)];
        record(&fields, &b" ".repeat(100))
    };
    file.extend(header(0, 0, 0));
    let (mut places, mut infos, mut known) = (Vec::new(), Vec::new(), Vec::<Vec<u8>>::new());
    for messages in run.chunks(per_chunk) {
        let (mut chunk, mut index) = (Vec::new(), BTreeMap::<u32, Vec<u8>>::new());
        for (name, time, bytes) in messages {
            let id = if name == "/tf" { 0u32 } else { 5 };
            let id_bytes = id.to_le_bytes();
            let type_name: &[u8] = b"a/B";
            let about = fields(&[
                ("topic", name.as_bytes()),
                ("type", type_name),
                ("md5sum", b"*"),
                ("message_definition", b"int32 x\n# a=b"),
                ("callerid", b"/node"),
                ("latching", if id == 0 { b"1" } else { b"0" }),
            ]);
            let connection = record(&[("op", &[7]), ("conn", &id_bytes), ("topic", name.as_bytes())], &about);
            if !known.contains(&connection) {
                known.push(connection.clone());
                chunk.extend(&connection);
            }
            let entry = [stamp(*time), (chunk.len() as u32).to_le_bytes().to_vec()].concat();
            index.entry(id).or_default().extend(entry);
            chunk.extend(record(&[("op", &[2]), ("conn", &id_bytes), ("time", &stamp(*time))], bytes));
        }
        let packed = pack(packing, &chunk);
        let name = packing.map_or("none", Packing::name);
        let size = (chunk.len() as u32).to_le_bytes();
        places.push(file.len());
        file.extend(record(&[("op", &[5]), ("compression", name.as_bytes()), ("size", &size)], &packed));
        let mut counts = Vec::new();
        for (id, entries) in index {
            let (id, n) = (id.to_le_bytes(), (entries.len() as u32 / 12).to_le_bytes());
            let header: [(&str, &[u8]); 4] =
                [("op", &[4]), ("ver", &[1, 0, 0, 0]), ("conn", &id), ("count", &n)];
            file.extend(record(&header, &entries));
            counts.extend([id, n].concat());
        }
        let place = (places[places.len() - 1] as u64).to_le_bytes();
        infos.push(record(&[("op", &[6]), ("ver", &[1, 0, 0, 0]), ("chunk_pos", &place)], &counts));
    }
    if indexed {
        let start = header(file.len() as u64, known.len() as u32, infos.len() as u32);
        file.splice(13..13 + start.len(), start);
        file.extend(known.concat());
        file.extend(infos.concat());
    }
    (file, places)
}

#[test]
fn chunks_of_every_compression_with_and_without_index() {
    let run = run(100);
    for packing in [None, Some(Packing::Bz2), Some(Packing::Lz4)] {
        for indexed in [true, false] {
            let (file, _) = built(&run, 8, packing, indexed);
            let bag = open(&[&file], false).unwrap();
            assert_eq!((bag.kind(), bag.notes().len()), (Some(ContainerKind::RosBag), usize::from(!indexed)));
            holds(&bag, &run);
            let topic = &bag.topics()[0];
            assert_eq!((topic.name.as_str(), topic.type_name.as_str()), ("/tf", "a/B"));
            assert_eq!(
                (topic.encoding, topic.definition_format),
                (Encoding::Ros1, DefinitionFormat::Ros1Msg)
            );
            assert_eq!(
                (topic.definition.as_str(), topic.publisher.as_deref()),
                ("int32 x\n# a=b", Some("/node"))
            );
            assert!(topic.latched && !bag.topics()[1].latched);
            holds(&open(&[&file], true).unwrap(), &run);
            let chunks = [(packing.map_or("none", Packing::name), 100u64.div_ceil(8))].into();
            assert_eq!(bag.summary().unwrap().chunks, chunks);
        }
    }
    let (a, b) = run.split_at(30);
    let files = [built(a, 7, None, true).0, built(b, 7, None, true).0];
    let bag = open(&[&files[0], &files[1]], false).unwrap();
    assert_eq!((bag.topics().len(), bag.notes().len()), (2, 0));
    holds(&bag, &run);
}

#[test]
fn a_cut_bag_is_an_error_or_read_to_there() {
    let run = run(40);
    for indexed in [true, false] {
        let (file, places) = built(&run, 10, Some(Packing::Lz4), indexed);
        for cut in (0..file.len()).step_by(11) {
            let (strict, allowed) = (open(&[&file[..cut]], false), open(&[&file[..cut]], true));
            let Ok(bag) = allowed else {
                says(strict, if cut == 0 { "is empty" } else { "file0" });
                assert!(cut < places[0], "{cut}");
                continue;
            };
            let got = content(&bag).unwrap();
            let from: Vec<_> = (0..4).map(|chunks| in_order(&run[..10 * chunks])).collect();
            assert!(got.len() == 40 || from.contains(&got), "{cut}");
            // Between records a bag without an index is a shorter one.
            assert_eq!(strict.is_err(), indexed || !bag.notes().is_empty(), "{cut}");
        }
    }
}

#[test]
fn damage_is_an_error_or_left_out() {
    let run = run(40);
    for packing in [Packing::Bz2, Packing::Lz4] {
        let (mut file, places) = built(&run, 10, Some(packing), false);
        let at = places[1] + 200;
        file[at..at + 8].iter_mut().for_each(|b| *b ^= 0x5a);
        says(open(&[&file], false), &format!("byte {}: a chunk is damaged", places[1]));
        let bag = open(&[&file], true).unwrap();
        assert_eq!(bag.notes().len(), 1, "{:?}", bag.notes());
        holds(&bag, &[&run[..10], &run[20..]].concat());
    }
    // An index that lies about the number of chunks, and about the place of a message.
    let (file, places) = built(&run, 10, None, true);
    let mut fewer = file.clone();
    let count = file.windows(12).position(|w| w == b"chunk_count=").unwrap() + 12;
    fewer[count] = 3;
    let bag = open(&[&fewer], false).unwrap();
    assert!(bag.notes()[0].contains("4 chunks of 3"), "{:?}", bag.notes());
    holds(&bag, &run);
    let mut moved = file.clone();
    let index = places[1] + file[places[1]..].windows(6).position(|w| w == b"count=").unwrap() + 6 + 4 + 4;
    moved[index + 4] ^= 1;
    says(content(&open(&[&moved], false).unwrap()), "not the one of the index");
}

#[test]
fn other_versions_and_encrypted_bags_are_refused() {
    says(open(&[b"#ROSBAG V1.2\nmore"], false), "the version of the bag is #ROSBAG V1.2; only version 2.0");
    says(open(&[b"#ROSRECORD V1.1\n"], true), "rosbag migrate");
    let number = [0; 8];
    let header = record(
        &[
            ("op", &[3]),
            ("index_pos", &number),
            ("conn_count", &number[..4]),
            ("chunk_count", &number[..4]),
            ("encryptor", b"rosbag/AesCbcEncryptor"),
        ],
        b"",
    );
    says(
        open(&[&[b"#ROSBAG V2.0\n", &header[..]].concat()], true),
        "the encryptor is rosbag/AesCbcEncryptor",
    );
    says(open(&[b"no bag at all, only text"], true), "is no MCAP, sqlite3 or ROS 1 bag");
}
