//! Changed specs that cause an error or a warning.

/// A spec below `specs/`, the replaced texts, and the rows of its table of poses.
type Case = (&'static str, &'static [(&'static str, &'static str)], Option<fn(u32) -> String>);

/// Columns of the tables.
pub const HEAD: &str = "x_um,theta_y_urad\n";

const REFERENCE: &str = "reference.toml";
const LEGS: &str = "legs.toml";
const GAINS: &str = "features/platform-gains.toml";
const CALIBRATION: &str = "features/platform-calibration.toml";
const FRAMES: &str = "features/platform-frames.toml";
const ENVIRONMENT: &str = "features/platform-environment.toml";
const F32: &str = "features/f32.toml";
const SIX: &str = "features/six-records.toml";
const NO_NOTCH: &str = "features/platform-no-notch.toml";
const FORCE: &str = "features/platform-force-sensor.toml";

const BIAS_Z: &str = "\"10 um\", \"0 urad\"";
const CASE_1: &str = "kind      = \"case-1\"\nfrequency = \"1 Hz\"";
const TABLE: &str = "kind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"1 ms\"";
const LAST_GAUGE: &str = "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]";
const STREAMS: &str =
    "stream_speed = [\"5 mm/s\", \"5 mm/s\", \"5 mm/s\", \"50 mrad/s\", \"50 mrad/s\", \"50 mrad/s\"]";
const GENTLE: &str = "stop_acceleration = [\"0.7 mm/s^2\", \"0.7 mm/s^2\", \"0.7 mm/s^2\", \"7 mrad/s^2\", \"7 mrad/s^2\", \"7 mrad/s^2\"]
stop_jerk = [\"1 m/s^3\", \"1 m/s^3\", \"1 m/s^3\", \"10 rad/s^3\", \"10 rad/s^3\", \"10 rad/s^3\"]
stream_speed = [\"100 um/s\", \"100 um/s\", \"100 um/s\", \"1 mrad/s\", \"1 mrad/s\", \"1 mrad/s\"]";
macro_rules! too_high {
    () => {
        "proportional = [\"5e5 N/m\", \"5e5 N/m\", \"2e6 N/m\", \"1e4 N m/rad\", \"1e4 N m/rad\", \"1e4 N m/rad\"]
integral     = [\"1e13 N/(m s)\", \"1e13 N/(m s)\", \"4e13 N/(m s)\", \"2e11 N m/(rad s)\", \"2e11 N m/(rad s)\", \"2e11 N m/(rad s)\"]
derivative   = [\"0 N s/m\", \"0 N s/m\", \"0 N s/m\", \"0 N m s/rad\", \"0 N m s/rad\", \"0 N m s/rad\"]

[timing]"
    };
}

/// 3 µm in x and 40 µrad about y, up and back.
fn wave(k: u32) -> String {
    let part = 0.5 * (1.0 - libm::cos(core::f64::consts::TAU * f64::from(k) / 100.0));
    format!("{:.6},{:.6}", 3.0 * part, 40.0 * part)
}

fn one_lost(k: u32) -> String {
    if k == 50 { "-90,0".to_owned() } else { wave(k) }
}

fn ramp(k: u32) -> String {
    format!("{:.3},0", 0.6 * f64::from(k))
}

fn steep(k: u32) -> String {
    format!("{:.3},0", 0.4 * f64::from(if k > 50 { 100 - k } else { k }))
}

/// Parts and loops: the spec without its trajectories.
#[rustfmt::skip]
pub const OF_PARTS: &[Case] = &[
    // Stability of legs.
    (LEGS, &[("gain_ratio   = [0.9, 1.1]", "gain_ratio   = [0.9, 8.0]")], None),
    (LEGS, &[("lag   = \"0.35 ms\"", "lag   = \"0 ms\"")], None),
    (LEGS, &[("lag   = \"0.35 ms\"", "lag   = \"0 ms\""), ("level_weight = 0.252", "level_weight = 0.02"), ("drift_weight = 0.011", "drift_weight = 0.001")], None),
    (LEGS, &[("mode         = \"pcc\"", "mode         = \"ewma\""), ("drift_weight = 0.011", "")], None),
    (LEGS, &[("lag   = \"0.35 ms\"", "lag   = \"0 ms\""), ("mode         = \"pcc\"", "mode         = \"ewma\""), ("level_weight = 0.252", "level_bandwidth = \"2000 rad/s\""), ("drift_weight = 0.011", "")], None),
    (LEGS, &[("mode         = \"pcc\"", "mode         = \"ewma\""), ("level_weight = 0.252", "level_weight = 1.9"), ("drift_weight = 0.011", "")], None),
    // Stability of platforms.
    (REFERENCE, &[("[timing]", concat!("[gains]\n", too_high!()))], None),
    (REFERENCE, &[("[timing]", concat!("[position_gains]\n", too_high!()))], None),
    (REFERENCE, &[("mode       = \"pcc\"", "mode       = \"pcc\"\nlevel_bandwidth = \"5000 rad/s\"\ndrift_bandwidth = \"200 rad/s\"")], None),
    (REFERENCE, &[("mode       = \"pcc\"", "mode       = \"ewma\"\nlevel_bandwidth = \"20 rad/s\"")], None),
    (REFERENCE, &[("gain_ratio = [0.9, 1.1]", "gain_ratio = [0.5, 1.9]")], None),
    (REFERENCE, &[("axial_stiffness = \"1e7 N/m\"", "axial_stiffness = \"2e9 N/m\""), ("[timing]\n", "[lint]\nallow = [\"actuator.resonance: a rod\"]\n\n[timing]\n")], None),
    (REFERENCE, &[("notch_damping   = 1.0", "notch_damping   = 0.1")], None),
    (REFERENCE, &[("modal_damping   = 0.02", "modal_damping   = 0.0005"), ("notch_damping   = 1.0\n", "")], None),
    (REFERENCE, &[("interaction     = \"none\"", "interaction     = \"measured\""), ("[control.setpoint]", "[control.environment]\nstiffness = [\"1e9 N/m\", \"1e9 N/m\", \"1e9 N/m\", \"1e6 N m/rad\", \"1e6 N m/rad\", \"1e6 N m/rad\"]\n\n[control.setpoint]")], None),
    (REFERENCE, &[("interaction     = \"none\"", "interaction     = \"modelled\""), ("[control.setpoint]", "[control.environment]\nstiffness = [\"1e6 N/m\", \"2e6 N/m\", \"3e6 N/m\", \"1e3 N m/rad\", \"2e3 N m/rad\", \"3e3 N m/rad\"]\n\n[control.setpoint]")], None),
    (GAINS, &[("level_bandwidth", "gain_ratio = [0.6, 1.6]\nlevel_bandwidth")], None),
    (ENVIRONMENT, &[("period = \"100 us\"", "period = \"50 us\"")], None),
    (FORCE, &[("period = \"100 us\"", "period = \"200 us\"")], None),
    // Geometry, gauges, converters.
    (REFERENCE, &[("platform_angle  = \"0.012 pi rad\"", "platform_angle  = \"0.6546667 pi rad\"")], None),
    (REFERENCE, &[(BIAS_Z, "\"-3 um\", \"0 urad\"")], None),
    (REFERENCE, &[("translation = [\"50 um\"", "translation = [\"56 um\"")], None),
    (REFERENCE, &[("translation = [\"50 um\"", "translation = [\"50 mm\"")], None),
    (REFERENCE, &[("rotation    = [\"0.4 mrad\", \"0.35 mrad\"", "rotation    = [\"0.4 mrad\", \"0.013889 pi rad\"")], None),
    (REFERENCE, &[(LAST_GAUGE, "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [0, 1, 0]")], None),
    (REFERENCE, &[("[\"-40 mm\", \"69.282 mm\", \"180 mm\"]", "[\"0 mm\", \"0 mm\", \"180 mm\"]"), ("[\"-40 mm\", \"-69.282 mm\", \"180 mm\"]", "[\"-80 mm\", \"0 mm\", \"180 mm\"]")], None),
    (REFERENCE, &[(LAST_GAUGE, "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]\ntarget_normal = [0, 1, 0]")], None),
    (REFERENCE, &[(LAST_GAUGE, "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]\ntarget_normal = [0.9, 0.1, 0.2]\ntarget_point = [\"1 mm\", \"79 mm\", \"1 mm\"]")], None),
    (REFERENCE, &[("[\"-55 um\", \"55 um\"]", "[\"-25 um\", \"25 um\"]")], None),
    (REFERENCE, &[("noise = \"2.2 nm\"", "noise = \"2.2 nm\"\ncalibration = [\"-55 um\", \"10 um/V\"]\ninput_range = [\"0 V\", \"2 V\"]")], None),
    (REFERENCE, &[("noise = \"2.2 nm\"", "noise = \"2.2 nm\"\ncalibration = [\"-55 um\", \"10 um/V\"]\ninput_range = [\"0 V\", \"12 V\"]")], None),
    (REFERENCE, &[("noise = \"2.2 nm\"", "noise = \"2.2 nm\"\ninput_range = [\"0 V\", \"2 V\"]")], None),
    (CALIBRATION, &[("\"12 nm/V^2\"", "\"1.2 um/V^2\"")], None),
    (CALIBRATION, &[("\"12 nm/V^2\"", "\"-1.2 um/V^2\"")], None),
    (CALIBRATION, &[("\"9.97 um/V\"", "\"-9.97 um/V\"")], None),
    (REFERENCE, &[("bits  = 16", "bits  = 8"), ("[\"0 V\", \"150 V\"]", "[\"0 V\", \"1500 V\"]")], None),
    (REFERENCE, &[("slew_rate       = \"40 V/ms\"", "slew_rate       = \"0.01 V/ms\"")], None),
    // Patterns of gauges: one that is aside of all others.
    (REFERENCE, &[("direction = [0, 1, 0]", "direction = [0.3, 1, 0]")], None),
    (REFERENCE, &[("direction = [1, 0, 0]", "direction = [1, 0.3, 0.1]")], None),
    (REFERENCE, &[("[\"-40 mm\", \"69.282 mm\", \"180 mm\"]", "[\"-40 mm\", \"62 mm\", \"180 mm\"]")], None),
    (REFERENCE, &[("[\"-40 mm\", \"69.282 mm\", \"180 mm\"]", "[\"-40 mm\", \"69.282 mm\", \"171 mm\"]")], None),
    (REFERENCE, &[("[\"0 mm\", \"80 mm\", \"180 mm\"]", "[\"0 mm\", \"70 mm\", \"180 mm\"]")], None),
    (REFERENCE, &[("[\"-55 um\", \"55 um\"]", "[\"-55 um\", \"0 um\"]")], None),
    (REFERENCE, &[("[\"-55 um\", \"55 um\"]", "[\"0 um\", \"55 um\"]")], None),
    (REFERENCE, &[("[\"-55 um\", \"55 um\"]", "[\"-25 um\", \"30 um\"]")], None),
    // Gauges in line with the centre except for the sign of one.
    (REFERENCE, &[("point     = [\"-80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 1, 0]", "point     = [\"-40 mm\", \"69.282 mm\", \"180 mm\"]\ndirection = [0.866, -0.5, 0]"), (LAST_GAUGE, "point     = [\"-40 mm\", \"-69.282 mm\", \"180 mm\"]\ndirection = [0.866, -0.5, 0]")], None),
    // Converters that begin below zero.
    (LEGS, &[("[\"0 V\", \"150 V\"]", "[\"-25.7 V\", \"150 V\"]"), ("[\"0 V\", \"100 V\"]", "[\"-11.3 V\", \"101.7 V\"]")], None),
    (F32, &[("[\"0 V\", \"150 V\"]", "[\"-25.7 V\", \"150 V\"]"), ("[\"0 V\", \"100 V\"]", "[\"11.3 V\", \"101.7 V\"]")], None),
    // Dependence on rate.
    (LEGS, &[("[hysteresis]", "[hysteresis]\nrate = \"creep\"\ncreep_times = [\"0.8 s\", \"40 ms\"]\ncreep_weights = [0.03, 0.09]\ndead_time = \"0.13 ms\"")], None),
    (REFERENCE, &[("[hysteresis]", "[hysteresis]\nrate = \"creep\"\ncreep_times = [\"0.8 s\"]\ncreep_weights = [0.03]")], None),
    (LEGS, &[("[hysteresis]", "[hysteresis]\nrate = \"dynamic-preisach\"\nrate_tables = [\"records/leg1.csv\"]\ndead_time = \"0.01 ms\"")], None),
    (SIX, &[("[hysteresis]", "[hysteresis]\nrate = \"dynamic-preisach\"\nrate_tables = [\"../records/leg1.csv\", \"../records/leg2.csv\", \"../records/leg3.csv\", \"../records/leg4.csv\", \"../records/leg5.csv\", \"../records/leg6.csv\"]"), ("[timing]", "[supervisor]\nrest_voltage = \"7 V\"\n\n[timing]")], None),
    // The supervisor.
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nrest_voltage = \"12 V\"\narm_time = \"30 ms\"\nramp_rate = \"0.3 V/ms\"\ngauge_time = \"7 ms\"\nstuck_motion = \"130 nm\"\nstuck_time = \"41 ms\"\ndisagreement = \"9 um\"\ndisagreement_time = \"73 ms\"\ntracking_error = 0.31\ntracking_time = \"87 ms\"\nvoltage_time = \"210 ms\"\nslew_time = \"33 ms\"\nmissed_ticks = 5\nhost_lost = [\"70 ms\", \"4 s\"]")], None),
    (LEGS, &[("[timing]", "[supervisor]\nrest_voltage = \"12 V\"\narm_time = \"30 ms\"\nramp_rate = \"0.3 V/ms\"\ngauge_time = \"7 ms\"\nstuck_motion = \"130 nm\"\nstuck_time = \"41 ms\"\ndisagreement = \"9 um\"\ndisagreement_time = \"73 ms\"\ntracking_error = 0.31\ntracking_time = \"87 ms\"\nvoltage_time = \"210 ms\"\nslew_time = \"33 ms\"\nmissed_ticks = 5\nhost_lost = [\"70 ms\", \"4 s\"]\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nramp_rate = \"0.001 V/ms\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nramp_rate = \"0.001 V/ms\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nramp_rate = \"39 V/ms\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nramp_rate = \"39 V/ms\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nramp_rate = \"50 V/ms\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nramp_rate = \"50 V/ms\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nrest_voltage = \"101 V\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nrest_voltage = \"101 V\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nrest_voltage = \"-1 V\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nrest_voltage = \"-1 V\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\narm_time = \"10 us\"\nslew_time = \"99 us\"\nvoltage_time = \"100 us\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\narm_time = \"10 us\"\nslew_time = \"99 us\"\nvoltage_time = \"100 us\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nstuck_time = \"1.1 ms\"\ntracking_time = \"1.2 ms\"\ndisagreement_time = \"100 us\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nstuck_time = \"1.1 ms\"\ntracking_time = \"1.2 ms\"\ndisagreement_time = \"100 us\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nhost_lost = [\"50 us\", \"70 us\"]")], None),
    (LEGS, &[("[timing]", "[supervisor]\nhost_lost = [\"50 us\", \"70 us\"]\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nhost_lost = [\"1 ms\", \"2 ms\"]\ngauge_time = \"20 ms\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nhost_lost = [\"1 ms\", \"2 ms\"]\ngauge_time = \"20 ms\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\nstuck_motion = \"1 nm\"\ndisagreement = \"2 nm\"")], None),
    (LEGS, &[("[timing]", "[supervisor]\nstuck_motion = \"1 nm\"\ndisagreement = \"2 nm\"\n\n[timing]")], None),
    (NO_NOTCH, &[("[supervisor]", "[supervisor]\ntracking_error = 1e-6")], None),
    (LEGS, &[("[timing]", "[supervisor]\ntracking_error = 1e-6\n\n[timing]")], None),
];

/// Paths and stops: the spec with the first of its trajectories.
#[rustfmt::skip]
pub const OF_PATHS: &[Case] = &[
    // No two numbers are equal, and none is zero.
    (
        FRAMES,
        &[
            ("\"1.195 kg\"", "\"1.195 kg\"\ncenter_of_mass = [\"1.1 mm\", \"-2.3 mm\", \"3.7 mm\"]\nproducts = [\"1.1e6 g mm^2\", \"-0.7e6 g mm^2\", \"0.9e6 g mm^2\"]"),
            ("[\"3.26e7 g mm^2\", \"3.26e7 g mm^2\", \"9.7e6 g mm^2\"]", "[\"3.21e7 g mm^2\", \"3.37e7 g mm^2\", \"1.27e7 g mm^2\"]"),
            ("base_angle      = \"0.012 pi rad\"", "base_angle      = \"0.032 pi rad\""),
            ("fixed_center       = \"50 mm\"", "fixed_center       = \"47 mm\""),
            ("extensible_center  = \"50 mm\"", "extensible_center  = \"61 mm\""),
            ("[\"0 V\", \"100 V\"]", "[\"-11.3 V\", \"101.7 V\"]"),
            ("[\"0 V\", \"150 V\"]", "[\"-25.7 V\", \"147 V\"]"),
            ("[\"-40 mm\", \"69.282 mm\", \"180 mm\"]\ndirection = [0, 0, 1]", "[\"-37 mm\", \"66 mm\", \"171 mm\"]\ndirection = [0.1, -0.2, 0.97]\ntarget_normal = [0.05, 0.1, 0.99]\ntarget_point = [\"-38 mm\", \"65 mm\", \"-3 mm\"]"),
            ("[\"-45 um\", \"55 um\"]", "[\"-71 um\", \"83 um\"]"),
            ("bias = [\"0 um\", \"0 um\", \"10 um\", \"0 urad\", \"0 urad\", \"0 urad\"]", "bias = [\"1.3 um\", \"-2.1 um\", \"11 um\", \"3 urad\", \"-5 urad\", \"7 urad\"]\nspeed = [\"90 um/s\", \"110 um/s\", \"70 um/s\", \"0.9 mrad/s\", \"1.1 mrad/s\", \"0.7 mrad/s\"]\nacceleration = [\"9 mm/s^2\", \"11 mm/s^2\", \"7 mm/s^2\", \"90 mrad/s^2\", \"110 mrad/s^2\", \"70 mrad/s^2\"]\njerk = [\"0.9 m/s^3\", \"1.1 m/s^3\", \"0.7 m/s^3\", \"9 rad/s^3\", \"11 rad/s^3\", \"7 rad/s^3\"]"),
            ("[timing]", "[[trajectory]]\nname = \"table\"\nkind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"1 ms\"\n\n[timing]"),
        ],
        Some(wave),
    ),
    (REFERENCE, &[("[amplifier]", "[amplifier]\ncurrent = \"20 mA\""), ("damping_ratio   = 0.1", "damping_ratio   = 0.1\ncapacitance = \"3 uF\"")], None),
    (REFERENCE, &[("[amplifier]", "[amplifier]\ncurrent = \"1 uA\""), ("damping_ratio   = 0.1", "damping_ratio   = 0.1\ncapacitance = \"3 uF\"")], None),
    (REFERENCE, &[("slew_rate       = \"40 V/ms\"", "slew_rate       = \"0.1 V/ms\"")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"20 Hz\""), ("axial_stiffness = \"1e7 N/m\"", "axial_stiffness = \"1e5 N/m\"")], None),
    (REFERENCE, &[(BIAS_Z, "\"53 um\", \"0 urad\"")], None),
    (REFERENCE, &[(BIAS_Z, "\"51 um\", \"0 urad\"")], None),
    (REFERENCE, &[("\"50 um\", \"52 um\"]", "\"50 um\", \"47 um\"]")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"200 Hz\"")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"10 Hz\"")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"0.001 Hz\"")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"0.7 Hz\"")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"1 Hz\"\nas_printed = true")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"case-2\"\nfrequency = \"1 Hz\"\nas_printed = true")], None),
    (REFERENCE, &[(CASE_1, "kind      = \"machining\"\nfrequency = \"3 Hz\"\nas_printed = true")], None),
    (REFERENCE, &[("jerk         = [\"1 m/s^3\"", "jerk         = [\"1e-12 m/s^3\"")], None),
    (REFERENCE, &[("speed        = [\"100 um/s\"", "speed        = [\"1 nm/s\"")], None),
    (REFERENCE, &[(CASE_1, TABLE)], Some(wave)),
    (REFERENCE, &[(CASE_1, TABLE)], Some(one_lost)),
    (REFERENCE, &[(CASE_1, TABLE)], Some(ramp)),
    (REFERENCE, &[(CASE_1, TABLE)], Some(steep)),
    (REFERENCE, &[(CASE_1, "kind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"0.25 ms\"")], Some(wave)),
    (REFERENCE, &[(CASE_1, "kind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"1 ms\"\nrepeat = true")], Some(wave)),
    (REFERENCE, &[(CASE_1, "kind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"1 ms\"\nrepeat = true")], Some(steep)),
    (REFERENCE, &[(CASE_1, "kind = \"waveform\"\nfile = \"table.csv\"\nperiod = \"100 us\"")], Some(wave)),
    (FRAMES, &[("rotation    = [\"0.4 mrad\"", "rotation    = [\"0.3 rad\"")], None),
    (FRAMES, &[("\"2 deg\", \"0 deg\", \"30 deg\"", "\"0 deg\", \"0 deg\", \"0 deg\"")], None),
    (FRAMES, &[("work = [\"4 um\"", "work = [\"60 um\"")], None),
    // Stops.
    (REFERENCE, &[("stream_speed = [\"5 mm/s\"", "stream_speed = [\"13 mm/s\"")], None),
    (REFERENCE, &[("stale_ticks  = 10", "stale_ticks  = 60")], None),
    (REFERENCE, &[(STREAMS, GENTLE)], None),
    (REFERENCE, &[(STREAMS, GENTLE), ("\"50 um\", \"52 um\"]", "\"50 um\", \"50.1 um\"]")], None),
];
