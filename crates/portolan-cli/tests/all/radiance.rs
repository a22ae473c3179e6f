//! `portolan radiance` as a program: what it writes, what it prints, how it fails.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn radiance(out: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(["radiance", "--steps", "200", "--out"])
        .arg(out)
        .args(more)
        .output()
        .expect("the program starts")
}

#[test]
fn json_is_one_document_and_files_repeat_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let output = radiance(&first, &["--json", "--seed", "7", "--channels", "depth,depth-reflectance"]);
    assert!(output.status.success());
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["seed"], 7);
    assert_eq!(document["fits"].as_array().map(Vec::len), Some(2));
    let quiet = radiance(&second, &["-q", "--seed", "7", "--channels", "depth,depth-reflectance"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty());
    let mut names: Vec<_> = fs::read_dir(&first).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    let expected =
        ["bias.png", "density.png", "radiance.json", "rays.png", "residuals.png", "transmittance.png"];
    assert_eq!(names, expected, "and no temporary files");
    for name in expected {
        assert_eq!(fs::read(first.join(name)).unwrap(), fs::read(second.join(name)).unwrap(), "{name}");
    }
    let full: serde_json::Value =
        serde_json::from_slice(&fs::read(first.join("radiance.json")).unwrap()).unwrap();
    assert_eq!(full["fits"][1]["density"].as_array().map(Vec::len), Some(80));
    assert_eq!(full["fits"][0]["rays"].as_array().map(Vec::len), Some(10));
}

#[test]
fn bad_calls_and_bad_folders_have_their_own_status() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(radiance(folder.path(), &["--seed", "nobody"]).status.code(), Some(2));
    assert_eq!(radiance(folder.path(), &["--channels", "smell"]).status.code(), Some(2));
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    assert_eq!(radiance(&file, &[]).status.code(), Some(1));
}
