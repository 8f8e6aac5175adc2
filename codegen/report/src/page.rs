//! The page: turns sections into HTML with embedded style, script and data. It loads nothing.

use serde_json::{Map, Value};

use super::chart::Chart;
use super::plot::escaped;
use super::section::{Grid, Multiples, Part, Section};

const STYLE: &str = concat!(include_str!("assets/shared.css"), include_str!("assets/report.css"));
const SCRIPT: &str = concat!(
    include_str!("assets/draw.js"),
    include_str!("assets/plot.js"),
    include_str!("assets/rows.js"),
    include_str!("assets/view.js"),
    include_str!("assets/page.js")
);
/// Symbols for marks; distinguishable by shape without colour.
pub(crate) const MARKS: &str = r##"<svg width="0" height="0" style="position:absolute" aria-hidden="true"><defs>
<symbol id="m-ok" viewBox="0 0 16 16"><circle cx="8" cy="8" r="7.5" fill="var(--blue)"/><path d="M4.6 8.3l2.4 2.4 4.5-5" fill="none" stroke="var(--on)" stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round"/></symbol>
<symbol id="m-warning" viewBox="0 0 16 16"><path d="M8 1.6L15 14H1z" fill="none" stroke="var(--orange)" stroke-width="1.5" stroke-linejoin="round"/><path d="M8 6v4M8 11.6v.9" stroke="var(--orange)" stroke-width="1.6" stroke-linecap="round"/></symbol>
<symbol id="m-error" viewBox="0 0 16 16"><path d="M5 .8h6L15.2 5v6L11 15.2H5L.8 11V5z" fill="var(--orange)"/><path d="M5.5 5.5l5 5M10.5 5.5l-5 5" stroke="var(--on)" stroke-width="1.8" stroke-linecap="round"/></symbol>
<symbol id="m-none" viewBox="0 0 16 16"><circle cx="8" cy="8" r="6.8" fill="none" stroke="var(--edge)" stroke-width="1.4" stroke-dasharray="3 2"/><path d="M5.2 8h5.6" stroke="var(--ink2)" stroke-width="1.5"/></symbol>
<symbol id="m-note" viewBox="0 0 16 16"><circle cx="8" cy="8" r="6.9" fill="none" stroke="var(--ink2)" stroke-width="1.4"/><path d="M8 7.2v4M8 4.6v.9" stroke="var(--ink2)" stroke-width="1.6" stroke-linecap="round"/></symbol>
</defs></svg>
"##;

/// Header of a page.
#[derive(Debug, Clone)]
pub struct Head {
    /// File name of the spec.
    pub file: String,
    /// Window title.
    pub title: String,
    /// Digest of the spec, in hex.
    pub digest: String,
    /// Versions and target.
    pub versions: String,
    /// The command that creates the page.
    pub command: String,
    /// Whether the spec is refused.
    pub refused: bool,
    /// Link to another page: its file and title.
    pub other: Option<[String; 2]>,
}

/// The page: `first` is the first screen, followed by the sections; at the end the numbers of every figure and `evidence`,
/// collapsed. The same arguments give the same bytes.
pub fn html(head: &Head, first: &[Part], sections: &[Section], evidence: &[Section]) -> String {
    let mut page = Page { out: String::new(), data: Map::new(), numbers: Vec::new(), figures: 0 };
    let (file, digest) = (escaped(&head.file), escaped(&head.digest));
    let short: String = head.digest.chars().take(16).collect();
    let (version, title) = (env!("CARGO_PKG_VERSION"), escaped(&head.title));
    let (refused, digest_shown) = (if head.refused { " class=\"refused-page\"" } else { "" }, escaped(&short));
    let versions = escaped(&head.versions);
    page.out += &format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"specgen {version}\">\n<title>{file}: {title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body{refused}>\n{MARKS}<header class=\"top\"><b>{file}</b><code title=\"{digest}\">{digest_shown}</code><span class=\"versions\">{versions}</span>"
    );
    page.out.push_str("<nav>");
    if !first.is_empty() {
        page.out.push_str("<a href=\"#verdict\">Verdict</a>");
    }
    page.out
        .extend(sections.iter().map(|section| format!("<a href=\"#{}\">{}</a>", section.id, escaped(&section.title))));
    if let Some([href, text]) = &head.other {
        page.out += &format!("<a href=\"{}\">{}</a>", escaped(href), escaped(text));
    }
    page.out.push_str("<a href=\"#tables\">Tables</a></nav><button id=\"theme\" type=\"button\">Light / dark</button></header>\n<noscript><p><strong>The figures are drawn by this page's script, but scripts are disabled.</strong></p></noscript>\n<main>\n");
    page.parts(first);
    for section in sections {
        page.section(section);
    }
    page.tables(evidence);
    page.out += &format!(
        "</main>\n<footer>Command: <code>{}</code><span class=\"digest\"> · digest {digest}</span></footer>\n",
        escaped(&head.command)
    );
    // `</script>` in a text would end the script.
    let data = Value::Object(page.data).to_string().replace("</", "<\\/");
    page.out += &format!(
        "<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n"
    );
    page.out
}

/// Number of figures on a page with these parts.
pub fn figures(first: &[Part], sections: &[Section]) -> usize {
    let mut page = Page { out: String::new(), data: Map::new(), numbers: Vec::new(), figures: 0 };
    page.parts(first);
    sections.iter().for_each(|section| page.section(section));
    page.figures
}

struct Page {
    out: String,
    data: Map<String, Value>,
    numbers: Vec<Grid>,
    figures: usize,
}

impl Page {
    fn section(&mut self, section: &Section) {
        let chosen = if section.panes.is_empty() { "" } else { " data-choices" };
        let (id, title) = (&section.id, escaped(&section.title));
        self.out += &format!(
            "<section id=\"{id}\" class=\"card section\"{chosen}>\n<div class=\"head\"><h2>{title}</h2><div class=\"tools\">"
        );
        let depth = section.panes.first().map_or(0, |pane| pane.values.len());
        for axis in 0..depth {
            let mut values: Vec<&str> = Vec::new();
            for pane in &section.panes {
                if !values.contains(&pane.values[axis].as_str()) {
                    values.push(&pane.values[axis]);
                }
            }
            self.choice(axis, &values, &section.panes[0].values[axis]);
        }
        self.out.push_str("</div></div>\n");
        for (k, pane) in section.panes.iter().enumerate() {
            // Spaces in button names do not separate values.
            let value: Vec<String> = pane.values.iter().map(|value| joined(value)).collect();
            let hidden = if k == 0 { "" } else { " hidden" };
            self.out += &format!("<div class=\"pane\" data-value=\"{}\"{hidden}>\n", escaped(&value.join(" ")));
            self.parts(&pane.parts);
            self.out.push_str("</div>\n");
        }
        self.content(section);
        self.out.push_str("</section>\n");
    }

    /// What is not in a pane, and the command that makes the section.
    fn content(&mut self, section: &Section) {
        self.parts(&section.parts);
        if !section.command.is_empty() {
            self.out += &format!("<p class=\"again\">Command: <code>{}</code></p>\n", escaped(&section.command));
        }
    }

    fn choice(&mut self, axis: usize, values: &[&str], first: &str) {
        self.out += &format!("<span class=\"choice\" data-axis=\"{axis}\">");
        for value in values {
            let on = if *value == first { (" class=\"on\"", true) } else { ("", false) };
            let (class, pressed, data, shown) = (on.0, on.1, escaped(&joined(value)), marked(value));
            self.out += &format!(
                "<button type=\"button\"{class} aria-pressed=\"{pressed}\" data-value=\"{data}\">{shown}</button>"
            );
        }
        self.out.push_str("</span>");
    }

    fn parts(&mut self, parts: &[Part]) {
        for part in parts {
            match part {
                Part::Lead(text) => {
                    self.out += &format!("<p class=\"lead\">{}</p>\n", marked(text));
                }
                Part::Text(text) => {
                    self.out += &format!("<p class=\"soft\">{}</p>\n", marked(text));
                }
                Part::Lines(lines) => {
                    self.out += &format!("<pre>{}</pre>\n", escaped(lines));
                }
                Part::Table(grid) => write_table(&mut self.out, grid),
                Part::Chart(chart) => {
                    self.keep(chart);
                    self.figures += 1;
                    let (id, title) = (&chart.id, marked(&chart.title));
                    self.out += &format!(
                        "<figure class=\"plot only\" data-plot=\"{id}\"><figcaption>{title}</figcaption></figure>\n"
                    );
                }
                Part::Multiples(multiples) => self.multiples(multiples),
                Part::Rows(rows) => {
                    self.figures += 1;
                    let (id, title) = (&rows.id, marked(&rows.title));
                    self.out += &format!(
                        "<figure class=\"rows\" data-rows=\"{id}\"><figcaption>{title}</figcaption></figure>\n"
                    );
                    let mut data = rows.data.clone();
                    data["title"] = Value::String(rows.title.clone());
                    self.data.insert(rows.id.clone(), data);
                    self.numbers.push(rows.numbers.clone());
                }
                Part::View(id, view) => {
                    self.figures += 1;
                    self.out += &format!("<figure class=\"view\" data-view=\"{id}\"></figure>\n");
                    self.data.insert((*id).to_owned(), view.clone());
                }
                Part::Columns(columns) => {
                    let class = if columns.len() == 2 { "two" } else { "three" };
                    self.out += &format!("<div class=\"columns {class}\">\n");
                    for column in columns {
                        self.out.push_str("<div>\n");
                        self.parts(column);
                        self.out.push_str("</div>\n");
                    }
                    self.out.push_str("</div>\n");
                }
                Part::Html(html) => self.out.push_str(html),
            }
        }
    }

    fn keep(&mut self, chart: &Chart) {
        if self.data.insert(chart.id.clone(), chart.data()).is_none() {
            self.numbers.push(chart.numbers());
        }
    }

    fn multiples(&mut self, multiples: &Multiples) {
        let selected = multiples.items.get(multiples.selected);
        self.out += &format!(
            "<div class=\"multiples\" data-multiples=\"{}\" data-selected=\"{}\">\n<div class=\"large\">\n",
            multiples.id, multiples.selected
        );
        for _ in selected.into_iter().flatten() {
            self.figures += 1;
            self.out.push_str("<figure class=\"plot large\"><figcaption></figcaption></figure>\n");
        }
        let many = if multiples.items.len() > 6 || multiples.groups.len() == 1 { " many" } else { "" };
        self.out += &format!("</div>\n<div class=\"small{many}\">\n");
        if multiples.groups.len() == 2 {
            self.out.extend(
                multiples.groups.iter().map(|group| format!("<p class=\"caption\">{}</p>\n", marked(&group.title))),
            );
        }
        // Groups are columns; the script finds the figures by their order.
        for (k, charts) in multiples.items.iter().enumerate() {
            charts.iter().for_each(|chart| self.keep(chart));
            self.figures += 1;
            let title = charts.last().map_or("", |chart| chart.title.as_str());
            let named = charts.last().is_some_and(|chart| !chart.short.is_empty());
            let caption = if named { String::new() } else { marked(title) };
            let caption = if caption.is_empty() { caption } else { format!("<figcaption>{caption}</figcaption>") };
            let column = multiples.groups.iter().position(|group| group.items.contains(&k)).unwrap_or(0);
            let style = if multiples.groups.len() == 2 {
                format!(" style=\"grid-column:{}\"", column + 1)
            } else {
                String::new()
            };
            // Its name is that of the picture that the script draws in it.
            self.out += &format!("<figure class=\"plot\" tabindex=\"0\" role=\"button\"{style}>{caption}</figure>\n");
        }
        self.out.push_str("</div>\n</div>\n");
        self.data.insert(multiples.id.clone(), multiples.data());
    }

    /// Tables with the numbers of every figure.
    fn tables(&mut self, evidence: &[Section]) {
        let numbers: Vec<Grid> =
            std::mem::take(&mut self.numbers).into_iter().filter(|grid| !grid.rows.is_empty()).collect();
        self.out += &format!(
            "<section id=\"tables\" class=\"card section\">\n<div class=\"head\"><h2>Tables</h2></div>\n<p class=\"lead\">The numbers of every figure. All points of a chart can be saved as CSV.</p>\n<details><summary>Numbers of {} figures</summary>\n",
            numbers.len()
        );
        for grid in &numbers {
            write_table(&mut self.out, grid);
        }
        self.out.push_str("</details>\n");
        for section in evidence {
            self.out += &format!("<details id=\"{}\"><summary>{}</summary>\n", section.id, escaped(&section.title));
            self.content(section);
            self.out.push_str("</details>\n");
        }
        self.out.push_str("</section>\n");
    }
}

fn joined(value: &str) -> String {
    value.replace([' ', '\u{2009}'], "_")
}

/// Escaped text with axis names of angles as subscripts.
pub fn marked(text: &str) -> String {
    let mut out = escaped(text);
    for axis in ["x", "y", "z"] {
        out = out.replace(&format!("θ{axis}"), &format!("θ<sub>{axis}</sub>"));
    }
    out
}

fn write_table(out: &mut String, grid: &Grid) {
    *out += &format!("<div class=\"table\"><table>\n<caption>{}</caption>\n<thead><tr>\n", escaped(&grid.caption));
    let numbers: Vec<bool> = (0..grid.head.len()).map(|column| numeric(grid, column)).collect();
    let class = |column: usize| if numbers.get(column) == Some(&true) { " class=\"n\"" } else { "" };
    for (column, text) in grid.head.iter().enumerate() {
        *out += &format!("<th scope=\"col\"{}>{}</th>", class(column), escaped(text));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &grid.rows {
        out.push_str("<tr>");
        out.extend(row.iter().enumerate().map(|(column, text)| format!("<td{}>{}</td>", class(column), escaped(text))));
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
}

/// Whether a column is numeric and right-aligned: most of its texts are numbers, and at least one.
fn numeric(grid: &Grid, column: usize) -> bool {
    let texts = grid.rows.iter().filter_map(|row| row.get(column)).filter(|text| !text.is_empty());
    let (mut numbers, mut all) = (0, 0);
    for text in texts {
        all += 1;
        numbers += usize::from(text.trim_start_matches(['<', '>', ' ']).parse::<f64>().is_ok());
    }
    2 * numbers > all
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
        let text = |text: &str| text.to_owned();
        let head = Head {
            file: text("n.toml"),
            title: text("report"),
            digest: text("d"),
            versions: text("v"),
            command: text("c"),
            refused: false,
            other: None,
        };
        html(&head, &[], &[section], &[])
    }

    #[test]
    fn texts_are_escaped_and_data_does_not_end_its_script() {
        let page = page();
        assert!(page.contains("<h2>A &amp; B</h2>") && page.contains("<td class=\"n\">-1.5</td><td>&lt;b&gt;</td>"));
        assert_eq!(page.matches("</script>").count(), 2, "data and script");
        assert!(page.contains("<\\/script>"));
    }

    #[test]
    fn nothing_is_loaded() {
        let page = page();
        // The only address is the name of the SVG namespace.
        let addresses: Vec<_> = page.match_indices("http").map(|(at, _)| &page[at..at + 26]).collect();
        assert!(addresses.iter().all(|address| *address == "http://www.w3.org/2000/svg"), "{addresses:?}");
        for word in ["fetch(", "XMLHttpRequest", "import ", "@import", "url("] {
            assert!(!page.contains(word), "{word}");
        }
    }

    #[test]
    fn a_figure_has_its_numbers() {
        let page = page();
        assert!(
            page.contains("<summary>Numbers of 1 figures</summary>")
                && page.contains("x &lt; y (&lt;/script&gt; (nm) over t (s))")
        );
    }
}
