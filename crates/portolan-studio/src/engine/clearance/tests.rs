//! What the page gets is what the library computes.

use std::f64::consts::TAU;
use std::sync::Arc;

use portolan::Answer;
use portolan::field::{ClearanceField, Esdf, EsdfSettings, UnknownSpace};
use portolan::geom::{Pose, vector};
use portolan::map::Tsdf2;
use portolan::plan::{Cause, PathCheck, Waypoints, check_path};
use portolan::scan::{Beam, BeamKind, Scan};
use portolan::surface::{ContourSettings, marching_squares};
use portolan::{Mapper, MapperSettings};
use portolan_io::AnswerRow;
use serde_json::{Value, json};

use super::ask::{Ask, Which};
use super::fields::Fields;
use super::meter::meter;
use super::{Clearance as View, path, probe};
use crate::engine::fusion::{Beside, Fusion};
use crate::engine::protocol::Values;
use crate::engine::{Clock, Limits, Logs, Refusal, Reply, Source2d};

/// A view and the map that it looks at.
struct Studio {
    fusion: Fusion,
    view: View,
}

impl Studio {
    fn of(source_2d: Source2d) -> Self {
        let (logs, clock) = (Arc::new(Logs { source_2d, ..Logs::default() }), Clock::new(|| 0.0));
        Self {
            fusion: Fusion::new(&logs, Limits::default(), &clock),
            view: View::new(Limits::default(), &clock),
        }
    }

    fn try_ask(&mut self, question: Value) -> Result<Reply, Refusal> {
        let ask: Ask = serde_json::from_value(question)?;
        self.view.ask(ask, &mut self.fusion)
    }

    fn ask(&mut self, question: Value) -> Reply {
        self.try_ask(question).unwrap()
    }

    fn tsdf(&mut self) -> Tsdf2 {
        self.maps().0
    }

    fn maps(&mut self) -> (Tsdf2, Beside) {
        self.fusion.finish_if_new().unwrap();
        let (tsdf, beside) = self.fusion.with_beside().unwrap();
        (tsdf.clone(), beside.clone())
    }

    fn fields(&mut self) -> Fields {
        let (tsdf, mut beside) = self.maps();
        Fields::of(&tsdf, beside.cells()).unwrap()
    }
}

fn apartment() -> Studio {
    Studio::of(Source2d::Apartment)
}

/// One look around a plain of 15 m with one wall at its end, or with none: what is near is known, what is further than 509
/// cells is saturated.
fn plain(wall: bool) -> Studio {
    let beam = |i: usize| {
        let angle = TAU * i as f64 / 720.0;
        let kind = if wall && i < 8 { BeamKind::Hit } else { BeamKind::MaxRange };
        (angle, Beam { direction: [angle.cos(), angle.sin()], range: 15.0, kind })
    };
    let (bearings, beams): (Vec<_>, Vec<_>) = (0..720).map(beam).unzip();
    let scan = Scan::from_fan(&bearings, beams);
    Studio::of(Source2d::Recorded {
        name: "plain".into(),
        scans: vec![(Pose::<2>::new(0.0, 0.0, 0.0), scan)],
    })
}

/// Points all over a map and beyond, cell centers and corners among them.
fn points(tsdf: &Tsdf2, n: usize) -> Vec<[f64; 2]> {
    let bounds = tsdf.grid().aabb().grown(1.0);
    let lattice = tsdf.grid().lattice;
    let at = |i: usize, k: usize| {
        bounds.min[k] + (i as f64 * [0.754_877_666, 0.569_840_291][k]).fract() * bounds.extent()[k]
    };
    let some = (0..n).map(|i| [at(i, 0), at(i, 1)]);
    let snapped = some.clone().step_by(7).filter_map(|p| Some(lattice.center(lattice.cell_of(p)?)));
    let corners = some.clone().step_by(11).filter_map(|p| Some(lattice.corner(lattice.cell_of(p)?)));
    let far = [[1e12, 0.0], [-1e300, 1e300], [0.0, f64::MAX]];
    some.chain(snapped).chain(corners).chain(far).collect()
}

/// The field that `query` makes of a `map.portolan`.
fn field_of_query(tsdf: &Tsdf2, beside: &mut Beside, unknown: bool) -> Esdf<2> {
    let settings = EsdfSettings {
        max_distance: vector::norm(tsdf.grid().aabb().extent()).max(tsdf.grid().lattice.resolution),
        unknown,
        ..EsdfSettings::default()
    };
    Esdf::with_obstacles(tsdf, beside.cells(), &settings)
}

/// The probe against the library's own answers, through the page's JSON; which statuses there were.
fn agrees(studio: &mut Studio, n: usize) -> Vec<String> {
    let (tsdf, mut beside) = studio.maps();
    let mut seen = Vec::new();
    for (word, unknown) in
        [("optimistic", UnknownSpace::Optimistic), ("pessimistic", UnknownSpace::Pessimistic)]
    {
        let field = field_of_query(&tsdf, &mut beside, unknown == UnknownSpace::Pessimistic);
        let limit = f64::from(field.max_distance()) - 2.0 * tsdf.grid().lattice.resolution;
        for p in points(&tsdf, n) {
            let body = studio.ask(json!({ "op": "probe", "at": p, "unknown": word })).body;
            let body: Value = serde_json::from_str(&body.to_string()).unwrap();
            let told = &body["euclidean"];
            let number = |name: &str| told[name].as_f64().map(f64::to_bits);
            let inside = tsdf.grid().aabb().contains(p);
            let answer = if inside { field.distance_and_gradient(p) } else { Answer::Outside };
            let answer = if inside && answer == Answer::Outside { Answer::Unknown } else { answer };
            let mut row = AnswerRow::of(p, beside.occupancy(p), answer);
            row.certify(&field, p, unknown, limit);
            let status = row.status.word();
            assert_eq!(told["status"], status, "{p:?}");
            for (name, said) in [("distance", row.distance), ("lower", row.lower), ("upper", row.upper)] {
                assert_eq!(number(name), said.map(f64::to_bits), "{name} at {p:?}");
            }
            let gradient = told["gradient"].as_array().map(|g| [0, 1].map(|k| g[k].as_f64().unwrap()));
            assert_eq!(gradient, row.gradient, "{p:?}");
            assert_eq!(told["norm"].as_f64(), row.gradient.map(vector::norm));
            assert_eq!(told["occupancy"].as_f64(), beside.occupancy(p));
            seen.push(status.to_owned());
        }
    }
    seen.sort();
    seen.dedup();
    seen
}

#[test]
fn the_probe_says_what_query_says() {
    assert_eq!(agrees(&mut apartment(), 3000), ["known", "outside", "unknown"]);
    assert_eq!(agrees(&mut plain(true), 2000), ["known", "outside", "saturated", "unknown"]);
    assert_eq!(agrees(&mut plain(false), 500), ["outside", "saturated", "unknown"]);
}

#[test]
fn the_row_has_the_numbers_of_the_answer() {
    let mut studio = apartment();
    let body = studio.ask(json!({ "op": "probe", "at": [6.5, 4.5], "unknown": "optimistic" })).body;
    let row: Vec<&str> = body["row"].as_str().unwrap().split(',').collect();
    let e = &body["euclidean"];
    assert_eq!(row[..3], ["6.5", "4.5", "known"]);
    let numbers: Vec<f64> = row[3..9].iter().map(|v| v.parse().unwrap()).collect();
    let told =
        [&e["occupancy"], &e["distance"], &e["lower"], &e["upper"], &e["gradient"][0], &e["gradient"][1]];
    assert_eq!(numbers, told.map(|v| v.as_f64().unwrap()));
    assert_eq!(row[9], "free");
    let unknown = studio.ask(json!({ "op": "probe", "at": [50.0, 4.5], "unknown": "optimistic" })).body;
    assert_eq!(unknown["row"], "50,4.5,outside,,,,,,,");
}

#[test]
fn the_truncated_field_is_a_constant_beyond_its_truncation() {
    let mut studio = apartment();
    let tsdf = studio.tsdf();
    let (mut known, mut saturated, mut bent) = (0, 0, 0);
    for p in points(&tsdf, 2000) {
        let body = studio.ask(json!({ "op": "probe", "at": p, "unknown": "optimistic" })).body;
        let (kept, status) = (&body["truncated"], body["truncated"]["status"].as_str().unwrap());
        match status {
            "saturated" => {
                saturated += 1;
                assert!((kept["distance"].as_f64().unwrap().abs() - 0.15).abs() < 2e-5);
                bent += usize::from(kept["norm"].as_f64().unwrap() > 1e-3);
            }
            "known" => {
                known += 1;
                assert!(kept["distance"].as_f64().unwrap().abs() < 0.15);
            }
            _ => assert!(kept["distance"].is_null() && kept["gradient"].is_null()),
        }
    }
    // At the last center of the constant the field bends.
    assert!(known > 200 && saturated > 200 && bent < 50, "{known} {saturated} {bent}");
}

#[test]
fn rings_lie_where_the_field_has_their_distance() {
    let mut studio = apartment();
    let fields = studio.fields();
    for (word, which) in [("euclidean", Which::Euclidean), ("truncated", Which::Truncated)] {
        let reply = studio.ask(json!({ "op": "rings", "field": word, "spacing": 0.1 }));
        let [points, starts, levels] = [0, 1, 2].map(|i| &reply.arrays[i].values);
        let (Values::F32(points), Values::U32(starts), Values::F32(levels)) = (points, starts, levels) else {
            panic!("other arrays")
        };
        assert_eq!(starts.len(), levels.len() + 1);
        assert!(levels.len() > 10);
        for (k, &level) in levels.iter().enumerate() {
            for i in starts[k] as usize..starts[k + 1] as usize {
                let p = [f64::from(points[2 * i]), f64::from(points[2 * i + 1])];
                let d = match which {
                    Which::Euclidean => fields.euclidean.distance(p),
                    Which::Truncated => fields.truncated(p).map(|s| s.0),
                    Which::Pessimistic => panic!("it has a test of its own"),
                };
                // Unknown: rounded to the other side of the last square.
                if let Answer::Known(d) | Answer::Saturated(d) = d {
                    assert!((d - f64::from(level)).abs() < 1e-5, "{word}: {d} on ring {level}");
                }
            }
        }
        let most = levels.iter().fold(0.0f32, |m, l| m.max(*l));
        assert_eq!(most > 0.15, which == Which::Euclidean, "only a distance field has far rings: {most}");
    }
}

/// No picture may show more clearance than is certified for what it counts as obstacles.
#[test]
fn the_pessimistic_picture_shows_no_more_than_is_certified() {
    let mut studio = apartment();
    let fields = studio.fields();
    let grid = *fields.grid();
    let (shown, distances) = (fields.samples(Which::Pessimistic), fields.samples(Which::Euclidean));
    let mut nearer = 0;
    for (i, (&shown, &distance)) in shown.iter().zip(distances).enumerate() {
        assert_eq!(shown.is_nan(), distance.is_nan());
        if shown.is_nan() || distance <= 0.0 {
            continue;
        }
        let certified =
            fields.euclidean.clearance(grid.lattice.center(grid.cell(i)), UnknownSpace::Pessimistic);
        let lower = certified.value().map_or(0.0, |c| c.lower);
        assert!(f64::from(shown) <= lower + 1e-6, "{shown} at cell {i}, certified {lower}");
        nearer += usize::from(shown < distance - 0.1);
    }
    assert!(nearer > 40, "{nearer} cells are near to what was never seen");
}

#[test]
fn arrows_are_the_gradients_of_single_questions() {
    let mut studio = apartment();
    let fields = studio.fields();
    let question =
        json!({ "op": "arrows", "field": "euclidean", "bounds": [[2.0, 1.0], [5.0, 4.0]], "spacing": 0.2 });
    let reply = studio.ask(question);
    let (Values::F32(places), Values::F32(slopes)) = (&reply.arrays[0].values, &reply.arrays[1].values)
    else {
        panic!("other arrays")
    };
    assert!(places.len() > 200 && places.len() == slopes.len());
    for (p, g) in places.as_chunks::<2>().0.iter().zip(slopes.as_chunks::<2>().0) {
        assert!((2.0..=5.0).contains(&p[0]) && (1.0..=4.0).contains(&p[1]));
        let (_, want) = fields.euclidean.distance_and_gradient(p.map(f64::from)).known().unwrap();
        // The place was rounded.
        assert!(vector::distance(g.map(f64::from), want) < 1e-4, "{g:?} {want:?} at {p:?}");
    }
}

#[test]
fn the_meter_tells_a_distance_field_from_a_truncated_one() {
    let meter = meter(&apartment().fields());
    let [truncated, euclidean] = [&meter.truncated, &meter.euclidean].map(|n| n.median.unwrap());
    assert!((0.95..1.02).contains(&euclidean), "{euclidean}");
    assert!(truncated < 0.05, "{truncated}");
    for norms in [&meter.truncated, &meter.euclidean] {
        assert_eq!(norms.counts.iter().sum::<u32>() as usize, meter.corners);
    }
}

#[test]
fn all_of_a_path_has_a_verdict_and_what_is_certified_is_free() {
    let (tsdf, mut beside) = apartment().maps();
    let fields = Fields::of(&tsdf, beside.cells()).unwrap();
    let contour = marching_squares(&tsdf, &ContourSettings::of(&tsdf));
    let corners =
        vec![[0.8, 5.4], [2.0, 4.5], [6.6, 4.5], [7.8, 6.2], [8.6, 5.5], [6.6, 0.7], [-1.0, 0.5], [1.2, 2.0]];
    let path = Waypoints::new(corners).unwrap();
    let mut causes = Vec::new();
    for unknown in [UnknownSpace::Optimistic, UnknownSpace::Pessimistic] {
        let demand = path::demand(0.2, unknown, path.length());
        let (whole, pieces) = path::pieces(&fields.euclidean, &path, &demand);
        assert_eq!(whole, check_path(&fields.euclidean, &path, &demand));
        let PathCheck::Violated(first) = whole else { panic!("there are walls") };
        assert_eq!((pieces[0].from, pieces[0].to, pieces[0].cause), (0.0, first.from, None));
        assert_eq!(pieces.last().unwrap().to, path.length());
        assert!(
            pieces
                .windows(2)
                .all(|w| w[0].to == w[1].from && w[0].cause != w[1].cause || w[0].cause.is_some())
        );
        for piece in &pieces {
            assert!(piece.from <= piece.to);
            let inside = (0..=40).map(|i| piece.from + (piece.to - piece.from) * f64::from(i) / 40.0);
            for p in inside.map(|s| portolan::plan::Curve::point(&path, s)) {
                if piece.cause.is_none() {
                    assert!(contour.nearest_distance(p).unwrap() >= 0.2 - 1e-9, "{p:?} is certified");
                }
            }
            causes.extend(piece.cause);
        }
        let room: f64 = pieces.iter().filter(|p| p.cause.is_none()).map(|p| p.to - p.from).sum();
        assert!(room > 5.0 && room < 0.8 * path.length(), "{room}");
    }
    assert!(
        causes.contains(&Cause::TooNear)
            && causes.contains(&Cause::Unknown)
            && causes.contains(&Cause::Outside)
    );
}

#[test]
fn the_driven_way_is_certified() {
    let mut studio = apartment();
    let way = studio.ask(json!({ "op": "open" })).body["way"].clone();
    assert!(way.as_array().unwrap().len() > 50);
    let body =
        studio.ask(json!({ "op": "path", "points": way, "clearance": 0.2, "unknown": "pessimistic" })).body;
    assert_eq!(body["check"]["certified"], true);
    assert_eq!(body["pieces"].as_array().unwrap().len(), 1);
    assert_eq!(body["lengths"]["certified"], body["length"]);
}

#[test]
fn the_fields_follow_the_map() {
    let mut studio = apartment();
    let first = studio.ask(json!({ "op": "open" })).body;
    let held = studio.view.memory_bytes();
    assert!(held > 240 * 180 * 9, "{held}");
    let again = studio.ask(json!({ "op": "open", "have": first["revision"] }));
    assert!(again.body["unchanged"] == true && again.arrays.is_empty());
    studio.fusion.ask(serde_json::from_value(json!({ "op": "seek", "scan": 30 })).unwrap()).unwrap();
    let other = studio.ask(json!({ "op": "open", "have": first["revision"] })).body;
    assert_eq!(other["at"], 30);
    assert_ne!(other["meter"]["corners"], first["meter"]["corners"]);
    studio.view.forget();
    assert_eq!(studio.view.memory_bytes(), 0);
}

#[test]
fn hostile_questions_are_refused_or_answered() {
    let mut studio = apartment();
    let many: Vec<[f64; 2]> = vec![[1.0, 1.0]; 1001];
    for (question, words) in [
        (
            json!({ "op": "path", "points": many, "clearance": 0.2, "unknown": "optimistic" }),
            "1000 points at most",
        ),
        (json!({ "op": "path", "points": [], "clearance": 0.2, "unknown": "optimistic" }), "empty"),
        (
            json!({ "op": "path", "points": [[1, 1]], "clearance": -1, "unknown": "optimistic" }),
            "from 0 to 100 m",
        ),
        (
            json!({ "op": "path", "points": [[0, 0], [1e300, 0]], "clearance": 0.2, "unknown": "optimistic" }),
            "not finite",
        ),
        (json!({ "op": "rings", "field": "euclidean", "spacing": 0 }), "0.01 to 100"),
        (json!({ "op": "rings", "field": "seeded", "spacing": 1 }), "unknown variant"),
        (
            json!({ "op": "arrows", "field": "euclidean", "bounds": [[0, 0], [1, 1]], "spacing": -1 }),
            "positive",
        ),
        (json!({ "op": "probe", "at": [null, 1], "unknown": "optimistic" }), "null"),
        (json!({ "op": "probe", "at": [1, 1] }), "unknown"),
    ] {
        let refusal = studio.try_ask(question.clone()).unwrap_err().to_string();
        assert!(refusal.contains(words), "{question}: {refusal}");
    }
    for question in [
        json!({ "op": "rings", "field": "euclidean", "spacing": 0.01 }),
        json!({ "op": "arrows", "field": "truncated", "bounds": [[-1e300, -1e300], [1e300, 1e300]], "spacing": 1e-300 }),
        json!({ "op": "arrows", "field": "euclidean", "bounds": [[5, 5], [1, 1]], "spacing": 0.1 }),
        json!({ "op": "arrows", "field": "euclidean", "bounds": [[0, 0], [9, 9]], "spacing": 1e300 }),
        json!({ "op": "path", "points": [[-1e100, 0], [1e100, 3]], "clearance": 0.2, "unknown": "pessimistic" }),
        json!({ "op": "path", "points": [[1e100, 0], [1e100, 0]], "clearance": 0, "unknown": "pessimistic" }),
        json!({ "op": "path", "points": [[2, 4.5], [2, 4.5]], "clearance": 0, "unknown": "pessimistic" }),
    ] {
        studio.ask(question);
    }
    let coarser = studio
        .ask(json!({ "op": "arrows", "field": "euclidean", "bounds": [[0, 0], [12, 9]], "spacing": 1e-9 }));
    assert_eq!(coarser.body["spacing"], 0.1, "cells are 5 cm, and 43 200 of them too many");
}

#[test]
fn the_row_of_a_cell_is_the_same_with_and_without_distances_to_unknown_cells() {
    let (tsdf, mut beside) = apartment().maps();
    let [with, without] = [true, false].map(|unknown| field_of_query(&tsdf, &mut beside, unknown));
    for p in points(&tsdf, 500) {
        let rows = [&with, &without].map(|f| probe::row(&tsdf, &beside, f, p, UnknownSpace::Optimistic));
        assert_eq!(rows[0], rows[1]);
    }
}

/// Beams to a wall at 4 m, past a pole at 2 m that stops one in four of those near it, from several places.
fn pole() -> Studio {
    let scan = |k: usize| {
        let beam = |i: i32| {
            let angle = 0.01 * f64::from(i) + 1e-4 * k as f64;
            let stopped = i.abs() <= 2 && (i + k as i32) % 4 == 0;
            let range = if stopped { 2.0 } else { 4.0 / angle.cos() };
            (angle, Beam { direction: [angle.cos(), angle.sin()], range, kind: BeamKind::Hit })
        };
        let (bearings, beams): (Vec<_>, Vec<_>) = (-60..=60).map(beam).unzip();
        (Pose::<2>::new(0.0, 0.01 * (k % 5) as f64, 0.0), Scan::from_fan(&bearings, beams))
    };
    Studio::of(Source2d::Recorded { name: "pole".into(), scans: (0..60).map(scan).collect() })
}

/// Obstacles that the surface does not show are those of the library's default recipe, wherever the map came from.
#[test]
fn what_stops_beams_without_a_surface_is_an_obstacle() {
    let mut studio = pole();
    let sent = |reply: &Reply| match &reply.arrays.iter().find(|a| a.name == "obstacles").unwrap().values {
        Values::F32(values) => values.clone(),
        _ => panic!("other arrays"),
    };
    let reply = studio.ask(json!({ "op": "open" }));
    let obstacles = sent(&reply);
    // By a mapper that makes all maps itself.
    let (tsdf, _) = studio.maps();
    let mut mapper = Mapper::with(MapperSettings::<2> {
        origin: Some(tsdf.grid().lattice.origin),
        max_distance: vector::norm(tsdf.grid().aabb().extent()),
        ..MapperSettings::new(tsdf.config().resolution)
    });
    for (pose, scan) in studio.fusion.scans().first(60) {
        mapper.integrate(pose, scan).unwrap();
    }
    let field = mapper.esdf().unwrap();
    let centers = field.point_obstacles().map(|(cell, _)| field.lattice().center(cell));
    let expected: Vec<f32> = centers.flatten().map(|v| v as f32).collect();
    assert!(!expected.is_empty() && obstacles == expected, "{obstacles:?} {expected:?}");
    assert!(obstacles.chunks(2).any(|p| (p[0] - 2.0).abs() < 0.1 && p[1].abs() < 0.1));
    let at = json!({ "op": "probe", "at": [1.8, 0.02], "unknown": "optimistic" });
    let near = studio.ask(at.clone()).body["euclidean"]["upper"].as_f64().unwrap();
    assert!(near < 0.3, "{near}");
    // Back to a time before it was hit, and on again.
    let seek = |studio: &mut Studio, scan: usize| {
        studio.fusion.ask(serde_json::from_value(json!({ "op": "seek", "scan": scan })).unwrap()).unwrap();
    };
    seek(&mut studio, 1);
    assert_ne!(sent(&studio.ask(json!({ "op": "open" }))), expected);
    seek(&mut studio, 60);
    assert_eq!(sent(&studio.ask(json!({ "op": "open" }))), expected);
}
