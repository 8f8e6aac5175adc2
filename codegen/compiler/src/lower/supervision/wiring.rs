//! The wiring check: the pulse of a leg, the weights of its samples, and the faults that this geometry cannot distinguish.

use super::{defaults, finding, rest, whole};
use crate::figure::figure;
use crate::ir::{Actuation, Hysteresis, Scalar, Supervision, Wiring};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{LARGEST_PULSE, LONGEST_TIMEOUT, LegMakes, Model};
use specgen_numerics::Factor;
use specgen_runtime::supervisor::{self, Fault, Finding, Response, with};

/// Fewest ticks of a pulse.
const FEWEST: f64 = 40.0;
/// Mains frequency, Hz. A pulse of 50 ms contains exactly three periods of 60 Hz, which cancel.
const MAINS: f64 = 50.0;
/// Fewest ticks per mains period that distinguish mains from the pulse.
const MAINS_TICKS: f64 = 4.0;
/// Fewest mains periods in a pulse: one whole period looks like the pulse itself.
const MAINS_PERIODS: f64 = 1.5;
/// Least gain of small motions over that of large ones, including stiff joints and legs with low gain.
const LEAST_GAIN: f64 = 0.4;
/// Largest rms noise, as a share of the response of a gauge or leg.
const NOISE: f64 = 0.03;
/// Gains of a faulty gauge or leg, hundredths.
const GAINS: [u32; 2] = [50, 200];
/// Range of gains of equal legs over the mean of the others: 15 % to either side.
const ALIKE: [f64; 2] = [0.74, 1.35];
/// Default of `wiring_check.residual`.
const RESIDUAL: f64 = 0.1;
/// Most steps towards a bound that is accepted as printed.
const TRIES: u32 = 200;

/// Constants of the check; none if the spec switches it off. `readings`: reading of each gauge (rows) per displacement of each leg.
pub(super) fn lower(
    model: &Model,
    hysteresis: &Hysteresis,
    actuation: &Actuation,
    max_step: i32,
    readings: &Response<f64>,
    scalar: Scalar,
    findings: &mut Vec<Diagnostic>,
) -> Option<Wiring> {
    let spec = &model.supervisor.wiring_check;
    if spec.off.is_some() {
        return None;
    }
    let rest = rest::code(model, actuation);
    let [above, below] = [actuation.code_max - rest, rest - actuation.code_min];
    let up = above >= below;
    let room = if up { above } else { below };
    let made =
        |amplitude: f64, time: Option<f64>| Pulse::new(model, actuation, [room, max_step], readings, amplitude, time);
    let chosen = match made(spec.amplitude, spec.time) {
        Ok(pulse) => pulse,
        Err(TooShort { time, least }) => {
            let usual = figure(libm::fmax(least, defaults::WIRING_TIME) * 1e3);
            let (given, required) = (time * 1e3, least * 1e3);
            findings.push(finding(
                model,
                codes::SUPERVISOR_TIME,
                "wiring_check.time",
                format!(
                    "a pulse of {given:.6} ms is too short: {FEWEST} periods and `actuator.slew_rate` require at least {required:.6} ms"
                ),
                format!(
                    "leave wiring_check.time out: the default is {usual} ms; it must be at least {required:.6} ms"
                ),
            ));
            return None;
        }
    };
    if chosen.noise > NOISE {
        let (noise, size, most) = (figure(chosen.noise * 1e2), figure(chosen.size * 1e6), NOISE * 1e2);
        findings.push(Diagnostic::at(
            &model.spans,
            &["supervisor.wiring_check.amplitude", "supervisor.wiring_check", "sensor.noise", "sensor"],
            codes::SUPERVISOR_BOUND,
            format!(
                "the gauges' noise is {noise} % of the response of a leg or gauge to a pulse of {size} um; at most {most:.0} % is allowed"
            ),
            larger_or_longer(model, &chosen, made),
        ));
        return None;
    }
    let Pulse { height, ticks, size: pulse, regression, .. } = chosen;
    let identified = hysteresis.tables.len() > 1;
    let compares = identified || spec.legs == LegMakes::Alike;
    let round = |value: f64| scalar.round(value);
    let signed = if up { height } else { -height };
    // For a negative pulse the gauges move down, too, and u is its depth.
    let per_leg = legs(hysteresis, actuation, [rest, rest + signed]);
    let constants = supervisor::Wiring {
        ticks,
        height: signed,
        turn: regression.turn.map(|turn| turn.map(round)),
        lag: regression.lag.map(round),
        weights: regression.coefficients.map(round),
        per_metre: per_leg.map(|leg| round(f64::from(signed.signum()) / (pulse * leg))),
        gauge_gain: spec.gauge_gain.map(round),
        leg_gain: compares.then(|| spec.leg_gain.map(round)),
        residual: round(spec.residual * spec.residual),
    };
    let (alike, unseen) = alike(&constants, readings);
    let turned = turned(&constants, readings);
    findings.extend(odd_bounds(model, identified, &constants, &unseen, readings));
    Some(Wiring { constants, alike, unseen, turned })
}

/// Findings about bounds that a fault-free machine violates, or that miss a fault which the default residual detects.
fn odd_bounds(
    model: &Model,
    identified: bool,
    constants: &supervisor::Wiring<f64>,
    unseen: &[u32],
    readings: &Response<f64>,
) -> Option<Diagnostic> {
    let spec = &model.supervisor.wiring_check;
    let odd = |key: &str, message: String, help: String| {
        Some(finding(model, codes::WIRING_BOUNDS, &format!("wiring_check.{key}"), message, help))
    };
    let [low, high] = spec.leg_gain;
    if !identified && constants.leg_gain.is_some() && (low > ALIKE[0] || high < ALIKE[1]) {
        return odd(
            "leg_gain",
            format!("equal legs have gains of {} to {}, but only {low} to {high} are accepted", ALIKE[0], ALIKE[1]),
            format!("write wiring_check.leg_gain = {ALIKE:?} or wider, in [supervisor]"),
        );
    }
    let usual = supervisor::Wiring { residual: RESIDUAL * RESIDUAL, ..*constants };
    let mut missed = unseen.iter().map(|word| Finding::of_word(*word)).filter(|fault| sees(&usual, readings, *fault));
    let missed = missed.next().filter(|_| spec.residual > RESIDUAL)?;
    odd(
        "residual",
        format!("with a residual of {} the check misses: {missed}", spec.residual),
        format!("write wiring_check.residual = {RESIDUAL} or less, in [supervisor]"),
    )
}

/// Whether the check detects a fault if small motions have 0.7 of the spec's gain.
fn sees(wiring: &supervisor::Wiring<f64>, readings: &Response<f64>, fault: Finding) -> bool {
    !supervisor::explains(wiring, readings, &small(with(readings, fault)))
}

fn small(response: Response<f64>) -> Response<f64> {
    response.map(|row| row.map(|entry| 0.7 * entry))
}

/// The pulse of a leg.
struct Pulse {
    /// Codes.
    height: i32,
    ticks: u32,
    /// s.
    time: f64,
    /// Displacement of a leg by the spec's gain, m.
    size: f64,
    regression: Regression,
    /// rms noise, as a share of the smallest response of a gauge or leg.
    noise: f64,
}

/// A pulse that is not possible in the given time (s).
struct TooShort {
    time: f64,
    least: f64,
}

impl Pulse {
    /// A pulse of a share of the stroke, in a time (s) or in the time that slew rate and noise require, with limits in codes, in all and per tick.
    fn new(
        model: &Model,
        actuation: &Actuation,
        [room, max_step]: [i32; 2],
        readings: &Response<f64>,
        amplitude: f64,
        given: Option<f64>,
    ) -> Result<Self, TooShort> {
        let period = model.timing.period;
        let gain = model.actuator.leg_gain();
        let volts = amplitude * model.actuator.stroke / gain;
        // Saturates.
        let height = (libm::round(volts / actuation.volts_per_code) as i32).clamp(1, if room > 1 { room } else { 1 });
        // Ticks that the slew rate requires where the pulse is steepest.
        let steepest = libm::ceil(f64::from(height) * core::f64::consts::PI / f64::from(max_step) - 1e-9);
        let least = period * if steepest > FEWEST { steepest } else { FEWEST };
        let time = given.unwrap_or(libm::fmax(least, defaults::WIRING_TIME));
        if time < least * (1.0 - 1e-9) {
            return Err(TooShort { time, least });
        }
        let size = f64::from(height) * actuation.volts_per_code * gain;
        let in_time = |time: f64| {
            let ticks = whole(libm::round(time / period));
            let regression = Regression::new(ticks, period, model.amplifier.lag, model.sensor.lag);
            let noise = noise(model, &regression.weights(), size, readings);
            Self { height, ticks, time, size, regression, noise }
        };
        let pulse = in_time(time);
        if given.is_some() || pulse.noise <= NOISE {
            return Ok(pulse);
        }
        // Noise falls with the square root of the time.
        let longer = time * (pulse.noise / NOISE) * (pulse.noise / NOISE) * 1.1;
        Ok(in_time(libm::fmax(time, libm::fmin(longer, defaults::LONGEST_WIRING_TIME))))
    }
}

/// Fixes for too much noise: an amplitude and a time that are accepted as printed.
fn larger_or_longer(
    model: &Model,
    refused: &Pulse,
    made: impl Fn(f64, Option<f64>) -> Result<Pulse, TooShort>,
) -> String {
    let spec = &model.supervisor.wiring_check;
    let accepted = |amplitude: f64, time: Option<f64>| made(amplitude, time).is_ok_and(|pulse| pulse.noise <= NOISE);
    let too_much = refused.noise / NOISE;
    let rises = |first: f64, by: f64| {
        (0..TRIES).scan(first, move |value, _| {
            let this = *value;
            *value *= by;
            Some(this)
        })
    };
    let larger = rises(refused.size / model.actuator.stroke * too_much, 1.02)
        .map(figure)
        .take_while(|text| text.parse().is_ok_and(|share: f64| share < LARGEST_PULSE))
        .find(|text| text.parse().is_ok_and(|share| accepted(share, spec.time)))
        .map(|text| format!("wiring_check.amplitude = {text} or more"));
    let longer = rises(libm::ceil(refused.time * too_much * too_much * 1e3), 1.02)
        .map(libm::ceil)
        .take_while(|time| *time < LONGEST_TIMEOUT * 1e3)
        .find(|time| accepted(spec.amplitude, Some(time * 1e-3)))
        .map(|time| format!("wiring_check.time = \"{time:.0} ms\" or more"));
    match (larger, longer) {
        (Some(larger), Some(longer)) => format!("write {larger}, or {longer}, in [supervisor]"),
        (Some(fix), None) | (None, Some(fix)) => format!("write {fix}, in [supervisor]"),
        (None, None) => {
            "write wiring_check = { off = \"the gauges are too noisy\" } in [supervisor]: the signs are then not checked"
                .to_owned()
        }
    }
}

/// Motion of each leg at the pulse by its own table, over the mean of all: legs measured individually are compared with their own table.
fn legs(hysteresis: &Hysteresis, actuation: &Actuation, codes: [i32; 2]) -> [f64; 6] {
    let drive = |code: i32| actuation.cells_at_zero + f64::from(code) * actuation.cells_per_code;
    let moves: Vec<f64> = hysteresis
        .tables
        .iter()
        .map(|table| {
            let [from, to] = codes.map(|code| rest::first_rise(table, hysteresis.grid, drive(code), Scalar::F64));
            libm::fabs(to - from)
        })
        .collect();
    let moved = hysteresis.table_of_leg.map(|table| moves[table]);
    let mean = moved.iter().sum::<f64>() / 6.0;
    // A table that is flat there gives no information.
    if moved.iter().all(|moved| *moved > 0.1 * mean) { moved.map(|moved| moved / mean) } else { [1.0; 6] }
}

/// Regressors of the samples of a leg: the pulse as the gauges read it, its path, a constant, time, and mains.
struct Regression {
    ticks: u32,
    turn: [[f64; 2]; 2],
    lag: [f64; 2],
    coefficients: [f64; 6],
}

impl Regression {
    fn new(ticks: u32, period: f64, amplifier_lag: f64, sensor_lag: f64) -> Self {
        let circle = |turns: f64| {
            let angle = 2.0 * core::f64::consts::PI * turns;
            [libm::cos(angle), libm::sin(angle)]
        };
        // A code acts from its tick on, and the amplifier follows the staircase: immediately if it has no lag.
        let steps = if amplifier_lag > 0.0 { 1.0 / (1.0 - libm::exp(-period / amplifier_lag)) } else { 1.0 };
        let delay = steps + sensor_lag / period;
        let share = 1.0 / f64::from(ticks);
        let has_mains = MAINS * period * MAINS_TICKS <= 1.0 && MAINS * period * f64::from(ticks) >= MAINS_PERIODS;
        let mut regression = Self {
            ticks,
            turn: [circle(share), if has_mains { circle(MAINS * period) } else { [1.0, 0.0] }],
            lag: circle(-delay * share),
            coefficients: [0.0; 6],
        };
        let count = if has_mains { 6 } else { 4 };
        let rows = regression.rows();
        let gram = |a: usize, b: usize| rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
        if let Some(factor) = Factor::of(count, gram) {
            let mut solution = vec![0.0; count];
            solution[0] = 1.0;
            factor.solve(&mut solution);
            regression.coefficients[..count].copy_from_slice(&solution);
        }
        regression
    }

    /// The regressors of every tick, in the order of the weights of [`supervisor::Wiring`].
    fn rows(&self) -> Vec<[f64; 6]> {
        let rotated = |[x, y]: [f64; 2], [cosine, sine]: [f64; 2]| [x * cosine - y * sine, y * cosine + x * sine];
        let [mut pulse, mut mains] = [[1.0, 0.0]; 2];
        (0..self.ticks)
            .map(|tick| {
                let [cosine, sine] = rotated(pulse, self.lag);
                let along = (1.0 - cosine) * 0.5;
                let way = if sine < 0.0 { 2.0 - along } else { along };
                let row = [along, way, 1.0, f64::from(tick) / f64::from(self.ticks), mains[0], mains[1]];
                pulse = rotated(pulse, self.turn[0]);
                mains = rotated(mains, self.turn[1]);
                row
            })
            .collect()
    }

    /// The weights of every sample.
    fn weights(&self) -> Vec<f64> {
        self.rows().iter().map(|row| row.iter().zip(&self.coefficients).map(|(a, b)| a * b).sum()).collect()
    }
}

/// rms noise of the smallest response of a gauge or leg.
fn noise(model: &Model, weights: &[f64], pulse: f64, readings: &Response<f64>) -> f64 {
    let step = model.sensor.step();
    let of_reading = libm::sqrt(model.sensor.noise * model.sensor.noise + step * step / 12.0);
    let of_entry = of_reading / pulse * libm::sqrt(weights.iter().map(|weight| weight * weight).sum());
    let size = |entries: [f64; 6]| libm::sqrt(entries.iter().map(|entry| entry * entry).sum());
    let rows = readings.iter().map(|row| size(*row));
    let columns = (0..6).map(|leg| size(core::array::from_fn(|gauge| readings[gauge][leg])));
    let least = rows.chain(columns).fold(f64::INFINITY, |least, size| if size < least { size } else { least });
    of_entry / (LEAST_GAIN * least)
}

/// Every single fault of a gauge or a leg.
#[must_use]
pub fn single_faults() -> Vec<Finding> {
    let one = [Fault::Inverted, Fault::Dead, Fault::Gain(GAINS[0]), Fault::Gain(GAINS[1])];
    let kinds: [fn(u32, Fault) -> Finding; 2] = [Finding::Gauge, Finding::Leg];
    let mut all = Vec::new();
    for kind in kinds {
        for place in 0..6 {
            all.extend(one.map(|fault| kind(place, fault)));
            all.extend((place + 1..6).map(|other| kind(place, Fault::Swapped(other))));
        }
    }
    all
}

fn is_dead(fault: Finding) -> bool {
    matches!(fault, Finding::Gauge(_, Fault::Dead) | Finding::Leg(_, Fault::Dead))
}

/// Positions by which the connectors of gauges and legs may both be rotated without detection.
fn turned(wiring: &supervisor::Wiring<f64>, readings: &Response<f64>) -> Vec<[usize; 2]> {
    let ways = (1..36).map(|way| [way / 6, way % 6]);
    let shown = |[gauges, legs]: [usize; 2]| -> Response<f64> {
        core::array::from_fn(|gauge| core::array::from_fn(|leg| 0.7 * readings[(gauge + gauges) % 6][(leg + legs) % 6]))
    };
    ways.filter(|way| supervisor::explains(wiring, readings, &shown(*way))).collect()
}

/// Sets of faults that the check cannot distinguish, and those that it does not detect, as words.
fn alike(wiring: &supervisor::Wiring<f64>, readings: &Response<f64>) -> (Vec<Vec<u32>>, Vec<u32>) {
    let faults = single_faults();
    let (mut sets, mut unseen): (Vec<Vec<u32>>, Vec<u32>) = (Vec::new(), Vec::new());
    for fault in &faults {
        let shown = small(with(readings, *fault));
        if !sees(wiring, readings, *fault) {
            unseen.push(fault.word());
        }
        // A set starts with its first fault.
        if sets.iter().any(|set| set.contains(&fault.word())) {
            continue;
        }
        let looks_like = |other: &Finding| {
            let [one, two] = [*fault, *other].map(|fault| small(with(readings, fault)));
            match [is_dead(*fault), is_dead(*other)] {
                [true, true] => one == two,
                [false, false] => supervisor::explains(wiring, &with(readings, *other), &shown),
                _ => false,
            }
        };
        let others = faults.iter().filter(|other| looks_like(other));
        let mut set: Vec<u32> = others.map(|other| other.word()).collect();
        if !set.contains(&fault.word()) {
            set.insert(0, fault.word());
        }
        if set.len() > 1 {
            sets.push(set);
        }
    }
    (sets, unseen)
}

/// Text about what the wiring check detects and what not.
#[must_use]
pub fn describe(model: &Model, supervision: &Supervision) -> String {
    let Some(wiring) = &supervision.wiring else {
        let reason = model.supervisor.wiring_check.off.as_deref().unwrap_or_default();
        return format!("  wiring check: off ({reason}); sign and order of gauges and legs are not checked\n");
    };
    let name = |word: &u32| Finding::of_word(*word).to_string();
    let volts =
        f64::from(wiring.height) * (model.dac.range[1] - model.dac.range[0]) / f64::from((1_i32 << model.dac.bits) - 1);
    let mut text = format!(
        "  wiring check: a pulse of {volts:.3} V, {:.3} um, {:.1} ms on each leg; {:.2} s in total while arming\n",
        libm::fabs(volts) * model.actuator.leg_gain() * 1e6,
        f64::from(wiring.ticks) * model.timing.period * 1e3,
        6.0 * f64::from(wiring.ticks) * model.timing.period
    );
    if wiring.leg_gain.is_none() {
        text.push_str("    gains of legs are not checked until each leg has its own record (hysteresis.records)\n");
    }
    let alike = match wiring.alike.len() {
        0 => "    this geometry distinguishes all single faults of gauges and legs\n".to_owned(),
        1 => "    this geometry does not distinguish 1 set of faults:\n".to_owned(),
        count => format!("    this geometry does not distinguish {count} sets of faults:\n"),
    };
    text.push_str(&alike);
    for set in &wiring.alike {
        text.push_str(&format!("      {}\n", set.iter().map(name).collect::<Vec<_>>().join(", ")));
    }
    if !wiring.unseen.is_empty() {
        text.push_str(&format!(
            "    not detected: {}\n",
            wiring.unseen.iter().map(name).collect::<Vec<_>>().join(", ")
        ));
    }
    for [gauges, legs] in &wiring.turned {
        text.push_str(&format!(
            "    not detected: the connectors of all gauges rotated by {gauges} positions and those of all legs by {legs}\n"
        ));
    }
    text.push_str("    not detected: a common factor of all gauges or all legs");
    if let Some([low, high]) = wiring.leg_gain {
        // As in the controller, for small motions.
        text.push_str(&format!(" that leaves {} to {} of the spec's gain", figure(low * 0.5), figure(high * 1.5)));
    }
    text.push('\n');
    text
}
