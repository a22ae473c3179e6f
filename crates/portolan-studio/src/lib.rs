//! The studio: a local web app in which every map runs its filter before one's eyes.
//!
//! Two halves that meet in one message format. [`engine`] answers messages about maps; it knows neither sockets nor
//! files nor clocks, so that the same page can one day talk to it inside the browser. [`server`] gives a browser the
//! page and each of its tabs an engine of its own.
//!
//! Nothing of a filter is written in JavaScript: the page draws what the engine computed with the library.

pub mod engine;
pub mod server;
