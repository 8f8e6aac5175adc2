//! What came out, as text, JSON and CSV.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::Arguments;
use super::trajectory::Followed;
use specgen_compiler::compile::Compiled;
use specgen_studies::robust::quantiles::quantile;
use specgen_studies::robust::{Deviation, Factor, Factors, Figures, Gate, Member, Outcome, Study};

/// Quantiles of the draws that are shown, %; 100 is the largest.
const QUANTILES: [f64; 4] = [5.0, 50.0, 95.0, 100.0];

/// One figure of a run.
struct Row {
    name: &'static str,
    key: &'static str,
    of: fn(&Figures) -> f64,
    platform_only: bool,
    /// Whether its worst run is shown.
    judged: bool,
}

const fn row(name: &'static str, key: &'static str, of: fn(&Figures) -> f64, platform_only: bool, judged: bool) -> Row {
    Row { name, key, of, platform_only, judged }
}

const ROWS: [Row; 6] = [
    row("error, nm rms", "error_nm", |f| f.error_nm, false, true),
    row("error, nm peak", "peak_nm", |f| f.peak_nm, false, false),
    row("angles, nrad rms", "orientation_nrad", |f| f.orientation_nrad, true, true),
    row("angles, nrad peak", "orientation_peak_nrad", |f| f.orientation_peak_nrad, true, false),
    row("at a limit, % of ticks", "limited_percent", |f| f.limited_percent, false, false),
    row("with a fault, ticks", "fault_ticks", |f| f.fault_ticks as f64, false, false),
];

/// See the module.
pub(super) struct Report<'a> {
    pub(super) arguments: &'a Arguments,
    pub(super) compiled: &'a Compiled,
    pub(super) factors: &'a Factors,
    pub(super) followed: &'a Followed,
    pub(super) study: &'a Study<'a>,
    pub(super) gate: &'a Gate,
    pub(super) reasons: &'a [String],
    /// Machines that were asked for.
    pub(super) planned: usize,
    /// Those that were run.
    pub(super) runs: &'a [(Member, Outcome)],
}

impl Report<'_> {
    fn rows(&self) -> impl Iterator<Item = &'static Row> {
        let platform = self.compiled.model.task_space.is_some();
        ROWS.iter().filter(move |row| platform || !row.platform_only)
    }

    fn figures(&self, row: &Row, which: impl Fn(&Member) -> bool) -> Vec<Option<f64>> {
        let chosen = self.runs.iter().filter(|(member, _)| which(member));
        chosen.map(|(_, outcome)| outcome.figures().map(row.of)).collect()
    }

    fn diverged(&self) -> usize {
        self.runs.iter().filter(|(_, outcome)| outcome.figures().is_none()).count()
    }

    /// The run with the largest figure, diverged ones before all, the first of equals.
    fn worst(&self, row: &Row) -> Option<&(Member, Outcome)> {
        let key = |run: &(Member, Outcome)| run.1.figures().map_or(f64::INFINITY, row.of);
        let mut worst: Option<&(Member, Outcome)> = None;
        for run in self.runs {
            if worst.is_none_or(|other| key(run) > key(other)) {
                worst = Some(run);
            }
        }
        worst
    }

    /// The command that runs one member alone.
    fn replay(&self, member: &Member) -> String {
        let Arguments { spec, vary, trajectory, frequency, plant, diverged_above, .. } = self.arguments;
        let mut out = format!("specgen robust {} --replay {}", quoted(&spec.display().to_string()), member.name);
        // Writing to a String cannot fail, here and below.
        if plant.seed != 1 {
            let _ = write!(out, " --seed {}", plant.seed);
        }
        if let Some(name) = trajectory {
            let _ = write!(out, " --trajectory {}", quoted(name));
        }
        if let Some(hertz) = frequency {
            let _ = write!(out, " --frequency {hertz}");
        }
        for given in vary {
            let _ = write!(out, " --vary {}={}:{}", given.factor, given.range[0], given.range[1]);
        }
        if let Some(bound) = diverged_above {
            let _ = write!(out, " --diverged-above '{bound:e} m'");
        }
        if let Some(path) = &plant.plant {
            let _ = write!(out, " --plant {}", quoted(&path.display().to_string()));
        }
        if plant.no_noise {
            out.push_str(" --no-noise");
        }
        out
    }

    fn told(&self, outcome: &Outcome) -> String {
        match outcome {
            Outcome::Ran(f) => {
                let mut out = format!("{:.2} nm rms, {:.1} nm peak", f.error_nm, f.peak_nm);
                if self.compiled.model.task_space.is_some() {
                    let (rms, peak) = (f.orientation_nrad, f.orientation_peak_nrad);
                    let _ = write!(out, ", {rms:.1} nrad rms, {peak:.1} nrad peak");
                }
                if f.limited_percent > 0.0 {
                    let _ = write!(out, ", {:.2} % of ticks at a limit", f.limited_percent);
                }
                if f.fault_ticks > 0 {
                    let _ = write!(out, ", {} ticks with a fault (status {:#x})", f.fault_ticks, f.fault_bits);
                }
                out
            }
            Outcome::Diverged { time, reason, limited_percent } => {
                let mut out = format!("diverged: {reason}");
                if let Some(time) = time {
                    let _ = write!(out, " after {time:.4} s");
                }
                if *limited_percent > 0.0 {
                    let _ = write!(out, ", a leg at its limit in {limited_percent:.1} % of the ticks before");
                }
                out
            }
        }
    }

    pub(super) fn text(&self) -> String {
        let mut out = String::new();
        let drawn = self.runs.iter().filter(|(member, _)| member.drawn).count();
        let _ = writeln!(
            out,
            "{}: {} at {} Hz on {} machines, {drawn} of them drawn (seed {}){}",
            self.compiled.ir.name,
            self.followed.name,
            self.followed.frequency,
            self.runs.len(),
            self.arguments.plant.seed,
            if self.study.noise { "" } else { ", without noise" },
        );
        out.push_str("varied, as factors on the spec:\n");
        for one in self.factors.iter() {
            let [low, high] = one.range;
            let each = if one.factor.of_each_leg() { ", each leg on its own in a draw" } else { "" };
            let _ = writeln!(out, "  {:<12}{low:>7.3} to {high:<7.3}({}{each})", one.factor.name(), one.origin);
        }
        match self.runs {
            [(member, outcome)] if self.arguments.replay.is_some() => {
                let _ = writeln!(out, "{}: {}\n{}", member.name, self.told(outcome), described(&member.deviation));
            }
            _ => self.table(&mut out),
        }
        let bound = self.study.bound * 1e9;
        let _ = writeln!(out, "diverged, an error beyond {bound:.0} nm: {} of {}", self.diverged(), self.runs.len());
        if self.runs.len() == self.planned {
            if self.reasons.is_empty() {
                let _ = writeln!(out, "gate: passed ({})", self.asked());
            }
            for reason in self.reasons {
                let _ = writeln!(out, "gate: {reason}");
            }
        }
        out
    }

    fn table(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "{:<24}{:>10} |{:>9} %{:>9} %{:>9} %{:>11} |{:>12}",
            "", "nominal", 5, 50, 95, "max drawn", "max corners"
        );
        for row in self.rows() {
            let cell = |figures: &[Option<f64>], percent: f64| match quantile(figures, percent) {
                Some(figure) => format!("{figure:.2}"),
                None if figures.is_empty() => "-".to_owned(),
                None => "diverged".to_owned(),
            };
            let drawn = self.figures(row, |member| member.drawn);
            let corners = self.figures(row, |member| !member.drawn);
            let nominal = self.figures(row, |member| member.name == "nominal");
            let [a, b, c, d] = QUANTILES.map(|percent| cell(&drawn, percent));
            let _ = writeln!(
                out,
                "{:<24}{:>10} |{a:>11}{b:>11}{c:>11}{d:>11} |{:>12}",
                row.name,
                cell(&nominal, 100.0),
                cell(&corners, 100.0)
            );
        }
        out.push_str("corners, all six legs alike:\n");
        for (member, outcome) in self.runs.iter().filter(|(member, _)| !member.drawn) {
            let _ = writeln!(out, "  {:<18}{}", member.name, self.told(outcome));
        }
        for row in self.rows().filter(|row| row.judged) {
            let Some((member, outcome)) = self.worst(row) else { continue };
            let _ = writeln!(out, "worst {}: {}: {}", row.name, member.name, self.told(outcome));
            let _ = writeln!(out, "{}\n  replay: {}", described(&member.deviation), self.replay(member));
        }
    }

    /// What the gate asks for.
    fn asked(&self) -> String {
        let mut parts = vec!["none diverged".to_owned()];
        let which = self.gate.quantile.map_or("largest".to_owned(), |percent| format!("{percent} % quantile of the"));
        if let Some(limit) = self.gate.error_nm {
            parts.push(format!("{which} rms error at most {limit:.2} nm"));
        }
        if let Some(limit) = self.gate.orientation_nrad {
            parts.push(format!("{which} rms orientation error at most {limit:.2} nrad"));
        }
        parts.join(", ")
    }

    pub(super) fn value(&self) -> Value {
        let quantiles = |figures: &[Option<f64>]| -> Vec<Value> {
            let one = |percent: &f64| json!({ "percent": percent, "value": quantile(figures, *percent) });
            QUANTILES.iter().map(one).collect()
        };
        let table: Vec<Value> = self
            .rows()
            .map(|row| {
                let worst = self.worst(row);
                json!({
                    "figure": row.key,
                    "nominal": quantile(&self.figures(row, |member| member.name == "nominal"), 100.0),
                    "drawn": quantiles(&self.figures(row, |member| member.drawn)),
                    "largest_of_corners": quantile(&self.figures(row, |member| !member.drawn), 100.0),
                    "worst": worst.map(|(member, _)| json!({ "name": member.name, "replay": self.replay(member) })),
                })
            })
            .collect();
        let runs: Vec<Value> = self
            .runs
            .iter()
            .map(|(member, outcome)| {
                json!({
                    "name": member.name,
                    "seed": member.seed,
                    "drawn": member.drawn,
                    "deviation": member.deviation,
                    "outcome": outcome,
                })
            })
            .collect();
        json!({
            "name": self.compiled.ir.name,
            "digest": self.compiled.ir.digest,
            "trajectory": self.followed.name,
            "frequency": self.followed.frequency,
            "seed": self.arguments.plant.seed,
            "noise": self.study.noise,
            "diverged_above_nm": self.study.bound * 1e9,
            "factors": self.factors,
            "planned": self.planned,
            "diverged": self.diverged(),
            "table": table,
            "gate": { "asked": self.gate, "reasons": self.reasons, "complete": self.runs.len() == self.planned },
            "runs": runs,
        })
    }

    /// One line per run: every figure and every factor in full digits.
    pub(super) fn csv(&self) -> String {
        let mut out = "name,seed,drawn,diverged,diverged_at_s".to_owned();
        for row in self.rows() {
            let _ = write!(out, ",{}", row.key);
        }
        out.push_str(",mass,damping,noise,delay_ticks");
        for factor in EACH {
            for leg in 0..6 {
                let _ = write!(out, ",{factor}[{leg}]");
            }
        }
        out.push('\n');
        for (member, outcome) in self.runs {
            let diverged = outcome.figures().is_none();
            let _ = write!(out, "{},{},{},{diverged},", member.name, member.seed, member.drawn);
            if let Outcome::Diverged { time: Some(time), .. } = outcome {
                let _ = write!(out, "{time}");
            }
            for row in self.rows() {
                let _ = match outcome.figures() {
                    Some(figures) => write!(out, ",{}", (row.of)(figures)),
                    None => write!(out, ","),
                };
            }
            let d = &member.deviation;
            let _ = write!(out, ",{},{},{},{}", d.mass, d.damping, d.noise, d.delay_ticks);
            for value in EACH.into_iter().flat_map(|factor| each(d, factor)) {
                let _ = write!(out, ",{value}");
            }
            out.push('\n');
        }
        out
    }
}

/// As a shell takes it for one word.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+=:%,".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Factors of each leg, in the order of the CSV.
const EACH: [Factor; 5] = [Factor::Stiffness, Factor::Gain, Factor::Hysteresis, Factor::Creep, Factor::Lag];

fn each(deviation: &Deviation, factor: Factor) -> [f64; 6] {
    deviation.legs.map(|leg| match factor {
        Factor::Stiffness => leg.stiffness,
        Factor::Gain => leg.gain,
        Factor::Hysteresis => leg.hysteresis,
        Factor::Creep => leg.creep,
        _ => leg.lag,
    })
}

/// The factors of a machine.
fn described(d: &Deviation) -> String {
    let mut out =
        format!("  mass {:.3}, damping {:.3}, noise {:.3}, delay {} ticks", d.mass, d.damping, d.noise, d.delay_ticks);
    for factor in EACH {
        let values = each(d, factor);
        if values.iter().all(|value| value.to_bits() == values[0].to_bits()) {
            let _ = write!(out, ", {factor} {:.3}", values[0]);
        } else {
            let _ = write!(out, "\n    {factor:<11} by leg", factor = factor.name());
            for value in values {
                let _ = write!(out, " {value:.3}");
            }
        }
    }
    out
}
