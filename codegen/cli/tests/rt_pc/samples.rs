//! Hosts that watch: samples match the record of the same run, each host has its own stream, and one that does not read disturbs
//! nobody.

use host_sim::controller::TickController;
use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::time::Duration;

use host_sim::record::{Reader, replay};
use rustix::process::Signal;
use serde_json::Value;
use specgen::operate::motion::Motion;
use specgen::operate::samples::{Block, Row, Spread};
use specgen::operate::{Session, SocketLine};
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Timeout};
use specgen_link::samples::MOST_EVERY;

use super::{Bench, ProcessGuard, wait_for};

/// Values of a tick in the record: status, phase, pose, set-point, voltages.
type TickValues = (u32, u8, [[f64; 6]; 3]);

fn shown(bench: &Bench, bytes: &[u8]) -> BTreeMap<u64, TickValues> {
    let mut machine = bench.machine();
    let (names, scalar) = (machine.output_names(), machine.controller().description().scalar);
    let place = |name: &str| names.iter().position(|known| known == name).unwrap();
    let places = ["pose[0]", "target[0]", "voltage[0]"].map(place);
    let mut all = BTreeMap::new();
    let mut reader = Reader::new(bytes).unwrap();
    let found = replay(&mut reader, &mut machine, |_, block, rows| {
        for (row, given) in block.rows.iter().zip(rows) {
            let values = places.map(|first| core::array::from_fn(|axis| scalar.decode(given[first + axis])));
            all.insert(row.tick, (row.status, row.supervisor as u8, values));
        }
    });
    assert!(found.unwrap().divergence.is_none());
    all
}

/// Minimum and maximum exactly, the mean within two roundings of the largest value.
fn check_spread(found: &Spread, values: impl Iterator<Item = f64>) {
    let values: Vec<f32> = values.map(|value| value as f32).collect();
    let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64;
    let least = values.iter().copied().reduce(|a, b| if b < a { b } else { a }).unwrap();
    let most = values.iter().copied().reduce(|a, b| if b > a { b } else { a }).unwrap();
    let largest = f64::from(if least.abs() > most.abs() { least.abs() } else { most.abs() });
    assert_eq!((found.least, found.most), (least, most));
    assert!((f64::from(found.mean) - mean).abs() <= 2.0 * f64::from(f32::EPSILON) * largest, "{found:?} {mean}");
}

/// Compares a row with the ticks of the record.
fn check_row(row: &Row, tick: u64, every: u32, shown: &BTreeMap<u64, TickValues>, motion: &Motion) {
    let ticks: Vec<&TickValues> = (tick..tick + u64::from(every)).map(|tick| &shown[&tick]).collect();
    let (_, phase, [pose, target, _]) = ticks[ticks.len() - 1];
    let user = |pose: &[f64; 6]| motion.user(&pose.map(|value| f64::from(value as f32))).unwrap();
    assert_eq!((row.phase, row.pose, row.target), (*phase, Some(user(pose)), user(target)), "tick {tick}");
    assert_eq!(row.status, ticks.iter().fold(0, |all, (status, ..)| all | status), "tick {tick}");
    for axis in 0..6 {
        check_spread(
            &row.error.unwrap()[axis],
            ticks.iter().map(|(_, _, [pose, target, _])| target[axis] - pose[axis]),
        );
        check_spread(&row.volts[axis], ticks.iter().map(|(_, _, [_, _, volts])| volts[axis]));
    }
}

/// With elastic time, so that it runs on any computer.
pub fn hosts_look_on_and_are_no_burden(bench: &Bench) {
    let link = bench.path("samples.link");
    let mut command = bench.command("samples.rec");
    command.args(["--elastic", "--sim-timeout", "5000", "--link-silence", "1000", "--link"]).arg(&link);
    let running = ProcessGuard::new(&mut command);
    wait_for("the link", || link.exists());
    let open = || Session::open(SocketLine::open(&link).unwrap(), Timeout::PIPE, None).map_err(|_| ()).unwrap();

    let (mut one, mut stalled) = (open(), open());
    assert!(one.take_blocks().unwrap().is_empty(), "no stream");
    let long = one.stream(MOST_EVERY + 1);
    assert!(matches!(long, Err(ClientError::Refused(Refusal::Word { index: 0 }))), "{long:?}");
    one.stream(37).unwrap();
    stalled.stream(1).unwrap();
    let begun = one.poll().unwrap().tick;

    // A third host moves the machine, and writes its samples to a file.
    let orders = [
        "arm",
        "wait holding",
        "run",
        "wait running",
        "watch 20 0.5 w.csv",
        "watch 1 0.05 w.jsonl",
        "watch 500 0.1",
        "ramp-down",
        "wait disarmed",
    ];
    let mut command = Command::new(env!("CARGO_BIN_EXE_specgen"));
    command.args(["operate", bench.spec.to_str().unwrap(), "--json"]).args(orders);
    command.arg("--socket").arg(&link).current_dir(bench.folder.path());
    let mut operate = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut blocks: Vec<Block> = Vec::new();
    // The queue of a host that does not read has 1023 blocks of nine ticks.
    let mut ages = Vec::new();
    while operate.try_wait().unwrap().is_none() || one.poll().unwrap().tick < begun + 10_000 {
        blocks.extend(one.take_blocks().unwrap());
        let seen = blocks.last().map_or(begun, Block::end);
        ages.push(one.poll().unwrap().tick - seen);
        std::thread::sleep(Duration::from_millis(5));
    }
    blocks.extend(one.take_blocks().unwrap());
    let late = stalled.take_blocks().unwrap();
    let motion = one.motion().unwrap().clone();
    let operated = operate.wait_with_output().unwrap();
    assert!(operated.status.success(), "{}", String::from_utf8_lossy(&operated.stderr));
    let output = running.end(Signal::INT);
    let (summary, record) = bench.check(&output, "samples.rec");
    let shown = shown(bench, &record.bytes);

    // The host that reads has every tick once, whatever another host left unread.
    let lost = summary["lost_rows"].as_u64().unwrap();
    let mut rows = 0;
    for pair in blocks.windows(2) {
        assert_eq!(pair[1].number, pair[0].number + 1);
        assert!(lost > 0 || pair[1].tick == pair[0].end(), "{lost} rows lost; {} and {}", pair[0].end(), pair[1].tick);
    }
    for block in &blocks {
        assert!(block.every == 37 || lost > 0);
        for (index, row) in block.rows.iter().enumerate() {
            check_row(row, block.tick + 37 * index as u64, block.every, &shown, &motion);
            rows += 1;
        }
    }
    assert!(rows * 37 > 10_000 && blocks[0].number == 0, "{rows} rows");

    // The other host has lost the oldest blocks, and knows how many.
    assert!(late[0].number > 0 && late.len() > 200, "{} {}", late[0].number, late.len());
    // It may lose more while it reads the rest.
    assert!(late.windows(2).all(|pair| pair[1].number > pair[0].number));
    for block in &late {
        let ticks = block.tick..;
        block.rows.iter().zip(ticks).for_each(|(row, tick)| check_row(row, tick, 1, &shown, &motion));
    }
    ages.sort_unstable();
    println!(
        "the newest row of 37 ticks is {} ticks old when it is here, {} at most",
        ages[ages.len() / 2],
        ages[ages.len() - 1]
    );
    println!(
        "{rows} rows of 37 ticks and {} of one are what the record says; {} blocks were given up for the one that did not read",
        late.iter().map(|block| block.rows.len()).sum::<usize>(),
        late[0].number
    );

    // Files and the JSON document agree.
    let text = std::fs::read_to_string(bench.path("w.csv")).unwrap();
    let titles: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| titles.iter().position(|title| *title == name).unwrap();
    let lines: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert!(lost > 0 || lines.len() == 250, "{}", lines.len());
    for line in &lines {
        let (tick, ticks) = (line[column("tick")] as u64, line[column("ticks")] as u32);
        let spread = |name: &str, unit: &str| {
            let [least, mean, most] =
                ["least", "mean", "most"].map(|which| line[column(&format!("{name}_{which}_{unit}"))] as f32);
            Spread { least, mean, most }
        };
        let of = |value: fn(&TickValues) -> f64| {
            (tick..tick + u64::from(ticks)).map(|tick| value(&shown[&tick])).collect::<Vec<_>>()
        };
        check_spread(&spread("error[4]", "rad"), of(|(_, _, [pose, target, _])| target[4] - pose[4]).into_iter());
        check_spread(&spread("volts[5]", "V"), of(|(_, _, [_, _, volts])| volts[5]).into_iter());
        assert!((line[column("time_s")] - tick as f64 * 1e-4).abs() < 1e-9);
    }
    let text = std::fs::read_to_string(bench.path("w.jsonl")).unwrap();
    let samples: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lost > 0 || samples.len() == 500, "{}", samples.len());
    for sample in &samples {
        let (_, _, [pose, target, _]) = shown[&sample["tick"].as_u64().unwrap()];
        assert_eq!(sample["error"][0]["most"].as_f64().unwrap() as f32, (target[0] - pose[0]) as f32);
    }
    let document: Value = serde_json::from_slice(&operated.stdout).unwrap();
    let watched =
        document["result"]["answers"].as_array().unwrap().iter().filter(|answer| answer["answer"]["rows"].is_u64());
    let watched: Vec<&Value> = watched.map(|answer| &answer["answer"]).collect();
    assert!(watched.len() == 3 && watched[0]["file"] == "w.csv" && watched[2]["file"].is_null(), "{watched:?}");
    assert_eq!(watched[2]["samples"].as_array().unwrap().len() as u64, watched[2]["rows"].as_u64().unwrap());
    assert!(lost > 0 || watched.iter().all(|answer| answer["gaps"] == serde_json::json!([])), "{watched:?}");
}
