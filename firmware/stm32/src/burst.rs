//! A converter's SPI with its chip select: frames of some bytes at the speed of the wire.
//!
//! To wait for each byte before the next one is given takes longer than the byte at 25 MHz. Here a frame goes through the FIFO of the
//! part, by [`Burst`], which each board has for its SPI.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};

use crate::CycleDelay;
use crate::pins::Output;

/// After the chip select has been read back, ns: with that, more than 30.
const SELECT: u32 = 20;

/// The SPI did not move a byte in time: its clock stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpiTimeout;

impl Error for SpiTimeout {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// Registers of an SPI that is set up, and that nobody else uses.
pub trait Burst {
    /// Moves `count` bytes: the k-th is `send(k)`, and what comes back for it goes to `take`. Ends with the last bit.
    ///
    /// # Errors
    /// [`SpiTimeout`]; the next exchange starts anew.
    fn exchange(
        &mut self,
        count: usize,
        send: impl FnMut(usize) -> u8,
        take: impl FnMut(usize, u8),
    ) -> Result<(), SpiTimeout>;

    /// The clock of the exchanges that follow: that of frames whose answer counts, or that of others. Where one clock does for both,
    /// nothing.
    fn pace(&mut self, answered: bool);
}

/// A part behind a chip select. `CYCLES` as in [`CycleDelay`].
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
        // Pin and SPI are on different buses, and the edge must be out 30 ns before the first one of the clock (AD7606): what is
        // read back has been written.
        let _ = self.select.is_set();
        CycleDelay::<CYCLES>.delay_ns(SELECT);
        let result = action(&mut self.bus);
        self.select.set(true);
        result
    }

    /// The same of a frame whose answer counts.
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

/// By `write` alone nothing comes back: all else has the clock of frames whose answer counts.
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
    // A byte comes back after it was sent, so one place serves both.
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
