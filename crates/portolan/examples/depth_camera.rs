//! A depth camera: images with known poses into a colored mesh, written as PLY.
//!
//! `cargo run --release -p portolan --example depth_camera -- mesh.ply`
#![allow(clippy::print_stdout, reason = "an example")]

use portolan::geom::Pose;
use portolan::mapper::{Mapper, MapperSettings};
use portolan::scan::{Pinhole, RangeImage};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = Pinhole { fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 }; // 320 x 240, x right, y down, z forward
    let mut mapper = Mapper::<3>::with(MapperSettings { color: true, ..MapperSettings::new(0.02) });
    for i in 0..10 {
        let x = 0.05 * f64::from(i);
        // A ball of 0.5 m before a wall at 2 m, seen from (x, 0, 0); meters along z, 0 where nothing was measured.
        let (mut depths, mut colors) = (Vec::new(), Vec::new());
        for pixel in 0..320 * 240 {
            let ray = [
                (f64::from(pixel % 320) - camera.cx) / camera.fx,
                (f64::from(pixel / 320) - camera.cy) / camera.fy,
                1.0,
            ];
            let (a, b) = (ray.iter().map(|r| r * r).sum::<f64>(), -x * ray[0] - 1.2);
            let root = b * b - a * (x * x + 1.2 * 1.2 - 0.25);
            let ball = if root > 0.0 { (-b - root.sqrt()) / a } else { f64::INFINITY };
            depths.push(ball.min(2.0) as f32);
            colors.push(if ball < 2.0 { [200, 60, 40] } else { [120, 140, 160] });
        }
        let image = RangeImage::from_depth(camera, 320, 240, depths).with_colors(colors);
        // The pose of the camera in the world.
        mapper.integrate(&Pose { translation: [x, 0.0, 0.0], ..Pose::IDENTITY }, &image)?;
    }
    let mesh = mapper.mesh();
    println!("{} triangles", mesh.triangles.len());
    let tsdf = mapper.tsdf().ok_or("no distances")?;
    println!("in the ball, 5 mm deep: {:?}", tsdf.signed_distance([0.2, 0.0, 0.705]));
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(&path, portolan_io::ply_mesh_to_bytes(&mesh)?)?;
        println!("{path}");
    }
    Ok(())
}
