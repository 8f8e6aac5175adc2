//! Limits on the results.

use serde::Serialize;

use super::plan::Member;
use super::quantiles::quantile;
use super::run::{Figures, Outcome};

/// The limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gate {
    /// Largest rms error of the translation, or of the legs, nm.
    pub error_nm: Option<f64>,
    /// Largest rms error of the angles, nrad.
    pub orientation_nrad: Option<f64>,
    /// Largest rms translation error after learning, nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned_nm: Option<f64>,
    /// Quantile of the random machines that is compared, %; `None` for the largest value of all machines.
    pub quantile: Option<f64>,
}

impl Gate {
    /// Why the runs fail, one reason per line; empty if they pass.
    pub fn reasons(&self, runs: &[(Member, Outcome)]) -> Vec<String> {
        let mut reasons = Vec::new();
        let lost: Vec<&str> = runs
            .iter()
            .filter(|(_, outcome)| outcome.figures().is_none())
            .map(|(member, _)| member.name.as_str())
            .collect();
        if let Some(first) = lost.first() {
            reasons.push(format!("{} of {} runs diverged, first {first}", lost.len(), runs.len()));
        }
        let grew: Vec<&str> = runs
            .iter()
            .filter(|(_, outcome)| outcome.figures().and_then(|figures| figures.learned).is_some_and(|one| one.grew))
            .map(|(member, _)| member.name.as_str())
            .collect();
        if let Some(first) = grew.first() {
            let (grown, all) = (grew.len(), runs.len());
            reasons.push(format!("the error grew during learning on {grown} of {all} machines, first {first}"));
        }
        type Figure = fn(&Figures) -> Option<f64>;
        let looked_at: [(Option<f64>, &str, &str, Figure); 3] = [
            (self.error_nm, "error", "nm", |figures| Some(figures.error_nm)),
            (self.orientation_nrad, "orientation error", "nrad", |figures| Some(figures.orientation_nrad)),
            (self.learned_nm, "learned error", "nm", |figures| Some(figures.learned?.error_nm)),
        ];
        for (limit, what, unit, of) in looked_at {
            let Some(limit) = limit else { continue };
            let compared: Vec<Option<f64>> = runs
                .iter()
                .filter(|(member, _)| self.quantile.is_none() || member.drawn)
                .map(|(_, outcome)| outcome.figures().and_then(of))
                .collect();
            let which = self.quantile.map_or("largest".to_owned(), |percent| format!("{percent} % quantile of the"));
            match quantile(&compared, self.quantile.unwrap_or(100.0)) {
                Some(found) if found <= limit => {}
                Some(found) => {
                    reasons.push(format!("{which} rms {what} is {found:.2} {unit}, above {limit:.2} {unit}"));
                }
                // The first reason covers diverged runs.
                None if compared.is_empty() => reasons.push(format!("no random machine for the {which} rms {what}")),
                None => reasons.push(format!("{which} rms {what} is that of a diverged run")),
            }
        }
        reasons
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robust::{Deviation, Factor, LearningFigures};
    use host_sim::coverage::Coverage;

    fn run(name: &str, drawn: bool, error_nm: Option<f64>) -> (Member, Outcome) {
        let deviation = Deviation::common(Factor::nominal);
        let outcome = match error_nm {
            Some(error_nm) => Outcome::Ran(Figures { error_nm, ..Figures::default() }),
            None => Outcome::Diverged { time: Some(0.1), reason: "test".to_owned(), limited_percent: 0.0 },
        };
        (Member { name: name.to_owned(), seed: 1, drawn, deviation }, outcome)
    }

    #[test]
    fn the_maximum_includes_corners_but_a_quantile_does_not() {
        let runs = [run("mass-low", false, Some(50.0)), run("7", true, Some(10.0)), run("8", true, Some(20.0))];
        let reasons = |error_nm, quantile| {
            Gate { error_nm: Some(error_nm), orientation_nrad: None, learned_nm: None, quantile }.reasons(&runs)
        };
        assert!(reasons(50.0, None).is_empty());
        assert!(reasons(49.9, None)[0].contains("largest rms error is 50.00 nm, above 49.90 nm"));
        assert!(reasons(20.0, Some(95.0)).is_empty() && reasons(10.0, Some(50.0)).is_empty());
        assert!(reasons(19.9, Some(95.0))[0].starts_with("95 % quantile of the rms error is 20.00 nm"));
    }

    #[test]
    fn learning_has_its_own_limit_and_must_not_diverge() {
        let with = |name: &str, error_nm: f64, grew: bool| {
            let learned = Some(LearningFigures { error_nm, passes: 5, grew, coverage: Coverage::default() });
            let (member, _) = run(name, true, None);
            (member, Outcome::Ran(Figures { error_nm: 20.0, learned, ..Figures::default() }))
        };
        let gate = |learned_nm| Gate { error_nm: Some(20.0), orientation_nrad: None, learned_nm, quantile: None };
        let runs = [with("1", 3.0, false), with("2", 4.0, false)];
        assert!(gate(Some(4.0)).reasons(&runs).is_empty() && gate(None).reasons(&runs).is_empty());
        assert_eq!(gate(Some(3.9)).reasons(&runs), ["largest rms learned error is 4.00 nm, above 3.90 nm"]);
        let grown = [with("1", 3.0, false), with("2", 4.0, true)];
        assert!(gate(None).reasons(&grown)[0].contains("grew during learning on 1 of 2 machines, first 2"));
        // Machines that did not learn fail the limit on learning.
        assert!(!gate(Some(4.0)).reasons(&[run("1", true, Some(1.0))]).is_empty());
    }

    #[test]
    fn a_diverged_run_fails_every_gate() {
        let runs = [run("all-soft", false, None), run("7", true, Some(10.0))];
        for quantile in [None, Some(50.0)] {
            let gate = Gate { error_nm: None, orientation_nrad: None, learned_nm: None, quantile };
            assert_eq!(gate.reasons(&runs), ["1 of 2 runs diverged, first all-soft"]);
        }
        let gate = Gate { error_nm: Some(1e9), orientation_nrad: None, learned_nm: None, quantile: None };
        assert_eq!(gate.reasons(&runs).len(), 2);
    }
}
