//! Pictures: depth and color, plain and packed. What is packed (JPEG, PNG) is handed on as it is.

use super::header::Header;
use super::values::{ByteOrder, Record};
use crate::Result;

/// What the pixels of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// Depth in whole millimeters, 0 for none: `16UC1`, `mono16`.
    Millimeters,
    /// Depth in meters, NaN for none: `32FC1`.
    Meters,
    /// Gray: `mono8`, `8UC1`.
    Gray,
    /// Red, green, blue: `rgb8`.
    Rgb,
    /// Blue, green, red: `bgr8`, `8UC3` (as OpenCV has them).
    Bgr,
    /// Red, green, blue and one more: `rgba8`.
    Rgba,
    /// Blue, green, red and one more: `bgra8`, `8UC4`.
    Bgra,
}

impl PixelFormat {
    fn of(encoding: &str) -> Option<Self> {
        Some(match encoding.trim().to_ascii_lowercase().as_str() {
            "16uc1" | "mono16" => Self::Millimeters,
            "32fc1" => Self::Meters,
            "mono8" | "8uc1" => Self::Gray,
            "rgb8" => Self::Rgb,
            "bgr8" | "8uc3" => Self::Bgr,
            "rgba8" => Self::Rgba,
            "bgra8" | "8uc4" => Self::Bgra,
            _ => return None,
        })
    }

    /// Bytes of a pixel.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Gray => 1,
            Self::Millimeters => 2,
            Self::Rgb | Self::Bgr => 3,
            Self::Meters | Self::Rgba | Self::Bgra => 4,
        }
    }

    /// Whether pixels are depth.
    pub const fn is_depth(self) -> bool {
        matches!(self, Self::Millimeters | Self::Meters)
    }
}

/// A picture whose size was checked.
#[derive(Clone, Debug)]
pub struct Image<'a> {
    /// When and in which (optical) frame it was taken.
    pub header: Header,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What its pixels are.
    pub format: PixelFormat,
    data: &'a [u8],
    step: usize,
    order: ByteOrder,
}

impl<'a> Image<'a> {
    /// Reads a `sensor_msgs/Image`.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for an encoding that is not read (Bayer, YUV), and for sizes that the data does not
    /// have.
    pub fn of(message: &Record<'a>) -> Result<Self> {
        let [width, height, step] = [message.size("width")?, message.size("height")?, message.size("step")?];
        let encoding = message.text("encoding")?;
        let format = PixelFormat::of(&encoding).ok_or_else(|| {
            let advice = "16UC1, mono16, 32FC1, mono8, rgb8, bgr8, rgba8 and bgra8 are read";
            message.fault("encoding", format!("\"{encoding}\""), advice)
        })?;
        let data = message.bytes("data")?;
        let row = width.saturating_mul(format.bytes());
        let step = if step == 0 { row } else { step };
        let needed = if height == 0 { 0 } else { step.saturating_mul(height - 1).saturating_add(row) };
        if step < row || data.len() < needed {
            let value = format!(
                "{} bytes in rows of {step} for {width} x {height} pixels of {}",
                data.len(),
                format.bytes()
            );
            return Err(message.fault(
                "data",
                value,
                "the driver's message is wrong, or its recording was cut",
            ));
        }
        let big = message.integer("is_bigendian")? != 0;
        let order = if big { ByteOrder::Big } else { ByteOrder::Little };
        Ok(Self { header: Header::of(message)?, width, height, format, data, step, order })
    }

    fn rows(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (data, step, row) = (self.data, self.step, self.width * self.format.bytes());
        (0..if row == 0 { 0 } else { self.height }).map(move |r| &data[r * step..][..row])
    }

    /// Depth along the optical axis (meters), row by row; 0 where there is none. `units_per_meter`: of whole numbers, 1000 in
    /// ROS (REP 118). `None` for a picture that is no depth.
    pub fn depth(&self, units_per_meter: f64) -> Option<Vec<f32>> {
        let big = self.order == ByteOrder::Big;
        let two = |b: &[u8; 2]| if big { u16::from_be_bytes(*b) } else { u16::from_le_bytes(*b) };
        let four = |b: &[u8; 4]| if big { f32::from_be_bytes(*b) } else { f32::from_le_bytes(*b) };
        Some(match self.format {
            PixelFormat::Millimeters => self
                .rows()
                .flat_map(|r| r.as_chunks::<2>().0)
                .map(|b| (f64::from(two(b)) / units_per_meter) as f32)
                .collect(),
            PixelFormat::Meters => self
                .rows()
                .flat_map(|r| r.as_chunks::<4>().0)
                .map(|b| Some(four(b)).filter(|d| d.is_finite() && *d > 0.0).unwrap_or(0.0))
                .collect(),
            _ => return None,
        })
    }

    /// Red, green and blue, row by row. `None` for depth.
    pub fn colors(&self) -> Option<Vec<[u8; 3]>> {
        let bytes = || self.rows();
        Some(match self.format {
            PixelFormat::Gray => bytes().flatten().map(|v| [*v; 3]).collect(),
            PixelFormat::Rgb => bytes().flat_map(|r| r.as_chunks::<3>().0).copied().collect(),
            PixelFormat::Bgr => {
                bytes().flat_map(|r| r.as_chunks::<3>().0).map(|[b, g, r]| [*r, *g, *b]).collect()
            }
            PixelFormat::Rgba => {
                bytes().flat_map(|r| r.as_chunks::<4>().0).map(|[r, g, b, _]| [*r, *g, *b]).collect()
            }
            PixelFormat::Bgra => {
                bytes().flat_map(|r| r.as_chunks::<4>().0).map(|[b, g, r, _]| [*r, *g, *b]).collect()
            }
            PixelFormat::Millimeters | PixelFormat::Meters => return None,
        })
    }
}

/// A packed picture.
#[derive(Clone, Debug)]
pub struct CompressedImage<'a> {
    /// When and in which (optical) frame it was taken.
    pub header: Header,
    /// What it is.
    pub content: Compressed<'a>,
}

/// The bytes of a packed picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compressed<'a> {
    /// JPEG or PNG of colors.
    Color(&'a [u8]),
    /// PNG of 16 bits with depth in millimeters, 0 for none.
    DepthMillimeters(&'a [u8]),
    /// PNG of 16 bits with inverse depth: [`InverseDepth`].
    DepthInverse(&'a [u8], InverseDepth),
}

/// How the transport `compressedDepth` packs meters in 16 bits: `value = a / depth + b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseDepth {
    a: f32,
    b: f32,
}

impl InverseDepth {
    /// Depth (meters) of a value; 0 where there is none.
    pub fn depth(self, value: u16) -> f32 {
        let depth = self.a / (f32::from(value) - self.b);
        if value == 0 || !depth.is_finite() || depth <= 0.0 { 0.0 } else { depth }
    }
}

/// The first bytes of every PNG.
const PNG: &[u8] = &[0x89, b'P', b'N', b'G'];
/// Bytes before the PNG of `compressedDepth`: a number for the kind and two parameters.
const DEPTH_HEADER: usize = 12;

impl<'a> CompressedImage<'a> {
    /// Reads a `sensor_msgs/CompressedImage`; its first bytes and the words of its format decide what it is.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for formats that are not read (RVL, H.264).
    pub fn of(message: &Record<'a>) -> Result<Self> {
        let header = Header::of(message)?;
        let (format, data) = (message.text("format")?, message.bytes("data")?);
        let bad = |what: &str| {
            let start = data.get(..8).unwrap_or(data);
            let value = format!("\"{format}\" with data that begins with {start:02x?}");
            message.fault("format", value, format!("{what}; JPEG, PNG and compressedDepth with PNG are read"))
        };
        let words = format.to_ascii_lowercase();
        let content = if words.contains("compresseddepth") {
            let Some((head, png)) =
                data.split_at_checked(DEPTH_HEADER).filter(|(_, png)| png.starts_with(PNG))
            else {
                return Err(bad("it is no PNG behind twelve bytes"));
            };
            let float = |at: usize| f32::from_le_bytes(head[at..at + 4].try_into().unwrap_or_default());
            if words.starts_with("32fc1") {
                let inverse = InverseDepth { a: float(4), b: float(8) };
                if !(inverse.a.is_finite() && inverse.a != 0.0 && inverse.b.is_finite()) {
                    return Err(bad("its parameters of depth are zero or not finite"));
                }
                Compressed::DepthInverse(png, inverse)
            } else {
                Compressed::DepthMillimeters(png)
            }
        } else if data.starts_with(PNG) && (words.starts_with("16uc1") || words.starts_with("mono16")) {
            Compressed::DepthMillimeters(data)
        } else if data.starts_with(PNG) || data.starts_with(&[0xff, 0xd8]) {
            Compressed::Color(data)
        } else {
            return Err(bad("it is neither JPEG nor PNG"));
        };
        Ok(Self { header, content })
    }
}
