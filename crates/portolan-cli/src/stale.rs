//! What an earlier run left in a folder.

use std::path::Path;

use anyhow::bail;
use serde_json::Value;

/// Removes the files that an earlier run of this program wrote into the folder and this one did not: they would belong to
/// another map. What that run wrote stands in its `summary.json`; nothing else is touched.
pub(crate) fn remove_stale(folder: &Path, written: &[&str]) -> anyhow::Result<()> {
    let Ok(text) = std::fs::read(folder.join("summary.json")) else { return Ok(()) };
    let Ok(summary) = serde_json::from_slice::<Value>(&text) else { return Ok(()) };
    if !summary["program"].as_str().is_some_and(|p| p.starts_with("portolan ")) {
        return Ok(());
    }
    let files = summary["files"].as_array().map(Vec::as_slice).unwrap_or_default();
    for name in files.iter().filter_map(Value::as_str) {
        // A name of a file in this folder, and not a way out of it.
        let plain = Path::new(name).file_name().is_some_and(|n| n == name);
        if !plain || name == "summary.json" || written.contains(&name) {
            continue;
        }
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                bail!("{}: cannot remove what an earlier run left: {e}; remove it", path.display())
            }
            _ => {}
        }
    }
    Ok(())
}
