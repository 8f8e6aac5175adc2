//! Measures the response of a running machine to a correction, during passes of a motion.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;

use serde::Serialize;

use super::{MachineSource, Options, SessionResult, learnable_of, machine_name, motion_of};
use crate::factors::Factors;
use crate::learning::{Convergence, Excitation, ModeMeasurement, PASSES, Structure, takes_correction};
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::model::StructuralMode;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_language::table::{right, row};
use specgen_language::ui::Ui;

/// Measures and writes the response.
pub(super) fn run(
    options: &Options,
    path: &Path,
    compiled: &Compilation,
    source: &mut impl MachineSource,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let limit = takes_correction(compiled)?.correction.unwrap_or_default();
    let (motion, _) = motion_of(options, source, compiled)?;
    let (learnable, machine) = (learnable_of(compiled)?, machine_name(options));
    let excitation = Excitation::new(&learnable, &motion, options.bandwidth, [limit, compiled.model.sensor.noise]);
    let factors = Factors::of(&compiled.model, &[]);
    let stop = interrupt::heed();
    let names = [compiled.ir.digest.as_str(), &machine];
    let done = source.work(
        compiled,
        ui,
        |repeating, ui| {
            let measured = excitation.measure(repeating, &learnable, &motion, |number| {
                ui.rate(&format!("learn: sweep {} of {PASSES}", number + 1));
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            ui.rate_done();
            measured
        },
        |spectra, ui| {
            let response = spectra.response(names);
            write_file(path, response.to_json().as_bytes())?;
            let modes = learnable.mode_measurements(&response);
            ui.progress(&format!("wrote the response at {} frequencies to {}", response.bins.len(), path.display()));
            ui.rate("learn: fit of structural modes");
            let structure = learnable.structure(compiled, &spectra.narrow());
            ui.rate_done();
            Ok(MeasuredResponse {
                name: compiled.ir.name.clone(),
                machine: machine.clone(),
                band: excitation.band,
                amplitude_nm: excitation.amplitude * 1e9,
                modes,
                shown: shown(structure.as_ref(), &compiled.model.structural_modes, excitation.band[1]),
                structure,
                convergence: learnable_of(compiled)?.with(response).convergence(&factors, options.bandwidth),
                file: path.display().to_string(),
            })
        },
    )?;
    let SessionResult { result, reason, final_state } = done;
    let interruption = || format!("interrupted before the last sweep was complete{final_state}");
    match result {
        Some(measured) => ui.judged(&measured, reason),
        None => Err(Failure::Gate(reason.unwrap_or_else(interruption))),
    }
}

/// What the response, measured up to `high` (Hz), shows of the structure, with lines for the spec, which has the modes `listed`.
fn shown(structure: Option<&Structure>, listed: &[StructuralMode], high: f64) -> String {
    let Some(found @ Structure { modes, unresolved, band, .. }) = structure else {
        return "  structural modes: the sweep covers too little; choose a higher --bandwidth\n".to_owned();
    };
    let mut text = match (modes.len(), unresolved) {
        (0, None) => "  structural modes: none found\n".to_owned(),
        (count, None) => format!("  structural modes: {count} found\n"),
        (count, Some(hertz)) => format!(
            "  structural modes: {count} found; a resonance near {hertz:.0} Hz is too uncertain, measure along a longer motion\n"
        ),
    };
    let f0 = match band {
        Some([low, known]) => {
            text.push_str(&format!(
                "  the response shows no other mode from {low:.0} to {known:.0} Hz; measured up to {high:.0} Hz (--bandwidth).\n"
            ));
            Some(10.0 * libm::floor(known / 10.0))
        }
        None => {
            text.push_str("  the response is too uncertain to exclude other modes; measure along a longer motion\n");
            None
        }
    };
    if f0.is_some() || !modes.is_empty() {
        text.push_str("  for the spec:\n\n");
    }
    if let Some(f0) = f0 {
        text.push_str(&format!("[robust.structure]\nf0 = \"{f0:.0} Hz\"\n\n"));
    }
    text + &found.lines(listed)
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
    /// Structural modes beyond those of the model, if the record suffices for a fit.
    structure: Option<Structure>,
    /// The same as text.
    #[serde(skip)]
    shown: String,
    /// Convergence of learning with this response, if any.
    convergence: Option<Convergence>,
    file: String,
}

impl Outcome for MeasuredResponse {
    fn text(&self) -> String {
        let Self { name, machine, band: [low, high], amplitude_nm, modes, shown, convergence, file, .. } = self;
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
        text.push_str(shown);
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
