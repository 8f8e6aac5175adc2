//! The board's image, unmodified, on an emulated core with models of what is around it; see `docs/bring-up.md`.
//!
//! Commands come from standard input, one a line; each is answered by one line on standard output.

mod ad5686r;
mod ad7606;
mod board;
mod dma;
mod elf;
mod enable;
mod exti;
mod fault;
mod gpio;
mod line;
mod machine;
mod meter;
mod mpu;
mod nvic;
mod part;
mod plant;
mod pulses;
mod rcc;
mod spi;
mod store;
mod time;
mod timer;
mod unicorn;
mod usart;
mod violations;
mod watchdog;

use std::io::BufRead;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

use board::Board;
use fault::Fault;
use line::Line;
use machine::Machine;
use meter::Meter;
use plant::Plant;
use time::{MICROSECOND, Time, microseconds};

const USAGE: &str = "usage: emulated-board --library FILE --target BOARD --bits N [--plant NAME] [--socket PATH] [--cycles] IMAGE

  --library FILE  the Unicorn engine, libunicorn.so.2
  --bits N        of a gauge: sensor.bits of the spec
  --plant NAME    the machine that `specgen plant --name NAME` serves; gauges in mid-range if not given
  --socket PATH   where a host finds the link: `specgen operate --socket PATH`
  --cycles        times by the model of specgen-cycles; one cycle an instruction if not given

Commands on standard input: run MS, input high|low, fail FAULT, heal, time, report, registers, quit. Without --socket the board runs by `run` alone.";

struct Options {
    library: PathBuf,
    part: &'static part::Part,
    bits: u32,
    plant: Option<String>,
    socket: Option<PathBuf>,
    cycles: bool,
    image: PathBuf,
}

fn options() -> Option<Options> {
    let mut arguments = std::env::args().skip(1);
    let (mut library, mut part, mut bits, mut plant, mut socket, mut image) = (None, None, None, None, None, None);
    let mut cycles = false;
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--library" => library = Some(arguments.next()?.into()),
            "--target" => {
                let name = arguments.next()?;
                part = Some(part::PARTS.iter().find(|(target, _)| *target == name)?.1);
            }
            "--bits" => bits = arguments.next()?.parse().ok().filter(|bits| (8..=18).contains(bits)),
            "--plant" => plant = Some(arguments.next()?),
            "--socket" => socket = Some(arguments.next()?.into()),
            "--cycles" => cycles = true,
            file if !file.starts_with('-') => image = Some(file.into()),
            _ => return None,
        }
    }
    Some(Options { library: library?, part: part?, bits: bits?, plant, socket, cycles, image: image? })
}

fn main() -> ExitCode {
    let Some(options) = options() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match serve(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("emulated-board: {text}");
            ExitCode::FAILURE
        }
    }
}

fn serve(options: &Options) -> Result<(), String> {
    let file = std::fs::read(&options.image).map_err(|error| format!("{}: {error}", options.image.display()))?;
    let image = elf::segments(&file).ok_or_else(|| format!("{} is no image", options.image.display()))?;
    let described = |key: &str| elf::described(&file, key).ok_or(format!("the image does not say its {key}"));
    let period: f64 = described("period")?.parse().map_err(|_| "the image's period is no number")?;
    let plant = match &options.plant {
        Some(name) => Plant::served(name, described("digest")?, (period * 1e6 * MICROSECOND as f64) as Time)?,
        None => Plant::Still,
    };
    let mut flash = vec![0xff; options.part.memories[0][1] as usize];
    for segment in &image {
        let at = segment.address.wrapping_sub(options.part.flash) as usize;
        let place = flash.get_mut(at..at + segment.bytes.len());
        place.ok_or("the image is larger than the flash")?.copy_from_slice(&segment.bytes);
    }
    // Code that runs elsewhere than in flash.
    let mut tightly = Vec::new();
    for segment in image.iter().filter(|segment| segment.runs_at < board::TIGHTLY) {
        tightly.resize(segment.runs_at as usize, 0);
        tightly.extend_from_slice(&segment.bytes);
    }
    let adc_bits = if options.bits <= 16 { 16 } else { 18 };
    let board = Board::new(options.part, [flash, tightly], [adc_bits, options.bits], plant, options.cycles);
    let mut machine = Machine::new(&options.library, board, &image)?;
    let mut line = match &options.socket {
        Some(path) => Some(Line::listen(path).map_err(|error| format!("{}: {error}", path.display()))?),
        None => None,
    };
    let commands = commands();
    println!("ready");
    let begun = Instant::now();
    let mut until: Time = 0;
    loop {
        // Without a line, one command after the other.
        let waits = line.is_none() && machine.board().now >= until;
        let command = if line.is_none() && !waits { Next::None } else { next(&commands, waits) };
        match command {
            Next::Command(command) => {
                let answer = obey(&mut machine, &command, &mut until);
                let Some(answer) = answer else { return Ok(()) };
                println!("{answer}");
            }
            Next::None => {}
            Next::End => return Ok(()),
        }
        if line.is_none() && machine.board().now >= until {
            continue;
        }
        let now = machine.board().now;
        if let Some(line) = line.as_mut().filter(|line| line.holds(now)) {
            std::thread::sleep(Duration::from_millis(1));
            machine.board().look(Some(line));
            continue;
        }
        machine.run();
        let board = machine.board();
        for text in board.log.drain(..) {
            println!("# {text}");
        }
        if let Some(text) = board.broken.take() {
            return Err(text);
        }
        let now = board.now;
        board.look(line.as_mut());
        // Not faster than a board: the host's times are real ones.
        let ahead = Duration::from_secs_f64(microseconds(now) * 1e-6).saturating_sub(begun.elapsed());
        if line.is_some() && ahead > Duration::from_millis(1) {
            std::thread::sleep(ahead);
        }
    }
}

enum Next {
    Command(String),
    None,
    End,
}

fn next(commands: &Receiver<String>, wait: bool) -> Next {
    if wait {
        return commands.recv().map_or(Next::End, Next::Command);
    }
    match commands.try_recv() {
        Ok(command) => Next::Command(command),
        Err(TryRecvError::Empty) => Next::None,
        Err(TryRecvError::Disconnected) => Next::End,
    }
}

/// Lines of standard input.
fn commands() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// The answer to a command; none at the end.
fn obey(machine: &mut Machine, command: &str, until: &mut Time) -> Option<String> {
    let words: Vec<&str> = command.split_whitespace().collect();
    Some(match words[..] {
        ["quit"] => return None,
        ["run", time] => match time.parse::<f64>() {
            Ok(time) if time >= 0.0 => {
                *until = machine.board().now + (time * 1000.0 * MICROSECOND as f64) as Time;
                "running".to_owned()
            }
            _ => format!("expected milliseconds, found {time}"),
        },
        ["input", level @ ("high" | "low")] => {
            machine.board().drive_input(level == "high");
            "driven".to_owned()
        }
        ["fail", name] => match Fault::of(name) {
            Some(fault) => {
                machine.fail(fault);
                "failed".to_owned()
            }
            None => format!("no fault {name}; there are {}", fault::NAMES.map(|(name, _)| name).join(", ")),
        },
        ["heal"] => {
            machine.board().heal();
            "healed".to_owned()
        }
        ["time"] => format!("time_ms={:.3}", microseconds(machine.board().now) / 1e3),
        ["report"] => report(machine.board()),
        ["registers"] => {
            let touched: Vec<String> = machine.board().unmodelled.iter().map(|at| format!("{at:#x}")).collect();
            touched.join(" ")
        }
        _ => format!("no command {command}"),
    })
}

/// How the board stands, and times since the last report.
fn report(board: &mut Board) -> String {
    let meter: Meter = std::mem::take(&mut board.meter);
    for text in board.violations.lines() {
        println!("! {text}");
    }
    let (ms, resets, enable) = (microseconds(board.now) / 1e3, board.resets, u8::from(board.enabled()));
    let (conversions, instructions, stack) = (board.adc.conversions, board.instructions, board.stack);
    let (metered, clock, violations) = (meter.text(), board.clock_text(), board.violations.lines().count());
    format!(
        "time_ms={ms:.3} resets={resets} enable={enable} conversions={conversions} instructions={instructions} stack={stack:#x} {metered} {clock} violations={violations}"
    )
}
