//! The text of a new spec: a template and values by key, each with its origin.

use std::collections::BTreeMap;

const TEMPLATE: &str = include_str!("template.toml");
const HEAD: &str = "\
#:schema ./platform.schema.json
# Values that were not given are marked: (assumed) is as in the paper's platform, (computed) follows from the others.
# `assumed` names them. Take an entry out once its value is measured or decided: `specgen check` counts the rest, and a real
# board takes the controller with --assumed-ok only while any remain. docs/spec-reference.md has every key.
";
/// Widest line of the list of assumed values, in characters.
const WIDTH: usize = 110;
/// The file itself says that it is simulated.
const RECORDS: &str = "hysteresis.records";

/// Origin of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Given,
    Computed,
}

/// A spec being written: TOML literals by key path, such as `geometry.height` or `gauge[2].point`.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    values: BTreeMap<String, (String, Origin)>,
    /// Sections to omit.
    without: &'static [&'static str],
}

impl Draft {
    /// Sets `key` to `literal`.
    pub fn set(&mut self, key: &str, literal: String, origin: Origin) {
        self.values.insert(key.to_owned(), (literal, origin));
    }

    /// Sets a computed value, unless one was given or all its inputs (`from`) are still the template's.
    pub fn compute(&mut self, key: &str, from: &[&str], literal: String) {
        if !self.is_given(key) && from.iter().any(|input| self.values.contains_key(*input)) {
            self.set(key, literal, Origin::Computed);
        }
    }

    pub fn is_given(&self, key: &str) -> bool {
        matches!(self.values.get(key), Some((_, Origin::Given)))
    }

    /// Omits sections and their subsections.
    pub fn leave_out(&mut self, sections: &'static [&'static str]) {
        self.without = sections;
    }

    /// Whether the spec has this key.
    pub fn has(&self, key: &str) -> bool {
        self.entries().any(|(found, ..)| found == key)
    }

    /// The TOML literal at `key`; the template's if nothing else was set.
    pub fn literal(&self, key: &str) -> String {
        let set = self.values.get(key).map(|(literal, _)| literal.clone());
        set.or_else(|| lines().find(|(found, ..)| found == key).map(|(_, _, value, _)| value.to_owned()))
            .unwrap_or_default()
    }

    /// Paths of the values that the user did not give: template values and computed ones. The gauges' positions count as one.
    pub fn assumed(&self) -> Vec<String> {
        let open = self.entries().map(|(key, ..)| key).filter(|key| key != RECORDS && !self.is_given(key));
        let mut paths: Vec<String> =
            open.map(|key| key.split_once('[').map_or(key.clone(), |(section, _)| section.to_owned())).collect();
        paths.dedup();
        paths
    }

    /// The complete file.
    pub fn text(&self, name: &str) -> String {
        let mut text = format!("{HEAD}schema = 1\nname = \"{name}\"\n{}", list(&self.assumed()));
        let mut header = "";
        let mut section: Vec<[String; 3]> = Vec::new();
        let mut last = String::new();
        for (key, name, _, comment) in self.entries() {
            let (at, short) = key.rsplit_once('.').unwrap_or(("", &key));
            if at != last {
                text.push_str(&aligned(header, &section));
                section.clear();
                (header, last) = (name, at.to_owned());
            }
            let origin = match self.values.get(&key) {
                _ if comment.is_empty() || key == RECORDS => "",
                None => " (assumed)",
                Some((_, Origin::Computed)) => " (computed)",
                Some((_, Origin::Given)) => "",
            };
            section.push([short.to_owned(), self.literal(&key), format!("{comment}{origin}")]);
        }
        text.push_str(&aligned(header, &section));
        text
    }

    fn entries(&self) -> impl Iterator<Item = (String, &'static str, &'static str, &'static str)> {
        let left_out = |header: &str| self.without.iter().any(|name| header.trim_matches(['[', ']']).starts_with(name));
        lines().filter(move |(_, header, ..)| !left_out(header))
    }
}

/// Each line of the template: key path, section header, value, comment.
fn lines() -> impl Iterator<Item = (String, &'static str, &'static str, &'static str)> {
    let mut header = "";
    let mut gauges = 0;
    TEMPLATE.lines().filter_map(move |line| {
        if line.starts_with('[') {
            header = line;
            gauges += usize::from(line.starts_with("[["));
        }
        let (key, rest) = line.split_once(" = ")?;
        let (value, comment) = rest.split_once(" # ").unwrap_or((rest, ""));
        let section = header.trim_matches(['[', ']']);
        let section = if header.starts_with("[[") { format!("{section}[{}]", gauges - 1) } else { section.to_owned() };
        Some((format!("{section}.{key}"), header, value, comment))
    })
}

/// The key `assumed`; empty if there are no assumed values.
fn list(paths: &[String]) -> String {
    if paths.is_empty() {
        return String::new();
    }
    let mut lines = vec![String::new()];
    for path in paths {
        let item = format!("\"{path}\",");
        match lines.last_mut() {
            Some(line) if line.is_empty() => *line = item,
            Some(line) if line.len() + item.len() < WIDTH => *line = format!("{line} {item}"),
            _ => lines.push(item),
        }
    }
    format!("assumed = [\n    {}\n]\n", lines.join("\n    "))
}

/// A section with values and comments in aligned columns.
fn aligned(header: &str, rows: &[[String; 3]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let (keys, values) = (width(0), width(1));
    let mut text = if rows.is_empty() { String::new() } else { format!("\n{header}\n") };
    for [key, value, comment] in rows {
        let line = if comment.is_empty() {
            format!("{key:keys$} = {value}\n")
        } else {
            format!("{key:keys$} = {value:values$}  # {comment}\n")
        };
        text.push_str(&line);
    }
    text
}
