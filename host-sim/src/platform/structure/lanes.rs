//! The structure of [`Structure`], without contact, in one step per control interval: legs in lanes.
//!
//! Behind amplifiers that hold their inputs a free displacement goes, over one interval, along the exponential of its
//! amplifier's lag and not along a straight line. Here each leg has that shape, so that an interval of 100 µs is one exact
//! step of the linear part; what the exact forces differ is extrapolated over it as ever.

use super::{STATES, Structure};
use crate::plant::lanes::{LANES, Lane};
use crate::platform::linear::{Matrix6, Six, exponential, inverse, product};

type Column = [f64; STATES];

#[derive(Debug, Clone, PartialEq)]
pub(in crate::platform) struct StructureLanes {
    from_state: [Column; STATES],
    /// Of a leg's displacement held at 1 m; of its way to 1 m along its lag, and straight.
    from_held: [Column; 6],
    from_lagged: [Column; 6],
    from_straight: [Column; 6],
    /// Of a generalised force at the beginning of a step and its way to the end.
    from_force: [Column; 6],
    from_force_change: [Column; 6],
    /// Vectors of the legs at rest, joints in {P}, lengths.
    rest: [Lane; 3],
    joint: [Lane; 3],
    rest_square: Lane,
    rest_length: Lane,
    stiffness: Lane,
    damping: Lane,
    /// Columns of J at rest.
    jacobian: [Lane; 6],
    state: Column,
    displacement: Lane,
    difference: Six,
    before: Six,
}

fn lane(of: impl Fn(usize) -> f64) -> Lane {
    // The idle lanes repeat the first leg, so that nothing there is undefined; their stiffness is zero.
    std::array::from_fn(|leg| of(if leg < 6 { leg } else { 0 }))
}

impl StructureLanes {
    /// The structure as it is, for steps of `step` (s); `lag` of each leg's amplifier, s.
    pub(in crate::platform) fn of(structure: &Structure, step: f64, lag: &Six) -> Self {
        let parameters = &structure.parameters;
        let geometry = &parameters.geometry;
        let flexibility = inverse(&structure.mass);
        let forces: Matrix6 = std::array::from_fn(|axis| {
            std::array::from_fn(|leg| structure.jacobian[leg][axis] * parameters.stiffness[leg])
        });
        let driven = product(&flexibility, &forces);
        let (spring, damper) = (product(&flexibility, &structure.stiffness), product(&flexibility, &structure.damping));
        // [h, ḣ] and per column of inputs a pair [u, u̇] with u̇ held, or one decaying input, in units of one step.
        let respond = |input: &Matrix6, decay: Option<&Six>| {
            let n = STATES + 12;
            let mut rates = vec![vec![0.0; n]; n];
            for row in 0..6 {
                rates[row][6 + row] = step;
                for column in 0..6 {
                    rates[6 + row][column] = -step * spring[row][column];
                    rates[6 + row][6 + column] = -step * damper[row][column];
                    rates[6 + row][12 + column] = step * input[row][column];
                }
                match decay {
                    Some(per_step) => rates[12 + row][12 + row] = -per_step[row],
                    None => rates[12 + row][18 + row] = 1.0,
                }
            }
            exponential(&rates)
        };
        let column = |out: &[Vec<f64>], k: usize| -> Column { std::array::from_fn(|row| out[row][k]) };
        let columns =
            |out: &[Vec<f64>], first: usize| -> [Column; 6] { std::array::from_fn(|k| column(out, first + k)) };
        let by_force = respond(&flexibility, None);
        let by_leg = respond(&driven, None);
        // Faster than a ten-thousandth of the step is at once.
        let decays = lag.map(|lag| if lag * 1e4 > step { step / lag } else { 0.0 });
        let decaying = respond(&driven, Some(&decays));
        let from_held = columns(&by_leg, STATES);
        let from_lagged = std::array::from_fn(|leg| {
            if decays[leg] == 0.0 {
                return from_held[leg];
            }
            let reached = -libm::expm1(-decays[leg]);
            std::array::from_fn(|row| (from_held[leg][row] - decaying[row][STATES + leg]) / reached)
        });
        let rest: [Lane; 3] = std::array::from_fn(|k| lane(|leg| geometry.rest_leg(leg)[k]));
        let mut out = Self {
            from_state: std::array::from_fn(|k| column(&by_force, k)),
            from_held,
            from_lagged,
            from_straight: columns(&by_leg, STATES + 6),
            from_force: columns(&by_force, STATES),
            from_force_change: columns(&by_force, STATES + 6),
            rest,
            joint: std::array::from_fn(|k| lane(|leg| geometry.platform_joints[leg][k])),
            rest_square: std::array::from_fn(|k| {
                rest[0][k] * rest[0][k] + rest[1][k] * rest[1][k] + rest[2][k] * rest[2][k]
            }),
            rest_length: lane(|leg| structure.rest_lengths[leg]),
            stiffness: std::array::from_fn(|leg| if leg < 6 { parameters.stiffness[leg] } else { 0.0 }),
            damping: std::array::from_fn(|leg| if leg < 6 { parameters.damping[leg] } else { 0.0 }),
            jacobian: std::array::from_fn(|axis| lane(|leg| structure.jacobian[leg][axis])),
            state: structure.state,
            displacement: lane(|leg| structure.displacement[leg]),
            difference: [0.0; 6],
            before: [0.0; 6],
        };
        out.difference = out.force_difference();
        out.before = out.difference;
        out
    }

    /// h, m and rad.
    pub(in crate::platform) fn pose(&self) -> Six {
        std::array::from_fn(|k| self.state[k])
    }

    /// ḣ, m/s and rad/s.
    pub(in crate::platform) fn rate(&self) -> Six {
        std::array::from_fn(|k| self.state[6 + k])
    }

    /// Free displacement of a leg, m.
    pub(in crate::platform) fn displacement(&self, leg: usize) -> f64 {
        self.displacement[leg]
    }

    /// One step to the free displacements `displacement` (m), each along its lag, or straight where `straight` says so.
    #[inline(always)]
    pub(in crate::platform) fn advance(&mut self, displacement: &Lane, straight: Option<&[bool; LANES]>) {
        let mut of_state = [0.0; STATES];
        let mut of_legs = [0.0; STATES];
        let mut of_forces = [0.0; STATES];
        for k in 0..STATES {
            for row in 0..STATES {
                of_state[row] += self.from_state[k][row] * self.state[k];
            }
        }
        for leg in 0..6 {
            let way = displacement[leg] - self.displacement[leg];
            let shape = match straight {
                Some(flags) if flags[leg] => &self.from_straight[leg],
                _ => &self.from_lagged[leg],
            };
            for row in 0..STATES {
                of_legs[row] += self.from_held[leg][row] * self.displacement[leg] + shape[row] * way;
            }
        }
        for k in 0..6 {
            let change = self.difference[k] - self.before[k];
            for row in 0..STATES {
                of_forces[row] +=
                    self.from_force[k][row] * self.difference[k] + self.from_force_change[k][row] * change;
            }
        }
        for row in 0..STATES {
            self.state[row] = of_state[row] + (of_legs[row] + of_forces[row]);
        }
        self.displacement = *displacement;
        self.before = self.difference;
        self.difference = self.force_difference();
    }

    /// Jᵀ f at h with the exact extensions, less J₀ᵀ f₀ with the linear ones.
    #[inline(always)]
    fn force_difference(&self) -> Six {
        let [x, y, z, tx, ty, tz, ..] = self.state;
        let (turn, rates) = crate::platform::geometry::attitude([tx, ty, tz]);
        let mut jacobian = [[0.0; LANES]; 6];
        let mut force = [0.0; LANES];
        let mut linear = [0.0; LANES];
        for k in 0..LANES {
            let p = [self.joint[0][k], self.joint[1][k], self.joint[2][k]];
            let arm = [
                turn[0][0] * p[0] + turn[0][1] * p[1] + turn[0][2] * p[2],
                turn[1][0] * p[0] + turn[1][1] * p[1] + turn[1][2] * p[2],
                turn[2][0] * p[0] + turn[2][1] * p[1] + turn[2][2] * p[2],
            ];
            let shift = [x + (arm[0] - p[0]), y + (arm[1] - p[1]), z + (arm[2] - p[2])];
            let rest = [self.rest[0][k], self.rest[1][k], self.rest[2][k]];
            let along = rest[0] * shift[0] + rest[1] * shift[1] + rest[2] * shift[2];
            let growth = 2.0 * along + (shift[0] * shift[0] + shift[1] * shift[1] + shift[2] * shift[2]);
            let length = (self.rest_square[k] + growth).sqrt();
            let extension = growth / (length + self.rest_length[k]);
            let inverse = 1.0 / length;
            let direction =
                [(rest[0] + shift[0]) * inverse, (rest[1] + shift[1]) * inverse, (rest[2] + shift[2]) * inverse];
            let moment = [
                arm[1] * direction[2] - arm[2] * direction[1],
                arm[2] * direction[0] - arm[0] * direction[2],
                arm[0] * direction[1] - arm[1] * direction[0],
            ];
            let mut speed = 0.0;
            let (mut rest_way, mut rest_speed) = (0.0, 0.0);
            for axis in 0..3 {
                jacobian[axis][k] = direction[axis];
                jacobian[3 + axis][k] =
                    moment[0] * rates[0][axis] + moment[1] * rates[1][axis] + moment[2] * rates[2][axis];
            }
            for axis in 0..6 {
                speed += jacobian[axis][k] * self.state[6 + axis];
                rest_way += self.jacobian[axis][k] * self.state[axis];
                rest_speed += self.jacobian[axis][k] * self.state[6 + axis];
            }
            force[k] = self.stiffness[k] * (self.displacement[k] - extension) - self.damping[k] * speed;
            linear[k] = self.stiffness[k] * (self.displacement[k] - rest_way) - self.damping[k] * rest_speed;
        }
        let mut out = [0.0; 6];
        for axis in 0..6 {
            let mut part = [0.0; LANES];
            for k in 0..LANES {
                part[k] = jacobian[axis][k] * force[k] - self.jacobian[axis][k] * linear[k];
            }
            out[axis] = ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]));
        }
        out
    }

    /// Puts the state back.
    pub(in crate::platform) fn put(&self, structure: &mut Structure) {
        let displacement: Six = std::array::from_fn(|leg| self.displacement[leg]);
        structure.set_state(&self.pose(), &self.rate(), &displacement);
    }
}

/// Check of the linear part: what the exact forces differ at rest is nothing.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::LegParameters;
    use crate::platform::{PlatformParameters, Specimen};

    #[test]
    fn the_difference_is_that_of_the_structure_of_small_steps() {
        let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
        let mut structure = Structure::new(specimen.structure(), 1e-4);
        let pose = [11e-6, -7e-6, 23e-6, 90e-6, -70e-6, 200e-6];
        structure.set_state(&pose, &[1e-3, -2e-3, 5e-4, 0.01, 0.02, -0.03], &[3e-6, 8e-6, 1e-5, 2e-5, 4e-6, 9e-6]);
        let lanes = StructureLanes::of(&structure, 1e-4, &[0.35e-3; 6]);
        let largest = structure.difference.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for (found, expected) in lanes.difference.iter().zip(&structure.difference) {
            assert!(
                (found - expected).abs() < 1e-9 * largest.max(1.0),
                "{:?} {:?}",
                lanes.difference,
                structure.difference
            );
        }
        assert!(largest > 1e-3, "{largest}");
    }
}
