//! What the emitted controller says of itself to tools that load it: names of words, scalar, period.

use crate::ir::{Ir, LEGS};

/// `name[0]` to `name[5]` of each name.
pub fn vectors(names: &[&str]) -> Vec<String> {
    names.iter().flat_map(|name| (0..LEGS).map(move |leg| format!("{name}[{leg}]"))).collect()
}

/// One `key=value` a line.
pub fn text(ir: &Ir, kind: &str, inputs: &[String], outputs: &[String], config: &[String]) -> String {
    format!(
        "name={}\ndigest={}\nversion={}\nkind={kind}\nscalar_bits={}\nleg_gain={:?}\nperiod={:?}\ngrid={}\ndrive_range={:?},{:?}\nconfig_names={}\ninput_names={}\noutput_names={}\n",
        ir.name,
        ir.digest,
        ir.specgen_version,
        ir.scalar.bits(),
        ir.defaults.leg_gain,
        ir.defaults.period,
        ir.hysteresis.grid,
        ir.actuation.voltage[0],
        ir.actuation.voltage[1],
        config.join(","),
        inputs.join(","),
        outputs.join(","),
    )
}
