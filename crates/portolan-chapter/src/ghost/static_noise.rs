//! What forgetting costs: a map that forgets never comes to rest.

use super::settings::{GhostSettings, chair, lap_config, map_config};
use portolan::geom::Grid;
use portolan::map::{MapError, Tsdf2};
use portolan_sim::{apartment, lap};
use serde::Serialize;

/// Noise of a map of a world in which nothing moves.
///
/// A lidar that loses no beam makes maps as noisy as predicted (within some percent). Lost beams add to it, more so for
/// large clamps: single views are biased, each in its own way (projective distances), and a view that is
/// missing in one lap moves the mean of the others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StaticNoise {
    /// The clamp of the weight; as JSON that of its [`GhostRun`](super::GhostRun).
    #[serde(skip)]
    pub w_max: f32,
    /// Saturated cells in front of surfaces that were followed.
    pub cells: usize,
    /// Standard deviation of a single observation of such a cell, at full weight (meters).
    pub observation: f64,
    /// Median weight of an observation.
    pub weight: f64,
    /// Standard deviation of the cells' distances from lap to lap, each time at the same place of the lap, over all
    /// places where the cell is observed (meters).
    pub measured: f64,
    /// `sqrt(sigma^2 / (2 W_max + w))` (meters).
    pub predicted: f64,
    /// Zero crossings between neighboring cells that were followed.
    pub crossings: usize,
    /// Standard deviation of their places from lap to lap, at the end of the lap (meters).
    pub crossing: f64,
}

/// Sums for a variance (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    n: f64,
    mean: f64,
    m2: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.n += 1.0;
        let off = value - self.mean;
        self.mean += off / self.n;
        self.m2 += off * (value - self.mean);
    }
}

/// A cell in front of a surface.
struct Front {
    cell: [i32; 2],
    /// Of each scan of the lap, its observations of the cell over the laps.
    said: Vec<Moments>,
    /// For each map the same of the estimate afterwards.
    estimates: Vec<Vec<Moments>>,
    weight: Moments,
}

/// The pooled variance over all scans that said something in several laps, and the degrees of freedom.
fn pooled(moments: &[Moments]) -> [f64; 2] {
    let [m2, freedom] = moments.iter().fold([0.0; 2], |[a, b], m| [a + m.m2, b + (m.n - 1.0).max(0.0)]);
    [m2 / freedom, freedom]
}

/// Measures the noise of static maps, one for each `W_max` of the settings, around the chair: `burn_in` laps to
/// forget the beginning, then `laps` laps of which each gives one reading of every cell. Driving is most of the cost.
///
/// # Errors
/// Where resolution, truncation or a clamp is not possible.
pub fn static_noise(
    settings: &GhostSettings,
    burn_in: usize,
    laps: usize,
) -> Result<Vec<StaticNoise>, MapError> {
    let world = apartment().world;
    let region = chair(&world).grown(1.2);
    let grid =
        Grid::covering(region, settings.resolution).ok_or(MapError::Resolution(settings.resolution))?;
    let map = |&w_max: &f32| Tsdf2::covering(&grid, map_config(settings, w_max));
    let mut maps = settings.w_max.iter().map(map).collect::<Result<Vec<_>, _>>()?;
    let distance = |cell: [i32; 2]| world.signed_distance(grid.lattice.center(cell));
    let front = (0..grid.len()).map(|i| grid.cell(i));
    let front = front.filter(|&c| (0.0..0.5 * settings.truncation).contains(&distance(c)));
    let mut fronts: Vec<Front> = front
        .map(|cell| {
            let said = vec![Moments::default(); settings.lap.scans];
            Front { cell, estimates: vec![said.clone(); maps.len()], said, weight: Moments::default() }
        })
        .collect();
    fronts.sort_by_key(|f| f.cell);
    maps.iter_mut().for_each(|m| m.watch(fronts.iter().map(|f| f.cell)));

    // Snapshots after each lap: [map][lap] planes of distances.
    let mut snapshots = vec![Vec::new(); maps.len()];
    for k in 0..burn_in + laps {
        for (i, (pose, scan)) in lap(&world, &lap_config(settings, k)).iter().enumerate() {
            for map in &mut maps {
                map.integrate(pose, scan)?;
            }
            if k < burn_in {
                continue;
            }
            for (m, map) in maps.iter().enumerate() {
                for (cell, event) in map.events() {
                    let Ok(f) = fronts.binary_search_by_key(cell, |f| f.cell) else { continue };
                    let front = &mut fronts[f];
                    front.estimates[m][i].add(event.after);
                    // Observations do not depend on the clamp: one map's are those of all.
                    if m == 0 {
                        front.said[i].add(event.observation);
                        front.weight.add(event.weight_before * event.gain / (1.0 - event.gain));
                    }
                }
            }
        }
        if k >= burn_in {
            for (map, snapshots) in maps.iter().zip(&mut snapshots) {
                snapshots.push(map.store().planes().distances().to_vec());
            }
        }
    }
    let told = maps.iter().zip(&snapshots).enumerate();
    Ok(told.map(|(m, map)| summarise(m, map, &fronts, laps)).collect())
}

fn summarise(
    m: usize,
    (map, snapshots): (&Tsdf2, &Vec<Vec<f32>>),
    fronts: &[Front],
    laps: usize,
) -> StaticNoise {
    let (grid, w_max) = (map.grid(), f64::from(map.config().w_max));
    let (mut cells, mut observed, mut measured, mut predicted) = (0usize, 0.0, 0.0, 0.0);
    let (mut crossings, mut crossing) = (0usize, 0.0);
    let mut weights = Vec::new();
    for front in fronts {
        let Some(i) = grid.index(front.cell) else { continue };
        let saturated = f64::from(map.store().planes().weights()[i]) >= w_max;
        let [variance_said, freedom] = pooled(&front.said);
        let per_lap = front.said.iter().map(|s| s.n).sum::<f64>() / laps as f64;
        if !saturated || per_lap < 3.0 || freedom < 10.0 {
            continue;
        }
        let weight = front.weight.mean;
        // The model: an observation of weight w has variance sigma^2 / w.
        let sigma_sq = weight * variance_said;
        let kept = correlation_bias(libm::pow(w_max / (w_max + weight), per_lap), laps);
        cells += 1;
        observed += sigma_sq;
        measured += pooled(&front.estimates[m])[0] / kept;
        predicted += sigma_sq / (2.0 * w_max + weight);
        weights.push(weight);
        for step in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
            let beside = grid.index([front.cell[0] + step[0], front.cell[1] + step[1]]);
            let behind = |j: &usize| snapshots.iter().all(|s| s[i] > 0.0 && s[*j] < 0.0);
            if let Some(j) = beside.filter(behind) {
                crossings += 1;
                let r = grid.lattice.resolution;
                let mut moments = Moments::default();
                snapshots.iter().for_each(|s| moments.add(r * f64::from(s[i]) / f64::from(s[i] - s[j])));
                crossing += moments.m2 / (moments.n - 1.0) / kept;
            }
        }
    }
    weights.sort_by(f64::total_cmp);
    let root = |sum: f64, n: usize| (sum / n as f64).sqrt();
    StaticNoise {
        w_max: map.config().w_max,
        cells,
        observation: root(observed, cells),
        weight: weights.get(weights.len() / 2).copied().unwrap_or(f64::NAN),
        measured: root(measured, cells),
        predicted: root(predicted, cells),
        crossings,
        crossing: root(crossing, crossings),
    }
}

/// A sample variance of `n` readings that remember each other by `rho` from one to the next is too small, by this
/// factor: `1 - 2 / (n (n - 1)) sum_k (n - k) rho^k`.
fn correlation_bias(rho: f64, n: usize) -> f64 {
    let (mut sum, mut power) = (0.0, 1.0);
    for k in 1..n {
        power *= rho;
        sum += (n - k) as f64 * power;
    }
    1.0 - 2.0 * sum / (n * (n - 1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan_sim::Random;

    #[test]
    fn the_bias_of_correlated_readings_is_as_computed() {
        let (rho, n) = (0.6f64, 8);
        let mut random = Random::stream(1, 0);
        let mut sum = 0.0;
        for _ in 0..20_000 {
            let mut x = random.normal();
            let mut moments = Moments::default();
            for _ in 0..n {
                moments.add(x);
                x = rho * x + (1.0 - rho * rho).sqrt() * random.normal();
            }
            sum += moments.m2 / (moments.n - 1.0);
        }
        let mean = sum / 20_000.0;
        assert!((mean - correlation_bias(rho, n)).abs() < 0.02, "{mean} {}", correlation_bias(rho, n));
    }
}
