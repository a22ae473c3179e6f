//! `PointCloud2`: points whose values lie where the message says.

use super::header::Header;
use super::schema::Primitive;
use super::values::{ByteOrder, Number, Record};
use crate::Result;

/// Where a value of a point lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointField {
    /// `x`, `intensity`, ..
    pub name: String,
    /// Bytes from the start of the point.
    pub offset: usize,
    /// The type of number.
    pub kind: Primitive,
    /// How many: 1 but for descriptors and the like.
    pub count: usize,
    order: ByteOrder,
}

impl PointField {
    /// The value of a point, given its bytes as [`PointCloud::points`] has them.
    #[inline]
    pub fn read(&self, point: &[u8]) -> Number {
        Number::read(self.kind, self.order, point.get(self.offset..).unwrap_or(&[]))
    }
}

/// The colors of a cloud.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ColorFields {
    /// Red, green and blue in the bits of one number of four bytes (`rgb`, `rgba`): 0x00RRGGBB.
    Packed(PointField),
    /// A field each.
    Separate([PointField; 3]),
}

/// A cloud as the message has it: points are read from its bytes when they are asked for.
#[derive(Clone, Debug)]
pub struct PointCloud<'a> {
    /// The time of the scan, which is its begin with most drivers and its end with some; and the frame of the points.
    pub header: Header,
    /// Points in a row.
    pub width: usize,
    /// Rows; 1 for a cloud without rows and columns.
    pub height: usize,
    /// Its fields, whose places were checked.
    pub fields: Vec<PointField>,
    /// Bytes behind the last point.
    pub trailing: usize,
    data: &'a [u8],
    point_step: usize,
    row_step: usize,
    order: ByteOrder,
}

impl<'a> PointCloud<'a> {
    /// Reads a `sensor_msgs/PointCloud2`.
    ///
    /// # Errors
    /// [`BagError::Message`](crate::BagError) for fields that lie outside of their point, and for sizes that the data does not have.
    pub fn of(message: &Record<'a>) -> Result<Self> {
        let [width, height] = [message.size("width")?, message.size("height")?];
        let [point_step, row_step] = [message.size("point_step")?, message.size("row_step")?];
        let data = message.bytes("data")?;
        let order = if message.integer("is_bigendian")? != 0 { ByteOrder::Big } else { ByteOrder::Little };
        let row = width.saturating_mul(point_step);
        // In a single row nothing comes after it: writers leave its step at zero.
        let row_step = if height <= 1 || row_step == 0 { row } else { row_step };
        if row_step < row {
            let value = format!("{row_step} for {width} points of {point_step} bytes");
            return Err(message.fault(
                "row_step",
                value,
                "rows would overlap; the driver's message is wrong",
            ));
        }
        let empty = width == 0 || height == 0;
        let needed = if empty { 0 } else { row_step.saturating_mul(height - 1).saturating_add(row) };
        if data.len() < needed || (!empty && point_step == 0) {
            let value = format!(
                "{} bytes where {width} x {height} points of {point_step} bytes take {needed}",
                data.len()
            );
            return Err(message.fault(
                "data",
                value,
                "the driver's message is wrong, or its recording was cut",
            ));
        }
        let mut fields = Vec::new();
        for field in message.records("fields")?.iter() {
            fields.push(read_field(&field?, point_step, order, empty)?);
        }
        let trailing = data.len() - needed.max(row_step.saturating_mul(height).min(data.len()));
        Ok(Self {
            header: Header::of(message)?,
            width: if empty { 0 } else { width },
            height: if empty { 0 } else { height },
            fields,
            trailing,
            data,
            point_step,
            row_step,
            order,
        })
    }

    /// Number of points, unusable ones as well.
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bytes of each point, row by row.
    pub fn points(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (data, step) = (self.data, self.point_step.max(1));
        let (row_step, row) = (self.row_step, self.width * self.point_step);
        (0..self.height).flat_map(move |r| data[r * row_step..][..row].chunks_exact(step))
    }

    /// The field of the first of these names that it has, in capitals or not.
    pub fn field(&self, names: &[&str]) -> Option<&PointField> {
        names.iter().find_map(|name| self.fields.iter().find(|f| f.name.eq_ignore_ascii_case(name)))
    }

    /// The fields of the position; `None` where one is missing.
    pub fn position(&self) -> Option<[&PointField; 3]> {
        Some([self.field(&["x"])?, self.field(&["y"])?, self.field(&["z"])?])
    }

    /// The fields of the color.
    pub fn color(&self) -> Option<ColorFields> {
        let packed = self.field(&["rgb", "rgba"]).filter(|f| f.kind.size() == 4);
        if let Some(field) = packed {
            let field = PointField { kind: Primitive::U32, order: self.order, ..field.clone() };
            return Some(ColorFields::Packed(field));
        }
        let one = |names: &[&str]| self.field(names).cloned();
        Some(ColorFields::Separate([one(&["r", "red"])?, one(&["g", "green"])?, one(&["b", "blue"])?]))
    }
}

fn read_field(field: &Record<'_>, point_step: usize, order: ByteOrder, empty: bool) -> Result<PointField> {
    let name = field.text("name")?.trim().to_owned();
    let [offset, count] = [field.size("offset")?, field.size("count")?];
    let code = field.integer("datatype")?;
    let kind = match code {
        1 => Primitive::I8,
        2 => Primitive::U8,
        3 => Primitive::I16,
        4 => Primitive::U16,
        5 => Primitive::I32,
        6 => Primitive::U32,
        7 => Primitive::F32,
        8 => Primitive::F64,
        _ => return Err(field.fault("datatype", format!("{code} for {name}"), "PointField has 1 to 8")),
    };
    // Old drivers write a count of zero for one.
    let count = count.max(1);
    if !empty && offset.saturating_add(count.saturating_mul(kind.size())) > point_step {
        let value = format!("{offset} for {name}");
        return Err(field.fault(
            "offset",
            value,
            format!("the field lies outside of its point of {point_step} bytes"),
        ));
    }
    Ok(PointField { name, offset, kind, count, order })
}
