//! Records: what the recorder kept replays to the same bits from wherever it begins, on the host and on the emulated
//! microcontroller; whatever was changed in it is found and named.

use std::fs;
use std::io::Cursor;

use crate::figures;
use host_sim::controller::{Supervised, TickController};
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{BUSY, Bench, Request};
use host_sim::record::{FileItem, Reader, RecordedController, Replay, Row, Writer, replay};
use host_sim::trajectory::PoseTarget;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::model::Mcu;
use specgen::target;
use specgen_runtime::record::{HEADER_WORDS, Layout, checksum};
use specgen_runtime::recorder::{Recorder, Row as Out, Settings};
use specgen_runtime::wave::{AxisWave, Limits, Settings as WaveSettings, Shape, Tone, Wave, step_of};
use specgen_tests::{Emitted, length, scenario, skipped};

/// Words of a block; the firmware of the test has the same.
const BLOCK: usize = 8192;
/// Ticks of the wave.
const TICKS: u32 = 1500;

fn layout(machine: &Supervised) -> Layout {
    Layout {
        config: machine.controller().description().config_names.len(),
        input: machine.input_names().len(),
        state: machine.state_words(),
    }
}

/// A closed loop of the reference platform under the supervisor, recorded; with a change of settings in the middle.
fn closed_loop(emitted: &Emitted) -> Vec<u8> {
    let controller = emitted.at_run_time();
    let text = controller.text().to_owned();
    let mut other = controller.default_config();
    controller.description().set_config(&mut other, "mode", 5.0).unwrap();
    let machine = Supervised::new(controller);
    let mut memory = vec![0; 2 * BLOCK];
    let mut recorder = Recorder::new(&mut memory, 2, layout(&machine)).unwrap();
    recorder.start(Settings::STREAM);
    let mut writer = Writer::new(Vec::new(), &text).unwrap();
    let mut recorded = RecordedController::new(machine, &mut recorder, &mut writer).unwrap();

    let (model, ir) = (&emitted.compiled.model, &emitted.compiled.ir);
    let setpoints = &ir.task_space.as_ref().unwrap().setpoints;
    let mut rig = scenario(&emitted.compiled, &LegParameters::reference(), 1).rig().clone();
    let mut settings = WaveSettings::still();
    for (axis, wave) in settings.axes.iter_mut().enumerate() {
        let tone = Tone { amplitude: 0.02 * ir.bounds.pose[axis], phase: 0, step: step_of(7.0, model.timing.period) };
        *wave = AxisWave { offset: 0.0, shape: Shape::Sine { tone } };
    }
    settings.ramp_ticks = 200;
    settings.ticks = TICKS as i32;
    let mut wave = Wave::new(Limits {
        low: ir.bounds.pose.map(|bound| -bound),
        high: ir.bounds.pose,
        rate: setpoints.stream_rate,
        acceleration: setpoints.stream_acceleration,
        ticks_per_second: setpoints.rate,
    });
    wave.set(&settings).unwrap();
    wave.start();

    let mut bench = Bench::new(&mut rig, &mut recorded, model.timing.period, 0).unwrap();
    let mut status = BUSY;
    for _ in 0..20_000 {
        if status & BUSY == 0 {
            break;
        }
        status = bench.tick(&Request::default()).unwrap().status;
    }
    assert_eq!(status & BUSY, 0, "at its bias pose");
    for tick in 0..TICKS {
        let motion = wave.advance().unwrap();
        let target = PoseTarget { pose: motion.pose, rate: motion.rate, acceleration: motion.acceleration };
        let seen = bench.tick(&Request::stream(target)).unwrap();
        assert_eq!(seen.status & 0x3_0000, 0, "tick {tick}: the wave is a stream that is believed");
        if tick == TICKS / 2 {
            bench.configure(&other).unwrap();
        }
    }
    assert!(wave.advance().is_none());
    recorded.finish().unwrap_or_else(|ended| panic!("{ended:?}"));
    assert_eq!(recorder.lost(), 0);
    writer.finish().unwrap()
}

fn run(bytes: &[u8], machine: &mut Supervised) -> Replay {
    let mut reader = Reader::new(Cursor::new(bytes)).unwrap();
    replay(&mut reader, machine, |_, _, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

/// Places of the blocks in a file: first byte, words.
fn blocks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let mut at = 16 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize + 8;
    let mut found = Vec::new();
    while at < bytes.len() {
        let words = word(at + 8) as usize;
        found.push((at, words));
        at += (words + 1) * 8;
    }
    found
}

/// The file with one bit of a word of a block flipped, and with the checksum that fits it if it is to be `fixed`.
fn flipped(bytes: &[u8], block: (usize, usize), word: usize, bit: u32, fixed: bool) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let (start, count) = block;
    bytes[start + word * 8 + bit as usize / 8] ^= 1 << (bit % 8);
    if fixed {
        let words: Vec<u64> =
            bytes[start..start + count * 8].as_chunks().0.iter().map(|chunk| u64::from_le_bytes(*chunk)).collect();
        let sum = checksum(&words).to_le_bytes();
        bytes[start + count * 8..start + (count + 1) * 8].copy_from_slice(&sum);
    }
    bytes
}

/// Rows of a file, with the words of their block at which they begin.
fn rows(bytes: &[u8]) -> Vec<Row> {
    let mut reader = Reader::new(Cursor::new(bytes)).unwrap();
    let mut rows = Vec::new();
    while let Some(piece) = reader.next_piece().unwrap() {
        let FileItem::Block(block) = piece else { panic!("{piece:?}") };
        rows.extend(block.rows);
    }
    rows
}

#[test]
fn a_record_replays_from_wherever_it_begins_and_a_changed_bit_is_found_and_named() {
    let emitted = Emitted::new("record", "reference.toml", &[]);
    let bytes = closed_loop(&emitted);
    let mut machine = Supervised::new(emitted.at_run_time());
    let whole = run(&bytes, &mut machine);
    let blocks = blocks(&bytes);
    println!("{} ticks in {} blocks, {} bytes", whole.ticks, blocks.len(), bytes.len());
    assert_eq!((&whole.divergence, whole.gaps.len(), whole.damaged.len(), whole.cut), (&None, 0, 0, None));
    assert!(whole.ticks > u64::from(TICKS) && whole.digests == whole.ticks && blocks.len() > 4);
    assert_eq!(whole.ticks, rows(&bytes).len() as u64);

    // From the middle of the run on: a machine that is loaded is the one that was.
    for first in (1..blocks.len()).step_by(length(3, 1)) {
        let header = &bytes[..blocks[0].0];
        let tail = [header, &bytes[blocks[first].0..]].concat();
        let found = run(&tail, &mut machine);
        assert_eq!((found.divergence, found.span.unwrap().1), (None, whole.span.unwrap().1), "from block {first}");
    }
    // A block that is missing in the middle is a gap, not a difference.
    let lost = [&bytes[..blocks[2].0], &bytes[blocks[3].0..]].concat();
    let found = run(&lost, &mut machine);
    assert_eq!((found.divergence.is_none(), found.gaps.len()), (true, 1));

    // Cut off anywhere it loses its last block and says so.
    for cut in (blocks[0].0 + 1..bytes.len()).step_by(length(90_011, 30_011)) {
        let found = run(&bytes[..cut], &mut machine);
        let kept = blocks.iter().filter(|(start, words)| start + (words + 1) * 8 <= cut).count();
        assert_eq!((found.blocks, found.divergence), (kept as u64, None), "{cut} bytes");
        let at_an_end = blocks.iter().any(|(start, _)| *start == cut);
        assert_eq!(found.cut.is_some(), !at_an_end, "{cut} bytes");
        assert!(found.cut.is_none_or(|tick| tick == found.ticks), "{cut} bytes: {:?}", found.cut);
    }

    // One flipped bit: the checksum sees it, and where that was made to fit, the replay does.
    let block = blocks[blocks.len() / 2];
    let at = |word: usize| u64::from_le_bytes(bytes[block.0 + word * 8..][..8].try_into().unwrap());
    let (config, state) = ((at(6) & 0xffff) as usize, (at(6) >> 32) as usize);
    let first_row = HEADER_WORDS + config + state;
    let inputs = (at(first_row) & !(1 << 63)).count_ones() as usize;
    let gauges = machine.input_names().iter().position(|name| name == "gauge[2]").unwrap();
    let gauge = (at(first_row) & ((1 << gauges) - 1)).count_ones() as usize;
    let codes = first_row + 1 + inputs;
    let tick = at(3);
    let cases = [
        // A gauge by some hundred nanometres: the first tick already comes out differently.
        ("input", first_row + 1 + gauge, 46, "dac_code"),
        ("code of leg 0", codes, 3, "dac_code[0]"),
        ("code of leg 5", codes + 2, 32 + 3, "dac_code[5]"),
        ("status", codes + 3, 17, "status"),
        ("phase", codes + 3, 33, "phase"),
        ("cause", codes + 3, 41, "cause"),
        ("amplifiers", codes + 3, 48, "amplifiers_on"),
        ("digest", codes + 4, 7, "state_digest"),
        ("snapshot", HEADER_WORDS + config + state / 2, 0, "state word"),
        ("digest of the snapshot", 5, 0, "state_digest before it"),
        ("settings", HEADER_WORDS + 2, 40, ""),
    ];
    for (what, word, bit, signal) in cases {
        let found = run(&flipped(&bytes, block, word, bit, false), &mut machine);
        assert_eq!(found.damaged.len(), 1, "{what}");
        assert!(found.damaged[0].1.contains("checksum"), "{what}: {:?}", found.damaged);
        assert_eq!(found.gaps, [(tick, tick + at(2))], "{what}");
        let found = run(&flipped(&bytes, block, word, bit, true), &mut machine);
        let divergence = found.divergence.unwrap_or_else(|| panic!("{what}: not seen"));
        println!("{what}: {divergence}");
        assert_eq!(divergence.tick, tick, "{what}: {divergence}");
        assert!(divergence.signal.starts_with(signal), "{what}: {divergence}");
        assert!((divergence.recorded != divergence.replayed), "{what}");
    }
    // In a block that begins a record nothing was before the snapshot: it is loaded, and its digest tells.
    let alone = [&bytes[..blocks[0].0], &bytes[block.0..]].concat();
    let start = (blocks[0].0, block.1);
    for (word, bit) in
        [(HEADER_WORDS + config, 62), (HEADER_WORDS + config + 2, 1), (HEADER_WORDS + config + state / 2, 63)]
    {
        let found = run(&flipped(&alone, start, word, bit, true), &mut machine);
        let divergence = found.divergence.unwrap_or_else(|| panic!("word {word}, bit {bit}: not seen"));
        println!("snapshot word {word}, bit {bit}: {divergence}");
        assert_eq!(divergence.tick, tick);
    }
    if length(true, false) {
        skipped("only in the full run: the recorder on the emulated M7");
    } else {
        on_the_microcontroller(&emitted, &bytes);
    }
}

fn hash(words: &[u64]) -> u64 {
    words.iter().fold(0_u64, |sum, word| (sum ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29))
}

/// The same ticks on the M7: outputs, digests, the words of every machine and those of every block; and what they cost.
fn on_the_microcontroller(emitted: &Emitted, bytes: &[u8]) {
    let main = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/record_support/qemu.rs");
    fs::copy(main, emitted.dir().join("qemu/src/main.rs")).unwrap();
    let Some(image) = emitted.image(Mcu::Mps2An500) else { return };
    let mut machine = Supervised::new(emitted.at_run_time());
    let config = machine.controller().default_config();
    let inputs: Vec<Vec<u64>> = rows(bytes).into_iter().map(|row| row.input).collect();
    let target = target::replay(&image, &config, &inputs, std::time::Duration::from_secs(300))
        .unwrap_or_else(|error| panic!("{error}"));

    let mut memory = vec![0; 2 * BLOCK];
    let mut recorder = Recorder::new(&mut memory, 2, layout(&machine)).unwrap();
    recorder.start(Settings::STREAM);
    let mut output = vec![0; machine.output_names().len()];
    let codes = machine.controller().description().output("dac_code[0]").unwrap();
    let status = machine.controller().description().output("status").unwrap();
    let mut closed = 0;
    for (tick, input) in inputs.iter().enumerate() {
        if recorder.opens() {
            let state = machine.save();
            recorder.open(&config, machine.digest(), |words| words.copy_from_slice(&state));
        }
        let word = machine.step(input, &mut output);
        let supervisor = u32::from(word.phase) | u32::from(word.cause) << 8 | u32::from(word.amplifier_on) << 16;
        let out = Out {
            codes: std::array::from_fn(|leg| output[codes + leg] as i32),
            status: output[status] as u32,
            supervisor,
        };
        recorder.push(input, &out, || machine.digest());
        let block = recorder.block(0).map_or(0, hash);
        closed += usize::from(block != 0);
        recorder.release();
        let expected: Vec<u64> = output.iter().copied().chain([hash(&machine.save()), block]).collect();
        assert_eq!(target.outputs[tick], expected, "tick {tick}");
        assert_eq!(target.digests[tick], machine.digest(), "tick {tick}");
    }
    assert!(closed > 3, "{closed} blocks");
    for stage in &target.stats.stages {
        let (name, calls, least, most) = (&stage.name, stage.calls, stage.smallest, stage.largest);
        let mean = stage.mean();
        println!("{name:<10} {calls:>6} calls, {least:>6} to {most:>6} instructions, mean {mean:.0}");
    }
    println!("{} words of a machine", machine.state_words());
    let most = |name: &str| target.stats.stage(name).unwrap().largest;
    let mean = |name: &str| target.stats.stage(name).unwrap().mean();
    let row = mean("recorded") - mean("step");
    let found = [row, row - mean("digest"), mean("digest"), mean("save"), mean("opening") - mean("step")];
    let found = COST.map(|(what, _)| what.to_owned()).into_iter().zip(found.map(f64::ceil)).collect();
    assert_eq!(figures::held("recorder.json", "M7 f64", &image.compiler, found), Vec::<String>::new());
    // What a snapshot costs grows with its words alone: 8.5 instructions each, measured.
    let words = machine.state_words() as u64;
    assert!(most("save") < 10 * words, "a snapshot of {words} words costs {} instructions", most("save"));
}

/// What is counted, and its row in docs/recorder.md.
const COST: [(&str, &str); 5] = [
    ("row with a digest", "a row with a digest, on top of the supervised tick"),
    ("row without a digest", "a row without"),
    ("digest", "a digest alone"),
    ("snapshot", "a snapshot"),
    ("opening", "a block that begins, on top of the supervised tick"),
];

#[test]
fn the_page_says_what_the_recorder_costs() {
    let row = |(what, row)| format!("| {row} | {} |", figures::figure("recorder.json", "M7 f64", what));
    figures::shown("recorder.md", &COST.map(row));
}

/// Random ticks of every kind on a machine: commands, readings, requests, events.
fn hostile(names: &[String], rng: &mut ChaCha8Rng, single: bool) -> Vec<u64> {
    let real = |value: f64| if single { u64::from((value as f32).to_bits()) } else { value.to_bits() };
    let odd = rng.next_u32().is_multiple_of(100);
    let share = |rng: &mut ChaCha8Rng| f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
    names
        .iter()
        .map(|name| match name.split('[').next().unwrap_or_default() {
            "command" => u64::from(rng.next_u32() % 5),
            "selector" => u64::from(rng.next_u32() % 4),
            "sequence" => u64::from(rng.next_u32() % 3),
            "request" => [3, 4, 5, 1].get(rng.next_u32() as usize % 60).copied().unwrap_or(2),
            "events" => u64::from(rng.next_u32().is_multiple_of(1000)) << (rng.next_u32() % 5),
            _ if odd && rng.next_u32().is_multiple_of(4) => rng.next_u64() >> if single { 32 } else { 0 },
            "displacement" => real((share(rng) + 0.5) * 2e-7),
            "setpoint" if name.ends_with("[0]") && names.len() < 20 => real((share(rng) + 0.5) * 6e-5),
            "gauge" => real(share(rng) * 2e-7),
            _ => real(share(rng) * 4e-5),
        })
        .collect()
}

/// A quiet tick: gauges with a little noise, nothing commanded, this request.
fn quiet(names: &[String], rng: &mut ChaCha8Rng, single: bool, request: u64) -> Vec<u64> {
    let noise = |rng: &mut ChaCha8Rng| (f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5) * 4e-9;
    let real = |value: f64| if single { u64::from((value as f32).to_bits()) } else { value.to_bits() };
    let word = |name: &String| match name.split('[').next().unwrap_or_default() {
        "gauge" | "displacement" => real(noise(rng)),
        "request" => request,
        _ => 0,
    };
    names.iter().map(word).collect()
}

/// Brings a machine from wherever it is to its running phase. While it arms, its gauges show what its legs move.
fn bring_to_run(machine: &mut Supervised, names: &[String], rng: &mut ChaCha8Rng, single: bool) {
    let mut output = vec![0; machine.output_names().len()];
    let mut standing = machine.standing(&quiet(names, rng, single, 0)).unwrap();
    let mut phase = 0;
    for tick in 0..400_000_u32 {
        let request = match phase {
            _ if tick % 4 < 2 => 5 * u64::from(tick % 4),
            0 => 1,
            5 => 5,
            // What was held for a cause is brought to rest, and armed again.
            3 if tick > 200_000 => 4,
            _ => 2,
        };
        let mut input = quiet(names, rng, single, request);
        if phase == 1 {
            standing.show(machine, &output, &mut input);
        } else {
            standing = machine.standing(&input).unwrap();
        }
        phase = machine.step(&input, &mut output).phase;
        if phase == 2 {
            return;
        }
    }
    panic!("the machine does not come to run");
}

/// `load(save(m))` has the digest of m and its future; words that are none are refused, and what is taken keeps the promises.
fn same_future(name: &str, spec: &str, edits: &[(&str, &str)], seed: u64) {
    let emitted = Emitted::new(name, spec, edits);
    let mut machine = Supervised::new(emitted.at_run_time());
    let description = machine.controller().description().clone();
    let single = description.scalar.bits() == 32;
    let names = machine.input_names();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut ours, mut theirs) = (vec![0; machine.output_names().len()], vec![0; machine.output_names().len()]);
    let mut loaded = machine.fork();
    let (mut refused, mut taken, mut deepest) = (0, 0, 0);
    let actuation = &emitted.compiled.ir.actuation;
    let limit = [actuation.code_min, actuation.code_max].map(i64::from);
    for round in 0..length(30, 60) {
        if round % 3 > 0 {
            bring_to_run(&mut machine, &names, &mut rng, single);
        }
        for _ in 0..rng.next_u32() % 100 {
            machine.step(&hostile(&names, &mut rng, single), &mut ours);
        }
        let words = machine.save();
        deepest = deepest.max(words[0]);
        loaded.reset();
        loaded.load(&words).unwrap_or_else(|error| panic!("{name}, round {round}: {error}"));
        assert_eq!(loaded.digest(), machine.digest(), "{name}, round {round}");
        assert_eq!(loaded.save(), words, "{name}, round {round}");
        let inputs: Vec<Vec<u64>> = (0..100).map(|_| hostile(&names, &mut rng, single)).collect();
        for (tick, input) in inputs.iter().enumerate() {
            machine.step(input, &mut ours);
            loaded.step(input, &mut theirs);
            assert_eq!(ours, theirs, "{name}, round {round}, tick {tick}");
            assert_eq!(loaded.digest(), machine.digest(), "{name}, round {round}, tick {tick}");
        }
        // Any word with any bits: refused, or a machine that keeps within its limits.
        for _ in 0..30 {
            let mut spoilt = words.clone();
            let place = rng.next_u32() as usize % spoilt.len();
            spoilt[place] = match rng.next_u32() % 4 {
                0 => rng.next_u64(),
                1 => spoilt[place] ^ 1 << (rng.next_u32() % 64),
                2 => u64::MAX,
                _ => {
                    if single {
                        0x7f80_0000
                    } else {
                        0x7ff0 << 48
                    }
                }
            };
            let before = loaded.digest();
            if loaded.load(&spoilt).is_err() {
                refused += 1;
                assert_eq!(loaded.digest(), before, "{name}: a machine that refuses stays as it is");
                continue;
            }
            taken += 1;
            for input in inputs.iter().take(20) {
                loaded.step(input, &mut theirs);
                for leg in 0..6 {
                    let voltage =
                        description.scalar.decode(theirs[description.output(&format!("voltage[{leg}]")).unwrap()]);
                    let code = theirs[description.output(&format!("dac_code[{leg}]")).unwrap()] as i64;
                    assert!(
                        voltage.is_finite() && (limit[0]..=limit[1]).contains(&code),
                        "{name}: word {place} {:016x}",
                        spoilt[place]
                    );
                }
            }
        }
    }
    println!(
        "{name}: {} words, {refused} spoilt ones refused, {taken} taken, memory to {deepest} extrema",
        loaded.state_words()
    );
    assert!(refused > 100 && taken > 10, "{name}: {refused}, {taken}");
    let short = loaded.load(&[0; 3]).unwrap_err().to_string();
    assert!(short.starts_with("a state of 3 words; this controller's has "), "{short}");
}

#[test]
fn a_machine_that_is_loaded_has_the_future_of_the_one_that_was_saved() {
    same_future("record-platform", "reference.toml", &[], 1);
    if length(false, true) {
        same_future("record-platform-f32", "features/platform-f32.toml", &[], 2);
        same_future("record-legs", "legs.toml", &[], 3);
    }
    let creep = "memory  = 64\nrate = \"creep\"\ncreep_times = [\"2 s\", \"4 ms\"]\ncreep_weights = [0.03, 0.08]\ndead_time = \"0.35 ms\"";
    same_future("record-creep", "legs.toml", &[("memory  = 64", creep)], 4);
}
