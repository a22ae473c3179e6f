//! The surface's crossings of the lattice's edges, as the seeds of the accurate transform.

/// Crossings on the edges that start at the cells of one brick (which join the cell's center to that of the next cell
/// along an axis).
///
/// One plane per axis, cells x fastest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BrickCrossings<const D: usize> {
    /// Place on the edge, in cells from its lower node, 0 to 1; anything where there is no crossing.
    pub(crate) place: [Box<[f32]>; D],
    /// Height of the parabola (squared cells), 0 to `D / 4`: `D / 4` less the squared radius within which this crossing
    /// answers for the surface around it. Infinite: no crossing that belongs to a whole cell of observed nodes.
    pub(crate) height: [Box<[f32]>; D],
}
