//! Eigenvalues of an open loop of six modes at many frequencies, and the structural modes that they place on the border of stability.

use nalgebra::{Complex, DMatrix, Matrix6};

use crate::nyquist::Flexure;

/// A 6×6 matrix of complex numbers.
pub type ComplexMatrix = Matrix6<Complex<f64>>;

/// a b. It is here, and not in the compiler, because this crate is optimised for speed.
pub fn product(a: &ComplexMatrix, b: &ComplexMatrix) -> ComplexMatrix {
    a * b
}

/// Eigenvalues of an open loop, each with its frequency in Hz.
#[derive(Debug, Clone, Default)]
pub struct Loci(Vec<(f64, Complex<f64>)>);

impl Loci {
    /// Adds the eigenvalues of `plant`·`controller` at a frequency, times each of `ratios`.
    pub fn include(&mut self, frequency: f64, plant: &ComplexMatrix, controller: &ComplexMatrix, ratios: &[f64]) {
        for value in complex_eigenvalues(&(plant * controller)) {
            self.0.extend(ratios.iter().map(|ratio| (frequency, value * *ratio)));
        }
    }

    /// f_n and ζ of each structural mode on the border of stability that needs damping.
    fn demands(&self, flexure: Flexure) -> impl Iterator<Item = [f64; 2]> {
        self.0.iter().filter_map(move |(frequency, value)| {
            let value = [value.re, value.im];
            if !flexure.may_exceed(value, [0.0; 2], [0.0; 2]) {
                return None;
            }
            let [ratio, damping] = flexure.border(value, [0.0; 2])?;
            (damping > 0.0).then_some([ratio * frequency, damping])
        })
    }

    /// Of the modes from one frequency to another (Hz), the one that needs the most damping: its frequency, Hz, and ζ.
    pub fn demanded(&self, flexure: Flexure, [from, to]: [f64; 2]) -> [f64; 2] {
        let inside = self.demands(flexure).filter(|[frequency, _]| (from..=to).contains(frequency));
        inside.fold([from, 0.0], |most, one| if one[1] > most[1] { one } else { most })
    }

    /// The most damping that a mode needs from each of `frequencies` (Hz, ascending) to the next; zero where every damping is enough.
    pub fn border(&self, flexure: Flexure, frequencies: &[f64]) -> Vec<f64> {
        let mut border = vec![0.0; frequencies.len()];
        for [frequency, damping] in self.demands(flexure) {
            let above = frequencies.partition_point(|one| *one <= frequency);
            if let Some(ratio) = above.checked_sub(1).and_then(|bin| border.get_mut(bin))
                && damping > *ratio
            {
                *ratio = damping;
            }
        }
        border
    }
}

/// Eigenvalues of a matrix. Modes that are not coupled keep their own.
pub fn complex_eigenvalues(matrix: &ComplexMatrix) -> [Complex<f64>; 6] {
    let mut found = [Complex::new(0.0, 0.0); 6];
    let mut done = [false; 6];
    for first in 0..6 {
        if done[first] {
            continue;
        }
        let (mut block, mut size, mut next) = ([first; 6], 1, 0);
        while next < size {
            let row = block[next];
            for column in 0..6 {
                let coupled =
                    matrix[(row, column)] != Complex::new(0.0, 0.0) || matrix[(column, row)] != Complex::new(0.0, 0.0);
                if coupled && !block[..size].contains(&column) {
                    block[size] = column;
                    size += 1;
                }
            }
            next += 1;
        }
        let block = &block[..size];
        block.iter().for_each(|&mode| done[mode] = true);
        let at = |i: usize, j: usize| matrix[(block[i], block[j])];
        match block {
            [_] => found[first] = at(0, 0),
            [_, other] => {
                let (half, product) = ((at(0, 0) + at(1, 1)) * 0.5, at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0));
                let root = root(half * half - product);
                (found[first], found[*other]) = (half + root, half - root);
            }
            _ => {
                let values = DMatrix::from_fn(size, size, at).schur().eigenvalues();
                for (mode, value) in block.iter().zip(values.iter().flat_map(|values| values.iter())) {
                    found[*mode] = *value;
                }
            }
        }
    }
    found
}

/// The root with a real part that is not negative.
fn root(value: Complex<f64>) -> Complex<f64> {
    let size = libm::sqrt(libm::hypot(value.re, value.im));
    let half = 0.5 * libm::atan2(value.im, value.re);
    Complex::new(size * libm::cos(half), size * libm::sin(half))
}
