//! Clients that occupy connections, control or the service: `ramp-down` from another host still takes effect within a second.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;
use specgen_link::{Refusal, Request};

use super::host::Host;
use super::{
    ACKNOWLEDGE, ARM, Bench, FAULTED, HOLD, HOLDING, HOST_GONE, LINK_LOST, NONE, ProcessGuard, RAMP_DOWN, RUN, RUNNING,
    signal, wait_for,
};
use crate::support::{Background, length};

/// Time within which `ramp-down` takes effect.
const TAKEN: Duration = Duration::from_secs(1);

/// A host in control that is never silent, until it is dropped or its connection is closed.
fn controlling(mut host: Host) -> Background {
    Background::new(move |over| {
        while !over.load(Ordering::Relaxed) && host.is_answered() {
            std::thread::sleep(Duration::from_millis(5));
        }
    })
}

struct Site {
    link: PathBuf,
}

impl Site {
    /// A host that arms and runs the machine, from any phase.
    fn run(&self) -> Host {
        let mut host = Host::open(&self.link, 1).unwrap();
        host.wait("the way down", |status| !status.amplifier_on);
        for request in [NONE, ACKNOWLEDGE, NONE, ARM] {
            wait_for("control", || host.asks(request));
            std::thread::sleep(Duration::from_millis(50));
        }
        host.wait("armed", |status| status.phase == HOLDING);
        host.done(&Request::Supervise { request: RUN });
        host.wait("running", |status| status.phase == RUNNING);
        host
    }

    /// Measures the time in which a new host can request a ramp-down, and asserts that the machine ramps down.
    fn down(&self, what: &str) {
        let start = Instant::now();
        let mut host = Host::open(&self.link, 77).unwrap_or_else(|error| panic!("{what}: {error}"));
        host.done(&Request::Supervise { request: RAMP_DOWN });
        let answered = start.elapsed();
        while host.status().phase == RUNNING {
            assert!(start.elapsed() < TAKEN, "{what}: still running");
        }
        let [answered, taken] = [answered, start.elapsed()].map(|time| time.as_secs_f64() * 1e3);
        println!("{what}: ramp-down answered after {answered:.1} ms, taken within {taken:.1} ms");
        assert!(taken < TAKEN.as_secs_f64() * 1e3, "{what}");
        host.wait(what, |status| !status.amplifier_on);
    }

    fn operate(&self, commands: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.args(["operate", "--socket"]).arg(&self.link).args(commands);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }
}

pub fn nobody_keeps_others_from_ramping_down(bench: &Bench) {
    let site = Site { link: bench.path("clients.link") };
    let mut command = bench.command("clients.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "500", "--link-idle", "1", "--link"]);
    let running = ProcessGuard::new(command.arg(&site.link));
    wait_for("the link", || site.link.exists());

    a_stopped_operate_loses_the_orders(&site);
    if length(false, true) {
        one_that_only_looks_loses_them(&site);
        let idle: Vec<UnixStream> = (0..8).map(|_| UnixStream::connect(&site.link).unwrap()).collect();
        let kept = controlling(site.run());
        site.down("eight idle hosts, and one that has the orders");
        drop((idle, kept));
        under_a_flood(&site);
        one_that_never_returns_is_not_waited_for(&site);
    }
    client_without_control_stops_the_program(&site, running);
}

/// A host in control that is stopped while its machine runs.
fn a_stopped_operate_loses_the_orders(site: &Site) {
    let script = ["none", "acknowledge", "none", "arm", "wait holding", "run", "wait 600"];
    let mut operate = site.operate(&script).spawn().unwrap();
    let mut other = Host::open(&site.link, 4).unwrap();
    other.wait("running", |status| status.phase == RUNNING);
    signal(&operate, Signal::STOP);
    site.down("operate stopped");
    // After a longer silence than permitted, it loses control: its connection is closed, and it does not continue.
    wait_for("control", || other.asks(NONE));
    signal(&operate, Signal::CONT);
    let status = operate.wait().unwrap();
    assert!(!status.success(), "it lost the orders: {status}");
}

/// A host that is never silent, but sends no command for longer than `--link-idle`.
fn one_that_only_looks_loses_them(site: &Site) {
    let mut host = site.run();
    host.done(&Request::Supervise { request: RUN });
    let mut other = Host::open(&site.link, 6).unwrap();
    assert_eq!(other.refused(&Request::Supervise { request: ARM }), Refusal::Busy);
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(1300) {
        assert_eq!(host.status().phase, RUNNING);
        std::thread::sleep(Duration::from_millis(5));
    }
    // Not only a hold, which every host may request: it is in control now.
    other.done(&Request::Supervise { request: RUN });
    other.done(&Request::Supervise { request: HOLD });
    other.wait("held by the next", |status| status.phase == HOLDING);
    assert!(!host.is_answered(), "its connection is closed");
    drop((host, other));
    site.down("an idle host");
}

/// By the times of the spec: it holds, and after 10 s it ramps down and switches off, without a request.
fn one_that_never_returns_is_not_waited_for(site: &Site) {
    let host = site.run();
    let mut other = Host::open(&site.link, 9).unwrap();
    other.wait("the loss", |status| (status.phase, status.cause, status.amplifier_on) == (HOLDING, LINK_LOST, true));
    let start = Instant::now();
    other.wait("the way down", |status| {
        (status.phase, status.cause, status.amplifier_on) == (FAULTED, HOST_GONE, false)
    });
    println!("a host that never returns: off {:.1} s after the hold", start.elapsed().as_secs_f64());
    drop(host);
}

/// `operate stop` takes effect while another host is in control, and returns when the program has ended.
fn client_without_control_stops_the_program(site: &Site, running: ProcessGuard) {
    let kept = controlling(site.run());
    let stopped = site.operate(&["shutdown"]).status().unwrap();
    assert!(stopped.success() && !site.link.exists(), "{stopped}");
    let output = running.wait();
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["last_phase"], "Disarmed", "{summary}");
    drop(kept);
}

/// Noise and requests at full speed.
fn under_a_flood(site: &Site) {
    let over = AtomicBool::new(false);
    let noise: Vec<u8> = (0..4096_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let flood = || {
        while !over.load(Ordering::Relaxed) {
            let Ok(mut stream) = UnixStream::connect(&site.link) else { continue };
            let mut reader = stream.try_clone().unwrap();
            // Read answers, because a client that does not is disconnected.
            std::thread::spawn(move || std::io::copy(&mut reader, &mut std::io::sink()));
            while !over.load(Ordering::Relaxed) {
                if stream.write_all(&noise).is_err() {
                    break;
                }
            }
        }
    };
    let asking = || {
        while !over.load(Ordering::Relaxed) {
            let Ok(mut host) = Host::open(&site.link, 50) else { continue };
            while !over.load(Ordering::Relaxed) {
                if !host.is_answered() {
                    break;
                }
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(flood);
        scope.spawn(asking);
        let kept = controlling(site.run());
        site.down("a flood of noise and requests");
        drop(kept);
        over.store(true, Ordering::Relaxed);
    });
}
