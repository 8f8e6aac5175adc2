//! How the law begins, works and stands still under the supervisor.

use specgen_runtime::linear::component;
use specgen_runtime::setpoint::{CommandKind, Generator};
use specgen_runtime::snapshot::Writer;
use specgen_runtime::supervisor::{Phase, Sample, Supervisor};
use specgen_runtime::{CodeLimits, Estimate, Integral, NotchState, Real as _, Transfer};

use super::config::{Config, Settings};
use super::constants::{Platform, TaskSpace};
use super::parts::{ModalDamping as _, RequestCorrection as _};
use super::state::{LegState, State};
use super::step::{advance, outputs, sense};
use super::tick::{TickInput, TickOutput, write_output};
use super::{sensing, triggers};
use crate::kinematics::leg_displacements;
use crate::memory::LegMemory as _;
use crate::spec::{ControlLaw, LEGS, Reset};
use crate::status::GAUGE_FAULT;
use crate::supervise::{compares, move_codes};

impl<P: Platform> ControlLaw<P> for TaskSpace {
    type Config = Config<P>;
    type Settings = Settings<P>;
    type State = State<P>;
    type Input = TickInput<P>;
    type Output = TickOutput<P>;

    fn at_reset(reset: &Reset<P>) -> State<P> {
        State::new(reset)
    }

    #[inline]
    fn code_limits(config: &Config<P>) -> CodeLimits {
        config.code_limits()
    }

    #[inline]
    fn codes(state: &State<P>) -> [i32; LEGS] {
        let [a, b, c, d, e, f] = &state.legs;
        [a.code, b.code, c.code, d.code, e.code, f.code]
    }

    #[inline]
    fn readings(input: &TickInput<P>) -> &[P::Real; 6] {
        &input.gauge
    }

    #[inline]
    fn readings_mut(input: &mut TickInput<P>) -> &mut [P::Real; 6] {
        &mut input.gauge
    }

    #[inline]
    fn faults(p: P, readings: &[P::Real; 6]) -> u32 {
        sensing::faults(p, readings)
    }

    /// Of the codes sent and the known load, m; and the set-point, m or rad.
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

    /// A mode that begins takes over what is held. After arming set-points begin at the measured pose and the estimates at zero; after
    /// a hold the last set-point and the estimates stay, and only what feeds back begins anew.
    #[cold]
    #[inline(never)]
    fn enter_running(
        p: P,
        _config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        _input: &TickInput<P>,
    ) {
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
    fn run(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
    ) -> u32 {
        advance(p, config, state, supervisor.oscillation.stage, input.command.kind, input)
    }

    #[inline]
    fn check_tracking(
        p: P,
        state: &State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
        channel: usize,
        [expected, target]: [P::Real; 2],
    ) {
        let error = target - component(&state.pose, channel);
        supervisor.look(p.supervision(), channel, &sample(p, &input.gauge, channel, expected, Some(error)));
        let given = state.correction.pose().map(|correction| component(&correction, channel));
        supervisor.follow(p.supervision(), channel, error, target, given);
    }

    #[inline]
    fn decelerate(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
    ) -> Option<u32> {
        let suspended = matches!(supervisor.phase, Phase::Holding | Phase::RampingDown);
        (suspended && state.generator.can_stop()).then(|| stop(p, config, state, supervisor, input))
    }

    /// Pose and rate are still measured.
    #[cold]
    #[inline(never)]
    fn hold(
        p: P,
        config: &Config<P>,
        state: &mut State<P>,
        supervisor: &mut Supervisor<P::Real>,
        input: &TickInput<P>,
        channel: usize,
        expected: P::Real,
    ) -> u32 {
        let legs = state.legs.iter_mut().map(|LegState { code, memory, .. }| (code, memory));
        move_codes(p, config.code_limits().max_step, supervisor, legs);
        for leg in &mut state.legs {
            leg.requested = leg.memory.displacement();
        }
        let faults = sense(p, config, state, &input.gauge);
        if faults == 0 {
            if compares(p, supervisor) {
                supervisor.look(p.supervision(), channel, &sample(p, &input.gauge, channel, expected, None));
            }
            let readings = sensing::readings(p, &input.gauge);
            supervisor.check(p.supervision(), p.readings_per_leg(), &readings, config.code_limits());
        }
        if !supervisor.phase.is_powered() {
            // What it knew of a load ends with the run: arming begins without.
            state.load = [P::Real::ZERO; LEGS];
        }
        supervisor.see(faults, 0, &input.gauge, &[0; LEGS], 1);
        faults << 8
    }

    #[inline]
    fn fire_triggers(
        _p: P,
        config: &Config<P>,
        state: &mut State<P>,
        phase: Phase,
        input: &TickInput<P>,
        status: u32,
    ) -> u32 {
        triggers::fire(config, state, phase, input, status)
    }

    #[inline]
    fn outputs(p: P, state: &State<P>, status: u32) -> TickOutput<P> {
        outputs(p, state, status)
    }

    fn read_input(p: P, words: &[u64]) -> TickInput<P> {
        TickInput::read(p, words)
    }

    fn measured(p: P, command: &[u64], gauge: &[P::Real; 6], wrench: &[P::Real; 6]) -> TickInput<P> {
        TickInput::of_command(p, command, gauge, wrench)
    }

    fn save_input(input: &TickInput<P>, words: &mut Writer<'_>) {
        input.save(words);
    }

    fn write_output(p: P, output: &TickOutput<P>, state: &State<P>, words: &mut [u64]) {
        write_output(p, output, state, words);
    }

    #[inline]
    fn codes_and_status(output: &TickOutput<P>) -> ([i32; LEGS], u32) {
        (output.dac_code, output.status)
    }
}

/// A motion that was under way when the law was to be suspended, brought to rest by it within the limits of stops. Returns
/// the status.
#[cold]
#[inline(never)]
fn stop<P: Platform>(
    p: P,
    config: &Config<P>,
    state: &mut State<P>,
    supervisor: &mut Supervisor<P::Real>,
    input: &TickInput<P>,
) -> u32 {
    let faults = advance(p, config, state, supervisor.oscillation.stage, CommandKind::Hold, input) & GAUGE_FAULT;
    supervisor.see(faults >> 8, 0, &input.gauge, &[0; LEGS], 1);
    faults
}

#[inline]
fn sample<P: Platform>(
    p: P,
    gauge: &[P::Real; 6],
    channel: usize,
    expected: P::Real,
    error: Option<P::Real>,
) -> Sample<P::Real> {
    let reading = component(&sensing::readings(p, gauge), channel);
    Sample { word: component(gauge, channel), reading, expected, error }
}
