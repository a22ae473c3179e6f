//! The Euclidean signed distance field: `(d, grad d)` anywhere, in constant time.

use super::{SparseEsdf, SparseEsdfSettings, squared_distance_transform};
use crate::answer::Answer;
use crate::geom::{Grid, interpolate, vector};
use crate::map::Tsdf;

/// Settings of [`esdf_from_tsdf`] as a derived field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EsdfSettings {
    /// Cells of smaller weight count as never observed.
    pub min_weight: f32,
    /// Cells whose estimate is within this many cells of zero seed the transform.
    pub band_cells: f64,
}

impl Default for EsdfSettings {
    /// The chapter's: `W_min` 0.5, a band of 1.5 cells.
    fn default() -> Self {
        Self { min_weight: 0.5, band_cells: 1.5 }
    }
}

impl EsdfSettings {
    /// The default with a `W_min` of half of what one ordinary observation of free space weighs in this map, so that
    /// what was seen free once is known (the chapter's 0.5 where everything weighs 1).
    pub fn of<const D: usize>(tsdf: &DenseTsdf<D>) -> Self {
        let config = tsdf.config();
        Self { min_weight: 0.5 * config.weights.typical_low() * config.carve_weight, ..Self::default() }
    }
}

/// Why distances are no field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EsdfError {
    /// The number of samples is not that of the grid.
    #[error("a distance field of {cells} cells cannot have {samples} samples")]
    Length {
        /// Cells of the grid (saturated).
        cells: usize,
        /// Samples given.
        samples: usize,
    },
}

/// Signed Euclidean distances at cell centres (metres), positive in free space; NaN marks cells of which
/// nothing is known, and stays inside: answers are typed.
#[derive(Clone, Debug)]
pub struct Esdf<const D: usize> {
    grid: Grid<D>,
    distance: Vec<f32>,
}

/// The chapter's transform: seeds every observed cell within `band_cells` of the surface with its own
/// estimate, `f = (D / r)^2`, runs the exact squared distance transform over `f`, and takes the sign from `D`.
///
/// Cells of weight below `min_weight` neither seed nor are answered for, so that a map without a surface is
/// unknown everywhere. O(cells).
///
/// How far to trust it: `sqrt(dist^2 + D^2)` treats a cell's offset to the surface as if it were at right
/// angles to the way there. On an exact field that makes distances too small by up to one and a half cells,
/// and never too large; on a fused field, whose values are projective, it can be too large by as much as the
/// cells' values are.
pub fn esdf_from_tsdf<const D: usize>(tsdf: &DenseTsdf<D>, min_weight: f32, band_cells: f64) -> Esdf<D> {
    let grid = *tsdf.grid();
    let planes = tsdf.store().planes();
    let (distance, weight) = (planes.distances(), planes.weights());
    let inverse = 1.0 / grid.lattice.resolution;
    let observed = |w: f32| w > 0.0 && w >= min_weight;
    let mut f: Vec<f64> = distance
        .iter()
        .zip(weight)
        .map(|(&d, &w)| {
            let offset = f64::from(d) * inverse;
            if observed(w) && offset.abs() <= band_cells { offset * offset } else { f64::INFINITY }
        })
        .collect();
    squared_distance_transform(&mut f, grid.shape);
    let signed = f.iter().zip(distance.iter().zip(weight)).map(|(&sq, (&d, &w))| {
        let known = observed(w) && sq < f64::INFINITY;
        let length = (sq.sqrt() * grid.lattice.resolution) as f32;
        if !known {
            f32::NAN
        } else if d < 0.0 {
            -length
        } else {
            length
        }
    });
    Esdf { distance: signed.collect(), grid }
}

impl<const D: usize> Esdf<D> {
    /// The field of a dense map by any method, as an array: what [`SparseEsdf::of_tsdf`] finds, clamped to the largest
    /// distance beyond it. O(cells) and the transform.
    ///
    /// # Panics
    /// Where `max_distance` is not positive.
    pub fn of_tsdf(tsdf: &DenseTsdf<D>, settings: &SparseEsdfSettings) -> Self {
        let dense = SparseEsdf::of_tsdf(tsdf, settings).dense(tsdf.grid());
        Self { grid: dense.grid, distance: dense.distances }
    }

    /// A field of given samples, x fastest, NaN where nothing is known.
    ///
    /// # Errors
    /// Where the number of samples is not that of the grid.
    pub fn from_samples(grid: Grid<D>, distance: Vec<f32>) -> Result<Self, EsdfError> {
        match grid.checked_len() {
            Some(n) if n == distance.len() => Ok(Self { grid, distance }),
            n => Err(EsdfError::Length { cells: n.unwrap_or(usize::MAX), samples: distance.len() }),
        }
    }

    /// A field from cells that are known to be occupied or free, from a mask: distance from each centre to the
    /// nearest centre of the other kind, less half a cell, negative in occupied cells. `None` cells are unknown
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
        let distance = (0..grid.len()).map(|i| {
            let (sq, sign) = match occupied(i) {
                Some(false) => (to_occupied[i], 1.0),
                Some(true) => (to_free[i], -1.0),
                None => (f64::INFINITY, 1.0),
            };
            let length = (sq.sqrt() - 0.5) * grid.lattice.resolution;
            if sq < f64::INFINITY { (sign * length) as f32 } else { f32::NAN }
        });
        Self { distance: distance.collect(), grid }
    }

    /// Shape and place.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Bytes held, measured.
    pub fn memory_bytes(&self) -> usize {
        self.distance.capacity() * size_of::<f32>() + size_of::<Self>()
    }

    /// Samples at the cell centres (metres), x fastest; NaN where nothing is known.
    pub fn samples(&self) -> &[f32] {
        &self.distance
    }

    /// Signed distance (metres) at a point, interpolated between the centres around it. Unknown where one of
    /// them is. O(1).
    #[inline]
    pub fn distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        self.sample(p_world.into()).map(|(value, _)| value)
    }

    /// The exact derivative of [`Esdf::distance`] (per metre): the direction away from the nearest surface, of
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

    /// The chapter's gradient: central differences of the distance over one cell to either side. Another field
    /// than the one that the value comes from; [`Esdf::gradient`] is the one to use.
    pub fn central_difference(&self, p_world: impl Into<[f64; D]>) -> Answer<[f64; D]> {
        let p = p_world.into();
        let h = self.grid.lattice.resolution;
        let mut gradient = [0.0; D];
        for k in 0..D {
            let (mut low, mut high) = (p, p);
            low[k] -= h;
            high[k] += h;
            match (self.distance(low), self.distance(high)) {
                (Answer::Known(a), Answer::Known(b)) => gradient[k] = (b - a) / (2.0 * h),
                (Answer::Outside, _) | (_, Answer::Outside) => return Answer::Outside,
                _ => return Answer::Unknown,
            }
        }
        Answer::Known(gradient)
    }

    #[inline(always)]
    fn sample(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
        let Some((base, fraction)) = self.grid.interpolation(p) else {
            // Between the outermost centres and the border nothing can be interpolated.
            return if self.grid.aabb().contains(p) { Answer::Unknown } else { Answer::Outside };
        };
        let Some(at) = self.grid.index(base) else { return Answer::Outside };
        let (value, slope) = interpolate(&self.distance, &self.grid.strides(), at, &fraction);
        // One unknown corner makes the sum NaN.
        if value.is_nan() { Answer::Unknown } else { Answer::Known((value, slope)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::TsdfConfig;

    fn sphere<const D: usize>(n: usize, r: f64, radius: f64) -> DenseTsdf<D> {
        let config = TsdfConfig { truncation: 3.0 * r, ..Default::default() };
        let mut tsdf = DenseTsdf::covering(&Grid::new([0.0; D], r, [n; D]), config).unwrap();
        let centre = [0.5 * n as f64 * r; D];
        for i in 0..tsdf.grid().len() {
            let cell = tsdf.grid().cell(i);
            let d = vector::distance(tsdf.grid().lattice.center(cell), centre) - radius;
            tsdf.fuse(cell, d, 1.0);
        }
        tsdf
    }

    /// The seeding's half of the finding that can be proved: on an exact field the distance is never too large,
    /// and too small by at most one and a half cells.
    fn exact_fields_are_never_over_estimated<const D: usize>() {
        let (n, r) = (40, 0.05);
        let tsdf = sphere::<D>(n, r, 0.5);
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        let centre = [0.5 * n as f64 * r; D];
        let mut worst_under: f64 = 0.0;
        for (i, &d) in esdf.samples().iter().enumerate() {
            let truth =
                (vector::distance(esdf.grid().lattice.center(esdf.grid().cell(i)), centre) - 0.5).abs();
            let error = f64::from(d).abs() - truth;
            // Sub-cell offsets of a curved surface: its chord lies inside by r^2 / 8R.
            assert!(error <= r * r / (8.0 * 0.5) + 1e-6, "over by {error}");
            worst_under = worst_under.max(-error);
        }
        assert!(worst_under > 0.2 * r && worst_under <= 1.5 * r, "under by {worst_under}");
    }

    #[test]
    fn exact_fields_are_never_over_estimated_2d_and_3d() {
        exact_fields_are_never_over_estimated::<2>();
        exact_fields_are_never_over_estimated::<3>();
    }

    #[test]
    fn a_map_without_a_surface_is_unknown_and_not_far() {
        let mut tsdf =
            DenseTsdf::covering(&Grid::new([0.0; 2], 0.05, [10; 2]), TsdfConfig::default()).unwrap();
        (0..100).for_each(|i| {
            let cell = tsdf.grid().cell(i);
            tsdf.fuse(cell, 0.15, 1.0);
        });
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        assert_eq!(esdf.distance([0.25, 0.25]), Answer::Unknown);
        assert_eq!(esdf.gradient([0.25, 0.25]), Answer::Unknown);
        assert_eq!(esdf.distance([0.26, 0.6]), Answer::Outside);
    }

    #[test]
    fn unobserved_cells_make_their_neighbourhood_unknown() {
        let mut tsdf =
            DenseTsdf::covering(&Grid::new([0.0; 2], 0.1, [20; 2]), TsdfConfig::default()).unwrap();
        for i in 0..400 {
            let cell = tsdf.grid().cell(i);
            if cell != [10, 10] {
                tsdf.fuse(cell, 0.1 * (f64::from(cell[0]) - 3.7), 1.0);
            }
        }
        let esdf = esdf_from_tsdf(&tsdf, 0.5, 1.5);
        assert_eq!(esdf.distance([1.02, 1.02]), Answer::Unknown);
        let d = esdf.distance([1.3, 1.3]).known().unwrap();
        assert!((0.7..0.9).contains(&d), "{d}");
        let (value, gradient) = esdf.distance_and_gradient([1.5, 0.5]).known().unwrap();
        assert!(value > 0.0 && (gradient[0] - 1.0).abs() < 0.01 && gradient[1].abs() < 1e-6);
        let central = esdf.central_difference([1.5, 0.5]).known().unwrap();
        assert!((central[0] - gradient[0]).abs() < 0.01);
        assert!(esdf.distance([0.15, 0.5]).known().unwrap() < 0.0);
    }

    #[test]
    fn a_mask_gives_distances_of_cells() {
        let grid = Grid::new([0.0; 2], 1.0, [10, 3]);
        let esdf = Esdf::from_mask(grid, |i| (i % 10 != 9).then_some(i % 10 < 3));
        assert_eq!(esdf.samples()[5], 2.5);
        assert_eq!(esdf.samples()[0], -2.5);
        assert!(esdf.samples()[9].is_nan());
        assert_eq!(esdf.distance([3.0, 1.5]), Answer::Known(0.0));
    }
}
