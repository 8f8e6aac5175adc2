//! Identification from a measured record of real hardware (`../shared/data/piezo-forc`), scored on another record of it.
//!
//! Each test prints that it is skipped where the data is absent.

use crate::identify_support::measured;
use std::time::Instant;

use specgen::everett::EverettTable;
use specgen::identify::response::respond;
use specgen::identify::{
    Branches, DeadTime, Identification, Input, Options, PredictionError, Record, choose_grid, identify, validate,
};
use specgen_tests::length;

const DRIVE: [f64; 2] = [-90.0, 90.0];

/// Reversal curves and another record, to predict, of one actuator.
fn curves_and_sine() -> Option<(Record, Record)> {
    Some((measured("forc-20hz.csv")?, measured("validate-growing-sine-5hz.csv")?))
}

fn found(record: &Record, options: &Options) -> Identification {
    let result = identify(record, options).unwrap_or_else(|d| panic!("{d:#?}"));
    assert!(result.warnings.is_empty(), "{:#?}", result.warnings);
    let r = &result.report;
    let (record, grid, fit, most) = (&r.record, r.grid, r.fit_rms_percent, r.fit_max_percent);
    let (within, dead_time, basis) = (r.branch_rms_percent, r.dead_time * 1e3, &r.dead_time_basis);
    let (zero, weights, factorised) = (r.zero_weights, r.weights, r.solver_iterations);
    println!(
        "{record} N={grid}: fit {fit:.3} % rms {most:.2} % max, within branches {within:.3} %, dead time {dead_time:.3} ms ({basis}), {zero} of {weights} weights zero, {factorised} factorisations"
    );
    result
}

fn predicted(table: &EverettTable, record: &Record, dead_time: f64) -> PredictionError {
    let validation = validate(table, record, dead_time).unwrap();
    let compared = validation.compared.unwrap();
    let (record, rms, on) = (&record.shown_as, compared.rms_percent, 100.0 * validation.start_on);
    println!("  predicts {record} to {rms:.3} % rms; {on:.0} % of the open weight on at the start");
    compared
}

#[test]
fn measured_record_is_fitted_and_predicts_another_one() {
    let Some((forc, sine)) = curves_and_sine() else { return };
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
    let Some((forc, sine)) = curves_and_sine() else { return };
    let result = found(&forc, &Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(32, DRIVE) });
    assert!(result.report.fit_rms_percent <= 0.5, "fit {} %", result.report.fit_rms_percent);
    let validation = predicted(&result.table, &sine, 0.0);
    assert!(validation.rms_percent <= 1.2, "prediction {} %", validation.rms_percent);
}

#[test]
fn a_table_without_hysteresis_fails_the_limits() {
    let Some((forc, sine)) = curves_and_sine() else { return };
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

/// Defects that lab records have: each is named, and changes dead time and prediction by at most a tenth, except hum at a
/// frequency of the drive.
#[test]
fn spikes_hum_and_a_step_do_not_spoil_a_measured_record() {
    let Some((forc, sine)) = curves_and_sine() else { return };
    let options = Options::new(32, DRIVE);
    let clean = found(&forc, &options);
    let error = predicted(&clean.table, &sine, clean.report.dead_time).rms_percent;
    let spoil = |code: &str, change: &dyn Fn(usize) -> f64| {
        let y = forc.displacement.iter().enumerate().map(|(k, y)| y + change(k)).collect();
        let record = Record::from_columns("spoilt.csv", forc.time.clone(), forc.drive.clone(), y).unwrap();
        let spoilt = identify(&record, &options).unwrap();
        println!("{code}: dead time {:.3} ms", spoilt.report.dead_time * 1e3);
        assert!(spoilt.warnings.iter().any(|d| d.code == code), "{:#?}", spoilt.warnings);
        assert!((spoilt.report.dead_time / clean.report.dead_time - 1.0).abs() < 0.1);
        assert!(predicted(&spoilt.table, &sine, spoilt.report.dead_time).rms_percent < 1.1 * error);
    };
    spoil("W0517", &|k| if [18_211, 27_003, 35_500].contains(&k) { 3e-6 } else { 0.0 });
    spoil("W0517", &|k| if k % 1231 < 5 { 3e-6 } else { 0.0 });
    spoil("W0521", &|k| 50e-9 * (std::f64::consts::TAU * 50.0 * forc.time[k]).sin());
    spoil("W0520", &|k| if k > 25_400 { 0.4e-6 } else { 0.0 });
    // The drive has these frequencies: hum there stays in the fit, and is named.
    for frequency in [20.0, 40.0, 60.0].into_iter().take(length(1, 3)) {
        let hum = |time: &f64| 50e-9 * (std::f64::consts::TAU * frequency * time).sin();
        let y = forc.displacement.iter().zip(&forc.time).map(|(y, time)| y + hum(time)).collect();
        let record = Record::from_columns("hum.csv", forc.time.clone(), forc.drive.clone(), y).unwrap();
        let warnings = identify(&record, &options).unwrap().warnings;
        let named = warnings.iter().any(|d| d.code == "W0521" && d.message.contains("it is in the fit"));
        assert!(named, "{frequency} Hz: {warnings:#?}");
    }
}

/// A growing sine of one second is a record of its own, over the range that it covers.
#[test]
fn a_measured_growing_sine_gives_a_table_for_its_range() {
    let Some(sine) = measured("validate-growing-sine-5hz.csv") else { return };
    let (range, late) = ([-82.0, 74.0], DeadTime::Fixed(1.14e-4));
    let found = identify(&sine, &Options::new(16, range)).unwrap_or_else(|d| panic!("{d:#?}"));
    assert!(found.warnings.iter().any(|d| d.code == "W0522"), "{:#?}", found.warnings);
    assert!(found.report.dead_time == 0.0 && found.report.dead_time_basis.contains("--dead-time"));
    let choice = choose_grid(&sine, range, late).unwrap();
    let best = choice.scores.iter().find(|score| score.grid == choice.best).unwrap();
    println!("held out: {best:?}");
    assert!(best.held_out_percent < 0.15, "{best:?}");
}

/// The cells beyond the sine continue those before them: the gain of the whole range is about that of the record.
#[test]
fn a_measured_growing_sine_gives_a_table_for_a_range_a_little_wider() {
    let Some(sine) = measured("validate-growing-sine-5hz.csv") else { return };
    let late = DeadTime::Fixed(1.14e-4);
    let gain = |range: [f64; 2]| {
        let found = identify(&sine, &Options { dead_time: late, ..Options::new(16, range) });
        let found = found.unwrap_or_else(|d| panic!("{d:#?}"));
        let error = predicted(&found.table, &sine, 1.14e-4).rms_percent;
        println!("{range:?}: {:.4} um/V, prediction {error:.3} %", found.table.mean_gain() * 1e6);
        (found, error)
    };
    let ((own, least), (wide, error)) = (gain([-82.0, 74.0]), gain([-90.0, 90.0]));
    assert!(wide.warnings.iter().any(|d| d.code == "W0609" && d.message.contains("continue")), "{:#?}", wide.warnings);
    let ratio = wide.table.mean_gain() / own.table.mean_gain();
    assert!((0.9..1.1).contains(&ratio) && error < 2.0 * least, "{ratio} {error} {least}");
    let refused = identify(&sine, &Options::new(16, [-110.0, 74.0])).unwrap_err();
    assert!(refused.iter().any(|d| d.code == "E0606"), "{refused:#?}");
}

/// The drive is noise of large amplitude, the gain of which is hysteresis at low frequencies.
#[test]
fn a_measured_wide_band_record_shows_the_resonance() {
    let Some(wide) = measured("validate-wide-band.csv") else { return };
    let rows = wide.time.iter().zip(&wide.drive).zip(&wide.displacement);
    let mut text = "time_s,drive_V,displacement_um\n".to_owned();
    text.extend(rows.map(|((t, u), y)| format!("{t:?},{u:?},{:?}\n", y * 1e6)));
    let fitted = respond(Input::Text(&text), "wide.csv", None).unwrap_or_else(|d| panic!("{d:#?}")).value.fitted;
    println!("{fitted:?}");
    assert!((fitted.resonance.value - 740.0).abs() < 3.0, "{fitted:?}");
    assert!((0.015..0.03).contains(&fitted.damping_ratio.value), "{fitted:?}");
    let lagging = std::f64::consts::TAU * fitted.resonance.value * fitted.lag.value;
    let gain = fitted.gain.value / (1.0 + lagging * lagging).sqrt();
    assert!((0.0235e-6..0.0265e-6).contains(&gain), "{gain:e}");
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
