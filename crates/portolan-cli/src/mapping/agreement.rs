//! Whether scans agree with each other: what they hit in space that earlier ones saw free.

use portolan::Answer;
use portolan::geom::Pose;
use portolan::scan::Frame;
use portolan_io::scan_log::ScanLogKind;
use serde_json::{Value, json};

use crate::log::Log;

/// Hits of each scan that are looked at, evenly among all.
const HITS: usize = 256;
/// So many cells away free space has to be seen on all sides of a hit.
const AROUND: f64 = 2.0;
/// Fewer hits say nothing.
const ENOUGH: u64 = 200;
/// A larger share of them in free space means that poses, frame or units are wrong. Right ones leave a thousandth, and some percent
/// where much moves.
const MOST: f64 = 0.02;

/// Hits of scans in space that earlier scans had seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Agreement {
    /// In cells that were seen.
    seen: u64,
    /// Of these, in free space (a truncation from the next surface at least, where there are distances), on all sides of which
    /// [`AROUND`] cells away is free, too: a ray that grazes a surface passes through cells that hold it, and not through those behind.
    in_free_space: u64,
}

impl Agreement {
    /// Looks at some hits of a scan that is to be fused. `is_free`: whether a place was seen free up to now; `None`: not seen.
    pub(super) fn look(
        &mut self,
        pose: &Pose<3>,
        frame: &Frame,
        resolution: f64,
        is_free: impl Fn([f64; 3]) -> Option<bool>,
    ) {
        for hit in hits(frame).into_iter().map(|p| pose.transform_point(p)) {
            let Some(free) = is_free(hit) else { continue };
            self.seen += 1;
            let beside = |side: usize| {
                let mut p = hit;
                p[side / 2] += AROUND * resolution * [1.0, -1.0][side % 2];
                p
            };
            let all_around = || (0..6).all(|side| is_free(beside(side)) == Some(true));
            self.in_free_space += u64::from(free && all_around());
        }
    }

    /// Whether a place is free, by its signed distance, where the maps have any, else by its occupancy.
    pub(super) fn is_free(distance: Option<Answer<f64>>, occupancy: Option<Answer<f64>>) -> Option<bool> {
        match (distance, occupancy) {
            (Some(Answer::Saturated(d)), _) => Some(d > 0.0),
            (Some(Answer::Known(_)), _) => Some(false),
            (None, Some(Answer::Known(p))) => Some(p < 0.5),
            _ => None,
        }
    }

    fn share(self) -> f64 {
        self.in_free_space as f64 / self.seen.max(1) as f64
    }

    pub(super) fn to_json(self) -> Value {
        json!({ "hits": self.seen, "in_free_space": self.in_free_space })
    }

    /// What is said where scans contradict each other, with what would mend it in such a log.
    pub(super) fn warning(self, log: &Log) -> Option<String> {
        if self.seen < ENOUGH || self.share() < MOST {
            return None;
        }
        let cure = match log {
            Log::Two(_) => return None,
            Log::Three(log) => match log.kind() {
                ScanLogKind::Kitti => {
                    "poses given with --poses must be the lidar's own; KITTI's are those of its left camera and belong into the \
                     log's folder as poses.txt, where they are used with the Tr of calib.txt"
                }
                ScanLogKind::Clouds | ScanLogKind::Bag | ScanLogKind::Stanford | ScanLogKind::ScanGraph => {
                    "are points and poses in meters, and the poses those of the sensor (--poses, --pose-convention)?"
                }
                _ => {
                    "are the units of depth right (--depth-scale), the camera (--intrinsics), and what the poses mean \
                     (--pose-convention)?"
                }
            },
        };
        Some(format!(
            "{:.0} % of the hits lie in space that earlier scans saw free: scans and poses do not fit together, or much moved; \
             {cure}",
            100.0 * self.share()
        ))
    }
}

/// At most [`HITS`] points of a scan, in the sensor's frame (meters).
fn hits(frame: &Frame) -> Vec<[f64; 3]> {
    match frame {
        Frame::Points(scan) => {
            let step = scan.points.len().div_ceil(HITS).max(1);
            scan.points.iter().step_by(step).map(|p| p.map(f64::from)).collect()
        }
        Frame::Image(image) => {
            let step = image.values.len().div_ceil(HITS).max(1);
            let pixels = (0..image.values.len()).step_by(step).filter(|&i| image.values[i] > 0.0);
            let point =
                |i: usize| image.point(i % image.columns, i / image.columns, f64::from(image.values[i]));
            pixels.map(point).collect()
        }
    }
}
