//! The load of the legs to first order: what the compiler proves of it, against the whole kernel at random motions and at the worst
//! corner of each leg.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::compile::Compilation;
use specgen::ir::{Load, LoadBound};
use specgen::lower;
use specgen_runtime::dynamics::Affine;
use specgen_runtime::{Motion, Platform};
use specgen_tests::{compile_edited, worse};

const MOTIONS: u32 = 500;
/// A motion as one list: pose, rate, acceleration.
type State = [f64; 18];

struct Case {
    name: &'static str,
    compiled: Compilation,
    platform: Platform<f64>,
}

impl Case {
    fn new(name: &'static str, spec: &str, edits: &[(&str, &str)]) -> Self {
        let compiled = compile_edited(&format!("load-{name}"), spec, edits, &[]);
        let platform = lower::platform(&compiled.model).unwrap();
        Self { name, compiled, platform }
    }

    fn load(&self) -> &Load {
        &self.compiled.ir.task_space.as_ref().unwrap().load
    }

    fn widths(&self, bound: &LoadBound) -> State {
        let pose = self.compiled.model.workspace.bounds();
        std::array::from_fn(|k| [pose, bound.rate, bound.acceleration].as_flattened()[k])
    }

    /// p of each leg by the whole kernel, m.
    fn whole(&self, state: &State) -> [f64; 6] {
        let six = |first: usize| std::array::from_fn(|k| state[first + k]);
        let force = self.platform.leg_forces(&Motion { pose: six(0), rate: six(6), acceleration: six(12) });
        let rest = self.platform.leg_forces(&Motion::new());
        std::array::from_fn(|leg| (force[leg] - rest[leg]) / self.compiled.model.actuator.axial_stiffness)
    }

    /// What the first order leaves of each leg's load, m.
    fn left(&self, affine: &Affine<f64>, state: &State) -> [f64; 6] {
        let six = |first: usize| std::array::from_fn(|k| state[first + k]);
        let first = affine.deflection(&Motion { pose: six(0), rate: six(6), acceleration: six(12) });
        let whole = self.whole(state);
        std::array::from_fn(|leg| whole[leg] - first[leg])
    }

    /// Largest error of any leg at corners and random motions, and at the corner that is found for each leg by turning one
    /// variable after the other to where the error grows.
    fn worst(&self, affine: &Affine<f64>, bound: &LoadBound) -> f64 {
        let widths = self.widths(bound);
        let largest = |state: &State| self.left(affine, state).into_iter().fold(0.0, |a, b| worse(a, b.abs()));
        let mut random = ChaCha8Rng::seed_from_u64(17);
        let mut worst = 0.0_f64;
        for round in 0..MOTIONS {
            let inside = round % 2 == 0;
            let unit = |word: u32| 2.0 * f64::from(word) / f64::from(u32::MAX) - 1.0;
            let mut state = widths.map(|width| {
                let place = unit(random.next_u32());
                width * if inside { place } else { place.signum() }
            });
            if round < 12 {
                for k in (0..18).chain(0..18) {
                    let mut turned = state;
                    turned[k] = -turned[k];
                    if largest(&turned) > largest(&state) {
                        state = turned;
                    }
                }
            }
            worst = worse(worst, largest(&state));
        }
        worst
    }
}

fn first_order(load: &Load) -> Affine<f64> {
    let affine = load.affine.as_ref().unwrap();
    Affine { pose: affine.pose, acceleration: affine.acceleration }
}

#[test]
#[ignore = "long: many random paths"]
fn what_the_first_order_leaves_is_within_its_bound_and_near_it() {
    let f32 = [("scalar = \"f64\"", "scalar = \"f32\"")];
    let cases = [
        Case::new("reference", "reference.toml", &[]),
        Case::new("f32", "reference.toml", &f32),
        Case::new("joints", "features/platform-joints.toml", &[]),
        Case::new(
            "loose",
            "reference.toml",
            &[("transfer_time   =", "dynamics_tolerance = \"3 nm\"\ntransfer_time =")],
        ),
    ];
    let mut terms = Vec::new();
    for case in &cases {
        let (load, affine) = (case.load(), first_order(case.load()));
        for (what, bound) in ["moves", "stops", "streams"].into_iter().zip(&load.bounds) {
            let worst = case.worst(&affine, bound);
            let (name, bound_nm, worst_nm, load) = (&case.name, bound.error * 1e9, worst * 1e9, bound.load * 1e9);
            println!(
                "{name}, {what}: off by {bound_nm:.4} nm at most, found {worst_nm:.4} nm; load up to {load:.1} nm"
            );
            assert!(worst <= bound.error, "{}, {what}: {worst:e} beyond {:e}", case.name, bound.error);
            assert!(bound.error < 2.5 * worst, "{}, {what}: {worst:e} is far below {:e}", case.name, bound.error);
        }
        assert!(load.bounds[0].error <= load.tolerance, "{}", case.name);
        terms.push(load.affine.as_ref().unwrap().terms());
    }
    // What the tolerance has room for is left out.
    assert!(terms[3] < terms[0] && terms[0] < terms[2] && terms[2] < 72, "{terms:?}");

    // In frames of the user's the bound holds, too, but for motions that no user can ask for.
    let frames = Case::new("frames", "features/platform-frames.toml", &[]);
    for bound in &frames.load().bounds {
        assert!(frames.worst(&first_order(frames.load()), bound) <= bound.error);
    }
}

/// Each kept coefficient is the derivative of the whole kernel at rest; a thousandth off is seen.
#[test]
fn the_coefficients_are_the_derivatives_of_the_whole_kernel() {
    for case in [
        Case::new("derivatives", "reference.toml", &[]),
        Case::new("derivatives-joints", "features/platform-joints.toml", &[]),
    ] {
        let widths = case.widths(&case.load().bounds[0]);
        let derivative = |k: usize, leg: usize| {
            let at = |place: f64| {
                let mut state = [0.0; 18];
                state[k] = place * widths[k];
                case.whole(&state)[leg]
            };
            (at(1.0) - at(-1.0)) / (2.0 * widths[k])
        };
        let agrees = |value: f64, k: usize, leg: usize| (value - derivative(k, leg)).abs() <= 1e-4 * value.abs();
        let affine = first_order(case.load());
        let mut seen = 0;
        for leg in 0..6 {
            for k in 0..6 {
                for (value, k) in [(affine.pose[leg][k], k), (affine.acceleration[leg][k], k + 12)] {
                    if value != 0.0 {
                        assert!(agrees(value, k, leg), "{}, leg {leg}, variable {k}: {value:e}", case.name);
                        assert!(!agrees(value * 1.001, k, leg) && !agrees(-value, k, leg));
                        seen += 1;
                    }
                }
            }
        }
        assert_eq!(seen, case.load().affine.as_ref().unwrap().terms());
    }
}

/// A platform that is heavier and faster gets the whole kernel, and so does who asks for it; what is proven is told all the same.
#[test]
fn what_is_not_proven_is_not_taken() {
    let fast = (
        "acceleration = [\"10 mm/s^2\", \"10 mm/s^2\", \"10 mm/s^2\",",
        "acceleration = [\"1 m/s^2\", \"1 m/s^2\", \"1 m/s^2\",",
    );
    let asked = ("transfer_time   =", "dynamics = \"whole\"\ntransfer_time =");
    let strict = ("transfer_time   =", "dynamics_tolerance = \"0.01 nm\"\ntransfer_time =");
    for (name, edit, proven) in [("fast", fast, false), ("asked", asked, true), ("strict", strict, false)] {
        let case = Case::new(name, "reference.toml", &[edit]);
        let load = case.load();
        assert!(load.affine.is_none(), "{name}");
        assert_eq!(load.bounds[0].error <= load.tolerance, proven, "{name}: {:?}", load.bounds[0]);
        assert!(lower::describe_load(load).contains("by the whole kernel"));
    }
}
