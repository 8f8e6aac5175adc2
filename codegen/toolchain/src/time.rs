//! Duration of a tick on a board: computing time by the cycle model ([`specgen_cycles`]), waiting time by the clocks recorded in the
//! board's image, and the entry and return of the interrupt.
//!
//! | part | estimate |
//! |---|---|
//! | law, recorder, wave, drivers | every instruction of `firmware/tick` on the emulated core, priced; the worst traced tick |
//! | law | also: excess of the longest tick of the exercise over the mean, in instructions |
//! | buses | bytes and frames of the drivers, by SCLK and the register accesses per byte and frame |
//! | waits | waits of the drivers: conversion and data-sheet delays |
//! | interrupt | entry, return and timer; what delays the tick: samples of a pass, a piece of a record |
//! | caches | empty at the start of a tick; constants are present |
//!
//! Link interrupts have a lower priority than the tick and do not delay it.

use object::{Object, ObjectSection, ObjectSymbol};
use serde::Serialize;
use specgen_cycles::{Cost, Family};
use specgen_language::model::Mcu;

use super::checks;
use super::error::TargetError;
use super::image::RECORDER;
use super::trace::{Memory, Share, TickShares, Trace, Transfers};

/// Symbol of a board's [`Clocks`]: `firmware/stm32/src/times.rs`.
const SYMBOL: &str = "SPECGEN_TIMES";
/// Start of the flash; tightly coupled memory is below.
const FLASH: u64 = 0x0800_0000;
/// Layout version.
const VERSION: u32 = 2;
const WORDS: usize = 16;
/// A tick that leaves less than this share of its period is tight.
const ROOM: f64 = 0.2;
/// Margin on the suggested period: the set-points change with the period.
const MARGIN: f64 = 1.02;

/// Register reads and writes, and instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Work {
    reads: u64,
    writes: u64,
    instructions: u64,
}

/// Reading a pin.
const LOOK: Work = Work { reads: 1, writes: 0, instructions: 0 };

/// Clock settings recorded in a board's image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clocks {
    /// Hz.
    core: u64,
    /// FLASH_ACR and CCR.
    registers: [u32; 2],
    /// SCLK of ADC and DACs, and of DAC read-back, Hz.
    sclk: [u64; 3],
    byte: Work,
    frame: Work,
    /// Overhead of the tick's interrupt.
    interrupt: Work,
    family: Family,
    tightly_coupled: bool,
    /// Address of the recorder's memory.
    recorder: u32,
}

impl Clocks {
    /// The clocks in a board's image.
    ///
    /// # Errors
    /// [`TargetError::MalformedImage`] if the file is damaged or not a board image of this specgen.
    pub fn of(elf: &[u8], mcu: Mcu) -> Result<Self, TargetError> {
        let file = object::File::parse(elf).map_err(TargetError::malformed)?;
        let strange = || TargetError::MalformedImage { text: format!("it has no {SYMBOL} of this specgen") };
        let named = |name: &str| file.symbols().find(|symbol| symbol.name() == Ok(name)).ok_or_else(strange);
        let (symbol, tick) = (named(SYMBOL)?, named(checks::TICKS[0])?.address());
        let index = symbol.section_index().ok_or_else(strange)?;
        let section = file.section_by_index(index).map_err(TargetError::malformed)?;
        let bytes = section
            .data_range(symbol.address(), 4 * WORDS as u64)
            .map_err(TargetError::malformed)?
            .ok_or_else(strange)?;
        let words: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let [version, core, access, control, adc, dac, back, rest @ ..] =
            words.first_chunk::<WORDS>().ok_or_else(strange)?;
        let work = |at: usize| Work {
            reads: u64::from(rest[at]),
            writes: u64::from(rest[at + 1]),
            instructions: u64::from(rest[at + 2]),
        };
        if *version != VERSION || *core == 0 || *adc == 0 || *dac == 0 || *back == 0 {
            return Err(strange());
        }
        Ok(Self {
            core: u64::from(*core),
            registers: [*access, *control],
            sclk: [u64::from(*adc), u64::from(*dac), u64::from(*back)],
            byte: work(0),
            frame: work(3),
            interrupt: work(6),
            family: if mcu.part().double { Family::H7 } else { Family::F4 },
            tightly_coupled: tick < FLASH,
            recorder: file.section_by_name(RECORDER).map_or(0, |section| section.address() as u32),
        })
    }

    /// Memory that holds the code of a tick.
    pub fn memory(&self) -> Memory {
        Memory {
            family: self.family,
            flash: FLASH,
            recorder: self.recorder,
            registers: self.registers,
            tightly_coupled: self.tightly_coupled,
        }
    }

    /// Time per byte and per frame on the buses of ADC and DACs, per pin read, and extra time per read-back byte, ns.
    pub fn buses(&self) -> [u64; 6] {
        let nanoseconds = |cycles: u64| cycles * 1_000_000_000 / self.core;
        let [byte, frame] = [self.byte, self.frame].map(|work| nanoseconds(self.cycles(work)));
        let [adc, dac, back] = self.sclk.map(|hertz| byte.max(8_000_000_000 / hertz));
        [adc, frame, dac, frame, nanoseconds(self.cycles(LOOK)), back.saturating_sub(dac)]
    }

    fn cycles(&self, work: Work) -> u64 {
        let cost = Cost::new(self.family, true);
        work.reads * cost.access(false) + work.writes * cost.access(true) + work.instructions
    }
}

/// Cost of the control law.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Law {
    /// Number of priced ticks, each with empty caches: the first ones of the exercise.
    pub ticks: u64,
    /// Mean, rounded down.
    pub mean: Share,
    /// Most instructions; most cycles, or the estimate for the longest tick of the exercise.
    pub longest: Share,
}

/// Modelled time of a tick, µs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// The board.
    pub board: &'static str,
    /// Period of the spec.
    pub period: f64,
    /// Clock of the core, MHz.
    pub core: f64,
    /// The worst tick.
    pub worst: f64,
    /// Its parts: name and time.
    pub parts: Vec<(&'static str, f64)>,
    /// Cost of the control law on the core.
    pub law: Law,
    /// Bytes, frames and waits of the tick with the most.
    pub moved: Transfers,
    /// The shortest period that leaves a small margin, in steps of 1 µs.
    pub shortest: f64,
}

impl Estimate {
    /// Estimate from the traced ticks. `spread`: most instructions of the law in a long run over its mean.
    ///
    /// # Errors
    /// As [`Trace::price`].
    pub fn of(mcu: Mcu, clocks: &Clocks, trace: &Trace<'_>, period: f64, spread: f64) -> Result<Self, TargetError> {
        let ticks = trace.price(&clocks.memory())?;
        let microseconds = |cycles: u64| cycles as f64 * 1e6 / clocks.core as f64;
        let most = |of: fn(&TickShares) -> u64| ticks.iter().map(of).max().unwrap_or(0);
        let count = ticks.len().max(1) as u64;
        let mean = |of: fn(&Share) -> u64| ticks.iter().map(|tick| of(&tick.law)).sum::<u64>() / count;
        let mean = Share { instructions: mean(|law| law.instructions), cycles: mean(|law| law.cycles) };
        let law = most(|tick| tick.law.cycles).max((mean.cycles as f64 * spread) as u64);
        // Not every tick has the wave and a recorder block; the worst tick has both.
        let sum = |moved: &Transfers| -> (f64, f64, f64) {
            let [adc_byte, adc_frame, dac_byte, dac_frame, ..] = clocks.buses();
            let pins = clocks.cycles(Work { reads: moved.looks, writes: moved.edges, instructions: 0 });
            (
                (moved.adc_bytes * adc_byte + moved.adc_frames * adc_frame) as f64 / 1e3,
                (moved.dac_bytes * dac_byte + moved.dac_frames * dac_frame) as f64 / 1e3,
                moved.waits as f64 / 1e3 + microseconds(pins),
            )
        };
        let whole = |moved: &Transfers| {
            let (adc, dac, waits) = sum(moved);
            adc + dac + waits
        };
        let moved = trace.moved.iter().max_by(|a, b| whole(a).total_cmp(&whole(b))).copied().unwrap_or_default();
        let (adc, dac, waits) = sum(&moved);
        let parts = vec![
            ("interrupt", microseconds(2 * Cost::EXCEPTION + clocks.cycles(clocks.interrupt))),
            ("conversion and waits", waits),
            ("ADC", adc),
            ("law", microseconds(law)),
            ("DACs", dac),
            ("recorder", microseconds(most(|tick| tick.recorder.cycles))),
            ("wave", microseconds(most(|tick| tick.wave.cycles))),
            ("board", microseconds(most(|tick| tick.board.cycles))),
        ];
        let worst = parts.iter().fold(0.0, |sum, (_, time)| sum + time);
        let longest = Share { instructions: most(|tick| tick.law.instructions), cycles: law };
        let law = Law { ticks: ticks.len() as u64, mean, longest };
        let core = clocks.core as f64 / 1e6;
        Ok(Self {
            board: mcu.part().board,
            period: period * 1e6,
            core,
            worst,
            parts,
            law,
            moved,
            shortest: up(worst * MARGIN),
        })
    }

    /// The worst tick is longer than the period.
    pub fn too_long(&self) -> bool {
        self.worst > self.period
    }

    /// A period with enough margin, in steps of 1 µs.
    pub fn roomy(&self) -> f64 {
        up(self.worst * MARGIN / (1.0 - ROOM))
    }

    /// It fits, but leaves less than a fifth of the period.
    pub fn tight(&self) -> bool {
        !self.too_long() && self.worst > (1.0 - ROOM) * self.period
    }
}

/// Rounds up; tick times are far below 2^53 µs.
fn up(value: f64) -> f64 {
    let whole = value as u64 as f64;
    if whole < value { whole + 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(worst: f64, period: f64) -> Estimate {
        Estimate {
            board: "",
            period,
            core: 400.0,
            worst,
            parts: Vec::new(),
            law: Law::default(),
            moved: Transfers::default(),
            shortest: up(worst * MARGIN),
        }
    }

    /// The suggested periods are accepted, and not much longer than needed.
    #[test]
    fn suggested_periods_fit() {
        for worst in [0.01, 19.99, 20.0, 49.1, 147.8, 999.9] {
            let one = estimate(worst, worst * 0.999);
            assert!(one.too_long() && !one.tight(), "{worst}");
            assert!(!estimate(worst, one.shortest).too_long() && one.shortest <= worst * MARGIN + 1.0, "{worst}");
            let other = estimate(worst, worst);
            assert!(other.tight() && !other.too_long(), "{worst}");
            let roomy = estimate(worst, other.roomy());
            assert!(!roomy.tight() && !roomy.too_long(), "{worst}");
        }
    }

    #[test]
    fn an_image_without_clocks_is_refused() {
        assert!(Clocks::of(b"no image", Mcu::named("stm32h743zi").unwrap()).is_err());
    }
}
