//! Bytes in, frames out. A zero ends a frame in any case, so that garbage costs at most one frame.

use cobs::{DecodeResult, DecoderState};

use crate::frame::{self, BODY, Damage, Header};

/// Collects the body of one frame.
pub struct Receiver {
    decoder: DecoderState,
    body: [u8; BODY],
    /// Bytes of it so far, counted up to the room.
    length: usize,
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
        Self { decoder: DecoderState::Idle, body: [0; BODY], length: 0, overlong: false }
    }

    /// Takes a byte. At a zero after other bytes: header and message, or the damage. Zeros between frames are ignored:
    /// a sender may use some to end garbage on the line.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<(Header, &[u8]), Damage>> {
        let whole = match self.decoder.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(decoded)) => {
                match self.body.get_mut(self.length) {
                    Some(slot) => {
                        *slot = decoded;
                        self.length += 1;
                    }
                    None => self.overlong = true,
                }
                return None;
            }
            Ok(DecodeResult::DataComplete) => true,
            // Only at a zero.
            Err(_) => false,
        };
        let (length, overlong) = (self.length, self.overlong);
        (self.length, self.overlong) = (0, false);
        Some(match self.body.get(..length) {
            Some(body) if whole && !overlong => frame::open(body),
            _ if overlong => Err(Damage::Overlong),
            _ => Err(Damage::Malformed),
        })
    }
}
