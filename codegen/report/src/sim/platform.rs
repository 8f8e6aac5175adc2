//! `specgen sim` for a spec with `[control]`, on the machine that it describes: at rest, waves of all axes, the spec's own
//! trajectories played on board; or the paper's Tables 5 to 9.
//!
//! The machine's legs deviate individually within their tolerances; the controller has the records named in the spec. With
//! one nominal record for six legs the inverse model has the error of the legs, which adaptation compensates.

use std::cell::RefCell;

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::coverage::Coverage;
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{PlatformRun, Record};
use host_sim::platform::scenario::{FREE_MODES, select, select_at_equal_gains};
use host_sim::platform::table::{AXES, MachiningRow, MachiningTable, PoseRow, PoseTable};
use host_sim::trajectory::{PaperPath, PaperPose, PoseTarget, PoseTrajectory};
use host_sim::word::status_words;
use serde::Serialize;

use super::{Options, record, write_files};
use crate::chart::{Axis, Chart, LINE};
use crate::drawing::{self, File};
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::start_mode;
use specgen_language::model::TaskSpace;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_runtime::ControlMode;
use specgen_studies::machine::{self, run_failure};
use specgen_studies::reproduce::platform::{CASES, MACHINING_FREQUENCY, parts};
use specgen_studies::runs::{LEG_LIMITED, TrajectoryErrors, selector};

/// Observation time at rest, s.
const REST: f64 = 1.0;
/// Periods of a wave, including start and end, and its shortest duration, s.
const PERIODS: f64 = 4.0;
const SHORTEST: f64 = 0.2;
/// Amplitude of a wave relative to the simultaneous reach of all axes.
const WAVE: f64 = 0.9;
/// P, F and P/F of Table 9.
const MACHINING: [(&str, u32); 3] = [ControlMode::WORDS[0], ControlMode::WORDS[3], ControlMode::WORDS[6]];
/// Refuses options for legs only, and a trajectory that the spec does not have.
pub(super) fn check(options: &Options, task: &TaskSpace) -> Result<(), Failure> {
    if options.samples.is_some() {
        return Err(Failure::Usage(
            "--samples applies only to legs with their own gauges; a spec with [control] runs at its timing.period"
                .to_owned(),
        ));
    }
    let Some(name) = &options.trajectory else { return Ok(()) };
    if options.frequency.is_some() {
        return Err(Failure::Usage(
            "--frequency applies to waves and the paper's cases; the spec's own trajectories have their own frequency"
                .to_owned(),
        ));
    }
    selector(task, name).map(|_| ())
}

pub(super) fn run(
    options: &Options,
    compiled: &Compilation,
    task: &TaskSpace,
    controller: &mut dyn TickController,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let seed = options.plant.seed;
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    let (specimen, mut scenario) = options.plant.platform(&compiled.model, task)?;
    scenario.options.latency = options.latency as usize;
    if options.small_steps {
        scenario.rig_mut().plant_mut().step_small();
    }
    let drawn = options.plot.wanted()?;
    if options.traces || drawn {
        scenario.options.record = Record::Samples;
    }
    let mut experiment = Experiment {
        scenario,
        controller,
        ui,
        traced: options.traces,
        drawn,
        tables: Vec::new(),
        traces: Vec::new(),
        charts: Vec::new(),
        refused: Vec::new(),
        ended: Vec::new(),
        limited: Vec::new(),
    };
    let found = match &options.trajectory {
        Some(name) => experiment.own(name, compiled, selector(task, name)?)?,
        None if options.paper => experiment.tables(options.frequencies())?,
        None => experiment.motions(compiled, task, options.frequencies())?,
    };
    let Experiment { mut tables, traces, charts, refused, ended, limited, .. } = experiment;
    let plot = options.plot.charts(&compiled.ir.name, "target minus true pose", &charts)?;
    let report = Report {
        name: &compiled.ir.name,
        mode: start_mode(&compiled.model, task).to_string(),
        plot,
        digest: &compiled.ir.digest,
        seed,
        noise: !options.plant.no_noise,
        latency_ticks: options.latency,
        records: compiled.model.hysteresis.records.len(),
        axial_stiffness: specimen.stiffness,
        leg_gain: specimen.legs.each_ref().map(|leg| leg.gain_um_per_v),
        refused,
        limited,
        found,
    };
    tables.push(drawing::json("tables.json", &report));
    write_files(options, tables, traces, ui)?;
    ui.scored(&report, &ended)
}

/// The machine and the results.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(skip)]
    name: &'a str,
    /// Mode of the spec, as text.
    #[serde(skip)]
    mode: String,
    /// The line about the plot.
    #[serde(skip)]
    plot: Option<String>,
    digest: &'a str,
    seed: u64,
    noise: bool,
    latency_ticks: u32,
    /// Number of reversal-curve records of the controller.
    records: usize,
    #[serde(rename = "axial_stiffness_N_per_m")]
    axial_stiffness: [f64; 6],
    #[serde(rename = "leg_gain_um_per_V")]
    leg_gain: [f64; 6],
    /// Runs with refused set-points, as text.
    refused: Vec<String>,
    /// Runs in which a leg reached a limit, as text.
    limited: Vec<String>,
    #[serde(flatten)]
    found: Results,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Results {
    Tables {
        free_motion: Vec<PoseRow>,
        machining: Vec<MachiningRow>,
        #[serde(skip)]
        text: String,
    },
    /// Errors of the true pose, one row per motion.
    Motions {
        motions: Vec<Motion>,
    },
    Trajectory(TrajectoryErrors),
    /// The only run ended early.
    Nothing {},
}

/// A run of a motion of the platform.
#[derive(Serialize)]
struct Motion {
    name: String,
    #[serde(flatten)]
    coverage: Coverage,
    /// Rms error of x, y, z (nm) and of the angles (nrad).
    rms_nano: [f64; 6],
    /// Norm of the rms errors of x, y and z, nm.
    translation_nm: f64,
    /// Largest error of P_C, nm.
    peak_nm: f64,
    /// Amplitude of z in a wave, m.
    amplitude: Option<f64>,
}

impl Outcome for Report<'_> {
    fn text(&self) -> String {
        let records = match self.records {
            0 => "a straight line for each leg: none is identified, and on a machine this law does not run".to_owned(),
            1 => "one hysteresis record for all legs".to_owned(),
            many => format!("{many} hysteresis records"),
        };
        let Self { name, mode, seed, .. } = self;
        let mut out =
            format!("{name}, {mode}: simulated machine with tolerances, legs ±10 %, stiffness ±5 % (seed {seed});\n");
        out += &format!("the controller has {records}\n");
        match &self.found {
            Results::Tables { text, .. } => out += text,
            Results::Motions { motions } => out += &table(motions),
            Results::Trajectory(played) => out += &played.text(),
            Results::Nothing {} => {}
        }
        out.extend(self.refused.iter().chain(&self.limited).map(|line| format!("{line}\n")));
        out + self.plot.as_deref().unwrap_or_default()
    }
}

/// One row per motion.
fn table(motions: &[Motion]) -> String {
    let mut out = "rms of target minus true pose, nm and nrad; norm and peak of x, y, z\n".to_owned();
    let mut columns = vec![left(16)];
    columns.resize(11, right(8));
    row(&mut out, &columns, &[&"", &"x", &"y", &"z", &"norm", &"peak", &"θx", &"θy", &"θz", &"meas. s", &"path s"]);
    for Motion { name, coverage, rms_nano, translation_nm, peak_nm, .. } in motions {
        let [x, y, z, a, b, c] = rms_nano.map(short);
        let [over, path] = [coverage.seconds, coverage.path_seconds].map(|seconds| format!("{seconds:.3}"));
        let (norm, peak) = (short(*translation_nm), short(*peak_nm));
        row(&mut out, &columns, &[name, &x, &y, &z, &norm, &peak, &a, &b, &c, &over, &path]);
    }
    let waves: Vec<String> = motions
        .iter()
        .filter_map(|motion| Some(format!("{}: z ±{:.1} µm", motion.name, motion.amplitude? * 1e6)))
        .collect();
    if !waves.is_empty() {
        out += &format!("waves move all axes at once ({})\n", waves.join(", "));
    }
    out
}

/// At most seven characters up to a metre.
fn short(nano: f64) -> String {
    if nano < 999.0 { format!("{nano:.2}") } else { format!("{nano:.0}") }
}

/// The platform at its zero pose.
struct Rest;

impl PoseTrajectory for Rest {
    fn duration(&self) -> f64 {
        REST
    }

    fn target(&self, _time: f64) -> PoseTarget {
        PoseTarget::default()
    }
}

struct Experiment<'a> {
    scenario: PlatformScenario,
    controller: &'a mut dyn TickController,
    ui: &'a Ui,
    traced: bool,
    drawn: bool,
    tables: Vec<File>,
    traces: Vec<File>,
    charts: Vec<Chart>,
    refused: Vec<String>,
    /// Names of runs that did not complete their path.
    ended: Vec<String>,
    limited: Vec<String>,
}

impl Experiment<'_> {
    /// Tables 5 to 9.
    fn tables(&mut self, frequencies: &[f64]) -> Result<Results, Failure> {
        let mut free = PoseTable::default();
        for (name, path) in CASES {
            for &frequency in frequencies {
                self.ui.progress(&format!("Tables 5 to 8: {name} at {frequency} Hz"));
                let trajectory = PaperPose::corrected(path, frequency);
                for (mode, word) in FREE_MODES {
                    select_at_equal_gains(self.controller, word).map_err(environment)?;
                    let run = self.scenario.run(self.controller, &trajectory);
                    let row = |run: &PlatformRun| PoseRow::of(name, mode, frequency, &run.errors);
                    free.rows.extend(self.keep(&format!("{name}-{frequency}hz-{mode}"), run)?.as_ref().map(row));
                }
            }
        }
        let mut machining = MachiningTable::default();
        let trajectory = PaperPose::corrected(PaperPath::Machining, MACHINING_FREQUENCY);
        for (part, work) in parts() {
            self.ui.progress(&format!("Table 9: machining {part}"));
            for (mode, word) in MACHINING {
                select(self.controller, word).map_err(environment)?;
                let run = self.scenario.against(self.controller, &trajectory, work);
                if let Some(run) = self.keep(&format!("machining-{part}-{mode}"), run)? {
                    machining.push(part, mode, &run.errors);
                }
            }
        }
        self.tables.push(("free-motion.csv".to_owned(), free.to_csv().into_bytes()));
        self.tables.push(("machining.csv".to_owned(), machining.to_csv().into_bytes()));
        let text = format!(
            "Tables 5 to 8, with the paper's values (its angles interpreted as µrad)\n{}Table 9, machining at {MACHINING_FREQUENCY} Hz\n{}",
            free.to_text(true),
            machining.to_text(true)
        );
        Ok(Results::Tables { free_motion: free.rows, machining: machining.rows, text })
    }

    /// At rest, waves at `frequencies` (Hz), and every trajectory of the spec, in the mode of the spec.
    fn motions(&mut self, compiled: &Compilation, task: &TaskSpace, frequencies: &[f64]) -> Result<Results, Failure> {
        let mut motions = Vec::new();
        self.ui.progress("at rest");
        let run = self.scenario.run(self.controller, &Rest);
        motions.extend(self.keep("at rest", run)?.map(|run| motion("at rest", &run, None)));
        let period = compiled.model.timing.period;
        // All axes at once, with every leg within its stroke.
        let share = WAVE * compiled.reach.as_ref().map_or(0.0, |reach| reach.share);
        for &frequency in frequencies {
            let name = format!("wave {frequency} Hz");
            self.ui.progress(&name);
            let long = PERIODS / frequency;
            let seconds = if long > SHORTEST { long } else { SHORTEST };
            let (wave, amplitude) = match record::wave(compiled, (seconds / period) as i32, [frequency; 6], [share; 2])
            {
                Ok(found) => found,
                Err(Failure::Gate(why)) => {
                    self.refused.push(format!("{name}: {why}"));
                    continue;
                }
                Err(failure) => return Err(failure),
            };
            let run = self.scenario.run(self.controller, &record::WavePath { wave: RefCell::new(wave), seconds });
            motions.extend(self.keep(&name, run)?.map(|run| motion(&name, &run, Some(amplitude))));
        }
        for (place, trajectory) in task.trajectories.iter().enumerate() {
            let name = &trajectory.name;
            self.ui.progress(&format!("playing {name} on board"));
            let Some(path) = machine::on_board(compiled, place as u32) else { continue };
            let run = self.scenario.play(self.controller, &path, None);
            motions.extend(self.keep(name, run)?.map(|run| motion(name, &run, None)));
        }
        self.tables.push(("motions.csv".to_owned(), csv(&motions).into_bytes()));
        Ok(Results::Motions { motions })
    }

    /// A trajectory of the spec, in the mode of the spec.
    fn own(&mut self, name: &str, compiled: &Compilation, selector: u32) -> Result<Results, Failure> {
        self.ui.progress(&format!("playing {name} on board"));
        let Some(path) = machine::on_board(compiled, selector) else { return Ok(Results::Nothing {}) };
        let run = self.scenario.play(self.controller, &path, None);
        let run = self.keep(&format!("trajectory-{name}"), run)?;
        Ok(run.map_or(Results::Nothing {}, |run| Results::Trajectory(TrajectoryErrors::of(name, &run.errors))))
    }

    /// Keeps the samples of a run for its file; `None`, with a note, if it did not complete its path.
    fn keep(&mut self, name: &str, run: Result<PlatformRun, RunError>) -> Result<Option<PlatformRun>, Failure> {
        let run = match run {
            Err(error @ (RunError::EndedEarly { .. } | RunError::NotEnded { .. })) => {
                self.refused.push(format!("{name}: not scored: {error}"));
                self.ended.push(name.to_owned());
                return Ok(None);
            }
            run => run.map_err(run_failure)?,
        };
        if self.traced {
            self.traces.push((format!("{}.csv", name.replace(' ', "-")), run.to_csv().into_bytes()));
        }
        if self.drawn {
            self.charts.push(chart(name, self.scenario.options.interval, &run));
        }
        let seen = status_words(run.status);
        if run.is_followed() {
            if run.status & LEG_LIMITED != 0 {
                self.limited.push(format!("{name}: {seen}: at a limit of stroke, voltage or slew rate"));
            }
            return Ok(Some(run));
        }
        self.ended.push(name.to_owned());
        self.refused.push(format!(
            "{name}: not scored: {seen}; the path leaves the workspace\n  or exceeds control.setpoint.stream_speed"
        ));
        Ok(None)
    }
}

fn motion(name: &str, run: &PlatformRun, amplitude: Option<f64>) -> Motion {
    Motion {
        name: name.to_owned(),
        coverage: run.errors.coverage(),
        rms_nano: run.errors.rms_nano(),
        translation_nm: run.errors.rms_translation_nm(),
        peak_nm: run.errors.peak_translation_nm(),
        amplitude,
    }
}

/// Errors of x, y and z over time, nm.
pub fn chart(name: &str, interval: f64, run: &PlatformRun) -> Chart {
    let mut chart = Chart::new("", name, Axis::linear("time", "s"), Axis::linear("error", "nm"));
    for (axis, name) in AXES.iter().enumerate().take(3) {
        let errors: Vec<f64> =
            run.samples.iter().map(|sample| 1e9 * (sample.target[axis] - sample.tick.pose[axis])).collect();
        chart = chart.over_time(name, LINE, [interval; 2], &errors);
    }
    chart
}

/// One line per motion.
fn csv(motions: &[Motion]) -> String {
    let mut out = String::from("motion,seconds,path_seconds,x_nm,y_nm,z_nm,rx_nrad,ry_nrad,rz_nrad,norm_nm,peak_nm\n");
    for Motion { name, coverage, rms_nano, translation_nm, peak_nm, .. } in motions {
        out += &format!("{name},{:.6},{:.6}", coverage.seconds, coverage.path_seconds);
        out.extend(rms_nano.iter().map(|value| format!(",{value:.4}")));
        out += &format!(",{translation_nm:.4},{peak_nm:.4}\n");
    }
    out
}
