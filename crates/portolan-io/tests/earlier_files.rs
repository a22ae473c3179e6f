//! Map files that earlier versions wrote: their cells, settings and answers, and the same bytes when they are written
//! again. `data/README.md` describes how they were made.

#![allow(clippy::unwrap_used, reason = "what cannot be set up ends the test")]

use std::path::{Path, PathBuf};

use portolan::Answer;
use portolan::cell::{Cell, LogOdds8, LogOddsRule, LogOddsValue, OccupancyModel, Planes};
use portolan::field::{Esdf, EsdfSettings};
use portolan::store::{Bricks, Store};
use portolan::sweep::WeightModel;
use portolan_io::MapFile;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Probability that the map holds at a point; `None`: never observed.
fn probability<const D: usize>(store: &impl Store<LogOdds8, D>, p_world: [f64; D]) -> Option<f64> {
    let model = OccupancyModel::default();
    let rule = LogOddsRule::<i8>::new(&model).unwrap();
    store.lattice().cell_of(p_world).and_then(|cell| store.cell(cell)).map(|v| v.probability(&rule))
}

fn assert_close(value: Option<f64>, expected: f64) {
    assert!(value.is_some_and(|v| (v - expected).abs() < 1e-9), "{value:?}, not {expected}");
}

#[test]
fn a_2d_file_is_read() {
    let path = data("room-2d.portolan");
    let file = MapFile::<2>::read(&path).unwrap();
    assert_eq!(file.to_bytes().unwrap(), std::fs::read(&path).unwrap());

    assert_eq!((&*file.header.logs, file.header.scans), (&["room.log".to_owned()][..], 3));
    assert_eq!(file.header.settings["carve_weight"], 0.3);
    assert_eq!(file.header.statistics["beams"]["hit"], 183);
    assert_eq!(
        file.poses.iter().map(|p| p.translation).collect::<Vec<_>>(),
        [[1.0, 1.0], [1.5, 1.1], [2.0, 1.4]]
    );

    let grid = file.grid.as_ref().unwrap();
    assert_eq!((grid.store().grid().shape, *grid.model()), ([56, 46], OccupancyModel::default()));
    assert_eq!(grid.observed_cells(), 1227);
    let tree = file.tree.as_ref().unwrap();
    assert_eq!(
        (tree.store().depth(), tree.store().nodes(), *tree.model()),
        (6, 1197, OccupancyModel::default())
    );
    for (p, expected) in [
        ([1.0, 1.0], 0.39877717098749743),
        ([3.95, 1.2], 0.7002516603808345),
        ([2.0, 2.93], 0.7835423546524841),
    ] {
        assert_close(probability(grid.store(), p), expected);
        assert_close(probability(tree.store(), p), expected);
    }
    assert_eq!(probability(grid.store(), [4.05, 1.2]), None);

    let tsdf = file.tsdf.as_ref().unwrap();
    let config = tsdf.config();
    assert_eq!((config.truncation, config.w_max, config.carve_weight), (0.3, 64.0, 0.3));
    assert_eq!(config.weights, WeightModel::Constant);
    assert_eq!(tsdf.observed_cells(0.0), 1524);
    let at = |p: [f64; 2]| match tsdf.signed_distance(p) {
        Answer::Known(d) => Some(d),
        _ => None,
    };
    assert!(at([3.95, 1.25]).unwrap() > 0.0 && at([4.05, 1.25]).unwrap() < 0.0);
}

#[test]
fn a_3d_file_is_read() {
    let path = data("corner-3d.portolan");
    let file = MapFile::<3>::read(&path).unwrap();
    assert_eq!(file.to_bytes().unwrap(), std::fs::read(&path).unwrap());

    assert_eq!((&*file.header.logs, file.header.scans), (&["corner".to_owned()][..], 2));
    assert_eq!(file.header.settings["sweep"], "auto");
    let positions: Vec<_> = file.poses.iter().map(|p| p.translation).collect();
    assert_eq!(positions, [[0.0; 3], [0.1, 0.0, 0.0]]);

    let occupancy = file.occupancy_bricks.as_ref().unwrap();
    assert_eq!((occupancy.store.len(), occupancy.model), (50, OccupancyModel::default()));
    assert_close(probability(&occupancy.store, [0.0, 0.0, 0.7]), 0.30552476264292683);
    assert_close(probability(&occupancy.store, [0.0, 0.0, 1.52]), 0.8451416032574319);
    assert_eq!(probability(&occupancy.store, [0.0, -0.7, 0.1]), None);

    let tsdf = file.tsdf_bricks.as_ref().unwrap();
    assert_eq!((tsdf.truncation, tsdf.w_max, tsdf.carve_weight), (0.15, 64.0, 0.3));
    assert_eq!((tsdf.weights, tsdf.store.len()), (WeightModel::Constant, 78));
    let settings = EsdfSettings { max_distance: 1.0, min_weight: Some(0.15), ..Default::default() };
    let esdf = Esdf::of(&tsdf.store, &settings);
    let Answer::Known(distance) = esdf.distance([0.0, 0.0, 1.48]) else { panic!("the wall is not there") };
    assert!((distance - 0.02).abs() < 1e-5, "{distance}");
    assert_eq!(observed(&tsdf.store), 13_862);

    let colors = file.color_bricks.as_ref().unwrap();
    assert_eq!((colors.store.len(), colors.w_max, observed(&colors.store)), (33, 64.0, 3914));
    let cell = colors.store.lattice().cell_of([0.0, 0.0, 1.5]).unwrap();
    let [r, g, b] = colors.store.cell(cell).unwrap().rgb8();
    assert!((100..150).contains(&r) && (100..140).contains(&g) && (120..136).contains(&b), "{r} {g} {b}");
}

/// Number of observed cells.
fn observed<C: Cell>(store: &Bricks<C, 3>) -> usize {
    let of_brick = |brick: &C::Brick| (0..brick.len()).filter(|&i| brick.get(i).is_some()).count();
    store.bricks_by_age().map(|(_, brick)| of_brick(brick)).sum()
}
