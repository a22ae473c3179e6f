//! The time, by the caller's clock.

use std::sync::Arc;

/// Seconds since some moment: the engine reads no clock of its own.
#[derive(Clone)]
pub struct Clock(Arc<dyn Fn() -> f64 + Send + Sync>);

impl Clock {
    /// A clock that asks `seconds`.
    pub fn new(seconds: impl Fn() -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(seconds))
    }

    /// Seconds since its beginning.
    pub fn now(&self) -> f64 {
        (self.0)()
    }

    /// What `work` gives, and the seconds that it took.
    pub fn time<T>(&self, work: impl FnOnce() -> T) -> (T, f64) {
        let start = self.now();
        let made = work();
        (made, self.now() - start)
    }
}
