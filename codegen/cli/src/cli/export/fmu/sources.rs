//! What the plant is made of, besides the runtime: the crates `host-sim` and `host-sim/unit`.

/// Files of a folder below `host-sim/`, with the folder that they go to.
macro_rules! files {
    ($from:literal as $to:literal: $($path:literal,)*) => {
        &[$((
            concat!($to, "/", $path),
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../host-sim/", $from, $path)),
        )),*]
    };
}

/// Path below the workspace, text. Tests in files of their own are left out.
pub(super) const SIMULATOR: &[(&str, &str)] = files! { "" as "host-sim":
    "Cargo.toml",
    "plants/bouc-wen-leg.json",
    "plants/reference-leg.json",
    "plants/reference-platform.json",
    "src/closed_loop.rs",
    "src/controller.rs",
    "src/controller/engine.rs",
    "src/controller/library.rs",
    "src/controller/supervised.rs",
    "src/controller/supervised/snapshot.rs",
    "src/controller/supervised/standing.rs",
    "src/coverage.rs",
    "src/description.rs",
    "src/forc.rs",
    "src/lib.rs",
    "src/noise.rs",
    "src/plant.rs",
    "src/plant/bound.rs",
    "src/plant/bouc_wen.rs",
    "src/plant/creep.rs",
    "src/plant/filter.rs",
    "src/plant/lanes.rs",
    "src/plant/leg.rs",
    "src/plant/parameters.rs",
    "src/plant/play.rs",
    "src/plant/stack.rs",
    "src/platform.rs",
    "src/platform/amplifier.rs",
    "src/platform/contact.rs",
    "src/platform/frames.rs",
    "src/platform/gauge.rs",
    "src/platform/geometry.rs",
    "src/platform/inertia.rs",
    "src/platform/linear.rs",
    "src/platform/parameters.rs",
    "src/platform/plant.rs",
    "src/platform/rig.rs",
    "src/platform/rig/bench.rs",
    "src/platform/rig/run.rs",
    "src/platform/scenario.rs",
    "src/platform/sensor.rs",
    "src/platform/specimen.rs",
    "src/platform/structure.rs",
    "src/platform/structure/lanes.rs",
    "src/platform/study.rs",
    "src/platform/table.rs",
    "src/platform/whole_tick.rs",
    "src/record.rs",
    "src/record/csv.rs",
    "src/record/recorded.rs",
    "src/record/replay.rs",
    "src/record/writer.rs",
    "src/replay.rs",
    "src/scenario.rs",
    "src/stimulus.rs",
    "src/stimulus/draw.rs",
    "src/stimulus/platform.rs",
    "src/table.rs",
    "src/trace.rs",
    "src/trace/difference.rs",
    "src/trajectory.rs",
    "src/trajectory/jet.rs",
    "src/trajectory/multisine.rs",
    "src/trajectory/paper.rs",
    "src/trajectory/step.rs",
    "src/word.rs",
};

/// The same of the crate that is built.
pub(super) const UNIT: &[(&str, &str)] = files! { "unit/" as "unit":
    "Cargo.toml",
    "src/ffi.rs",
    "src/lib.rs",
};

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    fn below(folder: &Path, root: &Path, found: &mut BTreeSet<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                below(&path, root, found);
            } else if !path.ends_with("tests.rs") {
                found.insert(path.strip_prefix(root).unwrap().to_str().unwrap().to_owned());
            }
        }
    }

    #[test]
    fn every_file_is_listed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-sim");
        for (list, to, root) in [(SIMULATOR, "host-sim/", root.clone()), (UNIT, "unit/", root.join("unit"))] {
            let mut wanted = BTreeSet::from(["Cargo.toml".to_owned()]);
            ["src", "plants"].iter().map(|folder| root.join(folder)).filter(|path| path.is_dir()).for_each(|folder| {
                below(&folder, &root, &mut wanted);
            });
            let listed = list.iter().map(|(name, _)| name.strip_prefix(to).unwrap().to_owned());
            assert_eq!(listed.collect::<BTreeSet<_>>(), wanted, "{to}");
        }
    }
}
