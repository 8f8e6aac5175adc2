//! `specgen sim` for a spec without `[control]`: a sweep of its own legs with every law that has weights in the spec, or the
//! paper's leg experiment, Tables 1 and 2.

use host_sim::closed_loop::Tracking;
use host_sim::controller::TickController;
use host_sim::plant::NoiseParameters;
use host_sim::scenario::{LINEARITY_FREQUENCIES, TRACKING_FREQUENCIES, select};
use host_sim::table::{LinearityTable, TrackingRow, TrackingTable};
use host_sim::trajectory::LegSweep;
use serde::Serialize;
use serde_json::json;

use super::{Options, write_files};
use crate::chart::{Axis, Chart, DASHED, LINE};
use crate::drawing;
use specgen_compiler::compile::Compilation;
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_studies::machine::{self, run_failure};
use specgen_studies::paper::printed;
use specgen_studies::runs::{judge, modes};

/// Default number of control ticks per period of the paper's trajectory.
const SAMPLES: u32 = 500;
/// Share of a leg's range that a sweep leaves free at each end.
const ROOM: f64 = 0.1;
/// Periods of a sweep; the first is not scored.
const PERIODS: f64 = 3.0;
/// An error above this share of the range counts as not tracking.
const LOST: f64 = 0.1;

/// Refuses options for platforms only, and an interval at which the laws are unstable.
pub(super) fn check(options: &Options, compiled: &Compilation) -> Result<(), Failure> {
    if options.trajectory.is_some()
        || options.latency != 0
        || options.small_steps
        || (options.paper && options.frequency.is_some())
    {
        return Err(Failure::Usage(
            "--trajectory, --latency, --small-steps and the paper's --frequency need a platform with pose gauges; this spec has no [control]".to_owned(),
        ));
    }
    if options.record.is_some() {
        return Ok(());
    }
    if options.paper {
        let samples = options.samples.unwrap_or(SAMPLES);
        return TRACKING_FREQUENCIES.iter().try_for_each(|hertz| judge(compiled, *hertz, samples));
    }
    let Some(samples) = options.samples else { return Ok(()) };
    options.frequencies().iter().try_for_each(|hertz| judge(compiled, *hertz, samples))
}

/// Range of a sweep, m: nearly the full range of stack and gauge.
fn range(model: &Model) -> [f64; 2] {
    let [sees_low, sees_high] = model.sensor.range;
    let low = if sees_low > 0.0 { sees_low } else { 0.0 };
    let high = if sees_high < model.actuator.stroke { sees_high } else { model.actuator.stroke };
    let room = ROOM * (high - low);
    [low + room, high - room]
}

/// Tracking of the spec's own legs; the shape of their hysteresis comes from the plant file, everything else from the spec.
fn own(
    options: &Options,
    compiled: &Compilation,
    controller: &mut dyn TickController,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let model = &compiled.model;
    let leg = machine::leg(model, &options.plant.leg()?);
    let noise = if options.plant.no_noise { NoiseParameters::NONE } else { leg.noise };
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs = std::array::from_fn(|_| leg.clone());
    let scenario = machine::legs(model, &legs, &noise, options.plant.seed, 1);
    let own_law = controller.default_config().first().copied().unwrap_or_default();
    let (mut table, mut charts, mut traces) = (TrackingTable::default(), Vec::new(), Vec::new());
    for (mode, word) in modes(&model.adaptation) {
        select(controller, word).map_err(environment)?;
        for &frequency in options.frequencies() {
            ui.progress(&format!("{mode} at {frequency} Hz"));
            let interval = options.samples.map_or(model.timing.period, |samples| 1.0 / frequency / f64::from(samples));
            let sweep = LegSweep { range: range(model), frequency, periods: PERIODS };
            let mut run = scenario.rig().clone().run(controller, &sweep, interval).map_err(run_failure)?;
            let first = run.tracking.samples.iter().take_while(|sample| sample.time < 1.0 / frequency).count();
            if own_law == u64::from(word) {
                charts.push(chart(&run.tracking, &format!("{mode} at {frequency} Hz")));
            }
            if options.traces {
                traces.push((format!("trace-{mode}-{frequency}hz.csv"), run.to_csv().into_bytes()));
            }
            run.tracking.samples.drain(..first);
            table.rows.push(TrackingRow::of(mode, frequency, &run.tracking));
        }
    }
    let files = vec![
        ("tracking.csv".to_owned(), table.to_csv().into_bytes()),
        drawing::json("tables.json", &json!({ "tracking": table })),
    ];
    write_files(options, files, traces, ui)?;
    let range = range(model);
    let below = format!("a sweep from {:.1} to {:.1} µm, target minus gauge", range[0] * 1e6, range[1] * 1e6);
    let plot = options.plot.charts(&compiled.ir.name, &below, &charts)?;
    ui.result(&Own { name: &compiled.ir.name, digest: &compiled.ir.digest, range, tracking: table, plot });
    Ok(())
}

/// Errors of the legs over time, nm.
pub fn chart(tracking: &Tracking, title: &str) -> Chart {
    let mut chart = Chart::new("", title, Axis::linear("time", "s"), Axis::linear("error", "nm"));
    for leg in 0..6 {
        let errors: Vec<f64> =
            tracking.samples.iter().map(|sample| 1e9 * (sample.target[leg] - sample.measured[leg])).collect();
        // There are only four colours.
        let mark = if leg < 4 { LINE } else { DASHED };
        chart = chart.over_time(&format!("leg {leg}"), mark, [tracking.interval; 2], &errors);
    }
    chart
}

/// Tracking errors of the spec's own legs.
#[derive(Serialize)]
struct Own<'a> {
    #[serde(skip)]
    name: &'a str,
    digest: &'a str,
    /// Range of the sweep, m.
    range: [f64; 2],
    tracking: TrackingTable,
    /// The line about the plot.
    #[serde(skip)]
    plot: Option<String>,
}

impl Outcome for Own<'_> {
    fn text(&self) -> String {
        let [low, high] = self.range.map(|metres| metres * 1e6);
        let name = self.name;
        let mut out =
            format!("{name}: six legs of the spec, swept from {low:.1} to {high:.1} µm, target minus gauge\n");
        out += &self.tracking.to_text();
        for row in &self.tracking.rows {
            if row.rmse_nm > LOST * 1e3 * (high - low) {
                let (mode, hertz) = (&row.mode, row.frequency_hz);
                out += &format!("{mode} at {hertz} Hz does not track: {:.1} µm rms\n", row.rmse_nm / 1e3);
            }
        }
        out + self.plot.as_deref().unwrap_or_default()
    }
}

pub(super) fn run(
    options: &Options,
    compiled: &Compilation,
    controller: &mut dyn TickController,
    ui: &mut Ui,
) -> Result<(), Failure> {
    if !options.paper {
        return own(options, compiled, controller, ui);
    }
    let (parameters, noise) = options.plant.read()?;
    ui.progress("preparing six legs: pre-cycle, settling, gauges zeroed");
    let legs = std::array::from_fn(|_| parameters.clone());
    let samples = options.samples.unwrap_or(SAMPLES);
    let scenario = machine::legs(&compiled.model, &legs, &noise, options.plant.seed, samples);
    let modes = modes(&compiled.model.adaptation);
    ui.progress("Table 2: every law with weights in the spec, at three frequencies");
    let tracking = scenario.tracking(controller, &modes, &TRACKING_FREQUENCIES).map_err(run_failure)?;
    ui.progress("Table 1: inverse model alone at six frequencies");
    let linearity = scenario.linearity(controller, &LINEARITY_FREQUENCIES).map_err(run_failure)?;

    let mut traces = Vec::new();
    if options.traces {
        for &(mode, word) in &modes {
            select(controller, word).map_err(environment)?;
            for frequency in TRACKING_FREQUENCIES {
                let run = scenario.run(controller, frequency).map_err(run_failure)?;
                traces.push((format!("trace-{mode}-{frequency}hz.csv"), run.trace.to_csv().into_bytes()));
            }
        }
    }
    let files = vec![
        ("tracking.csv".to_owned(), tracking.to_csv().into_bytes()),
        ("linearity.csv".to_owned(), linearity.to_csv().into_bytes()),
        drawing::json("tables.json", &json!({ "tracking": tracking, "linearity": linearity })),
    ];
    write_files(options, files, traces, ui)?;
    let below = "tracking error of the leg trajectory, nm rms";
    let plot = options.plot.charts(&compiled.ir.name, below, &[paper_chart(&tracking)])?;
    ui.result(&Tables { name: &compiled.ir.name, digest: &compiled.ir.digest, tracking, linearity, plot });
    Ok(())
}

/// Errors over frequency, ours and the paper's.
fn paper_chart(tracking: &TrackingTable) -> Chart {
    let mut chart = Chart::new("", "Table 2", Axis::log("frequency", "Hz"), Axis::log("error", "nm rms"));
    for (color, (mode, paper)) in printed::TABLE_2.into_iter().enumerate() {
        let ours = TRACKING_FREQUENCIES.map(|hertz| [hertz, tracking.rmse_nm(mode, hertz).unwrap_or(f64::NAN)]);
        chart = chart.with(mode, LINE, ours.to_vec()).colored(color);
        let paper = TRACKING_FREQUENCIES.into_iter().zip(paper).map(|(hertz, nm)| [hertz, nm]).collect();
        chart = chart.with(&format!("{mode}, paper"), DASHED, paper).colored(color);
    }
    chart
}

/// The paper's tables of the legs.
#[derive(Serialize)]
struct Tables<'a> {
    #[serde(skip)]
    name: &'a str,
    digest: &'a str,
    tracking: TrackingTable,
    linearity: LinearityTable,
    /// The line about the plot.
    #[serde(skip)]
    plot: Option<String>,
}

impl Outcome for Tables<'_> {
    fn text(&self) -> String {
        let name = self.name;
        let mut out = format!("{name}: the paper's legs; tracking error, nm rms of T − Y (Table 2, paper)\n");
        let columns = [left(8).behind("  "), right(22), right(22), right(22)];
        row(&mut out, &columns, &[&"", &"0.1 Hz", &"1 Hz", &"10 Hz"]);
        for (mode, paper) in printed::TABLE_2 {
            let [a, b, c] = std::array::from_fn(|k| {
                let ours = self.tracking.rmse_nm(mode, TRACKING_FREQUENCIES[k]);
                format!("{} ({:.1})", ours.map_or("-".to_owned(), |nm| format!("{nm:.2}")), paper[k])
            });
            row(&mut out, &columns, &[&mode, &a, &b, &c]);
        }
        // The measured part is the same for every law.
        let [a, b, c] = TRACKING_FREQUENCIES.map(|hertz| {
            let made = self.tracking.rows.iter().find(|row| row.frequency_hz == hertz);
            made.map_or("-".to_owned(), |row| row.coverage.brief())
        });
        row(&mut out, &columns, &[&"over", &a, &b, &c]);
        out += &format!("{name}: slope of Y over q̂, relative to 0.1 Hz (paper's Table 1)\n");
        for (index, row) in self.linearity.rows.iter().enumerate() {
            let paper = printed::slope_ratio(index);
            let (hertz, ratio, offset) = (row.frequency_hz, row.gain_ratio, row.offset_um * 1e3);
            let slope = row.relative_slope;
            out += &format!("  {hertz:>5} Hz  λ {ratio:.4}  offset {offset:>8.1} nm  ratio {slope:.4} ({paper:.4})\n");
        }
        out + self.plot.as_deref().unwrap_or_default()
    }
}
