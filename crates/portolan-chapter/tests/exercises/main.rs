//! The text's seven exercises: what `docs/EXERCISES.md` claims, computed, and the page held to it.

#![allow(clippy::unwrap_used, reason = "helpers of tests are tests too")]

mod exercise_1;
mod exercise_2;
mod exercise_3;
mod exercise_4;
mod exercise_5;
mod exercise_6;
mod exercise_7;
mod page;
