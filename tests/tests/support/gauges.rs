//! Platforms with gauges, as models: layouts that no spec file needs to hold.

use std::marker::PhantomData;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::compile::compile;
use specgen::diagnostic::Diagnostic;
use specgen::everett::EverettTable;
use specgen::ir::scalar::{Numbers as _, Rounding};
use specgen::ir::{Ir, Sensing, constants};
use specgen::lower::{self, Origin};
use specgen::model::{Model, Probe, Scalar, SetpointRules, TaskSpace};
use specgen::spec::{self, SpecSource};
use specgen::stability::platform::{self, RestDynamics};
use specgen_runtime::{Gauges, Legs, Real, Series};
use specgen_tests::repository;

pub const HEIGHT: f64 = 0.18;

/// The leg study's platform seen by gauges of ±70 µm.
pub fn model(probes: [Probe; 6]) -> Model {
    let mut model = compile(&repository().join("specs/legs.toml")).unwrap().model;
    assert_eq!(model.geometry.height, HEIGHT);
    model.sensor.range = [-70e-6, 70e-6];
    model.workspace.rotation = [0.6e-3; 3];
    let reference = SpecSource::read(&repository().join("specs/reference.toml")).unwrap();
    let task = spec::load(&reference).0.unwrap().task_space.unwrap();
    model.task_space = Some(TaskSpace {
        probes,
        velocity_cutoff: 2000.0,
        lead: Some(0.0),
        transfer_time: 0.1,
        setpoint: SetpointRules {
            bias: [0.0; 6],
            speed: [1e-3; 6],
            acceleration: [1.0; 6],
            jerk: [1e3; 6],
            stream_speed: [1.0; 6],
            ..task.setpoint
        },
        trajectories: Vec::new(),
        ..task
    });
    model
}

pub fn task(model: &mut Model) -> &mut TaskSpace {
    model.task_space.as_mut().unwrap()
}

/// A smooth table: the legs do not matter here.
fn table(model: &Model) -> EverettTable {
    let grid = model.hysteresis.grid;
    let [drive_min, drive_max] = model.actuator.voltage;
    let mut nodes = vec![0.0; grid * (grid + 1) / 2];
    for up in 1..=grid {
        for down in 0..up {
            nodes[EverettTable::index(up, down)] = 60e-6 * (up - down) as f64 / grid as f64;
        }
    }
    EverettTable { grid, drive_min, drive_max, nodes }
}

pub fn lowered(model: &Model) -> Result<Ir, Vec<Diagnostic>> {
    let Some(task) = model.task_space.as_ref() else {
        return lower::lower(model, None, &[table(model)], &[], &[], origin());
    };
    let design = platform::design(model, task, &RestDynamics::of(&lower::platform(model)?))?;
    let (setpoints, _) = lower::setpoint::lower(model, task, &[], lower::scalar(model))?;
    lower::lower(model, Some((&design, setpoints)), &[table(model)], &[], &[], origin())
}

fn origin() -> Origin<'static> {
    Origin { digest: "0000", assumed: Vec::new() }
}

pub fn with_scalar(mut model: Model, scalar: Scalar) -> Model {
    model.controller.scalar = scalar;
    model
}

pub fn probe(at: [f64; 3], direction: [f64; 3], normal: [f64; 3]) -> Probe {
    let unit = |v: [f64; 3]| {
        let norm = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        v.map(|part| part / norm)
    };
    Probe {
        point: [at[0], at[1], at[2] + HEIGHT],
        direction: unit(direction),
        plane_point: at,
        plane_normal: unit(normal),
    }
}

/// Three along z on a circle of 80 mm, two along y side by side, one along x, all in the plane of P_C.
pub fn three_two_one() -> [Probe; 6] {
    let r = 0.08;
    let (s, c) = (r * 0.75_f64.sqrt(), r * 0.5);
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    [
        probe([r, 0.0, 0.0], z, z),
        probe([-c, s, 0.0], z, z),
        probe([-c, -s, 0.0], z, z),
        probe([r, 0.0, 0.0], y, y),
        probe([-r, 0.0, 0.0], y, y),
        probe([0.0, r, 0.0], x, x),
    ]
}

/// No two lines parallel, no line normal to its plane, targets at different heights.
pub fn tilted() -> [Probe; 6] {
    [
        probe([0.071, 0.013, 0.012], [0.1, -0.2, 1.0], [-0.1, 0.1, 0.9]),
        probe([-0.05, 0.062, -0.02], [0.05, 0.15, 1.0], [0.2, -0.1, 1.0]),
        probe([-0.033, -0.077, 0.008], [-0.2, 0.05, -1.0], [0.1, 0.2, 1.1]),
        probe([0.081, -0.02, 0.015], [0.1, 1.0, 0.2], [-0.2, 1.0, -0.1]),
        probe([-0.06, 0.03, -0.03], [-0.15, 0.9, -0.1], [0.1, 1.0, 0.2]),
        probe([0.012, 0.09, 0.02], [1.0, 0.2, -0.1], [1.0, -0.2, 0.15]),
    ]
}

pub struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }
    /// Uniform in −1..1.
    pub fn unit(&mut self) -> f64 {
        self.0.next_u64() as f64 / 2f64.powi(63) - 1.0
    }
    pub fn vector(&mut self, size: f64) -> [f64; 3] {
        [0; 3].map(|_| size * self.unit())
    }
    /// Within the declared workspace.
    pub fn pose(&mut self, model: &Model) -> [f64; 6] {
        let ([x, y, z], [a, b, c]) = (model.workspace.translation, model.workspace.rotation);
        [x, y, z, a, b, c].map(|bound| bound * self.unit())
    }
    /// Targets anywhere within ±100 mm, lines and normals any way, up to some 45° apart.
    pub fn layout(&mut self) -> [Probe; 6] {
        [0; 6].map(|_| {
            let direction = self.vector(1.0);
            let tilt = self.vector(0.5);
            let normal = [0, 1, 2].map(|k| direction[k] + tilt[k]);
            probe(self.vector(0.1), direction, normal)
        })
    }
}

pub fn sensing(ir: &Ir) -> &Sensing {
    &ir.task_space.as_ref().unwrap().sensing
}

pub fn real<T: Real>(value: f64) -> T {
    // IR constants are rounded to the scalar already.
    if size_of::<T>() == 4 { T::from_word(u64::from((value as f32).to_bits())) } else { T::from_word(value.to_bits()) }
}

pub fn double<T: Real>(value: T) -> f64 {
    if size_of::<T>() == 4 {
        f64::from(f32::from_bits(value.to_word() as u32))
    } else {
        f64::from_bits(value.to_word())
    }
}

/// The runtime's gauges with the constants of the IR.
pub fn runtime<T: Real>(ir: &Ir) -> Gauges<'static, T> {
    constants::gauges(&Rounding(PhantomData::<T>), sensing(ir))
}

pub fn series<T: Real>(ir: &Ir) -> Series<'static, T> {
    legs(ir).0.series
}

pub fn legs<T: Real>(ir: &Ir) -> (Legs<'static, T>, [[T; 6]; 6]) {
    let numbers = Rounding(PhantomData::<T>);
    (constants::legs(&numbers, &ir.kinematics), numbers.matrix(&ir.kinematics.inverse_jacobian))
}
