//! A signed distance field as one array.

use super::squared_distance_transform;
use crate::answer::{Answer, Status};
use crate::field::on_nodes::on_nodes;
use crate::geom::{Grid, interpolate, vector};

/// Why distances are no field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EsdfError {
    /// The number of samples is not that of the grid.
    #[error("a distance field of {cells} cells cannot have {samples} samples")]
    Length {
        /// Cells of the grid (saturated).
        cells: usize,
        /// Samples given, or statuses where those are wrong.
        samples: usize,
    },
}

/// Signed Euclidean distances at the centers of a box of cells (meters), positive in free space, x fastest.
///
/// NaN marks cells of which nothing is known, and stays inside: answers are typed. A saturated cell holds the largest
/// maintained distance, with the side's sign. 4 bytes a cell, 5 where some cell is saturated.
#[derive(Clone, Debug, PartialEq)]
pub struct EsdfGrid<const D: usize> {
    grid: Grid<D>,
    distances: Vec<f32>,
    /// `None`: numbers are known.
    status: Option<Vec<Status>>,
}

impl<const D: usize> EsdfGrid<D> {
    /// A field of given samples, x fastest, NaN where nothing is known.
    ///
    /// # Errors
    /// Where the number of samples is not that of the grid.
    pub fn from_samples(grid: Grid<D>, distances: Vec<f32>) -> Result<Self, EsdfError> {
        match grid.checked_len() {
            Some(n) if n == distances.len() => Ok(Self { grid, distances, status: None }),
            n => Err(EsdfError::Length { cells: n.unwrap_or(usize::MAX), samples: distances.len() }),
        }
    }

    /// [`EsdfGrid::from_samples`], with what each sample is worth. What is neither known nor saturated becomes NaN, and
    /// NaN is unknown.
    ///
    /// # Errors
    /// Where the number of samples or statuses is not that of the grid.
    pub fn with_status(
        grid: Grid<D>,
        distances: Vec<f32>,
        mut status: Vec<Status>,
    ) -> Result<Self, EsdfError> {
        let mut field = Self::from_samples(grid, distances)?;
        if status.len() != field.distances.len() {
            return Err(EsdfError::Length { cells: field.distances.len(), samples: status.len() });
        }
        for (distance, status) in field.distances.iter_mut().zip(&mut status) {
            if distance.is_nan() || !status.has_value() {
                (*distance, *status) = (f32::NAN, Status::Unknown);
            }
        }
        Ok(Self { status: Some(status), ..field })
    }

    /// Of cells whose samples and statuses fit each other and the grid.
    pub(in crate::field) fn of_cells(
        grid: Grid<D>,
        distances: Vec<f32>,
        status: Option<Vec<Status>>,
    ) -> Self {
        Self { grid, distances, status }
    }

    /// A field from cells that are known to be occupied or free, from a mask: distance from each center to the
    /// nearest center of the other kind, less half a cell, negative in occupied cells. `None` cells are unknown
    /// and count as neither. Quantised to cells: what a map without distances can give.
    pub fn from_mask(grid: Grid<D>, occupied: impl Fn(usize) -> Option<bool>) -> Self {
        let seeds = |kind: bool| {
            let mut f: Vec<f64> = (0..grid.len())
                .map(|i| if occupied(i) == Some(kind) { 0.0 } else { f64::INFINITY })
                .collect();
            squared_distance_transform(&mut f, grid.shape);
            f
        };
        let (to_occupied, to_free) = (seeds(true), seeds(false));
        let distances = (0..grid.len()).map(|i| {
            let (sq, sign) = match occupied(i) {
                Some(false) => (to_occupied[i], 1.0),
                Some(true) => (to_free[i], -1.0),
                None => (f64::INFINITY, 1.0),
            };
            let length = (sq.sqrt() - 0.5) * grid.lattice.resolution;
            if sq < f64::INFINITY { (sign * length) as f32 } else { f32::NAN }
        });
        Self { grid, distances: distances.collect(), status: None }
    }

    /// Shape and place.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Samples at the cell centers (meters), x fastest; NaN where nothing is known.
    pub fn samples(&self) -> &[f32] {
        &self.distances
    }

    /// What the sample of a cell is worth; outside beyond the last.
    pub fn status(&self, i: usize) -> Status {
        match (self.distances.get(i), &self.status) {
            (None, _) => Status::Outside,
            (Some(_), Some(status)) => status[i],
            (Some(d), None) if d.is_nan() => Status::Unknown,
            (Some(_), None) => Status::Known,
        }
    }

    /// What the samples are worth, a byte each ([`Status::byte`]).
    pub fn status_bytes(&self) -> Vec<u8> {
        (0..self.distances.len()).map(|i| self.status(i).byte()).collect()
    }

    /// Whether statuses are kept beside the samples: NaN says it all where they are not.
    pub fn has_status(&self) -> bool {
        self.status.is_some()
    }

    /// Whether some sample stands for more.
    pub fn is_saturated(&self) -> bool {
        self.status.iter().flatten().any(|s| *s == Status::Saturated)
    }

    /// Bytes held, measured.
    pub fn memory_bytes(&self) -> usize {
        let status = self.status.as_ref().map_or(0, Vec::capacity);
        self.distances.capacity() * size_of::<f32>() + status + size_of::<Self>()
    }

    /// Signed distance (meters) at a point, interpolated between the centers around it. Unknown where one of
    /// them is. O(1).
    #[inline]
    pub fn distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        self.sample(p_world.into()).map(|(value, _)| value)
    }

    /// The exact derivative of [`EsdfGrid::distance`] (per meter): the direction away from the nearest surface, of
    /// length 1 but for the cells' size and near the medial axis. O(1).
    #[inline]
    pub fn gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<[f64; D]> {
        self.distance_and_gradient(p_world).map(|(_, gradient)| gradient)
    }

    /// Value and gradient of one interpolant in one call. O(1).
    #[inline]
    pub fn distance_and_gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<(f64, [f64; D])> {
        let inverse = 1.0 / self.grid.lattice.resolution;
        self.sample(p_world.into()).map(|(value, slope)| (value, vector::scale(slope, inverse)))
    }

    #[inline(always)]
    fn sample(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
        let Some((base, fraction)) = self.grid.interpolation(p) else { return self.on_nodes(p) };
        let Some(at) = self.grid.index(base) else { return Answer::Outside };
        let (value, slope) = interpolate(&self.distances, &self.grid.strides(), at, &fraction);
        // One unknown corner makes the sum NaN.
        if value.is_nan() {
            self.on_nodes(p)
        } else if self.status.is_some() && self.saturated_beside(base) {
            Answer::Saturated((value, slope))
        } else {
            Answer::Known((value, slope))
        }
    }

    /// The answer where a center around the point is missing, in cells: known where that one does not count.
    #[cold]
    pub(in crate::field) fn on_nodes(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
        let place = self.grid.lattice.to_cells(p).map(|c| c - 0.5);
        let sample = |cell| {
            let i = self.grid.index(cell)?;
            let value = self.distances[i];
            (!value.is_nan()).then(|| (f64::from(value), self.status(i) == Status::Saturated))
        };
        on_nodes(place, sample).unwrap_or_else(|| self.nothing_at(p))
    }

    /// Whether one of the `2^D` cells from `base` on is saturated.
    #[inline]
    pub(in crate::field) fn saturated_beside(&self, base: [i32; D]) -> bool {
        let Some(status) = &self.status else { return false };
        (0..1usize << D).any(|c| {
            let cell = std::array::from_fn(|k| base[k] + (c >> k & 1) as i32);
            self.grid.index(cell).is_some_and(|i| status[i] == Status::Saturated)
        })
    }

    /// Between the outermost centers and the border nothing can be interpolated.
    pub(in crate::field) fn nothing_at<T>(&self, p: [f64; D]) -> Answer<T> {
        if self.grid.aabb().contains(p) { Answer::Unknown } else { Answer::Outside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_gives_distances_of_cells() {
        let grid = Grid::new([0.0; 2], 1.0, [10, 3]);
        let esdf = EsdfGrid::from_mask(grid, |i| (i % 10 != 9).then_some(i % 10 < 3));
        assert_eq!(esdf.samples()[5], 2.5);
        assert_eq!(esdf.samples()[0], -2.5);
        assert!(esdf.samples()[9].is_nan());
        assert_eq!(esdf.distance([3.0, 1.5]), Answer::Known(0.0));
    }

    /// A field whose first column is saturated and whose last cell is not observed.
    #[test]
    fn saturated_cells_make_their_neighborhood_saturated() {
        let grid = Grid::new([0.0; 2], 1.0, [4, 2]);
        let mut status = vec![Status::Known; 8];
        for i in [0, 4] {
            status[i] = Status::Saturated;
        }
        status[7] = Status::Unknown;
        let field = EsdfGrid::with_status(grid, vec![2.0; 8], status).unwrap();
        assert!(field.samples()[7].is_nan() && field.has_status() && field.is_saturated());
        assert_eq!(field.status_bytes(), [2, 1, 1, 1, 2, 1, 1, 0]);
        assert_eq!((field.status(7), field.status(8)), (Status::Unknown, Status::Outside));
        assert_eq!(field.distance([1.0, 1.0]), Answer::Saturated(2.0));
        assert_eq!(field.distance([2.0, 1.0]), Answer::Known(2.0));
        assert_eq!(field.distance([3.0, 1.0]), Answer::Unknown);
        let status = vec![Status::Known; 7];
        let error = EsdfGrid::with_status(grid, vec![2.0; 8], status).unwrap_err();
        assert_eq!(error, EsdfError::Length { cells: 8, samples: 7 });
        let plain = EsdfGrid::from_samples(grid, vec![2.0; 8]).unwrap();
        assert_eq!((plain.status(0), plain.is_saturated()), (Status::Known, false));
    }
}
