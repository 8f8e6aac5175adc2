//! Figs 6 to 8 and Table 2: tracking of six legs with their own gauges.

use host_sim::closed_loop::{RunError, Tracking};
use host_sim::controller::TickController;
use host_sim::scenario::{LegScenario, MODES, TRACKING_FREQUENCIES, select};

use super::motion::TARGETS;
use crate::chart::{Axis, Chart, DASHED, LINE};
use crate::section::Section;
use specgen_studies::reproduce;

/// Runs of every law at every frequency, with Table 2.
///
/// # Errors
/// As [`LegScenario::run`].
pub fn section(
    scenario: &LegScenario,
    controller: &mut dyn TickController,
    command: &str,
) -> Result<Section, RunError> {
    let table = reproduce::legs::table_2(scenario, controller)?;
    let mut charts = Vec::new();
    for (figure, frequency) in (6..).zip(TRACKING_FREQUENCIES) {
        let place = ["a", "b", "c"][figure - 6];
        let mut path = Chart::new(
            &format!("legs-{place}-path"),
            &format!("Fig. {figure}: leg 0 at {frequency} Hz"),
            Axis::linear("time", "s"),
            Axis::linear("displacement", "µm"),
        );
        let mut error = Chart::new(
            &format!("legs-{place}-error"),
            &format!("Fig. {figure}: error of leg 0 at {frequency} Hz"),
            Axis::linear("time", "s"),
            Axis::linear("T − Y", "nm"),
        );
        for (mode, word) in MODES {
            select(controller, word)?;
            let tracking = scenario.run(controller, frequency)?.tracking;
            let times = [tracking.interval, tracking.interval];
            let of = |pick: fn([f64; 2]) -> f64| values(&tracking, pick);
            path = path.over_time(mode, LINE, times, &of(|[_, y]| y * 1e6));
            error = error.over_time(mode, LINE, times, &of(|[t, y]| (t - y) * 1e9));
            // On top, since the curves of the laws coincide with it.
            if mode == "pcc" {
                path = path.over_time("target T", DASHED, times, &of(|[t, _]| t * 1e6)).colored(TARGETS);
            }
        }
        charts.extend([path, error]);
    }
    Ok(Section::new("leg-tracking", "Leg tracking", command)
        .text("Each leg follows the paper's trajectory with the emitted controller and its own gauge: target T, reading Y. invhys is the inverse model alone; ewma and pcc adapt it. The jump of 112 nm at the end of the ramp is the paper's.")
        .charts(charts)
        .comparison(&table))
}

fn values(tracking: &Tracking, pick: fn([f64; 2]) -> f64) -> Vec<f64> {
    tracking.samples.iter().map(|sample| pick([sample.target[0], sample.measured[0]])).collect()
}
