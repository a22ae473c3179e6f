//! MCAP: by the library's writer, and built by bytes for what it does not write.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;

use mcap::records::MessageHeader;
use mcap::{Channel, Schema, WriteOptions, Writer};

use super::super::unpack::Packing;
use super::super::{ContainerKind, DefinitionFormat, Encoding};
use super::support::{Written, content, holds, in_order, open, pack, run, says};

fn record(code: u8, body: &[u8]) -> Vec<u8> {
    [&[code][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// A file without an index whose messages are in chunks of `per_chunk`; the places of its chunks.
pub(super) fn built(run: &[Written], per_chunk: usize, packing: Option<Packing>) -> (Vec<u8>, Vec<usize>) {
    let mut file = mcap::MAGIC.to_vec();
    file.extend(record(1, &[string("ros2"), string("test")].concat()));
    let (mut places, mut known) = (Vec::new(), Vec::new());
    for messages in run.chunks(per_chunk) {
        let mut chunk = Vec::new();
        for (name, time, bytes) in messages {
            let id = known.iter().position(|n| n == name).unwrap_or(known.len()) as u16;
            if id as usize == known.len() {
                known.push(name.clone());
                let schema =
                    [&(id + 1).to_le_bytes()[..], &string("a/msg/B"), &string("ros2msg"), &string("int32 x")];
                chunk.extend(record(3, &schema.concat()));
                let ids = [id.to_le_bytes(), (id + 1).to_le_bytes()].concat();
                chunk.extend(record(4, &[ids, string(name), string("cdr"), vec![0; 4]].concat()));
            }
            let head = [&id.to_le_bytes()[..], &[0; 4], &time.to_le_bytes(), &[0; 8]].concat();
            chunk.extend(record(5, &[&head, &bytes[..]].concat()));
        }
        let packed = pack(packing, &chunk);
        let name = packing.map_or("", Packing::name);
        let size = (chunk.len() as u64).to_le_bytes();
        let crc = crc32fast::hash(&chunk).to_le_bytes();
        let packed_size = (packed.len() as u64).to_le_bytes();
        places.push(file.len());
        let body = [&[0; 16], &size[..], &crc, &string(name), &packed_size, &packed].concat();
        file.extend(record(6, &body));
    }
    file.extend(record(15, &[0; 4]));
    file.extend(record(2, &[0; 20]));
    file.extend(mcap::MAGIC);
    (file, places)
}

/// By the library.
pub(super) fn by_library(run: &[Written], options: WriteOptions) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = Writer::with_options(&mut bytes, options.compression(None)).unwrap();
    let schema =
        Schema { id: 1, name: "a/B".into(), encoding: "ros1msg".into(), data: Cow::Borrowed(b"int32 x\n") };
    let mut ids = BTreeMap::new();
    for (i, (name, time, data)) in run.iter().enumerate() {
        let id = *ids.entry(name.clone()).or_insert_with(|| {
            let metadata: BTreeMap<_, _> =
                [("callerid", "/node"), ("latching", "1")].map(|(k, v)| (k.into(), v.into())).into();
            let schema = Some(Arc::new(schema.clone()));
            let channel =
                Channel { id: 0, topic: name.clone(), schema, message_encoding: "ros1".into(), metadata };
            let schema = writer.add_schema("a/B", "ros1msg", b"int32 x\n").unwrap();
            writer.add_channel(schema, name, &channel.message_encoding, &channel.metadata).unwrap()
        });
        let log_time = *time as u64;
        let header = MessageHeader { channel_id: id, sequence: i as u32, log_time, publish_time: 0 };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

#[test]
fn what_the_library_wrote_is_read_with_and_without_its_index() {
    let run = run(100);
    let options = || WriteOptions::new().chunk_size(Some(2000));
    for (options, notes) in [
        (options(), 0),
        (options().emit_message_indexes(false), 1),
        (options().emit_statistics(false), 1),
        (options().repeat_channels(false), 1),
        (options().emit_summary_records(false).emit_summary_offsets(false), 1),
        (options().use_chunks(false), 1),
        (options().calculate_chunk_crcs(false), 0),
    ] {
        let file = by_library(&run, options);
        let bag = open(&[&file], false).unwrap();
        assert_eq!((bag.kind(), bag.notes().len()), (Some(ContainerKind::Mcap), notes), "{:?}", bag.notes());
        holds(&bag, &run);
        let topic = &bag.topics()[0];
        assert_eq!((topic.name.as_str(), topic.type_name.as_str()), ("/tf", "a/B"));
        assert_eq!((topic.encoding, topic.definition_format), (Encoding::Ros1, DefinitionFormat::Ros1Msg));
        assert_eq!((topic.definition.as_str(), topic.publisher.as_deref()), ("int32 x\n", Some("/node")));
        assert!(topic.latched);
        let allowed = open(&[&file], true).unwrap();
        assert!(allowed.notes().is_empty());
        holds(&allowed, &run);
    }
    let empty = open(&[&by_library(&[], options())], false).unwrap();
    assert!(empty.topics().is_empty() && empty.messages(&[0, 1]).is_empty());
}

#[test]
fn chunks_of_every_compression_are_unpacked() {
    let run = run(90);
    for packing in [None, Some(Packing::Zstd), Some(Packing::Lz4)] {
        let (file, _) = built(&run, 7, packing);
        let bag = open(&[&file], false).unwrap();
        holds(&bag, &run);
        let chunks = [(packing.map_or("none", Packing::name), 90u64.div_ceil(7))].into();
        assert_eq!(bag.summary().unwrap().chunks, chunks);
        // Split, and packed as a whole.
        let (a, b) = run.split_at(41);
        let files = [built(a, 9, packing).0, pack(Some(Packing::Zstd), &built(b, 9, packing).0)];
        let bag = open(&[&files[0], &files[1]], false).unwrap();
        assert_eq!(bag.topics().len(), 2);
        let summary = bag.summary().unwrap();
        assert_eq!((summary.files, summary.packed_files, summary.messages), (2, 1, 90));
        assert_eq!(summary.bytes, bag.files().map(|f| f.1).sum());
        holds(&bag, &run);
    }
}

#[test]
fn single_messages_may_be_compressed() {
    let run = run(20);
    let packed =
        run.iter().map(|(n, t, b)| (n.clone(), *t, pack(Some(Packing::Zstd), b))).collect::<Vec<_>>();
    holds(&open(&[&built(&packed, 6, None).0], false).unwrap(), &run);
    let mut damaged = packed;
    damaged[7].2.truncate(20);
    let file = built(&damaged, 6, None).0;
    says(content(&open(&[&file], false).unwrap()), "a compressed message is damaged zstd data");
    let bag = open(&[&file], true).unwrap();
    assert!(
        bag.notes().len() == 1 && bag.notes()[0].ends_with("1 messages like it are left out"),
        "{:?}",
        bag.notes()
    );
    holds(&bag, &[&run[..7], &run[8..]].concat());
}

#[test]
fn a_damaged_chunk_is_an_error_or_left_out() {
    let run = run(40);
    for packing in [None, Some(Packing::Zstd), Some(Packing::Lz4)] {
        let (mut file, places) = built(&run, 10, packing);
        let at = (places[1] + places[2]) / 2;
        file[at] ^= 0x10;
        says(open(&[&file], false), &format!("file0: byte {}: ", places[1]));
        says(open(&[&file], false), "--allow-truncated");
        let bag = open(&[&file], true).unwrap();
        assert_eq!(bag.notes().len(), 1, "{:?}", bag.notes());
        let rest = [&run[..10], &run[20..]].concat();
        holds(&bag, &rest);
    }
    // The index is whole: the damage is found when the chunk is read.
    let mut file = by_library(&run, WriteOptions::new().chunk_size(Some(3000)));
    file[1500] ^= 0x10;
    let bag = open(&[&file], false).unwrap();
    says(content(&bag), "the checksum of a chunk");
    let bag = open(&[&file], true).unwrap();
    let rest = content(&bag).unwrap();
    assert!(bag.notes().len() == 1 && rest.len() < run.len() && rest.iter().all(|m| run.contains(m)));
}

#[test]
fn a_cut_file_is_an_error_or_read_to_there() {
    let run = run(40);
    let (file, places) = built(&run, 10, Some(Packing::Zstd));
    for cut in (0..file.len()).step_by(13).chain([file.len() - 1]) {
        let result = open(&[&file[..cut]], false);
        says(result, if cut == 0 { "is empty" } else { "file0" });
        if cut < 8 {
            assert!(open(&[&file[..cut]], true).is_err());
            continue;
        }
        let bag = open(&[&file[..cut]], true).unwrap();
        let whole =
            places.iter().skip(1).filter(|p| **p <= cut).count() + usize::from(cut >= file.len() - 50);
        assert_eq!(content(&bag).unwrap(), in_order(&run[..10 * whole]), "{cut}");
        assert_eq!(
            bag.notes().len(),
            usize::from(cut < file.len() - 37),
            "{cut} of {}: {:?}",
            file.len(),
            bag.notes()
        );
    }
}

#[test]
fn an_index_that_lies_is_not_believed() {
    let run = run(40);
    let file =
        by_library(&run, WriteOptions::new().chunk_size(Some(3000)).calculate_summary_section_crc(false));
    // One message less in the statistics, and a time of a message index that is another.
    let statistics = file.windows(9).rposition(|w| w[0] == 11 && w[1] == 46 + 20).unwrap();
    let mut fewer = file.clone();
    fewer[statistics + 9] -= 1;
    let bag = open(&[&fewer], false).unwrap();
    assert!(bag.notes()[0].contains("40 messages of 39"), "{:?}", bag.notes());
    holds(&bag, &run);
    let index = file.windows(9).position(|w| w[0] == 7 && w[2..] == [0; 7] && w[1] % 16 == 6).unwrap();
    let mut moved = file.clone();
    moved[index + 9 + 6] ^= 1;
    says(content(&open(&[&moved], false).unwrap()), "not the one of the index");
    holds(&open(&[&moved], true).unwrap(), &run);
}

#[test]
fn other_encodings_are_left_out_and_told() {
    let run = run(9);
    let (file, _) = built(&run, 3, None);
    let text = file.windows(3).position(|w| w == b"cdr").unwrap();
    let mut other = file.clone();
    other[text..text + 3].copy_from_slice(b"xyz");
    // The checksum is wrong now: none.
    let chunk = 8 + 9 + 4 + 4 + 4 + 4;
    other[chunk + 9 + 24..chunk + 9 + 28].fill(0);
    let bag = open(&[&other], false).unwrap();
    let note = "/tf: its messages are encoded as \"xyz\", which is not read (3 messages left out)";
    assert!(bag.notes().iter().any(|n| n.ends_with(note)), "{:?}", bag.notes());
    let rest: Vec<_> = run.iter().filter(|m| m.0 == "/scan").cloned().collect();
    holds(&bag, &rest);
}

#[test]
fn threads_read_one_bag() {
    let run = run(200);
    for file in [built(&run, 7, Some(Packing::Zstd)).0, super::sqlite::built(&run)] {
        let bag = open(&[&file], false).unwrap();
        let (messages, expected) = (bag.messages(&[0, 1]), in_order(&run));
        std::thread::scope(|scope| {
            for start in 0..4 {
                let (bag, messages, expected) = (&bag, &messages, &expected);
                scope.spawn(move || {
                    let mut data = Vec::new();
                    for i in (0..messages.len()).map(|i| (i * 37 + start * 50) % messages.len()) {
                        bag.read(&messages[i], &mut data).unwrap();
                        assert!(data == expected[i].2);
                    }
                });
            }
        });
    }
}

#[test]
fn bombs_are_refused() {
    // Nothing but zeros, as a file that is compressed as a whole: 80 MB of 8 kB.
    let bomb = pack(Some(Packing::Zstd), &vec![0; 80 << 20]);
    assert!(bomb.len() < 20_000);
    says(open(&[&bomb], true), "unpacks to more than 67108864 bytes, 1000 times its size");
    // Two million empty messages in a chunk of few bytes.
    let run = vec![("/scan".to_owned(), 7, Vec::new()); 2_000_000];
    let (file, _) = built(&run, run.len(), Some(Packing::Zstd));
    assert!(file.len() < 100_000);
    says(open(&[&file], false), "the number of messages at byte");
}
