//! Which way is up in 3-D: told by `--up`, else estimated once, when a map is made, and kept in its header.

use anyhow::bail;
use portolan::cell::SignedDistance;
use portolan::geom::vector::{add, dot, norm, scale, unit};
use portolan::geom::{BLOCK_EDGE, block_cells};
use portolan::store::{Bricks, Store};
use portolan_io::scan_log::ScanLog;
use portolan_io::{MapFile, MapHeader};
use serde::{Deserialize, Serialize};

use crate::arguments::point3;
use crate::mapping::Settings;

/// A unit vector of the world, in its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Up(pub(crate) [f64; 3]);

impl Up {
    /// Of maps that do not say it.
    pub(crate) const Z: Self = Self([0.0, 0.0, 1.0]);

    /// What a map says.
    pub(crate) fn of_header(header: &MapHeader) -> Option<Self> {
        Settings::of_saved(&header.settings).up
    }

    /// By how the sensors of a log were held, put right by the floor that they saw.
    pub(crate) fn estimate(log: &ScanLog, map: &MapFile<3>) -> Self {
        let held = log.up();
        Self(map.tsdf_bricks.as_ref().map_or(rounded(held).0, |tsdf| floor(&tsdf.store, held).0))
    }

    /// `+z`, `-y`, or the vector.
    pub(crate) fn words(self) -> String {
        let axis = (0..3).find(|&k| self.0[k].abs() > 1.0 - 1e-9);
        match axis {
            Some(k) => format!("{}{}", if self.0[k] < 0.0 { '-' } else { '+' }, ["x", "y", "z"][k]),
            None => self.0.map(|v| format!("{}", (1e4 * v).round() / 1e4)).join(","),
        }
    }

    /// Refuses slabs between two heights, which are across z, where z is not up.
    pub(crate) fn check_slab(self, what: &str) -> anyhow::Result<()> {
        if dot(self.0, Self::Z.0) > LEVEL {
            return Ok(());
        }
        bail!(
            "{what}: up is {} in this map, and --z is a slab across z, which would be no floor plan; give --up +z if z is up \
             after all, or map the log again with poses in a world whose z is up",
            self.words()
        )
    }
}

/// `+z`, `-y`, `x`, or `x,y,z` of any length.
pub(crate) fn up(text: &str) -> Result<Up, String> {
    let wrong = || "must be an axis like +z or -y, or a direction x,y,z that is not zero".to_owned();
    let (sign, axis) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    if let Some(k) = ["x", "y", "z"].iter().position(|name| *name == axis) {
        return Ok(Up(std::array::from_fn(|i| if i == k { sign } else { 0.0 })));
    }
    let direction = point3(text).map_err(|_| wrong())?;
    unit(direction).map(rounded).ok_or_else(wrong)
}

/// The cosine to up from which something is level: 10 degrees.
const LEVEL: f64 = 0.985;
/// The cosine to an axis from which a floor is taken for the axis: 3 degrees, which is what poses are off by.
const AXIS: f64 = 0.9986;
/// Bricks that are looked at.
const BRICKS: usize = 20_000;
/// Cones about up, narrower and narrower (cosines), and the share of all surface that a floor must have in each: of a ball,
/// which has no floor, 9, 3 and 1 % of the area lie so near to level.
const CONES: [(f64, f64); 4] = [(0.82, 0.13), (0.94, 0.09), (0.98, 0.06), (0.99, 0.05)];

/// Up by the normals of the surfaces that are nearly level, which are the floor's, tables' and seats'.
fn floor(map: &Bricks<SignedDistance, 3>, held: [f64; 3]) -> Up {
    let normals = normals(map);
    let mut up = held;
    for (cone, least) in CONES {
        let level: Vec<_> = normals.iter().filter(|n| dot(**n, up) > cone).collect();
        if (level.len() as f64) < least * normals.len() as f64 || level.is_empty() {
            break;
        }
        let sum = level.into_iter().fold([0.0; 3], |sum, n| add(sum, *n));
        up = unit(sum).unwrap_or(up);
    }
    let axis = (0..3).find(|&k| up[k].abs() > AXIS);
    axis.map_or_else(
        || rounded(up),
        |k| Up(std::array::from_fn(|i| if i == k { up[k].signum() } else { 0.0 })),
    )
}

/// To four digits: the same text on every platform.
fn rounded(v: [f64; 3]) -> Up {
    Up(v.map(|c| (1e4 * c).round() / 1e4 + 0.0))
}

/// Directions into the free side, at cells that the surface runs through.
fn normals(map: &Bricks<SignedDistance, 3>) -> Vec<[f64; 3]> {
    let edge = map.lattice().resolution as f32;
    let step = map.len().div_ceil(BRICKS).max(1);
    let mut normals = Vec::new();
    for (_, brick) in map.bricks_by_age().step_by(step) {
        let distances = brick.distances();
        for i in 0..block_cells::<3>() {
            let at = [i % BLOCK_EDGE, i / BLOCK_EDGE % BLOCK_EDGE, i / BLOCK_EDGE / BLOCK_EDGE];
            if at.iter().any(|&k| k == 0 || k == BLOCK_EDGE - 1) || distances[i].abs() > 0.6 * edge {
                continue;
            }
            let strides = [1, BLOCK_EDGE, BLOCK_EDGE * BLOCK_EDGE];
            let ends = strides.map(|s| [distances[i - s], distances[i + s]]);
            let steps = ends.map(|[a, b]| f64::from(b - a));
            // What was never observed is 0, and gives no direction.
            if ends.iter().flatten().any(|d| *d == 0.0) || norm(steps) < f64::from(edge) {
                continue;
            }
            normals.push(scale(steps, 1.0 / norm(steps)));
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::cell::DistanceBrick;
    use portolan::geom::{BlockKey, Lattice};

    #[test]
    fn axes_and_directions_are_read_and_written() {
        for text in ["+z", "-y", "+x"] {
            assert_eq!(up(text).unwrap().words(), text);
        }
        assert_eq!(up("z").unwrap(), Up::Z);
        assert_eq!(up("0,0,-2").unwrap().words(), "-z");
        assert_eq!(up("0,3,4").unwrap().words(), "0,0.6,0.8");
        for text in ["", "w", "0,0,0", "1,2", "nan,0,1", "--z"] {
            assert!(up(text).unwrap_err().contains("axis like +z"), "{text}");
        }
    }

    /// A plane through the origin whose free side is where `normal` points.
    fn plane(normal: [f64; 3]) -> Bricks<SignedDistance, 3> {
        let lattice = Lattice::new([0.0; 3], 0.1);
        let mut map = Bricks::new(lattice);
        for i in 0..125 {
            let key = BlockKey([i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2]);
            let distances: Vec<f32> =
                (0..512).map(|i| dot(lattice.center(key.cell(i)), normal).clamp(-0.3, 0.3) as f32).collect();
            map.insert(key, DistanceBrick::from_parts(&distances, &[1.0; 512]).unwrap()).unwrap();
        }
        map
    }

    #[test]
    fn the_floor_puts_right_how_the_camera_was_held() {
        let tilted = unit([0.0, -0.9, -0.44]).unwrap();
        let found = floor(&plane(tilted), [0.0, -1.0, 0.0]);
        assert!(dot(found.0, tilted) > 0.9999, "{found:?}");
        // Two degrees are an error of the poses.
        let nearly = unit([0.02, -1.0, 0.02]).unwrap();
        assert_eq!(floor(&plane(nearly), tilted).words(), "-y");
        // A wall says nothing.
        assert_eq!(floor(&plane([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]), Up::Z);
    }

    #[test]
    fn a_slab_across_what_is_not_up_is_refused() {
        Up::Z.check_slab("hall").unwrap();
        Up([0.0, 0.1, 0.995]).check_slab("hall").unwrap();
        let error = up("-y").unwrap().check_slab("kitchen").unwrap_err().to_string();
        assert!(error.contains("kitchen: up is -y") && error.contains("--up +z"), "{error}");
    }
}
