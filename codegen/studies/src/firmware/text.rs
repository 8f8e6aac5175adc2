//! Text report of a build.

use super::{BuildResult, time};
use specgen_language::outcome::Outcome;
use specgen_language::table::{left, right, row};
use specgen_toolchain::budget::{ImageUsage, group};
use specgen_toolchain::checks::TickChecks;
use specgen_toolchain::size::Size;

/// Number of owners and variables listed.
const LISTED: usize = 12;

impl Outcome for BuildResult {
    fn text(&self) -> String {
        let (name, artifact, board, bits) = (&self.name, &self.artifact, &self.board, self.bits);
        let digest = &self.digest[..16];
        let mut out = format!("{name} → {artifact} for {board} (f{bits}, digest {digest})\n");
        // Writing to a String cannot fail, here and below.
        if let Some(compiler) = &self.compiler {
            out += &format!("  compiler      {compiler}\n");
        }
        if let Some(used) = &self.used {
            self.usage(used, &mut out);
        }
        if let Some(stack) = &self.stack {
            let [startup, running, reserved] = [stack.startup, stack.running, stack.reserved].map(group);
            out += &format!(
                "  stack         {startup} of {reserved} bytes at startup, {running} with tick and nested interrupts\n"
            );
        }
        if let Some(estimate) = self.measurement.as_ref().and_then(|m| m.time.as_ref()) {
            out.push_str(&time::text(estimate));
        }
        if let Some(size) = &self.size {
            out.push_str(&owners(size));
        }
        if let Some(checks) = &self.checks {
            out.push_str(&checked(checks));
        }
        if let Some(m) = self.measurement.as_ref().filter(|m| m.first_difference.is_none()) {
            out += &format!("  host and {} agree in every bit over {} ticks\n", m.machine, group(m.ticks));
        }
        out.extend(self.notes.iter().map(|note| format!("  note: {note}\n")));
        out
    }
}

impl BuildResult {
    /// Memory and instructions against their budgets.
    fn usage(&self, used: &ImageUsage, out: &mut String) {
        let of = |budget: Option<u64>| budget.map_or(String::new(), |budget| format!(" of {}", group(budget)));
        let limits = &self.limits.budget;
        *out += &format!("  flash         {}{} bytes\n", group(used.flash), of(limits.flash));
        let ram = match used.ram {
            Some(ram) => format!("{}{} bytes including the tick's stack", group(ram), of(limits.ram)),
            None if used.stack.is_none() => "unknown: the tick's stack is unbounded".to_owned(),
            None => "not measured: the sizes of State and settings are known only at run time".to_owned(),
        };
        *out += &format!("  RAM           {ram}\n");
        let bound = used
            .stack
            .map_or("unbounded".to_owned(), |bytes| format!("at most {}{} bytes", group(bytes), of(limits.stack)));
        *out += &format!("  tick stack    {bound} (static)\n");
        if let Some(instructions) = used.instructions {
            let counted = self.measurement.as_ref().map_or(String::new(), |m| {
                format!(
                    "; counted on {} with the same core and code; flash wait states and caches are not included",
                    m.machine
                )
            });
            let of = of(limits.instructions);
            *out += &format!("  instructions  {}{of} per tick, mean{counted}\n", group(instructions));
        }
    }
}

/// Flash by owner.
pub fn owners(size: &Size) -> String {
    let columns = [left(26).behind("  "), right(10).behind(" "), right(10).behind(" "), right(10).behind(" ")];
    let mut out = String::new();
    row(&mut out, &columns, &[&"flash by owner, bytes", &"code", &"constants", &"total"]);
    let (shown, rest) = size.owners.split_at(LISTED.min(size.owners.len()));
    let mut line = |name: &str, code: u64, constants: u64| {
        row(
            &mut out,
            &columns,
            &[&format_args!("  {name}"), &group(code), &group(constants), &group(code + constants)],
        );
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

pub fn sections(size: &Size) -> String {
    let mut out = String::new();
    if let Some(identity) = &size.identity {
        let target = size.target.map_or(String::new(), |target| format!(", for {target}"));
        out += &format!("  made by {identity}{target}\n");
    }
    if !size.assumed.is_empty() {
        out += &format!("  assumed: {}\n", size.assumed.join(", "));
    }
    let recorder = match size.recorder() {
        0 => String::new(),
        bytes => format!(", and {} bytes for the recorder", group(bytes)),
    };
    out += &format!("  flash {} bytes, RAM {} bytes static{recorder}\n", group(size.flash()), group(size.ram()));
    for section in &size.sections {
        let place = match (section.flash, section.ram) {
            (true, true) => "flash and RAM",
            (true, false) => "flash",
            _ => "RAM",
        };
        let (name, address, bytes) = (&section.name, section.address, group(section.bytes));
        out += &format!("    {name:<22} {address:#010x} {bytes:>10} bytes {place}\n");
    }
    for (name, bytes) in size.variables.iter().take(LISTED) {
        out += &format!("    variable {name}: {} bytes\n", group(*bytes));
    }
    out
}

/// Results of the tick checks.
pub fn checked(checks: &TickChecks) -> String {
    let mut out = String::new();
    out += &format!(
        "  {} reaches {} functions, {} bytes of code; {}\n",
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
    let bound = checks.stack.map_or("unbounded".to_owned(), |bytes| format!("at most {} bytes", group(bytes)));
    out += &format!("  stack: {bound}: {}\n", path.join(" → "));
    out.extend(checks.faults.iter().map(|fault| format!("  FAULT {}\n", fault.text)));
    out
}
