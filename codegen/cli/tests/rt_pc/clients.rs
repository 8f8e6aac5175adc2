//! Clients that keep a place, the orders or the service busy: `ramp-down` from somebody else is taken within a second all the same.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use specgen_link::{Refusal, Request};

use super::host::Host;
use super::{ARM, Bench, HOLDING, Lines, RAMP_DOWN, RUN, RUNNING, Running, signal, wait_for};

/// Within this `ramp-down` is taken.
const TAKEN: Duration = Duration::from_secs(1);

struct Site {
    socket: PathBuf,
    link: PathBuf,
}

impl Site {
    /// Arms and runs by lines, from wherever the machine stands.
    fn run(&self) {
        let mut lines = Lines::new(&self.socket);
        wait_for("the way down", || lines.ask("status").contains("amplifiers=0"));
        for line in ["none", "acknowledge", "none", "arm"] {
            wait_for(line, || lines.ask(line) == "ok");
            std::thread::sleep(Duration::from_millis(50));
        }
        wait_for("armed", || lines.ask("status").contains("phase=Holding"));
        assert_eq!(lines.ask("run"), "ok");
        wait_for("running", || lines.ask("status").contains("phase=Running"));
    }

    /// The time that a new line takes to ask for the way down, and whether the machine goes there.
    fn down_by_line(&self, what: &str) {
        let start = Instant::now();
        let mut lines = Lines::new(&self.socket);
        assert_eq!(lines.ask("ramp-down"), "ok", "{what}");
        self.is_down(what, "a line", start);
    }

    /// The same of a new host over the link.
    fn down_by_host(&self, what: &str) {
        let start = Instant::now();
        let mut host = Host::open(&self.link, 77).unwrap_or_else(|error| panic!("{what}: {error}"));
        host.done(&Request::Supervise { request: RAMP_DOWN });
        self.is_down(what, "a host", start);
    }

    fn is_down(&self, what: &str, who: &str, start: Instant) {
        let answered = start.elapsed();
        let mut lines = Lines::new(&self.socket);
        while lines.ask("status").contains("phase=Running") {
            assert!(start.elapsed() < TAKEN, "{what}: still running");
        }
        let [answered, taken] = [answered, start.elapsed()].map(|time| time.as_secs_f64() * 1e3);
        println!("{what}: ramp-down by {who} answered after {answered:.1} ms, taken within {taken:.1} ms");
        assert!(taken < TAKEN.as_secs_f64() * 1e3, "{what}");
        wait_for(what, || lines.ask("status").contains("amplifiers=0"));
    }

    /// Both, each from a running machine.
    fn both(&self, what: &str) {
        self.run();
        self.down_by_line(what);
        self.run();
        self.down_by_host(what);
    }
}

pub fn nobody_keeps_others_from_ramping_down(bench: &Bench) {
    let site = Site { socket: bench.path("clients.socket"), link: bench.path("clients.link") };
    let mut command = bench.command("clients.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "500", "--link-idle", "1"]);
    command.arg("--socket").arg(&site.socket).arg("--link").arg(&site.link);
    let running = Running::new(&mut command);
    wait_for("the link", || site.link.exists() && site.socket.exists());

    a_stopped_operate_loses_the_orders(&site);
    one_that_only_looks_loses_them(&site);
    let idle: Vec<UnixStream> = (0..8).map(|_| UnixStream::connect(&site.socket).unwrap()).collect();
    let quiet: Vec<UnixStream> = (0..8).map(|_| UnixStream::connect(&site.link).unwrap()).collect();
    site.both("eight idle lines and eight idle hosts");
    drop((idle, quiet));
    under_a_flood(&site);
    one_that_never_returns_is_not_waited_for(&site);
    running.end(Signal::TERM);
}

/// Stopped while it has the orders and its machine runs.
fn a_stopped_operate_loses_the_orders(site: &Site) {
    for by_line in [true, false] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.args(["operate", "--socket"]).arg(&site.link);
        command.args(["none", "acknowledge", "none", "arm", "wait holding", "run", "wait 600"]);
        let mut operate = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = Lines::new(&site.socket);
        wait_for("running", || lines.ask("status").contains("phase=Running"));
        signal(&operate, Signal::STOP);
        if by_line {
            site.down_by_line("operate stopped");
        } else {
            site.down_by_host("operate stopped");
        }
        // Silent for longer than a host may be, it loses the orders to a line: it finds its connection closed, and does not go on.
        wait_for("the orders", || lines.ask("none") == "ok");
        signal(&operate, Signal::CONT);
        let status = operate.wait().unwrap();
        assert!(!status.success(), "it lost the orders: {status}");
    }
}

/// There, heard all the time, but without an order for longer than `--link-idle`.
fn one_that_only_looks_loses_them(site: &Site) {
    site.run();
    let mut host = Host::open(&site.link, 5).unwrap();
    host.done(&Request::Supervise { request: RUN });
    let mut other = Host::open(&site.link, 6).unwrap();
    assert_eq!(other.refused(&Request::Supervise { request: ARM }), Refusal::Busy);
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1300) {
        assert_eq!(host.status().phase, RUNNING);
        std::thread::sleep(Duration::from_millis(5));
    }
    other.done(&Request::Supervise { request: 3 });
    other.wait("held by the next", |status| status.phase == HOLDING);
    drop((host, other));
    site.down_by_line("an idle host");
}

/// By the times of the spec: it holds, and after 10 s it ramps down and switches off, with nobody asking for it.
fn one_that_never_returns_is_not_waited_for(site: &Site) {
    site.run();
    let mut host = Host::open(&site.link, 9).unwrap();
    host.done(&Request::Supervise { request: RUN });
    let mut lines = Lines::new(&site.socket);
    wait_for("the loss", || lines.ask("status").contains("phase=Holding cause=LinkLost amplifiers=1"));
    let start = Instant::now();
    wait_for("the way down", || lines.ask("status").contains("phase=Faulted cause=HostGone amplifiers=0"));
    println!("a host that never returns: off {:.1} s after the hold", start.elapsed().as_secs_f64());
}

/// Lines and frames as fast as they go.
fn under_a_flood(site: &Site) {
    let over = AtomicBool::new(false);
    let flood = |path: &Path, bytes: &[u8]| {
        while !over.load(Ordering::Relaxed) {
            let Ok(mut stream) = UnixStream::connect(path) else { continue };
            let mut reader = stream.try_clone().unwrap();
            // Answers are read, so that it is not closed for leaving them.
            std::thread::spawn(move || std::io::copy(&mut reader, &mut std::io::sink()));
            while !over.load(Ordering::Relaxed) {
                if stream.write_all(bytes).is_err() {
                    break;
                }
            }
        }
    };
    let noise: Vec<u8> = (0..4096_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    std::thread::scope(|scope| {
        scope.spawn(|| flood(&site.socket, &b"status\n".repeat(100)));
        scope.spawn(|| flood(&site.link, &noise));
        site.both("a flood of lines and frames");
        over.store(true, Ordering::Relaxed);
    });
}
