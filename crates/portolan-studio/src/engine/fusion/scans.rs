//! The scans that are fused: a recorded log from its first to its last, or laps through the Apartment.

use std::sync::Arc;

use portolan::geom::vector::sub;
use portolan::geom::{Aabb, Pose};
use portolan::scan::Scan;
use portolan_chapter::ghost::chair;
use portolan_sim::{Lidar, SEED, World, apartment, lap_poses, scan_at};

use crate::engine::{Logs, Refusal, Source2d};

/// Scans in a lap through the Apartment.
const LAP: usize = 200;
/// Laps through the Apartment that are driven, at most.
const LAPS: usize = 20;

/// Where the chair was put, and when.
#[derive(Clone)]
pub(in crate::engine) struct Move {
    /// Scans that were taken before.
    pub(in crate::engine) scan: usize,
    /// Where the chair was and is.
    pub(in crate::engine) places: [Aabb<2>; 2],
    /// The world until then.
    pub(in crate::engine) before: World,
    /// The world since.
    pub(in crate::engine) world: World,
}

/// Scans in their order; those of the Apartment are made when they are first asked for.
pub(in crate::engine) struct Scans {
    logs: Arc<Logs>,
    driven: Option<Driven>,
}

/// Laps through the Apartment.
struct Driven {
    poses: Vec<Pose<2>>,
    noise: f64,
    first: World,
    moves: Vec<Move>,
    scans: Vec<(Pose<2>, Scan<2>)>,
}

impl Scans {
    pub(super) fn new(logs: &Arc<Logs>, noise: f64) -> Self {
        let driven = matches!(logs.source_2d, Source2d::Apartment).then(|| Driven {
            poses: lap_poses(LAP),
            noise,
            first: apartment().world,
            moves: Vec::new(),
            scans: Vec::new(),
        });
        Self { logs: logs.clone(), driven }
    }

    /// What is shown, for people.
    pub(in crate::engine) fn name(&self) -> &str {
        match &self.logs.source_2d {
            Source2d::Apartment => "the simulated Apartment",
            Source2d::Recorded { name, .. } => name,
        }
    }

    /// Scans in a log, or in a lap.
    pub(in crate::engine) fn lap_length(&self) -> usize {
        match &self.logs.source_2d {
            Source2d::Apartment => LAP,
            Source2d::Recorded { scans, .. } => scans.len(),
        }
    }

    /// Scans that there can be.
    pub(in crate::engine) fn most(&self) -> usize {
        if self.driven.is_some() { LAP * LAPS } else { self.lap_length() }
    }

    /// The scan after `i` others, `i` below [`Scans::most`].
    pub(super) fn scan(&mut self, i: usize) -> &(Pose<2>, Scan<2>) {
        match (&mut self.driven, &self.logs.source_2d) {
            (Some(driven), _) => driven.scan(i),
            (None, Source2d::Recorded { scans, .. }) => &scans[i],
            (None, Source2d::Apartment) => unreachable!("the Apartment is always driven through"),
        }
    }

    /// The first `n` scans, which have been asked for before.
    pub(in crate::engine) fn first(&self, n: usize) -> &[(Pose<2>, Scan<2>)] {
        match (&self.driven, &self.logs.source_2d) {
            (Some(driven), _) => &driven.scans[..n],
            (None, Source2d::Recorded { scans, .. }) => &scans[..n],
            (None, Source2d::Apartment) => &[],
        }
    }

    /// What there is in truth after `scans` scans; `None` for recorded logs.
    pub(in crate::engine) fn world(&self, scans: usize) -> Option<&World> {
        self.driven.as_ref().map(|d| d.world(scans))
    }

    /// The last move before or at `scans` scans.
    pub(in crate::engine) fn last_move(&self, scans: usize) -> Option<&Move> {
        self.driven.as_ref()?.moves.iter().rfind(|m| m.scan <= scans)
    }

    /// All moves: after how many scans, and where the middle of the chair has been since.
    pub(super) fn moves(&self) -> Vec<(usize, [f64; 2])> {
        let moves = self.driven.iter().flat_map(|d| &d.moves);
        moves.map(|m| (m.scan, middle(m.places[1]))).collect()
    }

    /// The move that comes exactly before scan `i`.
    pub(super) fn move_before(&self, i: usize) -> Option<&Move> {
        self.last_move(i).filter(|m| m.scan == i)
    }

    /// Where all positions lie.
    pub(super) fn way(&self) -> Vec<[f64; 2]> {
        match (&self.driven, &self.logs.source_2d) {
            (Some(driven), _) => driven.poses.iter().map(|p| p.translation).collect(),
            (None, Source2d::Recorded { scans, .. }) => scans.iter().map(|s| s.0.translation).collect(),
            (None, Source2d::Apartment) => Vec::new(),
        }
    }

    /// Makes the simulated scans with other noise: those that were taken are taken again.
    pub(super) fn set_noise(&mut self, noise: f64) {
        if let Some(driven) = self.driven.as_mut().filter(|d| d.noise != noise) {
            driven.noise = noise;
            driven.scans.clear();
        }
    }

    /// Moves the middle of the chair there after `scans` scans: whatever came later is forgotten.
    ///
    /// # Errors
    /// Where there is no chair, or no room for it.
    pub(super) fn move_chair(&mut self, scans: usize, to: [f64; 2]) -> Result<(), Refusal> {
        let moved = self.moved_chair(scans, to)?;
        if let Some(driven) = &mut self.driven {
            driven.moves.retain(|m| m.scan < scans);
            driven.moves.push(moved);
            driven.scans.truncate(scans);
        }
        Ok(())
    }

    /// What would become of the world.
    ///
    /// # Errors
    /// As [`Scans::move_chair`].
    pub(super) fn moved_chair(&self, scans: usize, to: [f64; 2]) -> Result<Move, Refusal> {
        let driven =
            self.driven.as_ref().ok_or_else(|| Refusal::new("a recorded log has no chair to move"))?;
        if !to.iter().all(|v| v.is_finite()) {
            return Err(Refusal::new("the chair must be put at a finite place"));
        }
        // A second move at the same scan replaces the first: the chair was never there.
        let before = driven.moves.iter().rfind(|m| m.scan == scans).map(|m| m.before.clone());
        let world = before.unwrap_or_else(|| driven.world(scans).clone());
        let world = &world;
        let old = chair(world);
        let moved = world.with_moved("chair", sub(to, middle(old)));
        let new = chair(&moved);
        let room = world.aabb();
        if !(room.contains(new.min) && room.contains(new.max)) {
            return Err(Refusal::new("the chair must stay in the Apartment"));
        }
        let stands_on = |s: &&portolan_sim::Solid| {
            let b = s.aabb();
            s.name != "chair" && (0..2).all(|k| b.min[k] < new.max[k] && new.min[k] < b.max[k])
        };
        if let Some(solid) = world.solids().iter().find(stands_on) {
            return Err(Refusal::new(format!("there is no room for the chair: {} stands there", solid.name)));
        }
        // The robot drives along its path whatever stands there, and must not drive through the chair.
        if driven.poses.iter().any(|p| new.grown(0.25).contains(p.translation)) {
            return Err(Refusal::new("the chair would stand in the robot's way"));
        }
        Ok(Move { scan: scans, places: [old, new], before: world.clone(), world: moved })
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let beams = self.driven.iter().flat_map(|d| &d.scans).map(|s| s.1.len()).sum::<usize>();
        beams * size_of::<portolan::scan::Beam<2>>()
    }
}

impl Driven {
    fn world(&self, scans: usize) -> &World {
        self.moves.iter().rfind(|m| m.scan <= scans).map_or(&self.first, |m| &m.world)
    }

    fn scan(&mut self, i: usize) -> &(Pose<2>, Scan<2>) {
        let lidar = Lidar { noise: self.noise, ..Lidar::default() };
        while self.scans.len() <= i {
            let k = self.scans.len();
            let pose = self.poses[k % self.poses.len()];
            let scan = scan_at(self.world(k), &pose, &lidar, SEED, k as u64).at_time(k as f64);
            self.scans.push((pose, scan));
        }
        &self.scans[i]
    }
}

fn middle(b: Aabb<2>) -> [f64; 2] {
    [0, 1].map(|k| 0.5 * (b.min[k] + b.max[k]))
}
