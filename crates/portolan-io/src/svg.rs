//! Contours as SVG: one unit is one meter, y up.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use portolan::geom::Aabb;

use crate::geojson::check_finite;
use crate::{IoError, Polyline, Result, write_atomic};

/// How a contour is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct SvgStyle {
    /// Any color of SVG.
    pub stroke: String,
    /// Width of the line on the screen (pixels).
    pub stroke_width_px: f64,
    /// Longer edge of the picture when it is opened alone (pixels).
    pub size_px: f64,
    /// Empty border around the contour (meters).
    pub margin: f64,
}

impl Default for SvgStyle {
    /// The purple of extracted contours.
    fn default() -> Self {
        Self { stroke: "#7b2d8b".into(), stroke_width_px: 1.5, size_px: 1200.0, margin: 0.5 }
    }
}

/// Coordinates beyond this are drawn relative to a corner: viewers compute with f32.
const FAR: f64 = 10_000.0;

/// Writes polylines (meters, y up).
///
/// The coordinates of the paths are the world's; where they lie farther than 10 km from its zero they are
/// relative to the point in the attribute `data-origin`.
///
/// # Errors
/// [`crate::IoError::Unwritable`] for a coordinate that is not finite, else as [`write_atomic`].
pub fn write_svg(path: impl AsRef<Path>, lines: &[Polyline], style: &SvgStyle) -> Result<()> {
    let path = path.as_ref();
    check_finite(path, lines)?;
    write_atomic(path, |w| draw(w, lines, style))
}

/// The text of [`write_svg`].
///
/// # Errors
/// [`crate::IoError::Unwritable`] for a coordinate that is not finite.
pub fn svg_text(lines: &[Polyline], style: &SvgStyle) -> Result<String> {
    let name = Path::new("contour.svg");
    check_finite(name, lines)?;
    let mut text = Vec::new();
    draw(&mut text, lines, style).map_err(|error| IoError::os(name, "written", error))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn draw(w: &mut dyn Write, lines: &[Polyline], style: &SvgStyle) -> std::io::Result<()> {
    let mut bounds = Aabb::<2>::EMPTY;
    lines.iter().flatten().for_each(|&p| bounds.include(p));
    if bounds.is_empty() {
        bounds = Aabb::new([0.0; 2], [0.0; 2]);
    }
    let bounds = bounds.grown(style.margin.max(1e-3));
    let far = bounds.min.iter().chain(&bounds.max).any(|v| v.abs() > FAR);
    let origin = if far { bounds.min.map(f64::floor) } else { [0.0; 2] };
    let [width, height] = bounds.extent();
    let scale = style.size_px / width.max(height);
    write!(w, "<svg xmlns=\"http://www.w3.org/2000/svg\" ")?;
    let (left, top) = (bounds.min[0] - origin[0], -(bounds.max[1] - origin[1]));
    write!(w, "viewBox=\"{left:.3} {top:.3} {width:.3} {height:.3}\" ")?;
    write!(w, "width=\"{:.0}\" height=\"{:.0}\" ", width * scale, height * scale)?;
    writeln!(w, "data-units=\"metres\" data-origin=\"{} {}\">", origin[0], origin[1])?;
    // Negative scale: y is up in the world and down on the screen.
    write!(w, "<g transform=\"scale(1 -1)\" fill=\"none\" stroke=\"{}\" ", escaped(&style.stroke))?;
    writeln!(w, "stroke-width=\"{}\" stroke-linejoin=\"round\">", style.stroke_width_px / scale)?;
    for line in lines.iter().filter(|l| l.len() > 1) {
        writeln!(w, "<path d=\"{}\"/>", data(line, origin))?;
    }
    writeln!(w, "</g>\n</svg>")
}

/// Path commands, a tenth of a millimeter fine.
fn data(line: &[[f64; 2]], origin: [f64; 2]) -> String {
    let closed = line.len() > 2 && line.first() == line.last();
    let drawn = if closed { &line[..line.len() - 1] } else { line };
    let mut d = String::new();
    for (i, p) in drawn.iter().enumerate() {
        let command = if i == 0 { 'M' } else { 'L' };
        // Writing to a string cannot fail.
        let _ = write!(d, "{command}{:.4} {:.4}", p[0] - origin[0], p[1] - origin[1]);
    }
    if closed {
        d.push('Z');
    }
    d
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(lines: &[Polyline]) -> String {
        let style = SvgStyle { margin: 1.0, ..SvgStyle::default() };
        String::from_utf8(crate::testing::written(|path| write_svg(path, lines, &style))).unwrap()
    }

    #[test]
    fn the_view_box_is_the_contour_in_metres_y_up() {
        let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 0.0]];
        let text = svg(&[square, vec![[1.0, 1.0], [2.0, 1.5]], vec![[1.0, 1.0]]]);
        assert!(
            text.contains("viewBox=\"-1.000 -3.000 6.000 4.000\" width=\"1200\" height=\"800\""),
            "{text}"
        );
        assert!(text.contains("<path d=\"M0.0000 0.0000L4.0000 0.0000L4.0000 2.0000Z\"/>"));
        assert!(text.contains("<path d=\"M1.0000 1.0000L2.0000 1.5000\"/>"));
        assert_eq!(text.matches("<path").count(), 2);
    }

    #[test]
    fn far_and_empty_contours_are_fine() {
        let text = svg(&[vec![[500_000.0, 4_000_000.0], [500_001.25, 4_000_002.0]]]);
        assert!(
            text.contains("data-origin=\"499999 3999999\"") && text.contains("M1.0000 1.0000L2.2500 3.0000")
        );
        assert!(svg(&[]).contains("viewBox=\"-1.000 -1.000 2.000 2.000\""));
        assert!(write_svg("never", &[vec![[f64::INFINITY, 0.0]]], &SvgStyle::default()).is_err());
    }
}
