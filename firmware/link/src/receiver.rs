//! Bytes in, frames out. A zero ends a frame whatever was before it, so that garbage costs one frame at most.

use crate::frame::{self, Damage, FRAME, Header};

/// Collects the bytes of one frame.
pub struct Receiver {
    bytes: [u8; FRAME],
    /// Bytes since the last zero, counted no further than the room.
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
        Self { bytes: [0; FRAME], length: 0, overlong: false }
    }

    /// Takes a byte. At the zero after some others: header and message, or why they are none.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<(Header, &[u8]), Damage>> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(slot) => {
                    *slot = byte;
                    self.length += 1;
                }
                None => self.overlong = true,
            }
            return None;
        }
        let (length, overlong) = (self.length, self.overlong);
        (self.length, self.overlong) = (0, false);
        if overlong {
            return Some(Err(Damage::Overlong));
        }
        if length == 0 {
            // Zeros between frames: a sender may put some to end what a line had made up.
            return None;
        }
        Some(self.bytes.get_mut(..length).map_or(Err(Damage::Overlong), frame::decode))
    }
}
