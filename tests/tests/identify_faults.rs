//! Faults injected into a good record of reversal curves: each is refused or gets no weight, and is named with its time.
//! The choice of the grid and the account of the residual, on records whose truth is known.

use crate::identify_support::{self, Drive, expect, generator, normal, random_table, uniform};
use specgen::diagnostic::Diagnostic;
use specgen::everett::EverettTable;
use specgen::identify::{
    DeadTime, Identification, Options, Record, Source, Staircase, choose_grid, identify, validate,
};
use specgen::report::identification;
use specgen_tests::{length, worse};

const RANGE: [f64; 2] = [0.0, 100.0];
const RATE: f64 = 1000.0;

/// Displacement (m) of `table` under `drive`.
fn response(table: &EverettTable, drive: &[f64]) -> Vec<f64> {
    identify_support::response(table, Staircase::negative_saturation(RANGE), drive)
}

struct Columns {
    time: Vec<f64>,
    drive: Vec<f64>,
    displacement: Vec<f64>,
}

impl Columns {
    /// Sixteen curves at 100 V/s on a table of 8 cells and 40 µm; noise 2 nm.
    fn good() -> Self {
        let drive = Drive::at(0.0, RATE).reversal_curves(16, RANGE, 100.0);
        let mut random = generator(5);
        let table = random_table(8, RANGE, 40e-6, 0.3, 7);
        let y = response(&table, &drive.samples).into_iter().map(|y| y + 2e-9 * normal(&mut random)).collect();
        Self { time: drive.time(), drive: drive.samples, displacement: y }
    }

    fn record(self) -> Result<Record, Vec<Diagnostic>> {
        Record::from_columns("r.csv", self.time, self.drive, self.displacement)
    }

    fn identified(self) -> Result<Identification, Vec<Diagnostic>> {
        identify(&self.record()?, &Options::new(8, RANGE))
    }
}

fn with(change: impl FnOnce(&mut Columns)) -> Result<Identification, Vec<Diagnostic>> {
    let mut columns = Columns::good();
    change(&mut columns);
    columns.identified()
}

#[test]
fn the_good_record_has_no_findings() {
    let found = with(|_| {}).unwrap();
    assert!(found.warnings.is_empty(), "{:#?}", found.warnings);
    assert_eq!(found.report.weightless, 0);
}

#[test]
fn a_gauge_at_its_limit_is_named_with_the_time_with_and_without_noise() {
    let all = with(|c| c.displacement.iter_mut().for_each(|y| *y = if *y > 30e-6 { 30e-6 } else { *y })).unwrap_err();
    expect(&all, "E0513", "is limited at 30");
    expect(&all, "E0513", "from 1");
    let mut random = generator(9);
    let soft = |c: &mut Columns| {
        for y in &mut c.displacement {
            if *y > 25e-6 {
                *y = 25e-6 + 2e-9 * normal(&mut random);
            }
        }
    };
    let all = with(soft).unwrap_err();
    expect(&all, "E0516", "is limited at about 25.0");
    expect(&all, "E0516", "from ");
}

#[test]
fn a_stuck_gauge_is_named_with_the_time() {
    // Sample 15000 lies in a rise: curve 15 rises from 13.1 s to 14.0 s, curve 16 from 15.0 s to 16.0 s.
    let stuck = |noise: f64| {
        with(move |c| {
            let mut random = generator(11);
            let held = c.displacement[15_300];
            c.displacement[15_300..15_700].iter_mut().for_each(|y| *y = held + noise * normal(&mut random));
        })
        .unwrap_err()
    };
    expect(&stuck(0.0), "E0513", "from 15.3 s to 15.699 s the displacement is stuck at");
    expect(&stuck(2e-9), "E0516", "is stuck at about");
    expect(&stuck(2e-9), "E0516", "from 15.");
}

/// After a rest, in a staircase and from the middle of a sine on, a gauge that is a sample late is not stuck.
#[test]
fn a_gauge_that_lags_a_step_is_accepted() {
    let table = random_table(8, RANGE, 40e-6, 0.3, 7);
    let sine = |k: i32| 50.0 + 45.0 * (1.0 + 0.03 * f64::from(k)).sin();
    let steps = [0.0, 25.0, 50.0, 75.0, 100.0, 75.0, 50.0, 25.0];
    let rest = [0.0; 500];
    let drives = [
        [&rest[..], &[60.0; 300], &rest].concat(),
        rest.iter().copied().chain((0..1000).map(sine)).collect(),
        (0..2400).map(|k| steps[k / 100 % 8]).collect(),
    ];
    for drive in drives {
        let response = response(&table, &drive);
        // Resolution 1 nm: at rest the gauge reads the same again and again.
        let late = std::iter::once(response[0]).chain(response).map(|y| (y / 1e-9).round() * 1e-9);
        let displacement: Vec<f64> = late.take(drive.len()).collect();
        let time = (0..drive.len()).map(|k| k as f64 / RATE).collect();
        let record = Columns { time, drive, displacement }.record();
        assert!(record.is_ok(), "{:#?}", record.unwrap_err());
    }
}

#[test]
fn units_and_swapped_columns_are_named_with_times() {
    let all = with(|c| c.displacement.iter_mut().for_each(|y| *y *= 1e3)).unwrap_err();
    expect(&all, "E0623", "is it in nm?");
    expect(&all, "E0623", "at 16.008 s");
    let all = with(|c| c.displacement.iter_mut().for_each(|y| *y *= 1e-3 / 2.0)).unwrap_err();
    expect(&all, "E0623", "is it in mm or m?");
    let all = with(|c| c.drive.iter_mut().for_each(|u| *u *= 1e3)).unwrap_err();
    expect(&all, "E0603", "100000 V (at 16.008 s)");
    let all = with(|c| {
        let drive = c.drive.clone();
        c.drive = c.displacement.iter().map(|y| y * 1e6).collect();
        c.displacement = drive.iter().map(|u| u * 1e-6).collect();
    })
    .unwrap_err();
    expect(&all, "E0604", "(at 16.008 s)");
    // With a rest before the curves, as real records have, the drive looks like a stuck gauge first.
    let all = with(|c| {
        let rest = 4000;
        let drive = std::mem::take(&mut c.drive);
        let displacement = std::mem::take(&mut c.displacement);
        let interval = c.time[1] - c.time[0];
        c.time = (0..rest + drive.len()).map(|k| k as f64 * interval).collect();
        // It creeps to its rest by a tenth of its range.
        let creep = |k: usize| 5e-6 * (1.0 - k as f64 / rest as f64);
        let noise = |k: usize| if k.is_multiple_of(2) { 2e-9 } else { -2e-9 };
        c.drive = (0..rest).map(|k| (displacement[0] + creep(k) + noise(k)) * 1e6).collect();
        c.drive.extend(displacement.iter().enumerate().map(|(k, y)| (y + noise(k)) * 1e6));
        c.displacement = vec![drive[0] * 1e-6; rest];
        c.displacement.extend(drive.iter().map(|u| u * 1e-6));
    })
    .unwrap_err();
    expect(&all, "E0604", "from 0 s to");
    let all = with(|c| c.displacement.iter_mut().for_each(|y| *y = -*y)).unwrap_err();
    expect(&all, "E0514", "between 0 s and 16.008 s the drive goes from 0 V to 100 V");
}

#[test]
fn time_that_stands_or_jumps_is_named() {
    expect(&with(|c| c.time[5000] = c.time[4999]).unwrap_err(), "E0510", "time goes from 4.999 s to 4.999 s");
    let without = |range: core::ops::Range<usize>| {
        let cut = |c: &mut Columns| {
            for column in [&mut c.time, &mut c.drive, &mut c.displacement] {
                drop(column.drain(range.clone()));
            }
        };
        with(cut).unwrap_err()
    };
    expect(&without(7000..7500), "E0511", "between 6.999 s and 7.5 s");
    expect(&without(60..Columns::good().time.len()), "E0509", "has 60 samples and ends at 0.059 s");
}

/// Without the weight of zero a glitch of 20 µm bends the table; the test fails if the mask is ignored.
#[test]
fn a_glitch_gets_no_weight_and_is_named_with_its_time() {
    let clean = with(|_| {}).unwrap();
    let found = with(|c| {
        for k in [3210, 9876, 14_500] {
            c.displacement[k] += 20e-6;
        }
    })
    .unwrap();
    expect(&found.warnings, "W0517", "at 3.21 s");
    expect(&found.warnings, "W0517", "at 14.5 s");
    assert_eq!(found.report.weightless, 3);
    let apart = |a: &Identification, b: &Identification| {
        a.table.nodes.iter().zip(&b.table.nodes).fold(0.0, |w, (x, y)| worse(w, (x - y).abs()))
    };
    assert!(apart(&clean, &found) < 2e-9, "{:e}", apart(&clean, &found));
    assert!(found.report.fit_rms < 2.0 * clean.report.fit_rms, "{:e}", found.report.fit_rms);
}

/// Sixteen curves at 2 and 8 kV/s in turn, at 10 kHz, on the same table; dead time 0.3 ms, noise 2 nm.
fn late(defect: impl FnOnce(&mut [f64])) -> Identification {
    let curve = |drive: Drive, k: u32| {
        let slope = if k.is_multiple_of(2) { 2000.0 } else { 8000.0 };
        drive.ramp(6.25 * f64::from(k), slope).ramp(0.0, slope)
    };
    let drive = (1..=16).fold(Drive::at(0.0, 1e4).hold(0.05), curve);
    let mut random = generator(5);
    let y = response(&random_table(8, RANGE, 40e-6, 0.3, 7), &drive.samples);
    let mut late: Vec<f64> = (0..y.len()).map(|k| y[k.saturating_sub(3)] + 2e-9 * normal(&mut random)).collect();
    defect(&mut late);
    let record = Record::from_columns("late.csv", drive.time(), drive.samples, late).unwrap();
    identify(&record, &Options::new(8, RANGE)).unwrap()
}

/// A few spikes anywhere, a hum of any frequency, a step anywhere.
#[test]
fn spikes_hum_and_steps_are_named_and_spoil_neither_dead_time_nor_table() {
    let clean = late(|_| {});
    assert!(clean.warnings.is_empty() && (clean.report.dead_time - 3e-4).abs() < 2e-5, "{:#?}", clean.report);
    let check = |code: &str, found: &Identification| {
        expect(&found.warnings, code, "");
        let apart = clean.table.nodes.iter().zip(&found.table.nodes).fold(0.0, |w, (x, y)| worse(w, (x - y).abs()));
        let later = (found.report.dead_time / clean.report.dead_time - 1.0).abs();
        assert!(later < 0.1 && apart < 40e-9, "{code}: {later} {apart:e} {:#?}", found.warnings);
    };
    for seed in 0..length(1, 30) {
        let mut random = generator(seed);
        let mut place = |from: f64, to: f64| from + (to - from) * uniform(&mut random);
        let spikes = |count: usize, samples: usize, height: f64, place: &mut dyn FnMut(f64, f64) -> f64| {
            let at: Vec<usize> = (0..count).map(|_| place(600.0, 4900.0) as usize).collect();
            late(|y| at.iter().for_each(|at| y[*at..at + samples].iter_mut().for_each(|y| *y += height)))
        };
        check("W0517", &spikes(3, 1, 3e-6, &mut place));
        check("W0517", &spikes(6, 5, -1e-6, &mut place));
        let frequency = place(30.0, 2000.0);
        check(
            "W0521",
            &late(|y| (0..).zip(y).for_each(|(k, y)| *y += 50e-9 * (6.28e-4 * frequency * f64::from(k)).sin())),
        );
        let at = place(600.0, 4900.0) as usize;
        check("W0520", &late(|y| y[at..].iter_mut().for_each(|y| *y += 0.4e-6)));
    }
    let mut random = generator(3);
    let noisy = late(|y| y.iter_mut().for_each(|y| *y += 30e-9 * normal(&mut random)));
    assert!((noisy.report.dead_time - 3e-4).abs() < 5e-5, "{:#?}", noisy.report);
}

#[test]
fn what_follows_a_jump_of_the_drive_gets_no_weight() {
    let found = with(|c| {
        // Behind a return to zero the drive jumps to 60 V and back, and the actuator rings.
        let at = c.time.len();
        for k in 0..400 {
            c.time.push((at + k) as f64 / RATE);
            c.drive.push(if k < 200 { 60.0 } else { 0.0 });
            let swing = 8e-6 * (0.9 * k as f64).cos() * (-(k as f64 % 200.0) / 40.0).exp();
            c.displacement.push(if k < 200 { 25e-6 } else { 1e-6 } + swing);
        }
    })
    .unwrap();
    expect(&found.warnings, "W0518", "at 17.009 s the drive jumps from 0 V to 60 V");
    // Its time constant is 40 ms: 4.6 of them after each jump. The record ends with the second ring.
    assert!((360..=380).contains(&found.report.weightless), "{}", found.report.weightless);
}

#[test]
fn the_part_of_the_plane_that_no_curve_enters_is_given_as_regions_and_drawn_hatched() {
    let tops = [6.25, 12.5, 18.75, 25.0, 75.0, 81.25, 87.5, 93.75, 100.0];
    let drive = tops.iter().fold(Drive::at(0.0, RATE), |d, top| d.ramp(*top, 100.0).ramp(0.0, 100.0));
    let table = random_table(16, RANGE, 40e-6, 0.3, 7);
    let y = response(&table, &drive.samples);
    let record = Record::from_columns("r.csv", drive.time(), drive.samples.clone(), y).unwrap();
    let found = identify(&record, &Options::new(16, RANGE)).unwrap();
    expect(&found.warnings, "W0609", "No weight is added to these sums");
    let region = &found.report.unexcited[0];
    assert_eq!(region.up, [25.0, 75.0]);
    assert_eq!(found.report.unexcited.iter().map(|r| r.cells).sum::<usize>(), region.cells);
    assert!((region.share - (1.0 - found.report.excited_share)).abs() < 1e-12);
    // The sums that the record does hold are kept: the curves at measured voltages are those of the truth.
    for up in [4, 12, 13, 16] {
        let (truth, fitted) = (table.node(up, 0), found.table.node(up, 0));
        assert!((truth - fitted).abs() < 1e-3 * table.node(16, 0), "{up}: {truth:e} {fitted:e}");
    }
    let svg = identification::everett(&found, None, None);
    assert_eq!(svg.matches("url(#hatch)").count(), region.cells + 1, "each cell, and the legend");
}

#[test]
fn cross_validation_prefers_the_grid_that_the_truth_has() {
    let drive = Drive::at(0.0, RATE).reversal_curves(32, RANGE, 200.0);
    let mut random = generator(5);
    let table = random_table(16, RANGE, 40e-6, 0.8, 7);
    let y = response(&table, &drive.samples).into_iter().map(|y| y + 2e-9 * normal(&mut random)).collect();
    let record = Record::from_columns("r.csv", drive.time(), drive.samples.clone(), y).unwrap();
    let choice = choose_grid(&record, RANGE, DeadTime::Fixed(0.0)).unwrap();
    println!("{:#?}", choice.scores);
    assert_eq!((choice.chosen, choice.levels, choice.folds), (16, 32, 5));
    let error = |grid| choice.scores.iter().find(|s| s.grid == grid).unwrap().held_out_rms;
    assert!(error(8) > 3.0 * error(16) && error(16) < error(12), "{:?}", choice.scores);
    if length(false, true) {
        assert_eq!(choice, choose_grid(&record, RANGE, DeadTime::Fixed(0.0)).unwrap(), "two runs");
    }
    // Two voltages leave nothing to hold out.
    let few = [50.0, 100.0, 50.0, 100.0].iter().fold(Drive::at(0.0, RATE), |d, u| d.ramp(*u, 100.0).ramp(0.0, 100.0));
    let y = response(&table, &few.samples);
    let record = Record::from_columns("r.csv", few.time(), few.samples.clone(), y).unwrap();
    expect(&choose_grid(&record, RANGE, DeadTime::Fixed(0.0)).unwrap_err(), "E0622", "at 2 different voltages");
}

/// Not only reversal curves: a random walk between random voltages.
#[test]
fn a_random_drive_is_cross_validated_too() {
    let mut random = generator(3);
    let mut drive = Drive::at(0.0, RATE).ramp(100.0, 400.0).ramp(0.0, 400.0);
    for _ in 0..120 {
        drive = drive.ramp(100.0 * uniform(&mut random), 400.0).ramp(100.0 * uniform(&mut random) * 0.5, 400.0);
    }
    drive = drive.ramp(100.0, 400.0).ramp(0.0, 400.0);
    let table = random_table(8, RANGE, 40e-6, 0.8, 7);
    let y = response(&table, &drive.samples);
    let record = Record::from_columns("r.csv", drive.time(), drive.samples.clone(), y).unwrap();
    let choice = choose_grid(&record, RANGE, DeadTime::Fixed(0.0)).unwrap();
    println!("{:#?}", choice.scores);
    assert!([8, 16, 24].contains(&choice.chosen), "a multiple of the truth's 8: {}", choice.chosen);
}

#[test]
fn the_cause_of_the_residual_is_named() {
    // A dead time that the record does not show (one rate) and that is held at zero.
    let late = with(|c| {
        let y = c.displacement.clone();
        c.displacement[5..].copy_from_slice(&y[..y.len() - 5]);
    })
    .unwrap();
    assert!(late.report.cause.shares.iter().any(|(s, share)| *s == Source::DeadTime && *share >= 0.0));
    // On another record at twice the rate the table errs by what the dead time adds.
    let turns = [100.0, 0.0, 60.0, 20.0, 100.0, 0.0];
    let fast = turns.iter().fold(Drive::at(0.0, RATE), |drive, turn| drive.ramp(*turn, 800.0));
    let y = response(&random_table(8, RANGE, 40e-6, 0.3, 7), &fast.samples);
    let mut moved = y.clone();
    moved[5..].copy_from_slice(&y[..y.len() - 5]);
    let record = Record::from_columns("fast.csv", fast.time(), fast.samples.clone(), moved).unwrap();
    let cause = validate(&with(|_| {}).unwrap().table, &record, 0.0).unwrap().compared.unwrap().cause;
    assert_eq!(cause.main, Source::DeadTime, "{cause:?}");
    assert!((cause.rate_delay - 5e-3).abs() < 1.5e-3, "{cause:?}");
    let noisy = with(|c| {
        let mut random = generator(2);
        c.displacement.iter_mut().for_each(|y| *y += 100e-9 * normal(&mut random));
    })
    .unwrap();
    assert_eq!(noisy.report.cause.main, Source::Noise, "{:?}", noisy.report.cause);
}

#[test]
fn a_sweep_that_cannot_tell_says_so() {
    // 40 kV/s at 1 kHz: one sample is 40 V.
    let fast =
        (1..=16).fold(Drive::at(0.0, RATE), |d, k| d.ramp(6.25 * f64::from(k), 4000.0).ramp(0.0, 4000.0).hold(0.02));
    let y = response(&random_table(8, RANGE, 40e-6, 0.3, 7), &fast.samples);
    let record = Record::from_columns("fast.csv", fast.time(), fast.samples.clone(), y).unwrap();
    let found = identify(&record, &Options::new(8, RANGE)).unwrap();
    expect(&found.warnings, "W0620", "V/s, where a dead time of");
    let dense = Drive::at(0.0, RATE).reversal_curves(64, RANGE, 400.0);
    let mut random = generator(4);
    let y = response(&random_table(8, RANGE, 4e-6, 0.3, 7), &dense.samples);
    let y = y.into_iter().map(|y| y + 60e-9 * normal(&mut random)).collect();
    let record = Record::from_columns("dense.csv", dense.time(), dense.samples.clone(), y).unwrap();
    let found = identify(&record, &Options::new(8, RANGE)).unwrap();
    expect(&found.warnings, "W0621", "turn back 1.562 V apart");
}
