//! `specgen gcs` between clients of the General Command Set and the real-time program, with the exact bytes of clients. Times are
//! printed, not asserted.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use specgen::operate::{MeasuredPose, Session, SocketLine};
use specgen_link::Request;
use specgen_link::client::Timeout;

use super::host::Host;
use super::{Bench, DISARMED, HOLDING, NONE, ProcessGuard, RUNNING, wait_for};
use crate::support::length;

/// Largest distance from the target after arrival, µm: much more than the gauges' noise, much less than a move.
const THERE: f64 = 0.05;

/// The bridge, at a separate port.
pub struct Bridge {
    process: ProcessGuard,
    port: u16,
}

impl Bridge {
    fn new(bench: &Bench, more: &[&str]) -> Self {
        Self::new_at(bench, "gcs.link", more)
    }

    pub fn new_at(bench: &Bench, link: &str, more: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.args(["gcs", "--listen", "127.0.0.1:0", "--socket"]).arg(bench.path(link)).arg(&bench.spec);
        let mut process = command.args(more).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines();
        let port = said.find_map(|line| {
            let line = line.unwrap();
            line.split_once("GCS at 127.0.0.1:")?.1.split(';').next()?.parse().ok()
        });
        // Discard its later output, so that it does not block.
        std::thread::spawn(move || said.for_each(drop));
        Self { process: ProcessGuard(Some(process)), port: port.unwrap() }
    }

    pub fn client(&self) -> Client {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream.set_nodelay(true).unwrap();
        Client(stream)
    }

    /// Ends it like Ctrl-C.
    pub fn end(self) {
        assert_eq!(self.process.end(Signal::INT).status.code(), Some(0));
    }
}

pub struct Client(pub TcpStream);

impl Client {
    pub fn send(&mut self, text: &str) {
        self.0.write_all(text.as_bytes()).unwrap();
        self.0.write_all(b"\n").unwrap();
    }

    /// Lines up to one that does not end in a space.
    fn answer(&mut self) -> String {
        let mut bytes = Vec::new();
        while !bytes.ends_with(b"\n") || bytes.ends_with(b" \n") {
            let mut byte = [0];
            self.0.read_exact(&mut byte).unwrap();
            bytes.extend(byte);
        }
        bytes.pop();
        bytes.into_iter().map(char::from).collect()
    }

    pub fn ask(&mut self, text: &str) -> String {
        self.send(text);
        self.answer()
    }

    fn single(&mut self, byte: u8) -> String {
        self.0.write_all(&[byte]).unwrap();
        self.answer()
    }

    /// Sends raw bytes; returns an answer for each query.
    fn exchange<const N: usize>(&mut self, bytes: &[u8]) -> [String; N] {
        self.0.write_all(bytes).unwrap();
        std::array::from_fn(|_| self.answer())
    }

    pub fn error(&mut self) -> String {
        self.ask("ERR?")
    }

    /// Sends a command without an answer; returns its error.
    pub fn order(&mut self, text: &str) -> String {
        self.send(text);
        self.error()
    }

    fn value(&mut self, text: &str) -> f64 {
        self.ask(text).split_once('=').unwrap().1.parse().unwrap()
    }

    pub fn settle(&mut self) {
        wait_for("the end of the motion", || self.single(5) == "0");
    }
}

pub fn clients_move_it_and_none_disturbs_it(bench: &Bench) {
    let link = bench.path("gcs.link");
    let mut command = bench.command("gcs.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "1000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let bridge = Bridge::new(bench, &[]);
    let mut observer = Session::open(SocketLine::open(&link).unwrap(), Timeout::SOCKET, None).unwrap();
    let mut read_place = || observer.place().unwrap().unwrap();
    let mut first = bridge.client();

    // While another host of the link is in control, commands are refused, and the bridge continues.
    let mut host = Host::open(&link, 7).unwrap();
    host.done(&Request::Supervise { request: NONE });
    assert_eq!([first.order("SVO X 1"), first.ask("SVO? X")], ["89", "X=0"]);
    drop(host);

    identification(&mut first, &mut read_place);
    a_refused_move_moves_nothing(&mut first, &mut read_place);
    latency(&mut first, &mut read_place);
    clients_that_were_tried_are_answered(&mut first);
    let mut second = bridge.client();
    other_clients_may_read_and_stop((&bridge, &link), &mut first, &mut second, &mut read_place);
    control_is_free_once_a_client_leaves(first, &mut second, &mut read_place);
    // If the bridge is killed, the host is lost, and the machine holds. Another bridge can continue.
    drop(bridge);
    wait_for("the hold", || read_place().phase == HOLDING);
    let bridge = Bridge::new(bench, &[]);
    let mut client = bridge.client();
    assert_eq!([client.ask("SVO? X"), client.order("MOV X 1")], ["X=0", "5"]);
    assert_eq!([client.order("SVO X 1"), client.order("MOV X 1")], ["0", "0"]);
    client.settle();
    assert!((client.value("POS? X") - 1.0).abs() < THERE);
    drop(client);
    bridge.end();
    assert_eq!(read_place().phase, DISARMED, "Ctrl-C ramps down");

    // With a single named axis, for clients of single stages; and servo off works.
    let bridge = Bridge::new(bench, &["--axis", "1=Z"]);
    let mut client = bridge.client();
    assert_eq!(client.ask("SAI?"), "1");
    assert_eq!(client.ask("SPA? 1 0X7000601"), "1 0X7000601=um");
    assert_eq!([client.order("SVO 1 1"), client.order("MOV Z 3")], ["0", "15"]);
    assert_eq!(client.exchange(b"MOV 1 3\nERR?\n\x05"), ["0", "1"]);
    client.settle();
    assert!((client.value("POS? 1") - 3.0).abs() < THERE);
    assert_eq!(client.order("SVO 1 0"), "0");
    wait_for("the ramp down", || read_place().phase == DISARMED);
    assert_eq!([client.ask("SVO? 1"), client.order("MOV 1 1")], ["1=0", "5"]);
    drop(client);
    a_program_of_others(bench, bridge.port);
    bridge.end();

    let (summary, _) = bench.check(&running.end(Signal::INT), "gcs.rec");
    let causes: Vec<_> = summary["incidents"].as_array().unwrap().iter().map(|one| one["cause"].as_str()).collect();
    assert_eq!(causes, [Some("LinkLost")], "never disturbed but by the bridge that was killed: {summary:#}");
}

/// The free client `qmi` with its driver of a single stage, if installed.
fn a_program_of_others(bench: &Bench, port: u16) {
    let python = std::env::var("SPECGEN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import qmi"]).stderr(Stdio::null()).status();
    if !has.is_ok_and(|status| status.success()) {
        return crate::support::skipped(
            "no Python with qmi: its exchanges are tried byte by byte (pip install qmi, SPECGEN_PYTHON)",
        );
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rt_pc/qmi_client.py");
    let mut command = Command::new(&python);
    // It writes its log to the home folder.
    command.env("QMI_HOME", bench.folder.path()).arg(script).arg(port.to_string());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    print!("{}", String::from_utf8_lossy(&output.stdout));
}

fn identification(client: &mut Client, read_place: &mut impl FnMut() -> MeasuredPose) {
    let name = client.ask("*IDN?");
    assert!(name.starts_with("specgen,HEXAPOD reference,") && name.split(',').count() == 4, "{name}");
    assert_eq!([client.ask("CSV?"), client.error()], ["2.0", "0"]);
    assert_eq!(client.ask("SAI? ALL"), "X \nY \nZ \nU \nV \nW");
    assert_eq!([client.ask("SVO? X U"), client.single(4)], ["X=0 \nU=0", "65536"]);
    // Limits are those of the strokes, not of the workspace: there is no voltage below rest.
    let (lowest, highest, right) = (client.value("TMN? Z"), client.value("PLM? Z"), client.value("TMX? X"));
    assert!(
        (-9.9..-9.0).contains(&lowest) && (highest - 42.0).abs() < 1e-6 && right < 20.0,
        "{lowest} {highest} {right}"
    );
    assert_eq!(client.order("MOV X 1"), "5");
    assert_eq!(read_place().phase, DISARMED);
    assert_eq!([client.order("SVO X 1"), client.ask("SVO? X")], ["0", "X=1"]);
    assert_eq!(client.order("FRF"), "0");
    // Waits while the machine starts.
    assert_eq!(client.order("MOV X 0 Y 0 Z 15 U 0 V 0 W 0"), "0");
    client.settle();
    assert_eq!([client.ask("ONT? Z"), client.single(7), client.single(4)], ["Z=1", "\u{b1}", "102400"]);
    assert_eq!(read_place().phase, RUNNING);
}

fn a_refused_move_moves_nothing(client: &mut Client, read_place: &mut impl FnMut() -> MeasuredPose) {
    let mut worst: f64 = 0.0;
    let moves = length(6, 100_u32);
    for count in 0..moves {
        let to = f64::from(count * 37 % 41) * 0.25 - 5.0;
        assert_eq!(client.order(&format!("MOV X {to:.6} Z {:.6}", 15.0 - to)), "0");
        client.settle();
        assert_eq!([client.value("MOV? X"), client.value("MOV? Z")], [to, 15.0 - to]);
        for error in [client.value("POS? X") - to, client.value("POS? Z") - 15.0 + to] {
            assert!(error.abs() < THERE, "{count}: {error}");
            worst = if error.abs() > worst { error.abs() } else { worst };
        }
    }
    println!("gcs: {moves} moves, {:.1} nm from the target at most, gauges' noise included", 1e3 * worst);
    assert_eq!([client.order("MOV X 1 Y 2 Z 15"), client.order("MVR X 0.5")], ["0", "0"]);
    client.settle();
    assert_eq!([client.value("MOV? X"), client.value("MOV? Y")], [1.5, 2.0]);

    let before = read_place();
    for (order, code) in [
        ("MOV Q 1", "15"),
        ("MOV X 1 Q 1", "15"),
        ("MOV X 500", "7"),
        ("MOV Y 1 Z -11", "7"),
        ("MVR U 399 V 399", "7"),
        ("MOV X", "24"),
        ("MOV", "24"),
        ("MOV X one", "1"),
        ("MOV X nan", "1"),
        ("MOV X 1 X 2", "22"),
        ("VLS 50", "8"),
        ("VEL X 50", "8"),
        ("SVO X 2", "17"),
        ("WHO", "2"),
        ("VLS 100", "0"),
        ("VEL X 100", "0"),
    ] {
        assert_eq!(client.order(order), code, "{order}");
        let now = read_place();
        assert!(now.target == before.target && now.phase == RUNNING && now.status >> 16 == 0, "{order}: {now:?}");
    }
    assert_eq!(client.ask("VMO? X 1 Y 2"), "1");
    assert_eq!(client.ask("VMO? Z -11"), "0");
    // Up to the reach along a direction, and no further.
    let far = client.value("TRA? X 1");
    assert_eq!(client.order(&format!("MOV X {:.6}", far - 0.001)), "0");
    assert_eq!(client.order(&format!("MOV X {:.6}", far + 0.001)), "7");
    // After a stop during a move, it is at the reported position.
    wait_for("the motion", || client.value("POS? X") > 3.0);
    client.0.write_all(&[24]).unwrap();
    assert_eq!(client.error(), "10");
    client.settle();
    let stood = client.value("MOV? X");
    assert!(stood < far - 1.0 && (client.value("POS? X") - stood).abs() < THERE, "{stood}");
    // A rotation about a pivot keeps its coordinates, and moves those of the platform.
    assert_eq!(client.order("MOV X 0 Y 0"), "0");
    client.settle();
    assert_eq!(client.order("SPI T -10000"), "0");
    assert_eq!([client.order("MOV V 100"), client.order("SPI T 0")], ["0", "93"]);
    client.settle();
    assert_eq!([client.value("MOV? X"), client.ask("SPI? T").trim_start_matches("T=").parse().unwrap()], [0.0, -1e4]);
    // −(R − I) c of c = (0, 0, −10 mm) turned by 100 µrad about y: +1 µm in x.
    let x = read_place().target[0];
    assert!((x - 1e-6).abs() < 1e-10, "{x}");
    assert_eq!([client.order("SPI T 0"), client.order("MOV V 0 X 0")], ["9", "0"]);
    client.settle();
    assert_eq!(client.order("SPI T 0"), "0");
}

/// Latency from a command to the first tick whose set-point follows it, as seen by another host.
fn latency(client: &mut Client, read_place: &mut impl FnMut() -> MeasuredPose) {
    let times = length(3, 50);
    let mut times: Vec<f64> = (0..times)
        .map(|count| {
            let before = read_place().target;
            let start = Instant::now();
            client.send(&format!("MOV Y {}", 2 - count % 2));
            while read_place().target == before {
                assert!(start.elapsed() < Duration::from_secs(20));
            }
            let time = start.elapsed().as_secs_f64() * 1e3;
            client.settle();
            time
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let (median, longest, all) = (times[times.len() / 2], times[times.len() - 1], times.len());
    println!("gcs: MOV to the first tick that follows: {median:.2} ms (median), {longest:.2} ms (longest of {all})");
}

/// The exact bytes that Micro-Manager's `PI_GCS_2` and EPICS' `motorPIGCS2` sent in a trial.
fn clients_that_were_tried_are_answered(client: &mut Client) {
    // Micro-Manager: its start, which continues without `EAX`, and a move. It parses the mask as C does: it could not parse `3F`, and
    // would take the platform to be at rest.
    assert_eq!(client.exchange::<5>(b"*IDN?\nTPC?\nERR?\nJON? 1\nERR?\n")[1..], ["0", "0", "1=0", "0"]);
    assert_eq!(client.exchange(b"EAX X 1\nERR?\nSVO X 1\nERR?\nHIN? X\nCSV?\nERR?\n"), ["2", "0", "X=0", "2.0", "0"]);
    assert_eq!(client.exchange(b"MOV X -5.12 Y 2.25\nERR?\n\x05ERR?\n"), ["0", "0x3F", "0"]);
    client.settle();
    let [both] = client.exchange(b"POS? X Y\n");
    let lines: Vec<_> = both.split(" \n").map(|line| line.split_at(2)).collect();
    let near = |(name, text): (&str, &str), expected: (&str, f64)| {
        name == expected.0 && (text.parse::<f64>().unwrap() - expected.1).abs() < THERE
    };
    assert!(lines.len() == 2 && near(lines[0], ("X=", -5.12)) && near(lines[1], ("Y=", 2.25)), "{both}");
    assert_eq!(client.exchange(b"MOV X 5 Y 0\nERR?\n"), ["0"]);
    assert_eq!(client.exchange(b"HLT X\nERR?\n"), ["10"]);
    client.send("HLT Y");
    client.settle();
    // It has not queried the error of the second stop, so it gets that error after the next move, which is executed.
    assert_eq!(client.exchange(b"MOV X 0 Y 0\nERR?\nMOV X 1 Y 0\nERR?\n"), ["10", "0"]);
    client.settle();
    assert_eq!(client.exchange(b"FRF X Y \nERR?\n\x07"), ["0", "\u{b1}"]);
    // EPICS: its start, a move, a stop, a move beyond reach, home.
    assert_eq!(client.exchange::<4>(b"\x04SPI? R S T\nSVO W 1\nERR?\nVLS?\n")[2..], ["0", "100.000000"]);
    assert_eq!(client.exchange(b"VLS 100.000000\nMOV Z 30.000000\n\x05"), ["0x3F"]);
    assert_eq!(client.exchange(b"\x18ERR?\n"), ["10"]);
    client.settle();
    assert_eq!(client.exchange(b"VLS 100.000000\nMOV Z 100.000000\n\x05ERR?\n"), ["0", "7"]);
    assert_eq!(client.exchange(b"SVO Z 1\nERR?\nFRF Z\nERR?\n\x05"), ["0", "0", "0"]);
    assert_eq!(client.order("MOV X 0 Z 15"), "0");
    client.settle();
    // Like most clients without TCP_NODELAY: data after a command without an answer waits for its acknowledgement.
    client.0.set_nodelay(false).unwrap();
    let mut times: Vec<f64> = (0..length(5, 20))
        .map(|_| {
            let start = Instant::now();
            assert_eq!(client.order("VLS 100"), "0");
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    client.0.set_nodelay(true).unwrap();
    times.sort_by(f64::total_cmp);
    println!("gcs: order and ERR? without TCP_NODELAY: {:.2} ms (median)", times[times.len() / 2]);
}

fn other_clients_may_read_and_stop(
    (bridge, link): (&Bridge, &Path),
    first: &mut Client,
    second: &mut Client,
    read_place: &mut impl FnMut() -> MeasuredPose,
) {
    assert_eq!([second.order("MOV X 1"), second.order("SVO X 0")], ["89", "89"]);
    // A host that only queries is not missed when it leaves, and prints no warning.
    let mut operate = Command::new(env!("CARGO_BIN_EXE_specgen"));
    let looked = operate.args(["operate", "--socket"]).arg(link).args(["status", "where", "limits"]).output().unwrap();
    let (said, shown) = (String::from_utf8_lossy(&looked.stderr), String::from_utf8_lossy(&looked.stdout));
    assert!(looked.status.success() && !said.contains("holds, then ramps down"), "{said}");
    assert!(shown.contains("running, amplifiers on") && shown.contains("  legs 0 to 5: "), "{shown}");
    // One that queries and never reads, one that sends invalid commands, one that disconnects within a line.
    let mut deaf = bridge.client();
    deaf.0.set_write_timeout(Some(Duration::from_millis(100))).unwrap();
    let _ = deaf.0.write_all(&b"POS?\n".repeat(100_000));
    let mut garbage = bridge.client();
    let bytes: Vec<u8> = (0..40_000_u32).map(|count| (count.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    garbage.0.set_write_timeout(Some(Duration::from_millis(100))).unwrap();
    // Without the stop byte, which every client may send.
    let _ = garbage.0.write_all(&bytes.into_iter().filter(|byte| *byte != 24).collect::<Vec<_>>());
    bridge.client().0.write_all(b"MOV X").unwrap();
    second.0.write_all(&b"XYZZY 1 2\n".repeat(10_000)).unwrap();
    for count in 0..length(4, 10_u32) {
        let to = f64::from(count % 3);
        assert_eq!(first.order(&format!("MOV X {to:.6}")), "0", "{count}");
        first.settle();
        assert!((first.value("POS? X") - to).abs() < THERE);
        assert_eq!(read_place().phase, RUNNING);
    }
    assert_eq!([second.error(), second.error()], ["2", "0"]);
    // Every client may stop.
    assert_eq!(first.order("MOV X 30"), "0");
    wait_for("the motion", || second.value("POS? X") > 5.0);
    assert_eq!(second.order("HLT"), "10");
    first.settle();
    assert!(first.value("MOV? X") < 29.0 && read_place().phase == RUNNING);
    assert_eq!(first.error(), "0", "each client has its own errors");
}

fn control_is_free_once_a_client_leaves(
    mut first: Client,
    second: &mut Client,
    read_place: &mut impl FnMut() -> MeasuredPose,
) {
    assert_eq!(first.order("MOV X -20"), "0");
    wait_for("the motion", || second.value("POS? X") < 0.0);
    drop(first);
    second.settle();
    assert!((second.value("POS? X") + 20.0).abs() < THERE, "it goes where it was sent, and stays");
    assert_eq!(read_place().phase, RUNNING);
    assert_eq!([second.order("MOV X 0"), second.error()], ["0", "0"]);
    second.settle();
}
