//! Mutated specs: whatever comes in, the reader neither panics nor reports a finding that cannot be shown.
//!
//! 2,000 inputs, and 70,000 in the full run. The seed is fixed: a failure repeats.

// Clippy sees the helpers of an integration test as production code.
use std::fs;

use crate::fuzz_corpus::targets;
use crate::support::specs::{every_key, folder_with_records, source, spec_files};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use specgen::diagnostic::{Diagnostic, Place, Severity, codes, render, to_json};
use specgen::spec;
use specgen_tests::repository;

/// Pieces that have broken parsers before.
#[rustfmt::skip]
const TOKENS: &[&str] = &[
    "", "[", "]", "[[", "]]", "{", "}", "=", ".", ",", "\"", "'", "\"\"\"", "'''", "#", "\n", "\r", "\r\n", "\t", "\0",
    "\\", "\\u0000", "\\ud800", "\\x", "\u{feff}", "\u{b5}m", "\u{3bc}m", "\u{202e}", "\u{10ffff}", "é", "𝛺", "nan",
    "-inf", "1e999", "1e-999", "-0.0", "0x", "0xffffffffffffffff", "9223372036854775808", "1_000", "01",
    "1979-05-27T07:32:00Z", "true", "false", " mm", " kg", "N/(m s)", "N/m s", "^-9", "^99", "((((", "))))", " pi rad",
    "*", "/", "²", "-", "+", " lb/in", "/√Hz", "×10^7", "NMS", "″", " per ", "⁻³", "kgcm", ".", "a.b.c", "geometry", "[target.budget]", "[control]", "[[gauge]]", "[[trajectory]]",
    "kind = \"waveform\"\n", "records/leg1.csv", "..", "/", "[[[[[[[[[[[[[[[[[[[[", "{a={a={a={a={a=",
];

struct Mutator {
    random: ChaCha8Rng,
    /// First the specs that pass, then those that do not.
    corpus: Vec<Vec<u8>>,
    good: usize,
}

impl Mutator {
    fn below(&mut self, bound: usize) -> usize {
        (self.random.next_u64() % bound.max(1) as u64) as usize
    }

    /// A range of `bytes`, mostly short.
    fn range(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let start = self.below(bytes.len() + 1);
        let most = if self.below(8) == 0 { bytes.len() } else { 12 };
        let length = self.below(most + 1);
        start..(start + length).min(bytes.len())
    }

    fn mutate(&mut self, bytes: &mut Vec<u8>) {
        let range = self.range(bytes);
        match self.below(8) {
            0 => drop(bytes.drain(range)),
            1 if !bytes.is_empty() => {
                let at = self.below(bytes.len());
                bytes[at] = self.random.next_u32() as u8;
            }
            2 | 3 => {
                let token = TOKENS[self.below(TOKENS.len())];
                drop(bytes.splice(range, token.bytes()));
            }
            4 => {
                let piece = bytes[range].to_vec();
                let at = self.below(bytes.len() + 1);
                drop(bytes.splice(at..at, piece));
            }
            5 => self.swap_lines(bytes),
            6 => {
                // The end of one spec on the start of another.
                let other_index = self.below(self.corpus.len());
                let other = self.corpus[other_index].clone();
                let (cut, from) = (self.below(bytes.len() + 1), self.below(other.len() + 1));
                bytes.truncate(cut);
                bytes.extend_from_slice(&other[from..]);
            }
            _ => {
                let token = TOKENS[self.below(TOKENS.len())].repeat(1 + self.below(40));
                let at = self.below(bytes.len() + 1);
                drop(bytes.splice(at..at, token.bytes()));
            }
        }
    }

    fn swap_lines(&mut self, bytes: &mut Vec<u8>) {
        let mut lines: Vec<Vec<u8>> = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
        if lines.len() > 1 {
            let (a, b) = (self.below(lines.len()), self.below(lines.len()));
            lines.swap(a, b);
            *bytes = lines.concat();
        }
    }

    fn next(&mut self) -> Vec<u8> {
        // Mostly from a good one, with few changes: what is broken at once is refused by the syntax alone.
        let pool = if self.below(4) == 0 { self.corpus.len() } else { self.good };
        let pick = self.below(pool);
        let mut bytes = self.corpus[pick].clone();
        let most = if self.below(2) == 0 { 1 } else { 6 };
        for _ in 0..1 + self.below(most) {
            self.mutate(&mut bytes);
        }
        bytes
    }
}

fn assert_sound(finding: &Diagnostic, text: &str) {
    targets::assert_sound(finding, text);
    if matches!(finding.place, Place::Whole) {
        assert_eq!(finding.code, codes::TRUNCATED);
    }
}

#[test]
fn mutated_specs_are_read_without_a_panic() {
    let count = specgen_tests::length(2_000, 70_000);
    let folder = folder_with_records();
    let mut corpus: Vec<Vec<u8>> = spec_files().iter().map(|path| fs::read(path).expect("readable")).collect();
    corpus.push(every_key().into_bytes());
    let good = corpus.len();
    let mut bad: Vec<_> =
        fs::read_dir(repository().join("tests/corpus")).expect("corpus").map(|e| e.expect("readable").path()).collect();
    bad.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    bad.sort();
    corpus.extend(bad.iter().map(|path| fs::read(path).expect("readable")));
    let mut mutator = Mutator { random: ChaCha8Rng::seed_from_u64(2), corpus, good };

    let (mut accepted, mut refused, mut not_text) = (0, 0, 0);
    let mut seen = std::collections::BTreeMap::new();
    for i in 0..count {
        let bytes = mutator.next();
        let text = match String::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => {
                not_text += 1;
                String::from_utf8_lossy(error.as_bytes()).into_owned()
            }
        };
        let source = source(&text, "fuzz.toml", &folder);
        let (model, findings) = spec::load(&source);
        findings.iter().for_each(|finding| assert_sound(finding, &text));
        let has_errors = findings.iter().any(|d| d.severity == Severity::Error);
        assert_eq!(model.is_none(), has_errors, "input {i}: {findings:?}");
        for finding in &findings {
            *seen.entry(finding.code).or_insert(0) += 1;
        }
        // Both renderings of every input, and no control character of the input in the plain one.
        let shown = render(&findings, &source, false);
        assert!(!shown.contains(|c: char| c.is_control() && c != '\n'), "input {i}: {shown:?}");
        assert_eq!(to_json(&findings, &source).as_array().map(Vec::len), Some(findings.len()));
        if i % 16 == 0 {
            let _ = render(&findings, &source, true);
        }
        if has_errors { refused += 1 } else { accepted += 1 }
    }
    println!("{count} inputs: {accepted} accepted, {refused} refused, {not_text} were not UTF-8\n{seen:?}");
    // Mutations that never pass or never fail would test one half only.
    assert!(accepted > count / 1000 && refused > count / 10, "{accepted} accepted, {refused} refused");
    assert!(seen.len() > 25, "only {} codes reached: {seen:?}", seen.len());
}
