//! Linux services for a control loop, without a controller: shared by the real-time target, `specgen plant` and
//! `specgen doctor`.
//!
//! ```text
//! clock        monotonic time, absolute sleeps, what happened to a thread in between
//! scheduling   SCHED_FIFO, locked memory, processor, C-states: asked for, or what is missing in words
//! account      every planned tick is on time, late or skipped, and why
//! histogram    times in fixed memory
//! allocation   an allocator that notices when a real-time thread uses it
//! exchange     shared memory between a controller and the machine that it moves
//! signals      those that are no reason to end
//! ```
//! Linux only. System calls are in `clock`, `scheduling`, `exchange`, `allocation` and `signals`, the only modules with
//! unsafe code.

pub mod account;
pub mod allocation;
pub mod clock;
pub mod exchange;
pub mod histogram;
pub mod scheduling;
pub mod signals;
