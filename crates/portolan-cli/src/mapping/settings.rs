//! The settings of `map`: options of the command line, fields of saved maps and of `summary.json`, all from one list.

use anyhow::bail;
use clap::ValueEnum;
use portolan::cell::TsdfRule;
use portolan::scan::Body;
use portolan::sweep::WeightModel;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value, json};

use super::choices::{MapKind, SweepArg, WeightsArg, word};
use crate::arguments::{Bounds, ForgettingArgs, Shift, bodies, body, bounds, length, share, shift, thin};
use crate::dimension::{Dimension, ONLY_3D, option};
use crate::error::bad_call;
use crate::esdf::EsdfArg;
use crate::json::object;
use crate::log::{LimitArgs, NoReturnArgs, RangeArgs, Selection};
use crate::up::{Up, up};
use portolan::map::{CARVE_WEIGHT, W_MAX};
use portolan::mapper::{MapperSettings, THIN};

/// What shapes the cells: a map can only be gone on with under the same values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub(crate) struct Shape {
    /// Edge of a cell (meters) [default with --append: that of the map]
    #[arg(long, value_name = "R", value_parser = length, allow_negative_numbers = true)]
    #[arg(required = false, required_unless_present_any = ["append", "repose"])]
    pub(crate) resolution: f64,
    /// Truncation distance: signed distances are stored up to here on either side of a surface (meters) [default: three
    /// cells]
    #[arg(long, value_name = "T", value_parser = length, allow_negative_numbers = true)]
    pub(crate) truncation: Option<f64>,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) forgetting: ForgettingArgs,
    /// Weight of each beam [default: constant]
    #[arg(long, value_enum, required = false)]
    pub(crate) weights: WeightsArg,
    /// How scans become evidence [default: cell-centre in 2-D, auto in 3-D]
    #[arg(long, value_enum)]
    pub(crate) sweep: Option<SweepArg>,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) range: RangeArgs,
    /// Do not fuse the free space in front of surfaces into the signed distances: faster, but free space stays unknown
    #[arg(long = "no-carve", action = clap::ArgAction::SetFalse)]
    pub(crate) carve: bool,
    /// Weight of free space relative to that of a surface, above 0 and at most 1. A lower weight keeps thin objects;
    /// what has gone fades as fast with any [default: 0.2; the textbook uses 1]
    #[arg(long, value_name = "W", value_parser = share, allow_negative_numbers = true, conflicts_with = "carve")]
    #[arg(required = false)]
    #[serde(serialize_with = "four_digits")]
    pub(crate) carve_weight: f32,
    /// Do not fuse color
    #[arg(long = "no-color", action = clap::ArgAction::SetFalse, help_heading = ONLY_3D)]
    pub(crate) color: bool,
    /// Leave the motion of the sensor within a scan in. Without this it is taken out where points have times and poses cover
    /// them
    #[arg(long = "no-deskew", action = clap::ArgAction::SetFalse)]
    pub(crate) deskew: bool,
    /// Leave out readings inside this part of the sensor's frame, which belong to the robot itself: a box
    /// x0,y0,z0,x1,y1,z1 or a sphere x,y,z,radius (meters); may be given several times
    #[arg(long, value_name = "BOX|SPHERE", value_parser = body, allow_hyphen_values = true, help_heading = ONLY_3D)]
    #[serde(with = "bodies")]
    pub(crate) self_filter: Vec<Body>,
    /// Insert points without rays: cells that hold points are occupied, everything else stays unknown. For fused maps and
    /// surveys, which do not say where points were seen from. Makes tree and esdf (distances to the nearest point's cell)
    #[arg(long, help_heading = ONLY_3D)]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) points_only: bool,
    /// Keep sums of whole numbers instead of clamped cells, and the list of scans: maps of parts of a log add up to the same
    /// bytes in any order (`merge`), scans can be taken out again or moved (--repose). Nothing is forgotten by itself, and no
    /// color is kept
    #[arg(long, conflicts_with_all = ["w_max", "half_life"])]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) ledger: bool,
    /// Take out what moved: a first pass over all scans finds the space that was seen open at other times, a second one leaves
    /// surfaces in it out of the maps, and lists them in movers.ply. SIGMA: standard deviation of the error of poses (meters)
    /// [default without a value: 0.03]
    #[arg(long, value_name = "SIGMA", value_parser = length, num_args = 0..=1, require_equals = true, default_missing_value = "0.03")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) movers: Option<f64>,
    /// Leave every N-th scan out of the map, for `eval --scans`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..), allow_negative_numbers = true)]
    pub(crate) hold_out: Option<u64>,
}

/// All settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub(crate) struct Settings {
    #[arg(skip)]
    #[serde(skip)]
    pub(crate) dimension: Dimension,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) shape: Shape,
    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) no_return: NoReturnArgs,
    /// Use only every N-th scan of the log
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    #[serde(serialize_with = "or_one")]
    pub(crate) every: Option<u64>,
    /// Map only this box: x0,y0,x1,y1 in 2-D, x0,y0,z0,x1,y1,z1 in 3-D (meters)
    #[arg(long, value_name = "BOX", value_parser = bounds, allow_hyphen_values = true)]
    #[serde(skip_deserializing)]
    pub(crate) bounds: Option<Bounds>,
    /// Where the map's own coordinates have their zero (x,y,z in meters, in the log's coordinates), for surveys at large
    /// coordinates: what is asked and written stays in the log's coordinates, but in OctoMap's files, which cannot hold
    /// them. auto: 0, or near the first scan where that is a million cells away [default: auto]
    #[arg(long, value_name = "auto|POINT|0", value_parser = shift, allow_hyphen_values = true, help_heading = ONLY_3D)]
    #[serde(skip_serializing_if = "Option::is_none", skip_deserializing)]
    pub(crate) shift: Option<Shift>,
    /// Which way is up, for pictures, floor plans and the studio: an axis like +z or -y, or a direction x,y,z [default: how the
    /// sensors were held, put right by the floor; with --ledger, and where neither says it, +z]
    #[arg(long, value_name = "AXIS|X,Y,Z", value_parser = up, allow_hyphen_values = true, help_heading = ONLY_3D)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) up: Option<Up>,
    /// Maps to make, separated by commas; esdf, contour and mesh are derived from the tsdf, which is then made too
    /// [default: all: grid,tree,tsdf,attenuation,esdf,contour in 2-D; tree,tsdf,attenuation,esdf,mesh in 3-D]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub(crate) maps: Vec<MapKind>,
    /// Method of the esdf [default: accurate]
    #[arg(long, value_enum, required = false)]
    pub(crate) esdf: EsdfArg,
    /// Share of the beams through a cell that must end there to make it an obstacle of the esdf where no surface is found
    /// (poles, table legs); what is more likely occupied than free is one, too. 0: only surfaces are obstacles [default:
    /// 0.145]
    #[arg(long, value_name = "SHARE", value_parser = thin, allow_negative_numbers = true, required = false)]
    pub(crate) thin: f64,
    /// Largest distance of the esdf (meters) [default: 1]
    #[arg(long, value_name = "M", value_parser = length, required = false, help_heading = ONLY_3D)]
    pub(crate) max_distance: f64,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            resolution: 0.05,
            truncation: None,
            forgetting: ForgettingArgs::default(),
            weights: WeightsArg::Constant,
            sweep: None,
            range: RangeArgs::default(),
            carve: true,
            carve_weight: CARVE_WEIGHT,
            color: true,
            deskew: true,
            self_filter: Vec::new(),
            points_only: false,
            ledger: false,
            movers: None,
            hold_out: None,
        }
    }
}

/// Distances of 3-D fields are found up to here (meters).
const MAX_DISTANCE: f64 = 1.0;

impl Default for Settings {
    fn default() -> Self {
        Self {
            dimension: Dimension::Two,
            shape: Shape::default(),
            no_return: NoReturnArgs::default(),
            every: None,
            bounds: None,
            shift: None,
            up: None,
            maps: Vec::new(),
            esdf: EsdfArg::default(),
            thin: THIN,
            max_distance: MAX_DISTANCE,
        }
    }
}

impl Settings {
    /// Those of a saved map. What another writer has put there in another form counts as missing.
    pub(crate) fn of_saved(saved: &Map<String, Value>) -> Self {
        let alone =
            |key: &str, value: &Value| Value::Object(Map::from_iter([(key.to_owned(), value.clone())]));
        let readable = |(key, value): &(&String, &Value)| Self::deserialize(alone(key, value)).is_ok();
        let fields = saved.iter().filter(readable).map(|(key, value)| (key.clone(), value.clone()));
        let saved = Self::deserialize(Value::Object(fields.collect())).unwrap_or_default();
        if saved.max_distance > 0.0 { saved } else { Self { max_distance: MAX_DISTANCE, ..saved } }
    }

    /// With what depends on the dimension and on other settings filled in, where it was left open.
    pub(crate) fn resolved(mut self, dimension: Dimension) -> Self {
        use MapKind::{Contour, Esdf, Mesh, Tree, Tsdf};
        self.dimension = dimension;
        let shape = &mut self.shape;
        shape.truncation.get_or_insert(three_cells(shape.resolution));
        shape.sweep.get_or_insert(SweepArg::usual(dimension));
        // Sums do not forget by themselves.
        let usual = if shape.ledger { f32::INFINITY } else { W_MAX };
        let asked = shape.forgetting.w_max().filter(|_| !shape.ledger);
        shape.forgetting = ForgettingArgs::of(asked.unwrap_or(usual));
        // What shapes sums is part of their map: no colors are promised where no sensor sees any.
        shape.color &= !shape.ledger || dimension == Dimension::Three;
        if self.maps.is_empty() {
            let made = |kind: &&MapKind| kind.only().is_none_or(|only| only == dimension);
            let all = MapKind::value_variants().iter().filter(made).copied();
            self.maps = all.filter(|kind| !self.shape.points_only || kind.is_of_points()).collect();
        }
        if self.shape.points_only {
            // Its distances are those to the cells that hold points.
            self.maps.push(Tree);
        } else if self.maps.iter().any(|kind| [Esdf, Contour, Mesh].contains(kind)) {
            self.maps.push(Tsdf);
        }
        self.maps.sort_unstable();
        self.maps.dedup();
        self
    }

    /// The same for points without rays. Maps that were asked for by name stay, for [`Settings::check`] to refuse what is
    /// made of rays alone.
    pub(crate) fn without_rays(mut self, are_maps_given: bool) -> anyhow::Result<Self> {
        self.shape.points_only = true;
        if !are_maps_given {
            self.maps.clear();
        }
        let dimension = self.dimension;
        let settings = self.resolved(dimension);
        settings.check(dimension)?;
        Ok(settings)
    }

    /// Whether a map is wanted.
    pub(crate) fn wants(&self, kind: MapKind) -> bool {
        self.maps.contains(&kind)
    }

    /// Refuses sweeps, maps and bounds of the other dimension, and a lower limit of range that is not below the upper one.
    pub(crate) fn check(&self, dimension: Dimension) -> anyhow::Result<()> {
        if let Some(sweep) = self.shape.sweep.filter(|sweep| sweep.only() != dimension) {
            return Err(dimension.refused(&format!("--sweep {}", word(&sweep)), "the log"));
        }
        if let Some(kind) = self.maps.iter().find(|kind| kind.only().is_some_and(|only| only != dimension)) {
            return Err(dimension.refused(&format!("--maps {}", kind.word()), "the log"));
        }
        if self.shape.points_only {
            if let Some(kind) = self.maps.iter().find(|kind| !kind.is_of_points()) {
                return Err(bad_call(format!(
                    "--maps {} is made of rays, and points without rays have none (--points-only, or a file that does not \
                     say where its points were seen from): they make tree and esdf",
                    kind.word()
                )));
            }
            if self.shape.movers.is_some() {
                return Err(bad_call(
                    "--movers needs rays, which say what was seen open, and points without rays have none",
                ));
            }
            if self.esdf != EsdfArg::Accurate {
                return Err(bad_call(format!(
                    "--esdf {} is made of signed distances, which points without rays have not; leave it out",
                    word(&self.esdf)
                )));
            }
        }
        match (dimension, self.bounds) {
            (Dimension::Two, Some(bounds)) => bounds.in_2d("the log").map(|_| ())?,
            (Dimension::Three, Some(bounds)) => bounds.in_3d("the log").map(|_| ())?,
            _ => {}
        }
        if dimension == Dimension::Three {
            self.shape.range.filter(Vec::new())?;
        }
        Ok(())
    }

    pub(crate) fn resolution(&self) -> f64 {
        self.shape.resolution
    }

    pub(crate) fn truncation(&self) -> f64 {
        self.shape.truncation.unwrap_or(three_cells(self.shape.resolution))
    }

    pub(crate) fn w_max(&self) -> f32 {
        self.shape.forgetting.w_max().unwrap_or(W_MAX)
    }

    pub(crate) fn sweep(&self) -> SweepArg {
        self.shape.sweep.unwrap_or(SweepArg::usual(self.dimension))
    }

    pub(crate) fn weights(&self) -> WeightModel {
        self.shape.weights.model()
    }

    pub(crate) fn limits(&self) -> LimitArgs {
        LimitArgs { range: self.shape.range, no_return: self.no_return }
    }

    pub(crate) fn selection(&self) -> Selection {
        Selection { every: self.every, hold_out: self.shape.hold_out }
    }

    /// Observations, of any weight up to 1, after which a saturated cell has lost half the error of a stale estimate.
    fn half_life(&self) -> f64 {
        TsdfRule { truncation: self.truncation() as f32, w_max: self.w_max() }.half_life(1.0)
    }

    /// How the distances forget, for people.
    pub(crate) fn forgetting(&self) -> String {
        match self.w_max().is_finite() {
            true => format!(
                "W_max {}: half of a stale distance is left after {:.2} observations",
                (100.0 * self.w_max()).round() / 100.0,
                self.half_life()
            ),
            false if self.shape.ledger => "sums: nothing is forgotten until it is taken out".to_owned(),
            false => "W_max infinite: nothing is forgotten".to_owned(),
        }
    }

    /// The settings as they are written into files: those that the dimension has a use for.
    pub(crate) fn to_json(&self) -> Map<String, Value> {
        let mut fields = object(json!(self));
        fields.insert("half_life".to_owned(), json!(Some(self.half_life()).filter(|n| n.is_finite())));
        for foreign in self.dimension.foreign::<Self>() {
            fields.remove(&foreign);
        }
        fields
    }

    /// Refuses to go on with a map that was made with other settings, as far as these shape it.
    pub(crate) fn check_agree(&self, saved: &Map<String, Value>, map: &str) -> anyhow::Result<()> {
        let ours = self.to_json();
        let mut shaping: Vec<String> = object(json!(self.shape)).into_iter().map(|(key, _)| key).collect();
        // Which scans are held out depends on which are looked at.
        shaping.extend(self.shape.hold_out.map(|_| "every".to_owned()));
        // A map that was made before there was a setting agrees with its default.
        let usual = object(json!(Shape::default()));
        for key in shaping {
            let old = saved.get(&key).or(usual.get(&key)).unwrap_or(&Value::Null);
            let Some(new) = ours.get(&key) else { continue };
            if new != old {
                let other = if key == "w_max" { " or --half-life" } else { "" };
                bail!(
                    "{map}: {key} is {old} in the map and {new} in this call; leave out {}{other} to use the map's value, \
                     or write to another folder",
                    option::<Self>(&key)
                );
            }
        }
        Ok(())
    }
}

/// The library's truncation for cells of this edge (meters).
fn three_cells(resolution: f64) -> f64 {
    MapperSettings::<3>::new(resolution).truncation()
}

fn four_digits<S: Serializer>(weight: &f32, out: S) -> Result<S::Ok, S::Error> {
    (f64::from((weight * 1e4).round()) / 1e4).serialize(out)
}

fn or_one<S: Serializer>(n: &Option<u64>, out: S) -> Result<S::Ok, S::Error> {
    n.unwrap_or(1).serialize(out)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::dimension::Given;

    #[derive(clap::Parser)]
    struct Call {
        #[command(flatten)]
        settings: Given<Settings>,
        #[arg(long)]
        append: bool,
        #[arg(long)]
        repose: bool,
    }

    #[test]
    fn only_what_was_given_changes_saved_settings() {
        let mut saved = Settings::default();
        (saved.shape.carve, saved.shape.hold_out, saved.every) = (false, Some(7), Some(3));
        saved.shape.forgetting = ForgettingArgs::of(8.0);
        let over = |call: &[&str]| Call::parse_from(call).settings.over(saved.clone()).unwrap();
        assert_eq!(over(&["map", "--append"]), saved);
        let other = over(&["map", "--append", "--truncation", "0.2", "--no-color", "--half-life", "1"]);
        assert_eq!((other.truncation(), other.shape.carve, other.shape.color), (0.2, false, false));
        assert_eq!((other.w_max(), other.shape.hold_out, other.every), (1.0, Some(7), Some(3)));
    }

    #[test]
    fn saved_settings_come_back() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let mut settings = Settings::default();
            settings.shape.self_filter = vec![Body::Sphere { center: [0.0, 0.1, -0.2], radius: 0.5 }];
            settings.shape.forgetting = ForgettingArgs::of(f32::INFINITY);
            settings.shape.range.max_range = Some(20.0);
            let settings = settings.resolved(dimension);
            let saved = settings.to_json();
            let again = Settings::of_saved(&saved).resolved(dimension);
            assert_eq!(again.to_json(), saved);
            assert_eq!(again.w_max(), f32::INFINITY);
            again.check_agree(&saved, "map").unwrap();
            assert_eq!(saved.contains_key("no_return"), dimension == Dimension::Two);
            assert_eq!(saved.contains_key("self_filter"), dimension == Dimension::Three);
            let mut other = again;
            other.shape.carve = false;
            let error = other.check_agree(&saved, "map").unwrap_err().to_string();
            assert!(error.contains("carve is true in the map") && error.contains("--no-carve"), "{error}");
        }
    }
}
