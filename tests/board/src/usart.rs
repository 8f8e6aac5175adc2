//! The link's USART: bytes at the time that they take on the line.

use std::collections::VecDeque;

use crate::dma::Dma;
use crate::part::Family;
use crate::time::{Time, cycle};
use crate::unicorn::Core;

/// Flags, at the same place in both kinds.
const FRAMING: u32 = 1 << 1;
const OVERRUN: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RECEIVED: u32 = 1 << 5;
const SENT: u32 = 1 << 6;
const EMPTY: u32 = 1 << 7;
/// What a framing error, noise or overrun looks like.
const ERRORS: u32 = 0xf;

pub struct Usart {
    family: Family,
    /// CR1, CR2, CR3, BRR.
    control: [u32; 4],
    status: u32,
    data: u8,
    /// In the data register, and on the line until.
    sending: Option<u8>,
    shifting: Option<(u8, Time)>,
    /// Next byte from the host comes to its end, then the line was quiet for one.
    arriving: Option<Time>,
    quiet: Option<Time>,
    /// Address of the data registers: received, to send.
    registers: [u32; 2],
    /// Hz.
    clock: u64,
    pub incoming: VecDeque<u8>,
    pub outgoing: Vec<u8>,
    /// The next byte comes with a framing error.
    pub damaged: bool,
    /// So does every third one.
    pub noise: bool,
    received: u32,
}

impl Usart {
    pub fn new(family: Family, base: u32) -> Self {
        let registers = match family {
            Family::H7 => [base + 0x24, base + 0x28],
            Family::F4 => [base + 4; 2],
        };
        Self {
            family,
            control: [0; 4],
            status: SENT | EMPTY,
            data: 0,
            sending: None,
            shifting: None,
            arriving: None,
            quiet: None,
            registers,
            clock: 1,
            incoming: VecDeque::new(),
            outgoing: Vec::new(),
            damaged: false,
            noise: false,
            received: 0,
        }
    }

    pub fn clock(&mut self, hertz: u64) {
        self.clock = hertz;
    }

    /// Bits a second.
    pub fn baud(&self) -> u64 {
        self.clock / u64::from(self.control[3].max(1))
    }

    /// Start bit, eight bits, stop bit.
    fn byte_time(&self) -> Time {
        10 * cycle(self.clock) * u64::from(self.control[3].max(1))
    }

    fn on(&self, direction: u32) -> bool {
        let enable = if self.family == Family::H7 { 0 } else { 13 };
        self.control[0] >> enable & 1 == 1 && self.control[0] >> direction & 1 == 1
    }

    fn receives(&self) -> bool {
        self.on(2)
    }

    fn sends(&self) -> bool {
        self.on(3)
    }

    /// When something happens next.
    pub fn next(&self, now: Time, dma: &Dma) -> Option<Time> {
        let fed =
            self.sends() && self.control[2] >> 7 & 1 == 1 && self.sending.is_none() && dma.feeds(self.registers[1]);
        let loads = self.sending.is_some() && self.shifting.is_none();
        let begins = self.receives() && self.arriving.is_none() && !self.incoming.is_empty();
        let taken = self.status & RECEIVED != 0 && self.control[2] >> 6 & 1 == 1 && dma.takes(self.registers[0]);
        let at_once = (fed || loads || begins || taken).then_some(now);
        [at_once, self.shifting.map(|(_, end)| end), self.arriving, self.quiet].into_iter().flatten().min()
    }

    /// What happens at `now`.
    pub fn advance(&mut self, now: Time, dma: &mut Dma, core: &Core<'_>) {
        if let Some((byte, _)) = self.shifting.filter(|(_, end)| *end <= now) {
            self.outgoing.push(byte);
            self.shifting = None;
            if self.sending.is_none() {
                self.status |= SENT;
            }
        }
        // Twice: the data register is free again once its byte is on the line.
        for _ in 0..2 {
            if self.sends() && self.sending.is_none() && self.control[2] >> 7 & 1 == 1 {
                self.sending = dma.fetch(self.registers[1], core);
            }
            if self.shifting.is_none()
                && let Some(byte) = self.sending.take()
            {
                self.shifting = Some((byte, now + self.byte_time()));
                self.status &= !SENT;
            }
        }
        // A byte that came before its DMA was on.
        if self.status & RECEIVED != 0
            && self.control[2] >> 6 & 1 == 1
            && dma.deliver(self.registers[0], self.data, core)
        {
            self.status &= !RECEIVED;
        }
        self.status = self.status & !EMPTY | if self.sending.is_none() { EMPTY } else { 0 };
        if self.quiet.is_some_and(|at| at <= now) {
            self.quiet = None;
            self.status |= IDLE;
        }
        if self.arriving.is_some_and(|end| end <= now) {
            self.arriving = None;
            self.quiet = Some(now + self.byte_time());
            if let Some(byte) = self.incoming.pop_front() {
                self.receive(byte, dma, core);
            }
        }
        if self.receives() && self.arriving.is_none() && !self.incoming.is_empty() {
            self.arriving = Some(now + self.byte_time());
            self.quiet = None;
        }
    }

    fn receive(&mut self, byte: u8, dma: &mut Dma, core: &Core<'_>) {
        self.received = self.received.wrapping_add(1);
        if std::mem::take(&mut self.damaged) || (self.noise && self.received.is_multiple_of(3)) {
            self.status |= FRAMING;
        }
        if self.status & RECEIVED != 0 {
            self.status |= OVERRUN;
            return;
        }
        self.data = byte;
        let taken = self.control[2] >> 6 & 1 == 1 && dma.deliver(self.registers[0], byte, core);
        if !taken {
            self.status |= RECEIVED;
        }
    }

    /// Its interrupt.
    pub fn line(&self) -> bool {
        let enabled = self.control[0] & (IDLE | RECEIVED | SENT | EMPTY);
        let error = self.control[2] & 1 == 1 && self.status & ERRORS & !1 != 0;
        // An overrun also where a received byte interrupts.
        let overrun = self.control[0] & RECEIVED != 0 && self.status & OVERRUN != 0;
        self.status & enabled != 0 || error || overrun
    }

    /// CR1, CR2, CR3, BRR by their offset.
    fn setting(&self, offset: u32) -> Option<usize> {
        match (self.family, offset) {
            (Family::H7, 0 | 4 | 8 | 0xc) => Some(offset as usize / 4),
            (Family::F4, 0xc | 0x10 | 0x14) => Some(offset as usize / 4 - 3),
            (Family::F4, 8) => Some(3),
            _ => None,
        }
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        if let Some(setting) = self.setting(offset) {
            return self.control[setting];
        }
        match (self.family, offset) {
            (Family::H7, 0x1c) => self.status | u32::from(self.sends()) << 21 | u32::from(self.receives()) << 22,
            (Family::F4, 0) => self.status,
            (Family::H7, 0x24) => {
                self.status &= !RECEIVED;
                u32::from(self.data)
            }
            (Family::F4, 4) => {
                self.status &= !(RECEIVED | IDLE | ERRORS);
                u32::from(self.data)
            }
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        if let Some(setting) = self.setting(offset) {
            self.control[setting] = value;
            return;
        }
        match (self.family, offset) {
            (Family::H7, 0x20) => self.status &= !(value & (ERRORS | IDLE | SENT)),
            // RXFRQ.
            (Family::H7, 0x18) if value >> 3 & 1 == 1 => self.status &= !RECEIVED,
            (Family::F4, 0) => self.status &= value | !(RECEIVED | SENT),
            (Family::H7, 0x28) | (Family::F4, 4) => self.sending = Some(value as u8),
            _ => {}
        }
    }
}
