//! Samples of a running machine: what it did in every tick, reduced by the device to rows of so many ticks.
//!
//! ```text
//! device: every tick → rows → numbered blocks, which wait in a ring ─ Session::take_blocks, every few ms ─► Vec<Block>
//! ```
//! The device makes blocks at its own pace and waits for nobody: what is not fetched in time is given up, and the numbers of the
//! blocks say so. A look takes the whole blocks that wait, else the rows of the one that is being filled: a row is here as soon as
//! it is whole and asked for.

use serde::Serialize;
use specgen_link::client::{ClientError, Port};
use specgen_link::{Reply, Request, samples};

use crate::Session;
use crate::motion::Motion;
use crate::session::GAUGES;

pub use specgen_link::samples::Spread;

/// Blocks that one look takes at most: the caller has other things to do, too.
const LOOK: usize = 256;

/// Some ticks of a machine, one behind the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// Every bit that the controller's status word had in any of them.
    pub status: u32,
    /// Number of `supervisor::Phase` in the last one.
    pub phase: u8,
    /// Pose measured in the last one, in the user's coordinates, m and rad; none if gauges were not read or not believed in any of them.
    pub pose: Option<[f64; 6]>,
    /// Set-point of the last one, in the user's coordinates, m and rad.
    pub target: [f64; 6],
    /// Set-point less pose over all of them, m and rad, none without a pose; along the platform's own axes, which a work frame of the spec turns.
    pub error: Option<[Spread; 6]>,
    /// Voltage of each leg over all of them, V.
    pub volts: [Spread; 6],
}

/// Rows, one behind the other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    /// Counts the blocks that the device made, from 0 at the beginning of the stream: one that is missing was lost.
    pub number: u32,
    /// First tick of the first row.
    pub tick: u64,
    /// Ticks of each row: those that were asked for, or fewer in a block of one row that a gap ends.
    pub every: u32,
    /// The rows.
    pub rows: Vec<Row>,
}

impl Block {
    /// The tick behind its last one.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.tick.saturating_add(u64::from(self.every) * self.rows.len() as u64)
    }
}

impl<P: Port> Session<P> {
    /// Streams samples from the next tick on, in rows of `every` ticks, 1 or more; 0 ends it. Blocks that wait are given up, and
    /// numbers begin at 0 again. A session that ends takes its stream with it; other sessions have streams of their own.
    ///
    /// # Errors
    /// `Refused` with [`Refusal::Rate`](specgen_link::Refusal::Rate), which has the smallest `every` that the device's line has room
    /// for; with `Unsupported` by six legs without a platform. Else as [`Client::ask`](specgen_link::client::Client::ask).
    pub fn stream(&mut self, every: u32) -> Result<(), ClientError> {
        self.done(&Request::Stream { every })
    }

    /// Takes the blocks that were made since the last call, the oldest first; none without a stream. Keeps the link alive as
    /// [`Session::poll`] does, and asks at least once.
    ///
    /// # Errors
    /// As [`Client::ask`](specgen_link::client::Client::ask).
    pub fn take_blocks(&mut self) -> Result<Vec<Block>, ClientError> {
        let mut blocks = Vec::new();
        for _ in 0..LOOK {
            let (motion, reply) = self.ask_for_samples()?;
            let Reply::Samples { number, tick, every, more, rows } = reply else {
                return Err(ClientError::Unexpected);
            };
            let rows = samples::rows(every, rows.0).ok_or(ClientError::Unexpected)?;
            let rows: Vec<Row> = rows.map(|row| Row::of(&row, motion)).collect();
            if !rows.is_empty() {
                blocks.push(Block { number, tick, every, rows });
            }
            if !more {
                break;
            }
        }
        Ok(blocks)
    }
}

impl Row {
    fn of(row: &samples::Row, motion: Option<&Motion>) -> Self {
        let samples::Row { status, phase, pose, target, error, volts } = *row;
        let user = |pose: [f32; 6]| {
            let pose = pose.map(f64::from);
            motion.and_then(|motion| motion.user(&pose)).unwrap_or(pose)
        };
        let is_measured = status & GAUGES == 0;
        Self {
            status,
            phase,
            pose: is_measured.then(|| user(pose)),
            target: user(target),
            error: is_measured.then_some(error),
            volts,
        }
    }
}
