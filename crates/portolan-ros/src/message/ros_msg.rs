//! `.msg` text of ROS 1 and ROS 2.
//!
//! ```text
//! std_msgs/Header header            # a comment
//! float32[<=8] ranges               # ROS 2: at most eight
//! string<=5 name "abc"              # ROS 2: a bound, a default
//! uint8 FIRST=1                     # a constant: not in messages
//! ================================================================================
//! MSG: std_msgs/Header
//! builtin_interfaces/Time stamp
//! string frame_id
//! ```

use super::fault::Fault;
use super::schema::{
    Count, Dialect, LONGEST_ARRAY, MOST_FIELDS, MOST_TYPES, Primitive, RawElement, RawField, RawStructure,
    type_name,
};

/// The structures of a text; the first is `root`'s.
pub(super) fn parse(root: &str, text: &str, dialect: Dialect) -> Result<Vec<RawStructure>, Fault> {
    let mut structures = vec![RawStructure { name: type_name(root), fields: Vec::new() }];
    let mut after_rule = false;
    for (i, line) in text.lines().enumerate() {
        let at = |fault: Fault| fault.within(&format!("line {} of the definition", i + 1));
        let line = line.trim();
        if line.len() >= 3 && line.bytes().all(|b| b == b'=') {
            after_rule = true;
            continue;
        }
        if after_rule && let Some(name) = line.strip_prefix("MSG:") {
            if structures.len() >= MOST_TYPES {
                return Err(at(Fault::new(
                    "the number of types",
                    format!("more than {MOST_TYPES}"),
                    "no message of ROS has so many",
                )));
            }
            structures.push(RawStructure { name: type_name(name), fields: Vec::new() });
            after_rule = false;
            continue;
        }
        after_rule &= line.is_empty();
        if let Some(field) = field(line, dialect).map_err(at)? {
            let Some(structure) = structures.last_mut() else { continue };
            if structure.fields.len() >= MOST_FIELDS {
                return Err(at(Fault::new(
                    "the number of fields",
                    format!("more than {MOST_FIELDS}"),
                    "no message of ROS has so many",
                )));
            }
            if structure.fields.iter().any(|f| f.name == field.name) {
                let advice = "a type has each field once; record the topic again";
                return Err(at(Fault::new("the field", format!("{} for a second time", field.name), advice)));
            }
            structure.fields.push(field);
        }
    }
    Ok(structures)
}

/// The field of a line; `None` for a comment, a constant, an empty line.
fn field(line: &str, dialect: Dialect) -> Result<Option<RawField>, Fault> {
    let Some(kind) = line.split_whitespace().next().filter(|k| !k.starts_with('#')) else { return Ok(None) };
    let rest = line[kind.len()..].trim_start();
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    if after.trim_start().starts_with('=') {
        return Ok(None);
    }
    if name.is_empty() {
        return Err(Fault::new("the line", line, "a field is a type and a name"));
    }
    let (element, count) = element(kind, dialect)?;
    Ok(Some(RawField { name: name.to_owned(), element, count }))
}

/// What `float32[<=8]` is.
fn element(text: &str, dialect: Dialect) -> Result<(RawElement, Count), Fault> {
    let bad = || {
        Fault::new("the type", text, "write it as float32, float32[], float32[9], float32[<=9] or string<=9")
    };
    let (kind, count) = match text.strip_suffix(']') {
        None => (text, Count::One),
        Some(array) => {
            let (kind, length) = array.rsplit_once('[').ok_or_else(bad)?;
            let count = match length.trim() {
                "" => Count::Sequence,
                bound if bound.starts_with("<=") => Count::Sequence,
                number => Count::Fixed(fixed(number)?),
            };
            (kind, count)
        }
    };
    // A bound of a string changes nothing in the bytes.
    let kind = kind.split_once("<=").map_or(kind, |(kind, _)| kind);
    Ok((named(kind, dialect)?, count))
}

/// The length of an array.
pub(super) fn fixed(number: &str) -> Result<usize, Fault> {
    let length = number.trim().parse::<usize>().ok().filter(|n| *n <= LONGEST_ARRAY);
    length.ok_or_else(|| {
        Fault::new("the length of an array", number, format!("give a number up to {LONGEST_ARRAY}"))
    })
}

fn named(kind: &str, dialect: Dialect) -> Result<RawElement, Fault> {
    use Primitive::*;
    Ok(RawElement::Number(match kind {
        "bool" => Bool,
        "int8" => I8,
        // ROS 1's byte is signed.
        "byte" if dialect == Dialect::Ros1 => I8,
        "uint8" | "char" | "byte" => U8,
        "int16" => I16,
        "uint16" => U16,
        "int32" => I32,
        "uint32" => U32,
        "int64" => I64,
        "uint64" => U64,
        "float32" => F32,
        "float64" => F64,
        "string" => return Ok(RawElement::Text),
        "wstring" => {
            return Err(Fault::new(
                "the type",
                kind,
                "wide strings are not read: their size is not the same everywhere",
            ));
        }
        _ => {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
            if kind.is_empty() || !kind.chars().all(plain) {
                return Err(Fault::new("the type", kind, "a type is a word, or package/Word"));
            }
            return Ok(RawElement::Named(kind.to_owned()));
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::super::schema::link;
    use super::*;
    use proptest::prelude::*;

    fn both(root: &str, text: &str, dialect: Dialect) -> Result<Vec<(String, Vec<String>)>, String> {
        let raw = parse(root, text, dialect).map_err(|f| f.of("t").to_string())?;
        let linked = link(root, raw, dialect).map_err(|f| f.of("t").to_string())?;
        let fields = |s: &super::super::schema::Structure| {
            s.fields.iter().map(|f| format!("{} {:?} {:?}", f.name, f.element, f.count)).collect()
        };
        Ok(linked.structures.iter().map(|s| (s.name.clone(), fields(s))).collect())
    }

    #[test]
    fn types_of_ros_1_with_a_header_and_its_seq() {
        let text = "# doc\nHeader header\nuint8 A=1\nstring S=a=b # c\nfloat32[] ranges # m\nbyte[3]  raw\nSub sub\n\n\
            ====================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n\
            ====================\nMSG: my_msgs/Sub\nduration d\n";
        let found = both("my_msgs/Top", text, Dialect::Ros1).unwrap();
        assert_eq!(found[0].0, "my_msgs/Top");
        assert_eq!(
            found[0].1,
            [
                "header Structure(1) One",
                "ranges Number(F32) Sequence",
                "raw Number(I8) Fixed(3)",
                "sub Structure(3) One"
            ]
        );
        assert_eq!(found[1].1, ["seq Number(U32) One", "stamp Structure(2) One", "frame_id Text One"]);
        assert_eq!(
            found[2],
            ("time".into(), vec!["secs Number(U32) One".into(), "nsecs Number(U32) One".into()])
        );
        assert_eq!(found[4].1, ["secs Number(I32) One", "nsecs Number(I32) One"]);
    }

    #[test]
    fn types_of_ros_2_with_bounds_and_defaults() {
        let text = "std_msgs/Header header\nint32 X = 5\nint32 y 7\nstring<=5 name \"a=b\"\nstring<=3[<=4] names\nbyte b\nchar c\nfloat64[<=9] k\nEmpty e\n\
            ===\nMSG: my/Empty\n===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
        let found = both("my/msg/Top", text, Dialect::Ros2).unwrap();
        assert_eq!(
            found[0].1,
            [
                "header Structure(1) One",
                "y Number(I32) One",
                "name Text One",
                "names Text Sequence",
                "b Number(U8) One",
                "c Number(U8) One",
                "k Number(F64) Sequence",
                "e Structure(3) One"
            ]
        );
        assert_eq!(found[3].1, ["structure_needs_at_least_one_member Number(U8) One"]);
    }

    #[test]
    fn what_cannot_be_a_message_is_refused() {
        for (text, part) in [
            ("A a\n===\nMSG: p/A\nB b\n===\nMSG: p/B\nA[] a\n", "p/A, which holds itself"),
            ("Top t\n", "which holds itself"),
            ("Gone g\n", "missing: p/Gone"),
            ("float32[999999999999] x\n", "the length of an array is 999999999999"),
            ("float32[-1] x\n", "the length of an array is -1"),
            ("float32\n", "the line is float32"),
            ("wstring w\n", "wide strings"),
            ("a$ b\n", "the type is a$"),
            ("uint8 a\nuint8 a\n", "a for a second time"),
            ("E[] e\n===\nMSG: p/E\n", "take no bytes"),
            ("A[1000] a\n===\nMSG: p/A\nB[1000] b\n===\nMSG: p/B\nuint8 x\n", "with 1000000 values"),
        ] {
            let error = both("p/Top", text, Dialect::Ros1).unwrap_err();
            assert!(error.contains(part) && !error.contains('\n'), "{text:?}: {error}");
        }
        // Each type holds the next twice: 2^23 values, of which none takes a byte.
        let mut text = "T1 a\nT1 b\n".to_owned();
        for k in 1..23 {
            text += &format!("===\nMSG: p/T{k}\nT{} a\nT{} b\n", k + 1, k + 1);
        }
        text += "===\nMSG: p/T23\nuint8 x\n";
        assert!(both("p/Top", &text, Dialect::Ros1).unwrap_err().contains("values"));
        let deep: String = (0..40).map(|k| format!("T{} a\n===\nMSG: p/T{}\n", k + 1, k + 1)).collect();
        assert!(
            both("p/Top", &format!("{deep}uint8 x\n"), Dialect::Ros1)
                .unwrap_err()
                .contains("within each other")
        );
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "([a-zA-Z/=#\\[\\]<>0-9: ]{0,12}[\n ]){0,12}", two in any::<bool>()) {
            let dialect = if two { Dialect::Ros2 } else { Dialect::Ros1 };
            if let Err(e) = both("p/Top", &text, dialect) {
                prop_assert!(!e.contains('\n'));
            }
        }
    }
}
