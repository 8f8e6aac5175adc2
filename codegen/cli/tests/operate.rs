//! `specgen operate` as a user runs it, with a board on simulated converters at a socket, in real time.

#![allow(clippy::unwrap_used, clippy::panic)] // Helpers of tests, where a panic is a failed test.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use crate::board_support::Line;
use crate::support::{Background, Folder, Run, length};
use controller::supervised::Phase;
use specgen_link::client::Port;

/// A board at a socket.
pub struct SocketBoard {
    pub path: PathBuf,
    /// Phase of the machine, for the test.
    phase: Arc<AtomicU32>,
    /// Set to make the converters fail.
    fails: Arc<AtomicBool>,
    _serves: Background,
}

impl SocketBoard {
    pub fn new(folder: &Folder) -> Self {
        let path = folder.path("board.sock");
        let listener = UnixListener::bind(&path).unwrap();
        listener.set_nonblocking(true).unwrap();
        let (phase, fails) = (Arc::default(), Arc::default());
        let shared = (Arc::clone(&phase), Arc::clone(&fails));
        let serves = Background::new(move |over| serve(&listener, &shared.0, &shared.1, over));
        Self { path, phase, fails, _serves: serves }
    }

    pub fn is(&self, phase: Phase) -> bool {
        u64::from(self.phase.load(Ordering::Relaxed)) == phase.word()
    }

    fn operate(&self, folder: &Folder, arguments: &[&str]) -> Command {
        let mut command = folder.command();
        command.args(["operate", "--socket"]).arg(&self.path).args(arguments);
        command
    }
}

/// Ticks at 10 kHz, one connection after the other.
fn serve(listener: &UnixListener, phase: &AtomicU32, fails: &AtomicBool, over: &AtomicBool) {
    let mut line = Line::new(40_000);
    line.with(|rig| rig.pace = 0);
    let (start, mut ticks) = (Instant::now(), 0);
    let mut stream: Option<UnixStream> = None;
    while !over.load(Ordering::Relaxed) {
        let due = (start.elapsed().as_secs_f64() * 1e4) as u64;
        // A busy computer does not catch up on lost time.
        let now = (due - ticks).min(100) as u32;
        ticks = due;
        line.parts(|parts| parts.fails = fails.load(Ordering::Relaxed));
        line.tick(now);
        phase.store(line.phase().word() as u32, Ordering::Relaxed);
        if let Ok((next, _)) = listener.accept() {
            next.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
            stream = Some(next);
        }
        let Some(open) = &mut stream else {
            std::thread::sleep(Duration::from_millis(1));
            continue;
        };
        let mut bytes = [0; 4096];
        match open.read(&mut bytes) {
            Ok(0) => stream = None,
            Ok(count) => {
                line.send(&bytes[..count]).unwrap();
                let count = line.receive(&mut bytes, Duration::ZERO).unwrap();
                let _ = open.write_all(&bytes[..count]);
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => stream = None,
        }
    }
}

const WAVE: &str = "ramp = 0.05\nseconds = 0.4\n\
    [[axis]]\naxis = \"z\"\nshape = { kind = \"sine\", amplitude = 1e-6, frequency = 5.0 }\n";

/// From rest, without the law: the volts of one leg, and what the gauges show of all legs, in a file that `identify` reads.
#[test]
fn an_open_drive_is_commanded_and_watched() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    let shape = "shape = { kind = \"sine\", amplitude = 2.0, frequency = 5.0 }";
    folder.write("volts.toml", format!("drive = true\nramp = 0.05\n[[axis]]\naxis = 1\noffset = 4.0\n{shape}\n"));
    folder.write("fast.toml", folder.read("volts.toml").replace("5.0", "4000.0"));
    folder.write("wave.toml", WAVE);
    let run = Run::of(&mut board.operate(&folder, &["reference.toml", "arm", "wait holding 20", "wave volts.toml"]));
    run.says(1, &["volts.toml: a wave of voltages needs an open drive; the machine is holding"]);
    folder.write(
        "drive.txt",
        "arm\nwait holding 20\ndrive\nwait driving\nwave volts.toml\nwatch 100 1 legs.csv\nwave stop\nwait 0.2\n\
         status\nhold\nwait holding\nramp-down\nwait disarmed 20\n",
    );
    let run = Run::of(&mut board.operate(&folder, &["reference.toml", "--script", "drive.txt"]));
    run.says(0, &[]);
    assert!(run.stdout.contains("`hold` ends it"), "{run:?}");
    let text = folder.read("legs.csv");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let titles = lines.next().unwrap();
    let at = |name: &str| titles.iter().position(|title| *title == name).unwrap();
    let [phase, volts, leg] = ["phase", "volts[1]_mean_V", "leg[5]_m"].map(at);
    let rows: Vec<_> = lines.collect();
    let volts = |row: &Vec<&str>| row[volts].parse::<f64>().unwrap();
    assert!(rows.len() > 80 && rows.iter().all(|row| row[phase] == "6" && row[leg].parse::<f64>().is_ok()), "{text}");
    let highest = rows.iter().map(volts).fold(0.0, f64::max);
    assert!((5.0..=6.0).contains(&highest), "{highest} V");
    for (wave, why) in [
        ("fast.toml", "fast.toml: leg 1 would exceed the slew rate"),
        ("wave.toml", "wave.toml: an open drive needs `drive = true`; the machine is driving"),
    ] {
        let lines = ["reference.toml", "arm", "wait holding 20", "drive", "wait driving", &format!("wave {wave}")];
        Run::of(&mut board.operate(&folder, &lines)).says(1, &[why]);
    }
}

#[test]
fn a_script_runs_a_wave_and_fetches_its_record() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    folder.write("wave.toml", WAVE);
    folder.write("fast.toml", WAVE.replace("frequency = 5.0", "frequency = 4000.0"));
    folder.write(
        "run.txt",
        "record look\narm\nwait arming 20\nrun   # as soon as it is armed\nwait running 20\nset command=0\nwait 1.5\n\
         record arm 1000\nwave wave.toml\nwait 0.6\nrecord trigger\nwait 0.4\nrecord stop\nrecord download run.rec\n\
         config write reference.toml\nramp-down\nwait disarmed 60\n",
    );
    let run = Run::of(&mut board.operate(&folder, &["reference.toml", "--script", "run.txt"]));
    run.says(0, &[]);
    for text in ["the recorder is running and waits for its trigger", "its capacity is at least", "wrote "] {
        assert!(run.stdout.contains(text), "{run:?}");
    }
    assert!(board.is(Phase::Disarmed));
    let bytes = std::fs::metadata(folder.path("run.rec")).unwrap().len();
    assert!(bytes > 20_000, "{bytes}");
    let replayed = folder.run(&["replay", "run.rec", "--csv", "run.csv"]);
    assert!(replayed.code == 0 && replayed.stdout.contains("rows exported"), "{replayed:?}");
    let csv = folder.read("run.csv");
    assert!(csv.lines().count() > 200);

    // As JSON; and a refusal of the device is shown with its reason.
    let run = Run::of(&mut board.operate(&folder, &["reference.toml", "--json", "status", "config"]));
    let document: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(document["result"]["status"]["state"], "disarmed", "{document:#}");
    assert_eq!(document["result"]["answers"][1]["answer"]["mode"], 6, "{document:#}");
    let run = Run::of(&mut board.operate(&folder, &["wave fast.toml"]));
    run.says(1, &["not checked against a spec", "fast.toml: axis z (leg 2) would exceed the speed"]);
    let run = Run::of(&mut board.operate(&folder, &["wave wave.toml"]));
    run.says(1, &["wave.toml: not now; the machine must be running"]);
    let run = Run::of(&mut board.operate(&folder, &["shutdown"]));
    run.says(1, &["the program of a board cannot be ended; `ramp-down` switches its amplifiers off"]);
    let run = Run::of(&mut board.operate(&folder, &["set gauge[0]=1"]));
    run.says(2, &["`gauge[0]` cannot be set; these can: command, selector"]);
    // An error in the last line is found before the first is executed.
    let cases = [
        (
            "set command=x",
            2,
            "`command`: expected hold, stream, move, trajectory, drive, found `x`; nothing was sent to the machine",
        ),
        ("wave none.toml", 1, "`none.toml` cannot be read: there is no such file"),
        ("play case-1 correction=none.json machine=m", 1, "`none.json` cannot be read: there is no such file"),
        ("config write none.toml", 1, "none.toml is refused"),
        // In either order: an input of the session is not overwritten.
        ("wave wave.toml; record download wave.toml", 2, "it is an input of this command, `wave.toml`"),
        ("record download wave.toml; on-edge wave wave.toml", 2, "it is an input of this command, `wave.toml`"),
        ("record download reference.toml", 2, "it is an input of this command, `reference.toml`"),
        ("record download legs.toml/x.rec", 3, "could not create the folder `legs.toml`"),
    ];
    for (last, code, text) in cases.into_iter().step_by(length(2, 1)) {
        let lines = ["reference.toml", "arm", "wait arming 20"].into_iter().chain(last.split("; "));
        let run = Run::of(&mut board.operate(&folder, &lines.collect::<Vec<_>>()));
        run.says(code, &[text]);
        assert!(board.is(Phase::Disarmed), "{last}");
    }
    let run = Run::of(&mut board.operate(&folder, &["record download legs.toml/x.rec"]));
    assert_eq!(run.code, 3, "{run:?}");
    // Another controller is refused.
    let run = Run::of(&mut board.operate(&folder, &["legs.toml", "arm"]));
    run.says(1, &["the device runs the controller `reference` of spec digest"]);
    assert!(board.is(Phase::Disarmed));
}

#[test]
fn narrow_code_limits_keep_the_voltage_while_running() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    // Without the spec, so that the machine is not without a host while it is compiled.
    let operate = |commands: &[&str]| Run::of(&mut board.operate(&folder, commands));
    let volts = || {
        let document: serde_json::Value = serde_json::from_str(&operate(&["--json", "where"]).stdout).unwrap();
        let volts = document["result"]["answers"][0]["answer"]["voltage"].clone();
        serde_json::from_value::<Vec<f64>>(volts).unwrap()
    };
    operate(&["config code_max=4369 code_min=4370"]).says(1, &["expected code_min ≤ code_max"]);
    operate(&["config code_max=43691"]).says(1, &["`code_max`: expected code_min ≤ code_max, within the spec's"]);
    // A tenth of 100 V: the wiring check has room, and no output goes beyond.
    let tenth = ["config code_min=0 code_max=4369", "arm", "wait holding 20", "run", "wait running 20"];
    operate(&[&tenth[..], &["wait 2", "move z=20um", "wait 2"]].concat()).says(1, &["holding: voltage saturation"]);
    let most = volts().into_iter().fold(0.0, f64::max);
    assert!((9.0..=10.0).contains(&most), "{most} V");
}

const UP: [&str; 5] = ["reference.toml", "arm", "wait arming 20", "run", "wait running 20"];
/// Target of the last tick relative to rest, including the bias of 10 µm.
const TARGETS: [(&str, f64); 4] =
    [("target[0]_m", 0.0), ("target[1]_m", 1e-6), ("target[2]_m", 11.5e-6), ("target[3]_rad", 2e-6)];
const MOVE: &str = "move x=0 y=0 z=2um rx=0 ry=0 rz=0";

#[test]
fn moves_in_words_are_taken_or_refused_and_no_axis_is_guessed() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    let operate = |script: &[&str]| Run::of(&mut board.operate(&folder, script));
    // A machine whose session ended has lost its host: ramp it down immediately, because otherwise it holds for ten seconds.
    let recover = || {
        operate(&["reference.toml", "ramp-down", "wait disarmed 60"]).says(1, &["faulted: link lost"]);
        wait(&board, Phase::Faulted);
        operate(&["reference.toml", "acknowledge", "wait disarmed 20"]).says(0, &[]);
    };
    // Invalid commands are refused before anything is sent.
    for (script, text) in [
        (&[MOVE, "jog z=1"][..], "z needs a unit of"),
        (&["goto there"], "there is no pose `there`: `mark there` first; known poses: zero"),
        (&["play case-9"], "no trajectory `case-9`; it has case-1, case-2, machining"),
        (&["gains kd=1"], "there is no gain `kd`"),
        (&["mode p-pcc"], "expected p, f or pf"),
    ] {
        let run = operate(&[&UP[..], script].concat());
        run.says(2, &[text]);
        assert!(board.is(Phase::Disarmed), "{script:?}");
    }
    operate(&["gains ki=1"]).says(2, &["name the spec"]);
    operate(&["reference.toml", MOVE]).says(1, &["disarmed: it moves only while running"]);
    operate(&["on-edge"]).says(1, &["no input line; declare one in its spec: [[trigger]] with name = \"start\""]);

    let script = format!(
        "wait arrived 20; {MOVE}; wait arrived 20; jog z=-500nm rx=2urad; wait arrived 20; move y=1um; \
         wait arrived 20; mark here; goto zero; wait arrived 20; can-i-go z=5um speed=100um/s; \
         can-i-go z=5um speed=101um/s; can-i-go z=5um rx=1urad speed=1mrad/s; can-i-go z=43um; can-i-go z=-11um; \
         frame tool z=-10mm; move ry=50urad; wait arrived 20; where; frame work rz=5deg x=1um; frame none; where; \
         goto here; wait arrived 20; where; limits; mode pf-ewma; gains; gains ki[2]=7e9; status; record arm 100; \
         record trigger; wait 0.5; record stop; record download run.rec; ramp-down; wait disarmed 60"
    );
    let script: Vec<&str> = script.split("; ").collect();
    let run = operate(&[&UP[..], &script].concat());
    run.says(0, &[]);
    assert!(run.stdout.contains("moves to x 0.000 um, y 1.000 um, z 1.500 um, rx 2.000 urad"), "{run:?}");
    let yes_and_no: Vec<&str> = run.stdout.lines().filter(|line| *line == "yes" || line.starts_with("no: ")).collect();
    assert_eq!(yes_and_no.len(), 5, "{run:?}");
    for (line, text) in yes_and_no.iter().zip([
        "yes",
        "no: z moves at 100.000 um/s at most",
        "yes",
        "no: z would be at 53.000 um from rest, outside the workspace of +-52.000 um",
        "no: leg ",
    ]) {
        assert!(line.starts_with(text), "{line}: {text}");
    }
    for text in [
        "        1.5000     ",
        "42.000  um\n",
        "mode pf-ewma\n",
        "  legs 0 to 5: ",
        "  stable up to \u{3bb} = 2.",
        "7.0000e9",
    ] {
        assert!(run.stdout.contains(text), "{text:?}: {}", run.stdout);
    }
    // A rotation by 50 urad about y, about a point 10 mm below, keeps that point and moves the tool point by half a micrometre.
    let frame = "rz 87266.463 urad; tool point at x 0.000 um, y 0.000 um, z -10000.000 um";
    assert!(run.stdout.contains("        0.5000     ") && run.stdout.contains(frame), "{}", run.stdout);
    // The platform's own target, as the controller computed it.
    let replayed = folder.run(&["replay", "run.rec", "--spec", "reference.toml", "--csv", "run.csv"]);
    assert_eq!(replayed.code, 0, "{replayed:?}");
    let csv = folder.read("run.csv");
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let last: Vec<&str> = lines.next_back().unwrap().split(',').collect();
    for (name, expected) in TARGETS {
        let column = names.iter().position(|known| known == &name).unwrap_or_else(|| panic!("{name}: {names:?}"));
        let value: f64 = last[column].parse().unwrap();
        assert!((value - expected).abs() < 1e-15, "{name}: {value}");
    }

    // `wait` includes a requested trajectory. Unstable gains are not sent, just as such a spec would be refused.
    let script = ["wait arrived 20", "play case-1", "wait arrived 20", "jog z=0.1um", "gains kp=1e9"];
    let run = operate(&[&UP[..], &script].concat());
    run.says(1, &["not sent: E04"]);
    recover();
    let run = operate(&["reference.toml", "status"]);
    assert!(run.code == 0 && run.stdout.contains("`arm`, then `run`"), "{run:?}");

    // A move beyond the workspace is refused, and so is a move during a motion.
    let run = operate(&[&UP[..], &["wait arrived 20", MOVE, "wait arrived 20", "jog z=100um"]].concat());
    run.says(1, &["cannot move to x 0.000 um, y 0.000 um, z 102.000 um", "no motion was started"]);
    recover();

    // A command is refused during the 0.1 s move to the bias. A busy computer may be too late for that.
    let is_early = (0..5).any(|_| {
        let run = operate(&[&UP[..], &[MOVE]].concat());
        recover();
        run.code == 1 && run.stderr.contains("a motion is in progress; `wait arrived` first")
    });
    assert!(is_early);
}

#[test]
fn a_fault_ends_a_script_with_its_cause_and_lines_go_on_after_a_mistake() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    let mut lines = board
        .operate(&folder, &["reference.toml"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = lines.stdin.take().unwrap();
    input.write_all(b"go\nset setpoint[0]=x\nset command=mov\nset command=move\nwait arming 0.1\nstatus\n").unwrap();
    drop(input);
    let output = lines.wait_with_output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    for text in [
        "invalid command `go`",
        "expected a finite number, found `x`",
        "expected hold, stream, move, trajectory, drive, found `mov`",
    ] {
        assert!(printed.contains(text), "{printed}");
    }
    let script = ["reference.toml", "arm", "wait arming 20", "run", "wait running 20", "wait 30"];
    let running = board.operate(&folder, &script).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait(&board, Phase::Running);
    board.fails.store(true, Ordering::Relaxed);
    let output = running.wait_with_output().unwrap();
    let shown = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    assert!(shown.contains("the machine is faulted: converter, at tick "), "{shown}");
    // One acknowledgement restarts the converters. Events are reported once, however often the link was polled before.
    board.fails.store(false, Ordering::Relaxed);
    let script = ["reference.toml", "acknowledge", "wait disarmed 20", "wait 0.2", "status", "status"];
    let run = Run::of(&mut board.operate(&folder, &script));
    run.says(0, &[]);
    let parts: Vec<&str> = run.stdout.split("events since the last status request: ").collect();
    let [_, first, second] = parts[..] else { panic!("{run:#?}") };
    assert!(first.starts_with("link lost, converter\n") || first.starts_with("converter\n"), "{first}");
    assert!(first.contains("converter: all bits of the ADC's frame are equal"), "{first}");
    assert!(second.starts_with("none\n"), "{second}");
}

#[test]
fn ctrl_c_ramps_down_and_waits() {
    let folder = Folder::new();
    let board = SocketBoard::new(&folder);
    let script = ["reference.toml", "arm", "wait arming 20", "run", "wait running 20", "wait 60"];
    let running = board.operate(&folder, &script).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait(&board, Phase::Running);
    let process = rustix::process::Pid::from_raw(running.id().cast_signed()).unwrap();
    rustix::process::kill_process(process, rustix::process::Signal::INT).unwrap();
    let output = running.wait_with_output().unwrap();
    let shown = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{shown}");
    assert!(shown.contains("interrupted; the machine is disarmed, amplifiers off"), "{shown}");
    assert!(board.is(Phase::Disarmed));
}

pub fn wait(board: &SocketBoard, phase: Phase) {
    let start = Instant::now();
    while !board.is(phase) {
        assert!(start.elapsed() < Duration::from_secs(60), "{:?}", board.phase);
        std::thread::sleep(Duration::from_millis(5));
    }
}
