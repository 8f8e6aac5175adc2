//! Splits the bytes of a client into commands: lines that end in LF, and single bytes. Stops overtake other commands.

use std::collections::VecDeque;

/// Longest line; six axes with all digits need much less.
const LONGEST: usize = 512;
/// Largest size of queued commands, bytes with [`PIECE`] for each. Further commands are dropped, so that a stop behind them is
/// found.
const ROOM: usize = 1 << 22;
/// Size of a command in addition to its letters, bytes.
const PIECE: usize = 32;
/// Moves that are skipped in one call.
const SKIPPED: usize = 1 << 10;
/// Bytes that are commands by themselves: position, status, motion, ready, macros, wave generator, stop.
const SINGLE: [u8; 7] = [3, 4, 5, 7, 8, 9, STOP];
/// Stops all axes.
pub(super) const STOP: u8 = 24;

/// One command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Piece {
    /// A single-byte command.
    Single(u8),
    /// A line without its end; never empty.
    Line(String),
    /// A line that was too long, or commands that were dropped.
    TooLong,
}

impl Piece {
    fn words(&self) -> std::str::SplitWhitespace<'_> {
        match self {
            Self::Line(line) => line.split_whitespace(),
            Self::Single(_) | Self::TooLong => "".split_whitespace(),
        }
    }

    /// Whether its client must be in control: it causes or enables motion.
    pub(super) fn needs_control(&self) -> bool {
        self.is_move() || matches!(self.words().next(), Some("SVO" | "FRF" | "SPI" | "VEL" | "VLS"))
    }

    /// Whether it stops the platform; every client may do that.
    pub(super) fn is_stop(&self) -> bool {
        *self == Self::Single(STOP) || matches!(self.words().next(), Some("STP" | "HLT"))
    }

    /// Whether it switches the servo off.
    pub(super) fn is_off(&self) -> bool {
        let is_zero = |word: &str| word.parse() == Ok(0.0);
        let states = || self.words().skip(2).step_by(2);
        self.words().next() == Some("SVO") && states().next().is_some() && states().all(is_zero)
    }

    /// Whether it leads to a motion, so that a stop discards it.
    fn is_move(&self) -> bool {
        matches!(self.words().next(), Some("MOV" | "MVR")) || self.words().next() == Some("SVO") && !self.is_off()
    }

    fn size(&self) -> usize {
        PIECE + if let Self::Line(line) = self { line.len() } else { 0 }
    }
}

/// Received commands of a client that were not executed yet.
#[derive(Debug, Default)]
pub(super) struct Input {
    line: Vec<u8>,
    /// Skipping to the end of a line that is too long.
    skips: bool,
    /// The line began before a stop of another client.
    is_late: bool,
    /// The last stop and the last servo-off command; they come first.
    stops: Vec<Piece>,
    pieces: VecDeque<Piece>,
    /// Number of pieces at the front that were sent before a stop; moves among them are discarded in turn.
    before_stop: usize,
    /// A move was discarded.
    has_dropped: bool,
    /// Size of the pieces, as for [`ROOM`].
    size: usize,
}

impl Input {
    /// Adds bytes. Returns whether they contain a stop, or a servo-off command of a client that `may_control`. That command then
    /// comes first, and moves that were sent before it are discarded.
    pub(super) fn push(&mut self, bytes: &[u8], may_control: bool) -> bool {
        let mut stops = false;
        for byte in bytes {
            match *byte {
                b'\n' => stops |= self.end_line(may_control),
                b'\r' => {}
                STOP => {
                    self.line.clear();
                    self.skips = false;
                    stops |= self.add(Piece::Single(STOP), may_control);
                }
                byte if SINGLE.contains(&byte) => stops |= self.add(Piece::Single(byte), may_control),
                byte if self.line.len() < LONGEST => self.line.push(byte),
                _ => self.skips = true,
            }
        }
        stops
    }

    fn end_line(&mut self, may_control: bool) -> bool {
        let text = String::from_utf8_lossy(&self.line).trim().to_owned();
        self.line.clear();
        let is_late = std::mem::take(&mut self.is_late);
        let piece = if std::mem::take(&mut self.skips) { Piece::TooLong } else { Piece::Line(text) };
        let is_dropped = is_late && piece.is_move();
        self.has_dropped |= is_dropped;
        if is_dropped || piece == Piece::Line(String::new()) {
            return false;
        }
        self.add(piece, may_control)
    }

    fn add(&mut self, piece: Piece, may_control: bool) -> bool {
        if piece.is_stop() || may_control && piece.is_off() {
            self.drop_moves();
            self.stops.retain(|before| before.is_stop() != piece.is_stop());
            self.stops.insert(0, piece);
            return true;
        }
        if self.size < ROOM {
            self.size += piece.size();
            self.pieces.push_back(piece);
        } else if let Some(last) = self.pieces.back_mut() {
            self.size -= last.size() - PIECE;
            *last = Piece::TooLong;
        }
        false
    }

    /// Discards moves, including the incomplete line. It takes constant time: see [`Input::skip`].
    pub(super) fn drop_moves(&mut self) {
        self.before_stop = self.pieces.len();
        self.is_late = !self.line.is_empty();
    }

    /// Skips discarded moves, a limited number per call. Returns whether the next command may be executed.
    pub(super) fn skip(&mut self) -> bool {
        for _ in 0..SKIPPED {
            let is_dropped = self.stops.is_empty() && self.before_stop > 0 && self.first().is_some_and(Piece::is_move);
            if !is_dropped {
                return true;
            }
            self.done();
            self.has_dropped = true;
        }
        false
    }

    /// Whether a stop or a servo-off command is waiting.
    pub(super) fn has_stop(&self) -> bool {
        !self.stops.is_empty()
    }

    /// Whether a move was discarded since the last call.
    pub(super) fn has_dropped(&mut self) -> bool {
        std::mem::take(&mut self.has_dropped)
    }

    /// The next command.
    pub(super) fn first(&self) -> Option<&Piece> {
        self.stops.first().or(self.pieces.front())
    }

    /// Removes the next command.
    pub(super) fn done(&mut self) {
        if !self.stops.is_empty() {
            self.stops.remove(0);
        } else if let Some(piece) = self.pieces.pop_front() {
            self.size -= piece.size();
            self.before_stop = self.before_stop.saturating_sub(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(input: &mut Input) -> Option<Piece> {
        while !input.skip() {}
        input.first().cloned()
    }

    fn all(mut input: Input) -> Vec<Piece> {
        let mut found = Vec::new();
        while let Some(piece) = first(&mut input) {
            found.push(piece);
            input.done();
        }
        assert_eq!(input.size, 0);
        found
    }

    fn pieces(parts: &[&[u8]]) -> Vec<Piece> {
        let mut input = Input::default();
        for part in parts {
            input.push(part, true);
        }
        all(input)
    }

    fn line(text: &str) -> Piece {
        Piece::Line(text.to_owned())
    }

    #[test]
    fn lines_and_single_bytes_come_in_their_order_however_they_are_cut() {
        assert_eq!(
            pieces(&[b"POS? X\r\n\n  \n\x05MO", b"V X 1\nPO"]),
            [line("POS? X"), Piece::Single(5), line("MOV X 1")]
        );
        // Within a line, and with an unnecessary line end.
        assert_eq!(pieces(&[b"PO\x05\nS?\n"]), [Piece::Single(5), line("PO"), line("S?")]);
        assert_eq!(pieces(&[&[b'A'; 600], b"\nERR?\n"]), [Piece::TooLong, line("ERR?")]);
    }

    #[test]
    fn a_stop_comes_first_and_discards_moves() {
        let stop = || Piece::Single(STOP);
        assert_eq!(pieces(&[b"MOV X 1\nMVR X 2\nSVO X 1\n\x18ERR?\n"]), [stop(), line("ERR?")]);
        assert_eq!(pieces(&[b"MOV X 1\nHLT X\nMOV X 2\n"]), [line("HLT X"), line("MOV X 2")]);
        assert_eq!(pieces(&[b"STP\nMOV X 1\nMOV X", b" 2\x18ERR?\n"]), [stop(), line("ERR?")], "the line, too");
        assert_eq!(pieces(&[b"POS?\nVLS 1\nMOV X 1\n\x18"]), [stop(), line("POS?"), line("VLS 1")]);
        assert_eq!(pieces(&[b"SVO X 1\nMOV X 1\nSVO X 0 Y 0\n"]), [line("SVO X 0 Y 0")]);
        assert_eq!(pieces(&[b"MOV X 1\nSVO X 0 Y 1\n"]).len(), 2);
        // From a client that may not switch the servo off.
        let mut input = Input::default();
        assert!(!input.push(b"MOV X 1\nSVO X 0\n", false) && input.push(b"STP\n", false));
        assert_eq!(all(input), [line("STP"), line("SVO X 0")]);
    }

    #[test]
    fn a_stop_of_another_client_discards_an_incomplete_line() {
        let mut input = Input::default();
        input.push(b"MOV X", true);
        input.drop_moves();
        assert!(!input.has_dropped(), "it may still be a query");
        input.push(b" 2\nMOV X 3\n", true);
        assert!(input.has_dropped() && !input.has_dropped());
        assert_eq!(all(input), [line("MOV X 3")]);
    }

    #[test]
    fn the_queue_is_bounded_and_a_stop_is_found_behind_it() {
        let mut input = Input::default();
        for _ in 0..100 {
            input.push(&b"MOV X 1\n".repeat(10_000), true);
        }
        assert!(input.size <= ROOM + PIECE + LONGEST && input.pieces.back() == Some(&Piece::TooLong));
        assert!(input.push(b"\x18", true));
        assert_eq!(all(input), [Piece::Single(STOP), Piece::TooLong]);
    }
}
