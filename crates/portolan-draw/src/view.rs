//! The map from a box of the world to a rectangle of pixels.

/// A rectangle of pixels: x to the right, y down, from the top left corner of the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelRect {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, not negative.
    pub width: f64,
    /// Height, not negative.
    pub height: f64,
}

impl PixelRect {
    /// The rectangle with its top left corner at `(x, y)`; negative sizes count as 0.
    pub fn new(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self { x, y, width: width.max(0.0), height: height.max(0.0) }
    }

    /// Right edge.
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    /// Bottom edge.
    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }

    /// The same rectangle without a margin at each side.
    pub fn inset(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(self.x + left, self.y + top, self.width - left - right, self.height - top - bottom)
    }

    /// Cuts the rectangle into `columns × rows` equal parts with `gap` pixels between them, row by row.
    pub fn split(&self, columns: usize, rows: usize, gap: f64) -> Vec<Self> {
        let (columns, rows) = (columns.max(1), rows.max(1));
        let width = (self.width - gap * (columns - 1) as f64) / columns as f64;
        let height = (self.height - gap * (rows - 1) as f64) / rows as f64;
        (0..rows * columns)
            .map(|i| {
                let (column, row) = ((i % columns) as f64, (i / columns) as f64);
                Self::new(self.x + column * (width + gap), self.y + row * (height + gap), width, height)
            })
            .collect()
    }
}

/// An affine map from a box of the world (meters, y up) onto a rectangle of pixels (y down).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    world_min: [f64; 2],
    rect: PixelRect,
    scale: [f64; 2],
}

impl View {
    /// The world box scaled to fit into `rect` with equal scales, centered; [`View::rect`] is the part that it covers. An
    /// extent of 0 counts as 1 m.
    pub fn fit(world_min: [f64; 2], world_max: [f64; 2], rect: PixelRect) -> Self {
        let extent = extent(world_min, world_max);
        let scale = (rect.width / extent[0]).min(rect.height / extent[1]);
        let (width, height) = (extent[0] * scale, extent[1] * scale);
        let (x, y) = (rect.x + 0.5 * (rect.width - width), rect.y + 0.5 * (rect.height - height));
        Self { world_min, rect: PixelRect::new(x, y, width, height), scale: [scale; 2] }
    }

    /// The world box stretched to `rect`, each axis with its own scale: for charts.
    pub fn stretch(world_min: [f64; 2], world_max: [f64; 2], rect: PixelRect) -> Self {
        let extent = extent(world_min, world_max);
        Self { world_min, rect, scale: [rect.width / extent[0], rect.height / extent[1]] }
    }

    /// Pixel coordinates of a point of the world.
    pub fn pixel_from_world(&self, point: [f64; 2]) -> [f64; 2] {
        [
            self.rect.x + (point[0] - self.world_min[0]) * self.scale[0],
            self.rect.bottom() - (point[1] - self.world_min[1]) * self.scale[1],
        ]
    }

    /// The point of the world under a pixel coordinate.
    pub fn world_from_pixel(&self, pixel: [f64; 2]) -> [f64; 2] {
        [
            self.world_min[0] + (pixel[0] - self.rect.x) / self.scale[0],
            self.world_min[1] + (self.rect.bottom() - pixel[1]) / self.scale[1],
        ]
    }

    /// Pixels per meter along x and y.
    pub fn scale(&self) -> [f64; 2] {
        self.scale
    }

    /// The rectangle of pixels that the world box covers; shapes are clipped to it.
    pub fn rect(&self) -> PixelRect {
        self.rect
    }

    /// Corners of the world box: minimum, maximum.
    pub fn world_box(&self) -> ([f64; 2], [f64; 2]) {
        (self.world_min, self.world_from_pixel([self.rect.right(), self.rect.y]))
    }

    /// The part of the segment `a b` (world) inside the view, in pixels; `None` where it lies outside or a coordinate is not
    /// finite (Liang & Barsky 1984).
    pub(crate) fn clip(&self, a: [f64; 2], b: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let (a, b) = (self.pixel_from_world(a), self.pixel_from_world(b));
        if !(a[0].is_finite() && a[1].is_finite() && b[0].is_finite() && b[1].is_finite()) {
            return None;
        }
        let low = [self.rect.x, self.rect.y];
        let high = [self.rect.right(), self.rect.bottom()];
        let delta = [b[0] - a[0], b[1] - a[1]];
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            for (step, room) in [(-delta[axis], a[axis] - low[axis]), (delta[axis], high[axis] - a[axis])] {
                if step == 0.0 {
                    if room < 0.0 {
                        return None;
                    }
                } else if step < 0.0 {
                    enter = enter.max(room / step);
                } else {
                    leave = leave.min(room / step);
                }
            }
        }
        let at = |t: f64| [a[0] + t * delta[0], a[1] + t * delta[1]];
        (enter <= leave).then(|| [at(enter), at(leave)])
    }

    /// Pixel coordinates of a point inside the view; `None` outside or not finite.
    pub(crate) fn inside(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        self.clip(point, point).map(|ends| ends[0])
    }
}

/// Extent of a box, with 1 where it is empty or not finite.
fn extent(min: [f64; 2], max: [f64; 2]) -> [f64; 2] {
    let axis = |a: usize| {
        let length = max[a] - min[a];
        if length.is_finite() && length > 0.0 { length } else { 1.0 }
    };
    [axis(0), axis(1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn y_points_up_and_the_box_is_centred() {
        let view = View::fit([0.0, 0.0], [2.0, 1.0], PixelRect::new(0.0, 0.0, 100.0, 100.0));
        assert_eq!(view.rect(), PixelRect::new(0.0, 25.0, 100.0, 50.0));
        assert_eq!(view.pixel_from_world([0.0, 0.0]), [0.0, 75.0]);
        assert_eq!(view.pixel_from_world([2.0, 1.0]), [100.0, 25.0]);
        assert_eq!(view.world_from_pixel([50.0, 50.0]), [1.0, 0.5]);
        assert_eq!(view.world_box(), ([0.0, 0.0], [2.0, 1.0]));
    }

    #[test]
    fn segments_are_cut_at_the_frame() {
        let view = View::stretch([0.0, 0.0], [1.0, 1.0], PixelRect::new(0.0, 0.0, 10.0, 10.0));
        assert_eq!(view.clip([-1.0, 0.5], [2.0, 0.5]), Some([[0.0, 5.0], [10.0, 5.0]]));
        assert_eq!(view.clip([-1.0, 2.0], [2.0, 2.0]), None);
        assert_eq!(view.clip([0.0, f64::NAN], [1.0, 1.0]), None);
        assert_eq!(view.inside([0.5, 0.5]), Some([5.0, 5.0]));
        assert_eq!(view.inside([1.5, 0.5]), None);
    }

    #[test]
    fn degenerate_boxes_do_not_divide_by_zero() {
        let view = View::fit([1.0, 1.0], [1.0, 1.0], PixelRect::new(0.0, 0.0, 10.0, 10.0));
        assert!(view.pixel_from_world([1.0, 1.0]).iter().all(|p| p.is_finite()));
    }

    #[test]
    fn split_fills_the_rectangle() {
        let parts = PixelRect::new(0.0, 0.0, 110.0, 50.0).split(2, 1, 10.0);
        assert_eq!(parts, [PixelRect::new(0.0, 0.0, 50.0, 50.0), PixelRect::new(60.0, 0.0, 50.0, 50.0)]);
    }
}
