//! Plants, scenarios and traces around an emitted controller.
//!
//! ```text
//! trajectory ─► closed loop ─► controller (emitted, or any TickController) ─► plant ×6 ─► gauge ─┐
//!                    ▲                                                                           │
//!                    └───────────────────────────── reading ◄────────────────────────────────────┘
//!                    └─► trace (bits) and tracking (metres) ─► tables
//! ```
//! Quantities are in SI units at every public function (m, V, s, Hz) unless a name states another (`_um`, `_nm`). Plant
//! parameter files and records use µm, as measurement files do. Everything is a function of its parameters and a seed:
//! two runs give the same bits.

pub mod closed_loop;
pub mod controller;
pub mod coverage;
pub mod description;
pub mod forc;
pub mod machine;
pub mod noise;
pub mod plant;
pub mod platform;
pub mod record;
pub mod scenario;
pub mod table;
pub mod trace;
pub mod trajectory;
pub mod word;
