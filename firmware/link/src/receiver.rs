//! Bytes in, frames out. A zero ends a frame in any case, so that garbage costs at most one frame.

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;

use crate::frame::{self, BODY, Damage, Header};

/// Collects the body of one frame.
pub struct Receiver {
    decoder: DecoderState,
    body: Vec<u8, BODY>,
    overlong: bool,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// Between two frames.
    #[must_use]
    pub const fn new() -> Self {
        Self { decoder: DecoderState::Idle, body: Vec::new(), overlong: false }
    }

    /// Takes a byte. At a zero after other bytes: header and message, or the damage. Zeros between frames are ignored:
    /// a sender may use some to end garbage on the line.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<(Header, &[u8]), Damage>> {
        if matches!(self.decoder, DecoderState::Idle) {
            self.body.clear();
            self.overlong = false;
        }
        let whole = match self.decoder.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(decoded)) => {
                self.overlong |= self.body.push(decoded).is_err();
                return None;
            }
            Ok(DecodeResult::DataComplete) => true,
            // Only at a zero.
            Err(_) => false,
        };
        Some(match (self.overlong, whole) {
            (true, _) => Err(Damage::Overlong),
            (false, true) => frame::open(&self.body),
            (false, false) => Err(Damage::Malformed),
        })
    }
}
