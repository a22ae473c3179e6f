//! The k-d tree over end points against the distance field: seconds a distance query, for clouds of growing size.
//!
//! `cargo run --release -p portolan-chapter --example cloud_crossover`

#![allow(clippy::print_stdout, reason = "an example speaks")]

use portolan::geom::Grid;
use portolan::map::MapError;
use portolan_chapter::gallery::{GallerySettings, run};
use portolan_sim::{LapConfig, apartment, lap};
use std::time::Instant;

fn main() -> Result<(), MapError> {
    let world = apartment().world;
    let log = lap(&world, &LapConfig::default());
    let grid = Grid::new([0.0; 2], 0.05, [240, 180]);
    let settings = GallerySettings::new(grid, 100_000, Some(world.wall_length()));
    let start = Instant::now();
    let gallery = run(&log, &settings, None, &mut || start.elapsed().as_secs_f64())?;
    let field = gallery.rows.iter().find(|r| r.name.starts_with("ESDF")).and_then(|r| r.distance);
    println!("the field: {:.1} ns", 1e9 * field.map_or(f64::NAN, |cost| cost.seconds));
    for (points, seconds) in &gallery.cloud_crossover.measured {
        println!("a cloud of {points:6} points: {:.1} ns", 1e9 * seconds);
    }
    match gallery.cloud_crossover.points {
        Some(0) => println!("the field is ahead from the first point on"),
        Some(points) => println!("the field is ahead from about {points} points on"),
        None => println!("the field is never ahead"),
    }
    Ok(())
}
