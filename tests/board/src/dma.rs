//! DMA1 as the link uses it: bytes between memory and one peripheral's data register. The request that a stream serves is taken
//! from its peripheral address; the multiplexer's channel is not looked at.

use crate::unicorn::Core;

/// Flags of a stream.
const HALF: u32 = 1 << 4;
const COMPLETE: u32 = 1 << 5;
/// Where the flags of a stream begin in LISR or HISR.
const PLACES: [u32; 4] = [0, 6, 16, 22];

#[derive(Default, Clone, Copy)]
struct Stream {
    control: u32,
    left: u32,
    reload: u32,
    peripheral: u32,
    memory: u32,
    others: [u32; 2],
    flags: u32,
}

impl Stream {
    fn runs(&self) -> bool {
        self.control & 1 == 1
    }

    /// Whether it moves from the peripheral to memory.
    fn receives(&self) -> bool {
        self.control >> 6 & 3 == 0
    }

    /// The address of this item; then one is done.
    fn step(&mut self) -> u32 {
        let address = self.memory + (self.reload - self.left);
        self.left -= 1;
        if self.left == self.reload / 2 {
            self.flags |= HALF;
        }
        if self.left == 0 {
            self.flags |= COMPLETE;
            if self.control >> 8 & 1 == 1 {
                self.left = self.reload;
            } else {
                self.control &= !1;
            }
        }
        address
    }
}

#[derive(Default)]
pub struct Dma {
    streams: [Stream; 8],
}

impl Dma {
    fn serving(&mut self, register: u32, receives: bool) -> Option<&mut Stream> {
        self.streams.iter_mut().find(|stream| {
            stream.runs() && stream.peripheral == register && stream.receives() == receives && stream.left > 0
        })
    }

    /// Whether a stream would give a byte for this register.
    pub fn feeds(&self, register: u32) -> bool {
        self.streams.iter().any(|s| s.runs() && s.peripheral == register && !s.receives() && s.left > 0)
    }

    /// Whether a stream would take a byte from this register.
    pub fn takes(&self, register: u32) -> bool {
        self.streams.iter().any(|s| s.runs() && s.peripheral == register && s.receives() && s.left > 0)
    }

    /// The next byte for a register.
    pub fn fetch(&mut self, register: u32, core: &Core<'_>) -> Option<u8> {
        let address = self.serving(register, false)?.step();
        let mut byte = [0];
        core.load(address, &mut byte);
        Some(byte[0])
    }

    /// Takes a byte from a register; false if no stream does.
    pub fn deliver(&mut self, register: u32, byte: u8, core: &Core<'_>) -> bool {
        let Some(stream) = self.serving(register, true) else { return false };
        core.store(stream.step(), &[byte]);
        true
    }

    /// The interrupt of a stream.
    pub fn line(&self, stream: usize) -> bool {
        let Stream { flags, control, .. } = self.streams[stream];
        // HTIE and TCIE stand one bit below their flags.
        flags & (control << 1) & (HALF | COMPLETE) != 0
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            0 | 4 => {
                let first = offset as usize;
                (0..4).fold(0, |word, k| word | self.streams[first + k].flags << PLACES[k])
            }
            0x10..=0xcf => {
                let stream = &self.streams[(offset as usize - 0x10) / 0x18];
                match (offset - 0x10) % 0x18 {
                    0 => stream.control,
                    4 => stream.left,
                    8 => stream.peripheral,
                    0xc => stream.memory,
                    at => stream.others[usize::from(at == 0x14)],
                }
            }
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        match offset {
            8 | 0xc => {
                let first = offset as usize - 8;
                for (stream, place) in self.streams.iter_mut().skip(first).zip(PLACES) {
                    stream.flags &= !(value >> place & 0x3f);
                }
            }
            0x10..=0xcf => {
                let stream = &mut self.streams[(offset as usize - 0x10) / 0x18];
                match (offset - 0x10) % 0x18 {
                    0 => {
                        // Ended by the program: complete, with what it has.
                        if stream.runs() && value & 1 == 0 {
                            stream.flags |= COMPLETE;
                        }
                        if !stream.runs() && value & 1 == 1 {
                            stream.reload = stream.left;
                        }
                        stream.control = value;
                    }
                    4 => (stream.left, stream.reload) = (value & 0xffff, value & 0xffff),
                    8 => stream.peripheral = value,
                    0xc => stream.memory = value,
                    at => stream.others[usize::from(at == 0x14)] = value,
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_begins_again_and_tells_half_and_end() {
        let mut stream = Stream { control: 1 | 1 << 8, left: 4, reload: 4, memory: 0x100, ..Stream::default() };
        let addresses: Vec<u32> = (0..5).map(|_| stream.step()).collect();
        assert_eq!(addresses, [0x100, 0x101, 0x102, 0x103, 0x100]);
        assert_eq!(stream.flags, HALF | COMPLETE);
        assert!(stream.runs());
    }

    #[test]
    fn flags_are_cleared_by_ones_and_raise_the_interrupt_only_where_it_is_enabled() {
        let mut dma = Dma::default();
        dma.streams[1].flags = COMPLETE;
        assert!(!dma.line(1));
        dma.write(0x28, 1 << 4);
        assert!(dma.line(1));
        assert_eq!(dma.read(0), COMPLETE << 6);
        dma.write(8, COMPLETE << 6);
        assert!(!dma.line(1));
    }
}
