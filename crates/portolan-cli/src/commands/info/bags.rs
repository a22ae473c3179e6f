//! `info` of a bag.

use std::fmt::Write;
use std::path::Path;

use portolan_io::scan_log::ScanLogOptions;
use portolan_io::{BagInfo, EdgeOfBag, TopicOfBag};
use serde_json::{Value, json};

/// What is in the bag, for programs and for people.
pub(super) fn about(path: &Path) -> anyhow::Result<(Value, String)> {
    let info = BagInfo::read(path, &ScanLogOptions::default())?;
    let command = info.map_options.as_ref().map(|options| {
        let words = options.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" ");
        format!("portolan map {} {words} --out DIR", quoted(&path.display().to_string()))
    });
    Ok((document(&info, command.as_deref()), text(&info, command.as_deref())))
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/_-.,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn document(info: &BagInfo, command: Option<&str>) -> Value {
    let topic = |t: &TopicOfBag| {
        json!({
            "name": t.name, "type": t.type_name, "messages": t.messages, "publisher": t.publisher,
            "steps_back": { "count": t.steps_back.0, "largest": t.steps_back.1 },
            "log_times": t.log_times, "rate": t.rate, "longest_gap": t.longest_gap, "frames": t.frames,
            "delay": t.delay, "read": t.is_read,
        })
    };
    let edge = |e: &EdgeOfBag| {
        json!({
            "parent": e.parent, "child": e.child, "static": e.is_static, "messages": e.messages,
            "stamps": e.stamps, "interval": e.interval, "longest_gap": e.longest_gap,
        })
    };
    let files = info.files.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes }));
    json!({
        "container": info.container,
        "files": files.collect::<Vec<_>>(),
        "chunks": info.chunks.iter().map(|(packing, n)| json!({ "packing": packing, "count": n })).collect::<Vec<_>>(),
        "log_times": info.log_times,
        "topics": info.topics.iter().map(topic).collect::<Vec<_>>(),
        "frames": { "edges": info.edges.iter().map(edge).collect::<Vec<_>>(), "roots": info.roots },
        "dimension": info.dimension,
        "choices": info.choices,
        "notes": info.notes,
        "map": command,
    })
}

fn text(info: &BagInfo, command: Option<&str>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let span = info.log_times.map_or(0.0, |[a, b]| b - a);
    let _ = writeln!(text, "  {} of {} file(s), {span:.2} s", info.container, info.files.len());
    let _ = writeln!(text, "  topics:");
    for t in &info.topics {
        let _ = write!(text, "    {} ({}): {} messages", t.name, t.type_name, t.messages);
        if let Some(publisher) = &t.publisher {
            let _ = write!(text, " by {publisher}");
        }
        if let Some(rate) = t.rate {
            let _ = write!(text, ", {rate:.1} Hz, longest gap {:.3} s", t.longest_gap);
        }
        if let (steps @ 1.., most) = t.steps_back {
            let _ = write!(text, ", the clock steps back {steps} times by up to {most:.3} s");
        }
        if !t.frames.is_empty() {
            let _ = write!(text, ", frame {}", t.frames.join(", "));
        }
        if let Some([least, most]) = t.delay {
            let _ = write!(text, ", recorded {least:.3} to {most:.3} s after the stamp");
        }
        let _ = writeln!(text, "{}", if t.is_read { "" } else { "; not read" });
    }
    if !info.edges.is_empty() {
        let _ = writeln!(text, "  frames (roots: {}):", info.roots.join(", "));
    }
    let start = info.log_times.map_or(0.0, |[a, _]| a);
    for e in &info.edges {
        let _ = write!(text, "    {} > {}: ", e.parent, e.child);
        let _ = match e.stamps {
            None => writeln!(text, "static"),
            Some([a, b]) => writeln!(
                text,
                "{} transforms every {:.3} s from {:.2} to {:.2} s, longest gap {:.3} s",
                e.messages,
                e.interval,
                a - start,
                b - start,
                e.longest_gap
            ),
        };
    }
    for choice in &info.choices {
        let _ = writeln!(text, "  {choice}");
    }
    for note in &info.notes {
        let _ = writeln!(text, "  note: {note}");
    }
    if let Some(command) = command {
        let _ = writeln!(text, "  map it by: {command}");
    }
    text
}
