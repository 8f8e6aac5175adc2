//! Steps and a path prepared by the leg model of a spec, hysteresis included, on machines of three classes of legs. The model is
//! chosen from noisy reversal curves of each leg at two rates; the machine is the plant that gave them. At one rate creep and
//! rate dependence look alike (W0649), and case 1 keeps 15.8 nm with plays. All of it is simulation.

use host_sim::platform::{PlatformParameters, Specimen};
use specgen_tests::{leg_class, length};

use super::bench::{Bench, two_rates};
use super::learning::{STEPS, case_1_errors, learning, settled};

/// What the steps may take in repeated passes, ms.
const SETTLED: [f64; 2] = [7.0, 14.0];
/// Name of each class, and what case 1 at 10 Hz may leave in the first pass, nm.
const CLASSES: [(&str, f64); 3] = [("plays", 14.0), ("Bouc-Wen", 15.0), ("rate-widened plays", 14.0)];

/// A machine of legs of a class, and a damped controller with the model of their own records.
fn bench(class: usize) -> Bench {
    let legs = Specimen::within_tolerances(&PlatformParameters::reference(), &leg_class(class as u64), 1);
    let model = ("memory  = 64", "memory  = 64\nmodel   = \"auto\"");
    let records = two_rates(&legs.legs);
    Bench::with_records(&format!("prepared-{class}"), legs, &records, &[&learning()[..], &[model]].concat())
}

#[test]
#[ignore = "long: a leg model chosen for each of six legs; three classes of them with SPECGEN_FULL"]
fn steps_and_a_path_are_prepared_by_the_whole_leg_model() {
    for (class, (name, most)) in CLASSES.into_iter().enumerate().skip(length(1, 0)).take(length(1, 3)) {
        let bench = bench(class);
        let [bare, prepared] = [false, true].map(|with| case_1_errors(&bench, with));
        println!("{name}: case 1 at 10 Hz, first pass and second: {bare:.1?} -> {prepared:.1?} nm");
        assert!(prepared[0] <= most && prepared[0] < bare[0], "{name}: {bare:?} {prepared:?}");
        for ([size, time], most) in STEPS.into_iter().zip(SETTLED) {
            let [[plain, repeated], [first, again]] = [false, true].map(|with| settled(&bench, [size, time], with));
            println!(
                "{name}: step of {:.0} µm in {:.1} ms, settled to 10 nm (repeated): {plain:.1} ({repeated:.1}) ms; prepared {first:.1} \
                 ({again:.1})",
                size * 1e6,
                time * 1e3
            );
            assert!(again <= most && first <= most, "{name}: {first} {again}");
        }
    }
}
