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
        _ => clock(field).map(|(_, seconds)| seconds).or_else(|| field.replace(['D', 'd'], "e").parse().ok()),
    };
    if let Some(value) = other {
        return Some((value, None));
    }
    if separator == b',' || field.contains('.') || field.matches(',').count() != 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().map(|value| (value, Some(',')))
}

/// A time of day: its day, if it has a date, and seconds since midnight.
pub(super) type Clock = (Option<i32>, f64);

/// The time of day in `10:11:12.5`, `2024-03-05T10:11:12,5Z` or `3/5/2024 10:11:12 PM`. Two numbers are minutes and
/// seconds if these have decimals.
pub(super) fn clock(text: &str) -> Option<Clock> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let lower = text.to_ascii_lowercase();
    let (text, afternoon) = match (lower.strip_suffix("pm"), lower.strip_suffix("am")) {
        (Some(rest), _) => (rest.trim_end(), Some(true)),
        (_, Some(rest)) => (rest.trim_end(), Some(false)),
        _ => (lower.as_str(), None),
    };
    // Behind the date, without the time zone.
    let (date, time) = text.rsplit_once(['t', ' ']).unwrap_or(("", text));
    let time = time.split(['+', '-']).next()?;
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
    let is_time = is_time && hours < 24 && minutes < 60 && seconds < 60.0;
    is_time.then(|| (day(date), f64::from(3600 * hours + 60 * minutes) + seconds))
}

/// Number of the day `2024-03-05` or `5.3.2024`; none for `3/5/2024`, in which day and month may have either order.
fn day(date: &str) -> Option<i32> {
    let parts: Option<Vec<i32>> = date.split(['-', '/', '.']).map(|part| part.trim().parse().ok()).collect();
    let (year, month, day) = match parts?[..] {
        [year @ 1000..10_000, month @ 1..13, day @ 1..32] => (year, month, day),
        [day @ 1..32, month @ 1..13, year @ 1000..10_000] if !date.contains('/') => (year, month, day),
        _ => return None,
    };
    // Years that begin in March end with the leap day.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    Some(365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day)
}

/// Times since the first one of a column.
pub(super) struct SinceFirst {
    first: Clock,
    /// Seconds since midnight of the last one, and midnights since the first.
    last: f64,
    midnights: f64,
}

impl SinceFirst {
    pub(super) const fn new(first: Clock) -> Self {
        Self { first, last: first.1, midnights: 0.0 }
    }

    /// Seconds from the first time to this one. Without a date, a time that falls by half a day is behind midnight.
    pub(super) fn seconds(&mut self, (day, seconds): Clock) -> f64 {
        if seconds < self.last - 0.5 * DAY {
            self.midnights += 1.0;
        }
        self.last = seconds;
        let days = day.zip(self.first.0).map_or(self.midnights, |(day, first)| f64::from(day - first));
        days * DAY + (seconds - self.first.1)
    }
}

/// A day, s.
const DAY: f64 = 86_400.0;

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
        let days = ["2024-02-28", "29.2.2024", "2024/03/01"].map(|date| clock(&format!("{date} 0:00:00")).unwrap().0);
        assert_eq!(days.map(|day| day.unwrap() - days[0].unwrap()), [0, 1, 2]);
        assert_eq!(clock("3/5/2024 0:00:00"), Some((None, 0.0)));
        assert!(is_date(b"2024-03-05") && is_date(b"5.3.2024") && !is_date(b"1-2") && !is_date(b"1.2.x"));
    }
}
