//! Pareto front of error and effort.

use super::Candidate;
use super::search::Generation;
use super::space::Space;

/// The Pareto front in ascending order of error, from candidates in any order.
pub fn front(candidates: &[Candidate]) -> Vec<Candidate> {
    let mut sorted = candidates.to_vec();
    sorted.sort_by(|a, b| {
        let (a, b) = (&a.score, &b.score);
        a.error_nm.total_cmp(&b.error_nm).then(a.effort_nm.total_cmp(&b.effort_nm))
    });
    let mut least = f64::INFINITY;
    sorted.retain(|candidate| {
        let on = candidate.score.effort_nm < least;
        if on {
            least = candidate.score.effort_nm;
        }
        on
    });
    sorted
}

/// The front as CSV: figures, then the tuned parameters.
pub fn to_csv(front: &[Candidate], space: &Space) -> String {
    let mut out = String::from(
        "candidate,error_nm,effort_nm,peak_nm,translation_nm,orientation_nrad,cost_um_s2,seconds,path_seconds",
    );
    out.extend(space.parameters.iter().map(|parameter| format!(",{}", parameter.role)));
    out.push('\n');
    for Candidate { number, setting, score } in front {
        let figures =
            [score.error_nm, score.effort_nm, score.peak_nm, score.translation_nm, score.orientation_nrad, score.cost];
        out += &format!("{number}");
        out.extend(figures.iter().map(|figure| format!(",{figure:.6e}")));
        out += &format!(",{:.6},{:.6}", score.coverage.seconds, score.coverage.path_seconds);
        out.extend(space.parameters.iter().map(|parameter| format!(",{:.3e}", space.value(setting, parameter.role))));
        out.push('\n');
    }
    out
}

/// Costs by generation as CSV.
pub fn history_csv(history: &[Generation]) -> String {
    let mut out = String::from("evaluations,best_cost_um_s2,median_cost_um_s2,unstable,limited\n");
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.9e}"));
    for one in history {
        let (best, median) = (number(one.best), number(one.median));
        out += &format!("{},{best},{median},{},{}\n", one.evaluations, one.unstable, one.limited);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tuning::{Score, Setting};
    use host_sim::coverage::Coverage;

    fn candidate(number: usize, error_nm: f64, effort_nm: f64) -> Candidate {
        let score = Score {
            error_nm,
            translation_nm: error_nm,
            orientation_nrad: 0.0,
            peak_nm: 0.0,
            effort_nm,
            cost: 0.0,
            coverage: Coverage::default(),
        };
        Candidate { number, setting: Setting::Legs { level: 0.1, drift: 0.1 }, score }
    }

    #[test]
    fn the_front_holds_exactly_the_undominated_candidates() {
        let all: Vec<Candidate> = (0..200)
            .map(|k| {
                let x = f64::from(k * 7919 % 200);
                candidate(k as usize, x, (x - 120.0).abs() + f64::from(k * 31 % 17))
            })
            .collect();
        let front = front(&all);
        let beats = |a: &Candidate, b: &Candidate| {
            a.score.error_nm <= b.score.error_nm && a.score.effort_nm <= b.score.effort_nm && a.number != b.number
        };
        for one in &all {
            let beaten = all.iter().any(|other| beats(other, one));
            assert_eq!(front.iter().any(|f| f.number == one.number), !beaten, "{one:?}");
        }
        assert!(front.len() > 5);
    }
}
