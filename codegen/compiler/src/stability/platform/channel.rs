//! Structural modes that are known, in modal coordinates: parts of the plant in frequency and in time.

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::modes::ModalBasis;
use specgen_language::model::{Model, Probe, StructuralKind, StructuralMode, TaskSpace};
use specgen_numerics::nyquist::Flexure;
use specgen_numerics::{ComplexMatrix, Matrix, Matrix6, cross, dot, multiply6};

/// The `[[mode]]` of a spec, as parts of the plant; `jacobian`: ∂l/∂h.
pub(super) fn known(model: &Model, task: &TaskSpace, basis: &ModalBasis, jacobian: &Matrix6) -> Vec<StructuralChannel> {
    let one = |mode: &StructuralMode| {
        let (flexure, per_pose) = match mode.kind {
            StructuralKind::Leg => (Flexure::Series, *jacobian),
            _ => (Flexure::Sensor(mode.participation), task.probes.each_ref().map(|probe| reading(model, probe))),
        };
        let place = mode.place.and_then(|index| {
            let per_mode = multiply6(&per_pose, &basis.from_modal);
            // No effect on any number of the controller: only stability is judged by it.
            let inverse = nalgebra::Matrix6::from_fn(|i, j| per_mode[i][j]).try_inverse()?;
            Some((per_mode[index], core::array::from_fn(|mode| inverse[(mode, index)])))
        });
        StructuralChannel { flexure, frequency: TAU * mode.frequency, damping_ratio: mode.damping_ratio, place }
    };
    model.structural_modes.iter().map(one).collect()
}

/// Reading of a gauge per pose coordinate at rest: its line meets the target plane at c, and with m the normal over its component along
/// the line, it reads m·(v + ω × c).
fn reading(model: &Model, probe: &Probe) -> [f64; 6] {
    let m = probe.plane_normal.map(|part| part / dot(probe.plane_normal, probe.direction));
    let start = [probe.point[0], probe.point[1], probe.point[2] - model.geometry.height];
    let way = dot(m, core::array::from_fn(|k| probe.plane_point[k] - start[k]));
    let c: [f64; 3] = core::array::from_fn(|k| start[k] + way * probe.direction[k]);
    let turned = cross(c, m);
    [m[0], m[1], m[2], turned[0], turned[1], turned[2]]
}

/// A structural mode of the plant, in modal coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct StructuralChannel {
    /// Where it acts.
    pub flexure: Flexure,
    /// ω, rad/s.
    pub frequency: f64,
    /// ζ.
    pub damping_ratio: f64,
    /// The one leg or gauge it concerns, as a row that gives its coordinate and a column that gives its effect; none: all six.
    pub place: Option<([f64; 6], [f64; 6])>,
}

impl StructuralChannel {
    /// Whether it acts on what the gauges see, and not on the legs.
    pub fn on_readings(&self) -> bool {
        matches!(self.flexure, Flexure::Sensor(_))
    }

    /// Row and column of each of its oscillators: that of its one leg or gauge, or one for each mode of the platform.
    pub(super) fn oscillators(&self) -> Vec<([f64; 6], [f64; 6])> {
        let unit = |mode: usize| -> [f64; 6] { core::array::from_fn(|i| f64::from(u8::from(i == mode))) };
        self.place.map_or_else(|| (0..6).map(|mode| (unit(mode), unit(mode))).collect(), |place| vec![place])
    }

    /// Adds its oscillators, w and ẇ/ω each, to the rates of a plant, w from state `first` on. `signals` is what it acts on, as
    /// combinations of the states. Returns the state after its own.
    pub(super) fn add_to(&self, rates: &mut Matrix, signals: &mut [Vec<f64>; 6], first: usize) -> usize {
        let oscillators = self.oscillators();
        let count = oscillators.len();
        let given = signals.clone();
        for (k, (row, column)) in oscillators.into_iter().enumerate() {
            let (place, speed) = (first + k, first + count + k);
            let mut source = vec![0.0; given[0].len()];
            for (factor, signal) in row.iter().zip(&given) {
                source.iter_mut().zip(signal).for_each(|(sum, value)| *sum += factor * value);
            }
            rates[(place, speed)] = self.frequency;
            for (state, factor) in source.iter().enumerate() {
                rates[(speed, state)] += self.frequency * factor;
            }
            rates[(speed, place)] -= self.frequency;
            rates[(speed, speed)] -= 2.0 * self.damping_ratio * self.frequency;
            // What the mode changes: w − s, or −a (s − w − 2ζ ẇ/ω), as r² H = −s²/(s² + 2ζωs + ω²).
            let share = if let Flexure::Sensor(share) = self.flexure { -share } else { -1.0 };
            let mut change: Vec<f64> = source.iter().map(|value| share * value).collect();
            change[place] -= share;
            if self.on_readings() {
                change[speed] -= 2.0 * share * self.damping_ratio;
            }
            for (factor, signal) in column.iter().zip(signals.iter_mut()) {
                // Zero terms are skipped, so that decoupled states stay exactly decoupled.
                if *factor != 0.0 {
                    signal.iter_mut().zip(&change).for_each(|(sum, value)| *sum += factor * value);
                }
            }
        }
        first + 2 * count
    }

    /// The factor of the plant at ω, rad/s.
    pub(super) fn at(&self, frequency: f64) -> ComplexMatrix {
        let [re, im] = self.flexure.factor(frequency / self.frequency, self.damping_ratio);
        let factor = Complex::new(re, im);
        match &self.place {
            None => ComplexMatrix::from_diagonal_element(factor),
            Some((row, column)) => {
                ComplexMatrix::identity() + ComplexMatrix::from_fn(|i, j| (factor - 1.0) * column[i] * row[j])
            }
        }
    }
}
