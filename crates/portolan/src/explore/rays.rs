//! Ray directions of common sensors, for views that are planned.

/// Unit directions of a 2-D scanner: `count` rays from the bearing `first` to `last` (radians, counter-clockwise from x of
/// the sensor), both included; a single ray points to the middle.
pub fn fan(first: f64, last: f64, count: usize) -> Vec<[f64; 2]> {
    spread(first, last, count).map(|bearing| [bearing.cos(), bearing.sin()]).collect()
}

/// Unit directions of a 3-D lidar that turns about its z axis: bearings from x (radians, counter-clockwise) as in [`fan`],
/// for each of the elevations from the xy plane upward, row by row. For a full turn the last bearing is one step less than
/// the first plus 2 pi.
pub fn spherical(bearings: [f64; 2], across: usize, elevations: [f64; 2], rows: usize) -> Vec<[f64; 3]> {
    spread(elevations[0], elevations[1], rows)
        .flat_map(|up| {
            spread(bearings[0], bearings[1], across)
                .map(move |a| [up.cos() * a.cos(), up.cos() * a.sin(), up.sin()])
        })
        .collect()
}

/// Unit directions through the pixels of a pinhole camera (z forward, x right, y down), row by row: through the center of
/// every `step`-th of `width` x `height` pixels, with focal lengths and principal point in pixels. Pixel centers have
/// integer coordinates.
pub fn pinhole(
    [width, height]: [usize; 2],
    focal: [f64; 2],
    principal: [f64; 2],
    step: usize,
) -> Vec<[f64; 3]> {
    let step = step.max(1);
    let rows = (step / 2..height).step_by(step);
    rows.flat_map(|v| {
        (step / 2..width).step_by(step).map(move |u| {
            let x = (u as f64 - principal[0]) / focal[0];
            let y = (v as f64 - principal[1]) / focal[1];
            let length = (x * x + y * y + 1.0).sqrt();
            [x / length, y / length, 1.0 / length]
        })
    })
    .collect()
}

fn spread(first: f64, last: f64, count: usize) -> impl Iterator<Item = f64> {
    let gaps = count.saturating_sub(1);
    (0..count).map(move |i| {
        let share = if gaps > 0 { i as f64 / gaps as f64 } else { 0.5 };
        first + share * (last - first)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector::{distance, norm};
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn directions_are_where_they_should_be() {
        let fan = fan(-FRAC_PI_2, FRAC_PI_2, 3);
        assert!(distance(fan[0], [0.0, -1.0]) < 1e-15 && distance(fan[1], [1.0, 0.0]) < 1e-15);
        let ball = spherical([0.0, FRAC_PI_2], 2, [0.0, FRAC_PI_2], 2);
        assert!(distance(ball[1], [0.0, 1.0, 0.0]) < 1e-15 && distance(ball[2], [0.0, 0.0, 1.0]) < 1e-15);
        let pixels = pinhole([640, 480], [500.0, 500.0], [319.5, 239.5], 8);
        assert_eq!(pixels.len(), 80 * 60);
        assert!(pixels.iter().all(|d| (norm(*d) - 1.0).abs() < 1e-15));
        assert!(pixels[0][0] < 0.0 && pixels[0][1] < 0.0 && pixels[0][2] > 0.7);
        assert_eq!(super::fan(0.2, 0.4, 1).len(), 1);
        assert!(super::fan(0.2, 0.4, 0).is_empty() && pinhole([4, 4], [1.0; 2], [0.0; 2], 0).len() == 16);
    }
}
