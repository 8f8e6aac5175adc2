//! Motion that does not repeat: random, raster and spiral, with the Preisach table and with a leg model chosen from the same records.

use std::f64::consts::TAU;

use host_sim::plant::LegParameters;
use host_sim::platform::{PlatformParameters, Specimen};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::identify::leg_model::choose;
use specgen::identify::{MAX_GRID, Options, error_on, join, write_leg_csv};
use specgen::model::LegModelKind;
use specgen_tests::{damped, leg_class, length, skipped};

use super::bench::{Bench, VOLTAGE, faded, in_parallel, three_records, two_rates};

/// One sine of an axis: axis, amplitude (m), angular frequency (rad/s), phase.
type Line = (usize, f64, f64, f64);

/// A sum of sines that is faded in and out.
struct Sines {
    lines: Vec<Line>,
}

impl Sines {
    const FADE: f64 = 0.1;
    const DURATION: f64 = 1.2;
    /// Largest displacement of an axis, m.
    const SIZE: f64 = 7.5e-6;

    /// 0 to 20 Hz in x, y and z, rms a third of the size.
    fn random(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let lines = (0..3).flat_map(|axis| (1..=40).map(move |k| (axis, 0.5 * f64::from(k))));
        let amplitude = Self::SIZE / 3.0 * (2.0_f64 / 40.0).sqrt();
        Self { lines: lines.map(|(axis, f)| (axis, amplitude, TAU * f, TAU * unit())).collect() }
    }

    /// Ten lines a second in x: a triangle without its harmonics above the ninth; one slow stroke in y.
    fn raster() -> Self {
        let harmonics = [1.0, 3.0, 5.0, 7.0, 9.0].into_iter().enumerate().map(|(k, n)| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            (0, sign * Self::SIZE * 0.81 / (n * n), TAU * 5.0 * n, 0.0)
        });
        Self { lines: harmonics.chain([(1, Self::SIZE, TAU * 0.4, 0.0)]).collect() }
    }

    /// 20 Hz in x and y, from the middle to the full radius and back.
    fn spiral() -> Self {
        let slow = 1.0 / Self::DURATION;
        let lines = [(0, TAU / 4.0), (1, 0.0)].into_iter().flat_map(|(axis, phase)| {
            // (1 − cos)/2 times a sine.
            [(0.5, 20.0), (-0.25, 20.0 - slow), (-0.25, 20.0 + slow)]
                .map(|(share, f)| (axis, share * Self::SIZE, TAU * f, phase))
        });
        Self { lines: lines.collect() }
    }
}

impl PoseTrajectory for Sines {
    fn duration(&self) -> f64 {
        Self::DURATION
    }

    fn target(&self, time: f64) -> PoseTarget {
        let [fade, rate, bend] = faded(time, Self::DURATION, Self::FADE);
        let mut target = PoseTarget::default();
        for (axis, a, angular, phase) in &self.lines {
            let (s, c) = (angular * time + phase).sin_cos();
            target.pose[*axis] += a * fade * s;
            target.rate[*axis] += a * (rate * s + fade * angular * c);
            target.acceleration[*axis] += a * (bend * s + 2.0 * rate * angular * c - fade * angular * angular * s);
        }
        target
    }
}

/// nm rms of the norm: random, raster, spiral.
fn errors(bench: &Bench) -> [f64; 3] {
    let (scenario, mut controller) = (bench.scenario(), bench.controller());
    [Sines::random(7), Sines::raster(), Sines::spiral()]
        .map(|path| scenario.run(&mut controller, &path).unwrap().errors.rms_translation_nm())
}

fn bench(name: &str, leg: &LegParameters, model: &str) -> Bench {
    let legs = Specimen::within_tolerances(&PlatformParameters::reference(), leg, 1);
    let model = format!("memory  = 64\nmodel   = \"{model}\"");
    Bench::new(&format!("non-repeating-{name}"), legs, &[("memory  = 64", &model), damped()])
}

fn shown(what: &str, errors: [f64; 3]) -> [f64; 3] {
    let [random, raster, spiral] = errors;
    println!("{what}: random {random:.1} nm, raster {raster:.1} nm, spiral {spiral:.1} nm");
    errors
}

#[test]
#[ignore = "long: every family fitted, and two controllers; the short run compares the bits of the chosen model"]
fn a_bouc_wen_leg_with_the_model_of_its_own_curves_follows_what_does_not_repeat() {
    let leg = leg_class(1);
    let modelled = shown("Bouc-Wen, auto", errors(&bench("bouc-auto", &leg, "auto")));
    let bars = [6.0, 6.0, 8.0];
    assert!(modelled.iter().zip(bars).all(|(error, bar)| *error <= bar), "{modelled:?}");
    if length(true, false) {
        return skipped("only in the full run: the table in its place");
    }
    let table = shown("Bouc-Wen, table", errors(&bench("bouc-table", &leg, "preisach")));
    assert!(modelled.iter().zip(table).all(|(model, table)| 3.0 * model < table), "{modelled:?} {table:?}");
}

#[test]
#[ignore = "long: every family fitted to twelve records, and four controllers"]
fn plays_follow_what_does_not_repeat_no_worse_with_a_chosen_model_than_with_the_table() {
    for (name, leg) in [("plays", leg_class(0)), ("rate-widened plays", leg_class(2))] {
        let [modelled, table] = ["auto", "preisach"]
            .map(|model| shown(&format!("{name}, {model}"), errors(&bench(&format!("{name}-{model}"), &leg, model))));
        assert!(modelled.iter().zip(table).all(|(model, table)| *model < 1.05 * table), "{modelled:?} {table:?}");
    }
}

/// Records of the legs.
#[derive(Clone, Copy, Debug)]
enum Records {
    /// Curves at two rates in one file, which the spec names; with `hysteresis.grid` or without.
    OneFile(Option<usize>),
    /// Those of `specgen forc --two-rates`, from which `specgen identify` chooses the models that the spec names.
    ThreeFiles,
}

/// The grid and the file of the chosen model of a leg, as `identify --model auto --validate` writes it.
fn identified(leg: &LegParameters, number: u64) -> (usize, String) {
    let [slow, fast, random] = three_records(leg, number);
    let options = Options { finest: MAX_GRID, ..Options::new(32, VOLTAGE) };
    let both = join(&[slow, fast], VOLTAGE).unwrap();
    let model = choose(&both, Some(&error_on(&random)), &options, LegModelKind::Auto).unwrap().model;
    (model.table.grid, write_leg_csv(&model))
}

/// A controller with the leg models that are chosen from `records`.
fn chosen(class: u32, records: Records) -> Bench {
    let legs = Specimen::within_tolerances(&PlatformParameters::reference(), &leg_class(class.into()), 1);
    let (name, records, grid) = match records {
        Records::OneFile(grid) => ("one", two_rates(&legs.legs), grid),
        Records::ThreeFiles => {
            let found: [_; 6] = std::array::from_fn(|leg| identified(&legs.legs[leg], leg as u64));
            ("three", found.each_ref().map(|(_, text)| text.clone()), Some(found[0].0))
        }
    };
    let grid = grid.map_or(String::new(), |grid| format!("grid = {grid}\n"));
    let hysteresis = format!("{grid}memory  = 64\nmodel   = \"auto\"");
    let edits = [
        ("grid    = 32\nmemory  = 64", hysteresis.as_str()),
        ("flash        = \"128 KiB\"", "flash        = \"1 MiB\""),
        damped(),
    ];
    Bench::with_records(&format!("non-repeating-{class}-{name}-{}", grid.trim()), legs, &records, &edits)
}

/// What the default choice is held to, nm rms: random, raster and spiral of each class. Measured with one file and with three: class 0
/// 4.4, 2.5, 4.9 (plays in the tick) and 6.5, 3.2, 7.6 (a table); class 1 2.7, 1.8, 4.7 and 2.5, 1.8, 3.9; class 2 4.4, 2.2, 5.4 and 3.6,
/// 2.0, 4.5 (plays in the tick). The aim is 6, 6 and 7 nm; class 0 with three files misses it.
const BARS: [[f64; 3]; 3] = [[7.2, 3.6, 8.4], [3.0, 2.2, 5.0], [4.9, 2.5, 6.0]];

/// The legs of SPECGEN_CLASS alone (0, 1 or 2), if it is set; then also with each grid given.
#[test]
#[ignore = "long: every family fitted to six records of each class, and a controller of each"]
fn the_default_choice_follows_what_does_not_repeat() {
    let only: Option<u32> = std::env::var("SPECGEN_CLASS").ok().and_then(|class| class.parse().ok());
    let given = [32, 64, 128].map(|grid| Records::OneFile(Some(grid)));
    let given = if only.is_none() { &[] } else { &given[..] };
    let all = [given, &[Records::OneFile(None), Records::ThreeFiles]].concat();
    for class in (0..3).filter(|class| only.is_none_or(|only| only == *class)) {
        let found = in_parallel(all.len() as u32, |which| {
            let bench = chosen(class, all[which as usize]);
            (bench.emitted.compiled.ir.hysteresis.grid, errors(&bench))
        });
        for (records, (grid, errors)) in all.iter().zip(&found) {
            shown(&format!("class {class}, grid {grid}, {records:?}"), *errors);
        }
        for (_, found) in &found[given.len()..] {
            assert!(
                found.iter().zip(BARS[class as usize]).all(|(error, bar)| *error <= bar),
                "class {class}: {found:?}"
            );
        }
    }
}
