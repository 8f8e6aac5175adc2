//! Triggers of a simulated platform that moves at 1 mm/s to and fro, with the noise of its gauges: the ticks of the record against those
//! that the recorded pose says, the record on the emulated microcontroller, and settings changed on the way.

use std::io::Cursor;
use std::time::Duration;

use host_sim::controller::{Supervised, TickController};
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{BUSY, Bench, Command, Request};
use host_sim::record::{Reader, RecordedController, Writer, replay};
use host_sim::trajectory::PoseTarget;
use specgen::model::Mcu;
use specgen::target;
use specgen_runtime::record::Layout;
use specgen_runtime::recorder::{Recorder, Settings};
use specgen_runtime::trigger::lines;
use specgen_tests::{Emitted, length, scenario, skipped};

const RUNNING: u32 = 2;
/// Ends of a sweep, m: beyond the first and the last position.
const SWEEP: f64 = 25e-6;
/// Positions of line 0 of the spec.
const POSITIONS: usize = 41;
const SWEEPS: usize = 6;
/// What rings after a move has died away behind so many ticks; then noise alone is looked at for so many.
const SETTLING: usize = 3000;
const QUIET: usize = 1000;

/// A tick of the record, and what a replay adds.
struct Tick {
    running: bool,
    lines: u32,
    pose: f32,
    missed: u64,
    /// start, stop, step, hysteresis of line 0.
    settings: [f32; 4],
}

/// What the platform is asked for until it stands.
fn goes(bench: &mut Bench<'_>, x: f64) {
    let mut target = PoseTarget::default();
    target.pose[0] = x;
    let request = Request { command: Command::Move, target, ..Request::default() };
    for tick in 0..20_000 {
        let status = bench.tick(&request).unwrap().status;
        if tick > 2 && status & BUSY == 0 {
            // Noise alone, from here on.
            for _ in 0..300 {
                bench.tick(&request).unwrap();
            }
            return;
        }
    }
    panic!("{x} m is not reached");
}

/// Sweeps under the spec's settings, a stop at a position, a stream of 95 set-points, then sweeps with steps twice as long.
fn record(emitted: &Emitted) -> Vec<u8> {
    let controller = emitted.at_run_time();
    let (text, description) = (controller.text().to_owned(), controller.description().clone());
    let mut other = controller.default_config();
    description.set_config(&mut other, "trigger_step[0]", 2e-6).unwrap();
    let machine = Supervised::new(controller);
    let layout = Layout {
        config: description.config_names.len(),
        input: machine.input_names().len(),
        state: machine.state_words(),
    };
    let mut memory = vec![0; 2 * 8192];
    let mut recorder = Recorder::new(&mut memory, 2, layout).unwrap();
    recorder.start(Settings::STREAM);
    let mut writer = Writer::new(Vec::new(), &text).unwrap();
    let mut recorded = RecordedController::new(machine, &mut recorder, &mut writer).unwrap();
    let model = &emitted.compiled.model;
    let mut rig = scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().clone();
    let mut bench = Bench::new(&mut rig, &mut recorded, model.timing.period, 0).unwrap();
    let mut status = BUSY;
    while status & BUSY != 0 {
        status = bench.tick(&Request::default()).unwrap().status;
    }
    for sweep in 0..SWEEPS {
        goes(&mut bench, if sweep % 2 == 0 { -SWEEP } else { SWEEP });
    }
    // Where noise alone decides on which side of it the platform is measured to be.
    goes(&mut bench, 5e-6);
    let mut target = PoseTarget::default();
    target.pose[0] = 5e-6;
    let stays = Request { command: Command::Move, target, ..Request::default() };
    for _ in 0..SETTLING + 2 * QUIET {
        bench.tick(&stays).unwrap();
    }
    for _ in 0..95 {
        bench.tick(&Request::stream(target)).unwrap();
    }
    bench.configure(&other).unwrap();
    for sweep in 0..SWEEPS {
        goes(&mut bench, if sweep % 2 == 0 { -SWEEP } else { SWEEP });
    }
    recorded.finish().unwrap_or_else(|ended| panic!("{ended:?}"));
    assert_eq!(recorder.lost(), 0);
    writer.finish().unwrap()
}

/// Words of settings, input and output of a tick.
type TickWords = (Vec<u64>, Vec<u64>, Vec<u64>);

/// The record, run again.
fn ticks(bytes: &[u8], machine: &mut Supervised) -> (Vec<Tick>, Vec<TickWords>) {
    let place = |name: &str| machine.output_names().iter().position(|known| known == name).unwrap();
    let (pose, missed) = (place("pose[0]"), place("missed"));
    let names = machine.controller().description().config_names.clone();
    let of_line = |config: &[u64], name: &str| {
        let place = names.iter().position(|known| *known == format!("trigger_{name}[0]")).unwrap();
        f32::from_bits(config[place] as u32)
    };
    let (mut all, mut rows) = (Vec::new(), Vec::new());
    let found = replay(&mut Reader::new(Cursor::new(bytes)).unwrap(), machine, |_, block, given| {
        let settings = ["start", "stop", "step", "hysteresis"].map(|name| of_line(&block.config, name));
        for (row, given) in block.rows.iter().zip(given) {
            all.push(Tick {
                running: row.supervisor & 0xff == RUNNING,
                lines: lines(row.status),
                pose: f32::from_bits(given[pose] as u32),
                missed: given[missed],
                settings,
            });
            rows.push((block.config.clone(), row.input.clone(), given.clone()));
        }
    });
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((&found.divergence, found.ticks as usize), (&None, all.len()), "line by line as it was recorded");
    (all, rows)
}

/// Ticks in which a line rises.
fn rises(ticks: &[Tick], line: u32) -> Vec<usize> {
    let high = |tick: usize| ticks[tick].lines >> line & 1 == 1;
    (1..ticks.len()).filter(|tick| high(*tick) && !high(tick - 1)).collect()
}

/// Ticks in which a position is passed, by the pose alone: each position by itself, on one side or the other, armed or not.
fn passed(ticks: &[Tick]) -> Vec<usize> {
    let (mut found, mut positions, mut under) = (Vec::new(), Vec::new(), [0.0; 4]);
    for (number, Tick { running, pose: x, settings, .. }) in ticks.iter().enumerate() {
        let [start, stop, step, h] = *settings;
        let away = |p: f32| *x >= p + h || *x <= p - h;
        if !running || *settings != under || positions.is_empty() {
            under = *settings;
            let count = ((stop - start) / step).round() as i32 + 1;
            positions = (0..count).map(|k| start + k as f32 * step).map(|p| (p, *x >= p, away(p))).collect();
            continue;
        }
        for (p, above, armed) in &mut positions {
            if !*armed && away(*p) {
                (*armed, *above) = (true, *x > *p);
            }
            if *armed && if *above { *x <= *p } else { *x >= *p } {
                (*armed, *above) = (away(*p), !*above);
                found.push(number);
            }
        }
    }
    found
}

/// The first pulse that is not where it should be.
fn difference(recorded: &[usize], computed: &[usize]) -> Option<(Option<usize>, Option<usize>)> {
    let most = recorded.len().max(computed.len());
    (0..most).map(|k| (recorded.get(k).copied(), computed.get(k).copied())).find(|(a, b)| a != b)
}

#[test]
fn triggers_at_1_mm_s_to_and_fro_are_in_the_ticks_that_the_recorded_pose_says() {
    let emitted = Emitted::new("triggers", "features/triggers.toml", &[]);
    let bytes = record(&emitted);
    let mut machine = Supervised::new(emitted.at_run_time());
    let (ticks, rows) = ticks(&bytes, &mut machine);
    let (recorded, computed) = (rises(&ticks, 0), passed(&ticks));
    assert_eq!(difference(&recorded, &computed), None);
    assert!(ticks.iter().all(|tick| tick.missed == 0) && ticks.iter().all(|tick| tick.running || tick.lines == 0));

    // Every position once a sweep, the first from the middle; those passed on the way to the stop; then every second.
    let changed = ticks.iter().position(|tick| tick.settings != ticks[0].settings).unwrap();
    let before = recorded.iter().filter(|tick| **tick < changed).count();
    let (half, whole) = (POSITIONS / 2 + 1, POSITIONS / 2 + 1);
    let at_rest = ticks[..changed].iter().rposition(|tick| tick.lines >> 3 & 1 == 1).unwrap();
    let within = |ticks: std::ops::Range<usize>| recorded.iter().filter(|tick| ticks.contains(tick)).count();
    let (stood, quiet) = (within(at_rest + 1..changed), within(at_rest + SETTLING..changed));
    let begins = rises(&ticks, 3);
    let sweeps: Vec<usize> = begins.windows(2).map(|pair| within(pair[0]..pair[1])).collect();
    println!(
        "pulses from motion to motion: {sweeps:?}; at rest on a position {stood}, {quiet} of them when it is quiet"
    );
    println!("{} ticks, {} pulses, {before} of them before other settings", ticks.len(), recorded.len());
    // At first it stands at x = 0, which is a position and is not armed.
    let on_the_way = before - stood - (half - 1) - (SWEEPS - 1) * POSITIONS;
    assert!((15..=16).contains(&on_the_way), "{on_the_way} from {SWEEP} m to 5 µm");
    assert!(quiet <= 1);
    let after = recorded.len() - before;
    assert!(after >= (SWEEPS - 1) * whole && after <= SWEEPS * whole, "{after} of steps twice as long");
    // 1 µm at 1 mm/s.
    let apart: Vec<usize> = recorded[..before].windows(2).map(|pair| pair[1] - pair[0]).collect();
    let ten = apart.iter().filter(|ticks| (9..=11).contains(*ticks)).count();
    assert!(ten > before / 2, "{ten} of {before} are 10 ticks apart");
    // Set-points 1, 11 … 91 of the stream.
    assert_eq!(rises(&ticks, 2).len(), 10);

    // What is compared would show a tick too many, too few, too early or too late.
    for k in [0, recorded.len() / 2, recorded.len() - 1] {
        let mut other = recorded.clone();
        other[k] += 1;
        assert!(difference(&other, &computed).is_some());
        other.remove(k);
        assert!(difference(&other, &computed).is_some());
    }

    if length(true, false) {
        return skipped("only in the full run: the same ticks on the emulated M4F");
    }
    let Some(image) = emitted.image(Mcu::Mps2An386) else { return };
    let rows = &rows[..changed];
    let inputs: Vec<Vec<u64>> = rows.iter().map(|(_, input, _)| input.clone()).collect();
    let result = target::replay_machine(&image, &rows[0].0, &inputs, Duration::from_secs(600)).unwrap();
    assert_eq!(rows.iter().zip(&result.outputs).position(|((_, _, host), mcu)| host != mcu), None, "same bits");
    assert_eq!(result.outputs.len(), changed);
    println!(
        "{changed} ticks equal on the emulated Cortex-M4F; {:.0} instructions mean",
        result.stats.stage("supervise").map_or(0.0, |stage| stage.mean())
    );
}
