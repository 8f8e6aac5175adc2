//! Numbers in the fields of a file, and times of day.

use super::names::MINUS;

/// What instruments write for infinity and for no number (SCPI).
const OVERFLOW: [f64; 2] = [9.9e37, 9.91e37];

/// A number with its decimal sign, if it has one.
pub(super) fn number(field: &str, separator: u8) -> Option<(f64, Option<char>)> {
    if let Ok(value) = field.parse::<f64>() {
        let value = if OVERFLOW.contains(&value.abs()) { value * f64::INFINITY } else { value };
        return Some((value, field.contains('.').then_some('.')));
    }
    if field.contains(&MINUS[1..]) {
        return number(&field.replace(MINUS, "-"), separator);
    }
    let other = match field {
        "∞" | "+∞" => Some(f64::INFINITY),
        "-∞" => Some(f64::NEG_INFINITY),
        // Fortran's exponents.
        _ => clock(field).map(|clock| clock.seconds).or_else(|| field.replace(['D', 'd'], "e").parse().ok()),
    };
    if let Some(value) = other {
        return Some((value, None));
    }
    if separator == b',' || field.contains('.') || field.matches(',').count() != 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().map(|value| (value, Some(',')))
}

/// Whether a text is a number with signs between thousands, such as `1,234.5`.
pub(super) fn is_grouped(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-']);
    let parts: Vec<&str> = digits.split([',', '.', '\'', '\u{2019}', ' ', '\u{a0}', '\u{202f}']).collect();
    let is_digits = parts.iter().all(|part| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit()));
    is_digits && parts[0].len() < 4 && parts.get(1).is_some_and(|part| part.len() == 3)
}

/// A time of day.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    /// Since midnight, s.
    seconds: f64,
    /// Number of its day, if it has a date that says it.
    day: Option<i32>,
    /// The date and the time zone as they are written.
    date: [String; 2],
}

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
    let (time, zone) = time.split_at(time.find(['+', '-']).unwrap_or(time.len()));
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
    is_time.then(|| Clock {
        seconds: f64::from(3600 * hours + 60 * minutes) + seconds,
        day: day(date),
        date: [date, zone].map(str::to_owned),
    })
}

/// Number of the day `2024-03-05` or `5.3.2024`; none for `3/5/2024`, in which day and month may have either order.
fn day(date: &str) -> Option<i32> {
    match parts(date)? {
        [year @ 1000..10_000, month, day] => number_of([year, month, day]),
        [day, month, year @ 1000..10_000] if !date.contains('/') => number_of([year, month, day]),
        _ => None,
    }
}

/// Whether a date is the day after another in one of the formats of its parts.
fn is_next_day(date: &str, before: &str) -> bool {
    let (Some(date), Some(before)) = (parts(date), parts(before)) else { return false };
    [[0, 1, 2], [2, 1, 0], [2, 0, 1]].iter().any(|order| {
        let [date, before] = [date, before].map(|parts| number_of(order.map(|at| parts[at])));
        date.zip(before).is_some_and(|(date, before)| date == before + 1)
    })
}

fn parts(date: &str) -> Option<[i32; 3]> {
    let number = |(at, part): (usize, &str)| part.trim().parse().ok().or_else(|| month(part).filter(|_| at == 1));
    let parts: Option<Vec<i32>> = date.split(['-', '/', '.', ' ']).enumerate().map(number).collect();
    parts?.try_into().ok()
}

/// Number of a month such as `Mar`.
fn month(text: &str) -> Option<i32> {
    let found = "janfebmaraprmayjunjulaugsepoctnovdec".find(&text.to_ascii_lowercase()).filter(|_| text.len() == 3)?;
    i32::try_from(found / 3 + 1).ok().filter(|_| found % 3 == 0)
}

/// Number of a day of a year and a month.
fn number_of(date: [i32; 3]) -> Option<i32> {
    let [year @ 0..10_000, month @ 1..13, day @ 1..32] = date else { return None };
    // Years that begin in March end with the leap day.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    Some(365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day)
}

/// Times since the first one of a column.
pub(super) struct SinceFirst {
    first: Clock,
    last: Clock,
    /// Since the first.
    midnights: f64,
}

impl SinceFirst {
    pub(super) fn new(first: Clock) -> Self {
        Self { last: first.clone(), first, midnights: 0.0 }
    }

    /// Seconds from the first time to this one. Without a day, a time that falls by half a day is behind midnight. None if
    /// the zone changes, or a date that does not say its day does so, but not to the next day at midnight.
    pub(super) fn seconds(&mut self, clock: Clock) -> Option<f64> {
        let [has_other_date, has_other_zone] = [0, 1].map(|k| clock.date[k] != self.last.date[k]);
        let falls = clock.seconds < self.last.seconds - 0.5 * DAY;
        let is_behind_midnight = falls && (clock.date[0].is_empty() || has_other_date);
        self.midnights += f64::from(u8::from(is_behind_midnight));
        let days = clock.day.zip(self.first.day).map(|(day, first)| f64::from(day - first));
        let is_next = || is_behind_midnight && is_next_day(&clock.date[0], &self.last.date[0]);
        let is_unknown = has_other_zone || days.is_none() && has_other_date && !is_next();
        let seconds = days.unwrap_or(self.midnights) * DAY + (clock.seconds - self.first.seconds);
        self.last = clock;
        (!is_unknown).then_some(seconds)
    }
}

impl Clock {
    /// With the dates of columns of their own, of which one says its day.
    pub(super) fn with_dates(mut self, dates: &[&[u8]]) -> Self {
        let text = |date: &&[u8]| String::from_utf8_lossy(date).into_owned();
        if let [date] = dates {
            self.day = self.day.or_else(|| day(&text(date)));
        }
        self.date[0].extend(dates.iter().map(text));
        self
    }
}

/// A day, s.
const DAY: f64 = 86_400.0;

/// Whether a field is a date such as `2024-03-05`, `5.3.2024` or `5-Mar-2024`.
pub(super) fn is_date(field: &[u8]) -> bool {
    let parts: Vec<&[u8]> = field.split(|byte| matches!(byte, b'-' | b'/' | b'.')).collect();
    let is_month = |part: &[u8]| std::str::from_utf8(part).is_ok_and(|text| month(text).is_some());
    let is_number = |part: &[u8]| !part.is_empty() && part.iter().all(u8::is_ascii_digit);
    parts.len() == 3 && parts.iter().enumerate().all(|(at, part)| is_number(part) || at == 1 && is_month(part))
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

    /// Pairs of times, with the seconds between them if these are known.
    #[test]
    fn times_between_dates_are_known_or_refused() {
        for (first, next, expected) in [
            ("23:59:59", "00:00:01", Some(2.0)),
            ("2024-03-04 10:00:00", "2024-03-07 09:00:00", Some(2.5e5 + 5600.0)),
            ("3/4/2024 23:59:59", "3/5/2024 0:00:01", Some(2.0)),
            ("31/12/2024 23:59:59", "1/1/2025 0:00:01", Some(2.0)),
            ("04.03.24 23:59:59", "05.03.24 0:00:01", Some(2.0)),
            ("3/4/2024 23:59:59", "3/7/2024 0:00:01", None),
            ("4-Mar-2024 23:59:59", "7-Mar-2024 0:00:01", Some(2.0 * DAY + 2.0)),
            ("28 Feb 2024 23:59:59", "01 Mar 2024 0:00:01", Some(DAY + 2.0)),
            ("Mar-4-2024 23:59:59", "Mar-5-2024 0:00:01", None),
            ("3/4/2024 23:59:59", "3/4/2024 0:00:01", Some(2.0 - DAY)),
            ("3/4/2024 10:00:00", "3/4/2024 10:00:02", Some(2.0)),
            ("3/4/2024 10:00:00", "3/5/2024 10:00:02", None),
            ("4-Mrz-2024 10:00:00", "5-Mrz-2024 10:00:02", None),
            ("2024-03-31T01:59:59+01:00", "2024-03-31T03:00:01+02:00", None),
            ("2024-03-31T01:59:59+01:00", "2024-03-31T02:00:01+01:00", Some(2.0)),
        ] {
            let [first, next] = [first, next].map(|text| clock(text).unwrap());
            assert_eq!(SinceFirst::new(first).seconds(next), expected, "{expected:?}");
        }
        let dated = |time: &str, dates: &[&[u8]]| clock(time).unwrap().with_dates(dates);
        for (dates, expected) in [
            ([&b"2024-03-04"[..], b"2024-03-06"], Some(172_802.0)),
            ([b"3/4/2024", b"3/6/2024"], None),
            ([b"3/4/2024", b"3/4/2024"], Some(2.0)),
        ] {
            let mut since = SinceFirst::new(dated("10:00:00", &dates[..1]));
            assert_eq!(since.seconds(dated("10:00:02", &dates[1..])), expected);
        }
    }

    #[test]
    fn minus_signs_of_typesetting_and_marks_of_instruments_are_known() {
        for (text, value) in [("\u{2212}0.5", -0.5), ("\u{2013}2e\u{2212}3", -2e-3), ("-9.9E+37", f64::NEG_INFINITY)] {
            assert_eq!(number(text, b',').map(|(value, _)| value), Some(value), "{text}");
        }
        assert!(number("9.91E+37", b',').is_some_and(|(value, _)| value.is_infinite()));
        assert!(["1,234.5", "-1.234,5", "1'234", "1\u{202f}234.5", "12 345"].iter().all(|text| is_grouped(text)));
        assert!(!["1.5", "1234,567", "5.3.2024", "", "1.", "10:11", "a,234"].iter().any(|text| is_grouped(text)));
        for bad in ["\u{2013}", "1\u{2013}2", "0x1f", "1'234.5", "1 234", "1.234.567", "1\u{202f}234", "5 %"] {
            assert_eq!(number(bad, b';'), None, "{bad}");
        }
    }

    #[test]
    fn times_of_day_are_seconds() {
        for (text, seconds) in [
            ("10:11:12.5", 36_672.5),
            ("2024-03-05T10:11:12,5Z", 36_672.5),
            ("2024-03-05 10:11:12.5+01:00", 36_672.5),
            ("10:11:12-0500", 36_672.0),
            ("3/5/2024 10:11:12 PM", 79_872.0),
            ("12:00:01 am", 1.0),
            ("11:12.5", 672.5),
        ] {
            assert_eq!(number(text, b','), Some((seconds, None)), "{text}");
        }
        for bad in ["10:11", "25:00:00", "10:61:00", "1:2:3:4", "a:b:c", "::", "10:11:-5"] {
            assert_eq!(number(bad, b','), None, "{bad}");
        }
        let days = ["2024-02-28", "29.2.2024", "2024/03/01"].map(|date| clock(&format!("{date} 0:00:00")).unwrap().day);
        assert_eq!(days.map(|day| day.unwrap() - days[0].unwrap()), [0, 1, 2]);
        assert_eq!(clock("3/5/2024 0:00:00").unwrap().day, None);
        assert!(is_date(b"5-Mar-2024") && !is_date(b"Mar-5-2024") && !is_date(b"5-anf-2024"));
        assert!(is_date(b"2024-03-05") && is_date(b"5.3.2024") && !is_date(b"1-2") && !is_date(b"1.2.x"));
    }
}
