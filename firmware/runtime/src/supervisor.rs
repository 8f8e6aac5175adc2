//! The supervisor: phase of the machine, its cause, and the codes while the law does not run.
//!
//! ```text
//!             arm              time and wiring, all good          run
//! disarmed ────────► arming ───────────────────────────► holding ◄────► running
//!     ▲                 │                                   │   hold       │
//!     │   codes at rest │ ramp down, or a cause             │              │
//!     ├─────────────────┴──── ramping down ◄────────────────┴──────────────┘
//!     │ acknowledge               │ for a cause
//!     └───────── faulted ◄────────┘            a cause that takes the amplifiers off at once: from any phase to faulted
//! ```
//! From *holding* the request *drive* leads to *driving*, the open drive: the host commands voltages, and the law is
//! suspended. It ends in *holding* or *ramping down*.
//!
//! The law runs in *running*, and until a stop of the platform completes. Otherwise codes are constant or ramp to
//! rest by whole codes, never faster than the slew limit: no reading and no request can cause a jump. While arming,
//! each leg makes one small pulse.
//! `docs/supervisor.md` has the table of causes.
//!
//! | module | what |
//! |---|---|
//! | `kinds` | phases, requests, causes, event bits |
//! | `supervision` | what the spec fixes |
//! | `debounce` | for how long a condition must last before it is a cause |
//! | `watch` | gauges against the model: stuck, disagreeing; tracking errors |
//! | `phases` | the state machine |
//! | `sift` | samples that leap are replaced, those that repeat are counted |
//! | `wiring` | the check that arming ends with: each leg in turn, against the Jacobian |
//! | `oscillation` | sustained oscillation of the error, and the stages that the law falls back to |
//! | `approach` | six legs: set-points from the measured displacement to the requested one |

mod approach;
mod debounce;
mod kinds;
mod oscillation;
mod phases;
mod sift;
mod supervision;
mod watch;
mod wiring;

pub use approach::Approach;
pub use debounce::{Debounce, WRONG};
pub use kinds::{
    AMPLIFIER, CONVERTER, Cause, EVENTS, FIRST_EVENT, HOLDS, INTEGRITY, LINK_LOST, MISSED_TICK, OF_GAUGES, Phase,
    RAMPS_DOWN, Reaction, Request, STALLED, STOP, SWITCHES_OFF,
};
pub use oscillation::{Fallback, Motion, Oscillation, Steadiness};
pub use phases::Supervisor;
pub use sift::{Activity, SAMPLE_REPEATED, SAMPLE_REPLACED, Sift};
pub use supervision::{Supervision, TIMED, TIMERS};
pub use watch::{Channel, Sample, Watch};
pub use wiring::{Check, Fault, Finding, FindingText, Response, Wiring, explains, with};

/// `code` moved towards `goal` by at most `step` (≥ 0) codes.
#[inline]
#[must_use]
pub fn toward(code: i32, goal: i32, step: i32) -> i32 {
    let (up, down) = (code.saturating_add(step), code.saturating_sub(step));
    if goal > up {
        up
    } else if goal < down {
        down
    } else {
        goal
    }
}
