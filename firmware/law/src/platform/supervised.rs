//! The law under the supervisor: start, run and hold.

use specgen_runtime::linear::{component, each, is_within};
use specgen_runtime::setpoint::{CommandKind, Generator, REFUSED};
use specgen_runtime::supervisor::{Fallback, Phase};
use specgen_runtime::{Estimate, Integral, ModalDamping as _, NotchState, Real as _, RequestCorrection as _, Transfer};

use super::config::Settings;
use super::constants::{Platform, TaskSpace};
use super::state::{LegState, State};
use super::step::{advance, sense};
use super::tick::{TickInput, write_output};
use super::{sensing, triggers};
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{Config, ControlLaw, LEGS, Machine, Reset, TickOutput};
use crate::status::GAUGE_FAULT;

/// Part of the workspace in which an open drive goes on.
const NEAR_END: f64 = 31.0 / 32.0;
/// Time for which the platform goes on at its speed after the codes stop, s: lag, two ticks, and 1/ω of the lowest mode.
const COASTING: f64 = 2e-3;

impl<P: Platform> ControlLaw<P> for TaskSpace {
    type Settings = Settings<P>;
    type State = State<P>;
    type Input = TickInput<P>;

    fn at_reset(reset: &Reset<P>) -> State<P> {
        State::new(reset)
    }

    #[inline]
    fn codes(state: &State<P>) -> [i32; LEGS] {
        let [a, b, c, d, e, f] = &state.legs;
        [a.code, b.code, c.code, d.code, e.code, f.code]
    }

    #[inline]
    fn drives(state: &mut State<P>) -> impl Iterator<Item = (&mut i32, &mut P::Memory)> {
        state.legs.iter_mut().map(|LegState { code, memory, .. }| (code, memory))
    }

    #[inline]
    fn readings(p: P, words: &[P::Real; 6]) -> [P::Real; 6] {
        sensing::readings(p, words)
    }

    fn words_per_leg(p: P, words: &[P::Real; 6]) -> [[P::Real; 6]; 6] {
        sensing::words_per_leg(p, words)
    }

    /// From the codes sent and the known load, m; and the set-point, m or rad.
    #[inline]
    fn expected_reading(p: P, state: &State<P>, channel: usize) -> (P::Real, P::Real) {
        let Some([a, b, c, d, e, f]) = p.readings_per_leg().get(channel) else {
            return (P::Real::ZERO, P::Real::ZERO);
        };
        let legs = &state.legs;
        let load = &state.load;
        let displaced = |leg: usize| legs[leg].memory.displacement() - load[leg];
        let half = *a * displaced(0) + *b * displaced(1) + *c * displaced(2);
        let expected = half + *d * displaced(3) + *e * displaced(4) + *f * displaced(5);
        (expected, component(&state.generator.target().pose, channel))
    }

    #[inline]
    fn reached(state: &State<P>, channel: usize, _reading: P::Real) -> (P::Real, Option<P::Real>) {
        let correction = state.correction.pose().map(|correction| component(&correction, channel));
        (component(&state.pose, channel), correction)
    }

    #[inline]
    fn advance(p: P, config: &Config<P>, state: &mut State<P>, fallback: Fallback, input: &TickInput<P>) -> u32 {
        advance(p, config, state, fallback, input.command.kind, input)
    }

    /// A bumpless start. After arming, set-points begin at the measured pose and the estimates at zero. After a hold,
    /// the last set-point and the estimates stay, and only the feedback is reset.
    #[cold]
    #[inline(never)]
    fn enter_running(p: P, _config: &Config<P>, machine: &mut Machine<P>, _input: &TickInput<P>) {
        let Machine { state, supervisor } = machine;
        if supervisor.fresh {
            state.generator = Generator::starting_at(p.setpoints(), &state.pose);
            state.demand = leg_displacements(p, &state.generator.target().pose);
            state.load = [P::Real::ZERO; LEGS];
            state.estimates = [Estimate::new(); 6];
        } else {
            state.generator.stand_still();
        }
        supervisor.fresh = false;
        state.mode = None;
        state.integral = Integral::new();
        state.error_notch = NotchState::new();
        state.innovation_notch = NotchState::new();
        state.damping.rest();
        state.correction.rest();
        state.error = [P::Real::ZERO; 6];
        state.deflection = [P::Real::ZERO; 6];
        state.transfer = Transfer::new();
        state.limited = false;
        for leg in &mut state.legs {
            leg.excess = P::Real::ZERO;
        }
    }

    #[inline]
    fn decelerate(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) -> Option<u32> {
        // After arming or an open drive the set-point is not that of the codes.
        let suspended = matches!(machine.supervisor.phase, Phase::Holding | Phase::RampingDown);
        (suspended && !machine.supervisor.fresh && machine.state.generator.can_stop())
            .then(|| stop(p, config, machine, input))
    }

    #[cold]
    #[inline(never)]
    fn voltages(input: &TickInput<P>) -> Result<&[P::Real; LEGS], u32> {
        let voltages = &input.command.target.pose;
        match input.command.kind {
            CommandKind::Drive if voltages.iter().all(|voltage| voltage.is_finite()) => Ok(voltages),
            CommandKind::Hold => Err(0),
            _ => Err(REFUSED),
        }
    }

    #[cold]
    #[inline(never)]
    fn may_drive(p: P, state: &State<P>) -> bool {
        !state.generator.can_stop() && !Self::is_near_end(p, state, &state.pose)
    }

    #[inline]
    fn pose(state: &State<P>) -> [P::Real; 6] {
        state.pose
    }

    #[cold]
    #[inline(never)]
    fn is_near_end(p: P, state: &State<P>, before: &[P::Real; 6]) -> bool {
        let bound = p.pose_bound().map(|bound| bound * P::Real::from_f64(NEAR_END));
        let ticks = p.setpoints().rate * P::Real::from_f64(COASTING);
        !is_within(&each(|axis| state.pose[axis] + (state.pose[axis] - before[axis]) * ticks), &bound)
    }

    /// Pose and rate are still measured.
    fn hold(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) -> u32 {
        let Machine { state, supervisor } = machine;
        for leg in &mut state.legs {
            leg.requested = leg.memory.displacement();
        }
        if !supervisor.phase.is_powered() {
            // The known load ends with the run: arming begins without one.
            state.load = [P::Real::ZERO; LEGS];
        }
        sense(p, config, state, &input.gauge)
    }

    #[inline]
    fn fire_triggers(config: &Config<P>, state: &mut State<P>, phase: Phase, input: &TickInput<P>, status: u32) -> u32 {
        triggers::fire(config, state, phase, input, status)
    }

    fn shown(state: &State<P>) -> Option<[[P::Real; 6]; 2]> {
        Some([state.generator.target().pose, state.pose])
    }

    fn write_output(p: P, output: &TickOutput<P>, state: &State<P>, words: &mut [u64]) {
        write_output(p, output, state, words);
    }
}

/// Stops a motion that was under way when the law is to be suspended, within the stop limits. Returns the status.
#[cold]
#[inline(never)]
fn stop<P: Platform>(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &TickInput<P>) -> u32 {
    let Machine { state, supervisor } = machine;
    let faults = advance(p, config, state, supervisor.oscillation.stage, CommandKind::Hold, input) & GAUGE_FAULT;
    supervisor.see(faults >> 8, 0, &input.gauge, &[0; LEGS], 1);
    faults
}
