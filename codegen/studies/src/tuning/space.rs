//! Tunable parameters and their bounds: maps numbers in [0, 1] to settings on a logarithmic scale, and back.
//!
//! Gains are relative to the stiffness of their axis, K_ii = (Jᵀ k_a J)_ii: `kp` and `kv`·rad/s as ratios, `ki` in 1/s. A
//! setting is already rounded to four digits here, so the scored setting is the one written into the spec.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::Setting;
use specgen_compiler::compile::Compilation;
use specgen_compiler::lower::platform;
use specgen_compiler::stability::platform::{RestDynamics, start_law, start_mode};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;
use specgen_runtime::{ControlMode, Law};

/// Which parameters to tune.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum TunedNumbers {
    /// Gains of the feedback.
    Gains,
    /// Weights or bandwidths of the adaptation.
    Weights,
    /// Both, as far as the spec's mode uses them.
    All,
}

impl TunedNumbers {
    /// Its name for `--what`.
    fn name(self) -> &'static str {
        match self {
            Self::Gains => "gains",
            Self::Weights => "weights",
            Self::All => "all",
        }
    }
}

/// Meaning of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Role {
    /// k_p of an axis.
    Proportional(usize),
    /// k_I of an axis.
    Integral(usize),
    /// k_v of an axis.
    Derivative(usize),
    /// ω1 or Ω1.
    Level,
    /// ω2 or Ω2.
    Drift,
}

impl Role {
    fn group(self) -> &'static str {
        match self {
            Self::Proportional(_) => "kp",
            Self::Integral(_) => "ki",
            Self::Derivative(_) => "kv",
            Self::Level => "level",
            Self::Drift => "drift",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Proportional(axis) | Self::Integral(axis) | Self::Derivative(axis) => {
                write!(f, "{}[{axis}]", self.group())
            }
            Self::Level | Self::Drift => f.write_str(self.group()),
        }
    }
}

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parameter {
    /// Its meaning.
    pub role: Role,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
}

/// Bounds given by the user for a group of parameters: `kp`, `ki`, `kv`, `level`, `drift`.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenBounds {
    /// The group.
    pub group: String,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
}

/// All tuned parameters, and the setting for the others.
#[derive(Debug, Clone)]
pub struct Space {
    /// The parameters.
    pub parameters: Vec<Parameter>,
    /// K_ii; ones for legs.
    stiffness: [f64; 6],
    /// Whether the gains are those of mode P.
    pub alone: bool,
    base: Setting,
}

const PROPORTIONAL: [f64; 2] = [2e-3, 4.0];
const INTEGRAL: [f64; 2] = [5.0, 5000.0];
const DERIVATIVE: [f64; 2] = [1e-6, 1e-3];
const WEIGHTS: [[f64; 2]; 2] = [[1e-3, 1.0], [1e-4, 1.0]];

impl Space {
    /// The space selected by `what` for a compiled spec, within the default or given bounds.
    ///
    /// # Errors
    /// If the spec's mode uses none of these parameters, or bounds are empty or for a parameter that is not tuned.
    pub fn of(compiled: &Compilation, what: TunedNumbers, given: &[GivenBounds]) -> Result<Self, Vec<Diagnostic>> {
        let model = &compiled.model;
        let mode = model.task_space.as_ref().map(|task| start_mode(model, task));
        let base = Setting::of(compiled);
        let mut parameters = Vec::new();
        let mut add = |role: Role, bounds: [f64; 2]| parameters.push(Parameter { role, bounds });
        let mut stiffness = [1.0; 6];
        let alone = mode.is_some_and(ControlMode::uses_position_gains);
        if let Some(design) = &compiled.design {
            stiffness = axis_stiffness(model);
            if what != TunedNumbers::Weights && mode.is_some_and(ControlMode::feeds_back) {
                let damped = if alone { design.position } else { design.combined }.derivative != [0.0; 6];
                (0..6).for_each(|axis| add(Role::Proportional(axis), PROPORTIONAL));
                (0..6).for_each(|axis| add(Role::Integral(axis), INTEGRAL));
                if damped {
                    (0..6).for_each(|axis| add(Role::Derivative(axis), DERIVATIVE));
                }
            }
        }
        if what != TunedNumbers::Gains {
            let bandwidths = compiled.design.as_ref().map(|design| {
                let most = design.bandwidth_limit;
                [[0.01 * most, most], [1e-4 * most, 0.5 * most]]
            });
            let [level, drift] = bandwidths.unwrap_or(WEIGHTS);
            let law = mode.map_or_else(|| start_law(model), ControlMode::law);
            if law != Law::Invhys {
                add(Role::Level, level);
            }
            if law == Law::Pcc {
                add(Role::Drift, drift);
            }
        }
        let refuse = |code, message: String, help: &str| {
            let keys = ["adaptation.mode", "control.mode", "control"];
            vec![Diagnostic::at(&model.spans, &keys, code, message, help)]
        };
        if parameters.is_empty() {
            let kind =
                if mode.is_some() { "this mode of the platform controller" } else { "this spec without [control]" };
            return Err(refuse(
                codes::TUNE_NOTHING,
                format!("{kind} uses none of the selected parameters (--what {})", what.name()),
                "weights need adaptation.mode = \"ewma\" or \"pcc\" and control.mode other than \"p\"; gains need [control] \
                 with mode = \"p\" or \"p/f\"; or tune all that are used, with --what all",
            ));
        }
        for GivenBounds { group, bounds } in given {
            let [low, high] = *bounds;
            if !(low > 0.0 && high > low && high.is_finite()) {
                return Err(refuse(
                    codes::TUNE_BOUNDS,
                    format!("the bounds of {group}, {low} to {high}, are empty: expected 0 < low < high"),
                    "give the smaller value first: --bounds ki=10:1000",
                ));
            }
            let found = parameters.iter_mut().filter(|p| p.role.group() == group);
            if found.map(|p| p.bounds = *bounds).count() == 0 {
                return Err(refuse(
                    codes::TUNE_BOUNDS,
                    format!("bounds were given for {group}, which is not tuned"),
                    "bounds apply to kp, ki, kv, level and drift, as far as --what and the spec's mode include them",
                ));
            }
        }
        Ok(Self { parameters, stiffness, alone, base })
    }

    /// Number of parameters.
    pub fn dimension(&self) -> usize {
        self.parameters.len()
    }

    /// The setting for numbers in [0, 1]; others are clipped.
    pub fn setting(&self, genes: &[f64]) -> Setting {
        let mut setting = self.base;
        for (parameter, gene) in self.parameters.iter().zip(genes) {
            let [low, high] = parameter.bounds;
            let gene = if *gene > 1.0 {
                1.0
            } else if *gene > 0.0 {
                *gene
            } else {
                0.0
            };
            let value = low * libm::exp(gene * libm::log(high / low));
            self.put(&mut setting, parameter.role, value);
        }
        setting
    }

    /// The setting with these parameters by name, in the unit of the bounds; the others keep their values from the spec.
    ///
    /// # Errors
    /// A message if a name is unknown or a value is outside its bounds.
    pub fn named(&self, values: &BTreeMap<String, f64>) -> Result<Setting, String> {
        let mut setting = self.base;
        for (name, value) in values {
            let Some(parameter) = self.parameters.iter().find(|parameter| parameter.role.to_string() == *name) else {
                let known: Vec<String> = self.parameters.iter().map(|parameter| parameter.role.to_string()).collect();
                return Err(format!("no tuned parameter is called `{name}`; expected {}", known.join(", ")));
            };
            let [low, high] = parameter.bounds;
            if !(low..=high).contains(value) {
                return Err(format!(
                    "{name} is {value}, outside its bounds {low:e} to {high:e}; change them with --bounds"
                ));
            }
            self.put(&mut setting, parameter.role, *value);
        }
        Ok(setting)
    }

    /// The numbers in [0, 1] for a setting, or for the nearest one within bounds.
    pub fn genes(&self, setting: &Setting) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|parameter| {
                let [low, high] = parameter.bounds;
                let value = self.value(setting, parameter.role);
                let gene = if value > 0.0 { libm::log(value / low) / libm::log(high / low) } else { 0.0 };
                if gene > 1.0 {
                    1.0
                } else if gene > 0.0 {
                    gene
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// The stiffness that gains are relative to.
    pub fn stiffness(&self) -> &[f64; 6] {
        &self.stiffness
    }

    fn put(&self, setting: &mut Setting, role: Role, value: f64) {
        match setting {
            Setting::Legs { level, drift } => match role {
                Role::Level => *level = rounded(value),
                Role::Drift => *drift = rounded(value),
                _ => {}
            },
            Setting::Platform { combined, position, .. } => {
                let gains = if self.alone { position } else { &mut *combined };
                match role {
                    Role::Proportional(axis) => gains.proportional[axis] = rounded(value * self.stiffness[axis]),
                    Role::Integral(axis) => gains.integral[axis] = rounded(value * self.stiffness[axis]),
                    Role::Derivative(axis) => gains.derivative[axis] = rounded(value * self.stiffness[axis]),
                    Role::Level => combined.level_bandwidth = rounded(value),
                    Role::Drift => combined.drift_bandwidth = rounded(value),
                }
            }
        }
    }

    /// A parameter of `setting`: gains relative to the stiffness of their axis.
    pub fn value(&self, setting: &Setting, role: Role) -> f64 {
        match setting {
            Setting::Legs { level, drift } => match role {
                Role::Level => *level,
                Role::Drift => *drift,
                _ => 0.0,
            },
            Setting::Platform { combined, position, .. } => {
                let gains = if self.alone { position } else { combined };
                match role {
                    Role::Proportional(axis) => gains.proportional[axis] / self.stiffness[axis],
                    Role::Integral(axis) => gains.integral[axis] / self.stiffness[axis],
                    Role::Derivative(axis) => gains.derivative[axis] / self.stiffness[axis],
                    Role::Level => combined.level_bandwidth,
                    Role::Drift => combined.drift_bandwidth,
                }
            }
        }
    }
}

/// K_ii = (Jᵀ k_a J)_ii at rest for a compiled model, N/m and N m/rad.
pub fn axis_stiffness(model: &Model) -> [f64; 6] {
    // Compilation succeeded, so the fallback is never used.
    let Ok(platform) = platform(model) else { return [1.0; 6] };
    let jacobian = RestDynamics::of(&platform).jacobian;
    std::array::from_fn(|axis| {
        jacobian.iter().map(|row| row[axis] * row[axis]).sum::<f64>() * model.actuator.axial_stiffness
    })
}

/// Rounds to four significant digits through the decimal text that the spec will contain: the double nearest to that text.
pub fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
