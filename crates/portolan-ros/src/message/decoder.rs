//! Reads the messages of a topic by the definition that the file has for it.

use super::fault::Fault;
use super::schema::{Definition, Dialect, link, type_name};
use super::values::{Reader, Record};
use super::{builtin, idl, ros_msg};
use crate::Result;
use crate::container::{DefinitionFormat, Encoding, Topic};

/// The most bytes of a definition: those of ROS have some ten thousand.
const LONGEST_DEFINITION: usize = 4 << 20;

/// Reads the messages of one topic.
///
/// ```
/// use portolan_ros::container::{DefinitionFormat, Encoding, Topic};
/// use portolan_ros::message::Decoder;
///
/// let topic = Topic {
///     name: "/height".into(),
///     type_name: "std_msgs/msg/Float32".into(),
///     encoding: Encoding::Cdr,
///     definition_format: DefinitionFormat::Ros2Msg,
///     definition: "float32 data".into(),
///     publisher: None,
///     latched: false,
/// };
/// let decoder = Decoder::new(&topic)?;
/// let message = decoder.decode(&[0, 1, 0, 0, 0, 0, 0x80, 0x3f])?;
/// assert_eq!(message.record.number("data")?, 1.0);
/// # Ok::<(), portolan_ros::BagError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Decoder {
    topic: String,
    definition: Definition,
    encoding: Encoding,
    notes: Vec<String>,
}

/// A message that was read.
#[derive(Clone, Debug)]
pub struct Message<'a> {
    /// Its fields.
    pub record: Record<'a>,
    /// Bytes behind its end. The up to three with which CDR fills the last four are not counted.
    pub trailing: usize,
}

impl Decoder {
    /// Parses the definition of a topic. Where the file has none, the usual one of ROS 2 is taken for the types that are read
    /// here, and [`Decoder::notes`] says so.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for a definition that cannot be read, or that holds itself or more than a
    /// message can; for a missing one of another type.
    pub fn new(topic: &Topic) -> Result<Self> {
        let (definition, note) = define(topic).map_err(|f| f.of(&topic.name))?;
        let mut notes = definition.notes.clone();
        notes.extend(note);
        Ok(Self { topic: topic.name.clone(), definition, encoding: topic.encoding, notes })
    }

    /// What had to be assumed.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Reads a message: its strings and arrays stay the bytes that were given.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) where the bytes end before the message does, or are in an encoding that is not
    /// read.
    pub fn decode<'a>(&'a self, bytes: &'a [u8]) -> Result<Message<'a>> {
        self.read(bytes).map_err(|f| f.of(&self.topic))
    }

    fn read<'a>(&'a self, bytes: &'a [u8]) -> Result<Message<'a>, Fault> {
        let mut reader = match self.encoding {
            Encoding::Ros1 => Reader::ros1(&self.topic, &self.definition, bytes),
            Encoding::Cdr => Reader::cdr(&self.topic, &self.definition, bytes)?,
        };
        let record = reader.record(0)?;
        let left = reader.left();
        let filling = if self.encoding == Encoding::Cdr && left < 4 { left } else { 0 };
        Ok(Message { record, trailing: left - filling })
    }
}

fn define(topic: &Topic) -> Result<(Definition, Option<String>), Fault> {
    let (root, text) = (type_name(&topic.type_name), &topic.definition);
    if text.len() > LONGEST_DEFINITION {
        let value = format!("{} bytes long", text.len());
        return Err(Fault::new("the definition", value, "definitions of ROS have some ten thousand"));
    }
    let msg = |dialect| ros_msg::parse(&root, text, dialect).and_then(|raw| link(&root, raw, dialect));
    match topic.definition_format {
        DefinitionFormat::Ros1Msg => Ok((msg(Dialect::Ros1)?, None)),
        DefinitionFormat::Ros2Msg => Ok((msg(Dialect::Ros2)?, None)),
        DefinitionFormat::Ros2Idl => Ok((link(&root, idl::parse(text)?, Dialect::Ros2)?, None)),
        DefinitionFormat::Missing if topic.encoding == Encoding::Cdr && builtin::is_known(&root) => {
            let mut definition = link(&root, Vec::new(), Dialect::Ros2)?;
            definition.notes.clear();
            let note = format!("the file has no definition of {root}: the usual one of ROS 2 is taken");
            Ok((definition, Some(note)))
        }
        DefinitionFormat::Missing => {
            let advice = "record it with ROS 2 Iron or later, whose bags have definitions";
            Err(Fault::new("the definition", format!("missing for {root}"), advice))
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A topic of a type.
    pub(crate) fn topic(kind: &str, encoding: Encoding, format: DefinitionFormat, definition: &str) -> Topic {
        Topic {
            name: "/t".into(),
            type_name: kind.into(),
            encoding,
            definition_format: format,
            definition: definition.into(),
            publisher: None,
            latched: false,
        }
    }

    /// Writes values as the encodings of ROS have them: for tests, apart from the reader.
    pub(crate) struct Writer {
        pub(crate) bytes: Vec<u8>,
        cdr: bool,
        big: bool,
    }

    impl Writer {
        pub(crate) fn ros1() -> Self {
            Self { bytes: Vec::new(), cdr: false, big: false }
        }

        pub(crate) fn cdr(big: bool) -> Self {
            Self { bytes: vec![0, u8::from(!big), 0, 0], cdr: true, big }
        }

        fn put(&mut self, little: &[u8]) -> &mut Self {
            while self.cdr && !(self.bytes.len() - 4).is_multiple_of(little.len()) {
                self.bytes.push(0xaa);
            }
            let at = self.bytes.len();
            self.bytes.extend(little);
            if self.big {
                self.bytes[at..].reverse();
            }
            self
        }

        pub(crate) fn u8(&mut self, v: u8) -> &mut Self {
            self.put(&[v])
        }

        pub(crate) fn u16(&mut self, v: u16) -> &mut Self {
            self.put(&v.to_le_bytes())
        }

        pub(crate) fn u32(&mut self, v: u32) -> &mut Self {
            self.put(&v.to_le_bytes())
        }

        pub(crate) fn u64(&mut self, v: u64) -> &mut Self {
            self.put(&v.to_le_bytes())
        }

        pub(crate) fn f32(&mut self, v: f32) -> &mut Self {
            self.put(&v.to_le_bytes())
        }

        pub(crate) fn f64(&mut self, v: f64) -> &mut Self {
            self.put(&v.to_le_bytes())
        }

        pub(crate) fn text(&mut self, v: &str) -> &mut Self {
            self.u32(v.len() as u32 + u32::from(self.cdr));
            self.bytes.extend(v.as_bytes());
            if self.cdr {
                self.bytes.push(0);
            }
            self
        }

        /// A length, then values.
        pub(crate) fn f32s(&mut self, all: &[f32]) -> &mut Self {
            self.u32(all.len() as u32);
            all.iter().for_each(|v| {
                self.f32(*v);
            });
            self
        }

        pub(crate) fn blob(&mut self, all: &[u8]) -> &mut Self {
            self.u32(all.len() as u32);
            self.bytes.extend(all);
            self
        }

        /// A header as both have it, but for `seq`.
        pub(crate) fn header(&mut self, stamp: (u32, u32), frame: &str) -> &mut Self {
            if !self.cdr {
                self.u32(7);
            }
            self.u32(stamp.0).u32(stamp.1).text(frame)
        }
    }

    const MIXED: &str = "uint8 a\nfloat64 b\nstring s\nfloat32[] r\nuint16[3] f\nIn[] i\nstring[] names\nint64[] none\nuint8 end\n===\nMSG: p/In\nuint8 k\nuint32 v\n";

    fn mixed(mut w: Writer) -> Vec<u8> {
        w.u8(200).f64(-2.5).text("hé").f32s(&[1.5, f32::INFINITY, -0.0]);
        w.u16(1).u16(2).u16(65535).u32(2).u8(1).u32(70_000).u8(2).u32(80_000);
        w.u32(2).text("").text("x").u32(0).u8(9);
        w.bytes
    }

    #[test]
    fn values_of_all_encodings_by_name() {
        for (bytes, encoding) in [
            (mixed(Writer::ros1()), Encoding::Ros1),
            (mixed(Writer::cdr(false)), Encoding::Cdr),
            (mixed(Writer::cdr(true)), Encoding::Cdr),
        ] {
            let decoder = Decoder::new(&topic("p/Top", encoding, DefinitionFormat::Ros1Msg, MIXED)).unwrap();
            let message = decoder.decode(&bytes).unwrap();
            let record = &message.record;
            assert_eq!(message.trailing, 0);
            assert_eq!((record.number("a").unwrap(), record.number("b").unwrap()), (200.0, -2.5));
            assert_eq!((&*record.text("s").unwrap(), record.integer("end").unwrap()), ("hé", 9));
            assert_eq!(record.numbers("r").unwrap().iter().collect::<Vec<_>>(), [1.5, f64::INFINITY, -0.0]);
            assert_eq!(record.numbers("f").unwrap().iter().sum::<f64>(), 65538.0);
            let inner: Vec<_> =
                record.records("i").unwrap().iter().map(|r| r.unwrap().size("v").unwrap()).collect();
            assert_eq!(inner, [70_000, 80_000]);
            assert!(record.numbers("none").unwrap().is_empty());
            // The reader borrows: an array is where the message is.
            let within = bytes.as_ptr_range();
            assert!(within.contains(&record.numbers("r").unwrap().bytes_for_test().as_ptr()));
            for (name, part) in
                [("gone", "p/Top.gone is missing; the definition has a, b, s"), ("a", "p/Top.a is a number")]
            {
                let error = record.text(name).unwrap_err().to_string();
                assert!(error.starts_with("/t: ") && error.contains(part), "{error}");
            }
            // Every cut is an error, none a panic; bytes behind it are told.
            for cut in 0..bytes.len() {
                assert!(decoder.decode(&bytes[..cut]).is_err(), "{cut}");
            }
            let longer = [&bytes[..], &[0; 5]].concat();
            assert_eq!(decoder.decode(&longer).unwrap().trailing, 5);
            assert_eq!(
                decoder.decode(&longer[..bytes.len() + 3]).unwrap().trailing,
                if encoding == Encoding::Cdr { 0 } else { 3 }
            );
        }
    }

    #[test]
    fn lengths_and_encodings_that_cannot_be_are_refused() {
        let decoder = Decoder::new(&topic(
            "p/T",
            Encoding::Cdr,
            DefinitionFormat::Ros2Msg,
            "E[] e\n===\nMSG: p/E\nuint8 x\n",
        ))
        .unwrap();
        for (bytes, part) in [
            (vec![0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1], "e.[1].x.its size is 1 bytes where 0 are left"),
            (vec![0, 3, 0, 0, 0, 0, 0, 0], "the encapsulation is 0x0003 (a parameter list)"),
            (vec![0, 7, 0, 0], "(XCDR version 2)"),
            (vec![0, 1, 0], "the length of the message is 3"),
        ] {
            let error = decoder.decode(&bytes).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn missing_definitions_are_the_usual_ones_and_told() {
        let decoder =
            Decoder::new(&topic("sensor_msgs/msg/LaserScan", Encoding::Cdr, DefinitionFormat::Missing, ""))
                .unwrap();
        assert!(decoder.notes()[0].contains("no definition of sensor_msgs/LaserScan"));
        for (kind, encoding) in
            [("my_msgs/msg/Own", Encoding::Cdr), ("sensor_msgs/LaserScan", Encoding::Ros1)]
        {
            let error =
                Decoder::new(&topic(kind, encoding, DefinitionFormat::Missing, "")).unwrap_err().to_string();
            assert!(error.contains("the definition is missing for"), "{error}");
        }
        let text = "std_msgs/Header header\n";
        let decoder =
            Decoder::new(&topic("p/msg/T", Encoding::Cdr, DefinitionFormat::Ros2Msg, text)).unwrap();
        assert!(decoder.notes()[0].contains("does not define std_msgs/Header"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(which in 0..3usize, at in 0..120usize, put in proptest::collection::vec(any::<u8>(), 0..9)) {
            let writer = [Writer::ros1(), Writer::cdr(false), Writer::cdr(true)].into_iter().nth(which).unwrap();
            let encoding = if which == 0 { Encoding::Ros1 } else { Encoding::Cdr };
            let mut bytes = mixed(writer);
            let at = at.min(bytes.len());
            let end = (at + put.len()).min(bytes.len());
            bytes.splice(at..end, put);
            let decoder = Decoder::new(&topic("p/Top", encoding, DefinitionFormat::Ros1Msg, MIXED)).unwrap();
            if let Ok(message) = decoder.decode(&bytes)
                && let Ok(records) = message.record.records("i")
            {
                prop_assert!(records.iter().all(|r| r.is_ok()));
            }
        }
    }
}
