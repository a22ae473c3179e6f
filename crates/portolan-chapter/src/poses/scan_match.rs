//! A scan against another: point-to-line ICP.

use super::Outline;
use portolan::geom::Pose;
use portolan::geom::vector::{dot, sub};
use portolan_graph::Information;
use portolan_sim::{heading, planar};

/// How scans are matched, and when a match is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchSettings {
    /// Points further than this from the reference have no partner, in the first iteration (meters).
    pub reach: f64,
    /// The same in the last ones (meters); it shrinks by a fifth each time.
    pub final_reach: f64,
    /// Residuals below this count in full (meters): about the noise.
    pub inlier: f64,
    /// Iterations at most.
    pub iterations: usize,
    /// Partners' normals differ by no more than the angle of this cosine: both faces of a wall are not one.
    pub min_normal_cosine: f64,
    /// Fewer pairs than this are no match.
    pub min_pairs: usize,
    /// Least share of the scan's points with a normal that must end within three times `inlier` of a partner.
    pub min_inlier_share: f64,
    /// Largest root mean square of the inliers' residuals (meters).
    pub max_rms: f64,
    /// Least share of the evidence that the weaker direction must have; a bare corridor has none along itself.
    pub min_balance: f64,
    /// Largest share of either scan's points where the other one saw through.
    pub max_contradicted_share: f64,
    /// A match may not leave the guess by more than this (meters, radians).
    pub max_correction: [f64; 2],
    /// Pairs share beams, normals and the shape of the world: the information of so many of them is that of one.
    pub pairs_per_independent: f64,
}

impl Default for MatchSettings {
    fn default() -> Self {
        Self {
            reach: 0.5,
            final_reach: 0.08,
            inlier: 0.02,
            iterations: 40,
            min_normal_cosine: 0.8,
            min_pairs: 60,
            min_inlier_share: 0.55,
            max_rms: 0.022,
            min_balance: 0.03,
            max_contradicted_share: 0.08,
            max_correction: [0.8, 0.35],
            pairs_per_independent: 2.0,
        }
    }
}

/// A match that is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanMatch {
    /// The pose of the scan's sensor in the frame of the reference's.
    pub reference_from_scan: Pose<2>,
    /// How sure it is, over `[x, y, theta]` in the scan's frame, as pose graphs take it.
    pub information: Information<2>,
    /// Share of the scan's points with a normal that lie on the reference.
    pub inlier_share: f64,
    /// Root mean square of the inliers' residuals (meters).
    pub rms: f64,
    /// Iterations used.
    pub iterations: usize,
}

/// Why a match is not believed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatchRefusal {
    /// Too little of the scans is near each other.
    #[error("{pairs} pairs of points, {needed} are needed")]
    TooFewPairs {
        /// Pairs found.
        pairs: usize,
        /// [`MatchSettings::min_pairs`].
        needed: usize,
    },
    /// Most of the scan does not lie on the reference.
    #[error("only {share:.2} of the scan lies on the reference")]
    TooFewInliers {
        /// Share found.
        share: f64,
    },
    /// The pairs leave a direction free.
    #[error("one direction has {balance:.4} of the evidence: a corridor without an end")]
    Degenerate {
        /// Share of the weaker direction, at most one half.
        balance: f64,
    },
    /// The scans lie on each other, but badly.
    #[error("residuals of {rms:.4} m are larger than the noise")]
    LargeResiduals {
        /// Root mean square (meters).
        rms: f64,
    },
    /// One scan has surfaces where the other one saw free space.
    #[error("a share of {share:.2} of a scan lies where the other one saw through")]
    Contradicted {
        /// The larger share of both.
        share: f64,
    },
    /// The match went away from where it should have been.
    #[error("the match is {metres:.2} m and {radians:.3} rad from the guess")]
    FarFromGuess {
        /// Distance (meters).
        metres: f64,
        /// Turn (radians).
        radians: f64,
    },
    /// Iterations ended before the pose stood still.
    #[error("the iterations did not come to rest")]
    Restless,
}

/// Steps smaller than this end the iterations (meters, radians): partners that change to and fro move the pose by
/// as much, and the noise is ten times larger.
const STILL: f64 = 2e-4;

/// How far behind a point the other scan must have seen for the point to be contradicted (meters).
const SEEN_BEYOND: f64 = 0.2;

/// Matches a scan to a reference by point-to-line ICP (Censi 2008, with partners by nearest point and compatible
/// normals instead of his bound on polar neighbors): pairs are taken within a reach that shrinks, residuals are
/// distances along the reference's normals, weighted by Cauchy's kernel, and the pose moves by Gauss-Newton. O(iterations
/// x points). The result is the same bytes on every machine.
///
/// # Errors
/// [`MatchRefusal`], where the match is not to be trusted.
pub fn match_scans(
    reference: &Outline,
    scan: &Outline,
    guess: &Pose<2>,
    settings: &MatchSettings,
) -> Result<ScanMatch, MatchRefusal> {
    let mut pose = *guess;
    let mut reach = settings.reach;
    for iteration in 1..=settings.iterations {
        let system = System::build(reference, scan, &pose, reach, settings);
        system.check(settings)?;
        let step = system.step();
        pose = stepped(&pose, step);
        let still = step[0].abs().max(step[1].abs()) < STILL && step[2].abs() < STILL;
        if still && reach <= settings.final_reach {
            return judge(reference, scan, (guess, &pose), settings, iteration);
        }
        reach = (0.8 * reach).max(settings.final_reach);
    }
    Err(MatchRefusal::Restless)
}

fn judge(
    reference: &Outline,
    scan: &Outline,
    (guess, pose): (&Pose<2>, &Pose<2>),
    settings: &MatchSettings,
    iterations: usize,
) -> Result<ScanMatch, MatchRefusal> {
    let [metres, radians] = Outline::apart(guess, pose);
    if metres > settings.max_correction[0] || radians > settings.max_correction[1] {
        return Err(MatchRefusal::FarFromGuess { metres, radians });
    }
    let system = System::build(reference, scan, pose, settings.final_reach, settings);
    let inlier_share = system.inliers as f64 / scan.normals().iter().flatten().count().max(1) as f64;
    if inlier_share < settings.min_inlier_share {
        return Err(MatchRefusal::TooFewInliers { share: inlier_share });
    }
    let rms = (system.inlier_sum_sq / system.inliers as f64).sqrt();
    if rms > settings.max_rms {
        return Err(MatchRefusal::LargeResiduals { rms });
    }
    let back = pose.inverse();
    let share = contradicted(reference, scan, pose).max(contradicted(scan, reference, &back));
    if share > settings.max_contradicted_share {
        return Err(MatchRefusal::Contradicted { share });
    }
    // Residuals smaller than half a centimeter are luck.
    let sigma = rms.max(0.005);
    let scale = 1.0 / (sigma * sigma * settings.pairs_per_independent);
    let h = system.hessian;
    let upper = [h[0][0], h[0][1], h[0][2], h[1][1], h[1][2], h[2][2]].map(|v| v * scale);
    let information = Information::from_upper(&upper)
        .map_err(|_| MatchRefusal::Degenerate { balance: system.balance() })?;
    Ok(ScanMatch { reference_from_scan: *pose, information, inlier_share, rms, iterations })
}

/// Share of the scan's points where the reference saw through.
fn contradicted(reference: &Outline, scan: &Outline, reference_from_scan: &Pose<2>) -> f64 {
    let through =
        |p: &&[f64; 2]| reference.sees_through(reference_from_scan.transform_point(**p), SEEN_BEYOND);
    scan.points().iter().filter(through).count() as f64 / scan.points().len().max(1) as f64
}

/// The normal equations of one iteration, for a step `[rho, phi]` on the right of the pose.
struct System {
    hessian: [[f64; 3]; 3],
    gradient: [f64; 3],
    pairs: usize,
    inliers: usize,
    inlier_sum_sq: f64,
    /// Sum over the pairs of the outer products of the normals.
    spread: [f64; 3],
}

impl System {
    fn build(
        reference: &Outline,
        scan: &Outline,
        pose: &Pose<2>,
        reach: f64,
        settings: &MatchSettings,
    ) -> Self {
        let mut system = Self {
            hessian: [[0.0; 3]; 3],
            gradient: [0.0; 3],
            pairs: 0,
            inliers: 0,
            inlier_sum_sq: 0.0,
            spread: [0.0; 3],
        };
        // The kernel is as wide as the pairs are far: at first they all count, in the end those within the noise.
        let width = settings.inlier.max(0.2 * reach);
        for (&p, n) in scan.points().iter().zip(scan.normals()) {
            let Some(own) = n else { continue };
            let q = pose.transform_point(p);
            let Some((partner, _)) = reference.nearest(q, reach) else { continue };
            let Some(normal) = reference.normals()[partner] else { continue };
            if dot(pose.rotate(*own), normal) < settings.min_normal_cosine {
                continue;
            }
            let residual = dot(normal, sub(q, reference.points()[partner]));
            // The normal in the scan's frame; a turn moves the point by its quarter turn.
            let seen = pose.inverse().rotate(normal);
            let row = [seen[0], seen[1], seen[1] * p[0] - seen[0] * p[1]];
            let weight = width * width / (width * width + residual * residual);
            for a in 0..3 {
                for b in 0..3 {
                    system.hessian[a][b] += weight * row[a] * row[b];
                }
                system.gradient[a] += weight * row[a] * residual;
            }
            system.pairs += 1;
            if residual.abs() <= 3.0 * settings.inlier {
                system.inliers += 1;
                system.inlier_sum_sq += residual * residual;
            }
            system.spread[0] += weight * seen[0] * seen[0];
            system.spread[1] += weight * seen[0] * seen[1];
            system.spread[2] += weight * seen[1] * seen[1];
        }
        system
    }

    fn check(&self, settings: &MatchSettings) -> Result<(), MatchRefusal> {
        if self.pairs < settings.min_pairs {
            return Err(MatchRefusal::TooFewPairs { pairs: self.pairs, needed: settings.min_pairs });
        }
        let balance = self.balance();
        if balance.is_nan() || balance < settings.min_balance {
            return Err(MatchRefusal::Degenerate { balance });
        }
        Ok(())
    }

    /// Share of the weaker direction in the normals' spread: 0.5 in a square room, 0 in a corridor.
    fn balance(&self) -> f64 {
        let [xx, xy, yy] = self.spread;
        let root = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        (0.5 * (xx + yy) - root) / (xx + yy)
    }

    /// Gauss-Newton's step, by Cholesky; the checks left no singular system, and a turn is held by distant points.
    fn step(&self) -> [f64; 3] {
        let mut l = [[0.0; 3]; 3];
        let mut y = [0.0; 3];
        for r in 0..3 {
            for c in 0..=r {
                let sum: f64 = (0..c).map(|k| l[r][k] * l[c][k]).sum();
                let rest = self.hessian[r][c] - sum;
                l[r][c] = if r == c { rest.max(1e-9).sqrt() } else { rest / l[c][c] };
            }
            y[r] = (-self.gradient[r] - (0..r).map(|k| l[r][k] * y[k]).sum::<f64>()) / l[r][r];
        }
        let mut x = [0.0; 3];
        for r in (0..3).rev() {
            x[r] = (y[r] - (r + 1..3).map(|k| l[k][r] * x[k]).sum::<f64>()) / l[r][r];
        }
        x
    }
}

/// The pose after a step on its right, exactly rigid.
fn stepped(pose: &Pose<2>, [x, y, phi]: [f64; 3]) -> Pose<2> {
    let moved = *pose * planar(x, y, phi);
    planar(moved.translation[0], moved.translation[1], heading(&moved))
}

#[cfg(test)]
mod tests {
    use super::*;
    use portolan_sim::{Lidar, Random, Solid, SolidKind, World, apartment, lap_poses, scan_at};

    fn scan(world: &World, pose: &Pose<2>, index: u64) -> Outline {
        Outline::of(&scan_at(world, pose, &Lidar::default(), 9, index))
    }

    #[test]
    fn motions_are_found_to_a_centimetre_and_their_errors_are_as_stated() {
        let world = apartment().world;
        let mut random = Random::stream(11, 0);
        let (mut errors, mut turns, mut chi_square, mut refused) = (Vec::new(), Vec::new(), 0.0, 0);
        for (k, pose) in lap_poses(200).iter().enumerate() {
            let u = |r: &mut Random, s: f64| s * (2.0 * r.uniform() - 1.0);
            let truth = planar(u(&mut random, 0.3), u(&mut random, 0.3), u(&mut random, 3.0));
            if world.signed_distance((*pose * truth).translation) < 0.2 {
                continue;
            }
            let (a, b) = (scan(&world, pose, 2 * k as u64), scan(&world, &(*pose * truth), 2 * k as u64 + 1));
            let guess = truth * planar(u(&mut random, 0.2), u(&mut random, 0.2), u(&mut random, 0.12));
            match match_scans(&a, &b, &guess, &MatchSettings::default()) {
                Ok(m) => {
                    let e = truth.inverse() * m.reference_from_scan;
                    let r = [e.translation[0], e.translation[1], heading(&e)];
                    let upper = m.information.upper();
                    let omega = [
                        [upper[0], upper[1], upper[2]],
                        [upper[1], upper[3], upper[4]],
                        [upper[2], upper[4], upper[5]],
                    ];
                    chi_square +=
                        (0..3).map(|i| (0..3).map(|j| r[i] * omega[i][j] * r[j]).sum::<f64>()).sum::<f64>();
                    errors.push(r[0].hypot(r[1]));
                    turns.push(r[2].abs().to_degrees());
                }
                Err(why) => {
                    refused += 1;
                    println!("{k}: {why}");
                }
            }
        }
        let n = errors.len();
        errors.sort_by(f64::total_cmp);
        turns.sort_by(f64::total_cmp);
        println!(
            "{n} matches, {refused} refused: {:.1} mm and {:.2} degrees in the median, {:.1} mm at 95 %, {:.1} at most; \
             chi-square {:.1} a match (3 expected)",
            1e3 * errors[n / 2],
            turns[n / 2],
            1e3 * errors[n * 95 / 100],
            1e3 * errors[n - 1],
            chi_square / n as f64
        );
        assert!(n > 120 && errors[n / 2] < 0.01 && errors[n * 95 / 100] < 0.03);
    }

    #[test]
    fn a_bare_corridor_is_refused() {
        let wall = |y: f64| Solid::rectangle("wall", SolidKind::Wall, [-50.0, y], [50.0, y + 0.3]);
        let world = World::new(vec![wall(-1.0), wall(1.0)]);
        let (a, b) = (scan(&world, &Pose::IDENTITY, 0), scan(&world, &planar(0.3, 0.0, 0.0), 1));
        let refusal = match_scans(&a, &b, &Pose::IDENTITY, &MatchSettings::default());
        assert!(matches!(refusal, Err(MatchRefusal::Degenerate { .. })), "{refusal:?}");
    }

    #[test]
    fn other_rooms_and_empty_scans_are_refused() {
        let world = apartment().world;
        let poses = lap_poses(200);
        let outlines: Vec<_> = poses.iter().enumerate().map(|(k, p)| scan(&world, p, k as u64)).collect();
        let (mut tried, mut believed) = (0, 0);
        for i in (0..200).step_by(9) {
            for j in (0..200).step_by(11) {
                if poses[i].translation_to(&poses[j]) > 2.5 {
                    tried += 1;
                    let guess = planar(0.0, 0.0, 0.0);
                    believed += i32::from(
                        match_scans(&outlines[i], &outlines[j], &guess, &Default::default()).is_ok(),
                    );
                }
            }
        }
        println!("{believed} of {tried} matches of different places believed");
        assert!(f64::from(believed) <= 0.01 * f64::from(tried));
        let nothing = Outline::of(&portolan::scan::Scan::from_beams([]));
        for (a, b) in [(&nothing, &outlines[0]), (&outlines[0], &nothing)] {
            let refusal = match_scans(a, b, &Pose::IDENTITY, &MatchSettings::default());
            assert!(matches!(refusal, Err(MatchRefusal::TooFewPairs { pairs: 0, .. })));
        }
    }
}
