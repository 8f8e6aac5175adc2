//! Counters of an endpoint. Every received byte is counted in exactly one of them, so that no loss is silent.

use serde::{Deserialize, Serialize};

use crate::frame::Damage;

/// Frames by outcome; counters saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Requests carried out or refused by the device.
    pub executed: u32,
    /// Repeated requests, which were only answered again.
    pub repeated: u32,
    /// Frames longer than the longest valid one.
    pub overlong: u32,
    /// Frames that are not valid COBS, or too short for header and CRC.
    pub malformed: u32,
    /// Frames whose CRC is wrong.
    pub checksum: u32,
    /// Valid frames of another version of the protocol.
    pub version: u32,
    /// Valid frames that are not requests.
    pub kind: u32,
    /// Valid frames with an unreadable message.
    pub message: u32,
    /// Requests of another session, or before the first.
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

    /// Invalid frames.
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
