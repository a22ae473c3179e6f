//! Writes a walk through the simulated Building among five people, and a chair that is moved, with the truth about each point:
//! `walkers OUT [SCANS [POSE_SIGMA]]` (200 scans, 0.02 m). KITTI's layout with `labels/NNNNNN.label` as SemanticKITTI has them: a
//! little-endian `u32` for each point, 252 where it is of what moves (there: a moving car), 50 elsewhere (a building).

use portolan::geom::Pose;
use portolan_io::{LogLayout, LogWriter};
use portolan_sim::building::{SpinningLidar, WalkersConfig, walkers_log};
use std::path::Path;

const MOVING: u32 = 252;
const STILL: u32 = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, rest @ ..] = arguments.as_slice() else {
        return Err("call it as: walkers OUT [SCANS [POSE_SIGMA]]".into());
    };
    let scans = rest.first().map_or(Ok(200), |scans| scans.parse())?;
    let pose_sigma = rest.get(1).map_or(Ok(0.02), |sigma| sigma.parse())?;
    let lidar = SpinningLidar { rings: 32, columns: 512, ..SpinningLidar::default() };
    let labels = Path::new(out).join("labels");
    let mut writer =
        LogWriter::create(Path::new(out), LogLayout::Kitti { camera_from_lidar: Pose::IDENTITY })?;
    std::fs::create_dir_all(&labels)?;
    for (i, scan) in walkers_log(&WalkersConfig { scans, lidar, pose_sigma, seed: 7 }).iter().enumerate() {
        writer.push(&scan.pose, 0.1 * i as f64, &scan.frame)?;
        let label = |moves: &bool| if *moves { MOVING } else { STILL }.to_le_bytes();
        let bytes: Vec<u8> = scan.moves.iter().flat_map(label).collect();
        std::fs::write(labels.join(format!("{i:06}.label")), bytes)?;
    }
    writer.finish()?;
    Ok(())
}
