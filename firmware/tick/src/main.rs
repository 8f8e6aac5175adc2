//! A board's tick, including its drivers, with simulated converters: the emulator traces the executed instructions, and specgen
//! converts them to cycles. Wave, pass, recorder and new settings are active together, as in the worst case on a board.
//!
//! Reads rows of INPUT_WORDS words, a closed loop from rest, from `input.bin` in the emulator's working folder, and the times of the
//! board's buses from `rates.bin`; writes the bus operations of each tick to `counts.bin` ([`parts::COUNTS`] words). A tick begins at
//! `specgen_timed_tick` and ends at `specgen_timed_end`; code between `specgen_aside_begin` and `specgen_aside_end` belongs to the
//! simulated parts.

#![no_std]
#![no_main]

#[path = "../../stm32/src/memory.rs"]
mod memory;
#[path = "../../qemu/src/panic.rs"]
mod panic;
mod parts;
#[allow(dead_code)] // It writes no file.
#[path = "../../qemu/src/semihosting.rs"]
mod semihosting;
#[path = "../../qemu/src/start.rs"]
mod start;

use controller::sensing::CONVERTER;
use controller::supervised::{IDENTIFIED, Phase, Request, machine_at_reset};
use controller::waves::{self, Wave};
use controller::{COMMAND_WORDS, Config, INPUT_WORDS, Real, passes, triggers};
use parts::{ADC_BITS, Bench, Bus, Delay, Line, Pin, REFERENCE, Rates, Role};
use semihosting::{Exit, File, exit};
use specgen_board::{Board, Exchange, MachineSnapshot, SampleMemory, TargetStatus, catch_up, gather};
use specgen_hal::CHANNELS;
use specgen_hal::ad5686r::Ad5686rPair;
use specgen_hal::ad7606::Ad7606;
use specgen_runtime::Real as _;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::Knot;

/// Words of the recorder: several blocks, so that ticks that start a block are included.
const RECORD: usize = 32 * 1024;
/// Ticks between changes of settings.
const SETTINGS_EVERY: usize = 16;

/// Ticks per row for a subscribed host.
const WATCHED: u32 = 100;

/// A pass with a knot in every tick, the worst case. It restarts when it ends.
const KNOTS: usize = 64;
const PASS: Course = Course { spacing: 1, before: 0, ticks: KNOTS as u32, trajectory: 0 };

/// The converters' drivers with simulated parts.
type Adc<'b> = Ad7606<ADC_BITS, Bus<'b>, Line<'b>, Pin<'b>, Pin<'b>, Delay<'b>>;
type Dacs<'b> = Ad5686rPair<Bus<'b>, Bus<'b>, Line<'b>, Pin<'b>, Delay<'b>>;

/// State of a tick.
struct Fixture<'m> {
    board: Board<'m, Adc<'m>, Dacs<'m>, [Option<Pin<'m>>; triggers::MOST]>,
    exchange: Exchange,
    /// Settings written by a host.
    settings: Config,
    /// Separate from the exchange, whose commands come from the rows.
    wave: Wave,
    waved: [u64; COMMAND_WORDS],
    player: Player<'static, Real>,
}

extern "C" fn main() -> ! {
    exit(match run() {
        Ok(()) => Exit::Done,
        Err(code) => code,
    })
}

fn run() -> Result<(), Exit> {
    let input = File::open(b"input.bin\0").ok_or(Exit::NoInput)?;
    let output = File::create(b"counts.bin\0").ok_or(Exit::CannotWrite)?;
    let mut machine = machine_at_reset();
    // It enters Running with the first tick, as after arming, or an open drive that is all there is.
    machine.supervisor.phase = Phase::Holding;
    let mut exchange = Exchange::new();
    let (words, kept, knots, samples) = memories();
    exchange.record(words, kept);
    exchange.show(samples, u32::MAX);
    let _ = exchange.watch(WATCHED);
    exchange.command.request = if IDENTIFIED { Request::Run } else { Request::Drive };
    let wave = Wave::new(waves::limits(&exchange.config));
    let bench = &Bench::new(rates()?);
    let mut lines = [(); triggers::LINES].into_iter();
    let lines = [(); triggers::MOST].map(|()| lines.next().map(|()| Pin { bench }));
    let board = Board::with_lines(adc(bench), dacs(bench), lines, &mut machine, true);
    let mut timed = Fixture {
        board,
        exchange,
        settings: Config::new(),
        wave,
        waved: [0; COMMAND_WORDS],
        player: Player::new(knots),
    };
    bench.codes.set(codes_of(&[0; INPUT_WORDS]));
    timed.board.start(&mut timed.exchange.report);
    bench.take();
    timed.wave.start();
    let mut row = [0; INPUT_WORDS];
    let mut ticks = 0_usize;
    loop {
        match input.read(&mut row) {
            0 => break,
            bytes if bytes == size_of_val(&row) => {}
            _ => return Err(Exit::InputSize),
        }
        bench.codes.set(codes_of(&row));
        for (slot, word) in timed.exchange.command.command.iter_mut().zip(row) {
            *slot = word;
        }
        timed.exchange.host_alive();
        if ticks.is_multiple_of(SETTINGS_EVERY) {
            timed.exchange.next = Some(timed.settings);
        }
        if passes::POSSIBLE && !timed.player.is_running() {
            timed.player.begin(PASS);
        }
        specgen_timed_tick(&mut timed);
        specgen_timed_end();
        // The work of the background.
        let Fixture { board, exchange, .. } = &mut timed;
        catch_up(&mut |action| action(exchange, board.machine_mut()), || true);
        gather(&mut |action| action(exchange, board.machine_mut()));
        if !output.write(&bench.take()) {
            return Err(Exit::CannotWrite);
        }
        ticks += 1;
    }
    // Ticks of a machine that stopped running do not count.
    let runs = !IDENTIFIED || timed.board.machine().supervisor.phase == Phase::Running;
    if runs { Ok(()) } else { Err(Exit::NotRunning) }
}

fn adc(bench: &Bench) -> Adc<'_> {
    let bus = Bus { bench, dac: None };
    Ad7606::new(bus, Line { bench, role: Role::Convst }, Pin { bench }, Pin { bench }, Delay(bench), REFERENCE)
}

fn dacs(bench: &Bench) -> Dacs<'_> {
    let [first, second] = [0, 1].map(|part| Bus { bench, dac: Some(part) });
    Ad5686rPair::new(first, second, Line { bench, role: Role::Ldac }, Pin { bench }, Delay(bench))
}

/// Times of the board's buses, ns.
fn rates() -> Result<Rates, Exit> {
    let mut words = [0; 6];
    let file = File::open(b"rates.bin\0").ok_or(Exit::NoInput)?;
    if file.read(&mut words) != size_of_val(&words) {
        return Err(Exit::InputSize);
    }
    let [adc_byte, adc_frame, dac_byte, dac_frame, look, back] = words;
    Ok(Rates { adc: [adc_byte, adc_frame], dac: [dac_byte, dac_frame], look, back })
}

/// Codes of the gauges' converter.
fn codes_of(row: &[u64; INPUT_WORDS]) -> [i32; CHANNELS] {
    let mut codes = [0; CHANNELS];
    for (code, word) in codes.iter_mut().zip(row.iter().skip(COMMAND_WORDS)) {
        *code = ((Real::from_word(*word) - CONVERTER.at_zero) / CONVERTER.per_code + 0.5) as i32;
    }
    codes
}

#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`: specgen looks this symbol up in the image.
fn specgen_timed_tick(timed: &mut Fixture<'_>) {
    if let Some(motion) = timed.wave.advance() {
        waves::write(&motion, timed.wave.sequence(), false, &mut timed.waved);
    }
    timed.board.tick(&mut timed.exchange, TargetStatus::default());
    // As in the exchange, which does not combine its command (here from the rows) with a wave.
    if passes::POSSIBLE {
        pass(timed);
    }
}

#[inline(never)]
fn pass(timed: &mut Fixture<'_>) {
    let Fixture { player, board, waved, exchange, .. } = timed;
    if let Some([target, pose]) = passes::shown(&board.machine().state) {
        player.keep(&target, &pose, exchange.report.status);
    }
    if let Some(given) = player.give() {
        passes::write(&given, waved);
    }
}

#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // As above.
extern "C" fn specgen_timed_end() {
    // SAFETY: a `nop`.
    unsafe { core::arch::asm!("nop") };
}

/// The recorder's memories, for a single call.
#[allow(unsafe_code, clippy::deref_addrof)] // Statics that are written, to which no plain reference may be taken.
fn memories() -> (&'static mut [u64], &'static mut MachineSnapshot, &'static mut [Knot], &'static mut SampleMemory) {
    static mut MEMORY: [u64; RECORD] = [0; RECORD];
    static mut KEPT: MachineSnapshot = MachineSnapshot::new();
    static mut PLAYED: [Knot; 2 * KNOTS] = [[0; 6]; 2 * KNOTS];
    static mut SAMPLES: SampleMemory = SampleMemory::new();
    // SAFETY: called once, by `run`; no interrupt is enabled.
    unsafe { (&mut *(&raw mut MEMORY), &mut *(&raw mut KEPT), &mut *(&raw mut PLAYED), &mut *(&raw mut SAMPLES)) }
}
