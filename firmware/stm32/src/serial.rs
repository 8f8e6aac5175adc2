//! The link over a USART.
//!
//! Received bytes go by DMA into a ring, as a tick may last longer than a byte and an F4 holds one byte only. Answers go out
//! by DMA, so that the background sleeps meanwhile.
//!
//! After an error (noise, framing, overrun) the USART and its ring are made anew: the ring of the HAL keeps its place in a buffer
//! that the DMA begins from the front again, and what it gives out from then on is not what comes in.

use core::future::pending;

use controller::supervised::Machine;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Config, ConfigError, Uart, UartTx};
use specgen_board::{Desk, Exchange, Visit};
use specgen_link::{Endpoint, FRAME};

/// Of the link, with 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;
/// Bytes of the ring: half of it holds what comes in 2.7 ms.
pub const RING: usize = 512;
/// Bytes of an answer.
pub const ANSWER: usize = FRAME;

/// Settings of the USART.
#[must_use]
pub fn config() -> Config {
    let mut config = Config::default();
    config.baudrate = BAUD;
    config
}

/// A USART with its pins and DMA, which can be made as often as it takes.
pub trait Line {
    /// The USART, as after a reset.
    ///
    /// # Errors
    /// A rate that the clocks do not give.
    fn open(&mut self) -> Result<Uart<'_, Async>, ConfigError>;
}

/// Answers requests for ever. `with` gives access to the exchange and the machine, with the tick held off. `ring` and `answer`
/// are where the DMA can reach them.
pub async fn serve(
    line: &mut impl Line,
    ring: &mut [u8; RING],
    endpoint: &mut Endpoint,
    desk: &mut Desk,
    answer: &mut [u8; ANSWER],
    mut with: impl FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine)),
) -> ! {
    let mut bytes = [0; 64];
    loop {
        // On noise without end this loop has the background for itself, which is alive all the same.
        with(&mut |exchange, _| exchange.beat = exchange.beat.wrapping_add(1));
        // The rate is one that the clocks give.
        let Ok(uart) = line.open() else {
            pending::<()>().await;
            continue;
        };
        let (mut sender, receiver) = uart.split();
        let mut receiver = receiver.into_ring_buffered(&mut *ring);
        // Whatever the host has taken for bytes meanwhile ends here.
        send(&mut sender, answer, &[0]).await;
        // The frame in which an error came is lost, and counted by its CRC.
        while let Ok(count) = receiver.read(&mut bytes).await {
            for &byte in bytes.iter().take(count) {
                if let Some(reply) = endpoint.push(byte, &mut Visit { desk: &mut *desk, with: &mut with }) {
                    send(&mut sender, answer, reply).await;
                }
            }
        }
    }
}

/// Sends from where the DMA can reach it. What does not go out the host asks for again.
async fn send(sender: &mut UartTx<'_, Async>, room: &mut [u8; ANSWER], bytes: &[u8]) {
    for (slot, value) in room.iter_mut().zip(bytes) {
        *slot = *value;
    }
    let _ = sender.write(room.get(..bytes.len()).unwrap_or_default()).await;
}
