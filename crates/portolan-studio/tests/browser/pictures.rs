//! The pictures of the README, taken where a folder for them is named:
//! `PORTOLAN_SCREENSHOTS=docs cargo test -p portolan-studio --test browser pictures`.

use super::{Screen, Studio};

/// Small enough that words can be read at the width of a README, with twice as many pixels.
const SCREEN: Screen = Screen { size: [1000, 680], ratio: 2.0, ..Screen::LIGHT };
#[test]
fn pictures_of_every_view() {
    if std::env::var_os("PORTOLAN_SCREENSHOTS").is_none() {
        return;
    }
    let Some(studio) = Studio::start() else { return };
    let page = studio.open_on("view=fusion&scan=230&chair=200,3.025,1.205&cell=29,56", SCREEN);
    page.wait_text("at", "scan 30 of 200, lap 2");
    page.wait_text("cell", "observations");
    page.rest();
    page.screenshot("studio-fusion");

    let page = studio.open_on("view=gallery&run=distance", SCREEN);
    page.wait_for("document.querySelector('.panel.winner') !== null");
    page.rest();
    page.screenshot("studio-gallery");

    let page = studio.open_on("view=clearance&path=driven&rings=0.25", SCREEN);
    page.wait_text("path-verdict", "Certified");
    page.rest();
    page.screenshot("studio-clearance");

    let page = studio.open_on("view=radiance&seed=41&run=depth-descent-900", SCREEN);
    page.rest();
    page.screenshot("studio-radiance");

    let page = studio.open_on("view=3d&sensor=camera&frame=160&color=color", SCREEN);
    page.wait_text("3d-at", "160 of 160");
    page.rest();
    page.screenshot("studio-3d");
}
