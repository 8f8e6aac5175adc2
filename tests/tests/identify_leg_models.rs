//! The family of a leg, chosen from its reversal curves.

use std::time::Instant;

use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};
use specgen::identify::leg_model::{Choice, choose};
use specgen::identify::{Options, Record, parse_record};
use specgen::model::LegModelKind as Kind;

/// Reversal curves of a leg as built, with the gauge's noise.
fn record(leg: &LegParameters, seed: u64) -> Record {
    let mut gauge = Gauge::new(&leg.noise, seed, 0);
    let experiment = ReversalExperiment { update: 5e-4, ..ReversalExperiment::reference(32) };
    parse_record(&experiment.run(&mut LegPlant::new(leg), &mut gauge).to_csv(), "leg.csv").unwrap()
}

fn chosen(leg: &LegParameters, seed: u64) -> Choice {
    let record = record(leg, seed);
    let start = Instant::now();
    let choice = choose(&record, &Options::new(32, [0.0, 100.0]), Kind::Auto).unwrap();
    for score in &choice.scores {
        let error = [score.held_out_rms, score.standard_error].map(|error| error * 1e9);
        println!("{}: {:.2} ± {:.2} nm", score.family.name(), error[0], error[1]);
    }
    println!("{} in {:.1} s: {:?}", choice.family.name(), start.elapsed().as_secs_f64(), choice.model.around);
    choice
}

#[test]
#[ignore = "long: every family fitted to two legs"]
fn the_family_of_a_leg_is_found_in_its_reversal_curves() {
    let bouc_wen = chosen(&LegParameters::bouc_wen(), 1);
    assert_eq!(bouc_wen.family.kind, Kind::BoucWen);
    // The creep of that leg has thresholds, which no family has: a table of plays in any form is right.
    let plays = chosen(&LegParameters::reference(), 1);
    assert_ne!(plays.family.kind, Kind::BoucWen, "{:?}", plays.family);
    let error = |choice: &Choice, kind: Kind| {
        let of_kind = choice.scores.iter().filter(|score| score.family.kind == kind);
        of_kind.map(|score| score.held_out_rms * 1e9).fold(f64::INFINITY, f64::min)
    };
    // The gauge's noise is 2.2 nm.
    assert!(error(&bouc_wen, Kind::BoucWen) < 3.0 && error(&bouc_wen, Kind::Preisach) > 100.0);
    assert!(error(&plays, Kind::BoucWen) > 4.0 * error(&plays, Kind::GeneralizedPlays));
}
