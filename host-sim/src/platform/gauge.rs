//! Six gauges that measure the platform: exact readings at any pose.

use serde::{Deserialize, Serialize};

use super::geometry::{angles, rotation};
use super::linear::{LANES, Lane, Matrix3, Six, Three, apply, dot};

/// A gauge fixed to the base that measures along its line to a plane on the platform.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// A point of the line in {B}, m.
    #[serde(rename = "point_m")]
    pub point: Three,
    /// Unit vector of the line in {B}; the reading grows when the target moves in this direction.
    pub direction: Three,
    /// A point of the target plane in {P}, m.
    #[serde(rename = "plane_point_m")]
    pub plane_point: Three,
    /// Unit normal of the target plane in {P}.
    pub plane_normal: Three,
}

impl Probe {
    /// Distance along the line to the plane, m.
    pub(super) fn distance(&self, height: f64, pose: &Six) -> f64 {
        let turn = &rotation(angles(pose));
        let at = apply(turn, &self.plane_point);
        let normal = apply(turn, &self.plane_normal);
        let to_plane = [
            pose[0] + at[0] - self.point[0],
            pose[1] + at[1] - self.point[1],
            height + pose[2] + at[2] - self.point[2],
        ];
        dot(&to_plane, &normal) / dot(&self.direction, &normal)
    }

    /// Displacement of the target along the line since rest, m, at `pose` from rest; `height` is z of P_C at rest, m.
    pub fn reading(&self, height: f64, pose: &Six) -> f64 {
        self.distance(height, pose) - self.distance(height, &[0.0; 6])
    }
}

/// Six probes, a lane each.
#[derive(Debug, Clone)]
pub(super) struct ProbeLanes {
    point: [Lane; 3],
    direction: [Lane; 3],
    plane_point: [Lane; 3],
    plane_normal: [Lane; 3],
}

impl ProbeLanes {
    pub(super) fn of(probes: &[Probe; 6]) -> Self {
        // The idle lanes repeat the first probe, so that nothing there is undefined.
        let lanes = |of: fn(&Probe) -> Three| -> [Lane; 3] {
            std::array::from_fn(|axis| std::array::from_fn(|k| of(&probes[if k < 6 { k } else { 0 }])[axis]))
        };
        Self {
            point: lanes(|probe| probe.point),
            direction: lanes(|probe| probe.direction),
            plane_point: lanes(|probe| probe.plane_point),
            plane_normal: lanes(|probe| probe.plane_normal),
        }
    }

    /// [`Probe::distance`] of each, to the bit.
    pub(super) fn distances(&self, height: f64, pose: &Six, turn: &Matrix3) -> Six {
        let above = [pose[0], pose[1], height + pose[2]];
        let (mut along, mut facing) = ([0.0; LANES], [0.0; LANES]);
        for (axis, row) in turn.iter().enumerate() {
            let (mut at, mut normal) = ([0.0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                at[k] = (row[0] * self.plane_point[0][k] + row[1] * self.plane_point[1][k])
                    + row[2] * self.plane_point[2][k];
            }
            for k in 0..LANES {
                normal[k] = (row[0] * self.plane_normal[0][k] + row[1] * self.plane_normal[1][k])
                    + row[2] * self.plane_normal[2][k];
            }
            for k in 0..LANES {
                along[k] += ((above[axis] + at[k]) - self.point[axis][k]) * normal[k];
                facing[k] += self.direction[axis][k] * normal[k];
            }
        }
        std::array::from_fn(|k| along[k] / facing[k])
    }
}

/// Conversion of displacements to the words of a controller.
#[derive(Debug, Clone, PartialEq)]
pub enum GaugeSignal {
    /// Metres.
    Metres,
    /// Volts: the controller's calibration polynomial V → m of each gauge, lowest power first, is inverted.
    Volts([Vec<f64>; 6]),
}

impl GaugeSignal {
    /// Signal of gauge `index` at `displacement` (m).
    pub fn of(&self, index: usize, displacement: f64) -> f64 {
        match self {
            Self::Metres => displacement,
            Self::Volts(polynomials) => invert(&polynomials[index], displacement),
        }
    }
}

/// x with p(x) = `value`, by Newton steps from the straight line; p must be monotonic.
fn invert(polynomial: &[f64], value: f64) -> f64 {
    let slope_at_zero = polynomial.get(1).copied().unwrap_or(0.0);
    let mut x = (value - polynomial.first().copied().unwrap_or(0.0)) / slope_at_zero;
    for _ in 0..20 {
        let (mut p, mut slope) = (0.0, 0.0);
        for factor in polynomial.iter().rev() {
            slope = slope * x + p;
            p = p * x + factor;
        }
        x -= (p - value) / slope;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::geometry::Geometry;
    use crate::platform::parameters::PlatformParameters;

    #[test]
    fn readings_are_exact_displacements_of_the_planes() {
        let parameters = PlatformParameters::reference();
        let height = parameters.geometry().height;
        let read = |pose: Six| parameters.probes.map(|probe| probe.reading(height, &pose));
        assert_eq!(read([0.0; 6]), [0.0; 6]);
        // Shifts along the axes are read by three, two and one gauges.
        let shifted = read([1e-6, 2e-6, 3e-6, 0.0, 0.0, 0.0]);
        for (found, expected) in shifted.iter().zip([3e-6, 3e-6, 3e-6, 2e-6, 2e-6, 1e-6]) {
            assert!((found - expected).abs() < 1e-16, "{shifted:?}");
        }
        // A turn about z by θ: a y probe at x = 80 mm meets the turned plane at x tan θ; the plane goes through P_C.
        let theta = 0.02;
        let turned = read([0.0, 0.0, 0.0, 0.0, 0.0, theta]);
        assert!((turned[3] - 0.08 * libm::tan(theta)).abs() < 1e-15, "{turned:?}");
        assert!((turned[4] + 0.08 * libm::tan(theta)).abs() < 1e-15);
        assert!((turned[5] + 0.08 * libm::tan(theta)).abs() < 1e-15);
        // A turn about y: a z probe at x = 80 mm meets the plane at −x tan θ, wherever the target slid to.
        let tilted = read([0.0, 0.0, 0.0, 0.0, theta, 0.0]);
        assert!((tilted[0] + 0.08 * libm::tan(theta)).abs() < 1e-15, "{tilted:?}");
    }

    #[test]
    fn lanes_measure_what_each_probe_does() {
        let parameters = PlatformParameters::reference();
        let mut probes = parameters.probes;
        // A skew one, for terms that are zero in the others.
        let third = libm::sqrt(1.0 / 3.0);
        probes[4].plane_normal = [third, -third, third];
        probes[4].direction = [0.6, 0.0, 0.8];
        for pose in [[0.0; 6], [1e-6, -2e-6, 33e-6, 4e-4, -3e-4, 2e-4], [5e-3, 1e-3, -2e-3, 0.02, -0.03, 0.1]] {
            let found = ProbeLanes::of(&probes).distances(0.18, &pose, &rotation(angles(&pose)));
            let expected = probes.map(|probe| probe.distance(0.18, &pose));
            assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{found:?} {expected:?}");
        }
    }

    #[test]
    fn noise_of_the_pose_is_that_of_the_study() {
        // First order: pose noise is the inverse of ∂reading/∂h times 2.2 nm; the study has 2.7/1.6/1.3 nm, 22/22/19 nrad.
        let parameters = PlatformParameters::reference();
        let height = parameters.geometry().height;
        let mut slopes = [[0.0; 6]; 6];
        for axis in 0..6 {
            let (mut above, mut below) = ([0.0; 6], [0.0; 6]);
            above[axis] = 1e-6;
            below[axis] = -1e-6;
            for (row, probe) in slopes.iter_mut().zip(&parameters.probes) {
                row[axis] = (probe.reading(height, &above) - probe.reading(height, &below)) / 2e-6;
            }
        }
        let inverse = super::super::linear::inverse(&slopes);
        let noise = inverse.map(|row| 2.2 * libm::sqrt(dot(&row, &row)));
        for (found, expected) in noise.iter().zip([2.7, 1.6, 1.3, 22.0, 22.0, 19.0]) {
            assert!((found / expected - 1.0).abs() < 0.03, "{noise:?}");
        }
    }

    #[test]
    fn a_tilted_plane_is_met_where_line_and_plane_cross() {
        let geometry = Geometry::hexagonal([0.15, 0.1], [0.04, 0.04], 0.18);
        let s = libm::sqrt(0.5);
        let probe = Probe {
            point: [0.05, 0.01, 0.1],
            direction: [0.0, 0.0, 1.0],
            plane_point: [0.05, 0.0, 0.0],
            plane_normal: [s, 0.0, s],
        };
        // A plane under 45° that moves by 1 µm along −x meets a vertical line 1 µm lower.
        assert!((probe.reading(geometry.height, &[-1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]) + 1e-6).abs() < 1e-16);
    }

    #[test]
    fn volts_are_those_that_the_calibration_turns_back_into_metres() {
        let calibration = [1e-6, 5e-6, 2e-9, -3e-10];
        let signal = GaugeSignal::Volts(std::array::from_fn(|_| calibration.to_vec()));
        let volts = signal.of(3, 21.5e-6);
        let metres = ((calibration[3] * volts + calibration[2]) * volts + calibration[1]) * volts + calibration[0];
        assert!((metres - 21.5e-6).abs() < 1e-19);
        assert_eq!(GaugeSignal::Metres.of(3, 21.5e-6), 21.5e-6);
    }
}
