//! Command lines in messages: a pasted line works whatever the name of the file.
//!
//! Every printed command line with a name in it is built here; `codegen/cli/tests/shell_lines.rs` checks the sources.

use std::fmt;
use std::path::Path;

/// A command line for `sh`, each argument one word.
///
/// ```
/// use specgen_language::shell::line;
/// assert_eq!(line("specgen check").path("my spec.toml").to_string(), "specgen check 'my spec.toml'");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line(String);

/// Begins a line with words that need no quotes, such as a command and its options.
pub fn line(words: &str) -> Line {
    Line(words.to_owned())
}

impl Line {
    /// Adds words that need no quotes.
    #[must_use]
    pub fn words(self, words: &str) -> Self {
        if words.is_empty() { self } else { Self(format!("{} {words}", self.0)) }
    }

    /// Adds one argument, which may be any text.
    #[must_use]
    pub fn word(self, text: &str) -> Self {
        Self(format!("{} {}", self.0, quoted(text)))
    }

    /// Adds the name of a file in a form that no program takes for an option.
    #[must_use]
    pub fn path(self, path: impl AsRef<Path>) -> Self {
        self.word(&no_option(path.as_ref().display().to_string()))
    }

    /// The line with its output redirected to a new file beside `input`: of the same name, but with `ending`, and a
    /// number if that exists. Also returns the name of the new file.
    pub fn into_new(self, input: &str, ending: &str) -> (Self, String) {
        let new = free(input, ending);
        (self.words(">").path(&new), new)
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<Line> for String {
    fn from(line: Line) -> Self {
        line.0
    }
}

/// A command on a file, and its options.
pub fn on(command: &str, path: impl AsRef<Path>, options: &str) -> String {
    line(command).path(path).words(options).into()
}

/// The same file under a name that no program takes for an option.
pub fn no_option(path: String) -> String {
    if path.starts_with('-') { format!("./{path}") } else { path }
}

/// Help text: the line by which `command` makes a new file from `input`, and the request to name the new file instead.
/// `command` reads standard input if it ends in `<`.
pub fn converted(command: &str, input: &str, ending: &str) -> String {
    let (line, new) = line(command).path(input).into_new(input, ending);
    format!("`{line}`, then name {new}")
}

/// The same for a text in another encoding, as `iconv` calls it.
pub fn as_utf8(encoding: &str, input: &str) -> String {
    let ending = Path::new(input).extension().map_or_else(String::new, |end| format!(".{}", end.display()));
    converted(&format!("iconv -f {encoding} -t UTF-8"), input, &format!(".utf8{ending}"))
}

/// Quoted as one word of a shell.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+=:%,@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// A free name beside `path`: `path` without its extension, and `ending`, with a number if needed.
pub fn free(path: &str, ending: &str) -> String {
    let folder = path.rfind('/').map_or(0, |slash| slash + 1);
    let dot = path[folder..].rfind('.').filter(|dot| *dot > 0);
    let stem = dot.map_or(path, |dot| &path[..folder + dot]);
    let stem = stem.strip_suffix(".csv").filter(|stem| stem.len() > folder).unwrap_or(stem);
    let name = |number: u32| if number == 1 { format!("{stem}{ending}") } else { format!("{stem}-{number}{ending}") };
    let is_free = |name: &String| name != path && std::fs::symlink_metadata(name).is_err();
    // There are fewer files than numbers.
    (1..).map(name).find(is_free).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Names that a careless line would misread.
    const NAMES: [&str; 9] =
        ["a b.csv", "it's.csv", "-rf.csv", "$HOME.csv", "a;b.csv", "`id`.csv", "\"q\".csv", "*.csv", "é\n\t.csv"];

    #[test]
    fn a_shell_reads_every_name_as_one_word() {
        for name in NAMES {
            let script = line("printf '%s|'").path(name).word(name).to_string();
            let output = Command::new("sh").args(["-c", &script]).output().unwrap();
            let path = if name.starts_with('-') { format!("./{name}") } else { name.to_owned() };
            assert_eq!(String::from_utf8(output.stdout).unwrap(), format!("{path}|{name}|"), "{script}");
        }
        assert_eq!(
            line("specgen").path("specs/a.toml").words("").words("-o").word("").to_string(),
            "specgen specs/a.toml -o ''"
        );
    }

    #[test]
    fn a_new_file_is_never_one_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        for name in NAMES.into_iter().chain([".csv", ".gz", "leg", "leg.csv", "leg.csv.gz", "leg.utf8.csv"]) {
            let path = folder.path().join(name).display().to_string();
            std::fs::write(&path, "data").unwrap();
            let (script, new) = line("cat").path(&path).into_new(&path, ".csv");
            assert!(!Path::new(&new).exists() && Path::new(&new).parent() == Some(folder.path()), "{new}");
            let status = Command::new("sh").args(["-ec", &script.to_string()]).status().unwrap();
            assert!(status.success(), "{script}");
            for file in [&path, &new] {
                assert_eq!(std::fs::read_to_string(file).unwrap(), "data", "{script}");
            }
        }
        assert_eq!(free("legs/g.csv.gz", ".csv"), "legs/g.csv");
        assert_eq!(free("no/leg.csv", ".utf8.csv"), "no/leg.utf8.csv");
    }
}
