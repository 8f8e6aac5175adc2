//! Runs of a spec's own controller: its laws and trajectories, and the errors of a trajectory played on board.

use host_sim::coverage::Coverage;
use host_sim::platform::table::{AXES, PoseErrors};
use host_sim::scenario::MODES;
use serde::Serialize;

use specgen_compiler::compile::Compilation;
use specgen_compiler::stability;
use specgen_language::model::{Adaptation, TaskSpace};
use specgen_language::outcome::Failure;
use specgen_language::spec::nearest;

/// Status bits for a limited leg.
pub const LEG_LIMITED: u32 = 0x3f;

/// Refuses `samples` ticks per period at `hertz` if a law of the spec is unstable at that interval, since the spec was only checked at
/// its own period.
///
/// # Errors
/// A law is unstable.
pub fn judge(compiled: &Compilation, hertz: f64, samples: u32) -> Result<(), Failure> {
    let period = compiled.model.timing.period;
    let mut model = compiled.model.clone();
    model.timing.period = 1.0 / hertz / f64::from(samples);
    let Err(findings) = stability::check(&model) else { return Ok(()) };
    let why = findings.first().map_or("", |finding| finding.message.as_str());
    let (interval, own, samples_of_period) = (model.timing.period * 1e6, period * 1e6, 1.0 / hertz / period);
    Err(Failure::Gate(format!(
        "--samples {samples} at {hertz} Hz gives an interval of {interval:.1} µs instead of the {own:.1} µs of timing.period, for which {why}. Use \
         --samples {samples_of_period:.0}, which is timing.period"
    )))
}

/// The laws with weights in the spec: with a weight of zero a law adapts nothing, and its row would be meaningless.
pub fn modes(adaptation: &Adaptation) -> Vec<(&'static str, u32)> {
    let given = |mode: &str| match mode {
        "ewma" => adaptation.level_weight > 0.0,
        "pcc" => adaptation.level_weight > 0.0 && adaptation.drift_weight > 0.0,
        _ => true,
    };
    MODES.into_iter().filter(|(mode, _)| given(mode)).collect()
}

/// Number of a trajectory of the spec.
///
/// # Errors
/// There is no trajectory with that name.
pub fn selector(task: &TaskSpace, name: &str) -> Result<u32, Failure> {
    let names: Vec<&str> = task.trajectories.iter().map(|trajectory| trajectory.name.as_str()).collect();
    let place = names.iter().position(|known| *known == name);
    place.and_then(|place| u32::try_from(place).ok()).ok_or_else(|| {
        let meant =
            nearest(name, names.iter().copied()).map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"));
        Failure::Usage(if names.is_empty() {
            format!("the spec has no trajectories, hence no `{name}`: add a [[trajectory]] or omit --trajectory")
        } else {
            format!("the spec has no trajectory `{name}`, only {}{meant}", names.join(", "))
        })
    })
}

/// Errors of a trajectory played on board: true pose against the controller's target, per axis.
#[derive(Debug, Serialize)]
pub struct TrajectoryErrors {
    trajectory: String,
    #[serde(flatten)]
    coverage: Coverage,
    /// Rms error of x, y, z (nm) and of the angles (nrad).
    rms_nano: [f64; 6],
    peak_nano: [f64; 6],
    /// Norm of the rms errors of x, y and z, nm.
    translation_nm: f64,
}

impl TrajectoryErrors {
    /// Errors of a run.
    pub fn of(trajectory: &str, errors: &PoseErrors) -> Self {
        Self {
            trajectory: trajectory.to_owned(),
            coverage: errors.coverage(),
            rms_nano: errors.rms_nano(),
            peak_nano: errors.peak_nano(),
            translation_nm: errors.rms_translation_nm(),
        }
    }

    /// Complete lines.
    pub fn text(&self) -> String {
        let Self { trajectory, coverage, rms_nano, peak_nano, translation_nm } = self;
        let mut out = format!("{trajectory}, on board, {coverage}: true pose minus controller target\n");
        for (axis, name) in AXES.iter().enumerate() {
            let unit = if axis < 3 { "nm" } else { "nrad" };
            out += &format!("  {name:<5}{:>10.2} {unit} rms{:>10.2} {unit} peak\n", rms_nano[axis], peak_nano[axis]);
        }
        out += &format!("  x,y,z{translation_nm:>10.2} nm rms, norm of the three\n");
        out
    }
}
