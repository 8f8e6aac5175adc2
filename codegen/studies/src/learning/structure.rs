//! Structural modes in a measured response: resonances of legs, gauge mounts and frame that the rigid platform does not have.
//!
//! ```text
//! P⁻¹ = T⁻¹ − T₀⁻¹ + P₀⁻¹           T: measured closed loop;  T₀, P₀: closed and open loop of the model, so T₀⁻¹ − P₀⁻¹ is the feedback
//! P = G (I + s D + s² W)⁻¹ R S       R: lags and sampling of P₀;  S = A⁻¹ diag(λ h) A over legs;  G = B⁻¹ diag(h) B over gauges
//! h = H of a leg mode, 1 + a r² H of a gauge mount or the frame        H = 1/(1 − r² + 2jζr),  r = f/f_n
//! ```
//! s = 2πjf. In modal coordinates of the model: W is mass, D (diagonal, 2ζ/ω) damping over stiffness; A, B: displacements of legs and
//! readings of gauges.
//! W, D, the gains λ of the legs, a dead time and a lag are fitted, too: stiffness, mass and gain of a machine are not those of its spec.
//! A mode is sought where what this fit leaves has the shape of r² H in the direction of one leg, of one gauge, or of all.

use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_identify::Parameter;
use specgen_language::model::{self as language, StructuralKind};
use specgen_numerics::complex6::sum;
use specgen_numerics::nyquist::{Complex, over, plus, square, times};

use super::convergence::Learnable;
use super::response::Bin;
use fit::{Domain, Fit, Problem, RATIO, Resonance};

pub(crate) mod fit;

/// Largest number of modes.
pub(crate) const MAX_MODES: usize = 6;
/// Least fall of χ² by a mode, in units of χ² per degree of freedom.
pub(crate) const MIN_CHI2_DROP: f64 = 60.0;
/// Largest standard error of a mode's figures relative to their values.
pub(crate) const UNCERTAIN: f64 = 1.0 / 3.0;
/// A mode of less participation disturbs no loop, and may be a trace of hysteresis.
pub(crate) const LEAST_PART: f64 = 0.03;
/// Steps of a fit.
const STEPS: usize = 30;
/// Steps of the fits from which the best is chosen.
const FIRST_STEPS: usize = 6;
/// Fall of χ² that one more parameter must bring, in units of χ² per degree of freedom.
const PER_PARAMETER: f64 = 5.0;
/// Damping ratios sought.
const RATIOS: [f64; 6] = [0.005, 0.01, 0.02, 0.04, 0.08, 0.15];
/// Half of the band around a sought mode: in damping ratios, and the least, both relative to its frequency.
const HALF_BAND: [f64; 2] = [6.0, 0.04];
/// Number of places for which a mode is fitted.
const PLACES: usize = 3;
/// Places are near if the fall of χ² of P by a mode there is at least this part of the largest.
const NEAR_BEST: f64 = 0.5;
/// The mode that a record must be able to show: damping ratios; participation of a gauge and, of all gauges, the frame.
const LEAST_SHOWN: [f64; 2] = [0.01, 0.05];
const PARTICIPATIONS: [f64; 2] = [0.5, 0.1];
/// A record shows nothing beyond this part of an unresolved frequency or of its highest one.
const SHORT_OF: f64 = 0.95;

/// What a fit leaves in one direction: frequency, Hz, relative residual, weight.
pub(crate) type Direction = Vec<(f64, Complex, f64)>;

/// Where a structural mode acts. Legs and gauges are numbered from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Location {
    /// In series with one leg.
    Leg(usize),
    /// In series with every leg.
    Legs,
    /// On the mount of one gauge.
    Gauge(usize),
    /// On the mounts of all gauges, or the frame if its participation is negative.
    Gauges,
}

/// A structural mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StructuralMode {
    /// Natural frequency, Hz.
    pub frequency: Parameter,
    /// ζ.
    pub damping: Parameter,
    /// a, 1 for a leg.
    pub participation: Parameter,
    /// Where it acts.
    pub place: Location,
}

/// What a response shows of the structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Structure {
    /// Modes, in ascending order of frequency.
    pub modes: Vec<StructuralMode>,
    /// Frequency of a resonance that is too uncertain for a mode, Hz.
    pub unresolved: Option<f64>,
    /// From the first to the second frequency (Hz) any other mode would have been found; `None` if there is no such band.
    pub band: Option<[f64; 2]>,
    /// χ² per degree of freedom.
    pub misfit: f64,
}

impl Location {
    /// Whether a mode there acts on readings; then its participation is free.
    fn on_gauges(self) -> bool {
        matches!(self, Self::Gauge(_) | Self::Gauges)
    }
}

impl Structure {
    /// `[[mode]]` tables for a spec that has the modes `listed`, with the largest participation first. A spec refuses two modes of a kind
    /// at the same place and nearly the same frequency; the second one becomes a comment.
    pub fn lines(&self, listed: &[language::StructuralMode]) -> String {
        let mut places: Vec<_> = listed.iter().map(|mode| (mode.kind, mode.place, mode.frequency)).collect();
        let mut modes = self.modes.clone();
        modes.sort_by(|a, b| b.participation.value.abs().total_cmp(&a.participation.value.abs()));
        let mut text = String::new();
        for mode in modes {
            let (place, mut lines) = (mode.written(), mode.lines());
            if places.iter().any(|other| language::StructuralMode::coincide(place, *other)) {
                lines = format!("# left out, too near another mode:\n{lines}").replace('\n', "\n# ");
            } else {
                places.push(place);
            }
            text.push_str(&format!("{lines}\n\n"));
        }
        text
    }
}

impl StructuralMode {
    /// Kind, number of leg or gauge, and frequency (Hz) in a spec, where only the frame has a negative participation.
    fn written(&self) -> (StructuralKind, Option<usize>, f64) {
        let (kind, number) = match self.place {
            Location::Leg(leg) => (StructuralKind::Leg, Some(leg)),
            Location::Legs => (StructuralKind::Leg, None),
            _ if self.participation.value < 0.0 => (StructuralKind::Frame, None),
            Location::Gauge(gauge) => (StructuralKind::Gauge, Some(gauge)),
            Location::Gauges => (StructuralKind::Gauge, None),
        };
        (kind, number, libm::round(10.0 * self.frequency.value) / 10.0)
    }

    /// `at` of a `[[mode]]`.
    pub(crate) fn at(&self) -> String {
        let (kind, number, _) = self.written();
        number.map_or(kind.word().to_owned(), |number| format!("{} {}", kind.word(), number + 1))
    }

    /// A `[[mode]]` of a spec.
    fn lines(&self) -> String {
        let Self { frequency, damping, participation, place } = self;
        let (_, number, hertz) = self.written();
        let at = self.at();
        let seen = match place {
            // A spec has no reaction in one gauge alone. In all gauges it disturbs the loop more.
            Location::Gauge(gauge) if number.is_none() => format!("  # in gauge {}", gauge + 1),
            _ => String::new(),
        };
        let mut lines = format!(
            "[[mode]]\nfrequency = \"{hertz:.1} Hz\"  # ± {:.1}\ndamping_ratio = {:.4}  # ± {:.4}\nat = \"{at}\"{seen}",
            frequency.error, damping.value, damping.error
        );
        if place.on_gauges() {
            lines.push_str(&format!("\nparticipation = {:.3}  # ± {:.3}", participation.value, participation.error));
        }
        lines
    }

    pub(crate) fn is_certain(&self) -> bool {
        let sure = |figure: &Parameter| figure.error <= UNCERTAIN * figure.value.abs();
        let physical = self.participation.value.abs() <= 1.0 && self.damping.value < 0.99 * RATIO[1];
        sure(&self.frequency) && sure(&self.damping) && sure(&self.participation) && physical
    }
}

impl Learnable {
    /// The structural modes that bins of a measured response show beyond the model. None if the geometry does not determine the pose,
    /// or if fewer bins can be used than the platform has parameters.
    pub fn structure(&self, compiled: &Compilation, bins: &[Bin]) -> Option<Structure> {
        let problem = Problem::new(self, compiled, bins)?;
        let mut fit = problem.fitted(&problem.start, Vec::new(), STEPS, Domain::Closed);
        let (mut modes, mut unresolved) = (Vec::new(), None);
        while fit.modes.len() < MAX_MODES {
            let Some(best) = problem.with_next_mode(&fit) else { break };
            if fit.cost - best.cost < MIN_CHI2_DROP * problem.misfit(&best) {
                break;
            }
            let estimates = problem.estimates(&best)?;
            if estimates.iter().any(|mode| mode.participation.value.abs() < LEAST_PART) {
                break;
            }
            if estimates.iter().any(|mode| !mode.is_certain()) {
                unresolved = best.modes.last().map(|mode| libm::exp(mode.values[0]));
                break;
            }
            (fit, modes) = (best, estimates);
        }
        modes.sort_by(|a, b| a.frequency.value.total_cmp(&b.frequency.value));
        let band = problem.band(&fit, unresolved);
        let misfit = problem.misfit(&fit);
        Some(Structure { modes, unresolved, band, misfit })
    }
}

impl Problem {
    /// A fit of T with the modes of another and the next one that P shows. `None` if P shows none.
    ///
    /// P depends on a mode more linearly, so modes are sought there, from the platform that fits T: from that of the spec, a fit of P may
    /// end in a worse minimum. T, whose noise is known, decides between near places.
    fn with_next_mode(&self, fit: &Fit) -> Option<Fit> {
        let fit = self.fitted(&fit.platform, fit.modes.clone(), STEPS, Domain::Open);
        let with = |mode| {
            let modes = fit.modes.iter().copied().chain([mode]).collect();
            self.fitted(&fit.platform, modes, FIRST_STEPS, Domain::Open)
        };
        let sought: Vec<Fit> = candidates(self.directions(&fit)).into_iter().map(with).collect();
        let fall = |next: &Fit| fit.cost - next.cost;
        let most = sought.iter().map(fall).max_by(f64::total_cmp)?;
        let shown = |next: &Fit| fall(next) >= NEAR_BEST * most && fall(next) >= MIN_CHI2_DROP * self.misfit(next);
        let closed = sought.into_iter().filter(shown).map(|next| {
            let open = self.fitted(&next.platform, next.modes, STEPS, Domain::Open);
            self.fitted(&open.platform, open.modes, STEPS, Domain::Closed)
        });
        // In series with all legs and on all gauges with a = 1 are nearly the same: the one with fewer parameters counts.
        let bound = |fit: &Fit| fit.cost + PER_PARAMETER * self.parameters(fit) as f64 * self.misfit(fit);
        closed.min_by(|a, b| bound(a).total_cmp(&bound(b)))
    }

    /// For each direction (legs, gauges, all), what the fit leaves there at each frequency, relative, with its weight.
    fn directions(&self, fit: &Fit) -> Vec<(Location, Direction)> {
        let places = (0..6).map(Location::Leg).chain((0..6).map(Location::Gauge)).chain([Location::Legs]);
        let mut all: Vec<_> = places.map(|place| (place, Vec::with_capacity(self.points.len()))).collect();
        for point in &self.points {
            let at = self.evaluated(point, fit);
            let missing = sum(&point.plant, &at.factors.plant, -1.0);
            for (place, list) in &mut all {
                let one = |index: usize| std::array::from_fn(|k| [f64::from(u8::from(k == index)), 0.0]);
                let effect = match place {
                    Location::Leg(leg) => Self::effect(&at, &at.factors, &one(*leg), &[[0.0; 2]; 6]),
                    Location::Gauge(gauge) => Self::effect(&at, &at.factors, &[[0.0; 2]; 6], &one(*gauge)),
                    Location::Legs | Location::Gauges => at.factors.plant,
                };
                let (mut product, mut weight) = ([0.0; 2], 0.0);
                for (i, j) in (0..36).map(|k| (k / 6, k % 6)) {
                    let w = point.plant_weights[i][j] * point.plant_weights[i][j];
                    let [re, im] = effect[i][j];
                    product = plus(product, times([w * re, -w * im], missing[i][j]));
                    weight += w * square(effect[i][j]);
                }
                list.push((point.hertz, product.map(|part| part / weight), weight));
            }
        }
        all
    }

    /// The band in which a mode at any place would have been found.
    fn band(&self, fit: &Fit, unresolved: Option<f64>) -> Option<[f64; 2]> {
        let misfit = self.misfit(fit);
        let directions = self.directions(fit);
        let shows = |hertz: f64| {
            directions.iter().all(|(place, list)| {
                let part = match place {
                    Location::Gauge(_) => PARTICIPATIONS[0],
                    Location::Legs | Location::Gauges => PARTICIPATIONS[1],
                    Location::Leg(_) => 1.0,
                };
                LEAST_SHOWN.iter().all(|ratio| {
                    shaped(list, hertz, *ratio)
                        .is_some_and(|(_, norm)| part * part * norm > 2.0 * MIN_CHI2_DROP * misfit)
                })
            })
        };
        let within: Vec<f64> = self.points.iter().map(|point| point.hertz).skip_while(|hertz| !shows(*hertz)).collect();
        let high = within.iter().copied().take_while(|hertz| shows(*hertz)).last()?;
        let end = self.points.last()?.hertz;
        let edge = SHORT_OF * unresolved.filter(|hertz| *hertz < end).unwrap_or(end);
        let high = if edge < high { edge } else { high };
        (high > within[0]).then_some([within[0], high])
    }
}

/// The most likely modes: of each direction the one whose shape explains most, the best [`PLACES`].
pub(crate) fn candidates(directions: Vec<(Location, Direction)>) -> Vec<Resonance> {
    let best = directions.into_iter().filter_map(|(place, list)| {
        let shapes = list.iter().flat_map(|(hertz, ..)| RATIOS.map(|ratio| (*hertz, ratio)));
        let explained = shapes.filter_map(|(hertz, ratio)| {
            let (share, norm) = shaped(&list, hertz, ratio)?;
            let part = (share[0] / norm).clamp(-1.0, 1.0);
            let values = [libm::log(hertz), libm::log(ratio), part];
            Some((square(share) / norm, Resonance { place, values }))
        });
        explained.max_by(|a, b| a.0.total_cmp(&b.0))
    });
    let mut best: Vec<_> = best.collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen = Vec::new();
    for (_, mode) in best.into_iter().take(PLACES) {
        chosen.push(mode);
        if mode.place == Location::Legs {
            chosen.push(Resonance { place: Location::Gauges, ..mode });
        }
    }
    chosen
}

/// Product of what a list holds with the shape r² H, less constant and slope over the band around `hertz`, and the shape's norm. `None` if
/// the list covers too little of the band.
fn shaped(list: &[(f64, Complex, f64)], hertz: f64, ratio: f64) -> Option<(Complex, f64)> {
    let half = libm::fmin(libm::fmax(HALF_BAND[0] * ratio, HALF_BAND[1]), 0.5);
    let first = list.partition_point(|(at, ..)| *at < hertz * (1.0 - half));
    let behind = list.partition_point(|(at, ..)| *at <= hertz * (1.0 + half));
    let part = &list[first..behind];
    // Both flanks belong to a peak.
    if part.len() < 6 || first == 0 || behind == list.len() {
        return None;
    }
    let mut shape: Vec<Complex> = part
        .iter()
        .map(|(at, ..)| {
            let r = at / hertz;
            over([r * r, 0.0], [1.0 - r * r, 2.0 * ratio * r])
        })
        .collect();
    let weight: f64 = part.iter().map(|(.., w)| w).sum();
    let centre = part.iter().map(|(at, _, w)| at * w).sum::<f64>() / weight;
    for power in 0..2 {
        let column = |at: f64| if power == 0 { 1.0 } else { at - centre };
        let norm: f64 = part.iter().map(|(at, _, w)| w * column(*at) * column(*at)).sum();
        let product = part
            .iter()
            .zip(&shape)
            .fold([0.0; 2], |sum, ((at, _, w), value)| plus(sum, value.map(|x| w * column(*at) * x / norm)));
        for ((at, ..), value) in part.iter().zip(&mut shape) {
            *value = plus(*value, product.map(|x| -x * column(*at)));
        }
    }
    let norm: f64 = part.iter().zip(&shape).map(|((.., w), value)| w * square(*value)).sum();
    let product = part
        .iter()
        .zip(&shape)
        .fold([0.0; 2], |sum, ((_, left, w), [re, im])| plus(sum, times([w * re, -w * im], *left)));
    Some((product, norm))
}

#[cfg(test)]
mod tests;
