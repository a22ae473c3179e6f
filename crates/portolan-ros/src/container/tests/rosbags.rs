//! Bags of all containers and compressions by the Python package rosbags, an independent writer.

use super::super::{Bag, BagOptions, ContainerKind, DefinitionFormat, Encoding};
use super::support::{content, python};

/// Writes bags into the folder and prints their names, then what each of them holds.
const SCRIPT: &str = r#"
import binascii, random, sys
from pathlib import Path
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_typestore
folder = Path(sys.argv[1]); rng = random.Random(1)
two, one = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS1_NOETIC)
messages = []
for i in range(300):
    data = b'\0\1\0\0' + rng.randbytes(rng.choice([0, 8, 100, 5000])) + bytes(i)
    messages.append((i % 3 == 0, 1700000000000000000 + (i * 7 % 300) // 2 * 10, data))
def fill(writer, store):
    with writer:
        names = ['/scan', '/tf']; types = ['sensor_msgs/msg/LaserScan', 'geometry_msgs/msg/TransformStamped']
        ids = [writer.add_connection(n, t, typestore=store) for n, t in zip(names, types)]
        for tf, time, data in messages: writer.write(ids[tf], time, data)
for plugin in StoragePlugin:
    for mode in (CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE):
        name = f'{plugin.name}_{mode.name}'
        writer = Writer2(folder / name, version=9, storage_plugin=plugin)
        if mode != CompressionMode.NONE: writer.set_compression(mode, CompressionFormat.ZSTD)
        fill(writer, two); print(name)
for packing in [None, *Writer1.CompressionFormat]:
    name = f'ROS1_{packing.name if packing else "NONE"}.bag'
    writer = Writer1(folder / name)
    if packing: writer.set_compression(packing)
    fill(writer, one); print(name)
print('content')
for tf, time, data in sorted(messages, key=lambda m: m[1]):
    print('/tf' if tf else '/scan', time, binascii.crc32(data))
"#;

#[test]
fn all_containers_hold_what_rosbags_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let Some(output) = python("rosbags", SCRIPT, &[folder.path()]) else { return };
    let (names, expected) = output.split_once("content\n").unwrap();
    assert_eq!(names.lines().count(), 9);
    for name in names.lines() {
        for allow_truncated in [false, true] {
            let bag = Bag::open(folder.path().join(name), &BagOptions { allow_truncated }).unwrap();
            let line = |(name, time, bytes): &(String, i64, Vec<u8>)| {
                format!("{name} {time} {}\n", crc32fast::hash(bytes))
            };
            let got: String = content(&bag).unwrap().iter().map(line).collect();
            assert!(got == expected && bag.notes().is_empty(), "{name}: {:?}", bag.notes());
            let ros1 = bag.kind() == Some(ContainerKind::RosBag);
            for topic in bag.topics() {
                let expected = match ros1 {
                    true => (Encoding::Ros1, DefinitionFormat::Ros1Msg),
                    false => (Encoding::Cdr, DefinitionFormat::Ros2Msg),
                };
                assert_eq!((topic.encoding, topic.definition_format), expected);
                assert!(topic.definition.contains("MSG: std_msgs/"), "{}", topic.definition);
            }
        }
    }
}
