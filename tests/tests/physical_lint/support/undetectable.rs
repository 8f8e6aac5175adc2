//! Slips that make another platform as plausible as the one that was meant: no rule tells them from a choice, and the reason
//! stands beside each. They are counted by themselves, and only where nothing was found.

use super::super::list;
use super::mutants::Mutant;

/// Which slips, and why nobody could know.
pub struct Undetectable {
    /// The kind; empty: any.
    pub kind: &'static str,
    /// Key without indices, or its beginning.
    pub key: &'static str,
    /// Part of the change; empty: any.
    pub change: &'static str,
    /// The spec that it is true of; empty: any.
    base: &'static str,
    pub why: &'static str,
}

const fn of(kind: &'static str, key: &'static str, change: &'static str, why: &'static str) -> Undetectable {
    Undetectable { kind, key, change, base: "", why }
}

const JOINTS: &str = "features/platform-joints.toml";
const FREE: &str = "a layout without a pattern, where gauges and targets may stand anywhere on the platform";
const FRAME: &str = "a work frame or a tool may lie anywhere, in any order and with any sign";
const LOAD: &str = "the load decides where mass lies; within the size of the platform every place and sign is one";

/// In the order of kinds, then keys.
pub const UNDETECTABLE: &[Undetectable] = &[
    of("degrees for radians", "geometry.", "", "joints of a pair as near as a hundredth of a leg are built"),
    of(
        "digit",
        "actuator.axial_stiffness",
        "x 0.1",
        "a soft leg with less mass moving than declared resonates as well; stacks are sold from 1 to 1000 N/um",
    ),
    of("digit", "actuator.slew_rate", "x 0.1", "a lower limit of slew is a choice; what a trajectory needs is checked"),
    of(
        "digit",
        "actuator.slew_rate",
        "x 10",
        "where a third of the resonance's period allows it, a faster amplifier is a choice",
    ),
    of("digit", "adaptation.level_bandwidth", "x 0.1", "45 and 450 rad/s are both usual"),
    of(
        "digit",
        "amplifier.lag",
        "",
        "amplifiers lag from 10 us to some ms; only one too slow for its own slew rate is known to be wrong",
    ),
    of("digit", "amplifier.noise", "", "amplifiers have 0.1 to 10 mV rms"),
    of("digit", "control.frames", "", FRAME),
    of("digit", "control.lead", "", "the best lead lies anywhere from nothing to the lag"),
    of(
        "digit",
        "control.setpoint.bias",
        "x 0.1",
        "a bias is a choice; that the workspace is reached from it is checked",
    ),
    of("digit", "dac.range", "", "up to four times the stacks' range a converter is wide, not wrong"),
    of("digit", "geometry.base_angle", "", "joints of a pair from one to sixty degrees apart are built"),
    of("digit", "geometry.platform_angle", "", "joints of a pair from one to sixty degrees apart are built"),
    of("digit", "platform.center_of_mass", "", LOAD),
    of("digit", "platform.products", "", LOAD),
    of("digit", "sensor.noise", "", "gauges have 0.1 to 100 nm rms"),
    of("digit", "sensor.range", "x 0.1", "the gauge of a leg may begin next to where the leg rests"),
    of("digit", "sensor.range", "x 10", "the gauge of a leg may begin a third of the stroke below rest"),
    of("digit", "target.budget", "", "a budget is what its owner has left; beyond all measure it is warned of"),
    of(
        "digit",
        "timing.period",
        "",
        "ticks from 10 us to 1 ms are built; against modes and stability they are checked",
    ),
    of("digit", "trajectory", "", "a table may be played as fast as legs and slew rate allow, and that is checked"),
    of("digit", "workspace.", "x 0.1", "a smaller workspace is a choice"),
    of("group", "control.frames", "", FRAME),
    of("group", "platform.center_of_mass", "", LOAD),
    of("group", "platform.products", "", LOAD),
    of("keys swapped", "control.lead", "", "lead and lag are alike, and a lead a quarter above the lag is still one"),
    of("keys swapped", "dac.bits", "", "both are from 16 to 20"),
    of("keys swapped", "geometry.", "height", "height and radius are alike: hexapods are built flat and tall"),
    of("keys swapped", "leg.", "", "the two parts of a leg are alike"),
    of("keys swapped", "timing.period", "", "lag and period are alike"),
    of("mm for cm", "control.frames", "", FRAME),
    of("mm for cm", "platform.center_of_mass", "", LOAD),
    of("rows turned", "control.frames", "", FRAME),
    of("rows turned", "platform.center_of_mass", "", LOAD),
    of("rows turned", "platform.products", "", LOAD),
    of("rows turned", "workspace.", "", "bounds of one size: any order may be meant"),
    of("sign", "gauge.direction", "", "the only gauge along its line: it may count either way"),
    of("swapped", "workspace.", "", "bounds of one size: any order may be meant"),
    of("swapped", "platform.products", "", LOAD),
    of("um for nm", "control.frames", "", FRAME),
    Undetectable { base: JOINTS, ..of("", "gauge.direction", "", FREE) },
    Undetectable { base: JOINTS, ..of("", "gauge.point", "", FREE) },
    Undetectable { base: JOINTS, ..of("", "gauge.target_", "", FREE) },
];

impl Undetectable {
    /// Whether it says so of a slip in a spec.
    pub fn is_of(&self, base: &str, mutant: &Mutant) -> bool {
        // gauge[3].point[1] → gauge.point
        let key: String = list(&mutant.key).split(['[', ']']).step_by(2).collect();
        (self.kind.is_empty() || self.kind == mutant.kind)
            && key.starts_with(self.key)
            && mutant.change.contains(self.change)
            && (self.base.is_empty() || self.base == base)
    }
}

/// The reason for which a slip in a spec cannot be known, if there is one.
pub fn reason(base: &str, mutant: &Mutant) -> Option<&'static str> {
    UNDETECTABLE.iter().find(|one| one.is_of(base, mutant)).map(|one| one.why)
}
