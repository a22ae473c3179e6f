//! What the page asks before it shows a view.

use serde::Deserialize;
use serde_json::json;

use super::{Logs, Refusal, Reply};

/// A question about the studio itself.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Ask {
    /// What it was given, and which view shows that.
    About {},
}

/// Answers.
pub(super) fn answer(ask: &Ask, logs: &Logs) -> Result<Reply, Refusal> {
    let Ask::About {} = ask;
    let given = logs.given();
    let opens = if given.is_some_and(|(_, in_3d)| in_3d) { "3d" } else { "fusion" };
    Reply::of(json!({
        "opens": opens,
        "given": given.map(|(name, in_3d)| json!({ "name": name, "in_3d": in_3d })),
    }))
}

#[cfg(test)]
mod tests {
    use portolan::map::{Tsdf3, TsdfConfig};

    use super::*;
    use crate::engine::Source3d;

    #[test]
    fn the_view_of_what_was_given_is_opened() {
        let of = |logs: &Logs| answer(&Ask::About {}, logs).unwrap().body;
        assert_eq!(of(&Logs::default()), json!({ "opens": "fusion", "given": null }));
        let tsdf = Box::new(Tsdf3::new(TsdfConfig::default()).unwrap());
        let source_3d =
            Source3d::Map { name: "kitchen".into(), tsdf, up: [0.0, -1.0, 0.0], beside: Box::default() };
        let kitchen = of(&Logs { source_3d, ..Logs::default() });
        assert_eq!(kitchen, json!({ "opens": "3d", "given": { "name": "kitchen", "in_3d": true } }));
    }
}
