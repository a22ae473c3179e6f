//! The files that a mapping run leaves behind.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use portolan::cell::LogOddsValue;
use portolan::field::EsdfGrid;
use portolan::geom::Grid;
use portolan::map::Quadtree;
use portolan::surface::{Contour, ContourSettings, DoubledLength, ThinWalls};
use portolan::surface::{doubled_length, marching_squares, thin_walls};
use portolan_io::{
    MapCell, MapFile, Polyline, SvgStyle, write_atomic, write_esdf, write_geojson, write_map_server,
    write_svg,
};

use super::{MapKind, Settings};
use crate::esdf::{dense_plane_esdf, status_plane};
use crate::picture;
use crate::stale::remove_stale;

/// Contours nearer to each other than this and facing the same way are one wall seen twice (metres).
const DOUBLED_REACH: f64 = 0.15;

/// What is made of the maps when all scans are fused.
#[derive(Default)]
pub(crate) struct Derived {
    pub(crate) contour: Option<Contour>,
    pub(crate) doubled: DoubledLength,
    pub(crate) thin: ThinWalls,
    pub(crate) esdf: Option<EsdfGrid<2>>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
}

impl Derived {
    /// Contour and distance field, as far as they are wanted and there is something to derive them from.
    pub(crate) fn of(file: &MapFile<2>, settings: &Settings) -> Self {
        let mut derived = Self::default();
        let Some(tsdf) = &file.tsdf else { return derived };
        if settings.wants(MapKind::Contour) {
            let start = Instant::now();
            let contour = marching_squares(tsdf, &ContourSettings::of(tsdf));
            derived.seconds.insert("contour", start.elapsed().as_secs_f64());
            let start = Instant::now();
            derived.doubled = doubled_length(&contour, DOUBLED_REACH);
            derived.thin = thin_walls(tsdf, &contour);
            derived.seconds.insert("contour_checks", start.elapsed().as_secs_f64());
            derived.contour = Some(contour);
        }
        if settings.wants(MapKind::Esdf) {
            let start = Instant::now();
            derived.esdf = Some(dense_plane_esdf(tsdf, settings.esdf));
            derived.seconds.insert("esdf", start.elapsed().as_secs_f64());
        }
        derived
    }

    /// Bytes of each derived field, measured.
    pub(crate) fn bytes(&self) -> BTreeMap<&'static str, usize> {
        let contour = self.contour.iter().map(|c| ("contour", c.memory_bytes()));
        contour.chain(self.esdf.iter().map(|e| ("esdf", e.memory_bytes()))).collect()
    }
}

/// Everything that is written.
pub(crate) struct Artefacts<'a> {
    pub(crate) file: &'a MapFile<2>,
    pub(crate) derived: &'a Derived,
    /// What the picture's title says.
    pub(crate) title: String,
}

impl Artefacts<'_> {
    /// Writes all files but `summary.json` and gives their names and the seconds that they took. What an
    /// earlier run left in the folder and this one does not make is removed: it would belong to another map.
    pub(crate) fn write(
        &self,
        folder: &Path,
    ) -> anyhow::Result<(Vec<&'static str>, BTreeMap<&'static str, f64>)> {
        let mut written = Vec::new();
        let mut seconds = BTreeMap::new();
        let start = Instant::now();
        if let Some(esdf) = &self.derived.esdf {
            let status = status_plane(esdf);
            write_esdf(folder.join("esdf.bin"), esdf.grid(), esdf.samples(), status.as_deref())?;
            written.push("esdf.bin");
        }
        if let Some(contour) = &self.derived.contour {
            let lines = polylines(contour);
            write_geojson(folder.join("contour.geojson"), &lines)?;
            write_svg(folder.join("contour.svg"), &lines, &SvgStyle::default())?;
            written.extend(["contour.geojson", "contour.svg"]);
        }
        if let Some((grid, cells)) = cells_for_map_server(self.file) {
            write_map_server(folder.join("map.yaml"), &grid, &cells)?;
            written.extend(["map.pgm", "map.yaml"]);
        }
        seconds.insert("write", start.elapsed().as_secs_f64());
        let start = Instant::now();
        if let Some(png) = picture::of_map(self.file, self.derived, &self.title) {
            write_atomic(folder.join("map.png"), |w| std::io::Write::write_all(w, &png))?;
            written.push("map.png");
        }
        seconds.insert("picture", start.elapsed().as_secs_f64());
        let start = Instant::now();
        self.file.write(folder.join("map.portolan"))?;
        written.push("map.portolan");
        remove_stale(folder, &written)?;
        *seconds.entry("write").or_default() += start.elapsed().as_secs_f64();
        Ok((written, seconds))
    }
}

/// The lines of a contour as files hold them: closed ones repeat their first point.
pub(crate) fn polylines(contour: &Contour) -> Vec<Polyline> {
    let closed = |line: portolan::surface::Polyline| {
        let mut points = line.vertices;
        if line.closed {
            points.extend(points.first().copied());
        }
        points
    };
    contour.polylines().into_iter().map(closed).collect()
}

/// Writes lines as GeoJSON or SVG, by the name of the file. `false`: the name is of neither.
pub(crate) fn write_contour(path: &Path, lines: &[Polyline]) -> anyhow::Result<bool> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("geojson" | "json") => write_geojson(path, lines)?,
        Some("svg") => write_svg(path, lines, &SvgStyle::default())?,
        _ => return Ok(false),
    }
    Ok(true)
}

/// More likely occupied than this is occupied, less likely than the second is free.
const OCCUPIED: f64 = 0.65;
const FREE: f64 = 0.25;

/// The cells of a map_server map: from the occupancy grid, else from the tree, else from the signs of the
/// distances. `None`: the file has no map.
/// A tree may span more than any array can hold: dense files of it stop here.
const MOST_CELLS: usize = 1 << 28;

/// The box of the observed leaves of a tree: the root may be much larger than what was seen.
pub(crate) fn seen_by_tree(map: &Quadtree) -> Option<Grid<2>> {
    let mut low = [i32::MAX; 2];
    let mut high = [i32::MIN; 2];
    map.store().for_each_leaf(|leaf| {
        for k in 0..2 {
            low[k] = low[k].min(leaf.cell[k]);
            high[k] = high[k].max(leaf.cell[k] + (1 << leaf.height));
        }
    });
    let lattice = map.store().grid().lattice;
    let shape = [0, 1].map(|k| high[k].saturating_sub(low[k]).max(0) as usize);
    (low[0] < high[0]).then(|| Grid::new(lattice.corner(low), lattice.resolution, shape))
}

pub(crate) fn cells_for_map_server(file: &MapFile<2>) -> Option<(Grid<2>, Vec<MapCell>)> {
    let decide = |p: Option<f64>| match p {
        Some(p) if p > OCCUPIED => MapCell::Occupied,
        Some(p) if p < FREE => MapCell::Free,
        _ => MapCell::Unknown,
    };
    if let Some(map) = &file.grid {
        // 256 values: a table instead of an exponential per cell.
        let table: Vec<MapCell> = (i8::MIN..=i8::MAX)
            .map(|v| {
                let value = portolan::cell::LogOdds8(v);
                decide((!value.is_unobserved()).then(|| value.probability(map.rule())))
            })
            .collect();
        let cells = map.store().planes().iter().map(|v| table[(i16::from(v.0) + 128) as usize]).collect();
        return Some((*map.store().grid(), cells));
    }
    if let Some(map) = &file.tsdf {
        let grid = *map.grid();
        let cell = |i: usize| map.store().at(i).map(|c| if c.distance < 0.0 { 1.0 } else { 0.0 });
        return Some((grid, (0..grid.len()).map(|i| decide(cell(i))).collect()));
    }
    let map = file.tree.as_ref()?;
    let grid = seen_by_tree(map).filter(|grid| grid.len() <= MOST_CELLS)?;
    let cells = (0..grid.len()).map(|i| decide(map.probability(grid.lattice.center(grid.cell(i))).known()));
    Some((grid, cells.collect()))
}
