//! `specgen report` and `specgen reproduce` as a user runs them: bytes, sizes, and the page in a browser, if there is one.

use crate::support;
use std::path::Path;
use std::process::Command;

use crate::support::Folder;

/// Largest report, bytes.
const LARGEST: usize = 5_000_000;

/// A page as rendered by a browser.
struct RenderedPage {
    dom: String,
    console: Vec<String>,
}

/// Renders the page in headless Chromium, in a window of this width (px); none if it is not installed.
fn drawn(page: &Path, width: u32) -> Option<RenderedPage> {
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
            .arg(format!("--window-size={width},800"))
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(["--dump-dom", &format!("file://{}", page.display())])
            .output()
            .ok()
    };
    let output = ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(run)?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let console = text.lines().filter(|line| line.contains(":CONSOLE")).map(str::to_owned).collect();
    Some(RenderedPage { dom: String::from_utf8_lossy(&output.stdout).into_owned(), console })
}

/// Number of figures of a page, and the names of those without points.
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

/// Asserts that every figure is drawn, without console messages or horizontal scrolling, on a phone and, in the full run, on a large
/// screen.
#[track_caller]
fn is_drawn(folder: &Folder, name: &str, expected: &serde_json::Value) {
    for width in support::length(&[390][..], &[1280, 390]) {
        let width = *width;
        let Some(drawn) = drawn(&folder.path(name), width) else {
            return support::skipped("no chromium: the page is not drawn");
        };
        assert_eq!(drawn.console, Vec::<String>::new(), "console");
        assert!(drawn.dom.contains("data-errors=\"0\""), "the page's own count of errors");
        assert!(drawn.dom.contains("data-overflow=\"0\""), "{width} px: the page is wider than its window");
        let (count, empty) = figures(&drawn.dom);
        assert_eq!((count, empty), (expected.as_u64().unwrap() as usize, Vec::new()));
        assert_eq!(drawn.dom.matches("<svg role=\"img\"").count(), count, "a picture in each figure");
    }
}

/// Asserts that axe-core finds no violation in the page. It runs in a copy of it.
fn is_accessible(folder: &Folder, name: &str) {
    let Some(axe) = support::axe() else { return };
    let check = format!(
        "document.documentElement.dataset.axe = 'runs'; {}.then(text => {{ document.documentElement.dataset.axe = text || 'none'; }});",
        support::VIOLATIONS
    );
    let page = folder.read(name);
    folder.write("axe.js", axe);
    let scripts = "<script src=\"axe.js\"></script><script>addEventListener('load', () => {";
    folder.write("axe.html", format!("{page}{scripts} {check} }});</script>"));
    for width in [1280, 390] {
        let Some(drawn) = drawn(&folder.path("axe.html"), width) else {
            return support::skipped("no chromium: the page is not drawn");
        };
        let found = drawn.dom.split("data-axe=\"").nth(1).and_then(|rest| rest.split('"').next());
        assert_eq!(found, Some("none"), "{name}, {width} px");
    }
}

/// Asserts that the page ends with the numbers of its figures, with as many tables as its heading says.
#[track_caller]
fn has_numbers(page: &str) {
    let (_, rest) = page.split_once("<summary>Numbers of ").unwrap();
    let (count, rest) = rest.split_once(" figures</summary>").unwrap();
    let tables = rest.split("</details>").next().unwrap().matches("<table>").count();
    assert!(tables > 5 && tables == count.parse::<usize>().unwrap(), "{tables} tables of {count} figures");
    // Each chart or image of the page has one table, however often it is shown.
    let kept = page.matches("\"series\":[").count();
    assert!(tables >= kept, "{tables} tables, {kept} charts");
}

/// Asserts that the page has these words in this order.
#[track_caller]
fn in_order(page: &str, words: &[&str]) {
    let mut from = 0;
    for word in words {
        from += page[from..].find(word).unwrap_or_else(|| panic!("{word} does not follow"));
    }
}

#[test]
fn the_report_of_six_legs_is_one_small_page_that_begins_with_the_verdict() {
    let folder = Folder::new();
    let arguments = ["report", "legs.toml", "--no-target", "-o"];
    let document = folder.json(&[&arguments[..], &["page.html"]].concat());
    assert_eq!(document.code, 0, "{:#}", document.value);
    let result = &document.value["result"];
    let page = folder.read("page.html");
    assert_eq!(
        (&result["bytes"], &result["verdict"]),
        (&page.len().into(), &"Ready, not measured, on assumptions".into())
    );
    assert!(page.len() < LARGEST, "{} bytes", page.len());
    in_order(
        &page,
        &[
            "id=\"verdict\"",
            "Ready, not measured, on assumptions",
            "10 assumed values, simulated leg record",
            "Reach per axis",
            "data-view=\"platform\"",
            "Findings",
            "id=\"tracking\"",
            "id=\"error-budget\"",
            "id=\"margins\"",
            "id=\"hysteresis\"",
            "id=\"tables\"",
            "Output of check --details",
        ],
    );
    assert!(page.contains("Not measured: skipped by --no-target"));
    has_numbers(&page);
    is_drawn(&folder, "page.html", &result["figures"]);
    if support::length(false, true) {
        assert_eq!(folder.run(&[&arguments[..], &["again.html"]].concat()).code, 0);
        assert!(folder.read("again.html") == page, "two runs, two pages");
    }
}

/// With limits of two kinds, one of which is exceeded; and the paper's figures on a separate page.
#[test]
fn the_report_of_a_platform_judges_errors_by_their_limits() {
    let folder = Folder::new();
    let limits = "[requirements]\nrotation_noise = \"20 nrad\"\n\n[[requirements.tracking]]\ntrajectory = \"case-1\"\ntranslation = \"50 nm\"\n\n[[requirements.tracking]]\ntrajectory = \"case-2\"\nfrequency = \"10 Hz\"\naxes = [\"1 nm\", \"1 um\", \"1 um\", \"1 mrad\", \"1 mrad\", \"1 mrad\"]\n\n[target]\n";
    let spec = folder.read("reference.toml");
    folder.write("limited.toml", spec.replace("[target]\n", limits));
    let checked = folder.run(&["check", "limited.toml"]);
    assert_eq!(checked.code, 1, "{}", checked.stderr);
    in_order(
        &checked.stdout,
        &["reference is NOT ready: noise θx/θy/θz 26.9/", "2 limits, not simulated here: specgen report"],
    );
    let run = folder.run(&["report", "limited.toml", "--no-target", "-o", "limited.html"]);
    run.says(1, &["E0347", "reference is NOT ready: noise θx/θy/θz 26.9/26.9/22.4 > 20/20/20 nrad, case-2 10 Hz x"]);
    assert!(run.stdout.starts_with("Not safe to build: noise of θx\n"), "{}", run.stdout);
    let page = folder.read("limited.html");
    in_order(
        &page,
        &["Not safe to build", "requirements.rotation_noise", "Error of case-2 10 Hz x", "requirements.tracking"],
    );
    in_order(
        &page,
        &["14 assumed values, simulated leg record", "noise at rest in θ", "E0347", "<table>", "not measured: 14"],
    );
    // The border of structural modes: a line for each kind, none of which enters the declared range.
    let border = page.split("\"border\":").nth(1).unwrap();
    let border = serde_json::Deserializer::from_str(border).into_iter::<serde_json::Value>().next().unwrap().unwrap();
    let series = border["series"].as_array().unwrap();
    let names: Vec<&str> = series.iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["leg", "gauge", "frame", "least of the declared range"]);
    let numbers = |one: usize, axis: &str| -> Vec<f64> { serde_json::from_value(series[one][axis].clone()).unwrap() };
    let (declared, least) = (numbers(3, "x"), numbers(3, "y"));
    assert!(
        declared[0] == declared[1] && declared[2] == 5000.0 && least == [1.0, 0.01, 0.01],
        "{declared:?} {least:?}"
    );
    for (kind, name) in names[..3].iter().enumerate() {
        let (x, y) = (numbers(kind, "x"), numbers(kind, "y"));
        let mut within = x.windows(2).zip(&y).filter(|(x, _)| x[0] >= declared[0] && x[1] > x[0]);
        assert!(within.all(|(_, ratio)| *ratio <= 0.01), "{name}");
        assert!(y.iter().any(|ratio| *ratio > 0.01), "{name}");
    }
    let table = page.split("<caption>Errors on trajectories, rms</caption>").nth(1).unwrap();
    for (name, word) in [
        ("case-1 1 Hz xyz", "within limit"),
        ("case-2 10 Hz x", "exceeds limit"),
        ("machining 1 Hz", "no limit in the spec"),
    ] {
        let row = table.split(&format!("<td>{name}</td>")).nth(1).unwrap().split("</tr>").next().unwrap();
        assert!(row.contains(word), "{name}: {row}");
    }
}

/// The page of a platform, and the paper's figures and tables of it.
// The paper's page of six legs is made by the same code in a fifth of the time.
#[test]
#[ignore = "long: another report, with the paper's page"]
fn the_report_of_a_platform_has_every_figure_and_table() {
    let folder = Folder::new();
    let document =
        folder.json(&["report", "reference.toml", "--paper", "--generations", "1", "--no-target", "-o", "page.html"]);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let page = folder.read("page.html");
    assert!(page.len() < LARGEST, "{} bytes", page.len());
    assert!(page.contains("The spec sets no limit"));
    assert!(page.contains("W0458") && page.contains("href=\"page-paper.html\""), "a finding of check, the other page");
    has_numbers(&page);
    is_drawn(&folder, "page.html", &document.value["result"]["figures"]);

    let paper = folder.read("page-paper.html");
    for figure in (11..=28).chain([3, 4, 29]) {
        assert!(paper.contains(&format!("Fig. {figure}")), "Fig. {figure}");
    }
    for table in (5..=9).chain([3]) {
        assert!(paper.contains(&format!("Table {table}")), "Table {table}");
    }
    is_drawn(&folder, "page-paper.html", &document.value["result"]["paper"]["figures"]);
}

/// The paper's figures of six legs. Each section names its command.
#[test]
#[ignore = "long: the paper's page of six legs"]
fn the_papers_page_of_six_legs_has_its_figures_and_tables() {
    let folder = Folder::new();
    let document =
        folder.json(&["report", "legs.toml", "--paper", "--generations", "1", "--no-target", "-o", "page.html"]);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let page = folder.read("page-paper.html");
    for word in ["Fig. 3", "Fig. 4", "Fig. 6", "Fig. 7", "Fig. 8", "Fig. 29", "Table 1", "Table 2", "Table 3"] {
        assert!(page.contains(word), "{word}");
    }
    is_drawn(&folder, "page-paper.html", &document.value["result"]["paper"]["figures"]);
}

/// A spec whose workspace is too small for the paper's paths: the reason is given once, and no figure or table is empty.
#[test]
#[ignore = "long: another report"]
fn paths_that_are_refused_leave_no_empty_figure_or_table() {
    let folder = Folder::new();
    let spec = std::fs::read_to_string(support::repository().join("specs/features/platform-frames.toml")).unwrap();
    folder.write("frames.toml", spec.replace("../records/", "records/"));
    let arguments = ["report", "frames.toml", "--paper", "--generations", "1", "--no-target", "-o", "page.html"];
    let document = folder.json(&arguments);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let paper = folder.read("page-paper.html");
    // Two cases, machining, and the linear relation.
    assert_eq!(paper.matches("The controller refused set-points").count(), 4);
    for (name, figures) in [("page.html", "figures"), ("page-paper.html", "paper")] {
        let page = folder.read(name);
        assert!(!page.contains("<td>–</td>") && !page.contains("class=\"n\">–</td>"), "a value that was not made");
        let result = &document.value["result"];
        is_drawn(&folder, name, if figures == "paper" { &result["paper"]["figures"] } else { &result["figures"] });
    }
}

/// The check of pages detects errors.
#[test]
fn a_page_with_an_empty_figure_or_an_error_is_seen() {
    let (count, empty) = figures(
        "<figure data-points=\"12\"></figure><figure class=\"chart\" data-points=\"0\"></figure><figure class=\"chart\"></figure>",
    );
    assert_eq!((count, empty.len()), (3, 2));
    let folder = Folder::new();
    folder.write("bad.html", "<!doctype html><title>x</title><script>nowhere()</script>");
    match drawn(&folder.path("bad.html"), 800) {
        Some(drawn) => assert_eq!(drawn.console.len(), 1, "{:?}", drawn.console),
        None => support::skipped("no chromium: console errors are not seen"),
    }
}

#[test]
fn a_report_violates_no_rule_of_accessibility_and_names_the_board_of_the_spec() {
    let folder = Folder::new();
    folder.spec("board.toml", &[("mcu = \"mps2-an500\"", "mcu = \"stm32h743zi\"")]);
    folder.json(&["report", "board.toml", "-o", "board.html", "--no-target"]);
    let page = folder.read("board.html");
    let board = "NUCLEO-H743ZI2";
    for place in [format!("<title>board.toml: report for {board}<"), format!("Controller on {board}<")] {
        assert!(page.contains(&place), "{place}");
    }
    is_accessible(&folder, "board.html");
}

#[test]
fn a_spec_that_is_refused_gives_a_page_that_says_why() {
    let folder = Folder::new();
    folder.spec("bad.toml", &[("grid    = 32", "grid    = 1")]);
    let document = folder.json(&["report", "bad.toml", "-o", "bad.html"]);
    document.finding("E0301");
    assert_eq!(document.code, 1);
    let page = folder.read("bad.html");
    in_order(
        &page,
        &["Not safe to build: ", "Nothing was generated", "<u>1</u>", "<b>Do:</b>", "Explain E0301", "not computed"],
    );
    is_drawn(&folder, "bad.html", &0.into());

    let spec = folder.read("reference.toml");
    folder.write("far.toml", spec.replace("\"50 um\", \"50 um\", \"52 um\"", "\"50 um\", \"50 um\", \"95 um\""));
    let document = folder.json(&["report", "far.toml", "-o", "far.html"]);
    assert_eq!(document.code, 1);
    let page = folder.read("far.html");
    in_order(
        &page,
        &["Not safe to build: z is out of reach", "<u>", "95 um", "Reach per axis", "data-view=\"platform\"", "W0458"],
    );
    // The platform alone.
    is_drawn(&folder, "far.html", &1.into());

    let before = folder.listing();
    folder.json(&["report", "nothing.toml"]).finding("E0101");
    assert_eq!(folder.listing(), before);
}

/// A recorded run, here from a simulation: simulating its commands again gives the same errors.
#[test]
#[ignore = "long: a record is replayed to the bit in the short run"]
fn a_recorded_run_stands_beside_the_simulation_of_its_commands() {
    let folder = Folder::new();
    let run = folder.run(&["sim", "reference.toml", "--record", "run.rec", "--seconds", "0.5"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document = folder.json(&["report", "reference.toml", "--record", "run.rec", "-o", "run.html"]);
    assert_eq!(document.code, 0, "{:#}", document.value);
    let page = folder.read("run.html");
    in_order(
        &page,
        &[
            "The run is complete",
            "the simulation of the same commands gives",
            "late ticks",
            "at a limit",
            "identical over",
            "id=\"errors\"",
            "id=\"spectra\"",
            "id=\"noise\"",
            "id=\"hysteresis\"",
            "id=\"timing\"",
        ],
    );
    has_numbers(&page);
    is_drawn(&folder, "run.html", &document.value["result"]["figures"]);
    // A recording of another spec.
    let refused = folder.json(&["report", "legs.toml", "--record", "run.rec", "-o", "other.html"]);
    assert!(refused.code == 1 && refused.error().contains("give the spec that the target was built from"));
    if support::length(true, false) {
        return support::skipped("only in the full run: records of six legs");
    }
    // A recording of six legs, and one without its first two blocks, in which the machine arms, so that it starts during a run.
    let run = folder.run(&["sim", "legs.toml", "--record", "legs.rec", "--seconds", "1.5"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let whole = std::fs::read(folder.path("legs.rec")).unwrap();
    let mut blocks = whole.windows(8).enumerate().filter(|(_, word)| word == b"SPGBLOCK").map(|(place, _)| place);
    let [first, third] = [blocks.next().unwrap(), blocks.nth(1).unwrap()];
    std::fs::write(folder.path("middle.rec"), [&whole[..first], &whole[third..]].concat()).unwrap();
    for (record, drawn_only) in [("legs.rec", false), ("middle.rec", true)] {
        let document = folder.json(&["report", "legs.toml", "--record", record, "-o", "legs.html"]);
        assert_eq!(document.code, 0, "{:#}", document.value);
        let page = folder.read("legs.html");
        let number = |before: &str| -> f64 {
            page.split_once(before).unwrap().1.split('\u{2009}').next().unwrap().parse().unwrap()
        };
        let [recorded, simulated] = [number("recorded. Error "), number("the same commands gives ")];
        assert!((0.9..1.1).contains(&(recorded / simulated)), "{record}: {recorded} nm, simulated {simulated} nm");
        assert_eq!(page.contains("0.20 s of the record are drawn but not scored"), drawn_only, "{record}");
    }
}

/// All experiments with a short search, outside of the repository, because the specs are in the binary.
#[test]
#[ignore = "long: every experiment of the paper, twice; `paper_tables` holds its figures in the short run"]
fn reproduce_gives_the_same_bytes_twice_and_every_table() {
    let folder = Folder::new();
    for output in ["first", "second"] {
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
    assert!(first == support::contents(&folder.path("second")), "two runs, two results");
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
    // The project's claims for Table 2 and Fig. 29.
    for line in csv.lines().filter(|line| line.starts_with("table-2,invhys")) {
        assert!(line.contains(",agrees,"), "{line}");
    }
    for line in csv.lines().filter(|line| line.starts_with("figure-29,\"PCC")) {
        assert!(line.contains(",agrees,"), "{line}");
    }
}
