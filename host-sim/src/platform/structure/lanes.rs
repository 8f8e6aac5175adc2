//! The structure of [`Structure`] in steps of a control interval: legs in lanes.
//!
//! Behind amplifiers that hold their inputs a free displacement goes, over one step, along the exponential of its
//! amplifier's lag and not along a straight line. Here each leg has that shape, and by how much it is off that on the way as
//! a mean and a first moment ([`StepShape`]): those of 6 s (1 − s) and 120 s (1 − s) (s − 1/2), the response to which is exact.
//! What the exact forces differ from the linear ones is extrapolated over the step as ever.

use super::{STATES, Structure, sum};
use crate::plant::StepShape;
use crate::platform::contact::Contact;
use crate::platform::geometry::{angles, attitude, rate_matrix};
use crate::platform::linear::{LANES, Lane, Matrix6, Six, apply, exponential, inverse, product};

type Column = [f64; STATES];

#[derive(Debug, Clone, PartialEq)]
pub(in crate::platform) struct StructureLanes {
    from_state: [Column; STATES],
    /// Of a leg's displacement held at 1 m; of its way to 1 m along its lag; of being off that by 1 m on average, and by 1 m as
    /// the first moment.
    from_held: [Column; 6],
    from_lagged: [Column; 6],
    from_mean: [Column; 6],
    from_skew: [Column; 6],
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
    /// A contact, with its stiffness in coordinates h.
    contact: Option<(Contact, Matrix6)>,
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
    /// Copies the structure, for steps of `step` (s); `lag` of each leg's amplifier, s. None if there is a disturbance or a cable.
    pub(in crate::platform) fn of(structure: &Structure, step: f64, lag: &Lane) -> Option<Self> {
        if structure.disturbance.is_some() || structure.cable.is_some() {
            return None;
        }
        let parameters = &structure.parameters;
        let geometry = &parameters.geometry;
        let flexibility = inverse(&structure.mass);
        let forces: Matrix6 = std::array::from_fn(|axis| {
            std::array::from_fn(|leg| structure.jacobian[leg][axis] * parameters.stiffness[leg])
        });
        let driven = product(&flexibility, &forces);
        let stiffness = sum(&structure.stiffness, &structure.contact_stiffness);
        let (spring, damper) = (product(&flexibility, &stiffness), product(&flexibility, &structure.damping));
        // [h, ḣ] and per column of inputs u with its first `order` derivatives, the last one held; or u alone, decaying. In
        // units of one step.
        let respond = |input: &Matrix6, order: usize, decay: &Six| {
            let n = STATES + 6 * (order + 1);
            let mut rates = vec![vec![0.0; n]; n];
            for row in 0..6 {
                rates[row][6 + row] = step;
                for column in 0..6 {
                    rates[6 + row][column] = -step * spring[row][column];
                    rates[6 + row][6 + column] = -step * damper[row][column];
                    rates[6 + row][12 + column] = step * input[row][column];
                }
                for below in 0..order {
                    rates[12 + 6 * below + row][18 + 6 * below + row] = 1.0;
                }
                rates[12 + row][12 + row] = -decay[row];
            }
            exponential(&rates)
        };
        let column = |out: &[Vec<f64>], k: usize| -> Column { std::array::from_fn(|row| out[row][k]) };
        let columns =
            |out: &[Vec<f64>], first: usize| -> [Column; 6] { std::array::from_fn(|k| column(out, first + k)) };
        let by_force = respond(&flexibility, 1, &[0.0; 6]);
        let by_leg = respond(&driven, 3, &[0.0; 6]);
        // Of s, s²/2 and s³/6.
        let powers = |factors: [f64; 3]| -> [Column; 6] {
            std::array::from_fn(|leg| {
                std::array::from_fn(|row| (0..3).map(|k| factors[k] * by_leg[row][STATES + 6 * (k + 1) + leg]).sum())
            })
        };
        // Faster than a ten-thousandth of the step is at once.
        let decays = std::array::from_fn(|leg| if lag[leg] * 1e4 > step { step / lag[leg] } else { 0.0 });
        let decaying = respond(&driven, 0, &decays);
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
            from_mean: powers([6.0, -12.0, 0.0]),
            from_skew: powers([-60.0, 360.0, -720.0]),
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
            contact: structure.contact.map(|contact| (contact, structure.contact_stiffness)),
            state: structure.state,
            displacement: lane(|leg| structure.displacement[leg]),
            difference: [0.0; 6],
            before: [0.0; 6],
        };
        out.difference = out.force_difference();
        out.before = out.difference;
        Some(out)
    }

    /// h, m and rad.
    pub(in crate::platform) fn pose(&self) -> Six {
        std::array::from_fn(|k| self.state[k])
    }

    /// ḣ, m/s and rad/s.
    pub(in crate::platform) fn rate(&self) -> Six {
        std::array::from_fn(|k| self.state[6 + k])
    }

    /// One step, over which the free displacements go along `free` (m).
    #[inline(always)]
    pub(in crate::platform) fn advance(&mut self, free: &StepShape<LANES>) {
        let mut of_state = [0.0; STATES];
        let mut of_legs = [0.0; STATES];
        let mut of_forces = [0.0; STATES];
        for k in 0..STATES {
            for row in 0..STATES {
                of_state[row] += self.from_state[k][row] * self.state[k];
            }
        }
        for leg in 0..6 {
            let way = free.end[leg] - self.displacement[leg];
            for row in 0..STATES {
                of_legs[row] += (self.from_held[leg][row] * self.displacement[leg] + self.from_lagged[leg][row] * way)
                    + (self.from_mean[leg][row] * free.mean[leg] + self.from_skew[leg][row] * free.skew[leg]);
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
        self.displacement = free.end;
        self.before = self.difference;
        self.difference = self.force_difference();
    }

    /// Jᵀ f at h with the exact extensions, less J₀ᵀ f₀ with the linear ones; the same of a part in touch.
    #[inline(always)]
    fn force_difference(&self) -> Six {
        let [x, y, z, tx, ty, tz, ..] = self.state;
        let (turn, rates) = attitude([tx, ty, tz]);
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
        if let Some((contact, stiffness)) = &self.contact {
            let pose = self.pose();
            let pushed = contact.wrench(&pose).generalised(&rate_matrix(angles(&pose)));
            let spring = apply(stiffness, &pose);
            for k in 0..6 {
                out[k] += pushed[k] + spring[k];
            }
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
        let lanes = StructureLanes::of(&structure, 1e-4, &[0.35e-3; LANES]).unwrap();
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
