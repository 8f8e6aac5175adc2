//! The paper's Tables 5 to 9 from the emitted controller.
mod platform_support;
use host_sim::platform::scenario::*;
use host_sim::platform::*;
use host_sim::trajectory::*;
use platform_support::*;
use std::time::Instant;

#[test]
fn reference() {
    let t = Instant::now();
    let mut bench = Bench::new("tables-reference", Specimen::reference(), &[]);
    println!("built {:?}", t.elapsed());
    let sc = bench.scenario();
    println!("prepared {:?}", t.elapsed());
    for (name, path) in [("case-1", PaperPath::Case1), ("case-2", PaperPath::Case2)] {
        for f in [1.0, 10.0] {
            let p = paper(path, f);
            let named = [NamedTrajectory { name, frequency: f, trajectory: &p }];
            println!("{}", sc.free_motion(&mut bench.controller, &PLATFORM_MODES, &named).unwrap().to_text());
        }
    }
    let p = paper(PaperPath::Machining, 1.0);
    println!(
        "{}",
        sc.machining(
            &mut bench.controller,
            &PLATFORM_MODES,
            &[("glass", WorkPart::glass()), ("aluminium", WorkPart::aluminium())],
            &p
        )
        .unwrap()
        .to_text()
    );
    println!("all {:?}", t.elapsed());
    let d = bench.design();
    println!(
        "limit {} level {} drift {} {:?} {:?}",
        d.bandwidth_limit,
        d.combined.level_bandwidth,
        d.combined.drift_bandwidth,
        d.combined.integral,
        d.position.integral
    );
}
