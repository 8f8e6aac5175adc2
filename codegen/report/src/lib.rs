//! Self-contained HTML page about a spec: its guarantees and the figures behind them. A refused spec, a recorded run
//! and the paper's figures have separate pages, as has a machine in operation. Also plots of identification and tuning.
//!
//! ```text
//! compiled + verdict            → first (cards) ──┐
//! compiled + emitted controller → one module per section → Section (texts, tables, charts as data) → page (HTML, CSS, script)
//! identified records, searches  → charts ─→ plot (SVG)
//! ```
//! A [`chart`] is data that the page's script draws, so it can be zoomed and saved as CSV without duplication;
//! separate picture files are drawn by [`plot`] and written by [`drawing`].
//!
//! Commands that draw are implemented here, each with its options, tables and texts: [`sim`], [`replay`], [`robust`], [`tune`],
//! [`identify`], [`reproduce`], [`pages`].

pub mod arrays;
pub mod budget;
pub mod chart;
pub mod commission;
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
