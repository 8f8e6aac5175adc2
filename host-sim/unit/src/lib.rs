//! The simulated machine of a spec, stepped by words: what `specgen export fmu --plant` builds into an FMI 2.0 unit.
//!
//! ```text
//! Description (JSON, from a spec) ─┬─► Plant ─hold(inputs)─► read(outputs)
//! Settings (seed, noise, ratios) ──┘
//! ```
//! It is the machine of `specgen sim`: the same calls in the same order, so that a controller in the loop gets the same bits. All
//! words have 64 bits: reals by their bit pattern, whole numbers zero-extended. [`ffi`] is the same for C.

pub mod ffi;

use std::fmt;

use host_sim::closed_loop::{LEGS, Preparation};
use host_sim::machine::Machine;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::rig::Noise;
use host_sim::platform::{GaugeSignal, PlatformParameters, PlatformRig, Specimen, Wrench};
use host_sim::scenario::LegScenario;
use serde::{Deserialize, Serialize};

/// Samples per period of the paper's trajectory, which is not run here.
const NO_TRAJECTORY: u32 = 1;
/// Ratios of a machine to its data sheet that are taken.
const RATIOS: [f64; 2] = [0.1, 10.0];

/// What a spec says of its machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Control period, s: how long voltages are held.
    pub period: f64,
    /// A leg without tolerances, with the gauge and the amplifier of the spec.
    pub leg: LegParameters,
    /// What the legs move.
    pub kind: Kind,
}

/// What six legs move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Kind {
    /// A platform, seen by six gauges.
    Platform {
        /// Its data sheet.
        nominal: Box<PlatformParameters>,
        /// Polynomials V → m of gauges that give volts, see [`GaugeSignal::Volts`].
        calibration: Option<[Vec<f64>; 6]>,
    },
    /// Nothing: each has its own gauge.
    Legs {
        /// Lowest voltage, and the one at which the legs stand before a run, V.
        voltages: [f64; 2],
    },
}

/// What may be chosen of a machine before it is prepared; in the order of their words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Of noise and tolerances.
    pub seed: u32,
    /// Whether gauges, amplifiers and force sensor have noise and steps.
    pub noise: bool,
    /// Whether the legs of a platform are out of tolerance, as those of `specgen sim` are. Legs without a platform never are.
    pub tolerances: bool,
    /// Stiffness of the legs by that of the data sheet; of legs without a platform it moves their resonance.
    pub stiffness_ratio: f64,
    /// Gain of the legs by that of the data sheet.
    pub gain_ratio: f64,
}

impl Default for Settings {
    /// The machine of `specgen sim`.
    fn default() -> Self {
        Self { seed: 1, noise: true, tolerances: true, stiffness_ratio: 1.0, gain_ratio: 1.0 }
    }
}

/// Names of the settings, and whether each is a real.
pub const SETTINGS: [(&str, bool); 5] =
    [("seed", false), ("noise", false), ("tolerances", false), ("stiffness_ratio", true), ("gain_ratio", true)];

impl Settings {
    /// Their words, one for each of [`SETTINGS`].
    pub fn words(&self) -> [u64; SETTINGS.len()] {
        let whole = [u64::from(self.seed), u64::from(self.noise), u64::from(self.tolerances)];
        [whole[0], whole[1], whole[2], self.stiffness_ratio.to_bits(), self.gain_ratio.to_bits()]
    }

    /// Settings of these words.
    ///
    /// # Errors
    /// [`UnitError`], if one is out of its range.
    pub fn of(words: &[u64; SETTINGS.len()]) -> Result<Self, UnitError> {
        let flag = |word: u64, why| if word < 2 { Ok(word == 1) } else { Err(UnitError(why)) };
        let ratio = |word, why| {
            let value = f64::from_bits(word);
            if (RATIOS[0]..=RATIOS[1]).contains(&value) { Ok(value) } else { Err(UnitError(why)) }
        };
        let seed = u32::try_from(words[0]).ok().filter(|seed| *seed <= i32::MAX as u32);
        Ok(Self {
            seed: seed.ok_or(UnitError(c"settings.seed is out of its range: expected 0 to 2147483647"))?,
            noise: flag(words[1], c"settings.noise is out of its range: expected 0 or 1")?,
            tolerances: flag(words[2], c"settings.tolerances is out of its range: expected 0 or 1")?,
            stiffness_ratio: ratio(words[3], c"settings.stiffness_ratio is out of its range: expected 0.1 to 10")?,
            gain_ratio: ratio(words[4], c"settings.gain_ratio is out of its range: expected 0.1 to 10")?,
        })
    }
}

/// Why something was not taken; for C as well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnitError(pub &'static std::ffi::CStr);

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.to_string_lossy())
    }
}

impl std::error::Error for UnitError {}

impl Description {
    /// Stems of the inputs: six reals each. `voltage` in V; `disturbance` is a force (N) and torque (N m) on the platform about P_C
    /// in base axes, held until it is changed.
    pub fn inputs(&self) -> &'static [&'static str] {
        match self.kind {
            Kind::Platform { .. } => &["voltage", "disturbance"],
            Kind::Legs { .. } => &["voltage"],
        }
    }

    /// Stems of the outputs: six reals each. What a controller reads comes first under the names that it has there: `gauge` in the
    /// unit that the controller takes (m or V) and `wrench` of the force sensor (N, N m), or `displacement` (m). Then what no sensor
    /// tells: `true_pose` from rest (m, rad), `true_extension` of the legs from rest (m), `stack_voltage` from the lowest (V); or
    /// `true_displacement` (m).
    pub fn outputs(&self) -> &'static [&'static str] {
        match self.kind {
            Kind::Platform { .. } => &["gauge", "wrench", "true_pose", "true_extension", "stack_voltage"],
            Kind::Legs { .. } => &["displacement", "true_displacement"],
        }
    }

    /// Voltage at which the legs stand before the first tick, V.
    pub fn rest_voltage(&self) -> f64 {
        match &self.kind {
            Kind::Platform { nominal, .. } => nominal.rest_voltage_v,
            Kind::Legs { voltages, .. } => voltages[1],
        }
    }

    /// The machine after its pre-cycle, at rest with the gauges zeroed.
    pub fn prepared(&self, settings: &Settings) -> Plant {
        let Settings { seed, noise, tolerances, stiffness_ratio, gain_ratio } = *settings;
        let seed = u64::from(seed);
        match &self.kind {
            Kind::Platform { nominal, calibration } => {
                let mut specimen = match tolerances {
                    true => Specimen::within_tolerances(nominal, &self.leg, seed),
                    false => Specimen::ideal(nominal, &self.leg),
                };
                specimen.stiffness.iter_mut().for_each(|stiffness| *stiffness *= stiffness_ratio);
                specimen.legs.iter_mut().for_each(|leg| leg.gain_um_per_v *= gain_ratio);
                let noise = if noise { Noise::of(&specimen) } else { Noise::NONE };
                let mut rig = PlatformRig::new(&specimen, &noise, seed);
                rig.prepare(&Preparation::of(&specimen.legs[0], nominal.rest_voltage_v - nominal.lowest_voltage_v));
                if let Some(calibration) = calibration {
                    rig = rig.with_signal(GaugeSignal::Volts(calibration.clone()));
                }
                // As `specgen sim` takes them.
                rig.plant_mut().step_whole_ticks(self.period);
                Plant(Machine::Platform(Box::new(rig)))
            }
            Kind::Legs { voltages } => {
                let mut leg = self.leg.clone();
                leg.gain_um_per_v *= gain_ratio;
                leg.fn_hz *= stiffness_ratio.sqrt();
                let noise = if noise { leg.noise } else { NoiseParameters::NONE };
                let legs: [_; LEGS] = std::array::from_fn(|_| leg.clone());
                let scenario = LegScenario::resting(&legs, &noise, seed, NO_TRAJECTORY, *voltages);
                Plant(Machine::Legs(Box::new(scenario.rig().clone())))
            }
        }
    }
}

/// A prepared machine.
#[derive(Debug, Clone)]
pub struct Plant(Machine);

impl Plant {
    /// Holds the inputs for `interval` (s): six reals for each of [`Description::inputs`].
    ///
    /// # Errors
    /// [`UnitError`], if one is missing or no number; nothing has moved then.
    pub fn hold(&mut self, inputs: &[f64], interval: f64) -> Result<(), UnitError> {
        if !inputs.iter().all(|input| input.is_finite()) {
            return Err(UnitError(
                c"an input is not a finite number: check what is connected to voltage and disturbance",
            ));
        }
        let six = |stem: usize| inputs.get(6 * stem..6 * stem + 6).and_then(|six| <[f64; 6]>::try_from(six).ok());
        let missing = UnitError(c"inputs are missing");
        let voltages = six(0).ok_or(missing)?;
        if let Machine::Platform(rig) = &mut self.0 {
            let [fx, fy, fz, tx, ty, tz] = six(1).ok_or(missing)?;
            rig.plant_mut().disturb(&Wrench { force: [fx, fy, fz], torque: [tx, ty, tz] });
        }
        self.0.hold(&voltages, interval);
        Ok(())
    }

    /// Reads the sensors, whose noise is drawn, and looks at the rest: six reals for each of [`Description::outputs`].
    pub fn read(&mut self, outputs: &mut [f64]) {
        let found: Vec<[f64; 6]> = match &mut self.0 {
            Machine::Platform(rig) => {
                let (gauge, wrench) = (rig.read_gauges(), rig.read_wrench());
                let plant = rig.plant();
                let pose = plant.pose();
                let extension = plant.structure().parameters().geometry.extensions(&pose);
                vec![gauge, wrench, pose, extension, plant.stack_voltages()]
            }
            Machine::Legs(rig) => vec![rig.read(), rig.displacements()],
        };
        outputs.iter_mut().zip(found.as_flattened()).for_each(|(output, value)| *output = *value);
    }
}
