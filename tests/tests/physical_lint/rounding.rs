//! Rounding errors: the bound by analysis against trials.

use specgen::precision::{self, Figures};
use specgen::spec::SpecSource;

use super::support::spec;
use specgen_tests::length;

/// Specs of the short run.
const SOME: [&str; 2] = ["features/platform-f32.toml", "legs.toml"];
/// Each error found is within its bound, and the bound within so many times the largest found.
const NEAR: f64 = 20.0;

fn near(what: &str, figures: &Figures) -> Result<(), String> {
    for (axis, ratio) in figures.ratio().into_iter().enumerate() {
        let (bound, sampled) = (figures.bound[axis], figures.sampled[axis]);
        match ratio {
            // An axis that the workspace locks has neither.
            None if bound == 0.0 => {}
            Some(ratio) if (1.0..=NEAR).contains(&ratio) => {}
            _ => return Err(format!("{what} {axis}: bound {bound:e}, found {sampled:e}")),
        }
    }
    Ok(())
}

fn compiled(name: &str) -> specgen::compile::Compilation {
    let dir = specgen_tests::repository().join("specs");
    let source = SpecSource { display_name: name.to_owned(), text: spec(name), dir };
    specgen::compile::compile_source(source).expect("a good spec")
}

/// Every spec that is accepted, but the one that measures in QEMU only.
fn good_specs() -> Vec<String> {
    let specs = specgen_tests::repository().join("specs");
    let mut names = Vec::new();
    for folder in ["", "features/"] {
        for entry in std::fs::read_dir(specs.join(folder)).expect("specs") {
            let name = entry.expect("an entry").file_name().into_string().expect("a plain name");
            if name.ends_with(".toml") && name != "as-printed.toml" {
                names.push(format!("{folder}{name}"));
            }
        }
    }
    names.sort();
    assert!(names.len() >= 10, "only {} specs", names.len());
    names
}

#[test]
fn rounding_errors_stay_within_their_bound_and_near_it() {
    let mut compared = 0;
    println!("spec, pose: x y z (nm), θx θy θz (nrad): bound / largest found = ratio");
    // The short run's: of each folder some, one in single precision.
    for name in good_specs().into_iter().filter(|name| length(SOME.contains(&name.as_str()), true)) {
        let compiled = compiled(&name);
        let precision = precision::of(&compiled.model, &compiled.ir).expect("lowered before");
        let mut all = vec![("legs", precision.legs), ("commanded", precision.commanded)];
        all.extend(precision.measured.map(|figures| ("measured", figures)));
        for (what, figures) in all {
            let shown: Vec<String> = (0..6)
                .map(|k| {
                    let (bound, found) = (figures.bound[k] * 1e9, figures.sampled[k] * 1e9);
                    format!("{bound:.1e}/{found:.1e}={:.1}", bound / found)
                })
                .collect();
            println!("{name:<36} {what:<10} {}", shown.join(" "));
            near(&format!("{name} {what}"), &figures).expect("near");
            if let Some(against) = figures.against_f64 {
                compared += 1;
                // Another measure, of the same size: the same kernels in doubles.
                for (value, sampled) in against.iter().zip(&figures.sampled) {
                    assert!(*value > 0.5 * sampled && *value < 2.0 * sampled, "{name} {what}: {value:e} {sampled:e}");
                }
            }
        }
    }
    assert!(compared > 0, "no figures of single precision");
}

#[test]
fn no_fresh_pose_is_off_by_more_than_the_bound() {
    let names = ["reference.toml", "features/platform-f32.toml", "features/platform-joints.toml"];
    for name in names.into_iter().take(length(1, 3)) {
        let compiled = compiled(name);
        let fresh =
            precision::tried(&compiled.model, &compiled.ir, 20_261_122, length(3_000, 30_000)).expect("lowered before");
        for (what, figures) in
            [("legs", fresh.legs), ("commanded", fresh.commanded), ("measured", fresh.measured.expect("gauges"))]
        {
            near(&format!("{name} {what}"), &figures).expect("near");
        }
    }
}

#[test]
fn the_judgement_of_bounds_can_fail() {
    let good = Figures { bound: [6.0; 6], sampled: [1.0; 6], against_f64: None };
    near("good", &good).expect("near");
    for axis in 0..6 {
        let mut shrunk = good;
        shrunk.bound[axis] = 0.999;
        assert!(near("below what was found", &shrunk).is_err());
        let mut loose = good;
        loose.bound[axis] = 20.1;
        assert!(near("far from what was found", &loose).is_err());
        let mut none = good;
        none.bound[axis] = f64::NAN;
        assert!(near("no bound", &none).is_err());
    }
    // And the real one, shrunk as far as what was found.
    let compiled = compiled("reference.toml");
    let mut real = precision::of(&compiled.model, &compiled.ir).expect("lowered before").commanded;
    near("as it is", &real).expect("near");
    real.bound = real.bound.map(|bound| bound / 15.0);
    assert!(near("shrunk", &real).is_err());
}
