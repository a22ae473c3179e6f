//! Transforms in the order of a bag become a tree.

use std::collections::{BTreeMap, BTreeSet};

use portolan::geom::Pose;

use super::track::{TrackBuilder, apart, pose};
use super::tree::{Edge, FrameTree, Motion};
use crate::message::{RawTransform, StampedTransform};
use crate::{BagError, Result};

/// The most frames of a bag: robots have some hundred.
const MOST_FRAMES: usize = 1 << 14;
/// Static transforms nearer than this say the same (meters, entries of the rotation).
const SAME: f64 = 1e-6;

/// Collects transforms.
#[derive(Clone, Debug, Default)]
pub struct FrameTreeBuilder {
    /// By parent and child.
    edges: BTreeMap<(String, String), EdgeBuilder>,
    /// Transforms of a frame in itself, or without a name: the first, and how many.
    unnamed: (u64, String),
    frames: BTreeSet<String>,
    crowded: u64,
}

#[derive(Clone, Debug, Default)]
struct EdgeBuilder {
    moving: TrackBuilder,
    moving_count: u64,
    fixed: Option<Pose<3>>,
    fixed_count: u64,
    fixed_refused: u64,
    /// How far static transforms of this edge are apart at most (m or rad).
    fixed_apart: f64,
    sources: BTreeSet<String>,
}

impl FrameTreeBuilder {
    /// Takes a transform. A static one holds for all time, whenever it comes. `source`: its topic, and who published it where
    /// the bag knows.
    pub fn add(&mut self, transform: &StampedTransform, is_static: bool, source: &str) {
        let (parent, child) = (&transform.header.frame, &transform.child);
        if parent.is_empty() || child.is_empty() || parent == child {
            self.unnamed.0 += 1;
            if self.unnamed.0 == 1 {
                self.unnamed.1 = format!("\"{parent}\" > \"{child}\"");
            }
            return;
        }
        for name in [parent, child] {
            if !self.frames.contains(name) {
                if self.frames.len() >= MOST_FRAMES {
                    self.crowded += 1;
                    return;
                }
                self.frames.insert(name.clone());
            }
        }
        let edge = self.edges.entry((parent.clone(), child.clone())).or_default();
        if !edge.sources.contains(source) && edge.sources.len() < 8 {
            edge.sources.insert(source.to_owned());
        }
        if is_static {
            edge.add_static(&transform.transform);
        } else {
            edge.moving_count += 1;
            edge.moving.add(transform.header.stamp, &transform.transform);
        }
    }

    /// The tree.
    ///
    /// # Errors
    /// [`BagError::Message`] for frames that are each other's ancestors.
    pub fn finish(self) -> Result<FrameTree> {
        let mut notes = Vec::new();
        let frames: Vec<String> = self.frames.into_iter().collect();
        let place = |name: &String| frames.binary_search(name).unwrap_or_default();
        let mut edges = Vec::with_capacity(self.edges.len());
        for ((parent, child), edge) in self.edges {
            edges.extend(edge.finish(
                [place(&parent), place(&child)],
                &format!("{parent} > {child}"),
                &mut notes,
            ));
        }
        if self.unnamed.0 > 0 {
            let (count, first) = self.unnamed;
            notes.push(format!(
                "{count} transforms of a frame in itself or without a name were left out, first {first}"
            ));
        }
        if self.crowded > 0 {
            notes
                .push(format!("{} transforms of more than {MOST_FRAMES} frames were left out", self.crowded));
        }
        let tree = FrameTree::new(frames, edges, notes);
        match tree.cycle() {
            None => Ok(tree),
            Some(cycle) => Err(BagError::Message {
                topic: "the tree of frames".into(),
                field: "a frame's parent".into(),
                value: format!("its own child: {}", cycle.join(" > ")),
                advice: "frames in a circle have no pose; name poses with --pose-topic or --poses".into(),
            }),
        }
    }
}

impl EdgeBuilder {
    fn add_static(&mut self, raw: &RawTransform) {
        self.fixed_count += 1;
        let Some((pose, mended)) = pose(raw) else {
            self.fixed_refused += 1;
            return;
        };
        if mended {
            // Told as that of moving edges, from one place.
            self.moving.count_mended();
        }
        if let Some(before) = &self.fixed {
            let (way, turn) = apart(before, &pose);
            self.fixed_apart = self.fixed_apart.max(way.max(turn));
        }
        self.fixed = Some(pose);
    }

    fn finish(self, ends: [usize; 2], name: &str, notes: &mut Vec<String>) -> Option<Edge> {
        if self.fixed_refused > 0 {
            notes.push(format!(
                "{name}: {} static transforms refused: not finite, or a quaternion of zero",
                self.fixed_refused
            ));
        }
        if self.fixed_apart > SAME {
            notes.push(format!(
                "{name}: static transforms that differ by up to {:.4} (m or rad): the last holds for all time",
                self.fixed_apart
            ));
        }
        let track = self.moving.finish(name);
        notes.extend(track.notes().iter().cloned());
        let motion = match (track.is_empty(), self.fixed) {
            (true, None) => return None,
            (true, Some(pose)) => Motion::Static(pose),
            (false, fixed) => {
                if fixed.is_some() {
                    notes.push(format!(
                        "{name}: it is both static and moving: the moving transforms are taken"
                    ));
                }
                Motion::Moving(Box::new(track))
            }
        };
        if self.sources.len() > 1 {
            let all: Vec<String> = self.sources.iter().cloned().collect();
            notes.push(format!("{name}: several publishers: {}", all.join(", ")));
        }
        let messages = self.moving_count + self.fixed_count;
        Some(Edge { parent: ends[0], child: ends[1], motion, messages })
    }
}
