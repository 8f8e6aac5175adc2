//! Collects findings about one data file, so that one run reports all of them without flooding the user.

use std::collections::BTreeMap;

use specgen_language::diagnostic::{Code, Diagnostic, Severity};

/// Findings of one kind that are shown; further ones are counted.
const SHOWN_PER_CODE: usize = 5;

/// Findings about one file.
#[derive(Debug)]
pub(crate) struct Findings {
    path: String,
    found: Vec<Diagnostic>,
    count: BTreeMap<&'static str, (Code, usize)>,
}

impl Findings {
    /// An empty collection for the file that the user named `path`.
    pub(crate) fn new(path: &str) -> Self {
        Self { path: path.to_owned(), found: Vec::new(), count: BTreeMap::new() }
    }

    /// The same, after the warnings of an earlier step.
    pub(crate) fn after(path: &str, warnings: &[Diagnostic]) -> Self {
        Self { found: warnings.to_vec(), ..Self::new(path) }
    }

    /// The file as the user named it.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// Adds a finding about `line`, or about the whole file, with the severity of its code.
    pub(crate) fn add(&mut self, code: Code, line: Option<usize>, message: String, help: &str) {
        let (_, count) = self.count.entry(code.id).or_insert((code, 0));
        *count += 1;
        if *count <= SHOWN_PER_CODE {
            self.found.push(Diagnostic::in_file(&self.path, line, code, message, help));
        }
    }

    /// Adds a finding that ends the work on the file.
    pub(crate) fn refuse<T>(&mut self, code: Code, line: Option<usize>, message: String, help: &str) -> Option<T> {
        self.add(code, line, message, help);
        None
    }

    /// Whether a finding refuses the file.
    pub(crate) fn any_error(&self) -> bool {
        self.found.iter().any(|d| d.severity == Severity::Error)
    }

    /// The result of a record, with its warnings, unless a finding refuses it.
    pub(crate) fn conclude<T>(self, found: Option<T>) -> Result<(T, Vec<Diagnostic>), Vec<Diagnostic>> {
        let refused = self.any_error();
        let all = self.into_diagnostics();
        match found {
            Some(found) if !refused => Ok((found, all)),
            _ => Err(all),
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// All findings in their order, then one line for each kind that was cut.
    pub(crate) fn into_diagnostics(self) -> Vec<Diagnostic> {
        let Self { path, mut found, count, .. } = self;
        for (code, n) in count.into_values().filter(|(_, n)| *n > SHOWN_PER_CODE) {
            let message = format!("and {} more lines like this ({})", n - SHOWN_PER_CODE, code.id);
            found.push(Diagnostic::in_file(&path, None, code, message, "fix the ones shown and run again"));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_language::diagnostic::codes;

    #[test]
    fn repeated_findings_are_counted_instead_of_listed() {
        let mut findings = Findings::new("a.csv");
        for line in 2..44 {
            findings.add(codes::RECORD_VALUE, Some(line), format!("line {line}"), "fix it");
        }
        let all = findings.into_diagnostics();
        assert_eq!(all.len(), SHOWN_PER_CODE + 1);
        assert!(all[SHOWN_PER_CODE].message.contains("and 37 more lines"), "{}", all[SHOWN_PER_CODE].message);
    }
}
