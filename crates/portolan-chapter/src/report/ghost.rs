//! The ghost of the chair: half-lives measured and predicted for each W_max, and their price in noise.

use crate::ghost::{GhostGroup, GhostRun};

use super::page::{figure, table};
use super::{Facts, Section};
use crate::experiment::{Forgetting, shown_half_life};
use crate::pictures;

pub(super) fn section(facts: &Facts) -> Option<Section> {
    let forgetting = facts.forgetting?;
    let body = format!(
        "{}{}{}",
        half_lives(forgetting),
        failures(&forgetting.ghost.per_w_max),
        price(&forgetting.ghost.per_w_max)
    );
    Some(Section {
        title: "The ghost of the chair, and what forgetting costs",
        body,
        command: "portolan demo --out out   (for machines: out/ghost.json; maps that forget: --half-life 10)",
    })
}

/// What the experiment is, its table and its picture.
fn half_lives(forgetting: &Forgetting) -> String {
    let runs = &forgetting.ghost.per_w_max;
    let picture = figure(
        &pictures::ghost(forgetting),
        "full",
        "Error of the moved chair's cells against re-observations",
        "<b>Forgetting, counted in observations.</b> Left: cells that were saturated and are seen as free from then on, which \
         follow from the gain (dashed). Right: the cells that the prediction does not cover.",
    );
    let restless = if runs.iter().all(|r| r.laps_until_saturated.is_none()) {
        "With none of the three clamps were <em>all</em> cells of the chair saturated by then: those deep inside it are only \
         seen through the taper, and gather weight slowly."
    } else {
        "Where some cells were not saturated by then, the table says so."
    };
    format!(
        "<p>The chair stands while the lap is driven up to {before} times; then it is moved, and the laps go on for three \
         predicted half-lives. Every cell of its old place is followed from observation to observation. {restless} A cell at its \
         clamp keeps <i>W<sub>max</sub></i> / (<i>W<sub>max</sub></i> + <i>w</i>) of its error in each step, so half of it is \
         left after <i>n</i> = ln 2 / ln(1 + <i>w</i> / <i>W<sub>max</sub></i>) observations. How long the map believes in the chair is \
         measured over <em>all</em> cells of the place that were seen again; the kinds of cells are beside it.</p>{table}\
         <p>Half-lives are medians in re-observations, not in scans: a cell that the lap passes rarely haunts the map longer. \
         Where not all cells of a group had lost half of their error when the run ended, the table says how many had; “never” \
         is a median over as many that had not. The curves go on only as long as half of a group was still being observed.</p>{picture}",
        before = forgetting.settings.max_laps_before,
        table = table(&HEADER, &runs.iter().map(row).collect::<Vec<_>>(), &[]),
    )
}

const HEADER: [&str; 9] = [
    "W<sub>max</sub>",
    "saturated after",
    "half-life: all cells left",
    "saturated",
    "by the gain",
    "not yet clamped",
    "tapered",
    "noise at rest",
    "predicted",
];

/// One map's line of the table.
fn row(run: &GhostRun) -> Vec<String> {
    let cells = |g: &GhostGroup| match g.cells {
        0 => "–<small>no cells</small>".to_owned(),
        n if g.halved == n => format!("{}<small>{n} cells</small>", shown_half_life(g.half_life_measured)),
        n => format!("{}<small>{} of {n} cells</small>", shown_half_life(g.half_life_measured), g.halved),
    };
    let noise = run.static_noise.map_or(["–".into(), "–".into()], |n| {
        [n.measured, n.predicted].map(|v| format!("{:.2} mm", 1e3 * v))
    });
    let m = &run.saturated;
    let mut row = vec![
        format!("{}", run.w_max),
        match run.laps_until_saturated {
            Some(laps) => format!("{laps} laps"),
            None => format!("moved after {}<small>not all saturated</small>", run.laps_before),
        },
        format!("<b>{}</b>", cells(&run.left)),
        cells(m),
        shown_half_life(m.half_life_predicted),
        cells(&run.unclamped),
        cells(&run.tapered),
    ];
    row.extend(noise);
    row
}

/// Where the prediction fails, and why.
fn failures(runs: &[GhostRun]) -> String {
    let tapered = runs.iter().map(|r| &r.tapered).find(|g| g.cells > 0);
    let unclamped = runs.iter().map(|r| &r.unclamped).rfind(|g| g.cells > 0);
    // The weights that really arrived, where enough of them did.
    let gains = match tapered.filter(|g| g.half_life_of_gains.is_finite()) {
        Some(g) => format!(
            " With the weights that really arrived the same formula gives {} at the smallest clamp, where {} is measured.",
            shown_half_life(g.half_life_of_gains),
            shown_half_life(g.half_life_measured)
        ),
        None => String::new(),
    };
    format!(
        "<p><b>Saturated cells are no measurement.</b> They only ever receive +τ with weight 1 after the move, and +τ is the truth \
         there: their error after <i>n</i> looks <em>is</em> the product of what each look leaves, so that column tests the \
         program, not the theory. What the theory leaves out shows in the other columns, and all of it in the first.</p>\
         <p><b>Where the prediction fails</b> (exercise 4), and why:</p><ul>\
         <li><b>Tapered weights.</b> Behind a surface the weight falls from 1 to 0 at −τ. A cell that is sometimes seen from \
         behind one learns with <i>w</i> &lt; 1 (here {weight:.2} in the median), and the half-life grows about as \
         1/<i>w</i>.{gains}</li>\
         <li><b>Cells not yet clamped.</b> Their weight is below <i>W<sub>max</sub></i>, so the gain <i>w</i> / (<i>W</i> + <i>w</i>) \
         is above the clamp's: they forget faster at first, and come to the predicted rate as they fill up. A cell that \
         had the weight of {young:.0} observations when the chair left has lost half of its error after {young_half:.0} more.</li>\
         <li><b>Cells that settle on something else.</b> The distance along a beam is not the distance to the nearest surface. \
         Near the chair's new place, and near walls seen at a slant, the estimate settles on a biased value: the error goes \
         to a floor instead of zero, and if the floor is above one half it never halves.</li></ul>",
        weight = tapered.map_or(f64::NAN, |g| g.weight),
        young = unclamped.map_or(f64::NAN, |g| g.weight_at_move),
        young_half = unclamped.map_or(f64::NAN, |g| g.half_life_measured),
    )
}

/// What forgetting costs.
fn price(runs: &[GhostRun]) -> String {
    let noise = |run: &GhostRun| Some((run.w_max, run.static_noise?.measured));
    let compared = match (runs.first().and_then(noise), runs.last().and_then(noise)) {
        (Some((short, noisy)), Some((long, calm))) if long > short => {
            format!("{:.0} times the memory, {:.2} of the noise", long / short, calm / noisy)
        }
        _ => "The longer the memory, the less noise".to_owned(),
    };
    format!(
        "<p><b>What forgetting costs.</b> A map that forgets never comes to rest: where nothing moves, its cells keep the standard \
         deviation σ / √(2 <i>W<sub>max</sub></i> + <i>w</i>). The last two columns are the same three maps in a world that stands \
         still. The measured noise lies above the prediction, more so for large clamps: lost beams make the mix of views differ from \
         lap to lap, and each view has a bias of its own. {compared}: choose by how often things move.</p>"
    )
}
