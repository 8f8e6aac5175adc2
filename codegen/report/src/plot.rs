//! Draws charts as SVG, side by side, with axes and units. The pictures need no fonts or other files, and two runs give the same bytes.

mod ruler;
mod svg;

use super::chart::{Chart, Mark, Series};
use ruler::Ruler;
pub(crate) use svg::escaped;
use svg::{Canvas, Hatch};

/// Colours by number: dark enough on white, without adjacent red and green.
const COLORS: [&str; 4] = ["#1f5fa8", "#d9730d", "#7a3fa0", "#8a8f98"];
/// A colour number.
pub const BLUE: usize = 0;
/// A colour number.
pub const ORANGE: usize = 1;
/// A colour number.
pub const PURPLE: usize = 2;
/// A colour number.
pub const GREY: usize = 3;

const WIDTH: f64 = 620.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 58.0;
const BOTTOM: f64 = 56.0;
const HEAD: f64 = 64.0;
/// Longer series are thinned to this number of points.
const POINTS: usize = 5000;
/// Width of a legend character, px: a generous estimate, since no font is measured.
const LETTER: f64 = 6.6;

/// Charts in `columns` columns under a title and a subtitle.
pub fn figure(title: &str, subtitle: &str, charts: &[Chart], columns: usize) -> String {
    let columns = columns.max(1);
    let rows = charts.len().div_ceil(columns).max(1);
    let (width, height) = (WIDTH * columns as f64, HEAD + HEIGHT * rows as f64);
    let mut canvas = Canvas::new(width, height);
    canvas.text(LEFT * 0.5, 28.0, 17.0, "start", "#111", title);
    // Long lines are wrapped at a semicolon, so no text is cut off.
    let letters = ((width - LEFT) / 6.4) as usize;
    for (k, line) in broken(subtitle, letters).iter().take(2).enumerate() {
        canvas.text(LEFT * 0.5, 46.0 + 15.0 * k as f64, 12.0, "start", "#555", line);
    }
    for (k, chart) in charts.iter().enumerate() {
        let at = [WIDTH * (k % columns) as f64, HEAD + HEIGHT * (k / columns) as f64];
        draw(&mut canvas, chart, at, k);
    }
    canvas.finish()
}

/// An HTML page with the SVG.
pub fn html(title: &str, svg: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title></head>\n<body>\n{svg}</body></html>\n",
        escaped(title)
    )
}

fn color(series: &Series) -> &'static str {
    COLORS[series.color % COLORS.len()]
}

fn broken(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_inclusive(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() <= letters => line.push_str(word),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn draw(canvas: &mut Canvas, chart: &Chart, at: [f64; 2], id: usize) {
    let frame = [at[0] + LEFT, at[1] + TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM];
    let all = |which: usize| {
        let points = chart.series.iter().flat_map(move |s| s.points.iter().map(move |p| p[which]));
        let patches = chart.patches.iter().flat_map(move |p| if which == 0 { p.x } else { p.y });
        points.chain(patches)
    };
    let x = Ruler::over(all(0), chart.x.log, None, [frame[0], frame[0] + frame[2]]);
    let y = Ruler::over(all(1), chart.y.log, chart.y_limits, [frame[1] + frame[3], frame[1]]);
    canvas.text(frame[0], at[1] + 20.0, 14.0, "start", "#111", &chart.title);
    legend(canvas, chart, [frame[0], at[1] + 42.0], frame[2]);
    canvas.clip(id, frame);
    canvas.open_clipped(id);
    for patch in &chart.patches {
        let (x0, x1, y0, y1) = (x.at(patch.x[0]), x.at(patch.x[1]), y.at(patch.y[1]), y.at(patch.y[0]));
        canvas.patch([x0, y0, x1 - x0, y1 - y0], patch.shade.map_or(Hatch::Lines, Hatch::Shade));
    }
    canvas.close();
    grid(canvas, &x, &y, frame);
    canvas.open_clipped(id);
    for series in &chart.series {
        let place = |p: &[f64; 2]| [x.at(p[0]), y.at(p[1])];
        let every = series.points.len().div_ceil(POINTS).max(1);
        let points: Vec<[f64; 2]> = series.points.iter().step_by(every).map(place).collect();
        match series.mark {
            Mark::Line(width) => canvas.line(&points, color(series), width, false),
            Mark::Dashed(width) => canvas.line(&points, color(series), width, true),
            Mark::Dots(radius) => canvas.dots(&points, color(series), radius),
        }
    }
    canvas.close();
    canvas.frame(frame);
    canvas.text(frame[0] + 0.5 * frame[2], at[1] + HEIGHT - 14.0, 13.0, "middle", "#222", &chart.x.text());
    canvas.upright(at[0] + 20.0, frame[1] + 0.5 * frame[3], 13.0, &chart.y.text());
}

fn grid(canvas: &mut Canvas, x: &Ruler, y: &Ruler, frame: [f64; 4]) {
    for tick in x.ticks() {
        let at = x.at(tick.value);
        canvas.rule([at, frame[1]], [at, frame[1] + frame[3]]);
        canvas.text(at, frame[1] + frame[3] + 18.0, 12.0, "middle", "#333", &tick.label);
    }
    for tick in y.ticks() {
        let at = y.at(tick.value);
        canvas.rule([frame[0], at], [frame[0] + frame[2], at]);
        canvas.text(frame[0] - 7.0, at + 4.0, 12.0, "end", "#333", &tick.label);
    }
}

fn legend(canvas: &mut Canvas, chart: &Chart, at: [f64; 2], width: f64) {
    let named: Vec<&Series> = chart.series.iter().filter(|s| !s.name.is_empty()).collect();
    let mut left = at[0];
    let mut entry = |name: &str, sample: &mut dyn FnMut(f64)| {
        let wide = 30.0 + LETTER * name.chars().count() as f64 + 12.0;
        if left + wide > at[0] + width + 20.0 {
            return None;
        }
        sample(left);
        let text_at = left + 28.0;
        left += wide;
        Some(text_at)
    };
    let mut texts = Vec::new();
    for series in named {
        let found = entry(&series.name, &mut |x| {
            let ends = [[x, at[1] - 4.0], [x + 22.0, at[1] - 4.0]];
            match series.mark {
                Mark::Line(_) => canvas.line(&ends, color(series), 2.0, false),
                Mark::Dashed(_) => canvas.line(&ends, color(series), 2.0, true),
                Mark::Dots(r) => canvas.dots(&[[x + 11.0, at[1] - 4.0]], color(series), if r > 2.0 { r } else { 2.5 }),
            }
        });
        texts.extend(found.map(|x| (x, series.name.clone())));
    }
    if let Some(name) = &chart.hatched {
        let found = entry(name, &mut |x| canvas.patch([x, at[1] - 11.0, 22.0, 13.0], Hatch::Lines));
        texts.extend(found.map(|x| (x, name.clone())));
    }
    for (x, text) in texts {
        canvas.text(x, at[1], 12.0, "start", "#333", &text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Axis;

    #[test]
    fn a_figure_is_well_formed_and_escapes_its_texts() {
        let chart = Chart::new("", "a < b & c", Axis::linear("x", "V"), Axis::linear("y", "um"))
            .with("line", Mark::Line(1.0), vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]])
            .with("dots", Mark::Dots(2.0), vec![[0.5, 1.5]]);
        let svg = figure("t", "s", &[chart], 1);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        assert!(svg.contains("a &lt; b &amp; c") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
    }

    #[test]
    fn empty_and_constant_series_have_axes_too() {
        for points in [vec![], vec![[1.0, 5.0]], vec![[1.0, 0.0], [1.0, 0.0]]] {
            let chart =
                Chart::new("", "p", Axis::linear("x", ""), Axis::linear("y", "")).with("a", Mark::Line(1.0), points);
            let svg = figure("t", "s", &[chart], 1);
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
