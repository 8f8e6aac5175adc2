//! `specgen report` and `specgen reproduce` as a user runs them: bytes, sizes, and the page in a browser where there is one.

use crate::support;
use std::path::Path;
use std::process::Command;

use crate::support::Folder;

/// Largest report, bytes.
const LARGEST: usize = 5_000_000;

/// What a browser made of a page.
struct Drawn {
    dom: String,
    console: Vec<String>,
}

/// The page in headless Chromium; none where there is no such program.
fn drawn(page: &Path) -> Option<Drawn> {
    let profile = tempfile::tempdir().unwrap();
    let run = |program: &str| {
        Command::new(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"])
            .args([
                "--disable-component-update",
                "--disable-sync",
                "--enable-logging=stderr",
                "--virtual-time-budget=4000",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(["--dump-dom", &format!("file://{}", page.display())])
            .output()
            .ok()
    };
    let output = ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(run)?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let console = text.lines().filter(|line| line.contains(":CONSOLE")).map(str::to_owned).collect();
    Some(Drawn { dom: String::from_utf8_lossy(&output.stdout).into_owned(), console })
}

/// Figures of a page: how many there are, and what those without a point are called.
fn figures(dom: &str) -> (usize, Vec<String>) {
    let mut empty = Vec::new();
    let tags: Vec<&str> = dom.split("<figure ").skip(1).map(|rest| rest.split('>').next().unwrap()).collect();
    for tag in &tags {
        let points = tag.split("data-points=\"").nth(1).and_then(|rest| rest.split('"').next()?.parse().ok());
        if points.unwrap_or(0) < 2 {
            empty.push((*tag).to_owned());
        }
    }
    (tags.len(), empty)
}

#[track_caller]
fn is_drawn(folder: &Folder, name: &str, expected: usize) {
    let Some(drawn) = drawn(&folder.path(name)) else {
        return support::skipped("no chromium: the page is not drawn");
    };
    assert_eq!(drawn.console, Vec::<String>::new(), "console");
    assert!(drawn.dom.contains("data-errors=\"0\""), "the page's own count of errors");
    let (count, empty) = figures(&drawn.dom);
    assert_eq!((count, empty), (expected, Vec::new()));
    assert_eq!(drawn.dom.matches("<svg viewBox=\"0 0 460 290\"").count() + 1, expected, "a picture in each figure");
}

#[test]
fn the_report_of_six_legs_is_one_small_page_with_every_figure() {
    let folder = Folder::new();
    let arguments = ["report", "legs.toml", "--generations", "1", "--no-target", "-o"];
    let document = folder.json(&[&arguments[..], &["page.html"]].concat());
    assert_eq!(document.code, 0, "{:#}", document.value);
    let result = &document.value["result"];
    let page = folder.read("page.html");
    assert_eq!(result["bytes"], page.len());
    assert!(page.len() < LARGEST, "{} bytes", page.len());
    for word in
        ["Fig. 3", "Fig. 4", "Fig. 6", "Fig. 7", "Fig. 8", "Fig. 29", "Table 1", "Table 2", "Table 3", "Error budget"]
    {
        assert!(page.contains(word), "{word}");
    }
    assert!(page.contains("Not measured: left out by --no-target"));
    let sections = result["sections"].as_array().unwrap().len();
    assert_eq!(page.matches("Again: <code>specgen ").count(), sections, "every section names its command");
    is_drawn(&folder, "page.html", result["figures"].as_u64().unwrap() as usize);
    if support::length(false, true) {
        assert_eq!(folder.run(&[&arguments[..], &["again.html"]].concat()).code, 0);
        assert!(folder.read("again.html") == page, "two runs, two pages");
    }
}

#[test]
fn the_report_of_a_platform_has_the_figures_of_section_4() {
    let folder = Folder::new();
    let arguments = ["report", "reference.toml", "--generations", "1", "--no-target", "-o", "page.html"];
    let document = folder.json(&arguments);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let page = folder.read("page.html");
    assert!(page.len() < LARGEST, "{} bytes", page.len());
    for figure in (11..=28).chain([3, 4, 29]) {
        assert!(page.contains(&format!("Fig. {figure}")), "Fig. {figure}");
    }
    for table in (5..=9).chain([3]) {
        assert!(page.contains(&format!("Table {table}")), "Table {table}");
    }
    assert!(page.contains("W0458"), "a finding of check");
    is_drawn(&folder, "page.html", document.value["result"]["figures"].as_u64().unwrap() as usize);
}

/// A spec whose workspace holds none of the paper's paths: why is said once, and no figure or table is left empty.
#[test]
fn paths_that_are_refused_leave_no_empty_figure_or_table() {
    if support::length(true, false) {
        return support::skipped("only in the soak: a third report");
    }
    let folder = Folder::new();
    let spec = std::fs::read_to_string(support::repository().join("specs/features/platform-frames.toml")).unwrap();
    folder.write("frames.toml", spec.replace("../records/", "records/"));
    let document = folder.json(&["report", "frames.toml", "--generations", "1", "--no-target", "-o", "page.html"]);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let page = folder.read("page.html");
    // Two cases, machining, and the linear relation.
    assert_eq!(page.matches("The controller refused set-points").count(), 4);
    assert!(!page.contains("<td>–</td>") && !page.contains("class=\"n\">–</td>"), "a value that was not made");
    is_drawn(&folder, "page.html", document.value["result"]["figures"].as_u64().unwrap() as usize);
}

/// The judge of pages sees what it is there for.
#[test]
fn a_page_with_an_empty_figure_or_an_error_is_seen() {
    let (count, empty) = figures(
        "<figure data-points=\"12\"></figure><figure class=\"chart\" data-points=\"0\"></figure><figure class=\"chart\"></figure>",
    );
    assert_eq!((count, empty.len()), (3, 2));
    let folder = Folder::new();
    folder.write("bad.html", "<!doctype html><title>x</title><script>nowhere()</script>");
    match drawn(&folder.path("bad.html")) {
        Some(drawn) => assert_eq!(drawn.console.len(), 1, "{:?}", drawn.console),
        None => support::skipped("no chromium: console errors are not seen"),
    }
}

#[test]
fn a_spec_that_is_refused_gives_no_page() {
    let folder = Folder::new();
    folder.spec("bad.toml", &[("grid    = 32", "grid    = 1")]);
    let before = folder.listing();
    folder.json(&["report", "bad.toml"]).finding("E0301");
    folder.json(&["report", "nothing.toml"]).finding("E0101");
    assert_eq!(folder.listing(), before);
}

/// The whole list but for a short search, in the soak twice; away from the repository, for the specs are in the binary.
#[test]
fn reproduce_gives_the_same_bytes_twice_and_every_table() {
    let folder = Folder::new();
    let outputs = ["first", "second"];
    for output in support::length(&outputs[..1], &outputs) {
        let run = folder.run(&["reproduce", "--generations", "1", "-o", output]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(
            run.stderr.contains("s left]") && run.stdout.starts_with("# The paper's experiments"),
            "{}",
            run.stderr
        );
    }
    let first = support::contents(&folder.path("first"));
    assert_eq!(first.len(), 4);
    let last = support::contents(&folder.path(support::length("first", "second")));
    assert!(first == last, "two runs, two results");
    let csv = folder.read("first/reproduction.csv");
    let mut rows = 0;
    for record in csv::Reader::from_reader(csv.as_bytes()).records() {
        let record = record.unwrap();
        rows += 1;
        if &record[0] == "table-3" {
            continue;
        }
        let [paper, ours, ratio] = [5, 6, 7].map(|column| record[column].parse::<f64>().unwrap());
        assert!((ours / paper / ratio - 1.0).abs() < 1e-2 || ratio < 1e-4, "{record:?}");
        assert!(!record[8].is_empty() && &record[8] != "unexplained", "{record:?}");
        assert_eq!(&record[8] == "agrees", (ratio - 1.0).abs() <= 0.1, "{record:?}");
    }
    // 18 + 9, 8, 4 × 27, 10, 10.
    assert_eq!(rows, 18 + 9 + 8 + 4 * 27 + 10 + 10);
    // What the project promises of Table 2 and of Fig. 29.
    for line in csv.lines().filter(|line| line.starts_with("table-2,invhys")) {
        assert!(line.ends_with("agrees"), "{line}");
    }
    for line in csv.lines().filter(|line| line.starts_with("figure-29,\"PCC")) {
        assert!(line.ends_with("agrees"), "{line}");
    }
}
