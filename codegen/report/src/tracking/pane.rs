//! Plots of a run: path and error of each coordinate, and the corners of the path.

use host_sim::coverage::Coverage;

use crate::chart::{Axis, BLUE, Chart, DASHED, INK, LINE, Note, WIDE};
use crate::section::{Group, Multiples, Part};

/// A run to plot, per axis or per leg.
#[derive(Debug, Clone)]
pub struct PlottedRun<'a> {
    /// Identifier on the page.
    pub id: String,
    /// Trajectory and speed.
    pub what: String,
    /// Control mode.
    pub law: &'a str,
    /// Names of the coordinates.
    pub names: [&'a str; 6],
    /// Number of coordinates that are lengths; the others are angles.
    pub lengths: usize,
    /// Control interval, s.
    pub interval: f64,
    /// The measured part of the path.
    pub coverage: Coverage,
    /// Target and actual value, m and rad, tick by tick.
    pub samples: Vec<[[f64; 6]; 2]>,
    /// Label for a corner of the path.
    pub corner: &'a str,
}

impl PlottedRun<'_> {
    /// Rms error over all coordinates and ticks, nm.
    pub fn rms_nano(&self) -> f64 {
        let square =
            |[target, pose]: &[[f64; 6]; 2]| target.iter().zip(pose).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 6.0;
        libm::sqrt(self.samples.iter().map(square).sum::<f64>() / self.samples.len().max(1) as f64) * 1e9
    }
}

/// Content of a section about a run.
pub fn pane(run: &PlottedRun) -> Vec<Part> {
    let of = |axis: usize| -> Vec<f64> {
        run.samples.iter().map(|[target, pose]| (target[axis] - pose[axis]) * 1e9).collect()
    };
    let all: [Vec<f64>; 6] = core::array::from_fn(of);
    let rms =
        all.each_ref().map(|errors| libm::sqrt(errors.iter().map(|v| v * v).sum::<f64>() / errors.len().max(1) as f64));
    let peak = all
        .each_ref()
        .map(|errors| errors.iter().fold(0.0, |peak: f64, v| if v.abs() > peak { v.abs() } else { peak }));
    let worst = (1..run.lengths).fold(0, |worst, axis| if rms[axis] > rms[worst] { axis } else { worst });
    let times = [run.interval, run.interval];
    let causes = bends(&run.samples, run.interval);
    let (id, what) = (&run.id, &run.what);
    let mut items = Vec::new();
    let mut at_corner = false;
    for axis in 0..6 {
        let (unit, large) = if axis < run.lengths { ("nm", "µm") } else { ("nrad", "µrad") };
        let name = run.names[axis];
        let errors = &all[axis];
        let mut error = Chart::new(
            &format!("error-{id}-{axis}"),
            &format!("Error of {name}, {what}"),
            Axis::linear("time", "s"),
            Axis::linear(&format!("error of {name}"), unit),
        )
        .over_time("", LINE, times, errors)
        .colored(BLUE)
        .noted(Note::Band([-rms[axis], rms[axis]], [format!("+rms {} {unit}", short(rms[axis])), "−rms".to_owned()]));
        error.short = format!("{name} {} {unit}", short(rms[axis]));
        error.height = 250;
        let (mut largest, mut place) = (0.0, 0);
        for (k, value) in errors.iter().enumerate() {
            if value.abs() > largest {
                (largest, place) = (value.abs(), k);
            }
        }
        for time in &causes {
            let follows = place as f64 * run.interval - time;
            let caused = (0.0..0.02).contains(&follows);
            at_corner |= caused && axis == worst;
            let text = if caused { run.corner } else { "" };
            error = error.noted(Note::Cause(*time, text.to_owned()));
        }
        let at = (place + 1) as f64 * run.interval;
        let value = errors.get(place).copied().unwrap_or_default();
        error = error.noted(Note::Ring([at, value], format!("largest {} {unit}", short(largest))));
        let mut path = Chart::new(
            &format!("path-{id}-{axis}"),
            &format!("{name} of {what}: path above, error below"),
            Axis::linear("time", "s"),
            Axis::linear(name, large),
        )
        .over_time(
            if run.lengths == 3 { "true pose" } else { "reading" },
            WIDE,
            times,
            &run.samples.iter().map(|[_, pose]| pose[axis] * 1e6).collect::<Vec<_>>(),
        )
        .colored(2)
        .over_time(
            "target",
            DASHED,
            times,
            &run.samples.iter().map(|[target, _]| target[axis] * 1e6).collect::<Vec<_>>(),
        )
        .colored(INK);
        path.bare = true;
        path.height = 140;
        items.push(vec![path, error]);
    }
    let range = |axes: core::ops::Range<usize>| {
        let largest = peak[axes].iter().fold(0.0, |a: f64, b| if *b > a { *b } else { a });
        let round = round_up(largest);
        Some([-round, round])
    };
    let groups = error_groups(run.lengths == 3, range);
    let follows = if at_corner { "; the peak is after a corner of the path" } else { "" };
    let (law, name, most, rms) = (run.law, run.names[worst], short(peak[worst]), short(rms[worst]));
    let coverage = run.coverage;
    vec![
        Part::Lead(format!(
            "With {law}, {name} stays within {most}\u{2009}nm of {what}, {rms}\u{2009}nm rms over {coverage}{follows}."
        )),
        Part::Multiples(Multiples { id: format!("axes-{id}"), items, groups, selected: worst }),
    ]
}

/// Formats with three digits.
pub fn short(value: f64) -> String {
    let size = value.abs();
    if size >= 99.95 {
        format!("{value:.0}")
    } else if size >= 9.995 {
        format!("{value:.1}")
    } else {
        format!("{value:.2}")
    }
}

/// Rounds up to 1, 2, 3, 4, 6 or 8 times a power of ten.
pub(crate) fn round_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 1.0;
    }
    let decade = libm::pow(10.0, libm::floor(libm::log10(value)));
    [1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0].iter().map(|k| k * decade).find(|v| *v >= value).unwrap_or(10.0 * decade)
}

/// Times of the three sharpest corners of the path, s, where its second difference is far above the usual.
fn bends(samples: &[[[f64; 6]; 2]], interval: f64) -> Vec<f64> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for axis in 0..6 {
        let target = |window: &[[[f64; 6]; 2]], k: usize| window[k][0][axis];
        let second: Vec<f64> =
            samples.windows(3).map(|w| (target(w, 2) - 2.0 * target(w, 1) + target(w, 0)).abs()).collect();
        let mut sorted = second.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() * 99 / 100).copied().unwrap_or_default();
        let sharpest = sorted.last().copied().unwrap_or_default();
        if sharpest <= 5.0 * usual || sharpest <= 0.0 {
            continue;
        }
        for (k, value) in second.iter().enumerate() {
            if *value > 0.2 * sharpest && *value > 5.0 * usual {
                found.push((value / sharpest, (k + 2) as f64 * interval));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
    let mut times: Vec<f64> = Vec::new();
    for (_, time) in found {
        if times.len() < 3 && times.iter().all(|other| (time - other).abs() > 1e-3) {
            times.push(time);
        }
    }
    times.sort_by(f64::total_cmp);
    times
}

/// Groups of small error charts, for a pose (`axes`) with lengths and angles separate, or for six legs. `range`: that of some of them.
pub(crate) fn error_groups(axes: bool, range: impl Fn(core::ops::Range<usize>) -> Option<[f64; 2]>) -> Vec<Group> {
    let group = |title: &str, items: Vec<usize>, of| Group { title: title.to_owned(), items, range: range(of) };
    if axes {
        vec![
            group("Position error, nm over s", vec![0, 1, 2], 0..3),
            group("Angle error, nrad over s", vec![3, 4, 5], 3..6),
        ]
    } else {
        vec![group("Error, nm over s", vec![0, 1, 2], 0..6), group("", vec![3, 4, 5], 0..6)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_contain_their_values() {
        for value in [0.3, 1.0, 1.21, 172.0, 610.0, 9.9] {
            assert!(round_up(value) >= value && round_up(value) <= 1.7 * value, "{value}");
        }
        assert_eq!((round_up(172.0), round_up(0.0)), (200.0, 1.0));
        assert_eq!([short(171.6), short(23.84), short(4.806)], ["172", "23.8", "4.81"]);
    }
}
