//! `src/lib.rs` of a platform: documentation of the controller and its public names.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{hysteresis, identity};
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let title = identity::title(ir);
    let identity = identity::emit(ir);
    let rate_doc = hysteresis::rate_doc(ir);
    quote! {
        #![doc = #title]
        #![doc = ""]
        #![doc = " [`step`] is one control tick: a command and six gauge readings in, six voltages out. It is the control law of the paper's"]
        #![doc = " section 4 in task space, (7), over the hysteresis feed-forward of section 3 (Fig. 5, Appendix B):"]
        #![doc = ""]
        #![doc = " ```text"]
        #![doc = " gauges → h                          sensing        six gauges see the platform"]
        #![doc = " h_d, ḣ_d, ḧ_d                       setpoint       stream, move, trajectory; frames, bias"]
        #![doc = " Δl, J⁻ᵀ(M ḧ_d + C ḣ_d + G)          dynamics       computed torque, Appendix A corrected"]
        #![doc = " k_p e + k_I ∫e, notch               task_space     position feedback (7) behind the modal notch"]
        #![doc = " δ̂, φ̂ ;  u = Γ⁻¹(q)                  hysteresis     run-to-run adaptation and inverse Preisach model"]
        #![doc = " code, q̂                             limits         voltage, slew rate, converter; what was really requested"]
        #![doc = " ```"]
        #![doc = " [`ControlMode`] says which of them are at work: P, F or P/F."]
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
        pub mod setpoint;
        pub mod snapshot;
        mod stage;
        pub mod stages;
        mod standing;
        mod state;
        mod step;
        pub mod supervised;
        pub mod supervision;
        pub mod task_space;
        pub mod waves;
        mod words;

        pub use defaults::LEG_GAIN;
        pub use description::DESCRIPTION;
        pub use config::{Config, ConfigError, Environment};
        pub use specgen_runtime::setpoint::{Command, CommandKind, Target};
        pub use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Law};
        pub use state::{LegState, State};
        pub use step::{
            GAUGE_FAULT, GENERATOR_BUSY, LEG_LIMITED, SETPOINT_FAULT, SETPOINT_STALE, STATIC_INVERSE, TickInput, TickOutput, WRENCH_FAULT,
            actuate, step,
        };
        pub use words::{
            CONFIG_NAMES, CONFIG_WORDS, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words,
        };

        #identity
    }
}
