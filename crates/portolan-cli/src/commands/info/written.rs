//! `info` of what portolan writes beside maps: pose graphs, and the documents of runs.

use std::path::Path;

use anyhow::{Context, bail};
use portolan_graph::{AnyGraph, EdgeKind, PoseGraph, read_g2o};
use serde_json::{Value, json};

/// What the file is and what it holds; `None`: it is none of these.
///
/// # Errors
/// Where its name says that it is one, and its content is not.
pub(super) fn about(path: &Path) -> anyhow::Result<Option<Value>> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let kind = match name.as_str() {
        "summary.json" => "what a run did and refused (summary.json)",
        "gallery.json" => "what representations cost and answer (gallery.json)",
        _ if name.ends_with(".g2o") => return of_graph(path).map(Some),
        _ => return Ok(None),
    };
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{shown}: cannot be read"))?;
    let document: Value = serde_json::from_str(&text).with_context(|| format!("{shown}: is not JSON"))?;
    let Value::Object(mut document) = document else { bail!("{shown}: is not a JSON object") };
    document.insert("kind".into(), json!(kind));
    Ok(Some(Value::Object(document)))
}

fn of_graph(path: &Path) -> anyhow::Result<Value> {
    let name = path.display().to_string();
    let input = portolan_io::open(path)?;
    let file = read_g2o(input, &name)?;
    let mut document = match &file.graph {
        AnyGraph::Se2(graph) => counts(graph),
        AnyGraph::Se3(graph) => counts(graph),
    };
    document["kind"] = json!("a pose graph (g2o)");
    document["vertices_made_of_edges"] = json!(file.vertices_made.then_some(true));
    document["lines_skipped"] = json!(file.unknown);
    Ok(document)
}

fn counts<const D: usize>(graph: &PoseGraph<D>) -> Value {
    let of = |kind: EdgeKind| graph.edges().iter().filter(|edge| edge.kind == kind).count();
    json!({
        "dimension": D,
        "poses": graph.vertices().len(),
        "edges": { "odometry": of(EdgeKind::Odometry), "closures": of(EdgeKind::Closure) },
    })
}
