//! The simulated machine of a spec: everything that the spec says about the machine, nothing about the controller.
//!
//! What a spec does not specify is taken from the reference plant: hysteresis, creep and asymmetry of a leg, scaled to the
//! declared leg gain and voltages; the force sensor. The legs deviate from nominal within their tolerances.

use core::array::from_fn;
use std::path::PathBuf;

use host_sim::closed_loop::{LEGS, RunError};
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::rig::{Noise, OnBoard, PlatformRig, RunOptions};
use host_sim::platform::{
    Cable, GaugeSignal, Imperfections, Joints, Mains, ModePlace, PlatformParameters, PlatformScenario, Probe, Specimen,
    StructuralMode, UserFrames,
};
use host_sim::scenario::LegScenario;

use serde::{Deserialize, Serialize};

use specgen_compiler::compile::Compilation;
use specgen_language::files;
use specgen_language::model::{self as language, Model, StructuralKind, TaskSpace};
use specgen_language::outcome::Failure;

/// Gain of the reference leg's controller, 5 × 0.1262 µm/V, to which its measured gain is related, m/V.
const REFERENCE_GAIN: f64 = 0.631e-6;
/// Minimum number of integration steps per period of the fastest mode.
const STEPS_PER_PERIOD: f64 = 60.0;
/// Longest and shortest integration step, s.
const STEPS: [f64; 2] = [1e-7, 2e-5];
/// Rest at the bias pose before a run, s.
const SETTLE: f64 = 0.2;

/// The failure of a command whose simulated run failed.
pub fn run_failure(error: RunError) -> Failure {
    let message = error.to_string();
    match error {
        RunError::EndedEarly { .. } | RunError::NotEnded { .. } => {
            Failure::EndedEarly { message, result: serde_json::Value::Null }
        }
        _ => Failure::Environment(message),
    }
}

/// Options of the simulated legs.
#[derive(Debug, Clone)]
pub struct PlantOptions {
    /// A built-in leg, or a file of leg parameters: the shape of the hysteresis. Default: the reference leg.
    pub plant: Option<PathBuf>,
    /// No noise and no quantisation of gauge and amplifier.
    pub no_noise: bool,
    /// Seed of the noise and of the tolerances of a platform.
    pub seed: u64,
}

impl PlantOptions {
    /// Parameters of the leg.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn leg(&self) -> Result<LegParameters, Failure> {
        match &self.plant {
            Some(path) => LegParameters::named(path, files::text).map_err(|error| Failure::Gate(error.to_string())),
            None => Ok(LegParameters::reference()),
        }
    }

    /// The leg and its noise.
    ///
    /// # Errors
    /// As [`Self::leg`].
    pub fn read(&self) -> Result<(LegParameters, NoiseParameters), Failure> {
        let leg = self.leg()?;
        let noise = if self.no_noise { NoiseParameters::NONE } else { leg.noise };
        Ok((leg, noise))
    }

    /// A platform of such legs with tolerances, prepared.
    ///
    /// # Errors
    /// As [`Self::leg`].
    pub fn platform(&self, model: &Model, task: &TaskSpace) -> Result<(Specimen, PlatformScenario), Failure> {
        Ok(self.platform_of(model, task, &self.leg()?))
    }

    /// The same with another leg.
    pub fn platform_of(&self, model: &Model, task: &TaskSpace, leg: &LegParameters) -> (Specimen, PlatformScenario) {
        let specimen = specimen(model, task, leg, Some(self.seed));
        let noise = if self.no_noise { Noise::NONE } else { Noise::of(&specimen) };
        let scenario = scenario(model, task, &specimen, &noise, self.seed);
        (specimen, scenario)
    }
}

/// Six legs with these parameters under the voltages of the spec, prepared.
pub fn legs(
    model: &Model,
    parameters: &[LegParameters; LEGS],
    noise: &NoiseParameters,
    seed: u64,
    samples_per_period: u32,
) -> LegScenario {
    let voltages = [model.actuator.voltage[0], model.rest_voltage()];
    LegScenario::resting(parameters, noise, seed, samples_per_period, voltages)
}

/// A machine of the spec with tolerances from `seed` (legs ± 10 %, stiffness ± 5 %), or nominal if `None`. `leg`
/// gives the shape of the hysteresis.
pub fn specimen(model: &Model, task: &TaskSpace, leg: &LegParameters, seed: Option<u64>) -> Specimen {
    let leg = self::leg(model, leg);
    let mut nominal = nominal(model, task);
    // The usual step is too long for the modes of a stiff light platform.
    let fastest = Specimen::ideal(&nominal, &leg).structure().modes().0[5] / core::f64::consts::TAU;
    let needed = 1.0 / (STEPS_PER_PERIOD * fastest);
    nominal.step_s = if needed < STEPS[0] {
        STEPS[0]
    } else if needed < STEPS[1] {
        needed
    } else {
        STEPS[1]
    };
    match seed {
        Some(seed) => Specimen::within_tolerances(&nominal, &leg, seed),
        None => Specimen::ideal(&nominal, &leg),
    }
}

/// That machine, prepared, with the gauges of the spec and steps of one control interval; `noise` is from [`Noise::of`] or
/// [`Noise::NONE`].
pub fn scenario(model: &Model, task: &TaskSpace, specimen: &Specimen, noise: &Noise, seed: u64) -> PlatformScenario {
    let mut options = RunOptions::new(model.timing.period, bias(task));
    options.settle = SETTLE;
    options.frames =
        Some(UserFrames::new(&[task.frames.work[3], task.frames.work[4], task.frames.work[5]], task.frames.tool));
    let mut scenario = PlatformScenario::new(specimen, noise, seed, options);
    if let Some(calibration) = &task.calibration {
        let rig: PlatformRig = scenario.rig().clone().with_signal(GaugeSignal::Volts(calibration.clone()));
        *scenario.rig_mut() = rig;
    }
    let plant = scenario.rig_mut().plant_mut();
    plant.step_whole_ticks(model.timing.period);
    if let Some(cross_talk) = &model.actuator.cross_talk {
        plant.couple(cross_talk);
    }
    scenario
}

/// The trajectory with this number, as the controller plays it; `None` if the spec has none.
pub fn on_board(compiled: &Compilation, selector: u32) -> Option<OnBoard> {
    let setpoints = &compiled.ir.task_space.as_ref()?.setpoints;
    let path = &setpoints.trajectories.get(selector as usize)?.path;
    let approach = Some(path.start()).filter(|start| *start != setpoints.home);
    Some(OnBoard { selector, approach, ticks: path.ticks() as usize, repeats: path.repeats() })
}

/// Pose of the user's zero: the bias plus the offset of the work frame.
pub(crate) fn bias(task: &TaskSpace) -> [f64; 6] {
    let mut bias = task.setpoint.bias;
    for (value, offset) in bias.iter_mut().zip(&task.frames.work[..3]) {
        *value += offset;
    }
    bias
}

/// A leg with the displacement (µm), the voltages (V, from the lowest), the lag (s) and the noise of the spec; everything else,
/// such as the shape of the hysteresis and the creep, is that of `leg`.
pub fn leg(model: &Model, leg: &LegParameters) -> LegParameters {
    let [low, high] = model.actuator.voltage;
    let stretch = (high - low) / leg.u_max;
    let volts = |values: &[f64]| values.iter().map(|v| v * stretch).collect();
    let steps = libm::exp2(f64::from(model.sensor.bits));
    let mut stretched = leg.clone();
    stretched.widen(stretch);
    LegParameters {
        name: model.name.clone(),
        u_max: high - low,
        gain_um_per_v: leg.gain_um_per_v * model.actuator.leg_gain() / REFERENCE_GAIN,
        v0_v_per_s: leg.v0_v_per_s * stretch,
        creep_thresholds_v: volts(&leg.creep_thresholds_v),
        forc_rate_v_per_s: leg.forc_rate_v_per_s * stretch,
        tau_amp_s: model.amplifier.lag,
        gauge_lag_s: model.sensor.lag,
        fn_hz: model.actuator.resonance,
        zeta: model.actuator.damping_ratio,
        noise: NoiseParameters {
            sensor_nm_rms: model.sensor.noise * 1e9,
            adc_lsb_nm: (model.sensor.range[1] - model.sensor.range[0]) / steps * 1e9,
            amplifier_mv_rms: model.amplifier.noise * 1e3,
            ..leg.noise
        },
        ..stretched
    }
}

/// What the spec says about the structure beyond a rigid platform on six legs: its known modes.
fn known_structure(model: &Model) -> Imperfections {
    let mode = |mode: &language::StructuralMode| StructuralMode {
        place: match mode.kind {
            StructuralKind::Leg => ModePlace::Leg(mode.place),
            StructuralKind::Gauge => ModePlace::Gauge(mode.place),
            StructuralKind::Frame => ModePlace::Frame,
        },
        frequency_hz: mode.frequency,
        damping_ratio: mode.damping_ratio,
        participation: (mode.kind != StructuralKind::Leg).then_some(mode.participation),
    };
    Imperfections { modes: model.structural_modes.iter().map(mode).collect(), ..Imperfections::default() }
}

/// Highest frequency of a random structural mode, Hz.
const HIGHEST: f64 = 5e3;

/// Ranges of a random structure with one mode that the controller does not know.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureRange {
    /// Lowest frequency of the mode, Hz.
    pub from_hz: f64,
    /// Highest, Hz.
    pub to_hz: f64,
    /// Its damping ratio.
    pub damping_ratio: [f64; 2],
    /// Where it may act, with the participation.
    pub kinds: Vec<(ModePlace, Option<f64>)>,
}

impl StructureRange {
    /// That of a spec, up to 5 kHz and three times the least damping ratio; `machine` gives the default of f0.
    pub fn of(model: &Model, machine: &Specimen) -> Self {
        let declared = &model.structure;
        let lowest = machine.structure().modes().0[0] / core::f64::consts::TAU;
        let from_hz = declared.from_hz(lowest);
        let kind = |kind: &StructuralKind| match kind {
            StructuralKind::Leg => (ModePlace::Leg(None), None),
            StructuralKind::Gauge => (ModePlace::Gauge(None), Some(declared.gauge_participation)),
            StructuralKind::Frame => (ModePlace::Frame, Some(declared.frame_participation)),
        };
        Self {
            from_hz,
            to_hz: if from_hz > HIGHEST { from_hz } else { HIGHEST },
            damping_ratio: [declared.damping_ratio, 3.0 * declared.damping_ratio],
            kinds: declared.kinds.iter().map(kind).collect(),
        }
    }
}

/// Largest transverse stiffness of a joint over the axial one of its leg.
const STIFFEST_JOINT: f64 = 0.05;
/// Largest amplitude of the mains in a gauge, m, and their frequency, Hz.
const MAINS: (f64, f64) = (2e-9, 50.0);
/// Fastest drift of a gauge, m/s: 0.1 m of steel that warms up by 0.1 K a minute.
const DRIFT: f64 = 2e-9;
/// Stiffest cable, N/m, and its largest friction, N.
const CABLE: (f64, f64) = (1e4, 0.1);
/// Largest jitter of the instant of reading, s rms.
const JITTER: f64 = 1e-6;

/// A random structure as shares (0 to 1) of its ranges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StructureShares {
    /// Of the mode: kind, frequency and damping ratio, the latter two on logarithmic scales.
    pub mode: [f64; 3],
    /// Stiffness of the joints.
    pub joints: f64,
    /// Mains: amplitude, gauge, phase.
    pub mains: [f64; 3],
    /// Drift of each gauge, either way.
    pub drift: [f64; LEGS],
    /// Cable: stiffness and friction along each axis.
    pub cable: [f64; 2],
    /// Jitter of the instant of reading.
    pub jitter: f64,
}

impl StructureShares {
    /// Only a mode, of one of several kinds, that is hardest to tolerate: with the lowest frequency and the least damping.
    pub fn worst(kind: usize, kinds: usize) -> Self {
        let mode = [(kind as f64 + 0.5) / kinds as f64, 0.0, 0.0];
        Self { mode, joints: 0.0, mains: [0.0; 3], drift: [0.5; LEGS], cable: [0.0; 2], jitter: 0.0 }
    }

    /// Adds this structure to a machine.
    pub fn add_to(&self, machine: &mut Imperfections, range: &StructureRange) {
        let one_of = |share: f64, count: usize| (share * count as f64) as usize;
        let log = |share: f64, low: f64, high: f64| low * libm::pow(high / low, share);
        let [kind, frequency, damping] = self.mode;
        if let Some((place, participation)) = range.kinds.get(one_of(kind, range.kinds.len())) {
            machine.modes.push(StructuralMode {
                place: *place,
                frequency_hz: log(frequency, range.from_hz, range.to_hz),
                damping_ratio: log(damping, range.damping_ratio[0], range.damping_ratio[1]),
                participation: *participation,
            });
        }
        machine.joint_stiffness_share = STIFFEST_JOINT * self.joints;
        let [amplitude, gauge, phase] = self.mains;
        machine.mains.push(Mains {
            amplitude_m: MAINS.0 * amplitude,
            frequency_hz: MAINS.1,
            gauge: Some(1 + one_of(gauge, LEGS)),
            phase_rad: core::f64::consts::TAU * phase,
        });
        machine.gauge_drift_m_per_s = self.drift.map(|share| DRIFT * (2.0 * share - 1.0));
        let [stiffness, friction] = self.cable;
        machine.cable =
            Some(Cable { stiffness_n_per_m: [CABLE.0 * stiffness; 3], friction_n: [CABLE.1 * friction; 3] });
        machine.timing_jitter_s = JITTER * self.jitter;
    }
}

fn nominal(model: &Model, task: &TaskSpace) -> PlatformParameters {
    let reference = PlatformParameters::reference();
    let (body, leg) = (&model.platform, &model.leg);
    let ([ixx, iyy, izz], [ixy, ixz, iyz]) = (body.inertia, body.products);
    PlatformParameters {
        name: model.name.clone(),
        joints: Some(Joints { base: model.geometry.base_joints, platform: model.geometry.platform_joints }),
        height_m: model.geometry.height,
        platform_mass_kg: body.mass,
        platform_inertia_kg_m2: [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]],
        platform_center_m: body.center_of_mass,
        fixed_mass_kg: leg.fixed_mass,
        extensible_mass_kg: leg.extensible_mass,
        fixed_inertia_kg_m2: leg.fixed_inertia,
        extensible_inertia_kg_m2: leg.extensible_inertia,
        fixed_center_m: leg.fixed_center,
        extensible_center_m: leg.extensible_center,
        axial_stiffness_n_per_m: model.actuator.axial_stiffness,
        modal_damping: task.modal_damping,
        // The current limit gives the slew rate of the spec.
        amplifier_current_a: model.actuator.slew_rate * reference.stack_capacitance_f,
        lowest_voltage_v: model.actuator.voltage[0],
        rest_voltage_v: model.rest_voltage(),
        probes: from_fn(|k| Probe {
            point: task.probes[k].point,
            direction: task.probes[k].direction,
            plane_point: task.probes[k].plane_point,
            plane_normal: task.probes[k].plane_normal,
        }),
        gauge_range_m: model.sensor.range,
        imperfections: known_structure(model),
        ..reference
    }
}
