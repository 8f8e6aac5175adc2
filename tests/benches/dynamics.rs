//! Host time of the inverse dynamics: `cargo bench -p specgen-benches --bench dynamics`. Quote ratios: machines are noisy.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};
use specgen::compile::compile;
use specgen::lower::{self, GRAVITY};
use specgen::model::Model;
use specgen_runtime::Motion;
use specgen_tests::{motions, repository};

fn main() {
    divan::main();
}

fn model() -> Model {
    compile(&repository().join("specs/reference.toml")).expect("the reference spec compiles").model
}

/// Times `compute` on every motion.
fn each(bencher: Bencher, motions: &[Motion<f64>], compute: impl Fn(&Motion<f64>) -> f64) {
    bencher.counter(ItemsCount::new(motions.len())).bench_local(|| {
        for motion in motions {
            black_box(compute(black_box(motion)));
        }
    });
}

/// h, ḣ, ḧ to six leg forces, the kernel of the controller.
#[divan::bench]
fn leg_forces(bencher: Bencher) {
    let platform = lower::platform(&model()).expect("a sound geometry");
    each(bencher, &motions(1024, 1e-3), |motion| black_box(platform.leg_forces(motion))[0]);
}

/// With displacements and a wrench, as the tick takes it.
#[divan::bench]
fn load(bencher: Bencher) {
    let platform = lower::platform(&model()).expect("a sound geometry");
    each(bencher, &motions(1024, 1e-3), |motion| black_box(platform.load(motion, black_box(Some(&[1.0; 6])))).force[0]);
}

/// The same forces as one writes them with nalgebra from the errata: M and C ḣ + G by summing over the legs, LU of Jᵀ.
#[divan::bench]
fn leg_forces_in_plain_nalgebra(bencher: Bencher) {
    let plain = Plain::new(&model());
    let kernel = lower::platform(&model()).expect("a sound geometry");
    let motions = motions(1024, 1e-3);
    for motion in &motions {
        let difference = plain.leg_forces(motion) - Vector6::from(kernel.leg_forces(motion));
        assert!(difference.norm() < 1e-10, "both compute the same");
    }
    each(bencher, &motions, |motion| black_box(plain.leg_forces(motion))[0]);
}

/// Textbook recursion.
struct Plain {
    model: Model,
    inertia: Matrix3<f64>,
    center: Vector3<f64>,
    base: [Vector3<f64>; 6],
    joints: [Vector3<f64>; 6],
}

impl Plain {
    fn new(model: &Model) -> Self {
        let [xy, xz, yz] = model.platform.products;
        let [xx, yy, zz] = model.platform.inertia;
        Self {
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            center: model.platform.center_of_mass.into(),
            base: model.geometry.base_joints.map(Vector3::from),
            joints: model.geometry.platform_joints.map(Vector3::from),
            model: model.clone(),
        }
    }

    fn leg_forces(&self, motion: &Motion<f64>) -> Vector6<f64> {
        let [x, y, z, tx, ty, tz] = motion.pose;
        let turn = Rotation3::from_euler_angles(tx, ty, tz).into_inner();
        let place = Vector3::new(x, y, self.model.geometry.height + z);
        let (sy, cy, sz, cz) = (ty.sin(), ty.cos(), tz.sin(), tz.cos());
        let rates = Matrix3::new(cy * cz, -sz, 0.0, cy * sz, cz, 0.0, -sy, 0.0, 1.0);
        let [vx, vy, vz, rx, ry, rz] = motion.rate;
        let slopes = Matrix3::new(
            -sy * cz * ry - cy * sz * rz,
            -cz * rz,
            0.0,
            -sy * sz * ry + cy * cz * rz,
            -sz * rz,
            0.0,
            -cy * ry,
            0.0,
            0.0,
        );
        let [ax, ay, az, bx, by, bz] = motion.acceleration;
        let omega = rates * Vector3::new(rx, ry, rz);
        let alpha = rates * Vector3::new(bx, by, bz) + slopes * Vector3::new(rx, ry, rz);
        let (velocity, acceleration) = (Vector3::new(vx, vy, vz), Vector3::new(ax, ay, az));
        let up = Vector3::z() * GRAVITY;

        let body = &self.model.platform;
        let center = turn * self.center;
        let lift = (acceleration + alpha.cross(&center) + omega.cross(&omega.cross(&center)) + up) * body.mass;
        let inertia = turn * self.inertia * turn.transpose();
        let mut force = lift;
        let mut torque = inertia * alpha + omega.cross(&(inertia * omega)) + center.cross(&lift);
        let mut equations = Matrix6::zeros();
        let leg = &self.model.leg;
        for i in 0..6 {
            let arm = turn * self.joints[i];
            let r = place + arm - self.base[i];
            let length = r.norm();
            let s = r / length;
            let v = velocity + omega.cross(&arm);
            let a = acceleration + alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
            let across = Matrix3::identity() - s * s.transpose();
            let reach = length - leg.extensible_center;
            let swing = leg.fixed_inertia
                + leg.extensible_inertia
                + leg.fixed_mass * leg.fixed_center * leg.fixed_center
                + leg.extensible_mass * reach * reach;
            let mass = s * s.transpose() * leg.extensible_mass + across * (swing / (length * length));
            let lengthening = s.dot(&v);
            let aside = across * v;
            let m_b = leg.extensible_mass * reach / length - swing / (length * length);
            let coriolis = (s * (leg.extensible_mass * leg.extensible_center * v.dot(&aside))
                + aside * (2.0 * length * m_b * lengthening))
                / (length * length);
            let weight = (s * s.transpose() * leg.extensible_mass
                + across * ((leg.fixed_mass * leg.fixed_center + leg.extensible_mass * reach) / length))
                * up;
            let load = mass * a + coriolis + weight;
            force += load;
            torque += arm.cross(&load);
            let moment = arm.cross(&s);
            equations.set_column(i, &Vector6::new(s.x, s.y, s.z, moment.x, moment.y, moment.z));
        }
        let wrench = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        equations.lu().solve(&wrench).expect("a sound geometry")
    }
}
