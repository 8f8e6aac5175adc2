//! `specgen size`: who takes the memory of an image, and what its tick reaches.

use std::path::PathBuf;

use clap::Args;
use object::{Architecture, Object};
use serde_json::json;

use super::{Common, make, read_image, refusal, text};
use crate::cli::ui::{Failure, Ui};
use specgen_toolchain::TargetError;
use specgen_toolchain::checks::{self, Rules};
use specgen_toolchain::size::{has_tick, size};

/// Arguments of `size`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::SIZE)]
pub struct Arguments {
    /// A spec, which is built first, or an ELF image.
    #[arg(value_name = "SPEC|ELF")]
    file: PathBuf,
    #[command(flatten)]
    common: Common,
    /// Function of the image that is one tick; found by itself in images of specgen.
    #[arg(long, value_name = "SYMBOL")]
    tick: Option<String>,
    /// The core of the image has no double-precision FPU: its tick must not compute f64.
    #[arg(long)]
    single: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let path = &arguments.file;
    let Some(bytes) = read_image(path)? else {
        let (_, made) = make(path, &arguments.common, super::any, ui)?;
        let mut out = format!("{} for {}\n", made.artifact, made.board);
        if let Some(size) = &made.size {
            out += &(text::sections(size) + &text::owners(size));
        }
        if let Some(checks) = &made.checks {
            out += &text::checked(checks);
        }
        if made.failures.is_empty() {
            ui.result(&out, json!(made));
            return Ok(());
        }
        if !ui.is_json() {
            ui.out(&out);
        }
        return Err(Failure::Judged { message: refusal(&made), result: json!(made) });
    };
    let malformed = |error: object::Error| TargetError::MalformedImage { text: format!("{}: {error}", path.display()) };
    let machine = object::File::parse(&*bytes).map_err(malformed)?.architecture();
    let size = size(&bytes)?;
    let mut out = format!("{}\n{}{}", path.display(), text::sections(&size), text::owners(&size));
    // Only Thumb code is followed; on a PC the operating system's own checks apply.
    let follows = machine == Architecture::Arm && (arguments.tick.is_some() || has_tick(&bytes));
    let rules = Rules { single: arguments.single, whole_image: false };
    let checked = if follows { Some(checks::check(&bytes, arguments.tick.as_deref(), rules)?) } else { None };
    match &checked {
        Some(checked) => out += &text::checked(checked),
        None if machine == Architecture::Arm => {
            out +=
                &format!("  no function {} in it: name the one that is a tick by --tick\n", checks::TICKS.join(", "));
        }
        None => out += "  checks of the tick and the stack bound are for images of Cortex-M\n",
    }
    let result = json!({ "file": path.display().to_string(), "size": size, "checks": checked });
    let faults = checked.map_or(0, |checked| checked.faults.len());
    if faults == 0 {
        ui.result(&out, result);
        return Ok(());
    }
    if !ui.is_json() {
        ui.out(&out);
    }
    Err(Failure::Judged { message: format!("{faults} faults in {}", path.display()), result })
}
