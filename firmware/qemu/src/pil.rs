//! Processor in the loop: the controller on an emulated Cortex-M, stepped tick by tick by a host over the link.
//!
//! The frames of `../link` arrive through the named pipe `pil.in` in the emulator's working folder and are sent through
//! `pil.out`. It is the same link as that of a board over a serial line. No control decision is made here.

#![no_std]
#![no_main]

mod counted;
mod instructions;
mod panic;
mod pipe;
#[allow(dead_code)] // The files are `replay`'s.
mod semihosting;
mod stack;
mod stages;
mod start;
#[allow(dead_code)] // The file of figures is `replay`'s.
mod stats;
mod steps;

use instructions::InstructionCounter;
use pipe::Pipe;
use semihosting::{Exit, exit};
use specgen_link::lockstep::Lockstep;
use specgen_link::{Endpoint, FRAME};
use steps::Steps;

extern "C" fn main() -> ! {
    exit(match serve() {
        Ok(()) => Exit::Done,
        Err(code) => code,
    })
}

/// Answers the host until it closes the pipe.
fn serve() -> Result<(), Exit> {
    let mut counter = InstructionCounter::new();
    let exact = counter.self_test() == [0, 1, 100, 1000];
    let mut device = Lockstep::new(Steps::new(counter, exact));
    let mut endpoint = Endpoint::new();
    // The host opens its ends in this order.
    let input = Pipe::reader(b"pil.in\0").ok_or(Exit::NoInput)?;
    let output = Pipe::writer(b"pil.out\0").ok_or(Exit::CannotWrite)?;
    let mut bytes = [0; FRAME];
    loop {
        let count = input.receive(&mut bytes);
        if count == 0 {
            return Ok(());
        }
        for byte in bytes.iter().take(count) {
            if let Some(reply) = endpoint.push(*byte, &mut device) {
                if !output.send(reply) {
                    return Err(Exit::CannotWrite);
                }
            }
        }
    }
}
