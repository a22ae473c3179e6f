//! The 3-D view: it plays, a voxel shows what the engine knows of it, slices and links show what they say.

use portolan::cell::DistanceBrick;
use portolan::geom::{BlockKey, Lattice};
use portolan::map::{Tsdf3, TsdfConfig};
use portolan::store::Bricks;
use portolan::uncertainty::SurfaceSigma;
use portolan_studio::engine::{BesideMap, Logs, Source3d};
use portolan_studio::server::Settings;
use serde_json::{Value, json};

use super::{Page, Studio};

/// Meters as the view writes them.
fn metres(value: &Value) -> String {
    match value.as_f64() {
        None => "unknown".into(),
        Some(v) => format!("{}{:.4} m", if v >= 0.0 { '+' } else { '\u{2212}' }, v.abs()),
    }
}

/// Waits until all frames that were asked for are fused, and all of the mesh is drawn.
fn wait_drawn(page: &Page, at: &str) {
    page.wait_text("3d-at", at);
    page.wait_for("document.getElementById('3d-canvas').dataset.pending === '0'");
    page.rest();
}

fn cell_shown(page: &Page) -> Vec<i32> {
    page.text("voxel-cell").split(", ").map(|n| n.parse().unwrap()).collect()
}

#[test]
fn plays_and_a_voxel_in_the_middle_tells_its_filter() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=3d&frame=4");
    wait_drawn(&page, "4 of 40");
    assert!(page.ask("3d", json!({ "op": "mesh" }))["mesh"]["triangles"].as_u64().unwrap() > 1000);
    page.focus("3d-canvas");
    page.press("Enter");
    page.wait_for("document.getElementById('voxel-cell').checkVisibility()");
    page.press("n");
    wait_drawn(&page, "5 of 40");
    page.wait_text("voxel-note", "of the frames observed it");
    let cell = cell_shown(&page);
    let told = page.ask("3d", json!({ "op": "voxel", "cell": cell }));
    assert_eq!(page.text("voxel-distance"), metres(&told["distance"]));
    assert_eq!(page.text("voxel-weight"), format!("{:.2}", told["weight"].as_f64().unwrap()));
    assert_eq!(page.text("voxel-truth"), metres(&told["truth"]));
    let history = page.ask("3d", json!({ "op": "history" }));
    let last = history["events"].as_array().unwrap().last().unwrap();
    assert_eq!(page.text("event-observation"), metres(&last[3]));
    assert_eq!(page.text("event-gain"), format!("{:.4}", last[4].as_f64().unwrap()));
    assert_eq!(page.text("event-posterior"), metres(&last[5]));
    // What the filter came to is what the map holds.
    assert_eq!(page.text("event-posterior"), page.text("voxel-distance"));
    page.press("x");
    page.wait_for(&format!(
        "document.getElementById('voxel-cell').textContent.startsWith('{}, ')",
        cell[0] + 1
    ));
    page.press("Escape");
    page.wait_for("!document.getElementById('voxel-cell').checkVisibility()");
    page.assert_no_errors();
}

#[test]
fn slices_through_every_field_and_colours_of_the_surface() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=3d&frame=3");
    wait_drawn(&page, "3 of 40");
    for field in ["tsdf", "esdf", "occupancy"] {
        page.choose("3d-slice", field);
        // A map without occupancy is made again with it.
        page.wait_for(&format!("location.hash.includes('slice={field}')"));
        wait_drawn(&page, "3 of 40");
        page.wait_text("3d-slice-legend", "Slice, ");
        page.screenshot(&format!("3d-slice-{field}"));
    }
    let before = page.text("3d-slice-note");
    page.focus("3d-canvas");
    page.press("]");
    page.rest();
    assert_eq!(page.text("3d-slice-note"), before);
    for color in ["weight", "error", "height"] {
        page.choose("3d-color", color);
        page.wait_for(&format!("location.hash.includes('color={color}')"));
        wait_drawn(&page, "3 of 40");
    }
    page.choose("3d-slice", "none");
    page.press("ArrowLeft");
    page.assert_no_errors();
}

#[test]
fn a_link_shows_the_same_and_files_can_be_taken_away() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=3d&frame=3&color=error&slice=tsdf,2,1.0");
    wait_drawn(&page, "3 of 40");
    page.focus("3d-canvas");
    page.press("Enter");
    page.wait_for("location.hash.includes('voxel=')");
    let link = page.eval("location.hash.slice(1)");
    let other = studio.open(link.as_str().unwrap());
    wait_drawn(&other, "3 of 40");
    other.wait_text("voxel-cell", &page.text("voxel-cell"));
    for id in ["voxel-distance", "voxel-weight", "3d-triangles"] {
        assert_eq!(other.text(id), page.text(id), "{id}");
    }
    let folder = tempfile::tempdir().unwrap();
    page.save_into(folder.path());
    for (file, name) in [("ply", "mesh.ply"), ("glb", "mesh.glb"), ("esdf", "esdf.bin")] {
        page.click(&format!("3d-{file}"));
        assert!(page.wait_saved(&folder.path().join(name)).len() > 1000);
    }
    page.assert_no_errors();
    // A color that nobody can show is passed over.
    let strange = studio.open("view=3d&frame=1&color=plaid");
    wait_drawn(&strange, "1 of 40");
    strange.assert_no_errors();
}

/// A surface that fills a cube of so many cells along each side; of 184, it is of four million triangles.
pub(super) fn gyroid(cells: i32) -> Tsdf3 {
    const PERIOD: f64 = 16.0;
    let mut store = Bricks::new(Lattice::new([0.0; 3], 0.05));
    let bricks = cells / 8;
    for i in 0..bricks * bricks * bricks {
        let key = BlockKey([i % bricks, i / bricks % bricks, i / bricks / bricks]);
        let value = |i: usize| {
            let [x, y, z] = key.cell(i).map(|v| std::f64::consts::TAU * f64::from(v) / PERIOD);
            (0.1 * (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos())) as f32
        };
        let distances: Vec<f32> = (0..512).map(value).collect();
        store.insert(key, DistanceBrick::from_parts(&distances, &[4.0; 512]).unwrap()).unwrap();
    }
    Tsdf3::from_stores(store, None, TsdfConfig::textbook()).unwrap()
}

/// A studio that shows this surface, saved with that beside it; `None`: there is no browser.
pub(super) fn studio_of_gyroid(cells: i32, beside: BesideMap) -> Option<Studio> {
    let (tsdf, beside) = (Box::new(gyroid(cells)), Box::new(beside));
    let source_3d = Source3d::Map { name: "a gyroid".into(), tsdf, up: [0.0, 0.0, 1.0], beside };
    Studio::with(Logs { source_3d, ..Logs::default() }, &Settings::default())
}

#[test]
fn what_moved_and_how_sure_the_surface_is_are_shown() {
    let beside = BesideMap {
        sigma: SurfaceSigma::through([[1.0, 0.02], [100.0, 0.002]]),
        movers: (0..500).map(|i| [0.01 * f64::from(i), 0.5, 0.5]).collect(),
        ..BesideMap::default()
    };
    let Some(studio) = studio_of_gyroid(48, beside) else { return };
    let page = studio.open("view=3d");
    page.wait_for("document.getElementById('3d-canvas').dataset.pending === '0'");
    page.wait_text("3d-movers", "500 returns");
    assert_eq!(page.eval("document.getElementById('3d-canvas').movers()"), 500);
    page.choose("3d-color", "sigma");
    page.wait_for("document.getElementById('3d-canvas').coloredBy() === 'sigma'");
    page.wait_text("3d-legend", "Standard deviation");
    assert_eq!([page.text("3d-low"), page.text("3d-high")], ["0.2 cm", "2 cm"]);
    // Weights of 4 are between the ends, nearer to the upper one.
    let shade = page.eval("document.getElementById('3d-canvas').shadeOf(0)");
    let shade = shade.as_u64().unwrap();
    assert!((150..220).contains(&shade), "{shade}");
    page.rest();
    page.screenshot("3d-sigma");
    page.click("3d-show-movers");
    page.wait_for("document.getElementById('3d-canvas').movers() === 0");
    page.assert_no_errors();
}

#[test]
fn millions_of_triangles_are_one_draw_call() {
    let Some(studio) = studio_of_gyroid(184, BesideMap::default()) else { return };
    let page = studio.open("view=3d");
    page.wait_for("document.getElementById('3d-canvas').dataset.pending === '0'");
    page.rest();
    let told = page.eval(
        "(() => {
            const { load, info } = document.getElementById('3d-canvas');
            const { calls, triangles } = info().render;
            return { calls, triangles, seconds: (load.done - load.started) / 1000, transfer: load.transfer / 1000,
                take: load.take / 1000, bytes: load.bytes, renderer: document.getElementById('meter').textContent };
        })()",
    );
    // Said, not asserted: it is the machine's affair.
    eprintln!("a large mesh: {told}");
    eprintln!("bytes: {}", page.ask("3d", json!({ "op": "mesh" }))["bytes"]);
    assert!(told["triangles"].as_u64().unwrap() > 4_000_000, "{told}");
    // The mesh, and the box around it.
    assert!(told["calls"].as_u64().unwrap() <= 2, "{told}");
    page.assert_no_errors();
}
