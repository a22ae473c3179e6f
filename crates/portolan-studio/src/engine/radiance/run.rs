//! A fit from its random start to where it stands, through every change of what it learns from.

use portolan_chapter::radiance::{Fit, Line, Measurement, Progress, Report, Scene, Settings};
use serde::Serialize;

use super::ask::{ChannelsChoice, OptimizerChoice};
use super::curve::Curve;
use crate::engine::Refusal;

/// Ways of fitting in a row that a run may have.
const MOST_PHASES: usize = 32;

/// How the fit was made for a while.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Phase {
    pub(super) channels: ChannelsChoice,
    pub(super) optimizer: OptimizerChoice,
    pub(super) steps: u64,
}

/// What was measured from a seed, and the fit to it.
pub(super) struct Run {
    pub(super) seed: u64,
    pub(super) training: Vec<Measurement>,
    pub(super) held_out: Vec<Measurement>,
    pub(super) fit: Fit,
    pub(super) phases: Vec<Phase>,
    pub(super) curve: Curve,
    /// The field at the beginning of the last phase.
    from: Line,
}

impl Run {
    /// The random start of a seed, and no step made.
    pub(super) fn new(
        scene: &Scene,
        seed: u64,
        channels: ChannelsChoice,
        optimizer: OptimizerChoice,
    ) -> Result<Self, Refusal> {
        let settings = settings(channels, optimizer);
        let (training, held_out) = scene.measure(&settings.noise, seed);
        let from = scene.random_start(seed);
        let fit = Fit::new(from.clone(), &training, settings).map_err(Refusal::new)?;
        let phases = vec![Phase { channels, optimizer, steps: 0 }];
        Ok(Self { seed, training, held_out, fit, phases, curve: Curve::new(), from })
    }

    /// Goes on from the field as it stands, as [`portolan_chapter::radiance::Experiment::run_from`] does.
    pub(super) fn go_on(
        &mut self,
        channels: ChannelsChoice,
        optimizer: OptimizerChoice,
    ) -> Result<(), Refusal> {
        let idle = self.phases.last().is_some_and(|p| p.steps == 0);
        if !idle && self.phases.len() >= MOST_PHASES {
            return Err(Refusal::new(format!("this run was changed {MOST_PHASES} times; start it again")));
        }
        let from = if idle { self.from.clone() } else { self.fit.line().clone() };
        let fit = Fit::new(from.clone(), &self.training, settings(channels, optimizer));
        let fit = fit.map_err(Refusal::new)?;
        if idle {
            // No step was made in that way: as if it had not been chosen.
            self.phases.pop();
        } else {
            let (step, progress) = (self.steps(), self.progress());
            self.curve.end(step, progress);
        }
        (self.fit, self.from) = (fit, from);
        self.phases.push(Phase { channels, optimizer, steps: 0 });
        Ok(())
    }

    /// Makes steps.
    pub(super) fn step(&mut self, steps: usize) {
        let before = self.steps();
        for step in (before..).take(steps) {
            if self.curve.wants(step) {
                let held_out = self.fit.residuals(&self.held_out);
                let Report { objective, training } = self.fit.step();
                self.curve.add(step, Progress { objective, training, held_out });
            } else {
                self.fit.step();
            }
        }
        if let Some(phase) = self.phases.last_mut() {
            phase.steps += steps as u64;
        }
    }

    /// Steps made in all phases.
    pub(super) fn steps(&self) -> u64 {
        self.phases.iter().map(|p| p.steps).sum()
    }

    /// Where the fit stands.
    pub(super) fn progress(&mut self) -> Progress {
        let Report { objective, training } = self.fit.report();
        Progress { objective, training, held_out: self.fit.residuals(&self.held_out) }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.fit.memory_bytes() + self.curve.memory_bytes()
    }
}

fn settings(channels: ChannelsChoice, optimizer: OptimizerChoice) -> Settings {
    Settings { channels: channels.into(), optimizer: optimizer.into(), ..Settings::default() }
}

#[cfg(test)]
mod tests {
    use portolan_chapter::radiance::{Channels, Experiment, Optimizer, PARKED};

    use super::*;

    fn experiment(steps: usize, optimizer: Optimizer) -> Experiment {
        let settings = Settings { optimizer, ..Settings::default() };
        Experiment { steps, settings, ..Experiment::default() }
    }

    /// Field and residuals are those of the library, bit for bit, through a change of channels.
    #[test]
    fn a_run_is_the_librarys_experiment() {
        use {ChannelsChoice as C, OptimizerChoice as O};
        let scene = Scene::corridor();
        for (optimizer, rate) in
            [(O::Descent, Settings::default().optimizer), (O::Adam, Optimizer::adam(0.02))]
        {
            let mut run = Run::new(&scene, PARKED.seed, C::Depth, optimizer).unwrap();
            run.step(1);
            run.step(150);
            run.step(49);
            let first = experiment(200, rate).run(PARKED.seed, Channels::Depth).unwrap();
            assert_eq!(run.fit.line(), first.fit.line());
            assert_eq!(run.progress(), first.last());

            run.go_on(C::Reflectance, O::Descent).unwrap();
            run.step(100);
            let start = first.fit.line().clone();
            let second = experiment(100, Settings::default().optimizer);
            let second = second.run_from(start, PARKED.seed, Channels::DepthReflectance).unwrap();
            assert_eq!(run.fit.line(), second.fit.line());
            assert_eq!(run.progress(), second.last());

            // Every point of the curve, too.
            let (_, values) = run.curve.news();
            let rows: Vec<&[f32]> = values.chunks(8).filter(|r| !r[1].is_nan()).collect();
            let expected = first.curve.iter().chain(&second.curve[..100]);
            assert_eq!(rows.len(), 301);
            for (row, p) in rows.iter().zip(expected) {
                let values = [p.objective, p.training.depth, p.held_out.depth].map(|v| v as f32);
                assert_eq!([row[1], row[2], row[5]], values);
            }
        }
    }

    #[test]
    fn a_way_that_made_no_step_leaves_no_trace() {
        use {ChannelsChoice as C, OptimizerChoice as O};
        let scene = Scene::corridor();
        let mut run = Run::new(&scene, 3, C::Depth, O::Descent).unwrap();
        run.step(20);
        let mut other = Run::new(&scene, 3, C::Spread, O::Adam).unwrap();
        other.go_on(C::Depth, O::Descent).unwrap();
        other.step(20);
        assert_eq!(run.phases, other.phases);
        for channels in [C::Reflectance, C::Spread] {
            run.go_on(channels, O::Adam).unwrap();
        }
        other.go_on(C::Spread, O::Adam).unwrap();
        for run in [&mut run, &mut other] {
            run.step(5);
        }
        assert_eq!((run.fit.line(), &run.phases), (other.fit.line(), &other.phases));
        assert!(
            run.curve.news().1.iter().zip(&other.curve.news().1).all(|(a, b)| a.to_bits() == b.to_bits())
        );
    }

    #[test]
    fn changes_are_counted() {
        use {ChannelsChoice as C, OptimizerChoice as O};
        let mut run = Run::new(&Scene::corridor(), 3, C::Depth, O::Descent).unwrap();
        for _ in 1..MOST_PHASES {
            run.step(1);
            run.go_on(C::Depth, O::Descent).unwrap();
        }
        // An idle phase may still be exchanged.
        run.go_on(C::Spread, O::Descent).unwrap();
        run.step(1);
        let refusal = run.go_on(C::Depth, O::Descent).unwrap_err();
        assert!(refusal.to_string().contains("start it again"));
        assert_eq!(run.steps(), MOST_PHASES as u64);
    }
}
