//! What a message is made of: structures of named fields, and the checks that a definition must pass.

use std::collections::HashMap;

use super::builtin;
use super::fault::Fault;

/// Structures within structures: no message of ROS has more than eight.
const DEEPEST: usize = 24;
/// The most values in one message that arrays of numbers and sequences do not hold.
const MOST_VALUES: u64 = 1 << 16;
/// The most numbers in an array of fixed length.
pub(super) const LONGEST_ARRAY: usize = 1 << 28;
/// The most types of one definition.
pub(super) const MOST_TYPES: usize = 1024;
/// The most fields of one type.
pub(super) const MOST_FIELDS: usize = 4096;

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // Their names say it.
pub enum Primitive {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Primitive {
    /// Bytes of one.
    pub const fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Whether it is a whole number.
    pub const fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// The type of a field, or of the elements of its array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// A number.
    Number(Primitive),
    /// A string.
    Text,
    /// Another structure, by its index in the definition.
    Structure(usize),
}

/// How many of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// One, not in an array.
    One,
    /// Always so many.
    Fixed(usize),
    /// As many as the message says.
    Sequence,
}

/// A field of a structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its type.
    pub element: Element,
    /// How many.
    pub count: Count,
}

/// Named fields in the order in which messages have them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    /// `sensor_msgs/LaserScan`, for ROS 2 as well.
    pub name: String,
    /// The fields.
    pub fields: Vec<Field>,
}

/// The definition of a message: its own structure first, then those that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// All structures; messages are of the first.
    pub structures: Vec<Structure>,
    /// What had to be assumed: types that the file does not define.
    pub notes: Vec<String>,
}

/// A type before names are looked up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum RawElement {
    Number(Primitive),
    Text,
    Named(String),
}

/// A field before names are looked up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RawField {
    pub(super) name: String,
    pub(super) element: RawElement,
    pub(super) count: Count,
}

/// A structure before names are looked up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RawStructure {
    pub(super) name: String,
    pub(super) fields: Vec<RawField>,
}

/// The name of a type without the `msg` of ROS 2: `sensor_msgs/msg/LaserScan` and `sensor_msgs/LaserScan` are one.
pub fn type_name(name: &str) -> String {
    let parts: Vec<&str> = name.trim().split('/').filter(|p| !p.is_empty()).collect();
    match parts[..] {
        [package, _, .., kind] => format!("{package}/{kind}"),
        [package, kind] => format!("{package}/{kind}"),
        _ => parts.join("/"),
    }
}

/// In which ROS a definition is written: they differ in what `time` is and whether an empty structure has a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    Ros1,
    Ros2,
}

/// Looks names up, from `root` on, and checks what comes out.
pub(super) fn link(root: &str, raw: Vec<RawStructure>, dialect: Dialect) -> Result<Definition, Fault> {
    let mut by_name = HashMap::new();
    for structure in raw {
        // The first definition counts: a file repeats dependencies.
        by_name.entry(structure.name.clone()).or_insert(structure);
    }
    let mut linker =
        Linker { by_name, dialect, done: HashMap::new(), structures: Vec::new(), assumed: Vec::new() };
    linker.add(&type_name(root), &mut Vec::new())?;
    let Linker { structures, assumed, .. } = linker;
    let notes = match &assumed[..] {
        [] => Vec::new(),
        names => vec![format!(
            "the file does not define {}: the usual definition of ROS 2 is taken",
            names.join(", ")
        )],
    };
    let definition = Definition { structures, notes };
    check_sizes(&definition)?;
    Ok(definition)
}

struct Linker {
    by_name: HashMap<String, RawStructure>,
    dialect: Dialect,
    done: HashMap<String, usize>,
    structures: Vec<Structure>,
    assumed: Vec<String>,
}

impl Linker {
    /// The index of a structure; `above` has the names of those that hold it.
    fn add(&mut self, name: &str, above: &mut Vec<String>) -> Result<usize, Fault> {
        if above.iter().any(|n| n == name) {
            let value = format!("{name}, which holds itself");
            return Err(Fault::new(
                "the definition",
                value,
                "such a type cannot be read; record the topic again",
            ));
        }
        if let Some(&index) = self.done.get(name) {
            return Ok(index);
        }
        if above.len() >= DEEPEST || self.structures.len() >= MOST_TYPES {
            let value =
                format!("more than {DEEPEST} types within each other, or more than {MOST_TYPES} types");
            return Err(Fault::new("the definition", value, "it cannot be a message of ROS"));
        }
        let raw = self.find(name)?;
        let index = self.structures.len();
        self.structures.push(Structure { name: name.to_owned(), fields: Vec::new() });
        above.push(name.to_owned());
        let mut fields = Vec::with_capacity(raw.fields.len());
        for field in raw.fields {
            let element = match field.element {
                RawElement::Number(kind) => Element::Number(kind),
                RawElement::Text => Element::Text,
                RawElement::Named(kind) => {
                    let kind = self.resolve(&kind, name);
                    Element::Structure(self.add(&kind, above).map_err(|f| f.within(&field.name))?)
                }
            };
            fields.push(Field { name: field.name, element, count: field.count });
        }
        if fields.is_empty() && self.dialect == Dialect::Ros2 {
            // What the generators of ROS 2 put into a structure without fields.
            let name = "structure_needs_at_least_one_member".to_owned();
            fields.push(Field { name, element: Element::Number(Primitive::U8), count: Count::One });
        }
        above.pop();
        self.structures[index].fields = fields;
        self.done.insert(name.to_owned(), index);
        Ok(index)
    }

    /// The full name of a type that is named within another: without a package it is of the same one.
    fn resolve(&self, kind: &str, within: &str) -> String {
        if kind.contains('/') {
            return type_name(kind);
        }
        let package = within.split('/').next().unwrap_or("");
        match kind {
            "Header" if !self.by_name.contains_key(&format!("{package}/Header")) => "std_msgs/Header".into(),
            "time" | "duration" => kind.to_owned(),
            _ => format!("{package}/{kind}"),
        }
    }

    fn find(&mut self, name: &str) -> Result<RawStructure, Fault> {
        if let Some(found) = self.by_name.get(name) {
            return Ok(found.clone());
        }
        if let Some(found) = builtin::clock(name, self.dialect) {
            return Ok(found);
        }
        let usual = if self.dialect == Dialect::Ros2 { builtin::structure(name)? } else { None };
        let found = usual.ok_or_else(|| {
            let advice = "it is not in the definition that the file has for it; record the topic again";
            Fault::new("the definition of a type", format!("missing: {name}"), advice)
        })?;
        self.assumed.push(name.to_owned());
        Ok(found)
    }
}

/// Refuses what would make few bytes into many values.
fn check_sizes(definition: &Definition) -> Result<(), Fault> {
    // Structures come before those that they hold, but for ones that were known already: from the last to the first
    // is not enough, so each is asked with a memory.
    let mut known = vec![None; definition.structures.len()];
    for index in 0..definition.structures.len() {
        let (values, _) = sizes(definition, index, &mut known)?;
        if values > MOST_VALUES {
            let value = format!("{} with {values} values", definition.structures[index].name);
            return Err(Fault::new("the definition", value, "no message of ROS has so many fields"));
        }
    }
    Ok(())
}

/// Values in one structure, and the fewest bytes that it takes. Recursion ends: `link` refuses structures that hold
/// themselves and those too deep.
fn sizes(
    definition: &Definition,
    index: usize,
    known: &mut [Option<(u64, u64)>],
) -> Result<(u64, u64), Fault> {
    if let Some(found) = known[index] {
        return Ok(found);
    }
    let (mut values, mut bytes) = (0u64, 0u64);
    for field in &definition.structures[index].fields {
        let (v, b) = match field.element {
            Element::Number(kind) => (1, kind.size() as u64),
            Element::Text => (1, 4),
            Element::Structure(inner) => {
                let (v, b) = sizes(definition, inner, known)?;
                if b == 0 && field.count != Count::One {
                    let value = format!("an array of {}", definition.structures[inner].name);
                    return Err(Fault::new(
                        &field.name,
                        value,
                        "its elements take no bytes: such an array has no end",
                    ));
                }
                (v, b)
            }
        };
        let (v, b) = match (field.count, field.element) {
            (Count::One, _) => (v, b),
            (Count::Sequence, _) => (1, 4),
            (Count::Fixed(n), Element::Number(_)) => (1, b.saturating_mul(n as u64)),
            (Count::Fixed(n), _) => (v.saturating_mul(n as u64), b.saturating_mul(n as u64)),
        };
        values = values.saturating_add(v);
        bytes = bytes.saturating_add(b);
    }
    known[index] = Some((values, bytes));
    Ok((values, bytes))
}
