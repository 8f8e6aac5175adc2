//! Traces the instructions of a board's tick in the emulator and prices them by the cycle model.
//!
//! The image is that of `firmware/tick`: the board's tick with stand-ins for its converters. The emulator logs the blocks
//! it executes. The instructions between two of them are decoded here; they must end in a branch from one to the next.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::time::Duration;

use object::{Object, ObjectSection, ObjectSymbol, SectionKind};
use serde::Serialize;
use specgen_cycles::{Cost, Family};
use specgen_language::interrupt::Scratch;

use super::build::Image;
use super::emulator::Emulator;
use super::error::TargetError;
use super::owner;
use super::panics::{self, DebugInfo};
use super::replay::{read_words, write_words};
use super::thumb::{self, Branch, Instruction};

/// Start and end of a tick; start and end of code that does not count.
const MARKS: [&str; 4] = ["specgen_timed_tick", "specgen_timed_end", "specgen_aside_begin", "specgen_aside_end"];
/// A block ends with its page; this is the smallest page size, bytes.
const PAGE: u64 = 1024;

/// Cost of a part of a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Share {
    /// Instructions.
    pub instructions: u64,
    /// Cycles of the core, modelled.
    pub cycles: u64,
}

/// Cost of a tick by owner.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct TickShares {
    /// The supervised law.
    pub law: Share,
    /// The recorder: row, digest, settings, snapshot.
    pub recorder: Share,
    /// The wave.
    pub wave: Share,
    /// Code of the board around them.
    pub board: Share,
}

impl TickShares {
    /// The sum.
    pub fn whole(&self) -> Share {
        let all = [self.law, self.recorder, self.wave, self.board];
        all.iter().fold(Share::default(), |sum, share| Share {
            instructions: sum.instructions + share.instructions,
            cycles: sum.cycles + share.cycles,
        })
    }
}

/// Memory layout and speed for the code of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// The core and its flash interface.
    pub family: Family,
    /// First address of the flash.
    pub flash: u64,
    /// Address of the recorder's memory.
    pub recorder: u32,
    /// FLASH_ACR and CCR, inputs of the cycle model.
    pub registers: [u32; 2],
    /// The tick's code is in tightly coupled memory instead of flash.
    pub tightly_coupled: bool,
}

/// Converter accesses of a tick, as counted by `firmware/tick`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Transfers {
    /// Bytes from the ADC.
    pub adc_bytes: u64,
    /// Frames from the ADC.
    pub adc_frames: u64,
    /// Bytes to the DACs.
    pub dac_bytes: u64,
    /// Frames to the DACs.
    pub dac_frames: u64,
    /// Waits, ns: conversion and data-sheet delays.
    pub waits: u64,
    /// Pin reads.
    pub looks: u64,
    /// Pin edges.
    pub edges: u64,
}

impl Transfers {
    fn of(words: &[u64; 7]) -> Self {
        let [adc_bytes, adc_frames, dac_bytes, dac_frames, waits, looks, edges] = *words;
        Self { adc_bytes, adc_frames, dac_bytes, dac_frames, waits, looks, edges }
    }
}

/// Addresses of the executed blocks of every tick, and its converter accesses.
#[derive(Debug)]
pub struct Trace<'a> {
    elf: &'a [u8],
    /// By tick: runs of consecutive blocks.
    ticks: Vec<Vec<Vec<u64>>>,
    /// By tick.
    pub moved: Vec<Transfers>,
}

/// Runs the image on `inputs`, with rows as for [`replay`](super::replay()) and the words that `firmware/tick` reads from `rates.bin`.
///
/// # Errors
/// As [`replay`](super::replay()).
pub fn trace<'a>(
    image: &'a Image,
    inputs: &[Vec<u64>],
    buses: [u64; 6],
    limit: Duration,
) -> Result<Trace<'a>, TargetError> {
    let emulator = Emulator::find()?;
    let folder = Scratch::new().map_err(|e| TargetError::io("creating a folder in", std::env::temp_dir(), e))?;
    write_words(&folder.path().join("input.bin"), inputs.iter().flatten().copied())?;
    write_words(&folder.path().join("rates.bin"), buses.into_iter())?;
    let log = folder.path().join("blocks.log");
    emulator.run(image, folder.path(), &["-d", "exec,nochain", "-D", "blocks.log"], limit)?;
    let counts = read_words(&folder.path().join("counts.bin"))?;
    let moved: Vec<Transfers> = counts.as_chunks().0.iter().map(Transfers::of).collect();

    let mut reader = Reader { marks: marks(&image.elf)?, ticks: Vec::new(), within: false, aside: false };
    let reading = |error| TargetError::io("reading", &log, error);
    for line in BufReader::new(File::open(&log).map_err(reading)?).split(b'\n') {
        if let Some((executed, address)) = block(&line.map_err(reading)?) {
            reader.take(executed, address);
        }
    }
    let Reader { ticks, within, .. } = reader;
    if ticks.len() != inputs.len() || moved.len() != inputs.len() || within {
        return Err(misread(format!("{} of {} ticks were logged", ticks.len(), inputs.len())));
    }
    Ok(Trace { elf: &image.elf, ticks, moved })
}

/// Assigns blocks to ticks.
struct Reader {
    marks: [u64; 4],
    ticks: Vec<Vec<Vec<u64>>>,
    within: bool,
    aside: bool,
}

impl Reader {
    fn take(&mut self, executed: bool, address: u64) {
        let [begin, end, aside, back] = self.marks;
        if address == begin && executed {
            self.within = true;
            self.ticks.push(vec![Vec::new()]);
        }
        let Some(tick) = self.ticks.last_mut().filter(|_| self.within) else { return };
        let Some(run) = tick.last_mut() else { return };
        if !executed {
            // It was logged but did not run.
            if run.last() == Some(&address) {
                run.pop();
            }
            return;
        }
        if !self.aside {
            run.push(address);
        }
        if address == aside {
            self.aside = true;
        } else if address == back {
            self.aside = false;
            tick.push(vec![address]);
        }
        self.within = address != end;
    }
}

/// `Trace 0: 0x7f0c4c000100 [00400000/0000012c/00000110/ff000201] name`: an executed block and its address; `Stopped execution of TB chain
/// before 0x7f0c4c000100 [0000012c] name`: a block that did not run.
fn block(line: &[u8]) -> Option<(bool, u64)> {
    let text = std::str::from_utf8(line).ok()?;
    let inside = text.split_once('[')?.1.split_once(']')?.0;
    let executed = text.starts_with("Trace ");
    let address = if executed { inside.split('/').nth(1)? } else { inside };
    (executed || text.starts_with("Stopped ")).then_some(())?;
    Some((executed, u64::from_str_radix(address, 16).ok()?))
}

impl Trace<'_> {
    /// Cost of each tick. Caches are empty at its start, because the background has run in between.
    ///
    /// # Errors
    /// [`TargetError::MalformedImage`] if the sequence of blocks does not match the image.
    pub fn price(&self, memory: &Memory) -> Result<Vec<TickShares>, TargetError> {
        let code = Code::of(self.elf)?;
        let debug = panics::debug_info(self.elf)?;
        let mut places = BTreeMap::new();
        self.ticks
            .iter()
            .map(|blocks| {
                let mut cost = Cost::new(memory.family, true);
                let [access, control] = memory.registers;
                cost.configure(access, control);
                let mut computed = TickShares::default();
                for pair in blocks.iter().flat_map(|run| run.windows(2)) {
                    code.walk(pair[0], pair[1], |instruction| {
                        let address = instruction.place + if memory.tightly_coupled { 0 } else { memory.flash };
                        // Addresses have 32 bits on these parts.
                        let mut cycles = cost.of(address as u32, instruction.size(), instruction.halves());
                        let (who, far) =
                            places.entry(instruction.place).or_insert_with(|| who(&debug, instruction.place));
                        if *far {
                            let words = Cost::stored(instruction.size(), instruction.halves());
                            cycles += (0..words).map(|_| cost.data(memory.recorder, true)).sum::<u64>();
                        }
                        let share = match who {
                            CodeOwner::Law => &mut computed.law,
                            CodeOwner::Recorder => &mut computed.recorder,
                            CodeOwner::Wave => &mut computed.wave,
                            CodeOwner::Board => &mut computed.board,
                        };
                        share.instructions += 1;
                        share.cycles += cycles;
                    })?;
                }
                Ok(computed)
            })
            .collect()
    }
}

/// Owner of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CodeOwner {
    Law,
    Recorder,
    Wave,
    Board,
}

/// The owner by the source file of the line and of its inlined callers; true if its stores go to the recorder's memory.
fn who(debug: &DebugInfo<'_>, address: u64) -> (CodeOwner, bool) {
    let mut found = (CodeOwner::Board, false);
    let Ok(mut frames) = debug.find_frames(address).skip_all_loads() else { return found };
    while let Ok(Some(frame)) = frames.next() {
        let file = frame.location.and_then(|location| location.file).unwrap_or_default();
        match of_file(file) {
            Some((CodeOwner::Law, _)) => found = (CodeOwner::Law, false),
            Some(other) => return other,
            None => {}
        }
    }
    found
}

/// The owner by crate and path within it, ignoring outer folders; `None` if the callers decide.
fn of_file(path: &str) -> Option<(CodeOwner, bool)> {
    let (owner, file) = owner::source_of(path);
    let is_law = matches!(owner.as_str(), "controller" | "law" | "runtime");
    if !is_law && owner != "board" {
        return None;
    }
    let name = file.rsplit('/').next().unwrap_or_default();
    match name {
        // The state at the start of a block is written by the snapshot, to the block.
        "ring.rs" | "snapshot.rs" => Some((CodeOwner::Recorder, true)),
        _ if file.starts_with("snapshot/") => Some((CodeOwner::Recorder, true)),
        "recorder.rs" | "record.rs" | "recording.rs" | "digest.rs" => Some((CodeOwner::Recorder, false)),
        "wave.rs" | "waves.rs" => Some((CodeOwner::Wave, false)),
        _ if file.starts_with("wave/") => Some((CodeOwner::Wave, false)),
        _ => is_law.then_some((CodeOwner::Law, false)),
    }
}

/// The code sections of an image.
struct Code<'a> {
    sections: Vec<(u64, &'a [u8])>,
}

impl<'a> Code<'a> {
    fn of(elf: &'a [u8]) -> Result<Self, TargetError> {
        let file = object::File::parse(elf).map_err(TargetError::malformed)?;
        let texts = file.sections().filter(|section| section.kind() == SectionKind::Text);
        let sections = texts.map(|section| Ok((section.address(), section.data().map_err(TargetError::malformed)?)));
        Ok(Self { sections: sections.collect::<Result<_, _>>()? })
    }

    fn at(&self, address: u64) -> Option<Instruction> {
        self.sections.iter().find_map(|(start, bytes)| {
            let at = usize::try_from(address.checked_sub(*start)?).ok()?;
            thumb::one(address, bytes.get(at..)?)
        })
    }

    /// Visits every instruction of a block, up to the start of the next one.
    fn walk(&self, block: u64, next: u64, each: impl FnMut(&Instruction)) -> Result<(), TargetError> {
        let astray = |at: u64| misread(format!("from {block:#x} the emulator went to {next:#x}, past {at:#x}"));
        let (mut at, mut walked) = (block, Vec::new());
        // Number of instructions before `next`, if the block continues past it.
        let mut within = None;
        loop {
            if at == next && at != block {
                within = Some(walked.len());
            }
            let instruction = self.at(at).ok_or_else(|| astray(at))?;
            at += u64::from(instruction.size());
            let (ends, branch) = (instruction.ends_block(), instruction.branch());
            walked.push(instruction);
            if ends {
                let leads = match branch {
                    Some(Branch::Call(target) | Branch::Jump(target)) => next == target || next == at,
                    _ => true,
                };
                if !leads {
                    // For a clock event the emulator stops within a block and resumes from there.
                    walked.truncate(within.ok_or_else(|| astray(at))?);
                }
                break;
            }
            // A page may end here or within the next instruction.
            if at == next && (at / PAGE != block / PAGE || (at + 2) / PAGE != block / PAGE) {
                break;
            }
        }
        walked.iter().for_each(each);
        Ok(())
    }
}

fn misread(text: String) -> TargetError {
    TargetError::MalformedStats { text: format!("unexpected block in the emulator's log: {text}") }
}

/// Addresses of [`MARKS`].
fn marks(elf: &[u8]) -> Result<[u64; 4], TargetError> {
    let file = object::File::parse(elf).map_err(TargetError::malformed)?;
    let mut found = [0; 4];
    for (slot, name) in found.iter_mut().zip(MARKS) {
        let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
        let missing = || TargetError::MalformedImage { text: format!("it has no function {name}") };
        *slot = symbol.ok_or_else(missing)?.address() & !1;
    }
    if (1..MARKS.len()).any(|k| found[..k].contains(&found[k])) {
        return Err(TargetError::MalformedImage { text: format!("some of {} share an address", MARKS.join(", ")) });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn owners_do_not_depend_on_outer_folders() {
        let [law, board, recorder, far, wave] = [
            Some((CodeOwner::Law, false)),
            None,
            Some((CodeOwner::Recorder, false)),
            Some((CodeOwner::Recorder, true)),
            Some((CodeOwner::Wave, false)),
        ];
        // Parts of a controller, relative as in cargo, and below folders with misleading names.
        for folder in
            ["", "/tmp/out/", "/home/me/runtime/out/", "/home/controller/src/wave/snapshot/", "/w/library/core/"]
        {
            for (file, expected) in [
                ("law/src/platform/step.rs", law),
                ("controller/src/lib.rs", law),
                ("runtime/src/memory.rs", law),
                ("runtime/src/setpoint/trajectory.rs", law),
                ("board/src/cycle.rs", board),
                ("hal/src/ad7606.rs", board),
                ("tick/src/main.rs", board),
                ("link/src/frame.rs", board),
                ("runtime/src/recorder.rs", recorder),
                ("board/src/recording.rs", recorder),
                ("runtime/src/digest.rs", recorder),
                ("law/src/snapshot.rs", far),
                ("runtime/src/snapshot/walk.rs", far),
                ("runtime/src/recorder/ring.rs", far),
                ("runtime/src/wave/shape.rs", wave),
                ("law/src/platform/waves.rs", wave),
            ] {
                assert_eq!(of_file(&format!("{folder}{file}")), expected, "{folder}{file}");
            }
        }
        for path in [
            "/home/runtime/.rustup/toolchains/stable/lib/rustlib/src/rust/library/core/src/num/f64.rs",
            "/controller/.cargo/registry/src/index.crates.io-19/embedded-hal-1.0.0/src/spi.rs",
            "",
        ] {
            assert_eq!(of_file(path), None, "{path}");
        }
    }

    #[test]
    fn blocks_are_read_from_the_lines_of_several_versions() {
        let line = b"Trace 0: 0x7f0c4c000100 [00400000/0000012c/00000110/ff000201] specgen_timed_tick".as_slice();
        assert_eq!(block(line), Some((true, 0x12c)));
        let wide = b"Trace 0: 0x7f0c4c000100 [0000000000400000/000000000000012c/00000110/ff000201]".as_slice();
        assert_eq!(block(wide), Some((true, 0x12c)));
        assert_eq!(block(b"Stopped execution of TB chain before 0x7f [0000012c] x"), Some((false, 0x12c)));
        assert_eq!(block(b"Linking TBs 0x7f0c [00000110] index 0"), None);
        assert_eq!(block(b""), None);
    }

    #[test]
    fn a_block_ends_in_a_branch_to_the_next() {
        // movs r0, #1; subs r0, #1; bne .-2; bx lr
        let bytes = [0x01, 0x20, 0x01, 0x38, 0xfd, 0xd1, 0x70, 0x47];
        let code = Code { sections: vec![(0x1000, &bytes)] };
        let count = |from, to| {
            let mut count = 0;
            code.walk(from, to, |_| count += 1).map(|()| count).ok()
        };
        // The loop's head within the block does not end it.
        assert_eq!(count(0x1000, 0x1002), Some(3));
        assert_eq!(count(0x1002, 0x1006), Some(2));
        assert_eq!(count(0x1006, 0x2000), Some(1));
        // A clock event of the emulator may cut a block only between instructions.
        assert_eq!(count(0x1000, 0x1004), Some(2));
        assert_eq!(count(0x1000, 0x1003), None);
        assert_eq!(count(0x1002, 0x1008), None);
        assert_eq!(count(0x3000, 0x3002), None);
    }
}
