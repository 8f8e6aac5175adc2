//! Identification from a measured record of real hardware (`../shared/data/piezo-forc`), scored on another record of it.
//!
//! Each test prints that it is skipped where the data is absent.

use crate::identify_support::measured;
use std::time::Instant;

use specgen::everett::EverettTable;
use specgen::identify::{Branches, DeadTime, Identification, Options, PredictionError, Record, identify, validate};
use specgen_tests::length;

const DRIVE: [f64; 2] = [-90.0, 90.0];

fn found(record: &Record, options: &Options) -> Identification {
    let result = identify(record, options).unwrap_or_else(|d| panic!("{d:#?}"));
    assert!(result.warnings.is_empty(), "{:#?}", result.warnings);
    let r = &result.report;
    println!(
        "{} N={}: fit {:.3} % rms {:.2} % max, within branches {:.3} %, dead time {:.3} ms ({}), {} of {} weights zero, {} factorisations",
        r.record,
        r.grid,
        r.fit_rms_percent,
        r.fit_max_percent,
        r.branch_rms_percent,
        r.dead_time * 1e3,
        r.dead_time_basis,
        r.zero_weights,
        r.weights,
        r.solver_iterations,
    );
    result
}

fn predicted(table: &EverettTable, record: &Record, dead_time: f64) -> PredictionError {
    let validation = validate(table, record, dead_time).unwrap();
    let compared = validation.compared.unwrap();
    println!(
        "  predicts {} to {:.3} % rms; {:.0} % of the open weight on at the start",
        record.shown_as,
        compared.rms_percent,
        100.0 * validation.start_on
    );
    compared
}

#[test]
fn measured_record_is_fitted_and_predicts_another_one() {
    let (Some(forc), Some(sine)) = (measured("forc-20hz.csv"), measured("validate-growing-sine-5hz.csv")) else {
        return;
    };
    let result = found(&forc, &Options::new(32, DRIVE));
    let report = &result.report;
    assert_eq!(report.branches, Branches::Descending);
    assert_eq!(report.reversal_curves, 50);
    assert_eq!(report.excited_share, 1.0);
    // The drive rests at -90 V for 1.5 s while the displacement rings and creeps.
    assert_eq!(report.samples_skipped, 15_000);
    assert!(report.kkt_violation < 1e-10);
    assert!(report.fit_rms_percent <= 0.25, "fit {} %", report.fit_rms_percent);
    let validation = predicted(&result.table, &sine, report.dead_time);
    // The record ends with a jump from -81 V to -5 V in one sample.
    assert_eq!(validation.samples_after_jumps, 1);
    assert!(validation.rms_percent <= 0.85, "prediction {} %", validation.rms_percent);
}

/// The limits hold without the dead time too, which a static table cannot know.
#[test]
fn the_table_alone_stays_within_the_limits() {
    let (Some(forc), Some(sine)) = (measured("forc-20hz.csv"), measured("validate-growing-sine-5hz.csv")) else {
        return;
    };
    let result = found(&forc, &Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(32, DRIVE) });
    assert!(result.report.fit_rms_percent <= 0.5, "fit {} %", result.report.fit_rms_percent);
    let validation = predicted(&result.table, &sine, 0.0);
    assert!(validation.rms_percent <= 1.2, "prediction {} %", validation.rms_percent);
}

#[test]
fn a_table_without_hysteresis_fails_the_limits() {
    let (Some(forc), Some(sine)) = (measured("forc-20hz.csv"), measured("validate-growing-sine-5hz.csv")) else {
        return;
    };
    let result = found(&forc, &Options::new(32, DRIVE));
    let mut straight = result.table.clone();
    for up in 1..=32 {
        for down in 0..up {
            let gain = straight.node(32, 0) / 32.0;
            straight.nodes[EverettTable::index(up, down)] = gain * (up - down) as f64;
        }
    }
    assert!(predicted(&straight, &sine, result.report.dead_time).rms_percent > 2.0);
}

#[test]
fn all_three_rates_and_all_grids_identify() {
    let Some(sine) = measured("validate-growing-sine-5hz.csv") else {
        return;
    };
    for name in ["forc-20hz.csv", "forc-40hz.csv", "forc-100hz.csv"].into_iter().take(length(1, 3)) {
        let Some(forc) = measured(name) else { return };
        let grids: &[usize] =
            if name == "forc-20hz.csv" { length(&[16], &[8, 16, 25, 32, 64]) } else { &[8, 16, 25, 32] };
        for &grid in grids {
            let started = Instant::now();
            let result = found(&forc, &Options::new(grid, DRIVE));
            println!("  {:.2} s", started.elapsed().as_secs_f64());
            assert!(result.report.fit_rms_percent <= 0.5, "fit {} %", result.report.fit_rms_percent);
            let validation = predicted(&result.table, &sine, result.report.dead_time);
            assert!(validation.rms_percent <= 1.35, "prediction {} %", validation.rms_percent);
        }
    }
}
