//! The paper's Tables 1 and 2, from the emitted controller on the reference plant: our figures against the paper's and
//! against the study of the same plant. `cargo test --release -p specgen-tests paper_tables -- --nocapture` prints them.

use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant, NoiseParameters};
use host_sim::scenario::{LINEARITY_FREQUENCIES, LegScenario, MODES, TRACKING_FREQUENCIES};
use host_sim::table::TrackingTable;
use specgen_tests::Emitted;

const SAMPLES_PER_PERIOD: u32 = 500;
const SEED: u64 = 1;

fn scenario(noise: &NoiseParameters, seed: u64) -> LegScenario {
    let legs = std::array::from_fn(|_| LegParameters::reference());
    LegScenario::new(&legs, noise, seed, SAMPLES_PER_PERIOD)
}

fn row(table: &TrackingTable, mode: &str) -> [f64; 3] {
    let row = TRACKING_FREQUENCIES.map(|frequency| table.rmse_nm(mode, frequency).expect("the run was made"));
    println!("{mode:<8} {:.2} {:.2} {:.2} nm", row[0], row[1], row[2]);
    row
}

#[track_caller]
fn within(what: &str, ours: [f64; 3], expected: [f64; 3], share: f64) {
    for (ours, expected) in ours.iter().zip(expected) {
        assert!((ours / expected - 1.0).abs() <= share, "{what}: {ours:.2} against {expected:.2} nm");
    }
}

#[track_caller]
fn at_most(what: &str, ours: [f64; 3], limit: [f64; 3]) {
    for (ours, limit) in ours.iter().zip(limit) {
        assert!(*ours <= limit, "{what}: {ours:.2} above {limit:.2} nm");
    }
}

#[test]
fn table_2_on_the_reference_plant() {
    let mut controller = Emitted::new("paper", "legs.toml", &[]).at_run_time();
    let noise = LegParameters::reference().noise;
    for seed in [SEED, 2, 3].into_iter().take(specgen_tests::length(1, 3)) {
        let table = scenario(&noise, seed).tracking(&mut controller, &MODES, &TRACKING_FREQUENCIES).expect("a run");
        let (invhys, ewma, pcc) = (row(&table, "invhys"), row(&table, "ewma"), row(&table, "pcc"));
        within("Invhys against the paper", invhys, [127.0, 232.0, 504.5], 0.10);
        at_most("EWMA against the paper", ewma, [103.086, 117.305, 191.409]);
        at_most("PCC against the paper", pcc, [80.5, 81.783, 156.25]);
        at_most("EWMA", ewma, [9.0, 18.0, 30.0]);
        at_most("PCC", pcc, [8.0, 14.0, 25.0]);
        for k in 0..3 {
            assert!(invhys[k] > ewma[k] && ewma[k] > pcc[k], "ranking at {} Hz", TRACKING_FREQUENCIES[k]);
        }
    }
}

#[test]
fn table_2_in_f32_differs_by_less_than_the_noise() {
    let edits = [("scalar   = \"f64\"", "scalar   = \"f32\"")];
    let mut controller = Emitted::new("paper-f32", "legs.toml", &edits).at_run_time();
    let mut reference = Emitted::new("paper-f64", "legs.toml", &[]).at_run_time();
    let noise = LegParameters::reference().noise;
    let scenario = scenario(&noise, SEED);
    let single = scenario.tracking(&mut controller, &MODES, &TRACKING_FREQUENCIES).expect("a run");
    let double = scenario.tracking(&mut reference, &MODES, &TRACKING_FREQUENCIES).expect("a run");
    for mode in ["invhys", "ewma", "pcc"] {
        let (a, b) = (row(&single, mode), row(&double, mode));
        for k in 0..3 {
            assert!((a[k] - b[k]).abs() < 0.5, "{mode}: {} against {} nm", a[k], b[k]);
        }
    }
}

#[test]
fn the_study_without_noise_on_a_grid_of_16() {
    let mut leg = LegPlant::new(&LegParameters::reference());
    let mut gauge = Gauge::new(&NoiseParameters::NONE, SEED, 0);
    let record = ReversalExperiment::reference(16).run(&mut leg, &mut gauge).to_csv();
    let edits = [("grid    = 32", "grid    = 16"), ("records/reference-forc.csv", "records/clean-16.csv")];
    let emitted = Emitted::with_records("clean-16", "legs.toml", &edits, &[("clean-16.csv", record)]);
    let mut controller = emitted.at_run_time();
    let table =
        scenario(&NoiseParameters::NONE, SEED).tracking(&mut controller, &MODES, &TRACKING_FREQUENCIES).expect("a run");
    within("Invhys", row(&table, "invhys"), [142.3, 230.0, 495.5], 0.05);
    within("EWMA", row(&table, "ewma"), [9.00, 12.91, 21.81], 0.05);
    within("PCC", row(&table, "pcc"), [8.57, 10.96, 18.14], 0.05);
}

#[test]
fn table_1_slope_ratios() {
    let mut controller = Emitted::new("slopes", "legs.toml", &[]).at_run_time();
    let noise = LegParameters::reference().noise;
    let table = scenario(&noise, SEED).linearity(&mut controller, &LINEARITY_FREQUENCIES).expect("a run");
    let paper = [1.0, 0.9844, 0.9797, 0.9774, 0.9735, 0.9704];
    assert_eq!(table.rows.len(), paper.len());
    for (row, paper) in table.rows.iter().zip(paper) {
        println!("{} Hz: {:.4} ({paper})", row.frequency_hz, row.relative_slope);
        assert!((row.relative_slope / paper - 1.0).abs() <= 0.01, "{} Hz: {}", row.frequency_hz, row.relative_slope);
    }
}
