//! `specgen panel` between pages and the real-time program on a simulated machine. Pages are simulated here by their bytes, except one
//! in a real browser ([`browser`]).

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{Shutdown, TcpStream};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::{Value, json};
use specgen::{compile, machine, plant_server};
use specgen_link::{Request, Status};
use specgen_rt::exchange::{Server, path_of};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::host::Host;
use super::{Bench, FAULTED, HOLDING, LINK_LOST, ProcessGuard, RAMP_DOWN, Record, wait_for};
use crate::support::Background;

mod browser;

/// Timeout on a loaded computer.
const LONG: Duration = Duration::from_secs(60);

/// The panel, at a separate port.
pub struct Panel {
    process: ProcessGuard,
    pub address: String,
    pub token: String,
}

impl Panel {
    pub fn new(spec: &Path, link: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
        command.arg("panel").arg(spec).args(["--listen", "127.0.0.1:0", "--socket"]).arg(link);
        command.arg("--commission").arg(link.with_extension("commission"));
        let mut process = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines();
        let printed =
            said.find_map(|line| line.unwrap().split_once("panel at http://").map(|(_, rest)| rest.to_owned()));
        // Read its later output, so that it does not block.
        std::thread::spawn(move || said.map_while(Result::ok).for_each(|line| println!("panel: {line}")));
        let printed = printed.expect("it says where it is");
        let (address, token) = printed.split_once("/?token=").unwrap();
        Self { process: ProcessGuard(Some(process)), address: address.to_owned(), token: token.to_owned() }
    }

    fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }

    /// The raw answer to a request.
    pub fn get(&self, path: &str, fields: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\n{fields}\r\n", self.address).unwrap();
        std::io::read_to_string(stream).unwrap()
    }

    pub fn page(&self) -> Page {
        let mut request = format!("ws://{}/socket?token={}", self.address, self.token).into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{}", self.address).parse().unwrap());
        let stream = TcpStream::connect(&self.address).unwrap();
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        socket.get_ref().set_read_timeout(Some(LONG)).unwrap();
        Page { socket, state: Value::Null, events: Vec::new(), ticks: None, gap: 0, asked: 0 }
    }

    /// Ends it like Ctrl-C.
    pub fn end(self) {
        assert_eq!(self.process.end(Signal::INT).status.code(), Some(0));
    }
}

/// A page with the protocol of the real one.
pub struct Page {
    socket: WebSocket<TcpStream>,
    state: Value,
    events: Vec<String>,
    /// First tick of the next row, and number of missing ticks.
    ticks: Option<u64>,
    gap: u64,
    asked: u64,
}

impl Page {
    pub fn say(&mut self, what: &Value) {
        self.socket.send(Message::text(what.to_string())).unwrap();
    }

    /// Takes one message, and returns it if it is an answer or a record.
    fn hear(&mut self) -> Option<Message> {
        let message = self.socket.read().unwrap();
        match &message {
            Message::Text(text) => {
                let value: Value = serde_json::from_str(text).unwrap();
                match value["k"].as_str() {
                    Some("state" | "left" | "lost") => {
                        self.state = value;
                        self.say(&json!({ "do": "seen", "number": 0 }));
                    }
                    Some("event") => self.events.push(value["text"].as_str().unwrap().to_owned()),
                    Some("answer") => return Some(message),
                    _ => {}
                }
            }
            Message::Binary(bytes) => {
                let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                if word(0) == 2 {
                    return Some(message);
                }
                let mut at = 72;
                for _ in 0..word(4) {
                    let tick = f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as u64;
                    let (every, rows) = (u64::from(word(at + 12)), u64::from(word(at + 16)));
                    self.gap += self.ticks.map_or(0, |next| tick - next);
                    self.ticks = Some(tick + every * rows);
                    at += 24 + 200 * rows as usize;
                }
                assert_eq!(at, bytes.len());
                let number = word(8);
                self.say(&json!({ "do": "seen", "number": number }));
            }
            _ => {}
        }
        None
    }

    fn wait(&mut self, what: &str, mut there: impl FnMut(&Value) -> bool) {
        let start = Instant::now();
        while !there(&self.state) {
            assert!(start.elapsed() < LONG, "{what}: {:#}", self.state);
            self.hear();
        }
    }

    fn phase(&mut self, phase: &str) {
        self.wait(phase, |state| state["phase"] == phase);
    }

    /// A command's answer.
    fn command(&mut self, mut what: Value) -> Value {
        self.asked += 1;
        what["id"] = json!(self.asked);
        self.say(&what);
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < LONG, "no answer to {what}");
            if let Some(Message::Text(text)) = self.hear() {
                let answer: Value = serde_json::from_str(&text).unwrap();
                if answer["id"] == self.asked {
                    return answer;
                }
            }
        }
    }

    fn line(&mut self, line: &str) -> Value {
        self.command(json!({ "do": "command", "line": line }))
    }

    #[track_caller]
    fn done(&mut self, what: Value) -> Value {
        let answer = self.command(what);
        assert_eq!(answer["ok"], true, "{answer}");
        answer["value"].clone()
    }

    #[track_caller]
    fn refused(&mut self, what: Value, why: &str) {
        let answer = self.command(what);
        assert!(answer["ok"] == false && answer["why"].as_str().unwrap().contains(why), "{why}: {answer}");
    }

    pub fn takes_control(&mut self) {
        self.say(&json!({ "do": "request-control" }));
        self.wait("control", |state| state["mine"] == true);
    }

    /// Armed and running at its bias.
    fn runs(&mut self) {
        self.done(json!({ "do": "begin", "request": "arm" }));
        self.phase("holding");
        self.done(json!({ "do": "begin", "request": "run" }));
        self.wait("arrived", |state| state["phase"] == "running" && state["said"]["what"] == "Running. Nothing to do.");
    }
}

/// A program on the simulated machine, at a link.
fn program(bench: &Bench, name: &str, plant: &str, link: &Path) -> ProcessGuard {
    let mut command = Command::new(&bench.programs.binary);
    command.args([
        "--sim",
        plant,
        "--allow-no-rt",
        "--json",
        "--elastic",
        "--sim-timeout",
        "5000",
        "--link-silence",
        "1000",
    ]);
    command.arg("--record").arg(bench.path(name)).arg("--link").arg(link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    running
}

#[test]
fn pages_operate_a_machine_one_is_in_control_and_a_page_that_leaves_is_a_host_that_is_lost() {
    let bench = Bench::named("reference.toml", "panel");
    let link = bench.path("panel.link");
    let running = program(&bench, "panel.rec", &bench.name, &link);
    let panel = Panel::new(&bench.spec, &link);
    nobody_gets_in_without_the_token_or_from_elsewhere(&panel);

    let mut first = panel.page();
    first.phase("disarmed");
    first.refused(json!({ "do": "begin", "request": "arm" }), "is not in control");
    first.takes_control();
    first.runs();

    // The other page watches: hold works, moving does not, and it gets control if it is granted, or not answered within ten seconds.
    let mut second = panel.page();
    second.wait("another page in control", |state| state["holder"] == "page 1" || state["holder"].is_string());
    second.refused(json!({ "do": "command", "line": "jog x=100nm" }), "is not in control");
    let answer = first.line("jog z=1um");
    assert_eq!(answer["ok"], true, "{answer}");
    second.say(&json!({ "do": "hold" }));
    first.phase("holding");
    first.done(json!({ "do": "begin", "request": "run" }));
    first.phase("running");
    drop(second);

    // Unstable gains are not sent; invalid commands have no effect.
    let answer = first.command(json!({ "do": "gain", "factor": 30.0 }));
    assert!(answer["ok"] == false && answer["why"].as_str().unwrap().starts_with("not sent: E"), "{answer}");
    let gains = first.done(json!({ "do": "gain", "factor": 0.5 }));
    assert!(gains["gain_ratio_limit"].as_f64().unwrap() > 1.1, "{gains}");
    // Settings that differ from the spec are named until they are restored.
    first.wait("changed gains", |state| {
        state["known"]["differ"].as_array().is_some_and(|names| names.contains(&json!("kp")))
    });
    first.done(json!({ "do": "restore" }));
    first.wait("the gains of the spec", |state| state["known"]["differ"] == json!([]));
    for line in ["config write x.toml", "record download /tmp/x", "shutdown", "stop", "wait 5", "fly"] {
        assert_eq!(first.line(line)["ok"], false, "{line}");
    }
    garbage_disturbs_nothing(&panel, &mut first);

    // A wave by the text of its file, a record over the socket.
    let wave = "ramp = 0.1\n[[axis]]\naxis = \"z\"\nshape = { kind = \"sine\", amplitude = 1e-7, frequency = 5.0 }\n";
    first.refused(json!({ "do": "wave", "name": "w", "text": "ramp = 1" }), "axis");
    first.done(json!({ "do": "command", "line": "goto zero" }));
    first.done(json!({ "do": "command", "line": "record arm 500" }));
    // It starts at its center.
    let start = Instant::now();
    while first.command(json!({ "do": "wave", "name": "small.toml", "text": wave }))["ok"] == false {
        assert!(start.elapsed() < LONG, "no wave: {:#}", first.state);
    }
    first.refused(json!({ "do": "command", "line": "jog z=100nm" }), "in progress");
    first.done(json!({ "do": "command", "line": "wave stop" }));
    first.done(json!({ "do": "command", "line": "record stop" }));
    first.say(&json!({ "do": "download", "id": 999 }));
    let bytes = loop {
        if let Some(Message::Binary(bytes)) = first.hear() {
            break bytes[4..].to_vec();
        }
    };
    // Every tick was in a row, or reported as missing.
    assert!(first.gap == 0 || first.events.iter().any(|text| text.contains("were lost")), "{} ticks", first.gap);
    let record = Record::new(bytes);
    let replay = record.replay(&mut bench.machine());
    assert!(replay.divergence.is_none() && replay.ticks == record.rows.len() as u64 && replay.ticks > 100);

    // Handed over, then the page is closed: the machine holds.
    let mut second = panel.page();
    second.say(&json!({ "do": "request-control" }));
    first.wait("asked", |state| state["asked"]["by"].is_string());
    first.say(&json!({ "do": "grant-control" }));
    second.wait("control", |state| state["mine"] == true);
    first.wait("without them", |state| state["mine"] == false);
    drop(second);
    first.wait("left alone", |state| state["k"] == "left");
    // Its time may be slower than that of pages: another host polls until the machine has lost its host.
    let mut watcher = Host::open(&link, 1).unwrap();
    let is_lost = |status: &Status| (status.phase, status.cause) == (HOLDING, LINK_LOST);
    watcher.wait("the loss", is_lost);
    first.takes_control();
    first.wait("held for the lost host", |state| state["status"]["phase"] == HOLDING);
    assert_eq!(first.state["said"]["what"], "Holding. The host was silent.");
    // A silent page also counts as gone.
    first.done(json!({ "do": "begin", "request": "run" }));
    first.phase("running");
    let mut third = panel.page();
    std::thread::sleep(Duration::from_millis(100));
    third.wait("a page that stopped responding", |state| state["k"] == "left");
    watcher.wait("the second loss", is_lost);
    drop(watcher);
    third.say(&json!({ "do": "ramp-down" }));
    third.phase("faulted");
    assert!(third.events.iter().any(|text| text.contains("requested: ramp down")), "{:?}", third.events);
    drop((first, third));
    if crate::support::length(false, true) {
        browser::a_browser_draws_it(&panel);
    } else {
        crate::support::skipped("only in the full run: the panel in a real browser");
    }
    panel.end();
    bench.check(&running.end(Signal::TERM), "panel.rec");
}

#[test]
#[ignore = "long: another session; every part of it alone is in the short run"]
fn a_page_commissions_the_machine_and_ramp_down_of_another_page_ends_it() {
    let bench = Bench::named("reference.toml", "page-commission");
    let link = bench.path("commissioned.link");
    let running = program(&bench, "commissioned.rec", &bench.name, &link);
    let panel = Panel::new(&bench.spec, &link);
    let result = format!("/commission?token={}", panel.token);
    let mut page = panel.page();
    page.phase("disarmed");
    assert!(panel.get(&result, "").starts_with("HTTP/1.1 404"), "there is none yet");
    page.refused(json!({ "do": "commission" }), "is not in control");
    page.takes_control();
    let steps = |state: &Value| state["commission"]["outlook"]["steps"].clone();
    assert!(steps(&page.state).as_array().unwrap().iter().all(|step| step["date"].is_null()), "{}", page.state);
    let seconds = page.state["commission"]["outlook"]["seconds"].as_f64().unwrap();
    assert!((300.0..1500.0).contains(&seconds), "{seconds} s");
    page.done(json!({ "do": "commission" }));
    page.refused(json!({ "do": "commission" }), "being commissioned");
    page.phase("driving");
    page.refused(json!({ "do": "begin", "request": "acknowledge" }), "being commissioned");
    page.wait("the first step", |state| steps(state)[0]["date"].is_string());
    let mut other = panel.page();
    other.phase("driving");
    other.say(&json!({ "do": "ramp-down" }));
    page.phase("disarmed");
    page.wait("its end", |state| state["commission"]["runs"] == false);
    assert!(page.state["commission"]["ended"].as_str().unwrap().contains("disarmed"), "{}", page.state);
    assert!(page.events.iter().any(|text| text.starts_with("The commissioning ended")), "{:?}", page.events);
    let shown = panel.get(&result, "");
    assert!(shown.starts_with("HTTP/1.1 200") && shown.contains("Commissioning of reference"), "{shown:.300}");
    // The machine is free for other commands, and the end of the panel ends a commissioning ramped down.
    page.done(json!({ "do": "commission" }));
    page.phase("driving");
    panel.end();
    let mut watcher = Host::open(&link, 1).unwrap();
    assert_eq!(watcher.status().phase, super::DISARMED);
    drop(watcher);
    bench.check(&running.end(Signal::TERM), "commissioned.rec");
}

/// A socket in front of that of the program, whose connections can be cut.
#[derive(Clone, Default)]
struct Relay {
    is_cut: Arc<AtomicBool>,
    streams: Arc<Mutex<Vec<UnixStream>>>,
}

impl Relay {
    fn new(path: &Path, program: &Path) -> Self {
        let (listener, relay) = (UnixListener::bind(path).unwrap(), Self::default());
        let (shared, program) = (relay.clone(), program.to_owned());
        std::thread::spawn(move || {
            for host in listener.incoming().map_while(Result::ok) {
                let mut streams = shared.streams.lock().unwrap();
                // Without the program, the host sees a closed connection.
                let Some(device) = UnixStream::connect(&program).ok().filter(|_| !shared.is_cut.load(Ordering::SeqCst))
                else {
                    continue;
                };
                for (from, to) in [(&host, &device), (&device, &host)] {
                    let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    std::thread::spawn(move || {
                        let _ = std::io::copy(&mut from, &mut to);
                        let _ = to.shutdown(Shutdown::Both);
                    });
                }
                streams.extend([host, device]);
            }
        });
        relay
    }

    fn cut(&self) {
        let mut streams = self.streams.lock().unwrap();
        self.is_cut.store(true, Ordering::SeqCst);
        for stream in streams.drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    fn mend(&self) {
        self.is_cut.store(false, Ordering::SeqCst);
    }
}

#[test]
#[ignore = "long: another session; a host that is lost is in the short run"]
fn the_panel_reconnects_after_a_cut_that_is_a_fault_and_after_a_restart_and_the_same_page_is_in_control() {
    let bench = Bench::named("reference.toml", "reconnect");
    let [link, front] = ["program.link", "front.link"].map(|name| bench.path(name));
    let running = program(&bench, "cut.rec", &bench.name, &link);
    let relay = Relay::new(&front, &link);
    let panel = Panel::new(&bench.spec, &front);
    let mut page = panel.page();
    page.phase("disarmed");
    page.takes_control();
    page.runs();

    // The controller is without its host: it holds with a cause, and ends faulted.
    relay.cut();
    let mut watcher = Host::open(&link, 1).unwrap();
    page.wait("a lost link", |state| state["k"] == "lost");
    page.refused(json!({ "do": "begin", "request": "run" }), "no link to the machine");
    page.wait("the loss", |_| {
        let status = watcher.status();
        (status.phase, status.cause) == (HOLDING, LINK_LOST)
    });
    watcher.done(&Request::Supervise { request: RAMP_DOWN });
    page.wait("the fault", |state| state["k"] == "lost" && watcher.status().phase == FAULTED);
    // It took control by its request.
    drop(watcher);

    // The page says so when it has a link, and the operator goes on. No other page has got control.
    relay.mend();
    page.phase("faulted");
    assert_eq!(page.state["said"]["what"], "The host was silent.");
    assert_eq!(page.state["mine"], true);
    assert!(page.events.iter().any(|text| text == "The machine answers again."), "{:?}", page.events);
    let mut other = panel.page();
    other.phase("faulted");
    other.refused(json!({ "do": "begin", "request": "acknowledge" }), "is not in control");
    drop(other);
    page.done(json!({ "do": "begin", "request": "acknowledge" }));
    page.phase("disarmed");
    page.runs();
    page.say(&json!({ "do": "ramp-down" }));
    page.phase("disarmed");

    // The program ends and starts again; address, token and control stay. A stop from meanwhile is sent.
    let output = running.end(Signal::TERM);
    page.wait("a lost link", |state| state["k"] == "lost");
    page.say(&json!({ "do": "ramp-down" }));
    let running = program(&bench, "again.rec", &bench.name, &link);
    page.phase("disarmed");
    panel.page().phase("disarmed");
    let stops = |page: &Page| page.events.iter().filter(|text| text.contains("requested: ramp down")).count();
    page.wait("control", |state| state["mine"] == true);
    assert_eq!(stops(&page), 2, "{:?}", page.events);
    page.runs();
    page.say(&json!({ "do": "ramp-down" }));
    page.phase("disarmed");
    panel.end();
    bench.check(&output, "cut.rec");
    bench.check(&running.end(Signal::TERM), "again.rec");
}

fn nobody_gets_in_without_the_token_or_from_elsewhere(panel: &Panel) {
    let status = |answer: &str| answer.split(' ').nth(1).unwrap().to_owned();
    let with = format!("/?token={}", panel.token);
    let page = panel.get(&with, "");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("Ramp down") && page.contains("frame-ancestors 'none'"));
    assert_eq!(status(&panel.get("/", "")), "403");
    assert_eq!(status(&panel.get("/?token=0123456789abcdef0123456789abcdef", "")), "403");
    let fields = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let socket = format!("/socket?token={}", panel.token);
    for origin in ["", "Origin: http://evil.example\r\n", "Origin: null\r\n"] {
        assert_eq!(status(&panel.get(&socket, &format!("{fields}{origin}"))), "403", "{origin}");
    }
    // By a host name, as after DNS rebinding.
    let mut stream = TcpStream::connect(&panel.address).unwrap();
    write!(stream, "GET {with} HTTP/1.1\r\nHost: evil.example\r\n\r\n").unwrap();
    assert_eq!(status(&std::io::read_to_string(stream).unwrap()), "421");
}

fn garbage_disturbs_nothing(panel: &Panel, page: &mut Page) {
    // Invalid HTTP, a head without end, a head that is too long.
    for bytes in [&b"\x00\xff\x13\x37\r\n\r\n"[..], b"GET / HTTP/1.1\r\n", &[b'x'; 20_000]] {
        let mut stream = TcpStream::connect(&panel.address).unwrap();
        let _ = stream.write_all(bytes);
    }
    // Invalid frames, texts that are not commands, numbers that were not sent yet, a message that is too long.
    let mut stranger = panel.page();
    for text in [
        "",
        "{}",
        "[1,2",
        "{\"do\":\"fly\"}",
        "{\"do\":\"gain\",\"id\":1,\"factor\":\"NaN\"}",
        "{\"do\":\"seen\",\"number\":4000000000}",
    ] {
        stranger.socket.send(Message::text(text)).unwrap();
    }
    stranger.socket.send(Message::binary(vec![7; 1000])).unwrap();
    let _ = stranger.socket.send(Message::text("x".repeat(100_000)));
    let mut stranger = panel.page();
    let _ = stranger.socket.get_mut().write_all(&[0xff; 4096]);
    // A browser that reads nothing.
    let idle = panel.page();
    let before = page.state["status"]["tick"].as_u64().unwrap();
    page.wait("ticks meanwhile", |state| state["status"]["tick"].as_u64().unwrap() > before + 5_000);
    assert_eq!((page.state["phase"].as_str(), page.state["mine"].as_bool()), (Some("running"), Some(true)));
    drop((stranger, idle));
}

/// A machine with the plant of another spec, as if cables were swapped.
fn miswired_machine(spec: &Path, digest: &str, name: &str) -> Background {
    let compiled = compile::compile(spec).unwrap_or_else(|_| panic!("it compiles"));
    let task = compiled.model.task_space.as_ref().unwrap();
    let leg = host_sim::plant::LegParameters::reference();
    let specimen = machine::specimen(&compiled.model, task, &leg, Some(1));
    let noise = host_sim::platform::rig::Noise::of(&specimen);
    let scenario = machine::scenario(&compiled.model, task, &specimen, &noise, 1);
    let plant = host_sim::machine::Machine::Platform(Box::new(scenario.rig().clone()));
    let mut plant_server = plant_server::PlantServer::new(plant, &compiled.model, &compiled.ir);
    let server = Server::create(&path_of(name).unwrap(), digest).unwrap();
    Background::new(move |over| {
        let mut seen = 0;
        while !over.load(Ordering::Relaxed) {
            if let Some((actuation, wanted)) = server.wait(&mut seen, 0, 50_000_000) {
                server.publish(&plant_server.answer(&actuation, wanted));
            }
        }
    })
}

#[test]
#[ignore = "long: another session; every fault of the wiring is named by the supervisor in the short run"]
fn the_wiring_check_names_gauges_that_are_exchanged_or_turned_and_lets_a_good_machine_hold() {
    let bench = Bench::named("reference.toml", "check");
    let text = fs::read_to_string(&bench.spec).unwrap();
    let digest = compile::compile(&bench.spec).unwrap_or_else(|_| panic!("it compiles")).ir.digest;
    // Gauges 3 and 5 of the machine are swapped.
    let [three, five] = [
        "point     = [\"80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 1, 0]",
        "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]",
    ];
    let exchanged = text.replace(three, "3").replace(five, three).replace("\n3\n", &format!("\n{five}\n"));
    let one = "point     = [\"-40 mm\", \"69.282 mm\", \"180 mm\"]\ndirection = [0, 0, ";
    let turned = text.replace(&format!("{one}1]"), &format!("{one}-1]"));
    let cases =
        [(&text, None), (&exchanged, Some("gauge 3 swapped with gauge 5.")), (&turned, Some("gauge 1 inverted."))];
    let records = bench.spec.with_file_name("records");
    fs::create_dir(bench.path("records")).unwrap();
    fs::copy(records.join("reference-forc.csv"), bench.path("records/reference-forc.csv")).unwrap();
    for (number, (spec, expected)) in cases.into_iter().enumerate() {
        assert!(number == 0 || *spec != text, "the spec is another");
        let path = bench.path(&format!("check-{number}.toml"));
        fs::write(&path, spec).unwrap();
        let name = format!("check-{number}-{}", std::process::id());
        let plant = miswired_machine(&path, &digest, &name);
        let link = bench.path(&format!("check{number}.link"));
        let running = program(&bench, &format!("check{number}.rec"), &name, &link);
        let panel = Panel::new(&bench.spec, &link);
        let mut page = panel.page();
        page.phase("disarmed");
        page.takes_control();
        let answer = page.command(json!({ "do": "check" }));
        assert_eq!(answer["ok"], true, "{answer}");
        let verdict = &answer["value"];
        assert_eq!(verdict["good"], expected.is_none(), "{verdict:#}");
        match expected {
            None => {
                page.phase("holding");
                page.refused(json!({ "do": "check" }), "ramp down");
                page.say(&json!({ "do": "ramp-down" }));
            }
            Some(what) => {
                assert_eq!(verdict["what"], what);
                assert!(verdict["advice"].as_str().is_some_and(|advice| advice.starts_with("Swap")), "{verdict:#}");
                page.phase("faulted");
                page.refused(json!({ "do": "check" }), "acknowledge");
                page.done(json!({ "do": "begin", "request": "acknowledge" }));
            }
        }
        page.phase("disarmed");
        panel.end();
        let output = running.end(Signal::TERM);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            text.contains("\"last_phase\": \"Disarmed\"") || text.contains("\"last_phase\":\"Disarmed\""),
            "{text}"
        );
        if let Some(what) = expected {
            assert!(text.contains(&format!("wiring, {}", what.trim_end_matches('.'))), "{text}");
        }
        drop(plant);
    }
}
