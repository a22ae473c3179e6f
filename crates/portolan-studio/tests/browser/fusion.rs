//! The view of fusion, as its user has it.

use portolan::cell::FusionEvent;
use portolan::geom::Grid;
use portolan::map::{Tsdf2, TsdfConfig};
use portolan_sim::{LapConfig, apartment, lap};
use serde_json::json;

use super::{Page, Screen, Studio};

/// The Apartment's box (meters), as the canvas shows it before anything is moved.
const APARTMENT: [f64; 2] = [12.0, 9.0];

/// Where a point of the Apartment is on the canvas (CSS pixels), as `canvas2d.js` puts it.
fn on_canvas(page: &Page, [x, y]: [f64; 2]) -> [f64; 2] {
    let [_, _, w, h] = page.area("fusion-canvas");
    let margin = f64::min(28.0, 0.04 * w.min(h));
    let scale = f64::min((w - 2.0 * margin) / APARTMENT[0], (h - 2.0 * margin) / APARTMENT[1]);
    [0.5 * w + (x - 0.5 * APARTMENT[0]) * scale, 0.5 * h - (y - 0.5 * APARTMENT[1]) * scale]
}

/// The number that an element's text begins with.
fn number(page: &Page, id: &str) -> f64 {
    let text = page.text(id);
    let word = text.split_whitespace().next().unwrap_or_default();
    word.parse().unwrap_or_else(|_| panic!("#{id} says {text:?}, which is no number"))
}

fn scan(page: &Page) -> usize {
    page.text("at").split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn plays_pauses_steps_and_scrubs() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion");
    page.choose("speed", "200");
    // The list has a use of its own for the key.
    page.focus("fusion-canvas");
    page.press("Space");
    page.wait_text("at", "of 200");
    page.wait_for("Number(document.getElementById('at').textContent.split(' ')[1]) > 60");
    page.press("Space");
    page.wait_text("play", "Play");
    page.settle();
    let paused = scan(&page);
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(scan(&page), paused, "it goes on though it was paused");

    page.click("step");
    page.wait_text("at", &format!("scan {} of", paused + 1));
    page.press(",");
    page.wait_text("at", &format!("scan {paused} of"));
    page.set_slider("scrub", 31.0);
    page.wait_text("at", "scan 31 of");
    page.press("Home");
    page.wait_text("at", "scan 0 of");
    page.press("End");
    page.wait_text("at", "scan 200 of");
    page.screenshot("fusion-lap");
    page.assert_no_errors();
}

/// The work of a picture while scans are fused may be so many times that of drawing alone: 7.6 and 10.5 were measured, and long work is interrupted
/// more often than short where others use the machine.
const MOST_OVER_DRAWING: f64 = 24.0;

/// Taking in a scan's answer and drawing it costs the page's main thread little more than drawing alone: scans are fused elsewhere.
#[test]
fn the_main_thread_has_little_to_do() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion");
    page.choose("speed", "60");
    page.focus("fusion-canvas");
    page.press("Space");
    page.wait_for("Number(document.getElementById('at').textContent.split(' ')[1]) > 120");
    let fusing = page.text("meter");
    page.press("Space");
    page.wait_text("play", "Play");
    // As many pictures as the meter remembers, of what is there, moved to and fro.
    page.eval(
        "(async () => {
            const canvas = document.getElementById('fusion-canvas');
            for (let i = 0; i < 260; i++) {
                const key = i % 2 ? 'ArrowLeft' : 'ArrowRight';
                canvas.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
                await new Promise((done) => requestAnimationFrame(done));
            }
        })()",
    );
    page.settle();
    let drawing = page.text("meter");
    eprintln!("main thread while the Apartment is fused: {fusing}; while it is drawn alone: {drawing}");
    let milliseconds = |text: &str| text.split_whitespace().next().unwrap().parse::<f64>().unwrap();
    // In one run, so that a busy machine slows both down; fusing on the main thread would be many times as much.
    assert!(
        milliseconds(&fusing) <= MOST_OVER_DRAWING * milliseconds(&drawing),
        "{fusing} while fusing, {drawing} while drawing"
    );
    page.assert_no_errors();
}

/// What the library says that scans did to a cell, with the page's settings.
fn events(cell: [i32; 2], scans: usize) -> Vec<(usize, FusionEvent)> {
    let config = TsdfConfig::textbook();
    let mut tsdf = Tsdf2::covering(&Grid::new([0.0; 2], 0.05, [240, 180]), config).unwrap();
    tsdf.watch([cell]);
    let mut events = Vec::new();
    for (i, (pose, scan)) in lap(&apartment().world, &LapConfig::default()).iter().take(scans).enumerate() {
        tsdf.integrate(pose, scan).unwrap();
        events.extend(tsdf.events().iter().map(|e| (i, e.1)));
    }
    events
}

/// What the page shows of an event is what the library computed, to all digits that are shown.
fn assert_shown(page: &Page, (scan, e): &(usize, FusionEvent)) {
    let before = if e.weight_before > 0.0 { format!("{:.6} m", e.before) } else { "unknown".into() };
    let shown = [
        ("cell-before", before),
        ("cell-observed", format!("{:.6} m", e.observation)),
        ("cell-gain", format!("{:.6}", e.gain)),
        ("cell-after", format!("{:.6} m", e.after)),
        ("cell-weight-before", format!("{:.4}", e.weight_before)),
        ("cell-weight", format!("{:.4}", e.weight_after)),
        ("cell-scan", (scan + 1).to_string()),
    ];
    for (id, text) in shown {
        assert_eq!(page.text(id), text, "#{id} of scan {scan}");
    }
}

#[test]
fn a_click_shows_the_librarys_numbers() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=150");
    page.wait_text("at", "scan 150 of");
    // Walls, a corner, the chair, free space.
    for cell in [[31, 60], [37, 70], [20, 50], [100, 90]] {
        let center = cell.map(|i| 0.05 * (f64::from(i) + 0.5));
        page.click_at("fusion-canvas", on_canvas(&page, center));
        page.wait_text("cell", &format!("Cell {}, {} at", cell[0], cell[1]));
        let events = events(cell, 150);
        assert!(events.len() > 3, "{cell:?} was seen {} times", events.len());
        page.wait_text("cell-count", &format!("{0} of {0}", events.len()));
        assert_shown(&page, events.last().unwrap());
        for n in [0, events.len() / 2] {
            page.set_slider("cell-event", n as f64);
            page.wait_text("cell-count", &format!("{} of", n + 1));
            assert_shown(&page, &events[n]);
        }
        page.set_slider("cell-event", events.len() as f64 - 1.0);
    }
    page.screenshot("fusion-cell");
    page.assert_no_errors();
}

#[test]
fn a_cell_is_followed_by_keyboard() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=40");
    page.focus("fusion-canvas");
    page.press("Enter");
    page.wait_text("cell", "Cell 120, 90 at");
    for (key, cell) in [("w", "120, 91"), ("a", "119, 91"), ("s", "119, 90"), ("d", "120, 90")] {
        page.press(key);
        page.wait_text("cell", &format!("Cell {cell} at"));
    }
    page.press("Escape");
    page.wait_text("cell", "Click a cell");
    page.assert_no_errors();
}

#[test]
fn the_chairs_ghost_fades_as_predicted() {
    let Some(studio) = Studio::start() else { return };
    for w_max in [8, 16] {
        let page = studio.open(&format!("view=fusion&w_max={w_max}&scan=200"));
        page.wait_text("at", "scan 200 of");
        page.click("move-chair");
        page.wait_text("status", "The chair was moved");
        for lap in 2..=4 {
            page.press("End");
            page.wait_text("at", &format!("scan 200 of 200, lap {lap}"));
        }
        let (measured, predicted) = (number(&page, "ghost-measured"), number(&page, "ghost-predicted"));
        assert!(
            (measured / predicted - 1.0).abs() <= 0.1,
            "W_max {w_max}: {measured}, predicted {predicted}"
        );
        page.screenshot(&format!("fusion-chair-{w_max}"));
        page.assert_no_errors();
    }
}

#[test]
fn the_chair_is_dragged_where_there_is_room_and_nowhere_else() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion&scan=5");
    page.wait_text("at", "scan 5 of");
    let world = apartment().world;
    let chair = world.solids().iter().find(|s| s.name == "chair").unwrap().aabb();
    let middle = [0, 1].map(|k| 0.5 * (chair.min[k] + chair.max[k]));
    let drag = |from: [f64; 2], by: [f64; 2]| {
        let to = [from[0] + by[0], from[1] + by[1]];
        page.drag("fusion-canvas", on_canvas(&page, from), on_canvas(&page, to));
        to
    };
    drag(middle, [20.0, 0.0]);
    page.wait_for("document.getElementById('status').matches('.error')");
    let refused = page.text("status");
    assert!(refused.contains("chair"), "{refused}");
    // Where the textbook puts it.
    drag(middle, [1.38, -1.62]);
    page.wait_text("status", "The chair was moved");
    page.wait_for("location.hash.includes('chair=5')");
    page.assert_no_errors();
}

#[test]
fn a_link_shows_the_same() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open("view=fusion");
    page.set_slider("w-max", 2.0);
    page.choose("sweep", "march");
    page.wait_text("half-life-note", "half of an error");
    page.set_slider("scrub", 25.0);
    page.wait_text("at", "scan 25 of");
    page.focus("fusion-canvas");
    page.press("Enter");
    page.wait_text("cell", "Cell 120, 90");
    page.press("+");
    page.wait_for("location.hash.includes('scan=25') && location.hash.includes('cell=120') && location.hash.includes('at=')");
    let hash = page.eval("location.hash.slice(1)");

    let again = studio.open(hash.as_str().unwrap());
    again.wait_text("at", "scan 25 of");
    again.wait_text("cell", "Cell 120, 90");
    for id in ["at", "cell", "cell-after", "cell-weight", "half-life-note", "observed"] {
        assert_eq!(again.text(id), page.text(id), "#{id}");
    }
    for id in ["w-max", "sweep", "resolution"] {
        let value = format!("document.getElementById({}).value", json!(id));
        assert_eq!(again.eval(&value), page.eval(&value), "#{id}");
    }
    again.wait_for(&format!("location.hash.slice(1) === {hash}"));
    page.assert_no_errors();
    again.assert_no_errors();
}

#[test]
fn files_can_be_taken_away() {
    let Some(studio) = Studio::start() else { return };
    let page = studio.open_on("view=fusion&scan=50", Screen::DARK);
    let folder = tempfile::tempdir().unwrap();
    page.save_into(folder.path());
    let exports = [("esdf", "esdf.bin"), ("contour", "contour.geojson"), ("map", "map.portolan")];
    for (file, name) in exports {
        page.click(&format!("export-{file}"));
        assert!(page.wait_saved(&folder.path().join(name)).len() > 1000);
    }
    page.focus("fusion-canvas");
    page.press("p");
    let picture = page.wait_saved(&folder.path().join("portolan-fusion.png"));
    assert!(picture.starts_with(b"\x89PNG"));
    page.assert_no_errors();
}
