//! Identification from a measured record of real hardware (`../shared/data/piezo-forc`), scored on another record of it.
//!
//! Each test prints that it is skipped where the data is absent.

use std::path::{Path, PathBuf};

use specgen::identify::{DeadTime, Identified, Options, Record, identify, read_record, validate};

const DRIVE: [f64; 2] = [-90.0, 90.0];

fn data(name: &str) -> Option<Record> {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/piezo-forc").join(name);
    if path.exists() {
        return Some(read_record(&path, name).unwrap_or_else(|d| panic!("{d:#?}")));
    }
    println!("skipped: ../shared/data/piezo-forc/{name} is not here");
    None
}

fn identified(record: &Record, options: &Options) -> Identified {
    let started = std::time::Instant::now();
    let result = identify(record, options).unwrap_or_else(|d| panic!("{d:#?}"));
    println!("N = {}: {:.2} s", options.grid, started.elapsed().as_secs_f64());
    println!("{}", serde_json::to_string_pretty(&result.report).unwrap());
    result
}

#[test]
fn measured_record_is_fitted_and_predicts_another_one() {
    let (Some(forc), Some(triangle)) = (data("forc-20hz.csv"), data("validate-triangle-50hz.csv")) else { return };
    let grids: Vec<usize> = std::env::var("GRIDS").map_or(vec![32], |g| g.split(',').map(|n| n.parse().unwrap()).collect());
    for grid in grids {
        for dead_time in [DeadTime::Estimate, DeadTime::Fixed(0.0)] {
            let options = Options { dead_time, ..Options::new(grid, DRIVE) };
            let found = identified(&forc, &options);
            let validation = validate(&found.table, &triangle, found.report.dead_time).unwrap();
            println!("{}", serde_json::to_string_pretty(&validation).unwrap());
        }
    }
}
