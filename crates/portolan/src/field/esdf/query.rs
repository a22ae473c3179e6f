//! What a field answers: at cells, and between them.

use super::field::Esdf;
use super::measure::NodeDistances;
use crate::answer::Answer;
use crate::field::on_nodes::on_nodes;
use crate::geom::{BLOCK_EDGE, BlockKey, interpolate, vector};

impl<const D: usize> Esdf<D> {
    /// Signed distance at the center of a cell (meters).
    pub fn cell(&self, cell: [i32; D]) -> Answer<f32> {
        match self.value(cell) {
            Some(v) if v.is_nan() => Answer::Unknown,
            Some(v) if v.is_infinite() => Answer::Saturated(self.clamped(v)),
            Some(v) => Answer::Known(v),
            None => self.nothing_at(cell),
        }
    }

    /// Signed distance (meters) at a point, interpolated between the centers around it; its status is the worst of
    /// theirs. Saturated: at least so far, on the side of the sign. O(1).
    #[inline]
    pub fn distance(&self, p_world: impl Into<[f64; D]>) -> Answer<f64> {
        self.distance_and_gradient(p_world).map(|(value, _)| value)
    }

    /// The exact derivative of [`Esdf::distance`] (per meter): the direction away from the nearest surface. 0
    /// where all around is saturated. O(1).
    #[inline]
    pub fn gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<[f64; D]> {
        self.distance_and_gradient(p_world).map(|(_, gradient)| gradient)
    }

    /// Value and gradient of one interpolant in one call. O(1): a look into one brick, or into up to `2^D` where the
    /// centers around the point lie in several.
    pub fn distance_and_gradient(&self, p_world: impl Into<[f64; D]>) -> Answer<(f64, [f64; D])> {
        let p = p_world.into();
        let Some((base, fraction)) = self.place(p) else { return Answer::Outside };
        let Some((corners, saturated)) = self.corners(base) else {
            return self.on_nodes(p).map(|(value, slope)| (value, self.per_meter(slope)));
        };
        let (value, slope) = interpolate(&corners, &std::array::from_fn(|k| 1 << k), 0, &fraction);
        let answer = (value, self.per_meter(slope));
        if saturated { Answer::Saturated(answer) } else { Answer::Known(answer) }
    }

    fn per_meter(&self, slope: [f64; D]) -> [f64; D] {
        vector::scale(slope, 1.0 / self.lattice.resolution)
    }

    /// The answer where a center around the point is missing, in cells: known where that one does not count.
    #[cold]
    pub(in crate::field) fn on_nodes(&self, p: [f64; D]) -> Answer<(f64, [f64; D])> {
        let place = self.lattice.to_cells(p).map(|c| c - 0.5);
        let sample = |cell| {
            let value = self.value(cell).filter(|v| !v.is_nan())?;
            Some((f64::from(self.clamped(value)), value.is_infinite()))
        };
        on_nodes(place, sample).unwrap_or_else(|| self.nothing(p))
    }

    /// The lower one of the two centers beside a point, along every axis, and the point's place between them; `None` where
    /// no index holds it.
    #[inline(always)]
    pub(in crate::field) fn place(&self, p: [f64; D]) -> Option<([i32; D], [f64; D])> {
        let shifted: [f64; D] = std::array::from_fn(|k| p[k] - 0.5 * self.lattice.resolution);
        let base = self.lattice.cell_of(shifted)?;
        let cells = self.lattice.to_cells(p);
        let fraction = std::array::from_fn(|k| (cells[k] - 0.5 - f64::from(base[k])).clamp(0.0, 1.0));
        Some((base, fraction))
    }

    /// The answer at a point that cannot be interpolated: it belongs to the cell that holds it.
    pub(in crate::field) fn nothing<T>(&self, p: [f64; D]) -> Answer<T> {
        self.lattice.cell_of(p).map_or(Answer::Outside, |cell| match self.value(cell) {
            Some(_) => Answer::Unknown,
            None => self.nothing_at(cell),
        })
    }

    /// The `2^D` values from `base` on, clamped to the largest distance, and whether one of them was; `None` where one
    /// is unknown.
    #[inline]
    pub(in crate::field) fn corners(&self, base: [i32; D]) -> Option<([f32; 8], bool)> {
        let mut corners = [0.0; 8];
        let key = BlockKey::of_cell(base);
        let inside = (0..D).all(|k| (base[k] & 7) < BLOCK_EDGE as i32 - 1);
        let brick = if inside { self.brick(key)? } else { &[] };
        for (c, corner) in corners.iter_mut().enumerate().take(1 << D) {
            let cell: [i32; D] = std::array::from_fn(|k| base[k] + ((c >> k) & 1) as i32);
            *corner = if inside { brick[BlockKey::offset(cell)] } else { self.value(cell)? };
        }
        let used = &corners[..1 << D];
        if used.iter().any(|v| v.is_nan()) {
            return None;
        }
        let saturated = used.iter().any(|v| v.is_infinite());
        Some((corners.map(|v| self.clamped(v)), saturated))
    }

    pub(super) fn clamped(&self, value: f32) -> f32 {
        value.clamp(-self.max_distance, self.max_distance)
    }

    #[inline]
    pub(in crate::field) fn brick(&self, key: BlockKey<D>) -> Option<&[f32]> {
        Some(self.plane(self.slot(key)?))
    }

    /// Signed distances of the brick in a slot, measured if nobody has read them yet.
    #[inline]
    pub(super) fn plane(&self, slot: usize) -> &[f32] {
        self.bricks[slot].distance.get_or_init(|| self.measured(slot, &mut NodeDistances::new()))
    }

    /// The stored value of a cell; `None` where there is no brick.
    #[inline]
    pub(super) fn value(&self, cell: [i32; D]) -> Option<f32> {
        Some(self.brick(BlockKey::of_cell(cell))?[BlockKey::offset(cell)])
    }

    /// Unknown beside a brick of the map, outside elsewhere.
    pub(super) fn nothing_at<T>(&self, cell: [i32; D]) -> Answer<T> {
        let key = BlockKey::of_cell(cell);
        let near = (0..3usize.pow(D as u32)).any(|n| {
            let step = |k: usize| (n / 3usize.pow(k as u32) % 3) as i32 - 1;
            self.slots.contains_key(&BlockKey(std::array::from_fn(|k| key.0[k] + step(k))))
        });
        if near { Answer::Unknown } else { Answer::Outside }
    }
}
