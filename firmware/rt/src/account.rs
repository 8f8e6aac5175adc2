//! The account of a run: every planned tick is on time, late or skipped, and each late or skipped tick has a cause.
//!
//! A tick has a planned time, and a **limit** after it for the writing of its outputs. It is *late* if they were
//! written after the limit. If the loop reaches a tick a whole period or more after its planned time, the ticks whose
//! periods have passed are *skipped*: their outputs were never computed, and the old ones stayed. The cause is the
//! phase with the largest excess over its usual duration, and for phases of work also the kernel's counters of the
//! thread.
//!
//! Always: planned = on time + late + skipped. [`Account::balances`] is checked at the end of every run.

use crate::clock::Usage;
use crate::histogram::{Histogram, known_text, time_text};

use std::fmt::Write as _;

/// Cause of a late or skipped tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// The loop was woken late.
    Wake,
    /// The computer was suspended.
    Suspended,
    /// The thread was preempted during a tick.
    Preempted,
    /// A page fault occurred during a tick.
    PageFault,
    /// The gauges took long.
    Input,
    /// The controller took long without preemption.
    Computation,
    /// The amplifiers took long.
    Output,
    /// Handing over the record took long.
    HandOver,
}

impl Cause {
    /// All, in the order of tables.
    pub const ALL: [Self; 8] = [
        Self::Wake,
        Self::Suspended,
        Self::Preempted,
        Self::PageFault,
        Self::Input,
        Self::Computation,
        Self::Output,
        Self::HandOver,
    ];

    /// Its name in tables and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wake => "woken late",
            Self::Suspended => "computer suspended",
            Self::Preempted => "preempted",
            Self::PageFault => "page fault",
            Self::Input => "gauges slow",
            Self::Computation => "computation slow",
            Self::Output => "amplifiers slow",
            Self::HandOver => "hand-over slow",
        }
    }

    /// What to look at.
    #[must_use]
    pub fn advice(self) -> &'static str {
        match self {
            Self::Wake => "scheduler, interrupts or hypervisor: PREEMPT_RT, isolcpus, governor; see `specgen doctor`",
            Self::Suspended => "forbid suspend while the machine runs: systemd-inhibit",
            Self::Preempted => "a thread of higher priority, or no SCHED_FIFO: raise --priority, pin with --cpu",
            Self::PageFault => "memory was not locked: see the lines about privileges at the start",
            Self::Input => "bus or device driver, or a simulated machine without enough processor time",
            Self::Computation => {
                "interrupts, system management or hypervisor on this processor, or too slow a processor"
            }
            Self::Output => "bus or device driver",
            Self::HandOver => "interrupts, system management or hypervisor on this processor",
        }
    }
}

/// End of each phase of a tick, ns of [`crate::clock::now`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stamps {
    /// Planned start.
    pub planned: u64,
    /// The loop runs again.
    pub woken: u64,
    /// The gauges are read.
    pub read: u64,
    /// The controller is done.
    pub computed: u64,
    /// The codes were written to the amplifiers.
    pub written: u64,
    /// The record was handed over.
    pub done: u64,
}

/// How a tick went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Outputs were written within the limit.
    OnTime,
    /// Written later, and why.
    Late(Cause),
}

/// The account. Fixed memory; only the text allocates.
#[derive(Debug, Clone)]
pub struct Account {
    /// Length of a period, ns.
    period: u64,
    /// Outputs later than this after the planned time are late, ns.
    limit: u64,
    planned: u64,
    on_time: u64,
    late: [u64; Cause::ALL.len()],
    skipped: [u64; Cause::ALL.len()],
    /// Ticks in which the thread blocked between reading and sleeping: a lock or a file in the wrong place.
    blocked: u64,
    worst: [Option<(u64, Stamps)>; Cause::ALL.len()],
    /// End of the last tick, and the cause if it was late.
    previous: Option<(u64, Option<Cause>)>,
    /// Times by [`TIMES`].
    times: [Histogram; TIMES.len()],
}

/// Names of times, see [`Account::histograms`].
const TIMES: [&str; 5] = ["wake", "gauges", "computation", "amplifiers", "response"];
/// The last of them.
const RESPONSE: usize = TIMES.len() - 1;

impl Account {
    /// An empty book for ticks of `period` whose outputs are due `limit` after their time, ns.
    #[must_use]
    pub fn new(period: u64, limit: u64) -> Self {
        Self {
            period: if period == 0 { 1 } else { period },
            limit,
            planned: 0,
            on_time: 0,
            late: [0; Cause::ALL.len()],
            skipped: [0; Cause::ALL.len()],
            blocked: 0,
            worst: [None; Cause::ALL.len()],
            previous: None,
            times: [const { Histogram::new() }; TIMES.len()],
        }
    }

    /// The loop has reached the tick planned at `planned` (ns) at the time `woken`. Enters the ticks whose periods have
    /// passed as skipped, and returns their number. `suspended`: the computer was suspended since the last tick.
    pub fn arrive(&mut self, planned: u64, woken: u64, suspended: bool) -> u64 {
        let over = woken.saturating_sub(planned) / self.period;
        if over > 0 {
            let cause = self.cause_of_arrival(planned, suspended);
            self.planned += over;
            self.skipped[cause as usize] += over;
            let stamps = Stamps { planned, woken, ..Stamps::default() };
            self.note_worst(cause, woken.saturating_sub(planned), stamps);
        }
        over
    }

    /// Enters a completed tick. `usage` are the kernel's counters from its reading to its end, `suspended` as in
    /// [`Account::arrive`].
    pub fn tick(&mut self, stamps: &Stamps, usage: &Usage, suspended: bool) -> Verdict {
        let Stamps { planned, woken, read, computed, written, done } = *stamps;
        self.planned += 1;
        let response = written.saturating_sub(planned);
        if usage.voluntary_switches > 0 {
            self.blocked += 1;
        }

        let phases = [
            (woken.saturating_sub(planned), Cause::Wake),
            (read.saturating_sub(woken), Cause::Input),
            (computed.saturating_sub(read), Cause::Computation),
            (written.saturating_sub(computed), Cause::Output),
        ];
        let times = phases.iter().map(|(time, _)| *time).chain([response]);
        for (histogram, time) in self.times.iter_mut().zip(times) {
            histogram.add(time);
        }
        let mut longest = phases[0];
        for phase in phases {
            if phase.0 > longest.0 {
                longest = phase;
            }
        }
        let cause = match longest.1 {
            Cause::Wake => self.cause_of_arrival(planned, suspended),
            phase => during(phase, usage),
        };
        let late = response > self.limit;
        // The cause for the next tick, if this one delays it.
        let carried = if late { cause } else { during(Cause::HandOver, usage) };
        self.previous = Some((done, Some(carried)));
        if late {
            self.late[cause as usize] += 1;
            self.note_worst(cause, response, *stamps);
            Verdict::Late(cause)
        } else {
            self.on_time += 1;
            Verdict::OnTime
        }
    }

    /// Cause of a late arrival at a tick: the previous tick if that had not ended, otherwise the wait.
    fn cause_of_arrival(&self, planned: u64, suspended: bool) -> Cause {
        match self.previous {
            _ if suspended => Cause::Suspended,
            Some((done, Some(cause))) if done > planned => cause,
            _ => Cause::Wake,
        }
    }

    fn note_worst(&mut self, cause: Cause, delay: u64, stamps: Stamps) {
        let slot = &mut self.worst[cause as usize];
        if slot.is_none_or(|(worst, _)| delay > worst) {
            *slot = Some((delay, stamps));
        }
    }

    /// Ticks whose time has come.
    #[must_use]
    pub fn planned(&self) -> u64 {
        self.planned
    }

    /// Ticks on time.
    #[must_use]
    pub fn on_time(&self) -> u64 {
        self.on_time
    }

    /// Late ticks by cause, in the order of [`Cause::ALL`].
    #[must_use]
    pub fn late(&self) -> [u64; Cause::ALL.len()] {
        self.late
    }

    /// Skipped ticks by cause, in the order of [`Cause::ALL`].
    #[must_use]
    pub fn skipped(&self) -> [u64; Cause::ALL.len()] {
        self.skipped
    }

    /// Ticks in which the thread blocked during its work.
    #[must_use]
    pub fn blocked(&self) -> u64 {
        self.blocked
    }

    /// The longest delay of a cause, ns.
    #[must_use]
    pub fn worst(&self, cause: Cause) -> Option<u64> {
        self.worst[cause as usize].map(|(delay, _)| delay)
    }

    /// Times with their names: from the planned time to waking, gauges, computation, amplifiers, and from the planned time
    /// to the outputs.
    pub fn histograms(&self) -> impl Iterator<Item = (&'static str, &Histogram)> {
        TIMES.into_iter().zip(&self.times)
    }

    /// planned = on time + late + skipped, by independent counters, with a response time for every completed tick.
    #[must_use]
    pub fn balances(&self) -> bool {
        let late: u64 = self.late.iter().sum();
        let skipped: u64 = self.skipped.iter().sum();
        self.planned == self.on_time + late + skipped && self.times[RESPONSE].count() == self.on_time + late
    }

    /// The book as tables.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        let late: u64 = self.late.iter().sum();
        let skipped: u64 = self.skipped.iter().sum();
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "ticks  planned {} = on time {} + late {late} + skipped {skipped}{}",
            self.planned,
            self.on_time,
            if self.balances() { "" } else { "   DOES NOT BALANCE: report this as a defect of specgen" }
        );
        let _ = writeln!(text, "       late: outputs more than {} after the planned time", time_text(self.limit));
        if late + skipped > 0 {
            let _ = writeln!(text, "  {:<18}{:>9}{:>9}{:>12}  check", "cause", "late", "skipped", "longest");
        }
        for cause in Cause::ALL {
            let (late, skipped) = (self.late[cause as usize], self.skipped[cause as usize]);
            if late + skipped > 0 {
                let longest = known_text(self.worst(cause));
                let _ = writeln!(text, "  {:<18}{late:>9}{skipped:>9}{longest:>12}  {}", cause.name(), cause.advice());
            }
        }
        let _ = writeln!(text, "  {:<18}{:>11}{:>11}{:>11}{:>11}", "time", "median", "99 %", "99.9 %", "longest");
        for (name, histogram) in self.histograms() {
            let _ = write!(text, "  {name:<18}");
            for share in [0.5, 0.99, 0.999] {
                let _ = write!(text, "{:>11}", known_text(histogram.quantile(share)));
            }
            let _ = writeln!(text, "{:>11}", known_text(histogram.largest()));
        }
        let _ = write!(text, "outputs after the planned time:\n{}", self.times[RESPONSE].to_text());
        text
    }
}

/// Cause of a long phase of work, by the kernel's counters.
fn during(phase: Cause, usage: &Usage) -> Cause {
    if usage.major_faults > 0 || usage.minor_faults > 0 {
        Cause::PageFault
    } else if usage.involuntary_switches > 0 {
        Cause::Preempted
    } else {
        phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: Usage = Usage { minor_faults: 0, major_faults: 0, voluntary_switches: 0, involuntary_switches: 0 };

    /// A tick at `planned` with the given lengths of its phases.
    fn stamps(planned: u64, phases: [u64; 5]) -> Stamps {
        let mut time = planned;
        let mut next = |length| {
            time += length;
            time
        };
        let [wake, input, computation, output, hand_over] = phases;
        Stamps {
            planned,
            woken: next(wake),
            read: next(input),
            computed: next(computation),
            written: next(output),
            done: next(hand_over),
        }
    }

    #[test]
    fn the_phase_that_took_longest_is_the_cause_and_the_kernel_says_more() {
        let quiet = [5, 2, 10, 1, 1];
        let preempted = Usage { involuntary_switches: 1, ..QUIET };
        let faulted = Usage { minor_faults: 3, involuntary_switches: 1, ..QUIET };
        for (phase, usage, suspended, expected) in [
            (0, QUIET, false, Cause::Wake),
            (0, preempted, false, Cause::Wake),
            (0, QUIET, true, Cause::Suspended),
            (1, QUIET, false, Cause::Input),
            (2, QUIET, false, Cause::Computation),
            (3, QUIET, false, Cause::Output),
            (2, preempted, false, Cause::Preempted),
            (3, faulted, false, Cause::PageFault),
        ] {
            let mut account = Account::new(100, 50);
            let mut phases = quiet;
            assert_eq!(account.tick(&stamps(1_000, phases), &usage, false), Verdict::OnTime);
            phases[phase] = 60;
            assert_eq!(account.tick(&stamps(1_100, phases), &usage, suspended), Verdict::Late(expected));
            assert!(account.balances());
            assert_eq!(account.late()[expected as usize], 1);
        }
    }

    #[test]
    fn ticks_that_a_tick_reaches_into_have_its_cause() {
        let mut account = Account::new(100, 50);
        assert_eq!(account.arrive(1_000, 1_005, false), 0);
        assert_eq!(account.tick(&stamps(1_000, [5, 2, 350, 1, 1]), &QUIET, false), Verdict::Late(Cause::Computation));
        // It ended at 1359: the ticks of 1100 and 1200 have passed, that of 1300 is late.
        assert_eq!(account.arrive(1_100, 1_360, false), 2);
        let next = stamps(1_300, [60, 2, 5, 1, 1]);
        assert_eq!(account.tick(&next, &QUIET, false), Verdict::Late(Cause::Computation));
        assert_eq!((account.planned(), account.skipped()[Cause::Computation as usize]), (4, 2));
        // A long hand-over is distinguished from a late wake-up.
        assert_eq!(account.tick(&stamps(1_400, [5, 2, 5, 1, 300]), &QUIET, false), Verdict::OnTime);
        assert_eq!(account.arrive(1_500, 1_715, false), 2);
        assert_eq!(account.skipped()[Cause::HandOver as usize], 2);
        assert_eq!(account.tick(&stamps(1_700, [15, 2, 5, 1, 1]), &QUIET, false), Verdict::OnTime);
        assert_eq!(account.arrive(1_800, 2_000, false), 2);
        assert_eq!(account.skipped()[Cause::Wake as usize], 2);
        assert!(account.balances());
        assert_eq!(account.planned(), 4 + 6, "{}", account.to_text());
    }

    #[test]
    fn any_run_balances_and_a_lost_tick_does_not() {
        // A walk through all causes with a fixed linear congruence.
        let mut seed = 12_345_u64;
        let mut draw = |below: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % below
        };
        let mut account = Account::new(100, 50);
        let (mut planned, mut end, mut ticks) = (1_000, 0, 0);
        for _ in 0..20_000 {
            let wake = if draw(10) == 0 { draw(700) } else { draw(20) };
            let woken = (planned + wake).max(end);
            let over = account.arrive(planned, woken, draw(50) == 0);
            planned += over * 100;
            let mut phases = [woken - planned, 0, 0, 0, 0];
            phases[1..].iter_mut().for_each(|phase| *phase = if draw(20) == 0 { draw(300) } else { draw(8) });
            let usage = Usage { involuntary_switches: draw(8) / 7, voluntary_switches: draw(30) / 29, ..QUIET };
            let stamps = stamps(planned, phases);
            account.tick(&stamps, &usage, draw(50) == 0);
            end = stamps.done;
            ticks += over + 1;
            planned += 100;
        }
        assert!(account.balances());
        assert_eq!(account.planned(), ticks);
        assert_eq!(account.planned() * 100, planned - 1_000);
        assert!(account.to_text().starts_with(&format!("ticks  planned {ticks} = on time ")));
        let mut broken = account.clone();
        broken.on_time -= 1;
        assert!(!broken.balances() && broken.to_text().contains("DOES NOT BALANCE"));
        let mut broken = account;
        broken.planned += 1;
        assert!(!broken.balances());
    }
}
