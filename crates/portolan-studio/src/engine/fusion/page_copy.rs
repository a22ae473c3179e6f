//! The page's copy of the map: the next answer holds only blocks that differ.

use portolan::map::Tsdf2;

/// Edge of a block (cells).
pub(super) const EDGE: usize = 16;

/// The page's copy of distances and weights.
pub(super) struct PageCopy {
    shape: [usize; 2],
    distance: Vec<f32>,
    weight: Vec<f32>,
    fresh: bool,
}

/// Blocks that the page must change, each `EDGE` x `EDGE` cells, x fastest; cells beyond the grid are 0.
#[derive(Default)]
pub(super) struct Delta {
    /// The page must forget what it has: these are all blocks in which anything was observed.
    pub(super) fresh: bool,
    /// Number of the block, x fastest.
    pub(super) blocks: Vec<u32>,
    pub(super) distance: Vec<f32>,
    pub(super) weight: Vec<f32>,
}

impl PageCopy {
    /// A page that has nothing: all is unobserved.
    pub(super) fn nothing(shape: [usize; 2]) -> Self {
        let cells = shape[0] * shape[1];
        Self { shape, distance: vec![0.0; cells], weight: vec![0.0; cells], fresh: true }
    }

    /// What has changed since the last time.
    pub(super) fn update(&mut self, tsdf: &Tsdf2) -> Delta {
        let planes = tsdf.store().planes();
        let [width, height] = self.shape;
        let across = width.div_ceil(EDGE);
        let mut delta = Delta { fresh: std::mem::take(&mut self.fresh), ..Delta::default() };
        for by in 0..height.div_ceil(EDGE) {
            let rows = EDGE * by..height.min(EDGE * (by + 1));
            for bx in 0..across {
                let columns = EDGE * bx..width.min(EDGE * (bx + 1));
                let line = |y: usize| y * width + columns.start..y * width + columns.end;
                let same = rows.clone().all(|y| {
                    self.weight[line(y)] == planes.weights()[line(y)]
                        && self.distance[line(y)] == planes.distances()[line(y)]
                });
                if same {
                    continue;
                }
                delta.blocks.push((by * across + bx) as u32);
                for y in EDGE * by..EDGE * (by + 1) {
                    let given = if y < height { line(y) } else { 0..0 };
                    let missing = EDGE - given.len();
                    let sides = [
                        (&mut delta.distance, &mut self.distance, planes.distances()),
                        (&mut delta.weight, &mut self.weight, planes.weights()),
                    ];
                    for (sent, copy, now) in sides {
                        copy[given.clone()].copy_from_slice(&now[given.clone()]);
                        sent.extend_from_slice(&now[given.clone()]);
                        sent.extend(std::iter::repeat_n(0.0, missing));
                    }
                }
            }
        }
        delta
    }

    pub(super) fn memory_bytes(&self) -> usize {
        (self.distance.capacity() + self.weight.capacity()) * size_of::<f32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan::geom::Grid;
    use portolan::map::TsdfConfig;
    use proptest::prelude::*;

    proptest! {
        /// Whatever was fused, applying the blocks gives the map.
        #[test]
        fn blocks_that_are_sent_make_the_map(
            shape in [1usize..40, 1usize..40],
            rounds in prop::collection::vec(prop::collection::vec((0i32..40, 0i32..40, -0.1f64..0.1), 0..20), 1..5),
        ) {
            let mut tsdf = Tsdf2::covering(&Grid::new([0.0; 2], 0.05, shape), TsdfConfig::textbook()).unwrap();
            let mut seen = PageCopy::nothing(shape);
            let mut page = (vec![0f32; shape[0] * shape[1]], vec![0f32; shape[0] * shape[1]]);
            for round in rounds {
                for (x, y, d) in round {
                    tsdf.fuse([x, y], d, 1.0);
                }
                let delta = seen.update(&tsdf);
                let across = shape[0].div_ceil(EDGE);
                for (n, &block) in delta.blocks.iter().enumerate() {
                    let (bx, by) = (block as usize % across, block as usize / across);
                    for i in 0..EDGE * EDGE {
                        let (x, y) = (EDGE * bx + i % EDGE, EDGE * by + i / EDGE);
                        if x < shape[0] && y < shape[1] {
                            page.0[y * shape[0] + x] = delta.distance[n * EDGE * EDGE + i];
                            page.1[y * shape[0] + x] = delta.weight[n * EDGE * EDGE + i];
                        }
                    }
                }
                let planes = tsdf.store().planes();
                prop_assert_eq!(&page.0[..], planes.distances());
                prop_assert_eq!(&page.1[..], planes.weights());
                prop_assert!(seen.update(&tsdf).blocks.is_empty());
            }
        }
    }
}
