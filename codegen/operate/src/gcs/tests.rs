//! Clients that flood the server and never read: another client can still stop the machine, which is polled as often as ever.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use specgen_link::client::{Port, Timeout};
use specgen_link::{
    Bytes, CostUnit, Counters, Device, Endpoint, Identity, RecorderAction, RecorderStatus, Refusal, Reply, Request,
    Status, put_words,
};

use super::{Axes, Bridge, Stage};
use crate::session::Session;

/// A running machine with upright legs, which executes commands immediately.
const DESCRIPTION: &str = "name=made up\ndigest=0123456789\nversion=1\nscalar_bits=64\nconfig_names=\n\
    input_names=command,setpoint[0],setpoint[1],setpoint[2],setpoint[3],setpoint[4],setpoint[5],gauge[0]\noutput_names=\nperiod=1e-4\n\
    kind=platform\norigin=0.0,0.0,1e-5,0.0,0.0,0.0\nbound=5e-5,5e-5,5e-5,4e-4,4e-4,4e-4\nspeed=1e-4,1e-4,1e-4,1e-3,1e-3,1e-3\n\
    stroke=7e-5\nrest_leg=0,0,0.2,0,0,0.2,0,0,0.2,0,0,0.2,0,0,0.2,0,0,0.2\n\
    platform_joint=0.1,0,0,0.05,0.08,0,-0.05,0.08,0,-0.1,0,0,-0.05,-0.08,0,0.05,-0.08,0\ntrajectories=\n";
const RUNNING: u8 = 2;
const MOVE: u64 = 2;
/// Ticks between two requests.
const TICKS: u64 = 10;
/// Time until link and machine answer.
const ANSWER: Duration = Duration::from_micros(100);
/// Limit of the median time of a stop; the computer may be loaded.
const STOPS: Duration = Duration::from_millis(50);
/// Interval in which the machine must be polled, with a factor of two for the same reason.
const ASKED: Duration = Duration::from_millis(40);
/// Duration of a flood before the first stop.
const FLOOD: Duration = Duration::from_millis(300);

/// A request to the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Ask {
    Place,
    Move,
    Stop,
}

type Asks = Arc<Mutex<Vec<(Instant, Ask)>>>;

struct Machine {
    asks: Asks,
    tick: u64,
    target: [u64; 6],
    bytes: [u8; 24 * 8],
    /// How many more times the stopped recorder reports that it still writes.
    writes: u32,
}

impl Device for Machine {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        self.tick += TICKS;
        let ask = |ask| self.asks.lock().unwrap().push((Instant::now(), ask));
        match request {
            Request::Hello => Reply::Identity(Identity {
                config_words: 0,
                input_words: 8,
                output_words: 0,
                stages: 0,
                counted: CostUnit::Nothing,
                description: DESCRIPTION.len() as u32,
            }),
            Request::Describe { offset } => {
                let rest = &DESCRIPTION.as_bytes()[*offset as usize..];
                let bytes = Bytes(&rest[..rest.len().min(256)]);
                Reply::Chunk { offset: *offset, total: DESCRIPTION.len() as u32, bytes }
            }
            Request::Status => Reply::Status(Status {
                tick: self.tick,
                phase: RUNNING,
                cause: 0,
                finding: 0,
                amplifier_on: true,
                status: 0,
                events: 0,
                late: 0,
                age: Some(0),
                link: Counters::NONE,
            }),
            Request::Place => {
                ask(Ask::Place);
                let mut words = [0; 24];
                words[12..18].copy_from_slice(&self.target);
                let words = put_words(&words, &mut self.bytes).unwrap();
                Reply::Place { tick: self.tick, phase: RUNNING, status: 0, measured: Some(0), words }
            }
            Request::Setpoint { words } => {
                let words: Vec<u64> = words.words(7).unwrap().collect();
                ask(if words[0] == MOVE { Ask::Move } else { Ask::Stop });
                if words[0] == MOVE {
                    self.target.copy_from_slice(&words[1..]);
                }
                Reply::Done
            }
            Request::Recorder { .. } => {
                let running = self.writes > 0;
                self.writes = self.writes.saturating_sub(1);
                Reply::Recorder(RecorderStatus { running, triggered: true, ticks: 1, capacity: 2 })
            }
            _ => Reply::Refused(Refusal::State),
        }
    }
}

/// A link to it.
struct Line {
    machine: Machine,
    endpoint: Endpoint,
    answer: Vec<u8>,
}

impl Line {
    fn new(asks: Asks) -> Self {
        let machine = Machine { asks, tick: 0, target: [0; 6], bytes: [0; 24 * 8], writes: 3 };
        Self { machine, endpoint: Endpoint::new(), answer: Vec::new() }
    }
}

impl Port for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            self.answer.extend(self.endpoint.push(*byte, &mut self.machine).unwrap_or_default());
        }
        thread::sleep(ANSWER);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
        let count = buffer.len().min(self.answer.len());
        buffer[..count].copy_from_slice(&self.answer[..count]);
        self.answer.drain(..count);
        Ok(count)
    }
}

/// Runs one bench at a time, because it asserts times and loads all processors.
static ALONE: Mutex<()> = Mutex::new(());

/// A running bridge, and clients that flood it.
struct Bench {
    _alone: MutexGuard<'static, ()>,
    address: SocketAddr,
    asks: Asks,
    over: Arc<AtomicBool>,
    bridge: JoinHandle<()>,
    floods: Vec<(TcpStream, JoinHandle<()>)>,
}

impl Bench {
    fn new() -> Self {
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let asks = Asks::default();
        let session = Session::open(Line::new(asks.clone()), Timeout::PIPE, None).unwrap();
        let stage = Stage::new(session).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let mut bridge = Bridge::new(stage, Axes::default(), listener).unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let stop = over.clone();
        let bridge = thread::spawn(move || bridge.run(&stop, |_| {}).unwrap());
        Self { _alone: alone, address, asks, over, bridge, floods: Vec::new() }
    }

    fn client(&self) -> Client {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.set_nodelay(true).unwrap();
        Client(BufReader::new(stream))
    }

    /// Adds a client that sends `bytes` this many times.
    fn flood(&mut self, bytes: Vec<u8>, times: usize) {
        let stream = TcpStream::connect(self.address).unwrap();
        let mut sends = stream.try_clone().unwrap();
        let flood = thread::spawn(move || {
            for _ in 0..times {
                if sends.write_all(&bytes).is_err() {
                    break;
                }
            }
        });
        self.floods.push((stream, flood));
    }

    fn asks(&self) -> Vec<(Instant, Ask)> {
        self.asks.lock().unwrap().clone()
    }

    /// Asserts that one client can stop the machine during the floods, and that the machine is polled at its interval.
    fn stops_get_in(self, mut who: Client, what: &str) {
        let first = self.asks().len();
        thread::sleep(FLOOD);
        let mut times: Vec<Duration> = (0..10)
            .map(|count| {
                let (start, before) = (Instant::now(), self.asks().len());
                who.0.get_mut().write_all(b"\x18ERR?\n").unwrap();
                let answer = who.line();
                let time = start.elapsed();
                assert_eq!(answer, "10", "{what}, stop {count}");
                assert!(self.asks()[before..].iter().any(|(_, ask)| *ask == Ask::Stop), "{what}, stop {count}");
                thread::sleep(Duration::from_millis(20));
                time
            })
            .collect();
        times.sort();
        let asks = &self.asks()[first..];
        let start = asks[0].0;
        let place =
            |&&(time, ask): &&(Instant, Ask)| (ask == Ask::Place).then(|| (time - start).as_nanos() / ASKED.as_nanos());
        let mut intervals: Vec<_> = asks.iter().collect::<Vec<_>>().iter().filter_map(place).collect();
        intervals.dedup();
        let all = start.elapsed().as_nanos() / ASKED.as_nanos();
        intervals.retain(|interval| *interval < all);
        let (median, longest, polled) = (times[5].as_secs_f64() * 1e3, times[9].as_secs_f64() * 1e3, intervals.len());
        let milliseconds = ASKED.as_millis();
        println!(
            "gcs, {what}: stops answered after {median:.1} ms (median of 10), {longest:.1} ms (longest); machine polled in {polled} of {all} intervals of {milliseconds} ms"
        );
        assert!(times[5] <= STOPS, "{what}: {times:?}");
        assert!(intervals.len() as u128 * 4 >= all * 3, "{what}: {} of {all}", intervals.len());
        for (stream, flood) in self.floods {
            let _ = stream.shutdown(std::net::Shutdown::Both);
            flood.join().unwrap();
        }
        self.over.store(true, Ordering::Relaxed);
        self.bridge.join().unwrap();
    }
}

struct Client(BufReader<TcpStream>);

impl Client {
    fn line(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    }
}

fn moves(count: usize) -> Vec<u8> {
    (0..count).flat_map(|count| format!("MOV X {}\n", 3 - 6 * (count as i32 % 2)).into_bytes()).collect()
}

#[test]
fn one_client_floods() {
    for (what, bytes) in [
        ("questions", b"POS?\n".repeat(500)),
        ("questions that take long", b"TMX?\nTRA? X 1 Y 1\n".repeat(100)),
        ("moves", moves(500)),
        ("stops", vec![24; 2000]),
        ("stops in lines", b"STP\n".repeat(500)),
        ("ends of lines", b"\n".repeat(2000)),
        ("no end of a line", vec![b'A'; 2000]),
    ] {
        let mut bench = Bench::new();
        let who = bench.client();
        bench.flood(bytes, usize::MAX);
        bench.stops_get_in(who, what);
    }
}

#[test]
fn twenty_five_clients_flood() {
    for (what, bytes) in [("25 with questions", b"POS?\n".repeat(200)), ("25 with stops", b"STP\n".repeat(200))] {
        let mut bench = Bench::new();
        let who = bench.client();
        (0..25).for_each(|_| bench.flood(bytes.clone(), usize::MAX));
        bench.stops_get_in(who, what);
    }
}

/// After the stop none of them is executed, even if it was still in a buffer.
#[test]
fn a_hundred_thousand_moves_at_once() {
    let mut bench = Bench::new();
    let who = bench.client();
    bench.flood(moves(100_000), 1);
    let asks = bench.asks.clone();
    bench.stops_get_in(who, "100,000 moves");
    let asks = asks.lock().unwrap();
    let stop = asks.iter().position(|(_, ask)| *ask == Ask::Stop).unwrap();
    let moves = |asks: &[(Instant, Ask)]| asks.iter().filter(|(_, ask)| *ask == Ask::Move).count();
    assert_eq!(moves(&asks[stop..]), 0);
    assert!(moves(&asks[..stop]) > 0, "no move before the stop");
}

/// The F446 takes some ticks to write it, and a script downloads immediately.
#[test]
fn a_stop_of_the_recorder_waits_until_the_record_is_written() {
    let mut session = Session::open(Line::new(Asks::default()), Timeout::PIPE, None).unwrap();
    assert!(session.recorder(RecorderAction::Look).unwrap().running);
    assert!(!session.recorder(RecorderAction::Stop).unwrap().running);
}
