//! Choices of the supervisor as words.

use super::{Cause, Phase, Request};
use crate::snapshot::Choice;

impl Choice for Phase {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        Self::from_word(word)
    }
}

impl Choice for Cause {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        Self::from_word(word)
    }
}

impl Choice for Request {
    fn to_word(&self) -> u64 {
        self.word()
    }

    fn of_word(word: u64) -> Option<Self> {
        (word <= 5).then(|| Self::from_word(word))
    }
}
