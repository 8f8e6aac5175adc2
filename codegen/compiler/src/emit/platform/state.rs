//! `src/state.rs` of a platform: what the controller remembers. The same for every spec; sizes come from the other files.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::rest::{self, AtRest};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let leg = |AtRest { memory, displacement, code }: AtRest| {
        quote! { LegState { memory: #memory, requested: #displacement, excess: 0.0, code: #code } }
    };
    let (leg, legs) = match rest::emit(ir) {
        Err(alike) => {
            let leg = leg(alike);
            (quote! { let leg = #leg; }, quote! { [leg; LEGS] })
        }
        Ok(each) => {
            let legs = each.map(leg);
            (quote! {}, quote! { [#(#legs),*] })
        }
    };
    let reset_doc = rest::doc(ir);
    let limits = ir.supervision.risen.is_none().then(|| quote! { , limits });
    quote! {
        #![doc = " What the controller remembers from tick to tick. No NaN or infinity is ever stored here."]

        use specgen_runtime::setpoint::Generator;
        use specgen_runtime::{ControlMode, Digest, Estimate, Integral, Interaction, NotchState, Rate, Transfer};

        use crate::config::Environment;
        use crate::hysteresis::Memory;
        use crate::{LEGS, Real #limits};

        /// State of one leg.
        #[derive(Debug, Clone, Copy)]
        pub struct LegState {
            /// Reversal memory of the drive that was really applied.
            pub memory: Memory,
            /// q̂ = ρ̂X: displacement really requested by the code held, in the model of the mode it was asked in, m.
            pub requested: Real,
            /// Part of the last request that a limit withheld, m; zero for a leg that was free.
            pub excess: Real,
            /// Converter code now held at the output.
            pub code: i32,
        }

        /// State of the controller.
        #[derive(Debug, Clone, Copy)]
        pub struct State {
            /// Legs 0 to 5.
            pub legs: [LegState; LEGS],
            /// h: pose from rest, from the last gauge readings that were believed, m and rad.
            pub pose: [Real; 6],
            /// ḣ: its filtered derivative.
            pub rate: Rate<Real>,
            /// Where set-points come from; its target is h_d at the end of the interval now running.
            pub generator: Generator<Real>,
            /// N(h_d − h), the pose error behind the notch, m and rad.
            pub error: [Real; 6],
            /// Notch on the pose error.
            pub error_notch: NotchState<Real>,
            /// Notch on the innovation.
            pub innovation_notch: NotchState<Real>,
            /// k_I ∫e.
            pub integral: Integral<Real>,
            /// δ̂ and φ̂ of each mode.
            pub estimates: [Estimate<Real>; 6],
            /// K⁻¹F in modal coordinates: what the feedback takes the platform to deflect by, over the interval now running.
            pub deflection: [Real; 6],
            /// Δl(h_d) of the interval now running, m.
            pub demand: [Real; LEGS],
            /// p: deflection of each leg under the known load of the interval now running, m.
            pub load: [Real; LEGS],
            /// Some leg was held back by a limit in the last tick.
            pub limited: bool,
            /// Interaction wrench last believed, N and N m.
            pub wrench: [Real; 6],
            /// What is left of the last change of mode.
            pub transfer: Transfer<Real>,
            /// Mode of the last tick; none before the first.
            pub mode: Option<ControlMode>,
            /// Where the last tick took the interaction force from.
            pub interaction: Interaction,
            /// Its model of the environment.
            pub environment: Environment,
        }

        impl Default for State {
            fn default() -> Self {
                Self::new()
            }
        }

        impl State {
            #[doc = #reset_doc]
            #[must_use]
            pub const fn new() -> Self {
                #leg
                Self {
                    legs: #legs,
                    pose: [0.0; 6],
                    rate: Rate::new(),
                    generator: Generator::new(),
                    error: [0.0; 6],
                    error_notch: NotchState::new(),
                    innovation_notch: NotchState::new(),
                    integral: Integral::new(),
                    estimates: [Estimate::new(); 6],
                    deflection: [0.0; 6],
                    demand: [0.0; LEGS],
                    load: [0.0; LEGS],
                    limited: false,
                    wrench: [0.0; 6],
                    transfer: Transfer::new(),
                    mode: None,
                    interaction: Interaction::Neglected,
                    environment: Environment { stiffness: [0.0; 6], rest: [0.0; 6] },
                }
            }

            /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
            #[must_use]
            pub fn digest(&self) -> u64 {
                let mut digest = Digest::new();
                for leg in &self.legs {
                    leg.memory.digest(&mut digest);
                    digest.real(leg.requested);
                    digest.real(leg.excess);
                    digest.word(leg.code as u32 as u64);
                }
                for estimate in &self.estimates {
                    estimate.digest(&mut digest);
                }
                let Environment { stiffness, rest } = &self.environment;
                let vectors =
                    [&self.pose, &self.error, &self.deflection, &self.demand, &self.load, &self.wrench, stiffness, rest];
                for vector in vectors {
                    for value in vector {
                        digest.real(*value);
                    }
                }
                self.rate.digest(&mut digest);
                self.generator.digest(&mut digest);
                self.error_notch.digest(&mut digest);
                self.innovation_notch.digest(&mut digest);
                self.integral.digest(&mut digest);
                self.transfer.digest(&mut digest);
                digest.word(self.limited as u64);
                digest.word(match self.mode {
                    None => 0,
                    Some(mode) => 1 + mode.word(),
                });
                digest.word(self.interaction.word());
                digest.finish()
            }
        }
    }
}
