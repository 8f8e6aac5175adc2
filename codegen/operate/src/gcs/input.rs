//! Bytes of a client as commands: lines that end in LF, and single bytes without one.

use std::collections::VecDeque;

/// Longest line: six axes with all their digits, many times over.
const LONGEST: usize = 512;
/// Commands that may wait; more are left in the socket.
const MOST: usize = 256;
/// Bytes that are commands by themselves: position, status, motion, ready, macros, wave generator, stop.
const SINGLE: [u8; 7] = [3, 4, 5, 7, 8, 9, STOP];
/// Stops all axes.
pub(super) const STOP: u8 = 24;

/// One command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Piece {
    /// A byte that needs no line.
    Single(u8),
    /// A line without its end; never empty.
    Line(String),
    /// A line that was longer than any command.
    TooLong,
}

/// What a client sent and nobody looked at yet.
#[derive(Debug, Default)]
pub(super) struct Input {
    line: Vec<u8>,
    /// Skips to the end of a line that is too long.
    skips: bool,
    pieces: VecDeque<Piece>,
}

impl Input {
    /// Takes bytes. A stop overtakes everything that waits, and takes it away: it is not to be followed by what it stopped.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match *byte {
                b'\n' => self.end_line(),
                b'\r' => {}
                STOP => {
                    self.pieces.clear();
                    self.pieces.push_back(Piece::Single(STOP));
                }
                byte if SINGLE.contains(&byte) => self.pieces.push_back(Piece::Single(byte)),
                byte if self.line.len() < LONGEST => self.line.push(byte),
                _ => self.skips = true,
            }
        }
    }

    fn end_line(&mut self) {
        let text = String::from_utf8_lossy(&self.line).trim().to_owned();
        self.line.clear();
        let stops = matches!(text.split_whitespace().next(), Some("STP" | "HLT"));
        if std::mem::take(&mut self.skips) {
            self.pieces.push_back(Piece::TooLong);
        } else if !text.is_empty() {
            if stops {
                self.pieces.clear();
            }
            self.pieces.push_back(Piece::Line(text));
        }
    }

    /// The command whose turn it is.
    pub(super) fn first(&self) -> Option<&Piece> {
        self.pieces.front()
    }

    /// It is done with.
    pub(super) fn done(&mut self) {
        self.pieces.pop_front();
    }

    /// Whether as much waits as may.
    pub(super) fn is_full(&self) -> bool {
        self.pieces.len() >= MOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(parts: &[&[u8]]) -> Vec<Piece> {
        let mut input = Input::default();
        for part in parts {
            input.push(part);
        }
        let mut found = Vec::new();
        while let Some(piece) = input.first() {
            found.push(piece.clone());
            input.done();
        }
        found
    }

    #[test]
    fn lines_and_single_bytes_come_in_their_order_however_they_are_cut() {
        let line = |text: &str| Piece::Line(text.to_owned());
        assert_eq!(
            pieces(&[b"POS? X\r\n\n  \n\x05MO", b"V X 1\nPO"]),
            [line("POS? X"), Piece::Single(5), line("MOV X 1")]
        );
        // In the midst of a line, and with a line end that it does not need.
        assert_eq!(pieces(&[b"PO\x05\nS?\n"]), [Piece::Single(5), line("PO"), line("S?")]);
        assert_eq!(pieces(&[&[b'A'; 600], b"\nERR?\n"]), [Piece::TooLong, line("ERR?")]);
    }

    #[test]
    fn a_stop_takes_away_what_waits() {
        let line = |text: &str| Piece::Line(text.to_owned());
        assert_eq!(pieces(&[b"MOV X 1\nMOV X 2\n\x18ERR?\n"]), [Piece::Single(STOP), line("ERR?")]);
        assert_eq!(pieces(&[b"MOV X 1\nHLT X\nERR?\n"]), [line("HLT X"), line("ERR?")]);
    }

    #[test]
    fn what_waits_is_bounded() {
        let mut input = Input::default();
        assert!(!input.is_full());
        input.push(&b"A\n".repeat(300));
        assert!(input.is_full());
    }
}
