//! `src/setpoint.rs`: limits, user frames and trajectories. Reads [`ir::Setpoints`](crate::ir::Setpoints) and the pose bounds;
//! exports `SETPOINTS` and `TRAJECTORY_NAMES`. Only for controllers of a platform.

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Frames, Ir, Path, Scalar, Setpoints};

pub fn emit(ir: &Ir, s: &Setpoints) -> TokenStream {
    let scalar = ir.scalar;
    let (frames_type, frames) = frames(scalar, &s.frames);
    let setpoints = literal::constant!(scalar, setpoints, &ir.bounds.pose, s, literal::RustExpression(&frames), &[]);
    let count = literal::count(s.trajectories.len());
    let names = s.trajectories.iter().map(|trajectory| &trajectory.name);
    let (constants, entries): (Vec<_>, Vec<_>) = s
        .trajectories
        .iter()
        .enumerate()
        .map(|(index, trajectory)| path(scalar, index, &trajectory.name, &trajectory.path))
        .unzip();
    quote! {
        #![doc = " Set-points: limits of bias, moves and streams, user frames, trajectories."]
        #![allow(clippy::approx_constant)] // A frequency of 1 Hz is τ rad/s.

        use specgen_runtime::setpoint::*;

        use crate::Real;

        /// Parameters of the set-point generator; from `control.setpoint`, `control.frames`, `workspace`, `timing.period`
        /// and `trajectory`.
        pub const SETPOINTS: Setpoints<Real, UserFrames> = #setpoints;

        /// The user's frames; from `control.frames`.
        pub type UserFrames = #frames_type;
        /// Names of the trajectories, by the word `selector`.
        pub const TRAJECTORY_NAMES: [&str; #count] = [#(#names),*];
        /// Trajectories by the word `selector`.
        pub(crate) static TRAJECTORIES: [Trajectory<Real>; #count] = [#(#entries),*];

        #(#constants)*
    }
}

/// Type and value of the user's frames.
fn frames(scalar: Scalar, frames: &Frames) -> (TokenStream, TokenStream) {
    match frames {
        Frames::Parallel => (quote! { Parallel }, quote! { Parallel }),
        Frames::Tool { point, largest_angle } => {
            let (point, largest) = (literal::reals(scalar, point), literal::real(scalar, *largest_angle));
            (quote! { Tool<Real> }, quote! { Tool { point: [#point], largest_angle: #largest } })
        }
        Frames::Work { axes, point, largest_angle } => {
            let axes = literal::vectors(scalar, axes);
            let (point, largest) = (literal::reals(scalar, point), literal::real(scalar, *largest_angle));
            (quote! { Work<Real> }, quote! { Work { axes: #axes, point: [#point], largest_angle: #largest } })
        }
    }
}

/// The constant that holds a trajectory's parts, and its entry in the list.
fn path(scalar: Scalar, index: usize, name: &str, path: &Path) -> (TokenStream, TokenStream) {
    let six = |values: &[f64; 6]| literal::reals(scalar, values);
    let real = |value| literal::real(scalar, value);
    match path {
        Path::Segments { start, segments, ticks, end } => {
            let constant = format_ident!("SEGMENTS_{index}");
            let doc = format!(" Pieces of trajectory `{name}`.");
            let count = literal::count(segments.len());
            let (start, end) = (six(start), six(end));
            let ticks = Literal::u32_unsuffixed(*ticks);
            let segments = segments.iter().map(|part| literal::constant!(scalar, segment, part));
            (
                quote! {
                    #[doc = #doc]
                    static #constant: [Segment<Real>; #count] = [#(#segments),*];
                },
                quote! {
                    Trajectory::Segments { start: [#start], segments: &#constant, ticks: #ticks, end: [#end] }
                },
            )
        }
        Path::Table { rows, row_ticks, per_tick, per_second, bend_rate, repeat } => {
            let constant = format_ident!("ROWS_{index}");
            let doc = format!(" Rows of trajectory `{name}`.");
            let count = literal::count(rows.len());
            let row_ticks = Literal::u32_unsuffixed(*row_ticks);
            let (per_tick, per_second, bend_rate) = (real(*per_tick), real(*per_second), real(*bend_rate));
            let rows = rows.iter().map(|part| literal::constant!(scalar, row, part));
            (
                quote! {
                    #[doc = #doc]
                    static #constant: [Row<Real>; #count] = [#(#rows),*];
                },
                quote! {
                    Trajectory::Table(Table {
                        rows: &#constant,
                        row_ticks: #row_ticks,
                        per_tick: #per_tick,
                        per_second: #per_second,
                        bend_rate: #bend_rate,
                        repeat: #repeat,
                    })
                },
            )
        }
    }
}
