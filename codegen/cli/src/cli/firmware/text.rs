//! What was built, in words.

use std::fmt::Write as _;

use super::Made;
use specgen_compiler::compile::Compiled;
use specgen_toolchain::budget::group;
use specgen_toolchain::checks::Checked;
use specgen_toolchain::size::Size;

/// As many owners and variables as are listed.
const LISTED: usize = 12;

/// The result of `build`.
pub fn of(compiled: &Compiled, made: &Made) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        out,
        "{} → {} for {} (f{}, digest {})",
        made.name,
        made.artifact,
        made.board,
        compiled.ir.scalar.bits(),
        &made.digest[..16]
    );
    if let Some(compiler) = &made.compiler {
        let _ = writeln!(out, "  compiler      {compiler}");
    }
    if let Some(used) = &made.used {
        let target = &compiled.model.target;
        let of = |budget: Option<u64>| budget.map_or(String::new(), |budget| format!(" of {}", group(budget)));
        let _ = writeln!(out, "  flash         {}{} bytes", group(used.flash), of(target.flash));
        let _ =
            writeln!(out, "  RAM           {}{} bytes, the stack of a tick included", group(used.ram), of(target.ram));
        let bound = used
            .stack
            .map_or("unbounded".to_owned(), |bytes| format!("{}{} bytes at most", group(bytes), of(target.stack)));
        let _ = writeln!(out, "  stack a tick  {bound} (static)");
        if let Some(instructions) = used.instructions {
            let _ = writeln!(
                out,
                "  instructions  {}{} a tick, mean{}",
                group(instructions),
                of(target.instructions),
                made.measurement.as_ref().map_or(String::new(), |m| format!(
                    "; counted on {}, the same core and code: flash wait states and caches are not in it",
                    m.machine
                ))
            );
        }
    }
    if let Some(size) = &made.size {
        out.push_str(&owners(size));
    }
    if let Some(checks) = &made.checks {
        out.push_str(&checked(checks));
    }
    if let Some(m) = made.measurement.as_ref().filter(|m| m.first_difference.is_none()) {
        let _ = writeln!(out, "  host and {} agree in every bit over {} ticks", m.machine, group(m.ticks));
    }
    for note in &made.notes {
        let _ = writeln!(out, "  note: {note}");
    }
    out
}

/// Who takes the flash.
pub fn owners(size: &Size) -> String {
    let mut out = format!("  {:<26} {:>10} {:>10} {:>10}\n", "flash by owner, bytes", "code", "constants", "all");
    let (shown, rest) = size.owners.split_at(LISTED.min(size.owners.len()));
    let mut line = |name: &str, code: u64, constants: u64| {
        let (code, constants, all) = (group(code), group(constants), group(code + constants));
        let _ = writeln!(out, "    {name:<24} {code:>10} {constants:>10} {all:>10}");
    };
    for owner in shown {
        line(&owner.name, owner.code, owner.constants);
    }
    if !rest.is_empty() {
        let sum = |of: fn(&specgen_toolchain::size::Owner) -> u64| rest.iter().map(of).sum();
        line(&format!("{} more", rest.len()), sum(|owner| owner.code), sum(|owner| owner.constants));
    }
    out
}

/// Sections and variables.
pub fn sections(size: &Size) -> String {
    let mut out = String::new();
    if let Some(identity) = &size.identity {
        let _ = writeln!(out, "  made by {identity}");
    }
    let recorder = match size.recorder() {
        0 => String::new(),
        bytes => format!(", and {} bytes for the recorder", group(bytes)),
    };
    let _ = writeln!(out, "  flash {} bytes, RAM {} bytes static{recorder}", group(size.flash()), group(size.ram()));
    for section in &size.sections {
        let place = match (section.flash, section.ram) {
            (true, true) => "flash and RAM",
            (true, false) => "flash",
            _ => "RAM",
        };
        let _ = writeln!(
            out,
            "    {:<22} {:#010x} {:>10} bytes {place}",
            section.name,
            section.address,
            group(section.bytes)
        );
    }
    for (name, bytes) in size.variables.iter().take(LISTED) {
        let _ = writeln!(out, "    variable {name}: {} bytes", group(*bytes));
    }
    out
}

/// What was looked for in the tick.
pub fn checked(checks: &Checked) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "  {} reaches {} functions, {} bytes of code; {}",
        checks.tick,
        checks.functions,
        group(checks.code),
        if checks.faults.is_empty() {
            "no panic, no allocation, no call through a register, no f64 in software where the core has none".to_owned()
        } else {
            format!("{} faults", checks.faults.len())
        }
    );
    let path: Vec<String> = checks.path.iter().map(|(name, frame)| format!("{name} {frame}")).collect();
    let bound = checks.stack.map_or("not bounded".to_owned(), |bytes| format!("{} bytes at most", group(bytes)));
    let _ = writeln!(out, "  stack: {bound}: {}", path.join(" → "));
    for fault in &checks.faults {
        let _ = writeln!(out, "  FAULT {}", fault.text);
    }
    out
}
