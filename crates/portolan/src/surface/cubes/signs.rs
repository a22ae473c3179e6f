//! Signs of a brick as bits, so that the cubes with surface are found 64 at a time.

use crate::cell::DistanceBrick;

/// The lowest column and row of a plane of 8 x 8 bits, and the highest.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
pub(super) const LAST_COLUMN: u64 = FIRST_COLUMN << 7;
pub(super) const LAST_ROW: u64 = 0xff << 56;

/// A word per layer of 8 x 8 nodes, x fastest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Signs {
    /// Nodes with a negative value.
    pub(super) inside: [u64; 8],
    /// Nodes that were observed.
    pub(super) observed: [u64; 8],
}

impl Signs {
    /// The signs of a missing brick.
    pub(super) const NOTHING: Self = Self { inside: [0; 8], observed: [0; 8] };
}

/// One layer of a brick, seen four times: the nodes themselves, and their neighbors at x + 1, at y + 1 and at both.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layer {
    pub(super) at: u64,
    pub(super) x: u64,
    pub(super) y: u64,
    pub(super) xy: u64,
}

impl Layer {
    /// From the words of the brick, of its neighbors along x and y, and of the one along both.
    #[inline(always)]
    pub(super) fn new([own, x, y, xy]: [u64; 4]) -> Self {
        let along_x = |own: u64, next: u64| (own >> 1) & !LAST_COLUMN | (next & FIRST_COLUMN) << 7;
        let (up, up_next) = (own >> 8 | y << 56, x >> 8 | xy << 56);
        Self { at: own, x: along_x(own, x), y: up, xy: along_x(up, up_next) }
    }

    /// Cubes (at their lowest node) with any of the four nodes.
    #[inline(always)]
    pub(super) fn any(&self) -> u64 {
        self.at | self.x | self.y | self.xy
    }

    /// Cubes with all four nodes.
    #[inline(always)]
    pub(super) fn all(&self) -> u64 {
        self.at & self.x & self.y & self.xy
    }
}

/// Cubes moved by one along x: those that touch a node from below.
#[inline(always)]
pub(super) fn next_column(cubes: u64) -> u64 {
    (cubes & !LAST_COLUMN) << 1
}

/// Nine layers of signs around a brick: its own eight and the first one above.
pub(super) struct Layers {
    pub(super) inside: [Layer; 9],
    pub(super) observed: [Layer; 9],
}

impl Layers {
    /// From the signs of a brick and of its seven upper neighbors, by octant (x, y, z as bits).
    #[inline]
    pub(super) fn new(octants: [&Signs; 8]) -> Self {
        let layer = |z: usize, word: fn(&Signs) -> &[u64; 8]| {
            let o = z >> 3 << 2;
            Layer::new([0, 1, 2, 3].map(|k| word(octants[o + k])[z & 7]))
        };
        Self {
            inside: std::array::from_fn(|z| layer(z, |s| &s.inside)),
            observed: std::array::from_fn(|z| layer(z, |s| &s.observed)),
        }
    }

    /// Whether any edge between two of the nodes has a crossing, observed or not: most bricks have none.
    #[inline]
    pub(super) fn any_crossing(&self) -> bool {
        let any = self.inside.iter().fold(0, |any, layer| any | layer.any());
        let all = self.inside.iter().fold(u64::MAX, |all, layer| all & layer.all());
        any != 0 && all != u64::MAX
    }
}

/// Signs of a brick's cells; those of a weight below `threshold` were not observed.
pub(super) fn signs_of_brick(brick: &DistanceBrick, threshold: f32) -> Signs {
    let mut signs = Signs::NOTHING;
    let planes = brick.distances().as_chunks::<64>().0.iter().zip(brick.weights().as_chunks::<64>().0);
    for (z, (d, w)) in planes.enumerate().take(8) {
        signs.observed[z] = word(w, |w| w >= threshold);
        signs.inside[z] = word(d, |d| d < 0.0) & signs.observed[z];
    }
    signs
}

/// A bit for each of 64 values.
#[inline(always)]
fn word(values: &[f32; 64], has: impl Fn(f32) -> bool) -> u64 {
    let mut bytes = [0u8; 8];
    for (byte, row) in bytes.iter_mut().zip(values.as_chunks::<8>().0) {
        *byte = self::byte(row, &has);
    }
    u64::from_le_bytes(bytes)
}

/// A bit for each of eight values.
#[inline(always)]
pub(super) fn byte(values: &[f32; 8], has: impl Fn(f32) -> bool) -> u8 {
    let mut byte = 0;
    for (k, &v) in values.iter().enumerate() {
        byte |= u8::from(has(v)) << k;
    }
    byte
}

/// A bit for each of 32 values.
#[inline(always)]
pub(super) fn word32(values: &[f32; 32], has: impl Fn(f32) -> bool) -> u32 {
    // Four lanes that meet once at the end: made bit by bit, a word takes four times as long.
    let mut lanes = [0u32; 4];
    for (j, four) in values.as_chunks::<4>().0.iter().enumerate() {
        for k in 0..4 {
            lanes[k] |= if has(four[k]) { 1 << (4 * j + k) } else { 0 };
        }
    }
    lanes[0] | lanes[1] | (lanes[2] | lanes[3])
}
