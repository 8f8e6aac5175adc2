//! The registry of finding codes. A code never changes its meaning; a retired one is not used again.
//!
//! What a code means stands in its page, `codegen/language/findings/E0441.md` and so on: what is checked, why it matters, a
//! spec that shows it, the fix. `docs/diagnostics.md` is these pages, see [`super::reference_markdown`]; the examples are
//! run by `codegen/cli/tests/findings.rs`.

use super::Severity;

/// A code and its page. The ones below are all there are: a finding with another code does not compile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Code {
    /// Such as `E0102`: E for an error, W for a warning, N for a note.
    pub id: &'static str,
    /// Its page as Markdown: a heading with id and title, then what is checked, and below headings of the second level
    /// `Why it matters`, `Example` and `Fix`. Lines of text have at most 80 columns.
    pub page: &'static str,
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

    /// What is wrong, in a few words: the heading of the page.
    #[must_use]
    pub fn title(self) -> &'static str {
        let heading = self.page.lines().next().unwrap_or_default();
        heading.split_once(": ").map_or(heading, |(_, title)| title)
    }

    /// What is checked and why it matters: the text of the page above its example, without headings, as one line.
    #[must_use]
    pub fn explanation(self) -> String {
        let text = self.page.split("\n## Example").next().unwrap_or_default();
        let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        lines.collect::<Vec<_>>().join(" ")
    }
}

/// A [`Diagnostic::code`](super::Diagnostic::code) beside the constant.
impl PartialEq<Code> for &str {
    fn eq(&self, other: &Code) -> bool {
        *self == other.id
    }
}

// Statics: each crate that names a constant has a copy of its page.
macro_rules! codes {
    ($($name:ident = $id:literal;)*) => {
        $(#[doc = include_str!(concat!("../../findings/", $id, ".md"))]
        pub static $name: Code = Code { id: $id, page: include_str!(concat!("../../findings/", $id, ".md")) };)*
        /// Every code, by number.
        pub static REGISTRY: &[Code] = &[$($name),*];
    };
}

codes! {
    // The list of findings.
    TRUNCATED = "W0001";

    // File and syntax.
    UNREADABLE = "E0101";
    TOO_LARGE = "E0102";
    NOT_TEXT = "E0103";
    SYNTAX = "E0104";
    EMPTY = "E0105";
    UNQUOTED = "E0106";

    // Keys and values.
    UNKNOWN_SECTION = "E0201";
    UNKNOWN_KEY = "E0202";
    MISSING_SECTION = "E0203";
    MISSING_KEY = "E0204";
    DUPLICATE = "E0205";
    WRONG_TYPE = "E0206";
    WRONG_COUNT = "E0207";
    UNIT_MISSING = "E0208";
    BAD_QUANTITY = "E0209";
    UNKNOWN_UNIT = "E0210";
    WRONG_DIMENSION = "E0211";
    NOT_FINITE = "E0212";
    UNKNOWN_CHOICE = "E0213";
    ALTERNATIVES = "E0214";
    PLACEHOLDER = "E0220";

    // Ranges and consistency.
    OUT_OF_RANGE = "E0301";
    STROKE_MISMATCH = "W0301";
    WRONG_ORDER = "E0302";
    RESONANCE_ALIASED = "W0302";
    VOLTAGE_OUTSIDE_DAC = "E0303";
    SENSOR_NOISE = "W0303";
    RECORD_COUNT = "E0304";
    SENSOR_RANGE = "W0304";
    RECORD_PATH = "E0305";
    RECORD_UNREADABLE = "E0306";
    GYRATION_ODD = "W0306";
    BANDWIDTH_TOO_HIGH = "E0307";
    UNUSED_WEIGHT = "W0307";
    BAD_NAME = "E0308";
    GAINS_UNUSED = "W0308";
    CENTER_OUTSIDE_LEG = "E0309";
    INERTIA_UNPHYSICAL = "E0310";
    GYRATION = "E0311";
    DEGENERATE_GEOMETRY = "E0312";
    WORKSPACE_UNREACHABLE = "E0313";
    SLEW_BELOW_CODE = "E0314";
    BUDGET_NOT_WHOLE = "E0315";
    WITHOUT_CONTROL = "E0316";
    GAUGE_COUNT = "E0317";
    BAD_DIRECTION = "E0318";
    LEG_KEY_WITH_CONTROL = "E0319";
    NOTCH_DAMPING = "E0320";
    CUTOFF_TOO_HIGH = "E0321";
    TRAJECTORY_KEY = "E0322";
    NAME_TAKEN = "E0323";
    BIAS_OUTSIDE = "E0324";
    CALIBRATION_PARTLY = "E0325";
    TOO_MANY_TRAJECTORIES = "E0326";
    RATE_KEYS = "E0327";
    GAUGES_ALIKE = "E0328";
    ALLOW_FORM = "E0329";
    SCALAR_WITHOUT_FPU = "E0330";
    BUDGET_BEYOND_PART = "E0331";
    TOO_FEW_BITS = "E0332";
    WRONG_PART = "E0333";
    TICK_TOO_LONG = "E0334";
    TICK_TIGHT = "W0335";
    CORRECTION_TOO_LARGE = "E0336";
    TRIGGER_KEY = "E0337";
    TRIGGER_OUTSIDE = "E0338";
    TOO_MANY_TRIGGERS = "E0339";
    DIRECTION_ANGLES = "W0340";
    ASSUMED_UNKNOWN = "E0345";
    ASSUMED_TWICE = "E0346";
    NOISE_AT_REST = "E0347";
    ASSUMED_ON_BOARD = "E0348";

    // Stability, reach, set-points, gauges, supervisor.
    UNSTABLE_STATIC = "E0401";
    UNSTABLE_SAMPLED = "E0402";
    TOO_FEW_CODES = "E0410";
    WORKSPACE_TOO_LARGE = "E0412";
    ILL_CONDITIONED = "E0413";
    NO_MODES = "E0420";
    UNSTABLE_PLATFORM = "E0421";
    NO_TUNING = "E0422";
    THIN_MARGIN = "W0423";
    MODE_NOT_NOTCHED = "W0424";
    SLOWER_THAN_P = "W0425";
    HARDLY_DAMPED = "W0426";
    PROBE_MISSES = "E0431";
    GAUGES_BLIND = "E0432";
    GAUGE_RANGE = "E0433";
    CALIBRATION_AMBIGUOUS = "E0434";
    GAUGES_DIVERGE = "E0435";
    BIAS_UNREACHABLE = "E0440";
    AXIS_UNREACHABLE = "E0441";
    TRAJECTORY_UNREACHABLE = "E0442";
    NO_ROOM = "W0444";
    ZERO_OUTSIDE = "E0450";
    MOVES_TOO_SLOW = "E0451";
    FRAMES_TOO_WIDE = "E0452";
    TRAJECTORY_JUMPS = "E0453";
    TRAJECTORY_OUTSIDE = "E0454";
    TRAJECTORY_TOO_FAST = "E0455";
    TRAJECTORY_TICKS = "E0456";
    WAVEFORM_CLOSED_TWICE = "E0457";
    TRAJECTORY_CORNERS = "W0458";
    STOP_LEAVES = "E0459";
    WAVEFORM_HEADER = "E0460";
    WAVEFORM_VALUE = "E0461";
    WAVEFORM_TIME = "E0462";
    WAVEFORM_LENGTH = "E0463";
    SUPERVISOR_TIME = "E0470";
    SUPERVISOR_BOUND = "E0471";
    SUPERVISOR_RAMP = "E0472";
    SUPERVISOR_REST = "E0473";
    GAUGE_INPUT = "E0474";
    INPUT_WITHOUT_CALIBRATION = "E0475";
    WIRING_BOUNDS = "E0476";

    // Records.
    RECORD_IO = "E0501";
    RECORD_TOO_LARGE = "E0502";
    RECORD_NOT_TEXT = "E0503";
    RECORD_HEADER = "E0504";
    RECORD_COLUMN_TWICE = "E0505";
    RECORD_VALUE = "E0506";
    RECORD_LENGTHS = "E0507";
    RECORD_NOT_FINITE = "E0508";
    RECORD_TOO_SHORT = "E0509";
    RECORD_TIME = "E0510";
    RECORD_GAP = "E0511";
    RECORD_CONSTANT = "E0512";
    RECORD_STUCK = "E0513";
    RECORD_RELATION = "E0514";
    RECORD_UNIT = "W0515";
    RECORD_LIMITED = "E0516";
    RECORD_GLITCH = "W0517";
    RECORD_JUMP = "W0518";
    RECORD_LONG = "W0519";

    // Identification.
    GRID_NOT_IDENTIFIABLE = "E0601";
    DRIVE_RANGE_EMPTY = "E0602";
    DRIVE_UNIT = "E0603";
    COLUMNS_SWAPPED = "E0604";
    DRIVE_RANGE = "E0605";
    NOT_EXCITED = "E0606";
    TOO_FEW_CURVES = "E0607";
    FEW_CURVES = "W0608";
    CELLS_INTERPOLATED = "W0609";
    NOT_DETERMINED = "E0610";
    POOR_FIT = "W0611";
    VALIDATION_IDLE = "E0612";
    TABLE_FILE = "E0613";
    TABLE_MISMATCH = "E0614";
    RECORD_SCALE = "E0615";
    SWEEP_TOO_FAST = "W0620";
    CURVES_IN_NOISE = "W0621";
    GRID_NOT_CHOSEN = "E0622";
    DISPLACEMENT_UNIT = "E0623";
    NO_CYCLE = "E0625";
    FREQUENCY_UNCLEAR = "E0626";
    RESPONSE_SAMPLES = "E0630";
    RESPONSE_COHERENCE = "E0631";
    RESPONSE_FIT = "E0632";
    RESPONSE_BAND = "W0633";
    RESPONSE_POOR = "W0634";
    GAUGE_NOT_MONOTONE = "E0635";
    GAUGE_RECORD = "E0636";
    GAUGE_HYSTERESIS = "W0637";
    GAUGE_GLITCH = "W0638";
    ONE_RATE = "E0640";
    RATE_TABLE_FILE = "E0641";
    RATE_TABLE_MISMATCH = "E0642";
    RATE_NOT_IN_STABILITY = "W0643";
    STIFFNESS_SIGN = "E0644";
    STIFFNESS_DRIVE = "E0645";
    STIFFNESS_RECORD = "E0646";
    STIFFNESS_UNCERTAIN = "W0647";
    STATIC_TABLE_WITH_CREEP = "W0648";
    RATE_NOT_INVERTIBLE = "E0655";

    // Tuning.
    TUNE_NOTHING = "E0701";
    TUNE_BOUNDS = "E0702";
    TUNE_NO_START = "E0703";
    TUNE_REFUSED = "E0704";
    TUNE_LIMITED = "E0705";

    // Values that do not fit together: the physical lint.
    STROKE_IMPOSSIBLE = "E0801";
    STRAIN_ODD = "W0802";
    RESONANCE_ODD = "W0803";
    SLEW_TOO_FAST = "W0804";
    LAG_AGAINST_SLEW = "W0805";
    CURRENT_AGAINST_SLEW = "W0806";
    AMPLIFIER_NOISE = "W0807";
    CONVERTER_COARSE = "W0808";
    SLEW_TOO_SLOW = "W0809";
    LEG_PART_SMALL = "W0810";
    CENTRE_AT_JOINT = "W0811";
    MOMENT_ODD = "W0812";
    MOMENTS_UNEVEN = "W0813";
    LEG_MASS_ODD = "W0814";
    JOINTS_TOUCH = "W0815";
    PLATFORM_WIDER = "W0816";
    OUT_OF_PROPORTION = "W0817";
    LEGS_CROSS = "W0818";
    REST_NOT_ZERO = "W0819";
    GAUGE_QUIET = "W0820";
    GAUGE_LOPSIDED = "W0821";
    GAUGE_COARSE = "W0822";
    COORDINATE_ODD = "W0823";
    GAUGE_REVERSED = "W0824";
    GAUGE_FAR = "W0825";
    GAUGE_SLIP = "W0826";
    CALIBRATION_ODD = "W0827";
    GAIN_UNEVEN = "W0828";
    WORK_PIECE_ODD = "W0829";
    TIME_WITHOUT_EFFECT = "W0830";
    LEAD_TOO_LONG = "W0831";
    TRANSFER_ODD = "W0832";
    VELOCITY_FILTER_SLOW = "W0833";
    TICKS_AGAINST_MODES = "W0834";
    GAIN_RATIO_ODD = "W0835";
    ADAPTATION_SLOW = "W0836";
    DRIFT_ODD = "W0837";
    CONTACT_LEVER = "W0838";
    CONTACT_FAR = "W0839";
    MOVE_BEYOND_SLEW = "W0840";
    MOVE_SLOW = "W0841";
    LIMIT_WITHOUT_EFFECT = "W0842";
    STREAM_UNCHECKED = "W0843";
    WORKSPACE_TINY = "W0844";
    GAINS_EXCHANGED = "W0845";
    RANGE_AT_ZERO = "W0846";
    CALIBRATION_BENT = "W0847";
    GAUGE_PATTERN = "W0848";
    CONVERTER_WIDE = "W0849";
    PATH_BEYOND_SLEW = "E0850";
    PATH_NEAR_SLEW = "W0851";
    PATH_BEYOND_CURRENT = "E0852";
    PATH_INERTIA = "W0853";
    PATH_EXCITES = "W0854";
    WAVEFORM_STEP = "W0855";
    LEG_PART_SHAPE = "W0856";
    CENTRE_FAR = "W0857";
    DAMPING_ODD = "W0858";
    GRID_COARSE = "W0859";
    JOINT_ANGLE = "E0860";
    CONDITION_POOR = "W0861";
    GAUGE_LATE = "W0862";
    GAUGE_SHORT_OF_STROKE = "N0863";
    CAPACITANCE_ODD = "W0864";
    MOMENTS_ELSEWHERE = "W0865";
    ASKS_NOTHING = "W0866";
    STREAM_SLOW = "W0867";
    PAIR_WIDE = "W0868";
    MODE_ALIASED = "W0869";
    BUDGET_IMPOSSIBLE = "E0870";
    BUDGET_LOOSE = "W0871";
    ESTIMATED = "N0872";
    BUDGET_SWAPPED = "W0873";
    TRIGGER_STEP = "E0874";
    TRIGGER_IN_NOISE = "W0875";
    TRIGGERS_MERGE = "W0876";
    TRIGGER_SINGLE = "W0877";
    INTEGRAL_SLOW = "W0878";
    PRECISION_POOR = "W0880";
    OTHER_FRAME = "W0881";
    JOINTS_CLOCKWISE = "W0882";
    GAUGES_MIRRORED = "N0883";
    LAYOUT_TURNED = "W0884";
    LAYOUT_SMALL = "W0885";
    GAUGE_NOISY = "W0886";
    LIMITS_APART = "W0887";
    FAR_FROM_DEFAULT = "W0888";
    FACTOR_ODD = "W0889";
    FAR_OFF = "E0890";
    ALLOWED = "N0891";
    ALLOWED_NOTHING = "W0892";
    ONE_VALUE = "W0893";
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
    fn codes_are_well_formed_and_in_order() {
        for code in REGISTRY {
            assert!(code.id.len() == 5 && code.id.starts_with(['E', 'W', 'N']), "{}", code.id);
            assert!(code.id[1..].bytes().all(|b| b.is_ascii_digit()), "{}", code.id);
        }
        for pair in REGISTRY.windows(2) {
            let [first, second] = [pair[0].id, pair[1].id].map(|id| (&id[1..], &id[..1]));
            assert!(first < second, "{} before {}", pair[0].id, pair[1].id);
        }
    }

    #[test]
    fn every_page_has_its_code() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/findings");
        let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut files: Vec<String> = std::fs::read_dir(folder).unwrap().map(name).collect();
        let mut pages: Vec<String> = REGISTRY.iter().map(|code| format!("{}.md", code.id)).collect();
        files.sort();
        pages.sort();
        assert_eq!(files, pages);
    }

    #[test]
    fn every_page_has_its_parts() {
        for code in REGISTRY {
            let (heading, rest) = code.page.split_once("\n\n").unwrap();
            assert_eq!(heading, format!("# {}: {}", code.id, code.title()));
            let headings = ["\n## Why it matters\n\n", "\n## Example\n\n", "\n## Fix\n\n"];
            let mut parts = Vec::new();
            let mut rest = rest;
            for heading in headings {
                let (part, behind) = rest.split_once(heading).unwrap_or_else(|| panic!("{}: no {heading:?}", code.id));
                parts.push(part);
                rest = behind;
            }
            parts.push(rest);
            assert!(parts.iter().all(|part| !part.trim().is_empty()), "{}", code.id);
            // Text, and not the blocks of code between.
            let text = code.page.split("```").step_by(2).flat_map(str::lines);
            text.for_each(|line| assert!(line.chars().count() <= 80, "{}: {line}", code.id));
        }
    }
}
