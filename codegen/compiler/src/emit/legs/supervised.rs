//! What `src/supervised.rs` has of six legs: how the law begins, works and stands still.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::supervised::{self, Parts};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let imports = quote! {
        use specgen_runtime::{Estimate, Law, Real as _};

        use crate::limits::{gauge_is_accepted, leg_setpoint_is_accepted};
        use crate::supervision::{APPROACH_KEEP, APPROACH_NEGLIGIBLE};
        use crate::{SetpointKind, kinematics};
    };
    let no_lead = ir.hysteresis.lead.as_ref().map(|_| quote! { leg.lead = 0.0; });
    let no_leads = ir.hysteresis.lead.as_ref().map(|_| {
        quote! {
            for leg in &mut state.legs {
                leg.lead = 0.0;
            }
        }
    });
    let functions = quote! {
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

        /// The tick with the set-point that the law is given on its way to the one that is asked for.
        #[cold]
        #[inline(never)]
        fn approaching(config: &Config, supervisor: &mut Supervisor, input: &TickInput) -> TickInput {
            let accepted = match config.setpoint() {
                SetpointKind::Pose => kinematics::pose_is_accepted(&input.setpoint),
                SetpointKind::Leg => leg_setpoint_is_accepted(&input.setpoint),
            };
            let setpoint =
                supervisor.approach.setpoint(&input.setpoint, accepted, APPROACH_KEEP, APPROACH_NEGLIGIBLE);
            TickInput { setpoint, displacement: input.displacement }
        }

        /// The leg whose turn it is, after the law has seen the readings.
        #[inline]
        fn look(
            _state: &State,
            supervisor: &mut Supervisor,
            input: &TickInput,
            channel: usize,
            expected: Real,
            target: Real,
        ) {
            let reading = component(&input.displacement, channel);
            let error = Some(target - reading);
            supervisor.look(&SUPERVISION, channel, &Sample { word: reading, reading, expected, error });
        }

        /// Codes held or on their way to rest, the law suspended. Returns the status.
        #[cold]
        #[inline(never)]
        fn stand(
            config: &Config,
            state: &mut State,
            supervisor: &mut Supervisor,
            input: &TickInput,
            channel: usize,
            expected: Real,
        ) -> u32 {
            move_codes(config, state, supervisor);
            let mut faults = 0;
            for (index, reading) in input.displacement.iter().enumerate() {
                faults |= (!gauge_is_accepted(*reading) as u32) << index;
            }
            #no_leads
            if faults == 0 && compares(supervisor.phase) {
                let reading = component(&input.displacement, channel);
                supervisor.look(&SUPERVISION, channel, &Sample { word: reading, reading, expected, error: None });
            }
            supervisor.see(faults, 0, &input.displacement, &[0; LEGS], 1);
            faults << 8
        }

        /// What a leg ought to show by the code sent over the interval that has ended, and the demand on it, m.
        #[inline]
        fn expectation(state: &State, channel: usize) -> (Real, Real) {
            match state.legs.get(channel) {
                Some(leg) => (leg.memory.displacement(), component(&state.demand, channel)),
                None => (0.0, 0.0),
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
    supervised::emit(&Parts {
        imports,
        functions,
        // Legs have no rate that would have to be brought to rest.
        stops: TokenStream::new(),
        law: quote! {
            let approached;
            let given = if supervisor.approach.is_done() {
                input
            } else {
                approached = approaching(config, supervisor, input);
                &approached
            };
            let status = advance(config, state, given);
        },
        gauges: quote! { displacement },
    })
}
