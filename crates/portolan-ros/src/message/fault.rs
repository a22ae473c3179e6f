//! What is wrong in a message, before the topic is known.

use crate::BagError;

/// A field, its value, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    field: String,
    value: String,
    advice: String,
}

impl Fault {
    pub(crate) fn new(field: impl Into<String>, value: impl ToString, advice: impl Into<String>) -> Self {
        Self { field: field.into(), value: one_line(&value.to_string()), advice: advice.into() }
    }

    /// The same fault of a field of `outer`.
    pub(crate) fn within(mut self, outer: &str) -> Self {
        self.field = format!("{outer}.{}", self.field);
        self
    }

    /// As the error of a topic, or of a type.
    pub(crate) fn of(self, topic: &str) -> BagError {
        let Self { field, value, advice } = self;
        BagError::Message { topic: one_line(topic), field: one_line(&field), value, advice }
    }
}

/// Text of a file as a word on one line.
pub(crate) fn one_line(text: &str) -> String {
    const LONGEST: usize = 120;
    let mut line: String = text.chars().take(LONGEST).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() {
        line.push_str("...");
    }
    line
}
