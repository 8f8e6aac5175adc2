//! Linux services for a control loop, without a controller: shared by the real-time target, `specgen plant` and
//! `specgen doctor`.
//!
//! ```text
//! clock        monotonic time, absolute sleeps, a thread's preemptions and page faults
//! scheduling   SCHED_FIFO, locked memory, processor, C-states; missing privileges as text
//! account      every planned tick is on time, late or skipped, and why
//! histogram    times in fixed memory
//! allocation   an allocator that counts its use by a real-time thread
//! exchange     shared memory between a controller and the machine that it moves
//! signals      SIGINT and SIGTERM as flags
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
