//! Health of a machine, as text and as JSON.

use std::fmt::Write as _;

use serde::Serialize;
use specgen_hal::Fault;
use specgen_link::{Health, reset_cause};
use specgen_runtime::supervisor::{AMPLIFIER, Cause, EVENTS, FIRST_EVENT};

use super::answer::MachineStatus;
use super::location::Location;
use specgen_language::outcome::Outcome;

/// Answer to `status`: state and health of the machine.
#[derive(Serialize)]
pub struct StatusReport {
    #[serde(flatten)]
    pub status: MachineStatus,
    /// Only of a platform.
    pub place: Option<Location>,
    /// Suggested next step, if there is one.
    pub advice: Option<String>,
    pub health: HealthReport,
}

impl Outcome for StatusReport {
    fn text(&self) -> String {
        let mut text = self.status.text();
        if let Some(place) = &self.place {
            text += &place.text();
        }
        if let Some(advice) = &self.advice {
            text += &format!("  {advice}\n");
        }
        text + &self.health.text(self.status.period)
    }
}

/// [`Health`] with units. Times are the last and the longest, µs; none if they are not measured.
#[derive(Serialize)]
pub struct HealthReport {
    events: u32,
    events_in_words: Vec<&'static str>,
    converter_faults: u32,
    converter_faults_in_words: Vec<String>,
    gauge_faults: u32,
    overruns: Option<u32>,
    tick_us: Option<[f64; 2]>,
    gauges_to_outputs_us: Option<[f64; 2]>,
    latest_us: Option<f64>,
    /// Peak use and size.
    stack_bytes: Option<[u32; 2]>,
    /// Cause of the last reset; empty if unknown.
    reset_cause: Vec<&'static str>,
}

impl From<Health> for HealthReport {
    fn from(health: Health) -> Self {
        let microseconds = |counts: u64| counts as f64 * 1e6 / f64::from(health.clock);
        let timed = |times: Option<[u64; 2]>| times.filter(|_| health.clock > 0).map(|times| times.map(microseconds));
        let is_event = |cause: &Cause| u64::from(health.events & EVENTS) << FIRST_EVENT >> cause.word() & 1 == 1;
        let causes = Cause::ALL.into_iter().filter(is_event).map(Cause::name);
        let amplifier = (health.events & AMPLIFIER != 0).then_some(Cause::AmplifierFault.name());
        let kinds = Fault::ALL.into_iter().filter(|fault| health.faults & fault.bit() != 0);
        Self {
            events: health.events,
            events_in_words: causes.chain(amplifier).collect(),
            converter_faults: health.converter_faults,
            converter_faults_in_words: kinds.map(|fault| fault.to_string()).collect(),
            gauge_faults: health.gauge_faults,
            overruns: health.overruns,
            tick_us: timed(health.tick),
            gauges_to_outputs_us: timed(health.output),
            latest_us: health.latest.filter(|_| health.clock > 0).map(microseconds),
            stack_bytes: health.stack,
            reset_cause: reset_cause::names(health.reset_cause).collect(),
        }
    }
}

impl HealthReport {
    fn text(&self, period: f64) -> String {
        let events = if self.events == 0 { "none".to_owned() } else { self.events_in_words.join(", ") };
        let mut text = format!("  events since the last status request: {events}\n");
        let late = self.latest_us.map_or_else(
            || "start delay not measured: time waits for the tick".to_owned(),
            |late| format!("started at most {late:.1} us late"),
        );
        // Writing to a String cannot fail, here and below.
        let _ = match self.tick_us {
            Some([tick, longest]) => {
                writeln!(text, "  tick time {tick:.1} us, longest {longest:.1} us of {} us, {late}", period * 1e6)
            }
            None => writeln!(text, "  tick time: not measured"),
        };
        if let Some([output, most]) = self.gauges_to_outputs_us {
            let _ = writeln!(text, "  from gauges to outputs {output:.1} us, longest {most:.1} us");
        }
        let overruns =
            self.overruns.map_or_else(|| "overruns not measured".to_owned(), |count| format!("{count} overruns"));
        let _ = writeln!(
            text,
            "  since power-up: {overruns}, {} converter faults, {} ticks with an implausible gauge",
            self.converter_faults, self.gauge_faults
        );
        text.extend(self.converter_faults_in_words.iter().map(|kind| format!("    converter: {kind}\n")));
        if let Some([used, total]) = self.stack_bytes {
            let _ = writeln!(text, "  stack: peak {used} of {total} bytes");
        }
        if !self.reset_cause.is_empty() {
            let _ = writeln!(text, "  reset cause: {}", self.reset_cause.join(", "));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use specgen_runtime::pending::EDGE;
    use specgen_runtime::supervisor::{CONVERTER, MISSED_TICK, STALLED};

    use super::*;

    #[test]
    fn health_has_units_and_omits_what_is_not_measured() {
        let health = Health {
            events: MISSED_TICK | CONVERTER | STALLED | EDGE | AMPLIFIER,
            converter_faults: 3,
            faults: Fault::NotEnded.bit(),
            clock: 200_000_000,
            tick: Some([10_000, 20_000]),
            output: Some([5_000, 6_000]),
            latest: Some(300),
            overruns: Some(2),
            stack: Some([100, 8192]),
            reset_cause: 0b1001_0100,
            ..Health::default()
        };
        let text = HealthReport::from(health).text(1e-4);
        for part in [
            "status request: missed tick, converter, stalled, amplifier fault\n",
            "50.0 us, longest 100.0 us of 100 us",
            "1.5 us late",
            "25.0 us",
            "BUSY stayed high",
            "100 of 8192",
            "2 overruns",
            "reset cause: reset pin, watchdog, no external clock\n",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let bare = HealthReport::from(Health::default()).text(1e-4);
        assert!(!bare.contains("stack") && !bare.contains("reset") && bare.contains("none"), "{bare}");
        // A zero that nothing counted is not a measurement, and neither is a saturated counter.
        assert!(bare.contains("tick time: not measured") && bare.contains("overruns not measured"), "{bare}");
        let waits = Health { clock: 1_000_000_000, tick: Some([12_300, 6_000_000_000]), ..Health::default() };
        let text = HealthReport::from(waits).text(1e-4);
        assert!(text.contains("longest 6000000.0 us of 100 us, start delay not measured"), "{text}");
    }
}
