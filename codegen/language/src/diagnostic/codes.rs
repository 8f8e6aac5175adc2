//! The registry of finding codes. A code never changes its meaning; a retired one is not used again.
//!
//! `docs/diagnostics.md` is generated from here, see [`super::reference_markdown`]. E01: file and syntax, E02: keys and
//! values, E03: ranges and consistency, E04: stability and lowering, E05: records, E06: identification, E07: tuning,
//! E08: values that do not fit together (the physical lint).

use super::Severity;

/// A code and what it stands for. The constants below are all there are: a finding with another code does not compile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Code {
    /// Such as `E0102`: E for an error, W for a warning, N for a note.
    pub id: &'static str,
    /// What is wrong, in a few words.
    pub title: &'static str,
    /// Why it is refused or pointed out, and how to fix it.
    pub explanation: &'static str,
}

impl Code {
    /// How bad every finding with this code is: its letter says so.
    #[must_use]
    pub const fn severity(self) -> Severity {
        match self.id.as_bytes() {
            [b'E', ..] => Severity::Error,
            [b'W', ..] => Severity::Warning,
            _ => Severity::Note,
        }
    }
}

/// A [`Diagnostic::code`](super::Diagnostic::code) beside the constant.
impl PartialEq<Code> for &str {
    fn eq(&self, other: &Code) -> bool {
        *self == other.id
    }
}

macro_rules! codes {
    ($($name:ident = $id:literal, $title:literal, $explanation:literal;)*) => {
        $(#[doc = concat!($id, ": `", $title, "`.")]
        pub const $name: Code = Code { id: $id, title: $title, explanation: $explanation };)*
        /// Every code, in order.
        pub const REGISTRY: &[Code] = &[$($name),*];
    };
}

codes! {
    UNREADABLE = "E0101", "the spec file cannot be read",
        "The path does not exist, is a folder, or may not be read. Check the path and its permissions.";
    TOO_LARGE = "E0102", "the spec file is too large",
        "A spec is a few kilobytes; more than 1 MiB is surely another file. Measurements belong in CSV files that the spec names.";
    NOT_TEXT = "E0103", "the spec file is not UTF-8 text",
        "The message names the first byte that is not UTF-8. Save the file as UTF-8 (editors often call Latin-1 \"ANSI\").";
    SYNTAX = "E0104", "TOML syntax",
        "The text is not TOML at the place shown. Values and keys are checked only once the syntax is right.";
    EMPTY = "E0105", "the spec file is empty",
        "There is nothing in it but white space and comments. Start from a copy of `specs/minimal.toml`.";
    UNQUOTED = "E0106", "a text without quotes",
        "TOML wants quotes around every text, and a quantity is a text: `mass = \"1.195 kg\"`.";
    UNKNOWN_SECTION = "E0201", "unknown section",
        "No section has this name. If the name is near a known one, that one is suggested, and the keys below are checked as if it stood there.";
    UNKNOWN_KEY = "E0202", "unknown key",
        "The section has no such key. A key that nobody reads would be a setting that silently does nothing.";
    MISSING_SECTION = "E0203", "missing section",
        "The section has keys that must be given. The help shows it as it may be written.";
    MISSING_KEY = "E0204", "missing key",
        "The key has no default: no value would be right for every platform.";
    DUPLICATE = "E0205", "given twice",
        "A key or a section may be given once only. Which of the two counts would be a guess.";
    WRONG_TYPE = "E0206", "wrong kind of value",
        "A number stands where a text is due, a text where a number is due, or the like.";
    WRONG_COUNT = "E0207", "wrong number of values",
        "The array has more or fewer values than the key takes.";
    UNIT_MISSING = "E0208", "a number without unit",
        "A value with a dimension is written with its unit, in quotes: `\"150 mm\"`. A bare number would leave the unit to guesswork.";
    BAD_QUANTITY = "E0209", "not a quantity",
        "A quantity is a number and a unit: `\"1.195 kg\"`, `\"3.26e7 g mm^2\"`, `\"40 V/ms\"`, `\"0.012 pi rad\"`. After a slash, group what stands below it: `N/(m s)`.";
    UNKNOWN_UNIT = "E0210", "unknown unit",
        "Units are m, g, s, min, V, N, Hz, rad, deg, arcmin, arcsec, Pa, J, W, A, F and B with the prefixes f p n u m c d k M G T (Ki Mi Gi for B). Upper and lower case matter.";
    WRONG_DIMENSION = "E0211", "wrong dimension",
        "The unit measures something else than the key wants, such as a voltage where a length is due. Radians count: a rotational stiffness is in N m/rad, a bandwidth in rad/s and not in Hz.";
    NOT_FINITE = "E0212", "not a finite number",
        "NaN and infinity are no physical values, and a number may be too large or too small for a double.";
    UNKNOWN_CHOICE = "E0213", "unknown choice",
        "The key takes one of a few words, listed in the help.";
    ALTERNATIVES = "E0214", "one of two keys",
        "A weight may be given per run or as a bandwidth, not both; a mode that uses the weight needs one of them. Joints lie on circles or are given one by one, not both. With [control] both bandwidths are given or neither.";
    OUT_OF_RANGE = "E0301", "out of range",
        "The value lies outside what the key takes. `docs/spec-reference.md` lists the ranges.";
    WRONG_ORDER = "E0302", "limits in the wrong order",
        "The first of the two values must be the smaller one.";
    VOLTAGE_OUTSIDE_DAC = "E0303", "voltage limits outside the converter's range",
        "The controller would ask for voltages that the converter cannot make.";
    RECORD_COUNT = "E0304", "one or six records",
        "Either one record identifies all legs, or each leg has its own.";
    RECORD_PATH = "E0305", "file path not relative",
        "Records and waveforms are named relative to the spec, with forward slashes, so that the folder can move to another machine.";
    RECORD_UNREADABLE = "E0306", "record cannot be read",
        "The file does not exist beside the spec, is a folder, or may not be read.";
    BANDWIDTH_TOO_HIGH = "E0307", "bandwidth too high",
        "The weight per run, bandwidth x period x run_interval, would exceed 1. The help names the largest bandwidth that would do.";
    BAD_NAME = "E0308", "not a name",
        "The name becomes part of file and symbol names: a letter first, then letters, digits, `-` and `_`, at most 64 characters.";
    CENTER_OUTSIDE_LEG = "E0309", "mass centre outside the leg",
        "A mass centre is measured from its own joint and lies between the two joints.";
    INERTIA_UNPHYSICAL = "E0310", "no body has this inertia",
        "The inertia matrix of a body is positive definite, and none of its principal moments exceeds the sum of the other two.";
    GYRATION = "E0311", "mass and inertia do not fit the size",
        "The radius of gyration, sqrt(I/m), is far from the size of the part: almost always a slip of the unit. The paper prints 1.195 g for 1.195 kg, which gives 5.2 m on a platform of 0.1 m.";
    DEGENERATE_GEOMETRY = "E0312", "the legs do not hold the platform",
        "The six legs leave a motion free at rest, or nearly so: no controller can hold it. Change radii, angles or height.";
    WORKSPACE_UNREACHABLE = "E0313", "workspace out of reach",
        "One axis alone needs a leg motion beyond the stroke. The paper's pi/72 rad needs 4.4 mm from legs of 60 um.";
    SLEW_BELOW_CODE = "E0314", "slew rate below one converter code per tick",
        "Within one period the voltage may change by less than one code, so that it could never move.";
    BUDGET_NOT_WHOLE = "E0315", "not a whole number of bytes",
        "Memory is counted in whole bytes.";
    WITHOUT_CONTROL = "E0316", "belongs to the task-space controller",
        "Gauges that see the platform, their calibration and trajectories are for a spec with [control]. Without it each leg has its own gauge, and these would silently do nothing.";
    GAUGE_COUNT = "E0317", "not six gauges",
        "Six gauges, each a [[gauge]] section, tell the six coordinates of a pose.";
    BAD_DIRECTION = "E0318", "not a direction, or one along the target",
        "A direction is a vector other than zero. A gauge whose line lies nearly in its target plane (within 6 degrees) sees no motion along the line, and a tilt as a large one.";
    LEG_KEY_WITH_CONTROL = "E0319", "key of the leg feed-forward beside [control]",
        "The task-space controller adapts in every tick, with bandwidths that hold at any period, and its set-point is a pose.";
    NOTCH_DAMPING = "E0320", "notch below the mode's own damping",
        "A notch replaces the damping of a mode by notch_damping; at or below modal_damping it would raise the resonance.";
    CUTOFF_TOO_HIGH = "E0321", "velocity filter above half the tick rate",
        "A low-pass above pi rad / period does not filter anything that the ticks can show.";
    TRAJECTORY_KEY = "E0322", "key of another kind of trajectory",
        "The paper's paths take frequency and as_printed; a waveform takes file, period and repeat.";
    NAME_TAKEN = "E0323", "name given twice",
        "Trajectories are told apart by their names.";
    BIAS_OUTSIDE = "E0324", "bias outside the workspace",
        "The workspace bounds the pose from rest with the bias in it: no set-point could be reached.";
    CALIBRATION_PARTLY = "E0325", "calibration of some gauges only",
        "The gauge words are volts for all six gauges or metres for all six.";
    TOO_MANY_TRAJECTORIES = "E0326", "too many trajectories",
        "The controller chooses among at most 32.";
    RATE_KEYS = "E0327", "keys that do not fit hysteresis.rate",
        "rate = \"dynamic-preisach\" takes rate_tables, rate = \"creep\" takes creep_times and creep_weights, one weight for each time and less than 1 in all. A key of another option would silently do nothing.";
    SCALAR_WITHOUT_FPU = "E0330", "double precision on a single-precision FPU",
        "The FPU of a Cortex-M4F computes `f32`. In `f64` every operation is a call of software, and a tick takes ten times as long. Choose `controller.scalar = \"f32\"`, whose figures are in the README, or a part with a double-precision FPU.";
    BUDGET_BEYOND_PART = "E0331", "a budget larger than the part",
        "The microcontroller has less memory than the budget allows, so the budget would let an image pass that does not fit. RAM is that of the region images are linked into.";
    TOO_FEW_BITS = "E0332", "converter too coarse for the precision asked for",
        "A code of `dac.bits` over `dac.range` moves the leg, or the platform, by more than `requirements.precision`. The help says how many bits would do. Feedback does not help: what lies between two codes cannot be reached, only crossed.";
    WRONG_PART = "E0333", "firmware for another part than the spec's",
        "Scalar, margins of time and memory belong to `target.mcu`. A board with another core is refused; one with the same core is built and said so.";
    UNSTABLE_STATIC = "E0401", "adaptation unstable on any leg",
        "With these weights and the declared gain_ratio the loop grows even on a leg without dynamics (Appendix B). The help names the largest weight that would do.";
    UNSTABLE_SAMPLED = "E0402", "adaptation unstable on this leg",
        "The sampled loop of amplifier lag, resonance and adaptation has a spectral radius of 1 or more. The help names the largest weight that would do; a longer run helps as well.";
    NO_MODES = "E0420", "the platform has no six modes on its legs",
        "Mass matrix and leg stiffness at rest must be positive definite: every motion has a mass and a stiffness. Check geometry, masses and actuator.axial_stiffness.";
    UNSTABLE_PLATFORM = "E0421", "a control mode unstable on this platform",
        "One tick of the closed loop (amplifier lag, modes of the platform on its legs, notch, gains, adaptation) has a spectral radius of 1 or more somewhere in gain_ratio, free or touching the declared work piece. Every mode that a running controller can be switched to is checked. The help names the largest factor or bandwidth that would do.";
    NO_TUNING = "E0422", "no start values hold",
        "The spec leaves gains or bandwidths to the compiler, and its rule found none that are stable. A higher tick rate, a notch (control.notch_damping), more damping or a narrower gain_ratio helps.";
    THIN_MARGIN = "W0423", "stable, but not by much",
        "A gain margin below 1.5 or a delay margin below half a tick: a platform a little softer, less damped or later than the spec says may be unstable.";
    MODE_NOT_NOTCHED = "W0424", "a mode too fast for the notch",
        "The mode lies above nine tenths of half the tick rate, where a sampled notch cannot sit on it. The stability check includes it.";
    SLOWER_THAN_P = "W0425", "P/F slower than P",
        "P/F shares its gains among Invhys, EWMA and PCC, and leaves room in them for the estimates of the latter two. With Invhys nothing uses that room: its integral is slower than that of P, and forces of a work piece are corrected later. On the reference machine, machining glass, that is 32.7 nm rms against 16.6 nm.";
    BIAS_UNREACHABLE = "E0440", "bias out of reach",
        "At the pose control.setpoint.bias a leg would be shorter than at zero volts or longer than its stroke.";
    AXIS_UNREACHABLE = "E0441", "workspace bound that no pose reaches",
        "Moving along this axis alone from the middle of the strokes, the legs end before the bound does.";
    TRAJECTORY_UNREACHABLE = "E0442", "trajectory out of reach",
        "Somewhere on the declared trajectory a leg would be shorter than at zero volts or longer than its stroke. The help names the bias in z that would make it fit, if there is one.";
    NO_ROOM = "W0444", "bias without room for corrections",
        "A leg stands within a hundredth of its stroke of an end, so that feedback and adaptation can move it one way only. Corners of the declared workspace beyond reach are usual for a hexapod and not a finding; `specgen check` shows how much of it is reached.";
    TOO_FEW_CODES = "E0410", "converter too coarse for the grid",
        "There are fewer than two converter codes to a cell of the Preisach grid.";
    WORKSPACE_TOO_LARGE = "E0412", "workspace too large for the legs",
        "The kinematics counts its Newton steps for leg displacements up to a quarter of the leg length; no piezo leg comes near that.";
    ILL_CONDITIONED = "E0413", "leg forces not determined in the workspace",
        "The equations for the leg forces come close to singular at some pose of the declared workspace, and digits would be lost there. Change the geometry so that the legs point in more different directions, or reduce the workspace.";
    PROBE_MISSES = "E0431", "gauge that misses the platform",
        "The line of the gauge meets its target plane far from the platform: most likely a frame is mistaken. The line is in {B}, the plane in {P}, whose origin is P_C.";
    GAUGES_BLIND = "E0432", "gauges that leave a motion unseen",
        "Six readings fix a pose only if no motion leaves all of them as they are, or nearly so. The message names the motion that is seen least.";
    GAUGE_RANGE = "E0433", "workspace beyond the gauges' range",
        "A pose that the controller would accept could not be measured.";
    CALIBRATION_AMBIGUOUS = "E0434", "calibration that cannot be inverted",
        "Over sensor.range a calibration rises or falls all the way, so that every raw value means one reading.";
    GAUGES_DIVERGE = "E0435", "workspace too large for the gauges' equations",
        "They are solved for small motions, by a number of passes that the compiler counts.";
    ZERO_OUTSIDE = "E0450", "bias or work zero outside the workspace",
        "Set-points are counted from the bias pose and the offset of the work frame: both must lie where the platform can go.";
    MOVES_TOO_SLOW = "E0451", "limits of moves too low",
        "At these limits of speed, acceleration and jerk a move across the workspace never comes to its end.";
    FRAMES_TOO_WIDE = "E0452", "workspace too wide for user frames",
        "Work and tool frames are computed for small rotations.";
    TRAJECTORY_JUMPS = "E0453", "trajectory that jumps",
        "No platform follows a jump: its legs would be driven at their limits. The paper's printed trajectories jump; the corrected ones do not.";
    TRAJECTORY_OUTSIDE = "E0454", "trajectory outside the workspace",
        "At some time the pose, with the bias, leaves the declared workspace. The message names the time and the axis that is worst.";
    TRAJECTORY_TOO_FAST = "E0455", "trajectory too fast",
        "At some time an axis is faster than a streamed set-point may be.";
    TRAJECTORY_TICKS = "E0456", "trajectory that does not fit the ticks",
        "Rows of a table are a whole number of ticks apart, a sinusoid is slower than half the tick rate, and no trajectory is longer than about four million ticks.";
    WAVEFORM_CLOSED_TWICE = "E0457", "last row given twice",
        "A table that repeats goes from its last row to its first: a last row that is the first again would make it stand still for a row.";
    STOP_LEAVES = "E0459", "a stop that leaves workspace or strokes",
        "A stream that runs dry goes on with its last rate until it counts as stale, and then comes to rest within the limits of stops; so does any motion that another command ends. Along each axis alone, from the bias pose in its better direction, a stop from the largest declared speed must end within workspace and strokes, and a stop from any tick of a trajectory.";
    TRAJECTORY_CORNERS = "W0458", "trajectory with corners",
        "Where the slope changes at once the platform rings, whatever the controller. The paper's trajectories have such corners.";
    WAVEFORM_HEADER = "E0460", "a table of poses without its columns",
        "The first line names the columns by axis and unit: x, y, z in nm, um, mm or m, theta_x, theta_y, theta_z in nrad, urad, mrad or rad, such as `x_um,theta_z_urad`, and optionally `time_s`.";
    WAVEFORM_VALUE = "E0461", "a pose that is not a number",
        "Values are finite plain numbers with a decimal point; every line has all columns.";
    WAVEFORM_TIME = "E0462", "times that do not fit the period",
        "The time column rises from row to row by trajectory.period.";
    WAVEFORM_LENGTH = "E0463", "too few or too many rows",
        "A table of poses has at least two rows, and no more than a microcontroller holds.";
    SUPERVISOR_TIME = "E0470", "a time of the supervisor shorter than it can see",
        "The supervisor counts ticks, and looks at the six gauges in turn: what the gauges show takes twelve periods to be seen twice, everything else one.";
    SUPERVISOR_BOUND = "E0471", "a bound of the supervisor below the noise",
        "A bound that the noise of the gauges, or a step of their converter, passes by itself would stop a sound machine.";
    SUPERVISOR_RAMP = "E0472", "a ramp to rest faster than the slew rate",
        "Voltages go to rest no faster than amplifier and stack stand.";
    SUPERVISOR_REST = "E0473", "a rest voltage beyond the limits",
        "The legs stand at supervisor.rest_voltage while they are disarmed: it lies within actuator.voltage.";
    GAUGE_INPUT = "E0474", "a converter that does not see a gauge at rest",
        "With a calibration a gauge's words are volts, and its converter takes in sensor.input_range, ±10 V without that key. Where the reading zero lies beyond, no reading would ever be believed.";
    INPUT_WITHOUT_CALIBRATION = "E0475", "an input range in volts for a gauge in metres",
        "sensor.input_range is the converter's range of a gauge with a calibration. Without one, sensor.range is what code 0 and full scale mean.";
    RECORD_IO = "E0501", "a record cannot be opened",
        "The CSV file does not exist or may not be read.";
    RECORD_TOO_LARGE = "E0502", "a record is too large",
        "Record at a lower rate, or keep every n-th sample.";
    RECORD_NOT_TEXT = "E0503", "a record is not UTF-8 text",
        "Export it as CSV text in UTF-8.";
    RECORD_HEADER = "E0504", "a record without its columns",
        "The first line names the columns, time, drive and displacement, with their units. The help shows it.";
    RECORD_COLUMN_TWICE = "E0505", "a column given twice",
        "Which of the two counts would be a guess.";
    RECORD_VALUE = "E0506", "a value that is not a number",
        "Values are plain numbers with a decimal point; every line has all columns.";
    RECORD_LENGTHS = "E0507", "columns of different length",
        "Every sample has a time, a drive and a displacement.";
    RECORD_NOT_FINITE = "E0508", "a value that is not finite",
        "NaN and infinity are no measurements.";
    RECORD_TOO_SHORT = "E0509", "too few samples",
        "Record more samples per reversal curve.";
    RECORD_TIME = "E0510", "time does not rise",
        "Every sample is later than the one before. Is the time column the right one, with enough digits?";
    RECORD_GAP = "E0511", "a gap in the record",
        "A reversal of the drive may be missing in it.";
    RECORD_CONSTANT = "E0512", "a signal that never changes",
        "The drive or the displacement is the same in every sample. Is the channel connected?";
    RECORD_STUCK = "E0513", "displacement stuck or clipped",
        "The displacement stays the same while the drive moves: the gauge is at the end of its range or disconnected.";
    RECORD_RELATION = "E0514", "displacement does not follow the drive",
        "It falls when the drive rises, or hardly follows it: a sign or a column is wrong.";
    RECORD_UNIT = "W0515", "displacement in another unit?",
        "The range is far from what a piezo actuator does; the column is in micrometres.";
    RECORD_LIMITED = "E0516", "displacement limited or stuck, with noise",
        "Over a long way of the drive the displacement hardly moves: the gauge or the amplifier is at its limit, or the gauge is stuck. The message names the time.";
    RECORD_GLITCH = "W0517", "a glitch in the displacement",
        "A single sample is far off its neighbours. It gets no weight in any fit.";
    RECORD_JUMP = "W0518", "a jump of the drive",
        "No rate-independent model follows a jump, and the actuator rings behind it: the samples there get no weight.";
    GRID_NOT_IDENTIFIABLE = "E0601", "grid beyond identification",
        "A table of that size cannot be fitted to a record.";
    DRIVE_RANGE_EMPTY = "E0602", "empty drive range",
        "The lowest voltage comes first.";
    DRIVE_UNIT = "E0603", "drive in another unit?",
        "The drive column is in volts at the stack.";
    COLUMNS_SWAPPED = "E0604", "columns swapped?",
        "Drive and displacement seem to have changed places.";
    DRIVE_RANGE = "E0605", "record outside the declared drive range",
        "The range of the record and the voltage limits of the spec must fit.";
    NOT_EXCITED = "E0606", "record misses an end of the range",
        "Between the curves the drive falls to the lowest voltage, and the last curves rise to the highest.";
    TOO_FEW_CURVES = "E0607", "too few reversal curves",
        "A grid needs about as many curves as it has intervals; or choose a coarser grid.";
    FEW_CURVES = "W0608", "few reversal curves",
        "Weights between the curves are interpolated.";
    CELLS_INTERPOLATED = "W0609", "cells that were never excited",
        "Their weights are interpolated from their neighbours.";
    NOT_DETERMINED = "E0610", "weights not determined",
        "Choose a coarser grid, or record more reversal curves.";
    POOR_FIT = "W0611", "the table fits the record poorly",
        "Is the record one actuator at one load, without steps or lost samples?";
    VALIDATION_IDLE = "E0612", "validation record hardly moves",
        "Validate with a record that moves the drive through the table's range.";
    TABLE_FILE = "E0613", "not a table file",
        "A table file is as `identify` writes it: three columns, the nodes of a triangle of rising thresholds, no negative weight.";
    TABLE_MISMATCH = "E0614", "a table of another grid or voltage range",
        "A table named in hysteresis.records must have the cells of hysteresis.grid over the range of actuator.voltage: identify the record again with both.";
    RECORD_SCALE = "E0615", "a record that the actuator cannot have made",
        "Its displacement is more than five times, or less than a fifth, of stacks x stack_gain x voltage: most likely it is not in micrometres.";
    SWEEP_TOO_FAST = "W0620", "sweep too fast to tell hysteresis from dead time",
        "A dead time widens the loop in proportion to the rate. Where it cannot be told from hysteresis it is counted as such.";
    CURVES_IN_NOISE = "W0621", "curves closer than the noise",
        "Neighbouring reversal curves differ by less than the gauge can tell.";
    GRID_NOT_CHOSEN = "E0622", "grid that cannot be chosen from the record",
        "Cross-validation holds out curves that turn back at other voltages than the rest: there must be several. Give --grid otherwise.";
    DISPLACEMENT_UNIT = "E0623", "displacement in another unit",
        "The displacement covers more or less than any piezo actuator does; the column is in micrometres.";
    NO_CYCLE = "E0625", "no linear relation in the record",
        "The relation Y = rho X + delta is fitted to whole cycles of one frequency, with the displacement rising with the drive.";
    FREQUENCY_UNCLEAR = "E0626", "record of no one frequency, or of another one",
        "Each record of a linear relation holds one frequency. The message names the cycle that differs.";
    RESPONSE_SAMPLES = "E0630", "record that gives no frequency response",
        "Samples must be evenly spaced, and enough for several segments.";
    RESPONSE_COHERENCE = "E0631", "coherence too low",
        "Where the coherence is low the response is noise. The bands are named; the resonance must lie in a coherent one.";
    RESPONSE_FIT = "E0632", "response that the model does not fit",
        "A second-order resonance with a first-order lag and a dead time is fitted, with a positive static gain.";
    RESPONSE_BAND = "W0633", "part of the response left out or not resolved",
        "Bands of low coherence get no weight; a resonance narrower than a few bins looks broader than it is.";
    RESPONSE_POOR = "W0634", "response fitted poorly",
        "Most often the band holds more than one resonance.";
    GAUGE_NOT_MONOTONE = "E0635", "calibration that turns back",
        "One voltage would mean two displacements.";
    GAUGE_RECORD = "E0636", "record that gives no calibration",
        "Too few positions, or another unit than volts and micrometres.";
    GAUGE_HYSTERESIS = "W0637", "gauge that reads differently on the way back",
        "A calibration cannot remove that.";
    GAUGE_GLITCH = "W0638", "a point far off the calibration",
        "Was the reading disturbed?";
    ONE_RATE = "E0640", "records of one rate only",
        "Rate dependence shows between records of one leg at different rates: record the same sweep at two rates or more.";
    RATE_TABLE_FILE = "E0641", "not a table of the second weight",
        "A table named in hysteresis.rate_tables is as `identify rate -o NAME` writes it to NAME-mu1.csv: the nodes of a triangle of rising thresholds, of either sign.";
    RATE_TABLE_MISMATCH = "E0642", "a second table of another grid or voltage range",
        "A table named in hysteresis.rate_tables must have the cells of hysteresis.grid over the range of actuator.voltage: identify both tables with these.";
    RATE_NOT_IN_STABILITY = "W0643", "rate term not part of the stability check",
        "The stability of the adaptation was checked with the static inverse. The inverse of (6) can raise the gain of fast corrections, by a factor of two at most, before it falls back to the static one: keep gain_ratio wide enough for that.";
    STATIC_TABLE_WITH_CREEP = "W0648", "static table beside creep terms",
        "A table that is fitted to a record of reversal curves alone holds part of the creep, which the creep terms then compensate once more: take the table that was fitted together with them.";
    STIFFNESS_SIGN = "E0644", "negative stiffness",
        "Force counts positive where it pushes the displacement up.";
    STIFFNESS_DRIVE = "E0645", "drive that moves while the stiffness is measured",
        "The drive's own displacement would be taken for the force's.";
    STIFFNESS_RECORD = "E0646", "record that gives no stiffness",
        "The force must rise and fall, move the actuator beyond the noise, and be in newtons.";
    STIFFNESS_UNCERTAIN = "W0647", "stiffness uncertain",
        "The standard error is more than a tenth of the value.";
    TUNE_NOTHING = "E0701", "nothing to tune",
        "The spec's mode uses none of the numbers that `--what` names. The help says which modes use which.";
    TUNE_BOUNDS = "E0702", "bounds that hold nothing",
        "The smaller bound comes first and is above zero, and bounds are for numbers that are tuned.";
    TUNE_NO_START = "E0703", "no start within the margins",
        "Neither the spec's own numbers nor the rule's, made smaller forty times, are stable with the margins that are asked for, within the bounds. Ask for smaller margins, widen the bounds downward, or see what `specgen check` says of the loop.";
    TUNE_REFUSED = "E0704", "a result that does not compile",
        "The spec with the tuned numbers is refused by the compiler, which looks at more conditions than the search does; nothing was written. Ask for larger margins.";
    TUNE_LIMITED = "E0705", "a start at its limits",
        "With the first numbers that are stable the run meets a limit of voltage or stroke, or the controller refuses the trajectory: another trajectory or frequency is needed.";
    STROKE_MISMATCH = "W0301", "stroke, gain and voltage do not fit",
        "stacks x stack_gain x voltage range is far from the stroke: one of the four is probably wrong, or the stroke is never used.";
    RESONANCE_ALIASED = "W0302", "resonance above half the tick rate",
        "The gauges cannot see it as what it is. The stability check uses the sampled model and remains valid.";
    SENSOR_NOISE = "W0303", "gauge noise large against its range",
        "More than a hundredth of the range: probably a slip of the unit. The paper prints 2.2 um for 2.2 nm.";
    SENSOR_RANGE = "W0304", "gauge range does not fit the stroke",
        "The range leaves out the displacement at rest, or is far smaller or larger than the stroke.";
    GYRATION_ODD = "W0306", "mass and inertia fit the size badly",
        "The radius of gyration is unusual for the size of the platform, though possible.";
    UNUSED_WEIGHT = "W0307", "weight that the mode does not use",
        "The key is checked and kept for a later change of mode, but has no effect at start-up.";
    GAINS_UNUSED = "W0308", "gains without a task-space controller",
        "The leg feed-forward has no feedback: [gains] and [position_gains] take effect with [control].";
    STROKE_IMPOSSIBLE = "E0801", "a stroke that the stacks do not have",
        "stacks x stack_gain x voltage range is more than four times the stroke, or less than a quarter: legs would be driven past their ends, or never reach what reach was checked for.";
    STRAIN_ODD = "W0802", "a stroke that does not fit the length of a leg",
        "Piezo stacks stretch by 0.001 to 0.0015 of their own length. More than 0.015 of the leg, or less than a millionth, is most often a slip of the unit.";
    RESONANCE_ODD = "W0803", "resonance, stiffness and mass do not fit",
        "The resonance lies far from what axial_stiffness makes with the mass of the extensible part, alone or with a sixth of the platform.";
    SLEW_TOO_FAST = "W0804", "a slew rate that does not spare the stacks",
        "The voltage could cross its range within a third of a period of the resonance. A stack that is driven so fast overshoots into tension, which ceramics do not stand.";
    LAG_AGAINST_SLEW = "W0805", "an amplifier too slow for the slew rate",
        "A first-order lag makes at most range / lag of slew.";
    CURRENT_AGAINST_SLEW = "W0806", "an amplifier without the current for the slew rate",
        "A leg takes capacitance x slew rate. Beyond its current the amplifier limits the slew itself, unknown to the controller.";
    AMPLIFIER_NOISE = "W0807", "amplifier noise that cannot be",
        "More than a hundredth of the voltage range, or less than two ten-millionths: probably a slip of the unit.";
    CONVERTER_COARSE = "W0808", "converter step large against the stroke",
        "One code moves a leg by more than a thousandth of its stroke.";
    REST_NOT_ZERO = "W0819", "a rest that amplifiers do not keep when they are off",
        "A stack whose amplifier is off discharges to 0 V. Where the legs rest at another voltage although 0 V is permitted, the amplifiers make a jump when they are switched on, and one when they are switched off.";
    LEG_PART_SMALL = "W0810", "mass and inertia of a leg part do not fit the leg",
        "The radius of gyration of a part is less than a fiftieth of the leg.";
    CENTRE_AT_JOINT = "W0811", "mass centre in the joint",
        "The mass centre lies far nearer to its joint than the part's radius of gyration. Write 0 for a part that is balanced about its joint.";
    MOMENT_ODD = "W0812", "a moment of inertia that does not fit the size",
        "About x or y the radius of gyration is less than a tenth of the joint circle, or more than three times it; about z, less than 0.3 or more than 1.5 times.";
    MOMENTS_UNEVEN = "W0813", "moments of inertia in another order?",
        "I_xx and I_yy differ by more than a factor of two on a platform whose joints lie alike along x and y; or by less, where I_zz is as one of the two.";
    LEG_MASS_ODD = "W0814", "leg and platform of very different mass",
        "A leg part weighs more than five times the platform, or less than a five-thousandth of it.";
    JOINTS_TOUCH = "W0815", "joints that would touch",
        "Two joints of one body are nearer to each other than a hundredth of a leg, which would have to be thinner than that.";
    PLATFORM_WIDER = "W0816", "platform wider than its base",
        "Possible, but most hexapods stand on the wider side: are the two in each other's place?";
    OUT_OF_PROPORTION = "W0817", "radii and height out of proportion",
        "Of the radii of base and platform and the height one is five times larger or smaller than what lies between the other two: probably a slip of the unit.";
    LEGS_CROSS = "W0818", "legs that cross",
        "Two legs would be shorter with each other's joints. Both lists of joints go in the order of the legs; a layout with crossed legs is possible, and rare.";
    SLEW_TOO_SLOW = "W0809", "a slew rate that leaves the legs standing",
        "The voltage takes more than a second over its range.";
    GAUGE_QUIET = "W0820", "gauge noise far below its step",
        "Nobody can measure a noise below a fiftieth of the converter's step: probably a slip of the unit.";
    GAUGE_LOPSIDED = "W0821", "a range with ends in different units?",
        "One end of sensor.range lies a hundred times further from rest than the other, or five times further and five times beyond what there is to see; or the range of a leg's gauge ends five strokes away.";
    GAUGE_COARSE = "W0822", "gauge step large against the stroke",
        "One code of the gauge is more than a thousandth of the stroke.";
    COORDINATE_ODD = "W0823", "a coordinate that is nearly zero",
        "Beside the size of the platform a coordinate of a gauge is next to nothing, and not zero: probably a slip of the unit.";
    GAUGE_REVERSED = "W0824", "gauges that count against each other",
        "Of gauges along the same direction one counts the other way. A wrong sign makes the loop run away; check it by moving the platform by hand before the amplifiers are on.";
    GAUGE_FAR = "W0825", "a gauge that looks past the platform",
        "The line of the gauge meets its target plane far outside the platform: probably coordinates in another order or unit.";
    GAUGE_SLIP = "W0826", "a layout of gauges that one slip would explain",
        "The gauges see some motion badly, and would not if one of them had another sign, or two coordinates in another order.";
    CALIBRATION_ODD = "W0827", "a calibration unlike the others",
        "Offset or slope of one gauge is far from those of the other five, or of another sign.";
    GAIN_UNEVEN = "W0828", "a gain unlike the others",
        "Gains go with the stiffness of their axes. One is more than ten times, or less than a tenth, of what the others have.";
    WORK_PIECE_ODD = "W0829", "a work piece too soft or too stiff",
        "Its stiffness along an axis is less than a thousandth of the platform's on its legs, or more than twenty times it.";
    TIME_WITHOUT_EFFECT = "W0830", "a time too short to have an effect",
        "Lag, lead or dead time is less than a hundredth of a tick.";
    LEAD_TOO_LONG = "W0831", "a lead longer than what it takes out",
        "More than amplifier lag and tick together, and a quarter: the legs would run ahead of the set-point.";
    TRANSFER_ODD = "W0832", "a transfer time that is no transfer",
        "Shorter than a tick, or longer than five seconds.";
    VELOCITY_FILTER_SLOW = "W0833", "a velocity filter far below the modes",
        "It passes less than a tenth of the lowest mode's frequency.";
    TICKS_AGAINST_MODES = "W0834", "tick and modes do not fit",
        "Fewer than four ticks to a period of the lowest mode, or more than three thousand: period, stiffness or masses are in another unit.";
    GAIN_RATIO_ODD = "W0835", "a gain ratio that no stack has",
        "Less than a fifth of the identified gain, or more than four times it: no temperature and no amplitude does that to a stack.";
    ADAPTATION_SLOW = "W0836", "an adaptation that comes too late",
        "The level estimate takes more than half a second. The error of a hysteresis model changes with every turn of the motion.";
    DRIFT_ODD = "W0837", "a drift estimate that does not go with the level",
        "It follows faster than the level estimate, or two thousand times slower: probably the unit, or the two in each other's place.";
    CONTACT_LEVER = "W0838", "a work piece that turns on too long a lever",
        "Its stiffness of turning, over that along an axis, is a lever of more than three radii of the platform.";
    CONTACT_FAR = "W0839", "a work piece that presses the legs together",
        "At the bias it is so far from its unloaded pose that the legs would bend by more than they reach.";
    MOVE_BEYOND_SLEW = "W0840", "moves faster than the slew rate",
        "At control.setpoint.speed the voltage would have to change faster than actuator.slew_rate.";
    MOVE_SLOW = "W0841", "moves that take minutes",
        "At control.setpoint.speed a move across the workspace takes more than two minutes.";
    LIMIT_WITHOUT_EFFECT = "W0842", "a limit of moves that has no effect",
        "Speed, acceleration and jerk belong together: one is reached within a tick, or never.";
    STREAM_UNCHECKED = "W0843", "streamed set-points that are not checked",
        "At control.setpoint.stream_speed a stream may jump across the whole workspace in one tick.";
    WORKSPACE_TINY = "W0844", "a workspace bound of next to nothing",
        "Less than half a hundredth of what the legs reach on this axis.";
    GAINS_EXCHANGED = "W0845", "gains of two axes in each other's place?",
        "Gains go with the stiffness of their axes. Two are five times apart for it, and would fit in each other's place.";
    RANGE_AT_ZERO = "W0846", "an end of the range that is nearly zero",
        "Not zero, but less than a thousandth of the range from rest: probably a slip of the unit.";
    CALIBRATION_BENT = "W0847", "a calibration that is far from straight",
        "A power of the voltage above the first adds more than a tenth of the range. Gauges are straight within a hundredth or two.";
    GAUGE_PATTERN = "W0848", "a gauge out of the pattern of the others",
        "Gauges stand at one height or one radius, look straight along the axis, their radius or across it, or make an equilateral triangle. One does not, and would with another sign, digit or order of its coordinates.";
    CONVERTER_WIDE = "W0849", "a converter that the stacks hardly use",
        "dac.range spans more than four times actuator.voltage: two bits and more are never used.";
    PATH_BEYOND_SLEW = "E0850", "trajectory faster than the slew rate",
        "A leg would need a faster change of voltage than actuator.slew_rate, even with a quarter more gain than the mean.";
    PATH_NEAR_SLEW = "W0851", "trajectory near the slew rate",
        "Where a stack's gain is lowest a leg may meet its slew limit.";
    PATH_BEYOND_CURRENT = "E0852", "trajectory that takes more current than the amplifier gives",
        "I = C dU/dt with actuator.capacitance and the gain of the stacks.";
    PATH_INERTIA = "W0853", "trajectory whose inertia bends the legs",
        "By more than a tenth of the stroke: the feed-forward takes it out, but reach does not count it.";
    PATH_EXCITES = "W0854", "trajectory near the lowest mode",
        "A sinusoid above a fifth of the lowest mode's frequency excites it.";
    WAVEFORM_STEP = "W0855", "a step that stands out",
        "Between two rows of a table an axis moves four times further than in the rows around: a jump between two pieces.";
    LEG_PART_SHAPE = "W0856", "mass, inertia and mass centre of no one body",
        "A part of a leg reaches from its joint: its radius of gyration is a quarter to five quarters of the way to its mass centre.";
    CENTRE_FAR = "W0857", "a centre of mass outside the legs",
        "It lies further beside the axis than the joints, or three times as far above or below them.";
    DAMPING_ODD = "W0858", "a resonance without damping",
        "The damping ratio of a leg is below that of a bare ceramic, 0.0002: probably a slip, as of a percentage for a ratio.";
    GRID_COARSE = "W0859", "a grid too coarse for a hysteresis loop",
        "Less than 8 intervals per axis of the Preisach plane: each branch of the loop would be a few straight pieces.";
    JOINT_ANGLE = "E0860", "joints beyond their angle",
        "Somewhere in the workspace a joint of a leg turns further than leg.joint_angle.";
    CONDITION_POOR = "W0861", "legs that hold the platform badly",
        "Somewhere in the declared workspace the condition number of J may exceed 30: forces and errors along one motion are that many times those along another.";
    LEGS_CUT_SHORT = "N0862", "a workspace beyond the strokes of the legs",
        "Without [control] the workspace bounds what is accepted as a set-point. Where no pose reaches a bound, set-points near it are accepted and the legs stop at the ends of their strokes.";
    GAUGE_SHORT_OF_STROKE = "N0863", "a gauge that ends before its leg does",
        "A leg may go where its own gauge cannot see it, which is a gauge fault. The gauge of the paper ends at 48 um, its legs at 60 um.";
    BUDGET_IMPOSSIBLE = "E0870", "a budget below what the tables take",
        "The constants alone do not fit: the unit is wrong, or grid and memory are too large.";
    BUDGET_LOOSE = "W0871", "a budget that checks nothing",
        "It is hundreds of times what the tables take.";
    BUDGET_SWAPPED = "W0873", "more RAM than flash",
        "Parts have more flash than RAM, and controllers need more of it.";
    PRECISION_POOR = "W0880", "arithmetic too coarse for the gauges",
        "The rounding errors of the chosen scalar may exceed the noise of the gauges. f64, or a smaller workspace, fixes it.";
    ESTIMATED = "N0872", "memory and time are measured by a build",
        "`check` knows what tables and memories take; code, stack and instructions are known once it is built.";
    TRUNCATED = "W0001", "further findings left out",
        "Only the first findings are shown; fix them and run again.";
}

/// The entry of `id`.
#[must_use]
pub fn find(id: &str) -> Option<&'static Code> {
    REGISTRY.iter().find(|code| code.id == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_unique_and_well_formed() {
        for (i, code) in REGISTRY.iter().enumerate() {
            assert!(REGISTRY[..i].iter().all(|other| other.id != code.id), "{} twice", code.id);
            assert!(code.id.len() == 5 && code.id.starts_with(['E', 'W', 'N']), "{}", code.id);
            assert!(code.id[1..].bytes().all(|b| b.is_ascii_digit()), "{}", code.id);
        }
    }
}
