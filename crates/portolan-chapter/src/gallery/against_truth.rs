//! The gallery's answers against the truth.

use super::asker::{Asker, gradient, median};
use super::costs::{contour_of_grid, contour_of_tree, sign_of, zero_of};
use super::fields::against_contour;
use super::measured::Gallery;
use portolan::geom::vector;
use portolan::surface::marching_squares;

/// How wrong the answers are, row by row and field by field.
pub(super) fn hold_against_truth(gallery: &mut Gallery, asker: &Asker<'_>) {
    let limit = vector::norm(asker.grid.aabb().extent());
    let (occupancy, contour, distance) = (&gallery.occupancy, &gallery.contour, &gallery.fields[0].field);
    let inside = |p| contour.is_inside(p).map(|inside| if inside { 1.0 } else { 0.0 });
    let wrong = [
        asker.occupancy_wrong(occupancy),
        asker.occupancy_wrong(&gallery.tree),
        asker.occupancy_wrong(&gallery.chapter_tree),
        asker.occupancy_wrong(&gallery.tsdf),
        asker.occupancy_wrong(&gallery.marched),
        asker.occupancy_wrong(&gallery.hits),
        asker.wrong(|p| sign_of(distance, p)),
        asker.wrong(inside),
        None,
    ];
    let rings = asker.distance_error(|p| occupancy.search_distance_by_rings(p, limit));
    let read = asker.distance_error(|p| distance.distance(p).known());
    let nearest = asker.distance_error(|p| contour.nearest_distance(p));
    let cloud = asker.distance_error(|p| gallery.cloud.nearest_distance(p));
    let distances = [rings, None, None, None, None, None, read, nearest, cloud];
    let surfaces = [
        asker.surface_error(&contour_of_grid(occupancy)),
        asker.surface_error(&contour_of_tree(&gallery.tree)),
        asker.surface_error(&contour_of_tree(&gallery.chapter_tree)),
        asker.surface_error(contour),
        asker.surface_error(&marching_squares(&gallery.marched, &gallery.contour_settings)),
        None,
        asker.surface_error(&zero_of(distance)),
        asker.surface_error(contour),
        None,
    ];
    for (i, row) in gallery.rows.iter_mut().enumerate() {
        (row.occupancy_wrong, row.distance_error, row.surface_error) = (wrong[i], distances[i], surfaces[i]);
    }
    let exact: Vec<Option<f64>> = asker.free.iter().map(|&p| gallery.contour.nearest_distance(p)).collect();
    for measured in &mut gallery.fields {
        measured.against_contour = against_contour(&measured.field, &asker.free, &exact);
        measured.against_truth = asker.distance_error(|p| measured.field.distance(p).known());
        let norms = asker.free.iter().filter_map(|&p| measured.field.gradient(p).known().map(vector::norm));
        measured.gradient = median(norms.collect());
    }
    gallery.tsdf_gradient = gradient(&gallery.tsdf, &asker.free);
}
