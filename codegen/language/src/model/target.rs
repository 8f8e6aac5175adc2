//! What is emitted, at which rate it runs, on what, and within which limits.

use super::Mcu;
use crate::keys::declare::*;

const BYTES: Shape = one(Dimension::MEMORY, Range::closed(1.0, 1_099_511_627_776.0), "KiB");

section! {
    /// Control timing.
    ///
    /// In s.
    "timing", Plain => Timing {
        /// Control period.
        period: f64 = one(Dimension::TIME, Range::closed(1e-6, 10.0), "us"), Required, "T_s", "200 us";
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
    /// What the six set-point numbers are at start-up.
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
        /// What the six set-point numbers are at start-up: a pose, or leg displacements.
        setpoint: SetpointKind = one_of(SetpointKind::WORDS), Default("pose"), "", "pose";
    }
}

section! {
    /// What the platform is for. A spec that cannot meet it is refused.
    ///
    /// In m.
    "requirements", Optional => Requirements {
        /// Finest displacement that matters. No converter code may move a leg by more, nor half a code on every leg the platform along an axis.
        precision: Option<f64> = one(Dimension::LENGTH, Range::closed(1e-12, 1e-3), "nm"), Optional, "", "50 nm";
    }
}

section! {
    /// What it runs on.
    "target", Plain => Target {
        /// Microcontroller: `mps2-an500` and `stm32h743zi` are a Cortex-M7 with double-precision FPU, `mps2-an386` and `stm32f446re` a Cortex-M4F with single precision; the first of each is emulated.
        mcu: Mcu = one_of(&["mps2-an500", "mps2-an386", "stm32h743zi", "stm32f446re"]), Default("mps2-an500"), "", "mps2-an500";
    }
    and |fields, _table| {
        /// What it may use there.
        budget: Budget = Budget::read(fields, "target.budget")?;
    }
}

section! {
    /// What it may use there; a build that needs more is refused.
    ///
    /// In bytes; none where the spec does not say.
    "target.budget", Plain => Budget {
        /// Flash.
        flash: Option<u64> = BYTES, Optional, "", "128 KiB";
        /// RAM, stack included.
        ram: Option<u64> = BYTES, Optional, "", "32 KiB";
        /// Stack of one tick.
        stack: Option<u64> = BYTES, Optional, "", "2 KiB";
        /// Mean instructions per tick.
        instructions: Option<u64> = integer(1, 1_000_000_000), Optional, "", 3000;
    }
}

impl Budget {
    /// No limits but those of the part.
    pub const NONE: Self = Self { flash: None, ram: None, stack: None, instructions: None };
}

impl Value for Mcu {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        Self::named(fields.choice(path)?)
    }
}
