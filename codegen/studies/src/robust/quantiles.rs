//! Quantiles of runs, some of which have no figure because they diverged.

/// The smallest figure that at least `percent` (0 to 100) of all runs do not exceed: nearest rank, so it is the figure
/// of an actual run. A diverged run counts as larger than all others. `None` if the quantile is that of a diverged run, or there are no runs.
pub fn quantile(figures: &[Option<f64>], percent: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = figures.iter().map(|figure| figure.unwrap_or(f64::INFINITY)).collect();
    sorted.sort_by(f64::total_cmp);
    // The tolerance avoids a higher rank from rounding if the product is an integer.
    let rank = libm::ceil(percent / 100.0 * sorted.len() as f64 - 1e-9);
    let index = if rank > 1.0 { rank as usize - 1 } else { 0 };
    sorted.get(index).copied().filter(|figure| figure.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_figure_of_the_nearest_rank() {
        let figures: Vec<Option<f64>> = (1..=20).rev().map(|n| Some(f64::from(n))).collect();
        for (percent, expected) in [(0.0, 1.0), (5.0, 1.0), (5.1, 2.0), (50.0, 10.0), (95.0, 19.0), (100.0, 20.0)] {
            assert_eq!(quantile(&figures, percent), Some(expected), "{percent} %");
        }
        assert_eq!(quantile(&[], 50.0), None);
    }

    #[test]
    fn a_run_without_a_figure_exceeds_everything() {
        let figures = [None, Some(1.0), None, Some(2.0)];
        assert_eq!(quantile(&figures, 50.0), Some(2.0));
        assert_eq!(quantile(&figures, 51.0), None);
    }
}
