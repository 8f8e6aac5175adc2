//! What `src/supervised.rs` has of a platform: how the law begins, works and stands still.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::supervised;

pub fn emit() -> TokenStream {
    let imports = quote! {
        use specgen_runtime::linear::each;
        use specgen_runtime::setpoint::Generator;
        use specgen_runtime::{Estimate, Integral, NotchState, Real as _, Transfer};

        use crate::setpoint::PLAN as SETPOINTS;
        use crate::step::{GAUGE_FAULT, LEG_LIMITED, sense};
        use crate::supervision::READINGS_PER_LEG;
        use crate::{kinematics, sensing};
    };
    let parts = quote! {
        /// Puts the law where the machine is. No leg moves in the first tick: a mode that begins takes over what is held.
        ///
        /// After arming set-points begin at the measured pose and the estimates at zero; after a hold the last set-point and the
        /// estimates stay, and only what feeds back begins anew.
        #[cold]
        #[inline(never)]
        fn begin(_config: &Config, state: &mut State, supervisor: &mut Supervisor, _input: &TickInput) {
            if supervisor.fresh {
                state.generator = Generator::starting_at(&SETPOINTS, &state.pose);
                state.demand = kinematics::leg_displacements(&state.generator.target().pose);
                state.load = [0.0; LEGS];
                state.estimates = [Estimate::new(); 6];
            } else {
                state.generator.stand_still();
            }
            supervisor.fresh = false;
            state.mode = None;
            state.integral = Integral::new();
            state.error_notch = NotchState::new();
            state.innovation_notch = NotchState::new();
            state.error = [0.0; 6];
            state.deflection = [0.0; 6];
            state.transfer = Transfer::new();
            state.limited = false;
            for leg in &mut state.legs {
                leg.excess = 0.0;
            }
        }

        /// The control law, watched.
        #[inline]
        fn work(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> TickOutput {
            let channel = supervisor.watch.take_turn();
            let expected = expected(state, channel);
            let target = component(&state.generator.target().pose, channel);
            let before = codes(state);
            let output = step(config, state, input);
            let faults = output.status & GAUGE_FAULT;
            let limited = output.status & LEG_LIMITED;
            if faults == 0 {
                let error = target - component(&state.pose, channel);
                supervisor.look(&PLAN, channel, &sample(&input.gauge, channel, expected, Some(error)));
            }
            if faults | limited == 0 {
                supervisor.seen = 0;
            } else {
                let step = config.code_limits().max_step;
                supervisor.see(faults >> 8, limited, &input.gauge, &moved(state, &before), step);
            }
            output
        }

        /// Codes held or on their way to rest, the law suspended; pose and rate are still measured.
        #[cold]
        #[inline(never)]
        fn stand(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> TickOutput {
            let channel = supervisor.watch.take_turn();
            let expected = expected(state, channel);
            move_codes(config, state, supervisor);
            for leg in &mut state.legs {
                leg.requested = leg.memory.displacement();
            }
            let faults = sense(config, state, &input.gauge);
            if faults == 0 && compares(supervisor.phase) {
                supervisor.look(&PLAN, channel, &sample(&input.gauge, channel, expected, None));
            }
            supervisor.see(faults, 0, &input.gauge, &[0; LEGS], 1);
            let legs = &state.legs;
            TickOutput {
                voltage: each(|leg| DAC.voltage(legs[leg].code)),
                dac_code: each(|leg| legs[leg].code),
                status: faults << 8,
            }
        }

        /// What a gauge ought to read by the codes sent over the interval that has ended and the known load, m.
        #[inline]
        fn expected(state: &State, channel: usize) -> Real {
            let Some([a, b, c, d, e, f]) = READINGS_PER_LEG.get(channel) else { return 0.0 };
            let legs = &state.legs;
            let load = &state.load;
            let displaced = |leg: usize| legs[leg].memory.displacement() - load[leg];
            *a * displaced(0) + *b * displaced(1) + *c * displaced(2) + *d * displaced(3) + *e * displaced(4) + *f * displaced(5)
        }

        #[inline]
        fn sample(gauge: &[Real; 6], channel: usize, expected: Real, error: Option<Real>) -> Sample<Real> {
            Sample { word: component(gauge, channel), reading: component(&sensing::readings(gauge), channel), expected, error }
        }

        #[inline]
        fn component(vector: &[Real; 6], index: usize) -> Real {
            match vector.get(index) {
                Some(value) => *value,
                None => Real::ZERO,
            }
        }
    };
    supervised::emit(&imports, &parts)
}
