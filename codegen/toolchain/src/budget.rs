//! Resource use of a controller against the budget of the spec and the size of the part; for an excess, the largest users.

use serde::Serialize;

use specgen_language::model::Target;

/// Number of users that a message lists.
const NAMED: usize = 3;

/// Resource use of a built image.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ImageUsage {
    /// Bytes of flash.
    pub flash: u64,
    /// Flash by owner: name, bytes.
    pub flash_by: Vec<(String, u64)>,
    /// Bytes of RAM including `State`, settings and the stack of a tick; `None` if one of them is unknown.
    pub ram: Option<u64>,
    /// Bytes of the known parts: a lower bound.
    pub ram_least: u64,
    /// RAM by owner: name, bytes.
    pub ram_by: Vec<(String, u64)>,
    /// Stack bound of a tick, bytes; `None` if it cannot be bounded.
    pub stack: Option<u64>,
    /// Frames of the deepest path: function, bytes.
    pub stack_by: Vec<(String, u64)>,
    /// Mean instructions of a tick, rounded up; `None` if not counted.
    pub instructions: Option<u64>,
    /// Instructions by stage: name, instructions per tick.
    pub instructions_by: Vec<(String, u64)>,
}

/// A resource and its limit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BudgetLine {
    /// `flash`, `RAM`, `stack` or `instructions`.
    pub what: &'static str,
    /// Bytes; mean instructions of a tick.
    pub used: u64,
    /// The limit and its source: a key of the spec, or the part. `None` if there is no limit.
    pub most: Option<(u64, String)>,
}

/// All known figures with their limits. Omits RAM if a part of it is unknown, an unbounded stack, and instructions that were not counted.
pub fn usage_lines(target: &Target, used: &ImageUsage) -> Vec<BudgetLine> {
    let (part, budget) = (target.mcu.part(), &target.budget);
    let limit = |declared: Option<u64>, key: &str, has: u64| match declared {
        Some(bytes) => (bytes, format!("target.budget.{key}")),
        None => (has, part.name.to_owned()),
    };
    let mut lines =
        vec![BudgetLine { what: "flash", used: used.flash, most: Some(limit(budget.flash, "flash", part.flash)) }];
    let ram = || Some(limit(budget.ram, "ram", part.ram));
    lines.extend(used.ram.map(|ram_used| BudgetLine { what: "RAM", used: ram_used, most: ram() }));
    if let Some(stack) = used.stack {
        lines.push(BudgetLine { what: "stack", used: stack, most: Some(limit(budget.stack, "stack", part.ram)) });
    }
    if let Some(instructions) = used.instructions {
        let most = budget.instructions.map(|most| (most, "target.budget.instructions".to_owned()));
        lines.push(BudgetLine { what: "instructions", used: instructions, most });
    }
    lines
}

/// One message per exceeded limit.
#[must_use]
pub fn over(target: &Target, used: &ImageUsage) -> Vec<String> {
    let mut over = Vec::new();
    let mut lines = usage_lines(target, used);
    if used.ram.is_none() {
        // The known parts alone may exceed the limit.
        let part = ImageUsage { ram: Some(used.ram_least), ..ImageUsage::default() };
        lines.extend(usage_lines(target, &part).into_iter().filter(|one| one.what == "RAM"));
    }
    for BudgetLine { what, used: amount, most } in lines {
        let Some((most, from)) = most.filter(|(most, _)| amount > *most) else { continue };
        let (unit, by) = match what {
            "flash" => ("bytes", &used.flash_by),
            "RAM" => ("bytes", &used.ram_by),
            "stack" => ("bytes", &used.stack_by),
            _ => ("per tick", &used.instructions_by),
        };
        let subject = if what == "instructions" { "instruction count is".to_owned() } else { format!("{what} uses") };
        let verb = if from.contains('.') { "allows" } else { "has" };
        let (least, used) = (if what == "RAM" && used.ram.is_none() { "at least " } else { "" }, group(amount));
        let (limit, excess, by) = (group(most), group(amount - most), users(by, amount));
        over.push(format!("{subject} {least}{used} {unit}, {from} {verb} {limit}: reduce it by {excess}{by}"));
    }
    if target.budget.stack.is_some() && used.stack.is_none() {
        over.push("the stack of a tick cannot be bounded".to_owned());
    }
    over
}

/// `; largest: load 1,761 (43 %), learn 437 (11 %)`.
fn users(by: &[(String, u64)], whole: u64) -> String {
    let mut sorted: Vec<&(String, u64)> = by.iter().filter(|(_, amount)| *amount > 0).collect();
    sorted.sort_by(|a, b| (b.1, &a.0).cmp(&(a.1, &b.0)));
    let share = |amount: u64| (100 * amount + whole / 2) / whole.max(1);
    let named: Vec<String> = sorted
        .iter()
        .take(NAMED)
        .map(|(name, amount)| format!("{name} {} ({} %)", group(*amount), share(*amount)))
        .collect();
    if named.is_empty() { String::new() } else { format!("; largest: {}", named.join(", ")) }
}

/// A count with thousands separated.
pub fn group(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_language::model::{Budget, Mcu};

    fn used() -> ImageUsage {
        let list = |parts: &[(&str, u64)]| parts.iter().map(|(name, amount)| ((*name).to_owned(), *amount)).collect();
        ImageUsage {
            flash: 60_000,
            flash_by: list(&[("core", 5000), ("controller", 40_000), ("runtime", 15_000)]),
            ram: Some(9000),
            ram_least: 9000,
            ram_by: list(&[("State", 8000)]),
            stack: Some(1672),
            stack_by: list(&[("step", 1600), ("memcpy", 72)]),
            instructions: Some(4107),
            instructions_by: list(&[("learn", 437), ("load", 1761)]),
        }
    }

    #[test]
    fn an_excess_is_reported_with_the_largest_users() {
        let mut target = Target { mcu: Mcu::Mps2An500, budget: Budget::NONE };
        assert_eq!(over(&target, &used()), Vec::<String>::new());
        target.budget =
            Budget { flash: Some(60_000), ram: Some(9000), stack: Some(1672), instructions: Some(4107), time: None };
        assert_eq!(over(&target, &used()), Vec::<String>::new());
        target.budget.instructions = Some(4000);
        assert_eq!(
            over(&target, &used()),
            [
                "instruction count is 4,107 per tick, target.budget.instructions allows 4,000: reduce it by 107; largest: \
                 load 1,761 (43 %), learn 437 (11 %)"
            ]
        );
        target.budget.flash = Some(59_999);
        let words = over(&target, &used()).join("\n");
        assert!(words.contains("reduce it by 1; largest: controller 40,000 (67 %), runtime"), "{words}");
        (target.budget.ram, target.budget.stack) = (Some(1), Some(1));
        assert_eq!(over(&target, &used()).len(), 4);
        assert!(
            over(&target, &ImageUsage { stack: None, ..used() })
                .iter()
                .any(|words| words.contains("cannot be bounded"))
        );
    }

    #[test]
    fn ram_of_which_a_part_is_missing_is_no_figure_and_may_be_too_much_all_the_same() {
        let mut target = Target { mcu: Mcu::Mps2An500, budget: Budget { ram: Some(2000), ..Budget::NONE } };
        let part = ImageUsage { ram: None, ram_least: 1440, ..used() };
        assert!(usage_lines(&target, &part).iter().all(|one| one.what != "RAM"));
        assert_eq!(over(&target, &part), Vec::<String>::new());
        target.budget.ram = Some(1439);
        let words = over(&target, &part).join("\n");
        assert!(words.contains("RAM uses at least 1,440 bytes") && words.contains("reduce it by 1"), "{words}");
    }

    #[test]
    fn without_a_budget_the_part_is_the_limit() {
        let target = Target { mcu: Mcu::named("stm32f446re").unwrap(), budget: Budget::NONE };
        assert_eq!(over(&target, &used()), Vec::<String>::new());
        let words = over(&target, &ImageUsage { flash: 600_000, ..used() }).join("\n");
        assert!(words.contains("stm32f446re has 524,288") && words.contains("reduce it by 75,712"), "{words}");
    }

    #[test]
    fn thousands_are_separated() {
        assert_eq!([0, 999, 1000, 1_234_567].map(group), ["0", "999", "1,000", "1,234,567"]);
    }
}
