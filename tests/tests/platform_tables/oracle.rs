//! The emitted tick against one written apart from it, in plain f64 with matrices: host-sim's reference controller, fed
//! with the same tables, settings and inputs.

use host_sim::controller::TickController;
use host_sim::forc::{ReversalRecord, ReversalRow};
use host_sim::oracle::{PlatformOracle, Settings, Table};
use host_sim::plant::LegParameters;
use host_sim::platform::Specimen;
use host_sim::platform::rig::{Noise, Record, RunOptions};
use host_sim::platform::scenario::{PLATFORM_MODES, select};
use host_sim::platform::{PlatformParameters, PlatformScenario};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};
use specgen_tests::Emitted;

use crate::bench::PERIOD;

/// Up, then a dance on all six axes, begun and ended at rest.
struct Dance;

impl PoseTrajectory for Dance {
    fn duration(&self) -> f64 {
        0.8
    }
    fn target(&self, time: f64) -> PoseTarget {
        let up = (time / 0.3).min(1.0);
        let way = up * up * up * (10.0 + up * (6.0 * up - 15.0));
        let mut target = PoseTarget::default();
        target.pose[2] = 20e-6 * way;
        let t = (time - 0.3).max(0.0);
        for (axis, (size, turns)) in
            [(6e-6, 7.0), (5e-6, 11.0), (8e-6, 5.0), (4e-5, 13.0), (3e-5, 9.0), (6e-5, 17.0)].into_iter().enumerate()
        {
            let omega = std::f64::consts::TAU * turns;
            let (sin, cos) = (omega * t).sin_cos();
            // size sin² (ω t / 2): starts without a jump of its rate.
            target.pose[axis] += 0.5 * size * (1.0 - cos);
            target.rate[axis] += 0.5 * size * omega * sin;
            target.acceleration[axis] += if t > 0.0 { 0.5 * size * omega * omega * cos } else { 0.0 };
        }
        target
    }
}

/// A record from which the oracle reads just the nodes of an Everett table.
fn record(nodes: &[f64], grid: usize, interval: f64) -> ReversalRecord {
    let everett = |up: usize, down: usize| nodes[up * (up + 1) / 2 + down];
    let mut rows = vec![ReversalRow { time: 0.0, drive: 0.0, displacement: 0.0 }];
    let mut push = |level: usize, displacement: f64| {
        rows.push(ReversalRow { time: 0.0, drive: level as f64 * interval, displacement });
    };
    for peak in 1..=grid {
        for level in 1..=peak {
            push(level, everett(peak, 0));
        }
        for level in (0..peak).rev() {
            push(level, everett(peak, 0) - everett(peak, level));
        }
    }
    ReversalRecord { rows }
}

#[test]
fn every_tick_is_that_of_the_reference_controller() {
    let edits = [(
        "\"0 um\", \"0 um\", \"10 um\", \"0 urad\", \"0 urad\", \"0 urad\"]  # room",
        "\"0 um\", \"0 um\", \"0 um\", \"0 urad\", \"0 urad\", \"0 urad\"]  # room",
    )];
    let emitted = Emitted::new("tables-oracle", "reference.toml", &edits);
    let mut controller = emitted.controller();
    let hysteresis = &emitted.compiled.ir.hysteresis;
    let table = record(&hysteresis.tables[0], hysteresis.grid, 100.0 / hysteresis.grid as f64);

    let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
    let mut settings = Settings::of(&specimen, PERIOD, Some(1.0));
    settings.tables = std::array::from_fn(|_| Table::from_record(&table, hysteresis.grid, 100.0));
    (settings.bias, settings.bias_time) = ([0.0; 6], 0.0);
    let mut oracle = PlatformOracle::new(&settings).expect("a regular platform");

    let options = RunOptions { record: Record::Trace, settle: 0.01, ..RunOptions::new(PERIOD, [0.0; 6]) };
    let machine = PlatformScenario::new(&Specimen::reference(), &Noise::of(&specimen), 1, options);
    for (name, mode) in PLATFORM_MODES {
        select(&mut controller, mode).expect("a mode");
        let trace = machine.run(&mut controller, &Dance).expect("a run").trace.expect("kept");
        let mut words = controller.default_config();
        words[0] = u64::from(mode);
        oracle.configure(&words).expect("the same words");
        oracle.reset();

        let description = trace.description();
        let inputs = description.input_names.len();
        let place = |name: &str| inputs + description.output(name).expect("an output");
        let mut output = vec![0; oracle.description().output_names.len()];
        // Largest difference of each vector, m, rad or V; and ticks of a leg with another code.
        let mut worst =
            [("demand", 0.0_f64), ("pose", 0.0), ("load", 0.0), ("level", 0.0), ("drift", 0.0), ("requested", 0.0)];
        let (mut codes, mut ticks, mut limited) = (0, 0, 0);
        for row in trace.rows() {
            oracle.step(&row[..inputs], &mut output);
            ticks += 1;
            limited += usize::from(row[place("status")] & 0x3f != 0);
            for leg in 0..6 {
                for (stem, largest) in &mut worst {
                    let at = place(&format!("{stem}[{leg}]"));
                    let difference = f64::from_bits(row[at]) - f64::from_bits(output[at - inputs]);
                    *largest = largest.max(difference.abs());
                }
                let at = place(&format!("dac_code[{leg}]"));
                codes += usize::from(row[at] != output[at - inputs]);
            }
        }
        println!(
            "{name}: {ticks} ticks, {limited} limited, {codes} other codes; largest differences {:?}",
            worst.map(|(stem, largest)| format!("{stem} {largest:.1e}"))
        );
        assert!(ticks > 8000);
        for (stem, largest) in worst {
            let allowed = if stem == "requested" { 1e-9 } else { 1e-12 };
            assert!(largest <= allowed, "{name}: {stem} differs by {largest:e}");
        }
    }
}
