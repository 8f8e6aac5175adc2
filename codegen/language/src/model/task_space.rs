//! The task-space controller of a spec: what of section 4 of the paper the user chooses.

use super::Gains;

/// The task-space controller, section 4 of the paper. A pose is x, y, z, θx, θy, θz from rest, m and rad.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskSpace {
    /// Loops that are closed at start-up; how the feed-forward adapts is [`Adaptation::mode`](super::Adaptation::mode).
    pub mode: ControlMode,
    /// What the six gauges see, in the order of the words `gauge[0]` to `gauge[5]`.
    pub probes: [Probe; 6],
    /// Reading of each gauge, a polynomial V → m with the lowest power first, at least two coefficients. None: the
    /// gauge words are metres.
    pub calibration: Option<[Vec<f64>; 6]>,
    /// ζ of the lowest mode of the platform on its legs, in (0, 1); the leg damper is c_a = 2 ζ k_a / ω_1.
    pub modal_damping: f64,
    /// ζ_d of the modal notch, in (0, 1] and above `modal_damping`. None: no notch.
    pub notch_damping: Option<f64>,
    /// Gains of P and F together. None: the compiler's start rule.
    pub gains: Option<Gains>,
    /// Gains of P alone. None: the compiler's start rule.
    pub position_gains: Option<Gains>,
    /// Ω1 (level) and Ω2 (drift), rad/s: the weight per tick is Ω T_s, at most 1. None: the compiler's start rule.
    pub adaptation: Option<[f64; 2]>,
    /// First-order low-pass of the pose derivative, rad/s, below half the angular tick rate.
    pub velocity_cutoff: f64,
    /// Where the interaction force of the feed-forward comes from.
    pub interaction: Interaction,
    /// The work piece of [`Interaction::Modelled`]; zero if the spec gives none.
    pub environment: Environment,
    /// Time by which the leg displacements of the set-point are asked for early, s; not negative.
    pub lead: f64,
    /// Time constant with which the offset of a bumpless change of mode fades, s.
    pub transfer_time: f64,
    /// What set-points are believed and how fast moves are.
    pub setpoint: SetpointRules,
    /// Coordinates that set-points are given in.
    pub frames: Frames,
    /// Trajectories by the word `selector`, in the order of the spec; names are unique.
    pub trajectories: Vec<Trajectory>,
}

/// Which loops are closed. The paper's "P", "F" and "P/F".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlMode {
    /// Position feedback alone: no inverse model, no adaptation.
    P,
    /// Feed-forward alone.
    F,
    /// Both.
    PF,
}

/// One gauge between base and platform: the target is a plane on the platform, the probe measures along a line fixed in
/// the base. The reading is the distance from the probe point to the plane along `direction`, from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// A point of the measuring line in {B}, m.
    pub point: [f64; 3],
    /// Unit vector of the line in {B}: the reading grows when the target moves this way.
    pub direction: [f64; 3],
    /// A point of the target plane in {P}, m.
    pub plane_point: [f64; 3],
    /// Unit normal of the target plane in {P}; its sign does not matter.
    pub plane_normal: [f64; 3],
}

/// Where the interaction force of the feed-forward comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interaction {
    /// None is fed forward.
    None,
    /// K_e (h_d − h_e).
    Modelled,
    /// A force sensor: the words `wrench[0]` to `wrench[5]`.
    Measured,
}

/// A linear work piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Diagonal of K_e, N/m and N m/rad.
    pub stiffness: [f64; 6],
    /// h_e, the pose at which it is unloaded, m and rad.
    pub rest: [f64; 6],
}

/// Limits of the set-point generator, per axis, m or rad and their time derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct SetpointRules {
    /// Pose that every set-point is added to, m and rad; approached slowly after start-up.
    pub bias: [f64; 6],
    /// Of bias and moves, per s.
    pub speed: [f64; 6],
    /// Of bias and moves, per s².
    pub acceleration: [f64; 6],
    /// Of bias and moves, per s³.
    pub jerk: [f64; 6],
    /// Largest deceleration of stops, per s². None: the compiler derives it.
    pub stop_acceleration: Option<[f64; 6]>,
    /// Their largest jerk, per s³. None: the compiler derives it.
    pub stop_jerk: Option<[f64; 6]>,
    /// A streamed step beyond `stream_speed` · T_s is a jump, per s.
    pub stream_speed: [f64; 6],
    /// A stream without a fresh set-point for this many ticks is stale, at least 1.
    pub stale_ticks: u32,
}

/// Coordinates that set-points are given in.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// Work frame in {B}, about P_C at rest: x, y, z (m), θx, θy, θz (rad), R = Rz Ry Rx.
    pub work: [f64; 6],
    /// Tool point in {P}, m: what is placed, and what rotations turn about.
    pub tool: [f64; 3],
}

/// A trajectory that the controller can play.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// ASCII letters, digits, `-` and `_`.
    pub name: String,
    /// What it is.
    pub kind: TrajectoryKind,
}

/// Kinds of trajectory.
#[derive(Debug, Clone, PartialEq)]
pub enum TrajectoryKind {
    /// One of the paper's, as corrected in the errata or as printed.
    Paper {
        /// Which.
        path: PaperPath,
        /// With the jumps of the printed formulas.
        as_printed: bool,
        /// f_c, Hz.
        frequency: f64,
    },
    /// A table of poses in a CSV file.
    Waveform {
        /// Relative to the spec.
        file: String,
        /// Time between rows, s.
        period: f64,
        /// Begins again after the last row.
        repeat: bool,
    },
}

/// Paths of section 4 of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperPath {
    /// Case 1.
    Case1,
    /// Case 2.
    Case2,
    /// Machining.
    Machining,
}
