//! Small bags in the three containers, and what is in them.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};

/// A message: topic, type, definition, log time, bytes as ROS 1 has them.
type Written = (&'static str, &'static str, String, u64, Vec<u8>);

pub const HEADER: &str = "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
pub const SCAN: &str = "Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n\
    float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n";
pub const CLOUD: &str = "Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n\
    uint32 row_step\nuint8[] data\nbool is_dense\n===\nMSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\n\
    uint32 count\n";
const TF: &str = "geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\nHeader header\n\
    string child_frame_id\nTransform transform\n===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n\
    ===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n===\nMSG: geometry_msgs/Quaternion\nfloat64 x\n\
    float64 y\nfloat64 z\nfloat64 w\n";

fn text(text: &str) -> Vec<u8> {
    blob(text.as_bytes())
}

fn blob(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
}

fn words(all: &[u32]) -> Vec<u8> {
    all.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn floats(all: &[f32]) -> Vec<u8> {
    all.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn header(seconds: u32, frame: &str) -> Vec<u8> {
    [words(&[0, seconds, 0]), text(frame)].concat()
}

pub fn scan(seconds: u32) -> Vec<u8> {
    let about = floats(&[-1.0, 1.0, 0.5, 0.0, 0.1, 0.1, 10.0]);
    [header(seconds, "laser"), about, words(&[5]), floats(&[1.0, 2.0, f32::INFINITY, 3.0, 9.0]), words(&[0])]
        .concat()
}

pub fn cloud(seconds: u32) -> Vec<u8> {
    let points: Vec<u8> = (0..4).flat_map(|i| floats(&[i as f32, 2.0, -1.0, 0.01 * i as f32])).collect();
    let field = |(k, name): (u32, &str)| [text(name), words(&[4 * k]), vec![7], words(&[1])].concat();
    let fields: Vec<u8> = (0..).zip(["x", "y", "z", "time"]).flat_map(field).collect();
    let size = words(&[1, 4, 4]);
    [header(seconds, "lidar"), size, fields, vec![0], words(&[16, 64]), blob(&points), vec![1]].concat()
}

fn transform(seconds: u32, child: &str) -> Vec<u8> {
    let pose: Vec<u8> =
        [f64::from(seconds), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    [words(&[1]), header(seconds, "odom"), text(child), pose].concat()
}

fn run() -> Vec<Written> {
    let mut all: Vec<Written> = Vec::new();
    for t in 1..4u32 {
        let at = u64::from(t) * 1_000_000_000;
        for child in ["laser", "lidar"] {
            all.push(("/tf", "tf2_msgs/TFMessage", format!("{TF}{HEADER}"), at, transform(t, child)));
        }
        all.push(("/scan", "sensor_msgs/LaserScan", format!("{SCAN}{HEADER}"), at, scan(t)));
        all.push(("/points", "sensor_msgs/PointCloud2", format!("{CLOUD}{HEADER}"), at, cloud(t)));
    }
    all
}

/// A run of the lasers alone, and of the lidar alone: a log is of one dimension.
fn runs() -> Vec<Vec<Written>> {
    let without = |topic: &str| run().into_iter().filter(|m| m.0 != topic).collect();
    vec![without("/points"), without("/scan"), run()]
}

fn mcap(run: &[Written], chunks: bool) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).use_chunks(chunks);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    for (topic, kind, definition, time, bytes) in run {
        let schema = writer.add_schema(kind, "ros1msg", definition.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "ros1", &BTreeMap::new()).unwrap();
        let header =
            mcap::records::MessageHeader { channel_id, sequence: 0, log_time: *time, publish_time: *time };
        writer.write_to_known_channel(&header, bytes).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn record(header: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| blob(&[name.as_bytes(), b"=", value].concat());
    let header: Vec<u8> = header.iter().flat_map(field).collect();
    [blob(&header), blob(data)].concat()
}

/// A ROS 1 bag without an index, of one chunk.
fn ros1(run: &[Written], packing: &str) -> Vec<u8> {
    let mut file = b"#ROSBAG V2.0\n".to_vec();
    let zero = [0; 8];
    let head: [(&str, &[u8]); 4] =
        [("op", &[3]), ("index_pos", &zero), ("conn_count", &zero[..4]), ("chunk_count", &zero[..4])];
    file.extend(record(&head, &b" ".repeat(20)));
    let mut chunk = Vec::new();
    for (topic, kind, definition, time, bytes) in run {
        let id = (topic.len() as u32).to_le_bytes();
        let about: Vec<u8> = [
            ("topic", topic.as_bytes()),
            ("type", kind.as_bytes()),
            ("md5sum", b"*"),
            ("message_definition", definition.as_bytes()),
        ]
        .iter()
        .flat_map(|(name, value)| blob(&[name.as_bytes(), b"=", value].concat()))
        .collect();
        chunk.extend(record(&[("op", &[7]), ("conn", &id), ("topic", topic.as_bytes())], &about));
        let stamp = words(&[(time / 1_000_000_000) as u32, 0]);
        chunk.extend(record(&[("op", &[2]), ("conn", &id), ("time", &stamp)], bytes));
    }
    let packed = match packing {
        "bz2" => {
            let mut writer = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            writer.write_all(&chunk).unwrap();
            writer.finish().unwrap()
        }
        "lz4" => {
            let mut writer = lz4_flex::frame::FrameEncoder::new(Vec::new());
            writer.write_all(&chunk).unwrap();
            writer.finish().unwrap()
        }
        _ => chunk.clone(),
    };
    let size = (chunk.len() as u32).to_le_bytes();
    file.extend(record(&[("op", &[5]), ("compression", packing.as_bytes()), ("size", &size)], &packed));
    file
}

enum Value<'a> {
    Int(i64),
    Blob(&'a [u8]),
    Text(&'a str),
}

fn varint(value: usize) -> Vec<u8> {
    let mut bytes = vec![(value & 0x7f) as u8];
    let mut rest = value >> 7;
    while rest > 0 {
        bytes.insert(0, 0x80 | (rest & 0x7f) as u8);
        rest >>= 7;
    }
    bytes
}

/// A table of one page of sqlite3.
fn page(size: usize, at: usize, rows: &[Vec<Value<'_>>]) -> Vec<u8> {
    let (mut page, mut end) = (vec![0; size], size);
    page[at] = 13;
    page[at + 3..at + 5].copy_from_slice(&(rows.len() as u16).to_be_bytes());
    for (i, row) in rows.iter().enumerate() {
        // The key of the row stands for its first column.
        let (mut types, mut body) = (vec![0], Vec::new());
        for value in row {
            match value {
                Value::Int(v) => (types.push(6), body.extend(v.to_be_bytes())).0,
                Value::Blob(b) => (types.extend(varint(2 * b.len() + 12)), body.extend(*b)).0,
                Value::Text(t) => (types.extend(varint(2 * t.len() + 13)), body.extend(t.as_bytes())).0,
            }
        }
        let payload = [vec![types.len() as u8 + 1], types, body].concat();
        let cell = [varint(payload.len()), varint(i + 1), payload].concat();
        end -= cell.len();
        page[end..end + cell.len()].copy_from_slice(&cell);
        page[at + 8 + 2 * i..at + 10 + 2 * i].copy_from_slice(&(end as u16).to_be_bytes());
    }
    page
}

/// rosbag2's sqlite3, whose messages are CDR.
fn sqlite() -> Vec<u8> {
    const SIZE: usize = 4096;
    use Value::{Blob, Int, Text};
    // std_msgs/Header of ROS 2, little endian.
    let message = [&[0, 1, 0, 0][..], &words(&[7, 9]), &blob(b"map\0")].concat();
    let topics = [vec![Text("/a"), Text("std_msgs/msg/Header"), Text("cdr"), Text("- durability: 1\n")]];
    let messages: Vec<_> = (0..3).map(|i| vec![Int(1), Int(i), Blob(&message)]).collect();
    let definition = "builtin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let definitions = [vec![Text("std_msgs/msg/Header"), Text("ros2msg"), Text(definition)]];
    let tables = [
        (
            "topics",
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format, offered_qos_profiles)",
        ),
        ("messages", "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)"),
        (
            "message_definitions",
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type, encoding, encoded_message_definition)",
        ),
    ];
    let mut schema = page(SIZE, 100, &[]);
    // Rows of the schema begin with their type, not with a key.
    let mut end = SIZE;
    schema[103..105].copy_from_slice(&(tables.len() as u16).to_be_bytes());
    for (i, (name, sql)) in tables.iter().enumerate() {
        let texts = ["table", name, name];
        let mut types: Vec<u8> = texts.iter().map(|t| 2 * t.len() as u8 + 13).collect();
        types.push(6);
        types.extend(varint(2 * sql.len() + 13));
        let root = (i as i64 + 2).to_be_bytes();
        let body = [texts.concat().as_bytes(), &root, sql.as_bytes()].concat();
        let payload = [vec![types.len() as u8 + 1], types, body].concat();
        let cell = [varint(payload.len()), varint(i + 1), payload].concat();
        end -= cell.len();
        schema[end..end + cell.len()].copy_from_slice(&cell);
        schema[108 + 2 * i..110 + 2 * i].copy_from_slice(&(end as u16).to_be_bytes());
    }
    schema[..16].copy_from_slice(b"SQLite format 3\0");
    schema[16..18].copy_from_slice(&(SIZE as u16).to_be_bytes());
    schema[18..24].copy_from_slice(&[1, 1, 0, 64, 32, 32]);
    schema[28..32].copy_from_slice(&4u32.to_be_bytes());
    schema[59] = 1;
    [schema, page(SIZE, 0, &topics), page(SIZE, 0, &messages), page(SIZE, 0, &definitions)].concat()
}

/// Small bags of every container.
pub fn all() -> Vec<Vec<u8>> {
    let mut all = vec![sqlite()];
    for run in runs() {
        all.extend([true, false].map(|chunks| mcap(&run, chunks)));
        all.extend(["none", "bz2", "lz4"].map(|packing| ros1(&run, packing)));
    }
    all
}

/// A depth image of 8 x 6 pixels, 1 m deep.
pub fn depth_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 8, 6);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&1000u16.to_be_bytes().repeat(48)).unwrap();
    bytes
}
