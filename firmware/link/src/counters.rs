//! What an endpoint has seen. Every received byte ends in exactly one of these, so that nothing is lost silently.

use serde::{Deserialize, Serialize};

use crate::frame::Damage;

/// Frames by what became of them; counts stand still at their largest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Requests carried out or refused by the device.
    pub executed: u32,
    /// Requests that came again and were only answered again.
    pub repeated: u32,
    /// Frames longer than any can be.
    pub overlong: u32,
    /// Frames that are not what COBS makes, or too short for header and CRC.
    pub malformed: u32,
    /// Frames with another CRC than they carry.
    pub checksum: u32,
    /// Whole frames of another version of the protocol.
    pub version: u32,
    /// Whole frames that are no request.
    pub kind: u32,
    /// Whole frames whose message cannot be read.
    pub message: u32,
    /// Requests of another session, or before any.
    pub session: u32,
    /// Requests out of sequence.
    pub sequence: u32,
}

impl Counters {
    /// Nothing seen.
    pub const NONE: Self = Self {
        executed: 0,
        repeated: 0,
        overlong: 0,
        malformed: 0,
        checksum: 0,
        version: 0,
        kind: 0,
        message: 0,
        session: 0,
        sequence: 0,
    };

    /// Frames that were not believed.
    #[must_use]
    pub fn errors(&self) -> u32 {
        [
            self.overlong,
            self.malformed,
            self.checksum,
            self.version,
            self.kind,
            self.message,
            self.session,
            self.sequence,
        ]
        .into_iter()
        .fold(0, u32::saturating_add)
    }

    pub(crate) fn damaged(&mut self, damage: Damage) {
        count(match damage {
            Damage::Overlong => &mut self.overlong,
            Damage::Malformed => &mut self.malformed,
            Damage::Checksum => &mut self.checksum,
        });
    }
}

/// One more.
pub(crate) fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
