//! Values for unknown cells, for consumers without a value for unknown.

use super::reach::{distance_to_boxes, extended};
use crate::field::UnknownSpace;
use crate::geom::Grid;

/// Why a field cannot be exported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandoverError {
    /// The number of samples differs from the number of cells, or is 0.
    #[error("a grid of {cells} cells cannot have {samples} samples")]
    Length {
        /// Cells of the grid (saturated).
        cells: usize,
        /// Samples given.
        samples: usize,
    },
    /// A setting is out of range.
    #[error("{name} is {value}; {advice}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The values allowed.
        advice: &'static str,
    },
}

pub(super) fn check_length<const D: usize>(grid: &Grid<D>, samples: usize) -> Result<(), HandoverError> {
    match grid.checked_len() {
        Some(n) if n == samples && n > 0 => Ok(()),
        n => Err(HandoverError::Length { cells: n.unwrap_or(usize::MAX), samples }),
    }
}

/// A field without unknown cells: finite samples everywhere (meters, positive in free space, x fastest), limited to `far`,
/// without a step at the border of observed space that an optimizer would take for a wall.
///
/// - [`UnknownSpace::Pessimistic`]: unknown cells are obstacles. A free cell has the distance to the nearest surface or to
///   the box of the nearest unknown cell, whichever is less; an unknown cell has the negative distance to the nearest free
///   cell. The gradient points out of unknown space.
/// - [`UnknownSpace::Optimistic`]: unknown cells are free. Known cells keep their distance; an unknown cell has the least
///   sum of the value of a known cell and the distance to it (in steps between neighboring cells, up to 8 % longer than
///   straight lines). Unknown space inside a wall becomes a pocket of free space.
#[derive(Clone, Debug, PartialEq)]
pub struct Filled<const D: usize> {
    /// Shape and position.
    pub grid: Grid<D>,
    /// Samples at the cell centers (meters), x fastest, finite.
    pub values: Vec<f32>,
}

impl<const D: usize> Filled<D> {
    /// Replaces NaN in `distances` (meters, x fastest) and limits all values to `-far..=far` (meters). O(cells x cells of
    /// `far`) at worst, where everything is unknown.
    ///
    /// # Errors
    /// Where the number of samples is not that of the grid, or `far` or the resolution is not positive and finite.
    pub fn new(
        grid: &Grid<D>,
        distances: &[f32],
        unknown: UnknownSpace,
        far: f64,
    ) -> Result<Self, HandoverError> {
        check_length(grid, distances.len())?;
        let resolution = grid.lattice.resolution;
        for (name, value) in [("the largest distance", far), ("the resolution", resolution)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(HandoverError::Setting {
                    name,
                    value,
                    advice: "give a positive number of meters",
                });
            }
        }
        let most = far as f32;
        // Saturated samples may be infinite.
        let mut values: Vec<f32> = distances.iter().map(|d| d.clamp(-most, most)).collect();
        if !values.iter().any(|d| d.is_nan()) {
            return Ok(Self { grid: *grid, values });
        }
        match unknown {
            UnknownSpace::Optimistic => extended(&mut values, grid, most),
            UnknownSpace::Pessimistic => {
                let reach = far / resolution;
                let to = |of: &dyn Fn(f32) -> bool| distance_to_boxes(grid.shape, |i| of(values[i]), reach);
                let to_unknown = to(&|d| d.is_nan());
                let to_free = to(&|d| d > 0.0);
                let of_cells = |cells: f32| (f64::from(cells) * resolution).min(far) as f32;
                for (i, d) in values.iter_mut().enumerate() {
                    *d = if d.is_nan() { -of_cells(to_free[i]) } else { d.min(of_cells(to_unknown[i])) };
                }
            }
        }
        Ok(Self { grid: *grid, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::vector;

    const NEVER: f32 = f32::NAN;

    /// Free space left of a wall at x = 6, nothing known from x = 7.5 on and in one cell in the middle of the free space.
    fn scene<const D: usize>(shape: [usize; D]) -> (Grid<D>, Vec<f32>) {
        let grid = Grid::new([-3.0; D], 0.5, shape);
        let hole = std::array::from_fn(|k| shape[k] as i32 / 2 - 3 * i32::from(k == 0));
        let distances = (0..grid.len())
            .map(|i| {
                let cell = grid.cell(i);
                let d = 0.5 * (10.0 - (f64::from(cell[0]) + 0.5)) as f32;
                if d < -0.75 || cell == hole { NEVER } else { d }
            })
            .collect();
        (grid, distances)
    }

    /// Both sides of the definition, by brute force over all pairs of cells.
    fn pessimistic_is_the_definition<const D: usize>(shape: [usize; D], far: f64) {
        let (grid, distances) = scene(shape);
        let filled = Filled::new(&grid, &distances, UnknownSpace::Pessimistic, far).unwrap();
        let to = |i: usize, which: &dyn Fn(f32) -> bool| {
            let a = grid.cell(i);
            let others = (0..grid.len()).filter(|j| which(distances[*j]));
            let of = |j: usize| {
                let b = grid.cell(j);
                let gap: [f64; D] =
                    std::array::from_fn(|k| (f64::from((a[k] - b[k]).abs()) - 0.5).max(0.0) * 0.5);
                vector::norm(gap)
            };
            others.map(of).fold(far, f64::min)
        };
        for i in 0..grid.len() {
            let expected = match distances[i] {
                d if d.is_nan() => -to(i, &|d| d > 0.0),
                d => f64::from(d).clamp(-far, far).min(to(i, &|d| d.is_nan())),
            };
            assert!((f64::from(filled.values[i]) - expected).abs() < 1e-5, "{:?}", grid.cell(i));
        }
    }

    #[test]
    fn pessimistic_is_the_definition_2d_and_3d() {
        pessimistic_is_the_definition([16, 7], 100.0);
        pessimistic_is_the_definition([15, 8], 1.2);
        pessimistic_is_the_definition([14, 5, 6], 100.0);
        pessimistic_is_the_definition([14, 6, 4], 0.9);
    }

    fn optimistic_rises_no_faster_than_distance<const D: usize>(shape: [usize; D]) {
        let (grid, distances) = scene(shape);
        let filled = Filled::new(&grid, &distances, UnknownSpace::Optimistic, 100.0).unwrap();
        for i in 0..grid.len() {
            let (value, known) = (filled.values[i], distances[i]);
            if !known.is_nan() {
                assert_eq!(value, known);
                continue;
            }
            // The largest extension that rises by no more than the distance, in straight lines.
            let a = grid.lattice.center(grid.cell(i));
            let largest = (0..grid.len())
                .filter(|j| !distances[*j].is_nan())
                .map(|j| f64::from(distances[j]) + vector::distance(a, grid.lattice.center(grid.cell(j))))
                .fold(f64::INFINITY, f64::min);
            let above = f64::from(value) - largest;
            assert!(above > -1e-5 && above < 0.09 * 8.0, "{above} at {:?}", grid.cell(i));
            for j in 0..grid.len() {
                let (b, c) = (grid.cell(i), grid.cell(j));
                if (0..D).all(|k| (b[k] - c[k]).abs() <= 1) {
                    let step = vector::distance(a, grid.lattice.center(c));
                    assert!(f64::from((value - filled.values[j]).abs()) <= step + 1e-5);
                }
            }
        }
    }

    #[test]
    fn optimistic_rises_no_faster_than_distance_2d_and_3d() {
        optimistic_rises_no_faster_than_distance([16, 7]);
        optimistic_rises_no_faster_than_distance([14, 5, 6]);
    }

    #[test]
    fn all_or_nothing_unknown_and_what_is_refused() {
        let grid = Grid::new([0.0; 2], 0.5, [3, 2]);
        let of = |unknown, d: &[f32]| Filled::new(&grid, d, unknown, 2.0).map(|f| f.values);
        assert_eq!(of(UnknownSpace::Pessimistic, &[NEVER; 6]), Ok(vec![-2.0; 6]));
        assert_eq!(of(UnknownSpace::Optimistic, &[NEVER; 6]), Ok(vec![2.0; 6]));
        let known = [0.1, -0.2, 5.0, f32::INFINITY, f32::NEG_INFINITY, -9.0];
        for unknown in [UnknownSpace::Pessimistic, UnknownSpace::Optimistic] {
            assert_eq!(of(unknown, &known), Ok(vec![0.1, -0.2, 2.0, 2.0, -2.0, -2.0]));
        }
        assert!(matches!(
            of(UnknownSpace::Optimistic, &[0.0; 5]),
            Err(HandoverError::Length { cells: 6, samples: 5 })
        ));
        for far in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = Filled::new(&grid, &known, UnknownSpace::Optimistic, far);
            assert!(matches!(refused, Err(HandoverError::Setting { .. })));
        }
        let none = Grid::new([0.0; 2], 0.5, [0, 2]);
        assert!(Filled::new(&none, &[], UnknownSpace::Optimistic, 1.0).is_err());
    }
}
