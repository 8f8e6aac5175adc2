//! The tables as Markdown, CSV and JSON. No clock, path or duration is in them: two runs give the same bytes.

use std::fmt::Write as _;

use serde::{Serialize, Serializer};
use serde_json::json;
use specgen_language::outcome::Outcome;

use super::table::{Cell, Row, Table};
use crate::paper::convergence::Convergence;
use crate::tuning::front;

/// Everything that was found.
#[derive(Debug)]
pub struct Results {
    /// Spec digests: legs, platform.
    pub digests: [String; 2],
    /// Seed of machine and noise.
    pub seed: u64,
    /// In the order of the paper.
    pub tables: Vec<Table>,
    /// Table 3 at work.
    pub convergence: Convergence,
}

/// Four significant digits, without an exponent.
#[must_use]
pub fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let whole = if value == 0.0 { 0 } else { libm::floor(libm::log10(value.abs())) as i32 };
    let decimals = (3 - whole).clamp(0, 9) as usize;
    format!("{value:.decimals$}")
}

/// Text of a cell: the value, or the dash where there is none.
pub fn cell(cell: &Cell) -> String {
    match cell {
        Cell::Number(value) => digits(*value),
        Cell::Text(text) => text.clone(),
    }
}

fn frequency(row: &Row) -> String {
    row.frequency_hz.map_or_else(String::new, |hertz| format!("{hertz}"))
}

/// How the search went, in a sentence.
pub fn fell(convergence: &Convergence) -> String {
    let (Some(first), Some(last)) = (convergence.history.first(), convergence.history.last()) else {
        return "No generation was run.".to_owned();
    };
    let cost = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |cost| format!("{cost:.4e}"));
    let unstable: usize = convergence.history.iter().map(|generation| generation.unstable).sum();
    if last.best.is_none() {
        return format!(
            "{} numbers, {} generations, {} strings, and none with a cost: {unstable} were rejected for their margins and not simulated, the others could not follow the multisine.",
            convergence.dimension,
            convergence.history.len(),
            last.evaluations
        );
    }
    format!(
        "{} numbers, {} generations, {} strings: the best cost falls from {} to {} µm s², the median of a generation from {} to {}; {unstable} strings were rejected for their margins and not simulated.",
        convergence.dimension,
        convergence.history.len(),
        last.evaluations,
        cost(first.best),
        cost(last.best),
        cost(first.median),
        cost(last.median)
    )
}

impl Outcome for Results {
    fn text(&self) -> String {
        self.markdown()
    }
}

impl Results {
    /// Files: name, bytes.
    #[must_use]
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let mut files = vec![
            ("reproduction.md".to_owned(), self.markdown().into_bytes()),
            ("reproduction.csv".to_owned(), self.csv().into_bytes()),
            ("reproduction.json".to_owned(), format!("{:#}\n", json!(self)).into_bytes()),
        ];
        files.push(("convergence.csv".to_owned(), front::history_csv(&self.convergence.history).into_bytes()));
        files
    }

    /// For people.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = format!(
            "# The paper's experiments, reproduced\n\nMade by `specgen reproduce` (specgen {}) with the controllers that it emits, on simulated machines that are not\nof the controller's model class. Ratio: ours over the paper's. Seed of machine and noise: {}.\nSpec digests: legs `{}`, reference `{}`.\n",
            env!("CARGO_PKG_VERSION"),
            self.seed,
            self.digests[0],
            self.digests[1]
        );
        for table in &self.tables {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, "\n## {}\n\n{}. Alone: `{}`.\n\n", table.title, table.how, table.command);
            out.push_str("| case | quantity | Hz | unit | paper | ours | ratio | remark |\n|---|---|---:|---|---:|---:|---:|---|\n");
            for row in &table.rows {
                let _ = writeln!(
                    out,
                    "| {} | {} | {} | {} | {} | {} | {} | {} |",
                    row.case,
                    row.quantity,
                    frequency(row),
                    row.unit,
                    cell(&row.paper).replace('|', "\\|"),
                    cell(&row.ours).replace('|', "\\|"),
                    row.ratio.map_or_else(String::new, digits),
                    row.remark.map_or("", |remark| remark.id())
                );
            }
            out.push('\n');
            for remark in table.remarks() {
                let _ = writeln!(out, "- **{}**: {}", remark.id(), remark.text());
            }
            if table.id == "table-3" {
                let _ = writeln!(out, "\n{} Costs by generation: `convergence.csv`.", fell(&self.convergence));
            }
        }
        out
    }

    /// One line for each comparison.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut out =
            String::from("table,case,quantity,frequency_Hz,unit,paper,ours,ratio,remark,seconds,path_seconds\n");
        let quoted = |text: &str| {
            if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
        };
        let plain = |cell: &Cell| match cell {
            Cell::Number(value) => format!("{value:.6e}"),
            Cell::Text(text) => quoted(text),
        };
        for table in &self.tables {
            for row in &table.rows {
                let _ = writeln!(
                    out,
                    "{},{},{},{},{},{},{},{},{},{}",
                    table.id,
                    quoted(&row.case),
                    quoted(&row.quantity),
                    frequency(row),
                    row.unit,
                    plain(&row.paper),
                    plain(&row.ours),
                    row.ratio.map_or_else(String::new, |ratio| format!("{ratio:.6}")),
                    row.remark.map_or("", |remark| remark.id()),
                    row.coverage.map_or_else(
                        || ",".to_owned(),
                        |coverage| format!("{:.6},{:.6}", coverage.seconds, coverage.path_seconds)
                    )
                );
            }
        }
        out
    }
}

impl Serialize for Results {
    /// With the texts of the remarks, each once.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut remarks = serde_json::Map::new();
        for remark in self.tables.iter().flat_map(Table::remarks) {
            remarks.insert(remark.id().to_owned(), remark.text().into());
        }
        json!({
            "specgen": env!("CARGO_PKG_VERSION"),
            "digests": { "legs": self.digests[0], "reference": self.digests[1] },
            "seed": self.seed,
            "tables": self.tables,
            "convergence": self.convergence,
            "remarks": remarks,
        })
        .serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::remark::Remark;

    fn results() -> Results {
        let rows = vec![
            Row::numbers(["pcc, \"a\"", "x"], Some(10.0), "nm", [156.25, 16.49], Remark::UpperBound),
            Row::numbers(["invhys", "x"], Some(0.1), "nm", [127.039, 126.8], Remark::Unexplained),
        ];
        let table = Table { id: "table-2", title: "Table 2", how: "how".to_owned(), command: "specgen sim", rows };
        let convergence = Convergence { seed: 1, dimension: 2, history: Vec::new(), best: None };
        Results { digests: ["a".to_owned(), "b".to_owned()], seed: 1, tables: vec![table], convergence }
    }

    #[test]
    fn ratios_and_remarks_stand_beside_the_values() {
        let text = results().markdown();
        assert!(text.contains("| 10 | nm | 156.2 | 16.49 | 0.1055 | upper-bound |"), "{text}");
        assert!(text.contains("| 0.1 | nm | 127.0 | 126.8 | 0.9981 | agrees |"), "{text}");
        assert_eq!(text.matches("- **upper-bound**").count(), 1);
    }

    #[test]
    fn a_comma_or_a_quote_in_a_name_stays_one_field() {
        let csv = results().csv();
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!((&rows[0][1], rows.len()), ("pcc, \"a\"", 2));
        assert!((rows[0][7].parse::<f64>().unwrap() - 16.49 / 156.25).abs() < 1e-6);
    }

    #[test]
    fn digits_keep_four_of_them() {
        assert_eq!(
            [digits(0.1282), digits(5702.0), digits(1.6), digits(0.0), digits(f64::NAN)],
            ["0.1282", "5702", "1.600", "0.000", "–"]
        );
    }
}
