//! What a saved map was made with.

use anyhow::{anyhow, bail};
use clap::ValueEnum;
use portolan::scan::Body;
use serde_json::{Map, Value};

use crate::arguments::body;
use crate::mapping::MapKind;

/// Settings of a saved map.
pub(crate) struct Saved<'a>(pub(crate) Option<&'a Map<String, Value>>);

impl Saved<'_> {
    pub(crate) fn number(&self, key: &str) -> Option<f64> {
        self.0?.get(key)?.as_f64()
    }

    pub(crate) fn word(&self, key: &str) -> Option<&str> {
        self.0?.get(key)?.as_str()
    }

    pub(crate) fn maps(&self) -> Option<Vec<MapKind>> {
        let words = self.0?.get("maps")?.as_array()?;
        words.iter().map(|word| MapKind::from_str(word.as_str()?, false).ok()).collect()
    }

    /// The parts of the sensor's frame that a saved map left out.
    pub(crate) fn bodies(&self) -> anyhow::Result<Vec<Body>> {
        let Some(list) = self.0.and_then(|s| s.get("self_filter")).and_then(Value::as_array) else {
            return Ok(Vec::new());
        };
        let text = |numbers: &Value| {
            let numbers = numbers.as_array().map(Vec::as_slice).unwrap_or_default();
            numbers.iter().map(Value::to_string).collect::<Vec<_>>().join(",")
        };
        list.iter().map(|b| body(&text(b)).map_err(|e| anyhow!("the map's self_filter: {e}"))).collect()
    }

    pub(crate) fn flag(&self, key: &str) -> Option<bool> {
        self.0?.get(key)?.as_bool()
    }
}

/// Refuses to go on with a map that was made with other settings, as far as these shape it.
pub(crate) fn check_agree(
    ours: &Map<String, Value>,
    theirs: &Map<String, Value>,
    shaping: &[&str],
    name: &str,
) -> anyhow::Result<()> {
    // Which scans are held out depends on which are looked at.
    let holds_out = !ours.get("hold_out").is_none_or(Value::is_null);
    for &key in shaping.iter().chain(holds_out.then_some(&"every")) {
        let null = Value::Null;
        let (new, old) = (ours.get(key).unwrap_or(&null), theirs.get(key).unwrap_or(&null));
        if new != old {
            let options = match key {
                "w_max" => "--w-max or --half-life".to_owned(),
                "color" => "--no-color".to_owned(),
                "carve" => "--no-carve".to_owned(),
                key => format!("--{}", key.replace('_', "-")),
            };
            bail!(
                "{name}: {key} is {old} in the map and {new} in this call; leave {options} out to go on with the map's, \
                 or write to another folder"
            );
        }
    }
    Ok(())
}
