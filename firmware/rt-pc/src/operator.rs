//! Requests to the machine: by the command line's plan, over the link, by signals.
//!
//! There is a single state for all sources. A host that has sent a command is in control as long as it is not silent
//! and keeps sending commands; other hosts can then only hold it, ramp it down or stop it. The arbiter only requests:
//! the supervisor decides, and each step here waits for its answer.

use controller::supervised::{Cause, Finding, MACHINE_INPUT_NAMES, Phase, Request};
use controller::supervision::LOOK_ALIKE;
use controller::{COMMAND_WORDS, Real, passes, waves};
use specgen_rt::clock::SECOND;
use specgen_runtime::supervisor::FindingText;

use crate::handover::OperatorRequest;
use crate::words::{Command, place, word_of};

/// Time limit of a step of the plan, ns.
const STEP_LIMIT: u64 = 120 * SECOND;
/// Time limit of a ramp-down, after which the loop ends anyway, ns.
const DOWN_LIMIT: u64 = 30 * SECOND;

/// The supervisor's last report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SupervisorReport {
    pub phase: Phase,
    pub cause: Cause,
    /// Finding of the wiring check, if that is the cause.
    pub finding: Finding,
    pub on: bool,
    /// Status of the control law.
    pub status: u32,
    pub tick: u64,
    /// Number of commands that the loop had executed by then.
    pub commands: u32,
    /// Whether the set-point was a wave's.
    pub waving: bool,
    /// Number of late ticks so far.
    pub late: u64,
}

/// A cause as text, with the finding of the wiring check and its alternatives on this geometry, or with the fallback
/// stage.
pub fn why(cause: Cause, finding: Finding) -> String {
    match finding {
        Finding::None => cause.name().to_owned(),
        _ => format!("{}, {}", cause.name(), FindingText(finding, LOOK_ALIKE)),
    }
}

/// A connection over the link; no number is given twice in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HostId(pub u64);

/// Reason why a host does not get control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlRefusal {
    /// The program is ramping down to end.
    Ending,
    Others,
}

/// For how long a host stays in control, ns.
#[derive(Debug, Clone, Copy)]
pub struct Timeout {
    /// Longest silence.
    pub silence: u64,
    /// Longest time without a command.
    pub idle: u64,
}

/// Source of the last command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// The plan, or none.
    Here,
    /// A host over the link.
    Host {
        id: HostId,
        /// Times of its last request, and of its last command, ns.
        seen: u64,
        ordered: u64,
        left: bool,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// No plan: hosts alone.
    Free,
    /// Arming was requested; until the machine arms.
    Arming,
    /// Running was requested; until the machine runs.
    Starting,
    /// Running; the trajectory was requested.
    Playing,
    /// A ramp-down was requested; until the amplifiers are off.
    GoingDown,
    /// Complete: the loop may end.
    Over,
}

#[derive(Debug)]
pub struct Arbiter {
    command: Command,
    request: Request,
    step: Step,
    since: u64,
    /// Input words to set once it runs, by place.
    assignments: Vec<(usize, u64)>,
    /// Reason why the plan failed.
    pub failure: Option<String>,
    /// Since the last [`Arbiter::take_pending`].
    changed: bool,
    commanded: bool,
    owner: Owner,
    requests: u64,
    /// The host that lost control last.
    evicted: Option<HostId>,
    timeout: Timeout,
    /// Another host stopped the machine while it was arming; the owner's replies do not show it.
    is_overruled: bool,
    /// Phase of the machine at the last check.
    phase: Phase,
    /// A person watches: after a fault the loop continues in *faulted* instead of ending.
    attended: bool,
}

impl Arbiter {
    /// Without a plan. If a plan fails, the loop continues if it is `attended`, otherwise it ends.
    pub fn new(attended: bool, timeout: Timeout) -> Self {
        Self {
            command: [0; COMMAND_WORDS],
            request: Request::None,
            step: Step::Free,
            since: 0,
            assignments: Vec::new(),
            failure: None,
            changed: true,
            commanded: true,
            owner: Owner::Here,
            requests: 0,
            evicted: None,
            timeout,
            is_overruled: false,
            phase: Phase::Disarmed,
            attended,
        }
    }

    /// Plans: arm, run, then set `assignments` (such as `command=3`).
    ///
    /// # Errors
    /// An invalid assignment.
    pub fn plan(&mut self, assignments: &[String], now: u64) -> Result<(), String> {
        for assignment in assignments {
            self.assignments.push(self.assignment(assignment)?);
        }
        self.go(Step::Arming, Request::Arm, now);
        Ok(())
    }

    /// Requests a ramp-down, after which the loop may end.
    pub fn ramp_down(&mut self, now: u64) {
        if !self.is_ending() {
            self.go(Step::GoingDown, Request::RampDown, now);
        }
    }

    /// Whether the loop may end now.
    pub fn is_over(&self) -> bool {
        self.step == Step::Over
    }

    /// Continues the plan by the supervisor's report.
    pub fn update(&mut self, said: &SupervisorReport, now: u64) {
        let before = std::mem::replace(&mut self.phase, said.phase);
        if before.is_commanded() && said.phase != before {
            // An old command must not take effect when the machine runs or is driven again.
            waves::rest(&[0.0; 6], &mut self.command);
            (self.changed, self.commanded) = (true, true);
        }
        let waited = now.saturating_sub(self.since);
        match (self.step, said.phase) {
            (Step::Arming | Step::Starting | Step::Playing, Phase::Faulted) => {
                self.give_up(format!("the machine faulted: {}", why(said.cause, said.finding)), now);
            }
            (Step::Arming, Phase::Running) | (Step::Starting, Phase::Running) => {
                for (place, word) in std::mem::take(&mut self.assignments) {
                    self.command[place] = word;
                    self.commanded = true;
                }
                self.go(Step::Playing, Request::None, now);
            }
            (Step::Arming, Phase::Arming | Phase::Holding) => self.go(Step::Starting, Request::Run, now),
            (Step::Arming | Step::Starting, _) if waited > STEP_LIMIT => {
                self.give_up(
                    format!("the machine is still {} after {} s", said.phase.name(), STEP_LIMIT / SECOND),
                    now,
                );
            }
            (Step::GoingDown, Phase::Disarmed | Phase::Faulted) if !said.on => self.go(Step::Over, Request::None, now),
            (Step::GoingDown, _) if waited > DOWN_LIMIT => {
                let text = format!(
                    "not down after {} s ({}): amplifiers switched off",
                    DOWN_LIMIT / SECOND,
                    said.phase.name()
                );
                self.failure.get_or_insert(text);
                self.go(Step::Over, Request::None, now);
            }
            _ => {}
        }
    }

    /// A manual request: a plan ends, except for its ramp-down.
    fn ask(&mut self, request: Request) {
        if !self.is_ending() {
            self.step = Step::Free;
        }
        (self.request, self.changed) = (request, true);
    }

    /// Whether it only waits for the end.
    pub fn is_ending(&self) -> bool {
        matches!(self.step, Step::GoingDown | Step::Over)
    }

    /// Whether a host is in control: it is not silent, and has sent a command recently.
    pub fn host_in_control(&self, now: u64) -> bool {
        match self.owner {
            Owner::Here => false,
            Owner::Host { seen, ordered, left, .. } => {
                let Timeout { silence, idle } = self.timeout;
                !left && now.saturating_sub(seen) <= silence && now.saturating_sub(ordered) <= idle
            }
        }
    }

    /// Whether the silence of the link matters: a host has sent a command.
    fn is_host_owned(&self) -> bool {
        matches!(self.owner, Owner::Host { .. })
    }

    /// Whether this host sent the last command.
    pub fn is_owner(&self, host: HostId) -> bool {
        matches!(self.owner, Owner::Host { id, .. } if id == host)
    }

    /// Whether this host has lost control.
    pub fn is_evicted(&self, host: HostId) -> bool {
        self.evicted == Some(host)
    }

    /// Changes with every request of the host in control; 0 if no host's silence matters.
    pub fn heartbeat(&self) -> u64 {
        if self.is_host_owned() { self.requests } else { 0 }
    }

    /// A host sent a request.
    pub fn seen(&mut self, host: HostId, now: u64) {
        if let Owner::Host { id, seen, .. } = &mut self.owner {
            if *id == host {
                *seen = now;
                self.requests += 1;
            }
        }
    }

    /// A host connects: requests of a host that is gone are not continued for it.
    pub fn connected(&mut self, host: HostId, now: u64) {
        if self.is_host_owned() && self.may_take_control(host, now) && !self.is_ending() {
            self.ask(Request::None);
        }
    }

    /// A host has disconnected. A machine that is off ignores it.
    pub fn left(&mut self, host: HostId, last: Option<&SupervisorReport>) {
        if let Owner::Host { id, left, .. } = &mut self.owner {
            if *id == host {
                *left = true;
                if last.is_none_or(|said| said.phase == Phase::Disarmed && !said.on) {
                    self.owner = Owner::Here;
                }
            }
        }
    }

    /// Whether no other host is in control.
    pub fn may_take_control(&self, host: HostId, now: u64) -> bool {
        self.is_owner(host) || !self.host_in_control(now)
    }

    /// Gives control to a host.
    ///
    /// # Errors
    /// If the program is ending, or another host is in control.
    pub fn take_for_host(&mut self, host: HostId, now: u64) -> Result<(), ControlRefusal> {
        if self.is_ending() {
            return Err(ControlRefusal::Ending);
        }
        // An overruled owner is refused once: reading the flag clears it.
        if !self.may_take_control(host, now) || std::mem::take(&mut self.is_overruled) && self.is_owner(host) {
            return Err(ControlRefusal::Others);
        }
        if !self.is_owner(host) {
            self.requests += 1;
            // A host that was in control must reconnect.
            if let Owner::Host { id, .. } = self.owner {
                self.evicted = Some(id);
            }
        }
        self.owner = Owner::Host { id: host, seen: now, ordered: now, left: false };
        self.step = Step::Free;
        Ok(())
    }

    /// A request of a host. The caller has checked that it is in control, or slows the machine down.
    pub fn ask_by_link(&mut self, request: Request, host: HostId) {
        let rises = matches!(self.phase, Phase::Disarmed | Phase::Arming)
            && matches!(self.request, Request::Arm | Request::Run);
        self.is_overruled = rises && self.is_host_owned() && !self.is_owner(host);
        self.ask(request);
    }

    /// The command words from the link, in their order.
    pub fn set_by_link(&mut self, words: Command) {
        self.command = words;
        (self.changed, self.commanded) = (true, true);
    }

    /// The waiting command has started and is now the command.
    pub fn has_begun_at_edge(&mut self, command: &Command) {
        self.command = *command;
    }

    /// The present command.
    pub fn command(&self) -> &Command {
        &self.command
    }

    /// Command after a wave around `center`: stay there.
    pub fn rest_at(&mut self, center: &[Real; 6]) {
        waves::rest(center, &mut self.command);
        (self.changed, self.commanded) = (true, true);
    }

    /// A pass has started this trajectory: it is the command until another one.
    pub fn has_begun(&mut self, trajectory: u32) {
        passes::begin(trajectory, &mut self.command);
        (self.changed, self.commanded) = (true, true);
    }

    /// The request for the loop, if it changed since the last call.
    pub fn take_pending(&mut self) -> Option<OperatorRequest> {
        let command = std::mem::take(&mut self.commanded).then_some(self.command);
        std::mem::take(&mut self.changed).then_some(OperatorRequest { command, request: self.request })
    }

    fn go(&mut self, step: Step, request: Request, now: u64) {
        (self.step, self.request, self.since, self.changed) = (step, request, now, true);
    }

    /// Reason why it cannot continue: ramp down, and end if it is not attended.
    pub fn give_up(&mut self, text: String, now: u64) {
        self.failure.get_or_insert(text);
        if self.attended {
            self.go(Step::Free, Request::RampDown, now);
        } else {
            self.go(Step::GoingDown, Request::RampDown, now);
        }
    }

    /// Index and word of `name=value`.
    fn assignment(&self, text: &str) -> Result<(usize, u64), String> {
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("expected NAME=VALUE such as `command=3`, found `{text}`"))?;
        let place = place(name)?;
        if place >= COMMAND_WORDS {
            let free = MACHINE_INPUT_NAMES[..COMMAND_WORDS].join(", ");
            return Err(format!("`{name}` is measured, or set by a request; --set accepts {free}"));
        }
        let number: f64 = value.parse().map_err(|_| format!("`{name}`: expected a number, found `{value}`"))?;
        let word = number.is_finite().then(|| word_of(place, number)).flatten();
        word.map(|word| (place, word))
            .ok_or_else(|| format!("`{name}`: expected a finite number, or a whole one of 0 to 4294967295 where the word is a count; found `{value}`"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SILENCE: u64 = 100;
    const IDLE: u64 = 1000;
    const A: HostId = HostId(1);
    const B: HostId = HostId(2);

    const TIMEOUT: Timeout = Timeout { silence: SILENCE, idle: IDLE };

    fn said(phase: Phase, on: bool) -> SupervisorReport {
        SupervisorReport { on, ..crate::bench::said(phase) }
    }

    fn operator() -> Arbiter {
        Arbiter::new(false, TIMEOUT)
    }

    #[test]
    fn the_plan_arms_runs_plays_and_goes_down() {
        let mut operator = operator();
        operator.plan(&["setpoint[0]=1e-6".to_owned()], 0).unwrap();
        assert_eq!(operator.take_pending().unwrap().request, Request::Arm);
        operator.update(&said(Phase::Disarmed, false), 1);
        assert!(operator.take_pending().is_none());
        operator.update(&said(Phase::Arming, true), 1);
        assert_eq!(operator.take_pending().unwrap().request, Request::Run);
        operator.update(&said(Phase::Arming, true), 1);
        assert!(operator.take_pending().is_none());
        operator.update(&said(Phase::Running, true), 2);
        let wish = operator.take_pending().unwrap();
        let index = place("setpoint[0]").unwrap();
        assert_eq!(wish.request, Request::None);
        assert_eq!(wish.command.unwrap()[index], word_of(index, 1e-6).unwrap());
        operator.ramp_down(3);
        assert_eq!(operator.take_pending().unwrap().request, Request::RampDown);
        operator.update(&said(Phase::RampingDown, true), 4);
        assert!(!operator.is_over());
        operator.update(&said(Phase::Disarmed, false), 5);
        assert!(operator.is_over() && operator.failure.is_none());
    }

    #[test]
    fn a_fault_ends_the_plan_and_a_machine_that_does_not_come_down_is_not_waited_for_for_ever() {
        let mut operator = operator();
        operator.plan(&[], 0).unwrap();
        operator.update(&said(Phase::Faulted, true), 1);
        assert!(operator.failure.as_ref().unwrap().contains("faulted: "));
        operator.update(&said(Phase::Holding, true), 2);
        assert!(!operator.is_over());
        operator.update(&said(Phase::Holding, true), 2 + DOWN_LIMIT);
        assert!(operator.is_over());
    }

    #[test]
    fn an_attended_loop_does_not_end_at_a_fault() {
        let mut operator = Arbiter::new(true, TIMEOUT);
        operator.plan(&[], 0).unwrap();
        operator.update(&said(Phase::Faulted, false), 1);
        operator.update(&said(Phase::Faulted, false), 2);
        assert!(operator.failure.is_some() && !operator.is_over());
        operator.ramp_down(3);
        operator.update(&said(Phase::Faulted, false), 4);
        assert!(operator.is_over());
    }

    #[test]
    fn a_plan_is_read_or_refused_with_what_is_expected() {
        for (assignment, expected) in [
            ("request=1", "or set by a request"),
            ("setpoint[9]=1", "no input word `setpoint[9]`"),
            ("setpoint[0]=x", "expected a number, found `x`"),
            ("setpoint[0]=inf", "expected a finite number"),
            ("setpoint[0]", "NAME=VALUE"),
        ] {
            let mut operator = operator();
            let error = operator.plan(&[assignment.to_owned()], 0).unwrap_err();
            assert!(error.contains(expected), "{assignment}: {error}");
            assert_eq!(operator.take_pending().unwrap().request, Request::None, "{assignment}: nothing is asked for");
        }
    }

    #[test]
    fn a_host_has_the_orders_while_it_is_not_silent() {
        let mut operator = operator();
        operator.seen(A, 0);
        operator.left(A, None);
        assert!(!operator.host_in_control(1) && operator.heartbeat() == 0, "one that only looks is not in control");
        operator.take_for_host(A, 10).unwrap();
        operator.ask_by_link(Request::Run, A);
        assert!(operator.heartbeat() > 0 && operator.take_pending().unwrap().request == Request::Run);
        assert_eq!(operator.take_for_host(B, 10 + SILENCE), Err(ControlRefusal::Others));
        assert!(operator.host_in_control(20) && !operator.is_evicted(A));
        operator.seen(A, 200);
        let number = operator.heartbeat();
        operator.seen(B, 250);
        assert_eq!(operator.heartbeat(), number, "another host is not the one that is missed");
        // Silent while something moves: it is missed until another host takes over.
        assert!(
            operator.host_in_control(200 + SILENCE)
                && !operator.host_in_control(201 + SILENCE)
                && operator.heartbeat() > 0
        );
        operator.take_for_host(B, 500).unwrap();
        assert!(operator.is_evicted(A) && operator.heartbeat() != number);
        // Gone while something moves: missed, and every other host may take over at once.
        operator.left(B, Some(&said(Phase::Running, true)));
        assert!(operator.heartbeat() > 0 && !operator.host_in_control(600));
        // Gone while nothing can move: not missed.
        operator.take_for_host(A, 600).unwrap();
        operator.left(A, Some(&said(Phase::Disarmed, false)));
        assert_eq!(operator.heartbeat(), 0);
        operator.ramp_down(700);
        assert_eq!(operator.take_for_host(A, 701), Err(ControlRefusal::Ending));
    }

    #[test]
    fn what_was_commanded_before_the_machine_stopped_running_is_forgotten() {
        let mut operator = operator();
        operator.plan(&["setpoint[0]=1e-6".to_owned()], 0).unwrap();
        for phase in [Phase::Arming, Phase::Running] {
            operator.update(&said(phase, true), 1);
        }
        operator.command[0] = 2;
        assert!(operator.take_pending().is_some());
        operator.update(&said(Phase::Running, true), 2);
        assert!(operator.take_pending().is_none());
        operator.update(&said(Phase::Holding, true), 3);
        assert_eq!(operator.take_pending().unwrap().command.unwrap()[0], 0);
    }

    #[test]
    fn a_stop_of_another_while_the_machine_arms_is_told_with_the_next_order() {
        let mut operator = operator();
        operator.take_for_host(A, 0).unwrap();
        operator.ask_by_link(Request::Arm, A);
        operator.update(&said(Phase::Arming, true), 1);
        assert_eq!(operator.take_for_host(B, 1), Err(ControlRefusal::Others));
        operator.ask_by_link(Request::Hold, B);
        assert_eq!(operator.take_for_host(A, 2), Err(ControlRefusal::Others));
        assert_eq!(operator.take_for_host(A, 2), Ok(()));
        // If the phase shows it, no host needs a notice.
        operator.update(&said(Phase::Running, true), 3);
        operator.ask_by_link(Request::Hold, B);
        assert_eq!(operator.take_for_host(A, 4), Ok(()));
    }

    #[test]
    fn a_host_that_orders_nothing_for_long_loses_the_orders_to_the_next() {
        let mut operator = operator();
        operator.take_for_host(A, 0).unwrap();
        for now in (0..=IDLE).step_by(50) {
            operator.seen(A, now);
        }
        assert_eq!(operator.take_for_host(B, IDLE), Err(ControlRefusal::Others));
        operator.seen(A, IDLE + 1);
        // It still has them while no other asks, and its silence would be noticed.
        assert!(operator.is_owner(A) && operator.heartbeat() > 0);
        operator.take_for_host(B, IDLE + 1).unwrap();
        assert!(operator.is_evicted(A) && operator.is_owner(B));
    }

    #[test]
    fn a_step_that_is_not_answered_is_given_up_after_its_time_and_not_before() {
        for (phase, first, limit, asked) in [
            (Phase::Disarmed, Phase::Disarmed, STEP_LIMIT, Request::Arm),
            (Phase::Arming, Phase::Arming, STEP_LIMIT, Request::Run),
        ] {
            let mut operator = operator();
            operator.plan(&[], 7).unwrap();
            operator.update(&said(first, true), 7);
            operator.update(&said(phase, true), 7 + limit);
            assert_eq!((operator.take_pending().unwrap().request, operator.failure.is_some()), (asked, false));
            operator.update(&said(phase, true), 8 + limit);
            assert_eq!(operator.take_pending().unwrap().request, Request::RampDown);
            let failure = operator.failure.clone().unwrap();
            assert!(failure.contains(&format!("still {} after 120 s", phase.name())), "{failure}");
            // On the way down it is waited for as well, for a shorter time.
            operator.update(&said(Phase::RampingDown, true), 8 + limit + DOWN_LIMIT);
            assert!(!operator.is_over());
            operator.update(&said(Phase::RampingDown, true), 9 + limit + DOWN_LIMIT);
            assert!(operator.is_over() && operator.failure == Some(failure), "the first reason stays");
        }
        let mut operator = operator();
        operator.ramp_down(0);
        operator.update(&said(Phase::RampingDown, true), DOWN_LIMIT + 1);
        assert!(operator.failure.unwrap().starts_with("not down after 30 s (ramping down)"));
        assert_eq!((STEP_LIMIT, DOWN_LIMIT), (120_000_000_000, 30_000_000_000));
    }

    #[test]
    fn a_machine_that_is_off_is_down_in_either_phase_and_one_that_is_on_in_none() {
        for phase in [Phase::Disarmed, Phase::Faulted] {
            let mut operator = operator();
            operator.ramp_down(0);
            assert_eq!(operator.take_pending().unwrap().request, Request::RampDown);
            operator.update(&said(phase, true), 1);
            assert!(!operator.is_over() && operator.is_ending());
            operator.ramp_down(1);
            assert!(operator.take_pending().is_none(), "once");
            operator.update(&said(phase, false), 1);
            assert!(operator.is_over());
            assert_eq!(operator.take_pending().unwrap().request, Request::None);
        }
    }

    #[test]
    fn a_plan_may_find_the_machine_running_and_is_over_when_a_host_orders() {
        let mut operator = operator();
        operator.plan(&["setpoint[0]=1e-6".to_owned()], 0).unwrap();
        operator.update(&said(Phase::Running, true), 1);
        let wish = operator.take_pending().unwrap();
        assert!(wish.request == Request::None && wish.command.unwrap() != [0; COMMAND_WORDS]);
        let mut operator = self::operator();
        operator.plan(&[], 0).unwrap();
        operator.take_for_host(A, 0).unwrap();
        operator.ask_by_link(Request::Hold, A);
        operator.update(&said(Phase::Faulted, true), 1);
        assert!(operator.failure.is_none() && operator.take_pending().unwrap().request == Request::Hold);
    }

    #[test]
    fn what_a_host_that_has_gone_asked_for_is_not_asked_for_on_behalf_of_the_next() {
        let connected = |owner: Option<HostId>, now: u64| {
            let mut operator = Arbiter::new(true, TIMEOUT);
            if let Some(owner) = owner {
                operator.take_for_host(owner, 0).unwrap();
                operator.ask_by_link(Request::Run, owner);
            } else {
                operator.plan(&[], 0).unwrap();
            }
            operator.take_pending();
            operator.connected(B, now);
            operator.take_pending().map(|wish| wish.request)
        };
        assert_eq!(connected(Some(A), SILENCE), None, "it is still there");
        assert_eq!(connected(Some(A), SILENCE + 1), Some(Request::None));
        assert_eq!(connected(Some(B), 0), Some(Request::None), "it reconnects by itself");
        assert_eq!(connected(None, SILENCE + 1), None, "a plan goes on");
        let mut operator = Arbiter::new(true, TIMEOUT);
        operator.take_for_host(A, 0).unwrap();
        operator.ramp_down(1);
        operator.take_pending();
        operator.connected(B, SILENCE + 1);
        assert!(operator.take_pending().is_none(), "the way down goes on");
    }

    #[test]
    fn only_a_host_that_has_gone_from_a_machine_that_is_off_is_forgotten() {
        for (who, last, forgotten) in [
            (A, None, true),
            (A, Some(said(Phase::Disarmed, false)), true),
            (A, Some(said(Phase::Disarmed, true)), false),
            (A, Some(said(Phase::Holding, false)), false),
            (B, Some(said(Phase::Disarmed, false)), false),
        ] {
            let mut operator = operator();
            operator.take_for_host(A, 0).unwrap();
            operator.left(who, last.as_ref());
            assert_eq!(operator.heartbeat() == 0, forgotten, "{last:?}");
            assert_eq!(operator.host_in_control(1), who == B);
            assert_eq!(operator.is_owner(A), !forgotten);
        }
    }

    #[test]
    fn a_number_comes_with_every_request_of_the_owner() {
        let mut operator = operator();
        operator.take_for_host(A, 0).unwrap();
        let first = operator.heartbeat();
        operator.seen(A, 1);
        operator.seen(A, 2);
        assert_eq!(operator.heartbeat(), first + 2);
        operator.take_for_host(A, 3).unwrap();
        assert_eq!(operator.heartbeat(), first + 2);
        operator.left(A, Some(&said(Phase::Running, true)));
        operator.take_for_host(B, 4).unwrap();
        assert_eq!(operator.heartbeat(), first + 3);
    }

    #[test]
    fn only_a_stop_of_another_host_under_a_rise_is_told() {
        for (phase, request, who, told) in [
            (Phase::Arming, Request::Arm, B, true),
            (Phase::Disarmed, Request::Run, B, true),
            (Phase::Arming, Request::None, B, false),
            (Phase::Holding, Request::Run, B, false),
            (Phase::Arming, Request::Arm, A, false),
        ] {
            let mut operator = operator();
            operator.take_for_host(A, 0).unwrap();
            operator.ask_by_link(request, A);
            operator.update(&said(phase, true), 1);
            operator.ask_by_link(Request::Hold, who);
            assert_eq!(operator.take_for_host(A, 2).is_err(), told, "{phase:?} {request:?}");
        }
        // Under a plan no host needs a notice.
        let mut operator = operator();
        operator.plan(&[], 0).unwrap();
        operator.ask_by_link(Request::Hold, B);
        assert!(!operator.is_overruled);
    }

    #[test]
    fn a_command_goes_out_with_a_wish_once() {
        let mut operator = operator();
        assert!(operator.take_pending().unwrap().command.is_some() && operator.take_pending().is_none());
        operator.ask(Request::Arm);
        assert!(operator.take_pending().is_some_and(|wish| wish.command.is_none() && wish.request == Request::Arm));
        operator.set_by_link([4; COMMAND_WORDS]);
        assert_eq!((operator.command()[7], operator.take_pending().unwrap().command), (4, Some([4; COMMAND_WORDS])));
        operator.has_begun(9);
        assert_eq!(operator.take_pending().unwrap().command.unwrap()[..2], [3, 9]);
        operator.rest_at(&[0.0; 6]);
        assert_eq!(operator.take_pending().unwrap().command.unwrap()[0], 0);
        operator.has_begun_at_edge(&[6; COMMAND_WORDS]);
        assert!(operator.command()[2] == 6 && operator.take_pending().is_none(), "the loop has it");
    }

    #[test]
    fn a_cause_is_named_with_what_was_found() {
        assert_eq!(why(Cause::EmergencyStop, Finding::None), "emergency stop");
        let finding =
            (0..1 << 15).map(Finding::of_word).find(|finding| matches!(finding, Finding::Fallback(_))).unwrap();
        let text = why(Cause::Oscillation, finding);
        assert!(text.starts_with("oscillation, ") && text.len() > "oscillation, ".len(), "{text}");
    }
}
