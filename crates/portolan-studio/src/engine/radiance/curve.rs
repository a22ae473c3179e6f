//! How a fit came along, in no more points than a picture can show.

use portolan_chapter::radiance::Progress;

/// Points that are kept at most, but for the few where the run was changed.
const MOST: usize = 1024;

/// States of a fit at equal strides of steps. When there are too many, every second one goes and the stride doubles.
pub(super) struct Curve {
    points: Vec<Point>,
    stride: u64,
    /// Points that the page has.
    sent: usize,
}

/// The fit at a step; `None` where one way of fitting ends and the next begins.
struct Point {
    step: u64,
    progress: Option<Progress>,
    /// Stays at any stride.
    stays: bool,
}

impl Curve {
    pub(super) fn new() -> Self {
        Self { points: Vec::new(), stride: 1, sent: 0 }
    }

    /// Whether the state at a step is one of those that are kept.
    pub(super) fn wants(&self, step: u64) -> bool {
        step.is_multiple_of(self.stride)
    }

    /// Keeps the state at a step.
    pub(super) fn add(&mut self, step: u64, progress: Progress) {
        self.points.push(Point { step, progress: Some(progress), stays: false });
        if self.points.len() > MOST {
            self.stride *= 2;
            let stride = self.stride;
            self.points.retain(|p| p.stays || p.step.is_multiple_of(stride));
            self.sent = 0;
        }
    }

    /// The last state of one way of fitting: what comes after it has another objective.
    pub(super) fn end(&mut self, step: u64, progress: Progress) {
        self.points.push(Point { step, progress: Some(progress), stays: true });
        self.points.push(Point { step, progress: None, stays: true });
    }

    /// The page has nothing of it.
    pub(super) fn resend(&mut self) {
        self.sent = 0;
    }

    /// The number of points that the page has already, and the values of the others, eight each: step, objective,
    /// then depth, reflectance and second moment of the training rays and of the held-out ones.
    pub(super) fn news(&mut self) -> (usize, Vec<f32>) {
        let from = self.sent;
        self.sent = self.points.len();
        let values = self.points[from..].iter().flat_map(|p| {
            let of = |f: fn(&Progress) -> f64| p.progress.as_ref().map_or(f64::NAN, f);
            [
                p.step as f64,
                of(|p| p.objective),
                of(|p| p.training.depth),
                of(|p| p.training.reflectance),
                of(|p| p.training.second_moment),
                of(|p| p.held_out.depth),
                of(|p| p.held_out.reflectance),
                of(|p| p.held_out.second_moment),
            ]
        });
        (from, values.map(|v| v as f32).collect())
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.points.capacity() * size_of::<Point>()
    }
}

#[cfg(test)]
mod tests {
    use portolan_chapter::radiance::Residuals;

    use super::*;

    fn at(step: u64) -> Progress {
        let depth = step as f64;
        let training = Residuals { depth, ..Residuals::default() };
        Progress { objective: 2.0 * depth, training, held_out: Residuals::default() }
    }

    #[test]
    fn long_runs_keep_few_points_at_equal_strides_and_all_ends() {
        let mut curve = Curve::new();
        for step in 0..100_000 {
            if step == 33_333 {
                curve.end(step, at(step));
            }
            if curve.wants(step) {
                curve.add(step, at(step));
            }
        }
        assert!(curve.points.len() <= MOST + 2 && curve.points.len() > MOST / 2);
        assert!(curve.points.windows(2).all(|p| p[0].step <= p[1].step));
        let strides = curve.points.iter().filter(|p| !p.stays).map(|p| p.step % curve.stride);
        assert!(strides.max() == Some(0));
        assert_eq!(curve.points.iter().filter(|p| p.step == 33_333).count(), 2);
    }

    #[test]
    fn the_page_is_told_every_point_once_and_all_again_when_they_were_thinned() {
        let mut curve = Curve::new();
        let mut page: Vec<f32> = Vec::new();
        for step in 0..5_000 {
            if curve.wants(step) {
                curve.add(step, at(step));
            }
            if step % 7 == 0 {
                let (from, news) = curve.news();
                page.truncate(8 * from);
                page.extend(news);
            }
        }
        let (from, news) = curve.news();
        page.truncate(8 * from);
        page.extend(news);
        curve.resend();
        let (from, all) = curve.news();
        assert_eq!((from, all.len()), (0, 8 * curve.points.len()));
        assert_eq!(all, page);
        assert_eq!((all[8], all[9], all[10]), (8.0, 16.0, 8.0));
    }
}
