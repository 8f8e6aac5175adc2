#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! The control law, written once, for any platform and in `f32` or `f64`.
//!
//! Start reading at [`platform::step`](mod@platform::step): one control tick of a platform in task space. [`legs`] is the law of six
//! legs with their own gauges. [`supervise`](supervise::supervise) runs either under its supervisor.
//!
//! A law knows a spec by the constants and types of a trait: [`Spec`] for both laws, [`platform::Platform`] and
//! [`legs::SixLegs`] for one of them. An emitted controller implements the trait with constants ([`ConstSpec`] adds the
//! sizes of its memory), and [`controller!`] gives it its public names. The constants are passed by value: a zero-sized
//! type in an emitted controller, a reference in the crate `run-time`, which reads them from the compiled spec.
//!
//! No panic path, no allocation; the rules of `specgen_runtime` apply here, too.

mod controller;
pub mod integrity;
pub mod kinematics;
pub mod legs;
mod machine;
mod memory;
pub mod platform;
pub mod snapshot;
mod spec;
mod stage;
pub mod status;
pub mod supervise;
pub mod words;

pub use machine::{MachineInput, MachineOutput, followed_by, write_machine_output};
pub use memory::LegMemory;
pub use spec::{
    Config, ConfigError, ConstSpec, ControlLaw, Input, InputOf, LEGS, Machine, Reset, Settings, SettingsOf, Spec,
    StateOf, TickOutput,
};
#[doc(hidden)]
pub use specgen_runtime;
pub use stage::Stage;
