//! What is built and measured, and how.

use super::crossover::{CloudCrossover, TreeCrossover};
use super::fields::MeasuredField;
use super::row::{Row, Winner};
use super::turned::{Accuracy, Turned};
use portolan::cell::{HitLength, OccupancyModel};
use portolan::field::{EsdfGrid, EsdfSettings};
use portolan::geom::Grid;
use portolan::map::{Attenuation, Cloud, OccupancyGrid, Quadtree, Tsdf2, TsdfConfig};
use portolan::store::Dense;
use portolan::surface::{Contour, ContourSettings};

/// Hits per meter in an array.
pub type HitGrid = Attenuation<2, Dense<HitLength, 2>>;

/// What to build and how hard to ask.
#[derive(Clone, Debug)]
pub struct GallerySettings {
    /// The cells of the dense maps.
    pub grid: Grid<2>,
    /// The TSDF; its grid is replaced by `grid`.
    pub tsdf: TsdfConfig<2>,
    /// The occupancy filter of grid and trees.
    pub model: OccupancyModel,
    /// Contour extraction.
    pub contour: ContourSettings,
    /// The distance transforms.
    pub esdf: EsdfSettings,
    /// Number of probes for direct answers; searches get a fiftieth.
    pub probes: usize,
    /// Length of all true surfaces, both sides of walls (meters), for the crossover formula; `None`: the
    /// length of the extracted contour.
    pub surface_length: Option<f64>,
}

impl GallerySettings {
    /// The textbook's maps over these cells, asked at so many points.
    pub fn new(grid: Grid<2>, probes: usize, surface_length: Option<f64>) -> Self {
        Self {
            grid,
            tsdf: TsdfConfig::textbook(),
            model: Default::default(),
            contour: Default::default(),
            esdf: Default::default(),
            probes,
            surface_length,
        }
    }
}

/// Everything that was built and measured.
#[derive(Debug)]
pub struct Gallery {
    /// One row a representation.
    pub rows: Vec<Row>,
    /// Who is cheapest for each workload.
    pub winners: Vec<Winner>,
    /// Rows that win no workload.
    pub never_win: Vec<usize>,
    /// Trees against the dense array.
    pub trees: Vec<TreeCrossover>,
    /// The cloud against the ESDF.
    pub cloud_crossover: CloudCrossover,
    /// Median gradient norm of the raw TSDF (central differences) over observed free probes.
    pub tsdf_gradient: f64,
    /// Distance fields of the TSDF by every method, the accurate one first: the one of the rows.
    pub fields: [MeasuredField; 3],
    /// The grid, for pictures.
    pub occupancy: OccupancyGrid<2>,
    /// The tree on the grid's own lattice, for pictures.
    pub tree: Quadtree,
    /// The TSDF with carving, for pictures.
    pub tsdf: Tsdf2,
    /// The contour, for pictures.
    pub contour: Contour,
    /// Hits per meter, for pictures.
    pub hits: HitGrid,
    /// The cloud, for pictures.
    pub cloud: Cloud<2>,
    /// The tree with the textbook's leaves.
    pub(super) chapter_tree: Quadtree,
    /// The TSDF by the textbook's march.
    pub(super) marched: Tsdf2,
    pub(super) contour_settings: ContourSettings,
    /// How true the answers are in worlds that are turned against the lattice; `None`: not measured.
    pub turned: Option<Turned>,
}

impl Gallery {
    /// The accurate distance field.
    pub fn distance(&self) -> &EsdfGrid<2> {
        &self.fields[0].field
    }

    /// What is to be said of accuracy: the medians over turned worlds where they were measured, else that of this one.
    pub fn headline(&self) -> Accuracy {
        self.turned.as_ref().map_or_else(|| Accuracy::of(self), |turned| turned.accuracy.clone())
    }

    /// Bytes of everything that was built.
    pub fn memory_bytes(&self) -> usize {
        let others = self.fields[1..].iter().map(|f| f.field.memory_bytes());
        self.rows.iter().map(|row| row.memory_bytes).sum::<usize>() + others.sum::<usize>()
    }
}
