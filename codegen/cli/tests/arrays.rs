//! Tables as arrays, as a user writes them: the same numbers as the CSV, for this program and for NumPy and SciPy.

use std::process::Command;

use crate::support::{Folder, skipped};

/// The columns of a file of CSV: names and bits; comments are left out.
fn columns(text: &str) -> Vec<(String, Vec<u64>)> {
    let mut rows = text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(','));
    let mut columns: Vec<(String, Vec<u64>)> = rows.next().unwrap().map(|name| (name.to_owned(), Vec::new())).collect();
    for row in rows {
        for (column, field) in columns.iter_mut().zip(row) {
            column.1.push(field.parse::<f64>().unwrap().to_bits());
        }
    }
    columns
}

/// Every array of a file by NumPy and SciPy, as `name,` and the bits of its values.
const DUMP: &str = "
import sys
import numpy, scipy.io
for path in sys.argv[1:]:
    arrays = scipy.io.loadmat(path) if path.endswith('.mat') else numpy.load(path)
    for name in [name for name in arrays if not name.startswith('__')]:
        values = arrays[name]
        if values.dtype.kind == 'U':
            print(name, *values.ravel())
        else:
            print(name, *values.astype('<f8').ravel().view('<u8'))
";

/// Commands that write a table, without the name of its file.
const WRITERS: [&[&str]; 4] = [
    &["forc", "--grid", "4", "-o"],
    &["identify", "leg.csv", "--drive", "0:100", "--grid", "4", "-o"],
    &["identify", "predict", "table.csv", "leg.csv", "-o"],
    &["replay", "run.rec", "--csv"],
];

#[test]
fn arrays_have_the_numbers_of_the_csv() {
    let folder = Folder::new();
    let simulated = ["sim", "legs.toml", "--seconds", "0.05", "--record", "run.rec"];
    assert_eq!(folder.run(&simulated).code, 0);
    for (name, line) in ["leg", "table", "predicted", "run"].into_iter().zip(WRITERS) {
        for form in ["csv", "npz", "mat"] {
            let file = format!("{name}.{form}");
            let run = folder.run(&[line, &[&file]].concat());
            assert_eq!(run.code, 0, "{file}: {}", run.stderr);
        }
        let wanted = folder.read(&format!("{name}.csv"));
        for form in ["npz", "mat"] {
            let back = format!("{name}-{form}.csv");
            let file = format!("{name}.{form}");
            let run = folder.run(&["export", "table", &file, "-o", &back]);
            if name == "run" {
                // Its texts are no numbers: a part of the table would be a silent loss.
                assert!(run.code == 1 && run.stderr.contains("no numbers"), "{}", run.stderr);
                continue;
            }
            assert_eq!(run.code, 0, "{back}: {}", run.stderr);
            let found = folder.read(&back);
            assert_eq!(columns(&found), columns(&wanted), "{back}");
            let comment =
                |text: &str| text.lines().filter(|line| line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(comment(&found), comment(&wanted), "{back}");
        }
    }
    // Read in the place of the CSV.
    for form in ["npz", "mat"] {
        let record = format!("leg.{form}");
        let table = format!("table.{form}");
        for line in [
            &["identify", &record, "--drive", "0:100", "--grid", "4"][..],
            &["identify", "predict", &table, &record],
            &["export", "table", "run.csv", "-o", &format!("again.{form}")],
        ] {
            let run = folder.run(line);
            assert_eq!(run.code, 0, "{line:?}: {}", run.stderr);
        }
    }
    check_with_python(&folder);
}

#[test]
fn what_is_no_table_is_refused_before_the_run() {
    let folder = Folder::new();
    let begun = std::time::Instant::now();
    let mut line = ["sim", "legs.toml", "--seconds", "100000", "--record", "run.npz"];
    let run = folder.run(&line);
    let is_refused = run.code == 2 && run.stderr.contains("only tables are written") && run.stderr.contains("`run`");
    assert!(is_refused && begun.elapsed().as_secs() < 20, "{} {}", run.code, run.stderr);
    (line[3], line[5]) = ("0.05", "run");
    assert_eq!(folder.run(&line).code, 0);
    for line in [&["report", "legs.toml", "-o", "report.mat"][..], &["replay", "run", "--mcap", "run.npz"]] {
        let run = folder.run(line);
        assert!(run.code == 2 && run.stderr.contains("only tables are written"), "{line:?}: {}", run.stderr);
    }
}

#[test]
fn tables_of_other_programs_become_arrays_and_return() {
    let folder = Folder::new();
    for (text, wanted) in [
        ("a,b/c\n# one, two\n1.5,2\n3,4\n", "a,b_per_c\n# one, two\n# column b_per_c is `b/c`\n1.5,2.0\n3.0,4.0\n"),
        (
            "a;b:c;b\\c\n1,5;2;3\n2,5;4;5\n",
            "a,b_c,b_c_2\n# column b_c is `b:c`\n# column b_c_2 is `b\\c`\n1.5,2.0,3.0\n2.5,4.0,5.0\n",
        ),
    ] {
        folder.write("table.csv", text);
        for form in ["npz", "mat"] {
            let arrays = format!("table.{form}");
            assert_eq!(folder.run(&["export", "table", "table.csv", "-o", &arrays]).code, 0, "{form}");
            let run = folder.run(&["export", "table", &arrays, "-o", "back.csv"]);
            assert!(run.code == 0, "{form}: {}", run.stderr);
            assert_eq!(folder.read("back.csv"), wanted, "{form}");
        }
    }
    folder.write("empty.csv", "a,b\n");
    assert_eq!(folder.run(&["export", "table", "empty.csv", "-o", "empty.npz"]).code, 0);
    folder.write("text.csv", "a; b\nno table\n");
    let run = folder.run(&["export", "table", "text.csv", "-o", "text.npz"]);
    assert!(run.code != 0 && run.stderr.contains("there is no table"), "{}", run.stderr);
}

/// What NumPy and SciPy read are the bits of the CSV.
fn check_with_python(folder: &Folder) {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import numpy, scipy.io"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        skipped("no Python with NumPy and SciPy");
        return;
    }
    for name in ["leg", "table", "predicted"] {
        for form in ["npz", "mat"] {
            let output =
                Command::new(&python).args(["-c", DUMP]).arg(folder.path(format!("{name}.{form}"))).output().unwrap();
            let text = String::from_utf8(output.stdout).unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            for (title, bits) in columns(&folder.read(&format!("{name}.csv"))) {
                let bits: Vec<String> = bits.iter().map(u64::to_string).collect();
                let line = format!("{title} {}", bits.join(" "));
                assert!(text.lines().any(|found| found == line), "{name}.{form}: {title}");
            }
        }
    }
    let output =
        Command::new(&python).args(["-c", DUMP]).args([folder.path("run.npz"), folder.path("run.mat")]).output();
    assert!(output.unwrap().status.success());
}

#[test]
fn further_records_replace_no_other_file() {
    let folder = Folder::new();
    let line = ["forc", "--two-rates", "--grid", "4", "-o", "leg.csv"];
    folder.write("leg-fast.csv", "time_s,drive_V,displacement_um\n0,0,0\n");
    let run = folder.run(&line);
    assert!(run.code == 3 && run.stderr.contains("leg-fast.csv"), "{} {}", run.code, run.stderr);
    assert_eq!(folder.read("leg-fast.csv").lines().count(), 2);
    std::fs::remove_file(folder.path("leg-fast.csv")).unwrap();
    folder.write("curves-fast.npz", "another's");
    let run = folder.run(&["forc", "--two-rates", "--grid", "4", "-o", "curves.npz"]);
    assert!(run.code == 3 && run.stderr.contains("curves-fast.npz"), "{} {}", run.code, run.stderr);
    assert_eq!(folder.read("curves-fast.npz"), "another's");
    // Its own are replaced.
    for _ in 0..2 {
        assert_eq!(folder.run(&line).code, 0);
    }
}
