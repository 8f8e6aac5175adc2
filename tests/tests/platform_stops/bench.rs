//! A machine of its own hysteresis under its controller, and a stream that runs dry on it.

use host_sim::controller::TickController;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Bench as Rig, Command, Request, Tick};
use host_sim::platform::{PlatformParameters, Specimen};
use host_sim::trajectory::PoseTarget;
use specgen_tests::worse;

use crate::platform_tables::bench::{BIAS, Bench, PERIOD};

const LEG_LIMITED: u32 = 0x3f;
const STALE: u32 = 1 << 17;
const BUSY: u32 = 1 << 18;
/// From a turn to the way that it moves a gauge's target, m: counts a turn of 10 µrad as 1 µm.
const LEVER: f64 = 0.1;
/// Where the streams pass, above the bias: all legs have room on both sides.
const MIDDLE: [f64; 6] = [0.0, 0.0, 15e-6, 0.0, 0.0, 0.0];
/// Ticks of the way from rest to the speed of a stream, and of the longest way at that speed.
const RISE: usize = 20;
const CRUISE: usize = 300;
/// Longest way at that speed, m or 0.1 rad.
const LONGEST: f64 = 8e-6;

/// A machine with its controller.
pub struct Machine {
    pub name: String,
    bench: Bench,
}

/// A leg of the reference's file, changed.
fn leg(change: impl FnOnce(&mut LegParameters)) -> LegParameters {
    let mut leg = LegParameters::reference();
    change(&mut leg);
    leg
}

/// The first `count` of: the reference machine, legs of other hysteresis on the reference platform, random machines.
pub fn machines(count: usize) -> Vec<Machine> {
    #[allow(clippy::type_complexity)] // A table of four.
    let kinds: [(&str, fn() -> Specimen); 4] = [
        ("reference", Specimen::reference),
        // Thresholds that widen by a third at 5 mm/s.
        ("rate-dependent", || built_of(|leg| leg.kappa = 0.05)),
        ("creeping", || built_of(|leg| leg.creep_weights.iter_mut().for_each(|weight| *weight *= 3.0))),
        ("plays alone", || {
            built_of(|leg| {
                leg.kappa = 0.0;
                leg.s2 = 0.0;
                leg.creep_weights.iter_mut().for_each(|weight| *weight = 0.0);
            })
        }),
    ];
    let kinds = kinds.map(|(name, specimen)| (name.to_owned(), specimen()));
    let random = (0..12).map(|number| (format!("random-{number}"), oracle::random::machine(1, number)));
    kinds
        .into_iter()
        .chain(random)
        .take(count)
        .map(|(name, specimen)| Machine {
            bench: Bench::new(&format!("stops-{}", name.replace(' ', "-")), specimen, &[]),
            name,
        })
        .collect()
}

fn built_of(change: impl FnOnce(&mut LegParameters)) -> Specimen {
    Specimen::within_tolerances(&PlatformParameters::reference(), &leg(change), 1)
}

/// What the compiler states of streams at their largest speed: way of the target in a stop, and by how much the platform may
/// go beyond it, m.
pub struct StatedLimits {
    pub way: f64,
    pub overshoot: f64,
}

impl Machine {
    pub fn stated(&self) -> StatedLimits {
        let stream = &self.bench.emitted.compiled.stops[0];
        assert_eq!(stream.what, "stream");
        let most = |of: &[f64; 6]| (0..6).map(|axis| of[axis] * lever(axis)).fold(0.0, worse);
        StatedLimits { way: most(&stream.way), overshoot: most(&stream.overshoot) }
    }

    /// With the platform at rest at the bias.
    pub fn run(&self, each: impl FnOnce(&mut Run)) {
        let mut scenario = self.bench.scenario();
        let mut controller = self.bench.controller();
        let speed = self.bench.emitted.compiled.model.task_space.as_ref().expect("in task space").setpoint.stream_speed;
        controller.reset();
        let mut rig = Rig::new(scenario.rig_mut(), &mut controller, PERIOD, 0).expect("the words of a platform");
        rig.arm(10.0).expect("the bias pose");
        each(&mut Run { rig, speed });
    }
}

fn lever(axis: usize) -> f64 {
    if axis < 3 { 1.0 } else { LEVER }
}

/// A platform under its controller.
pub struct Run<'a> {
    rig: Rig<'a>,
    speed: [f64; 6],
}

/// What became of a stream that ran dry. Lengths in m, turns times 0.1 m.
#[derive(Debug, Clone, Copy)]
pub struct StopRun {
    pub axis: usize,
    /// Speed over the largest one of streams, with its sign.
    pub share: f64,
    /// Bits of limited legs.
    pub status: u32,
    /// From the last set-point until the target stands, s.
    pub time: f64,
    /// How far the target and the platform went on from where the target was when the stream counted as stale.
    pub target: f64,
    pub pose: f64,
    /// Distance of the platform from its target: at most from the last set-point on, and 15 ms and 50 ms after it.
    pub worst: f64,
    pub at_15ms: f64,
    pub at_50ms: f64,
}

impl Run<'_> {
    fn tick(&mut self, request: &Request) -> Tick {
        self.rig.tick(request).unwrap_or_else(|error| panic!("{error:?}"))
    }

    /// A stream along `axis` that rises smoothly to `share` of the largest speed, goes on for a while and brings nothing more.
    pub fn run_dry(&mut self, axis: usize, share: f64) -> StopRun {
        let speed = share * self.speed[axis];
        let cruise = ((LONGEST / lever(axis) / speed.abs() / PERIOD) as usize).min(CRUISE);
        let way = speed * PERIOD * (0.5 * RISE as f64 + cruise as f64 + 16.0);
        let mut start = MIDDLE;
        start[axis] -= 0.5 * way;
        self.go_to(start);
        let mut ran = StopRun {
            axis,
            share,
            status: 0,
            time: 0.0,
            target: 0.0,
            pose: 0.0,
            worst: 0.0,
            at_15ms: 0.0,
            at_50ms: 0.0,
        };
        let mut last = Request::default();
        for tick in 1..=RISE + cruise {
            last = Request::stream(rising(&start, axis, speed, tick));
            let tick = self.tick(&last);
            assert_eq!(tick.status & !LEG_LIMITED, 0, "{ran:?}: {:x}", tick.status);
            ran.status |= tick.status & LEG_LIMITED;
        }
        last.fresh = false;
        let mut stale = None;
        for after in 1..=500 {
            let tick = self.tick(&last);
            ran.status |= tick.status & LEG_LIMITED;
            let along = |pose: &[f64; 6], from: f64| (pose[axis] - from) * share.signum() * lever(axis);
            let off = (0..6).map(|k| ((tick.pose[k] - tick.target[k]) * lever(k)).powi(2)).sum::<f64>().sqrt();
            if tick.status & STALE == 0 {
                stale = Some(tick.target[axis]);
            } else if let Some(from) = stale {
                ran.target = worse(ran.target, along(&tick.target, from));
                ran.pose = worse(ran.pose, along(&tick.pose, from));
            }
            if tick.status & STALE == 0 || tick.status & BUSY != 0 {
                ran.time = (after + 1) as f64 * PERIOD;
            }
            ran.worst = worse(ran.worst, off);
            match after {
                150 => ran.at_15ms = off,
                500 => ran.at_50ms = off,
                _ => {}
            }
        }
        ran
    }

    /// A move, and rest until the estimates have settled.
    fn go_to(&mut self, user: [f64; 6]) {
        let goal = PoseTarget { pose: user, ..PoseTarget::default() };
        let request = Request { command: Command::Move, target: goal, ..Request::default() };
        for _ in 0..20_000 {
            let tick = self.tick(&request);
            if tick.status & BUSY == 0 {
                assert_eq!(tick.target, std::array::from_fn(|k| user[k] + BIAS[k]));
                for _ in 0..500 {
                    self.tick(&request);
                }
                return;
            }
        }
        panic!("the move does not end");
    }
}

/// The set-point `tick` ticks after a rest at `start`.
fn rising(start: &[f64; 6], axis: usize, speed: f64, tick: usize) -> PoseTarget {
    let mut target = PoseTarget { pose: *start, ..PoseTarget::default() };
    let (rise, since) = (RISE as f64 * PERIOD, tick as f64 * PERIOD);
    if tick < RISE {
        let s = since / rise;
        target.pose[axis] += speed * rise * (s * s * s - 0.5 * s * s * s * s);
        target.rate[axis] = speed * s * s * (3.0 - 2.0 * s);
        target.acceleration[axis] = 6.0 * speed / rise * s * (1.0 - s);
    } else {
        target.pose[axis] += speed * (since - 0.5 * rise);
        target.rate[axis] = speed;
    }
    target
}
