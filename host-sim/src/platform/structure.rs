//! A rigid platform on six flexible legs.
//!
//! ```text
//! M ḧ = J(h)ᵀ f − K_j h + Q_contact(h) + Q_cable(h) ,   f_i = k_i (d_i − Δl_i(h)) − c_i J_i(h) ḣ
//! ```
//! h counts from rest, where weight and leg forces balance; f is the change of the leg forces since then. M is that of
//! rest (over the travel of piezo legs it changes by 1e-4 and an inertial force by as much of itself; Coriolis forces are
//! smaller still), lengths and directions of the legs and the contact are those of h. The change of the weight's moments
//! with h is in the stiffness at rest. So is K_j = Σ J_iᵀ (I − s_i s_iᵀ) k_i J_i, the stiffness of the legs across their axes at the
//! platform joints. The force of the cable acts at P_C.
//!
//! Step: M, the stiffness at rest and the damping make a linear system, which is propagated exactly for free
//! displacements that change linearly over the step. What the exact forces differ from the linear ones, some 1e-4 of
//! them, is extrapolated linearly over the step. Second order; without that difference the step has no error at all.

use super::contact::{Contact, WorkPart, Wrench};
use super::geometry::{Geometry, angles, point_jacobian, rate_matrix};
use super::imperfections::{Cable, CableForce};
use super::inertia::Masses;
use super::linear::{
    Matrix6, Six, add_congruent, apply, apply_transposed, congruent, dot, exponential, generalised_eigen, inverse,
    product,
};

mod lanes;

pub(super) use lanes::StructureLanes;

/// Coordinates and rates.
const STATES: usize = 12;

/// Parameters of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureParameters {
    /// Joints.
    pub geometry: Geometry,
    /// Masses.
    pub masses: Masses,
    /// k_i: axial stiffness of each leg, N/m.
    pub stiffness: Six,
    /// c_i: axial damping of each leg, N s/m.
    pub damping: Six,
    /// Stiffness of each leg across its axis at its platform joint, N/m.
    pub transverse: Six,
}

impl StructureParameters {
    /// M at rest.
    pub fn mass_matrix(&self) -> Matrix6 {
        self.masses.mass_matrix(&self.geometry, &[0.0; 6])
    }

    /// K = Jᵀ diag(k) J at rest, in coordinates h, and that of the joints.
    pub fn stiffness_matrix(&self) -> Matrix6 {
        let axial = congruent(&self.geometry.jacobian(&[0.0; 6]), &self.stiffness);
        self.joint_stiffness().map_or(axial, |joints| sum(&axial, &joints))
    }

    /// Σ J_iᵀ (I − s_i s_iᵀ) k_i J_i of the legs' joints at rest, with the Jacobian J_i of the joint, the direction s_i of the
    /// leg and its transverse stiffness k_i; none if all are 0.
    fn joint_stiffness(&self) -> Option<Matrix6> {
        if self.transverse == [0.0; 6] {
            return None;
        }
        let mut out = [[0.0; 6]; 6];
        for (leg, stiffness) in self.transverse.iter().enumerate() {
            let along = self.geometry.rest_leg(leg);
            let square = dot(&along, &along);
            let joint = point_jacobian(self.geometry.platform_joints[leg], &rate_matrix([0.0; 3]));
            add_congruent(&mut out, &joint, &[*stiffness; 3]);
            let axial = [apply_transposed(&joint, &along)];
            add_congruent(&mut out, &axial, &[-stiffness / square]);
        }
        Some(out)
    }

    /// Undamped modes on the legs alone: angular frequencies in rising order, rad/s, and shapes as columns.
    pub fn modes(&self) -> (Six, Matrix6) {
        let (squares, shapes) = generalised_eigen(&self.stiffness_matrix(), &self.mass_matrix());
        (squares.map(libm::sqrt), shapes)
    }

    /// ∂/∂h of the imbalance of weight and static leg forces near rest, where they balance.
    fn weight_stiffness(&self) -> Matrix6 {
        // Static forces f0 with Jᵀ f0 = G at rest.
        let transposed = super::linear::transposed(&self.geometry.jacobian(&[0.0; 6]));
        let weight = self.masses.weight(&self.geometry, &[0.0; 6]).map(|x| [x]);
        let carried = super::linear::solve(&transposed, &weight).map(|[x]| x);
        let left_over = |pose: &Six| {
            let lift = apply_transposed(&self.geometry.jacobian(pose), &carried);
            let weight = self.masses.weight(&self.geometry, pose);
            [0, 1, 2, 3, 4, 5].map(|k| weight[k] - lift[k])
        };
        let mut out = [[0.0; 6]; 6];
        const STEP: f64 = 1e-5;
        for column in 0..6 {
            let (mut above, mut below) = ([0.0; 6], [0.0; 6]);
            above[column] = STEP;
            below[column] = -STEP;
            let (above, below) = (left_over(&above), left_over(&below));
            for row in 0..6 {
                out[row][column] = (above[row] - below[row]) / (2.0 * STEP);
            }
        }
        out
    }
}

fn sum(a: &Matrix6, b: &Matrix6) -> Matrix6 {
    std::array::from_fn(|row| std::array::from_fn(|column| a[row][column] + b[row][column]))
}

/// Exact step of M ḧ + C ḣ + K h = F with F linear in time. Columns, so that a step is a sum of columns.
#[derive(Debug, Clone, PartialEq)]
struct Propagator {
    from_state: [[f64; STATES]; STATES],
    from_first: [[f64; STATES]; 6],
    from_last: [[f64; STATES]; 6],
}

impl Propagator {
    fn new(mass: &Matrix6, damping: &Matrix6, stiffness: &Matrix6, step: f64) -> Self {
        let flexibility = inverse(mass);
        let (spring, damper) = (product(&flexibility, stiffness), product(&flexibility, damping));
        // d/dt [h, ḣ, F, Ḟ] with Ḟ in units of one step.
        let n = STATES + 12;
        let mut rates = vec![vec![0.0; n]; n];
        for row in 0..6 {
            rates[row][6 + row] = step;
            rates[12 + row][18 + row] = 1.0;
            for column in 0..6 {
                rates[6 + row][column] = -step * spring[row][column];
                rates[6 + row][6 + column] = -step * damper[row][column];
                rates[6 + row][12 + column] = step * flexibility[row][column];
            }
        }
        let out = exponential(&rates);
        Self {
            from_state: std::array::from_fn(|column| std::array::from_fn(|row| out[row][column])),
            from_first: std::array::from_fn(|k| {
                std::array::from_fn(|row| out[row][STATES + k] - out[row][STATES + 6 + k])
            }),
            from_last: std::array::from_fn(|k| std::array::from_fn(|row| out[row][STATES + 6 + k])),
        }
    }

    fn advance(&self, state: &[f64; STATES], first: &Six, last: &Six) -> [f64; STATES] {
        let mut out = [0.0; STATES];
        let mut add = |column: &[f64; STATES], factor: f64| {
            for row in 0..STATES {
                out[row] += column[row] * factor;
            }
        };
        for k in 0..STATES {
            add(&self.from_state[k], state[k]);
        }
        for k in 0..6 {
            add(&self.from_first[k], first[k]);
            add(&self.from_last[k], last[k]);
        }
        out
    }
}

/// See the module.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    parameters: StructureParameters,
    rest_lengths: Six,
    mass: Matrix6,
    /// At rest: J, and stiffness and damping without contact.
    jacobian: Matrix6,
    stiffness: Matrix6,
    /// Part of it that is not of the legs' axes: of the weight, and of the joints.
    beside: Matrix6,
    damping: Matrix6,
    contact: Option<Contact>,
    contact_stiffness: Matrix6,
    /// None is zero, and adds nothing.
    disturbance: Option<Wrench>,
    cable: Option<CableForce>,
    step: f64,
    propagator: Propagator,
    state: [f64; STATES],
    displacement: Six,
    /// Generalised force of the displacements, and what the exact forces differ from the linear ones.
    drive: Six,
    difference: Six,
    /// The same one step earlier, if nothing has changed since.
    earlier: Option<Six>,
}

impl Structure {
    /// At rest, without contact; `step` in s is the length of the steps that follow.
    pub fn new(parameters: StructureParameters, step: f64) -> Self {
        let mass = parameters.mass_matrix();
        let jacobian = parameters.geometry.jacobian(&[0.0; 6]);
        let weight_stiffness = parameters.weight_stiffness();
        // That of the joints is linear, as the weight's is.
        let joints = parameters.joint_stiffness();
        let axial = congruent(&jacobian, &parameters.stiffness);
        let beside = joints.map_or(weight_stiffness, |joints| sum(&weight_stiffness, &joints));
        let stiffness = sum(&axial, &beside);
        let damping = congruent(&jacobian, &parameters.damping);
        Self {
            propagator: Propagator::new(&mass, &damping, &stiffness, step),
            rest_lengths: parameters.geometry.rest_lengths(),
            parameters,
            mass,
            jacobian,
            stiffness,
            beside,
            damping,
            contact: None,
            contact_stiffness: [[0.0; 6]; 6],
            disturbance: None,
            cable: None,
            step,
            state: [0.0; STATES],
            displacement: [0.0; 6],
            drive: [0.0; 6],
            difference: [0.0; 6],
            earlier: None,
        }
    }

    /// What it is made of.
    pub fn parameters(&self) -> &StructureParameters {
        &self.parameters
    }

    /// Attaches a cable, without force at the pose zero.
    pub(super) fn attach(&mut self, cable: Cable) {
        self.cable = Some(CableForce::new(cable));
    }

    /// Length of a step, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Fixes the length of the steps that follow, s.
    pub fn set_step(&mut self, step: f64) {
        if step.to_bits() != self.step.to_bits() {
            self.step = step;
            self.propagate_anew();
        }
    }

    fn propagate_anew(&mut self) {
        let stiffness = sum(&self.stiffness, &self.contact_stiffness);
        self.propagator = Propagator::new(&self.mass, &self.damping, &stiffness, self.step);
        self.earlier = None;
    }

    /// Makes contact with a part at the present pose, unloaded.
    pub fn touch(&mut self, part: WorkPart) {
        let pose = self.pose();
        self.contact_stiffness = part.stiffness_matrix(&pose);
        self.contact = Some(Contact::at(part, &pose));
        self.propagate_anew();
        self.difference = self.force_difference();
    }

    /// Takes the part away.
    pub fn release(&mut self) {
        if self.contact.take().is_some() {
            self.contact_stiffness = [[0.0; 6]; 6];
            self.propagate_anew();
        }
        self.earlier = None;
        self.difference = self.force_difference();
    }

    /// The part in touch.
    pub fn contact(&self) -> Option<&Contact> {
        self.contact.as_ref()
    }

    /// Puts a wrench on the platform that stays as it is until it is changed.
    pub fn disturb(&mut self, wrench: &Wrench) {
        let before = self.disturbing();
        self.disturbance = (*wrench != Wrench::default()).then_some(*wrench);
        let after = self.disturbing();
        // It jumps between two steps, and what is extrapolated over them does not.
        for k in 0..6 {
            let jump = after[k] - before[k];
            self.difference[k] += jump;
            if let Some(earlier) = &mut self.earlier {
                earlier[k] += jump;
            }
        }
    }

    /// The wrench that was put on it.
    pub fn disturbance(&self) -> Wrench {
        self.disturbance.unwrap_or_default()
    }

    /// Generalised force of the disturbance.
    fn disturbing(&self) -> Six {
        self.disturbance.map_or([0.0; 6], |wrench| wrench.generalised(&rate_matrix(angles(&self.pose()))))
    }

    /// h, m and rad.
    pub fn pose(&self) -> Six {
        std::array::from_fn(|k| self.state[k])
    }

    /// ḣ, m/s and rad/s.
    pub fn rate(&self) -> Six {
        std::array::from_fn(|k| self.state[6 + k])
    }

    /// Puts the platform into another state, with the free displacements (m) as they are there.
    pub fn set_state(&mut self, pose: &Six, rate: &Six, displacement: &Six) {
        self.state = std::array::from_fn(|k| if k < 6 { pose[k] } else { rate[k - 6] });
        self.displacement = *displacement;
        self.drive = self.drive_of(displacement);
        self.earlier = None;
        self.cable_follows();
        self.difference = self.force_difference();
    }

    /// Axial forces of the legs on the platform, as a change from rest, N.
    pub fn leg_forces(&self) -> Six {
        self.forces_on_legs().0
    }

    fn forces_on_legs(&self) -> (Six, Matrix6) {
        let p = &self.parameters;
        let (extensions, jacobian) = p.geometry.extensions_and_jacobian_from(&self.rest_lengths, &self.pose());
        let speeds = apply(&jacobian, &self.rate());
        let force = std::array::from_fn(|leg| {
            p.stiffness[leg] * (self.displacement[leg] - extensions[leg]) - p.damping[leg] * speeds[leg]
        });
        (force, jacobian)
    }

    fn drive_of(&self, displacement: &Six) -> Six {
        let force: Six = std::array::from_fn(|leg| self.parameters.stiffness[leg] * displacement[leg]);
        apply_transposed(&self.jacobian, &force)
    }

    /// Exact generalised force less the linear one of the propagator in use.
    fn force_difference(&self) -> Six {
        let (pose, rate) = (self.pose(), self.rate());
        let (force, jacobian) = self.forces_on_legs();
        let exact = apply_transposed(&jacobian, &force);
        let mut linear = apply(&self.stiffness, &pose);
        let damped = apply(&self.damping, &rate);
        let beside = apply(&self.beside, &pose);
        for k in 0..6 {
            linear[k] = self.drive[k] - linear[k] - damped[k] + beside[k];
        }
        let mut out: Six = std::array::from_fn(|k| exact[k] - linear[k]);
        if let Some(contact) = &self.contact {
            let pushed = contact.wrench(&pose).generalised(&rate_matrix(angles(&pose)));
            let spring = apply(&self.contact_stiffness, &pose);
            for k in 0..6 {
                out[k] += pushed[k] + spring[k];
            }
        }
        if self.disturbance.is_some() {
            let pushed = self.disturbing();
            for k in 0..6 {
                out[k] += pushed[k];
            }
        }
        if let Some(cable) = &self.cable {
            for (out, force) in out.iter_mut().zip(cable.force()) {
                *out += force;
            }
        }
        out
    }

    fn cable_follows(&mut self) {
        let [x, y, z, ..] = self.pose();
        self.cable.iter_mut().for_each(|cable| cable.follow(&[x, y, z]));
    }

    /// One step, over which the free displacements go straight to `displacement` (m).
    pub fn advance(&mut self, displacement: &Six) {
        let drive = self.drive_of(displacement);
        let before = self.earlier.unwrap_or(self.difference);
        let first = std::array::from_fn(|k| self.drive[k] + self.difference[k]);
        let last = std::array::from_fn(|k| drive[k] + (2.0 * self.difference[k] - before[k]));
        self.state = self.propagator.advance(&self.state, &first, &last);
        self.displacement = *displacement;
        self.drive = drive;
        self.earlier = Some(self.difference);
        self.cable_follows();
        self.difference = self.force_difference();
    }
}

#[cfg(test)]
mod tests;
