//! First screen: the verdict, the deciding figures with their limits, the findings.

use specgen_language::diagnostic::{Diagnostic, Place, Severity, to_json};
use specgen_language::spec::SpecSource;
use specgen_studies::verdict::{Answer, Figure, Mark, Subject, Verdict};

use super::page::marked;
use super::plot::escaped;

/// Width of a limit bar, px; the limit is at four fifths of it.
const BAR: f64 = 76.0;
const LIMIT: f64 = 0.8 * BAR;
/// From this share on a figure is close to its limit.
const TIGHT: f64 = 0.9;
/// Number of findings shown initially; the others are in their section.
const SEEN: usize = 3;

/// A mark by its name: `ok`, `warning`, `error`, `none`, `note`.
pub fn mark(name: &str) -> String {
    let label = match name {
        "ok" => "within limit",
        "none" => "no limit",
        other => other,
    };
    format!("<svg class=\"mark\" role=\"img\" aria-label=\"{label}\"><use href=\"#m-{name}\"/></svg>")
}

fn mark_of(figure: &Figure) -> &'static str {
    match figure.mark {
        Mark::Within => "ok",
        Mark::Beyond => "error",
        Mark::NoLimit => "none",
    }
}

/// A number with thin spaces as thousands separators and a true minus sign.
pub fn thin(text: &str) -> String {
    text.replace(',', "\u{2009}").replace('-', "\u{2212}")
}

/// Used share of the limit; for a lower limit, the limit relative to the value.
pub fn share(figure: &Figure) -> Option<f64> {
    let limit = figure.limit.as_ref()?;
    let share = if limit.least { limit.value / figure.value } else { figure.value / limit.value };
    share.is_finite().then_some(share)
}

/// A row of a card: label, value and limit, bar, share, mark.
pub fn limit_row(label: &str, figure: &Figure) -> String {
    let label = &figure.coverage.map_or_else(|| label.to_owned(), |coverage| format!("{label}, {}", coverage.brief()));
    let Some((limit, share)) = figure.limit.as_ref().zip(share(figure)) else {
        let text = figure.words.clone().unwrap_or_else(|| format!("{} {}", thin(&figure.value_text()), unit(figure)));
        return text_row(label, &text, mark_of(figure));
    };
    let (asked, has) = if limit.least { (limit.value, figure.value) } else { (figure.value, limit.value) };
    let decimals = decimals(asked, figure.unit);
    let sign = if figure.subject == Subject::Reach && figure.name != "z" { "±" } else { "" };
    let more = if figure.more { ">" } else { "" };
    let number = |value: f64| format!("{sign}{}", grouped(value, figure.unit, decimals));
    value_row(label, [&number(asked), &format!("{more}{}", number(has)), unit(figure)], share, mark_of(figure))
}

/// A row of a card: label, a value of another with their unit, share, name of a mark.
pub fn value_row(label: &str, [asked, has, unit]: [&str; 3], share: f64, mark_name: &str) -> String {
    let percent = 100.0 * share;
    let percent = if percent > 0.0 && percent < 0.95 { format!("{percent:.1}") } else { format!("{percent:.0}") };
    let tight = if share >= TIGHT { " tight" } else { "" };
    let over = if mark_name == "error" { " over" } else { "" };
    let unit = if unit.is_empty() { String::new() } else { format!("\u{2009}{unit}") };
    let (label, bar, mark) = (marked(label), bar(share), mark(mark_name));
    format!(
        "<div class=\"limit{over}\"><span>{label}</span><span class=\"value\">{asked} <i>of</i> {has}{unit}</span>{bar}<span class=\"share{tight}\">{percent}\u{2009}%</span>{mark}</div>\n"
    )
}

/// A row of a card with a text instead of a bar.
pub fn text_row(label: &str, text: &str, mark_name: &str) -> String {
    let (label, text, mark) = (marked(label), marked(text), mark(mark_name));
    format!("<div class=\"limit plain\"><span>{label}</span><span class=\"value\">{text}</span>{mark}</div>\n")
}

/// The bar of a limit row; the part beyond the limit is hatched.
fn bar(share: f64) -> String {
    let inside = if share < 1.0 { share * LIMIT } else { LIMIT };
    let beyond = if share > 1.0 { (if share < 1.25 { share * LIMIT } else { BAR }) - LIMIT } else { 0.0 };
    let mut hatch = String::new();
    if beyond > 0.0 {
        hatch += &format!("<rect x=\"{LIMIT}\" y=\"5\" width=\"{beyond:.1}\" height=\"8\" fill=\"var(--orange)\"/>");
        let mut at = LIMIT + 3.0;
        while at < LIMIT + beyond - 1.0 {
            hatch += &format!("<path d=\"M{at:.1} 13l3-8\" stroke=\"var(--card)\" stroke-width=\"1.4\"/>");
            at += 5.0;
        }
    }
    format!(
        "<svg width=\"{BAR}\" height=\"18\" viewBox=\"0 0 {BAR} 18\" aria-hidden=\"true\"><rect y=\"5\" width=\"{BAR}\" height=\"8\" fill=\"var(--track)\"/><rect y=\"5\" width=\"{inside:.1}\" height=\"8\" fill=\"var(--blue)\"/>{hatch}<rect x=\"{:.1}\" y=\"2\" width=\"1.5\" height=\"14\" fill=\"var(--ink)\"/></svg>",
        LIMIT - 0.75
    )
}

fn unit(figure: &Figure) -> &'static str {
    match figure.unit {
        "bytes" => "KiB",
        "instructions" => "",
        unit => unit,
    }
}

fn decimals(value: f64, unit: &str) -> usize {
    let value = if unit == "bytes" { value / 1024.0 } else { value };
    match value {
        _ if unit == "instructions" => 0,
        size if size >= 99.95 => 0,
        size if size >= 9.995 => 1,
        _ => 2,
    }
}

fn grouped(value: f64, unit: &str, decimals: usize) -> String {
    let value = if unit == "bytes" { value / 1024.0 } else { value };
    let text = format!("{value:.decimals$}");
    if decimals > 0 || text.len() < 4 { text } else { thin(&specgen_toolchain::budget::group(value as u64)) }
}

/// A card: title, note on the right, rows.
pub fn card(title: &str, note: &str, class: &str, content: &str) -> String {
    let (title, note) = (marked(title), marked(note));
    format!(
        "<div class=\"card {class}\"><div class=\"head\"><h2>{title}</h2><span class=\"note\">{note}</span></div>\n{content}</div>\n"
    )
}

/// The verdict as text.
#[derive(Debug, Clone, PartialEq)]
pub struct Sentence {
    /// At most six words.
    pub verdict: String,
    /// Number, limit, consequence.
    pub why: String,
    /// `ok`, `warning`, `none` or `error`.
    pub mark: &'static str,
}

impl Sentence {
    /// The sentence for a verdict.
    pub fn of(verdict: &Verdict) -> Self {
        let tightest = most_used(verdict.figures.iter());
        let within = verdict.figures.iter().filter(|figure| figure.mark == Mark::Within).count();
        let tight = tightest.map_or_else(String::new, |(figure, share)| {
            format!(" Tightest: {}, {:.0}\u{2009}% used.", label(figure), 100.0 * share)
        });
        let errors = verdict.figures.iter().any(|figure| figure.subject == Subject::Tracking && figure.limit.is_some());
        let open = if errors { "" } else { " The spec sets no limit on trajectory errors." };
        let assumed = &verdict.assumed;
        let resting = if assumed.is_empty() {
            String::new()
        } else {
            format!(" Not measured: {}; a real machine accepts it only with --assumed-ok.", assumed.summary())
        };
        let legs = if assumed.unidentified { " No leg is identified: on a machine the law does not run." } else { "" };
        let resting = format!("{legs}{resting}");
        let on = if assumed.is_empty() { "" } else { ", on assumptions" };
        match verdict.answer {
            Answer::Ready => Self {
                verdict: format!("Ready to build{on}"),
                why: format!("All {within} limits are met.{tight}{open}{resting}"),
                mark: if assumed.is_empty() { "ok" } else { "warning" },
            },
            Answer::NotMeasured => Self {
                verdict: format!("Ready, not measured{on}"),
                why: format!(
                    "All {within} checked limits are met.{tight} Time, memory and bits: {}.{resting}",
                    verdict.unmeasured.as_deref().unwrap_or("not measured")
                ),
                mark: "none",
            },
            Answer::NotReady => {
                let beyond: Vec<&Figure> = verdict.beyond().collect();
                let first = beyond.first().map_or_else(String::new, |figure| match figure.subject {
                    Subject::Tracking => "error above its limit".to_owned(),
                    Subject::Time | Subject::Memory => format!("{} over budget", figure.name),
                    _ => label(figure),
                });
                let why = beyond.iter().map(|figure| match (&figure.words, &figure.limit) {
                    (Some(words), _) => format!("{words}."),
                    (None, Some(limit)) => {
                        let (name, value) = (label(figure), thin(&figure.value_text()));
                        let (limit, unit, from) = (thin(&figure.limit_text()), unit(figure), &limit.from);
                        format!("{name}: {value} with a limit of {limit}\u{2009}{unit} ({from}).")
                    }
                    (None, None) => String::new(),
                });
                Self {
                    verdict: format!("Not safe to build: {first}"),
                    why: why.map(|text| capital(&text)).collect::<Vec<_>>().join(" ") + &resting,
                    mark: "error",
                }
            }
        }
    }

    /// The card, with the numbers of errors, warnings and notes.
    pub fn html(&self, findings: &[Diagnostic]) -> String {
        let count = |severity: Severity, name: &str, word: &str| {
            let number = findings.iter().filter(|finding| finding.severity == severity).count();
            let zero = if number == 0 { " class=\"zero\"" } else { "" };
            let sign = if name == "error" && number == 0 { "ok" } else { name };
            let s = if number == 1 { "" } else { "s" };
            format!("<span{zero}>{}<span><b>{number}</b> {word}{s}</span></span>", mark(sign))
        };
        let (class, mark) = (if self.mark == "error" { " refused" } else { "" }, mark(self.mark));
        let (verdict, why) = (marked(&self.verdict), marked(&self.why));
        let errors = count(Severity::Error, "error", "error");
        let warnings = count(Severity::Warning, "warning", "warning");
        let notes = count(Severity::Note, "note", "note");
        format!(
            "<div id=\"verdict\" class=\"card verdict{class}\">{mark}<div><h1>{verdict}</h1><p>{why}</p></div><div class=\"counts\">{errors}{warnings}{notes}</div></div>\n"
        )
    }
}

/// The figure that uses most of its limit, and its share of it.
fn most_used<'a>(figures: impl Iterator<Item = &'a Figure>) -> Option<(&'a Figure, f64)> {
    figures.filter_map(|figure| Some((figure, share(figure)?))).max_by(|a, b| a.1.total_cmp(&b.1))
}

fn label(figure: &Figure) -> String {
    match figure.subject {
        Subject::Reach => format!("reach in {}", figure.name),
        Subject::Noise if figure.name != "step" => format!("noise of {}", figure.name),
        Subject::Margins => format!("margin of {}", figure.name),
        Subject::Tracking => format!("error of {}", figure.name),
        Subject::Bits => "bits differ".to_owned(),
        _ => figure.name.clone(),
    }
}

/// Rows of a subject.
pub fn rows(verdict: &Verdict, subjects: &[Subject]) -> String {
    let of = |figure: &&Figure| subjects.contains(&figure.subject);
    verdict.figures.iter().filter(of).map(|figure| limit_row(&figure.name, figure)).collect()
}

/// For phones: the tightest figure of each group.
pub fn tightest(verdict: &Verdict, error: &str) -> String {
    let mut content = String::new();
    for (subject, prefix) in
        [(Subject::Reach, "reach "), (Subject::Time, ""), (Subject::Memory, ""), (Subject::Margins, "margin ")]
    {
        let all = verdict.figures.iter().filter(|figure| figure.subject == subject);
        if let Some((figure, _)) = most_used(all) {
            content += &limit_row(&format!("{prefix}{}", figure.name), figure);
        }
    }
    for figure in verdict.figures.iter().filter(|figure| figure.subject == Subject::Bits) {
        let good = figure.mark == Mark::Within;
        content += &text_row(
            "bits",
            if good { "identical on host and microcontroller" } else { "DIFFERENT from the host" },
            mark_of(figure),
        );
    }
    let judged = verdict.figures.iter().filter(|figure| figure.subject == Subject::Tracking && figure.limit.is_some());
    content += &match most_used(judged) {
        Some((figure, _)) => limit_row("error", figure),
        None => text_row("error", error, "none"),
    };
    card("Tightest of each group", "used of limit", "tightest", &content)
}

/// Findings, one row per code with all places.
pub fn findings(title: &str, note: &str, findings: &[Diagnostic], source: &SpecSource) -> String {
    let list = to_json(findings, source);
    let all: Vec<&serde_json::Value> = list.as_array().into_iter().flatten().collect();
    let mut codes: Vec<&str> = Vec::new();
    for finding in findings {
        if !codes.contains(&finding.code) {
            codes.push(finding.code);
        }
    }
    let worst =
        |code: &str| findings.iter().filter(|finding| finding.code == code).map(|finding| finding.severity).max();
    codes.sort_by_key(|code| std::cmp::Reverse(worst(code)));
    let mut content = String::new();
    for (row, code) in codes.iter().enumerate() {
        let same: Vec<(&Diagnostic, &serde_json::Value)> =
            findings.iter().zip(all.iter().copied()).filter(|(finding, _)| finding.code == *code).collect();
        let Some((first, _)) = same.first() else { continue };
        let name = match first.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let places: Vec<String> = same
            .iter()
            .filter_map(|(_, json)| Some((json["file"].as_str()?, json["line"].as_u64())))
            .enumerate()
            .map(|(k, (file, line))| {
                let file = if k == 0 { file.rsplit(['/', '\\']).next().unwrap_or(file) } else { "" };
                line.map_or_else(|| file.to_owned(), |line| format!("{file}:{line}"))
            })
            .collect();
        let count =
            if same.len() > 1 { format!("<div class=\"places\">{} places</div>", same.len()) } else { String::new() };
        let more = if same.len() > 1 { format!(" And {} more.", same.len() - 1) } else { String::new() };
        let (class, mark) = (if row < SEEN { "" } else { " more" }, mark(name));
        let (message, places) = (marked(&sentence(&first.message)), escaped(&places.join(", ")));
        let help = marked(&pretty(&first.help));
        content += &format!(
            "<div class=\"finding{class}\">{mark}<div><b>{code}</b>{count}</div><div>{message}{more} <code class=\"soft\">{places}</code></div><div><b>Do:</b> {help}</div></div>\n"
        );
    }
    if codes.is_empty() {
        content.push_str(&text_row("", "none: no errors, warnings or notes", "ok"));
    }
    let hidden = codes.len().saturating_sub(SEEN);
    let note = if hidden > 0 { format!("{note} · {hidden} more in the section Findings") } else { note.to_owned() };
    card(title, &note, "all", &content)
}

/// Source of the first error: its line and neighbours, the word underlined, and a line that fixes it.
pub fn source(findings: &[Diagnostic], source: &SpecSource, accepted: bool) -> String {
    let Some(first) = findings.iter().find(|finding| finding.severity == Severity::Error) else { return String::new() };
    let title = specgen_language::diagnostic::codes::REGISTRY
        .iter()
        .find(|code| code.id == first.code)
        .map_or((String::new(), String::new()), |code| (code.title().to_owned(), code.explanation()));
    let mut content = String::new();
    let mut place = String::new();
    let mut fix = None;
    if let Place::Spec(span) = &first.place {
        let list = to_json(std::slice::from_ref(first), source);
        let line = list[0]["line"].as_u64().unwrap_or(1) as usize;
        let name = source.display_name.rsplit(['/', '\\']).next().unwrap_or_default();
        place = format!("{name}, line {line}, column {}", list[0]["column"]);
        let lines: Vec<&str> = source.text.lines().collect();
        let start = source.text[..span.start.min(source.text.len())].rfind('\n').map_or(0, |at| at + 1);
        content.push_str("<div class=\"source\" tabindex=\"0\">");
        for number in line.saturating_sub(1).max(1)..=(line + 1).min(lines.len()) {
            let text = lines.get(number - 1).copied().unwrap_or_default();
            if number != line {
                content += &format!("<div><b>{number}</b><span>{}</span></div>\n", escaped(text));
                continue;
            }
            let cut = |at: usize| {
                let mut at = at.saturating_sub(start).min(text.len());
                while !text.is_char_boundary(at) {
                    at -= 1;
                }
                at
            };
            let (from, to) = (cut(span.start), cut(span.end));
            let (before, bad, after) = (escaped(&text[..from]), escaped(&text[from..to]), escaped(&text[to..]));
            content += &format!("<div class=\"bad\"><b>{number}</b><span>{before}<u>{bad}</u>{after}</span></div>\n");
            if let Some(replacement) = first.replacement.as_ref().filter(|_| accepted) {
                let line = format!("{}{replacement}{}", &text[..from], &text[to..]);
                let (before, new, after) = (escaped(&text[..from]), escaped(replacement), escaped(&text[to..]));
                content += &format!(
                    "<div class=\"fix\"><b>+</b><span>{before}<strong>{new}</strong>{after}   # checked: accepted</span></div>\n"
                );
                fix = Some(line);
            }
        }
        content.push_str("</div>\n");
    } else if let Place::File { path, line } = &first.place {
        place = line.map_or_else(|| path.clone(), |line| format!("{path}, line {line}"));
    }
    let copy = fix.map_or_else(String::new, |line| {
        format!("<button type=\"button\" data-copy=\"{}\">Copy line</button>", escaped(line.trim()))
    });
    let (message, help, code) = (marked(&sentence(&first.message)), marked(&pretty(&first.help)), &first.code);
    let explained = marked(&title.1);
    content += &format!(
        "<p>{message}</p><div class=\"do\"><span><b>Do:</b> {help}</span><span>{copy}<button type=\"button\" data-toggle=\"explain\">Explain {code}</button></span></div><p id=\"explain\" class=\"soft\" hidden>{explained}</p>\n"
    );
    let (mark, code, title, place) = (mark("error"), &first.code, marked(&capital(&title.0)), escaped(&place));
    format!(
        "<div class=\"card wide\"><div class=\"head\">{mark}<h2>{code} {title}</h2><span class=\"note\">{place}</span></div>\n{content}</div>\n"
    )
}

/// A message in typographic form: with unit symbols and a true minus sign.
fn pretty(text: &str) -> String {
    let mut text = text.to_owned();
    for axis in ["x", "y", "z"] {
        text = text.replace(&format!("theta_{axis}"), &format!("θ{axis}"));
    }
    for (typed, shown) in [(" um", "\u{2009}µm"), (" urad", "\u{2009}µrad"), (" us", "\u{2009}µs"), (" -", " \u{2212}")]
    {
        text = text.replace(typed, shown);
    }
    text
}

/// A message as a sentence.
pub fn sentence(text: &str) -> String {
    let text = capital(&pretty(text));
    if text.ends_with(['.', '!', '?']) { text } else { format!("{text}.") }
}

pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
