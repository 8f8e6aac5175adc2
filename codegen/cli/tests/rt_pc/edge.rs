//! Commands that wait for an edge of the input line: the record shows the tick of the edge, and that the command started in the next
//! tick.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use specgen::operate::{Session, SocketLine};
use specgen_link::client::{Port, Timeout};
use specgen_runtime::pending::{EDGE, Stage};
use specgen_runtime::setpoint::CommandKind;

use super::{BUSY, Bench, ProcessGuard, wait_for};

/// Ticks from edge to edge: 0.4 s of the machine.
const EVERY: u64 = 4000;
const WAVE: &str = "ramp = 0.02\nseconds = 0.1\n[[axis]]\naxis = \"z\"\nshape = { kind = \"sine\", amplitude = 1e-6, frequency = 20.0 }\n";

/// Polls until a condition holds.
fn until<P: Port>(observer: &mut Session<P>, what: &str, mut wanted: impl FnMut(&mut Session<P>) -> bool) {
    let start = Instant::now();
    while !wanted(observer) {
        assert!(start.elapsed() < Duration::from_secs(120), "{what} does not appear: {:?}", observer.edge(false));
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[ignore = "long: the program of another spec"]
fn an_edge_of_the_input_line_starts_what_waits_for_it_in_the_next_tick() {
    let bench = Bench::new("features/triggers.toml");
    let link = bench.path("edge.link");
    let mut command = bench.command("edge.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--sim-edge-every", "0.4", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let mut observer = Session::open(SocketLine::open(&link).unwrap(), Timeout::SOCKET, None).unwrap();
    fs::write(bench.path("wave.toml"), WAVE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
    command.current_dir(bench.folder.path()).arg("operate").arg("--socket").arg(&link).arg(&bench.spec);
    let mut operate = ProcessGuard::new(command.stdin(Stdio::piped()));
    let mut input = operate.0.as_mut().unwrap().stdin.take().unwrap();
    let mut say = |lines: &str| input.write_all(lines.as_bytes()).unwrap();
    let stage =
        |session: &mut Session<SocketLine>| Stage::from_word(u64::from(session.edge(false).unwrap().stage)).unwrap();

    // A machine that is not running accepts no waiting command; a dropped one does not start; the last one wins.
    say("on-edge\non-edge move z=1um\narm\nwait holding\nrun\nwait running\nwait arrived\n");
    say("on-edge move z=1um\non-edge drop\non-edge\non-edge move z=1um\non-edge goto zero\njog z=0.5um\non-edge\n");
    until(&mut observer, "the step", |session| session.place().unwrap().unwrap().target[2] > 0.49e-6);
    let edges = observer.edge(false).unwrap().edges;
    until(&mut observer, "one more edge", |session| session.edge(false).unwrap().edges > edges + 1);
    assert_eq!(stage(&mut observer), Stage::Dropped);
    let mut begun = Vec::new();
    for order in ["on-edge jog z=1um\non-edge move x=2um z=1um\n", "on-edge wave wave.toml\n", "on-edge goto zero\n"] {
        say("wait arrived\nset command=hold\nwait 0.05\n");
        say(order);
        let last = begun.last().copied();
        until(&mut observer, order, |session| {
            let edge = session.edge(false).unwrap();
            u64::from(edge.stage) == Stage::Begun.word() && last != Some(edge.tick)
        });
        begun.push(observer.edge(false).unwrap().tick);
        until(&mut observer, "rest", |session| {
            let (tick, status) = (session.poll().unwrap().tick, session.status().status);
            tick > begun.last().unwrap() + 1500 && status & BUSY == 0
        });
    }
    // Another host may not do that.
    assert!(observer.edge(true).is_err());
    say("on-edge\nramp-down\nwait disarmed\n");
    drop(input);
    let operated = operate.wait();
    let (said, errors) = (String::from_utf8_lossy(&operated.stdout), String::from_utf8_lossy(&operated.stderr));
    println!("{said}{errors}");
    for text in ["no command for the edge; ", "dropped before the edge; ", "begun at the edge of tick "] {
        assert!(said.contains(text), "{text}: {said}");
    }
    assert!(said.contains("it moves only while running"), "{said}");

    // The machine's line rises every 4000 ticks, and no row of the record is without its edge.
    let (_, record) = bench.check(&running.end(Signal::INT), "edge.rec");
    let (events, command) = (record.place("events"), record.place("command"));
    let rose: Vec<u64> =
        record.rows.iter().filter(|row| row.input[events] & u64::from(EDGE) != 0).map(|row| row.tick).collect();
    assert!(rose.len() > 3 && rose.iter().all(|tick| tick % EVERY == 0), "{rose:?}");
    let kind = |tick: u64| {
        let row = record.rows.iter().find(|row| row.tick == tick).unwrap();
        CommandKind::from_word(row.input[command])
    };
    for (tick, expected) in begun.iter().zip([CommandKind::Move, CommandKind::Stream, CommandKind::Move]) {
        assert!(rose.contains(tick), "{tick} of {rose:?}");
        assert_eq!((kind(*tick), kind(tick + 1)), (CommandKind::Hold, expected), "tick {tick}");
    }
    assert!(bench.replay("edge.rec").status.success());
    a_card_has_lines_for_triggers(&bench);
}

/// Output lines follow the enable line, then the input line, which is read once per tick.
fn a_card_has_lines_for_triggers(bench: &Bench) {
    let library = super::fake_comedi(bench);
    let output = super::on_card(bench, &library, &[("FAKE_HIGH_AFTER", "100")], &super::TWO_CARDS);
    let (_, record) = bench.check(&output, "card.rec");
    let events = record.place("events");
    let rose = record.rows.iter().enumerate().filter(|(_, row)| row.input[events] & u64::from(EDGE) != 0);
    assert_eq!(rose.map(|(row, _)| row).collect::<Vec<_>>(), [100]);
    let text = fs::read_to_string(bench.path("card.log")).unwrap();
    let looks = format!("looks={}", record.rows.len());
    for line in ["directions=0:1,7:0,8:0,5:0,1:1,2:1,3:1,4:1,6:1", &looks, "bad="] {
        assert!(text.lines().any(|known| known == line), "{line}: {text}");
    }
}
