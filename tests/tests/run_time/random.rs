//! Random specs: platforms as they might be built, from the tests of the lint, with what else a spec may ask for drawn on top.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::physical_lint::support::plausible;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::compile::{Compilation, compile_source};
use specgen::everett::EverettTable;
use specgen::identify::rate::write_rate_csv;
use specgen::spec::SpecSource;
use specgen_tests::{Emitted, scratch};

/// What a part adds: lines behind a header that the spec has, or a text of its own.
enum Addition {
    Behind(&'static str, String),
    Text(String),
}

const DAMPING: &str = "active damping";

/// A part of a spec that may be left out, and the chance that it is asked for, in quarters.
struct Part {
    name: &'static str,
    quarters: u64,
    added: Vec<Addition>,
}

fn behind(name: &'static str, quarters: u64, header: &'static str, lines: impl Into<String>) -> Part {
    Part { name, quarters, added: vec![Addition::Behind(header, lines.into())] }
}

/// Uniform from 0 to 1.
fn unit(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn one_of<'a>(random: &mut ChaCha8Rng, choices: &[&'a str]) -> &'a str {
    choices[(random.next_u64() % choices.len() as u64) as usize]
}

/// Adds a part to a spec.
fn with(text: &str, part: &Part) -> String {
    let mut text = text.to_owned();
    for added in &part.added {
        match added {
            Addition::Behind(header, lines) if text.contains(header) => {
                text = text.replacen(&format!("{header}\n"), &format!("{header}\n{lines}\n"), 1);
            }
            Addition::Behind(header, lines) => text += &format!("\n{header}\n{lines}\n"),
            Addition::Text(more) => text += more,
        }
    }
    text
}

/// Parts of both kinds of controller, with sizes that fit this one.
fn common(random: &mut ChaCha8Rng, base: &Compilation, folder: &Path) -> Vec<Part> {
    let (model, grid) = (&base.model, base.ir.hysteresis.grid);
    let [low, high] = model.actuator.voltage;
    let file = "second-weight.csv";
    // A second weight of either sign, of a size that can be inverted at most periods.
    let size = 3e-6 * model.actuator.stroke;
    let nodes = (1..=grid).flat_map(|up| {
        (0..up).map(move |down| {
            let (u, d) = (up as f64 / grid as f64, down as f64 / grid as f64);
            -size * (u - d) * (1.0 - 1.6 * u)
        })
    });
    let table = EverettTable { grid, drive_min: low, drive_max: high, nodes: nodes.collect() };
    fs::write(folder.join(file), write_rate_csv(&table)).expect("written");
    let creep = one_of(
        random,
        &[
            "creep_times = [\"0.7 s\"]\ncreep_weights = [0.06]",
            "creep_times = [\"2 s\", \"50 ms\", \"4 ms\"]\ncreep_weights = [0.03, 0.05, 0.08]",
        ],
    );
    vec![
        behind("creep", 2, "[hysteresis]", format!("rate = \"creep\"\n{creep}")),
        behind("dynamic", 2, "[hysteresis]", format!("rate = \"dynamic-preisach\"\nrate_tables = [\"{file}\"]")),
        behind("run interval", 1, "[adaptation]", format!("run_interval = {}", 2 + random.next_u64() % 6)),
        behind(
            "gain ratio",
            1,
            "[adaptation]",
            format!("gain_ratio = [{:.2}, {:.2}]", 0.85 + 0.1 * unit(random), 1.05 + 0.1 * unit(random)),
        ),
        behind("gauge lag", 1, "[sensor]", format!("lag = \"{:.1} us\"", 5.0 + 20.0 * unit(random))),
        behind(
            "amplifier fault",
            2,
            "[supervisor]",
            format!("amplifier_fault = \"{}\"", one_of(random, &["ramp-down", "hold", "off"])),
        ),
        behind("short arming", 1, "[supervisor]", format!("arm_time = \"{:.1} ms\"", 5.0 + 40.0 * unit(random))),
        behind("rest voltage", 1, "[supervisor]", format!("rest_voltage = \"{:.1} V\"", low + 0.2 * (high - low))),
        behind("no wiring check", 1, "[supervisor.wiring_check]", "off = \"bench without stacks\""),
        behind("legs of different makes", 1, "[supervisor.wiring_check]", "legs = \"different\""),
    ]
}

/// Parts of a controller in task space.
fn platform(random: &mut ChaCha8Rng, base: &Compilation) -> Vec<Part> {
    let bound = base.ir.bounds.pose.map(|bound| bound * 1e6);
    let task = base.model.task_space.as_ref().expect("a platform");
    let [x, z] = [bound[0], bound[2] - 1e6 * task.setpoint.bias[2].abs()].map(|room| 0.3 * room);
    let [low, high] = base.model.sensor.range.map(|end| end * 1e6);
    let gauges = format!("calibration = [\"{:.4} um\", \"{:.6} um/V\"]", 0.5 * (low + high), (high - low) / 20.0);
    let (start, step) = (-x, x / 4.0);
    let lines = [
        format!(
            "kind = \"position\"\naxis = \"x\"\nstart = \"{start:.3} um\"\nstop = \"{x:.3} um\"\nstep = \"{step:.3} um\""
        ),
        format!("kind = \"level\"\naxis = \"z\"\nstart = \"0 um\"\nstop = \"{z:.3} um\""),
        format!("kind = \"points\"\nevery = {}", 1 + random.next_u64() % 9),
        "kind = \"motion\"".to_owned(),
        format!("kind = \"ticks\"\nfirst = 3\nevery = {}", 2 + random.next_u64() % 50),
    ];
    let first = random.next_u64() as usize;
    let count = 1 + first % 4;
    let lines: String =
        (0..count).map(|k| format!("\n[[trigger]]\nname = \"line-{k}\"\n{}\n", lines[(first / 4 + k) % 5])).collect();
    let (to_x, to_z, ms) = (0.5 * x, -0.5 * z, 20.0 + 80.0 * unit(random));
    let step = format!(
        "\n[[trajectory]]\nname = \"step\"\nkind = \"step\"\nto = [\"{to_x:.3} um\", \"0 um\", \"{to_z:.3} um\", \"0 urad\", \"0 urad\", \"0 urad\"]\ntime = \"{ms:.1} ms\"\n"
    );
    let path = format!(
        "\n[[trajectory]]\nname = \"path\"\nkind = \"{}\"\nfrequency = \"1 Hz\"\n",
        one_of(random, &["case-1", "case-2", "machining"])
    );
    let text = |name, quarters, text: &str| Part { name, quarters, added: vec![Addition::Text(text.to_owned())] };
    vec![
        behind("mode", 2, "[control]", format!("mode = \"{}\"", one_of(random, &["p", "f", "p/f"]))),
        behind(DAMPING, 2, "[control]", "active_damping = true"),
        behind("no notch", 1, "[control]", "notch = false"),
        behind("hand-over", 2, "[control]", "hand_over = true"),
        behind("learning", 2, "[control]", format!("correction = \"{:.3} um\"", 0.1 * x)),
        behind("measured force", 1, "[control]", "interaction = \"measured\""),
        Part {
            name: "modelled force",
            quarters: 1,
            added: vec![
                Addition::Behind("[control]", "interaction = \"modelled\"".to_owned()),
                Addition::Behind(
                    "[control.environment]",
                    "stiffness = [\"0 N/m\", \"0 N/m\", \"1e5 N/m\", \"0 N m/rad\", \"0 N m/rad\", \"0 N m/rad\"]"
                        .to_owned(),
                ),
            ],
        },
        behind("whole dynamics", 2, "[control]", "dynamics = \"whole\""),
        behind("tool", 1, "[control.frames]", "tool = [\"0 mm\", \"0 mm\", \"15 mm\"]"),
        behind(
            "work frame",
            1,
            "[control.frames]",
            "work = [\"0 mm\", \"0 mm\", \"0 mm\", \"0 deg\", \"0 deg\", \"30 deg\"]",
        ),
        behind("calibration", 2, "[sensor]", gauges),
        text("triggers", 3, &lines),
        text("step", 2, &step),
        text("path", 2, &path),
    ]
}

/// Parts of six legs.
fn legs(random: &mut ChaCha8Rng) -> Vec<Part> {
    vec![
        behind("dead time", 2, "[hysteresis]", format!("dead_time = \"{:.3} ms\"", 0.05 + 0.3 * unit(random))),
        behind("resonance", 2, "[actuator]", format!("resonance_gain = {:.3}", 0.4 + 0.5 * unit(random))),
        behind("leg set-points", 2, "[controller]", "setpoint = \"leg\""),
    ]
}

fn compiled(text: &str, folder: &Path) -> Option<Compilation> {
    let source =
        SpecSource { display_name: "platform.toml".to_owned(), text: text.to_owned(), dir: folder.to_path_buf() };
    compile_source(source).ok()
}

/// Random spec number `index`, compiled, with the names of the parts that were drawn and fit. Parts that make the compiler refuse the spec
/// are left out again; a platform that is refused by itself is drawn anew.
pub fn emitted(index: usize) -> (Emitted, Vec<&'static str>) {
    let folder = scratch("random-spec");
    let mut random = ChaCha8Rng::seed_from_u64(4_700 + index as u64);
    let (mut text, mut accepted) = loop {
        let text = plausible::platform(&mut random, &folder, index);
        if let Some(accepted) = compiled(&text, &folder) {
            break (text, accepted);
        }
    };
    let mut parts = common(&mut random, &accepted, &folder);
    parts.extend(if accepted.ir.task_space.is_some() { platform(&mut random, &accepted) } else { legs(&mut random) });
    parts.retain(|part| random.next_u64() % 4 < part.quarters);
    // Last, because each compilation with it searches its design for seconds.
    parts.sort_by_key(|part| part.name == DAMPING);
    let mut names = Vec::new();
    for part in parts {
        let more = with(&text, &part);
        if let Some(compiled) = compiled(&more, &folder) {
            (text, accepted) = (more, compiled);
            names.push(part.name);
        }
    }
    (Emitted::of(&format!("random-{index}"), accepted.into()), names)
}

/// What was drawn, to be held against what has to occur.
#[derive(Debug, Default)]
pub struct Kinds(BTreeSet<String>);

impl Kinds {
    /// Notes what a spec has.
    pub fn add(&mut self, compiled: &Compilation, parts: &[&str]) {
        let kind = if compiled.ir.task_space.is_some() { "platform" } else { "legs" };
        let scalar = format!("f{}", compiled.ir.scalar.bits());
        self.0.extend([kind, &*scalar].into_iter().chain(parts.iter().copied()).map(str::to_owned));
    }

    /// Of few specs both kinds, of many every part that may be drawn.
    pub fn assert_varied(&self, count: usize) {
        let expected = "platform, legs, f32, f64, creep, dynamic, run interval, gain ratio, gauge lag, amplifier fault, \
            short arming, rest voltage, no wiring check, legs of different makes, mode, active damping, \
            no notch, hand-over, learning, measured force, modelled force, whole dynamics, tool, work frame, \
            calibration, triggers, step, path, dead time, resonance, leg set-points";
        let expected = expected.split(", ").filter(|_| count >= 50);
        let missing: Vec<&str> = expected.filter(|kind| !self.0.contains(*kind)).collect();
        assert!(missing.is_empty(), "not drawn: {missing:?} of {:?}", self.0);
    }
}
