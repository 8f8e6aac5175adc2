//! Digital lines: outputs that show where the platform is measured to be, or what it does, and an input that starts a motion.

use super::{LARGEST_TRAVEL, LARGEST_TURN};
use crate::keys::declare::*;

/// Most output lines: the number of pins for them on the boards.
pub const MAX_OUTPUTS: usize = 4;
/// And an input.
pub const MAX_TRIGGERS: usize = MAX_OUTPUTS + 1;
/// Names of the axes, x y z θx θy θz.
const AXES: &[&str] = &["x", "y", "z", "theta_x", "theta_y", "theta_z"];
/// Longest pulse, s.
const LONGEST_PULSE: f64 = 1.0;
/// Largest count of set-points or ticks.
const LARGEST_COUNT: i64 = i32::MAX as i64;

const PLACE: Shape = one(Dimension::LENGTH, Range::closed(-LARGEST_TRAVEL, LARGEST_TRAVEL), "um");
const ANGLE: Shape = one(Dimension::ANGLE, Range::closed(-LARGEST_TURN, LARGEST_TURN), "urad");
const STEP: Shape = one(Dimension::LENGTH, Range::above(0.0, LARGEST_TRAVEL), "um");
const TURN: Shape = one(Dimension::ANGLE, Range::above(0.0, LARGEST_TURN), "urad");
const ROOM: Shape = one(Dimension::LENGTH, Range::closed(0.0, LARGEST_TRAVEL), "nm");
const TURN_ROOM: Shape = one(Dimension::ANGLE, Range::closed(0.0, LARGEST_TURN), "nrad");

choice! {
    /// Function of an output line, or that the line is the input.
    TriggerKind {
        /// A pulse at each position that the pose passes.
        Position = "position",
        /// High while the pose is within bounds.
        Level = "level",
        /// High while the set-point moves.
        Motion = "motion",
        /// A pulse at set-points of a stream or wave.
        Points = "points",
        /// A pulse at ticks of the run.
        Ticks = "ticks",
        /// Not an output: a rising edge of this line starts the waiting command.
        Input = "input",
    }
}

choice! {
    /// Direction of passages that give a pulse.
    TriggerDirection {
        /// All.
        Both = "both",
        /// Only with the pose rising.
        Up = "up",
        /// Only with the pose falling.
        Down = "down",
    }
}

section! {
    /// A digital output line: pulses at positions of the measured pose, at set-points of a wave or at ticks, or a level. Outputs are numbered from 0 in the order of the file. Or the input line, whose rising edge starts a waiting motion or wave. Only with [control]. docs/triggers.md describes timing and wiring.
    ///
    /// Positions in m or rad from rest, the bias included; times in s.
    "trigger" ["output", "digital_output", "input"], Repeated(0, MAX_TRIGGERS) => Trigger {
        /// Its name, unique in the file.
        name: String = NAME, Required, "", "camera";
        /// Function of the line: positions passed, the pose within bounds, the set-point in motion, set-points of a stream or wave, ticks of the run; `input` is the input line.
        kind: TriggerKind = one_of(TriggerKind::WORDS), Required, "" ["mode"], "position";
        /// Axis of the measured pose for positions and levels.
        axis = one_of(AXES), Default("x"), "", "x";
        /// For positions: direction of passages that give a pulse.
        direction: TriggerDirection = one_of(TriggerDirection::WORDS), Default("both"), "", "up";
        /// First position, or lower end of a level, from rest.
        start = PLACE, InsteadOf("start_angle"), "" ["begin"], "-20 um";
        /// The same of a rotation.
        start_angle = ANGLE, InsteadOf("start"), "", "-100 urad";
        /// Last position, to the nearest step, or upper end of a level; the end of the workspace if neither is given.
        stop = PLACE, InsteadOf("stop_angle"), "" ["end"], "20 um";
        /// The same of a rotation.
        stop_angle = ANGLE, InsteadOf("stop"), "", "100 urad";
        /// Distance between positions, above `hysteresis`.
        step = STEP, InsteadOf("step_angle"), "" ["pitch"], "1 um";
        /// The same of a rotation.
        step_angle = TURN, InsteadOf("step"), "", "10 urad";
        /// Distance that the pose must move away from a passed position before that is armed again, or beyond a level before it ends; ten times the noise of the pose if neither is given.
        hysteresis = ROOM, InsteadOf("hysteresis_angle"), "", "50 nm";
        /// The same of a rotation.
        hysteresis_angle = TURN_ROOM, InsteadOf("hysteresis"), "", "500 nrad";
        /// First set-point or tick with a pulse, counted from 1.
        first: u32 = integer(1, LARGEST_COUNT), Default(1), "", 1;
        /// Set-points or ticks from pulse to pulse.
        every: u32 = integer(1, LARGEST_COUNT), Default(1), "", 10;
        /// Last set-point or tick with a pulse. Without it there is no last one.
        last: Option<u32> = integer(1, LARGEST_COUNT), Optional, "", 1000;
        /// Length of a pulse, to the nearest tick and at least one.
        width: Option<f64> = one(Dimension::TIME, Range::above(0.0, LONGEST_PULSE), "ms"), Rule("one tick"), "", "0.1 ms";
    }
    and |fields, table| {
        /// x y z θx θy θz by number.
        axis: usize = AXES.iter().position(|axis| fields.choice(&join(table, "axis")) == Some(axis))?;
        /// m or rad.
        start: Option<f64> = either(fields, table, "start");
        /// m or rad. None: the end of the workspace.
        stop: Option<f64> = either(fields, table, "stop");
        /// m or rad.
        step: Option<f64> = either(fields, table, "step");
        /// m or rad. None: by the noise of the pose.
        hysteresis: Option<f64> = either(fields, table, "hysteresis");
    }
}

/// The value for a translation or a rotation.
fn either(fields: &Fields, table: &str, key: &str) -> Option<f64> {
    fields.number(&join(table, key)).or_else(|| fields.number(&join(table, &format!("{key}_angle"))))
}
