//! Pareto front of a search: error over effort, with all candidates, the front, start and end.

use crate::chart::{Axis, Chart, Mark};
use crate::plot::{BLUE, GREY, ORANGE, PURPLE, figure};
use specgen_studies::tuning::{Candidate, Score};

/// Radius of the last mark, px. Earlier ones are larger by the same step, since marks may overlap.
const SMALLEST: f64 = 2.5;

/// The plot as SVG. `axes` name effort and error (nm rms), `marks` are named scores, such as the start of the search.
pub fn svg(title: &str, axes: [&str; 2], all: &[Candidate], front: &[Candidate], marks: &[(&str, Score)]) -> String {
    let scores = || all.iter().map(|c| &c.score).chain(marks.iter().map(|(_, score)| score));
    // A few very poor candidates would compress everything else into a corner.
    let limit = |value: fn(&Score) -> f64, part: f64, factor: f64| {
        let mut values: Vec<f64> = scores().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get((part * values.len() as f64) as usize).map_or(f64::INFINITY, |value| factor * value)
    };
    let worst = [limit(|score| score.error_nm, 0.5, 10.0), limit(|score| score.effort_nm, 0.97, 1.5)];
    let place = |score: &Score| {
        (score.error_nm <= worst[0] && score.effort_nm <= worst[1]).then_some([score.effort_nm, score.error_nm])
    };
    let places = |list: &[Candidate]| list.iter().filter_map(|candidate| place(&candidate.score)).collect();
    let mut chart =
        Chart::new("", "Candidates and Pareto front", Axis::log(axes[0], "nm rms"), Axis::log(axes[1], "nm rms"))
            .with("candidates", Mark::Dots(2.0), places(all))
            .colored(GREY)
            .with("front", Mark::Line(1.6), places(front))
            .colored(ORANGE);
    for (k, (name, score)) in marks.iter().enumerate() {
        let mark = Mark::Dots(SMALLEST * (marks.len() - k) as f64);
        chart = chart.with(name, mark, place(score).into_iter().collect()).colored([BLUE, PURPLE, ORANGE, GREY][k % 4]);
    }
    let errors: Vec<String> = marks.iter().map(|(name, score)| format!("{name} {:.2} nm", score.error_nm)).collect();
    figure(title, &errors.join("; "), &[chart], 1)
}
