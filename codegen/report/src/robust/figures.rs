//! Results of a study as text, JSON and CSV.

use crate::chart::{Axis, Chart, DOTS};
use host_sim::coverage::Coverage;
use serde::Serialize;
use specgen_language::shell;

use super::work::{Lessons, Work};
use specgen_language::outcome::Outcome as CommandOutcome;
use specgen_language::table::{left, right, row};
use specgen_studies::robust::quantiles::quantile;
use specgen_studies::robust::{Deviation, Factor, Factors, Figures, Gate, LearningFigures, Member, Outcome};

/// Quantiles of the random machines shown, %; 100 is the largest.
const QUANTILES: [f64; 4] = [5.0, 50.0, 95.0, 100.0];

/// One figure of a run.
struct Row {
    name: &'static str,
    key: &'static str,
    of: fn(&Figures) -> f64,
    /// Whether a study has it.
    shown: fn(&Work) -> bool,
    /// Whether to show its worst run.
    judged: bool,
}

const fn figure(
    name: &'static str,
    key: &'static str,
    of: fn(&Figures) -> f64,
    shown: fn(&Work) -> bool,
    judged: bool,
) -> Row {
    Row { name, key, of, shown, judged }
}

const ALWAYS: fn(&Work) -> bool = |_| true;
const PLATFORM: fn(&Work) -> bool = |work| work.platform;
const LEARNED: fn(&Work) -> bool = |work| work.learning.is_some();

const ROWS: [Row; 7] = [
    figure("error, nm rms", "error_nm", |f| f.error_nm, ALWAYS, true),
    figure("error, nm peak", "peak_nm", |f| f.peak_nm, ALWAYS, false),
    figure("angles, nrad rms", "orientation_nrad", |f| f.orientation_nrad, PLATFORM, true),
    figure("angles, nrad peak", "orientation_peak_nrad", |f| f.orientation_peak_nrad, PLATFORM, false),
    figure("at a limit, % of ticks", "limited_percent", |f| f.limited_percent, ALWAYS, false),
    figure("ticks with a fault", "fault_ticks", |f| f.fault_ticks as f64, ALWAYS, false),
    figure("learned, nm rms", "learned_nm", learned_nm, LEARNED, true),
];

/// Error after learning.
fn learned_nm(figures: &Figures) -> f64 {
    figures.learned.map_or(f64::INFINITY, |learned| learned.error_nm)
}

/// A study and its results.
#[derive(Clone, Copy)]
pub struct StudyResult<'a> {
    pub work: &'a Work,
    pub gate: &'a Gate,
    pub reasons: &'a [String],
    /// Whether it is a single named machine.
    pub alone: bool,
    /// Number of requested machines.
    pub planned: usize,
    pub runs: &'a [(Member, Outcome)],
}

#[derive(Serialize)]
pub struct Report<'a> {
    name: &'a str,
    digest: &'a str,
    trajectory: &'a str,
    frequency: f64,
    seed: u64,
    noise: bool,
    diverged_above_nm: f64,
    factors: &'a Factors,
    planned: usize,
    diverged: usize,
    /// The measured part of the path, which is the same for all machines within the bound.
    #[serde(flatten)]
    coverage: Option<Coverage>,
    table: Vec<Line<'a>>,
    gate: Judgement<'a>,
    runs: Vec<Run<'a>>,
    #[serde(skip)]
    found: StudyResult<'a>,
}

/// A figure over all machines; `None` if one of them diverged, or there are none.
#[derive(Serialize)]
struct Line<'a> {
    figure: &'static str,
    nominal: Option<f64>,
    drawn: [Quantile; 4],
    largest_of_corners: Option<f64>,
    worst: Option<Worst<'a>>,
    #[serde(skip)]
    row: &'static Row,
    /// Machines behind the columns: nominal, random, corners.
    #[serde(skip)]
    counts: [usize; 3],
}

#[derive(Serialize)]
struct Quantile {
    percent: f64,
    value: Option<f64>,
}

#[derive(Serialize)]
struct Worst<'a> {
    name: &'a str,
    replay: String,
    #[serde(skip)]
    run: &'a (Member, Outcome),
}

#[derive(Serialize)]
struct Judgement<'a> {
    asked: &'a Gate,
    reasons: &'a [String],
    complete: bool,
}

#[derive(Serialize)]
struct Run<'a> {
    #[serde(flatten)]
    member: &'a Member,
    outcome: &'a Outcome,
}

impl<'a> StudyResult<'a> {
    pub fn report(self) -> Report<'a> {
        Report {
            name: &self.work.name,
            digest: &self.work.digest,
            trajectory: &self.work.trajectory,
            frequency: self.work.frequency,
            seed: self.work.seed,
            noise: self.work.noise,
            diverged_above_nm: self.work.bound * 1e9,
            factors: &self.work.factors,
            planned: self.planned,
            diverged: self.runs.iter().filter(|(_, outcome)| outcome.figures().is_none()).count(),
            coverage: self.runs.iter().find_map(|(_, outcome)| Some(outcome.figures()?.coverage)),
            table: self.rows().map(|row| self.line(row)).collect(),
            gate: Judgement { asked: self.gate, reasons: self.reasons, complete: self.runs.len() == self.planned },
            runs: self.runs.iter().map(|(member, outcome)| Run { member, outcome }).collect(),
            found: self,
        }
    }

    /// Errors of the random machines in ascending order, of the corners, and errors after learning; without diverged runs.
    pub fn charts(&self) -> Vec<Chart> {
        let mut charts = vec![self.chart("error of each machine", |figures| Some(figures.error_nm))];
        if self.work.learning.is_some() {
            let learned = |figures: &Figures| figures.learned.map(|learned| learned.error_nm);
            charts.push(self.chart("after learning", learned));
        }
        charts
    }

    fn chart(&self, caption: &str, of: impl Fn(&Figures) -> Option<f64>) -> Chart {
        let errors = |drawn: bool| {
            let chosen = self.runs.iter().filter(|(member, _)| member.drawn == drawn);
            let mut errors: Vec<f64> = chosen.filter_map(|(_, outcome)| of(outcome.figures()?)).collect();
            errors.sort_by(f64::total_cmp);
            let count = errors.len() as f64;
            errors.into_iter().enumerate().map(|(k, nm)| [100.0 * (k as f64 + 0.5) / count, nm]).collect()
        };
        Chart::new("", caption, Axis::linear("share", "%"), Axis::linear("error", "nm rms"))
            .with("drawn", DOTS, errors(true))
            .with("corners", DOTS, errors(false))
    }

    fn rows(&self) -> impl Iterator<Item = &'static Row> + use<> {
        let shown = ROWS.each_ref().map(|row| (row.shown)(self.work));
        ROWS.iter().zip(shown).filter(|(_, shown)| *shown).map(|(row, _)| row)
    }

    fn line(&self, row: &'static Row) -> Line<'a> {
        let figures = |which: fn(&Member) -> bool| -> Vec<Option<f64>> {
            let chosen = self.runs.iter().filter(|(member, _)| which(member));
            chosen.map(|(_, outcome)| outcome.figures().map(row.of)).collect()
        };
        let [nominal, drawn, corners] = [
            figures(|member| member.name == "nominal"),
            figures(|member| member.drawn),
            figures(|member| !member.drawn),
        ];
        Line {
            figure: row.key,
            nominal: quantile(&nominal, 100.0),
            drawn: QUANTILES.map(|percent| Quantile { percent, value: quantile(&drawn, percent) }),
            largest_of_corners: quantile(&corners, 100.0),
            worst: self.worst(row).map(|run| Worst { name: &run.0.name, replay: self.replay(&run.0), run }),
            row,
            counts: [nominal.len(), drawn.len(), corners.len()],
        }
    }

    /// The run with the largest figure: a diverged one, if any; else the first of the largest.
    fn worst(&self, row: &Row) -> Option<&'a (Member, Outcome)> {
        let key = |run: &(Member, Outcome)| run.1.figures().map_or(f64::INFINITY, row.of);
        let mut worst: Option<&(Member, Outcome)> = None;
        for run in self.runs {
            if worst.is_none_or(|other| key(run) > key(other)) {
                worst = Some(run);
            }
        }
        worst
    }

    /// The command that runs a single member.
    fn replay(&self, member: &Member) -> String {
        let Work { spec, options, .. } = self.work;
        shell::line("specgen robust").path(spec).words("--replay").word(&member.name).words(options.trim_start()).into()
    }

    fn figures(&self, outcome: &Outcome) -> String {
        match outcome {
            Outcome::Ran(f) => {
                let mut out = format!("{:.2} nm rms, {:.1} nm peak", f.error_nm, f.peak_nm);
                if self.work.platform {
                    let (rms, peak) = (f.orientation_nrad, f.orientation_peak_nrad);
                    out += &format!(", {rms:.1} nrad rms, {peak:.1} nrad peak");
                }
                out += &format!(", over {}", f.coverage.brief());
                if let Some(LearningFigures { error_nm, passes, grew, coverage }) = f.learned {
                    out += &format!(", {error_nm:.2} nm after learning from {passes} passes over {}", coverage.brief());
                    out.push_str(if grew { ", then diverged" } else { "" });
                }
                if f.limited_percent > 0.0 {
                    out += &format!(", {:.2} % of ticks at a limit", f.limited_percent);
                }
                if f.fault_ticks > 0 {
                    out += &format!(", {} ticks with a fault (status {:#x})", f.fault_ticks, f.fault_bits);
                }
                out
            }
            Outcome::Diverged { time, reason, limited_percent } => {
                let mut out = format!("diverged: {reason}");
                if let Some(time) = time {
                    out += &format!(" after {time:.4} s");
                }
                if *limited_percent > 0.0 {
                    out += &format!(", a leg at its limit in {limited_percent:.1} % of the preceding ticks");
                }
                out
            }
        }
    }

    /// Conditions of the gate.
    fn gate_conditions(&self) -> String {
        let mut parts = vec!["none diverged".to_owned()];
        let which = self.gate.quantile.map_or("largest".to_owned(), |percent| format!("{percent} % quantile of the"));
        if let Some(limit) = self.gate.error_nm {
            parts.push(format!("{which} rms error at most {limit:.2} nm"));
        }
        if let Some(limit) = self.gate.orientation_nrad {
            parts.push(format!("{which} rms orientation error at most {limit:.2} nrad"));
        }
        if let Some(limit) = self.gate.learned_nm {
            parts.push(format!("{which} rms learned error at most {limit:.2} nm"));
        }
        parts.join(", ")
    }

    /// One line per run: every figure and every factor with full precision.
    pub fn csv(&self) -> String {
        let mut out = "name,seed,drawn,diverged,diverged_at_s".to_owned();
        out.extend(self.rows().map(|row| format!(",{}", row.key)));
        out.push_str(",mass,damping,noise,delay_ticks");
        for factor in EACH {
            out.extend((0..6).map(|leg| format!(",{factor}[{leg}]")));
        }
        out.push_str(",seconds,path_seconds");
        if self.work.learning.is_some() {
            out.push_str(",learned_seconds,learned_path_seconds");
        }
        out.push('\n');
        for (member, outcome) in self.runs {
            let diverged = outcome.figures().is_none();
            out += &format!("{},{},{},{diverged},", member.name, member.seed, member.drawn);
            if let Outcome::Diverged { time: Some(time), .. } = outcome {
                out += &format!("{time}");
            }
            for row in self.rows() {
                out.push(',');
                out.extend(outcome.figures().map(|figures| (row.of)(figures).to_string()));
            }
            let d = &member.deviation;
            out += &format!(",{},{},{},{}", d.mass, d.damping, d.noise, d.delay_ticks);
            out.extend(EACH.into_iter().flat_map(|factor| by_leg(d, factor)).map(|value| format!(",{value}")));
            let figures = outcome.figures();
            let mut measured = vec![figures.map(|figures| figures.coverage)];
            if self.work.learning.is_some() {
                measured.push(figures.and_then(|figures| Some(figures.learned?.coverage)));
            }
            for coverage in measured {
                let both = coverage.map(|Coverage { seconds, path_seconds }| format!(",{seconds},{path_seconds}"));
                out += both.as_deref().unwrap_or(",,");
            }
            out.push('\n');
        }
        out
    }

    /// The measured part of the motion on learning machines; that of the first, since all follow the same path.
    fn learned_over(&self) -> String {
        let learned = self.runs.iter().find_map(|(_, outcome)| outcome.figures()?.learned);
        learned.map_or_else(String::new, |learned| format!(", measured over {}", learned.coverage))
    }
}

impl CommandOutcome for Report<'_> {
    fn text(&self) -> String {
        let (found, mut out) = (&self.found, String::new());
        let drawn = self.runs.iter().filter(|run| run.member.drawn).count();
        let (name, trajectory, frequency) = (&self.name, &self.trajectory, self.frequency);
        let (machines, seed, noise) = (self.runs.len(), self.seed, if self.noise { "" } else { ", without noise" });
        out += &format!(
            "{name}: {trajectory} at {frequency} Hz on {machines} machines, {drawn} of them random (seed {seed}){noise}\n"
        );
        if let Some(coverage) = &self.coverage {
            out += &format!("each run measured over {coverage}\n");
        }
        if let Some(Lessons { passes, band: [low, high] }) = found.work.learning {
            let over = found.learned_over();
            out += &format!("learning from {passes} passes on each, {low:.1} to {high:.0} Hz{over}\n");
        }
        out.push_str("varied, as factors on spec values:\n");
        for one in self.factors.iter() {
            let [low, high] = one.range;
            let each = if one.factor.of_each_leg() { ", independent for each leg of a random machine" } else { "" };
            out += &format!("  {:<12}{low:>7.3} to {high:<7.3}({}{each})\n", one.factor.name(), one.origin);
        }
        match found.runs {
            [(member, outcome)] if found.alone => {
                out += &format!("{}: {}\n{}\n", member.name, found.figures(outcome), described(&member.deviation));
            }
            _ => self.figures(&mut out),
        }
        let bound = self.diverged_above_nm;
        out += &format!("diverged (error above {bound:.0} nm): {} of {}\n", self.diverged, self.runs.len());
        if self.gate.complete {
            if self.gate.reasons.is_empty() {
                out += &format!("gate: passed ({})\n", found.gate_conditions());
            }
            out.extend(self.gate.reasons.iter().map(|reason| format!("gate: {reason}\n")));
        }
        out
    }
}

impl Report<'_> {
    fn figures(&self, out: &mut String) {
        let columns =
            [left(24), right(10), right(11).behind(" |"), right(11), right(11), right(11), right(12).behind(" |")];
        row(out, &columns, &[&"", &"nominal", &"5 %", &"50 %", &"95 %", &"max random", &"max corners"]);
        for line in &self.table {
            let cell = |figure: Option<f64>, count: usize| match figure {
                Some(figure) => format!("{figure:.2}"),
                None if count == 0 => "-".to_owned(),
                None => "diverged".to_owned(),
            };
            let [nominal, drawn, corners] = line.counts;
            let [a, b, c, d] = line.drawn.each_ref().map(|quantile| cell(quantile.value, drawn));
            let (nominal, corners) = (cell(line.nominal, nominal), cell(line.largest_of_corners, corners));
            row(out, &columns, &[&line.row.name, &nominal, &a, &b, &c, &d, &corners]);
        }
        out.push_str("corners, with six equal legs:\n");
        for run in self.runs.iter().filter(|run| !run.member.drawn) {
            *out += &format!("  {:<18}{}\n", run.member.name, self.found.figures(run.outcome));
        }
        for line in self.table.iter().filter(|line| line.row.judged) {
            let Some(Worst { name, replay, run: (member, outcome) }) = &line.worst else { continue };
            *out += &format!("worst {}: {name}: {}\n", line.row.name, self.found.figures(outcome));
            *out += &format!("{}\n  replay: {replay}\n", described(&member.deviation));
        }
    }
}

/// Factors of each leg, in the order of the CSV.
const EACH: [Factor; 6] =
    [Factor::Stiffness, Factor::Gain, Factor::Hysteresis, Factor::Creep, Factor::Lag, Factor::GaugeLag];

fn by_leg(deviation: &Deviation, factor: Factor) -> [f64; 6] {
    deviation.legs.map(|leg| match factor {
        Factor::Stiffness => leg.stiffness,
        Factor::Gain => leg.gain,
        Factor::Hysteresis => leg.hysteresis,
        Factor::Creep => leg.creep,
        Factor::GaugeLag => leg.gauge_lag,
        _ => leg.lag,
    })
}

/// Text of the factors of a machine.
fn described(d: &Deviation) -> String {
    let mut out =
        format!("  mass {:.3}, damping {:.3}, noise {:.3}, delay {} ticks", d.mass, d.damping, d.noise, d.delay_ticks);
    for factor in EACH {
        let values = by_leg(d, factor);
        if values.iter().all(|value| value.to_bits() == values[0].to_bits()) {
            out += &format!(", {factor} {:.3}", values[0]);
        } else {
            out += &format!("\n    {factor:<11} by leg", factor = factor.name());
            out.extend(values.iter().map(|value| format!(" {value:.3}")));
        }
    }
    out
}
