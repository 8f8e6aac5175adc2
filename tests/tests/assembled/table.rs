//! A table identified from the planned drive on the assembled machine's recorder, against that of a perfect record of the
//! same leg. Simulation.

use super::{plan, reference};
use host_sim::noise::Gaussian;
use host_sim::plant::{LegParameters, LegPlant};
use specgen::everett::EverettTable;
use specgen::identify::assembled::{Drive, Kind, Plan};
use specgen::identify::{DeadTime, Identification, Options, Record, identify};
use specgen_tests::{leg_class, length};

const TICK: f64 = 1e-4;
/// Ticks between the first row and the start of the wave: rows are not aligned with it.
const BEFORE: usize = 137;
/// rms of a reading, m; drift, m/s; amplitude of the mains, m.
const NOISE: f64 = 2.2e-9;
const DRIFT: f64 = 1e-9;
const MAINS: f64 = 5e-9;

/// What is seen at each row of a record: mean voltage and displacement.
type Rows = Vec<[f64; 2]>;

/// The drives of a leg up to the first curves, and the rows of these.
fn record(found: &Plan, leg: &LegParameters, seed: Option<u64>) -> (Drive, Rows) {
    let mut plant = LegPlant::new(leg);
    let mut noise = Gaussian::new(NOISE, seed.unwrap_or(0), 0);
    let mut ticks = 0_u32;
    let mut read = |plant: &LegPlant| {
        ticks += 1;
        let time = f64::from(ticks) * TICK;
        let hum = MAINS * (std::f64::consts::TAU * 50.0 * time + 0.7).sin();
        plant.displacement() + if seed.is_some() { noise.draw() + DRIFT * time + hum } else { 0.0 }
    };
    for drive in found.drives.iter().filter(|drive| drive.legs == [0] && drive.kind != Kind::CrossTalk) {
        let every = drive.average as usize;
        let (mut rows, mut sums) = (Vec::new(), [0.0; 2]);
        let count = BEFORE + (drive.seconds() / TICK).round() as usize + 3 * every;
        for tick in 1..=count / every * every {
            let volts = drive.voltage(tick as f64 - BEFORE as f64);
            plant.hold(volts, TICK);
            let seen = read(&plant);
            sums = [sums[0] + volts, sums[1] + seen];
            if tick % every == 0 {
                rows.push(sums.map(|sum| sum / every as f64));
                sums = [0.0; 2];
            }
        }
        if matches!(drive.kind, Kind::Curves { .. }) {
            return (drive.clone(), rows);
        }
        plant.hold(drive.voltage(0.0), drive.rest_before);
    }
    unreachable!("the plan has curves");
}

fn identified(drive: &Drive, [time, volts, seen]: [Vec<f64>; 3]) -> Identification {
    let Kind::Curves { grid, .. } = drive.kind else { unreachable!() };
    let record = Record::from_columns("leg0.csv", time, volts, seen).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let options = Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(grid, drive.range) };
    identify(&record, &options).unwrap_or_else(|findings| panic!("{findings:#?}"))
}

/// Scale of `found` over `truth`, and rms and maximum of the rest, m.
fn compared(found: &EverettTable, truth: &EverettTable) -> [f64; 3] {
    let pairs = || found.nodes.iter().zip(&truth.nodes);
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs().fold(0.0, |sum, (found, truth)| sum + of(*found, *truth));
    let scale = sum(&|found, truth| found * truth) / sum(&|_, truth| truth * truth);
    let rms = (sum(&|found, truth| (found / scale - truth).powi(2)) / found.nodes.len() as f64).sqrt();
    [scale, rms, pairs().fold(0.0, |most: f64, (found, truth)| most.max((found / scale - truth).abs()))]
}

#[test]
fn the_planned_curves_identify_the_table_of_a_perfect_record() {
    let found = plan(&reference(), 32, false).unwrap();
    for class in 0..length(1, 3) {
        let leg = leg_class(class);
        // The same leg without amplifier and mode, and without noise, drift and mains; in the same rows.
        let still = LegParameters { tau_amp_s: 1e-6, fn_hz: 2e5, zeta: 0.7, ..leg.clone() };
        // The plant holds each voltage of a tick before its end: half a tick early.
        let lag = leg.tau_amp_s + 2.0 * leg.zeta / (std::f64::consts::TAU * leg.fn_hz) - 0.5 * TICK;
        let table = |leg: &LegParameters, seed: Option<u64>, lag: f64| {
            let (drive, rows) = record(&found, leg, seed);
            let [volts, seen] = [0, 1].map(|column| rows.iter().map(|row| row[column]).collect::<Vec<_>>());
            // As a device sends them.
            let volts: Vec<f64> = volts.iter().map(|volts| f64::from(*volts as f32)).collect();
            let first = drive.first_tick(&volts);
            assert_eq!(first, -(BEFORE as f64), "class {class}");
            identified(&drive, drive.nodes(first, &seen, lag, 50.0).expect("all rows"))
        };
        let (perfect, measured) = (table(&still, None, 0.0), table(&leg, Some(7), lag));
        let [scale, rms, most] = compared(&measured.table, &perfect.table);
        println!(
            "legs of class {class}: shape {:.2} nm rms, {:.1} nm at most, scale {:+.3} %; {} curves, excited {:.3}",
            rms * 1e9,
            most * 1e9,
            100.0 * (scale - 1.0),
            measured.report.reversal_curves,
            measured.report.excited_share
        );
        assert!(measured.warnings.is_empty(), "{:?}", measured.warnings);
        assert_eq!((measured.report.reversal_curves, measured.report.excited_share), (32, 1.0));
        assert!(rms <= 1.5e-9 && most <= 8e-9 && (scale - 1.0).abs() <= 5e-3, "class {class}");
    }
}
