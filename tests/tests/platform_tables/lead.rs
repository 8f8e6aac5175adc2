//! A lead of its own for a trajectory: what it changes, what the model proposes, and what that is worth on simulated machines.

use host_sim::platform::Specimen;
use host_sim::platform::rig::{BUSY, Bench as Rig, Command, Request};
use host_sim::trajectory::PoseTarget;
use specgen::lead::{self, LeadOf};
use specgen_tests::length;

use super::bench::{Bench, PERIOD};
use super::classes::bouc_wen;

/// Case 1 of the reference spec at a frequency, with further keys.
fn case_1(hertz: u32, keys: &str) -> String {
    format!("kind      = \"case-1\"\nfrequency = \"{hertz} Hz\"\n{keys}")
}

/// A controller of the reference spec whose case 1 has this lead of its own, and [control] that one; each if any.
fn bench(class: &str, hertz: u32, own: Option<&str>, usual: Option<&str>) -> Bench {
    let keys = own.map_or_else(String::new, |lead| format!("lead = \"{lead}\"\n"));
    let case = case_1(hertz, &keys);
    let control = usual.map_or_else(String::new, |lead| format!("lead = \"{lead}\"\n"));
    let control = format!("{control}transfer_time   =");
    let fast =
        ["stream_speed = [\"5 mm/s\", \"5 mm/s\", \"5 mm/s\"", "stream_speed = [\"9 mm/s\", \"9 mm/s\", \"9 mm/s\""];
    let edits = [
        ("kind      = \"case-1\"\nfrequency = \"1 Hz\"\n", case.as_str()),
        ("transfer_time   =", control.as_str()),
        (fast[0], fast[1]),
        ("stale_ticks  = 10", "stale_ticks = 3"),
    ];
    let name = format!("lead-{class}-{hertz}-{}-{}", own.unwrap_or("none"), usual.unwrap_or("none")).replace(' ', "");
    if class == "plays" { Bench::new(&name, Specimen::reference(), &edits) } else { bouc_wen(&name, &edits) }
}

/// Voltages of a stream along x, then error of the true pose while the controller plays case 1 and 0.1 s behind it, nm rms.
fn played(bench: &Bench) -> (Vec<[f64; 6]>, f64) {
    let mut controller = bench.controller();
    let mut prepared = bench.scenario().rig().clone();
    let mut rig = Rig::new(&mut prepared, &mut controller, PERIOD, 0).unwrap();
    rig.arm(60.0).unwrap();
    let streamed = (0..2000)
        .map(|tick| {
            let mut target = PoseTarget::default();
            target.pose[0] = 2e-6 * (std::f64::consts::TAU * 5e-3 * f64::from(tick)).sin();
            rig.tick(&Request::stream(target)).unwrap().voltage
        })
        .collect();
    let hold = Request::default();
    for _ in 0..2000 {
        rig.tick(&hold).unwrap();
    }
    let play = Request { command: Command::Trajectory, selector: 0, ..Request::default() };
    let (mut sum, mut count, mut rest) = (0.0, 0, 0);
    while rest < 1000 {
        let done = rig.tick(&play).unwrap();
        rest = if done.status & BUSY == 0 { rest + 1 } else { 0 };
        sum += (0..3).map(|axis| (done.target[axis] - done.pose[axis]).powi(2)).sum::<f64>();
        count += 1;
    }
    (streamed, (sum / f64::from(count)).sqrt() * 1e9)
}

#[test]
#[ignore = "long: three controllers with other leads"]
fn a_lead_of_its_own_is_that_of_a_trajectory_alone() {
    let of = |own, usual| played(&bench("plays", 30, own, usual));
    let ((own_stream, own), (usual_stream, usual), (_, less)) =
        (of(Some("0.1 ms"), None), of(None, None), of(None, Some("0.1 ms")));
    println!(
        "case 1 at 30 Hz, played: lead 0.1 ms of its own {own:.1} nm, of the control {less:.1}; as proposed {usual:.1}"
    );
    // Streams do not know of it, to the bit.
    assert!(own_stream == usual_stream);
    assert!((own / less - 1.0).abs() < 0.01 && (usual / less - 1.0).abs() > 0.03);
}

#[test]
#[ignore = "long: controllers with the usual and the proposed lead, played"]
fn corners_ask_for_less_lead_and_the_model_says_how_much() {
    let classes = length(&["plays"][..], &["plays", "Bouc-Wen"]);
    let frequencies = length(&[10][..], &[1, 10, 30]);
    for (class, hertz) in classes.iter().flat_map(|class| frequencies.iter().map(move |hertz| (class, *hertz))) {
        let usual = bench(class, hertz, None, None);
        let found = lead::of(&usual.emitted.compiled);
        let LeadOf { lead, best, errors, .. } = &found[0];
        let proposed = format!("{:.4} ms", best * 1e3);
        let [before, after] = [played(&usual).1, played(&bench(class, hertz, Some(&proposed), None)).1];
        let (without, milliseconds, with) = (errors[0] * 1e9, lead * 1e3, errors[1] * 1e9);
        println!(
            "{class}, case 1 at {hertz} Hz: by the model {without:.1} nm with {milliseconds:.3} ms, {with:.1} with {proposed}; played {before:.1} -> {after:.1} nm"
        );
        assert!(best < lead && errors[1] < errors[0]);
        assert!(!found[0].is_proposed() || after <= 1.02 * before, "{before} {after}");
    }
}
