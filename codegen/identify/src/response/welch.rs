//! Welch's averaged cross spectra.

use specgen_numerics::fft::{Complex64, forward};

/// One bin of the response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Frequency of the bin, Hz.
    pub frequency: f64,
    /// Real and imaginary part of H1, m/V.
    pub h: [f64; 2],
    /// γ², 0 to 1.
    pub coherence: f64,
    /// Sxx, arbitrary unit.
    pub drive_power: f64,
}

/// H1 of `y` against `x` at `rate` (Hz) over half-overlapped Hann segments, bins 0 to the last below half the rate.
pub(super) fn h1(x: &[f64], y: &[f64], rate: f64, segment: usize) -> Vec<Bin> {
    let half = segment / 2;
    let window: Vec<f64> =
        (0..segment).map(|k| 0.5 - 0.5 * libm::cos(std::f64::consts::TAU * k as f64 / segment as f64)).collect();
    let fft = forward(segment);
    let (mut xx, mut yy, mut xy) = (vec![0.0; half], vec![0.0; half], vec![Complex64::new(0.0, 0.0); half]);
    let mut start = 0;
    while start + segment <= x.len() {
        let spectrum = |signal: &[f64]| {
            let part = &signal[start..start + segment];
            let mean = part.iter().fold(0.0, |sum, v| sum + v) / segment as f64;
            let mut values: Vec<Complex64> =
                part.iter().zip(&window).map(|(v, w)| Complex64::new((v - mean) * w, 0.0)).collect();
            fft.process(&mut values);
            values
        };
        let (a, b) = (spectrum(x), spectrum(y));
        for k in 0..half {
            xx[k] += a[k].norm_sqr();
            yy[k] += b[k].norm_sqr();
            xy[k] += a[k].conj() * b[k];
        }
        start += half.max(1);
    }
    (0..half)
        .map(|k| {
            let power = xx[k] * yy[k];
            let (h, coherence) =
                if power > 0.0 { (xy[k] / xx[k], xy[k].norm_sqr() / power) } else { (Complex64::new(0.0, 0.0), 0.0) };
            Bin {
                frequency: k as f64 * rate / segment as f64,
                h: [h.re, h.im],
                coherence: if coherence > 1.0 { 1.0 } else { coherence },
                drive_power: xx[k],
            }
        })
        .collect()
}
