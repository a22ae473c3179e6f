//! 2-D and 3-D: which options are for which, and what was given on the command line.

use std::marker::PhantomData;

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};

use crate::error::bad_call;

/// The dimension of a log, a map or a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Dimension {
    /// Scans of a laser in its plane, maps over x and y.
    #[default]
    Two,
    /// Depth images and clouds, maps over x, y and z.
    Three,
}

/// Headings of help pages: an option under one of them is refused where the log or map is of the other dimension.
pub(crate) const ONLY_2D: &str = "Only for 2-D";
/// See [`ONLY_2D`].
pub(crate) const ONLY_3D: &str = "Only for 3-D";

impl Dimension {
    /// 2-D or 3-D.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Two => "2-D",
            Self::Three => "3-D",
        }
    }

    /// The heading of options that this dimension has no use for.
    fn heading_of_other(self) -> &'static str {
        match self {
            Self::Two => ONLY_3D,
            Self::Three => ONLY_2D,
        }
    }

    /// Ids of the arguments that this dimension has no use for.
    pub(crate) fn foreign<A: Args>(self) -> Vec<String> {
        let command = A::augment_args(Command::new(""));
        let foreign =
            command.get_arguments().filter(|a| a.get_help_heading() == Some(self.heading_of_other()));
        foreign.map(|a| a.get_id().to_string()).collect()
    }

    /// Refuses options that were given and that this dimension has no use for. `what` is the log or the map.
    pub(crate) fn check<A: Args, T>(self, given: &Given<T>, what: &str) -> anyhow::Result<()> {
        match self.foreign::<A>().iter().find(|id| given.has(id)) {
            Some(id) => Err(self.refused(&option::<A>(id), what)),
            None => Ok(()),
        }
    }

    /// The refusal of an option that is for the other dimension.
    pub(crate) fn refused(self, option: &str, what: &str) -> anyhow::Error {
        let other = if self == Self::Two { Self::Three } else { Self::Two };
        bad_call(format!("{option} is only for {}; {what} is {}", other.word(), self.word()))
    }
}

/// The option of an argument as it is written on the command line.
pub(crate) fn option<A: Args>(id: &str) -> String {
    let command = A::augment_args(Command::new(""));
    let long = command.get_arguments().find(|a| a.get_id() == id).and_then(clap::Arg::get_long);
    format!("--{}", long.unwrap_or(id))
}

/// What was given on the command line, of arguments `T` that change values from elsewhere: of a saved map, or defaults.
#[derive(Clone, Debug)]
pub(crate) struct Given<T> {
    matches: ArgMatches,
    of: PhantomData<T>,
}

impl<T> Given<T> {
    /// Whether any of these arguments was given.
    pub(crate) fn has_any<A: Args>(&self) -> bool {
        A::augment_args(Command::new("")).get_arguments().any(|a| self.has(a.get_id().as_str()))
    }

    /// Whether an argument was given, and is not a default.
    pub(crate) fn has(&self, id: &str) -> bool {
        self.matches.try_contains_id(id).unwrap_or(false)
            && self.matches.value_source(id) == Some(ValueSource::CommandLine)
    }
}

impl<T: Args> Given<T> {
    /// The values with what was given in place of theirs.
    pub(crate) fn over(&self, mut values: T) -> anyhow::Result<T> {
        let mut given = self.matches.clone();
        for argument in T::augment_args(Command::new("")).get_arguments() {
            // A flag that was not given has a value, too.
            if !self.has(argument.get_id().as_str()) {
                given.try_clear_id(argument.get_id().as_str())?;
            }
        }
        values.update_from_arg_matches(&given)?;
        Ok(values)
    }
}

impl<T> FromArgMatches for Given<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self { matches: matches.clone(), of: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.matches = matches.clone();
        Ok(())
    }
}

impl<T: Args> Args for Given<T> {
    fn augment_args(command: Command) -> Command {
        T::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        T::augment_args_for_update(command)
    }
}
