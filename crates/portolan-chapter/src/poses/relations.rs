//! Relations: relative poses that people verified by hand, and how well poses agree with them.

use super::PoseErrors;
use portolan::geom::Pose;
use portolan_sim::planar;

/// A verified relative pose between the robot at two times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relation {
    /// When the robot was at the first pose (seconds, in the log's clock).
    pub first_time: f64,
    /// When it was at the second.
    pub second_time: f64,
    /// The second pose in the frame of the first.
    pub first_from_second: Pose<2>,
}

/// A line of a relations file that is not a relation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: a relation is eight finite numbers, `t1 t2 x y z roll pitch yaw`, found {found:?}")]
pub struct RelationError {
    /// Number of the line, from 1.
    pub line: usize,
    /// Its beginning.
    pub found: String,
}

/// Reads the text of a relations file (Kümmerle et al. 2009): `t1 t2 x y z roll pitch yaw` on a line, seconds,
/// meters and radians; `#` starts a comment. `z`, `roll` and `pitch` are left out: the robot drives in the plane.
///
/// # Errors
/// [`RelationError`], the first line that is no relation.
pub fn parse_relations(text: &str) -> Result<Vec<Relation>, RelationError> {
    let mut relations = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            content.split_whitespace().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[first_time, second_time, x, y, _, _, _, yaw]) => {
                relations.push(Relation { first_time, second_time, first_from_second: planar(x, y, yaw) });
            }
            _ => {
                return Err(RelationError { line: k + 1, found: content.chars().take(60).collect() });
            }
        }
    }
    Ok(relations)
}

/// Scores poses `(seconds, world_from_robot)` against relations: of each relation both of whose ends have a pose
/// within `tolerance` seconds, the nearest in time, the error of the pose between them. `count` of the result says how
/// many those were. The measures do not depend on where the world's zero is. O((poses + relations) log poses).
pub fn score_relations(relations: &[Relation], poses: &[(f64, Pose<2>)], tolerance: f64) -> PoseErrors {
    let mut sorted: Vec<_> = poses.iter().filter(|p| p.0.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |time: f64| {
        let next = sorted.partition_point(|p| p.0 < time);
        let around = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| sorted.get(i));
        let nearest = around.min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs()))?;
        ((nearest.0 - time).abs() <= tolerance).then_some(nearest.1)
    };
    PoseErrors::of(relations.iter().filter_map(|r| {
        let first_from_second = at(r.first_time)?.inverse() * at(r.second_time)?;
        Some(r.first_from_second.inverse() * first_from_second)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_are_no_relations_are_refused_with_their_number() {
        let good = "# a comment\n\n1.0 2.0 0.5 0 0 0 0 1.5\n2 3 0 0 0 0 0 0 # and one more\n";
        assert_eq!(parse_relations(good).unwrap().len(), 2);
        for bad in ["1 2 3", "1 2 0 0 0 0 0 NaN", "1 2 0 0 0 0 0 0 0", "a b c d e f g h"] {
            let error = parse_relations(&format!("{good}{bad}\n")).unwrap_err();
            assert_eq!((error.line, error.found.as_str()), (5, bad));
        }
    }

    #[test]
    fn poses_that_agree_score_zero_wherever_the_world_is() {
        let poses: Vec<_> =
            (0..20).map(|k| (f64::from(k), planar(f64::from(k), 0.3, 0.2 * f64::from(k)))).collect();
        let relation = |a: usize, b: usize| Relation {
            first_time: poses[a].0 + 0.01,
            second_time: poses[b].0,
            first_from_second: poses[a].1.inverse() * poses[b].1,
        };
        let mut relations = vec![relation(3, 11), relation(19, 0)];
        relations.push(Relation { first_time: 40.0, ..relations[0] });
        let moved: Vec<_> = poses.iter().rev().map(|p| (p.0, planar(5.0, -7.0, 2.0) * p.1)).collect();
        let score = score_relations(&relations, &moved, 0.05);
        assert_eq!(score.count, 2);
        assert!(score.translation.max < 1e-12 && score.rotation.max < 1e-12);
        assert_eq!(score_relations(&relations, &[], 0.05).count, 0);
    }
}
