//! The pose of a frame in another at a time.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;

use portolan::geom::{NoPose, Pose};

use super::track::Track;

/// How a frame moves in its parent.
#[derive(Clone, Debug)]
pub(super) enum Motion {
    /// Not at all.
    Static(Pose<3>),
    /// By stamped poses.
    Moving(Box<Track>),
}

/// `parent_from_child`.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub(super) parent: usize,
    pub(super) child: usize,
    pub(super) motion: Motion,
    pub(super) messages: u64,
}

/// Frames and how they move in each other.
#[derive(Clone, Debug)]
pub struct FrameTree {
    /// In order of their names.
    frames: Vec<String>,
    edges: Vec<Edge>,
    /// Edges to the parents of each frame.
    up: Vec<Vec<usize>>,
    notes: Vec<String>,
}

/// An edge of the tree, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeInfo<'a> {
    /// The parent's name.
    pub parent: &'a str,
    /// The child's name.
    pub child: &'a str,
    /// Whether it is static.
    pub is_static: bool,
    /// Transforms in the bag.
    pub messages: u64,
    /// The first and the last stamp (nanoseconds) of one that moves.
    pub span: Option<(i64, i64)>,
    /// The median time between transforms (seconds) of one that moves.
    pub usual_interval: f64,
    /// The longest time between transforms (seconds) of one that moves.
    pub largest_gap: f64,
}

/// Why there is no pose.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum NoTransform {
    /// No transform names the frame.
    UnknownFrame(String),
    /// No chain of transforms leads from one to the other.
    NotConnected {
        /// The frame in which the pose was asked.
        target: String,
        /// The frame whose pose was asked.
        source: String,
    },
    /// An edge between them has no pose at the time.
    Time {
        /// The edge's parent.
        parent: String,
        /// The edge's child.
        child: String,
        /// What is missing, and by how much.
        cause: NoPose,
    },
}

impl fmt::Display for NoTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownFrame(frame) => write!(f, "no transform names the frame {frame}"),
            Self::NotConnected { target, source } => {
                write!(f, "no chain of transforms leads from {source} to {target}")
            }
            Self::Time { parent, child, cause } => write!(f, "transform {parent} > {child}: {cause}"),
        }
    }
}

impl FrameTree {
    pub(super) fn new(frames: Vec<String>, edges: Vec<Edge>, mut notes: Vec<String>) -> Self {
        let mut up = vec![Vec::new(); frames.len()];
        for (i, edge) in edges.iter().enumerate() {
            up[edge.child].push(i);
        }
        for (frame, parents) in up.iter().enumerate().filter(|(_, p)| p.len() > 1) {
            let names: Vec<&str> = parents.iter().map(|e| &*frames[edges[*e].parent]).collect();
            notes.push(format!(
                "{}: it has {} parents ({}): the shortest way to the fixed frame is taken",
                frames[frame],
                names.len(),
                names.join(", ")
            ));
        }
        let mut tree = Self { frames, edges, up, notes };
        let roots = tree.roots();
        if roots.len() > 1 {
            let note = format!(
                "the tree has {} roots: {}; no pose leads from one to another",
                roots.len(),
                roots.join(", ")
            );
            tree.notes.push(note);
        }
        tree
    }

    /// What contradicts itself, was mended or left out: a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The names of all frames, in their order.
    pub fn frames(&self) -> &[String] {
        &self.frames
    }

    /// Whether a transform names this frame.
    pub fn has(&self, frame: &str) -> bool {
        self.place(frame).is_ok()
    }

    /// The frames without a parent.
    pub fn roots(&self) -> Vec<&str> {
        self.frames.iter().zip(&self.up).filter(|(_, up)| up.is_empty()).map(|(name, _)| &**name).collect()
    }

    /// The frame at the top of this one's ancestors, where there is one way up; the frame itself where it has no parent or
    /// is not known.
    pub fn root_of<'a>(&'a self, frame: &'a str) -> &'a str {
        let Ok(mut at) = self.place(frame) else { return frame };
        // No cycle: the builder refuses them.
        while let Some(edge) = self.up[at].first() {
            at = self.edges[*edge].parent;
        }
        &self.frames[at]
    }

    /// The edges from a frame to the top, the frame's own first, where there is one way up.
    pub fn chain<'a>(&'a self, frame: &str) -> Vec<EdgeInfo<'a>> {
        let mut all = Vec::new();
        let Ok(mut at) = self.place(frame) else { return all };
        while let Some(edge) = self.up[at].first() {
            all.push(self.info(&self.edges[*edge]));
            at = self.edges[*edge].parent;
        }
        all
    }

    /// All edges, by parent and child.
    pub fn edges(&self) -> impl Iterator<Item = EdgeInfo<'_>> {
        self.edges.iter().map(|edge| self.info(edge))
    }

    fn info(&self, edge: &Edge) -> EdgeInfo<'_> {
        let track = match &edge.motion {
            Motion::Static(_) => None,
            Motion::Moving(track) => Some(track),
        };
        EdgeInfo {
            parent: &self.frames[edge.parent],
            child: &self.frames[edge.child],
            is_static: track.is_none(),
            messages: edge.messages,
            span: track.and_then(|t| t.span()),
            usual_interval: track.map_or(0.0, |t| t.usual_interval()),
            largest_gap: track.map_or(0.0, |t| t.largest_gap()),
        }
    }

    /// The pose `target_from_source` at a stamp (nanoseconds): each edge between them at that time, by its own
    /// [`Track`]. A frame's pose in itself is the identity, whether the tree knows it or not. O(depth log n).
    ///
    /// # Errors
    /// [`NoTransform`] names the frame or the edge.
    pub fn lookup(
        &self,
        target: &str,
        source: &str,
        stamp: i64,
        tolerance: f64,
    ) -> Result<Pose<3>, NoTransform> {
        if target == source {
            return Ok(Pose::IDENTITY);
        }
        let (to, from) = (self.place(target)?, self.place(source)?);
        let (above_target, above_source) = (self.climb(to), self.climb(from));
        let common = above_source.iter().filter_map(|(frame, (steps, _))| {
            above_target.get(frame).map(|(more, _)| (steps + more, *frame))
        });
        let Some((_, top)) = common.min() else {
            return Err(NoTransform::NotConnected { target: target.to_owned(), source: source.to_owned() });
        };
        let top_from_target = self.along(&above_target, top, stamp, tolerance)?;
        let top_from_source = self.along(&above_source, top, stamp, tolerance)?;
        Ok(match top == to {
            // An inverse of the identity would be one, but for the signs of its zeros.
            true => top_from_source,
            false => top_from_target.inverse() * top_from_source,
        })
    }

    fn place(&self, frame: &str) -> Result<usize, NoTransform> {
        let found = self.frames.binary_search_by(|f| f.as_str().cmp(frame));
        found.map_err(|_| NoTransform::UnknownFrame(frame.to_owned()))
    }

    /// All frames above one, with the fewest steps and the last edge of the way up.
    fn climb(&self, from: usize) -> BTreeMap<usize, (usize, Option<usize>)> {
        let mut found = BTreeMap::from([(from, (0, None))]);
        let mut queue = VecDeque::from([(from, 0)]);
        while let Some((frame, steps)) = queue.pop_front() {
            for &edge in &self.up[frame] {
                let parent = self.edges[edge].parent;
                if let std::collections::btree_map::Entry::Vacant(entry) = found.entry(parent) {
                    entry.insert((steps + 1, Some(edge)));
                    queue.push_back((parent, steps + 1));
                }
            }
        }
        found
    }

    /// The pose of where a climb began in one of the frames above.
    fn along(
        &self,
        climb: &BTreeMap<usize, (usize, Option<usize>)>,
        top: usize,
        stamp: i64,
        tolerance: f64,
    ) -> Result<Pose<3>, NoTransform> {
        let (mut pose, mut at) = (Pose::IDENTITY, top);
        let mut first = true;
        while let Some((_, Some(edge))) = climb.get(&at) {
            let edge = &self.edges[*edge];
            let step = match &edge.motion {
                Motion::Static(pose) => *pose,
                Motion::Moving(track) => track.at(stamp, tolerance).map_err(|cause| NoTransform::Time {
                    parent: self.frames[edge.parent].clone(),
                    child: self.frames[edge.child].clone(),
                    cause,
                })?,
            };
            pose = if first { step } else { pose * step };
            first = false;
            at = edge.child;
        }
        Ok(pose)
    }

    /// Frames that are each other's ancestors, in a circle.
    pub(super) fn cycle(&self) -> Option<Vec<String>> {
        // Frames whose parents are all done are done; what remains holds a circle.
        let mut left: Vec<usize> = self.up.iter().map(Vec::len).collect();
        let mut down = vec![Vec::new(); self.frames.len()];
        self.edges.iter().for_each(|e| down[e.parent].push(e.child));
        let mut done: Vec<usize> = (0..self.frames.len()).filter(|f| left[*f] == 0).collect();
        while let Some(frame) = done.pop() {
            for &child in &down[frame] {
                left[child] -= 1;
                if left[child] == 0 {
                    done.push(child);
                }
            }
        }
        let mut at = left.iter().position(|n| *n > 0)?;
        let mut seen = Vec::new();
        // From parent to parent among what remains, until a frame comes again.
        while !seen.contains(&at) {
            seen.push(at);
            let parent = self.up[at].iter().map(|e| self.edges[*e].parent).find(|p| left[*p] > 0);
            at = parent?;
        }
        let start = seen.iter().position(|f| *f == at)?;
        let mut names: Vec<String> = seen[start..].iter().map(|f| self.frames[*f].clone()).collect();
        names.push(self.frames[at].clone());
        names.reverse();
        Some(names)
    }
}
