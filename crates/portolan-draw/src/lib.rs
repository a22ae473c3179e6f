//! Maps and charts as PNG bytes in memory.
//!
//! Not a plotting library: it has the few shapes that the pictures of this project need, in one palette, and it opens no
//! files. A picture is a [`Canvas`]; a [`View`] maps a box of the world, in meters, to a rectangle of pixels; [`Panels`]
//! places several views side by side; a [`Chart`] has axes. Nothing here panics on empty, constant or non-finite data:
//! such points are omitted.
//!
//! ```
//! use portolan_draw::{Canvas, Pen, PixelRect, View, color};
//!
//! let mut canvas = Canvas::new(320, 240);
//! let view = View::fit([0.0, 0.0], [4.0, 3.0], PixelRect::new(0.0, 0.0, 320.0, 240.0));
//! canvas.raster(&view, [8, 6], [0.0, 0.0], 0.5, |[x, _]| color::signed_distance(x as f64 - 4.0, 4.0));
//! canvas.polyline(&view, &[[0.5, 0.5], [3.5, 2.5]], Pen::new(color::SURFACE, 2.0));
//! assert_eq!(&canvas.encode_png()[1..4], b"PNG");
//! ```

mod canvas;
mod chart;
pub mod color;
mod legend;
mod panels;
mod plot;
mod render;
mod text;
mod ticks;
mod units;
mod view;

pub use canvas::{Canvas, Pen};
pub use chart::{Axis, Chart, Line, Mark, Scale, Series};
pub use color::Color;
pub use legend::{Entry, Swatch};
pub use panels::{Panel, Panels};
pub use render::{Camera, MeshView, Preview, Sensor, preview, render_mesh};
pub use text::{Anchor, Font};
pub use ticks::{linear_ticks, log_ticks, tick_label};
pub use units::{shown_bytes, shown_seconds};
pub use view::{PixelRect, View};
