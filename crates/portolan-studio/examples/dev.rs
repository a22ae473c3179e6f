//! dev
use portolan_studio::{engine::{Logs, PlaneLog}, server::{Server, Settings}};
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut logs = Logs::default();
    if let Some(p) = std::env::args().nth(1) {
        let log = portolan_io::CarmenLog::read(&p)?;
        let limits = portolan::scan::RangeLimits { no_return: portolan_io::detect_no_return(&log).unwrap_or(f64::INFINITY), ..Default::default() };
        let scans = (0..log.len()).map(|i| (log.raw(i).world_from_laser, log.raw(i).to_scan(&limits))).collect();
        logs.plane = PlaneLog::Recorded { name: "intel".into(), scans };
    }
    let s = Server::start(logs, &Settings { port: std::env::var("PORT").ok().and_then(|p| p.parse().ok()).unwrap_or(7700), ..Default::default() })?;
    s.wait();
    Ok(())
}
