//! The files that a mapping run leaves behind.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use portolan::cell::LogOddsRule;
use portolan::geom::Aabb;
use portolan_io::{
    IoError, MapFile, SvgStyle, write_atomic, write_esdf, write_geojson, write_map_server, write_octomap_bt,
    write_octomap_ot, write_svg,
};

use super::files::{dense_esdf, polylines, write_mesh};
use super::movers::{FoundMovers, MOVERS_FILE};
use super::preview::Over;
use super::sigma::{Calibration, SIGMA_FILE};
use super::{Derived, DistanceField, cells_for_map_server, picture, preview};
use crate::esdf::status_plane;
use crate::saved::SavedMap;
use crate::up::Up;

/// Names of what may be written beside a map.
pub(crate) const ARTIFACTS: [&str; 14] = [
    "contour.geojson",
    "contour.svg",
    "esdf.bin",
    "map.pgm",
    "map.png",
    "map.yaml",
    "mesh.ply",
    "movers.ply",
    "obstacles.csv",
    "octree.bt",
    "octree.ot",
    "preview.png",
    "sigma.json",
    "sigma.png",
];

/// Everything that is written.
pub(crate) struct Artifacts<'a> {
    pub(crate) file: &'a SavedMap,
    pub(crate) derived: &'a Derived,
    /// The box of a 3-D distance field that goes into `esdf.bin`; `None`: all of it.
    pub(crate) dense: Option<Aabb<3>>,
    /// Of a cell (meters).
    pub(crate) edge: f64,
    /// Whether the sensor is a camera, which looks along z.
    pub(crate) camera: bool,
    /// What moved and is not in the map.
    pub(crate) movers: Option<&'a FoundMovers>,
    /// How sure the surface is.
    pub(crate) sigma: Option<&'a Calibration>,
    /// Title of the picture.
    pub(crate) title: String,
}

/// What writing did.
#[derive(Default)]
pub(crate) struct Written {
    pub(crate) files: Vec<&'static str>,
    pub(crate) seconds: BTreeMap<&'static str, f64>,
    /// What was not written, and why.
    pub(crate) notes: Vec<String>,
}

impl Written {
    /// Of a folder with the map alone.
    pub(crate) fn of_map_alone() -> Self {
        Self { files: vec!["map.portolan"], ..Self::default() }
    }
}

impl Artifacts<'_> {
    /// Writes all files but `map.portolan`, which was saved before anything was derived from it, and `summary.json`.
    pub(crate) fn write(&self, folder: &Path) -> anyhow::Result<Written> {
        let mut written = Written { notes: self.derived.notes.clone(), ..Written::default() };
        let start = Instant::now();
        self.write_surface(folder, &mut written)?;
        self.write_octree(folder, &mut written)?;
        self.write_esdf(folder, &mut written)?;
        self.write_obstacles(folder, &mut written)?;
        self.write_map_server(folder, &mut written)?;
        written.files.push("map.portolan");
        written.seconds.insert("write", start.elapsed().as_secs_f64());
        self.write_picture(folder, &mut written)?;
        self.write_movers(folder, &mut written)?;
        self.write_sigma(folder, &mut written)?;
        Ok(written)
    }

    /// `movers.ply`: what moved.
    pub(crate) fn write_movers(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let Some(movers) = self.movers else { return Ok(()) };
        movers.write(&folder.join(MOVERS_FILE))?;
        written.files.push(MOVERS_FILE);
        Ok(())
    }

    /// `sigma.json` and `sigma.png`: how sure the surface is.
    fn write_sigma(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let Some(calibration) = self.sigma else { return Ok(()) };
        calibration.write(&folder.join(SIGMA_FILE))?;
        written.files.push(SIGMA_FILE);
        let sigma = calibration.sigma();
        let png = match self.file {
            SavedMap::Two(file) => picture::of_sigma(file, self.derived, sigma, &self.title),
            SavedMap::Three(file) => {
                let map = file.tsdf_bricks.as_ref().map(|map| Over::Sigma(sigma, &map.store));
                self.preview(file, map)
            }
        };
        if let Some(png) = png {
            write_atomic(folder.join("sigma.png"), |w| w.write_all(&png))?;
            written.files.push("sigma.png");
        }
        Ok(())
    }

    /// Views of the mesh.
    fn preview(&self, file: &MapFile<3>, over: Option<Over<'_>>) -> Option<Vec<u8>> {
        let up = Up::of_header(&file.header).map(|up| up.0);
        let mesh = self.derived.mesh.as_ref()?;
        preview::of_mesh(mesh, &file.poses, self.camera, up, over, &self.title)
    }

    fn write_surface(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        if let Some(mesh) = &self.derived.mesh {
            write_mesh(&folder.join("mesh.ply"), mesh)?;
            written.files.push("mesh.ply");
        }
        if let Some(contour) = &self.derived.contour {
            let lines = polylines(&contour.contour);
            write_geojson(folder.join("contour.geojson"), &lines)?;
            write_svg(folder.join("contour.svg"), &lines, &SvgStyle::default())?;
            written.files.extend(["contour.geojson", "contour.svg"]);
        }
        Ok(())
    }

    fn write_octree(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let SavedMap::Three(file) = self.file else { return Ok(()) };
        let (Some(octree), Some(map)) = (&self.derived.octree, &file.occupancy_bricks) else { return Ok(()) };
        let rule = LogOddsRule::<i8>::new(&map.model)?;
        let bt = write_octomap_bt(folder.join("octree.bt"), &octree.tree);
        let ot = write_octomap_ot(folder.join("octree.ot"), &octree.tree, rule.quantum);
        if bt.is_ok() || ot.is_ok() {
            written.notes.extend(octree.note());
        }
        for (name, result) in [("octree.bt", bt), ("octree.ot", ot)] {
            match result {
                Ok(()) => written.files.push(name),
                // The format's own limits: the map is whole without it.
                Err(error @ IoError::Unwritable { .. }) => written.notes.push(error.to_string()),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    fn write_esdf(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let path = folder.join("esdf.bin");
        match &self.derived.esdf {
            None => return Ok(()),
            Some(DistanceField::Two { cells, .. }) => {
                write_esdf(path, cells.grid(), cells.samples(), status_plane(cells).as_deref())?;
            }
            Some(DistanceField::Three(esdf)) => match dense_esdf(esdf, self.dense.as_ref()) {
                Ok(dense) => write_esdf(path, dense.grid(), dense.samples(), Some(&dense.status_bytes()))?,
                Err(why) => {
                    written.notes.push(format!("esdf.bin was not written: {why}"));
                    return Ok(());
                }
            },
        }
        written.files.push("esdf.bin");
        Ok(())
    }

    /// `obstacles.csv`: what the distances are measured to beside the surface.
    fn write_obstacles(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let Some(esdf) = &self.derived.esdf else { return Ok(()) };
        let axes = if matches!(self.file, SavedMap::Two(_)) { "x,y" } else { "x,y,z" };
        write_atomic(folder.join("obstacles.csv"), |w| {
            writeln!(w, "{axes},edge,kind")?;
            for (center, kind) in esdf.points() {
                center.iter().try_for_each(|v| write!(w, "{},", shortest(*v)))?;
                writeln!(w, "{},{}", self.edge, kind.word())?;
            }
            Ok(())
        })?;
        written.files.push("obstacles.csv");
        Ok(())
    }

    fn write_map_server(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let SavedMap::Two(file) = self.file else { return Ok(()) };
        if let Some((grid, cells)) = cells_for_map_server(file) {
            write_map_server(folder.join("map.yaml"), &grid, &cells)?;
            written.files.extend(["map.pgm", "map.yaml"]);
        }
        Ok(())
    }

    /// `map.png` of a 2-D map, `preview.png` of a mesh.
    fn write_picture(&self, folder: &Path, written: &mut Written) -> anyhow::Result<()> {
        let start = Instant::now();
        let movers = self.movers.map_or(&[][..], FoundMovers::points);
        let (stage, name, png) = match self.file {
            SavedMap::Two(file) => {
                ("picture", "map.png", picture::of_map(file, self.derived, movers, &self.title))
            }
            SavedMap::Three(file) => {
                ("preview", "preview.png", self.preview(file, Some(Over::Movers(movers, self.edge))))
            }
        };
        if let Some(png) = png {
            write_atomic(folder.join(name), |w| w.write_all(&png))?;
            written.files.push(name);
        }
        written.seconds.insert(stage, start.elapsed().as_secs_f64());
        Ok(())
    }
}

/// Without the rounding error of the product that a coordinate is: to a tenth of a nanometer.
fn shortest(v: f64) -> f64 {
    (v * 1e10).round() / 1e10
}

/// Title of the picture of a map: its logs, its cells, its scans.
pub(crate) fn title(logs: &[String], resolution: f64, scans: u64) -> String {
    let names: Vec<_> = logs.iter().map(|name| stem(name)).collect();
    // Without the rounding error of the product: 0.07 m are 7 cm.
    let in_cm = (resolution * 1e8).round() / 1e6;
    let cells = if resolution < 1.0 { format!("{in_cm} cm") } else { format!("{resolution} m") };
    format!("{} · cells of {cells} · {scans} scans", names.join(" + "))
}

/// A file name without folders, packing and kind.
fn stem(path: &str) -> String {
    let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy();
    let mut name: &str = &name;
    for end in [".gz", ".bz2", ".log", ".clf", ".gfs"] {
        name = name.strip_suffix(end).unwrap_or(name);
    }
    name.to_owned()
}
