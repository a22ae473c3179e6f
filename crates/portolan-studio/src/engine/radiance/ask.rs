//! What the view of radiance can be asked.

use portolan_chapter::radiance::{Channels, Optimizer, Settings};
use serde::{Deserialize, Serialize};

/// A question. All are answered with the fit as it is then (`answer.rs`).
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub(in crate::engine) enum Ask {
    /// What never changes, too: the page has drawn nothing yet.
    Open {},
    /// A new run from a random start.
    Start {
        /// Of noise and start, below 2^53.
        seed: u64,
        /// What is measured along a ray.
        channels: ChannelsChoice,
        /// How steps are made.
        optimizer: OptimizerChoice,
    },
    /// From the field as it stands, but in another way.
    GoOn {
        /// What is measured along a ray.
        channels: ChannelsChoice,
        /// How steps are made.
        optimizer: OptimizerChoice,
    },
    /// Steps of the optimiser.
    Step {
        /// How many, 1 to 2000.
        steps: usize,
    },
    /// Looks at a ray, whose light is sent from now on, and at a bin, whose gradient is.
    Look {
        /// The rays to learn from, then those held out, from 0.
        ray: Option<usize>,
        /// From 0.
        bin: Option<usize>,
    },
}

/// [`Channels`] by name.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum ChannelsChoice {
    /// Depth alone.
    Depth,
    /// Depth and reflectance.
    Reflectance,
    /// Depth, reflectance and the spread of the return.
    Spread,
}

impl From<ChannelsChoice> for Channels {
    fn from(choice: ChannelsChoice) -> Self {
        match choice {
            ChannelsChoice::Depth => Self::Depth,
            ChannelsChoice::Reflectance => Self::DepthReflectance,
            ChannelsChoice::Spread => Self::DepthReflectanceSpread,
        }
    }
}

/// [`Optimizer`] by name, with the rates of the command line.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(in crate::engine) enum OptimizerChoice {
    /// Plain gradient descent: the setting of the named seeds.
    Descent,
    /// Adam, which scales small gradients up.
    Adam,
}

impl From<OptimizerChoice> for Optimizer {
    fn from(choice: OptimizerChoice) -> Self {
        match choice {
            OptimizerChoice::Descent => Settings::default().optimizer,
            OptimizerChoice::Adam => Self::adam(0.02),
        }
    }
}
