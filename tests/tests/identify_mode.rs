//! A mode behind the table, on records of the reference leg with a lightly damped resonance: its hysteresis and creep (plays,
//! thresholds, asymmetry) are of no model's class that is fitted here. The mode is found in the ring of the records themselves.

use crate::identify_support::{generator, normal};
use core::f64::consts::TAU;
use host_sim::plant::{LegParameters, LegPlant};
use specgen::identify::mode::ring;
use specgen::identify::rate::{RateModel, RateOption, identify_rate};
use specgen::identify::response::respond;
use specgen::identify::{Drive, Input, Options, PredictionError, Record, Source, predict};
use std::fmt::Write as _;

const SAMPLE: f64 = 1e-4;

fn leg() -> LegPlant {
    let reference = LegParameters::reference();
    LegPlant::new(&LegParameters { fn_hz: 735.0, zeta: 0.015, tau_amp_s: 6e-5, ..reference })
}

/// The displacement at the beginning of each sample, whose drive is held until the next, with 1.5 nm of noise; at 50 V before.
fn record(name: &str, drive: Vec<f64>, seed: u64) -> Record {
    let mut plant = leg();
    plant.hold(50.0, 0.05);
    let mut random = generator(seed);
    let displacement = drive
        .iter()
        .map(|u| {
            let y = plant.displacement();
            plant.hold(*u, SAMPLE);
            y + 1.5e-9 * normal(&mut random)
        })
        .collect();
    let time = (0..drive.len()).map(|k| k as f64 * SAMPLE).collect();
    Record::from_columns(name, time, drive, displacement).unwrap()
}

/// 60 ms of rest at 0 V behind a jump from 50 V, then reversal curves (1 − cos) of `frequency` to 1/25, 2/25 … of 100 V.
fn curves(frequency: f64, seed: u64) -> Record {
    let period = (1.0 / frequency / SAMPLE) as usize;
    let mut drive = vec![0.0; 600];
    for curve in 1..=25_usize {
        let height = 2.0 * curve as f64;
        drive.extend((1..=period).map(|k| height * (1.0 - (TAU * k as f64 / period as f64).cos())));
    }
    record(&format!("{frequency} Hz"), drive, seed)
}

/// Six lines from 11 to 600 Hz, of equal rate.
fn wide_band() -> Record {
    let lines = [11.0, 37.0, 83.0, 190.0, 410.0, 600.0];
    let at = |k: usize| {
        let t = k as f64 * SAMPLE;
        let sum: f64 = lines.iter().map(|f| (TAU * f * t + f).cos() / f).sum();
        50.0 + if t < 0.1 { t / 0.1 } else { 1.0 } * 260.0 * sum
    };
    record("wide band", (0..8000).map(at).collect(), 7)
}

/// Noise behind two low-passes of `cut` Hz, within 10 V and 90 V.
fn noise(cut: f64, samples: usize) -> Record {
    let share = 1.0 - (-TAU * cut * SAMPLE).exp();
    let mut random = generator(11);
    let (mut first, mut second) = (0.0, 0.0);
    let shape: Vec<f64> = (0..samples)
        .map(|_| {
            first += share * (normal(&mut random) - first);
            second += share * (first - second);
            second
        })
        .collect();
    let most = shape.iter().fold(0.0, |most: f64, x| if x.abs() > most { x.abs() } else { most });
    record("noise", shape.iter().map(|x| 50.0 + 40.0 * x / most).collect(), 8)
}

fn compared(model: &RateModel, record: &Record) -> PredictionError {
    predict(model, &Drive::from(record)).unwrap().compared.unwrap()
}

/// A wide-band drive and noise, by models that were fitted to reversal curves alone.
#[test]
fn a_mode_found_in_the_ring_predicts_a_drive_that_excites_it() {
    let records: Vec<Record> = [20.0, 40.0, 100.0].iter().zip(1..).map(|(f, seed)| curves(*f, seed)).collect();
    let found = ring(&records[0].time, &records[0].drive, &records[0].displacement).unwrap().mode;
    println!("ring: {found:?}");
    assert!((found.frequency - 735.0).abs() < 3.0 && (found.damping / 0.015 - 1.0).abs() < 0.1, "{found:?}");
    let found = identify_rate(&records, None, &Options::new(24, [0.0, 100.0])).unwrap();
    let model = |wanted: RateOption| &found.models.iter().find(|(option, _)| *option == wanted).unwrap().1;
    for option in &found.report.options {
        println!("{:<18} fitted {:.3?} left out {:.3?}", option.option.name(), option.fitted, option.left_out);
    }
    let record = wide_band();
    let [without, with] = [RateOption::Creep, RateOption::CreepMode].map(|option| compared(model(option), &record));
    println!("wide band: {:.3} % by creep, {:.3} % with the mode", without.rms_percent, with.rms_percent);
    println!("  {:?}, near {:?} Hz; then {:?}", without.cause.main, without.cause.resonance, with.cause.main);
    assert!(with.rms_percent < 0.95 && with.rms_percent < 0.8 * without.rms_percent);
    assert_eq!(without.cause.main, Source::Resonance);
    let [plain, moved] =
        [RateOption::Creep, RateOption::CreepMode].map(|option| compared(model(option), &noise(40.0, 8000)));
    println!("noise of 40 Hz: {:.3} % by creep, {:.3} % with the mode", plain.rms_percent, moved.rms_percent);
    assert!(moved.rms_percent < 0.75 && moved.rms_percent < 0.8 * plain.rms_percent);
    // The drive ends at 600 Hz, so that the frequency is not better known.
    assert!((without.cause.resonance.unwrap() / 735.0 - 1.0).abs() < 0.15);
}

/// Noise that makes the leg ring by more than it moves it: for a moment it goes back while the drive rises, and is where it was.
#[test]
fn a_leg_that_rings_is_not_taken_for_a_gauge_that_is_stuck() {
    assert_eq!(noise(100.0, 8000).time.len(), 8000);
}

/// Noise behind low-passes, at large amplitude: the gauge's own noise leaves coherence around the resonance and far below it, and below
/// there is hysteresis. The coherence of each bin decides, not the width of the band or the power of the drive in it.
#[test]
fn a_noise_record_shows_the_resonance_where_its_bins_are_coherent() {
    let record = noise(40.0, 100_000);
    let mut random = generator(19);
    let mut text = String::from("time_s,drive_V,displacement_um\n");
    for ((t, u), y) in record.time.iter().zip(&record.drive).zip(&record.displacement) {
        writeln!(text, "{t:?},{u:?},{:?}", y * 1e6 + 0.6 * normal(&mut random)).unwrap();
    }
    let found = respond(Input::Text(&text), "noise.csv", None).unwrap_or_else(|d| panic!("{d:#?}")).value;
    let (low, high, fitted, left_out) = (found.band[0], found.band[1], found.fitted, found.left_out.len());
    println!("{low:.0} to {high:.0} Hz, {fitted:?}, left out {left_out:?}");
    let fitted = found.fitted;
    assert!((fitted.resonance.value / 735.0 - 1.0).abs() < 0.01, "{fitted:?}");
    assert!((0.7..1.5).contains(&(fitted.damping_ratio.value / 0.015)), "{fitted:?}");
    // Left out are bins around the resonance, too.
    assert!(found.left_out.iter().any(|band| band.high > 0.7 * 735.0 && band.high < 1.3 * 735.0), "{found:?}");
}
