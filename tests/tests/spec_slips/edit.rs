//! Changes of a spec as hands make them: the value of a key, its name, its line.

/// One change of a text.
#[derive(Debug, Clone, Copy)]
pub enum Edit {
    /// Another literal at a key path, such as `gauge[2].point`.
    Value(&'static str, &'static str),
    /// Another name for the key at a path.
    Rename(&'static str, &'static str),
    /// Another line in the place of the key at a path.
    Line(&'static str, &'static str),
    /// The key at a path is left out.
    Remove(&'static str),
    /// One more line at the end of a section.
    Add(&'static str, &'static str),
    /// The literals of two keys in each other's place.
    Swap(&'static str, &'static str),
    /// One text for another, wherever it stands.
    Text(&'static str, &'static str),
    /// The text, changed as a whole.
    With(fn(&str) -> String),
    /// The record of the legs, changed.
    Record(fn(&str) -> String),
}

impl Edit {
    /// The text of the spec, changed; that of [`Edit::Record`] as it is.
    pub fn of(self, text: &str) -> String {
        match self {
            Self::Value(path, literal) => with_line(text, path, |name, _| format!("{name} = {literal}")),
            Self::Rename(path, to) => with_line(text, path, |_, literal| format!("{to} = {literal}")),
            Self::Line(path, line) => with_line(text, path, |_, _| line.to_owned()),
            Self::Remove(path) => with_line(text, path, |_, _| String::new()),
            Self::Add(section, line) => {
                let (_, end) = section_at(text, section);
                format!("{}{line}\n{}", &text[..end], &text[end..])
            }
            Self::Swap(a, b) => {
                let (of_a, of_b) = (literal(text, a), literal(text, b));
                let text = with_line(text, a, |name, _| format!("{name} = {of_b}"));
                with_line(&text, b, |name, _| format!("{name} = {of_a}"))
            }
            Self::Text(from, to) => {
                assert!(text.contains(from), "{from}");
                text.replace(from, to)
            }
            Self::With(change) => change(text),
            Self::Record(_) => text.to_owned(),
        }
    }
}

/// Where the lines of a section begin and end, such as `actuator` or `gauge[2]`; of no name: before the first section.
fn section_at(text: &str, section: &str) -> (usize, usize) {
    let begin = match section.split_once('[') {
        _ if section.is_empty() => 0,
        None => text.find(&format!("\n[{section}]\n")).unwrap_or_else(|| panic!("[{section}]")) + 1,
        Some((name, index)) => {
            let index: usize = index.trim_end_matches(']').parse().unwrap();
            text.match_indices(&format!("\n[[{name}]]\n")).nth(index).unwrap().0 + 1
        }
    };
    let begin = if section.is_empty() { begin } else { begin + text[begin..].find('\n').unwrap() + 1 };
    let end = text[begin..].find("\n[").map_or(text.len(), |end| begin + end + 1);
    (begin, begin + text[begin..end].trim_end().len() + 1)
}

/// The text with another line in the place of the key at `path`, of its name and its literal.
fn with_line(text: &str, path: &str, line: impl Fn(&str, &str) -> String) -> String {
    let (section, key) = path.rsplit_once('.').unwrap_or(("", path));
    let (begin, end) = section_at(text, section);
    let mut at = begin;
    for old in text[begin..end].split_inclusive('\n') {
        if let Some((name, literal)) = old.split_once('=')
            && name.trim() == key
        {
            let new = line(name.trim_end(), literal.split('#').next().unwrap_or_default().trim());
            return format!("{}{new}\n{}", &text[..at], &text[at + old.len()..]);
        }
        at += old.len();
    }
    panic!("{path} is not in the spec");
}

fn literal(text: &str, path: &str) -> String {
    let found = std::cell::RefCell::new(String::new());
    with_line(text, path, |_, literal| {
        literal.clone_into(&mut found.borrow_mut());
        String::new()
    });
    found.into_inner()
}
