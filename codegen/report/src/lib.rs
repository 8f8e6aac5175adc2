//! One self-contained HTML file about one spec: what it promises, and the figures that show it. Plots of what was identified
//! and tuned.
//!
//! ```text
//! compiled + emitted controller → one module a figure → Section (texts, tables, charts as data) → page (HTML, CSS, script)
//! identified records, searches  → charts ─→ plot (SVG)
//! ```
//! A [`chart`] is data: the page's own script draws it, so that it can be zoomed and saved as CSV, and nothing is there twice;
//! what is to be a file of its own, [`plot`] draws.

pub mod chart;
pub mod convergence;
pub mod evidence;
pub mod front;
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
