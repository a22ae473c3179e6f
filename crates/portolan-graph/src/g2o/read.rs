//! Reading g2o files.

use std::collections::BTreeMap;
use std::io::BufRead;

use portolan::geom::Pose;

use super::fields::{Fields, G2oError, next_line, shortened};
use crate::graph::{Edge, EdgeKind, PoseGraph};
use crate::information::Information;
use crate::start::Chain;
use crate::tangent::{planar, tangent_dimension};

/// A 2-D or a 3-D graph.
#[derive(Clone, Debug)]
pub enum AnyGraph {
    /// 2-D poses.
    Se2(PoseGraph<2>),
    /// 3-D poses.
    Se3(PoseGraph<3>),
}

/// The content of a g2o file.
#[derive(Clone, Debug)]
pub struct G2oFile {
    /// The graph. Edges between ids that differ by one are odometry, all others closures.
    pub graph: AnyGraph,
    /// Whether the file had edges only: the vertices were then made from the ids in the edges, ascending, and placed
    /// by chaining odometry ([`Chain::Odometry`]).
    pub vertices_made: bool,
    /// Number of lines skipped by their first word; from the 65th word on counted as `(other)`.
    pub unknown: BTreeMap<String, usize>,
    /// Number of quaternions whose length differs from 1 by more than 1e-3; all are normalized.
    pub quaternions_off: usize,
}

/// Reads a g2o text file; `name` is its name in error messages. Comments (`#`) and empty lines are skipped.
///
/// ```
/// use portolan_graph::{AnyGraph, read_g2o};
/// let text = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
/// let file = read_g2o(text.as_bytes(), "two poses")?;
/// let AnyGraph::Se2(graph) = file.graph else { panic!("SE2 is 2-D") };
/// assert!(file.vertices_made);
/// assert_eq!(graph.pose(1).unwrap().translation, [1.0, 0.0]);
/// # Ok::<(), portolan_graph::G2oError>(())
/// ```
///
/// # Errors
/// [`G2oError`], which names the line, the field and the value. Nothing is repaired or left out.
pub fn read_g2o(mut input: impl BufRead, name: &str) -> Result<G2oFile, G2oError> {
    let mut se2 = Lines::<2>::default();
    let mut se3 = Lines::<3>::default();
    let mut fixed = Vec::new();
    let mut unknown = BTreeMap::new();
    let mut quaternions_off = 0;
    let mut buffer = Vec::new();
    let mut line = 1;
    while next_line(&mut input, &mut buffer, name, line)? {
        let text = String::from_utf8_lossy(&buffer);
        let text = text.trim_ascii();
        let (word, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        let fields = |tag| Fields::new(name, line, tag, rest);
        match word {
            "" => {}
            "VERTEX_SE2" => se2.vertex(fields("VERTEX_SE2"), planar_pose)?,
            "EDGE_SE2" => se2.edge(fields("EDGE_SE2"), planar_pose)?,
            "VERTEX_SE3:QUAT" => {
                se3.vertex(fields("VERTEX_SE3:QUAT"), |f| spatial_pose(f, &mut quaternions_off))?;
            }
            "EDGE_SE3:QUAT" => {
                se3.edge(fields("EDGE_SE3:QUAT"), |f| spatial_pose(f, &mut quaternions_off))?;
            }
            "FIX" => {
                let mut fields = fields("FIX");
                fixed.push((line, fields.id("id")?));
                while let Some(word) = fields.more() {
                    fixed.push((line, fields.parse_id("id", word)?));
                }
            }
            _ if word.starts_with('#') => {}
            _ => {
                let key = shortened(word);
                let known = unknown.contains_key(&key) || unknown.len() < 64;
                *unknown.entry(if known { key } else { "(other)".into() }).or_insert(0) += 1;
            }
        }
        if let (Some(_), Some(_)) = (se2.last, se3.last) {
            let tag = se2.last.max(se3.last).map_or("", |(_, tag)| tag);
            return Err(G2oError::MixedDimensions { name: name.into(), line, tag });
        }
        line += 1;
    }
    let (graph, vertices_made) = if se2.last.is_some() {
        let (graph, made) = se2.graph(name, &fixed)?;
        (AnyGraph::Se2(graph), made)
    } else if se3.last.is_some() {
        let (graph, made) = se3.graph(name, &fixed)?;
        (AnyGraph::Se3(graph), made)
    } else {
        return Err(G2oError::Empty { name: name.into(), lines: line - 1 });
    };
    Ok(G2oFile { graph, vertices_made, unknown, quaternions_off })
}

/// The lines of one dimension, kept until the end of the file: edges may precede their vertices.
#[derive(Default)]
struct Lines<const D: usize> {
    vertices: Vec<(usize, u64, Pose<D>)>,
    edges: Vec<(usize, Edge<D>)>,
    /// Line and tag read last.
    last: Option<(usize, &'static str)>,
}

impl<const D: usize> Lines<D> {
    fn vertex(
        &mut self,
        mut fields: Fields<'_>,
        mut pose: impl FnMut(&mut Fields<'_>) -> Result<Pose<D>, G2oError>,
    ) -> Result<(), G2oError> {
        let id = fields.id("id")?;
        let pose = pose(&mut fields)?;
        fields.end()?;
        self.vertices.push((fields.line, id, pose));
        self.last = Some((fields.line, fields.tag));
        Ok(())
    }

    fn edge(
        &mut self,
        mut fields: Fields<'_>,
        mut pose: impl FnMut(&mut Fields<'_>) -> Result<Pose<D>, G2oError>,
    ) -> Result<(), G2oError> {
        let (i, j) = (fields.id("i")?, fields.id("j")?);
        let i_from_j = pose(&mut fields)?;
        let n = tangent_dimension(D);
        let mut upper = Vec::with_capacity(n * (n + 1) / 2);
        for r in 1..=n {
            for c in r..=n {
                upper.push(fields.number(&format!("information {r} {c}"))?);
            }
        }
        fields.end()?;
        let information = Information::from_upper(&upper).map_err(|source| fields.refused(source))?;
        let kind = if i.abs_diff(j) == 1 { EdgeKind::Odometry } else { EdgeKind::Closure };
        self.edges.push((fields.line, Edge { i, j, i_from_j, information, kind }));
        self.last = Some((fields.line, fields.tag));
        Ok(())
    }

    /// The graph, and whether its vertices were made from its edges.
    fn graph(self, name: &str, fixed: &[(usize, u64)]) -> Result<(PoseGraph<D>, bool), G2oError> {
        let refused = |line: usize| move |source| G2oError::Graph { name: name.into(), line, source };
        let mut graph = PoseGraph::new();
        let made = self.vertices.is_empty();
        if made {
            let mut ids: Vec<(u64, usize)> =
                self.edges.iter().flat_map(|(line, e)| [(e.i, *line), (e.j, *line)]).collect();
            ids.sort_unstable();
            ids.dedup_by_key(|(id, _)| *id);
            for (id, line) in ids {
                graph.add_vertex(id, Pose::IDENTITY).map_err(refused(line))?;
            }
        }
        for (line, id, pose) in self.vertices {
            graph.add_vertex(id, pose).map_err(refused(line))?;
        }
        for (line, edge) in self.edges {
            graph.add_edge(edge).map_err(refused(line))?;
        }
        for &(line, id) in fixed {
            graph.set_fixed(id, true).map_err(refused(line))?;
        }
        if made {
            graph.start_from_tree(Chain::Odometry);
        }
        Ok((graph, made))
    }
}

fn planar_pose(fields: &mut Fields<'_>) -> Result<Pose<2>, G2oError> {
    let [x, y, theta] = fields.numbers(["x", "y", "theta"])?;
    Ok(planar(x, y, theta))
}

fn spatial_pose(fields: &mut Fields<'_>, off: &mut usize) -> Result<Pose<3>, G2oError> {
    let translation = fields.numbers(["x", "y", "z"])?;
    let xyzw = fields.numbers(["qx", "qy", "qz", "qw"])?;
    let length = xyzw.iter().map(|v| v * v).sum::<f64>().sqrt();
    *off += usize::from((length - 1.0).abs() > 1e-3);
    Pose::from_quaternion(translation, xyzw)
        .ok_or_else(|| fields.wrong("qx qy qz qw", &format!("{xyzw:?}"), "a quaternion with a length"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::g2o::write_g2o;
    use proptest::prelude::*;

    const SE2_EDGE: &str = "EDGE_SE2 5 9 1 2 0.5 4 0 0 4 0 100";

    fn error(text: &str) -> String {
        read_g2o(text.as_bytes(), "f").unwrap_err().to_string()
    }

    fn se2(text: &str) -> (PoseGraph<2>, G2oFile) {
        let file = read_g2o(text.as_bytes(), "f").unwrap();
        let AnyGraph::Se2(graph) = file.graph.clone() else { panic!("not 2-D") };
        (graph, file)
    }

    #[test]
    fn errors_name_line_field_and_value() {
        let cases = [
            ("", "f: no pose graph (0 lines without a vertex or an edge)"),
            ("# a\nFIX 3\n", "f: no pose graph (2 lines without a vertex or an edge)"),
            ("\nVERTEX_SE2 1 2 3", "f, line 2: VERTEX_SE2 ends before its field theta"),
            ("VERTEX_SE2", "f, line 1: VERTEX_SE2 ends before its field id"),
            (
                "VERTEX_SE2 -1 0 0 0",
                "f, line 1: VERTEX_SE2 has \"-1\" in its field id, not a whole number from 0 to 2^64 - 1",
            ),
            ("VERTEX_SE2 1 nan 0 0", "f, line 1: VERTEX_SE2 has \"nan\" in its field x, not a finite number"),
            (
                "VERTEX_SE2 1 0 1e999 0",
                "f, line 1: VERTEX_SE2 has \"1e999\" in its field y, not a finite number",
            ),
            ("VERTEX_SE2 1 0 0 0 7", "f, line 1: VERTEX_SE2 goes on with \"7\" after its last field"),
            ("VERTEX_SE2 1 0 0 0\nVERTEX_SE2 1 0 0 0", "f, line 2: vertex 1 exists already"),
            (
                "VERTEX_SE2 1 0 0 0\nVERTEX_SE3:QUAT 2 0 0 0 0 0 0 1",
                "f, line 2: VERTEX_SE3:QUAT in a file that began with the other dimension",
            ),
            (
                "VERTEX_SE3:QUAT 2 0 0 0 0 0 0 0",
                "f, line 1: VERTEX_SE3:QUAT has \"[0.0, 0.0, 0.0, 0.0]\" in its field qx qy qz qw, not a quaternion with a length",
            ),
            ("EDGE_SE2 1 2 0 0 0 1 0 0 1 0", "f, line 1: EDGE_SE2 ends before its field information 3 3"),
            (
                "EDGE_SE2 1 2 0 0 0 1 0 0 -1 0 1",
                "f, line 1: an information matrix is not positive definite: pivot -1.000e0 in row 1",
            ),
            ("EDGE_SE2 1 1 0 0 0 1 0 0 1 0 1", "f, line 1: an edge connects vertex 1 with itself"),
            ("EDGE_SE2 1 2 0 0 0 1 0 0 1 0 1\nVERTEX_SE2 1 0 0 0", "f, line 1: vertex 2 does not exist"),
            ("VERTEX_SE2 1 0 0 0\nFIX 1 2", "f, line 2: vertex 2 does not exist"),
            ("VERTEX_SE2 1 0 0 0\nFIX", "f, line 2: FIX ends before its field id"),
        ];
        for (text, expected) in cases {
            assert_eq!(error(text), expected);
        }
        assert_eq!(error(&"x".repeat(1 << 20)), "f, line 1: longer than 65536 bytes");
    }

    #[test]
    fn huge_ids_unknown_tags_and_broken_characters() {
        let (graph, file) = se2(&format!(
            "PARAMS 0 1\nPARAMS 2\n\u{fffd}\r\nEDGE_SE2 18446744073709551615 0 1 0 0 1 0 0 1 0 1\r\n{SE2_EDGE}"
        ));
        assert_eq!(graph.vertices().iter().map(|v| v.id).collect::<Vec<_>>(), [0, 5, 9, u64::MAX]);
        assert!(file.vertices_made);
        assert_eq!(file.unknown["PARAMS"], 2);
        assert_eq!(file.unknown.len(), 2);
        assert!(graph.pose(0).unwrap().translation == [0.0, 0.0]);
        assert!((graph.pose(9).unwrap().translation[1] - 2.0).abs() < 1e-15, "its own part starts at 5");
        let many: String = (0..200).map(|k| format!("T{k}\n")).collect();
        let (_, file) = se2(&format!("{many}{SE2_EDGE}"));
        assert_eq!(file.unknown.len(), 65);
        assert_eq!(file.unknown["(other)"], 136);
    }

    #[test]
    fn written_graphs_read_back() {
        let (graph, _) = se2(&format!(
            "VERTEX_SE2 9 1e-7 -2e20 3.1\nVERTEX_SE2 5 0.1 0.2 -1.3\nVERTEX_SE2 6 0 0 7\n{SE2_EDGE}\n\
             EDGE_SE2 6 5 1 1 1 3 0.1 0.2 4 0.3 5\nFIX 5\n"
        ));
        let mut text = Vec::new();
        write_g2o(&graph, &mut text).unwrap();
        let (again, _) = se2(std::str::from_utf8(&text).unwrap());
        for (a, b) in graph.vertices().iter().zip(again.vertices()) {
            assert_eq!((a.id, a.fixed), (b.id, b.fixed));
            assert_eq!(a.world_from_vertex.translation, b.world_from_vertex.translation);
            let (r, s) = (a.world_from_vertex.rotation, b.world_from_vertex.rotation);
            assert!(r.iter().flatten().zip(s.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-15));
        }
        assert_eq!(graph.edges().len(), 2);
        for (a, b) in graph.edges().iter().zip(again.edges()) {
            assert_eq!((a.i, a.j, a.information, a.kind), (b.i, b.j, b.information, b.kind));
            assert_eq!(a.i_from_j.translation, b.i_from_j.translation);
        }
    }

    proptest! {
        #[test]
        fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = read_g2o(&bytes[..], "random");
        }

        /// Lines that are nearly right reach further than random bytes: words of the format in any order.
        #[test]
        fn random_words_never_panic_and_can_be_solved(
            words in proptest::collection::vec(0usize..24, 0..200),
        ) {
            const WORDS: [&str; 24] = [
                "VERTEX_SE2", "EDGE_SE2", "VERTEX_SE3:QUAT", "EDGE_SE3:QUAT", "FIX", "\n", "\n", "0", "1", "2",
                "-1", "1e300", "NaN", "0.5", "\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n", "\nVERTEX_SE2 0 0 0 0\n",
                "\nVERTEX_SE2 1 5 0 0\n", "\nEDGE_SE2 0 2 1e300 0 0 1 0 0 1 0 1\n", "#", "99999999999999999999",
                "\nEDGE_SE2 3 2 1 0 0 1e300 0 0 1e-300 0 1\n", "\nEDGE_SE2 1 3 9 9 9 1 0.9 0 1 0 1\n", "\u{e9}", "\nFIX 1\n",
            ];
            let text: String = words.iter().map(|&k| format!("{} ", WORDS[k])).collect();
            if let Ok(G2oFile { graph: AnyGraph::Se2(mut graph), .. }) = read_g2o(text.as_bytes(), "words") {
                let _ = graph.start_from_chordal();
                let _ = graph.optimize(&crate::Settings::default());
            }
        }

        /// Good files with a few bytes changed: most of them fail late, some not at all.
        #[test]
        fn damaged_files_never_panic(
            se3 in any::<bool>(),
            damage in proptest::collection::vec((any::<proptest::sample::Index>(), 0usize..14), 0..6),
        ) {
            let identity = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 4 0 0 4 0 4";
            let text = if se3 {
                format!("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0.6 0.8\nFIX 1\n\
                         EDGE_SE3:QUAT 0 1 1 2 3 0.5 0.5 0.5 0.5 {identity}\n\
                         EDGE_SE3:QUAT 1 0 1 1 1 0.1 0.2 0.3 0.9 {identity}\n")
            } else {
                format!("{SE2_EDGE}\nEDGE_SE2 9 4 1 1 -3 1 0.1 0 2 0 3\nEDGE_SE2 4 5 0 0 1 1 0 0 1 0 1\n")
            };
            let mut bytes = text.into_bytes();
            for (at, with) in damage {
                let at = at.index(bytes.len());
                bytes[at] = b"0123456789-e. "[with];
            }
            let settings = crate::Settings { kernel: crate::Kernel::Dcs(1.0), ..crate::Settings::default() };
            match read_g2o(&bytes[..], "damaged") {
                Ok(G2oFile { graph: AnyGraph::Se2(mut graph), .. }) => {
                    let _ = graph.start_from_chordal();
                    let _ = graph.optimize(&settings);
                }
                Ok(G2oFile { graph: AnyGraph::Se3(mut graph), .. }) => {
                    let _ = graph.start_from_chordal();
                    let _ = graph.optimize(&settings);
                }
                Err(_) => {}
            }
        }
    }
}
