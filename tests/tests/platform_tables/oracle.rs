//! The emitted tick against one written apart from it, in plain f64 with matrices: host-sim's reference controller, fed
//! with the same tables, settings and inputs.

use ::oracle::{PlatformOracle, Settings, Table};
use host_sim::controller::{Controller, TickController};
use host_sim::forc::{ReversalRecord, ReversalRow};
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::Specimen;
use host_sim::platform::rig::{Noise, Record, RunOptions};
use host_sim::platform::scenario::select;
use host_sim::platform::{PlatformParameters, PlatformScenario};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};
use specgen_runtime::ControlMode;
use specgen_tests::{Emitted, length, worse};

use super::bench::PERIOD;

/// Up, then a dance on all six axes.
struct Dance;

impl PoseTrajectory for Dance {
    fn duration(&self) -> f64 {
        // A replayed estimate integrates what converter codes differ by, and is no longer compared with itself in the end.
        0.5
    }
    fn target(&self, time: f64) -> PoseTarget {
        // At once and fast, for gauge noise must not take a leg to its lowest voltage: there the two controllers differ in
        // when a leg counts as held back, by half a code, and their integrals then stay apart.
        const RAMP: f64 = 5e-3;
        let mut target = PoseTarget::default();
        (target.pose[2], target.rate[2]) = if time < RAMP { (20e-6 * time / RAMP, 20e-6 / RAMP) } else { (20e-6, 0.0) };
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

/// Largest difference of each output vector between the two, m or rad.
type Differences = [(&'static str, f64); 6];

/// The emitted controller, the other one, and a machine that makes inputs for both.
struct Comparison {
    controller: Controller,
    oracle: PlatformOracle,
    machine: PlatformScenario,
}

impl Comparison {
    fn new(name: &str) -> Self {
        let edits = [
            (
                "\"0 um\", \"0 um\", \"10 um\", \"0 urad\", \"0 urad\", \"0 urad\"]  # room",
                "\"0 um\", \"0 um\", \"0 um\", \"0 urad\", \"0 urad\", \"0 urad\"]  # room",
            ),
            // A fine converter: a request on the edge between two codes may take either, and a replayed estimate never forgets.
            ("bits  = 16\n", "bits  = 24\n"),
        ];
        let emitted = Emitted::new(name, "reference.toml", &edits);
        let controller = emitted.at_run_time();
        let hysteresis = &emitted.compiled.ir.hysteresis;
        let table = record(&hysteresis.tables[0], hysteresis.grid, 100.0 / hysteresis.grid as f64);

        let specimen = Specimen::ideal(&PlatformParameters::reference(), &LegParameters::reference());
        let mut settings = Settings::of(&specimen, PERIOD, Some(1.0));
        settings.tables = std::array::from_fn(|_| Table::from_record(&table, hysteresis.grid, 100.0));
        settings.drive.lsb = 150.0 / f64::from((1 << 24) - 1);
        (settings.bias, settings.bias_time) = ([0.0; 6], 0.0);
        settings.lead = emitted.compiled.design.as_ref().expect("a spec with [control]").lead;
        let oracle = PlatformOracle::new(&settings).expect("a regular platform");

        let options = RunOptions { record: Record::Trace, settle: 0.0, ..RunOptions::new(PERIOD, [0.0; 6]) };
        // Gauge codes, but no noise, so that it stands still until it is to move.
        let channels = NoiseParameters { adc_lsb_nm: 0.76, ..NoiseParameters::NONE };
        let machine = PlatformScenario::new(&Specimen::reference(), &Noise { channels, ..Noise::NONE }, 1, options);
        Self { controller, oracle, machine }
    }

    /// Runs the emitted controller on the machine and the other one on the same inputs; a `slip` is another value of one
    /// of the other's settings.
    fn run(&mut self, (name, mode): (&str, u32), slip: Option<(&str, f64)>) -> Differences {
        let Self { controller, oracle, machine } = self;
        select(controller, mode).expect("a mode");
        let trace = machine.run(controller, &Dance).expect("a run").trace.expect("kept");
        let mut words = controller.default_config();
        words[0] = u64::from(mode);
        if let Some((setting, factor)) = slip {
            let at = controller.description().config_names.iter().position(|name| name == setting).expect("a setting");
            words[at] = (f64::from_bits(words[at]) * factor).to_bits();
        }
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
                let at = place(&format!("dac_code[{leg}]"));
                codes += usize::from(row[at] != output[at - inputs]);
                for (stem, largest) in &mut worst {
                    let at = place(&format!("{stem}[{leg}]"));
                    let difference = f64::from_bits(row[at]) - f64::from_bits(output[at - inputs]);
                    *largest = worse(*largest, difference.abs());
                }
            }
        }
        println!(
            "{name}: {ticks} ticks, {limited} limited, {codes} other codes; largest differences {:?}",
            worst.map(|(stem, largest)| format!("{stem} {largest:.1e}"))
        );
        assert!(ticks >= 5000);
        worst
    }
}

/// Two steps of the converter, m: a request on the edge between two codes may take either. What a replayed estimate
/// integrates of such steps stays in it, and in the request.
fn allowed(mode: u32, stem: &str) -> f64 {
    match stem {
        "requested" if matches!(mode, 0 | 1 | 4) => 1.2e-11,
        "requested" | "level" | "drift" => 1e-9,
        _ => 1e-12,
    }
}

/// (7) and Fig. 5: force, feedback, (AII.3), (AII.5), (AII.6) and the inverse, tick by tick.
#[test]
fn every_tick_is_that_of_the_reference_controller() {
    let mut comparison = Comparison::new("tables-oracle");
    // One of P, F and P/F in the short run.
    for mode in ControlMode::WORDS.into_iter().step_by(length(3, 1)) {
        for (stem, largest) in comparison.run(mode, None) {
            assert!(largest <= allowed(mode.1, stem), "{}: {stem} differs by {largest:e}", mode.0);
        }
    }
}

/// The comparison is falsifiable: a gain or a weight that is off by a hundredth is seen.
#[test]
fn a_setting_off_by_a_hundredth_is_seen() {
    let mut comparison = Comparison::new("tables-oracle-slip");
    for (mode, setting) in [
        (0, "position_ki[2]"),
        (0, "position_kp[5]"),
        (4, "position_ki[0]"),
        (4, "position_kp[3]"),
        (6, "level_weight"),
        (6, "drift_weight"),
    ]
    .into_iter()
    .step_by(length(3, 1))
    {
        let mode = ControlMode::WORDS[mode];
        let [.., (_, requested)] = comparison.run(mode, Some((setting, 1.01)));
        assert!(requested > allowed(mode.1, "requested"), "{setting}: {requested:e}");
    }
}
