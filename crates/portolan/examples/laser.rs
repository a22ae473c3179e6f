//! A planar laser: scans with known poses into an occupancy map, a contour and a distance field.
//!
//! `cargo run --release -p portolan --example laser`
#![allow(clippy::print_stdout, reason = "an example")]

use portolan::geom::Pose;
use portolan::scan::{RangeLimits, Scan};
use portolan::{Answer, Mapper};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Ranges that a laser of 360 beams measures in a room of 6 m x 4 m about the origin.
    let bearings: Vec<f64> = (0..360).map(|d| f64::from(d - 180).to_radians()).collect();
    let measure = |x: f64, y: f64| -> Vec<f64> {
        let wall = |at: f64, along: f64| if along > 0.0 { (at / along).abs() } else { f64::INFINITY };
        let range = |b: &f64| {
            let (s, c) = b.sin_cos();
            wall(3.0 - x, c).min(wall(3.0 + x, -c)).min(wall(2.0 - y, s)).min(wall(2.0 + y, -s))
        };
        bearings.iter().map(range).collect()
    };

    let mut mapper = Mapper::<2>::new(0.05); // cells of 5 cm
    for i in 0..40 {
        let (x, y) = (0.05 * f64::from(i) - 1.0, 0.2);
        // What a reading means: up to 20 m a surface; beyond that, free space up to there.
        let scan =
            Scan::from_laser(&bearings, &measure(x, y), &RangeLimits { max: 20.0, ..Default::default() });
        mapper.integrate(&Pose::<2>::new(x, y, 0.0), &scan)?; // x, y, heading
    }
    println!("{} scans, {} hits", mapper.stats().scans, mapper.stats().beams.hit);

    let occupancy = mapper.occupancy().ok_or("no occupancy map")?;
    println!("occupied at the wall: {:?}", occupancy.probability([2.99, 0.0]));
    println!("contour: {:.2} m (the room's walls are 20 m)", mapper.contour().length());

    let esdf = mapper.esdf().ok_or("no distances")?;
    for p in [[2.5, 0.0], [0.0, 0.0], [2.9, 9.0]] {
        match esdf.distance_and_gradient(p) {
            Answer::Known((d, away)) => println!("{p:?}: {d:.3} m, away is {away:.2?}"),
            Answer::Saturated((d, _)) => println!("{p:?}: at least {d:.3} m"),
            Answer::Unknown => println!("{p:?}: never observed"),
            Answer::Outside => println!("{p:?}: outside of the map"),
        }
    }
    Ok(())
}
