//! `src/lib.rs` of six legs: documentation of the controller and its public names.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{hysteresis, identity};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let rate_doc = hysteresis::rate_doc(ir);
    let title = identity::title(ir);
    let identity = identity::emit(ir);
    quote! {
        #![doc = #title]
        #![doc = ""]
        #![doc = " [`step`] is one control tick: pose or leg set-point and six gauge readings in, six voltages out. It is the hysteresis"]
        #![doc = " feed-forward of the paper (section 3, Fig. 5, Appendix B) on six legs, fed by the leg kinematics (1), (2), (AI.1)–(AI.4):"]
        #![doc = ""]
        #![doc = " ```text"]
        #![doc = " T = Δl(h_d)                         kinematics     pose to leg displacements"]
        #![doc = " m = Y − ρ̂X ;  δ̂, φ̂ ← m             adaptation     (AII.3), (AII.5), (AII.6)"]
        #![doc = " u = Γ⁻¹(T − δ̂ − φ̂)                  hysteresis     inverse Preisach model, (AII.2), (AII.4)"]
        #![doc = " code, ρ̂X = Γ(voltage(code))         limits         voltage, slew rate, converter; what was really requested"]
        #![doc = " ```"]
        #(#![doc = #rate_doc])*
        #![doc = ""]
        #![doc = " SI units throughout (m, rad, V, s); poses are measured from rest in the base frame {B}. No panic, no allocation, no"]
        #![doc = " `unsafe`; every voltage is finite and within limits whatever the inputs. `Config` holds what may change while running,"]
        #![doc = " `State` what the controller remembers."]
        #![doc = ""]
        #![doc = " Generated code carries no licence restriction of its own: use it as you like."]
        #![no_std]
        #![forbid(unsafe_code)]
        #![deny(missing_docs)]

        mod config;
        mod defaults;
        mod description;
        pub mod dynamics;
        pub mod hysteresis;
        pub mod integrity;
        pub mod kinematics;
        pub mod limits;
        mod machine_words;
        pub mod permitted;
        pub mod sensing;
        pub mod snapshot;
        mod stage;
        pub mod stages;
        mod standing;
        mod state;
        mod step;
        pub mod supervised;
        pub mod supervision;
        pub mod waves;
        mod words;

        pub use defaults::LEG_GAIN;
        pub use description::DESCRIPTION;
        pub use config::{Config, ConfigError, SetpointKind};
        pub use specgen_runtime::{CodeLimits, Law};
        pub use state::{LegState, State};
        pub use step::{GAUGE_FAULT, LEG_LIMITED, SETPOINT_FAULT, STATIC_INVERSE, TickInput, TickOutput, actuate, step};
        pub use words::{
            CONFIG_NAMES, CONFIG_WORDS, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words,
        };

        #identity
    }
}
