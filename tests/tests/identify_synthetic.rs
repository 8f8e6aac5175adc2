//! Identification of actuators whose truth is known: exact Preisach planes, and a play-and-creep plant outside the model class.

use crate::identify_support::{Drive, generator, normal, random_table, uniform};
use specgen::everett::EverettTable;
use specgen::identify::regressor::{Plane, evaluate};
use specgen::identify::{
    Branches, DeadTime, Identified, Options, Record, Staircase, Start, identify, read_table_csv, validate,
    write_table_csv,
};

const NM: f64 = 1e-9;

/// Displacement of a table along a drive (m), from a memory.
fn response(table: &EverettTable, mut memory: Staircase, drive: &[f64]) -> Vec<f64> {
    let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
    let mut row = Vec::new();
    drive
        .iter()
        .map(|&u| {
            memory.push(u);
            plane.row(&memory, &mut row);
            evaluate(&row, &table.nodes)
        })
        .collect()
}

fn found(drive: &Drive, displacement: Vec<f64>, options: &Options) -> Identified {
    let record = Record::from_columns("made.csv", drive.time(), drive.samples.clone(), displacement).unwrap();
    identify(&record, options).unwrap_or_else(|d| panic!("{d:#?}"))
}

fn worst_node(a: &EverettTable, b: &EverettTable) -> f64 {
    a.nodes.iter().zip(&b.nodes).fold(0.0, |worst, (x, y)| f64::max(worst, (x - y).abs()))
}

fn assert_monotone(table: &EverettTable) {
    for up in 1..=table.grid {
        for down in 0..up {
            // The table holds sums of weights: their difference may miss zero by a rounding of the sum.
            assert!(table.weight(up, down) >= -1e-15 * table.node(table.grid, 0), "weight of cell {up}, {down}");
        }
    }
}

#[test]
fn a_clean_record_gives_the_exact_table() {
    let range = [0.0, 100.0];
    let truth = random_table(16, range, 40e-6, 0.3, 11);
    let drive = Drive::at(0.0, 200.0).reversal_curves(16, range, 20.0);
    let y = response(&truth, Staircase::negative_saturation(range), &drive.samples);
    let result = found(&drive, y, &Options::new(16, range));
    println!("worst node {:.4} nm", worst_node(&truth, &result.table) / NM);
    assert_eq!(result.report.branches, Branches::Descending);
    assert_eq!(result.report.excited_share, 1.0);
    assert!(worst_node(&truth, &result.table) < 0.5 * NM);
    assert!(result.report.fit_rms < 0.1 * NM);
    assert_monotone(&result.table);
}

/// Starts in the middle of the range with unknown history, jumps to the minimum, rings there, then the curves; noise,
/// offset and drift on the displacement.
#[test]
fn noise_offset_drift_and_an_irregular_start_are_tolerated() {
    let range = [-90.0, 90.0];
    for (seed, noise) in [(21, 2.0 * NM), (22, 10.0 * NM)] {
        let truth = random_table(16, range, 40e-6, 0.3, seed);
        let drive = Drive::at(13.0, 1000.0)
            .ramp(40.0, 100.0)
            .ramp(-20.0, 100.0)
            .jump(-90.0)
            .hold(0.5)
            .reversal_curves(16, range, 100.0);
        let mut history = Staircase::negative_saturation(range);
        for u in [70.0, -40.0, 55.0] {
            history.push(u);
        }
        let mut random = generator(seed);
        let jump = drive.samples.iter().position(|u| *u == -90.0).unwrap();
        let time = drive.time();
        let y: Vec<f64> = response(&truth, history, &drive.samples)
            .iter()
            .enumerate()
            .map(|(k, f)| {
                let since = k as f64 - jump as f64;
                let ringing = if since >= 0.0 { 5e-6 * (since * 0.16).cos() * (-since / 60.0).exp() } else { 0.0 };
                f + ringing + 3e-6 + 20.0 * NM * time[k] + noise * normal(&mut random)
            })
            .collect();
        let within = found(&drive, y.clone(), &Options::new(16, range));
        let result = found(&drive, y, &Options { drift: true, ..Options::new(16, range) });
        let worst = worst_node(&truth, &result.table);
        // Left in the branches, the drift of the longest one (1.8 s) is all that bends the table.
        assert!(worst_node(&truth, &within.table) < worst + 20.0 * NM * 1.8);
        println!(
            "noise {} nm: worst node {:.2} nm, noise floor {:.2} nm, drift {:.2} nm/s, skipped {}",
            noise / NM,
            worst / NM,
            result.report.noise_floor / NM,
            result.report.drift / NM,
            result.report.samples_skipped,
        );
        assert!(worst < 2.0 * noise + 4.0 * NM, "worst node {} nm", worst / NM);
        assert!((result.report.noise_floor / noise - 1.0).abs() < 0.1);
        assert!((result.report.drift - 20.0 * NM).abs() < 2.0 * NM);
        assert!(result.report.samples_skipped > jump + 400, "the ringing after the jump must not be used");
        assert_eq!(result.report.reversal_curves, 16);
        assert_monotone(&result.table);
    }
}

/// The drive column is a measurement too: every sample is a tiny reversal, and the minimum is not met exactly.
#[test]
fn noise_on_the_drive_column_is_tolerated() {
    let range = [0.0, 100.0];
    let truth = random_table(16, range, 40e-6, 0.3, 25);
    let drive = Drive::at(0.0, 1000.0).reversal_curves(16, range, 50.0);
    let y = response(&truth, Staircase::negative_saturation(range), &drive.samples);
    let mut random = generator(25);
    let measured: Vec<f64> = drive.samples.iter().map(|u| u + 0.01 * normal(&mut random)).collect();
    let record = Record::from_columns("made.csv", drive.time(), measured, y).unwrap();
    let result = identify(&record, &Options::new(16, range)).unwrap();
    let worst = worst_node(&truth, &result.table);
    println!("10 mV on the drive: worst node {:.2} nm, {} curves", worst / NM, result.report.reversal_curves);
    assert_eq!(result.report.reversal_curves, 16);
    assert_eq!(result.report.branches, Branches::Descending);
    // 10 mV are about 4 nm; the highest of noisy samples overstates each reversal by some 30 mV.
    assert!(worst < 20.0 * NM);
}

/// Random reversals instead of first-order curves: the memory is deep, and rises are needed too.
#[test]
fn a_record_of_random_reversals_identifies_the_table() {
    let range = [0.0, 100.0];
    let truth = random_table(10, range, 40e-6, 0.3, 31);
    let mut random = generator(31);
    let mut drive = Drive::at(0.0, 500.0).ramp(100.0, 100.0).ramp(0.0, 100.0);
    for _ in 0..200 {
        drive = drive.ramp(100.0 * uniform(&mut random), 100.0);
    }
    let mut y = response(&truth, Staircase::negative_saturation(range), &drive.samples);
    y.iter_mut().for_each(|y| *y += NM * normal(&mut random));
    let result = found(&drive, y, &Options::new(10, range));
    println!(
        "worst node {:.3} nm over {:?}, excited {}",
        worst_node(&truth, &result.table) / NM,
        result.report.branches,
        result.report.excited_share
    );
    assert_eq!(result.report.branches, Branches::All);
    assert!(worst_node(&truth, &result.table) < 3.0 * NM);
}

#[test]
fn a_dead_time_is_estimated_only_where_rates_differ() {
    let range = [0.0, 100.0];
    let truth = random_table(16, range, 40e-6, 0.3, 41);
    let lag = 3.4e-3;
    let of_rates = |rates: [f64; 2], dead_time: DeadTime| {
        let drive = Drive::at(0.0, 1000.0).hold(0.2);
        let drive = (1..=16).fold(drive, |drive, k| {
            let (top, rate) = (100.0 * f64::from(k) / 16.0, rates[k as usize % 2]);
            drive.ramp(top, rate).ramp(0.0, rate)
        });
        // Exact delay: the drive interpolated between samples, which are closer than the grid.
        let late: Vec<f64> = (0..drive.samples.len())
            .map(|k| {
                let at = (k as f64 - lag * 1000.0).max(0.0);
                let (i, share) = (at as usize, at.fract());
                drive.samples[i] + share * (drive.samples[(i + 1).min(k)] - drive.samples[i])
            })
            .collect();
        let mut random = generator(41);
        let y = response(&truth, Staircase::negative_saturation(range), &late)
            .iter()
            .map(|f| f + NM * normal(&mut random))
            .collect();
        found(&drive, y, &Options { dead_time, ..Options::new(16, range) })
    };
    let varied = of_rates([50.0, 400.0], DeadTime::Estimate);
    let ignored = of_rates([50.0, 400.0], DeadTime::Fixed(0.0));
    println!(
        "varied: {} s, {}; worst node {:.2} nm",
        varied.report.dead_time,
        varied.report.dead_time_basis,
        worst_node(&truth, &varied.table) / NM
    );
    assert!((varied.report.dead_time - lag).abs() < 0.1e-3, "{}", varied.report.dead_time);
    let (with, without) = (worst_node(&truth, &varied.table), worst_node(&truth, &ignored.table));
    assert!(5.0 * with < without, "worst node {} nm with, {} nm without the dead time", with / NM, without / NM);
    let single = of_rates([400.0, 400.0], DeadTime::Estimate);
    println!("single: {}", single.report.dead_time_basis);
    assert_eq!(single.report.dead_time, 0.0);
    assert!(single.report.dead_time_basis.contains("not identifiable"));
}

/// Play operators and creep, as piezo actuators show them: not a Preisach model. Thresholds in V, output in m.
struct PlayCreep {
    plays: [f64; 12],
    creep: [f64; 3],
}

impl PlayCreep {
    const RATES: [f64; 3] = [0.05, 0.5, 3.0];
    const CREEP_GAINS: [f64; 3] = [0.012, 0.008, 0.015];

    fn relaxed() -> Self {
        Self { plays: [0.0; 12], creep: [0.0; 3] }
    }

    fn step(&mut self, u: f64, dt: f64) -> f64 {
        let mut sum = 0.5 * u;
        for (k, play) in self.plays.iter_mut().enumerate() {
            let radius = 3.5 * (k + 1) as f64;
            *play = play.clamp(u - radius, u + radius);
            sum += 0.09 * (-0.18 * k as f64).exp() * *play;
        }
        for ((z, rate), gain) in self.creep.iter_mut().zip(Self::RATES).zip(Self::CREEP_GAINS) {
            *z += (1.0 - (-rate * dt).exp()) * (u - *z);
            sum += gain * *z;
        }
        0.6e-6 * (sum + 5e-4 * sum * sum)
    }

    fn run(&mut self, drive: &[f64], dt: f64) -> Vec<f64> {
        drive.iter().map(|&u| self.step(u, dt)).collect()
    }
}

/// The classical table: E(u_i, u_j) = f(u_i) − f_{u_i}(u_j), read at the nodes of the i-th fall.
fn read_at_nodes(grid: usize, range: [f64; 2], drive: &[f64], y: &[f64]) -> EverettTable {
    let mut table =
        EverettTable { grid, drive_min: range[0], drive_max: range[1], nodes: vec![0.0; grid * (grid + 1) / 2] };
    let mut at = 0;
    for up in 1..=grid {
        let top = (at..drive.len()).find(|&k| drive[k] >= table.threshold(up) - 1e-9).unwrap();
        for down in 0..up {
            at = (top..drive.len()).find(|&k| drive[k] <= table.threshold(down) + 1e-9).unwrap();
            table.nodes[EverettTable::index(up, down)] = y[top] - y[at];
            if down == 0 {
                continue;
            }
        }
        at = (top..drive.len()).find(|&k| drive[k] <= range[0]).unwrap();
    }
    table
}

#[test]
fn on_a_plant_with_creep_the_fit_agrees_with_the_table_read_at_the_nodes() {
    let (range, grid, rate) = ([0.0, 100.0], 32, 1000.0);
    let drive = Drive::at(0.0, rate).reversal_curves(grid, range, 20.0);
    let mut random = generator(51);
    let mut y = PlayCreep::relaxed().run(&drive.samples, 1.0 / rate);
    let returned = y[y.len() - 1];
    y.iter_mut().for_each(|y| *y += 2.2 * NM * normal(&mut random));
    let result = found(&drive, y.clone(), &Options::new(grid, range));
    let read = read_at_nodes(grid, range, &drive.samples, &y);
    let worst = worst_node(&read, &result.table);

    // How well each predicts the plant on a path of nested loops: the error that a feed-forward inverse would leave.
    let path = Drive::at(0.0, rate)
        .ramp(100.0, 20.0)
        .ramp(0.0, 20.0)
        .hold(1.0)
        .ramp(70.0, 10.0)
        .ramp(20.0, 10.0)
        .ramp(60.0, 10.0)
        .ramp(10.0, 10.0)
        .ramp(80.0, 10.0);
    let plant = PlayCreep::relaxed().run(&path.samples, 1.0 / rate);
    let first = (11.0 * rate) as usize;
    let error = |table: &EverettTable| {
        let model = response(table, Staircase::negative_saturation(range), &path.samples);
        let sum: f64 =
            (first..plant.len()).map(|k| ((plant[k] - plant[first]) - (model[k] - model[first])).powi(2)).sum();
        (sum / (plant.len() - first) as f64).sqrt()
    };
    let (by_fit, by_reading) = (error(&result.table), error(&read));
    println!(
        "creep left at the end {:.0} nm, worst node {:.1} nm; prediction: fit {:.1} nm, read {:.1} nm; {}",
        returned / NM,
        worst / NM,
        by_fit / NM,
        by_reading / NM,
        result.report.dead_time_basis,
    );
    assert!(returned > 100.0 * NM, "the plant must creep, or the test says nothing");
    assert!(worst < 0.001 * read.node(grid, 0), "worst node {} nm", worst / NM);
    assert!((by_fit / by_reading - 1.0).abs() < 0.03, "{by_fit} against {by_reading}");
    assert_monotone(&result.table);
}

#[test]
fn validation_finds_the_start_and_removes_offset_and_drift() {
    let range = [-90.0, 90.0];
    let truth = random_table(16, range, 40e-6, 0.3, 61);
    let drive = Drive::at(5.0, 1000.0)
        .hold(0.1)
        .ramp(30.0, 200.0)
        .ramp(-30.0, 200.0)
        .ramp(50.0, 200.0)
        .ramp(-60.0, 200.0)
        .ramp(0.0, 200.0);
    let mut history = Staircase::negative_saturation(range);
    history.push(90.0);
    let y: Vec<f64> =
        response(&truth, history, &drive.samples).iter().zip(drive.time()).map(|(f, t)| f + 7e-6 - 1e-7 * t).collect();
    let record = Record::from_columns("other.csv", drive.time(), drive.samples.clone(), y).unwrap();
    let good = validate(&truth, &record, 0.0).unwrap();
    println!("{:?}", good.starts);
    assert_eq!(good.best.start, Start::PositiveSaturation);
    assert!(good.best.rms < 0.01 * NM, "{}", good.best.rms);
    let mut bent = truth.clone();
    bent.nodes.iter_mut().for_each(|e| *e *= 1.02);
    assert!(validate(&bent, &record, 0.0).unwrap().best.rms_percent > 0.2, "a wrong table must show");
}

#[test]
fn two_runs_give_the_same_bits() {
    let range = [0.0, 100.0];
    let truth = random_table(12, range, 40e-6, 0.3, 71);
    let drive = Drive::at(0.0, 200.0).reversal_curves(12, range, 20.0);
    let mut random = generator(71);
    let y: Vec<f64> = response(&truth, Staircase::negative_saturation(range), &drive.samples)
        .iter()
        .map(|f| f + 5.0 * NM * normal(&mut random))
        .collect();
    let options = Options { dead_time: DeadTime::Fixed(0.0), ..Options::new(12, range) };
    let bits = |r: Identified| r.table.nodes.iter().map(|e| e.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(found(&drive, y.clone(), &options)), bits(found(&drive, y, &options)));
}

#[test]
fn a_table_survives_its_csv_file_and_a_broken_file_is_refused() {
    let table = random_table(7, [-90.0, 90.0], 40e-6, 0.3, 81);
    let text = write_table_csv(&table);
    assert!(text.starts_with("up_V,down_V,everett_um\n"));
    let back = read_table_csv(&text, "everett.csv").unwrap();
    assert_eq!((back.grid, back.drive_min, back.drive_max), (7, -90.0, 90.0));
    assert!(worst_node(&table, &back) < 1e-20);
    let mut lines: Vec<&str> = text.lines().collect();
    lines.swap(3, 9);
    for broken in [
        lines.join("\n"),
        text.replacen("up_V", "upV", 1),
        text.replacen('.', "x", 1),
        text[..text.len() / 2].to_owned(),
        String::new(),
    ] {
        let all = read_table_csv(&broken, "everett.csv").unwrap_err();
        assert!(all.iter().all(|d| d.code == "E0613" && !d.help.is_empty()), "{all:?}");
    }
}
