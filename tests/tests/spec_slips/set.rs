//! Slips of engineers in their first hour, each with the key that the first finding should be about, and with what its help
//! should say. Written down before the messages were looked at; no message is a reason to change a line here.

use crate::physical_lint::support::spec;

use super::edit::Edit::{self, Add, Line, Record, Remove, Rename, Swap, Text, Value};

/// The spec that a slip is made in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Of {
    /// `own.toml`: six gauges see the platform.
    Own,
    /// `small.toml`: each leg has its own gauge.
    Small,
    /// `specs/reference.toml`.
    Reference,
    /// `specs/features/platform-gains.toml`.
    Gains,
    /// `specs/features/platform-environment.toml`.
    WorkPiece,
    /// `specs/features/platform-calibration.toml`.
    Calibrated,
    /// `specs/features/platform-joints.toml`.
    Joints,
    /// `specs/features/triggers.toml`.
    Triggers,
    /// `specs/legs.toml`.
    Legs,
}

impl Of {
    /// The spec as it is.
    pub fn text(self) -> String {
        match self {
            Self::Own => include_str!("own.toml").to_owned(),
            Self::Small => include_str!("small.toml").to_owned(),
            Self::Reference => spec("reference.toml"),
            Self::Gains => spec("features/platform-gains.toml"),
            Self::WorkPiece => spec("features/platform-environment.toml"),
            Self::Calibrated => spec("features/platform-calibration.toml"),
            Self::Joints => spec("features/platform-joints.toml"),
            Self::Triggers => spec("features/triggers.toml"),
            Self::Legs => spec("legs.toml"),
        }
    }
}

/// One slip.
#[derive(Debug)]
pub struct Slip {
    pub of: Of,
    pub kind: &'static str,
    pub edit: Edit,
    /// Key paths, without the index of a list's item: the first finding is about one of these. Two where nobody can know which.
    pub keys: &'static [&'static str],
    /// The help says one of these.
    pub fix: &'static [&'static str],
}

const fn s(
    of: Of,
    kind: &'static str,
    edit: Edit,
    keys: &'static [&'static str],
    fix: &'static [&'static str],
) -> Slip {
    Slip { of, kind, edit, keys, fix }
}

use Of::{Calibrated, Gains, Own, Reference, Small, WorkPiece};

const SYMBOL: &str = "symbol or common name";
const SECTION: &str = "wrong section";
const NO_UNIT: &str = "no unit";
const UNIT: &str = "unit";
const SPELLING: &str = "spelling of a unit";
const SIGN: &str = "sign";
const SWAPPED: &str = "swapped";
const MISSING: &str = "missing";
const COPY: &str = "copy";
const WORD: &str = "word";
const RECORD: &str = "record";
const FRAME: &str = "frame";
const FIGURE: &str = "figure";

/// All of them.
// One slip a line: this is a table.
#[rustfmt::skip]
pub const SET: &[Slip] = &[
    // Symbols of the paper and what people call things.
    s(Own, SYMBOL, Rename("geometry.base_radius", "r_B"), &["geometry.r_B"], &["base_radius"]),
    s(Own, SYMBOL, Rename("geometry.platform_radius", "r_P"), &["geometry.r_P"], &["platform_radius"]),
    s(Own, SYMBOL, Rename("geometry.base_angle", "alpha_B"), &["geometry.alpha_B"], &["base_angle"]),
    s(Own, SYMBOL, Rename("geometry.platform_angle", "alpha_P"), &["geometry.alpha_P"], &["platform_angle"]),
    s(Own, SYMBOL, Rename("geometry.height", "P_z"), &["geometry.P_z"], &["height"]),
    s(Own, SYMBOL, Rename("geometry.height", "h"), &["geometry.h"], &["height"]),
    s(Small, SYMBOL, Rename("geometry.base_radius", "rB"), &["geometry.rB"], &["base_radius"]),
    s(Small, SYMBOL, Rename("geometry.platform_radius", "top_radius"), &["geometry.top_radius"], &["platform_radius"]),
    s(Own, SYMBOL, Rename("platform.mass", "m"), &["platform.m"], &["mass"]),
    s(Small, SYMBOL, Rename("platform.mass", "payload"), &["platform.payload"], &["mass"]),
    s(Own, SYMBOL, Rename("platform.inertia", "I"), &["platform.I"], &["inertia"]),
    s(Small, SYMBOL, Rename("platform.inertia", "J"), &["platform.J"], &["inertia"]),
    s(Own, SYMBOL, Rename("platform.center_of_mass", "cog"), &["platform.cog"], &["center_of_mass"]),
    s(Own, SYMBOL, Rename("leg.fixed_mass", "m_s"), &["leg.m_s"], &["fixed_mass"]),
    s(Own, SYMBOL, Rename("leg.extensible_mass", "m_e"), &["leg.m_e"], &["extensible_mass"]),
    s(Own, SYMBOL, Rename("leg.fixed_inertia", "I_s"), &["leg.I_s"], &["fixed_inertia"]),
    s(Own, SYMBOL, Rename("leg.extensible_center", "l_e"), &["leg.l_e"], &["extensible_center"]),
    s(Own, SYMBOL, Rename("actuator.stack_gain", "gain"), &["actuator.gain"], &["stack_gain"]),
    s(Small, SYMBOL, Rename("actuator.stack_gain", "rho"), &["actuator.rho"], &["stack_gain"]),
    s(Own, SYMBOL, Rename("actuator.axial_stiffness", "stiffness"), &["actuator.stiffness"], &["axial_stiffness"]),
    s(Small, SYMBOL, Rename("actuator.axial_stiffness", "k_a"), &["actuator.k_a"], &["axial_stiffness"]),
    s(Small, SYMBOL, Rename("actuator.axial_stiffness", "k"), &["actuator.k"], &["axial_stiffness"]),
    s(Own, SYMBOL, Rename("actuator.stroke", "travel"), &["actuator.travel"], &["stroke"]),
    s(Own, SYMBOL, Rename("actuator.slew_rate", "slew"), &["actuator.slew"], &["slew_rate"]),
    s(Own, SYMBOL, Rename("actuator.resonance", "f_0"), &["actuator.f_0"], &["resonance"]),
    s(Small, SYMBOL, Rename("actuator.resonance", "natural_frequency"), &["actuator.natural_frequency"], &["resonance"]),
    s(Own, SYMBOL, Rename("actuator.damping_ratio", "zeta"), &["actuator.zeta"], &["damping_ratio"]),
    s(Small, SYMBOL, Rename("actuator.damping_ratio", "damping"), &["actuator.damping"], &["damping_ratio"]),
    s(Own, SYMBOL, Rename("actuator.capacitance", "C"), &["actuator.C"], &["capacitance"]),
    s(Own, SYMBOL, Rename("actuator.voltage", "drive"), &["actuator.drive"], &["voltage"]),
    s(Own, SYMBOL, Rename("actuator.stacks", "n"), &["actuator.n"], &["stacks"]),
    s(Own, SYMBOL, Rename("timing.period", "T_s"), &["timing.T_s"], &["period"]),
    s(Own, SYMBOL, Line("timing.period", "rate = \"20 kHz\""), &["timing.rate"], &["period = \"50 us\""]),
    s(Small, SYMBOL, Line("timing.period", "sample_rate = \"5 kHz\""), &["timing.sample_rate"], &["period = \"200 us\""]),
    s(Small, SYMBOL, Line("timing.period", "period = \"5 kHz\""), &["timing.period"], &["200 us"]),
    s(Own, SYMBOL, Rename("sensor.noise", "sigma"), &["sensor.sigma"], &["noise"]),
    s(Own, SYMBOL, Rename("amplifier.lag", "time_constant"), &["amplifier.time_constant"], &["lag"]),
    s(Own, SYMBOL, Line("amplifier.lag", "bandwidth = \"450 Hz\""), &["amplifier.bandwidth"], &["lag"]),
    s(Own, SYMBOL, Rename("dac.bits", "resolution"), &["dac.resolution"], &["bits"]),
    s(Own, SYMBOL, Rename("workspace.translation", "xyz"), &["workspace.xyz"], &["translation"]),
    s(Small, SYMBOL, Rename("workspace.rotation", "angles"), &["workspace.angles"], &["rotation"]),
    s(Own, SYMBOL, Rename("control.modal_damping", "zeta"), &["control.zeta"], &["modal_damping"]),
    s(Own, SYMBOL, Rename("hysteresis.records", "file"), &["hysteresis.file"], &["records"]),
    s(Small, SYMBOL, Rename("adaptation.gain_ratio", "lambda"), &["adaptation.lambda"], &["gain_ratio"]),
    s(Small, SYMBOL, Rename("adaptation.level_weight", "omega_1"), &["adaptation.omega_1"], &["level_weight"]),
    s(Gains, SYMBOL, Rename("gains.proportional", "k_p"), &["gains.k_p"], &["proportional"]),
    s(Gains, SYMBOL, Rename("gains.integral", "Ki"), &["gains.Ki"], &["integral"]),
    s(Gains, SYMBOL, Rename("gains.derivative", "k_v"), &["gains.k_v"], &["derivative"]),
    s(Own, SYMBOL, Rename("trajectory[0].frequency", "f_c"), &["trajectory[0].f_c"], &["frequency"]),
    s(WorkPiece, SYMBOL, Rename("control.environment.stiffness", "K_e"), &["control.environment.K_e"], &["stiffness"]),
    s(Own, SYMBOL, Rename("gauge[1].direction", "normal"), &["gauge[1].normal"], &["direction"]),
    s(Own, SYMBOL, Rename("gauge[1].point", "position"), &["gauge[1].position"], &["point"]),
    // Names of sections, and keys in another one.
    s(Own, SECTION, Text("[actuator]", "[piezo]"), &["piezo"], &["actuator"]),
    s(Own, SECTION, Text("[geometry]", "[hexapod]"), &["hexapod"], &["geometry"]),
    s(Small, SECTION, Text("[sensor]", "[sensors]"), &["sensors"], &["sensor"]),
    s(Own, SECTION, Text("[timing]", "[sampling]"), &["sampling"], &["timing"]),
    s(Own, SECTION, Text("[leg]", "[legs]"), &["legs"], &["leg"]),
    s(Small, SECTION, Text("[dac]", "[converter]"), &["converter"], &["dac"]),
    s(Own, SECTION, Add("platform", "r_P = \"120 mm\""), &["platform.r_P"], &["geometry.platform_radius"]),
    s(Own, SECTION, Add("", "T_s = \"50 us\""), &["T_s"], &["timing.period"]),
    s(Own, SECTION, Add("actuator", "lag = \"0.35 ms\""), &["actuator.lag"], &["amplifier.lag"]),
    s(Small, SECTION, Add("sensor", "grid = 32"), &["sensor.grid"], &["hysteresis.grid"]),
    // Numbers without a unit.
    s(Own, NO_UNIT, Value("platform.inertia", "0.0012"), &["platform.inertia"], &["kg m^2"]),
    s(Own, NO_UNIT, Value("platform.inertia", "[0.012, 0.012, 0.02]"), &["platform.inertia"], &["kg m^2"]),
    s(Own, NO_UNIT, Value("platform.mass", "2.4"), &["platform.mass"], &["kg"]),
    s(Small, NO_UNIT, Value("actuator.stroke", "30"), &["actuator.stroke"], &["um"]),
    s(Own, NO_UNIT, Value("timing.period", "50e-6"), &["timing.period"], &["us"]),
    s(Own, NO_UNIT, Value("actuator.voltage", "[-20, 120]"), &["actuator.voltage"], &["V"]),
    s(Own, NO_UNIT, Value("geometry.height", "180"), &["geometry.height"], &["mm"]),
    s(Own, NO_UNIT, Value("geometry.base_angle", "10"), &["geometry.base_angle"], &["deg"]),
    s(Small, NO_UNIT, Value("actuator.axial_stiffness", "40e6"), &["actuator.axial_stiffness"], &["N/um"]),
    s(Own, NO_UNIT, Value("sensor.noise", "\"1\""), &["sensor.noise"], &["nm"]),
    s(Small, NO_UNIT, Value("workspace.rotation", "[0.28, 0.26, 0.44]"), &["workspace.rotation"], &["mrad"]),
    // A unit that is off by a thousand or more, or another one than meant.
    s(Own, UNIT, Value("sensor.noise", "\"1 um\""), &["sensor.noise"], &["nm"]),
    s(Small, UNIT, Value("sensor.noise", "\"3 um\""), &["sensor.noise"], &["nm"]),
    s(Reference, UNIT, Value("sensor.noise", "\"2.2 um\""), &["sensor.noise"], &["nm"]),
    s(Own, UNIT, Value("amplifier.noise", "\"1 V\""), &["amplifier.noise"], &["mV"]),
    s(Small, UNIT, Value("amplifier.noise", "\"2 V\""), &["amplifier.noise"], &["mV"]),
    s(Own, UNIT, Value("actuator.capacitance", "\"6 nF\""), &["actuator.capacitance"], &["uF"]),
    s(Own, UNIT, Value("actuator.capacitance", "\"27 mF\""), &["actuator.capacitance"], &["uF"]),
    s(Own, UNIT, Value("amplifier.current", "\"2 mA\""), &["amplifier.current"], &["mA", "unit"]),
    s(Own, UNIT, Value("actuator.axial_stiffness", "\"25 N/m\""), &["actuator.axial_stiffness"], &["N/um", "unit"]),
    s(Small, UNIT, Value("actuator.axial_stiffness", "\"40 N/mm\""), &["actuator.axial_stiffness"], &["N/um", "unit"]),
    s(Reference, UNIT, Value("actuator.axial_stiffness", "\"10 N/m\""), &["actuator.axial_stiffness"], &["N/um", "unit"]),
    s(Own, UNIT, Value("actuator.stroke", "\"100 mm\""), &["actuator.stroke"], &["um", "range", "unit"]),
    s(Small, UNIT, Value("actuator.stroke", "\"30 nm\""), &["actuator.stroke"], &["um", "unit"]),
    s(Own, UNIT, Value("actuator.stack_gain", "\"0.7143 nm/V\""), &["actuator.stack_gain"], &["um/V", "unit"]),
    s(Own, UNIT, Value("actuator.slew_rate", "\"56 V/s\""), &["actuator.slew_rate"], &["V/ms"]),
    s(Small, UNIT, Value("actuator.slew_rate", "\"60 V/us\""), &["actuator.slew_rate"], &["V/ms"]),
    s(Own, UNIT, Value("actuator.resonance", "\"1200 kHz\""), &["actuator.resonance"], &["Hz"]),
    s(Small, UNIT, Value("actuator.resonance", "\"2.2 Hz\""), &["actuator.resonance"], &["kHz", "unit"]),
    s(Own, UNIT, Value("actuator.damping_ratio", "1e-5"), &["actuator.damping_ratio"], &["ratio", "percent", "0."]),
    s(Own, UNIT, Value("actuator.damping_ratio", "10"), &["actuator.damping_ratio"], &["ratio", "less than 1"]),
    s(Own, UNIT, Value("platform.mass", "\"2400 kg\""), &["platform.mass"], &["kg or g", "\"2.4 kg\""]),
    s(Small, UNIT, Value("platform.mass", "\"0.8 g\""), &["platform.mass"], &["kg or g", "\"0.8 kg\""]),
    s(Own, UNIT, Value("platform.inertia", "[\"0.012 kg mm^2\", \"0.012 kg mm^2\", \"0.02 kg mm^2\"]"), &["platform.inertia", "platform.mass"], &["m^2"]),
    s(Own, UNIT, Value("platform.inertia", "[\"12 kg m^2\", \"12 kg m^2\", \"20 kg m^2\"]"), &["platform.inertia", "platform.mass"], &["m^2"]),
    s(Own, UNIT, Value("leg.fixed_mass", "\"90.26 kg\""), &["leg.fixed_mass"], &["kg or g", "unit"]),
    s(Small, UNIT, Value("leg.extensible_inertia", "\"28200 g m^2\""), &["leg.extensible_inertia"], &["mm^2", "unit"]),
    s(Own, UNIT, Value("leg.fixed_center", "\"63 um\""), &["leg.fixed_center"], &["mm"]),
    s(Own, UNIT, Value("leg.extensible_center", "\"63 cm\""), &["leg.extensible_center"], &["mm"]),
    s(Own, UNIT, Value("geometry.base_radius", "\"200 m\""), &["geometry.base_radius"], &["mm", "unit"]),
    s(Own, UNIT, Value("geometry.platform_radius", "\"120 cm\""), &["geometry.platform_radius"], &["mm", "unit"]),
    s(Small, UNIT, Value("geometry.height", "\"11 mm\""), &["geometry.height"], &["height", "unit"]),
    s(Small, UNIT, Value("geometry.base_angle", "\"12 rad\""), &["geometry.base_angle"], &["rad", "deg"]),
    s(Own, UNIT, Value("amplifier.lag", "\"0.35 s\""), &["amplifier.lag"], &["ms"]),
    s(Own, UNIT, Value("control.lead", "\"1 ms\""), &["control.lead"], &["lag", "ms"]),
    s(Own, UNIT, Value("control.lead", "\"0.1 us\""), &["control.lead"], &["ms", "unit"]),
    s(Own, UNIT, Value("timing.period", "\"50 ms\""), &["timing.period"], &["us", "unit"]),
    s(Small, UNIT, Value("timing.period", "\"0.2 s\""), &["timing.period"], &["us", "unit"]),
    s(Own, UNIT, Value("workspace.translation", "[\"76 mm\", \"67 mm\", \"120 mm\"]"), &["workspace.translation"], &["unit", "um"]),
    s(Small, UNIT, Value("workspace.rotation", "[\"0.28 rad\", \"0.26 rad\", \"0.44 rad\"]"), &["workspace.rotation"], &["mrad"]),
    s(Own, UNIT, Value("workspace.rotation", "[\"0.57 urad\", \"0.5 urad\", \"0.56 urad\"]"), &["workspace.rotation"], &["unit", "mrad"]),
    s(Own, UNIT, Value("workspace.translation", "[\"76 nm\", \"67 nm\", \"120 nm\"]"), &["workspace.translation"], &["unit", "um"]),
    s(Own, UNIT, Value("control.setpoint.bias", "[\"0 um\", \"0 um\", \"60 mm\", \"0 urad\", \"0 urad\", \"0 urad\"]"), &["control.setpoint.bias"], &["um", "unit"]),
    s(Own, UNIT, Value("control.setpoint.stream_speed", "[\"1.5 um/s\", \"1.3 um/s\", \"2.4 um/s\", \"11 urad/s\", \"10 urad/s\", \"11 urad/s\"]"), &["control.setpoint.stream_speed"], &["unit", "mm/s", "at least"]),
    s(Own, UNIT, Value("sensor.range", "[\"-130 nm\", \"130 nm\"]"), &["sensor.range"], &["unit", "um"]),
    s(Small, UNIT, Value("sensor.range", "[\"-1.5 mm\", \"34.5 mm\"]"), &["sensor.range"], &["unit", "um"]),
    s(Small, UNIT, Value("sensor.range", "[\"-1.5 um\", \"34.5 nm\"]"), &["sensor.range"], &["unit", "um"]),
    s(Own, UNIT, Value("requirements.precision", "\"50 um\""), &["requirements.precision"], &["nm"]),
    s(Own, UNIT, Value("trajectory[0].frequency", "\"5 kHz\""), &["trajectory[0].frequency"], &["Hz", "slower"]),
    s(Own, UNIT, Value("gauge[4].point", "[\"-96 um\", \"0 mm\", \"180 mm\"]"), &["gauge[4].point"], &["mm"]),
    s(Own, UNIT, Value("gauge[0].point", "[\"96 mm\", \"0 mm\", \"180 m\"]"), &["gauge[0].point"], &["mm", "unit", "range"]),
    s(Own, UNIT, Value("platform.center_of_mass", "[\"0 mm\", \"0 mm\", \"20 m\"]"), &["platform.center_of_mass"], &["mm", "unit", "range"]),
    s(Gains, UNIT, Text("\"5.07e5 N/m\", \"5.07e5 N/m\"", "\"5.07e5 N/um\", \"5.07e5 N/m\""), &["gains.proportional"], &["unit", "N/m"]),
    s(WorkPiece, UNIT, Text("\"3e6 N/m\"", "\"3e6 N/mm\""), &["control.environment.stiffness"], &["unit", "N/m"]),
    s(Calibrated, UNIT, Value("sensor.calibration", "[\"-45 um\", \"10 nm/V\"]"), &["gauge[0].calibration", "sensor.calibration", "sensor.range"], &["unit", "calibration"]),
    s(Own, UNIT, Value("actuator.voltage", "[\"-20 V\", \"120 mV\"]"), &["actuator.voltage"], &["V", "order"]),
    s(Own, UNIT, Value("actuator.stroke", "\"100 V\""), &["actuator.stroke"], &["um", "mm"]),
    s(Gains, UNIT, Text("\"9.9e3 N m/rad\", \"9.9e3 N m/rad\"", "\"9.9e3 N/rad\", \"9.9e3 N/rad\""), &["gains.proportional"], &["N m/rad"]),
    // Units as people spell them.
    s(Own, SPELLING, Value("actuator.stroke", "\"100 micron\""), &["actuator.stroke"], &["um"]),
    s(Own, SPELLING, Value("geometry.base_angle", "\"10 degrees\""), &["geometry.base_angle"], &["deg"]),
    s(Own, SPELLING, Value("platform.mass", "\"2,4 kg\""), &["platform.mass"], &["2.4", "point"]),
    s(Own, SPELLING, Value("actuator.resonance", "\"1200 hz\""), &["actuator.resonance"], &["Hz"]),
    s(Own, SPELLING, Value("amplifier.lag", "\"0.35 msec\""), &["amplifier.lag"], &["ms"]),
    s(Own, SPELLING, Value("platform.inertia", "[\"0.012 kgm^2\", \"0.012 kgm^2\", \"0.02 kgm^2\"]"), &["platform.inertia"], &["kg m^2"]),
    s(Small, SPELLING, Value("actuator.slew_rate", "\"60 V per ms\""), &["actuator.slew_rate"], &["V/ms"]),
    s(Small, SPELLING, Value("platform.mass", "0.8 kg"), &["platform.mass"], &["quotes", "\"0.8 kg\""]),
    // Signs.
    s(Own, SIGN, Value("actuator.voltage", "[\"120 V\", \"-20 V\"]"), &["actuator.voltage"], &["smaller", "first"]),
    s(Own, SIGN, Value("actuator.voltage", "[\"20 V\", \"120 V\"]"), &["actuator.voltage", "actuator.stroke", "dac.range", "supervisor.rest_voltage"], &["actuator.voltage", "dac.range", "rest"]),
    s(Own, SIGN, Value("gauge[2].direction", "[0, 0, -1]"), &["gauge[2].direction"], &["sign"]),
    s(Own, SIGN, Value("control.setpoint.bias", "[\"0 um\", \"0 um\", \"-60 um\", \"0 urad\", \"0 urad\", \"0 urad\"]"), &["control.setpoint.bias"], &["add", "sign", "bias"]),
    s(Own, SIGN, Value("gauge[1].point", "[\"48 mm\", \"83.138 mm\", \"180 mm\"]"), &["gauge[1].point"], &["sign"]),
    s(Own, SIGN, Value("platform.mass", "\"-2.4 kg\""), &["platform.mass"], &["range"]),
    s(Small, SIGN, Value("sensor.range", "[\"1.5 um\", \"34.5 um\"]"), &["sensor.range"], &["rest", "0"]),
    // Values in each other's place.
    s(Own, SWAPPED, Swap("geometry.base_radius", "geometry.platform_radius"), &["geometry.base_radius", "geometry.platform_radius"], &["base_radius", "platform_radius", "each other"]),
    s(Own, SWAPPED, Value("platform.inertia", "[\"0.012 kg m^2\", \"0.02 kg m^2\", \"0.012 kg m^2\"]"), &["platform.inertia"], &["order", "I_zz"]),
    s(Own, SWAPPED, Swap("amplifier.lag", "timing.period"), &["amplifier.lag", "timing.period"], &["lag", "period"]),
    s(Own, SWAPPED, Value("gauge[5].direction", "[0, 1, 0]"), &["gauge[5].direction", "gauge[5].point"], &["order", "direction"]),
    s(Own, SWAPPED, Value("gauge[1].point", "[\"83.138 mm\", \"-48 mm\", \"180 mm\"]"), &["gauge[1].point"], &["order"]),
    s(Own, SWAPPED, Value("control.setpoint.bias", "[\"60 um\", \"0 um\", \"0 um\", \"0 urad\", \"0 urad\", \"0 urad\"]"), &["control.setpoint.bias"], &["order", "z", "add"]),
    s(Reference, SWAPPED, Swap("target.budget.flash", "target.budget.ram"), &["target.budget.ram", "target.budget.flash"], &["flash", "RAM"]),
    s(Small, SWAPPED, Swap("dac.range", "sensor.range"), &["dac.range", "sensor.range"], &["V", "um"]),
    s(Own, SWAPPED, Swap("platform.mass", "leg.fixed_mass"), &["platform.mass", "leg.fixed_mass"], &["platform.mass"]),
    // What is not there.
    s(Own, MISSING, Remove("platform.mass"), &["platform.mass"], &["mass = "]),
    s(Own, MISSING, Remove("timing.period"), &["timing.period"], &["period = "]),
    s(Small, MISSING, Remove("hysteresis.records"), &["hysteresis.records"], &["records = "]),
    s(Own, MISSING, Remove("gauge[3].direction"), &["gauge[3].direction"], &["direction = "]),
    s(Own, MISSING, Text("[[gauge]]\npoint     = [\"0 mm\", \"96 mm\", \"180 mm\"]\ndirection = [1, 0, 0]\n", ""), &["gauge"], &["six", "6"]),
    s(Own, MISSING, Remove("geometry.height"), &["geometry.height"], &["height = "]),
    s(Own, MISSING, Value("platform.inertia", "[\"0.012 kg m^2\", \"0.02 kg m^2\"]"), &["platform.inertia"], &["3"]),
    s(Small, MISSING, Text("[dac]\nbits  = 16\nrange = [\"0 V\", \"150 V\"]\n", ""), &["dac"], &["[dac]"]),
    // What was copied and not changed.
    s(Own, COPY, Value("gauge[4].point", "[\"96 mm\", \"0 mm\", \"180 mm\"]"), &["gauge[4].point", "gauge[4]"], &["gauge[3]"]),
    s(Own, COPY, Value("gauge[2].point", "[\"-48 mm\", \"83.138 mm\", \"180 mm\"]"), &["gauge[2].point", "gauge[2]"], &["gauge[1]"]),
    s(Reference, COPY, Value("gauge[1].point", "[\"80 mm\", \"0 mm\", \"180 mm\"]"), &["gauge[1].point", "gauge[1]"], &["gauge[0]"]),
    s(Reference, COPY, Value("trajectory[1].name", "\"case-1\""), &["trajectory[1].name"], &["name"]),
    s(Own, COPY, Add("platform", "mass = \"2.4 kg\""), &["platform.mass"], &["once", "twice", "one of"]),
    s(Own, COPY, Text("[requirements]", "[amplifier]\nlag = \"1 ms\"\n\n[requirements]"), &["amplifier"], &["once", "twice", "one"]),
    s(Own, COPY, Value("hysteresis.records", "[\"leg.csv\", \"leg.csv\"]"), &["hysteresis.records"], &["six"]),
    s(Own, COPY, Value("gauge[5].point", "[\"0 mm\", \"960 mm\", \"180 mm\"]"), &["gauge[5].point"], &["point"]),
    // Words.
    s(Own, WORD, Value("trajectory[0].kind", "\"case2\""), &["trajectory[0].kind"], &["case-2"]),
    s(Own, WORD, Value("control.mode", "\"PF\""), &["control.mode"], &["p/f"]),
    s(Own, WORD, Value("adaptation.mode", "\"PCC\""), &["adaptation.mode"], &["pcc"]),
    s(Own, WORD, Value("target.mcu", "\"stm32h743\""), &["target.mcu"], &["stm32h743zi"]),
    s(Own, WORD, Add("control", "notch = \"yes\""), &["control.notch"], &["true"]),
    s(Own, WORD, Value("dac.bits", "\"16\""), &["dac.bits"], &["16"]),
    s(Own, WORD, Value("hysteresis.records", "\"leg.csv\""), &["hysteresis.records"], &["["]),
    // Records.
    s(Own, RECORD, Record(|text| scaled(text, 0, 1e3)), &["", "hysteresis.records"], &["time_s", "seconds", "ms"]),
    s(Small, RECORD, Record(|text| scaled(text, 0, 1e3)), &["", "hysteresis.records"], &["time_s", "seconds", "ms"]),
    s(Own, RECORD, Record(|text| scaled(text, 2, 1e3)), &["", "hysteresis.records"], &["um", "µm"]),
    s(Own, RECORD, Record(|text| scaled(text, 2, 1e-3)), &["", "hysteresis.records"], &["um", "µm"]),
    s(Own, RECORD, Record(|text| scaled(text, 1, 0.1)), &["", "hysteresis.records"], &["actuator.voltage", "stack", "V"]),
    s(Small, RECORD, Record(|text| scaled(text, 2, -1.0)), &["", "hysteresis.records"], &["sign"]),
    s(Small, RECORD, Record(|text| text.replacen("time_s", "time_ms", 1)), &["", "hysteresis.records"], &["time_s"]),
    s(Small, RECORD, Record(|text| text.replacen("displacement_um", "displacement", 1)), &["", "hysteresis.records"], &["displacement_um"]),
    s(Small, RECORD, Record(|text| text.replace('.', ",")), &["", "hysteresis.records"], &["comma"]),
    s(Own, RECORD, Value("hysteresis.records", "[\"legs.csv\"]"), &["hysteresis.records"], &["file"]),
    // Given in another frame, or about another point.
    s(Own, FRAME, Value("platform.inertia", "[\"0.0898 kg m^2\", \"0.0898 kg m^2\", \"0.02 kg m^2\"]"), &["platform.inertia"], &["centre of mass"]),
    s(Small, FRAME, Value("platform.inertia", "[\"1.054e7 g mm^2\", \"1.054e7 g mm^2\", \"1.44e6 g mm^2\"]"), &["platform.inertia"], &["centre of mass"]),
    s(Own, FRAME, Value("platform.inertia", "[\"0.012 kg m^2\", \"0.108 kg m^2\", \"0.116 kg m^2\"]"), &["platform.inertia"], &["centre of mass", "order"]),
    s(Own, FRAME, Value("platform.center_of_mass", "[\"0 mm\", \"0 mm\", \"560 mm\"]"), &["platform.center_of_mass"], &["P_C", "{P}", "order"]),
    s(Own, FRAME, Value("gauge[3].point", "[\"96 mm\", \"0 mm\", \"0 mm\"]"), &["gauge[3].point"], &["{B}", "order", "height"]),
    s(Own, FRAME, Value("geometry.base_angle", "\"110 deg\""), &["geometry.base_angle"], &["pair", "close"]),
    // A digit, a factor, a figure of another thing.
    s(Own, FIGURE, Value("actuator.stroke", "\"1000 um\""), &["actuator.stroke"], &["stroke"]),
    s(Own, FIGURE, Value("actuator.stacks", "10"), &["actuator.stacks", "actuator.stroke"], &["stacks"]),
    s(Own, FIGURE, Value("actuator.voltage", "[\"-20 V\", \"1200 V\"]"), &["actuator.voltage"], &["voltage", "dac.range"]),
    s(Small, FIGURE, Value("actuator.voltage", "[\"0 V\", \"10 V\"]"), &["actuator.voltage"], &["\"150 V\"", "\"100 V\""]),
    s(Own, FIGURE, Value("dac.range", "[\"0 V\", \"10 V\"]"), &["dac.range", "actuator.voltage"], &["at the stack"]),
    s(Own, FIGURE, Value("dac.bits", "8"), &["dac.bits", "requirements.precision"], &["bits"]),
    s(Own, FIGURE, Value("workspace.translation", "[\"76 um\", \"67 um\", \"220 um\"]"), &["workspace.translation"], &["at most"]),
    s(Small, FIGURE, Value("workspace.translation", "[\"280 um\", \"26 um\", \"31 um\"]"), &["workspace.translation"], &["at most"]),
    s(Small, FIGURE, Value("workspace.rotation", "[\"0.28 mrad\", \"0.26 mrad\", \"4.4 mrad\"]"), &["workspace.rotation"], &["at most"]),
    s(Own, FIGURE, Value("trajectory[0].frequency", "\"500 Hz\""), &["trajectory[0].frequency"], &["slower", "Hz"]),
    s(Small, FIGURE, Value("adaptation.level_weight", "2"), &["adaptation.level_weight"], &["at most", "range", "less"]),
    s(Own, FIGURE, Add("adaptation", "gain_ratio = [0.1, 9]"), &["adaptation.gain_ratio"], &["gain"]),
    s(Own, FIGURE, Value("hysteresis.grid", "4"), &["hysteresis.grid"], &["grid", "cells", "intervals"]),
    s(Own, FIGURE, Value("sensor.bits", "8"), &["sensor.bits"], &["bits"]),
    s(Own, FIGURE, Value("actuator.slew_rate", "\"0.56 V/ms\""), &["actuator.slew_rate", "trajectory[0].frequency"], &["slew_rate", "slower"]),
    s(Own, FIGURE, Value("actuator.resonance", "\"120 Hz\""), &["actuator.resonance"], &["resonance"]),
    s(Own, FIGURE, Value("sensor.range", "[\"-13 um\", \"13 um\"]"), &["sensor.range"], &["range"]),
];

/// A record with one column times a factor.
fn scaled(record: &str, column: usize, factor: f64) -> String {
    let mut lines = record.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    for line in lines {
        if line.starts_with('#') {
            text.push_str(line);
            text.push('\n');
            continue;
        }
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[column] = format!("{}", cells[column].parse::<f64>().unwrap() * factor);
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}
