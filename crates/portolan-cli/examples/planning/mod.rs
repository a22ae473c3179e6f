//! What both planners share: a map, a search over its cells, a picture.
#![allow(dead_code)] // either example uses another part

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use portolan::field::{ClearanceField, Esdf, EsdfSettings, UnknownSpace};
use portolan::geom::{Aabb, Grid, Pose, vector};
use portolan::map::{Tsdf2, TsdfConfig};
use portolan::plan::{Demand, PathCheck, Waypoints, check_path};
use portolan::scan::{RangeLimits, Scan};
use portolan::surface::{Contour, ContourSettings, marching_squares};
use portolan_draw::{Anchor, Canvas, Chart, Color, Entry, Font, Pen, PixelRect, Swatch, View, color};
use portolan_io::{LaserLog, detect_no_return};

/// A map, the clearance in it, and where the robot was that made it.
pub(crate) struct Place {
    pub(crate) name: String,
    pub(crate) grid: Grid<2>,
    pub(crate) field: Esdf<2>,
    pub(crate) contour: Contour,
    pub(crate) way: Vec<[f64; 2]>,
}

/// The Intel research lab, where the real logs lie: in `PORTOLAN_DATA`, else beside the repository.
pub(crate) fn intel() -> Option<PathBuf> {
    let folder = std::env::var_os("PORTOLAN_DATA").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    Some(folder.join("lidar2d_carmen/intel-corrected.log.gz")).filter(|path| path.is_file())
}

impl Place {
    /// The map of a CARMEN log at 5 cm; without one, of a lap through the simulator's apartment.
    pub(crate) fn of(log: Option<&Path>) -> anyhow::Result<Self> {
        let (name, scans): (String, Vec<(Pose<2>, Scan<2>)>) = match log {
            Some(path) => {
                let log = LaserLog::read_carmen(path)?;
                let no_return = detect_no_return(&log).unwrap_or(f64::INFINITY);
                let limits = RangeLimits { no_return, ..RangeLimits::default() };
                (
                    path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                    log.scans(&limits).collect(),
                )
            }
            None => {
                let world = portolan_sim::apartment().world;
                ("the apartment".to_owned(), portolan_sim::lap(&world, &portolan_sim::LapConfig::default()))
            }
        };
        let mut seen = Aabb::EMPTY;
        for (pose, scan) in &scans {
            seen.include(pose.translation);
            scan.hits_world(pose).for_each(|p| seen.include(p));
        }
        let grid = Grid::covering(seen.grown(0.5), 0.05).context("the log has no box")?;
        let mut tsdf = Tsdf2::covering(&grid, TsdfConfig::default())?;
        for (pose, scan) in &scans {
            tsdf.integrate(pose, scan)?;
        }
        let how = EsdfSettings { max_distance: 2.0, unknown: true, ..EsdfSettings::default() };
        let field = Esdf::of(&tsdf, &how);
        let contour = marching_squares(&tsdf, &ContourSettings::of(&tsdf));
        let way = scans.iter().map(|(pose, _)| pose.translation).collect();
        Ok(Self { name, grid, field, contour, way })
    }

    /// What is certified at a point, with the library's default for unknown space, an obstacle: at least, and at most (meters).
    pub(crate) fn clearance(&self, p: [f64; 2]) -> Option<[f64; 2]> {
        use portolan::Answer::{Known, Saturated};
        match self.field.clearance(p, UnknownSpace::default()) {
            Known(c) | Saturated(c) if !c.inside => Some([c.lower, c.upper]),
            _ => None,
        }
    }

    /// The largest clearance that a line is certified to keep at every point (meters), to a millimeter; an error says
    /// where it does not even keep `demanded`.
    pub(crate) fn certified(&self, line: &[[f64; 2]], demanded: f64) -> anyhow::Result<f64> {
        let path = Waypoints::new(line.to_vec())?;
        let (mut low, mut high) = match check_path(&self.field, &path, &Demand::new(demanded)) {
            PathCheck::Certified(least) => (demanded.max(least.lower), least.upper.min(10.0)),
            PathCheck::Violated(v) => bail!("not certified from {:.2} m on: {:?}", v.from, v.cause),
        };
        while high - low > 1e-3 {
            let middle = 0.5 * (low + high);
            let holds = check_path(&self.field, &path, &Demand::new(middle)).is_certified();
            if holds { low = middle } else { high = middle }
        }
        Ok(low)
    }

    /// A* over the centers of cells (Hart, Nilsson, Raphael 1968) for a robot of this radius (meters). Where less than
    /// `comfort` is certified a meter costs up to `dear` times as much. `None`: no way.
    ///
    /// Cells count where the radius and half of a diagonal are certified: then the lines between neighbours are free, all
    /// of them.
    pub(crate) fn search(
        &self,
        from: [f64; 2],
        to: [f64; 2],
        radius: f64,
        comfort: f64,
        dear: f64,
    ) -> Option<Vec<[f64; 2]>> {
        let (grid, r) = (&self.grid, self.grid.lattice.resolution);
        let room: Vec<f64> = (0..grid.len())
            .map(|i| self.clearance(grid.lattice.center(grid.cell(i))).map_or(0.0, |[lower, _]| lower))
            .collect();
        let least = radius + 0.5 * r * 2f64.sqrt();
        let [start, goal] = [grid.index_of(from)?, grid.index_of(to)?];
        let center = |i: usize| grid.lattice.center(grid.cell(i));
        let mut cost = vec![f64::INFINITY; grid.len()];
        let mut before = vec![usize::MAX; grid.len()];
        let mut open = BinaryHeap::new();
        // Lengths in micrometres: whole numbers can be ordered.
        let key = |cost: f64, i: usize| ((cost + vector::distance(center(i), center(goal))) * 1e6) as u64;
        cost[start] = 0.0;
        open.push(Reverse((key(0.0, start), start)));
        while let Some(Reverse((at_key, i))) = open.pop() {
            if i == goal {
                let mut path = vec![goal];
                while let Some(&last) = path.last().filter(|&&last| last != start) {
                    path.push(before[last]);
                }
                return Some(path.into_iter().rev().map(center).collect());
            }
            if at_key > key(cost[i], i) {
                continue; // a shorter way to it was found since
            }
            let cell = grid.cell(i);
            let around = (0..9).map(|k| [cell[0] + k % 3 - 1, cell[1] + k / 3 - 1]);
            for j in around.filter_map(|c| grid.index(c)).filter(|&j| j != i && room[j] >= least) {
                let tight = ((comfort - room[j]) / (comfort - radius)).clamp(0.0, 1.0);
                let step = vector::distance(center(i), center(j)) * (1.0 + (dear - 1.0) * tight);
                if cost[i] + step < cost[j] {
                    cost[j] = cost[i] + step;
                    before[j] = i;
                    open.push(Reverse((key(cost[j], j), j)));
                }
            }
        }
        None
    }

    /// Lower bounds along a line, every 2 cm: arc length, meters.
    pub(crate) fn profile(&self, line: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let points = resampled(line, (length(line) / 0.02).ceil() as usize + 2);
        let mut at = 0.0;
        let mut last = None;
        let along = |p: &[f64; 2]| {
            at += last.map_or(0.0, |q| vector::distance(q, *p));
            last = Some(*p);
            [at, self.clearance(*p).map_or(0.0, |[lower, _]| lower)]
        };
        points.iter().map(along).collect()
    }
}

/// Length of a line (meters).
pub(crate) fn length(line: &[[f64; 2]]) -> f64 {
    line.windows(2).map(|w| vector::distance(w[0], w[1])).sum()
}

/// So many points at equal distances along a line, both ends among them.
pub(crate) fn resampled(line: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    let step = length(line) / (count - 1) as f64;
    let (mut leg, mut done) = (0, 0.0);
    (0..count)
        .map(|i| {
            let s = step * i as f64;
            while leg + 2 < line.len() && s > done + vector::distance(line[leg], line[leg + 1]) {
                done += vector::distance(line[leg], line[leg + 1]);
                leg += 1;
            }
            let [a, b] = [line[leg], line[leg + 1]];
            let t = ((s - done) / vector::distance(a, b).max(1e-12)).clamp(0.0, 1.0);
            [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
        })
        .collect()
}

/// A line of a picture, and of the chart under it.
pub(crate) struct Drawn<'a> {
    pub(crate) name: &'a str,
    pub(crate) line: &'a [[f64; 2]],
    pub(crate) color: Color,
    /// The robot is drawn along it, as wide as it is (meters).
    pub(crate) robot: Option<f64>,
}

/// The map with lines on it, and the certified clearance along them, as PNG bytes.
pub(crate) fn picture(place: &Place, title: &str, words: &str, lines: &[Drawn], demanded: f64) -> Vec<u8> {
    const MARGIN: f64 = 28.0;
    const WIDTH: f64 = 1344.0;
    const CHART: f64 = 330.0;
    let mut shown = Aabb::EMPTY;
    lines.iter().flat_map(|l| l.line).for_each(|p| shown.include(*p));
    let shown = shown.grown(1.5);
    let shown = Aabb::new(
        [0, 1].map(|k| shown.min[k].max(place.grid.aabb().min[k])),
        [0, 1].map(|k| shown.max[k].min(place.grid.aabb().max[k])),
    );
    let [w, h] = shown.extent();
    let height = (WIDTH * h / w).min(1100.0);
    let (heading, small) = (Font::new(24).bold(), Font::new(16));
    let subtitle = small.wrap(words, WIDTH);
    let top = MARGIN + 34.0 + subtitle.len() as f64 * 18.0 + 40.0;
    let map = PixelRect::new(MARGIN, top, WIDTH, height);
    let chart = PixelRect::new(MARGIN, map.bottom() + 24.0, WIDTH, CHART);
    let mut canvas = Canvas::new((WIDTH + 2.0 * MARGIN) as u32, (chart.bottom() + MARGIN) as u32);
    canvas.text([MARGIN, MARGIN - 4.0], &heading.fit(title, WIDTH), heading, Anchor::Left);
    for (k, line) in subtitle.iter().enumerate() {
        let at = [MARGIN, MARGIN + 26.0 + 18.0 * k as f64];
        canvas.text(at, line, small.color(color::MUTED), Anchor::Left);
    }
    let mut legend: Vec<Entry> =
        lines.iter().map(|l| Entry::new(Swatch::Line(Pen::new(l.color, 3.0)), l.name)).collect();
    legend.push(Entry::new(Swatch::Line(Pen::new(color::SURFACE, 2.5)), "surface of the map"));
    legend.push(Entry::new(Swatch::Area(color::signed_distance(1.0, 2.0).over(color::PAPER)), "1 m away"));
    legend.push(Entry::new(Swatch::Area(color::UNKNOWN), "not observed"));
    canvas.legend(PixelRect::new(MARGIN, top - 34.0, WIDTH, 30.0), &legend, small);

    let view = View::fit(shown.min, shown.max, map);
    canvas.fill_rect(view.rect(), color::UNKNOWN);
    let (grid, field) = (&place.grid, &place.field);
    canvas.raster(&view, grid.shape, grid.lattice.origin, grid.lattice.resolution, |[x, y]| {
        use portolan::Answer::{Known, Saturated};
        match field.distance(grid.lattice.center([x as i32, y as i32])) {
            Known(d) | Saturated(d) => color::signed_distance(d, 2.0).over(color::PAPER),
            _ => color::UNKNOWN,
        }
    });
    for drawn in lines {
        let Some(radius) = drawn.robot else { continue };
        let wide = 2.0 * radius * view.scale()[0];
        canvas.polyline(&view, drawn.line, Pen::new(drawn.color.with_alpha(0.22), wide));
    }
    let segments: Vec<_> = place.contour.ends().collect();
    canvas.segments(&view, &segments, Pen::new(color::SURFACE, 2.0));
    for drawn in lines {
        canvas.polyline(&view, drawn.line, Pen::new(drawn.color, 2.5));
    }
    if let Some(ends) = lines.first().and_then(|l| l.line.first().zip(l.line.last())) {
        canvas.dots(&view, &[*ends.0, *ends.1], 6.0, color::INK);
    }
    canvas.scale_bar(&view);

    let mut below = Chart::new(format!(
        "Certified clearance along the way (unknown space: {})",
        UnknownSpace::default().word()
    ))
    .x("way (m)")
    .y("at least (m)")
    .y_range(0.0, 1.2)
    .horizontal(demanded, "demanded", color::MUTED);
    for drawn in lines {
        below = below.series(portolan_draw::Series::line(drawn.name, place.profile(drawn.line), drawn.color));
    }
    below.draw(&mut canvas, chart);
    canvas.encode_png()
}
