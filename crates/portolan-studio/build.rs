//! Writes the table of the page's files: their paths in `page/`, in order, with the content of each.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

fn walk(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { walk(&path, found)? } else { found.push(path) }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    #![allow(clippy::print_stdout, reason = "that is how a build script speaks")]
    println!("cargo::rerun-if-changed=page");
    let page = Path::new(&std::env::var("CARGO_MANIFEST_DIR")?).join("page");
    let mut found = Vec::new();
    walk(&page, &mut found)?;
    let mut table = Vec::new();
    for path in &found {
        let name: Vec<_> = path.strip_prefix(&page)?.iter().filter_map(|part| part.to_str()).collect();
        table.push(format!("({:?}, include_bytes!({path:?}))", name.join("/")));
    }
    table.sort();
    fs::write(Path::new(&std::env::var("OUT_DIR")?).join("files.rs"), format!("&[{}]", table.join(", ")))?;
    Ok(())
}
