//! A commissioning that is aborted at random moments: by Ctrl-C, a kill of the command, a lost or silent link, a kill of the real-time
//! program, a machine without power. This process simulates the machine and checks every tick that it is sent. After each abort the
//! machine is ramped down or off within the stated time, and the same command continues.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host_sim::machine::Machine;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rustix::process::Signal;
use serde_json::Value;
use specgen::compile::{self, Compilation};
use specgen::lower;
use specgen::machine::PlantOptions;
use specgen::plant_server::PlantServer;
use specgen_rt::exchange::{Actuation, Sensing, Server, path_of};

use super::{ProcessGuard, Programs, signal, wait_for};
use crate::support::{BINARY, Background, length, repository};

/// Ticks a second.
const RATE: f64 = 1e4;
/// Silence after which the program holds, ms.
const SILENCE: u64 = 1000;
/// Beyond the ramp: the end of a motion, and an answer of a busy computer, s.
const MARGIN: f64 = 1.0;
/// What linear kinematics and the gauges' noise may add to a pose, m and rad.
const POSE: [f64; 6] = [30e-9, 30e-9, 30e-9, 0.3e-6, 0.3e-6, 0.3e-6];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Abort {
    /// Ctrl-C.
    Interrupt,
    /// `kill -9` of the command.
    Kill,
    /// The link is closed.
    Cut,
    /// The link carries nothing any more.
    Silence,
    /// `kill -9` of the real-time program.
    Program,
    /// The machine does not answer any more.
    Power,
}

/// A host takes a minute to give up a silent socket: such aborts are fewer.
const ABORTS: [Abort; 5] = [Abort::Interrupt, Abort::Program, Abort::Power, Abort::Kill, Abort::Cut];
const SILENCES: usize = 100;

/// A step, whether it is done again, and the time within which it is aborted, s.
const STEPS: [(&str, bool, f64); 4] =
    [("wiring", true, 6.5), ("cross-talk", false, 12.0), ("curves", false, 6.0), ("acceptance", true, 6.0)];

/// What a machine permits.
struct Permitted {
    codes: [i32; 2],
    /// Codes in a tick.
    step: i32,
    rest: i32,
    /// Pose per code of a gauge, and that of codes 0.
    poses: [[f64; 6]; 6],
    zero: [f64; 6],
    workspace: [f64; 6],
}

impl Permitted {
    fn new(Compilation { model, ir, .. }: &Compilation) -> Self {
        let poses = lower::poses_per_reading(model).unwrap().unwrap();
        let converter = &ir.gauge_converter;
        Self {
            codes: [ir.actuation.code_min, ir.actuation.code_max],
            step: ir.defaults.max_step,
            rest: ir.supervision.constants.rest,
            poses: std::array::from_fn(|axis| std::array::from_fn(|gauge| poses[axis][gauge] * converter.per_code)),
            zero: std::array::from_fn(|axis| (0..6).map(|gauge| poses[axis][gauge] * converter.at_zero).sum()),
            workspace: model.workspace.bounds(),
        }
    }
}

/// What the machine was sent.
#[derive(Default)]
struct Observation {
    /// Ticks of all sessions.
    ticks: u64,
    last: Actuation,
    /// How often the amplifiers were switched on, and the ticks that they were on.
    switched_on: u64,
    on: u64,
    /// Largest pose, part of the workspace.
    farthest: f64,
    wrong: Vec<String>,
}

impl Observation {
    fn take(&mut self, now: &Actuation, permitted: &Permitted) {
        let same = now.session == self.last.session;
        let passed = if same { now.tick.saturating_sub(self.last.tick) } else { 1 };
        let rises = now.enable && !(same && self.last.enable);
        // While the amplifiers were off, the legs were at rest.
        let before = if rises { [permitted.rest; 6] } else { self.last.codes };
        if now.enable {
            let [low, high] = permitted.codes;
            let most = permitted.step * passed.clamp(1, 1000) as i32;
            for (leg, (code, before)) in now.codes.iter().zip(before).enumerate() {
                if !(low..=high).contains(code) || (code - before).abs() > most {
                    self.wrong.push(format!("tick {}: leg {leg} from code {before} to {code}", now.tick));
                }
            }
            self.on += passed;
        }
        self.switched_on += u64::from(rises);
        self.ticks += passed;
        self.last = *now;
    }

    fn look(&mut self, sensing: &Sensing, permitted: &Permitted) {
        for (axis, rest) in POSE.iter().enumerate() {
            let row = permitted.poses[axis].iter().zip(sensing.codes);
            let pose = row.fold(permitted.zero[axis], |pose, (per_code, code)| pose + per_code * f64::from(code));
            let part = (pose.abs() - rest) / permitted.workspace[axis];
            self.farthest = self.farthest.max(part);
            if part > 1.0 {
                self.wrong.push(format!("tick {}: pose {axis} is {pose:e}", sensing.tick));
            }
        }
    }
}

/// Carries the link, as long as `state` is not one of these.
const CUT: u8 = 1;
const SILENT: u8 = 2;

fn relay(listener: &UnixListener, device: &Path, state: &AtomicU8, over: &AtomicBool) {
    let wait = Some(Duration::from_millis(1));
    let mut pair: Option<[UnixStream; 2]> = None;
    let mut bytes = [0; 4096];
    while !over.load(Ordering::Relaxed) {
        if let Ok((host, _)) = listener.accept() {
            pair = UnixStream::connect(device).ok().map(|device| [host, device]);
            pair.iter().flatten().for_each(|one| one.set_read_timeout(wait).unwrap());
        }
        match (state.load(Ordering::Relaxed), &mut pair) {
            (CUT, open) => *open = None,
            (SILENT, _) | (_, None) => std::thread::sleep(Duration::from_millis(1)),
            (_, Some([host, device])) => {
                let mut carry = |from: &mut UnixStream, to: &mut UnixStream| match from.read(&mut bytes) {
                    Ok(0) => false,
                    Ok(count) => to.write_all(&bytes[..count]).is_ok(),
                    Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
                };
                if !(carry(host, device) && carry(device, host)) {
                    pair = None;
                }
            }
        }
    }
}

/// A machine, its program, its link, and a commissioning.
struct Bench {
    programs: Arc<Programs>,
    folder: tempfile::TempDir,
    spec: PathBuf,
    compiled: Arc<Compilation>,
    name: String,
    seen: Arc<Mutex<Observation>>,
    power: Arc<AtomicBool>,
    link: Arc<AtomicU8>,
    program: Option<ProcessGuard>,
    random: ChaCha8Rng,
    _serves: [Background; 2],
}

impl Bench {
    fn new(spec: &Path) -> Self {
        let (folder, compiled) = (tempfile::tempdir().unwrap(), Arc::new(compile::compile(spec).unwrap()));
        let name = format!("test-aborts-{}", std::process::id());
        let seen = Arc::<Mutex<Observation>>::default();
        let (power, link) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicU8::new(0)));
        let server = Server::create(&path_of(&name).unwrap(), &compiled.ir.digest).unwrap();
        let serves = {
            let (seen, power, compiled) = (seen.clone(), power.clone(), compiled.clone());
            Background::new(move |over| serve(&server, &compiled, &seen, &power, over))
        };
        let listener = UnixListener::bind(folder.path().join("relay.link")).unwrap();
        listener.set_nonblocking(true).unwrap();
        let (device, state) = (folder.path().join("program.link"), link.clone());
        let relays = Background::new(move |over| relay(&listener, &device, &state, over));
        let random = ChaCha8Rng::seed_from_u64(52);
        let (programs, spec, program) = (Programs::of(spec), spec.to_owned(), None);
        Self { programs, folder, spec, compiled, name, seen, power, link, program, random, _serves: [serves, relays] }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn seen<R>(&self, look: impl FnOnce(&Observation) -> R) -> R {
        look(&self.seen.lock().unwrap())
    }

    /// A number from 0 to 1.
    fn part(&mut self) -> f64 {
        f64::from(self.random.next_u32()) / f64::from(u32::MAX)
    }

    /// Starts the program, unless it is running.
    fn serve_link(&mut self) {
        if self.program.as_mut().is_some_and(ProcessGuard::goes_on) {
            return;
        }
        let link = self.path("program.link");
        let _ = fs::remove_file(&link);
        let mut command = Command::new(&self.programs.binary);
        command.args(["--sim", &self.name, "--allow-no-rt", "--elastic", "--sim-timeout", "1000", "--link-silence"]);
        self.program = Some(ProcessGuard::new(command.arg(SILENCE.to_string()).arg("--link").arg(&link)));
        wait_for("the link", || link.exists());
    }

    fn specgen(&self, command: &str, more: &[&str]) -> Child {
        let mut line = Command::new(BINARY);
        line.arg(command).arg("--socket").arg(self.path("relay.link")).arg(&self.spec).args(more);
        line.current_dir(self.folder.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        line.spawn().unwrap()
    }

    fn commission(&self, more: &[&str]) -> Child {
        self.specgen("commission", &[&["--yes", "--grid", "4", "-o", "found"], more].concat())
    }

    /// After an abort the machine is faulted: what the next command says is done.
    fn acknowledge(&self) {
        let output = self.specgen("operate", &["acknowledge", "wait disarmed 10", "none"]).wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }

    /// Longest time to the end of everything without a host, s.
    fn stated(&self) -> f64 {
        let (ir, period) = (&self.compiled.ir, self.compiled.model.timing.period);
        let gone = f64::from(*ir.supervision.timeout.last().unwrap()) * period;
        let steps = f64::from(ir.actuation.code_max - ir.actuation.code_min) / f64::from(ir.supervision.ramp_step);
        let ramp = steps * f64::from(ir.supervision.ramp_every) * period;
        SILENCE as f64 * 1e-3 + gone + ramp + MARGIN
    }

    /// One abort. Returns whether it hit a machine with amplifiers on.
    fn abort(&mut self, abort: Abort, count: usize) -> bool {
        self.serve_link();
        let (step, again, within) = STEPS[(self.random.next_u32() % 4) as usize];
        let what = format!("{count}, {abort:?} during {step}");
        let moment = self.seen(|seen| seen.ticks) + (self.part() * within * RATE) as u64;
        let command = ["--step", step, "--again"];
        let mut child = self.commission(&command[..if again { 3 } else { 2 }]);
        while self.seen(|seen| seen.ticks) < moment && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(500));
        }
        let ended = child.try_wait().unwrap().is_some();
        let (was_on, begun) = self.seen(|seen| (seen.last.enable, seen.ticks));
        match abort {
            _ if ended => {}
            Abort::Interrupt => signal(&child, Signal::INT),
            Abort::Kill => child.kill().unwrap(),
            Abort::Cut => self.link.store(CUT, Ordering::Relaxed),
            Abort::Silence => self.link.store(SILENT, Ordering::Relaxed),
            Abort::Program => drop(self.program.take().unwrap().end(Signal::KILL)),
            Abort::Power => self.power.store(false, Ordering::Relaxed),
        }
        // Without its program a machine sees no tick: its hardware switches it off.
        let down = |bench: &Self| abort == Abort::Program && !ended || bench.seen(|seen| !seen.last.enable);
        let last = begun + (self.stated() * RATE) as u64;
        wait_for("the end", || down(self) || self.seen(|seen| seen.ticks) > last);
        assert!(down(self), "{what}: amplifiers on {} s after it", self.stated());
        let output = child.wait_with_output().unwrap();
        assert_ended(&output, abort, &what);
        assert!(self.seen(|seen| seen.wrong.is_empty()), "{what}: {:?}", self.seen(|seen| seen.wrong.clone()));
        println!("{what}, {}: {}", if was_on { "on" } else { "off" }, last_line(&output));
        self.link.store(0, Ordering::Relaxed);
        if abort == Abort::Power && !ended {
            // Power is back, and the program begins anew.
            drop(self.program.take().unwrap().end(Signal::KILL));
            self.power.store(true, Ordering::Relaxed);
        }
        self.usable(&what);
        was_on && !ended
    }

    /// Records in the folder are whole, and the next command knows them.
    fn usable(&mut self, what: &str) {
        let known = self.path("found/commission.json");
        if known.exists() {
            serde_json::from_str::<Value>(&fs::read_to_string(known).unwrap())
                .unwrap_or_else(|why| panic!("{what}: {why}"));
        }
        for entry in fs::read_dir(self.path("found")).into_iter().flatten().map(Result::unwrap) {
            let path = entry.path();
            if path.extension().is_some_and(|extension| extension == "csv") {
                let text = fs::read_to_string(&path).unwrap();
                let columns = text.lines().next().map_or(0, |line| line.split(',').count());
                let whole = text.ends_with('\n') && text.lines().all(|line| line.split(',').count() == columns);
                assert!(whole && text.lines().count() > 100, "{what}: {}", path.display());
            }
        }
        self.serve_link();
        // A machine without a host ends faulted.
        let status = self.specgen("operate", &["status"]).wait_with_output().unwrap();
        if String::from_utf8_lossy(&status.stdout).contains("faulted") {
            self.acknowledge();
        }
    }
}

fn last_line(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned()
}

/// Its exit code and its last line are those of what ended it.
fn assert_ended(output: &Output, abort: Abort, what: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code();
    assert!(!said.contains("panicked"), "{what}: {said}");
    let expected = match abort {
        Abort::Kill => &[None, Some(0)][..],
        Abort::Interrupt => &[Some(130), Some(0)],
        // The program may have ended before the command began.
        Abort::Cut | Abort::Silence | Abort::Program | Abort::Power => &[Some(1), Some(3), Some(0)],
    };
    assert!(expected.contains(&code), "{what}: {code:?}, {said}");
    if code == Some(130) {
        assert!(
            !said.contains("arming") || said.contains("amplifiers off; the same command continues"),
            "{what}: {said}"
        );
    }
}

/// Answers the program until `over`, except without power.
fn serve(server: &Server, compiled: &Compilation, seen: &Mutex<Observation>, power: &AtomicBool, over: &AtomicBool) {
    let plant = PlantOptions { plant: None, no_noise: false, seed: 1 };
    let rig = plant.platform(&compiled.model, compiled.model.task_space.as_ref().unwrap()).unwrap().1.rig().clone();
    let mut served = PlantServer::new(Machine::Platform(Box::new(rig)), &compiled.model, &compiled.ir);
    let (permitted, mut bell) = (Permitted::new(compiled), 0);
    while !over.load(Ordering::Relaxed) {
        let Some((actuation, wanted)) = server.wait(&mut bell, 0, 100_000_000) else { continue };
        let answered = power.load(Ordering::Relaxed).then(|| served.answer(&actuation, wanted));
        let mut seen = seen.lock().unwrap();
        // The first of a session comes before its first codes.
        if actuation.session == wanted[0] {
            seen.take(&actuation, &permitted);
        }
        if let Some(sensing) = answered {
            seen.look(&sensing, &permitted);
            server.publish(&sensing);
        }
    }
}

/// The reference spec, whose host is lost after a second.
fn impatient(folder: &Path) -> PathBuf {
    let specs = repository().join("specs");
    fs::create_dir_all(folder.join("records")).unwrap();
    fs::copy(specs.join("records/reference-forc.csv"), folder.join("records/reference-forc.csv")).unwrap();
    let text = fs::read_to_string(specs.join("reference.toml")).unwrap();
    let text = text.replacen("[timing]\n", "[supervisor]\nhost_lost = [\"100 ms\", \"1 s\"]\n\n[timing]\n", 1);
    let spec = folder.join("aborted.toml");
    fs::write(&spec, text).unwrap();
    spec
}

#[test]
#[ignore = "long: three aborts take half a minute; 100 in the full run"]
fn every_abort_ends_ramped_down_or_off_and_the_same_command_continues() {
    let folder = tempfile::tempdir().unwrap();
    // At less length it has the program of other tests, and aborts that end before the host is given up.
    let spec = length(repository().join("specs/reference.toml"), impatient(folder.path()));
    let mut bench = Bench::new(&spec);
    let (aborts, kinds) = length((3, &ABORTS[..3]), (100, &ABORTS));
    let mut on = 0;
    for count in 0..aborts {
        let kind = if count % SILENCES == SILENCES - 1 { Abort::Silence } else { kinds[count % kinds.len()] };
        on += usize::from(bench.abort(kind, count));
    }
    bench.seen(|seen| {
        println!(
            "{aborts} aborts, {on} with amplifiers on; {} times on, {:.1} s in all, {:.3} of the workspace at most",
            seen.switched_on,
            seen.on as f64 / RATE,
            seen.farthest
        );
    });
    assert!(3 * on >= aborts, "{on} of {aborts}");
    if length(true, false) {
        return;
    }
    let begun = bench.seen(|seen| seen.ticks);
    let output = bench.commission(&["--step", "wiring", "--step", "cross-talk"]).wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let minutes = said.split("about ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse::<f64>().unwrap();
    let took = bench.seen(|seen| seen.ticks - begun) as f64 / RATE / 60.0;
    println!("continued: {took:.2} min of the machine, {minutes} min stated");
    assert!(took <= minutes, "{took} {minutes}");
    let known: Value = serde_json::from_str(&fs::read_to_string(bench.path("found/commission.json")).unwrap()).unwrap();
    assert!(known["cross_talk"]["error"].as_f64().unwrap() < 1e-3, "{known}");
    assert!(bench.seen(|seen| seen.wrong.is_empty() && !seen.last.enable));
}
