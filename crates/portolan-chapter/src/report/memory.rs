//! When a tree pays: the crossover formula beside the measurement.

use super::page::{escaped, table};
use super::{Facts, Section};

/// The text's tree: leaves (meters), and the nodes that it counted.
const TEXT_LEAF: f64 = 0.0625;
const TEXT_NODES: u32 = 11_957;

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
    // Of our walls, which are as long as the text's.
    let crossed = 2.0 * surface / TEXT_LEAF;
    let stored = 2.0 * crossed;
    let (ratio, rest) = (stored * 20.0 / 43_200.0, f64::from(TEXT_NODES) - stored);
    let header = ["node", "leaf", "breaks even at", "bytes against the dense array: formula", "measured"];
    let body = format!(
        "<p>A tree keeps cells refined only where surface is. With <i>S</i> = {surface:.1} m of wall faces in \
         <i>V</i> = {:.0} m² it needs <i>b c<sub>d</sub> S r / V</i> times the bytes of an array with one byte a cell, and breaks \
         even at <i>r* = V / (b c<sub>d</sub> S)</i>, <i>c</i><sub>2</sub> = 2.</p>{}\
         <p>The text's node of 20 bytes (a value and four child indices) loses in this apartment at any resolution above \
         1.5 cm. Ours keeps inner nodes only: four one-byte values, one index, one mask, 9 bytes for four cells of the level \
         below. That moves the break-even point, and the tree to about the size of the array. For our node the formula \
         promises more than is measured, since a tree also refines where free space meets the unknown, and that frontier is a surface \
         too; furniture is not in <i>S</i> either.</p>\
         <p>The text explains its own gap, 5.5 measured against 4.2 by the formula, by that frontier alone. Most of it is \
         arithmetic. The formula counts the nodes that surface runs through, 2 <i>S</i>/<i>r</i> = {crossed:.0}, and a node has three \
         siblings which the tree of 20-byte nodes stores as well: two of every four children of a refined node hold no surface, so \
         that 4 <i>S</i>/<i>r</i> = {stored:.0} is the count to expect. And 4.2 is against a dense array of the tree's own 6.25 cm \
         cells, 5.5 against the 43.2 kB of a 5 cm grid. With siblings and the 5 cm grid the formula gives \
         {stored:.0} × 20 B / 43.2 kB = {ratio:.2}; only the rest, {rest:.0} of the text's {TEXT_NODES} nodes, is left for the \
         frontier. {}</p>",
        w * h,
        table(&header, &rows, &[]),
        ours(facts)
    );
    Section {
        title: "The tree that does not pay, and when it would",
        body,
        command: "portolan demo --out out",
    }
}

/// The same count for the tree that was built here.
fn ours(facts: &Facts) -> String {
    let measured = facts.scene.gallery.trees.first().map(|t| t.measured_ratio);
    measured.map_or(String::new(), |ratio| {
        format!(
            "Ours, at 20 bytes a node, comes to {ratio:.2}: of its outer walls only the inner faces were ever seen, and \
             where nothing was seen no tree refines."
        )
    })
}
