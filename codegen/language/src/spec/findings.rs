//! Collects findings, so that a check need not stop at the first mistake.

use std::ops::Range;

use crate::diagnostic::{Code, Diagnostic, Place, Severity, codes};

/// Further findings are cut: a file with that many is not a spec with mistakes.
pub(super) const MAX_FINDINGS: usize = 100;

/// Further findings are not even stored: a megabyte of mistakes would need a hundred megabytes of messages.
const MAX_KEPT: usize = 5000;

/// Findings of one run over one spec.
#[derive(Debug, Default)]
pub(super) struct Findings {
    list: Vec<Diagnostic>,
    left_out: usize,
}

impl Findings {
    /// Adds a finding about `key`, with the severity of its code.
    pub(super) fn add(&mut self, code: Code, key: &str, span: Range<usize>, message: String, help: String) {
        if self.list.len() >= MAX_KEPT {
            self.left_out += 1;
            return;
        }
        self.list.push(Diagnostic::new(code, key, Place::Spec(span), message, help));
    }

    /// Sets the replacement of the last finding, if that is about `key`.
    pub(super) fn replace_by(&mut self, key: &str, text: Option<String>) {
        if let Some(last) = self.list.last_mut().filter(|last| last.key == key) {
            last.replacement = text;
        }
    }

    /// Sets `line` as the replacement at `place` for the last finding, if that is about `key`.
    pub(super) fn instead(&mut self, key: &str, place: Range<usize>, line: &str) {
        if let Some(last) = self.list.last_mut().filter(|last| last.key == key) {
            last.help = format!("write {line}");
            last.replacement = Some(line.to_owned());
            last.place = Place::Spec(place);
        }
    }

    /// Counts findings that were not created.
    pub(super) fn leave_out(&mut self, count: usize) {
        self.left_out += count;
    }

    /// Keeps only the findings that satisfy `predicate`.
    pub(super) fn retain(&mut self, predicate: impl FnMut(&Diagnostic) -> bool) {
        self.list.retain(predicate);
    }

    /// Whether there is a finding about one of these keys.
    pub(super) fn mentions(&self, keys: &[&str]) -> bool {
        self.list.iter().any(|d| keys.contains(&d.key.as_str()))
    }

    /// Whether there is a finding about this key or one of its items.
    pub(super) fn mentions_item(&self, key: &str) -> bool {
        self.list.iter().any(|d| d.key.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('[')))
    }

    pub(super) fn all(&self) -> &[Diagnostic] {
        &self.list
    }

    pub(super) fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// In the order of the file, at most [`MAX_FINDINGS`], errors never pushed out by warnings.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        let start = |d: &Diagnostic| match &d.place {
            Place::Spec(span) => span.start,
            Place::File { .. } | Place::Whole => usize::MAX,
        };
        let total = self.list.len() + self.left_out;
        if self.list.len() > MAX_FINDINGS {
            self.list.sort_by_key(|d| (std::cmp::Reverse(d.severity), start(d)));
            self.list.truncate(MAX_FINDINGS);
        }
        // Stable sort: at one place the order of the key table remains.
        self.list.sort_by_key(start);
        if total > self.list.len() {
            let shown = self.list.len();
            let message = format!("{} further findings are not shown", total - shown);
            let help = "fix the ones shown and run again";
            self.list.push(Diagnostic::new(codes::TRUNCATED, "", Place::Whole, message, help));
        }
        self.list
    }
}
