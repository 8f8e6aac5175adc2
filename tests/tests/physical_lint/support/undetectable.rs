//! Slips that make another platform as plausible as the one that was meant: no rule tells them from a choice, and the reason
//! stands beside each. They are counted by themselves, and only where nothing was found.

use std::sync::LazyLock;

use specgen_tests::cases::{self, Case};

use super::super::list;
use super::mutants::Mutant;

/// Which slips, and why nobody could know.
static UNDETECTABLE: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let file = specgen_tests::repository().join("tests/cases/undetectable_slips.txt");
    cases::read(&file).into_iter().map(|(case, _)| case).collect()
});

/// All of them.
pub fn undetectable() -> &'static [Case] {
    &UNDETECTABLE
}

/// Whether a case says so of a slip in a spec.
pub fn is_of(case: &Case, base: &str, mutant: &Mutant) -> bool {
    // gauge[3].point[1] → gauge.point
    let key: String = list(&mutant.key).split(['[', ']']).step_by(2).collect();
    (case.title == "any kind" || case.title == mutant.kind)
        && key.starts_with(case.one('k').expect("a key"))
        && mutant.change.contains(case.one('c').unwrap_or_default())
        && case.one('@').is_none_or(|only| only == base)
}

/// The reason for which a slip in a spec cannot be known, if there is one.
pub fn reason(base: &str, mutant: &Mutant) -> Option<&'static str> {
    undetectable().iter().find(|one| is_of(one, base, mutant)).and_then(|one| one.one('y'))
}
