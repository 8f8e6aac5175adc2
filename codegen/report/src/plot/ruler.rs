//! Linear and logarithmic scales with round ticks.

pub(super) struct Ruler {
    log: bool,
    low: f64,
    high: f64,
    pixels: [f64; 2],
}

pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Ruler {
    /// A scale over all finite `values`, with a small margin, or over `limits`.
    pub(super) fn over(
        values: impl Iterator<Item = f64>,
        log: bool,
        limits: Option<[f64; 2]>,
        pixels: [f64; 2],
    ) -> Self {
        let fits = |v: &f64| v.is_finite() && (!log || *v > 0.0);
        let (mut low, mut high) = values.filter(fits).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (if v < a { v } else { a }, if v > b { v } else { b })
        });
        if let Some([a, b]) = limits {
            (low, high) = (a, b);
        }
        if low > high {
            (low, high) = (1.0, 10.0);
        }
        if log {
            (low, high) = (libm::log10(low), libm::log10(high));
        }
        if high - low <= 1e-12 * high.abs().max(low.abs()).max(1e-300) {
            let room = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - room, high + room);
        }
        let room = if limits.is_some() { 0.0 } else { 0.03 * (high - low) };
        Self { log, low: low - room, high: high + room, pixels }
    }

    /// Pixel position of `value`; NaN if it cannot be drawn.
    pub(super) fn at(&self, value: f64) -> f64 {
        let value = match self.log {
            false => value,
            true if value > 0.0 => libm::log10(value),
            true => f64::NAN,
        };
        self.pixels[0] + (value - self.low) / (self.high - self.low) * (self.pixels[1] - self.pixels[0])
    }

    pub(super) fn ticks(&self) -> Vec<Tick> {
        if self.log { logarithmic(self.low, self.high) } else { linear(self.low, self.high) }
    }
}

fn linear(low: f64, high: f64) -> Vec<Tick> {
    let rough = (high - low) / 6.0;
    let decade = libm::exp10(libm::log10(rough).floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * decade >= rough).unwrap_or(10.0);
    let step = factor * decade;
    let digits = (-libm::log10(step).floor()).clamp(0.0, 12.0) as usize;
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last.min(first + 20))
        .map(|k| {
            let value = k as f64 * step;
            let label = if value != 0.0 && (step >= 1e5 || digits > 5) {
                format!("{value:.1e}")
            } else {
                format!("{value:.digits$}")
            };
            Tick { value, label }
        })
        .collect()
}

fn logarithmic(low: f64, high: f64) -> Vec<Tick> {
    let factors: &[f64] = if high - low > 3.5 {
        &[1.0]
    } else if high - low > 1.2 {
        &[1.0, 3.0]
    } else {
        &[1.0, 2.0, 3.0, 5.0, 7.0]
    };
    let mut ticks = Vec::new();
    for decade in (low.floor() as i32)..=(high.ceil() as i32) {
        for factor in factors {
            let value = factor * libm::exp10(f64::from(decade));
            if libm::log10(value) >= low && libm::log10(value) <= high {
                let label = if (-3..5).contains(&decade) {
                    format!("{}", (value * 1e6).round() / 1e6)
                } else {
                    format!("{factor}e{decade}")
                };
                ticks.push(Tick { value, label });
            }
        }
    }
    // Less than a factor of two between the ends: linear ticks show more.
    if ticks.len() < 2 {
        ticks = linear(libm::exp10(low), libm::exp10(high));
    }
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |low, high| linear(low, high).into_iter().map(|t| t.label).collect::<Vec<_>>();
        assert_eq!(labels(-90.0, 90.0), ["-50", "0", "50"]);
        assert_eq!(labels(0.0, 0.5), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(logarithmic(0.0, 2.0).len(), 5);
    }
}
