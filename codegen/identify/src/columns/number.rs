//! Numbers in the fields of a file, and times of day.

/// A number with its decimal sign, if it has one.
pub(super) fn number(field: &str, separator: u8) -> Option<(f64, Option<char>)> {
    if let Ok(value) = field.parse() {
        return Some((value, field.contains('.').then_some('.')));
    }
    let other = match field {
        "∞" | "+∞" => Some(f64::INFINITY),
        "-∞" => Some(f64::NEG_INFINITY),
        // Fortran's exponents.
        _ => clock(field).or_else(|| field.replace(['D', 'd'], "e").parse().ok()),
    };
    if let Some(value) = other {
        return Some((value, None));
    }
    if separator == b',' || field.contains('.') || field.matches(',').count() != 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().map(|value| (value, Some(',')))
}

/// Seconds since midnight of a time of day, with or without a date: `10:11:12.5`, `2024-03-05T10:11:12,5Z`,
/// `3/5/2024 10:11:12 PM`. Two numbers are minutes and seconds if these have decimals.
pub(super) fn clock(text: &str) -> Option<f64> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let lower = text.to_ascii_lowercase();
    let (text, afternoon) = match (lower.strip_suffix("pm"), lower.strip_suffix("am")) {
        (Some(rest), _) => (rest.trim_end(), Some(true)),
        (_, Some(rest)) => (rest.trim_end(), Some(false)),
        _ => (lower.as_str(), None),
    };
    // Behind the date, without the time zone.
    let time = text.rsplit(['t', ' ']).next()?.split(['+', '-']).next()?;
    let mut parts = time.rsplit(':');
    let seconds = parts.next().filter(|part| part.starts_with(|c: char| c.is_ascii_digit()))?;
    let minutes: u32 = parts.next()?.parse().ok()?;
    let hours: Option<u32> = match parts.next() {
        Some(hours) => Some(hours.parse().ok()?),
        None => None,
    };
    let is_time = parts.next().is_none() && (hours.is_some() || seconds.contains(['.', ',']));
    let seconds: f64 = seconds.replace(',', ".").parse().ok()?;
    let hours = match (hours.unwrap_or(0), afternoon) {
        (12, Some(false)) => 0,
        (hours @ ..12, Some(true)) => hours + 12,
        (hours, _) => hours,
    };
    (is_time && hours < 24 && minutes < 60 && seconds < 60.0).then(|| f64::from(3600 * hours + 60 * minutes) + seconds)
}

/// Whether a field is a date such as `2024-03-05` or `5.3.2024`.
pub(super) fn is_date(field: &[u8]) -> bool {
    let parts: Vec<&[u8]> = field.split(|byte| matches!(byte, b'-' | b'/' | b'.')).collect();
    parts.len() == 3 && parts.iter().all(|part| !part.is_empty() && part.iter().all(u8::is_ascii_digit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_or_where_that_is_no_separator_a_comma() {
        assert_eq!(number("-12.5e-3", b','), Some((-12.5e-3, Some('.'))));
        assert_eq!(number("-12,5e-3", b';'), Some((-12.5e-3, Some(','))));
        assert_eq!(number("7", b';'), Some((7.0, None)));
        for bad in ["1.234,5", "1,234,5", "", "1 2", "2 V"] {
            assert_eq!(number(bad, b';'), None, "{bad}");
        }
        assert_eq!(number("1,5", b','), None);
    }

    #[test]
    fn times_of_day_are_seconds() {
        for (text, seconds) in [
            ("10:11:12.5", 36_672.5),
            ("2024-03-05T10:11:12,5Z", 36_672.5),
            ("2024-03-05 10:11:12.5+01:00", 36_672.5),
            ("3/5/2024 10:11:12 PM", 79_872.0),
            ("12:00:01 am", 1.0),
            ("11:12.5", 672.5),
        ] {
            assert_eq!(number(text, b','), Some((seconds, None)), "{text}");
        }
        for bad in ["10:11", "25:00:00", "10:61:00", "1:2:3:4", "a:b:c", "::", "10:11:-5"] {
            assert_eq!(number(bad, b','), None, "{bad}");
        }
        assert!(is_date(b"2024-03-05") && is_date(b"5.3.2024") && !is_date(b"1-2") && !is_date(b"1.2.x"));
    }
}
