//! The link over a USART.
//!
//! DMA moves received bytes into a ring, because a tick may last longer than a byte and an F4 buffers only one. Answers are sent by
//! DMA, so that the background continues meanwhile.
//!
//! After an error on the line (noise, framing, overrun) the received bytes are dropped. If the ring overflows, the CRC rejects the
//! frame. Both are counted, and the host repeats its request.

#![allow(unsafe_code)] // Interrupts are enabled.

use core::marker::PhantomData;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use cortex_m::asm;
use cortex_m::peripheral::NVIC;
use specgen_board::{Access, LinkHandler, RequestContext};
use specgen_link::{Endpoint, FRAME};
use stm32_metapac::{DMA1, Interrupt};

/// Baud rate of the link, with 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;
/// The circular buffer of the DMA: half of it holds 2.7 ms of data.
pub type Ring = [AtomicU8; 512];
/// An answer while it is being sent.
pub type Answer = [AtomicU8; FRAME];

/// The interrupt that serves the link. Its own device is not used; the other interrupts pend it.
const SERVICE: Interrupt = Interrupt::CEC;
/// Priority of the interrupts, in the upper half of the byte: 8 of 16, below the tick.
const PRIORITY: u8 = 8 << 4;

/// CR of a stream: enable, interrupts at an error, at the middle and at the end; direction to the peripheral, circular; memory increment
/// by bytes, highest priority.
const ENABLED: u32 = 1;
const ERROR: u32 = 1 << 2;
const HALF: u32 = 1 << 3;
const END: u32 = 1 << 4;
const SENDS: u32 = 1 << 6;
const CIRCULAR: u32 = 1 << 8;
const BYTES: u32 = 1 << 10 | 3 << 16;

/// The USART of a board. Its registers differ between families.
pub trait Port {
    /// Stream of DMA1 that sends.
    const SEND: usize;
    /// Stream of DMA1 that receives.
    const RECEIVE: usize;
    /// Bits of CR that select its request, or that its DMA needs in addition.
    const STREAM: u32;
    /// Its interrupt and those of the streams. Each must call [`interrupt`].
    const INTERRUPTS: [Interrupt; 3];

    /// Addresses of the data registers: to send, received.
    fn data() -> [u32; 2];

    /// Configures its pins, and the DMA requests if there is a multiplexer.
    fn prepare();

    /// Starts it: DMA in both directions, interrupts on an idle line and on errors, bits of so many clocks.
    fn start(clocks: u32);

    /// Clears its interrupts. True after an error.
    fn acknowledge() -> bool;
}

/// There was an error on the line.
static FAILED: AtomicBool = AtomicBool::new(false);

/// The USART with its DMA.
pub struct Line<P> {
    ring: &'static Ring,
    answer: &'static Answer,
    /// Index of the next byte in the ring.
    next: usize,
    port: PhantomData<P>,
}

impl<P: Port> Line<P> {
    /// Opens the link. `hertz`: clock of the USART. `ring` and `answer` must be in memory that the DMA can access.
    pub fn open(nvic: &mut NVIC, hertz: u32, ring: &'static Ring, answer: &'static Answer) -> Self {
        let [_, received] = P::data();
        P::prepare();
        start_stream::<P>(P::RECEIVE, received, ring, ring.len(), HALF | CIRCULAR);
        P::start((hertz + BAUD / 2) / BAUD);
        for interrupt in P::INTERRUPTS {
            // SAFETY: the handlers clear their interrupts and pend the service, which the program enables.
            unsafe {
                nvic.set_priority(interrupt, PRIORITY);
                NVIC::unmask(interrupt);
            }
        }
        let line = Self { ring, answer, next: 0, port: PhantomData };
        // Ends any garbage that the host has received so far.
        line.send(&[0]);
        line
    }

    /// Processes received bytes and answers them until an answer is being sent: the interrupt at its end calls this again.
    pub fn serve(&mut self, endpoint: &mut Endpoint, handler: &mut LinkHandler, with: &mut Access<'_>) {
        if FAILED.swap(false, Ordering::Relaxed) {
            self.next = self.end();
        }
        while !DMA1.st(P::SEND).cr().read().en() {
            let Some(byte) = self.take() else { return };
            if let Some(reply) = endpoint.push(byte, &mut RequestContext { handler: &mut *handler, with: &mut *with }) {
                self.send(reply);
            }
        }
    }

    /// The next received byte.
    fn take(&mut self) -> Option<u8> {
        if self.next == self.end() {
            return None;
        }
        let byte = self.ring.get(self.next)?.load(Ordering::Relaxed);
        self.next = (self.next + 1) % self.ring.len();
        Some(byte)
    }

    /// Index in the ring of the next byte to be received.
    fn end(&self) -> usize {
        let left = usize::from(DMA1.st(P::RECEIVE).ndtr().read().ndt());
        (self.ring.len() - left) % self.ring.len()
    }

    /// Sends from memory that the DMA can access. If it fails, the host repeats its request.
    fn send(&self, bytes: &[u8]) {
        for (slot, value) in self.answer.iter().zip(bytes) {
            slot.store(*value, Ordering::Relaxed);
        }
        let [to, _] = P::data();
        start_stream::<P>(P::SEND, to, self.answer, bytes.len(), SENDS);
    }
}

/// Starts a stream that has finished or never ran.
fn start_stream<P: Port>(number: usize, register: u32, memory: &'static [AtomicU8], count: usize, more: u32) {
    acknowledge(number);
    let stream = DMA1.st(number);
    stream.par().write_value(register);
    stream.m0ar().write_value(memory.as_ptr() as u32);
    stream.ndtr().write(|w| w.set_ndt(count as u16));
    // Direct mode, without the FIFO.
    stream.fcr().write(|w| w.0 = 0);
    // Earlier writes to memory have completed.
    asm::dmb();
    stream.cr().write(|w| w.0 = P::STREAM | BYTES | ERROR | END | more | ENABLED);
}

/// Clears the interrupts of a stream. An error is a bug of the program: invalid memory.
fn acknowledge(number: usize) {
    let (register, place) = (number / 4, number % 4);
    assert!(!DMA1.isr(register).read().teif(place));
    DMA1.ifcr(register).write(|w| {
        w.set_htif(place, true);
        w.set_tcif(place, true);
    });
}

/// Handler of the interrupts of USART and streams: the link is served below the tick and above the background.
pub fn interrupt<P: Port>() {
    acknowledge(P::SEND);
    acknowledge(P::RECEIVE);
    if P::acknowledge() {
        FAILED.store(true, Ordering::Relaxed);
    }
    NVIC::pend(SERVICE);
}
