//! How a setting of the page is read.

use super::Refusal;

/// A setting of the page, where it is in its range.
///
/// # Errors
/// Names the setting, its range and its value.
pub(super) fn within(name: &str, value: f64, low: f64, high: f64) -> Result<f64, Refusal> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Refusal::new(format!("{name} must be from {low} to {high}, and is {value}")))
}
