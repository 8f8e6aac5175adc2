//! Registers without a model: they read what was written.

use std::collections::BTreeMap;

/// Words by address.
#[derive(Default)]
pub struct Store {
    words: BTreeMap<u32, u32>,
}

impl Store {
    /// The word at an address, a multiple of four.
    pub fn word(&self, address: u32) -> u32 {
        self.words.get(&address).copied().unwrap_or(0)
    }

    /// Sets it.
    pub fn set(&mut self, address: u32, word: u32) {
        self.words.insert(address, word);
    }

    /// Sets `size` bytes.
    pub fn write(&mut self, address: u32, size: u32, value: u32) {
        let at = address & !3;
        self.set(at, merged(self.word(at), address, size, value));
    }
}

/// `size` bytes of a word, from where `address` points into it.
pub fn part(word: u32, address: u32, size: u32) -> u32 {
    let shifted = word >> (8 * (address & 3));
    if size < 4 { shifted & ((1 << (8 * size)) - 1) } else { shifted }
}

/// The word with these bytes changed.
pub fn merged(word: u32, address: u32, size: u32, value: u32) -> u32 {
    if size >= 4 {
        return value;
    }
    let shift = 8 * (address & 3);
    let mask = ((1 << (8 * size)) - 1) << shift;
    word & !mask | value << shift & mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_change_their_part_of_a_word() {
        let mut store = Store::default();
        store.write(0x10, 4, 0x1122_3344);
        store.write(0x11, 1, 0xab);
        assert_eq!(store.word(0x10), 0x1122_ab44);
        assert_eq!(part(store.word(0x10), 0x12, 2), 0x1122);
    }
}
