//! What `src/supervised.rs` has of six legs: how the law begins, works and stands still.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::supervised;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let imports = quote! {
        use specgen_runtime::{Estimate, Law, Real as _};

        use crate::limits::{gauge_is_accepted, leg_setpoint_is_accepted};
        use crate::step::{GAUGE_FAULT, LEG_LIMITED};
        use crate::supervision::{APPROACH_KEEP, APPROACH_NEGLIGIBLE};
        use crate::{SetpointKind, kinematics};
    };
    let no_lead = ir.hysteresis.lead.as_ref().map(|_| quote! { leg.lead = 0.0; });
    let parts = quote! {
        /// Puts the law where the machine is: the demand on a leg is where its gauge shows it, and its level estimate is what the
        /// model lacks to that, so that the code held stays what the law asks for. Without adaptation, or where the gauge is not
        /// believed, the demand is where the model has the leg. From there the demand goes to the set-point that is given.
        #[cold]
        #[inline(never)]
        fn begin(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) {
            let State { legs, demand, ticks_in_run } = state;
            *ticks_in_run = 0;
            for ((leg, demand), reading) in legs.iter_mut().zip(demand.iter_mut()).zip(&input.displacement) {
                let modelled = leg.memory.displacement();
                let adapts = config.law() != Law::Invhys && gauge_is_accepted(*reading);
                *demand = if adapts { *reading } else { modelled };
                leg.estimate = Estimate { level: *demand - modelled, drift: 0.0 };
                #no_lead
            }
            supervisor.fresh = false;
            supervisor.approach.begin(match config.setpoint() {
                SetpointKind::Pose => kinematics::pose_from_legs(demand),
                SetpointKind::Leg => *demand,
            });
        }

        /// The control law, watched.
        #[inline]
        fn work(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> TickOutput {
            let channel = supervisor.watch.take_turn();
            let expected = expected(state, channel);
            let target = component(&state.demand, channel);
            let before = codes(state);
            let accepted = match config.setpoint() {
                SetpointKind::Pose => kinematics::pose_is_accepted(&input.setpoint),
                SetpointKind::Leg => leg_setpoint_is_accepted(&input.setpoint),
            };
            let setpoint =
                supervisor.approach.setpoint(&input.setpoint, accepted, APPROACH_KEEP, APPROACH_NEGLIGIBLE);
            let output = step(config, state, &TickInput { setpoint, displacement: input.displacement });
            let faults = output.status & GAUGE_FAULT;
            let limited = output.status & LEG_LIMITED;
            if faults == 0 {
                let reading = component(&input.displacement, channel);
                let error = Some(target - reading);
                supervisor.look(&PLAN, channel, &Sample { word: reading, reading, expected, error });
            }
            if faults | limited == 0 {
                supervisor.seen = 0;
            } else {
                let step = config.code_limits().max_step;
                supervisor.see(faults >> 8, limited, &input.displacement, &moved(state, &before), step);
            }
            output
        }

        /// Codes held or on their way to rest, the law suspended.
        #[cold]
        #[inline(never)]
        fn stand(config: &Config, state: &mut State, supervisor: &mut Supervisor, input: &TickInput) -> TickOutput {
            let channel = supervisor.watch.take_turn();
            let expected = expected(state, channel);
            move_codes(config, state, supervisor);
            let mut output = TickOutput {
                voltage: [0.0; LEGS],
                requested: [0.0; LEGS],
                demand: state.demand,
                level: [0.0; LEGS],
                drift: [0.0; LEGS],
                dac_code: codes(state),
                status: 0,
            };
            let mut faults = 0;
            for (index, leg) in state.legs.iter().enumerate() {
                faults |= (!gauge_is_accepted(input.displacement[index]) as u32) << index;
                output.voltage[index] = DAC.voltage(leg.code);
                output.requested[index] = leg.memory.displacement();
                output.level[index] = leg.estimate.level;
                output.drift[index] = leg.estimate.drift;
            }
            output.status = faults << 8;
            if faults == 0 && compares(supervisor.phase) {
                let reading = component(&input.displacement, channel);
                supervisor.look(&PLAN, channel, &Sample { word: reading, reading, expected, error: None });
            }
            supervisor.see(faults, 0, &input.displacement, &[0; LEGS], 1);
            output
        }

        /// What a leg ought to show by the code sent over the interval that has ended, m.
        #[inline]
        fn expected(state: &State, channel: usize) -> Real {
            match state.legs.get(channel) {
                Some(leg) => leg.memory.displacement(),
                None => Real::ZERO,
            }
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
