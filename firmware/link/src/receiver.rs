//! Bytes in, frames out. A zero ends a frame whatever was before it, so that garbage costs one frame at most.

use cobs::{DecodeResult, DecoderState};

use crate::frame::{self, BODY, Damage, Header};

/// Collects the body of one frame.
pub struct Receiver {
    decoder: DecoderState,
    body: [u8; BODY],
    /// Bytes of it so far, counted no further than the room.
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

    /// Takes a byte. At the zero after some others: header and message, or why they are none. Zeros between frames are
    /// nothing: a sender may put some to end what a line had made up.
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
