//! The checked platform: SI units, no optional value that the controller needs, every number finite and in range.
//!
//! Vectors are in the base frame {B} or the platform frame {P} as stated; angles in rad.

mod mcu;
mod task_space;

use std::collections::BTreeMap;
use std::ops::Range;

pub use mcu::{Mcu, Part};
pub use task_space::{
    ControlMode, Environment, Frames, Interaction, PaperPath, Probe, SetpointRules, TaskSpace, Trajectory,
    TrajectoryKind,
};

/// Largest gain and stiffness that a spec may say, in SI units: products with it stay finite in both scalars.
pub const LARGEST_GAIN: f64 = 1e15;
/// Most intervals per axis of an Everett table: the normal matrix of 64 has 2,080 × 2,080 entries.
pub const MAX_GRID: usize = 64;
/// Most control ticks of a run.
pub const LARGEST_RUN_INTERVAL: i32 = 1_000_000;
/// Furthest that a workspace or a pose may reach from rest, m.
pub const LARGEST_TRAVEL: f64 = 0.1;
/// The same of angles, rad: the controller's series for small angles are sized by it.
pub const LARGEST_TURN: f64 = 0.5;

/// A spec that passed every check that needs no computation.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Name of the platform: ASCII letters, digits, `-` and `_`.
    pub name: String,
    /// (1), (2), (AI.2)–(AI.4).
    pub geometry: Geometry,
    /// The moving platform, Table 4.
    pub platform: RigidBody,
    /// One of six equal legs, Table 4.
    pub leg: LegBody,
    /// The piezo stacks of a leg.
    pub actuator: Actuator,
    /// Between DAC and stack.
    pub amplifier: Amplifier,
    /// Converter that drives the amplifier, in volts at the stack.
    pub dac: Dac,
    /// Displacement gauge of a leg, or with `task_space` one of the six that see the platform.
    pub sensor: Sensor,
    /// Where the hysteresis tables come from.
    pub hysteresis: Hysteresis,
    /// Run-to-run adaptation, Appendix B.
    pub adaptation: Adaptation,
    /// Control timing.
    pub timing: Timing,
    /// Poses that the controller accepts.
    pub workspace: Workspace,
    /// What is emitted.
    pub controller: ControllerOptions,
    /// What it runs on.
    pub target: Target,
    /// The controller that sees the platform: a spec with `[control]`. None: six legs with a gauge each.
    pub task_space: Option<TaskSpace>,
    /// Finest displacement that matters, m, if declared.
    pub precision: Option<f64>,
    /// What the supervisor takes for a fault.
    pub supervisor: Supervisor,
    /// What `specgen robust` varies, and its gate; no constant of the controller comes from here.
    pub robust: Robust,
    /// Where each key stands in the spec file, by key path (`actuator.voltage[1]`), for findings of later phases.
    pub spans: BTreeMap<String, Range<usize>>,
}

/// Declared uncertainties, as smallest and largest factor on what the rest of the spec says; none where it does not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Robust {
    /// On mass and inertia of the platform.
    pub mass: Option<[f64; 2]>,
    /// On the axial stiffness of a leg.
    pub stiffness: Option<[f64; 2]>,
    /// On the damping ratio.
    pub damping: Option<[f64; 2]>,
    /// λ, on the gain of a leg.
    pub gain: Option<[f64; 2]>,
    /// On the width of the hysteresis of a leg.
    pub hysteresis: Option<[f64; 2]>,
    /// On its creep.
    pub creep: Option<[f64; 2]>,
    /// On the lag of an amplifier.
    pub lag: Option<[f64; 2]>,
    /// On the noise of gauges, amplifiers and force sensor.
    pub noise: Option<[f64; 2]>,
    /// Control intervals by which voltages come late, at most.
    pub delay_ticks: Option<u32>,
    /// Largest error of the translation or of the legs, rms, m.
    pub max_error: Option<f64>,
    /// Largest error of the angles, rms, rad.
    pub max_orientation: Option<f64>,
}

/// What the supervisor takes for a fault; none where the rule of the key holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Supervisor {
    /// V.
    pub rest_voltage: Option<f64>,
    /// Time without any condition that arming takes, s.
    pub arm_time: Option<f64>,
    /// V/s.
    pub ramp_rate: Option<f64>,
    /// s.
    pub gauge_time: Option<f64>,
    /// m.
    pub stuck_motion: Option<f64>,
    /// s.
    pub stuck_time: Option<f64>,
    /// m.
    pub disagreement: Option<f64>,
    /// s.
    pub disagreement_time: Option<f64>,
    /// Share of the workspace bound of an axis, or of the stroke.
    pub tracking_error: f64,
    /// s.
    pub tracking_time: Option<f64>,
    /// s.
    pub voltage_time: Option<f64>,
    /// s.
    pub slew_time: Option<f64>,
    /// Within a second.
    pub missed_ticks: u32,
    /// Silence of a host until the machine holds, and until it ramps down, s.
    pub host_lost: Option<[f64; 2]>,
}

impl Model {
    /// Voltage at which the legs stand while disarmed, V; within the limits of a spec that compiles.
    #[must_use]
    pub fn rest_voltage(&self) -> f64 {
        let [low, high] = self.actuator.voltage;
        self.supervisor.rest_voltage.unwrap_or_else(|| Self::nearest_to_zero(low, high))
    }

    /// The voltage from `low` to `high` (V) nearest to that of a stack whose amplifier is off.
    #[must_use]
    pub fn nearest_to_zero(low: f64, high: f64) -> f64 {
        if low > 0.0 {
            low
        } else if high < 0.0 {
            high
        } else {
            0.0
        }
    }
}

/// Joints of base and platform, and the pose at rest. Radii and angles of a spec, (1) and (2), are joints here already.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// B_i in {B}, m.
    pub base_joints: [[f64; 3]; 6],
    /// P_i in {P}, m.
    pub platform_joints: [[f64; 3]; 6],
    /// z of P_C, the origin of {P}, in {B} at rest, m.
    pub height: f64,
}

impl Geometry {
    /// Largest distance of a platform joint from P_C, m.
    #[must_use]
    pub fn joint_radius(&self) -> f64 {
        let distances = self.platform_joints.map(|[x, y, z]| libm::sqrt(x * x + y * y + z * z));
        distances.into_iter().fold(0.0, |largest, d| if d > largest { d } else { largest })
    }
}

/// A rigid body in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    /// kg.
    pub mass: f64,
    /// I_xx, I_yy, I_zz about the centre of mass, kg m².
    pub inertia: [f64; 3],
    /// Products of inertia −∫xy, −∫xz, −∫yz dm (the matrix entries I_xy, I_xz, I_yz), kg m²; zero if not given.
    pub products: [f64; 3],
    /// Centre of mass in {P}, m.
    pub center_of_mass: [f64; 3],
}

/// The two parts of a leg.
#[derive(Debug, Clone, PartialEq)]
pub struct LegBody {
    /// m_s, kg.
    pub fixed_mass: f64,
    /// m_e, kg.
    pub extensible_mass: f64,
    /// I_s about a transverse axis through the part's mass centre, kg m².
    pub fixed_inertia: f64,
    /// I_e, likewise, kg m².
    pub extensible_inertia: f64,
    /// l_s, from the base joint, m.
    pub fixed_center: f64,
    /// l_e, from the platform joint, m.
    pub extensible_center: f64,
    /// Angle by which its joints may turn from rest, rad, if the spec says.
    pub joint_angle: Option<f64>,
}

/// Piezo stacks of one leg.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// Stacks in series.
    pub stacks: u32,
    /// ρ of one stack, m/V.
    pub stack_gain: f64,
    /// Free stroke of the leg, m.
    pub stroke: f64,
    /// Voltage limits [min, max], V.
    pub voltage: [f64; 2],
    /// V/s.
    pub slew_rate: f64,
    /// k_a, N/m.
    pub axial_stiffness: f64,
    /// First axial resonance, Hz.
    pub resonance: f64,
    /// ζ of that resonance.
    pub damping_ratio: f64,
    /// Of all stacks of a leg together, F, if the spec says.
    pub capacitance: Option<f64>,
}

impl Actuator {
    /// ρ̂ of a whole leg, m/V: stacks in series add.
    #[must_use]
    pub fn leg_gain(&self) -> f64 {
        f64::from(self.stacks) * self.stack_gain
    }
}

/// Power amplifier.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplifier {
    /// First-order lag, s.
    pub lag: f64,
    /// Output noise, V rms.
    pub noise: f64,
    /// Largest output current for a leg, A, if the spec says.
    pub current: Option<f64>,
}

/// Digital-to-analogue converter, referred to the stack.
#[derive(Debug, Clone, PartialEq)]
pub struct Dac {
    /// 8 to 24.
    pub bits: u32,
    /// Voltage at code 0 and at full scale (2^bits − 1), V.
    pub range: [f64; 2],
}

/// Displacement gauge of one leg, or one of the six that see the platform.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Smallest and largest displacement it can report, m.
    pub range: [f64; 2],
    /// m rms.
    pub noise: f64,
    /// Resolution of its converter over the range.
    pub bits: u32,
    /// With a calibration: voltage at code 0 and at full scale, V; ±10 V without the key.
    pub input_range: Option<[f64; 2]>,
}

/// Preisach grid and the records that identify it.
#[derive(Debug, Clone, PartialEq)]
pub struct Hysteresis {
    /// N, intervals per axis of the Preisach plane.
    pub grid: usize,
    /// Capacity of the reversal memory, extrema.
    pub memory: usize,
    /// Reversal-curve files relative to the spec: one for all legs, or six.
    pub records: Vec<String>,
    /// How the rate is accounted for.
    pub rate: RateDependence,
    /// s by which the displacement lags the drive, for six legs with their own gauges.
    pub dead_time: f64,
}

/// Rate dependence of the leg model.
#[derive(Debug, Clone, PartialEq)]
pub enum RateDependence {
    /// None.
    Static,
    /// (6), with the files of the second table: one for all legs, or six.
    DynamicPreisach(Vec<String>),
    /// Time constant (s) and weight of each operator behind the static model.
    Creep(Vec<[f64; 2]>),
}

/// How the run-to-run estimate is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdaptationMode {
    /// Inverse Preisach alone.
    Invhys,
    /// (AII.3).
    Ewma,
    /// (AII.5), (AII.6).
    Pcc,
}

/// Run-to-run adaptation. A bandwidth in the spec has already become a weight here: ω = Ω·T_run.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptation {
    /// Which estimates are used at start-up.
    pub mode: AdaptationMode,
    /// ω (EWMA) or ω1 (PCC), per run, in (0, 1]; 0 if the mode does not use it and the spec does not give it.
    pub level_weight: f64,
    /// ω2, per run, in (0, 1]; 0 if the mode does not use it and the spec does not give it.
    pub drift_weight: f64,
    /// Control ticks per run.
    pub run_interval: u32,
    /// Interval of λ = ρ/ρ̂ over which the loop must be stable.
    pub gain_ratio: [f64; 2],
}

/// Diagonal gains of (7), task space: x, y, z, θx, θy, θz.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains {
    /// k_p, N/m and N m/rad.
    pub proportional: [f64; 6],
    /// k_I, N/(m s) and N m/(rad s).
    pub integral: [f64; 6],
    /// k_v, N s/m and N m s/rad.
    pub derivative: [f64; 6],
}

/// Control timing.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Control period T_s, s.
    pub period: f64,
}

/// Bounds on the pose set-point, measured from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Workspace {
    /// |x|, |y|, |z|, m.
    pub translation: [f64; 3],
    /// |θx|, |θy|, |θz|, rad.
    pub rotation: [f64; 3],
}

/// Floating-point type of the emitted controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// 32 bits.
    F32,
    /// 64 bits.
    F64,
}

/// What the six set-point numbers are at start-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetpointKind {
    /// Pose from rest, m and rad.
    Pose,
    /// Leg displacements, m.
    Leg,
}

/// What is emitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerOptions {
    /// Arithmetic.
    pub scalar: Scalar,
    /// Meaning of the set-point at start-up.
    pub setpoint: SetpointKind,
}

/// Where it runs, and what it may use there.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// The part.
    pub mcu: Mcu,
    /// Flash, bytes, if declared.
    pub flash: Option<u64>,
    /// RAM, bytes, if declared.
    pub ram: Option<u64>,
    /// Stack of one tick, bytes, if declared.
    pub stack: Option<u64>,
    /// Mean instructions per tick, if declared.
    pub instructions: Option<u64>,
}
