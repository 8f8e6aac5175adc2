//! The target: arithmetic, rate, device and limits.

use super::Mcu;
use crate::keys::MAX_TABLES;
use crate::keys::declare::*;

const ERRORS: &[Item] = &six(
    item(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"),
    item(Dimension::ANGLE, Range::closed(1e-12, 1e-1), "nrad"),
);

const BYTES: Shape = one(Dimension::MEMORY, Range::closed(1.0, 1_099_511_627_776.0), "KiB");

section! {
    /// Control timing.
    ///
    /// In s.
    "timing" ["sampling", "rate", "clock"], Plain => Timing {
        /// Control period.
        period: f64 = one(Dimension::TIME, Range::closed(1e-6, 10.0), "us"), Required, "T_s" ["rate", "sample_rate", "sampling_rate", "sample_time", "sampling_time", "sampling_period", "frequency", "f_s", "dt", "control_rate", "loop_rate"], "200 us";
    }
}

choice! {
    /// Floating-point type of the emitted controller.
    Scalar {
        /// 32 bits.
        F32 = "f32",
        /// 64 bits.
        F64 = "f64",
    }
}

choice! {
    /// Meaning of the six set-point numbers at start-up.
    SetpointKind {
        /// Pose from rest, m and rad.
        Pose = "pose",
        /// Leg displacements, m.
        Leg = "leg",
    }
}

section! {
    /// What is emitted.
    "controller", Plain => ControllerOptions {
        /// Arithmetic of the controller.
        scalar: Scalar = one_of(Scalar::WORDS), Default("f64"), "", "f64";
        /// Meaning of the six set-point numbers at start-up: a pose, or leg displacements.
        setpoint: SetpointKind = one_of(SetpointKind::WORDS), Default("pose"), "", "pose";
    }
}

section! {
    /// Requirements on the platform. A spec that cannot meet them is refused.
    ///
    /// In m.
    "requirements" ["goals", "specification"], Optional => Requirements {
        /// Finest displacement that matters. A converter code must not move a leg by more, and half a code on every leg must not move the platform along an axis by more.
        precision: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "" ["resolution", "accuracy"], "50 nm";
        /// Largest noise of the measured pose at rest, including motion from amplifier noise: rms of each of x, y and z. `specgen check`, the main job and the report compare the spec with it.
        noise: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Rule("that of `precision`"), "" ["jitter", "stability", "noise_floor"], "5 nm";
        /// Largest noise at rest of θx, θy and θz, rms, each.
        rotation_noise: Option<f64> = one(Dimension::ANGLE, Range::closed(1e-12, 1e-1), "nrad"), Optional, "", "50 nrad";
    }
    and |fields, _table| {
        /// Limits of the tracking error.
        tracking: Vec<TrackingLimit> = (0..fields.count("requirements.tracking"))
            .map(|index| TrackingLimit::read(fields, &format!("requirements.tracking[{index}]")))
            .collect::<Option<_>>()?;
    }
}

impl Requirements {
    /// Largest noise at rest of the axis, 0 to 5, m or rad, and its key; none if the spec has no limit.
    pub fn noise_of(&self, axis: usize) -> Option<(f64, &'static str)> {
        if axis > 2 {
            return self.rotation_noise.map(|limit| (limit, "requirements.rotation_noise"));
        }
        let of_precision = self.precision.map(|limit| (limit, "requirements.precision"));
        self.noise.map(|limit| (limit, "requirements.noise")).or(of_precision)
    }
}

section! {
    /// Limit of the tracking error: largest rms error of the true pose. `specgen report` compares the simulated run with it; without a limit it only shows the error.
    ///
    /// In m and rad.
    "requirements.tracking", Repeated(0, MAX_TABLES) => TrackingLimit {
        /// The trajectory that the limit applies to; without it, all.
        trajectory: Option<String> = NAME, Optional, "", "circle";
        /// The operating frequency that the limit applies to; without it, that of the trajectory.
        frequency: Option<f64> = one(Dimension::FREQUENCY, Range::closed(1e-3, 1e3), "Hz"), Optional, "", "10 Hz";
        /// Largest norm of the errors of x, y and z, rms.
        translation: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "50 nm";
        /// Largest norm of the errors of θx, θy and θz, rms.
        rotation: Option<f64> = one(Dimension::ANGLE, Range::closed(1e-12, 1e-1), "nrad"), Optional, "", "500 nrad";
        /// Largest error of each axis, rms.
        axes: Option<[f64; 6]> = list(ERRORS), Optional, "", ["30 nm", "30 nm", "10 nm", "200 nrad", "200 nrad", "200 nrad"];
    }
}

section! {
    /// Exceptions from the physical lint. The controller does not use them.
    "lint", Optional => Lint {
        /// Keys whose values are intended although they disagree with other values, each with a reason. Findings about them become notes, including those that would be errors because a value is off by a factor of 7 or more.
        allow: Vec<String> = Shape::Reasons, Default([]), "", ["actuator.axial_stiffness: flexures in series, measured"];
    }
}

impl Lint {
    /// The reason that excepts `key`, or the list that it is an item of.
    pub fn reason(&self, key: &str) -> Option<&str> {
        self.reasons().find(|(allowed, _)| covers(allowed, key)).map(|(_, reason)| reason)
    }

    /// Each key with its reason.
    pub fn reasons(&self) -> impl Iterator<Item = (&str, &str)> {
        self.allow.iter().filter_map(|entry| entry.split_once(':')).map(|(key, reason)| (key.trim(), reason.trim()))
    }
}

/// Whether `key` is `allowed` or an item of it.
fn covers(allowed: &str, key: &str) -> bool {
    key.strip_prefix(allowed).is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
}

section! {
    /// Where the controller runs.
    "target" ["mcu", "board", "hardware"], Plain => Target {
        /// Microcontroller: `mps2-an500` and `stm32h743zi` are a Cortex-M7 with double-precision FPU, `mps2-an386` and `stm32f446re` a Cortex-M4F with single precision; the first of each is emulated.
        mcu: Mcu = one_of(&Mcu::NAMES), Default("mps2-an500"), "" ["processor", "part", "chip", "board", "cpu"], "mps2-an500";
    }
    and |fields, _table| {
        /// Resources that it may use.
        budget: Budget = Budget::read(fields, "target.budget")?;
    }
}

section! {
    /// Resources that the controller may use; a build that needs more is refused.
    ///
    /// In bytes and s; none if the spec has no limit.
    "target.budget", Plain => Budget {
        /// Flash.
        flash: Option<u64> = BYTES, Optional, "", "128 KiB";
        /// RAM, stack included.
        ram: Option<u64> = BYTES, Optional, "", "32 KiB";
        /// Stack of one tick.
        stack: Option<u64> = BYTES, Optional, "", "2 KiB";
        /// Mean instructions per tick.
        instructions: Option<u64> = integer(1, 1_000_000_000), Optional, "", 3000;
        /// Longest tick on the board, as estimated by `specgen build`; the rest of the period stays free. Without it, the period.
        time: Option<f64> = one(Dimension::TIME, Range::closed(1e-6, 10.0), "us"), Optional, "" ["duration", "tick"], "80 us";
    }
}

impl Budget {
    /// Only the limits of the part.
    pub const NONE: Self = Self { flash: None, ram: None, stack: None, instructions: None, time: None };
}

impl Value for Mcu {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        Self::named(fields.choice(path)?)
    }
}
