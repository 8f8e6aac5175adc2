//! A converter's SPI with its chip select: frames of a few bytes at full bus speed.
//!
//! At 25 MHz, waiting for each byte before sending the next takes longer than the byte. So a frame goes through the FIFO of the
//! SPI, with the [`Burst`] of each board.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};

use crate::CycleDelay;
use crate::pins::Output;

/// Wait after the chip select was read back, ns: more than 30 in total.
const SELECT: u32 = 20;

/// The SPI did not transfer a byte in time: its clock has stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpiTimeout;

impl Error for SpiTimeout {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// Registers of an initialised SPI, used exclusively.
pub trait Burst {
    /// Transfers `count` bytes: sends `send(k)` as the k-th and passes the received byte to `take`. Ends with the last bit.
    ///
    /// # Errors
    /// [`SpiTimeout`]; the next exchange starts from the beginning.
    fn exchange(
        &mut self,
        count: usize,
        send: impl FnMut(usize) -> u8,
        take: impl FnMut(usize, u8),
    ) -> Result<(), SpiTimeout>;

    /// Selects the clock of the following exchanges: slow for frames whose answer is used, or fast. Does nothing if one clock serves
    /// both.
    fn pace(&mut self, answered: bool);
}

/// A device with a chip select. `CYCLES` as in [`CycleDelay`].
pub struct Device<BUS, const CYCLES: u32> {
    /// The SPI.
    pub bus: BUS,
    /// Its chip select, high.
    pub select: Output,
}

impl<BUS: Burst, const CYCLES: u32> Device<BUS, CYCLES> {
    /// Between two edges of the chip select.
    #[inline]
    fn selected<T>(&mut self, action: impl FnOnce(&mut BUS) -> T) -> T {
        self.select.set(false);
        // Pin and SPI are on different buses, and the edge must precede the first clock edge by 30 ns (AD7606). Reading back ensures
        // that the write has completed.
        let _ = self.select.is_set();
        CycleDelay::<CYCLES>.delay_ns(SELECT);
        let result = action(&mut self.bus);
        self.select.set(true);
        result
    }

    /// The same for a frame whose answer is used.
    #[inline]
    fn answered<T>(&mut self, action: impl FnOnce(&mut BUS) -> T) -> T {
        self.bus.pace(true);
        let result = self.selected(action);
        self.bus.pace(false);
        result
    }
}

impl<BUS, const CYCLES: u32> ErrorType for Device<BUS, CYCLES> {
    type Error = SpiTimeout;
}

/// `write` ignores the answer; all other operations use the clock of frames whose answer is used.
impl<BUS: Burst, const CYCLES: u32> SpiDevice for Device<BUS, CYCLES> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), SpiTimeout> {
        self.answered(|bus| {
            for operation in operations {
                match operation {
                    Operation::Read(bytes) => bus.exchange(bytes.len(), |_| 0, |k, byte| put(bytes, k, byte))?,
                    Operation::Write(bytes) => bus.exchange(bytes.len(), |k| at(bytes, k), |_, _| {})?,
                    Operation::Transfer(to, from) => {
                        bus.exchange(to.len().max(from.len()), |k| at(from, k), |k, byte| put(to, k, byte))?;
                    }
                    Operation::TransferInPlace(bytes) => in_place(bus, bytes)?,
                    Operation::DelayNs(time) => CycleDelay::<CYCLES>.delay_ns(*time),
                }
            }
            Ok(())
        })
    }

    #[inline]
    fn transfer_in_place(&mut self, bytes: &mut [u8]) -> Result<(), SpiTimeout> {
        self.answered(|bus| in_place(bus, bytes))
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) -> Result<(), SpiTimeout> {
        self.selected(|bus| bus.exchange(bytes.len(), |k| at(bytes, k), |_, _| {}))
    }
}

#[inline]
fn in_place(bus: &mut impl Burst, bytes: &mut [u8]) -> Result<(), SpiTimeout> {
    // A byte is received after it was sent, so one buffer serves both.
    let cells = core::cell::Cell::from_mut(bytes).as_slice_of_cells();
    bus.exchange(
        cells.len(),
        |k| cells.get(k).map_or(0, core::cell::Cell::get),
        |k, byte| {
            if let Some(cell) = cells.get(k) {
                cell.set(byte);
            }
        },
    )
}

fn at(bytes: &[u8], k: usize) -> u8 {
    bytes.get(k).copied().unwrap_or_default()
}

fn put(bytes: &mut [u8], k: usize, byte: u8) {
    if let Some(place) = bytes.get_mut(k) {
        *place = byte;
    }
}
