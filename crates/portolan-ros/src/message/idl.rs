//! OMG IDL, as ROS 2 writes it beside `.msg`: modules, structs, typedefs of arrays, sequences, bounded strings. Constants,
//! annotations, comments and `#include` lines are passed over.
//!
//! ```text
//! IDL: geometry_msgs/msg/Pair
//! #include "geometry_msgs/msg/Point.idl"
//! module geometry_msgs { module msg {
//!   typedef double double__9[9];
//!   struct Pair { @verbatim(language="comment", text="..") geometry_msgs::msg::Point a; double__9 k; sequence<float, 8> r; };
//! }; };
//! ```

use std::collections::HashMap;

use super::fault::Fault;
use super::ros_msg::fixed;
use super::schema::{
    Count, MOST_FIELDS, MOST_TYPES, Primitive, RawElement, RawField, RawStructure, type_name,
};

/// Modules within modules.
const DEEPEST: usize = 16;

/// All structures of a text.
pub(super) fn parse(text: &str) -> Result<Vec<RawStructure>, Fault> {
    let words = words(text)?;
    let mut parser =
        Parser { words: &words, at: 0, path: Vec::new(), typedefs: HashMap::new(), structures: Vec::new() };
    parser.all()?;
    Ok(parser.structures)
}

/// Words, numbers, and single marks; `::` is one. Strings are `"`.
fn words(text: &str) -> Result<Vec<&str>, Fault> {
    let mut words = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let Some(first) = rest.chars().next() else { return Ok(words) };
        let line = || rest.find('\n').unwrap_or(rest.len());
        let length = match first {
            '#' => {
                rest = &rest[line()..];
                continue;
            }
            '=' if rest.starts_with("===") => {
                rest = &rest[line()..];
                continue;
            }
            _ if rest.starts_with("IDL:") || rest.starts_with("//") => {
                rest = &rest[line()..];
                continue;
            }
            _ if rest.starts_with("/*") => {
                rest = rest.find("*/").map_or("", |end| &rest[end + 2..]);
                continue;
            }
            '"' | '\'' => {
                let end = end_of_string(rest, first).ok_or_else(|| {
                    Fault::new("the definition", "a string without its end", "copy or record the file again")
                })?;
                words.push("\"");
                rest = &rest[end..];
                continue;
            }
            c if c.is_alphanumeric() || c == '_' || c == '-' || c == '.' => rest
                .find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '+')))
                .unwrap_or(rest.len()),
            ':' if rest.starts_with("::") => 2,
            c => c.len_utf8(),
        };
        words.push(&rest[..length]);
        rest = &rest[length..];
    }
}

fn end_of_string(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (i, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return Some(i + 1),
            _ => {}
        }
    }
    None
}

struct Parser<'a> {
    words: &'a [&'a str],
    at: usize,
    path: Vec<String>,
    /// By name without modules, and by its full name.
    typedefs: HashMap<String, (RawElement, Count)>,
    structures: Vec<RawStructure>,
}

impl<'a> Parser<'a> {
    fn next(&mut self) -> Option<&'a str> {
        let word = self.words.get(self.at).copied();
        self.at += 1;
        word
    }

    fn peek(&self) -> Option<&'a str> {
        self.words.get(self.at).copied()
    }

    fn expect(&mut self, mark: &str) -> Result<(), Fault> {
        match self.next() {
            Some(word) if word == mark => Ok(()),
            other => Err(self.bad(other, mark)),
        }
    }

    fn bad(&self, found: Option<&str>, wanted: &str) -> Fault {
        let advice = format!("{wanted} was expected; record the topic again");
        Fault::new("a word of the definition", found.unwrap_or("missing"), advice)
    }

    fn all(&mut self) -> Result<(), Fault> {
        while let Some(word) = self.next() {
            match word {
                "module" => {
                    let name = self.next().ok_or_else(|| self.bad(None, "a name"))?;
                    if self.path.len() >= DEEPEST {
                        return Err(Fault::new(
                            "the modules",
                            "too many within each other",
                            "record the topic again",
                        ));
                    }
                    self.path.push(name.to_owned());
                    self.expect("{")?;
                }
                "}" => {
                    self.path.pop();
                }
                ";" => {}
                "@" => self.annotation(),
                "struct" => self.structure()?,
                "typedef" => self.typedef()?,
                "const" | "enum" | "union" | "bitmask" => self.skip_statement(),
                other => return Err(self.bad(Some(other), "module, struct, typedef or const")),
            }
        }
        Ok(())
    }

    /// Behind a `@`: a name, perhaps with something in parentheses.
    fn annotation(&mut self) {
        self.next();
        if self.peek() == Some("(") {
            let mut depth = 0usize;
            while let Some(word) = self.next() {
                match word {
                    "(" => depth += 1,
                    ")" => depth -= 1,
                    _ => {}
                }
                if depth == 0 {
                    return;
                }
            }
        }
    }

    fn skip_statement(&mut self) {
        let mut depth = 0usize;
        while let Some(word) = self.next() {
            match word {
                "{" => depth += 1,
                "}" => depth = depth.saturating_sub(1),
                ";" if depth == 0 => return,
                _ => {}
            }
        }
    }

    fn structure(&mut self) -> Result<(), Fault> {
        let name = self.next().ok_or_else(|| self.bad(None, "a name"))?;
        let full = type_name(&format!("{}/{name}", self.path.join("/")));
        self.expect("{")?;
        let mut fields: Vec<RawField> = Vec::new();
        loop {
            match self.peek() {
                Some("}") => {
                    self.next();
                    break;
                }
                Some("@") => {
                    self.next();
                    self.annotation();
                    continue;
                }
                None => return Err(self.bad(None, "}")),
                Some(_) => {}
            }
            let (element, count) = self.kind()?;
            loop {
                let field = self.next().ok_or_else(|| self.bad(None, "the name of a field"))?.to_owned();
                let count = self.array(count)?;
                if fields.len() >= MOST_FIELDS || fields.iter().any(|f| f.name == field) {
                    let advice = "a type has each field once, and no message of ROS has thousands";
                    return Err(Fault::new("the field", field, advice));
                }
                fields.push(RawField { name: field, element: element.clone(), count });
                match self.next() {
                    Some(",") => {}
                    Some(";") => break,
                    other => return Err(self.bad(other, ";")),
                }
            }
        }
        if self.structures.len() >= MOST_TYPES {
            return Err(Fault::new(
                "the number of types",
                format!("more than {MOST_TYPES}"),
                "no message of ROS has so many",
            ));
        }
        // The generators put this into a structure without fields; the other reader of definitions adds it anew.
        self.structures.push(RawStructure { name: full, fields });
        Ok(())
    }

    fn typedef(&mut self) -> Result<(), Fault> {
        let (element, count) = self.kind()?;
        let name = self.next().ok_or_else(|| self.bad(None, "a name"))?.to_owned();
        let count = self.array(count)?;
        self.expect(";")?;
        self.typedefs.insert(name, (element, count));
        Ok(())
    }

    /// `[9]` behind a name.
    fn array(&mut self, count: Count) -> Result<Count, Fault> {
        let mut all: Option<usize> = None;
        while self.peek() == Some("[") {
            self.next();
            let length = self.next().ok_or_else(|| self.bad(None, "a length"))?;
            let length = fixed(length)?;
            all = Some(all.unwrap_or(1).saturating_mul(length));
            self.expect("]")?;
        }
        match (all, count) {
            (None, count) => Ok(count),
            (Some(n), Count::One) => Ok(Count::Fixed(fixed(&n.to_string())?)),
            (Some(_), _) => Err(Fault::new("the type", "an array of arrays", "such a type cannot be read")),
        }
    }

    /// A type.
    fn kind(&mut self) -> Result<(RawElement, Count), Fault> {
        use Primitive::*;
        let word = self.next().ok_or_else(|| self.bad(None, "a type"))?;
        let number = match word {
            "boolean" => Bool,
            "octet" | "uint8" | "char" => U8,
            "int8" => I8,
            "short" | "int16" => I16,
            "uint16" => U16,
            "int32" => I32,
            "uint32" => U32,
            "int64" => I64,
            "uint64" => U64,
            "float" => F32,
            "double" => F64,
            "long" => match self.peek() {
                Some("long") => {
                    self.next();
                    I64
                }
                Some("double") => return Err(Fault::new("the type", "long double", "it is not read")),
                _ => I32,
            },
            "unsigned" => match self.next() {
                Some("short") => U16,
                Some("long") if self.peek() == Some("long") => {
                    self.next();
                    U64
                }
                Some("long") => U32,
                other => return Err(self.bad(other, "short or long")),
            },
            "string" => {
                self.bound()?;
                return Ok((RawElement::Text, Count::One));
            }
            "wstring" | "wchar" => {
                return Err(Fault::new(
                    "the type",
                    word,
                    "wide strings are not read: their size is not the same everywhere",
                ));
            }
            "sequence" => {
                self.expect("<")?;
                let (element, count) = self.kind()?;
                if count != Count::One {
                    return Err(Fault::new("the type", "a sequence of arrays", "such a type cannot be read"));
                }
                if self.peek() == Some(",") {
                    self.next();
                    self.next();
                }
                self.expect(">")?;
                return Ok((element, Count::Sequence));
            }
            first => {
                let mut parts = vec![first];
                while self.peek() == Some("::") {
                    self.next();
                    parts.push(self.next().ok_or_else(|| self.bad(None, "a name"))?);
                }
                if let Some(found) = parts.last().and_then(|last| self.typedefs.get(*last)) {
                    return Ok(found.clone());
                }
                if !parts.iter().all(|p| p.chars().all(|c| c.is_alphanumeric() || c == '_')) {
                    return Err(self.bad(Some(first), "a type"));
                }
                let name = match parts[..] {
                    [one] => format!("{}/{one}", self.path.join("/")),
                    _ => parts.join("/"),
                };
                return Ok((RawElement::Named(type_name(&name)), Count::One));
            }
        };
        Ok((RawElement::Number(number), Count::One))
    }

    fn bound(&mut self) -> Result<(), Fault> {
        if self.peek() == Some("<") {
            self.next();
            self.next();
            self.expect(">")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::schema::{Dialect, link};
    use super::*;
    use proptest::prelude::*;

    const PAIR: &str = "================================================================================\nIDL: my/msg/Pair\n\
        // generated\n#include \"geometry_msgs/msg/Point.idl\"\nmodule my { module msg {\n\
        module Pair_Constants { @verbatim (language=\"comment\", text=\"a ; } \\\" b\") const octet X = 1; };\n\
        typedef double double__9[9];\nstruct Pair {\n@unit(value=\"m\") geometry_msgs::msg::Point a;\ndouble__9 k;\n\
        sequence<float, 8> r; /* c */ unsigned long long t; string<5> s; long i, j; uint8 m[2][3]; };\n}; };\n\
        ================================================================================\nIDL: geometry_msgs/msg/Point\n\
        module geometry_msgs { module msg { struct Point { double x; double y; double z; }; }; };\n";

    #[test]
    fn the_structs_of_a_text() {
        let raw = parse(PAIR).unwrap_or_else(|f| panic!("{}", f.of("")));
        let linked = link("my/Pair", raw, Dialect::Ros2).unwrap_or_else(|f| panic!("{}", f.of("")));
        let fields: Vec<String> = linked.structures[0]
            .fields
            .iter()
            .map(|f| format!("{} {:?} {:?}", f.name, f.element, f.count))
            .collect();
        assert_eq!(
            fields,
            [
                "a Structure(1) One",
                "k Number(F64) Fixed(9)",
                "r Number(F32) Sequence",
                "t Number(U64) One",
                "s Text One",
                "i Number(I32) One",
                "j Number(I32) One",
                "m Number(U8) Fixed(6)"
            ]
        );
    }

    #[test]
    fn what_is_no_idl_is_refused() {
        for (text, part) in [
            ("struct A { wstring w; };", "wide strings"),
            ("struct A { long x", "; was expected"),
            ("struct A { sequence<double__9[3]> x; };", "> was expected"),
            ("hello", "module, struct"),
            ("struct A { long x; long x; };", "the field is x"),
            ("const string X = \"a", "a string without its end"),
        ] {
            let error = parse(text).unwrap_err().of("t").to_string();
            assert!(error.contains(part), "{error}");
        }
        assert!(parse(&"module a {".repeat(99)).is_err());
    }

    proptest! {
        #[test]
        fn no_change_of_a_text_makes_it_panic(at in 0..PAIR.len(), cut in 0..40usize, put in "[a-z{}()<>;:\"@ ]{0,6}") {
            let end = (at + cut).min(PAIR.len());
            let text = format!("{}{put}{}", &PAIR[..at], &PAIR[end..]);
            let _ = parse(&text).map(|raw| link("my/Pair", raw, Dialect::Ros2));
        }
    }
}
