//! The device's side of the link. Its panic handler calls a function that nobody defines: if a panic path is left after
//! optimisation the library does not link.
#![no_std]

use specgen_link::lockstep::{Lockstep, Machine};
use specgen_link::samples::{Block, Collector, Sample};
use specgen_link::{Bytes, CostUnit, Device, Endpoint, FRAME, Receiver, Reply, Request, Stage, Status, telemetry};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: nobody defines it; what calls it does not link.
    unsafe extern "C" {
        fn specgen_panic_path_remains() -> !;
    }
    // SAFETY: never linked.
    unsafe { specgen_panic_path_remains() }
}

/// Words in, words out.
pub struct Adder([u64; 60]);

impl Machine for Adder {
    fn description(&self) -> &str {
        "name=adder\n"
    }

    fn words(&self) -> [usize; 3] {
        [60, 35, 57]
    }

    fn stages(&self) -> usize {
        1
    }

    fn counted(&self) -> CostUnit {
        CostUnit::Cycles
    }

    fn configure(&mut self, config: &[u64]) -> Result<(), usize> {
        for (slot, word) in self.0.iter_mut().zip(config) {
            *slot = *word;
        }
        Ok(())
    }

    fn reset(&mut self) {}

    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32) {
        for ((slot, word), own) in output.iter_mut().zip(input).zip(&self.0) {
            *slot = word.wrapping_add(*own);
        }
        #[cfg(feature = "spoiled")]
        {
            output[input[0] as usize] = 1;
        }
        (self.0[0], 0)
    }

    fn stage(&self, _index: usize) -> Option<Stage<'_>> {
        None
    }
}

/// Answers every kind of reply.
pub struct Every<'a>(u8, &'a Status, &'a [u8]);

impl Device for Every<'_> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match *request {
            Request::Status => Reply::Status(*self.1),
            Request::ReadConfig => Reply::Config { words: Bytes(self.2) },
            Request::Download { offset } => specgen_link::lockstep::piece(self.2, offset, 512),
            Request::Supervise { request } => {
                self.0 = request;
                Reply::Done
            }
            _ => Reply::Done,
        }
    }
}

/// A byte into the endpoint of a device in lock-step; length of the answer.
///
/// # Safety
/// The pointers are to what they say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn proof_lockstep(endpoint: *mut Endpoint, device: *mut Lockstep<Adder>, byte: u8) -> usize {
    // SAFETY: the caller's duty.
    let (endpoint, device) = unsafe { (&mut *endpoint, &mut *device) };
    endpoint.push(byte, device).map_or(0, <[u8]>::len)
}

/// The same for a device with every kind of answer.
///
/// # Safety
/// The pointers are to what they say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn proof_every(endpoint: *mut Endpoint, device: *mut Every<'_>, byte: u8) -> usize {
    // SAFETY: the caller's duty.
    let (endpoint, device) = unsafe { (&mut *endpoint, &mut *device) };
    endpoint.push(byte, device).map_or(0, <[u8]>::len)
}

/// A tick into a collector, and a block out of it; length of its rows.
///
/// # Safety
/// The pointers are to what they say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn proof_samples(
    collector: *mut Collector<[Block; 3]>,
    sample: *const Sample,
    every: u32,
) -> usize {
    // SAFETY: the caller's duty.
    let (collector, sample) = unsafe { (&mut *collector, &*sample) };
    if every != collector.every() {
        collector.start(every);
    }
    collector.add(sample);
    collector.take().map_or(0, |block| block.bytes().len())
}

/// Telemetry out, and a byte into a receiver.
///
/// # Safety
/// The pointers are to what they say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn proof_others(
    out: *mut [u8; FRAME],
    status: *const Status,
    receiver: *mut Receiver,
    byte: u8,
) -> usize {
    // SAFETY: the caller's duty.
    let (out, status, receiver) = unsafe { (&mut *out, &*status, &mut *receiver) };
    let length = telemetry(status, u16::from(byte), out).len();
    length + usize::from(receiver.push(byte).is_some_and(|frame| frame.is_ok()))
}
