//! A map that grows while others read it: snapshots, and a distance field that follows.
//!
//! `cargo run --release -p portolan --example incremental`
#![allow(clippy::print_stdout, reason = "an example")]

use portolan::field::Esdf;
use portolan::{Mapper, Status};
use std::sync::mpsc::channel;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let log = portolan_sim::lap(&portolan_sim::apartment().world, &Default::default());
    let start = log[0].0.translation;
    let (send, receive) = channel::<(usize, Esdf<2>)>();
    // A planner on another thread keeps the field that it was given last; nothing that happens later changes it.
    let planner = std::thread::spawn(move || {
        for (scans, field) in receive {
            let known = field.distance(start).status() != Status::Unknown;
            println!(
                "after {scans} scans: {:?} m at the start (known: {known})",
                field.distance(start).value()
            );
        }
    });
    let mut mapper = Mapper::<2>::new(0.05);
    for (i, (pose, scan)) in log.iter().enumerate() {
        mapper.integrate(pose, scan)?;
        if i % 40 == 39 {
            // Only what changed since is computed again; the clone shares all bricks with the field that goes on.
            let field = mapper.esdf().ok_or("no distances")?.clone();
            send.send((i + 1, field))?;
        }
    }
    drop(send);
    planner.join().map_err(|_| "the planner has stopped")?;
    println!("{} bytes in all", mapper.memory_bytes());
    Ok(())
}
