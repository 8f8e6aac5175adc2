//! `src/description.rs`: what the emitted controller says of itself to tools that load it: names of words, scalar, period.

use proc_macro2::TokenStream;
use quote::quote;

use crate::ir::{Ir, LEGS};

pub fn emit(ir: &Ir) -> TokenStream {
    let text = text(ir);
    quote! {
        #![doc = " What this controller says of itself."]

        /// What this controller is, one `key=value` a line, lists separated by commas: for tools that load it at run time.
        pub const DESCRIPTION: &str = #text;
    }
}

/// `name[0]` to `name[5]` of each name.
fn vectors(names: &[&str]) -> Vec<String> {
    names.iter().flat_map(|name| (0..LEGS).map(move |leg| format!("{name}[{leg}]"))).collect()
}

/// Kind, names of the input words and of the output words, in the order of the law's `words.rs`.
fn words(ir: &Ir) -> (&'static str, Vec<String>, Vec<String>) {
    if ir.task_space.is_none() {
        let outputs = vectors(&["voltage", "requested", "demand", "level", "drift", "dac_code"]);
        return ("legs", vectors(&["setpoint", "displacement"]), [outputs, vec!["status".to_owned()]].concat());
    }
    let command = ["command", "selector", "sequence"].map(str::to_owned).to_vec();
    let inputs = vectors(&["setpoint", "setpoint_rate", "setpoint_acceleration", "gauge", "wrench"]);
    let outputs = vectors(&["voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load"]);
    ("platform", [command, inputs].concat(), [outputs, vec!["status".to_owned()]].concat())
}

/// One `key=value` a line.
fn text(ir: &Ir) -> String {
    let (kind, inputs, outputs) = words(ir);
    let text = format!(
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
        ir.permitted.names().join(","),
        inputs.join(","),
        outputs.join(","),
    );
    let bias = ir.task_space.as_ref().map_or_else(String::new, |task| {
        let bias: Vec<String> = task.law.bias.iter().map(|value| format!("{value:?}")).collect();
        format!("bias={}\n", bias.join(","))
    });
    text + &bias
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emit::law;

    /// What the law calls its words is what the description says, name by name in this order.
    #[test]
    fn the_words_of_the_law_have_these_names() {
        for (spec, files) in [("legs.toml", law::LEGS), ("reference.toml", law::PLATFORM)] {
            let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs").join(spec);
            let Ok(compiled) = crate::compile::compile(&path) else { panic!("{spec} compiles") };
            let (_, text) = files.iter().find(|(path, _)| *path == "src/words.rs").unwrap();
            let (_, inputs, outputs) = words(&compiled.ir);
            for (constant, names) in
                [("INPUT_NAMES", inputs), ("OUTPUT_NAMES", outputs), ("CONFIG_NAMES", compiled.ir.permitted.names())]
            {
                let (_, list) = text.split_once(&format!("pub const {constant}: ")).unwrap();
                let list = list.split_once('=').and_then(|(_, list)| list.split_once("];")).unwrap().0;
                let found: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
                assert_eq!(found, names, "{spec}, {constant}");
            }
        }
    }
}
