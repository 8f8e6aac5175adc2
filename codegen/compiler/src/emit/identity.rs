//! `src/identity.rs`: what every emitted controller is called: platform, digest, scalar.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Frames, Ir, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let scalar = format_ident!("f{}", ir.scalar.bits().to_string());
    let bits = literal::count(ir.scalar.bits() as usize);
    let period = literal::real(Scalar::F64, ir.defaults.period);
    let (name, digest, version) = (&ir.name, &ir.digest, &ir.specgen_version);
    let about = format!(
        "name={name}\ndigest={digest}\nversion={version}\nkind={}\nscalar_bits={}\nleg_gain={:?}\nperiod={:?}\ngrid={}\ndrive_range={:?},{:?}\n",
        if ir.task_space.is_some() { "platform" } else { "legs" },
        ir.scalar.bits(),
        ir.defaults.leg_gain,
        ir.defaults.period,
        ir.hysteresis.grid,
        ir.actuation.voltage[0],
        ir.actuation.voltage[1],
    );
    let assumed = &ir.assumed;
    let motion = motion(ir);
    quote! {
        #![doc = " What this controller is."]

        /// Floating-point type of this controller; from `controller.scalar`.
        pub type Real = #scalar;
        /// Width of [`Real`].
        pub const SCALAR_BITS: u32 = #bits;
        /// Control period, s; from `timing.period`.
        pub const PERIOD_SECONDS: f64 = #period;
        /// Number of legs.
        pub const LEGS: usize = 6;
        /// Name of the platform.
        pub const SPEC_NAME: &str = #name;
        /// SHA-256 of the spec and of the records it names.
        pub const SPEC_DIGEST: &str = #digest;
        /// Version of the compiler.
        pub const SPECGEN_VERSION: &str = #version;
        /// What nobody measured: paths of the spec whose values are assumed, and simulated records. A program that drives a real machine
        /// asks its user first where this is not empty. Nothing of it is in the law.
        pub const ASSUMED: &[&str] = &[#(#assumed),*];
        /// Of the description what stands before the names of words, and what stands after them.
        pub(crate) const ABOUT: &str = #about;
        pub(crate) const MOTION: &str = #motion;
    }
}

/// Where a platform may go, how fast, and in which coordinates: what a host has to know beforehand to say whether a pose can be
/// reached. Nothing of six legs.
fn motion(ir: &Ir) -> String {
    let Some(task) = &ir.task_space else { return String::new() };
    let setpoints = &task.setpoints;
    let mut text = String::new();
    let mut line = |key: &str, values: &[f64]| {
        let values: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
        text.push_str(&format!("{key}={}\n", values.join(",")));
    };
    line("bias", &task.law.bias);
    line("origin", &setpoints.bias);
    line("bound", &ir.bounds.pose);
    line("speed", &setpoints.speed);
    line("stroke", &[ir.bounds.stroke]);
    line("rest_leg", ir.kinematics.rest_leg.as_flattened());
    line("platform_joint", ir.kinematics.platform_joint.as_flattened());
    match setpoints.frames {
        Frames::Parallel => {}
        Frames::Tool { point, largest_angle } => {
            line("tool", &point);
            line("largest_angle", &[largest_angle]);
        }
        Frames::Work { axes, point, largest_angle } => {
            line("tool", &point);
            line("axes", axes.as_flattened());
            line("largest_angle", &[largest_angle]);
        }
    }
    let names: Vec<&str> = setpoints.trajectories.iter().map(|trajectory| trajectory.name.as_str()).collect();
    text + "trajectories=" + &names.join(",") + "\n"
}
