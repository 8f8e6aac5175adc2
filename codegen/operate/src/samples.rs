//! Samples of a running machine. The device reduces a number of ticks to a row.
//!
//! ```text
//! device: every tick → rows → numbered blocks, which wait in a ring ─ Session::take_blocks, every few ms ─► Vec<Block>
//! ```
//! The device does not wait for the host: it overwrites blocks that are not fetched in time, and gaps in the numbers of the blocks
//! show that. A call takes all complete blocks, or otherwise the complete rows of the current block, so a row is available
//! immediately.

use serde::Serialize;
use specgen_link::client::{ClientError, Port};
use specgen_link::{Reply, Request, samples};
use specgen_runtime::supervisor::Phase;

use crate::Session;
use crate::motion::Motion;
use crate::session::GAUGES;

pub use specgen_link::samples::Spread;

/// Largest number of blocks per call, which limits its duration.
const LOOK: usize = 256;

/// Consecutive ticks of a machine, reduced to one row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// Union of the controller's status words.
    pub status: u32,
    /// Number of `supervisor::Phase` in the last tick.
    pub phase: u8,
    /// Pose measured in the last tick, in the user's coordinates, m and rad; none if a gauge was not read or implausible in any tick.
    pub pose: Option<[f64; 6]>,
    /// Set-point of the last tick, in the user's coordinates, m and rad.
    pub target: [f64; 6],
    /// Set-point minus pose over all ticks, m and rad; none without a pose. It is along the platform's axes, without the rotation of
    /// a work frame.
    pub error: Option<[Spread; 6]>,
    /// Voltage of each leg over all ticks, V.
    pub volts: [Spread; 6],
    /// Displacement of each leg from rest, m, at the mean of the poses measured; none without a pose, or while the law runs: its
    /// set-point moves within a row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub legs: Option<[f64; 6]>,
}

/// Consecutive rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Block {
    /// Number of the block in the stream, from 0; a missing number is a lost block.
    pub number: u32,
    /// First tick of the first row.
    pub tick: u64,
    /// Ticks per row: the requested number, or fewer in a block of one row before a gap.
    pub every: u32,
    /// The rows.
    pub rows: Vec<Row>,
}

impl Block {
    /// The tick after its last one.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.tick.saturating_add(u64::from(self.every) * self.rows.len() as u64)
    }
}

impl<P: Port> Session<P> {
    /// Starts a stream of samples from the next tick, in rows of `every` ticks; 0 ends it. Waiting blocks are discarded, and numbers
    /// restart at 0. Each session has its own stream, which ends with it.
    ///
    /// # Errors
    /// `Refused` with [`Refusal::Rate`](specgen_link::Refusal::Rate), which has the smallest `every` for the bandwidth of the line, or
    /// with `Unsupported` by six legs without a platform. Otherwise as [`Client::ask`](specgen_link::client::Client::ask).
    pub fn stream(&mut self, every: u32) -> Result<(), ClientError> {
        self.done(&Request::Stream { every })
    }

    /// Takes the blocks since the last call, oldest first; none without a stream. It sends at least one request, which keeps the
    /// link alive.
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
        let mean: [f64; 6] = std::array::from_fn(|axis| f64::from(target[axis]) - f64::from(error[axis].mean));
        let legs = motion
            .filter(|_| is_measured && u64::from(phase) != Phase::Running.word())
            .map(|motion| motion.displacements(&mean));
        Self {
            status,
            phase,
            pose: is_measured.then(|| user(pose)),
            target: user(target),
            error: is_measured.then_some(error),
            volts,
            legs,
        }
    }
}
