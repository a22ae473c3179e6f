//! The messages between page and engine.
//!
//! The page asks with a JSON text, `{"id": 7, "view": "fusion", "ask": {"op": "step", "scans": 1}}`; what a view can be
//! asked is an enum in its folder. The answer carries the same `id`, and `ok` or `error`. Without arrays it is a JSON
//! text; with arrays it is binary, little-endian:
//!
//! ```text
//! "PSTU" | u32 length of the header | header: JSON, padded with spaces to a multiple of 8 | arrays, each padded to 8
//! ```
//!
//! where the header has `arrays: [{name, type, offset, length}]` beside `ok`: `type` is `f32`, `u32`, `u8` ..., `offset`
//! counts bytes from the end of the header, `length` counts values. Numbers of JSON are `f64`s and come across whole;
//! what is not finite is `null`.

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use serde_json::{Value, json};

/// A question, not yet read by the view that it is for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Message {
    /// Of the page's choosing; the answer has it, too.
    pub(super) id: u32,
    /// Who is asked.
    pub(super) view: View,
    /// What.
    pub(super) ask: Box<RawValue>,
}

/// Who can be asked.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum View {
    /// The studio itself.
    Studio,
    Fusion,
    Gallery,
    Clearance,
    Radiance,
    #[serde(rename = "3d")]
    ThreeD,
}

/// An answer.
#[derive(Debug, Default)]
pub struct Reply {
    /// The JSON part.
    pub body: Value,
    /// Typed arrays.
    pub arrays: Vec<Array>,
}

/// Values of one kind under a name.
#[derive(Debug)]
pub struct Array {
    /// What the page knows them by.
    pub name: &'static str,
    /// The values.
    pub values: Values,
}

/// The values of an [`Array`].
#[derive(Debug)]
pub enum Values {
    /// `Float32Array`
    F32(Vec<f32>),
    /// `Uint32Array`
    U32(Vec<u32>),
    /// `Uint16Array`
    U16(Vec<u16>),
    /// `Uint8Array`
    U8(Vec<u8>),
    /// `Int8Array`
    I8(Vec<i8>),
}

/// Why a question has no answer. The session goes on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The message cannot be read.
    #[error("not a message of the studio: {0}")]
    Malformed(#[from] serde_json::Error),
    /// It is one, but what it asks for cannot be.
    #[error("{0}")]
    Impossible(String),
}

impl Refusal {
    /// With these words.
    pub(super) fn new(why: impl ToString) -> Self {
        Self::Impossible(why.to_string())
    }
}

impl Reply {
    /// An answer without arrays.
    ///
    /// # Errors
    /// Where `body` cannot be JSON: a bug of the view.
    pub(super) fn of(body: impl Serialize) -> Result<Self, Refusal> {
        Ok(Self { body: serde_json::to_value(body)?, arrays: Vec::new() })
    }

    /// With one array more.
    pub(super) fn with(mut self, name: &'static str, values: impl Into<Values>) -> Self {
        self.arrays.push(Array { name, values: values.into() });
        self
    }
}

impl From<Vec<f32>> for Values {
    fn from(values: Vec<f32>) -> Self {
        Self::F32(values)
    }
}

impl From<Vec<u32>> for Values {
    fn from(values: Vec<u32>) -> Self {
        Self::U32(values)
    }
}

impl From<Vec<u16>> for Values {
    fn from(values: Vec<u16>) -> Self {
        Self::U16(values)
    }
}

impl From<Vec<u8>> for Values {
    fn from(values: Vec<u8>) -> Self {
        Self::U8(values)
    }
}

impl From<Vec<i8>> for Values {
    fn from(values: Vec<i8>) -> Self {
        Self::I8(values)
    }
}

impl Values {
    fn kind(&self) -> &'static str {
        match self {
            Self::F32(_) => "f32",
            Self::U32(_) => "u32",
            Self::U16(_) => "u16",
            Self::U8(_) => "u8",
            Self::I8(_) => "i8",
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::I8(v) => v.len(),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::F32(_) | Self::U32(_) => 4 * self.len(),
            Self::U16(_) => 2 * self.len(),
            Self::U8(_) | Self::I8(_) => self.len(),
        }
    }

    fn append_to(&self, out: &mut Vec<u8>) {
        match self {
            Self::F32(v) => append(out, v, |x| x.to_le_bytes()),
            Self::U32(v) => append(out, v, |x| x.to_le_bytes()),
            Self::U16(v) => append(out, v, |x| x.to_le_bytes()),
            Self::U8(v) => out.extend_from_slice(v),
            Self::I8(v) => out.extend(v.iter().map(|x| x.to_le_bytes()[0])),
        }
    }
}

/// Whole chunks, so that it is a copy: megabytes of a mesh go through here.
fn append<T: Copy, const N: usize>(out: &mut Vec<u8>, values: &[T], bytes: impl Fn(T) -> [u8; N]) {
    let start = out.len();
    out.resize(start + N * values.len(), 0);
    for (place, &value) in out[start..].as_chunks_mut::<N>().0.iter_mut().zip(values) {
        *place = bytes(value);
    }
}

/// What goes over the wire.
#[derive(Debug, PartialEq)]
pub enum Wire {
    /// A JSON document.
    Text(String),
    /// A header and arrays.
    Binary(Vec<u8>),
}

/// Bytes that arrays begin at multiples of.
const ALIGNMENT: usize = 8;

/// An answer as it goes over the wire; `id` is missing where the message had none that could be read.
pub(super) fn encode(id: Option<u32>, answer: Result<Reply, Refusal>) -> Wire {
    let reply = match answer {
        Ok(reply) => reply,
        Err(refusal) => return Wire::Text(json!({ "id": id, "error": refusal.to_string() }).to_string()),
    };
    if reply.arrays.is_empty() {
        return Wire::Text(json!({ "id": id, "ok": reply.body }).to_string());
    }
    let mut offset = 0;
    let mut arrays = Vec::new();
    for Array { name, values } in &reply.arrays {
        arrays.push(json!({ "name": name, "type": values.kind(), "offset": offset, "length": values.len() }));
        offset += values.bytes().next_multiple_of(ALIGNMENT);
    }
    let mut header = json!({ "id": id, "ok": reply.body, "arrays": arrays }).to_string().into_bytes();
    header.resize(header.len().next_multiple_of(ALIGNMENT), b' ');
    let mut out = Vec::with_capacity(ALIGNMENT + header.len() + offset);
    out.extend_from_slice(b"PSTU");
    out.extend_from_slice(&(header.len() as u32).to_le_bytes());
    out.extend_from_slice(&header);
    for array in &reply.arrays {
        array.values.append_to(&mut out);
        out.resize(out.len().next_multiple_of(ALIGNMENT), 0);
    }
    Wire::Binary(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_lie_where_the_header_says() {
        let reply =
            Reply::of(json!({ "n": 0.1 })).unwrap().with("a", vec![1u8, 2, 3]).with("b", vec![0.5f32]);
        let Wire::Binary(bytes) = encode(Some(9), Ok(reply)) else { panic!("not binary") };
        assert_eq!(&bytes[..4], b"PSTU");
        let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
        assert_eq!(header["id"], 9);
        assert_eq!(header["ok"]["n"], 0.1);
        let body = &bytes[8 + length..];
        assert_eq!(&body[..3], &[1, 2, 3]);
        let b = &header["arrays"][1];
        assert_eq!((b["type"].as_str(), b["length"].as_u64()), (Some("f32"), Some(1)));
        let at = b["offset"].as_u64().unwrap() as usize;
        assert_eq!(f32::from_le_bytes(body[at..at + 4].try_into().unwrap()), 0.5);
        assert_eq!(bytes.len() % 8, 0);
    }
}
