//! Measures the response of a running machine to a correction, during passes of a motion.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;

use serde::Serialize;

use super::{MachineSource, Options, SessionResult, learnable_of, machine_name, motion_of};
use crate::factors::Factors;
use crate::learning::{Convergence, Excitation, ModeMeasurement, PASSES, takes_correction};
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;

/// Measures and writes the response.
pub(super) fn run(
    options: &Options,
    path: &Path,
    compiled: &Compilation,
    bed: &mut impl MachineSource,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let limit = takes_correction(compiled)?.correction.unwrap_or_default();
    let (motion, _) = motion_of(options, bed, compiled)?;
    let (learnable, machine) = (learnable_of(compiled)?, machine_name(options));
    let excitation = Excitation::new(&learnable, &motion, options.bandwidth, [limit, compiled.model.sensor.noise]);
    let factors = Factors::of(&compiled.model, &[]);
    let stop = interrupt::heed();
    let names = [compiled.ir.digest.as_str(), &machine];
    let done = bed.work(
        compiled,
        ui,
        |repeating, ui| {
            let measured = excitation.measure(repeating, &learnable, &motion, names, |number| {
                ui.rate(&format!("learn: sweep {} of {PASSES}", number + 1));
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            ui.rate_done();
            measured
        },
        |response, ui| {
            write_file(path, response.to_json().as_bytes())?;
            let modes = learnable.mode_measurements(&response);
            ui.progress(&format!("wrote the response at {} frequencies to {}", response.bins.len(), path.display()));
            Ok(MeasuredResponse {
                name: compiled.ir.name.clone(),
                machine: machine.clone(),
                band: excitation.band,
                amplitude_nm: excitation.amplitude * 1e9,
                modes,
                convergence: learnable_of(compiled)?.with(response).convergence(&factors, options.bandwidth),
                file: path.display().to_string(),
            })
        },
    )?;
    let SessionResult { found, why, down } = done;
    match found {
        Some(found) => ui.judged(&found, why),
        None => {
            Err(Failure::Gate(why.unwrap_or_else(|| format!("interrupted before the last sweep was complete{down}"))))
        }
    }
}

/// Report of a measurement.
#[derive(Serialize)]
struct MeasuredResponse {
    name: String,
    machine: String,
    /// Band of the sweeps, Hz.
    band: [f64; 2],
    /// Amplitude at the joints, along the axis with the largest motion, nm.
    amplitude_nm: f64,
    modes: [ModeMeasurement; 6],
    /// Convergence of learning with this response, if any.
    convergence: Option<Convergence>,
    file: String,
}

impl Outcome for MeasuredResponse {
    fn text(&self) -> String {
        let Self { name, machine, band: [low, high], amplitude_nm, modes, convergence, file } = self;
        let mut text = format!(
            "{name}: response of the running loop from {low:.1} to {high:.0} Hz, {PASSES} sweeps of\n  {amplitude_nm:.0} nm ({machine})\n"
        );
        let columns = [right(10), right(20), right(20), right(14)];
        row(&mut text, &columns, &[&"mode, Hz", &"peak", &"model", &"std. error"]);
        for ModeMeasurement { frequency, largest, modelled, error } in modes {
            let at = |[hertz, gain]: &[f64; 2]| format!("{gain:.2} at {hertz:.0} Hz");
            let cells = [format!("{frequency:.1}"), at(largest), at(modelled), format!("{:.1} %", 100.0 * error)];
            row(&mut text, &columns, &[&cells[0], &cells[1], &cells[2], &cells[3]]);
        }
        // Writing to a String cannot fail.
        let _ = match convergence {
            Some(Convergence { band: [low, high], radius, at, .. }) => writeln!(
                text,
                "  learning with --response {file} converges from {low:.1} to {high:.0} Hz:\n  error factor per pass at most {radius:.2}, worst at {at:.0} Hz"
            ),
            None => writeln!(text, "  it is too uncertain for learning; measure along a longer motion"),
        };
        text
    }
}
