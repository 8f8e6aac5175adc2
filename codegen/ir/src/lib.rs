//! Intermediate representation: every constant of the emitted controller, computed, rounded and in order.
//!
//! Plain data. Lowering fills it, emitters print it and do no arithmetic of their own. `specgen dump-ir` shows it.
//! Numbers are already rounded to the controller's scalar, so that the text is the constant.

pub mod constants;
pub mod description;
mod permitted;
pub mod scalar;
mod supervision;
mod task_space;

use serde::{Serialize, Serializer};

pub use permitted::*;
use scalar::Numbers;
use specgen_runtime::bouc_wen::READ_OUT;
use specgen_runtime::dynamics::Leg;
use specgen_runtime::plays::PLAYS;
use specgen_runtime::{Creep, Platform, Real};
pub use specgen_runtime::{Interaction, Law, SetpointKind};
pub use supervision::{Rest, Supervision, Wiring};
pub use task_space::*;

/// Number of legs.
pub const LEGS: usize = 6;

/// Floating-point type of the emitted code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scalar {
    /// IEEE 754 binary32.
    F32,
    /// IEEE 754 binary64.
    F64,
}

impl Scalar {
    /// Width in bits.
    pub fn bits(self) -> u32 {
        match self {
            Self::F32 => 32,
            Self::F64 => 64,
        }
    }

    /// `value` rounded to this type.
    pub fn round(self, value: f64) -> f64 {
        match self {
            Self::F32 => f64::from(value as f32),
            Self::F64 => value,
        }
    }

    /// Distance from 1 to the next number.
    pub fn epsilon(self) -> f64 {
        match self {
            Self::F32 => f64::from(f32::EPSILON),
            Self::F64 => f64::EPSILON,
        }
    }
}

/// A controller, down to its constants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ir {
    /// Platform name.
    pub name: String,
    /// SHA-256 of spec and records, hex.
    pub digest: String,
    /// Values that were not measured: paths in the spec, and simulated files.
    pub assumed: Vec<String>,
    /// Version of the compiler.
    pub specgen_version: String,
    /// Arithmetic.
    pub scalar: Scalar,
    /// Pose to leg displacements.
    pub kinematics: Kinematics,
    /// Motion to leg forces.
    pub dynamics: Dynamics,
    /// Preisach tables.
    pub hysteresis: Hysteresis,
    /// Converter and limits.
    pub actuation: Actuation,
    /// Plausible ranges of inputs.
    pub bounds: Bounds,
    /// Codes of the gauges' converters.
    pub gauge_converter: GaugeConverter,
    /// Constants of the supervisor.
    pub supervision: Supervision,
    /// Config at start-up.
    pub defaults: Defaults,
    /// Permitted values of a Config, and largest numbers of a state.
    pub permitted: PermittedRanges,
    /// Control in task space; none for six legs with their own gauges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task_space: Option<TaskSpace>,
    /// Settings and checksum for the check at start-up.
    pub integrity: Integrity,
}

/// Leg kinematics in difference form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Kinematics {
    /// r₀ = P₀ + P_i − B_i at rest (AI.2), base frame, m.
    pub rest_leg: [[f64; 3]; LEGS],
    /// P_i in the platform frame (AI.4), m.
    pub platform_joint: [[f64; 3]; LEGS],
    /// l₀ = |r₀|, m.
    pub rest_length: [f64; LEGS],
    /// Taylor coefficients of sin x / x in x², after the leading 1.
    pub sine: Vec<f64>,
    /// Taylor coefficients of (1 − cos x) / x² in x².
    pub versine: Vec<f64>,
    /// Taylor coefficients of the root of Δl² + 2 l₀ Δl = s over s/(2 l₀), in s/(2 l₀²), after the leading 1.
    pub root: Vec<f64>,
    /// Newton steps from there.
    pub newton_steps: u32,
    /// Largest |Δl| over the accepted poses, m (bound; sizes series and steps).
    pub largest_displacement: f64,
    /// J⁻¹ of the legs at rest: pose coordinates (rows) per leg displacement (columns), m/m and rad/m.
    pub inverse_jacobian: [[f64; 6]; LEGS],
    /// Corrections of the forward kinematics over the accepted poses.
    pub corrections: u32,
}

/// Inverse dynamics: the constants of [`specgen_runtime::Platform`], where each is explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dynamics {
    /// The legs in the order of elimination.
    pub legs: [DynamicsLeg; LEGS],
    /// Place of each leg in that order.
    pub places: [usize; LEGS],
    /// Equation that each place is solved from.
    pub rows: [usize; LEGS],
    /// Base joints in one plane.
    pub flat_base: bool,
    /// Platform joints in the plane z = 0.
    pub flat_platform: bool,
    /// Height of P_C at rest above that of `base`, m.
    pub base_depth: f64,
    /// Joint that moments are taken about, m.
    pub pole: [f64; 3],
    /// Platform and point masses at its joints, kg.
    pub mass: f64,
    /// About P_C, kg m.
    pub first_moment: [f64; 3],
    /// About the pole, kg m.
    pub pole_moment: [f64; 3],
    /// About P_C and the pole, kg m².
    pub second_moment: [[f64; 3]; 3],
    /// q, kg m.
    pub extensible_moment: f64,
    /// J, kg m².
    pub leg_inertia: f64,
    /// (q − σ) g, N m.
    pub leg_weight_moment: f64,
    /// g, m/s².
    pub gravity: f64,
    /// Smallest over largest pivot of the elimination, the worst of the declared workspace; moments in joint radii.
    pub pivot_ratio: f64,
}

/// Geometry of one leg in [`Dynamics`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DynamicsLeg {
    /// From the base joint, base axes, m.
    pub base: [f64; 3],
    /// P_i, m.
    pub joint: [f64; 3],
    /// P_i from the pole, m.
    pub arm: [f64; 3],
    /// r₀, m.
    pub rest: [f64; 3],
    /// l₀, m.
    pub length: f64,
    /// 1/l₀, 1/m.
    pub inverse_length: f64,
    /// 1/(2 l₀²), 1/m².
    pub half_inverse_square: f64,
}

impl Dynamics {
    /// The runtime's type, in any scalar.
    pub fn platform<T: Real>(&self) -> Platform<T> {
        self.platform_of(T::from_f64)
    }

    /// The runtime's type, with numbers converted by `number`.
    pub fn platform_of<T: Real>(&self, number: impl Fn(f64) -> T) -> Platform<T> {
        let vector = |values: [f64; 3]| values.map(&number);
        Platform {
            legs: self.legs.each_ref().map(|leg| Leg {
                base: vector(leg.base),
                joint: vector(leg.joint),
                arm: vector(leg.arm),
                rest: vector(leg.rest),
                length: number(leg.length),
                inverse_length: number(leg.inverse_length),
                half_inverse_square: number(leg.half_inverse_square),
            }),
            places: self.places,
            rows: self.rows,
            flat_base: self.flat_base,
            flat_platform: self.flat_platform,
            base_depth: number(self.base_depth),
            pole: vector(self.pole),
            mass: number(self.mass),
            first_moment: vector(self.first_moment),
            pole_moment: vector(self.pole_moment),
            second_moment: self.second_moment.map(&vector),
            extensible_moment: number(self.extensible_moment),
            leg_inertia: number(self.leg_inertia),
            leg_weight_moment: number(self.leg_weight_moment),
            gravity: number(self.gravity),
        }
    }

    /// Rounds all numbers to the scalar, except the pivot ratio, which is a finding and not a constant.
    #[must_use]
    pub fn rounded(mut self, scalar: Scalar) -> Self {
        let round = |value: &mut f64| *value = scalar.round(*value);
        for leg in &mut self.legs {
            let vectors = [&mut leg.base, &mut leg.joint, &mut leg.arm, &mut leg.rest];
            vectors.into_iter().flatten().for_each(round);
            [&mut leg.length, &mut leg.inverse_length, &mut leg.half_inverse_square].into_iter().for_each(round);
        }
        let vectors = [&mut self.pole, &mut self.first_moment, &mut self.pole_moment];
        vectors.into_iter().chain(&mut self.second_moment).flatten().for_each(round);
        let of_platform = [&mut self.base_depth, &mut self.mass, &mut self.gravity];
        let of_legs = [&mut self.extensible_moment, &mut self.leg_inertia, &mut self.leg_weight_moment];
        of_platform.into_iter().chain(of_legs).for_each(round);
        self
    }
}

/// Preisach tables.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hysteresis {
    /// N, cells per axis.
    pub grid: usize,
    /// Capacity of the reversal memory, extrema.
    pub memory: usize,
    /// Distinct tables: E(i, j) for i = 0..=N, j = 0..=i, with the zero diagonal, m.
    pub tables: Vec<Vec<f64>>,
    /// Table of each leg.
    pub table_of_leg: [usize; LEGS],
    /// Rate dependence; none in a static model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<RateModel>,
    /// Lead of the demanded leg displacements; none without a dead time and a resonance that is compensated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lead: Option<Lead>,
    /// Whether the tables are those of records; otherwise the law never runs: the controller has the open drive only.
    #[serde(skip_serializing_if = "Clone::clone")]
    pub identified: bool,
}

impl Hysteresis {
    /// Whether the legs have plays in place of the tables.
    pub fn has_plays(&self) -> bool {
        matches!(self.rate, Some(RateModel::BoucWen { plays: Some(_), .. }))
    }
}

/// Rate dependence of the leg model, at the period of the spec.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RateModel {
    /// (6).
    DynamicPreisach {
        /// Distinct tables of the second weight, in the layout of the first, m per cell per tick.
        tables: Vec<Vec<f64>>,
        /// Table of each leg.
        table_of_leg: [usize; LEGS],
        /// Error of the demand at which the inverse has converged, m.
        tolerance: f64,
    },
    /// Creep in series with the static model.
    Creep {
        /// g_j = 1 − e^(−T/τ_j).
        gains: Vec<f64>,
        /// w_j.
        weights: Vec<f64>,
        /// w_j (1 − g_j).
        carried: Vec<f64>,
        /// 1 + Σ w_j g_j.
        direct: f64,
    },
    /// A Bouc-Wen state beside the table, a read-out and creep.
    BoucWen {
        /// Of each leg; all have the same number of creep operators.
        legs: Box<[BoucWen; LEGS]>,
        /// Plays that widen with the rate, in place of the tables.
        #[serde(skip_serializing_if = "Option::is_none")]
        plays: Option<Box<[Plays; LEGS]>>,
    },
}

/// The constants of [`specgen_runtime::Plays`], where each is explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plays {
    /// N, cells.
    pub full_scale: f64,
    /// r_i, cells.
    pub thresholds: Vec<f64>,
    /// w_i, m per cell.
    pub weights: Vec<f64>,
    /// Σ w_i.
    pub slope: f64,
    /// Σ w_i r_i.
    pub rest: f64,
    /// κ.
    pub widening: f64,
    /// 1/v₀, ticks per cell.
    pub per_rate: f64,
    /// e^(−T/τ).
    pub decay: f64,
}

impl Plays {
    /// Every number, in the order of the runtime's checksum.
    pub fn numbers(&self) -> Vec<f64> {
        let after = [self.slope, self.rest, self.widening, self.per_rate, self.decay];
        [&[self.full_scale][..], &self.thresholds, &self.weights, &after].concat()
    }

    /// The runtime's type; none if there is another number of plays.
    pub fn constants<T: Real>(&self, numbers: &impl Numbers<T>) -> Option<specgen_runtime::Plays<T>> {
        let list = |values: &Vec<f64>| values.as_array().map(|values| numbers.vector::<PLAYS>(values));
        Some(specgen_runtime::Plays {
            full_scale: numbers.real(self.full_scale),
            thresholds: list(&self.thresholds)?,
            weights: list(&self.weights)?,
            slope: numbers.real(self.slope),
            rest: numbers.real(self.rest),
            widening: numbers.real(self.widening),
            per_rate: numbers.real(self.per_rate),
            decay: numbers.real(self.decay),
        })
    }
}

/// The constants of [`specgen_runtime::BoucWen`], where each is explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoucWen {
    /// g_j = 1 − e^(−T/τ_j).
    pub gains: Vec<f64>,
    /// w_j.
    pub weights: Vec<f64>,
    /// w_j (1 − g_j).
    pub carried: Vec<f64>,
    /// 1 + Σ w_j g_j.
    pub direct: f64,
    /// Its reciprocal.
    pub share: f64,
    /// G.
    pub read_out: [f64; READ_OUT],
    /// F.
    pub inverse: [f64; READ_OUT],
    /// Range of h, m.
    pub travel: [f64; 2],
    /// a, m per cell.
    pub slope: f64,
    /// β + γ, per cell.
    pub beta_plus_gamma: f64,
    /// β − γ, per cell.
    pub beta_minus_gamma: f64,
    /// a/(β + γ), m.
    pub limit: f64,
    /// z₀, m.
    pub rest: f64,
}

impl BoucWen {
    /// Every number, in the order of the runtime's checksum.
    pub fn numbers(&self) -> Vec<f64> {
        let lists = [&self.gains, &self.weights, &self.carried].map(Vec::as_slice);
        let after = [self.slope, self.beta_plus_gamma, self.beta_minus_gamma, self.limit, self.rest];
        [&lists.concat(), &[self.direct, self.share][..], &self.read_out, &self.inverse, &self.travel, &after].concat()
    }

    /// The runtime's type with `K` creep operators; none if there is another number of them.
    pub fn constants<T: Real, const K: usize>(
        &self,
        numbers: &impl Numbers<T>,
    ) -> Option<specgen_runtime::BoucWen<T, K>> {
        let list = |values: &Vec<f64>| values.as_array().map(|values| numbers.vector::<K>(values));
        Some(specgen_runtime::BoucWen {
            creep: Creep {
                gains: list(&self.gains)?,
                weights: list(&self.weights)?,
                carried: list(&self.carried)?,
                direct: numbers.real(self.direct),
            },
            share: numbers.real(self.share),
            read_out: numbers.vector(&self.read_out),
            inverse: numbers.vector(&self.inverse),
            travel: numbers.vector(&self.travel),
            slope: numbers.real(self.slope),
            beta_plus_gamma: numbers.real(self.beta_plus_gamma),
            beta_minus_gamma: numbers.real(self.beta_minus_gamma),
            limit: numbers.real(self.limit),
            rest: numbers.real(self.rest),
        })
    }
}

/// Lead on the demand of a leg.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lead {
    /// Ticks.
    pub ticks: f64,
    /// Inverse of the resonance; none without `actuator.resonance_gain`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resonance: Option<Resonance>,
    /// Largest addition, m.
    pub limit: f64,
}

/// Inverse of a leg's resonance, over the differences of its voltage in the units of small motion.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Resonance {
    /// Addition over the first difference: 2ζ/ω, ticks.
    pub lag: f64,
    /// Addition over the second difference: 1/ω², ticks².
    pub bend: f64,
    /// Relative growth of the gain over the distance from a turn, 1/m.
    pub gain_growth: f64,
}

/// Converter and limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Actuation {
    /// Bits of a code.
    pub bits: u32,
    /// Voltage of code 0, V.
    pub volts_at_zero: f64,
    /// V per code.
    pub volts_per_code: f64,
    /// Drive of code 0, cells.
    pub cells_at_zero: f64,
    /// Cells per code.
    pub cells_per_code: f64,
    /// Codes per cell.
    pub codes_per_cell: f64,
    /// Lowest code whose voltage is within limits.
    pub code_min: i32,
    /// Highest such code.
    pub code_max: i32,
    /// Voltage limits the codes come from, V.
    pub voltage: [f64; 2],
}

/// Plausible ranges of inputs; anything else is a fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// |pose component| from rest: m ×3, rad ×3.
    pub pose: [f64; 6],
    /// Leg displacement set-point, m.
    pub leg: [f64; 2],
    /// Gauge reading, m.
    pub sensor: [f64; 2],
    /// Stroke of every leg, m; only for hosts, through the controller's description.
    pub stroke: f64,
}

/// Codes of the gauges' converters; the constants of [`specgen_runtime::GaugeConverter`], where each is explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GaugeConverter {
    /// Number at code 0, m; V with a calibration.
    pub at_zero: f64,
    /// Step of a code.
    pub per_code: f64,
    /// Highest code.
    pub highest: i32,
    /// Values just below and above the plausible range.
    pub beyond: [f64; 2],
}

/// Config at start-up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Defaults {
    /// Adaptation law.
    #[serde(serialize_with = "in_lower_case")]
    pub law: Law,
    /// Meaning of the set-point.
    #[serde(serialize_with = "in_lower_case")]
    pub setpoint: SetpointKind,
    /// ω or ω1 per run.
    pub level_weight: f64,
    /// ω2 per run.
    pub drift_weight: f64,
    /// Ticks per run.
    pub run_interval: u32,
    /// Slew limit, codes per tick.
    pub max_step: i32,
    /// Control period the slew limit was derived for, s.
    pub period: f64,
    /// ρ̂ of a leg, m/V: the virtual drive X is q̂/ρ̂.
    pub leg_gain: f64,
}

/// Data of the controller's self-check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Integrity {
    /// Compiler, platform and spec in one line, kept in every image.
    pub identity: String,
    /// The settings as words, in the order of the emitted `CONFIG_NAMES`.
    #[serde(serialize_with = "as_hex")]
    pub settings: Vec<u64>,
    /// CRC-32 of identity, tables, trajectories and settings.
    pub crc: u32,
}

/// The name of a variant, without its contents.
fn in_lower_case<S: Serializer>(choice: &impl core::fmt::Debug, serializer: S) -> Result<S::Ok, S::Error> {
    let shown = format!("{choice:?}").to_lowercase();
    serializer.serialize_str(shown.split('(').next().unwrap_or(&shown))
}

/// Words in hexadecimal; readers that only support `f64` would round numbers.
fn as_hex<S: Serializer>(words: &[u64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(words.iter().map(|word| format!("{word:#x}")))
}
