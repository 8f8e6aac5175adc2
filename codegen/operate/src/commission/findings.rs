//! What a user has to know: a workspace that was narrowed, and figures of the acceptance that are far from their simulation.

use super::state::{Figure, State};
use crate::place::AXES;

/// A figure beyond this many times its simulation, and further from it than the noise at rest, is a finding.
const FAR: f64 = 1.5;

/// They, as sentences.
pub(super) fn findings(state: &State) -> Vec<String> {
    // Of the noise at rest in three axes, the norm.
    let noise = |axis: usize| {
        let of = |figure: &&Figure| figure.name.starts_with("hold") && figure.axis / 3 == axis / 3;
        let squares = state.acceptance.iter().filter(of).filter_map(|figure| Some(figure.computed? * figure.computed?));
        squares.fold(0.0, |sum, square| sum + square).sqrt()
    };
    let is_far = |figure: &&Figure| {
        figure.computed.is_some_and(|computed| {
            let at_rest = if figure.name.starts_with("hold") { computed } else { noise(figure.axis) };
            figure.value > FAR * computed && figure.value - computed > at_rest
        })
    };
    let figures = state.acceptance.iter().filter(is_far).map(|figure| {
        let times = figure.value / figure.computed.unwrap_or(f64::NAN);
        format!("{}: {times:.1} times its simulation", figure.name)
    });
    let loops = state.sensitivity.iter().filter_map(|one| {
        let far = |axis: &usize| {
            one.measured[*axis].is_some_and(|measured| {
                let computed = one.computed[*axis];
                measured > FAR * computed && measured - computed > 3.0 * one.error[*axis]
            })
        };
        let axes: Vec<&str> = (0..6).filter(far).map(|axis| AXES[axis]).collect();
        (!axes.is_empty())
            .then(|| format!("|S| at {} Hz, {}: above {FAR} times that of the spec", one.hertz, axes.join(" ")))
    });
    state.narrowed.iter().cloned().chain(figures).chain(loops).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_far_from_its_simulation_is_a_finding() {
        let figure = |name: &str, value: f64| Figure {
            name: name.to_owned(),
            axis: 0,
            value,
            computed: Some(3e-9),
            limit: None,
        };
        let of = |acceptance: Vec<Figure>| findings(&State { acceptance, ..State::default() });
        assert!(of(vec![figure("hold, x", 4e-9), figure("circle, xyz", 5.9e-9)]).is_empty());
        let far = of(vec![figure("hold, x", 6.1e-9), figure("circle, xyz", 9e-9)]);
        assert_eq!(far, ["hold, x: 2.0 times its simulation", "circle, xyz: 3.0 times its simulation"]);
    }
}
