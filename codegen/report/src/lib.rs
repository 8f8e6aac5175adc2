//! One self-contained HTML file about one spec: what it promises, and the figures that show it; a refused spec, a recorded run
//! and the paper's figures have pages of their own, and so has a machine that is operated. Plots of what was identified and tuned.
//!
//! ```text
//! compiled + verdict            → first (cards) ──┐
//! compiled + emitted controller → one module a section → Section (texts, tables, charts as data) → page (HTML, CSS, script)
//! identified records, searches  → charts ─→ plot (SVG)
//! ```
//! A [`chart`] is data: the page's own script draws it, so that it can be zoomed and saved as CSV, and nothing is there twice;
//! what is to be a file of its own, [`plot`] draws and [`drawing`] writes.
//!
//! Jobs of commands that also draw are here, each with its options, tables and texts: [`sim`], [`replay`], [`robust`], [`tune`],
//! [`identify`], [`reproduce`], [`pages`].

pub mod budget;
pub mod chart;
pub mod drawing;
pub mod evidence;
pub mod first;
pub mod front;
mod grid;
pub mod hysteresis;
pub mod identification;
pub mod identify;
pub mod learning;
pub mod margins;
pub mod page;
pub mod pages;
pub mod panel;
pub mod paper;
pub mod platform;
pub mod plot;
pub mod record;
pub mod replay;
pub mod reproduce;
pub mod reversal_curves;
pub mod robust;
pub mod section;
pub mod sim;
pub mod spectrum;
pub mod tracking;
pub mod tune;
pub mod verdict;
