//! The findings of every crate but those of the lints, which are beside their rules in `codegen/compiler/src/lint/`. A code
//! never changes its meaning; a retired one is not used again.
//!
//! The meaning of a code is on its page, `codegen/language/findings/E0441.md` and so on: what is checked, why it matters, a
//! spec that shows it, the fix. The examples are run by `codegen/cli/tests/findings.rs`.

use super::Severity;

/// A code and its page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Code {
    /// Such as `E0102`: E for an error, W for a warning, N for a note.
    pub id: &'static str,
    /// Its page: a file, or the lines of a comment.
    page: &'static [&'static str],
}

impl Code {
    /// A code with its page as Markdown: a heading with id and title, then what is checked, and below headings of the second
    /// level `Why it matters`, `Example` and `Fix`. Lines of text have at most 80 columns. The page is one text, or a line
    /// each, as the compiler passes on the lines of a comment: with the space behind the slashes.
    pub const fn new(id: &'static str, page: &'static [&'static str]) -> Self {
        Self { id, page }
    }

    /// The page as Markdown.
    pub fn page(self) -> String {
        let mut text = String::new();
        for piece in self.page {
            text += piece.strip_prefix(' ').unwrap_or(piece);
            if !piece.ends_with('\n') {
                text.push('\n');
            }
        }
        text
    }

    /// How bad every finding with this code is: its letter says so.
    pub const fn severity(self) -> Severity {
        match self.id.as_bytes() {
            [b'E', ..] => Severity::Error,
            [b'W', ..] => Severity::Warning,
            _ => Severity::Note,
        }
    }

    /// The problem in a few words: the heading of the page.
    pub fn title(self) -> &'static str {
        let heading = self.page.first().and_then(|piece| piece.lines().next()).unwrap_or_default();
        heading.split_once(": ").map_or(heading, |(_, title)| title)
    }

    /// What is checked and why it matters: the text of the page before its example, without headings, as one line.
    pub fn explanation(self) -> String {
        let page = self.page();
        let text = page.split("\n## Example").next().unwrap_or_default();
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

// Statics: otherwise each crate that names a constant would have a copy of its page.
macro_rules! codes {
    ($($name:ident = $id:literal;)*) => {
        $(#[doc = include_str!(concat!("../../findings/", $id, ".md"))]
        pub static $name: Code = Code { id: $id, page: &[include_str!(concat!("../../findings/", $id, ".md"))] };)*
        /// These codes, by number.
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
    MODE_KEY = "E0349";
    MODE_TWICE = "E0350";
    TOO_MANY_MODES = "E0351";
    JOINT_FILE = "E0352";

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
    HARDLY_DAMPED = "W0426";
    STRUCTURE_UNSTABLE = "E0427";
    STRUCTURE_TOO_LOW = "E0428";
    DESIGN_STALE = "W0429";
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
    RECORD_STEP = "W0520";
    RECORD_HUM = "W0521";
    RECORD_START = "W0522";
    RECORD_PART = "N0523";

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
    CREEP_FROM_ONE_RATE = "W0649";
    REST_UNKNOWN = "W0650";
    PLAYS_OF_SOME_LEGS = "W0651";
    NOT_IDENTIFIED = "W0652";
    RATE_NOT_INVERTIBLE = "E0655";
    CROSS_TALK_RECORD = "E0656";

    // Tuning.
    TUNE_NOTHING = "E0701";
    TUNE_BOUNDS = "E0702";
    TUNE_NO_START = "E0703";
    TUNE_REFUSED = "E0704";
    TUNE_LIMITED = "E0705";

    // Values that do not fit together, beside the lints.
    STROKE_IMPOSSIBLE = "E0801";
    WAVEFORM_STEP = "W0855";
    CONDITION_POOR = "W0861";
    GAUGE_SHORT_OF_STROKE = "N0863";
    PRECISION_POOR = "W0880";
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
