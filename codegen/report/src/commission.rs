//! The page about a commissioning as HTML: its text, with charts of the records beside it. The same folder gives the same bytes.

use std::path::Path;

use serde_json::Value;
use specgen_language::outcome::Failure;
use specgen_language::output::write_file;

use super::chart::{Axis, BLUE, Chart, DASHED, DOTS, INK, LINE, Note};
use super::page::{Head, html};
use super::plot::escaped;
use super::section::{Part, Section};

/// Files of the folder.
const TEXT: &str = "commission.md";
const STATE: &str = "commission.json";
const PAGE: &str = "commission.html";
/// Largest number of points of a curve.
const POINTS: usize = 2000;
const LEGS: usize = 6;

/// Writes `commission.html` into the folder of a commissioning that has a page.
///
/// # Errors
/// A file cannot be read or written.
pub fn write(folder: &Path) -> Result<(), Failure> {
    // Not as inputs: the same command may write them again.
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read_to_string(&path)
            .map_err(|error| Failure::Environment(format!("could not read `{}`: {error}", path.display())))
    };
    if !folder.join(TEXT).exists() {
        return Ok(());
    }
    let state: Value = serde_json::from_str(&read(STATE)?).unwrap_or_default();
    write_file(&folder.join(PAGE), page(&read(TEXT)?, &state, folder).as_bytes())
}

fn page(text: &str, state: &Value, folder: &Path) -> String {
    let word = |key: &str| state[key].as_str().unwrap_or_default().to_owned();
    let (name, machine) = (word("name"), word("machine"));
    let mut parts = text.split("\n## ");
    let first = parts.next().unwrap_or_default();
    let head = Head {
        file: name,
        title: "commissioning".to_owned(),
        digest: if state["written"].is_string() { word("written") } else { word("spec") },
        versions: machine,
        command: "specgen commission --report".to_owned(),
        refused: false,
        other: None,
    };
    let sections: Vec<Section> = parts.map(|part| section(part, state, folder)).collect();
    let heading = first.lines().next().unwrap_or_default().trim_start_matches("# ");
    let beyond = text.lines().filter(|line| line.ends_with("MISSES")).count();
    let rest = text.split_once("\n## Findings\n").map_or("", |(_, rest)| rest);
    let findings = rest.lines().take_while(|line| !line.starts_with("## "));
    let found = findings.filter(|line| line.starts_with("- ")).count();
    let limits = counted(beyond, "figure beyond its limit", "figures beyond their limits");
    let first = [
        Part::Html(format!("<h1>{}</h1>", escaped(heading))),
        Part::Lead(format!("Result: {limits}, {}.", counted(found, "finding", "findings"))),
        Part::Lines(lines(first.lines().skip(1))),
    ];
    html(&head, &first, &sections, &[])
}

fn counted(count: usize, one: &str, many: &str) -> String {
    match count {
        0 => format!("no {many}"),
        1 => format!("1 {one}"),
        more => format!("{more} {many}"),
    }
}

/// A section of the text, with its charts.
fn section(text: &str, state: &Value, folder: &Path) -> Section {
    let (title, body) = text.split_once('\n').unwrap_or((text, ""));
    let (id, charts) = match title {
        "Wiring" => ("wiring", Vec::new()),
        "Noise at rest, without feedback" => ("noise", Vec::new()),
        "Response at rest" => ("response", Vec::new()),
        "Cross-talk" => ("cross-talk", Vec::new()),
        "Legs" => ("legs", legs(state, folder)),
        "Before and after" => ("before", Vec::new()),
        "Acceptance" => ("acceptance", hold(folder).into_iter().collect()),
        "Sensitivity |S|" => ("sensitivity", vec![sensitivity(state)]),
        "Learned" => ("learned", Vec::new()),
        "Findings" => ("findings", Vec::new()),
        _ => ("more", Vec::new()),
    };
    Section::new(id, title, "").lines(&lines(body.lines())).charts(charts)
}

/// Lines without the fences of Markdown, and without empty ones at the ends.
fn lines<'a>(text: impl Iterator<Item = &'a str>) -> String {
    let kept: Vec<&str> = text.filter(|line| !line.starts_with("```")).collect();
    kept.join("\n").trim_matches('\n').to_owned() + "\n"
}

/// Columns of a record; none if one is missing.
fn columns(path: &Path, names: &[String]) -> Option<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path).ok()?;
    let mut rows = text.lines();
    let title: Vec<&str> = rows.next()?.split(',').collect();
    let places = names.iter().map(|name| title.iter().position(|known| known == name)).collect::<Option<Vec<_>>>()?;
    let mut columns = vec![Vec::new(); names.len()];
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        for (column, place) in columns.iter_mut().zip(&places) {
            column.push(cells.get(*place)?.parse().unwrap_or(f64::NAN));
        }
    }
    Some(columns)
}

/// Error of a machine that holds, nm.
fn hold(folder: &Path) -> Option<Chart> {
    let mut names = vec!["time_s".to_owned()];
    for axis in 0..3 {
        names.extend(["pose", "target"].map(|of| format!("{of}[{axis}]_m")));
    }
    let columns = columns(&folder.join("accept-hold.csv"), &names)?;
    let time = &columns[0];
    let step = time.get(1)? - time[0];
    let mut chart = Chart::new("hold", "Error at rest", Axis::linear("time", "s"), Axis::linear("error", "nm"));
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let [pose, target] = [&columns[1 + 2 * axis], &columns[2 + 2 * axis]];
        let errors: Vec<f64> = target.iter().zip(pose).map(|(target, pose)| 1e9 * (target - pose)).collect();
        chart = chart.over_time(name, LINE, [0.0, step], &errors);
    }
    Some(chart)
}

/// Largest |S| of the axes over frequency.
fn sensitivity(state: &Value) -> Chart {
    let all = state["sensitivity"].as_array().map_or(&[][..], Vec::as_slice);
    let largest = |one: &Value, key: &str| {
        // Only where it was measured.
        let shown = (0..LEGS).filter(|axis| one["measured"][axis].is_number());
        shown
            .filter_map(|axis| one[key][axis].as_f64())
            .fold(f64::NAN, |most, value| if value <= most { most } else { value })
    };
    let points = |key: &str| -> Vec<[f64; 2]> {
        let mut points: Vec<[f64; 2]> =
            all.iter().filter_map(|one| Some([one["hertz"].as_f64()?, largest(one, key)])).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let modes: Vec<f64> =
        all.iter().filter(|one| one["mode"].is_number()).filter_map(|one| one["hertz"].as_f64()).collect();
    let numbers = (1..=modes.len()).map(|number| number.to_string()).collect();
    Chart::new("sensitivity", "Largest |S| of the axes", Axis::log("frequency", "Hz"), Axis::log("|S|", ""))
        .with("computed", DASHED, points("computed"))
        .colored(INK)
        .with("measured", DOTS, points("measured"))
        .colored(BLUE)
        .noted(Note::Modes(modes, numbers))
}

/// The main reversal curves of each leg.
fn legs(state: &Value, folder: &Path) -> Vec<Chart> {
    let chart = |leg: usize| {
        let record = state["legs"][leg]["record"].as_str()?;
        let found = columns(&folder.join(record), &[format!("volts[{leg}]_mean_V"), format!("leg[{leg}]_m")])?;
        let (volts, moved) = (&found[0], &found[1]);
        let every = volts.len() / POINTS + 1;
        let points = volts.iter().zip(moved).step_by(every).map(|(volts, moved)| [*volts, 1e6 * moved]).collect();
        let (x, y) = (Axis::linear("voltage", "V"), Axis::linear("displacement", "um"));
        let mut chart = Chart::new(&format!("leg-{leg}"), &format!("Reversal curves of leg {leg}"), x, y);
        chart.short = format!("leg {leg}");
        Some(chart.with("measured", LINE, points).colored(BLUE))
    };
    (0..LEGS).filter_map(chart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_the_text_and_its_charts_and_the_same_bytes_again() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path()).unwrap();
        assert!(!folder.path().join(PAGE).exists(), "nothing to show");
        let text = "# Commissioning of stage\n\nspec ab\n\n## Legs\n\n```text\nleg 0 plays\n```\n\n## Acceptance\n\n```text\nhold, x 3 nm\n```\n\n\
            ## Sensitivity |S|\n\n```text\n10.5 measured 0.05\n```\n\nthe end\n";
        let state = r#"{ "name": "stage", "spec": "ab", "machine": "no. 7", "legs": [{ "record": "leg0.csv" }],
            "sensitivity": [{ "hertz": 10.5, "measured": [0.05, null], "computed": [0.04, 9.0] },
                            { "hertz": 361.0, "mode": 0, "measured": [1.2, 1.1], "computed": [1.1, 1.3] }] }"#;
        std::fs::write(folder.path().join(TEXT), text).unwrap();
        std::fs::write(folder.path().join(STATE), state).unwrap();
        std::fs::write(folder.path().join("leg0.csv"), "volts[0]_mean_V,leg[0]_m\n0.0,0.0\n10.0,6e-6\n0.0,1e-7\n")
            .unwrap();
        let title = "time_s,pose[0]_m,target[0]_m,pose[1]_m,target[1]_m,pose[2]_m,target[2]_m";
        std::fs::write(
            folder.path().join("accept-hold.csv"),
            format!("{title}\n1.0,1e-9,0,0,0,0,0\n1.1,-1e-9,0,0,0,0,0\n"),
        )
        .unwrap();
        let made = || {
            write(folder.path()).unwrap();
            std::fs::read_to_string(folder.path().join(PAGE)).unwrap()
        };
        let page = made();
        for part in [
            "<h1>Commissioning of stage</h1>",
            "no figures beyond their limits, no findings",
            "leg 0 plays",
            "Reversal curves of leg 0",
            "Error at rest",
            "Largest |S| of the axes",
            "no. 7",
            "the end",
        ] {
            assert!(page.contains(part), "{part}");
        }
        assert!(!page.contains("```") && page == made());
    }
}
