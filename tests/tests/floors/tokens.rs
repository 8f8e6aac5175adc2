//! Rust text as tokens, as far as names are concerned.

/// Words, quoted text and signs, without comments; `::` is one sign.
pub fn tokens(text: &str) -> Vec<&str> {
    let (mut tokens, mut rest) = (Vec::new(), text);
    while let Some(first) = rest.chars().next() {
        let length = length(rest, first);
        let token = &rest[..length];
        if !(first.is_whitespace() || token.starts_with("//") || token.starts_with("/*")) {
            tokens.push(token);
        }
        rest = &rest[length..];
    }
    tokens
}

/// Bytes of the token that `rest` begins with.
fn length(rest: &str, first: char) -> usize {
    let run = |part: fn(char) -> bool| rest.find(|c| !part(c)).unwrap_or(rest.len());
    if rest.starts_with("//") {
        rest.find('\n').unwrap_or(rest.len())
    } else if rest.starts_with("/*") {
        comment(rest)
    } else if rest.starts_with("::") {
        2
    } else if let Some(length) = quoted(rest) {
        length
    } else if first.is_whitespace() {
        run(char::is_whitespace)
    } else if is_word(first) {
        run(is_word)
    } else {
        first.len_utf8()
    }
}

/// A character of a name or of a number.
fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Bytes of a comment between `/*` and its `*/`.
fn comment(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    loop {
        let (sign, step) = (rest.get(at..at + 2), rest[at..].chars().next().map_or(0, char::len_utf8));
        match sign {
            Some("/*") => (depth, at) = (depth + 1, at + 2),
            Some("*/") => (depth, at) = (depth - 1, at + 2),
            _ => at += step,
        }
        if depth == 0 || at == rest.len() {
            return at;
        }
    }
}

/// Bytes of a string or a character with their prefix, or of a lifetime; none if `rest` begins with something else.
fn quoted(rest: &str) -> Option<usize> {
    let prefix = ["br", "cr", "r", "b", "c", ""].into_iter().find(|prefix| {
        rest.strip_prefix(prefix).is_some_and(|rest| rest.trim_start_matches('#').starts_with('"'))
            && (prefix.ends_with('r') || rest[prefix.len()..].starts_with('"'))
    });
    if let Some(prefix) = prefix {
        let hashes = rest[prefix.len()..].find('"')?;
        let start = prefix.len() + hashes + 1;
        if prefix.ends_with('r') {
            let end = format!("\"{}", "#".repeat(hashes));
            return Some(start + rest[start..].find(&end)? + end.len());
        }
        return closed(rest, start, '"');
    }
    let start =
        rest.strip_prefix('b').unwrap_or(rest).starts_with('\'').then(|| usize::from(rest.starts_with('b')) + 1)?;
    let mut after = rest[start..].chars();
    let (first, second) = (after.next()?, after.next());
    if first == '\\' || second == Some('\'') {
        return closed(rest, start, '\'');
    }
    // A lifetime.
    Some(start + rest[start..].find(|c| !is_word(c)).unwrap_or(rest.len() - start))
}

/// Bytes up to and with `sign`, from `start`; what a backslash precedes does not count.
fn closed(rest: &str, start: usize, sign: char) -> Option<usize> {
    let mut escaped = false;
    let end = rest[start..].char_indices().find(|(_, c)| {
        let ends = *c == sign && !escaped;
        escaped = *c == '\\' && !escaped;
        ends
    })?;
    Some(start + end.0 + 1)
}

/// Whether a token is a name or a keyword.
pub fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| is_word(c) && !c.is_numeric()) && token.chars().all(is_word)
}

/// Length of the group that `tokens` begin with, brackets included.
pub fn group(tokens: &[&str]) -> usize {
    let mut depth = 0_usize;
    let end = tokens.iter().position(|token| {
        match *token {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        depth == 0
    });
    end.map_or(tokens.len(), |end| end + 1)
}

/// Length of the item that `tokens` begin with, its attributes included.
pub fn item(tokens: &[&str]) -> usize {
    let mut at = 0;
    while at < tokens.len() {
        match tokens[at] {
            ";" => return at + 1,
            // The brackets of `use` are not its end.
            "{" if !tokens[..at].contains(&"use") => return at + group(&tokens[at..]),
            "{" | "(" | "[" => at += group(&tokens[at..]),
            _ => at += 1,
        }
    }
    at
}

/// What is between commas.
pub fn parts<'a, 'b>(tokens: &'b [&'a str]) -> Vec<&'b [&'a str]> {
    let (mut parts, mut start, mut at) = (Vec::new(), 0, 0);
    while at < tokens.len() {
        match tokens[at] {
            "{" => at += group(&tokens[at..]),
            "," => {
                parts.push(&tokens[start..at]);
                at += 1;
                start = at;
            }
            _ => at += 1,
        }
    }
    parts.push(&tokens[start..]);
    parts
}
