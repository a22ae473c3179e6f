//! Which cells' elements a crossing stands for.

/// A crossing so near to a node, in cells, may be one of several in nearly the same place, on other edges of the node.
const NEAR: f32 = 1.0 / 256.0;

/// The cells (by their lowest nodes) at the edge that starts at node `start` along `axis` and is crossed at `place`; where
/// that is nearly at a node, all cells at the node.
#[inline]
pub(crate) fn cells_around<const D: usize>(
    start: [i32; D],
    axis: usize,
    place: f32,
    mut visit: impl FnMut([i32; D]),
) {
    for c in 0..1usize << D {
        let at_edge = c >> axis & 1 == 0;
        let mut cell: [i32; D] = std::array::from_fn(|k| start[k] - (c >> k & 1) as i32);
        if at_edge || place <= NEAR {
            visit(cell);
        }
        if at_edge && place >= 1.0 - NEAR {
            cell[axis] += 1;
            visit(cell);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(place: f32) -> Vec<[i32; 3]> {
        let mut cells = Vec::new();
        cells_around([5, 6, 7], 1, place, |c| cells.push(c));
        cells.sort_unstable();
        cells
    }

    #[test]
    fn the_cells_at_an_edge_and_at_a_node() {
        assert_eq!(cells(0.5), [[4, 6, 6], [4, 6, 7], [5, 6, 6], [5, 6, 7]]);
        let at_node =
            |y: i32| [4, 5].into_iter().flat_map(move |x| [y - 1, y].map(|y| [[x, y, 6], [x, y, 7]]));
        assert_eq!(cells(0.0), at_node(6).flatten().collect::<Vec<_>>());
        assert_eq!(cells(1.0), at_node(7).flatten().collect::<Vec<_>>());
    }
}
