//! The link over a USART.
//!
//! Received bytes go by DMA into a ring, as a tick may last longer than a byte and an F4 holds one byte only. Answers go out
//! by DMA, so that the background sleeps meanwhile.

use controller::supervised::Machine;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Config, RingBufferedUartRx, UartTx};
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

/// Answers requests for ever. `with` gives access to the exchange and the machine, with the tick held off.
pub async fn serve(
    receiver: &mut RingBufferedUartRx<'static>,
    sender: &mut UartTx<'static, Async>,
    endpoint: &mut Endpoint,
    desk: &mut Desk,
    answer: &mut [u8; ANSWER],
    mut with: impl FnMut(&mut dyn FnMut(&mut Exchange, &mut Machine)),
) -> ! {
    let mut bytes = [0; 64];
    loop {
        // After an error (noise, overrun) reception begins anew with the next read; the frame is lost, and counted by its CRC.
        let Ok(count) = receiver.read(&mut bytes).await else { continue };
        for &byte in bytes.iter().take(count) {
            let Some(reply) = endpoint.push(byte, &mut Visit { desk: &mut *desk, with: &mut with }) else { continue };
            // Copied to where the DMA can reach it.
            let length = reply.len();
            for (slot, value) in answer.iter_mut().zip(reply) {
                *slot = *value;
            }
            // What does not go out the host asks for again.
            let _ = sender.write(answer.get(..length).unwrap_or_default()).await;
        }
    }
}
