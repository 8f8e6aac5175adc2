//! The link over a USART.
//!
//! Received bytes go by DMA into a ring, as a tick may last longer than a byte and an F4 holds one byte only. Answers go out by DMA,
//! so that the background goes on meanwhile.
//!
//! What has come in when something goes wrong on the line (noise, framing, overrun) is dropped, and so is a frame by its CRC when more comes in
//! than the ring holds: that is counted, and the host asks again.

#![allow(unsafe_code)] // Interrupts are enabled.

use core::marker::PhantomData;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use cortex_m::asm;
use cortex_m::peripheral::NVIC;
use specgen_board::{Access, LinkHandler, RequestContext};
use specgen_link::{Endpoint, FRAME};
use stm32_metapac::{DMA1, Interrupt};

/// Of the link, with 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;
/// What the DMA fills over and over: half of it holds what comes in 2.7 ms.
pub type Ring = [AtomicU8; 512];
/// An answer while it goes out.
pub type Answer = [AtomicU8; FRAME];

/// The interrupt by which the program serves the link. Its own device is not used, so that the others pend it.
const SERVICE: Interrupt = Interrupt::CEC;
/// Priority of the interrupts, in the upper half of the byte as all: 8 of 16, below the tick.
const PRIORITY: u8 = 8 << 4;

/// CR of a stream: enabled, an interrupt at an error, in the middle and at the end; to the peripheral, over and over; memory by bytes
/// one after the other, highest priority.
const ENABLED: u32 = 1;
const ERROR: u32 = 1 << 2;
const HALF: u32 = 1 << 3;
const END: u32 = 1 << 4;
const SENDS: u32 = 1 << 6;
const CIRCULAR: u32 = 1 << 8;
const BYTES: u32 = 1 << 10 | 3 << 16;

/// The USART of a board, whose registers differ between the families.
pub trait Port {
    /// Streams of DMA1 to and from it.
    const SEND: usize;
    /// See above.
    const RECEIVE: usize;
    /// Bits of CR that choose its request, or that its DMA needs besides.
    const STREAM: u32;
    /// Its interrupt and those of the streams. Each is to call [`interrupt`].
    const INTERRUPTS: [Interrupt; 3];

    /// Addresses of the data registers: to send, received.
    fn data() -> [u32; 2];

    /// Hands over its pins, and the requests of the DMA where a multiplexer chooses them.
    fn prepare();

    /// Sets it up: DMA both ways, interrupts when the line falls idle and at errors, bits of so many clocks.
    fn start(clocks: u32);

    /// Takes back its interrupts. True after an error.
    fn acknowledge() -> bool;
}

/// There was an error on the line.
static FAILED: AtomicBool = AtomicBool::new(false);

/// The USART with its DMA.
pub struct Line<P> {
    ring: &'static Ring,
    answer: &'static Answer,
    /// Place of the next byte in the ring.
    next: usize,
    port: PhantomData<P>,
}

impl<P: Port> Line<P> {
    /// Opens the link. `hertz`: clock of the USART. `ring` and `answer` are where the DMA can reach them.
    pub fn open(nvic: &mut NVIC, hertz: u32, ring: &'static Ring, answer: &'static Answer) -> Self {
        let [_, received] = P::data();
        P::prepare();
        start_stream::<P>(P::RECEIVE, received, ring, ring.len(), HALF | CIRCULAR);
        P::start((hertz + BAUD / 2) / BAUD);
        for interrupt in P::INTERRUPTS {
            // SAFETY: they take back what calls them, and pend the service, which the program enables.
            unsafe {
                nvic.set_priority(interrupt, PRIORITY);
                NVIC::unmask(interrupt);
            }
        }
        let line = Self { ring, answer, next: 0, port: PhantomData };
        // Whatever the host has taken for bytes until now ends here.
        line.send(&[0]);
        line
    }

    /// Takes what has come in, and answers it, for as long as no answer is on its way: the end of one is an interrupt, which comes back
    /// here.
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

    /// The next byte that has come in.
    fn take(&mut self) -> Option<u8> {
        if self.next == self.end() {
            return None;
        }
        let byte = self.ring.get(self.next)?.load(Ordering::Relaxed);
        self.next = (self.next + 1) % self.ring.len();
        Some(byte)
    }

    /// Place in the ring of the byte that comes in next.
    fn end(&self) -> usize {
        let left = usize::from(DMA1.st(P::RECEIVE).ndtr().read().ndt());
        (self.ring.len() - left) % self.ring.len()
    }

    /// Sends from where the DMA can reach it. What does not go out the host asks for again.
    fn send(&self, bytes: &[u8]) {
        for (slot, value) in self.answer.iter().zip(bytes) {
            slot.store(*value, Ordering::Relaxed);
        }
        let [to, _] = P::data();
        start_stream::<P>(P::SEND, to, self.answer, bytes.len(), SENDS);
    }
}

/// Starts a stream that has come to its end, or never ran.
fn start_stream<P: Port>(number: usize, register: u32, memory: &'static [AtomicU8], count: usize, more: u32) {
    acknowledge(number);
    let stream = DMA1.st(number);
    stream.par().write_value(register);
    stream.m0ar().write_value(memory.as_ptr() as u32);
    stream.ndtr().write(|w| w.set_ndt(count as u16));
    // Directly, without its FIFO.
    stream.fcr().write(|w| w.0 = 0);
    // What was written to memory is there.
    asm::dmb();
    stream.cr().write(|w| w.0 = P::STREAM | BYTES | ERROR | END | more | ENABLED);
}

/// Takes back what a stream has to say. An error is one of the program: no such memory.
fn acknowledge(number: usize) {
    let (register, place) = (number / 4, number % 4);
    assert!(!DMA1.isr(register).read().teif(place));
    DMA1.ifcr(register).write(|w| {
        w.set_htif(place, true);
        w.set_tcif(place, true);
    });
}

/// What the interrupts of USART and streams do: the link is served, below the tick and above the background.
pub fn interrupt<P: Port>() {
    acknowledge(P::SEND);
    acknowledge(P::RECEIVE);
    if P::acknowledge() {
        FAILED.store(true, Ordering::Relaxed);
    }
    NVIC::pend(SERVICE);
}
