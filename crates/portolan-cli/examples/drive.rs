//! Drives through a building that a real robot mapped, on a path that is certified: plans by A* over the certified
//! clearance of cells, takes out every corner that it can prove to be needless, and draws the result.
//!
//! ```text
//! cargo run --release -p portolan-cli --example drive -- [LOG] [--out drive.png]
//! ```
//!
//! LOG is a CARMEN log with good poses; by default the Intel research lab, where the real logs are there, else a lap
//! through the simulator's apartment.

mod planning;

use std::path::PathBuf;

use anyhow::Context;
use clap::Parser;
use planning::{Drawn, Place, intel, length, picture};
use portolan::geom::vector;
use portolan::plan::{Demand, Waypoints, check_path};
use portolan_draw::color;

/// A certified way through a mapped building, as a picture.
#[derive(Parser)]
struct Args {
    /// A CARMEN log
    log: Option<PathBuf>,
    #[arg(long, default_value = "drive.png")]
    out: PathBuf,
    /// Radius of the robot (meters)
    #[arg(long, default_value_t = 0.25)]
    radius: f64,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let place = Place::of(args.log.or_else(intel).as_deref())?;

    // From where the log begins to the place farthest from there where the robot was.
    let free = |p: &&[f64; 2]| place.clearance(**p).is_some_and(|[lower, _]| lower > args.radius + 0.1);
    let start = *place.way.iter().find(free).context("the robot fits nowhere")?;
    let farthest =
        |a: &&[f64; 2], b: &&[f64; 2]| vector::distance(start, **a).total_cmp(&vector::distance(start, **b));
    let goal = *place.way.iter().filter(free).max_by(farthest).context("the robot fits nowhere")?;
    let found = place.search(start, goal, args.radius, 0.6, 4.0).context("there is no way")?;

    // As few corners as can be certified: from each the farthest one that a straight leg reaches.
    // A leg keeps as much room as the search took, up to what is comfortable.
    let roomy = |from: usize, to: usize| {
        let taken = found[from..=to].iter().filter_map(|p| place.clearance(*p)).map(|[lower, _]| lower);
        let room = taken.fold(0.6, f64::min).max(args.radius);
        let leg = Waypoints::new(vec![found[from], found[to]]);
        leg.is_ok_and(|leg| check_path(&place.field, &leg, &Demand::new(room - 0.02)).is_certified())
    };
    let (mut corners, mut at) = (vec![found[0]], 0);
    while at + 1 < found.len() {
        at = (at + 1..found.len()).rev().find(|&to| to == at + 1 || roomy(at, to)).unwrap_or(at + 1);
        corners.push(found[at]);
    }
    let least = place.certified(&corners, args.radius)?;
    // Neighbouring cells are certified, and so is all between them.
    place.certified(&found, args.radius)?;

    let words = format!(
        "{}: {:.1} m and {} corners; A* over cells found {:.1} m. Nowhere nearer than {:.0} cm to a surface or to what was \
         not seen, at every point of the way: certified, not sampled.",
        place.name,
        length(&corners),
        corners.len() - 2,
        length(&found),
        100.0 * least
    );
    let lines = [
        Drawn { name: "A* over cells", line: &found, color: color::MEASUREMENT, robot: None },
        Drawn { name: "certified way", line: &corners, color: color::NEGATIVE, robot: Some(args.radius) },
    ];
    let png = picture(&place, "A certified way through a building", &words, &lines, args.radius);
    std::fs::write(&args.out, png).with_context(|| args.out.display().to_string())?;
    print(&format!("{words}\n{}\n", args.out.display()))
}

fn print(text: &str) -> anyhow::Result<()> {
    Ok(std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())?)
}
