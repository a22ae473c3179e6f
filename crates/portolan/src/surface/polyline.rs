//! Segments joined end to end.

use super::Contour;

/// A chain of points (world, meters). A closed one does not repeat its first point.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// The points in order, free space on the left.
    pub vertices: Vec<[f64; 2]>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

/// Joins the segments of a contour: open chains first, each from its start, then closed ones; both in the
/// order of their first segment. O(segments).
pub(super) fn join(contour: &Contour) -> Vec<Polyline> {
    const NONE: u32 = u32::MAX;
    let n = contour.vertices.len();
    // In a contour of marching squares a vertex starts at most one segment and ends at most one.
    let mut next = vec![NONE; n];
    let mut has_previous = vec![false; n];
    for &[from, to] in &contour.segments {
        next[from as usize] = to;
        has_previous[to as usize] = true;
    }
    let mut lines = Vec::new();
    let mut follow = |start: u32, next: &mut Vec<u32>| {
        let mut line = Polyline { vertices: vec![contour.vertices[start as usize]], closed: false };
        let mut at = start;
        while next[at as usize] != NONE {
            let to = std::mem::replace(&mut next[at as usize], NONE);
            if to == start {
                line.closed = true;
                break;
            }
            line.vertices.push(contour.vertices[to as usize]);
            at = to;
        }
        lines.push(line);
    };
    for &[from, _] in &contour.segments {
        if !has_previous[from as usize] && next[from as usize] != NONE {
            follow(from, &mut next);
        }
    }
    for &[from, _] in &contour.segments {
        if next[from as usize] != NONE {
            follow(from, &mut next);
        }
    }
    lines
}
