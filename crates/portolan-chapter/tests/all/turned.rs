//! Accuracy over worlds that are turned against the lattice.

use portolan::geom::Grid;
use portolan_chapter::gallery::{Accuracy, GallerySettings, Turn, run, turned};
use portolan_sim::{LapConfig, Truth, World, apartment, lap};

fn settings(world: &World) -> GallerySettings {
    GallerySettings::new(Grid::new([0.0; 2], 0.05, [240, 180]), 20_000, Some(world.wall_length()))
}

/// The medians over worlds are made as the accuracy of the world as it is drawn is: with that world alone they are the same
/// numbers.
#[test]
fn the_world_as_it_is_drawn_is_one_of_them() {
    let world = apartment().world;
    let log = lap(&world, &LapConfig::default());
    let settings = settings(&world);
    let gallery = run(&log, &settings, Some(&world as &dyn Truth<2>), &mut || 0.0).unwrap();
    let drawn = Turn { degrees: 0.0, shift: [0.0; 2] };
    let alone = turned(&log, &settings, &world, &[drawn]).unwrap();
    assert_eq!(alone.accuracy, Accuracy::of(&gallery));

    // Walls on borders of cells are an accident that decides: off the lattice the mask is not exact, and the maps of bits
    // lose half of their wrong answers.
    let usual = turned(&log, &settings, &world, &Turn::all(&Turn::USUAL)).unwrap().accuracy;
    let [as_drawn, off] = [&alone.accuracy, &usual].map(|a| {
        let mask = a.fields[2].against_truth.unwrap().median;
        (mask, a.rows[0].occupancy_wrong.unwrap(), a.rows[3].surface_error.unwrap().median)
    });
    println!("mask, occupancy wrong, contour: as drawn {as_drawn:?}, turned {off:?}");
    assert!(as_drawn.0 < 1e-5 && off.0 > 5e-3);
    assert!(as_drawn.1 > 0.04 && off.1 < 0.03);
    assert!(as_drawn.2 > 0.003 && off.2 < 0.003);
    // The accurate field is that of the contour in any pose.
    let contour = |a: &Accuracy| a.fields[0].against_contour.unwrap().median;
    assert!(contour(&usual) < 5e-4 && contour(&alone.accuracy) < 2e-4);
}

#[test]
fn no_turned_world_lies_on_the_lattice() {
    for turn in Turn::all(&[0.0; 8]) {
        assert!(turn.shift.iter().any(|s| (0.1..0.9).contains(s)), "{turn:?}");
    }
}
