//! The response of the assembled platform at rest: a stroke and a sweep of each leg in open drive, recorded tick by tick; what they
//! show, and whether the machine agrees with its spec.
//!
//! The stroke shows the gain. It and full strokes before it give every sweep the same history: a repetition has the same bias of
//! hysteresis.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

use host_sim::record::{FileItem, Reader};
use specgen_compiler::compile::Compilation;
use specgen_identify::assembled::{Kind, Plan};
use specgen_identify::{MAX_FILE_BYTES, Parameter};
use specgen_language::files;
use specgen_language::outcome::Failure;
use specgen_language::output::{unread_file, write_file};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_link::RecorderAction;
use specgen_studies::open_response::{OpenResponse, Sweep, SweepRecord, gain_of_strokes};

use super::machine::{Machine, play, rest};
use super::rows::Rows;
use super::state::{Response, record};
use crate::commands::SessionError;

/// Strokes: V, as a part of the voltage at most, s, and their number. The first one shows creep.
const STROKE: (f64, f64, f64, u32) = (20.0, 0.4, 0.5, 2);
/// Smooth start and end of the strokes, s, and rest before and after them.
const RAMP: f64 = 0.05;
const MARGIN: f64 = 0.3;
/// Row of their record, s, and the longest, in rows: a wave begins anywhere in a row.
const ROW: f64 = 5e-3;
const LONGEST: u32 = 4;
/// Rest after the strokes: the fastest creep is over, s.
const REST: f64 = 1.0;
/// Least dead time that counts, ticks.
const LEAST_DEAD_TIME: f64 = 0.25;
/// Part of the smallest workspace that strokes may take, and of the slew rate.
const SHARE: [f64; 2] = [0.3, 0.5];
/// Standard errors, and least differences, that count as a disagreement: stiffness over mass, damping, lag over that of the spec.
const SURE: f64 = 3.0;
const LEAST: [f64; 3] = [0.02, 0.1, 0.05];

/// Name of the record of a sweep, and of strokes.
fn names(prefix: &str, leg: usize) -> [String; 2] {
    [format!("{prefix}-leg{leg}"), format!("{prefix}-strokes-leg{leg}")]
}

/// Removes the records of a response.
pub(super) fn clear(folder: &Path, prefix: &str) -> Result<(), Failure> {
    let paths = (0..6).flat_map(|leg| {
        let [sweep, strokes] = names(prefix, leg);
        [folder.join(sweep + ".rec"), record(folder, &strokes)]
    });
    paths.into_iter().try_for_each(|path| remove(&path))
}

/// Removes a record, if it is there.
pub(super) fn remove(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::Environment(format!("could not remove `{}`: {error}", path.display())))
        }
        _ => Ok(()),
    }
}

/// Records strokes and a sweep of each leg, except where there are records; the machine drives.
pub(super) fn measure(
    machine: &mut Machine,
    (compiled, gain, plan): (&Compilation, f64, &Plan),
    folder: &Path,
    prefix: &str,
    ui: &Ui,
) -> Result<(), SessionError> {
    // Full strokes leave the same history, whatever the machine did before.
    let before = plan.drives.iter().filter(|drive| drive.kind == Kind::Preconditioning);
    let mut legs: Vec<&[usize]> = Vec::new();
    for drive in before {
        if !legs.contains(&drive.legs.as_slice()) {
            legs.push(&drive.legs);
            play(machine, drive, folder, ui)?;
        }
    }
    let capacity = machine.session.recorder(RecorderAction::Look)?.capacity;
    let sweep = Sweep::of(compiled, gain, capacity);
    let period = compiled.model.timing.period;
    let every = libm::ceil(ROW / period) as u32;
    for leg in 0..6 {
        let [name, strokes] = names(prefix, leg);
        let path = folder.join(format!("{name}.rec"));
        if path.exists() {
            continue;
        }
        ui.progress(&format!("{name} ({} of 6)", leg + 1));
        let (text, seconds) = strokes_of(compiled, gain, leg);
        let words = machine.wave_of_text(&text).map_err(SessionError::Refused)?;
        let mut start = |machine: &mut Machine| machine.start_wave(&strokes, &words, false);
        let (spans, rows) = ([MARGIN, seconds + MARGIN], record(folder, &strokes));
        // Of an interrupted run.
        remove(&rows).map_err(SessionError::Failed)?;
        machine.record_rows((every, LONGEST * every), spans, &rows, &mut start, ui)?;
        rest(machine, REST, ui)?;

        let words = machine.wave_of_text(&sweep_of(compiled, &sweep, leg)).map_err(SessionError::Refused)?;
        let after = libm::ceil((sweep.seconds + sweep.rest[1]) / period) as u32;
        machine.session.recorder(RecorderAction::Arm { after })?;
        rest(machine, sweep.rest[0], ui)?;
        machine.session.recorder(RecorderAction::Trigger)?;
        machine.start_wave(&name, &words, false)?;
        rest(machine, sweep.seconds + sweep.rest[1], ui)?;
        machine.session.recorder(RecorderAction::Stop)?;
        let bytes = machine.record()?;
        machine.beside(|| write_file(&path, &bytes))?.map_err(SessionError::Failed)?;
    }
    Ok(())
}

fn wave(compiled: &Compilation, leg: usize, [ramp, seconds, offset]: [f64; 3], shape: &str) -> String {
    let center = [compiled.model.rest_voltage(); 6];
    format!(
        "drive = true\ncenter = {center:?}\nramp = {ramp:?}\nseconds = {seconds:?}\n\n[[axis]]\naxis = {leg}\n\
         offset = {offset:?}\nshape = {{ {shape} }}\n"
    )
}

fn sweep_of(compiled: &Compilation, sweep: &Sweep, leg: usize) -> String {
    let Sweep { amplitude, offset, band: [from, to], seconds, ramp, .. } = sweep;
    let shape =
        format!("kind = \"chirp\", amplitude = {amplitude:?}, from = {from:?}, to = {to:?}, seconds = {seconds:?}");
    wave(compiled, leg, [*ramp, *seconds, *offset], &shape)
}

/// The strokes of a leg, away from the nearer limit, as the file of a wave, and their duration, s.
fn strokes_of(compiled: &Compilation, gain: f64, leg: usize) -> (String, f64) {
    let model = &compiled.model;
    let ([low, high], rest) = (model.actuator.voltage, model.rest_voltage());
    let (volts, part, seconds, count) = STROKE;
    let least = |a: f64, b: f64| if b < a { b } else { a };
    let room = model.workspace.bounds()[..3].iter().copied().fold(f64::INFINITY, least);
    let half = 0.5 * [part * (high - low), SHARE[0] * room / gain.abs()].into_iter().fold(volts, least);
    // π half/seconds is the steepest slope of a stroke.
    let slowest = PI * 2.0 * half / (SHARE[1] * model.actuator.slew_rate);
    let seconds = if slowest > seconds { slowest } else { seconds };
    let half = if high - rest > rest - low { half } else { -half };
    let phase = if half > 0.0 { 0.75 } else { 0.25 };
    let shape =
        format!("kind = \"sine\", amplitude = {:?}, frequency = {:?}, phase = {phase:?}", half.abs(), 1.0 / seconds);
    let seconds = f64::from(count) * seconds;
    (wave(compiled, leg, [RAMP, seconds, half], &shape), seconds)
}

/// The response that the records in the folder show.
///
/// # Errors
/// A record cannot be read, or does not show the leg.
pub(super) fn found(folder: &Path, prefix: &str, compiled: &Compilation, date: &str) -> Result<Response, Failure> {
    let mut records = Vec::new();
    let mut strokes = [0.0; 6];
    for (leg, stroke) in strokes.iter_mut().enumerate() {
        let [name, rows] = names(prefix, leg);
        records.push(sweep_record(&folder.join(format!("{name}.rec")), compiled, leg)?);
        *stroke = gain(&Rows::read(&record(folder, &rows))?, leg)?;
    }
    let records: [SweepRecord; 6] =
        records.try_into().map_err(|_| Failure::Gate("six records are needed".to_owned()))?;
    let found = OpenResponse::of(compiled, &records)
        .map_err(|why| Failure::Gate(format!("{}: {why}; record it again with --again", folder.display())))?;
    Ok(Response { found, strokes, date: date.to_owned(), agreement: Vec::new() }.judged(compiled))
}

/// Displacement of a leg per volt in the second of its strokes, m/V.
fn gain(rows: &Rows, leg: usize) -> Result<f64, Failure> {
    let (legs, volts) = (rows.legs()?, rows.column(&format!("volts[{leg}]_mean_V"))?);
    gain_of_strokes(volts, legs[leg]).ok_or_else(|| {
        Failure::Gate(format!("leg {leg} was not driven in its record of strokes: record it again with --again"))
    })
}

/// Voltage of the leg and readings of the gauges, about the sweep.
fn sweep_record(path: &Path, compiled: &Compilation, leg: usize) -> Result<SweepRecord, Failure> {
    let shown = path.display().to_string();
    let bad = |why: &dyn std::fmt::Display| Failure::Gate(format!("{shown}: {why}; record it again with --again"));
    let bytes = files::read(path, MAX_FILE_BYTES).map_err(|unread| unread_file(path, &unread))?;
    let mut reader = Reader::new(bytes.as_slice()).map_err(|error| bad(&error))?;
    let names = reader.input_names();
    let scalar = reader.header().description.scalar;
    let gauge = names.iter().position(|name| name == "gauge[0]").ok_or_else(|| bad(&"it has no gauges"))?;
    let model = &compiled.model;
    let ([from, to], steps) = (model.dac.range, f64::from((1_u32 << model.dac.bits) - 1));
    let calibration = compiled.ir.task_space.as_ref().and_then(|task| task.sensing.calibration.as_ref());
    let mut all = SweepRecord { volts: Vec::new(), readings: Default::default() };
    let (mut next, mut others) = (None, None);
    while let Some(item) = reader.next_piece().map_err(|error| bad(&error))? {
        let FileItem::Block(block) = item else { return Err(bad(&"it is damaged")) };
        for row in &block.rows {
            if next.is_some_and(|next| next != row.tick) {
                return Err(bad(&format!("tick {} is missing", next.unwrap_or_default())));
            }
            next = Some(row.tick + 1);
            let mut still = row.codes;
            still[leg] = 0;
            if *others.get_or_insert(still) != still {
                return Err(bad(&format!("not only leg {leg} is driven")));
            }
            all.volts.push(from + f64::from(row.codes[leg]) * (to - from) / steps);
            for (number, reading) in all.readings.iter_mut().enumerate() {
                let word = scalar.decode(row.input[gauge + number]);
                reading.push(match calibration {
                    Some(powers) => powers[number].iter().rev().fold(0.0, |sum, power| sum * word + power),
                    None => word,
                });
            }
        }
    }
    all.about().ok_or_else(|| bad(&format!("leg {leg} has no whole sweep in it")))
}

impl Response {
    /// Whether the amplifiers have a dead time that does not look like lag, for ticks of `period`, s.
    fn has_dead_time(&self, period: f64) -> bool {
        let Parameter { value, error } = self.found.dead_time;
        value > SURE * error && value > LEAST_DEAD_TIME * period
    }

    /// What a spec has as `amplifier.lag`, s, and what it contains: a spec has no dead time, and one that is too small to be certain
    /// counts as lag.
    pub(super) fn lag_of_spec(&self, period: f64) -> (Parameter, &'static str) {
        match self.has_dead_time(period) {
            true => (self.found.lag, "lag"),
            false => (self.found.delay, "lag and dead time"),
        }
    }

    /// With sentences about what disagrees with the spec.
    fn judged(mut self, compiled: &Compilation) -> Self {
        let OpenResponse { stiffness_to_mass, damping, lag, modes, .. } = &self.found;
        let differs = |of: &Parameter, spec: f64, least: f64| {
            let off = (of.value / spec - 1.0).abs();
            off > least && off * spec > SURE * of.error
        };
        let mut say = Vec::new();
        let percent = |ratio: f64| 100.0 * (ratio - 1.0);
        if differs(stiffness_to_mass, 1.0, LEAST[0]) {
            let [more, less] = [percent(stiffness_to_mass.value), percent(1.0 / stiffness_to_mass.value)];
            let [above, stiff, mass] = if more > 0.0 { ["above", "more", "less"] } else { ["below", "less", "more"] };
            say.push(format!(
                "k/m is {:.1} ± {:.1} % {above} the spec: mass {:.1} % {mass} than declared, or stiffness {:.1} % {stiff}; a known mass \
                 on the platform tells which",
                more.abs(),
                100.0 * stiffness_to_mass.error,
                less.abs(),
                more.abs()
            ));
        }
        let period = compiled.model.timing.period;
        if self.has_dead_time(period) {
            let Parameter { value, error } = self.found.dead_time;
            say.push(format!(
                "dead time of the amplifiers is {:.0} ± {:.0} us, which no key of a spec describes: find its cause, such as a filter or \
                 a converter; `--latency` of `specgen sim`, in ticks, shows what it does to the loop",
                value * 1e6,
                error * 1e6,
            ));
        }
        let (spec, (written, what)) = (compiled.model.amplifier.lag, self.lag_of_spec(period));
        if (written.value - spec).abs() > SURE * written.error && (written.value - spec).abs() > LEAST[2] * spec {
            say.push(format!(
                "{what} of the amplifiers: {:.0} ± {:.0} us, in the spec {:.0} us: the step `spec` writes amplifier.lag",
                written.value * 1e6,
                written.error * 1e6,
                spec * 1e6
            ));
        }
        if let Some(lowest) = modes.first().filter(|_| differs(damping, 1.0, LEAST[1])) {
            say.push(format!(
                "damping is {:.2} ± {:.2} times that of the spec, {:.4} of the lowest mode: the step `spec` writes control.modal_damping",
                damping.value, damping.error, lowest.zeta.value
            ));
        }
        for (leg, own) in self.found.lags.iter().enumerate() {
            let off = own - lag.value;
            if off.abs() > 20e-6 {
                say.push(format!("the amplifier of leg {leg} is {:+.0} us against the mean of all", off * 1e6));
            }
        }
        self.agreement = say;
        self
    }
}

/// The section of the page.
pub(super) fn section(response: &Response) -> String {
    let OpenResponse { modes, others, lags, lag, dead_time, delay, misfit, band, .. } = &response.found;
    let mut text = format!("\n## Response at rest, {}\n\n```text\n", response.date);
    let columns = [left(14), right(20), right(20), right(12), right(10)];
    row(&mut text, &columns, &[&"mode", &"Hz", &"damping ratio", &"spec, Hz", &"ratio"]);
    let pm = |of: &Parameter, digits: usize| format!("{:.digits$} ± {:.digits$}", of.value, of.error);
    for (number, mode) in modes.iter().enumerate() {
        let [hertz, ratio] = mode.spec;
        let cells = [pm(&mode.frequency, 2), pm(&mode.zeta, 5), format!("{hertz:.1}"), format!("{ratio:.4}")];
        row(&mut text, &columns, &[&(number + 1), &cells[0], &cells[1], &cells[2], &cells[3]]);
    }
    for mode in others {
        let known = if mode.known { "known" } else { "new" };
        let cells = [pm(&mode.frequency, 1), pm(&mode.zeta, 4)];
        row(
            &mut text,
            &columns,
            &[&mode.place, &cells[0], &cells[1], &known, &format!("{:.2}", mode.participation.value)],
        );
    }
    let micro = |of: &Parameter| format!("{:.1} ± {:.1} us", of.value * 1e6, of.error * 1e6);
    let legs: Vec<String> = lags.iter().map(|own| format!("{:.0}", own * 1e6)).collect();
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        text,
        "lag and dead time {}: lag {}, dead time {}; lag of each leg {} us\nfit {:.2} % of the response, {:.0} to {:.0} Hz\n```",
        micro(delay),
        micro(lag),
        micro(dead_time),
        legs.join(" "),
        100.0 * misfit,
        band[0],
        band[1]
    );
    for sentence in &response.agreement {
        let _ = writeln!(text, "\n- {sentence}");
    }
    text
}

#[cfg(test)]
mod tests {
    use specgen_compiler::compile::compile_source;
    use specgen_language::spec::SpecSource;
    use specgen_runtime::wave::{Limits, Settings, Wave};
    use specgen_studies::open_response::FoundMode;

    use super::*;
    use crate::wave::read_wave;

    fn reference() -> Compilation {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml");
        compile_source(SpecSource::read(&path).unwrap()).unwrap_or_else(|refusal| panic!("{:?}", refusal.findings))
    }

    #[test]
    fn the_waves_are_within_the_limits_of_an_open_drive() {
        let compiled = reference();
        let model = &compiled.model;
        let ([low, high], slew) = (model.actuator.voltage, model.actuator.slew_rate);
        let limits = Limits {
            low: [low; 6],
            high: [high; 6],
            rate: [slew; 6],
            acceleration: [2.0 * slew / model.timing.period; 6],
            ticks_per_second: 1.0 / model.timing.period,
        };
        let gain = model.actuator.leg_gain();
        for capacity in [2_000, 16_384, 1 << 20] {
            let sweep = Sweep::of(&compiled, gain, capacity);
            let whole = sweep.seconds + sweep.rest[0] + sweep.rest[1];
            assert!(whole <= 1.6 + 1e-9 && whole < f64::from(capacity) * model.timing.period, "{sweep:?}");
            for (text, seconds) in [(sweep_of(&compiled, &sweep, 3), sweep.seconds), strokes_of(&compiled, gain, 3)] {
                let read =
                    read_wave(&text, model.timing.period, false).unwrap_or_else(|error| panic!("{error}\n{text}"));
                let settings = Settings::from_words(read.words.as_slice().try_into().unwrap()).unwrap();
                assert!(read.drives && f64::from(settings.ticks) == (seconds / model.timing.period).round());
                Wave::new(limits).of_drive(true).set(&settings).unwrap_or_else(|refusal| panic!("{refusal:?}\n{text}"));
            }
        }
    }

    #[test]
    fn what_disagrees_with_the_spec_is_named_with_its_error() {
        let of = |value: f64, error: f64| Parameter { value, error };
        let mode = FoundMode { frequency: of(391.6, 0.1), zeta: of(0.02, 1e-4), spec: [360.5, 0.02] };
        let lags = [350e-6, 350e-6, 350e-6, 380e-6, 350e-6, 350e-6];
        let found = OpenResponse {
            modes: vec![mode; 6],
            lags,
            lag: of(355e-6, 1e-6),
            delay: of(356e-6, 1e-6),
            stiffness_to_mass: of(1.18, 0.002),
            damping: of(1.005, 0.01),
            ..OpenResponse::default()
        };
        let response = Response { found, strokes: [6e-7; 6], date: "2026-11-29".to_owned(), agreement: Vec::new() };
        let response = response.judged(&reference());
        assert_eq!(
            response.agreement,
            [
                "k/m is 18.0 ± 0.2 % above the spec: mass 15.3 % less than declared, or stiffness 18.0 % more; a known mass on the \
                 platform tells which",
                "the amplifier of leg 3 is +25 us against the mean of all",
            ]
        );
        let text = section(&response);
        for part in ["391.60 ± 0.10", "lag and dead time 356.0 ± 1.0 us", "- k/m is 18.0"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
