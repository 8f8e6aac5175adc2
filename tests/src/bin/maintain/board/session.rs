//! A running emulated board with its machine.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use specgen_language::{SpecSource, spec};
use specgen_toolchain::provision;

use super::Trial;

/// Longest time of an answer, on a busy computer.
const ANSWER: Duration = Duration::from_secs(600);

/// The processes of board and plant. Both end with it.
pub struct Session {
    plant: Child,
    board: Child,
    commands: ChildStdin,
    lines: Receiver<String>,
    socket: PathBuf,
    shared: PathBuf,
    /// The board's log, each line with its time.
    pub log: Vec<String>,
}

/// State of a board.
pub struct Report {
    /// `name=value`, separated by blanks.
    pub text: String,
    /// Violations of data sheets.
    pub violations: Vec<String>,
}

impl Report {
    /// A number of the report.
    pub fn value(&self, name: &str) -> Option<f64> {
        let values = self.text.split(' ').filter_map(|word| word.split_once('='));
        values.into_iter().find(|(known, _)| *known == name)?.1.parse().ok()
    }
}

impl Report {
    /// The longest tick, µs: the last of smallest, mean and largest.
    pub fn longest_tick(&self) -> Option<f64> {
        let times = self.text.split(' ').find_map(|word| word.strip_prefix("tick_us="))?;
        times.rsplit('/').next()?.parse().ok()
    }
}

impl Session {
    pub fn begin(trial: &Trial) -> Result<Self, String> {
        Self::with(trial, &[])
    }

    /// The same with more arguments for `specgen plant`.
    pub fn with(trial: &Trial, more: &[&str]) -> Result<Self, String> {
        static BEGUN: AtomicU32 = AtomicU32::new(0);
        let engine = provision::engine(&mut |_| {}).map_err(|error| error.to_string())?;
        let bits = gauge_bits(&trial.spec)?;
        // A unique name.
        let name = format!("board-{}-{}", std::process::id(), BEGUN.fetch_add(1, Ordering::Relaxed));
        let shared = Path::new("/dev/shm").join(format!("specgen-plant-{name}"));
        let socket = trial.folder.join(format!("{name}.sock"));
        let mut plant = Command::new(trial.programs.join("specgen"));
        plant
            .arg("plant")
            .arg(&trial.spec)
            .args(["--name", &name])
            .args(more)
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let plant = plant.spawn().map_err(|error| format!("specgen plant: {error}"))?;
        let mut board = Command::new(trial.programs.join("emulated-board"));
        board.arg("--library").arg(engine).args(["--target", trial.target, "--bits", &bits, "--plant", &name]);
        if trial.cycles {
            board.arg("--cycles");
        }
        board.arg("--socket").arg(&socket).arg(&trial.image).stdin(Stdio::piped()).stdout(Stdio::piped());
        let (plant, mut board) = started(plant, &shared, board)?;
        let (Some(commands), Some(output)) = (board.stdin.take(), board.stdout.take()) else {
            return Err("the emulated board has no pipes".to_owned());
        };
        let lines = lines_of(output);
        let mut session = Self { plant, board, commands, lines, socket, shared, log: Vec::new() };
        wait_for(&session.socket, &mut session.board)?;
        Ok(session)
    }

    /// `specgen operate` or another host on its link.
    pub fn command_of(&self, trial: &Trial, name: &str) -> Command {
        let mut host = Command::new(trial.programs.join("specgen"));
        host.current_dir(&trial.folder).arg(name).arg("--socket").arg(&self.socket).arg(&trial.spec);
        host
    }

    /// Sends a command that the board answers with one line.
    pub fn command(&mut self, command: &str) -> Result<Report, String> {
        writeln!(self.commands, "{command}").map_err(|error| format!("the emulated board: {error}"))?;
        let mut violations = Vec::new();
        loop {
            let line = self.lines.recv_timeout(ANSWER).map_err(|_| "the emulated board does not answer")?;
            if let Some(text) = line.strip_prefix("! ") {
                violations.push(text.to_owned());
            } else if let Some(text) = line.strip_prefix("# ") {
                self.log.push(text.to_owned());
            } else if line != "ready" {
                return Ok(Report { text: line, violations });
            }
        }
    }

    /// Time of the last log entry of an event, ms.
    pub fn logged(&self, what: &str) -> Option<f64> {
        self.times(what).next_back()
    }

    /// Time of the first log entry of an event, ms.
    pub fn first_logged(&self, what: &str) -> Option<f64> {
        self.times(what).next()
    }

    fn times<'a>(&'a self, what: &'a str) -> impl DoubleEndedIterator<Item = f64> + 'a {
        let lines = self.log.iter().filter_map(|line| line.split_once(" ms: "));
        lines.filter(move |(_, text)| text.starts_with(what)).filter_map(|(time, _)| time.parse().ok())
    }

    pub fn report(&mut self) -> Result<Report, String> {
        self.command("report")
    }

    /// The board's time, ms.
    pub fn time(&mut self) -> Result<f64, String> {
        self.command("time")?.value("time_ms").ok_or_else(|| "the board does not say its time".to_owned())
    }

    /// Waits until so much of the board's time has passed, ms.
    pub fn pass(&mut self, time: f64) -> Result<(), String> {
        let end = self.time()? + time;
        while self.time()? < end {
            thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        end(&mut self.board);
        end(&mut self.plant);
        // Killed processes leave it behind.
        let _ = fs::remove_file(&self.shared);
        let _ = fs::remove_file(&self.socket);
    }
}

/// The output lines of a process as they arrive.
fn lines_of(output: ChildStdout) -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

fn end(process: &mut Child) {
    // It may have ended.
    let _ = process.kill();
    let _ = process.wait();
}

/// Starts the board once the machine is ready.
fn started(mut plant: Child, shared: &Path, mut board: Command) -> Result<(Child, Child), String> {
    let there = wait_for(shared, &mut plant);
    match there.and_then(|()| board.spawn().map_err(|error| format!("the emulated board: {error}"))) {
        Ok(board) => Ok((plant, board)),
        Err(why) => {
            end(&mut plant);
            Err(why)
        }
    }
}

/// Waits until the process has created a file.
fn wait_for(path: &Path, process: &mut Child) -> Result<(), String> {
    let begin = Instant::now();
    while !path.exists() {
        if !matches!(process.try_wait(), Ok(None)) || begin.elapsed() > ANSWER {
            return Err(format!("{} did not come to be, see above", path.display()));
        }
        thread::sleep(Duration::from_millis(20));
    }
    Ok(())
}

fn gauge_bits(path: &Path) -> Result<String, String> {
    let source = SpecSource::read(path).map_err(|finding| finding.message)?;
    let (model, _) = spec::load(&source);
    Ok(model.ok_or_else(|| format!("{} is refused", path.display()))?.sensor.bits.to_string())
}

/// A host that runs until it is ended.
pub struct Host {
    process: Child,
    lines: Receiver<String>,
}

impl Host {
    pub fn of(mut command: Command) -> Result<Self, String> {
        let command = command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().map_err(|error| format!("specgen operate: {error}"))?;
        let output = process.stdout.take().ok_or("specgen operate has no pipe")?;
        Ok(Self { process, lines: lines_of(output) })
    }

    /// Sends commands and waits for these words; returns the line that contains them.
    pub fn order(&mut self, orders: &str, words: &str) -> Result<String, String> {
        let input = self.process.stdin.as_mut().ok_or("specgen operate has no pipe")?;
        writeln!(input, "{orders}").map_err(|error| format!("specgen operate: {error}"))?;
        loop {
            let line = self.lines.recv_timeout(ANSWER).map_err(|_| format!("the host does not say `{words}`"))?;
            if line.contains(words) {
                return Ok(line);
            }
        }
    }

    /// Sends commands one after the other, each when the words of those before it have come.
    pub fn orders(&mut self, all: &[(&str, &str)]) -> Result<(), String> {
        all.iter().try_for_each(|(orders, words)| self.order(orders, words).map(drop))
    }

    pub fn end(&mut self) {
        end(&mut self.process);
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.end();
    }
}
