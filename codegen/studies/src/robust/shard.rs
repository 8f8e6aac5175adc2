//! Splits a plan into parts that can run anywhere, and merges them: members are independent.

use serde::{Deserialize, Serialize};

use super::plan::{Member, Plan};
use super::run::Outcome;

/// Largest number of parts.
const MOST: u32 = 1_000_000;

/// One of `of` parts of a plan: every `of`-th member, so corners and random machines are spread over all parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 1 to `of`.
    pub index: u32,
    /// Number of parts.
    pub of: u32,
}

impl Shard {
    /// Reads `I/N`.
    ///
    /// # Errors
    /// A message if I is not from 1 to N.
    pub fn parse(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse().ok();
        let read = text.split_once('/').and_then(|(index, of)| Some(Self { index: number(index)?, of: number(of)? }));
        read.filter(|shard| shard.is_valid())
            .ok_or_else(|| format!("expected I/N with I from 1 to N, such as 2/7, found `{text}`"))
    }

    fn is_valid(self) -> bool {
        1 <= self.index && self.index <= self.of && self.of <= MOST
    }

    /// Its members of a plan, in order.
    pub fn of(self, plan: &Plan) -> Plan {
        let from = self.index.saturating_sub(1) as usize;
        Plan { members: plan.members.iter().skip(from).step_by(self.of.max(1) as usize).cloned().collect() }
    }
}

/// The runs of a shard, with the name of their file.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name given by the user.
    pub name: String,
    /// The shard.
    pub shard: Shard,
    /// Its members, in the order of the plan.
    pub runs: Vec<(Member, Outcome)>,
}

/// Merges the runs of a plan from its parts, in the order of the plan. A part that is given twice
/// with the same runs counts once.
///
/// # Errors
/// A message that names the part of another plan, the conflicting copy, or the missing part.
pub fn merged(plan: &Plan, parts: &[Part]) -> Result<Vec<(Member, Outcome)>, String> {
    let Some(first) = parts.first() else { return Err("no parts to merge".to_owned()) };
    let of = first.shard.of;
    let mut by_index: Vec<Option<&Part>> = vec![None; of.min(MOST) as usize];
    for part in parts {
        let Part { name, shard, runs } = part;
        if shard.of != of || !shard.is_valid() {
            let (index, other) = (shard.index, shard.of);
            return Err(format!("`{name}` is part {index} of {other}, but `{}` is one of {of}", first.name));
        }
        let expected = shard.of(plan).members;
        if !runs.iter().map(|(member, _)| member).eq(&expected) {
            let (machines, part, again) = (expected.len(), shard.index, shard.index);
            return Err(format!(
                "`{name}` does not have the {machines} machines of part {part} of {of}: it was modified or written by another version; run it \
                 again with --shard {again}/{of}"
            ));
        }
        match by_index[shard.index as usize - 1].replace(part) {
            Some(other) if other.runs != *runs => {
                return Err(format!(
                    "`{}` and `{name}` are both part {} of {of} but differ; run it again with --shard {}/{of} and merge only \
                     that one",
                    other.name, shard.index, shard.index
                ));
            }
            _ => {}
        }
    }
    let missing: Vec<String> = (1..)
        .zip(&by_index)
        .filter(|(_, part)| part.is_none())
        .map(|(index, _): (u32, _)| format!("{index}/{of}"))
        .collect();
    if !missing.is_empty() {
        return Err(format!("missing: --shard {}", missing.join(", ")));
    }
    let whole: Vec<&Part> = by_index.into_iter().flatten().collect();
    let places = 0..plan.members.len();
    // The check above ensures that every part is complete.
    Ok(places.filter_map(|place| whole[place % whole.len()].runs.get(place / whole.len()).cloned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::{Deviation, Factor, Figures};

    fn plan(count: u64) -> Plan {
        let member = |seed: u64| Member {
            name: seed.to_string(),
            seed,
            drawn: seed > 3,
            deviation: Deviation { mass: 1.0 + seed as f64 / 64.0, ..Deviation::common(Factor::nominal) },
        };
        Plan { members: (0..count).map(member).collect() }
    }

    fn run(plan: &Plan) -> Vec<(Member, Outcome)> {
        let outcome = |member: &Member| match member.seed {
            2 => Outcome::Diverged { time: Some(0.1), reason: "test".to_owned(), limited_percent: 0.3 },
            seed => Outcome::Ran(Figures { error_nm: 1.0 / seed as f64, ..Figures::default() }),
        };
        plan.members.iter().map(|member| (member.clone(), outcome(member))).collect()
    }

    fn part(plan: &Plan, index: u32, of: u32) -> Part {
        let shard = Shard { index, of };
        Part { name: format!("{index}.json"), shard, runs: run(&shard.of(plan)) }
    }

    #[test]
    fn parts_merge_in_any_order_and_infinities_survive_json() {
        for count in [0, 1, 6, 7, 120] {
            let plan = plan(count);
            for of in [1, 2, 4, 7, 130] {
                let mut parts: Vec<Part> = (1..=of).rev().map(|index| part(&plan, index, of)).collect();
                parts.push(part(&plan, 1, of));
                assert_eq!(merged(&plan, &parts).unwrap(), run(&plan), "{count} in {of}");
            }
        }
        // Machine 0 has an infinite error.
        let runs = run(&plan(9));
        assert_eq!(runs[0].1.figures().unwrap().error_nm, f64::INFINITY);
        let text = serde_json::to_string(&runs).unwrap();
        assert_eq!(serde_json::from_str::<Vec<(Member, Outcome)>>(&text).unwrap(), runs);
    }

    #[test]
    fn wrong_and_missing_parts_are_named() {
        let plan = plan(9);
        let refused = |parts: &[Part], says: &str| {
            let error = merged(&plan, parts).unwrap_err();
            assert!(error.contains(says), "{error}");
        };
        let [one, two, three] = [1, 2, 3].map(|index| part(&plan, index, 3));
        refused(&[], "no parts");
        refused(std::slice::from_ref(&one), "missing: --shard 2/3, 3/3");
        refused(&[one.clone(), part(&plan, 2, 4)], "`2.json` is part 2 of 4, but `1.json` is one of 3");
        let mut other = two.clone();
        other.name = "again.json".to_owned();
        other.runs[0].1 = Outcome::Ran(Figures::default());
        refused(&[one.clone(), two.clone(), other, three], "`2.json` and `again.json` are both part 2 of 3");
        let mut short = two.clone();
        short.runs.pop();
        refused(&[one.clone(), short], "`2.json` does not have the 3 machines");
        let mut changed = two;
        changed.runs[1].0.deviation.mass *= 1.0 + f64::EPSILON;
        refused(&[one, changed], "run it again with --shard 2/3");
    }

    #[test]
    fn a_shard_is_a_part_of_a_number_of_parts() {
        assert_eq!(Shard::parse(" 2 / 7"), Ok(Shard { index: 2, of: 7 }));
        for text in ["0/7", "8/7", "1", "1/0", "-1/2", "1/2/3", "a/b", "1/1000001"] {
            assert!(Shard::parse(text).unwrap_err().contains("such as 2/7"), "{text}");
        }
    }
}
