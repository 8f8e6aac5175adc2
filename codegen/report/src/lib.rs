//! One self-contained HTML file about one spec: what it promises, and the figures that show it.
//!
//! ```text
//! compiled + emitted controller → one module a figure → Section (texts, tables, charts as data) → page (HTML, CSS, script)
//! ```
//! A chart is data: the page's own script draws it, so that it can be zoomed and saved as CSV, and nothing is there twice.

pub mod chart;
pub mod convergence;
pub mod evidence;
pub mod hysteresis;
pub mod identification;
pub mod legs;
pub mod linear;
pub mod machining;
pub mod motion;
pub mod noise;
pub mod page;
pub mod plot;
pub mod region;
pub mod section;
pub mod spectrum;
pub mod view;
