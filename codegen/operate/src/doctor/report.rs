//! Report on this computer: whether it can run a controller in real time.

use std::fmt::Write as _;

use serde::Serialize;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_rt::histogram::{Histogram, known_text, time_text};

use super::latency::{self, Figures, LatencyMeasurement};
use super::{Files, Finding, Grade, equipment, system};

/// Measures wake-ups every `period` ns for this time, on one processor if given, and checks the computer.
///
/// # Errors
/// The system refuses the measurement.
pub fn examine(period: u64, seconds: f64, processor: Option<usize>, ui: &Ui) -> Result<Report, Failure> {
    ui.progress(&format!("measuring wake-ups every {} for {seconds} s", time_text(period)));
    let measured =
        latency::measure(period, seconds, processor).map_err(|error| Failure::Environment(error.to_string()))?;
    let files = Files::of_this_computer();
    let mut findings = system::findings(&files);
    findings.push(system::timer());
    findings.extend(system::rights(measured.priority.as_ref().copied(), measured.memory.as_ref().copied()));
    findings.push(management(&measured));
    findings.extend(equipment::devices(&files));
    findings.extend(equipment::tools());
    let (grade, text) = judge(&measured, period);
    Ok(Report {
        period_ns: period,
        findings,
        latency: measured.figures(),
        processors_kept_awake: measured.awake,
        preempted: measured.preempted,
        verdict: Verdict { grade, text },
        delays: measured.delays,
    })
}

/// Report on this computer.
#[derive(Serialize)]
pub struct Report {
    period_ns: u64,
    findings: Vec<Finding>,
    /// Delays of wake-ups.
    pub latency: Figures,
    processors_kept_awake: bool,
    preempted: u64,
    /// Whether a loop of the period keeps its time.
    pub verdict: Verdict,
    /// From the planned time to running, ns.
    #[serde(skip)]
    delays: Histogram,
}

/// A grade, with the reason.
#[derive(Serialize)]
pub struct Verdict {
    /// The grade.
    pub grade: Grade,
    /// The reason, one line.
    pub text: String,
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
        let _ = writeln!(text, "wake-up delays, from the planned time to running");
        let Figures { p50_ns, p99_ns, p999_ns, max_ns, .. } = self.latency;
        let [median, p99, p999, longest] = [p50_ns, p99_ns, p999_ns, max_ns].map(known_text);
        let _ = writeln!(text, "  median {median}, 99 % {p99}, 99.9 % {p999}, longest {longest}");
        text += &self.delays.to_text();
        let _ = writeln!(text, "{} {}", mark(self.verdict.grade), self.verdict.text);
        text
    }
}

fn management(measured: &LatencyMeasurement) -> Finding {
    const SUBJECT: &str = "firmware";
    match measured.management_interrupts {
        Some(0) => Finding::good(SUBJECT, "no system management interrupts during the measurement"),
        Some(count) => Finding::of(
            SUBJECT,
            Grade::Warning,
            format!("{count} system management interrupts during the measurement"),
            "disable USB legacy support, sensors and power management in the firmware set-up",
        ),
        None => Finding::of(
            SUBJECT,
            Grade::Unknown,
            "system management interrupts are not counted here",
            "on an Intel processor, run `modprobe msr` as root and repeat; `hwlatdetect` finds other causes",
        ),
    }
}

/// Verdict on a loop of this period.
fn judge(measured: &LatencyMeasurement, period: u64) -> (Grade, String) {
    let hertz = 1e9 / period as f64;
    let Some(longest) = measured.delays.largest() else {
        return (Grade::Unknown, format!("{hertz:.0} Hz: no wake-up was measured; increase --seconds"));
    };
    let within = format!("{} of {} periods of {}", measured.skipped, measured.planned, time_text(period));
    if measured.skipped > 0 {
        let share = measured.skipped as f64 / measured.planned as f64;
        return (Grade::Bad, format!("{hertz:.0} Hz: {within} were missed ({:.2} %)", share * 100.0));
    }
    if longest * 2 > period {
        let longest = time_text(longest);
        return (
            Grade::Warning,
            format!("{hertz:.0} Hz: no period was missed, but the longest delay of {longest} makes outputs late"),
        );
    }
    (Grade::Good, format!("{hertz:.0} Hz: every wake-up within half a period, longest delay {}", time_text(longest)))
}

fn mark(grade: Grade) -> &'static str {
    match grade {
        Grade::Good => "good   ",
        Grade::Unknown => "unknown",
        Grade::Warning => "warning",
        Grade::Bad => "bad    ",
    }
}
