//! Memory of a tree against a dense array, by the text's formula (section 3.1, D1).

/// Nodes per surface cell, over all levels: `c_d = 2^(d-1) / (2^(d-1) - 1)`; 2 in 2-D, 4/3 in 3-D.
fn nodes_per_surface_cell<const D: usize>() -> f64 {
    let faces = f64::from(1u32 << (D - 1));
    faces / (faces - 1.0)
}

/// Predicted bytes of a tree against a dense array of one-byte cells: `b c_d S r / V` (section 3.1, D1), for
/// `node_bytes` a node, surface measure `S` (meters in 2-D, square meters in 3-D), bounded volume `V`.
pub fn memory_ratio<const D: usize>(node_bytes: f64, surface: f64, volume: f64, resolution: f64) -> f64 {
    node_bytes * nodes_per_surface_cell::<D>() * surface * resolution / volume
}

/// What a node weighs in [`memory_ratio`] where only inner nodes are stored, `inner_bytes` each: of the
/// `c_d S / r^(d-1)` nodes that the formula counts, one in `2^(d-1)` is inner.
pub fn inner_only_node_bytes<const D: usize>(inner_bytes: f64) -> f64 {
    inner_bytes / f64::from(1u32 << (D - 1))
}

/// The resolution (meters) below which a tree is smaller than a dense array of one-byte cells:
/// `r* = V / (b c_d S)`, where [`memory_ratio`] is 1.
pub fn crossover_resolution<const D: usize>(node_bytes: f64, surface: f64, volume: f64) -> f64 {
    volume / (node_bytes * nodes_per_surface_cell::<D>() * surface)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chapter19_crossover() {
        let r = crossover_resolution::<2>(20.0, 180.6, 108.0);
        assert!((r - 0.015).abs() < 1e-4);
        assert!((memory_ratio::<2>(20.0, 180.6, 108.0, r) - 1.0).abs() < 1e-12);
        assert!((memory_ratio::<2>(20.0, 180.6, 108.0, 0.0625) - 4.2).abs() < 0.05);
        let block_of_airspace = crossover_resolution::<3>(36.0, 6e4, 2.4e6);
        assert!((block_of_airspace - 0.83).abs() < 0.01);
    }
}
