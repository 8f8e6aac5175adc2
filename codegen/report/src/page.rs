//! The page: sections to HTML, with style, script and data inside. Nothing is fetched.

use std::fmt::Write as _;

use super::chart::Chart;
use super::plot::escaped;
use super::section::{Grid, Part, Section};

const STYLE: &str = include_str!("assets/report.css");
const SCRIPT: &str =
    concat!(include_str!("assets/chart.js"), include_str!("assets/view.js"), include_str!("assets/page.js"));

/// What stands above the sections.
#[derive(Debug, Clone)]
pub struct Head {
    /// Name of the platform.
    pub name: String,
    /// Digest of the spec, hexadecimal.
    pub digest: String,
    /// The command that makes the page.
    pub command: String,
}

/// The page. The same sections give the same bytes.
#[must_use]
pub fn html(head: &Head, sections: &[Section]) -> String {
    let mut out = String::new();
    let title = escaped(&head.name);
    // Writing to a String cannot fail, here and below.
    let _ = write!(
        out,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"specgen {version}\">\n<title>{title}: report</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<p>Report of specgen {version} on spec digest <code>{digest}</code>. This page again: <code>{command}</code>. <button id=\"theme\" type=\"button\">light / dark</button></p>\n<noscript><p><strong>The figures are drawn by this page's own script; it is switched off.</strong></p></noscript>\n</header>\n",
        version = env!("CARGO_PKG_VERSION"),
        digest = escaped(&head.digest),
        command = escaped(&head.command),
    );
    out.push_str("<nav><ul>\n");
    for section in sections {
        let _ = writeln!(out, "<li><a href=\"#{}\">{}</a></li>", section.id, escaped(&section.title));
    }
    out.push_str("</ul></nav>\n<main>\n");
    let mut data = serde_json::Map::new();
    for section in sections {
        write_section(&mut out, section, &mut data);
    }
    out.push_str("</main>\n");
    // `</script>` in a text would end it.
    let data = serde_json::Value::Object(data).to_string().replace("</", "<\\/");
    let _ = write!(
        out,
        "<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n"
    );
    out
}

fn write_section(out: &mut String, section: &Section, data: &mut serde_json::Map<String, serde_json::Value>) {
    let _ = writeln!(out, "<section id=\"{}\">\n<h2>{}</h2>", section.id, escaped(&section.title));
    if !section.command.is_empty() {
        let _ = writeln!(out, "<p class=\"again\">Again: <code>{}</code></p>", escaped(&section.command));
    }
    for part in &section.parts {
        match part {
            Part::Text(text) => {
                let _ = writeln!(out, "<p>{}</p>", escaped(text));
            }
            Part::Lines(lines) => {
                let _ = writeln!(out, "<pre>{}</pre>", escaped(lines));
            }
            Part::Table(grid) => write_table(out, grid),
            Part::Charts(charts) => write_charts(out, charts, data),
            Part::View(view) => {
                let _ = writeln!(out, "<figure class=\"view\" data-view=\"{}\"></figure>", section.id);
                data.insert(section.id.to_owned(), view.clone());
            }
        }
    }
    out.push_str("</section>\n");
}

fn write_table(out: &mut String, grid: &Grid) {
    let _ = writeln!(out, "<div class=\"table\"><table>\n<caption>{}</caption>\n<thead><tr>", escaped(&grid.caption));
    let numbers: Vec<bool> = (0..grid.head.len()).map(|column| numeric(grid, column)).collect();
    let class = |column: usize| if numbers.get(column) == Some(&true) { " class=\"n\"" } else { "" };
    for (column, text) in grid.head.iter().enumerate() {
        let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(column), escaped(text));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &grid.rows {
        out.push_str("<tr>");
        for (column, text) in row.iter().enumerate() {
            let _ = write!(out, "<td{}>{}</td>", class(column), escaped(text));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
}

/// Whether a column holds numbers and is set to the right: most of its texts are numbers, and at least one.
fn numeric(grid: &Grid, column: usize) -> bool {
    let texts = grid.rows.iter().filter_map(|row| row.get(column)).filter(|text| !text.is_empty());
    let (mut numbers, mut all) = (0, 0);
    for text in texts {
        all += 1;
        numbers += usize::from(text.trim_start_matches(['<', '>', ' ']).parse::<f64>().is_ok());
    }
    2 * numbers > all
}

fn write_charts(out: &mut String, charts: &[Chart], data: &mut serde_json::Map<String, serde_json::Value>) {
    out.push_str("<div class=\"charts\">\n");
    for chart in charts {
        let _ = writeln!(
            out,
            "<figure class=\"chart\" data-chart=\"{}\"><figcaption>{}</figcaption></figure>",
            chart.id,
            escaped(&chart.title)
        );
        data.insert(chart.id.clone(), chart.data());
    }
    out.push_str("</div>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Axis, LINE};

    fn page() -> String {
        let chart = Chart::new("a", "x < y", Axis::linear("t", "s"), Axis::linear("</script>", "nm")).over_time(
            "one",
            LINE,
            [0.0, 1.0],
            &[1.0, 2.0],
        );
        let mut table = Grid::new("caption & more", &["a", "b"]);
        table.push(vec!["-1.5".to_owned(), "<b>".to_owned()]);
        let section =
            Section::new("first", "A & B", "specgen sim x.toml").text("a < b").table(table).charts(vec![chart]);
        let head = Head { name: "n".to_owned(), digest: "d".to_owned(), command: "c".to_owned() };
        html(&head, &[section])
    }

    #[test]
    fn texts_stay_texts_and_data_does_not_end_its_script() {
        let page = page();
        assert!(page.contains("<h2>A &amp; B</h2>") && page.contains("<td class=\"n\">-1.5</td><td>&lt;b&gt;</td>"));
        assert_eq!(page.matches("</script>").count(), 2, "data and script");
        assert!(page.contains("<\\/script>"));
    }

    #[test]
    fn nothing_is_fetched() {
        let page = page();
        // The one address is the name of SVG's namespace.
        let addresses: Vec<_> = page.match_indices("http").map(|(at, _)| &page[at..at + 26]).collect();
        assert!(addresses.iter().all(|address| *address == "http://www.w3.org/2000/svg"), "{addresses:?}");
        for word in ["fetch(", "XMLHttpRequest", "import ", "@import", "url("] {
            assert!(!page.contains(word), "{word}");
        }
    }
}
