//! Nav2 costs from distances.

use super::HandoverError;

/// Special costs *(nav2_costmap_2d/cost_values.hpp)*.
pub mod cost {
    /// Beyond the inflation radius.
    pub const FREE: u8 = 0;
    /// The largest cost that decays with distance.
    pub const LARGEST_DECAYING: u8 = 252;
    /// Within the inscribed radius: a robot centered here is in collision.
    pub const INSCRIBED: u8 = 253;
    /// An obstacle.
    pub const LETHAL: u8 = 254;
    /// Unknown.
    pub const NO_INFORMATION: u8 = 255;
}

/// Nav2's inflation layer *(nav2_costmap_2d/inflation_layer.hpp, `computeCost`)* over distances to the surface:
///
/// `252 exp(-cost_scaling_factor (d - inscribed_radius))`, rounded down, between the inscribed and the inflation radius;
/// 253 up to the inscribed radius, 254 in obstacles, 0 beyond the inflation radius, 255 where unknown.
///
/// Unlike Nav2, which measures from the center of the nearest obstacle *cell*, the distance here is that to the surface,
/// which is up to half the diagonal of a cell less: costs are never lower than those of Nav2 for the same surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inflation {
    /// Radius of the largest circle about the robot's center within its footprint (meters).
    pub inscribed_radius: f64,
    /// Distance beyond which the cost is 0 (meters).
    pub inflation_radius: f64,
    /// Decay (1/m): larger is steeper.
    pub cost_scaling_factor: f64,
}

impl Default for Inflation {
    /// The values of Nav2's bring-up for a TurtleBot 3: radii 0.22 m and 0.55 m, decay 3 per meter.
    fn default() -> Self {
        Self { inscribed_radius: 0.22, inflation_radius: 0.55, cost_scaling_factor: 3.0 }
    }
}

impl Inflation {
    /// The settings, if they are valid.
    ///
    /// # Errors
    /// Where a value is negative or not finite, or the inflation radius is less than the inscribed radius.
    pub fn validate(self) -> Result<Self, HandoverError> {
        let wrong = |name, value, advice| Err(HandoverError::Setting { name, value, advice });
        let can_be = |v: f64| v >= 0.0 && v.is_finite();
        for (name, value) in [
            ("the inscribed radius", self.inscribed_radius),
            ("the inflation radius", self.inflation_radius),
            ("the cost scaling factor", self.cost_scaling_factor),
        ] {
            if !can_be(value) {
                return wrong(name, value, "give a finite number, not negative");
            }
        }
        if self.inflation_radius < self.inscribed_radius {
            return wrong(
                "the inflation radius",
                self.inflation_radius,
                "give at least the inscribed radius",
            );
        }
        Ok(self)
    }

    /// The cost at a signed distance (meters); NaN is unknown. A saturated distance, which is a lower bound, gives an upper
    /// bound of the cost.
    pub fn cost(&self, distance: f64) -> u8 {
        if distance.is_nan() {
            cost::NO_INFORMATION
        } else if distance <= 0.0 {
            cost::LETHAL
        } else if distance <= self.inscribed_radius {
            cost::INSCRIBED
        } else if distance > self.inflation_radius {
            cost::FREE
        } else {
            let decay = (-self.cost_scaling_factor * (distance - self.inscribed_radius)).exp();
            (f64::from(cost::LARGEST_DECAYING) * decay) as u8
        }
    }

    /// The costs at many distances.
    pub fn costs(&self, distances: &[f32]) -> Vec<u8> {
        distances.iter().map(|&d| self.cost(f64::from(d))).collect()
    }

    /// A cost as Nav2 publishes it in an `OccupancyGrid` *(costmap_2d_publisher.cpp)*: 0 free, 1 to 98 decaying, 99
    /// inscribed, 100 lethal; `None` (-1 in the message) where unknown.
    pub fn percent(cost: u8) -> Option<u8> {
        match cost {
            cost::NO_INFORMATION => None,
            cost::LETHAL => Some(100),
            cost::INSCRIBED => Some(99),
            cost::FREE => Some(0),
            c => Some((1 + 97 * (u32::from(c) - 1) / 251) as u8),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_the_formula() {
        let how = Inflation { inscribed_radius: 0.2, inflation_radius: 1.0, cost_scaling_factor: 5.0 };
        for i in -200..2000 {
            let d = f64::from(i) * 1e-3;
            let expected = match d {
                d if d <= 0.0 => 254,
                d if d <= 0.2 => 253,
                d if d <= 1.0 => (252.0 * f64::exp(-5.0 * (d - 0.2))).floor() as u8,
                _ => 0,
            };
            assert_eq!(how.cost(d), expected, "{d}");
        }
        assert_eq!(how.costs(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.2001]), [255, 0, 254, 251]);
        // Monotone: what is farther never costs more.
        let all: Vec<u8> = (1..2000).map(|i| how.cost(f64::from(i) * 1e-3)).collect();
        assert!(all.windows(2).all(|w| w[0] >= w[1]));
    }

    /// Nav2's costs, from the centers of 2-D obstacle cells, are never higher.
    #[test]
    fn never_below_nav2s_own_costs() {
        let (how, r, edge) = (Inflation::default(), 0.05, 12);
        // Obstacle cells: a block with its corner at (8, 8); its surface is that of the block.
        let blocked = |x: i32, y: i32| x >= 8 && y >= 8;
        for (x, y) in (0..edge).flat_map(|x| (0..edge).map(move |y| (x, y))) {
            let gap = |v: i32| (f64::from(8 - v) - 0.5) * r;
            let surface = match (blocked(x, y), x >= 8, y >= 8) {
                (true, ..) => -0.01,
                (_, true, _) => gap(y),
                (_, _, true) => gap(x),
                _ => gap(x).hypot(gap(y)),
            };
            let cells =
                (0..edge).flat_map(|a| (0..edge).map(move |b| (a, b))).filter(|(a, b)| blocked(*a, *b));
            let nearest = cells.map(|(a, b)| f64::from(a - x).hypot(f64::from(b - y)) * r);
            let d = nearest.fold(f64::INFINITY, f64::min);
            let theirs = match d {
                0.0 => 254,
                d if d <= how.inscribed_radius => 253,
                d if d <= how.inflation_radius => {
                    (252.0 * f64::exp(-how.cost_scaling_factor * (d - how.inscribed_radius))) as u8
                }
                _ => 0,
            };
            assert!(how.cost(surface) >= theirs, "{x} {y}: {} {theirs}", how.cost(surface));
        }
    }

    #[test]
    fn percents_are_those_of_the_publisher() {
        assert_eq!([0, 1, 252, 253, 254].map(Inflation::percent), [0, 1, 98, 99, 100].map(Some));
        assert_eq!(Inflation::percent(255), None);
        assert!((1..=254).all(|c| Inflation::percent(c) >= Inflation::percent(c - 1)));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(Inflation::default().validate().is_ok());
        for (a, b, c) in [(-0.1, 1.0, 1.0), (0.1, f64::NAN, 1.0), (0.1, 1.0, f64::INFINITY), (0.5, 0.4, 1.0)]
        {
            let how = Inflation { inscribed_radius: a, inflation_radius: b, cost_scaling_factor: c };
            assert!(how.validate().is_err(), "{how:?}");
        }
    }
}
