//! `specgen doctor`: whether this computer can run a controller in real time, and what to change.

use std::fmt::Write as _;

use clap::Args;
use serde::Serialize;
use specgen_rt::histogram::{Histogram, known_text, time_text};

use super::named::InputFile;
use super::plot::Plot;
use specgen_compiler::spec_file;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::ui::Ui;
use specgen_operate::doctor::latency::{self, Figures, LatencyMeasurement};
use specgen_operate::doctor::{Files, Finding, Grade, equipment, system};
use specgen_report::chart::{Axis, Chart, LINE};

/// Period of the measurement without a spec, ns: 10 kHz.
const PERIOD: u64 = 100_000;

/// Arguments of `doctor`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::DOCTOR)]
pub struct Arguments {
    /// A spec, whose period the computer is judged by; 100 µs without one.
    spec: Option<InputFile>,
    /// How long wake-ups are measured, s.
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Measure on this processor.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    #[command(flatten)]
    plot: Plot,
}

fn seconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a time from 0.1 to 86400 s, found `{text}`");
    text.parse().ok().filter(|time| (0.1..=86_400.0).contains(time)).ok_or_else(expected)
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let mut period = PERIOD;
    if let Some(spec) = &arguments.spec {
        let compiled = spec_file::looked_up(spec, ui)?;
        period = (compiled.model.timing.period * 1e9) as u64;
    }
    ui.progress(&format!("measuring wake-ups every {} for {} s", time_text(period), arguments.seconds));
    let measured = latency::measure(period, arguments.seconds, arguments.cpu).map_err(environment)?;

    let files = Files::of_this_computer();
    let mut findings = system::findings(&files);
    findings.push(system::timer());
    findings.extend(system::rights(measured.priority.as_ref().copied(), measured.memory.as_ref().copied()));
    findings.push(management(&measured));
    findings.extend(equipment::devices(&files));
    findings.extend(equipment::tools());

    let (grade, verdict) = judge(&measured, period);
    let report = Report {
        period_ns: period,
        findings,
        latency: measured.figures(),
        processors_kept_awake: measured.awake,
        preempted: measured.preempted,
        verdict: Verdict { grade, text: verdict },
        delays: measured.delays,
    };
    let counts = report.latency.below_ns.iter().filter(|(_, count)| *count > 0);
    let chart =
        Chart::new("", "late wake-ups", Axis::log("later than planned, below", "µs"), Axis::log("how many", "")).with(
            "",
            LINE,
            counts.map(|(below, count)| [*below as f64 / 1e3, *count as f64]).collect(),
        );
    if let Some(line) = arguments.plot.place().charts("wake-ups of this computer", &report.verdict.text, &[chart])? {
        ui.progress(line.trim_end());
    }
    // Without a spec nothing is asked for that could be refused.
    let failed = (grade == Grade::Bad && arguments.spec.is_some()).then(|| report.verdict.text.clone());
    ui.judged(&report, failed)
}

/// What was found on this computer.
#[derive(Serialize)]
struct Report {
    period_ns: u64,
    findings: Vec<Finding>,
    latency: Figures,
    processors_kept_awake: bool,
    preempted: u64,
    verdict: Verdict,
    /// From the planned time to running, ns.
    #[serde(skip)]
    delays: Histogram,
}

#[derive(Serialize)]
struct Verdict {
    grade: Grade,
    text: String,
}

impl Outcome for Report {
    fn text(&self) -> String {
        let mut text = String::new();
        for finding in &self.findings {
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(text, "{} {:<17} {}", mark(finding.grade), finding.subject, finding.found);
            if let Some(fix) = &finding.fix {
                let _ = writeln!(text, "{:27}→ {fix}", "");
            }
        }
        let _ = writeln!(text, "wake-ups, from the planned time to running");
        let Figures { p50_ns, p99_ns, p999_ns, max_ns, .. } = self.latency;
        let [median, p99, p999, longest] = [p50_ns, p99_ns, p999_ns, max_ns].map(known_text);
        let _ = writeln!(text, "  median {median}, 99 % {p99}, 99.9 % {p999}, longest {longest}");
        text += &self.delays.to_text();
        let _ = writeln!(text, "{} {}", mark(self.verdict.grade), self.verdict.text);
        text
    }
}

fn management(measured: &LatencyMeasurement) -> Finding {
    let subject = "firmware";
    match measured.management_interrupts {
        Some(0) => Finding {
            subject,
            grade: Grade::Good,
            found: "no system management interrupts meanwhile".to_owned(),
            fix: None,
        },
        Some(count) => Finding {
            subject,
            grade: Grade::Warning,
            found: format!("{count} system management interrupts meanwhile"),
            fix: Some(
                "switch USB legacy support, sensors and power management off in the firmware's set-up".to_owned(),
            ),
        },
        None => Finding {
            subject,
            grade: Grade::Unknown,
            found: "system management interrupts are not counted here".to_owned(),
            fix: Some(
                "`modprobe msr` as root on an Intel processor, then again; `hwlatdetect` finds what is left".to_owned(),
            ),
        },
    }
}

/// What the measurement means for a loop of this period.
fn judge(measured: &LatencyMeasurement, period: u64) -> (Grade, String) {
    let hertz = 1e9 / period as f64;
    let Some(longest) = measured.delays.largest() else {
        return (Grade::Unknown, format!("{hertz:.0} Hz: no wake-up was measured; measure for longer, --seconds"));
    };
    let within = format!("{} of {} periods of {}", measured.skipped, measured.planned, time_text(period));
    if measured.skipped > 0 {
        let share = measured.skipped as f64 / measured.planned as f64;
        return (
            Grade::Bad,
            format!("{hertz:.0} Hz: {within} were slept through ({:.2} %): ticks would be missed", share * 100.0),
        );
    }
    if longest * 2 > period {
        let longest = time_text(longest);
        return (
            Grade::Warning,
            format!("{hertz:.0} Hz: no period was missed, but the longest delay of {longest} makes outputs late"),
        );
    }
    (
        Grade::Good,
        format!("{hertz:.0} Hz: every wake-up within half a period, the longest after {}", time_text(longest)),
    )
}

fn mark(grade: Grade) -> &'static str {
    match grade {
        Grade::Good => "good   ",
        Grade::Unknown => "unknown",
        Grade::Warning => "warning",
        Grade::Bad => "bad    ",
    }
}
