//! Messages of sensors and poses, written byte by byte.

use proptest::prelude::*;

use super::decoder::tests::{Writer, topic};
use super::*;
use crate::container::{DefinitionFormat, Encoding, Topic};

/// A topic without a definition, of ROS 2.
fn usual(kind: &str) -> Topic {
    topic(kind, Encoding::Cdr, DefinitionFormat::Missing, "")
}

/// Reads bytes as a message of a type.
fn with<T>(kind: &str, bytes: &[u8], read: impl FnOnce(&Record<'_>) -> crate::Result<T>) -> crate::Result<T> {
    let decoder = Decoder::new(&usual(kind)).unwrap();
    let message = decoder.decode(bytes)?;
    read(&message.record)
}

#[track_caller]
fn says<T>(result: crate::Result<T>, part: &str) {
    let error = result.err().unwrap().to_string();
    assert!(error.contains(part) && !error.contains('\n'), "{error}");
}

/// Name, offset, datatype, count.
type FieldRow = (&'static str, u32, u8, u32);

struct Cloud {
    size: [u32; 2],
    fields: Vec<FieldRow>,
    big: bool,
    steps: [u32; 2],
    data: Vec<u8>,
}

impl Cloud {
    fn bytes(&self) -> Vec<u8> {
        let mut w = Writer::cdr(false);
        w.header((1_700_000_000, 0), "lidar")
            .u32(self.size[1])
            .u32(self.size[0])
            .u32(self.fields.len() as u32);
        for (name, offset, kind, count) in &self.fields {
            w.text(name).u32(*offset).u8(*kind).u32(*count);
        }
        w.u8(self.big.into()).u32(self.steps[0]).u32(self.steps[1]).blob(&self.data).u8(1);
        w.bytes
    }
}

const CLOUD: &str = "sensor_msgs/msg/PointCloud2";

/// Two rows of three points, with padding in points and rows, in any order of fields and bytes.
fn grid(big: bool) -> Cloud {
    let mut data = vec![0xee; 2 * 100];
    let mut put = |at: usize, little: &[u8]| {
        data[at..at + little.len()].copy_from_slice(little);
        if big {
            data[at..at + little.len()].reverse();
        }
    };
    for row in 0..2 {
        for column in 0..3 {
            let (at, v) = (row * 100 + column * 32, (row * 3 + column) as f64);
            put(at + 1, &(v + 0.5).to_le_bytes());
            put(at + 9, &(-v as f32).to_le_bytes());
            put(at + 13, &(v as i16).to_le_bytes());
            put(at + 16, &0x00aa_bb00u32.wrapping_add(v as u32).to_le_bytes());
            put(at + 20, &(1e6 * v).to_le_bytes());
            put(at + 28, &(7 + v as u16).to_le_bytes());
        }
    }
    let fields = vec![
        ("ring", 28, 4, 1),
        ("rgb", 16, 7, 1),
        ("z", 13, 3, 1),
        ("x", 1, 8, 1),
        ("Y", 9, 7, 0),
        ("timestamp", 20, 8, 1),
    ];
    Cloud { size: [3, 2], fields, big, steps: [32, 100], data }
}

#[test]
fn points_lie_where_the_message_says() {
    for big in [false, true] {
        let bytes = grid(big).bytes();
        with(CLOUD, &bytes, |record| {
            let cloud = PointCloud::of(record)?;
            assert_eq!((cloud.len(), cloud.width, cloud.height, cloud.trailing), (6, 3, 2, 0));
            assert_eq!(cloud.header.frame, "lidar");
            let position = cloud.position().unwrap();
            let all: Vec<[f64; 3]> = cloud.points().map(|p| position.map(|f| f.read(p).to_f64())).collect();
            let expected: Vec<[f64; 3]> = (0..6).map(f64::from).map(|v| [v + 0.5, -v, v]).collect();
            assert_eq!(all, expected);
            let Some(ColorFields::Packed(color)) = cloud.color() else { panic!("{:?}", cloud.color()) };
            let last = cloud.points().last().unwrap();
            assert_eq!(color.read(last), Number::Integer(0x00aa_bb05));
            assert_eq!(cloud.field(&["ring", "line"]).unwrap().read(last), Number::Integer(12));
            let times = PointTimes::infer(&cloud, Some(0.01)).unwrap().unwrap();
            assert_eq!((times.unit, times.base), (TimeUnit::Nanoseconds, TimeBase::Stamp));
            assert!((times.after_stamp(&cloud)[5] - 0.005).abs() < 1e-12);
            assert!(times.describe().contains("timestamp in nanoseconds after the stamp"));
            Ok(())
        })
        .unwrap();
    }
}

#[test]
fn clouds_that_contradict_themselves_are_refused() {
    let refused = |change: &dyn Fn(&mut Cloud), part: &str| {
        let mut cloud = grid(false);
        change(&mut cloud);
        says(with(CLOUD, &cloud.bytes(), |r| PointCloud::of(r).map(|c| c.len())), part);
    };
    refused(&|c| c.fields[3].1 = 25, "offset is 25 for x; the field lies outside of its point of 32 bytes");
    refused(&|c| c.fields[3].1 = u32::MAX, "lies outside");
    refused(&|c| c.fields[0].3 = u32::MAX, "lies outside");
    refused(&|c| c.fields[0].2 = 9, "datatype is 9 for ring");
    refused(&|c| c.steps[1] = 95, "row_step is 95 for 3 points of 32 bytes");
    refused(&|c| c.data.truncate(195), "data is 195 bytes where 3 x 2 points of 32 bytes take 196");
    refused(&|c| c.size = [u32::MAX, u32::MAX], "row_step is 100 for 4294967295 points");
    refused(&|c| c.steps = [0, 0], "");
    let read =
        |cloud: &Cloud| with(CLOUD, &cloud.bytes(), |r| PointCloud::of(r).map(|c| (c.len(), c.trailing)));
    let mut one = grid(false);
    (one.size, one.steps[1]) = ([3, 1], 0);
    assert_eq!(read(&one).unwrap(), (3, 104));
    one.size = [0, 1];
    one.data.clear();
    assert_eq!(read(&one).unwrap(), (0, 0));
}

#[test]
fn livox_messages() {
    let mut w = Writer::cdr(false);
    w.header((5, 7), "livox_frame").u64(1).u32(2).u8(0).u8(0).u8(0).u8(0).u32(2);
    w.u32(0).f32(1.0).f32(2.0).f32(3.0).u8(200).u8(0).u8(1);
    w.u32(99_000_000).f32(0.0).f32(0.0).f32(0.0).u8(0).u8(0).u8(3);
    let scan = with("livox_ros_driver2/msg/CustomMsg", &w.bytes, LivoxScan::of).unwrap();
    assert_eq!(scan.header.stamp, 5_000_000_007);
    let first = LivoxPoint { position: [1.0, 2.0, 3.0], offset_time: 0, reflectivity: 200, line: 1 };
    assert_eq!((scan.points.len(), scan.points[0], scan.points[1].offset_time), (2, first, 99_000_000));
}

fn image(encoding: &str, size: [u32; 2], step: u32, big: bool, data: &[u8]) -> Vec<u8> {
    let mut w = Writer::cdr(false);
    w.header((1, 0), "camera").u32(size[1]).u32(size[0]).text(encoding).u8(big.into()).u32(step).blob(data);
    w.bytes
}

const IMAGE: &str = "sensor_msgs/msg/Image";

#[test]
fn pictures_of_every_format() {
    let depth = |bytes: Vec<u8>| with(IMAGE, &bytes, |r| Ok(Image::of(r)?.depth(1000.0).unwrap())).unwrap();
    let padded = [0xe8, 3, 0, 0, 9, 9, 0xd0, 7, 1, 0, 9, 9];
    assert_eq!(depth(image("16UC1", [2, 2], 6, false, &padded)), [1.0, 0.0, 2.0, 0.001]);
    assert_eq!(depth(image("mono16", [2, 1], 4, true, &[3, 0xe8, 0, 1])), [1.0, 0.001]);
    let mut floats = [1.5f32, f32::NAN, f32::INFINITY, -1.0].map(f32::to_le_bytes).concat();
    assert_eq!(depth(image("32FC1", [4, 1], 16, false, &floats)), [1.5, 0.0, 0.0, 0.0]);
    floats[..4].reverse();
    assert_eq!(depth(image("32FC1", [1, 1], 0, true, &floats)), [1.5]);
    for (encoding, data, expected) in [
        ("rgb8", &[1, 2, 3][..], [1, 2, 3]),
        ("bgr8", &[3, 2, 1], [1, 2, 3]),
        ("8UC3", &[3, 2, 1], [1, 2, 3]),
        ("rgba8", &[1, 2, 3, 9], [1, 2, 3]),
        ("bgra8", &[3, 2, 1, 9], [1, 2, 3]),
        ("mono8", &[7], [7; 3]),
    ] {
        let bytes = image(encoding, [1, 1], data.len() as u32, false, data);
        with(IMAGE, &bytes, |r| {
            let image = Image::of(r)?;
            assert_eq!((image.colors().unwrap(), image.depth(1000.0)), (vec![expected], None), "{encoding}");
            Ok(())
        })
        .unwrap();
    }
    let refused =
        |bytes: Vec<u8>, part: &str| says(with(IMAGE, &bytes, |r| Image::of(r).map(|i| i.width)), part);
    refused(image("bayer_rggb8", [1, 1], 1, false, &[1]), "encoding is \"bayer_rggb8\"; 16UC1");
    refused(image("rgb8", [2, 2], 6, false, &[0; 11]), "data is 11 bytes in rows of 6 for 2 x 2 pixels of 3");
    refused(image("rgb8", [2, 1], 5, false, &[0; 11]), "in rows of 5");
    refused(image("rgb8", [u32::MAX, u32::MAX], 0, false, &[0; 11]), "data is 11 bytes");
}

#[test]
fn packed_pictures_are_what_their_bytes_say() {
    let png = [0x89, b'P', b'N', b'G', 1, 2];
    let message = |format: &str, data: &[u8]| {
        let mut w = Writer::cdr(false);
        w.header((1, 0), "camera").text(format).blob(data);
        w.bytes
    };
    let kind = "sensor_msgs/msg/CompressedImage";
    let is = |bytes: &[u8], check: &dyn Fn(Compressed<'_>) -> bool| {
        let right = with(kind, bytes, |r| Ok(check(CompressedImage::of(r)?.content)));
        assert!(right.unwrap());
    };
    is(&message("jpeg", &[0xff, 0xd8, 0xff]), &|c| c == Compressed::Color(&[0xff, 0xd8, 0xff]));
    is(&message("bgr8; png compressed bgr8", &png), &|c| c == Compressed::Color(&png));
    is(&message("16UC1; png compressed", &png), &|c| c == Compressed::DepthMillimeters(&png));
    is(&message("16UC1; compressedDepth", &[&[0; 12][..], &png].concat()), &|c| {
        c == Compressed::DepthMillimeters(&png)
    });
    let head = [&[0; 4][..], &100.0f32.to_le_bytes(), &(-3.0f32).to_le_bytes(), &png].concat();
    is(&message("32FC1; compressedDepth png", &head), &|c| match c {
        // As the transport writes it: value = a / depth + b.
        Compressed::DepthInverse(_, inverse) => {
            (1..60).all(|v: u16| (100.0 / inverse.depth(v) - 3.0 - f32::from(v)).abs() < 1e-3)
                && inverse.depth(0) == 0.0
        }
        _ => false,
    });
    for (format, data) in [
        ("16UC1; compressedDepth rvl", &[0; 40][..]),
        ("h264", &[0, 0, 0, 1]),
        ("32FC1; compressedDepth", &[0; 12]),
    ] {
        says(
            with(kind, &message(format, data), |r| CompressedImage::of(r).map(drop)),
            &format!("format is \"{format}\""),
        );
    }
}

#[test]
fn cameras_of_ros_1_and_2() {
    let numbers = |w: &mut Writer| {
        w.text("plumb_bob").u32(5);
        (0..5).for_each(|k| {
            w.f64(0.1 * f64::from(k));
        });
        for n in [9, 9, 12] {
            (0..n).for_each(|k| {
                w.f64(f64::from(k) + 500.0);
            });
        }
        w.u32(0).u32(2).u32(0).u32(0).u32(0).u32(0).u8(0);
    };
    let mut w = Writer::cdr(false);
    w.header((1, 0), "camera").u32(480).u32(640);
    numbers(&mut w);
    let two = with("sensor_msgs/msg/CameraInfo", &w.bytes, CameraInfo::of).unwrap();
    let text = "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] P\n\
        uint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n===\n\
        MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n";
    let mut w = Writer::ros1();
    w.header((1, 0), "/camera").u32(480).u32(640);
    numbers(&mut w);
    let decoder =
        Decoder::new(&topic("sensor_msgs/CameraInfo", Encoding::Ros1, DefinitionFormat::Ros1Msg, text))
            .unwrap();
    let one = CameraInfo::of(&decoder.decode(&w.bytes).unwrap().record).unwrap();
    assert_eq!(one, two);
    assert_eq!(
        (one.pinhole(), one.is_distorted(), one.binning),
        (Some([500.0, 504.0, 502.0, 505.0]), true, [0, 2])
    );
    assert_eq!((one.width, one.height, one.p[11]), (640, 480, 511.0));
}

#[test]
fn poses_of_every_message() {
    let put = |w: &mut Writer| {
        (1..8).for_each(|k| {
            w.f64(f64::from(k));
        });
    };
    let expected = RawTransform { translation: [1.0, 2.0, 3.0], quaternion: [4.0, 5.0, 6.0, 7.0] };
    let zeros = |w: &mut Writer, n: usize| {
        (0..n).for_each(|_| {
            w.f64(0.0);
        });
    };
    let check = |found: StampedTransform, child: &str| {
        assert_eq!((found.header.stamp, &*found.header.frame), (3_500_000_000, "map"));
        assert_eq!((&*found.child, found.transform), (child, expected));
    };
    let mut w = Writer::cdr(true);
    w.header((3, 500_000_000), "/map").text("base");
    put(&mut w);
    zeros(&mut w, 36 + 6 + 36);
    check(with("nav_msgs/msg/Odometry", &w.bytes, odometry).unwrap(), "base");
    let mut w = Writer::cdr(false);
    w.header((3, 500_000_000), "map");
    put(&mut w);
    check(with("geometry_msgs/msg/PoseStamped", &w.bytes, pose_stamped).unwrap(), "");
    zeros(&mut w, 36);
    check(with("geometry_msgs/msg/PoseWithCovarianceStamped", &w.bytes, pose_with_covariance).unwrap(), "");
    let mut w = Writer::cdr(false);
    w.header((9, 0), "map").u32(2).header((3, 500_000_000), "");
    put(&mut w);
    w.header((3, 500_000_000), "map");
    put(&mut w);
    let found = with("nav_msgs/msg/Path", &w.bytes, path).unwrap();
    assert_eq!(found.len(), 2);
    found.into_iter().for_each(|p| check(p, ""));
    for kind in ["tf2_msgs/msg/TFMessage", "tf/tfMessage"] {
        let mut w = Writer::cdr(false);
        w.u32(1).header((3, 500_000_000), "map").text("/laser");
        put(&mut w);
        let mut found = with(kind, &w.bytes, transforms).unwrap();
        check(found.remove(0), "laser");
    }
}

proptest! {
    /// Whatever the bytes: no panic, and no point outside of the data.
    #[test]
    fn no_bytes_make_a_cloud_panic(at in 0..400usize, put in prop::collection::vec(any::<u8>(), 1..9), big in any::<bool>()) {
        let mut bytes = grid(big).bytes();
        let at = at.min(bytes.len());
        let end = (at + put.len()).min(bytes.len());
        bytes.splice(at..end, put);
        let _ = with(CLOUD, &bytes, |record| {
            let cloud = PointCloud::of(record)?;
            assert_eq!(cloud.points().count(), cloud.len());
            if let Some(position) = cloud.position() {
                cloud.points().for_each(|p| { let _ = position.map(|f| f.read(p).to_f64()); });
            }
            let _ = PointTimes::infer(&cloud, None);
            Ok(())
        });
    }
}
