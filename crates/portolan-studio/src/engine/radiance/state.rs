//! The run of this tab, and what of it is looked at.

use portolan_chapter::radiance::{PARKED, Scene};

use super::answer;
use super::ask::{Ask, ChannelsChoice, OptimizerChoice};
use super::run::Run;
use super::selection::Selection;
use crate::engine::{Clock, Refusal, Reply};

/// Steps that one question may make: more would keep the page waiting for its picture.
const MOST_STEPS: usize = 2000;
/// Larger seeds are no whole numbers in the page.
const MOST_SEED: u64 = (1 << 53) - 1;

/// The view of radiance.
pub(in crate::engine) struct Radiance {
    clock: Clock,
    scene: Scene,
    run: Option<Run>,
    pub(super) look: Selection,
}

impl Radiance {
    pub(in crate::engine) fn new(clock: &Clock) -> Self {
        Self { clock: clock.clone(), scene: Scene::corridor(), run: None, look: Selection::default() }
    }

    /// Answers.
    pub(in crate::engine) fn ask(&mut self, ask: &Ask) -> Result<Reply, Refusal> {
        match *ask {
            Ask::Open {} => self.frame((0, 0.0), true),
            Ask::Start { seed, channels, optimizer } => {
                if seed > MOST_SEED {
                    return Err(Refusal::new(format!(
                        "seed {seed} is too large; the largest is {MOST_SEED}"
                    )));
                }
                self.run = Some(Run::new(&self.scene, seed, channels, optimizer)?);
                // Another seed has measured something else.
                self.frame((0, 0.0), true)
            }
            Ask::GoOn { channels, optimizer } => {
                self.run()?.go_on(channels, optimizer)?;
                self.frame((0, 0.0), false)
            }
            Ask::Step { steps } => {
                if !(1..=MOST_STEPS).contains(&steps) {
                    return Err(Refusal::new(format!(
                        "{steps} steps at once; 1 to {MOST_STEPS} are possible"
                    )));
                }
                let clock = self.clock.clone();
                let run = self.run()?;
                let ((), seconds) = clock.time(|| run.step(steps));
                self.frame((steps, seconds), false)
            }
            Ask::Look { ray, bin } => {
                let rays = self.scene.training.len() + self.scene.held_out.len();
                if let Some(ray) = ray.filter(|ray| *ray >= rays) {
                    return Err(Refusal::new(format!("there is no ray {ray}; they are 0 to {}", rays - 1)));
                }
                let bins = self.scene.bins;
                if let Some(bin) = bin.filter(|bin| *bin >= bins) {
                    return Err(Refusal::new(format!("there is no bin {bin}; they are 0 to {}", bins - 1)));
                }
                self.look = Selection { ray, bin };
                self.frame((0, 0.0), false)
            }
        }
    }

    /// The run; where none was asked for, the one that gets stuck, which the textbook discusses.
    fn run(&mut self) -> Result<&mut Run, Refusal> {
        if self.run.is_none() {
            let (channels, optimizer) = (ChannelsChoice::Depth, OptimizerChoice::Descent);
            self.run = Some(Run::new(&self.scene, PARKED.seed, channels, optimizer)?);
        }
        self.run.as_mut().ok_or_else(|| Refusal::new("there is no run"))
    }

    fn frame(&mut self, made: (usize, f64), all: bool) -> Result<Reply, Refusal> {
        let look = self.look;
        self.run()?;
        let Some(run) = &mut self.run else { return Err(Refusal::new("there is no run")) };
        let all = all.then(|| answer::scene(&self.scene, run));
        answer::frame(&self.scene, run, look, made, all)
    }

    pub(in crate::engine) fn memory_bytes(&self) -> usize {
        self.run.as_ref().map_or(0, Run::memory_bytes)
    }

    /// Gives the run up.
    pub(in crate::engine) fn forget(&mut self) {
        self.run = None;
    }
}
