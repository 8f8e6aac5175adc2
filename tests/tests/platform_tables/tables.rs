//! Tables 5 to 9: the reference machine, and random ones.

use host_sim::platform::scenario::{FREE_MODES, MACHINING_MODES};
use host_sim::platform::table::{MachiningTable, PoseRow, PoseTable, paper_rms};
use host_sim::platform::{Specimen, WorkPart};
use host_sim::trajectory::{PaperPath, PaperPose};
use specgen_runtime::ControlMode;
use specgen_tests::{length, repository, worse};

use super::bench::{Bench, in_parallel, median, plants, random_machines, reference_machine};

const CASES: [(&str, PaperPath); 2] = [("case-1", PaperPath::Case1), ("case-2", PaperPath::Case2)];
#[allow(clippy::type_complexity)] // A table of two.
const PARTS: [(&str, fn() -> WorkPart); 2] = [("glass", WorkPart::glass), ("aluminium", WorkPart::aluminium)];

/// Cases 1 and 2 at some frequencies with P and F, and case 1 with F alone.
fn free_motion(bench: &Bench, frequencies: &[f64]) -> PoseTable {
    let (scenario, mut controller) = (bench.scenario(), bench.controller());
    let mut table = PoseTable::default();
    for (name, path) in CASES {
        for &frequency in frequencies {
            let trajectory = PaperPose::corrected(path, frequency);
            // No ranking is asked of F alone but in case 1 above the noise.
            let alone: &[_] = if name == "case-1" && frequency > 0.5 { &ControlMode::WORDS[2..4] } else { &[] };
            let modes: Vec<_> = FREE_MODES.iter().chain(alone).copied().collect();
            let runs = scenario.free_motion(&mut controller, &modes, (name, frequency), &trajectory).expect("a run");
            table.rows.extend(runs.rows);
        }
    }
    table
}

fn machining(bench: &Bench) -> MachiningTable {
    let parts = PARTS.map(|(name, part)| (name, part()));
    let path = PaperPose::corrected(PaperPath::Machining, 1.0);
    // In the short run one part with the best of the laws.
    let best: Vec<_> = MACHINING_MODES.into_iter().filter(|(mode, _)| *mode == "pf-pcc").collect();
    let (modes, parts) = length((&best[..], &parts[..1]), (&MACHINING_MODES, &parts));
    bench.scenario().machining(&mut bench.controller(), modes, parts, &path).expect("a run")
}

/// Every value of Tables 5 to 8 at most the paper's.
#[track_caller]
fn below_the_paper(table: &PoseTable) -> f64 {
    let mut closest = 0.0;
    // The paper has no F alone.
    let of_the_paper: Vec<&PoseRow> = table.rows.iter().filter(|row| row.mode.starts_with("pf-")).collect();
    assert!(of_the_paper.len() >= CASES.len() * FREE_MODES.len(), "{} rows", of_the_paper.len());
    for PoseRow { trajectory, mode, frequency_hz, rms_nano, .. } in of_the_paper {
        let paper = paper_rms(trajectory, mode, *frequency_hz).expect("the paper made this run");
        for (axis, (ours, paper)) in rms_nano.iter().zip(paper).enumerate() {
            assert!(*ours <= paper, "{trajectory} {frequency_hz} Hz {mode}, axis {axis}: {ours} above {paper}");
            closest = worse(closest, ours / paper);
        }
    }
    closest
}

fn translation(table: &PoseTable, case: &str, mode: &str, frequency: f64) -> f64 {
    table.row(case, mode, frequency).expect("the run was made").translation_nm()
}

#[test]
fn tables_5_to_9_on_the_reference_machine() {
    let bench = reference_machine();
    let mut table = free_motion(bench, length(&[10.0], &[0.1, 1.0, 10.0]));
    println!("closest to the paper: {:.3} of it", below_the_paper(&table));
    if length(true, false) {
        let trajectory = PaperPose::corrected(PaperPath::Case1, 1.0);
        let best: Vec<_> = FREE_MODES.into_iter().filter(|(mode, _)| *mode == "pf-pcc").collect();
        let runs = bench.scenario().free_motion(&mut bench.controller(), &best, ("case-1", 1.0), &trajectory);
        table.rows.extend(runs.expect("a run").rows);
    }
    println!("{}", table.to_text(true));
    let found = translation(&table, "case-1", "pf-pcc", 1.0);
    println!("P+PCC, case 1 at 1 Hz: {found:.2} nm (at most 4)");
    assert!(found <= 4.0, "{found} nm");
    let table = machining(bench);
    println!("{}", table.to_text(true));
    for (part, _) in PARTS.into_iter().take(length(1, 2)) {
        let row = table.row(part, "pf-pcc").expect("the run was made");
        assert!(row.translation_nm <= 3.0 && row.orientation_nrad <= 25.0, "{row:?}");
    }
}

#[test]
fn case_1_at_10_hz_on_the_reference_machine() {
    let bench = reference_machine();
    let run =
        bench.scenario().run(&mut bench.controller(), &PaperPose::corrected(PaperPath::Case1, 10.0)).expect("a run");
    let found = run.errors.rms_translation_nm();
    println!("P+PCC, case 1 at 10 Hz: {found:.2} nm (at most 25)");
    assert!(found <= 25.0, "{found} nm");
}

/// `specgen sim specs/reference.toml --paper` shows another figure than the test above: of the same machine, but the spec has one
/// record for its six legs, where the test has a record of each.
#[test]
fn one_record_for_six_legs_gives_the_figure_of_sim() {
    let record =
        std::fs::read_to_string(repository().join("specs/records/reference-forc.csv")).expect("the record of the spec");
    let records = std::array::from_fn(|_| record.clone());
    let bench = Bench::with_records("tables-one-record", Specimen::reference(), &records, &[]);
    let run =
        bench.scenario().run(&mut bench.controller(), &PaperPose::corrected(PaperPath::Case1, 10.0)).expect("a run");
    let found = run.errors.rms_translation_nm();
    println!("P+PCC, case 1 at 10 Hz, one record: {found:.2} nm (sim: 29.14)");
    assert!((found - 29.14).abs() < 0.5, "{found} nm");
}

#[test]
#[ignore = "long: tables of random machines; the reference machine's are in the short run"]
fn tables_5_to_8_on_random_machines() {
    let machines = random_machines();
    // At 1 Hz on the reference machine alone in the short run.
    let frequencies = length(&[10.0][..], &[1.0, 10.0]);
    let tables = in_parallel(plants(), |number| free_motion(&machines[number as usize].notched, frequencies));
    let mut closest: f64 = 0.0;
    for (table, machine) in tables.iter().zip(machines) {
        let nominal = &machine.notched.specimen.nominal;
        print!("k_a {:.2e} ζ {:.3}:", nominal.axial_stiffness_n_per_m, nominal.modal_damping);
        for (case, frequency) in CASES.iter().flat_map(|(case, _)| frequencies.iter().map(move |one| (case, *one))) {
            let [a, b, c] = FREE_MODES.map(|(mode, _)| translation(table, case, mode, frequency));
            print!(" {case} {frequency} Hz {a:.1} {b:.1} {c:.1} |");
        }
        println!(" nm Invhys, EWMA, PCC");
        closest = worse(closest, below_the_paper(table));
    }
    println!("closest to the paper: {closest:.3} of it");

    let ratios = |case: &str, frequency: f64, over: &str, under: &str| -> Vec<f64> {
        let ratio = |table| translation(table, case, over, frequency) / translation(table, case, under, frequency);
        let ratios: Vec<f64> = tables.iter().map(ratio).collect();
        let (low, high) = extremes(&ratios);
        println!("{case} {frequency} Hz {over}/{under}: {low:.3} to {high:.3}, median {:.3}", median(ratios.clone()));
        ratios
    };
    for &frequency in frequencies {
        let gained = ratios("case-1", frequency, "pf-invhys", "pf-ewma");
        assert!(extremes(&gained).0 >= 1.3);
        // A few machines have no median.
        if length(false, true) {
            assert!(median(gained) >= 2.0);
        }
        for case in ["case-1", "case-2"] {
            assert!(extremes(&ratios(case, frequency, "pf-pcc", "pf-ewma")).1 <= 1.05);
        }
        ratios("case-2", frequency, "pf-invhys", "pf-ewma");
        assert!(extremes(&ratios("case-1", frequency, "f-pcc", "f-ewma")).1 < 1.0);
    }
    for &frequency in frequencies {
        let limit = if frequency == 1.0 { 8.0 } else { 60.0 };
        let found: Vec<f64> = tables.iter().map(|table| translation(table, "case-1", "pf-pcc", frequency)).collect();
        let (low, high) = extremes(&found);
        println!("P+PCC, case 1 at {frequency} Hz: {low:.2} to {high:.2} nm (at most {limit})");
        assert!(high <= limit);
    }
}

#[test]
#[ignore = "long: machining on random machines; the reference machine's is in the short run"]
fn table_9_on_random_machines() {
    let machines = random_machines();
    let tables = in_parallel(plants(), |number| machining(&machines[number as usize].notched));
    for (part, _) in PARTS {
        let mut columns: [Vec<f64>; 4] = Default::default();
        for (table, machine) in tables.iter().zip(machines) {
            let [p, both] = ["p", "pf-pcc"].map(|mode| table.row(part, mode).expect("the run was made"));
            let [nm, nrad] = table.ratio(part, "p", "pf-pcc").expect("the runs were made");
            let nominal = &machine.notched.specimen.nominal;
            let (stiffness, damping) = (nominal.axial_stiffness_n_per_m, nominal.modal_damping);
            let (p_nm, p_nrad, both_nm) = (p.translation_nm, p.orientation_nrad, both.translation_nm);
            let both_nrad = both.orientation_nrad;
            println!(
                "{part:<9} k_a {stiffness:.2e} ζ {damping:.3}: P {p_nm:.1} nm {p_nrad:.0} nrad, P/F {both_nm:.2} nm {both_nrad:.1} nrad, ratios {nm:.2} {nrad:.2}"
            );
            for (column, value) in columns.iter_mut().zip([nm, nrad, both.translation_nm, both.orientation_nrad]) {
                column.push(value);
            }
        }
        let [nm, nrad, translation, orientation] = columns.map(|column| {
            let ((low, high), middle) = (extremes(&column), median(column));
            (low, high, middle)
        });
        println!(
            "{part}: lowest, highest, median: ratios {nm:.2?} {nrad:.2?}, P/F {translation:.2?} nm {orientation:.1?} nrad"
        );
        assert!(nm.0 >= 3.0 && nm.2 >= 5.0, "{part}: translation ratio {nm:?}");
        assert!(nrad.0 >= 2.0 && nrad.2 >= 3.5, "{part}: orientation ratio {nrad:?}");
        assert!(translation.1 <= 10.0 && translation.2 <= 3.0, "{part}: translation {translation:?}");
        assert!(orientation.1 <= 100.0 && orientation.2 <= 25.0, "{part}: orientation {orientation:?}");
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}
