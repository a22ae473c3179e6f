//! What the server computes for each scan of the Apartment's lap: the scan is simulated and fused, the surface extracted, and
//! the answer written down as it goes over the wire.
//!
//! `cargo run --release -p portolan-studio --example scan_step`

use std::io::Write;
use std::sync::Arc;
use std::time::Instant;

use portolan_studio::engine::{Clock, Limits, Logs, Session, Wire};

fn main() -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    for resolution in [0.05, 0.02] {
        let start = Instant::now();
        let clock = Clock::new(move || start.elapsed().as_secs_f64());
        let mut session = Session::new(&Arc::new(Logs::default()), Limits::default(), &clock);
        let set = format!(
            r#"{{"id":1,"view":"fusion","ask":{{"op":"set","settings":{{"resolution":{resolution},"truncation":0.15,"w_max":64,
            "noise":0.01,"carve":true,"carve_weight":1,"weights":"constant","sweep":"cell-centre"}}}}}}"#
        );
        session.answer(&set);
        let (mut times, mut bytes) = (Vec::new(), Vec::new());
        for _ in 0..200 {
            let before = clock.now();
            let answer = session.answer(r#"{"id":2,"view":"fusion","ask":{"op":"step","scans":1}}"#);
            times.push(1e3 * (clock.now() - before));
            bytes.push(match answer {
                Wire::Text(text) => panic!("refused: {text}"),
                Wire::Binary(bytes) => bytes.len(),
            });
        }
        times.sort_by(f64::total_cmp);
        bytes.sort_unstable();
        writeln!(
            out,
            "cells of {resolution} m: median {:.2} ms, worst {:.2} ms; median {} bytes, most {}",
            times[100], times[199], bytes[100], bytes[199]
        )?;
    }
    Ok(())
}
