//! Writing g2o files.

use std::io::Write;

use crate::graph::PoseGraph;
use crate::tangent::{angle, quaternion};
use portolan::geom::Pose;

/// Writes a graph as g2o text: vertices, `FIX` lines, edges, each in the order of the graph. Numbers are written with
/// the digits needed to read back the same values. The format does not store [`EdgeKind`](crate::EdgeKind).
///
/// # Errors
/// The errors of `out`.
pub fn write_g2o<const D: usize>(graph: &PoseGraph<D>, mut out: impl Write) -> std::io::Result<()> {
    let (vertex_tag, edge_tag) =
        if D == 2 { ("VERTEX_SE2", "EDGE_SE2") } else { ("VERTEX_SE3:QUAT", "EDGE_SE3:QUAT") };
    for vertex in graph.vertices() {
        write!(out, "{vertex_tag} {}", vertex.id)?;
        write_pose(&vertex.world_from_vertex, &mut out)?;
        writeln!(out)?;
    }
    for vertex in graph.vertices().iter().filter(|v| v.fixed) {
        writeln!(out, "FIX {}", vertex.id)?;
    }
    for edge in graph.edges() {
        write!(out, "{edge_tag} {} {}", edge.i, edge.j)?;
        write_pose(&edge.i_from_j, &mut out)?;
        for value in edge.information.upper() {
            write!(out, " {value:?}")?;
        }
        writeln!(out)?;
    }
    out.flush()
}

fn write_pose<const D: usize>(pose: &Pose<D>, out: &mut impl Write) -> std::io::Result<()> {
    for value in pose.translation {
        write!(out, " {value:?}")?;
    }
    if D == 2 {
        return write!(out, " {:?}", angle(pose));
    }
    for value in quaternion(pose) {
        write!(out, " {value:?}")?;
    }
    Ok(())
}
