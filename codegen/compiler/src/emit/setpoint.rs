//! `src/setpoint.rs`: limits, user frames and trajectories. Reads [`ir::Setpoints`](crate::ir::Setpoints) and the pose bounds;
//! exports `SETPOINTS` and `TRAJECTORY_NAMES`. Only for controllers that see the platform.

use proc_macro2::{Literal, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Frames, Ir, Path, Row, Scalar, Segment, SegmentAxis, Setpoints};

pub fn emit(ir: &Ir, s: &Setpoints) -> TokenStream {
    let scalar = ir.scalar;
    let real = |value| literal::real(scalar, value);
    let six = |values: &[f64; 6]| literal::reals(scalar, values);
    let (period, rate, square_rate) = (real(s.period), real(s.rate), real(s.square_rate));
    let (bias, home, bound) = (six(&s.bias), six(&s.home), six(&ir.bounds.pose));
    let (speed, acceleration, jerk) = (six(&s.speed_limit), six(&s.acceleration_limit), six(&s.jerk_limit));
    let (stop_acceleration, stop_jerk) = (six(&s.stop_acceleration_limit), six(&s.stop_jerk_limit));
    let (stream_step, stream_rate) = (six(&s.stream_step), six(&s.stream_rate));
    let stream_acceleration = six(&s.stream_acceleration);
    let shortest_stop = Literal::i32_unsuffixed(s.shortest_stop);
    let stale_ticks = Literal::u32_unsuffixed(s.stale_ticks);
    let (frames_type, frames) = frames(scalar, &s.frames);
    let count = literal::count(s.trajectories.len());
    let names = s.trajectories.iter().map(|trajectory| &trajectory.name);
    let (constants, entries): (Vec<_>, Vec<_>) = s
        .trajectories
        .iter()
        .enumerate()
        .map(|(index, trajectory)| path(scalar, index, &trajectory.name, &trajectory.path))
        .unzip();
    let mut imports: Vec<&str> = vec!["MoveLimits", "Setpoints"];
    imports.push(match s.frames {
        Frames::Parallel => "Parallel",
        Frames::Tool { .. } => "Tool",
        Frames::Work { .. } => "Work",
    });
    let has = |wanted: fn(&Path) -> bool| s.trajectories.iter().any(|trajectory| wanted(&trajectory.path));
    if has(|path| matches!(path, Path::Segments { .. })) {
        imports.extend(["Axis", "Segment"]);
    }
    if has(|path| matches!(path, Path::Table { .. })) {
        imports.extend(["Row", "Table"]);
    }
    imports.extend(["StopLimits", "Trajectory"]);
    imports.sort_unstable();
    let imports = imports.into_iter().map(|name| format_ident!("{name}"));
    quote! {
        #![doc = " Set-points: limits of bias, moves and streams, user frames, trajectories."]
        #![allow(clippy::approx_constant)] // A frequency of 1 Hz is τ rad/s.

        use specgen_runtime::setpoint::{#(#imports),*};

        use crate::Real;

        /// What the generator of set-points needs to know; from `control.setpoint`, `control.frames`, `workspace`, `timing.period`
        /// and `trajectory`.
        pub const SETPOINTS: Setpoints<Real, UserFrames> = Setpoints {
            period: #period,
            rate: #rate,
            square_rate: #square_rate,
            bias: [#bias],
            home: [#home],
            bound: [#bound],
            limits: MoveLimits {
                speed: [#speed],
                acceleration: [#acceleration],
                jerk: [#jerk],
            },
            stop: StopLimits {
                acceleration: [#stop_acceleration],
                jerk: [#stop_jerk],
                shortest: #shortest_stop,
            },
            stream_step: [#stream_step],
            stream_rate: [#stream_rate],
            stream_acceleration: [#stream_acceleration],
            stale_ticks: #stale_ticks,
            frames: #frames,
            trajectories: &TRAJECTORIES,
        };

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
            let segments = segments.iter().map(|part| segment(scalar, part));
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
            let rows = rows.iter().map(|Row { pose, bend }| {
                let (pose, bend) = (six(pose), six(bend));
                quote! { Row { pose: [#pose], bend: [#bend] } }
            });
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

fn segment(scalar: Scalar, segment: &Segment) -> TokenStream {
    let real = |value| literal::real(scalar, value);
    let first = Literal::u32_unsuffixed(segment.first);
    let (per_tick, per_second, angular) = (real(segment.per_tick), real(segment.per_second), real(segment.angular));
    let phase = Literal::u64_unsuffixed(segment.phase);
    let phase_step = Literal::u64_unsuffixed(segment.phase_step);
    let axes = segment.axes.iter().map(|SegmentAxis { place, slope, sine, cosine }| {
        let (place, slope) = (real(*place), real(*slope));
        let (sine, cosine) = (literal::reals(scalar, sine), literal::reals(scalar, cosine));
        quote! { Axis { place: #place, slope: #slope, sine: [#sine], cosine: [#cosine] } }
    });
    quote! {
        Segment {
            first: #first,
            per_tick: #per_tick,
            per_second: #per_second,
            phase: #phase,
            phase_step: #phase_step,
            angular: #angular,
            axes: [#(#axes),*],
        }
    }
}
