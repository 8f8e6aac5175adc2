//! A stop discards all earlier commands of all clients, whichever client sends it and in whatever phase.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::json;
use specgen::operate::{MeasuredPose, Session, SocketLine};
use specgen_link::client::{Client, Port, Timeout};
use specgen_link::{Bytes, CostUnit, Device, Endpoint, Identity, Refusal, Reply, Request};

use super::gcs::{self, Bridge};
use super::host::Host;
use super::panel::Panel;
use super::{ARM, BUSY, Bench, DISARMED, HOLD, HOLDING, NONE, ProcessGuard, RAMP_DOWN, RUN, RUNNING, wait_for};
use crate::support::length;

const ARMING: u8 = 1;
/// A platform's word to move.
const MOVE: u64 = 2;
/// Largest duration of a stop, on a loaded computer with elastic time.
const RAMP: Duration = Duration::from_millis(500);
/// Ticks without motion after which it is at rest.
const STILL: u64 = 300;
/// How long it must then stay at rest.
fn rest_time() -> Duration {
    Duration::from_millis(length(200, 1500))
}
/// Largest motion during a stop, m: many times that of a stop from full speed.
const STOPPING: f64 = 3e-6;

/// The machine as another host sees it.
struct Observer(Session<SocketLine>);

impl Observer {
    fn new(link: &Path) -> Self {
        Self(Session::open(SocketLine::open(link).unwrap(), Timeout::SOCKET, None).unwrap())
    }

    fn now(&mut self) -> MeasuredPose {
        self.0.place().unwrap().unwrap()
    }

    fn wait(&mut self, what: &str, there: impl Fn(&MeasuredPose) -> bool) {
        wait_for(what, || there(&self.now()));
    }

    /// Asserts that after a stop there is at most a stopping ramp, and then no motion.
    #[track_caller]
    fn assert_at_rest(&mut self, what: &str) {
        let way = |a: &MeasuredPose, b: &MeasuredPose| {
            a.target.iter().zip(&b.target).fold(0.0, |way: f64, (a, b)| way.max((a - b).abs()))
        };
        let (mut start, begun) = (Instant::now(), self.now());
        let mut rest = begun;
        while start.elapsed() < RAMP {
            std::thread::sleep(Duration::from_millis(5));
            let now = self.now();
            if way(&rest, &now) > 1e-12 {
                rest = now;
            } else if now.tick > rest.tick + STILL {
                break;
            }
        }
        assert!(way(&begun, &rest) < STOPPING, "{what}: {begun:?} {rest:?}");
        start = Instant::now();
        while start.elapsed() < rest_time() {
            let now = self.now();
            assert!(
                way(&rest, &now) < 1e-12,
                "{what}: it moves {:?} after the stop: {rest:?} {now:?}",
                start.elapsed()
            );
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

#[test]
fn a_stop_is_a_stop() {
    let bench = Bench::named("reference.toml", "stops");
    let link = bench.path("stops.link");
    let mut command = bench.command("stops.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "20000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let mut observer = Observer::new(&link);

    // In the short run, one of each: a host of the link, a client of the bridge during start-up, and after queued moves.
    let whole = length(false, true);
    hosts_of_the_link(&link, &mut observer);
    if whole {
        scripts(&bench, &link, &mut observer);
        println!("scripts: stopped");
    }
    let bridge = Bridge::new_at(&bench, "stops.link", &[]);
    stops_during_start_up(&bridge, &mut observer);
    if whole {
        servo_off_and_on_again(&bridge, &mut observer);
    }
    a_stop_overtakes_unread_moves(&bridge, &mut observer);
    if whole {
        by_another_host(&bridge, &link, &mut observer);
        many_clients(&bridge, &mut observer);
    }
    bridge.end();
    if whole {
        pages(&bench, &link, &mut observer);
    }
    drop(observer);
    let (summary, _) = bench.check(&running.end(Signal::INT), "stops.rec");
    assert_eq!(summary["incidents"], json!([]), "{summary:#}");
}

/// Set-points that were sent before the machine stopped running, for any reason, are not followed when it runs again.
fn hosts_of_the_link(link: &Path, observer: &mut Observer) {
    let mut host = Host::open(link, 1).unwrap();
    let moved = |x: f64| {
        let mut words = [0; 21];
        (words[0], words[3]) = (MOVE, x.to_bits());
        words.iter().flat_map(|word: &u64| word.to_le_bytes()).collect::<Vec<u8>>()
    };
    let up = |host: &mut Host| {
        for request in [NONE, ARM] {
            host.done(&Request::Supervise { request });
            host.wait("ticks", |status| status.tick > 0);
            std::thread::sleep(Duration::from_millis(20));
        }
        host.done(&Request::Supervise { request: RUN });
        host.wait("its bias pose", |status| status.phase == RUNNING && status.status & BUSY == 0);
    };
    host.wait("a tick", |status| status.tick > 0);
    let early = moved(4e-6);
    assert_eq!(host.refused(&Request::Setpoint { words: Bytes(&early) }), Refusal::State, "before it runs");
    up(&mut host);
    let bias = observer.now().target;
    assert!(bias[0].abs() < 1e-12, "{bias:?}");
    for (stop, phase) in [(HOLD, HOLDING), (RAMP_DOWN, DISARMED)] {
        let words = moved(-6e-6);
        host.done(&Request::Setpoint { words: Bytes(&words) });
        // During a move, or after arrival.
        host.wait("the motion", |status| status.status & BUSY == 0 || stop == HOLD);
        host.done(&Request::Supervise { request: stop });
        host.wait("the stop", |status| status.phase == phase);
        if stop == HOLD {
            observer.assert_at_rest("held over the link");
            let before = observer.now().target;
            host.done(&Request::Supervise { request: RUN });
            host.wait("running", |status| status.phase == RUNNING);
            observer.assert_at_rest("run after a hold");
            assert!((observer.now().target[0] - before[0]).abs() < 1e-9);
        } else {
            up(&mut host);
            observer.assert_at_rest("run after a ramp down");
            assert!(observer.now().target[0].abs() < 1e-12, "an old target: {:?}", observer.now());
        }
    }
    host.done(&Request::Supervise { request: RAMP_DOWN });
    host.wait("the way down", |status| status.phase == DISARMED);

    // Another host holds while this one arms: its next request was already on its way.
    let mut other = Host::open(link, 2).unwrap();
    for request in [NONE, ARM] {
        host.done(&Request::Supervise { request });
        std::thread::sleep(Duration::from_millis(20));
    }
    other.done(&Request::Supervise { request: HOLD });
    assert_eq!(host.refused(&Request::Supervise { request: RUN }), Refusal::Busy, "it is to hear of the stop");
    // The wiring check is aborted, and an unchecked machine does not hold.
    host.wait("the way down", |status| status.phase == DISARMED);
    observer.assert_at_rest("held while it armed");
    assert_eq!(observer.now().phase, DISARMED);
    host.done(&Request::Supervise { request: NONE });
    drop(host);

    // A host that does not wait for answers: requests that are unread when the other holds are discarded.
    let mut asks = Client::open(Paper::default(), 4, Timeout::PIPE).unwrap().0;
    let supervise = |request| Request::Supervise { request };
    let mut line = UnixStream::connect(link).unwrap();
    let words = moved(1e-6);
    for requests in [&[NONE, ARM][..], &[RUN]] {
        for request in requests {
            for _ in 0..120 {
                asks.ask(&Request::Setpoint { words: Bytes(&words) }).unwrap();
            }
            asks.ask(&supervise(*request)).unwrap();
        }
        line.write_all(&std::mem::take(&mut asks.port().sent)).unwrap();
        if requests.len() > 1 {
            other.wait("armed", |status| status.phase == HOLDING);
        }
    }
    other.done(&supervise(HOLD));
    observer.assert_at_rest("held before another host's request to run was read");
    assert_eq!(observer.now().phase, HOLDING);
    other.done(&supervise(RAMP_DOWN));
    other.wait("the way down", |status| status.phase == DISARMED);
}

/// A link to a device that accepts every request, and keeps the frames.
#[derive(Default)]
struct Paper {
    endpoint: Endpoint,
    sent: Vec<u8>,
    answer: Vec<u8>,
}

impl Port for Paper {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent.extend(bytes);
        for byte in bytes {
            self.answer.extend(self.endpoint.push(*byte, &mut StubDevice).unwrap_or_default());
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        let count = buffer.len().min(self.answer.len());
        buffer[..count].copy_from_slice(&self.answer[..count]);
        self.answer.drain(..count);
        Ok(count)
    }
}

struct StubDevice;

impl Device for StubDevice {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        let [config_words, input_words, output_words] = [1; 3];
        let identity =
            Identity { config_words, input_words, output_words, stages: 0, counted: CostUnit::Nothing, description: 0 };
        if *request == Request::Hello { Reply::Identity(identity) } else { Reply::Done }
    }
}

/// `operate`: its commands end when another host stops the machine, also during a wait. Waiting lines are skipped.
fn scripts(bench: &Bench, link: &Path, observer: &mut Observer) {
    let stop = |request, phase| {
        // Disconnected again, so that it is not in control.
        let mut other = Host::open(link, 5).unwrap();
        other.done(&Request::Supervise { request });
        other.wait("the stop", |status| status.phase == phase);
    };
    let operate = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.args(["operate", "--socket"]).arg(link).arg(&bench.spec).args(words).stdin(Stdio::piped());
        ProcessGuard::new(&mut command)
    };
    let up = ["none", "arm", "wait holding", "run", "wait arrived"];
    let script = operate(&[&up[..], &["wait 600", "jog x=5um"]].concat());
    observer.wait("its bias pose", |place| place.phase == RUNNING && place.status & BUSY == 0);
    stop(HOLD, HOLDING);
    let output = script.wait();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && text.contains("the machine was stopped, and is holding"), "{text}");
    stop(RAMP_DOWN, DISARMED);

    let mut session = operate(&[]);
    let mut input = session.0.as_mut().unwrap().stdin.take().unwrap();
    let lines = format!("{}\njog x=8um\nwait arrived\njog x=-8um\nstatus\n", up.join("\n"));
    input.write_all(lines.as_bytes()).unwrap();
    observer.wait("the jog", |place| place.target[0] > 1e-6);
    stop(HOLD, HOLDING);
    observer.assert_at_rest("held while it waits");
    stop(RAMP_DOWN, DISARMED);
    drop(input);
    let output = session.wait();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("the machine was stopped: command skipped") && text.contains("tick"), "{text}");

    // A stop from a terminal overtakes waiting lines.
    let mut command = Command::new("script");
    let line =
        format!("{} operate --socket {} {}", env!("CARGO_BIN_EXE_specgen"), link.display(), bench.spec.display());
    command.args(["-qec", &line, "/dev/null"]).stdin(Stdio::piped());
    let mut session = ProcessGuard::new(&mut command);
    let mut input = session.0.as_mut().unwrap().stdin.take().unwrap();
    input.write_all(format!("{}\nwait 600\njog x=5um\n", up.join("\n")).as_bytes()).unwrap();
    observer.wait("its bias pose", |place| place.phase == RUNNING && place.status & BUSY == 0);
    input.write_all(b"hold\n").unwrap();
    observer.wait("the hold", |place| place.phase == HOLDING);
    observer.assert_at_rest("held from the terminal");
    input.write_all(b"ramp-down\n").unwrap();
    observer.wait("the way down", |place| place.phase == DISARMED);
    drop((input, session));
}

/// Every kind of stop, from both, at several times during arming and the move to the bias.
fn stops_during_start_up(bridge: &Bridge, observer: &mut Observer) {
    let (mut a, mut b) = (bridge.client(), bridge.client());
    let given = ["\u{18}", "STP\n", "HLT X\n", "\u{18}"];
    for (count, stop) in given.into_iter().enumerate().take(length(1, 4)) {
        a.send("SVO X 1\nMOV X 5\nMOV X -5 Y 2");
        match count {
            0 => observer.wait("arming", |place| place.phase == ARMING),
            1 => observer.wait("the way to the bias", |place| place.phase == RUNNING),
            _ => {}
        }
        let who = if count == 3 { &mut a } else { &mut b };
        who.0.write_all(stop.as_bytes()).unwrap();
        assert_eq!(who.error(), "10", "{stop:?}");
        observer.assert_at_rest(&format!("{stop:?} during start-up, {count}"));
        assert!(observer.now().target[0].abs() < 1e-12, "{:?}", observer.now());
        if count < 3 {
            assert_eq!(a.error(), "10", "it is told that its moves were taken away");
        }
        // And none of it is executed later.
        assert_eq!(a.order("SVO X 1"), "0");
        a.settle();
        observer.assert_at_rest("at its bias pose");
        assert!(observer.now().phase == RUNNING && observer.now().target[0].abs() < 1e-12, "{:?}", observer.now());
        assert_eq!(a.order("SVO X 0"), "0");
        observer.wait("the way down", |place| place.phase == DISARMED);
    }
}

fn servo_off_and_on_again(bridge: &Bridge, observer: &mut Observer) {
    let mut client = bridge.client();
    assert_eq!([client.order("SVO X 1"), client.order("MOV X -6")], ["0", "0"]);
    client.settle();
    assert!((observer.now().target[0] + 6e-6).abs() < 1e-12);
    // Also after queued moves.
    client.send("MOV X 4\nMOV X -4\nSVO X 0");
    observer.wait("the way down", |place| place.phase == DISARMED);
    assert_eq!(client.order("SVO X 1"), "10");
    client.settle();
    observer.assert_at_rest("the servo on again");
    assert!(observer.now().target[0].abs() < 1e-12, "an old target: {:?}", observer.now());
}

/// Twenty thousand moves in one piece.
fn flood() -> Vec<u8> {
    (0..20_000_u32).flat_map(|count| format!("MOV X {}\n", 3 - 6 * (count as i32 % 2)).into_bytes()).collect()
}

fn a_stop_overtakes_unread_moves(bridge: &Bridge, observer: &mut Observer) {
    let mut b = bridge.client();
    let all = ["another client", "the same client", "another client, the first one gone"];
    for who in all.into_iter().take(length(1, 3)) {
        let mut a = bridge.client();
        // A client that disconnects gives up control.
        wait_for("control", || matches!(a.order("SVO X 1").as_str(), "0"));
        a.settle();
        let mut bytes = flood();
        if who == "the same client" {
            bytes.push(24);
        }
        a.0.write_all(&bytes).unwrap();
        let answer = if who == "the same client" {
            a.error()
        } else {
            if who != "another client" {
                drop(a);
            }
            std::thread::sleep(Duration::from_millis(5));
            b.0.write_all(&[24]).unwrap();
            b.error()
        };
        assert_eq!(answer, "10", "{who}");
        observer.assert_at_rest(who);
        assert_eq!(observer.now().phase, RUNNING);
    }
    // Later commands are executed.
    let mut a = bridge.client();
    a.0.write_all(&[&flood()[..], &b"\x18MOV X 2\n"[..]].concat()).unwrap();
    wait_for("the move", || (observer.now().target[0] - 2e-6).abs() < 1e-12);
    assert_eq!(a.error(), "10");
}

/// A hold and a ramp-down over the link: earlier commands of the bridge's clients are not executed when the machine runs again.
fn by_another_host(bridge: &Bridge, link: &Path, observer: &mut Observer) {
    let (mut a, mut host) = (bridge.client(), Host::open(link, 3).unwrap());
    for (request, phase) in [(HOLD, HOLDING), (RAMP_DOWN, DISARMED)] {
        assert_eq!(a.order("SVO X 1"), "0");
        a.settle();
        a.0.write_all(&[&flood()[..], &b"SVO X 1\nMOV X 5\n"[..]].concat()).unwrap();
        host.done(&Request::Supervise { request });
        host.wait("the stop", |status| status.phase == phase);
        observer.assert_at_rest("stopped by another host");
        assert_eq!((observer.now().phase, a.error().as_str()), (phase, "10"));
        assert_eq!(a.order("SVO X 1"), "0");
        a.settle();
        let before = observer.now();
        observer.assert_at_rest("run again");
        assert!(before.phase == RUNNING && (phase == HOLDING || before.target[0].abs() < 1e-12), "{before:?}");
    }
    // During start-up.
    assert_eq!(a.order("SVO X 0"), "0");
    observer.wait("the way down", |place| place.phase == DISARMED);
    a.send("SVO X 1\nMOV X 5");
    observer.wait("arming", |place| place.phase == ARMING);
    host.done(&Request::Supervise { request: HOLD });
    observer.assert_at_rest("held while it armed");
    assert!(observer.now().phase != RUNNING, "{:?}", observer.now());
    assert_eq!(a.order("SVO X 0"), "10");
    observer.wait("the way down", |place| place.phase == DISARMED);
}

/// Clients that occupy all places: the next one may stop the machine, and replaces one that has long been silent.
fn many_clients(bridge: &Bridge, observer: &mut Observer) {
    let mut a = bridge.client();
    wait_for("control", || matches!(a.order("SVO X 1").as_str(), "0"));
    assert_eq!(a.order("MOV Z 15"), "0");
    a.settle();
    let silent: Vec<gcs::Client> = (0..40).map(|_| bridge.client()).collect();
    a.send("MOV X 30");
    observer.wait("the motion in a crowd", |place| place.target[0] > 4e-6);
    let mut stopper = bridge.client();
    stopper.0.write_all(&[24]).unwrap();
    assert_eq!(stopper.error(), "10");
    observer.assert_at_rest("stopped by a client over the limit");
    assert!(observer.now().target[0] < 29e-6 && a.error() == "0", "the first is still there");
    wait_for("a place", || bridge.client().order("HLP") == "2");
    drop(silent);
    assert_eq!(a.order("SVO X 0"), "0");
    observer.wait("the way down", |place| place.phase == DISARMED);
}

/// Pages: a hold from one page ends the command of another; connections without the token block nobody.
fn pages(bench: &Bench, link: &Path, observer: &mut Observer) {
    let panel = Panel::new(&bench.spec, link);
    let (mut first, mut second) = (panel.page(), panel.page());
    first.takes_control();
    for request in ["arm", "run"] {
        first.say(&json!({ "do": "begin", "request": request, "id": 900 }));
    }
    for count in 0..8 {
        first.say(&json!({ "do": "command", "line": format!("jog x={}um", 1 + count), "id": 901 + count }));
    }
    observer.wait("arming", |place| place.phase == ARMING);
    second.say(&json!({ "do": "hold" }));
    observer.wait("the way down", |place| place.phase == DISARMED);
    observer.assert_at_rest("held from another page");
    assert_eq!(observer.now().phase, DISARMED);

    // A hundred connections that never complete their requests.
    let over = Arc::new(AtomicBool::new(false));
    let crowd: Vec<_> = (0..100)
        .map(|_| {
            let (over, address) = (over.clone(), panel.address.clone());
            std::thread::spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    let Ok(mut stream) = TcpStream::connect(&address) else { continue };
                    let _ = stream.set_read_timeout(Some(Duration::from_millis(100)));
                    while !over.load(Ordering::Relaxed) && stream.write_all(b"G").is_ok() {
                        if stream.read(&mut [0; 64]).is_ok() {
                            break;
                        }
                    }
                }
            })
        })
        .collect();
    std::thread::sleep(Duration::from_millis(300));
    for load in 0..48 {
        let page = panel.get(&format!("/?token={}", panel.token), "");
        assert!(page.starts_with("HTTP/1.1 200"), "load {load}: {page:.60}");
    }
    second.say(&json!({ "do": "request-control" }));
    over.store(true, Ordering::Relaxed);
    for thread in crowd {
        thread.join().unwrap();
    }
    drop((first, second));
    panel.end();
}
