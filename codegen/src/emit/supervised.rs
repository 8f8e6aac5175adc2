//! `src/supervised.rs`: the tick that every target calls, the control law under its supervisor.

use proc_macro2::TokenStream;
use quote::quote;

use crate::ir::Ir;

pub fn emit(_ir: &Ir) -> TokenStream {
    quote! {
        #![doc = " The control law under its supervisor: what every target calls."]

        pub use specgen_runtime::supervisor::{CONVERTER, Cause, INTEGRITY, LINK_LOST, MISSED_TICK, Phase, Request, STOP};
        use specgen_runtime::{Digest, supervisor};

        pub use crate::machine_words::{
            MACHINE_INPUT_NAMES, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_NAMES, MACHINE_OUTPUT_WORDS, machine_output_words,
        };
        use crate::{Config, Real, State, TickInput, TickOutput, step};

        /// State of the supervisor in this controller's arithmetic.
        pub type Supervisor = supervisor::Supervisor<Real>;

        /// Everything that is remembered from tick to tick. No NaN or infinity is ever stored here.
        #[derive(Debug, Clone, Copy)]
        pub struct Machine {
            /// State of the control law.
            pub state: State,
            /// Phase, cause and what the supervisor watches.
            pub supervisor: Supervisor,
        }

        impl Default for Machine {
            fn default() -> Self {
                Self::new()
            }
        }

        impl Machine {
            /// Reset: disarmed, and [`State::new`].
            #[must_use]
            pub const fn new() -> Self {
                Self { state: State::new(), supervisor: Supervisor::new() }
            }

            /// Fingerprint of everything that later ticks depend on.
            #[must_use]
            pub fn digest(&self) -> u64 {
                let mut digest = Digest::new();
                digest.word(self.state.digest());
                self.supervisor.digest(&mut digest);
                digest.finish()
            }
        }

        /// What a tick reads.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct MachineInput {
            /// Command and readings, as the control law takes them.
            pub tick: TickInput,
            /// What is wanted of the supervisor; it holds for as long as it is given.
            pub request: Request,
            /// What the target noticed since the last tick: [`MISSED_TICK`], [`LINK_LOST`], [`INTEGRITY`], [`CONVERTER`], [`STOP`].
            pub events: u32,
        }

        /// What a tick yields. Every number is finite.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct MachineOutput {
            /// Codes and voltages that go out, and the status of the control law where it ran.
            pub tick: TickOutput,
            /// What the machine does over the coming interval.
            pub phase: Phase,
            /// Why, if it was forced upon it.
            pub cause: Cause,
            /// Whether the amplifiers are to be on over the coming interval.
            pub amplifier_on: bool,
        }

        /// One supervised tick.
        pub fn supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
            let Machine { state, supervisor } = machine;
            supervisor.phase = match input.request {
                Request::Arm | Request::Run => Phase::Running,
                Request::RampDown => Phase::Disarmed,
                _ => supervisor.phase,
            };
            supervisor.request = input.request;
            let mut tick = step(config, state, &input.tick);
            let amplifier_on = supervisor.phase == Phase::Running;
            if !amplifier_on {
                *state = State::new();
                tick.dac_code = [crate::limits::CODES[0]; crate::LEGS];
                tick.voltage = [crate::limits::DAC.voltage(crate::limits::CODES[0]); crate::LEGS];
            }
            MachineOutput { tick, phase: supervisor.phase, cause: supervisor.cause, amplifier_on }
        }
    }
}
