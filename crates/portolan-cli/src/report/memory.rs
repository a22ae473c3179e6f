//! When a tree pays: the crossover formula beside the measurement.

use super::page::{escaped, table};
use super::{Facts, Section};

pub(super) fn section(facts: &Facts) -> Section {
    let gallery = facts.scene.gallery;
    let rows: Vec<Vec<String>> = gallery
        .trees
        .iter()
        .map(|t| {
            vec![
                escaped(&t.name),
                format!("{:.2} cm", 100.0 * t.resolution),
                format!("{:.2} cm", 100.0 * t.predicted_resolution),
                format!("{:.2}", t.predicted_ratio),
                format!("{:.2}", t.measured_ratio),
            ]
        })
        .collect();
    let surface = facts.scene.world.map_or(gallery.contour.length(), |w| w.wall_length());
    let [w, h] = gallery.tsdf.grid().aabb().extent();
    let header = ["node", "leaf", "breaks even at", "bytes against the dense array: formula", "measured"];
    let body = format!(
        "<p>A tree keeps cells refined only where surface is. With <i>S</i> = {surface:.1} m of wall faces in \
         <i>V</i> = {:.0} m² it needs <i>b c<sub>d</sub> S r / V</i> times the bytes of an array with one byte a cell, and breaks \
         even at <i>r* = V / (b c<sub>d</sub> S)</i>, <i>c</i><sub>2</sub> = 2.</p>{}\
         <p>The text's node of 20 bytes (a value and four child indices) loses in this apartment at any resolution above \
         1.5 cm. Ours keeps inner nodes only: four one-byte values, one index, one mask, 9 bytes for four cells of the level \
         below. That moves the break-even point, and the tree to about the size of the array. The formula promises more than \
         is measured, since a tree also refines where free space meets the unknown, and that frontier is a surface \
         too; furniture is not in <i>S</i> either.</p>",
        w * h,
        table(&header, &rows, &[])
    );
    Section { title: "The tree that does not pay, and when it would", body, command: "portolan gallery demo" }
}
