//! Error against effort as SVG: all candidates, the front, and where the search began and ended.

use std::fmt::Write as _;

use super::{Candidate, Score};

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 520.0;
/// Left, top, right, bottom.
const MARGIN: [f64; 4] = [78.0, 46.0, 24.0, 62.0];

/// A logarithmic axis.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn of(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, 0.0);
        for value in values.filter(|value| *value > 0.0) {
            low = if value < low { value } else { low };
            high = if value > high { value } else { high };
        }
        if !low.is_finite() || high <= 0.0 {
            (low, high) = (1.0, 10.0);
        }
        // Room around, and at least an eighth of a decade.
        let room = 0.06 * libm::log10(high / low) + 0.06;
        let factor = libm::pow(10.0, room);
        Self { low: low / factor, high: high * factor, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let value = if value > self.low { value } else { self.low };
        self.from + (self.to - self.from) * libm::log(value / self.low) / libm::log(self.high / self.low)
    }

    /// 1, 2, 5 times powers of ten within the axis; with every digit where the axis is short.
    fn ticks(&self) -> Vec<f64> {
        let digits: &[f64] =
            if self.high / self.low > 20.0 { &[1.0, 2.0, 5.0] } else { &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0] };
        let digits = if self.high / self.low > 1e4 { &digits[..1] } else { digits };
        let mut ticks = Vec::new();
        let first = libm::floor(libm::log10(self.low)) as i32;
        let last = libm::ceil(libm::log10(self.high)) as i32;
        for power in first..=last {
            for digit in digits {
                let value = digit * libm::pow(10.0, f64::from(power));
                if value > self.low && value < self.high {
                    ticks.push(value);
                }
            }
        }
        ticks
    }
}

/// The plot. `marks` are named scores, such as where the search began.
#[must_use]
pub fn svg(title: &str, axes: [&str; 2], all: &[Candidate], front: &[Candidate], marks: &[(&str, Score)]) -> String {
    let scores = || all.iter().map(|c| &c.score).chain(marks.iter().map(|(_, score)| score));
    // A few that are far worse than the rest would press everything else into a corner.
    let limit = |value: fn(&Score) -> f64, part: f64, factor: f64| {
        let mut values: Vec<f64> = scores().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get((part * values.len() as f64) as usize).map_or(f64::INFINITY, |value| factor * value)
    };
    let worst = [limit(|score| score.error_nm, 0.5, 10.0), limit(|score| score.effort_nm, 0.97, 1.5)];
    let seen = |score: &Score| score.error_nm <= worst[0] && score.effort_nm <= worst[1];
    let shown = || scores().filter(|score| seen(score));
    let x = Axis::of(shown().map(|score| score.effort_nm), MARGIN[0], WIDTH - MARGIN[2]);
    let y = Axis::of(shown().map(|score| score.error_nm), HEIGHT - MARGIN[3], MARGIN[1]);
    let mut out = String::new();
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">"
    );
    let _ = writeln!(out, "<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>");
    let _ = writeln!(out, "<text x=\"{}\" y=\"24\" font-size=\"15\">{}</text>", MARGIN[0], escaped(title));
    for tick in x.ticks() {
        let at = x.at(tick);
        let _ =
            writeln!(out, "<line x1=\"{at:.1}\" y1=\"{}\" x2=\"{at:.1}\" y2=\"{}\" stroke=\"#e4e4e4\"/>", y.to, y.from);
        let _ =
            writeln!(out, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", y.from + 18.0, label(tick));
    }
    for tick in y.ticks() {
        let at = y.at(tick);
        let _ =
            writeln!(out, "<line x1=\"{}\" y1=\"{at:.1}\" x2=\"{}\" y2=\"{at:.1}\" stroke=\"#e4e4e4\"/>", x.from, x.to);
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            x.from - 6.0,
            at + 4.5,
            label(tick)
        );
    }
    let _ = writeln!(
        out,
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>",
        x.from,
        y.to,
        x.to - x.from,
        y.from - y.to
    );
    let _ = writeln!(
        out,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        0.5 * (x.from + x.to),
        HEIGHT - 18.0,
        escaped(axes[0])
    );
    let middle = 0.5 * (y.from + y.to);
    let _ = writeln!(
        out,
        "<text x=\"20\" y=\"{middle}\" text-anchor=\"middle\" transform=\"rotate(-90 20 {middle})\">{}</text>",
        escaped(axes[1])
    );
    for Candidate { score, .. } in all.iter().filter(|candidate| seen(&candidate.score)) {
        let _ = writeln!(
            out,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2\" fill=\"#9db4c8\"/>",
            x.at(score.effort_nm),
            y.at(score.error_nm)
        );
    }
    let line: Vec<String> = front
        .iter()
        .filter(|c| seen(&c.score))
        .map(|c| format!("{:.1},{:.1}", x.at(c.score.effort_nm), y.at(c.score.error_nm)))
        .collect();
    let _ = writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#b03030\" stroke-width=\"1.6\"/>",
        line.join(" ")
    );
    // Names in a list of their own: marks may lie on one another.
    let colours = ["#1a1a1a", "#1f6f3f", "#7a3fa0", "#c07000"];
    for (k, (name, score)) in marks.iter().enumerate() {
        let colour = colours[k % colours.len()];
        if seen(score) {
            let (cx, cy) = (x.at(score.effort_nm), y.at(score.error_nm));
            let _ = writeln!(
                out,
                "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\"/>",
                5 + 2 * k
            );
        }
        let at = MARGIN[1] + 18.0 + 19.0 * k as f64;
        let _ = writeln!(
            out,
            "<circle cx=\"{}\" cy=\"{}\" r=\"5\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\"/>",
            x.to - 214.0,
            at - 4.5
        );
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{at}\" fill=\"{colour}\">{}: {:.2} nm</text>",
            x.to - 202.0,
            escaped(name),
            score.error_nm
        );
    }
    out.push_str("</svg>\n");
    out
}

fn label(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{}", (value * 1e6).round() / 1e6) } else { format!("{value:.0e}") }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_ticks_in_it_and_keeps_what_is_off_it_on_its_edge() {
        for (low, high) in [(3.0, 4.0), (1.0, 900.0), (1e-6, 1e3)] {
            let axis = Axis::of([low, high].into_iter(), 0.0, 100.0);
            let ticks = axis.ticks();
            assert!((2..=20).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            assert!(ticks.iter().all(|tick| (0.0..=100.0).contains(&axis.at(*tick))));
            assert_eq!(axis.at(0.0), 0.0);
        }
    }

    #[test]
    fn text_of_a_title_stays_text() {
        assert!(svg("a < b & c", ["x", "y"], &[], &[], &[]).contains("a &lt; b &amp; c"));
    }
}
