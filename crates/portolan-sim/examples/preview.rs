//! Fuses a 3-D log and writes a picture of its surface: `preview lidar|camera|LOG RESOLUTION OUT.png [EVERY]`, where
//! `lidar` and `camera` are walks through the simulated Building.

#![allow(clippy::print_stderr, reason = "an example prints its time")]

use portolan::geom::Pose;
use portolan::map::{Tsdf3, TsdfConfig};
use portolan::scan::{Frame, Projection, RangeImage};
use portolan::surface::{MeshSettings, marching_cubes};
use portolan_draw::{MeshView, Preview, Sensor, preview};
use portolan_io::scan_log::{ScanLog, ScanLogOptions};
use portolan_sim::building::{BuildingConfig, BuildingSensor, DepthCamera, building_log};
use std::path::Path;
use std::time::Instant;

type Error = Box<dyn std::error::Error>;
type Scans = Vec<(Pose<3>, Frame)>;

fn scans(log: &str, every: usize) -> Result<Scans, Error> {
    let sensor = match log {
        "lidar" => return Ok(building_log(&BuildingConfig::default()).scans),
        "camera" => BuildingSensor::Camera(DepthCamera::default()),
        path => {
            let log = ScanLog::open(Path::new(path), &ScanLogOptions::default())?;
            let scan = |i: usize| Ok((*log.pose(i), log.frame(i)?));
            return (0..log.len()).step_by(every).map(scan).collect();
        }
    };
    Ok(building_log(&BuildingConfig { scans: 120, sensor, ..Default::default() }).scans)
}

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [log, resolution, out, rest @ ..] = arguments.as_slice() else {
        return Err("call it as: preview lidar|camera|LOG RESOLUTION OUT.png [EVERY]".into());
    };
    let every = rest.first().map_or(Ok(1), |e| e.parse())?;
    let scans = scans(log, every)?;
    let resolution: f64 = resolution.parse()?;
    let start = Instant::now();
    let config = TsdfConfig {
        resolution,
        truncation: 3.0 * resolution,
        color: true,
        carve: false,
        ..TsdfConfig::textbook()
    };
    let mut map = Tsdf3::new(config)?;
    for (pose, frame) in &scans {
        map.integrate(pose, frame)?;
    }
    let fused = start.elapsed();
    let mesh = marching_cubes(map.store(), map.colors(), &MeshSettings::default());
    let sensor = |(pose, frame): &(Pose<3>, Frame)| {
        let axis = |k: usize, sign: f64| [0, 1, 2].map(|i| (sign * pose.rotation[i][k]) as f32);
        let (forward, up) = match frame {
            Frame::Image(RangeImage { projection: Projection::Orthographic { .. }, .. }) => {
                (axis(2, -1.0), axis(1, 1.0))
            }
            Frame::Image(_) => (axis(2, 1.0), axis(1, -1.0)),
            Frame::Points(_) => (axis(0, 1.0), axis(2, 1.0)),
        };
        let position = [0, 1, 2].map(|i| (pose.translation[i] - mesh.origin[i]) as f32);
        Sensor { position, forward, up }
    };
    let sensors: Vec<Sensor> = scans.iter().map(sensor).collect();
    let view = MeshView {
        vertices: &mesh.vertices,
        triangles: &mesh.triangles,
        normals: &mesh.normals,
        colors: &mesh.colors,
    };
    let meshed = start.elapsed();
    let subtitle = format!("{} scans, {resolution} m, {} triangles", scans.len(), mesh.triangles.len());
    let sheet =
        preview(&Preview { mesh: view, sensors: &sensors, up: None, title: log, subtitle: &subtitle });
    eprintln!(
        "{subtitle}: fused {fused:.2?}, meshed {:.2?}, drawn {:.2?}",
        meshed - fused,
        start.elapsed() - meshed
    );
    std::fs::write(out, sheet.encode_png())?;
    Ok(())
}
