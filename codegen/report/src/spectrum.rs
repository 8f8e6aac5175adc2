//! Spectra of errors.

use core::f64::consts::TAU;

use specgen_numerics::fft::{Complex64, forward};

/// Number of points of a drawn spectrum.
const POINTS: usize = 160;

/// Cumulative rms up to each frequency (Hz): frequencies and values, logarithmically spaced. The last value is the
/// rms of all signals together after removing their linear trends. Signals have equal lengths and are sampled every
/// `interval` (s).
pub fn cumulative(signals: &[&[f64]], interval: f64) -> (Vec<f64>, Vec<f64>) {
    let length = signals.first().map_or(0, |signal| signal.len());
    if length < 8 {
        return (Vec::new(), Vec::new());
    }
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * libm::cos(TAU * (k as f64 + 0.5) / length as f64)).collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let plan = forward(length);
    let half = length / 2;
    let mut spectrum = vec![0.0; half];
    for signal in signals {
        let (mean, slope) = line(signal);
        let middle = 0.5 * (length - 1) as f64;
        let mut buffer: Vec<Complex64> = signal
            .iter()
            .zip(&window)
            .enumerate()
            .map(|(k, (value, w))| Complex64::new((value - mean - slope * (k as f64 - middle)) * w, 0.0))
            .collect();
        plan.process(&mut buffer);
        for (sum, bin) in spectrum.iter_mut().zip(&buffer[1..]) {
            *sum += 2.0 * bin.norm_sqr() / (power * length as f64);
        }
    }
    let resolution = 1.0 / (interval * length as f64);
    let decades = libm::log10(half as f64);
    let (mut frequencies, mut roots) = (Vec::new(), Vec::new());
    let (mut sum, mut last) = (0.0, 0);
    for point in 0..=POINTS {
        let bin = libm::pow(10.0, decades * point as f64 / POINTS as f64) as usize;
        let bin = if point == POINTS || bin > half { half } else { bin };
        if bin <= last {
            continue;
        }
        sum += spectrum[last..bin].iter().sum::<f64>();
        last = bin;
        frequencies.push(bin as f64 * resolution);
        roots.push(libm::sqrt(sum));
    }
    (frequencies, roots)
}

/// Amplitude spectral density of a signal without its linear trend, per root hertz: frequencies (Hz) and values, each the mean
/// power of a band; bands are logarithmically spaced.
pub fn density(signal: &[f64], interval: f64) -> (Vec<f64>, Vec<f64>) {
    let (frequencies, roots) = cumulative(&[signal], interval);
    let (mut middle, mut values) = (Vec::new(), Vec::new());
    let (mut last, mut before) = (0.0, 0.0);
    for (frequency, root) in frequencies.iter().zip(&roots) {
        let power = (root * root - before) / (frequency - last);
        middle.push(if last > 0.0 { libm::sqrt(last * frequency) } else { *frequency });
        values.push(libm::sqrt(if power > 0.0 { power } else { 0.0 }));
        (last, before) = (*frequency, root * root);
    }
    (middle, values)
}

/// Mean and slope per sample.
fn line(signal: &[f64]) -> (f64, f64) {
    let count = signal.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = signal.iter().sum::<f64>() / count;
    let (mut product, mut spread) = (0.0, 0.0);
    for (k, value) in signal.iter().enumerate() {
        let from = k as f64 - middle;
        product += from * value;
        spread += from * from;
    }
    (mean, product / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sines_are_two_steps_of_the_right_height() {
        let interval = 1e-3;
        let signal: Vec<f64> = (0..4000)
            .map(|k| {
                let t = f64::from(k) * interval;
                2.0 * libm::sin(TAU * 10.0 * t) + 1.0 * libm::sin(TAU * 200.0 * t) + 5.0 + 3.0 * t
            })
            .collect();
        let (frequencies, roots) = cumulative(&[&signal], interval);
        let at = |hertz: f64| roots[frequencies.iter().position(|f| *f >= hertz).unwrap()];
        assert!(at(5.0) < 0.1, "{}", at(5.0));
        assert!((at(50.0) - 2.0 / 2f64.sqrt()).abs() < 0.03, "{}", at(50.0));
        assert!((roots.last().unwrap() - 2.5f64.sqrt()).abs() < 0.03);
        let (frequencies, densities) = density(&signal, interval);
        let highest = (0..densities.len()).max_by(|a, b| densities[*a].total_cmp(&densities[*b])).unwrap();
        assert!((9.0..11.0).contains(&frequencies[highest]), "{}", frequencies[highest]);
        let (_, both) = cumulative(&[&signal, &signal], interval);
        assert!((both.last().unwrap() / roots.last().unwrap() - 2f64.sqrt()).abs() < 1e-9);
    }
}
