//! Identification of actuators whose truth is known: exact Preisach planes, and a play-and-creep plant outside the model class.

use crate::identify_support::{Drive, generator, normal, random_table, response, uniform};
use specgen::everett::EverettTable;
use specgen::identify::rate::RateModel;
use specgen::identify::{
    Branches, DeadTime, Identification, Input, Options, Record, Staircase, identify, parse_record, predict, read_drive,
    read_table_csv, validate, write_table_csv,
};

use specgen_tests::worse;
use std::time::Instant;

const NM: f64 = 1e-9;

fn found(drive: &Drive, displacement: Vec<f64>, options: &Options) -> Identification {
    let record = Record::from_columns("made.csv", drive.time(), drive.samples.clone(), displacement).unwrap();
    identify(&record, options).unwrap_or_else(|d| panic!("{d:#?}"))
}

fn worst_node(a: &EverettTable, b: &EverettTable) -> f64 {
    a.nodes.iter().zip(&b.nodes).fold(0.0, |worst, (x, y)| worse(worst, (x - y).abs()))
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
        let (noise_nm, worst_nm, floor) = (noise / NM, worst / NM, result.report.noise_floor / NM);
        let (drift, skipped) = (result.report.drift / NM, result.report.samples_skipped);
        println!(
            "noise {noise_nm} nm: worst node {worst_nm:.2} nm, noise floor {floor:.2} nm, drift {drift:.2} nm/s, skipped {skipped}"
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
    let (worst, branches) = (worst_node(&truth, &result.table) / NM, result.report.branches);
    let excited = result.report.excited_share;
    println!("worst node {worst:.3} nm over {branches:?}, excited {excited}");
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
    let (dead_time, basis) = (varied.report.dead_time, &varied.report.dead_time_basis);
    let worst = worst_node(&truth, &varied.table) / NM;
    println!("varied: {dead_time} s, {basis}; worst node {worst:.2} nm");
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
    let (left, worst_nm, fit, reading) = (returned / NM, worst / NM, by_fit / NM, by_reading / NM);
    let basis = &result.report.dead_time_basis;
    println!(
        "creep left at the end {left:.0} nm, worst node {worst_nm:.1} nm; prediction: fit {fit:.1} nm, read {reading:.1} nm; {basis}"
    );
    assert!(returned > 100.0 * NM, "the plant must creep, or the test says nothing");
    assert!(worst < 0.001 * read.node(grid, 0), "worst node {} nm", worst / NM);
    assert!((by_fit / by_reading - 1.0).abs() < 0.03, "{by_fit} against {by_reading}");
    assert_monotone(&result.table);
}

/// Whatever the drive did before, not only three guesses: the state is found, and offset and drift are removed.
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
    let record = |history: &[f64]| {
        let mut memory = Staircase::negative_saturation(range);
        history.iter().for_each(|u| memory.push(*u));
        let y = response(&truth, memory, &drive.samples);
        let y = y.iter().zip(drive.time()).map(|(f, t)| f + 7e-6 - 1e-7 * t).collect();
        Record::from_columns("other.csv", drive.time(), drive.samples.clone(), y).unwrap()
    };
    // History, share of the open weight that it leaves on, error that the straight parts leave, nm.
    let histories: [(&[f64], [f64; 2], f64); 4] = [
        (&[], [0.0, 0.001], 0.01),
        (&[90.0], [0.999, 1.0], 0.01),
        (&[42.0, -21.0], [0.1, 0.9], 10.0),
        (&[90.0, -48.0, 33.0, -12.0, 20.0], [0.1, 0.9], 10.0),
    ];
    for (history, share, limit) in histories {
        let found = validate(&truth, &record(history), 0.0).unwrap();
        let compared = found.compared.unwrap();
        let (on, rms, range) = (found.start_on, compared.rms / NM, compared.range * 1e6);
        println!("after {history:?}: {on:.3} on, {rms:.3} nm rms of {range:.1} µm");
        assert!((share[0]..=share[1]).contains(&found.start_on), "{}", found.start_on);
        assert!(compared.rms < limit * NM, "{history:?}: {} nm", compared.rms / NM);
        assert!((compared.drift / -1e-7 - 1.0).abs() < 0.2, "{}", compared.drift);
    }
    let mut bent = truth.clone();
    bent.nodes.iter_mut().for_each(|e| *e *= 1.02);
    let wrong = validate(&bent, &record(&[90.0]), 0.0).unwrap().compared.unwrap();
    assert!(wrong.rms_percent > 0.2, "a wrong table must show");
}

/// The search is in seconds: a record sampled faster has the same dead time.
#[test]
fn a_dead_time_of_many_samples_is_found() {
    let range = [0.0, 100.0];
    let truth = random_table(8, range, 40e-6, 0.3, 67);
    let drive = Drive::at(0.0, 50e3).reversal_curves(8, range, 4e3).reversal_curves(8, range, 16e3);
    let still = response(&truth, Staircase::negative_saturation(range), &drive.samples);
    for late in [0, 10, 25] {
        let y = (0..still.len()).map(|k| still[k.saturating_sub(late)]).collect();
        let report = found(&drive, y, &Options::new(8, range)).report;
        println!("{late} samples: {:.6} ms, {}", report.dead_time * 1e3, report.dead_time_basis);
        assert!((report.dead_time - late as f64 / 50e3).abs() < 4e-6, "{late}: {}", report.dead_time);
        assert!(report.fit_rms < 5.0 * NM, "{}", report.fit_rms);
    }
}

/// A converter holds each sample of a command. An amplifier of first order behind it, sampled when the next command leaves:
/// what is found is its time constant and half an interval, and the report says which half.
#[test]
fn of_a_command_half_an_interval_is_the_hold() {
    let (interval, lag) = (1e-4, 4e-4);
    let truth = random_table(8, [0.0, 100.0], 40e-6, 0.3, 68);
    let drive =
        Drive::at(0.0, 1.0 / interval).reversal_curves(8, [0.0, 100.0], 1e3).reversal_curves(8, [0.0, 100.0], 4e3);
    let mut voltage = 0.0;
    let mut stack: Vec<f64> = Vec::new();
    for u in &drive.samples {
        stack.push(voltage);
        voltage += (u - voltage) * (1.0 - (-interval / lag).exp());
    }
    let y = response(&truth, Staircase::negative_saturation([0.0, 100.0]), &stack);
    let text = |name: &str| {
        let rows = drive.time().into_iter().zip(&drive.samples).zip(&y);
        let rows: String = rows.map(|((t, u), y)| format!("{t:.5},{u:.6},{:.9}\n", y * 1e6)).collect();
        format!("time_s,{name},displacement_um\n{rows}")
    };
    let report = |name: &str| {
        let record = parse_record(&text(name), "r.csv").unwrap_or_else(|d| panic!("{d:#?}"));
        identify(&record, &Options::new(8, [0.0, 100.0])).unwrap_or_else(|d| panic!("{d:#?}")).report
    };
    let (command, monitor) = (report("drive_V"), report("monitor_V"));
    println!("{:.4} ms between the columns, of it {:.4} ms hold", command.dead_time * 1e3, command.held * 1e3);
    assert_eq!((command.dead_time, monitor.held), (monitor.dead_time, 0.0));
    assert!((command.held - 0.5 * interval).abs() < 1e-12);
    assert!(((command.dead_time - command.held) / lag - 1.0).abs() < 0.15, "{}", command.dead_time);
}

/// A drive alone is predicted; a little beyond the table it is held and counted, far beyond it is refused; a record may end
/// with a jump. Against the staircase run over the drive as it should be held.
#[test]
fn a_drive_is_predicted_with_and_without_displacement() {
    let range = [0.0, 100.0];
    let truth = random_table(8, range, 40e-6, 0.3, 69);
    let beyond =
        |end: f64| Drive::at(0.0, 1000.0).ramp(end, 200.0).ramp(20.0, 200.0).ramp(60.0, 200.0).jump(0.0).samples;
    let drive = beyond(104.0);
    let y = response(&truth, Staircase::negative_saturation(range), &drive);
    let text = |samples: &[f64], y: Option<&[f64]>| {
        let mut text = format!("time_s,drive_V{}\n", if y.is_some() { ",displacement_um" } else { "" });
        for (k, u) in samples.iter().enumerate() {
            let y = y.map(|y| format!(",{:?}", y[k] * 1e6)).unwrap_or_default();
            text += &format!("{:?},{u:?}{y}\n", k as f64 * 1e-3);
        }
        text
    };
    let model = RateModel::of_table(truth, 0.0);
    let alone = predict(&model, &read_drive(Input::Text(&text(&drive, None)), "d.csv").unwrap()).unwrap();
    assert!(alone.compared.is_none() && alone.measured.is_none());
    assert_eq!(alone.samples_clipped, drive.iter().filter(|u| **u > 100.0).count());
    let worst = alone.displacement.iter().zip(&y).fold(0.0, |worst, (a, b)| worse(worst, (a - b).abs()));
    assert!(alone.displacement.len() == y.len() && worst < 1e-6 * NM, "{worst}");
    let compared =
        predict(&model, &read_drive(Input::Text(&text(&drive, Some(&y))), "d.csv").unwrap()).unwrap().compared.unwrap();
    assert_eq!((compared.samples, compared.samples_after_jumps), (y.len() - 1, 1));
    assert!(compared.max < 1e-3 * NM, "{}", compared.max);
    let far = read_drive(Input::Text(&text(&beyond(106.0), None)), "d.csv").unwrap();
    assert_eq!(predict(&model, &far).unwrap_err()[0].code, "E0605");
}

/// The largest grids are solved in a few factorisations, with the certificate of the optimum.
#[test]
fn a_grid_of_64_from_64_curves_takes_few_factorisations() {
    let range = [0.0, 100.0];
    let truth = random_table(64, range, 40e-6, 0.9, 70);
    let drive = Drive::at(0.0, 1000.0).reversal_curves(64, range, 400.0);
    let mut random = generator(70);
    let y = response(&truth, Staircase::negative_saturation(range), &drive.samples);
    let y = y.iter().map(|f| f + 8.0 * NM * normal(&mut random)).collect();
    let started = Instant::now();
    let report = found(&drive, y, &Options::new(64, range)).report;
    let (zero, weights, factorised) = (report.zero_weights, report.weights, report.solver_iterations);
    let seconds = started.elapsed().as_secs_f64();
    println!("{zero} of {weights} weights zero in {factorised} factorisations, {seconds:.2} s");
    assert!(report.zero_weights > 100 && report.solver_iterations < 20 && report.kkt_violation < 1e-10);
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
    let bits = |r: Identification| r.table.nodes.iter().map(|e| e.to_bits()).collect::<Vec<_>>();
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
        assert!(!all.is_empty() && all.iter().all(|d| d.code == "E0613" && !d.help.is_empty()), "{all:?}");
    }
}
