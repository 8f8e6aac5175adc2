//! What a machine noticed of itself, as text and as JSON.

use std::fmt::Write as _;

use serde::Serialize;
use specgen_hal::Fault;
use specgen_link::Health;
use specgen_runtime::supervisor::Cause;

use super::answer::MachineStatus;
use super::pose::Located;
use crate::cli::ui::Outcome;

/// Answer to `status`: how the machine stands, and what it noticed.
#[derive(Serialize)]
pub struct Standing {
    #[serde(flatten)]
    pub status: MachineStatus,
    /// Of a platform.
    pub place: Option<Located>,
    /// What to do, where something is to be done.
    pub advice: Option<String>,
    pub health: Noticed,
}

impl Outcome for Standing {
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

/// [`Health`] with units. Times are the last and the longest, µs; none where nothing is measured.
#[derive(Serialize)]
pub struct Noticed {
    events: u32,
    events_in_words: Vec<&'static str>,
    converter_faults: u32,
    converter_faults_in_words: Vec<String>,
    gauge_faults: u32,
    overruns: u32,
    tick_us: Option<[f64; 2]>,
    gauges_to_outputs_us: Option<[f64; 2]>,
    latest_us: Option<f64>,
    /// Most in use, and what there is.
    stack_bytes: Option<[u32; 2]>,
}

impl From<Health> for Noticed {
    fn from(health: Health) -> Self {
        let microseconds = |counts: u32| f64::from(counts) * 1e6 / f64::from(health.clock);
        let timed = health.clock > 0;
        // Event bits are in the order of the causes from `missed tick` on.
        let events = (0..5).filter(|bit| health.events >> bit & 1 == 1);
        let causes = events.filter_map(|bit| Cause::from_word(Cause::MissedTick.word() + bit));
        let kinds = Fault::ALL.into_iter().filter(|fault| health.faults & fault.bit() != 0);
        Self {
            events: health.events,
            events_in_words: causes.map(Cause::name).collect(),
            converter_faults: health.converter_faults,
            converter_faults_in_words: kinds.map(|fault| fault.to_string()).collect(),
            gauge_faults: health.gauge_faults,
            overruns: health.overruns,
            tick_us: timed.then(|| health.tick.map(microseconds)),
            gauges_to_outputs_us: timed.then(|| health.output.map(microseconds)),
            latest_us: timed.then(|| microseconds(health.latest)),
            stack_bytes: (health.stack[1] > 0).then_some(health.stack),
        }
    }
}

impl Noticed {
    fn text(&self, period: f64) -> String {
        let events = if self.events == 0 { "none".to_owned() } else { self.events_in_words.join(", ") };
        let mut text = format!("  events since asked last: {events}\n");
        // Writing to a String cannot fail.
        if let (Some([tick, longest]), Some([output, most]), Some(late)) =
            (self.tick_us, self.gauges_to_outputs_us, self.latest_us)
        {
            let period = period * 1e6;
            let _ = writeln!(
                text,
                "  a tick {tick:.1} us, longest {longest:.1} us of {period} us, begun at most {late:.1} us late"
            );
            let _ = writeln!(text, "  from gauges to outputs {output:.1} us, longest {most:.1} us");
        }
        let _ = writeln!(
            text,
            "  since power-up: {} overruns, {} converter faults, {} ticks with a gauge not believed",
            self.overruns, self.converter_faults, self.gauge_faults
        );
        for kind in &self.converter_faults_in_words {
            let _ = writeln!(text, "    converter: {kind}");
        }
        if let Some([used, there]) = self.stack_bytes {
            let _ = writeln!(text, "  stack: at most {used} of {there} bytes in use");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_board_noticed_is_said_with_its_units_and_what_is_not_measured_is_left_out() {
        let health = Health {
            events: 0b01001,
            converter_faults: 3,
            faults: Fault::NotEnded.bit(),
            clock: 200_000_000,
            tick: [10_000, 20_000],
            output: [5_000, 6_000],
            latest: 300,
            stack: [100, 8192],
            ..Health::default()
        };
        let text = Noticed::from(health).text(1e-4);
        for part in [
            "missed tick, converter",
            "50.0 us, longest 100.0 us of 100 us",
            "1.5 us late",
            "25.0 us",
            "BUSY stayed high",
            "100 of 8192",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let bare = Noticed::from(Health::default()).text(1e-4);
        assert!(!bare.contains("stack") && bare.contains("none"), "{bare}");
    }
}
