//! Modes of the structure that the rigid platform on six legs does not have: those that are known, and those that the
//! controller must tolerate.

use crate::keys::declare::*;

/// Largest damping ratio that the controller may rely on for a mode that is not known.
const LARGEST_DAMPING: f64 = 0.3;
/// Defaults of [`StructuralMode::participation`].
const GAUGE: f64 = 0.5;
const FRAME: f64 = -0.1;
/// That of a frame in a spec.
const FRAME_REACTION: &str = "-0.1";
/// Modes at the same place count as one if their frequencies differ by at most this fraction.
const SAME: f64 = 0.01;

const FREQUENCY: Shape = one(Dimension::FREQUENCY, Range::closed(0.1, 1e7), "Hz");
const KIND: Item = Item::Choice(StructuralKind::WORDS);
/// A kind for all of its places, or with the number of a leg or gauge.
const PLACES: &[&str] = &[
    "leg", "leg 1", "leg 2", "leg 3", "leg 4", "leg 5", "leg 6", "gauge", "gauge 1", "gauge 2", "gauge 3", "gauge 4",
    "gauge 5", "gauge 6", "frame",
];

choice! {
    /// Where a structural mode acts.
    StructuralKind {
        /// In series with a leg: its force reaches the platform through the mode.
        Leg = "leg",
        /// Mount of a gauge.
        Gauge = "gauge",
        /// Frame that the legs push against.
        Frame = "frame",
    }
}

section! {
    /// A known mode of the structure, in addition to those of the rigid platform on its legs: of a leg, of the mount of a gauge, or of the frame. r = f / frequency. A leg mode multiplies the response by H = 1 / (1 - r² + 2 j damping_ratio r); a mode of a gauge or of the frame multiplies it by 1 + participation r² H. Only with [control].
    "mode" ["structural_mode"], Repeated(0, MAX_TABLES) => StructuralMode {
        /// Natural frequency.
        frequency: f64 = FREQUENCY, Required, "" ["f", "f_n", "resonance", "natural_frequency", "eigenfrequency"], "1180 Hz";
        /// Damping ratio.
        damping_ratio: f64 = number(Range::open(0.0, 1.0)), Required, "" ["damping", "zeta"], 0.02;
        /// Where it acts: every leg or one, the mounts of all gauges or of one, or the frame. Legs and gauges are numbered from 1.
        at = one_of(PLACES), Required, "" ["place", "where", "kind"], "gauge 2";
        /// For a gauge or the frame: size and sign of the mode in the reading. It is above 0 for a gauge and below 0 for the frame.
        participation = number(Range::closed(-1.0, 1.0)), Rule("0.5 for a gauge, -0.1 for the frame"), "" ["weight"], 0.5;
    }
    and |fields, table| {
        /// Where it acts.
        kind: StructuralKind = place(fields, table)?.0;
        /// Leg or gauge, from 0. None: all of them, or the frame.
        place: Option<usize> = place(fields, table)?.1;
        /// 1 for a leg; in (0, 1] for a gauge, in [-1, 0) for the frame.
        participation: f64 = match place(fields, table)?.0 {
            StructuralKind::Leg => 1.0,
            StructuralKind::Gauge => fields.number(&join(table, "participation")).unwrap_or(GAUGE),
            StructuralKind::Frame => fields.number(&join(table, "participation")).unwrap_or(FRAME),
        };
    }
}

impl StructuralMode {
    /// Kind of the mode at a place such as `gauge 2`, and the number of its leg or gauge, from 0.
    pub fn place_of(at: &str) -> (StructuralKind, Option<usize>) {
        let mut words = at.split(' ');
        let kind = match words.next() {
            Some("leg") => StructuralKind::Leg,
            Some("gauge") => StructuralKind::Gauge,
            _ => StructuralKind::Frame,
        };
        (kind, words.next().and_then(|number| number.parse::<usize>().ok()?.checked_sub(1)))
    }

    /// Whether two modes, each with kind, number of leg or gauge, and frequency (Hz), count as one: of a kind at the same place with
    /// frequencies that differ by at most 1 %.
    pub fn coincide(
        (kind, at, frequency): (StructuralKind, Option<usize>, f64),
        (other_kind, other_at, other): (StructuralKind, Option<usize>, f64),
    ) -> bool {
        let meet = at.is_none() || other_at.is_none() || at == other_at;
        kind == other_kind && meet && (other - frequency).abs() <= SAME * frequency.max(other)
    }
}

/// Kind of the mode at `table`, and the number of its leg or gauge, from 0.
pub(crate) fn place(fields: &Fields, table: &str) -> Option<(StructuralKind, Option<usize>)> {
    Some(StructuralMode::place_of(fields.choice(&join(table, "at"))?))
}

section! {
    /// Structural modes that the spec does not list. The controller must be stable with any single one of them: its frequency is at least `f0` and its damping ratio at least `damping_ratio`. A spec without this section is checked with the defaults. The factors are those of [[mode]].
    "robust.structure" ["structural_uncertainty", "unmodelled"], Plain => StructuralUncertainty {
        /// Lowest frequency of such a mode.
        f0 = FREQUENCY, Rule("2.5 times the lowest mode of the platform"), "" ["from", "frequency", "lowest"], "900 Hz";
        /// Smallest damping ratio of such a mode.
        damping_ratio: f64 = number(Range::above(0.0, LARGEST_DAMPING)), Default(0.01), "" ["damping", "zeta"], 0.01;
        /// Where such a mode may act. List at least one; all three unless a measurement excludes one.
        kinds: Vec<StructuralKind> = Shape::Leading(1, &[KIND; 3]), Default(["leg", "gauge", "frame"]), "" ["at", "places"], ["leg", "gauge", "frame"];
        /// Participation of a mode of a gauge mount.
        gauge_participation: f64 = number(Range::above(0.0, 1.0)), Default(0.5), "", 0.5;
        /// Participation of a mode of the frame.
        frame_participation: f64 = number(Range { min: -1.0, max: 0.0, min_included: true, max_included: false }), Default(FRAME_REACTION), "", FRAME_REACTION;
    }
    and |fields, table| {
        /// Lowest frequency, Hz. None: 2.5 times the lowest mode of the platform.
        from: Option<f64> = fields.number(&join(table, "f0"));
        /// Whether the spec has the section.
        given: bool = fields.table(table).is_some();
    }
}

impl StructuralUncertainty {
    /// Lowest frequency of such a mode, Hz, on a platform whose lowest mode is `lowest`, Hz.
    pub fn from_hz(&self, lowest: f64) -> f64 {
        self.from.unwrap_or(2.5 * lowest)
    }
}

impl Value for Vec<StructuralKind> {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        let kinds = [StructuralKind::Leg, StructuralKind::Gauge, StructuralKind::Frame];
        fields.texts(path)?.iter().map(|word| kinds.into_iter().find(|kind| kind.word() == word)).collect()
    }
}
