//! The document of `info` for people: one field a line, rounded, with units. Machines have it whole, by `--json`.

use serde_json::{Number, Value};

use crate::arguments::shown_bytes;

/// Fields of lengths, wherever they stand: their numbers are meters.
const METERS: [&str; 19] = [
    "resolution",
    "origin",
    "truncation",
    "path_length",
    "length",
    "smallest",
    "largest",
    "max_distance",
    "min",
    "max",
    "size",
    "min_range",
    "max_range",
    "declared_max_range",
    "no_return",
    "no_reading",
    "position",
    "far_from_origin",
    "edge",
];
/// Of times, in seconds.
const SECONDS: [&str; 3] = ["time_span", "seconds", "total"];

/// The fields of a document, those of an inner one further in.
pub(super) fn lines(value: &Value, indent: &str, text: &mut String) {
    lines_of(value, indent, "", text);
}

fn lines_of(value: &Value, indent: &str, within: &str, text: &mut String) {
    let Value::Object(fields) = value else { return };
    for (key, value) in fields {
        let name = key.replace('_', " ");
        match value {
            _ if indent == "  " && ["file", "kind"].contains(&key.as_str()) => {}
            Value::Null => {}
            Value::Object(inner) if inner.is_empty() => {}
            Value::Array(all) if all.is_empty() => {}
            Value::Object(_) => {
                text.push_str(&format!("{indent}{name}:\n"));
                lines_of(value, &format!("{indent}  "), key, text);
            }
            Value::Number(n) if key.contains("bytes") || within == "bytes" || key == "peak_memory" => {
                text.push_str(&format!("{indent}{name}: {}\n", shown_bytes(n.as_f64().unwrap_or(0.0))));
            }
            other => {
                text.push_str(&format!("{indent}{name}: {}{}\n", shown(other), unit(key, within, other)))
            }
        }
    }
}

/// What the numbers of a field are in. Whole numbers are counts, but within extents.
fn unit(key: &str, within: &str, value: &Value) -> &'static str {
    let is_measure = match value {
        Value::Number(n) => n.is_f64(),
        Value::Array(all) => all.iter().all(Value::is_number),
        _ => false,
    };
    match key {
        _ if !is_measure => "",
        "area" => " m²",
        "yaw" => " rad",
        _ if SECONDS.contains(&key) || within == "seconds" => " s",
        _ if METERS.contains(&key) => " m",
        _ => "",
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Number(n) => number(n),
        Value::String(s) => s.clone(),
        Value::Array(all) => all.iter().map(shown).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

/// To six digits, and to a tenth of a millimeter at least.
fn number(n: &Number) -> String {
    let Some(v) = n.as_f64().filter(|_| n.is_f64()) else { return n.to_string() };
    if v == 0.0 || !v.is_finite() {
        return v.abs().to_string();
    }
    let digits = (5 - v.abs().log10().floor() as i32).clamp(0, 12).max(if v.abs() >= 1e-3 { 4 } else { 0 });
    let text = format!("{v:.*}", digits as usize);
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    short.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_are_rounded_and_have_units() {
        let document = json!({
            "kind": "a map", "resolution": 0.05, "cells": 12, "area": 83.123_456_789, "bytes": 2048, "nothing": null,
            "extent": { "min": [-1.000_000_000_2, 0.0, 123_456.789_123], "size": [10.0, 2, 3] },
            "beams": { "max_range": 17 }, "seconds": { "fuse": 1.23456789 }, "share": 0.000_123_456_789,
        });
        let mut text = String::new();
        lines(&document, "  ", &mut text);
        for line in [
            "  resolution: 0.05 m\n",
            "  cells: 12\n",
            "  area: 83.1235 m²\n",
            "    min: -1, 0, 123456.7891 m\n",
            "    size: 10, 2, 3 m\n",
            "    max range: 17\n",
            "    fuse: 1.23457 s\n",
            "  share: 0.000123457\n",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        assert!(!text.contains("nothing") && !text.contains("kind"), "{text}");
    }
}
