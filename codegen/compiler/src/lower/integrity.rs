//! Checksum of tables and settings, which the controller recomputes at start.

use super::Origin;
use specgen_runtime::Crc32;
use specgen_toolchain::{ASSUMED_MARK, ASSUMED_SEPARATOR, IDENTITY_MARK, sha256};

use crate::ir::{
    Actuation, Defaults, Gains, Hysteresis, Integrity, Path, PlatformDefaults, RateModel, Scalar, Segment, TaskSpace,
};

/// Digest of the inputs of the controller: the text of the spec (line ends as `\n`), and name and contents of the files that
/// it references. It does not depend on their folder.
pub(crate) fn digest<'a>(spec: &str, files: impl Iterator<Item = &'a (String, String)>) -> String {
    let mut all = spec.replace("\r\n", "\n").into_bytes();
    for (name, text) in files {
        all.push(0);
        all.extend(name.as_bytes());
        all.push(0);
        all.extend(sha256(text.as_bytes()).as_bytes());
    }
    sha256(&all)
}

/// A line with the origin of a controller, and one with its assumed values, if there are any.
pub(super) fn identity(name: &str, origin: &Origin<'_>, scalar: Scalar) -> String {
    let assumed = if origin.assumed.is_empty() {
        String::new()
    } else {
        format!("{ASSUMED_MARK}{}\n", origin.assumed.join(ASSUMED_SEPARATOR))
    };
    let (version, bits, digest) = (env!("CARGO_PKG_VERSION"), scalar.bits(), &origin.digest);
    format!("{IDENTITY_MARK}specgen {version}, platform {name}, f{bits}, spec {digest}\n{assumed}")
}

/// The settings as words, and the checksum of all constants. The order is that of the emitted `integrity.rs`: identity, tables by their
/// number, tables of the rate, creep, trajectories, settings.
pub(super) fn lower(
    identity: String,
    scalar: Scalar,
    hysteresis: &Hysteresis,
    actuation: &Actuation,
    defaults: &Defaults,
    task: Option<&TaskSpace>,
) -> Integrity {
    let word = |value: &f64| match scalar {
        Scalar::F32 => u64::from((*value as f32).to_bits()),
        Scalar::F64 => value.to_bits(),
    };
    let mut crc = Crc32::new();
    crc.bytes(identity.as_bytes());
    let mut add = |values: &[f64]| values.iter().for_each(|value| crc.word(word(value)));
    if !hysteresis.has_plays() {
        hysteresis.tables.iter().for_each(|table| add(table));
    }
    match &hysteresis.rate {
        None => {}
        Some(RateModel::DynamicPreisach { tables, tolerance: _, table_of_leg: _ }) => {
            tables.iter().for_each(|table| add(table));
        }
        Some(RateModel::Creep { gains, weights, carried, direct }) => {
            [gains, weights, carried].into_iter().for_each(|values| add(values));
            add(&[*direct]);
        }
        Some(RateModel::BoucWen { legs, plays }) => {
            legs.iter().for_each(|leg| add(&leg.numbers()));
            plays.iter().flat_map(|plays| plays.iter()).for_each(|leg| add(&leg.numbers()));
        }
    }
    for trajectory in task.iter().flat_map(|task| &task.setpoints.trajectories) {
        match &trajectory.path {
            Path::Segments { segments, .. } => segments.iter().for_each(|segment| of_segment(&mut crc, word, segment)),
            Path::Table { rows, .. } => {
                for value in rows.iter().flat_map(|row| row.pose.iter().chain(&row.bend)) {
                    crc.word(word(value));
                }
            }
        }
    }
    let settings = match task {
        None => of_legs(word, actuation, defaults),
        Some(task) => of_platform(word, actuation, defaults, &task.defaults),
    };
    crc.words(&settings);
    Integrity { identity, settings, crc: crc.finish() }
}

fn of_segment(crc: &mut Crc32, word: impl Fn(&f64) -> u64, segment: &Segment) {
    crc.words(&[u64::from(segment.first), segment.phase, segment.phase_step]);
    for value in [segment.per_tick, segment.per_second, segment.angular] {
        crc.word(word(&value));
    }
    for axis in &segment.axes {
        for value in [axis.place, axis.slope].iter().chain(&axis.sine).chain(&axis.cosine) {
            crc.word(word(value));
        }
    }
}

/// A code in the encoding of the emitted `Config::to_words`.
fn of_code(code: i32) -> u64 {
    u64::from(code.cast_unsigned())
}

/// `CONFIG_NAMES` of six legs.
fn of_legs(word: impl Fn(&f64) -> u64, actuation: &Actuation, defaults: &Defaults) -> Vec<u64> {
    vec![
        defaults.law.word(),
        defaults.setpoint.word(),
        word(&defaults.level_weight),
        word(&defaults.drift_weight),
        u64::from(defaults.run_interval),
        of_code(defaults.max_step),
        of_code(actuation.code_min),
        of_code(actuation.code_max),
    ]
}

/// `CONFIG_NAMES` of a platform.
fn of_platform(
    word: impl Fn(&f64) -> u64,
    actuation: &Actuation,
    defaults: &Defaults,
    d: &PlatformDefaults,
) -> Vec<u64> {
    let gains = |gains: &Gains| [gains.proportional, gains.integral, gains.derivative].concat();
    let mut settings = vec![
        d.mode.word(),
        d.interaction.word(),
        word(&d.level_weight),
        word(&d.drift_weight),
        of_code(defaults.max_step),
        of_code(actuation.code_min),
        of_code(actuation.code_max),
    ];
    let numbers =
        [gains(&d.gains), gains(&d.position_gains), d.environment_stiffness.to_vec(), d.environment_rest.to_vec()];
    settings.extend(numbers.iter().flatten().map(&word));
    for line in &d.triggers {
        settings.extend([line.kind.word(), line.axis as u64, line.direction.word()]);
        settings.extend([line.start, line.stop, line.step, line.hysteresis].iter().map(&word));
        settings.extend([line.first, line.every, line.last, line.width.cast_unsigned()].map(u64::from));
    }
    settings
}
