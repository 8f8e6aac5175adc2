//! Memory that the constants take whatever the code does.

use super::{Facts, Found, figure};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, Scalar};

lints! {
    rules: tables_fit;

    /// # E0870: a budget below what the tables take
    ///
    /// The constants of the tables and the reversal memories are counted before
    /// anything is built, and compared with `[target.budget]`; so are the least times
    /// and instructions of a tick.
    ///
    /// ## Why it matters
    ///
    /// The image cannot become smaller than its tables: n(n+1)/2 nodes for each
    /// different leg.
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
    /// Check the unit; otherwise a coarser grid or less memory.
    ///
    /// ```toml
    /// flash        = "128 KiB"
    /// ```
    BUDGET_IMPOSSIBLE = "E0870";

    /// # W0871: a budget that checks nothing
    ///
    /// A budget should not be hundreds of times what the tables take, nor the time of
    /// a tick longer than the period.
    ///
    /// ## Why it matters
    ///
    /// It would let an image pass that has grown tenfold.
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
    /// Check KiB against MiB; the measured size and a tenth is a good budget.
    ///
    /// ```toml
    /// flash        = "128 KiB"
    /// ```
    BUDGET_LOOSE = "W0871";

    /// # W0873: more RAM than flash
    ///
    /// The budget of RAM should not exceed that of flash.
    ///
    /// ## Why it matters
    ///
    /// Parts have more flash than RAM, and controllers need more of it: tables are
    /// constants.
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
    /// Are the two in each other's place?
    ///
    /// ```toml
    /// ram          = "32 KiB"
    /// ```
    BUDGET_SWAPPED = "W0873";

    /// # N0872: memory and time are measured by a build
    ///
    /// `specgen check` knows what tables and memories take.
    ///
    /// ## Why it matters
    ///
    /// Code, stack and instructions per tick are known once the image is built and
    /// run; until then a part of the budget is not checked.
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
    /// Nothing: build with `specgen SPEC -o DIR`.
    ESTIMATED = "N0872";
}

/// Least stack of a tick, bytes: six legs and a pose in flight.
const LEAST_STACK: u64 = 256;
/// Least instructions of a tick: two sums and a product for every leg and axis of the kinematics and the law.
const LEAST_INSTRUCTIONS: u64 = 300;
/// Least time of a tick, s: converters are asked, and wait.
const LEAST_TIME: f64 = 5e-6;
/// Declared more than this many times over what is needed, a budget checks nothing.
const LOOSE: u64 = 512;

/// Bytes that tables and reversal memories take, and with them everything that can be said before a build: the rest is
/// measured by `specgen build`.
pub fn least(model: &Model) -> [u64; 2] {
    let scalar = match model.controller.scalar {
        Scalar::F32 => 4,
        Scalar::F64 => 8,
    };
    let nodes = (model.hysteresis.grid + 1) * (model.hysteresis.grid + 2) / 2;
    let table = nodes * scalar * model.hysteresis.records.len();
    // Each reversal is an extremum; six legs remember their own.
    let memory = 6 * model.hysteresis.memory * scalar;
    [table as u64, memory as u64]
}

/// Says what of a declared budget only a build can tell.
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
            "tables take {tables} B of flash, reversal memories {memory} B of RAM; the rest of the budget is not checked here"
        ),
        "`specgen SPEC -o DIR` builds the controller and measures flash, RAM, stack and instructions".to_owned(),
    ))
}

/// A budget below what the tables take, or so far above it that it checks nothing.
fn tables_fit(facts: &Facts, found: &mut Found) {
    let budget = &facts.model.target.budget;
    let [table, memory] = least(facts.model);
    let lines = [
        ("flash", budget.flash, table, "the hysteresis tables alone take"),
        ("ram", budget.ram, memory, "the reversal memories alone take"),
        ("stack", budget.stack, LEAST_STACK, "no tick gets by with less than about"),
    ];
    for (name, declared, least, what) in lines {
        let Some(declared) = declared else { continue };
        let key = format!("target.budget.{name}");
        if declared < least {
            found.add(
                BUDGET_IMPOSSIBLE,
                &key,
                format!("`{key}` is {declared} B, but {what} {least} B"),
                "check the unit (B or KiB); `specgen build` measures what it really takes",
            );
        } else if declared > LOOSE * least.max(if name == "stack" { 1024 } else { 4096 }) {
            found.add(
                BUDGET_LOOSE,
                &key,
                format!(
                    "`{key}` is {} MiB; the tables take {} KiB",
                    figure(declared as f64 / 1_048_576.0),
                    figure(least as f64 / 1024.0)
                ),
                "a budget that no controller can exceed checks nothing: check the unit (KiB or MiB)",
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
            "code and tables are in flash, which is the larger on every part: are `target.budget.flash` and `target.budget.ram` in each other's place?",
        );
    }
    if let Some(declared) = budget.instructions
        && declared > LOOSE * LEAST_INSTRUCTIONS
    {
        found.add(
            BUDGET_LOOSE,
            "target.budget.instructions",
            format!("`target.budget.instructions` is {declared}, and no tick of six legs comes near that"),
            "some thousands are usual: a budget that no controller can exceed checks nothing",
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
                "the period is a limit without it: check the unit (us or ms)",
            );
        } else if time < LEAST_TIME {
            found.add(
                BUDGET_IMPOSSIBLE,
                "target.budget.time",
                format!("`target.budget.time` is {} us, and reading six gauges alone takes longer", shown(time)),
                "check the unit (us or ms); `specgen build` estimates what a tick takes on a board",
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
            "some thousands are usual; `specgen build` measures what a tick really takes",
        );
    }
}
