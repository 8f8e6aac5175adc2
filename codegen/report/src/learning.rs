//! Learning of a repeated motion: the frequency up to which it converges on every machine, and the error after each pass.

use core::f64::consts::TAU;
use core::ops::ControlFlow;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::coverage::Coverage;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::Bench;
use host_sim::trajectory::{PaperPath, PaperPose};
use specgen_compiler::compile::Compilation;
use specgen_language::model::TaskSpace;
use specgen_studies::learning::{
    Convergence, LARGEST_RADIUS, LearnError, Learnable, Learner, LearningResult, Motion, Update, learn,
};
use specgen_studies::reproduce::write::digits;
use specgen_studies::robust::Factors;

use super::chart::{Axis, BLUE, Chart, DASHED, DOTS, EDGE, LINE, Note};
use super::section::{Grid, Part, Section};
use super::tracking::short;

/// Highest frequency to be learned, Hz, as in `specgen learn`.
pub const BANDWIDTH: f64 = 800.0;
/// Number of passes to learn from.
const PASSES: usize = 5;
/// Frequency of case 1, Hz.
const FREQUENCY: f64 = 10.0;

/// The section; `None` for a controller without correction input. `command` runs the same.
///
/// # Errors
/// If the machine does not reach its bias pose.
pub fn section(
    compiled: &Compilation,
    task: &TaskSpace,
    scenario: &PlatformScenario,
    controller: &Controller,
    command: &str,
) -> Result<Option<Section>, LearnError> {
    let Some((_, learnable)) = task.correction.zip(Learnable::of(compiled)) else { return Ok(None) };
    let section = Section::new("learning", "Learning", command);
    let factors = Factors::of(&compiled.model, &[]);
    let Some(convergence) = learnable.convergence(&factors, BANDWIDTH) else {
        return Ok(Some(section.lead(
            "By the model, learning converges at no frequency on every machine within the declared intervals. Narrow [robust], or measure the response of the machine with specgen learn --excite.",
        )));
    };
    let learned = match passes(compiled, task, scenario, controller, (&learnable, &convergence)) {
        Ok(learned) => learned,
        // A limit of the spec: show the convergence analysis anyway.
        Err(error @ LearnError::Status(_)) => {
            let text = format!("Case 1 at {FREQUENCY:.0}\u{2009}Hz is not learned: {error}.");
            return Ok(Some(section.lead(&text).part(Part::Chart(bound(&learnable, &convergence)))));
        }
        Err(error) => return Err(error),
    };
    let lead = lead(&learned, &convergence);
    let mut table =
        Grid::new("Passes of case 1 at 10 Hz", &["pass", "nm rms", "nrad rms", "gauges, nm", "measured, s", "path, s"]);
    for (number, pass) in learned.passes.iter().enumerate() {
        let Coverage { seconds, path_seconds } = pass.coverage;
        let values = [pass.translation_nm, pass.orientation_nrad, pass.measured_nm, seconds, path_seconds].map(digits);
        table.push([vec![number.to_string()], values.to_vec()].concat());
    }
    let columns = vec![vec![Part::Chart(bound(&learnable, &convergence))], vec![Part::Chart(by_pass(&learned))]];
    Ok(Some(section.lead(&lead).part(Part::Columns(columns)).text(
        "At each frequency the remaining error after a pass is bounded by the spectral radius of Q (I − T L), over all corners of gain, stiffness over mass, damping, lag and delay. The passes are those of the simulated machine with its tolerances; errors are of the true pose.",
    ).table(table)))
}

/// Improvement by learning, and remaining error.
fn lead(learned: &LearningResult, convergence: &Convergence) -> String {
    let [first, best] = [0, learned.best].map(|pass| short(learned.passes[pass].translation_nm));
    let [low, high] = convergence.band.map(hertz);
    let case = format!("case 1 at {FREQUENCY:.0}\u{2009}Hz");
    let gained = match learned.best {
        0 => format!("Learning does not improve {case}, {first}\u{2009}nm, by more than the repeatability"),
        1 => format!("1 pass reduces the error of {case} from {first} to {best}\u{2009}nm"),
        many => format!("{many} passes reduce the error of {case} from {first} to {best}\u{2009}nm"),
    };
    let (coverage, radius) = (&learned.passes[learned.best].coverage, short(convergence.radius));
    format!(
        "{gained}, measured over {coverage}. From {low} to {high}\u{2009}Hz each pass multiplies the error by at most {radius} on every machine within the declared intervals."
    )
}

fn passes(
    compiled: &Compilation,
    task: &TaskSpace,
    scenario: &PlatformScenario,
    controller: &Controller,
    (learnable, convergence): (&Learnable, &Convergence),
) -> Result<LearningResult, LearnError> {
    let model = &compiled.model;
    let period = model.timing.period;
    let path = PaperPose::corrected(PaperPath::Case1, FREQUENCY);
    let motion = Motion::of(&path, period, &task.setpoint.speed, model.geometry.joint_radius())?;
    let spacing = convergence.spacing(period);
    let update = Update::new(learnable, &motion, convergence, spacing);
    let mut own = controller.fork();
    own.configure(&controller.default_config()).map_err(RunError::from)?;
    let mut rig = scenario.rig().clone();
    let mut bench = Bench::new(&mut rig, &mut own, period, 0)?;
    bench.arm(scenario.options.arming)?;
    learn(&mut bench, &motion, Learner::Host(&update), &[], spacing, PASSES, |_, _| ControlFlow::Continue(()))
}

/// Bound of the error factor per pass, over frequency.
fn bound(learnable: &Learnable, convergence: &Convergence) -> Chart {
    let modes: Vec<f64> = learnable.modes().map(|mode| mode / TAU).to_vec();
    let numbers = (1..=6).map(|k| k.to_string()).collect::<Vec<_>>();
    let [_, high] = convergence.band;
    let shown = convergence.bounds.iter().filter(|[hertz, _]| *hertz >= 1.0);
    let [bounds, unfiltered] = [true, false].map(|filtered| -> Vec<[f64; 2]> {
        let value = |hertz: f64, radius: f64| if filtered { radius * convergence.passed(hertz) } else { radius };
        shown.clone().map(|[hertz, radius]| [*hertz, value(*hertz, *radius)]).collect()
    });
    let mut chart = Chart::new(
        "convergence",
        "Bound of the error factor per pass",
        Axis::log("frequency", "Hz"),
        Axis::linear("error factor per pass", ""),
    )
    .with("without Q", DASHED, unfiltered)
    .colored(EDGE)
    .with("with Q", LINE, bounds)
    .colored(BLUE)
    .noted(Note::Beyond { y: LARGEST_RADIUS, up: true, text: format!("limit {LARGEST_RADIUS}") })
    .noted(Note::Ring(
        [convergence.at, convergence.radius],
        format!("{} at {}\u{2009}Hz", short(convergence.radius), hertz(convergence.at)),
    ))
    .noted(Note::Modes(modes, numbers));
    // Above f_c the bound without Q grows without limit, and nothing is learned there.
    chart.y_limits = Some([0.0, 1.3]);
    chart.short = format!("up to {}\u{2009}Hz", hertz(high));
    chart
}

/// The error of each pass.
fn by_pass(learned: &LearningResult) -> Chart {
    let points = learned.passes.iter().enumerate().map(|(number, pass)| [number as f64, pass.translation_nm]).collect();
    let last = learned.passes[learned.best].translation_nm;
    let mut chart = Chart::new(
        "passes",
        "Error of case 1 at 10\u{2009}Hz by pass",
        Axis::linear("pass", ""),
        Axis::log("translation", "nm rms"),
    )
    .with("", DOTS, points)
    .colored(BLUE)
    .noted(Note::Ring([learned.best as f64, last], format!("{}\u{2009}nm", short(last))));
    chart.short = format!("{}\u{2009}nm", short(last));
    chart
}

/// A frequency with three digits, without a fraction from a hundred on.
fn hertz(value: f64) -> String {
    if value >= 100.0 { format!("{value:.0}") } else { short(value) }
}
