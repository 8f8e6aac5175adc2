//! The checked platform: SI units, no optional value that the controller needs, every number finite and in range.
//!
//! Vectors are in the base frame {B} or the platform frame {P} as stated; angles in rad. Each section of a spec is
//! declared once: its keys with shape, range, unit, default, symbol and text, and the fields that they fill.

mod electronics;
mod hysteresis;
pub(crate) mod joints;
mod mcu;
mod mechanics;
pub(crate) mod structure;
mod supervisor;
mod target;
mod task_space;
mod trigger;

use std::collections::BTreeMap;
use std::ops;

use crate::keys::SCHEMA_VERSION;
use crate::keys::declare::*;

pub use electronics::{Actuator, Amplifier, Dac, Sensor};
pub use hysteresis::{
    Adaptation, AdaptationMode, Hysteresis, LARGEST_RUN_INTERVAL, LegModelKind, MAX_GRID, RateDependence,
};
pub use mcu::{BOARDS, Mcu, Part};
pub use mechanics::{Geometry, LARGEST_TRAVEL, LARGEST_TURN, LegBody, RigidBody, Workspace};
pub use structure::{StructuralKind, StructuralMode, StructuralUncertainty};
pub use supervisor::{FaultAction, LARGEST_PULSE, LONGEST_TIMEOUT, LegMakes, Robust, Supervisor, WiringCheck};
pub use target::{Budget, ControllerOptions, Lint, Requirements, Scalar, SetpointKind, Target, Timing, TrackingLimit};
pub(crate) use task_space::unit;
pub use task_space::{
    CORRECTION_SHARE, ControlMode, DynamicsChoice, Environment, Frames, Gains, Interaction, LARGEST_GAIN, PaperPath,
    Probe, SetpointRules, StoredDesign, TaskSpace, Trajectory, TrajectoryKind,
};
pub use trigger::{MAX_OUTPUTS, Trigger, TriggerDirection, TriggerKind};

/// Every section, in the order of the reference. Sections that hold others come before them.
pub static SECTIONS: &[Section] = &[
    START,
    Geometry::SECTION,
    RigidBody::SECTION,
    LegBody::SECTION,
    Actuator::SECTION,
    Amplifier::SECTION,
    Dac::SECTION,
    Sensor::SECTION,
    Hysteresis::SECTION,
    Adaptation::SECTION,
    TaskSpace::SECTION,
    Environment::SECTION,
    SetpointRules::SECTION,
    Frames::SECTION,
    StoredDesign::SECTION,
    Gains::SECTION,
    Gains::OF_POSITION,
    Probe::SECTION,
    Trajectory::SECTION,
    Trigger::SECTION,
    StructuralMode::SECTION,
    Timing::SECTION,
    Workspace::SECTION,
    ControllerOptions::SECTION,
    Requirements::SECTION,
    TrackingLimit::SECTION,
    Supervisor::SECTION,
    WiringCheck::SECTION,
    Target::SECTION,
    Budget::SECTION,
    Robust::SECTION,
    StructuralUncertainty::SECTION,
    Lint::SECTION,
];

const START: Section = Section {
    name: "",
    kind: Kind::Plain,
    aliases: &[],
    doc: "The keys before the first section.",
    keys: &[
        Key {
            name: "schema",
            shape: integer(SCHEMA_VERSION, SCHEMA_VERSION),
            presence: Presence::Required,
            doc: "Version of this language.",
            symbol: "",
            aliases: &[],
            example: "1",
        },
        Key {
            name: "name",
            shape: NAME,
            presence: Presence::Required,
            doc: "Name of the platform: a letter, then letters, digits, `-` and `_`.",
            symbol: "",
            aliases: &[],
            example: r#""reference""#,
        },
        Key {
            name: "assumed",
            shape: Shape::Paths,
            presence: Presence::Default("[]"),
            doc: "Values of this spec that are assumed, neither given nor measured, each by the path of its key; a repeated section such as `gauge` means all of its tables. The verdict counts them, and a real board or card accepts the controller only with `--assumed-ok`. Remove an entry once its value is measured or known. Entries do not change the law.",
            symbol: "",
            aliases: &["assumptions", "guessed", "estimated", "unmeasured"],
            example: r#"["sensor.noise"]"#,
        },
    ],
};

/// A spec that passed every check that needs no computation.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Name of the platform: ASCII letters, digits, `-` and `_`.
    pub name: String,
    /// Paths of keys and repeated sections whose values are assumed, neither given nor measured, in the order of the
    /// spec. Each names a value in the spec; no two are equal.
    pub assumed: Vec<String>,
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
    /// Displacement gauge of a leg, or with `task_space` one of the six that measure the platform.
    pub sensor: Sensor,
    /// Source of the hysteresis tables.
    pub hysteresis: Hysteresis,
    /// Run-to-run adaptation, Appendix B.
    pub adaptation: Adaptation,
    /// Control timing.
    pub timing: Timing,
    /// Poses that the controller accepts.
    pub workspace: Workspace,
    /// What is emitted.
    pub controller: ControllerOptions,
    /// Where the controller runs.
    pub target: Target,
    /// The task-space controller: a spec with `[control]`. None: six legs, each with its own gauge.
    pub task_space: Option<TaskSpace>,
    /// Requirements on the platform.
    pub requirements: Requirements,
    /// Limits of the supervisor.
    pub supervisor: Supervisor,
    /// What `specgen robust` varies, and its gate; no constant of the controller comes from here.
    pub robust: Robust,
    /// Known modes of the structure, in the order of the spec; none without `task_space`.
    pub structural_modes: Vec<StructuralMode>,
    /// Modes of the structure that the spec does not list.
    pub structure: StructuralUncertainty,
    /// Exceptions from the physical lint, with reasons.
    pub lint: Lint,
    /// Place of each key in the spec file, by key path (`actuator.voltage[1]`), for findings of later phases.
    pub spans: BTreeMap<String, ops::Range<usize>>,
}

impl Model {
    /// The model; `None` if a value is missing, for which there is a finding.
    pub(crate) fn read(fields: &Fields) -> Option<Self> {
        let controlled = fields.table("control").is_some();
        let task_space = if controlled { Some(TaskSpace::read(fields, "control")?) } else { None };
        Some(Self {
            name: Value::read(fields, "name")?,
            assumed: Value::read(fields, "assumed")?,
            geometry: Geometry::read(fields, "geometry")?,
            platform: RigidBody::read(fields, "platform")?,
            leg: LegBody::read(fields, "leg")?,
            actuator: Actuator::read(fields, "actuator")?,
            amplifier: Amplifier::read(fields, "amplifier")?,
            dac: Dac::read(fields, "dac")?,
            sensor: Sensor::read(fields, "sensor")?,
            hysteresis: Hysteresis::read(fields, "hysteresis")?,
            adaptation: Adaptation::read(fields, "adaptation")?,
            timing: Timing::read(fields, "timing")?,
            workspace: Workspace::read(fields, "workspace")?,
            controller: ControllerOptions::read(fields, "controller")?,
            target: Target::read(fields, "target")?,
            task_space,
            requirements: Requirements::read(fields, "requirements")?,
            supervisor: Supervisor::read(fields, "supervisor")?,
            robust: Robust::read(fields, "robust")?,
            structural_modes: (0..fields.count("mode"))
                .map(|index| StructuralMode::read(fields, &format!("mode[{index}]")))
                .collect::<Option<_>>()?,
            structure: StructuralUncertainty::read(fields, "robust.structure")?,
            lint: Lint::read(fields, "lint").unwrap_or(Lint { allow: Vec::new() }),
            spans: fields.spans(),
        })
    }

    /// Voltage of the legs while disarmed, V; within the limits of a spec that compiles.
    pub fn rest_voltage(&self) -> f64 {
        let [low, high] = self.actuator.voltage;
        self.supervisor.rest_voltage.unwrap_or_else(|| Self::nearest_to_zero(low, high))
    }

    /// The voltage from `low` to `high` (V) nearest to that of a stack whose amplifier is off.
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
