//! The studio as a program: it says where it is, fuses what it is asked to, and gives a map that the other commands read.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::support::logs_3d::{camera_log, lidar_log};
use crate::support::{arg, fail, json as document, log_lines, map, room, succeed};
use portolan_io::read_ply_mesh;
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// The program, serving; ended when it is dropped.
struct Studio {
    process: Child,
    said: Value,
}

impl Studio {
    fn start(arguments: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_portolan"))
            .args(["studio", "--port", "0", "--json"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        if line.is_empty() {
            let mut error = String::new();
            process.stderr.take().unwrap().read_to_string(&mut error).unwrap();
            panic!("it did not start: {error}");
        }
        Self { process, said: serde_json::from_str(&line).unwrap() }
    }

    fn url(&self) -> &str {
        self.said["url"].as_str().unwrap()
    }

    fn open(&self) -> Page {
        let address = self.url().trim_start_matches("http://").trim_end_matches('/');
        let mut request = format!("ws://{address}/engine").into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{address}").parse().unwrap());
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        Page { socket: tungstenite::client(request, stream).unwrap().0 }
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A tab of the browser, without one.
struct Page {
    socket: WebSocket<TcpStream>,
}

impl Page {
    /// What is answered, and the file that comes with it.
    fn ask(&mut self, view: &str, ask: Value) -> (Value, Vec<u8>) {
        self.socket.send(Message::text(json!({ "id": 1, "view": view, "ask": ask }).to_string())).unwrap();
        let (answer, body): (Value, _) = match self.socket.read().unwrap() {
            Message::Text(text) => (serde_json::from_str(&text).unwrap(), Vec::new()),
            Message::Binary(bytes) => {
                let end = 8 + u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
                (serde_json::from_slice(&bytes[8..end]).unwrap(), bytes[end..].to_vec())
            }
            other => panic!("no answer: {other:?}"),
        };
        assert!(answer.get("error").is_none(), "{answer}");
        let file = answer["arrays"].as_array().into_iter().flatten().find(|a| a["name"] == "file");
        let length = file.map_or(0, |f| f["length"].as_u64().unwrap() as usize);
        (answer["ok"].clone(), body.into_iter().take(length).collect())
    }

    fn export(&mut self, view: &str, file: &str, to: &Path) {
        let (_, bytes) = self.ask(view, json!({ "op": "export", "file": file }));
        std::fs::write(to, bytes).unwrap();
    }
}

#[test]
fn a_lap_that_was_fused_in_the_studio_is_read_by_the_other_commands() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start(&[]);
    assert_eq!(studio.said["views"]["fusion"], "the simulated Apartment");
    assert_eq!(studio.said["views"]["3d"], "the simulated building");
    let mut page = studio.open();
    page.ask("fusion", json!({ "op": "seek", "scan": 200 }));
    let (esdf, map) = (folder.path().join("esdf.bin"), folder.path().join("map.portolan"));
    page.export("fusion", "esdf", &esdf);
    page.export("fusion", "map", &map);

    let info = document(["info", arg(&map), "--json"]);
    assert_eq!(info["scans"], 200, "{info}");
    // The field that was taken away is the one that the map answers with.
    let points: String = (0..500)
        .map(|i| {
            let share = f64::from(i) / 500.0;
            format!("{},{}\n", 12.0 * share, 9.0 * (share * 37.0).fract())
        })
        .collect();
    assert!(query(&map, &points).lines().count() > 500);
    assert!(query(&esdf, &points).lines().count() > 500);
}

#[test]
fn a_recorded_log_is_shown_and_makes_the_map_that_map_makes() {
    let (folder, log) = room();
    let studio = Studio::start(&[arg(&log), "--every", "2"]);
    assert_eq!(studio.said["views"]["clearance"], "room.log, 30 scans");
    let mut page = studio.open();
    let (frame, _) = page.ask("fusion", json!({ "op": "seek", "scan": 30 }));
    assert_eq!((frame["at"].as_u64(), frame["lap"].as_u64()), (Some(30), Some(30)));
    let exported = folder.path().join("studio.portolan");
    page.export("fusion", "map", &exported);

    let made = folder.path().join("made");
    map(&log, &made, &["--every", "2"]);
    let points: String =
        (0..400).map(|i| format!("{},{}\n", 0.3 * f64::from(i % 20), 0.2 * f64::from(i / 20))).collect();
    // Everything: occupancy, distances to surface and obstacles, and their bounds.
    assert_eq!(query(&exported, &points), query(&made.join("map.portolan"), &points));
}

#[test]
fn a_recorded_3d_log_makes_the_surface_that_map_makes() {
    let mut made_before: Vec<Vec<[[i64; 3]; 3]>> = Vec::new();
    for ((folder, log), limits) in [
        (lidar_log(), &["--min-range", "1.2", "--max-range", "4"][..]),
        (camera_log(), &["--max-range", "3"]),
        (camera_log(), &[]),
    ] {
        let made = folder.path().join("made");
        let call = ["map", arg(&log), "--out", arg(&made), "--resolution", "0.05", "--maps", "tsdf,mesh"];
        succeed(call.iter().chain(limits));
        let scans = fused_scans(&made);

        let studio = Studio::start(&[&[arg(&log)], limits].concat());
        let mut page = studio.open();
        while page.ask("3d", json!({ "op": "seek", "frame": scans })).0["at"] != scans {}
        while page.ask("3d", json!({ "op": "mesh" })).0["mesh"]["pending"] != 0 {}
        let exported = folder.path().join("studio.ply");
        page.export("3d", "ply", &exported);
        let shown = surface(&exported);
        assert!(shown == surface(&made.join("mesh.ply")), "{limits:?}");
        assert!(!made_before.contains(&shown), "limits change what is seen: {limits:?}");
        made_before.push(shown);
    }
}

/// Scans that were fused.
fn fused_scans(map: &Path) -> u64 {
    let summary: Value = serde_json::from_slice(&std::fs::read(map.join("summary.json")).unwrap()).unwrap();
    summary["scans"]["fused"].as_u64().unwrap_or_else(|| panic!("{summary}"))
}

/// The triangles of a mesh, whatever their order: corners in tenths of millimeters.
fn surface(mesh: &Path) -> Vec<[[i64; 3]; 3]> {
    let mesh = read_ply_mesh(mesh).unwrap();
    let corner = |i: u32| mesh.vertices[i as usize].map(|v| (v * 1e4).round() as i64);
    let mut triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
    // A triangle begins where it likes.
    triangles.iter_mut().for_each(|t| {
        let first = (0..3).min_by_key(|&i| t[i]).unwrap();
        t.rotate_left(first);
    });
    triangles.sort_unstable();
    assert!(triangles.len() > 1000);
    triangles
}

/// What `query` prints.
fn query(map: &Path, points: &str) -> String {
    let mut process = Command::new(env!("CARGO_BIN_EXE_portolan"))
        .args(["query", arg(map), "--points", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    process.stdin.take().unwrap().write_all(points.as_bytes()).unwrap();
    let output = process.wait_with_output().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn what_cannot_be_shown_is_refused_before_anything_is_served() {
    let (folder, log) = room();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let refused = |arguments: &[&str]| fail(1, ["studio", "--port", "0"].iter().chain(arguments));

    let missing = folder.path().join("missing.log");
    assert!(refused(&[arg(&missing)]).contains("missing.log"));
    assert!(refused(&[arg(&file("empty.log", ""))]).contains("empty.log"));
    let nothing_hit = log_lines(0, 3)
        .lines()
        .map(|line| {
            let words = line.split(' ').enumerate();
            words
                .map(|(i, w)| if line.starts_with("FLASER") && (2..182).contains(&i) { "81.83" } else { w })
                .collect::<Vec<_>>()
                .join(" ")
                + "\n"
        })
        .collect::<String>();
    let free = file("free.log", &nothing_hit);
    assert!(refused(&[arg(&free), "--no-return", "81"]).contains("no beam of 3 scans hit anything"));
    assert!(refused(&[arg(&log), "--memory", "100K"]).contains("--memory"));

    let made = folder.path().join("made");
    map(&log, &made, &[]);
    let is_a_map = refused(&[arg(&made.join("map.portolan"))]);
    assert!(is_a_map.contains("map.portolan") && is_a_map.contains("a 2-D map; give the log"), "{is_a_map}");
    assert!(refused(&[arg(&made)]).contains("made"));
}

#[test]
fn calls_that_contradict_themselves_are_refused() {
    let (_folder, log) = room();
    assert!(fail(2, ["studio", "--every", "2"]).contains("give one"));
    assert!(
        fail(2, ["studio", arg(&log), "--intrinsics", "1,1,1,1"]).contains("only for 3-D; the log is 2-D")
    );
    let (_folder, log) = camera_log();
    assert!(fail(2, ["studio", arg(&log), "--no-return", "9"]).contains("only for 2-D; the log is 3-D"));
    let nothing = ["studio", arg(&log), "--min-range", "3", "--max-range", "2"];
    assert!(fail(2, nothing).contains("--min-range must be smaller than --max-range"));
    for bad in [["--port", "70000"], ["--host", "example.org"], ["--sessions", "0"], ["--memory", "much"]] {
        fail(2, ["studio"].iter().chain(&bad));
    }
}

#[test]
fn a_port_that_is_taken_is_named() {
    let taken = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let error = fail(1, ["studio", "--port", &port]);
    assert!(error.contains(&port) && error.contains("--port 0") && error.lines().count() == 1, "{error}");
}

#[test]
fn other_machines_are_let_in_only_with_a_warning() {
    let mut studio = Studio::start(&["--host", "0.0.0.0"]);
    assert!(studio.url().starts_with("http://127.0.0.1:"));
    let mut line = String::new();
    BufReader::new(studio.process.stderr.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.contains("warning") && line.contains("0.0.0.0"), "{line}");
}

#[cfg(unix)]
#[test]
fn an_interruption_ends_it_without_an_error() {
    let mut studio = Studio::start(&[]);
    let mut page = studio.open();
    page.ask("fusion", json!({ "op": "step", "scans": 1 }));
    // Still at work when it comes.
    page.socket.send(Message::text(r#"{"id":2,"view":"fusion","ask":{"op":"seek","scan":2000}}"#)).unwrap();
    let sent = Command::new("kill").args(["-INT", &studio.process.id().to_string()]).status().unwrap();
    assert!(sent.success());
    assert_eq!(studio.process.wait().unwrap().code(), Some(0));
    let help = succeed(["studio", "--help"]);
    assert!(help.contains("--port") && help.contains("Ctrl-C"));
}
