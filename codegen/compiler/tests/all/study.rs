//! The platform of the study: geometry A with k_a = 1e7 N/m, M and J at rest from the published vectors.

use std::path::Path;

use specgen_compiler::stability::platform::RestDynamics;
use specgen_language::model::{Model, Probe, SetpointRules, TaskSpace};
use specgen_language::spec::{self, SpecSource};

/// Home state of the dynamics vectors.
pub fn rest() -> RestDynamics {
    let (m, i, z, c) = (1.5287895840664694, 0.034589220502493224, 0.013246491448778656, 0.00048149071744203194);
    let mass = [
        [m, 0.0, 0.0, 0.0, -c, 0.0],
        [0.0, m, 0.0, c, 0.0, 0.0],
        [0.0, 0.0, 1.5928441004986444, 0.0, 0.0, 0.0],
        [0.0, c, 0.0, i, 0.0, 0.0],
        [-c, 0.0, 0.0, 0.0, i, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, z],
    ];
    #[rustfmt::skip]
    let half = [
        [0.10192863598012267, -0.5722408310728464, 0.8137266029940828, 0.0015337476821357854, -0.08135820464003886, -0.057406036960214755],
        [-0.5465394147818659, -0.1978476274045404, 0.8137266029940828, 0.07122514586563454, 0.03935083786429434, 0.057406036960214755],
        [0.44461077880174316, 0.374393203668306, 0.8137266029940828, 0.06969139818349875, 0.04200736677574452, -0.057406036960214755],
    ];
    // The other three legs mirror these in y.
    let mirror = |[a, b, c, d, e, f]: [f64; 6]| [a, -b, c, -d, e, -f];
    let jacobian = [half[0], half[1], half[2], mirror(half[2]), mirror(half[1]), mirror(half[0])];
    RestDynamics { mass, jacobian }
}

/// The leg study's spec with a platform controller: 10 kHz, ζ 2 %, λ = 1, notch ζ_d = 1.
pub fn model() -> (Model, TaskSpace) {
    let specs = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().join("specs");
    let read = |name: &str| spec::load(&SpecSource::read(&specs.join(name)).unwrap()).0.unwrap();
    let mut model = read("legs.toml");
    model.timing.period = 1e-4;
    model.adaptation.gain_ratio = [1.0, 1.0];
    let probe =
        Probe { point: [0.0; 3], direction: [0.0, 0.0, 1.0], plane_point: [0.0; 3], plane_normal: [0.0, 0.0, 1.0] };
    let reference = read("reference.toml").task_space.unwrap();
    let task = TaskSpace {
        probes: std::array::from_fn(|_| probe.clone()),
        velocity_cutoff: std::f64::consts::TAU * 3500.0,
        lead: Some(0.0),
        setpoint: SetpointRules {
            speed: [1e-3; 6],
            acceleration: [1.0; 6],
            jerk: [1e3; 6],
            stream_speed: [1e-2; 6],
            stale_ticks: 100,
            ..reference.setpoint
        },
        trajectories: Vec::new(),
        ..reference
    };
    (model, task)
}
