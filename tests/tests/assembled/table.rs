//! Tables that `specgen commission` identifies from the records of assembled machines, against those of perfect records of the
//! same legs alone. Simulation.

use super::machine::{Machine, TICK};
use super::{reference, roomy};
use specgen::everett::EverettTable;
use specgen::identify::assembled::{Drive, Kind, Plan};
use specgen::identify::{DeadTime, Options, Record, identify};
use specgen::model::LegModelKind;
use specgen::operate::commission::{legs, plan};
use specgen_tests::{compile_text, edited, length, scratch, worse};

fn identified(drive: &Drive, [time, volts, seen]: [Vec<f64>; 3]) -> EverettTable {
    let Kind::Curves { grid, .. } = drive.kind else { unreachable!() };
    let record = Record::from_columns("leg0.csv", time, volts, seen).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let options = Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(grid, [0.0, 100.0]) };
    identify(&record, &options).unwrap_or_else(|findings| panic!("{findings:#?}")).table
}

/// Of a perfect record: the same rows and estimator, and rows of 1 ms and the usual fit.
fn references(machine: &Machine, plan: &Plan) -> [EverettTable; 2] {
    let (drive, [_, seen]) = machine.perfect(plan, None);
    let nodes = drive.nodes(-(machine.before as f64), &seen, 0.0, plan.mains).expect("all rows");
    let (fine, [volts, seen]) = machine.perfect(plan, Some(10));
    let time = (0..volts.len()).map(|row| row as f64 * 10.0 * TICK).collect();
    [identified(&drive, nodes), identified(&fine, [time, volts, seen])]
}

/// Scale of `found` over `truth`, and rms and maximum of the rest, m.
fn compared(found: &EverettTable, truth: &EverettTable) -> [f64; 3] {
    let pairs = || found.nodes.iter().zip(&truth.nodes);
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs().fold(0.0, |sum, (found, truth)| sum + of(*found, *truth));
    let scale = sum(&|found, truth| found * truth) / sum(&|_, truth| truth * truth);
    let rms = (sum(&|found, truth| (found / scale - truth).powi(2)) / found.nodes.len() as f64).sqrt();
    [scale, rms, pairs().fold(0.0, |most: f64, (found, truth)| most.max((found / scale - truth).abs()))]
}

/// The worst of scale − 1, shape rms and maximum of six legs, against both references.
fn worst(machine: &Machine, pairs: bool) -> [[f64; 3]; 2] {
    let compiled = compile_text(&edited("reference.toml", &[])).unwrap();
    let gain = reference().stroke[0] / 100.0;
    let single = plan::of(&compiled, gain, 32, 50.0, false).unwrap_or_else(|failure| panic!("{}", failure.message()));
    let planned = if pairs { specgen::identify::assembled::plan(&roomy(), 32, true).unwrap() } else { single };
    let folder = scratch("assembled");
    machine.record(&planned, &folder);
    let coupling = legs::cross_talk(&folder, &planned).unwrap_or_else(|failure| panic!("{}", failure.message())).matrix;
    let found = legs::models(&folder, &compiled, &planned, (&coupling, &[machine.delay(); 6]), LegModelKind::Preisach);
    let found = found.unwrap_or_else(|failure| panic!("{}", failure.message()));
    let references = references(machine, &planned);
    let mut most = [[0.0; 3]; 2];
    for (leg, (choice, _)) in found.iter().enumerate() {
        for (most, reference) in most.iter_mut().zip(&references) {
            let [scale, rms, largest] = compared(&choice.model.table, reference);
            let values = [(scale / machine.gains[leg] - 1.0).abs(), rms, largest];
            *most = std::array::from_fn(|at| worse(most[at], values[at]));
        }
    }
    std::fs::remove_dir_all(folder).unwrap();
    for (name, [scale, rms, largest]) in
        ["the same rows and estimator", "rows of 1 ms and the usual fit"].iter().zip(&most)
    {
        println!(
            "  against {name}: shape {:.2} nm rms, {:.1} nm at most, scale {:.3} %",
            rms * 1e9,
            largest * 1e9,
            100.0 * scale
        );
    }
    most
}

/// With one leg at a time, and with pairs, on machines of all classes.
#[test]
fn commissioned_tables_are_those_of_perfect_records() {
    let bench = reference();
    for seed in 0..length(1, 6) {
        let machine = Machine::random(&bench, seed);
        for pairs in length(&[true][..], &[false, true]) {
            println!("machine {seed}, class {}, pairs {pairs}:", seed % 3);
            let [[scale, rms, largest], usual] = worst(&machine, *pairs);
            assert!(rms <= 1.5e-9 && largest <= 8e-9 && scale <= 5e-3, "machine {seed}");
            assert!(usual[1] <= 8e-9, "machine {seed}");
        }
    }
}
