//! Checks of `[target.budget]` that need no build.

use super::{Facts, Findings, figure};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, Scalar};

lints! {
    rules: tables_fit;

    /// # E0870: a budget below the size of the tables
    ///
    /// Before the build, `[target.budget]` is compared with the size of tables and
    /// reversal memories, and with the least time and instructions of a tick.
    ///
    /// ## Why it matters
    ///
    /// The image cannot be smaller than its tables: n(n+1)/2 nodes for each different
    /// leg.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [target.budget] @@
    /// -flash        = "128 KiB"
    /// +flash        = "128 B"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit; otherwise use a coarser grid or a shorter reversal memory.
    ///
    /// ```toml
    /// flash        = "128 KiB"
    /// ```
    BUDGET_IMPOSSIBLE = "E0870";

    /// # W0871: a budget that has no effect
    ///
    /// A budget should not be hundreds of times the size of the tables, and the
    /// time of a tick should not exceed the period.
    ///
    /// ## Why it matters
    ///
    /// An image that has grown tenfold would still be within the budget.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [target.budget] @@
    /// -flash        = "128 KiB"
    /// +flash        = "4 MiB"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check KiB against MiB. A good budget is the measured size plus a tenth.
    ///
    /// ```toml
    /// flash        = "128 KiB"
    /// ```
    BUDGET_LOOSE = "W0871";

    /// # W0873: more RAM than flash
    ///
    /// The RAM budget should not exceed the flash budget.
    ///
    /// ## Why it matters
    ///
    /// Microcontrollers have more flash than RAM, and controllers need more flash:
    /// tables are constants.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [target.budget] @@
    /// -ram          = "32 KiB"
    /// +ram          = "256 KiB"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check whether the two are swapped.
    ///
    /// ```toml
    /// ram          = "32 KiB"
    /// ```
    BUDGET_SWAPPED = "W0873";

    /// # N0872: memory and time are measured by a build
    ///
    /// `specgen check` knows only the size of tables and reversal memories.
    ///
    /// ## Why it matters
    ///
    /// Code size, stack and instructions per tick are known once the image is built
    /// and run. Until then these parts of the budget are not checked.
    ///
    /// ## Example
    ///
    /// `specs/minimal.toml` with
    ///
    /// ```diff
    /// +[target.budget]
    /// +flash = "128 KiB"
    /// ```
    ///
    /// ## Fix
    ///
    /// None needed: build with `specgen SPEC -o DIR`.
    ESTIMATED = "N0872";
}

/// Least stack of a tick, bytes: the values of six legs and a pose.
const LEAST_STACK: u64 = 256;
/// Least instructions of a tick: two sums and a product for every leg and axis of kinematics and control law.
const LEAST_INSTRUCTIONS: u64 = 300;
/// Least time of a tick, s: the conversion time of the gauges.
const LEAST_TIME: f64 = 5e-6;
/// A budget more than this many times the need has no effect.
const LOOSE: u64 = 512;

/// Size of tables and of reversal memories, bytes: all that is known before a build. `specgen build` measures the rest.
pub fn least(model: &Model) -> [u64; 2] {
    let scalar = match model.controller.scalar {
        Scalar::F32 => 4,
        Scalar::F64 => 8,
    };
    let nodes = (model.hysteresis.grid + 1) * (model.hysteresis.grid + 2) / 2;
    // Without records there is one table, a straight line.
    let table = nodes * scalar * model.hysteresis.records.len().max(1);
    // Each reversal is an extremum; six legs remember their own.
    let memory = 6 * model.hysteresis.memory * scalar;
    [table as u64, memory as u64]
}

/// Notes which part of a declared budget needs a build to be checked.
pub fn estimated(model: &Model) -> Option<Diagnostic> {
    let budget = &model.target.budget;
    if [budget.flash, budget.ram, budget.stack, budget.instructions] == [None; 4] {
        return None;
    }
    let [tables, memory] = least(model);
    Some(Diagnostic::at(
        &model.spans,
        &["target.budget"],
        ESTIMATED,
        format!(
            "tables take {tables} B of flash, reversal memories {memory} B of RAM; the rest of the budget is checked by a build"
        ),
        "`specgen SPEC -o DIR` builds the controller and measures flash, RAM, stack and instructions".to_owned(),
    ))
}

/// Checks for budgets below the need, and for budgets so large that they have no effect.
fn tables_fit(facts: &Facts, found: &mut Findings) {
    let budget = &facts.model.target.budget;
    let [table, memory] = least(facts.model);
    let lines = [
        ("flash", budget.flash, table, "the hysteresis tables alone take"),
        ("ram", budget.ram, memory, "the reversal memories alone take"),
        ("stack", budget.stack, LEAST_STACK, "a tick needs at least about"),
    ];
    for (name, declared, least, what) in lines {
        let Some(declared) = declared else { continue };
        let key = format!("target.budget.{name}");
        if declared < least {
            found.add(
                BUDGET_IMPOSSIBLE,
                &key,
                format!("`{key}` is {declared} B, but {what} {least} B"),
                "check the unit (B or KiB); `specgen build` measures the actual need",
            );
        } else if declared > LOOSE * least.max(if name == "stack" { 1024 } else { 4096 }) {
            let [mebibytes, kibibytes] = [declared as f64 / 1_048_576.0, least as f64 / 1024.0].map(figure);
            found.add(
                BUDGET_LOOSE,
                &key,
                format!("`{key}` is {mebibytes} MiB; the tables take {kibibytes} KiB"),
                "a budget that no controller can exceed has no effect: check the unit (KiB or MiB)",
            );
        }
    }
    if let (Some(flash), Some(ram)) = (budget.flash, budget.ram)
        && ram > flash
    {
        found.add(
            BUDGET_SWAPPED,
            "target.budget.ram",
            format!("a budget of {ram} B of RAM and {flash} B of flash"),
            "code and tables are in flash, which is larger than RAM on every microcontroller: check whether `target.budget.flash` and `target.budget.ram` are swapped",
        );
    }
    if let Some(declared) = budget.instructions
        && declared > LOOSE * LEAST_INSTRUCTIONS
    {
        found.add(
            BUDGET_LOOSE,
            "target.budget.instructions",
            format!("`target.budget.instructions` is {declared}, far more than any tick of six legs needs"),
            "a few thousand are usual: a budget that no controller can exceed has no effect",
        );
    }
    let period = facts.model.timing.period;
    if let Some(time) = budget.time {
        let shown = |time: f64| figure(time * 1e6);
        if time > period {
            found.add(
                BUDGET_LOOSE,
                "target.budget.time",
                format!("`target.budget.time` is {} us, more than the period of {} us", shown(time), shown(period)),
                "the period limits the time anyway: check the unit (us or ms)",
            );
        } else if time < LEAST_TIME {
            found.add(
                BUDGET_IMPOSSIBLE,
                "target.budget.time",
                format!("`target.budget.time` is {} us, but reading six gauges alone takes longer", shown(time)),
                "check the unit (us or ms); `specgen build` estimates the time of a tick on a board",
            );
        }
    }
    if let Some(declared) = budget.instructions
        && declared < LEAST_INSTRUCTIONS
    {
        found.add(
            BUDGET_IMPOSSIBLE,
            "target.budget.instructions",
            format!("`target.budget.instructions` is {declared}, but the kinematics of six legs alone takes more than {LEAST_INSTRUCTIONS}"),
            "a few thousand are usual; `specgen build` measures the actual number per tick",
        );
    }
}
