//! Additional constants of a controller in task space.

use serde::Serialize;
use specgen_runtime::{ControlMode, trigger};

use super::{Interaction, LEGS, Law, Scalar, in_lower_case};

/// Control in task space.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TaskSpace {
    /// Gauges to pose and its rate.
    pub sensing: Sensing,
    /// Set-points: limits, user frames, trajectories.
    pub setpoints: Setpoints,
    /// Constants of the control law.
    pub law: ControlLaw,
    /// Computation of the load of the legs.
    pub load: Load,
    /// Config at start-up.
    pub defaults: PlatformDefaults,
}

/// The load p of the legs under motion and gravity, (7), without feed-forward of an interaction force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Load {
    /// First-order model, with the cross-talk of the legs; none to use the full kernel.
    pub affine: Option<Affine>,
    /// E J: cross-talk of the legs beside the full kernel, a row by leg, m/m and m/rad.
    pub cross_talk: Option<[[f64; 6]; LEGS]>,
    /// Largest permitted error within the limits of moves and trajectories, m of a leg.
    pub tolerance: f64,
    /// Proven bounds of the first-order model: for moves and trajectories; for stops from any declared speed; for any stream.
    pub bounds: [LoadBound; 3],
    /// Operations of the full kernel and of the first-order model.
    pub operations: [usize; 2],
}

/// p = P h + Q ḧ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Affine {
    /// P, a row by leg, m/m and m/rad.
    pub pose: [[f64; 6]; LEGS],
    /// Q, a row by leg, m/(m/s²) and m/(rad/s²).
    pub acceleration: [[f64; 6]; LEGS],
}

impl Affine {
    /// Terms that are not zero.
    pub fn terms(&self) -> usize {
        self.pose.iter().chain(&self.acceleration).flatten().filter(|entry| **entry != 0.0).count()
    }
}

/// Bounds over a set of motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadBound {
    /// Largest rate of each coordinate, m/s and rad/s.
    pub rate: [f64; 6],
    /// Largest acceleration, m/s² and rad/s².
    pub acceleration: [f64; 6],
    /// |p|, m.
    pub load: f64,
    /// Error of the first-order model, m.
    pub error: f64,
}

/// Constants of (7), at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlLaw {
    /// T_s, s.
    pub period: f64,
    /// 1/k_a, m/N.
    pub compliance: f64,
    /// J⁻ᵀ/k_a, m/N and 1/N.
    pub wrench_to_legs: [[f64; 6]; LEGS],
    /// Its inverse, k_a Jᵀ, N/m and N.
    pub legs_to_wrench: [[f64; 6]; 6],
    /// V⁻¹ K⁻¹, K = Jᵀ k_a J. V are the modes if a notch is declared, else the axes of the pose.
    pub force_to_modes: [[f64; 6]; 6],
    /// V⁻¹ J⁻¹.
    pub legs_to_modes: [[f64; 6]; 6],
    /// J V.
    pub modes_to_legs: [[f64; 6]; 6],
    /// Leg forces at rest, N.
    pub rest_force: [f64; LEGS],
    /// Largest component of a measured wrench, N and N m.
    pub wrench_limit: [f64; 6],
    /// Lead of the leg displacements, in periods; zero if there is none.
    pub lead: f64,
    /// Lead of each trajectory, if one has its own; otherwise empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub own_leads: Vec<f64>,
    /// Remaining fraction of the transfer offset after a tick.
    pub transfer_keep: f64,
    /// Negligible transfer offset, m.
    pub transfer_negligible: f64,
    /// Drive of mode P, cells of the Everett grid per metre.
    pub cells_per_metre: f64,
    /// Its inverse.
    pub metres_per_cell: f64,
    /// Pose that user set-points are measured from, m and rad.
    pub bias: [f64; 6],
    /// Modal notch, if declared.
    pub notch: Option<Notch>,
    /// Active damping of each mode, if declared.
    pub damping: Option<[Resonator; 6]>,
    /// Whether the integral is transferred to the estimates when the set-point comes to rest.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub hands_over: bool,
    /// Limits of the correction on each axis, if there is one.
    pub correction: Option<[CorrectionLimit; 6]>,
}

/// Six biquads in modal coordinates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Notch {
    /// V⁻¹.
    pub pose_to_modes: [[f64; 6]; 6],
    /// V.
    pub modes_to_pose: [[f64; 6]; 6],
    /// One for each mode.
    pub sections: [Section; 6],
}

/// 1 − g (1 − z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Section {
    /// g.
    pub depth: f64,
    /// a₁, a₂.
    pub a: [f64; 2],
}

/// (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Resonator {
    /// b₀, b₁, b₂.
    pub b: [f64; 3],
    /// a₁, a₂.
    pub a: [f64; 2],
}

/// Limits of the correction of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CorrectionLimit {
    /// m or rad.
    pub most: f64,
    /// m or rad per tick.
    pub step: f64,
}

/// Diagonal gains of (7).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gains {
    /// k_p.
    pub proportional: [f64; 6],
    /// k_I.
    pub integral: [f64; 6],
    /// k_v.
    pub derivative: [f64; 6],
}

/// Config of a platform at start-up; code limits are in [`super::Defaults`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlatformDefaults {
    /// Control mode.
    #[serde(serialize_with = "in_lower_case")]
    pub mode: ControlMode,
    /// Run-to-run law of the spec, in a mode without one as well.
    #[serde(serialize_with = "in_lower_case")]
    pub law: Law,
    /// Source of the interaction force.
    #[serde(serialize_with = "in_lower_case")]
    pub interaction: Interaction,
    /// ω or ω1 per tick.
    pub level_weight: f64,
    /// ω2 per tick.
    pub drift_weight: f64,
    /// Gains of P/F with EWMA or PCC.
    pub gains: Gains,
    /// Gains of P and of P/F with Invhys.
    pub position_gains: Gains,
    /// K_e.
    pub environment_stiffness: [f64; 6],
    /// h_e.
    pub environment_rest: [f64; 6],
    /// Output lines.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub triggers: Vec<Line>,
    /// Whether there is an input line.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub input: bool,
}

/// An output line; the constants of `specgen_runtime::trigger::Line`, where each is explained.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Line {
    /// A word of `specgen_runtime::trigger::Kind`.
    #[serde(serialize_with = "by_name")]
    pub kind: trigger::Kind,
    /// 0 to 5.
    pub axis: usize,
    /// A word of `specgen_runtime::trigger::Direction`.
    #[serde(serialize_with = "by_name")]
    pub direction: trigger::Direction,
    /// m or rad.
    pub start: f64,
    /// m or rad.
    pub stop: f64,
    /// m or rad.
    pub step: f64,
    /// m or rad.
    pub hysteresis: f64,
    /// Set-points or ticks.
    pub first: u32,
    /// Set-points or ticks.
    pub every: u32,
    /// 0: no last one.
    pub last: u32,
    /// Ticks.
    pub width: i32,
}

/// The name of a variant.
fn by_name<S: serde::Serializer>(choice: &impl core::fmt::Debug, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{choice:?}"))
}

/// Gauges to pose and its rate. The constants are those of `specgen_runtime::sensing::Gauges`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensing {
    /// n of each gauge, unit, {B}.
    pub direction: [[f64; 3]; 6],
    /// m of each gauge: normal of its plane over n·normal, {P}.
    pub normal: [[f64; 3]; 6],
    /// m × n of each gauge.
    pub skew: [[f64; 3]; 6],
    /// c of each gauge: intersection of its line with the plane at rest, {P}, m.
    pub pierced: [[f64; 3]; 6],
    /// J⁻¹ at rest: pose coordinates (rows) per reading (columns), m/m and rad/m.
    pub inverse: [[f64; 6]; 6],
    /// J⁻¹ of the second-degree terms: pose coordinates (rows) per product of two turns (columns).
    pub curvature: [[f64; 6]; 6],
    /// Passes after the first guess.
    pub passes: u32,
    /// Remaining error of the passes over the accepted poses, in exact arithmetic: m, rad.
    pub remainder: [f64; 2],
    /// Coefficients of asin x / x in x² after the leading 1.
    pub arc_sine: Vec<f64>,
    /// Coefficients of atan x / x in x² after the leading 1.
    pub arc_tangent: Vec<f64>,
    /// Polynomial of each gauge from its raw word to m, lowest power first, all of one length; none: the words are m.
    pub calibration: Option<[Vec<f64>; 6]>,
    /// Plausible range of the raw words of each gauge, in the unit of the word.
    pub raw_limits: [[f64; 2]; 6],
    /// exp(−ω_c T) of the rate filter.
    pub rate_keep: f64,
    /// (1 − exp(−ω_c T))/T of the rate filter, 1/s.
    pub rate_gain: f64,
}

/// Constants of `specgen_runtime::setpoint::Setpoints`; the workspace is in [`super::Bounds`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setpoints {
    /// T_s, s.
    pub period: f64,
    /// 1/T_s, 1/s.
    pub rate: f64,
    /// 1/T_s², 1/s².
    pub square_rate: f64,
    /// Bias and offset of the work frame, m and rad.
    pub bias: [f64; 6],
    /// The user's coordinates of the bias, m and rad.
    pub home: [f64; 6],
    /// V: largest speed of moves, m/s and rad/s; only for hosts, through the controller's description.
    pub speed: [f64; 6],
    /// 1/(V T_s) of moves, 1/m and 1/rad.
    pub speed_limit: [f64; 6],
    /// 1/(A T_s²).
    pub acceleration_limit: [f64; 6],
    /// 1/(J T_s³).
    pub jerk_limit: [f64; 6],
    /// 1/(A T_s²) of stops, 1/m and 1/rad.
    pub stop_acceleration_limit: [f64; 6],
    /// 1/(J T_s³) of stops.
    pub stop_jerk_limit: [f64; 6],
    /// Ticks of the shortest stop.
    pub shortest_stop: i32,
    /// Largest streamed step, m and rad.
    pub stream_step: [f64; 6],
    /// Largest streamed rate, per s.
    pub stream_rate: [f64; 6],
    /// Largest streamed acceleration, per s².
    pub stream_acceleration: [f64; 6],
    /// Ticks after which a stream is stale.
    pub stale_ticks: u32,
    /// Coordinates of the user.
    pub frames: Frames,
    /// By the word `selector`.
    pub trajectories: Vec<Trajectory>,
}

/// Coordinates of the user.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Frames {
    /// Those of the platform.
    Parallel,
    /// Rotations about a tool point.
    Tool {
        /// In {P}, m.
        point: [f64; 3],
        /// Largest permitted angle, rad.
        largest_angle: f64,
    },
    /// Rotations about a tool point, along separate axes.
    Work {
        /// Columns are the axes in {B}.
        axes: [[f64; 3]; 3],
        /// In {P}, m.
        point: [f64; 3],
        /// Largest permitted angle, rad.
        largest_angle: f64,
    },
}

/// A trajectory that the controller can play.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trajectory {
    /// Its name in the spec.
    pub name: String,
    /// Its poses over time.
    pub path: Path,
}

/// Poses over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Path {
    /// Analytic pieces.
    Segments {
        /// First pose, m and rad.
        start: [f64; 6],
        /// In the order of time.
        segments: Vec<Segment>,
        /// First tick not before the end.
        ticks: u32,
        /// Last pose, m and rad.
        end: [f64; 6],
    },
    /// Rows joined by a cubic spline.
    Table {
        /// Nodes; the first again at the end if it repeats.
        rows: Vec<Row>,
        /// Ticks from row to row.
        row_ticks: u32,
        /// 1/row_ticks.
        per_tick: f64,
        /// Rows per s.
        per_second: f64,
        /// 6 · (rows per s)².
        bend_rate: f64,
        /// Starts again after the last row.
        repeat: bool,
    },
}

/// Line and growing sinusoid on every axis; w = 0..1 over the segment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Segment {
    /// Its first tick.
    pub first: u32,
    /// w per tick.
    pub per_tick: f64,
    /// w per s.
    pub per_second: f64,
    /// Phase at `first`, turn/2⁶⁴.
    pub phase: u64,
    /// Phase per tick, turn/2⁶⁴.
    pub phase_step: u64,
    /// rad/s.
    pub angular: f64,
    /// By coordinate.
    pub axes: [SegmentAxis; 6],
}

/// place + slope w + (a + b w) sin + (c + d w) cos, m or rad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SegmentAxis {
    /// At w = 0.
    pub place: f64,
    /// Over w = 0..1.
    pub slope: f64,
    /// a, b.
    pub sine: [f64; 2],
    /// c, d.
    pub cosine: [f64; 2],
}

/// Node of a spline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// m and rad.
    pub pose: [f64; 6],
    /// Second derivative · (row time)²/6.
    pub bend: [f64; 6],
}

impl Frames {
    /// Rounds all constants to `scalar`.
    pub fn rounded(&self, scalar: Scalar) -> Self {
        let round = |value: f64| scalar.round(value);
        match *self {
            Self::Parallel => Self::Parallel,
            Self::Tool { point, largest_angle } => {
                Self::Tool { point: point.map(round), largest_angle: round(largest_angle) }
            }
            Self::Work { axes, point, largest_angle } => Self::Work {
                axes: axes.map(|row| row.map(round)),
                point: point.map(round),
                largest_angle: round(largest_angle),
            },
        }
    }
}

impl Path {
    /// Its start in the controller, in the user's coordinates, m and rad.
    pub fn start(&self) -> [f64; 6] {
        match self {
            Self::Segments { start, .. } => *start,
            Self::Table { rows, .. } => rows.first().map_or([0.0; 6], |row| row.pose),
        }
    }

    /// Ticks from start to end, or of one repetition.
    pub fn ticks(&self) -> u32 {
        match self {
            Self::Segments { ticks, .. } => *ticks,
            Self::Table { rows, row_ticks, .. } => rows.len().saturating_sub(1) as u32 * row_ticks,
        }
    }

    /// Whether it repeats.
    pub fn repeats(&self) -> bool {
        matches!(self, Self::Table { repeat: true, .. })
    }

    /// Rounds all constants to `scalar`.
    #[must_use]
    pub fn rounded(mut self, scalar: Scalar) -> Self {
        let round = |value: &mut f64| *value = scalar.round(*value);
        match &mut self {
            Self::Segments { start, segments, end, .. } => {
                start.iter_mut().chain(end).for_each(round);
                for segment in segments {
                    [&mut segment.per_tick, &mut segment.per_second, &mut segment.angular].into_iter().for_each(round);
                    for axis in &mut segment.axes {
                        [&mut axis.place, &mut axis.slope].into_iter().for_each(round);
                        axis.sine.iter_mut().chain(&mut axis.cosine).for_each(round);
                    }
                }
            }
            Self::Table { rows, per_tick, per_second, bend_rate, .. } => {
                [per_tick, per_second, bend_rate].into_iter().for_each(round);
                for row in rows {
                    row.pose.iter_mut().chain(&mut row.bend).for_each(round);
                }
            }
        }
        self
    }
}
