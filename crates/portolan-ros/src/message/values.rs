//! Bytes to values by a definition. Numbers of an array stay bytes of the message, structures of an array are read one by one
//! when they are asked for: a message of 100 MB makes no tree.

use std::borrow::Cow;

use super::fault::Fault;
use super::schema::{Count, Definition, Element, Primitive, Structure};
use crate::{BagError, Result};

/// In which order the bytes of a number are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// The least byte first.
    Little,
    /// The greatest byte first.
    Big,
}

/// A number of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Whole numbers of all sizes and `bool`.
    Integer(i128),
    /// `float32`, `float64`.
    Real(f64),
}

impl Number {
    /// As a real number.
    pub fn to_f64(self) -> f64 {
        match self {
            Self::Integer(v) => v as f64,
            Self::Real(v) => v,
        }
    }

    /// Reads one. `bytes` has as many as the type.
    #[inline]
    pub(crate) fn read(kind: Primitive, order: ByteOrder, bytes: &[u8]) -> Self {
        macro_rules! read {
            ($t:ty) => {{
                // Callers slice by `Primitive::size`; fewer bytes would read as zeros.
                let all: [u8; size_of::<$t>()] =
                    bytes.get(..size_of::<$t>()).and_then(|b| b.try_into().ok()).unwrap_or_default();
                if order == ByteOrder::Little { <$t>::from_le_bytes(all) } else { <$t>::from_be_bytes(all) }
            }};
        }
        use Primitive::*;
        match kind {
            Bool | U8 => Self::Integer(read!(u8).into()),
            I8 => Self::Integer(read!(i8).into()),
            I16 => Self::Integer(read!(i16).into()),
            U16 => Self::Integer(read!(u16).into()),
            I32 => Self::Integer(read!(i32).into()),
            U32 => Self::Integer(read!(u32).into()),
            I64 => Self::Integer(read!(i64).into()),
            U64 => Self::Integer(read!(u64).into()),
            F32 => Self::Real(read!(f32).into()),
            F64 => Self::Real(read!(f64)),
        }
    }
}

/// What is in a message.
#[derive(Clone, Debug)]
enum Value<'a> {
    Number(Number),
    Text(&'a [u8]),
    Record(Record<'a>),
    Numbers(Numbers<'a>),
    Texts,
    Records(Records<'a>),
}

impl Value<'_> {
    fn word(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Text(_) => "a string",
            Self::Record(_) => "a structure",
            Self::Numbers(_) => "an array of numbers",
            Self::Texts => "an array of strings",
            Self::Records(_) => "an array of structures",
        }
    }
}

/// An array of numbers: the bytes of the message.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<'a> {
    bytes: &'a [u8],
    kind: Primitive,
    order: ByteOrder,
}

impl<'a> Numbers<'a> {
    /// How many.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.kind.size()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The numbers in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f64> + 'a {
        let (kind, order) = (self.kind, self.order);
        self.bytes.chunks_exact(kind.size()).map(move |b| Number::read(kind, order, b).to_f64())
    }

    /// As bytes, where they are.
    pub fn as_bytes(&self) -> Option<&'a [u8]> {
        matches!(self.kind, Primitive::U8 | Primitive::I8 | Primitive::Bool).then_some(self.bytes)
    }
}

/// An array of structures, read when they are asked for.
#[derive(Clone, Debug)]
pub struct Records<'a> {
    reader: Reader<'a>,
    count: usize,
    structure: usize,
}

impl<'a> Records<'a> {
    /// How many.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The structures in order.
    ///
    /// # Errors
    /// None in practice: the message was walked once to its end before.
    pub fn iter(&self) -> impl Iterator<Item = Result<Record<'a>>> + use<'a> {
        let (mut reader, structure) = (self.reader, self.structure);
        (0..self.count).map(move |_| reader.record(structure).map_err(|f| f.of(reader.topic)))
    }
}

/// A structure of a message, whose values are asked for by name.
#[derive(Clone, Debug)]
pub struct Record<'a> {
    topic: &'a str,
    structure: &'a Structure,
    values: Vec<Value<'a>>,
}

impl<'a> Record<'a> {
    /// The name of its type.
    pub fn type_name(&self) -> &'a str {
        &self.structure.name
    }

    /// Whether it has a field of this name.
    pub fn has(&self, name: &str) -> bool {
        self.structure.fields.iter().any(|f| f.name == name)
    }

    fn get(&self, name: &str) -> Result<&Value<'a>> {
        let place = self.structure.fields.iter().position(|f| f.name == name);
        place.and_then(|i| self.values.get(i)).ok_or_else(|| {
            let fields: Vec<&str> = self.structure.fields.iter().map(|f| &*f.name).take(40).collect();
            let advice = format!("the definition has {}; name a topic of another type", fields.join(", "));
            self.fault(name, "missing", advice)
        })
    }

    fn wrong<T>(&self, name: &str, found: &Value<'_>, wanted: &str) -> Result<T> {
        Err(self.fault(name, found.word(), format!("it should be {wanted}: another type of the same name")))
    }

    /// An error about one of its fields.
    pub(crate) fn fault(&self, name: &str, value: impl ToString, advice: impl Into<String>) -> BagError {
        Fault::new(format!("{}.{name}", self.structure.name), value, advice).of(self.topic)
    }

    /// A number.
    ///
    /// # Errors
    /// [`BagError::Message`] where the structure has no field of this name and kind. So below.
    pub fn number(&self, name: &str) -> Result<f64> {
        match self.get(name)? {
            Value::Number(number) => Ok(number.to_f64()),
            other => self.wrong(name, other, "a number"),
        }
    }

    /// A whole number.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn integer(&self, name: &str) -> Result<i128> {
        match self.get(name)? {
            Value::Number(Number::Integer(number)) => Ok(*number),
            other => self.wrong(name, other, "a whole number"),
        }
    }

    /// A whole number that is a size.
    ///
    /// # Errors
    /// As [`Record::number`], and for one below zero.
    pub fn size(&self, name: &str) -> Result<usize> {
        let number = self.integer(name)?;
        usize::try_from(number).map_err(|_| self.fault(name, number, "a size is not below zero"))
    }

    /// A string; bytes that are not UTF-8 become replacement characters.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn text(&self, name: &str) -> Result<Cow<'a, str>> {
        match self.get(name)? {
            Value::Text(bytes) => Ok(String::from_utf8_lossy(bytes)),
            other => self.wrong(name, other, "a string"),
        }
    }

    /// A structure.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn record(&self, name: &str) -> Result<&Record<'a>> {
        match self.get(name)? {
            Value::Record(record) => Ok(record),
            other => self.wrong(name, other, "a structure"),
        }
    }

    /// An array of numbers.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn numbers(&self, name: &str) -> Result<Numbers<'a>> {
        match self.get(name)? {
            Value::Numbers(numbers) => Ok(*numbers),
            other => self.wrong(name, other, "an array of numbers"),
        }
    }

    /// An array of bytes.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn bytes(&self, name: &str) -> Result<&'a [u8]> {
        let numbers = self.numbers(name)?;
        numbers
            .as_bytes()
            .ok_or_else(|| self.fault(name, "an array of other numbers", "it should be one of bytes"))
    }

    /// An array of structures.
    ///
    /// # Errors
    /// As [`Record::number`].
    pub fn records(&self, name: &str) -> Result<&Records<'a>> {
        match self.get(name)? {
            Value::Records(records) => Ok(records),
            other => self.wrong(name, other, "an array of structures"),
        }
    }
}

/// Where reading is, and how numbers lie there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reader<'a> {
    topic: &'a str,
    definition: &'a Definition,
    /// What positions are counted from: for CDR behind its first four bytes.
    bytes: &'a [u8],
    at: usize,
    order: ByteOrder,
    /// CDR: numbers begin at multiples of their size, strings end with a zero.
    cdr: bool,
}

impl<'a> Reader<'a> {
    /// ROS 1: little endian, nothing between values.
    pub(super) fn ros1(topic: &'a str, definition: &'a Definition, bytes: &'a [u8]) -> Self {
        Self { topic, definition, bytes, at: 0, order: ByteOrder::Little, cdr: false }
    }

    /// CDR: four bytes say in which order the rest is *(OMG DDSI-RTPS 2.5, 10.5)*.
    pub(super) fn cdr(topic: &'a str, definition: &'a Definition, bytes: &'a [u8]) -> Result<Self, Fault> {
        let Some((head, bytes)) = bytes.split_at_checked(4) else {
            return Err(Fault::new(
                "the length of the message",
                bytes.len(),
                "CDR has four bytes at least; the message is cut",
            ));
        };
        let order = match u16::from_be_bytes([head[0], head[1]]) {
            0x0000 => ByteOrder::Big,
            0x0001 => ByteOrder::Little,
            kind => {
                let word = match kind {
                    0x0002 | 0x0003 => " (a parameter list)",
                    0x0006..=0x000b => " (XCDR version 2)",
                    _ => "",
                };
                let advice = "only plain CDR (0 and 1), which ROS 2 writes, is read";
                return Err(Fault::new("the encapsulation", format!("{kind:#06x}{word}"), advice));
            }
        };
        Ok(Self { topic, definition, bytes, at: 0, order, cdr: true })
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        match self.bytes[self.at..].get(..length) {
            Some(found) => {
                self.at += length;
                Ok(found)
            }
            None => {
                let value = format!("{length} bytes where {} are left", self.left());
                Err(Fault::new(
                    "its size",
                    value,
                    "the message is cut, or is of another type than its topic says",
                ))
            }
        }
    }

    /// Passes over what stands before a number of this size in CDR.
    fn align(&mut self, size: usize) {
        if self.cdr {
            // What lies behind the end is found by `take`.
            self.at = self.at.next_multiple_of(size).min(self.bytes.len());
        }
    }

    fn number(&mut self, kind: Primitive) -> Result<Number, Fault> {
        self.align(kind.size());
        Ok(Number::read(kind, self.order, self.take(kind.size())?))
    }

    fn length(&mut self) -> Result<usize, Fault> {
        match self.number(Primitive::U32)? {
            Number::Integer(length) => Ok(length as usize),
            Number::Real(_) => unreachable!("lengths are whole numbers"),
        }
    }

    fn text(&mut self) -> Result<&'a [u8], Fault> {
        let length = self.length()?;
        let bytes = self.take(length)?;
        Ok(if self.cdr { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes })
    }

    fn numbers(&mut self, kind: Primitive, count: usize) -> Result<Numbers<'a>, Fault> {
        let mut bytes: &[u8] = &[];
        if count > 0 {
            self.align(kind.size());
            // What does not fit a `usize` does not fit the message.
            bytes = self.take(count.saturating_mul(kind.size()))?;
        }
        Ok(Numbers { bytes, kind, order: self.order })
    }

    /// The structure at this place. Depth and size of what is made are bounded by the definition, which was checked.
    pub(super) fn record(&mut self, structure: usize) -> Result<Record<'a>, Fault> {
        let definition = self.definition;
        let structure = &definition.structures[structure];
        let mut values = Vec::with_capacity(structure.fields.len());
        for field in &structure.fields {
            values.push(self.value(field.element, field.count).map_err(|f| f.within(&field.name))?);
        }
        Ok(Record { topic: self.topic, structure, values })
    }

    fn value(&mut self, element: Element, count: Count) -> Result<Value<'a>, Fault> {
        let count = match (count, element) {
            (Count::One, Element::Number(kind)) => return Ok(Value::Number(self.number(kind)?)),
            (Count::One, Element::Text) => return Ok(Value::Text(self.text()?)),
            (Count::One, Element::Structure(inner)) => return Ok(Value::Record(self.record(inner)?)),
            (Count::Fixed(n), _) => n,
            (Count::Sequence, _) => self.length()?,
        };
        match element {
            Element::Number(kind) => Ok(Value::Numbers(self.numbers(kind, count)?)),
            Element::Text => {
                for _ in 0..count {
                    self.text()?;
                }
                Ok(Value::Texts)
            }
            Element::Structure(structure) => {
                let records = Records { reader: *self, count, structure };
                for i in 0..count {
                    // Each takes a byte at least, so that a wrong count ends with the message.
                    self.skip(structure).map_err(|f| f.within(&format!("[{i}]")))?;
                }
                Ok(Value::Records(records))
            }
        }
    }

    /// Passes over a structure, without making anything.
    fn skip(&mut self, structure: usize) -> Result<(), Fault> {
        let definition = self.definition;
        for field in &definition.structures[structure].fields {
            self.skip_value(field.element, field.count).map_err(|f| f.within(&field.name))?;
        }
        Ok(())
    }

    fn skip_value(&mut self, element: Element, count: Count) -> Result<(), Fault> {
        let count = match count {
            Count::One => 1,
            Count::Fixed(n) => n,
            Count::Sequence => self.length()?,
        };
        match element {
            Element::Number(kind) => self.numbers(kind, count).map(drop),
            Element::Text => (0..count).try_for_each(|_| self.text().map(drop)),
            Element::Structure(inner) => (0..count).try_for_each(|_| self.skip(inner)),
        }
    }
}

#[cfg(test)]
impl<'a> Numbers<'a> {
    pub(crate) fn bytes_for_test(&self) -> &'a [u8] {
        self.bytes
    }
}
