//! The target of the controller.

use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model::Mcu;
use crate::spec::findings::Findings;

/// A multiplication in software takes about thirty instructions, and a tick ten times as long.
pub(super) fn scalar_fits_fpu(f: &Fields, findings: &mut Findings) -> Option<()> {
    let part = Mcu::named(f.choice("target.mcu")?)?.part();
    if !part.double && f.choice("controller.scalar")? == "f64" {
        let path = if f.given("target.mcu") { "target.mcu" } else { "controller.scalar" };
        let (name, core) = (&part.name, part.core);
        let by_default = if f.given("controller.scalar") { "" } else { " by default" };
        findings.add(
            codes::SCALAR_WITHOUT_FPU,
            path,
            f.span(path),
            format!("the FPU of {name} ({core}) has single precision, but controller.scalar is \"f64\"{by_default}"),
            format!(
                "write, in [controller]: scalar = \"f32\"; or choose mcu = \"{}\"",
                Mcu::doubles().join("\" or \"")
            ),
        );
    }
    Some(())
}

pub(super) fn budget_in_bytes(f: &Fields, findings: &mut Findings) -> Option<()> {
    for path in ["target.budget.flash", "target.budget.ram", "target.budget.stack"] {
        let Some(bytes) = f.number(path) else {
            continue;
        };
        if bytes.fract() != 0.0 {
            findings.add(
                codes::BUDGET_NOT_WHOLE,
                path,
                f.span(path),
                format!("`{path}` is {bytes} bytes, expected a whole number of bytes"),
                format!("write \"{} B\", or another whole amount", bytes.round()),
            );
        }
    }
    Some(())
}

/// A budget beyond the part would pass an image that cannot be flashed.
pub(super) fn budget_fits_part(f: &Fields, findings: &mut Findings) -> Option<()> {
    let part = Mcu::named(f.choice("target.mcu")?)?.part();
    for (path, has, what) in [
        ("target.budget.flash", part.flash, "flash"),
        ("target.budget.ram", part.ram, "RAM"),
        ("target.budget.stack", part.ram, "RAM"),
    ] {
        let Some(bytes) = f.number(path) else {
            continue;
        };
        if bytes > has as f64 {
            findings.add(
                codes::BUDGET_BEYOND_PART,
                path,
                f.span(path),
                format!("`{path}` is {bytes} bytes, but {} has {has} bytes of {what}", part.name),
                format!("write at most \"{} KiB\", or choose a larger part in `target.mcu`", has / 1024),
            );
        }
    }
    Some(())
}
