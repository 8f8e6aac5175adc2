//! Measures the wake-up delay of a thread that sleeps until an absolute time, as the control loop does.

use std::io::{Read as _, Seek as _, SeekFrom};
use std::thread;

use serde::Serialize;
use specgen_rt::clock::{self, SECOND, Usage};
use specgen_rt::histogram::Histogram;
use specgen_rt::scheduling::{self, AwakeProcessors, MissingPrivilege};

/// Priority of the measurement, the same as that of rt-pc.
const PRIORITY: u8 = 80;
/// From the start to the first tick, ns.
const LEAD: u64 = 10_000_000;

/// A measurement, with the privileges that were granted.
#[derive(Debug)]
pub struct LatencyMeasurement {
    /// From the planned time to running, ns.
    pub delays: Histogram,
    /// Ticks that were due.
    pub planned: u64,
    /// Whole periods that were missed.
    pub skipped: u64,
    /// Involuntary context switches.
    pub preempted: u64,
    /// System management interrupts during the measurement, if they are counted.
    pub management_interrupts: Option<u64>,
    /// Whether SCHED_FIFO was granted.
    pub priority: Result<(), MissingPrivilege>,
    /// Whether memory could be locked.
    pub memory: Result<(), MissingPrivilege>,
    /// Whether processors could be kept awake.
    pub awake: bool,
}

/// Figures of a measurement for the JSON document, ns.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Figures {
    /// Ticks that were due.
    pub planned: u64,
    /// Whole periods that were missed.
    pub skipped: u64,
    /// Median; none if nothing was measured, as below.
    pub p50_ns: Option<u64>,
    /// 99 % quantile.
    pub p99_ns: Option<u64>,
    /// 99.9 % quantile.
    pub p999_ns: Option<u64>,
    /// Maximum.
    pub max_ns: Option<u64>,
    /// Upper limits and counts of octaves.
    pub below_ns: Vec<(u64, u64)>,
}

/// Sleeps `seconds` in periods of `period` (ns), on processor `cpu` if one is named.
///
/// # Errors
/// There is no such processor, or no thread could be started.
pub fn measure(period: u64, seconds: f64, cpu: Option<usize>) -> Result<LatencyMeasurement, String> {
    // Missing privileges are part of the result, not errors.
    let memory = scheduling::lock_memory();
    let awake = AwakeProcessors::request();
    let before = management_interrupts();
    let ticks = ((seconds * SECOND as f64) / period as f64) as u64;
    let measured = thread::Builder::new().name("latency".to_owned()).spawn(move || {
        cpu.map_or(Ok(()), scheduling::pin)?;
        let priority = scheduling::set_fifo(PRIORITY);
        scheduling::touch_stack();
        let mut delays = Histogram::new();
        let (mut planned, mut skipped, mut done) = (clock::now() + LEAD, 0, 0);
        let usage = Usage::of_this_thread();
        while done < ticks {
            clock::sleep_until(planned);
            let delay = clock::now().saturating_sub(planned);
            delays.add(delay);
            let over = delay / period;
            skipped += over;
            done += over + 1;
            planned += (over + 1) * period;
        }
        let preempted = Usage::of_this_thread().since(usage).involuntary_switches;
        Ok::<_, MissingPrivilege>((delays, done, skipped, preempted, priority))
    });
    let measured = measured.map_err(|error| format!("no thread to measure with: {error}"))?.join();
    scheduling::unlock_memory();
    // The thread has no path that panics.
    let measured = measured.map_err(|_| "the measuring thread ended early".to_owned())?;
    let (delays, planned, skipped, preempted, priority) = measured.map_err(|error| error.to_string())?;
    let management_interrupts = before.zip(management_interrupts()).map(|(before, after)| after.wrapping_sub(before));
    Ok(LatencyMeasurement {
        delays,
        planned,
        skipped,
        preempted,
        management_interrupts,
        priority,
        memory,
        awake: awake.is_ok(),
    })
}

impl LatencyMeasurement {
    /// Figures for the JSON document.
    #[must_use]
    pub fn figures(&self) -> Figures {
        let quantile = |share| self.delays.quantile(share);
        Figures {
            planned: self.planned,
            skipped: self.skipped,
            p50_ns: quantile(0.5),
            p99_ns: quantile(0.99),
            p999_ns: quantile(0.999),
            max_ns: self.delays.largest(),
            below_ns: self.delays.octaves(),
        }
    }
}

/// Counter of system management interrupts of Intel processors (register 0x34); none without permission to read it.
fn management_interrupts() -> Option<u64> {
    const REGISTER: u64 = 0x34;
    let mut file = std::fs::File::open("/dev/cpu/0/msr").ok()?;
    file.seek(SeekFrom::Start(REGISTER)).ok()?;
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes).ok()?;
    Some(u64::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_planned_tick_is_measured_or_skipped() {
        let measured = measure(500_000, 0.1, None).unwrap();
        assert!(measured.planned >= 200);
        assert_eq!(measured.planned, measured.delays.count() + measured.skipped);
        let figures = measured.figures();
        assert!(figures.p50_ns <= figures.p99_ns && figures.p99_ns <= figures.p999_ns);
        assert_eq!(figures.below_ns.iter().map(|(_, count)| count).sum::<u64>(), measured.delays.count());
        assert!(measure(500_000, 0.01, Some(100_000)).unwrap_err().contains("processor 100000"));
    }
}
