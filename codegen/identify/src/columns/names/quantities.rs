//! The quantities that columns hold, with their names and units.

use super::{Quantity, Unit};

const TIME: &[Unit] = &[
    ("s", 1.0),
    ("ms", 1e3),
    ("us", 1e6),
    ("ns", 1e9),
    ("ps", 1e12),
    ("min", 1.0 / 60.0),
    ("h", 1.0 / 3600.0),
    ("d", 1.0 / 86_400.0),
];
const VOLTAGE: &[Unit] = &[("V", 1.0), ("mV", 1e3), ("uV", 1e6), ("kV", 1e-3)];
const LENGTH: &[Unit] = &[
    ("um", 1.0),
    ("nm", 1e3),
    ("pm", 1e6),
    ("mm", 1e-3),
    ("m", 1e-6),
    ("angstrom", 1e4),
    ("in", 1.0 / 25_400.0),
    ("mil", 1.0 / 25.4),
    ("uin", 1.0 / 0.0254),
];
const ANGLE: &[Unit] = &[
    ("urad", 1.0),
    ("nrad", 1e3),
    ("mrad", 1e-3),
    ("rad", 1e-6),
    ("deg", 1e-6 * core::f64::consts::FRAC_1_PI * 180.0),
    ("arcsec", 1e-6 * core::f64::consts::FRAC_1_PI * 180.0 * 3600.0),
];
const FORCE: &[Unit] =
    &[("N", 1.0), ("mN", 1e3), ("kN", 1e-3), ("lbf", 1.0 / 4.448_221_615_260_5), ("kgf", 1.0 / 9.806_65)];
/// Units of the quantities of a record, by kind.
pub(super) const KINDS: [&[Unit]; 5] = [TIME, VOLTAGE, LENGTH, FORCE, ANGLE];

/// Every quantity of a record.
pub(crate) static QUANTITIES: [Quantity; 7] = [
    Quantity::new("time_s", &["t", "zeit"], TIME),
    Quantity::new("drive_V", &["command"], VOLTAGE),
    Quantity::new("monitor_V", &[], VOLTAGE),
    Quantity::new("displacement_um", &["position", "disp", "auslenkung"], LENGTH),
    Quantity::new("force_N", &["kraft"], FORCE),
    Quantity::new("gauge_V", &[], VOLTAGE),
    Quantity::new("reference_um", &["ref"], LENGTH),
];

/// The coordinates of a pose, in the order of a row.
pub(crate) static COORDINATES: [Quantity; 6] = [
    Quantity::new("x_um", &[], LENGTH),
    Quantity::new("y_um", &[], LENGTH),
    Quantity::new("z_um", &[], LENGTH),
    Quantity::new("theta_x_urad", &["rx", "θx"], ANGLE),
    Quantity::new("theta_y_urad", &["ry", "θy"], ANGLE),
    Quantity::new("theta_z_urad", &["rz", "θz"], ANGLE),
];

/// Their rates, then their accelerations.
pub(crate) static RATES: [Quantity; 12] = [
    Quantity::rate(1, "vx_um/s", &["xdot"], LENGTH),
    Quantity::rate(1, "vy_um/s", &["ydot"], LENGTH),
    Quantity::rate(1, "vz_um/s", &["zdot"], LENGTH),
    Quantity::rate(1, "omega_x_urad/s", &["wx", "ωx", "rxdot"], ANGLE),
    Quantity::rate(1, "omega_y_urad/s", &["wy", "ωy", "rydot"], ANGLE),
    Quantity::rate(1, "omega_z_urad/s", &["wz", "ωz", "rzdot"], ANGLE),
    Quantity::rate(2, "ax_um/s2", &["xddot"], LENGTH),
    Quantity::rate(2, "ay_um/s2", &["yddot"], LENGTH),
    Quantity::rate(2, "az_um/s2", &["zddot"], LENGTH),
    Quantity::rate(2, "alpha_x_urad/s2", &["αx", "rxddot"], ANGLE),
    Quantity::rate(2, "alpha_y_urad/s2", &["αy", "ryddot"], ANGLE),
    Quantity::rate(2, "alpha_z_urad/s2", &["αz", "rzddot"], ANGLE),
];

/// Words of headers for a quantity, in lower case: those of up to three letters alone, longer ones also as part of another.
pub(super) const WORDS: [(&str, &[&str]); 4] = [
    ("time", &["time", "zeit", "temps", "tiempo", "x_value", "t"]),
    ("force", &["force", "kraft", "load"]),
    ("displacement", &["disp", "posit", "sensor", "gauge", "laser", "weg", "pos", "dépl", "vibro", "target", "y"]),
    ("drive", &["drive", "volt", "comm", "spannung", "tension", "amp", "cmd", "out", "dac", "u", "v"]),
];
