//! The dynamics against a Lagrangian of its own text: kinetic and potential energy by textbook geometry, differentiated; and by
//! the identities that follow from it.

use specgen_runtime::dynamics::Leg;
use specgen_runtime::{Motion, Platform};

use crate::common::{Matrix, Random, cross, dot, product, rotation, times, transpose, worse};

type Six = [f64; 6];
type Vector = [f64; 3];

const GRAVITY: f64 = 9.81;

/// A platform as a drawing has it.
#[derive(Clone)]
struct Machine {
    base: [Vector; 6],
    joint: [Vector; 6],
    height: f64,
    mass: f64,
    center: Vector,
    /// About the mass centre.
    inertia: Matrix,
    /// Fixed and extensible part of a leg: mass, inertia about the mass centre, mass centre from its joint.
    fixed: [f64; 3],
    extensible: [f64; 3],
}

/// Nothing symmetric; joints in planes where that is asked for.
fn machine(flat_base: bool, flat_platform: bool) -> Machine {
    let mut random = Random(77);
    let mut off = |size: f64| size * (2.0 * random.unit() - 1.0);
    let ring = |radius: f64, spread: f64, turn: f64| -> [Vector; 6] {
        std::array::from_fn(|leg| {
            let side = if leg % 2 == 0 { -spread } else { spread };
            let angle = std::f64::consts::TAU / 3.0 * (leg / 2) as f64 + turn + side;
            [radius * angle.cos(), radius * angle.sin(), 0.0]
        })
    };
    let mut scattered = |joints: [Vector; 6], flat: bool, level: f64| {
        joints.map(|[x, y, _]| [x + off(0.01), y + off(0.01), if flat { level } else { level + off(0.02) }])
    };
    Machine {
        base: scattered(ring(0.15, 0.2, 0.0), flat_base, 0.03),
        joint: scattered(ring(0.1, 0.8, 0.05), flat_platform, 0.0),
        height: 0.25,
        mass: 1.7,
        center: [0.004, -0.006, 0.02],
        inertia: [[4e-3, 3e-4, -2e-4], [3e-4, 5e-3, 4e-4], [-2e-4, 4e-4, 7e-3]],
        fixed: [0.11, 1.5e-4, 0.03],
        extensible: [0.07, 0.9e-4, 0.05],
    }
}

fn scaled(v: Vector, by: f64) -> Vector {
    v.map(|x| x * by)
}

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: Vector, b: Vector) -> Vector {
    plus(a, scaled(b, -1.0))
}

fn inner(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &Six) -> f64 {
    inner(a, a).sqrt()
}

fn along(pose: &Six, direction: &Six, step: f64) -> Six {
    std::array::from_fn(|k| pose[k] + step * direction[k])
}

fn unit(k: usize) -> Six {
    std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 })
}

impl Machine {
    fn turn(pose: &Six) -> Matrix {
        rotation([pose[3], pose[4], pose[5]])
    }

    /// Axes that the three angles turn about, {B}.
    fn axes(pose: &Six) -> Matrix {
        let about_z = rotation([0.0, 0.0, pose[5]]);
        let about_zy = product(&about_z, &rotation([0.0, pose[4], 0.0]));
        [times(&about_zy, [1.0, 0.0, 0.0]), times(&about_z, [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]]
    }

    fn omega(pose: &Six, rate: &Six) -> Vector {
        times(&transpose(&Self::axes(pose)), [rate[3], rate[4], rate[5]])
    }

    /// P_C.
    fn place(&self, pose: &Six) -> Vector {
        [pose[0], pose[1], self.height + pose[2]]
    }

    /// Length and direction of a leg, {B}.
    fn leg(&self, leg: usize, pose: &Six) -> (f64, Vector) {
        let r = minus(plus(self.place(pose), times(&Self::turn(pose), self.joint[leg])), self.base[leg]);
        let length = dot(r, r).sqrt();
        (length, scaled(r, 1.0 / length))
    }

    fn displacements(&self, pose: &Six) -> Six {
        std::array::from_fn(|leg| self.leg(leg, pose).0 - self.leg(leg, &[0.0; 6]).0)
    }

    /// ∂l/∂h of a leg: its direction, and the moment of that about the axes of the angles.
    fn jacobian(&self, pose: &Six) -> [Six; 6] {
        let axes = Self::axes(pose);
        std::array::from_fn(|leg| {
            let (_, s) = self.leg(leg, pose);
            let [a, b, c] = times(&axes, cross(times(&Self::turn(pose), self.joint[leg]), s));
            [s[0], s[1], s[2], a, b, c]
        })
    }

    fn kinetic(&self, pose: &Six, rate: &Six) -> f64 {
        let (turn, omega, v) = (Self::turn(pose), Self::omega(pose, rate), [rate[0], rate[1], rate[2]]);
        let of = |point: Vector| plus(v, cross(omega, times(&turn, point)));
        let (center, spin) = (of(self.center), times(&transpose(&turn), omega));
        let mut sum = self.mass * dot(center, center) + dot(spin, times(&self.inertia, spin));
        let ([m_s, i_s, l_s], [m_e, i_e, l_e]) = (self.fixed, self.extensible);
        for leg in 0..6 {
            let (length, s) = self.leg(leg, pose);
            let joint = of(self.joint[leg]);
            let across = minus(joint, scaled(s, dot(s, joint)));
            let swing = scaled(across, 1.0 / length);
            let outer = minus(joint, scaled(swing, l_e));
            sum += (i_s + i_e + m_s * l_s * l_s) * dot(swing, swing) + m_e * dot(outer, outer);
        }
        0.5 * sum
    }

    fn potential(&self, pose: &Six) -> f64 {
        let mut sum = self.mass * plus(self.place(pose), times(&Self::turn(pose), self.center))[2];
        for leg in 0..6 {
            let (length, s) = self.leg(leg, pose);
            sum += self.fixed[0] * plus(self.base[leg], scaled(s, self.fixed[2]))[2];
            sum += self.extensible[0] * plus(self.base[leg], scaled(s, length - self.extensible[2]))[2];
        }
        sum * GRAVITY
    }

    /// M: kinetic energy is a quadratic form of the rates, so its differences are exact.
    fn mass_matrix(&self, pose: &Six) -> [Six; 6] {
        let of = |rate: &Six| self.kinetic(pose, rate);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| of(&along(&unit(i), &unit(j), 1.0)) - of(&unit(i)) - of(&unit(j)))
        })
    }

    /// Rate of change along each coordinate.
    fn gradient(of: impl Fn(&Six) -> f64, pose: &Six) -> Six {
        let step = 1e-5;
        std::array::from_fn(|k| (of(&along(pose, &unit(k), step)) - of(&along(pose, &unit(k), -step))) / (2.0 * step))
    }

    fn gravity(&self, pose: &Six) -> Six {
        Self::gradient(|pose| self.potential(pose), pose)
    }

    /// Lagrange: Ṁ ḣ − ∂T/∂h.
    fn coriolis(&self, pose: &Six, rate: &Six) -> Six {
        let momentum = |pose: &Six| self.mass_matrix(pose).map(|row| inner(&row, rate));
        let step = 1e-5;
        let (ahead, behind) = (momentum(&along(pose, rate, step)), momentum(&along(pose, rate, -step)));
        let slope = Self::gradient(|pose| self.kinetic(pose, rate), pose);
        std::array::from_fn(|k| (ahead[k] - behind[k]) / (2.0 * step) - slope[k])
    }

    /// The equilibrium equations at a pose about the joint of leg `pole`, platform axes: column by leg.
    fn equations(&self, pose: &Six, pole: usize, reach: f64) -> [Six; 6] {
        let back = transpose(&Self::turn(pose));
        std::array::from_fn(|leg| {
            let s = times(&back, self.leg(leg, pose).1);
            let [a, b, c] = scaled(cross(minus(self.joint[leg], self.joint[pole]), s), 1.0 / reach);
            [s[0], s[1], s[2], a, b, c]
        })
    }

    fn reach(&self) -> f64 {
        dot(self.joint[0], self.joint[0]).sqrt()
    }

    /// Smallest over largest pivot of plain elimination in a fixed order.
    fn pivot_ratio(&self, pose: &Six, order: [usize; 6], rows: [usize; 6], reach: f64) -> f64 {
        let columns = self.equations(pose, order[0], reach);
        let mut m: [Six; 6] = rows.map(|row| order.map(|leg| columns[leg][row]));
        for k in 0..6 {
            for i in k + 1..6 {
                let factor = m[i][k] / m[k][k];
                m[i] = along(&m[i], &m[k], -factor);
            }
        }
        let sizes: Six = std::array::from_fn(|k| m[k][k].abs());
        let (low, high) = sizes.iter().fold((f64::MAX, 0.0), |(low, high), x| (f64::min(low, *x), f64::max(high, *x)));
        if low > 0.0 { low / high } else { 0.0 }
    }

    /// The equations, of all orders that begin with a force, that stay farthest from dividing by zero at rest.
    fn rows(&self, order: [usize; 6]) -> [usize; 6] {
        let mut best = (0.0, [0; 6]);
        let mut left: Vec<Vec<usize>> = (0..3).map(|first| vec![first]).collect();
        while let Some(chosen) = left.pop() {
            if let Ok(rows) = <[usize; 6]>::try_from(chosen.clone()) {
                let ratio = self.pivot_ratio(&[0.0; 6], order, rows, self.reach());
                best = if ratio > best.0 { (ratio, rows) } else { best };
            } else {
                left.extend((0..6).filter(|row| !chosen.contains(row)).map(|row| [&chosen[..], &[row]].concat()));
            }
        }
        best.1
    }

    /// The constants by their definitions.
    fn platform(&self, order: [usize; 6]) -> Platform<f64> {
        let flat = |joints: &[Vector; 6]| joints.iter().all(|joint| joint[2] == joints[0][2]);
        let (flat_base, flat_platform) = (flat(&self.base), flat(&self.joint));
        let level = if flat_base { self.base[0][2] } else { 0.0 };
        let pole = self.joint[order[0]];
        let ([m_s, i_s, l_s], [m_e, i_e, l_e]) = (self.fixed, self.extensible);
        let trace = self.inertia[0][0] + self.inertia[1][1] + self.inertia[2][2];
        // Point masses, and what the body has beside one at its mass centre.
        let points: Vec<(f64, Vector)> =
            self.joint.iter().map(|joint| (m_e, *joint)).chain([(self.mass, self.center)]).collect();
        let sum = |f: &dyn Fn(Vector) -> f64| points.iter().map(|(mass, at)| mass * f(*at)).sum::<f64>();
        let second: Matrix = std::array::from_fn(|i| {
            std::array::from_fn(|k| {
                let own = if i == k { 0.5 * trace } else { 0.0 } - self.inertia[i][k];
                own + sum(&|at| at[i] * (at[k] - pole[k]))
            })
        });
        Platform {
            legs: order.map(|leg| {
                let (length, s) = self.leg(leg, &[0.0; 6]);
                let [x, y, z] = self.base[leg];
                Leg {
                    base: [-x, -y, level - z],
                    joint: self.joint[leg],
                    arm: minus(self.joint[leg], pole),
                    rest: scaled(s, length),
                    length,
                    inverse_length: 1.0 / length,
                    half_inverse_square: 0.5 / (length * length),
                }
            }),
            places: std::array::from_fn(|leg| order.iter().position(|found| *found == leg).unwrap()),
            rows: self.rows(order),
            flat_base,
            flat_platform,
            base_depth: self.height - level,
            pole,
            mass: self.mass + 6.0 * m_e,
            first_moment: std::array::from_fn(|k| sum(&|at| at[k])),
            pole_moment: std::array::from_fn(|k| sum(&|at| at[k] - pole[k])),
            second_moment: second,
            extensible_moment: m_e * l_e,
            leg_inertia: i_s + i_e + m_s * l_s * l_s + m_e * l_e * l_e,
            leg_weight_moment: (m_e * l_e - m_s * l_s) * GRAVITY,
            gravity: GRAVITY,
        }
    }
}

fn single(platform: &Platform<f64>) -> Platform<f32> {
    let three = |v: Vector| v.map(|x| x as f32);
    Platform {
        legs: platform.legs.map(|leg| Leg {
            base: three(leg.base),
            joint: three(leg.joint),
            arm: three(leg.arm),
            rest: three(leg.rest),
            length: leg.length as f32,
            inverse_length: leg.inverse_length as f32,
            half_inverse_square: leg.half_inverse_square as f32,
        }),
        places: platform.places,
        rows: platform.rows,
        flat_base: platform.flat_base,
        flat_platform: platform.flat_platform,
        base_depth: platform.base_depth as f32,
        pole: three(platform.pole),
        mass: platform.mass as f32,
        first_moment: three(platform.first_moment),
        pole_moment: three(platform.pole_moment),
        second_moment: platform.second_moment.map(three),
        extensible_moment: platform.extensible_moment as f32,
        leg_inertia: platform.leg_inertia as f32,
        leg_weight_moment: platform.leg_weight_moment as f32,
        gravity: platform.gravity as f32,
    }
}

/// Machines of every kind of joints, each in an order of its own, at motions in all six coordinates.
fn everywhere(mut look: impl FnMut(&Machine, [usize; 6], &Platform<f64>, &Motion<f64>)) {
    let mut random = Random(5);
    for (flat_base, flat_platform, order) in [
        (false, false, [3, 0, 5, 1, 4, 2]),
        (true, false, [0, 1, 2, 3, 4, 5]),
        (false, true, [5, 2, 0, 4, 3, 1]),
        (true, true, [1, 4, 3, 0, 2, 5]),
    ] {
        let machine = machine(flat_base, flat_platform);
        let platform = machine.platform(order);
        for _ in 0..12 {
            let mut six = |a: f64, b: f64| -> Six {
                std::array::from_fn(|k| (if k < 3 { a } else { b }) * (2.0 * random.unit() - 1.0))
            };
            let motion = Motion { pose: six(0.01, 0.3), rate: six(0.3, 2.0), acceleration: six(5.0, 30.0) };
            look(&machine, order, &platform, &motion);
        }
    }
}

/// Largest difference as a share of `scale`.
fn apart(found: &Six, expected: &Six, scale: f64) -> f64 {
    found.iter().zip(expected).map(|(a, b)| (a - b).abs() / scale).fold(0.0, worse)
}

#[test]
fn displacements_and_jacobian_are_those_of_the_geometry() {
    everywhere(|machine, _, platform, motion| {
        let pose = &motion.pose;
        assert!(apart(&platform.displacements(pose), &machine.displacements(pose), 1.0) < 1e-15);
        let rest: Six = std::array::from_fn(|leg| machine.leg(leg, &[0.0; 6]).0);
        assert!(apart(&platform.rest_lengths(), &rest, 1.0) < 1e-16);
        for (found, expected) in platform.jacobian(pose).iter().zip(&machine.jacobian(pose)) {
            assert!(apart(found, expected, 1.0) < 1e-14, "{found:?} {expected:?}");
        }
        // And the derivative of the one is the other.
        for k in 0..6 {
            let moved = |step| platform.displacements(&along(pose, &unit(k), step));
            let (ahead, behind) = (moved(1e-5), moved(-1e-5));
            for (leg, row) in platform.jacobian(pose).iter().enumerate() {
                assert!(((ahead[leg] - behind[leg]) / 2e-5 - row[k]).abs() < 1e-9, "leg {leg}, coordinate {k}");
            }
        }
    });
}

#[test]
fn mass_coriolis_and_gravity_are_those_of_lagrange() {
    everywhere(|machine, _, platform, motion| {
        let Motion { pose, rate, acceleration } = motion;
        let (mass, expected) = (platform.mass_matrix(pose), machine.mass_matrix(pose));
        for (found, expected) in mass.iter().zip(&expected) {
            assert!(apart(found, expected, 1e-3) < 1e-11, "{found:?} {expected:?}");
        }
        let coriolis = machine.coriolis(pose, rate);
        let found = platform.coriolis(pose, rate);
        assert!(apart(&found, &coriolis, norm(&coriolis)) < 1e-7, "{found:?} {coriolis:?}");
        let gravity = machine.gravity(pose);
        let found = platform.gravity(pose);
        assert!(apart(&found, &gravity, norm(&gravity)) < 1e-8, "{found:?} {gravity:?}");
        // All of them at once, and half of the weight.
        let all: Six = std::array::from_fn(|k| inner(&expected[k], acceleration) + coriolis[k] + 0.5 * gravity[k]);
        let found = platform.generalised_force(motion, 0.5);
        assert!(apart(&found, &all, norm(&all)) < 1e-7, "{found:?} {all:?}");
    });
}

/// (3), by virtual work: Jᵀ f is the generalised force.
#[test]
fn leg_forces_do_the_work_of_the_generalised_force_less_that_of_a_wrench() {
    let wrench = [3.0, -5.0, 7.0, 0.2, -0.4, 0.6];
    everywhere(|machine, _, platform, motion| {
        let jacobian = machine.jacobian(&motion.pose);
        let work =
            |force: &Six| -> Six { std::array::from_fn(|k| (0..6).map(|leg| jacobian[leg][k] * force[leg]).sum()) };
        let expected = platform.generalised_force(motion, 1.0);
        let force = platform.leg_forces(motion);
        assert!(apart(&work(&force), &expected, norm(&expected)) < 1e-12);
        let free = platform.load(motion, None);
        assert_eq!(free.displacement, platform.displacements(&motion.pose));
        assert!(apart(&free.force, &force, norm(&force)) < 1e-15);
        let loaded = platform.load(motion, Some(&wrench));
        assert_eq!(loaded.displacement, free.displacement);
        let [a, b, c] = times(&Machine::axes(&motion.pose), [wrench[3], wrench[4], wrench[5]]);
        let taken = work(&along(&force, &loaded.force, -1.0));
        assert!(apart(&taken, &[3.0, -5.0, 7.0, a, b, c], 1.0) < 1e-11, "{taken:?}");
    });
}

/// The mass matrix is symmetric and positive definite, and Ṁ − 2 C does no work.
#[test]
fn no_motion_has_negative_energy_and_the_coriolis_force_does_no_work_but_what_changes_the_mass() {
    everywhere(|_, _, platform, motion| {
        let Motion { pose, rate, .. } = motion;
        let mass = platform.mass_matrix(pose);
        let mut rest = mass;
        for k in 0..6 {
            for j in 0..6 {
                assert!((mass[k][j] - mass[j][k]).abs() < 1e-14 * mass[k][k].max(mass[j][j]));
            }
            assert!(rest[k][k] > 0.0, "pivot {k} of the mass matrix");
            for i in k + 1..6 {
                rest[i] = along(&rest[i], &rest[k], -rest[i][k] / rest[k][k]);
            }
        }
        let energy = |pose: &Six| inner(rate, &platform.mass_matrix(pose).map(|row| inner(&row, rate)));
        let drift = (energy(&along(pose, rate, 1e-5)) - energy(&along(pose, rate, -1e-5))) / 2e-5;
        let work = 2.0 * inner(rate, &platform.coriolis(pose, rate));
        assert!((drift - work).abs() < 1e-7 * norm(rate) * norm(&platform.coriolis(pose, rate)), "{drift} {work}");
    });
}

/// Where the origin of {B} lies does not matter, nor which leg is eliminated first.
#[test]
fn neither_origin_nor_order_changes_a_force() {
    everywhere(|machine, _, platform, motion| {
        let mut lifted = machine.clone();
        lifted.base = machine.base.map(|[x, y, z]| [x, y, z - 0.04]);
        lifted.height -= 0.04;
        let force = platform.leg_forces(motion);
        for other in [lifted.platform([2, 5, 1, 0, 4, 3]), lifted.platform([4, 1, 2, 3, 5, 0])] {
            assert!(apart(&other.leg_forces(motion), &force, norm(&force)) < 1e-11);
            assert!(apart(&other.displacements(&motion.pose), &platform.displacements(&motion.pose), 1.0) < 1e-15);
        }
    });
}

#[test]
fn the_pivot_ratio_is_that_of_plain_elimination_and_zero_where_the_legs_do_not_hold() {
    everywhere(|machine, order, platform, motion| {
        for reach in [machine.reach(), 1.0] {
            let expected = machine.pivot_ratio(&motion.pose, order, platform.rows, reach);
            let found = platform.pivot_ratio(&motion.pose, reach);
            assert!((found - expected).abs() < 1e-12 && expected > 1e-3, "{found} {expected}");
        }
    });
    // Six upright legs hold nothing that slides.
    let mut upright = machine(true, true);
    let rows = upright.rows([0, 1, 2, 3, 4, 5]);
    upright.base = upright.joint;
    let mut platform = upright.platform([0, 1, 2, 3, 4, 5]);
    platform.rows = rows;
    assert_eq!(platform.pivot_ratio(&[0.0; 6], upright.reach()), 0.0);
}

#[test]
fn single_precision_is_the_same_to_its_last_bits() {
    everywhere(|_, _, platform, motion| {
        let few = |six: &Six| six.map(|x| x as f32);
        let single = single(platform);
        let Motion { pose, rate, acceleration } = motion;
        let motion32 = Motion { pose: few(pose), rate: few(rate), acceleration: few(acceleration) };
        let exact = platform.leg_forces(motion);
        assert!(apart(&single.leg_forces(&motion32).map(f64::from), &exact, norm(&exact)) < 2e-6);
        let load = single.load(&motion32, None);
        assert_eq!(load.displacement, single.displacements(&motion32.pose));
        assert!(apart(&load.force.map(f64::from), &exact, norm(&exact)) < 2e-6);
        // Micrometres to less than 50 pm: nothing is lost to the length of the leg.
        let small = pose.map(|x| (x * 2e-3) as f32);
        let expected = platform.displacements(&small.map(f64::from));
        assert!(apart(&single.displacements(&small).map(f64::from), &expected, 1.0) < 0.05e-9);
    });
}
