//! The detection of an oscillation by itself: how fast it is, and what it does not take for one.

use super::SUPERVISION;
use specgen_runtime::supervisor::{Cause, Fallback, Finding, Phase, Request, Steadiness, Supervision, Supervisor};
use std::f64::consts::TAU;

/// Rate of ticks, Hz, and what noise and environment may make of an error, m: those of the reference platform.
const RATE: f64 = 1e4;
const LIMIT: f64 = 40e-9;
/// Decay of what was explained, and in a stage, s; a mode that rings for 22 ms asks for it.
const HELD: [f64; 2] = [0.176, 0.066];

fn plan() -> Supervision<f64> {
    let follow = 1.0 - (-TAU * 60.0 * 6.0 / RATE).exp();
    let steadiness = Steadiness {
        per_limit: [1.0 / LIMIT; 6],
        follow,
        motion: 1.0 / follow,
        keep: (-2.0 / (HELD[0] * RATE)).exp(),
        keep_fallen: (-2.0 / (HELD[1] * RATE)).exp(),
        one_way: 18,
        first: 50,
        next: 167,
    };
    Supervision { steadiness, timeout: [u32::MAX; 7], ..SUPERVISION }
}

/// A machine that runs; the error of one axis and its set-point are given, tick by tick.
struct Run {
    plan: Supervision<f64>,
    supervisor: Supervisor<f64>,
    ticks: u32,
}

impl Run {
    fn new() -> Self {
        let mut supervisor = Supervisor::new();
        supervisor.phase = Phase::Running;
        Self { plan: plan(), supervisor, ticks: 0 }
    }

    fn tick(&mut self, request: Request, axis: usize, error: f64, target: f64, given: Option<f64>) {
        self.supervisor.decide(&self.plan, request, 0, false);
        let channel = self.supervisor.watch.take_turn();
        if self.supervisor.phase == Phase::Running {
            let [error, target] = [error, target].map(|value| if channel == axis { value } else { 0.0 });
            self.supervisor.follow(&self.plan, channel, error, target, given);
        }
        self.ticks += 1;
    }

    fn time(&self) -> f64 {
        f64::from(self.ticks) / RATE
    }

    fn stage(&self) -> Fallback {
        self.supervisor.oscillation.stage
    }

    /// For so many s; whether anything was found.
    fn finds(&mut self, time: f64, error: impl Fn(f64) -> f64, target: impl Fn(f64) -> f64) -> bool {
        for tick in 0..(time * RATE) as u32 {
            let now = f64::from(tick) / RATE;
            self.tick(Request::None, 3, error(now), target(now), None);
        }
        self.supervisor.cause == Cause::Oscillation
    }
}

/// 100 nm, any frequency from 60 Hz to a quarter of the rate of ticks, any phase, any axis.
#[test]
fn a_steady_sine_of_any_frequency_is_found_in_time() {
    let mut hertz: Vec<f64> = (0..).map(|k| 60.0 + 17.3 * f64::from(k)).take_while(|hertz| *hertz < 2500.0).collect();
    // Where axes that came at regular intervals would see the same again.
    for every in 4..=36 {
        hertz.extend((1..every).map(|k| RATE * f64::from(k) / f64::from(every)).filter(|f| (60.0..2499.0).contains(f)));
    }
    let mut worst = 0.0_f64;
    for hertz in hertz {
        for phase in 0..4 {
            for axis in 0..6 {
                let mut run = Run::new();
                while run.stage() == Fallback::None {
                    let error = 100e-9 * (TAU * (hertz * run.time() + f64::from(phase) / 8.0)).sin();
                    run.tick(Request::None, axis, error, 0.0, None);
                    assert!(run.time() < 0.05, "{hertz} Hz, phase {phase}, axis {axis}");
                }
                worst = worst.max(run.time());
            }
        }
    }
    println!("100 nm from 60 Hz to 2500 Hz: {:.1} ms at most", worst * 1e3);
}

#[test]
fn each_stage_is_reached_shown_and_left_by_an_acknowledgement() {
    let sine = |run: &Run| 200e-9 * (TAU * 361.0 * run.time()).sin();
    let mut run = Run::new();
    let mut seen = Vec::new();
    while run.supervisor.phase == Phase::Running {
        let error = sine(&run);
        run.tick(Request::None, 0, error, 0.0, None);
        let finding = Finding::of_word(run.supervisor.finding());
        let stage = run.supervisor.conditions >> 29;
        if seen.last().is_none_or(|(_, found, _, _)| *found != finding) {
            seen.push((run.supervisor.cause, finding, stage, run.time()));
        }
    }
    let stages: Vec<_> = seen.iter().map(|(cause, finding, ..)| (*cause, *finding)).collect();
    assert_eq!(
        stages,
        [
            (Cause::None, Finding::None),
            (Cause::Oscillation, Finding::Fallback(Fallback::Reduced)),
            (Cause::Oscillation, Finding::Fallback(Fallback::FeedForward)),
        ]
    );
    assert_eq!((run.supervisor.phase, run.supervisor.cause), (Phase::RampingDown, Cause::Oscillation));
    let times: Vec<f64> = seen.iter().skip(1).map(|(.., time)| *time).collect();
    assert!(times[0] < 0.05 && times[1] - times[0] < 0.2 && run.time() - times[1] < 0.2, "{seen:?}");

    // It stays for a hold and a run, and goes when it is acknowledged.
    let mut run = Run::new();
    while run.stage() == Fallback::None {
        let error = sine(&run);
        run.tick(Request::None, 0, error, 0.0, None);
    }
    for request in [Request::Hold, Request::None, Request::Run, Request::None] {
        run.tick(request, 0, 0.0, 0.0, None);
        assert_eq!(run.stage(), Fallback::Reduced, "{request:?}");
        assert_eq!(Finding::of_word(run.supervisor.finding()), Finding::Fallback(Fallback::Reduced));
    }
    assert_eq!((run.supervisor.phase, run.supervisor.cause), (Phase::Running, Cause::Oscillation));
    assert_eq!(run.supervisor.conditions >> 29, 1);
    run.tick(Request::Acknowledge, 0, 0.0, 0.0, None);
    assert_eq!(
        (run.supervisor.phase, run.supervisor.cause, run.stage()),
        (Phase::Running, Cause::None, Fallback::None)
    );
    run.tick(Request::Acknowledge, 0, 0.0, 0.0, None);
    assert_eq!((run.supervisor.conditions >> 28, run.supervisor.finding()), (0, 0));
}

/// A ring that dies out is none, however large; one that does not is.
/// Where the set-point stands is no motion, neither where the law begins nor after an acknowledgement.
#[test]
fn an_oscillation_is_found_in_time_wherever_the_set_point_stands() {
    let sine = |now: f64| 100e-9 * (TAU * 361.0 * now).sin();
    let mut run = Run::new();
    for time in ["first", "acknowledged"] {
        assert!(run.finds(0.05, sine, |_| 50e-6), "{time}");
        run.tick(Request::Acknowledge, 3, 0.0, 50e-6, None);
        assert_eq!((run.supervisor.phase, run.stage()), (Phase::Running, Fallback::None), "{time}");
    }
}

#[test]
fn a_ring_that_dies_out_is_no_oscillation() {
    for hertz in [80.0, 361.0, 795.0] {
        for size in [1e-7, 1e-6, 1e-5] {
            let ring = |lasts: f64| move |now: f64| size * (-now / lasts).exp() * (TAU * hertz * now).cos();
            assert!(!Run::new().finds(0.6, ring(0.022), |_| 0.0), "{size} m at {hertz} Hz");
            assert!(Run::new().finds(0.6, ring(1.0), |_| 0.0), "{size} m at {hertz} Hz that stays");
        }
    }
}

/// Noise, drift, and errors that a set-point in motion explains; the same errors at rest are an oscillation.
#[test]
fn noise_drift_and_motion_are_explained() {
    let mut state = 1_u64;
    let mut noise = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut run = Run::new();
    for tick in 0..400_000 {
        let mut gauss = 0.0;
        for _ in 0..12 {
            gauss += noise();
        }
        // A sixth of the limit, rms, and 1 um in a second.
        run.tick(Request::None, 3, LIMIT / 6.0 * gauss + 1e-10 * f64::from(tick), 0.0, None);
    }
    assert_ne!(run.supervisor.cause, Cause::Oscillation, "noise and drift");
    // A way of 10 um in half a second that the set-point does not have: what a change of mode leaves.
    let way = |now: f64| 1e-5 * (1.0 - (-now / 0.1).exp());
    assert!(!Run::new().finds(1.0, way, |_| 0.0), "a way");
    let circle = |now: f64| 5e-6 * (TAU * 50.0 * now).sin();
    let error = |now: f64| 1e-6 * (TAU * 50.0 * now).cos();
    assert!(!Run::new().finds(1.0, error, circle), "a circle");
    assert!(Run::new().finds(1.0, error, |_| 0.0), "the same error at rest");
    assert!(Run::new().finds(1.0, |now| 8e-6 * (TAU * 361.0 * now).sin(), circle), "what is larger than the motion");
    // A correction is answered by the modes, which may ring with it.
    let mut run = Run::new();
    for tick in 0..10_000 {
        let now = f64::from(tick) / RATE;
        run.tick(Request::None, 3, 5e-7 * (TAU * 361.0 * now).sin(), 0.0, Some(1e-7));
    }
    assert_ne!(run.supervisor.cause, Cause::Oscillation, "a correction");
}

/// A leg at the end of its voltage explains what the platform lacks to a set-point that moves, and nothing at rest.
#[test]
fn a_leg_at_its_limit_is_not_counted() {
    for (limited, moves) in [(true, true), (false, true), (true, false)] {
        let mut run = Run::new();
        for _ in 0..1000 {
            let error = 1e-6 * (TAU * 200.0 * run.time()).sin();
            let target = if moves { 1e-9 * run.time() } else { 0.0 };
            run.tick(Request::None, 3, error, target, None);
            run.supervisor.seen = if limited { Cause::VoltageSaturation.bit() } else { 0 };
        }
        assert_eq!(run.stage() == Fallback::None, limited && moves);
    }
}

#[test]
fn what_is_left_of_the_gains() {
    let shares = [Fallback::None, Fallback::Reduced, Fallback::FeedForward].map(Fallback::share::<f64>);
    assert_eq!(shares, [1.0, 0.25, 0.0]);
    for stage in [Fallback::Reduced, Fallback::FeedForward] {
        let finding = Finding::Fallback(stage);
        assert_eq!(Finding::of_word(finding.word()), finding);
        assert!(finding.word() < 1 << Finding::BITS);
    }
    assert_eq!(Finding::Fallback(Fallback::FeedForward).to_string(), "feedback off");
}
