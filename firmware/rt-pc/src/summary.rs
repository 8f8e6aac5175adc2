//! What a run leaves to be read: the book of its ticks, the machine's phases, the record.

use std::fmt::Write as _;

use controller::supervised::Phase;
use specgen_rt::account::{Account, Cause as Late};
use specgen_rt::allocation;

use crate::service::{Incident, Outcome, Traffic};

pub struct Summary<'a> {
    pub account: &'a Account,
    pub outcome: &'a Outcome,
    /// Rows that found no room.
    pub lost_rows: u64,
    /// Readings or outputs that failed.
    pub device_faults: u64,
    pub device: String,
    /// Control period, ns.
    pub period: u64,
    pub missing_rights: Vec<String>,
}

impl Summary<'_> {
    /// What makes the run a failed one, if anything does.
    #[must_use]
    pub fn failure(&self) -> Option<String> {
        let outcome = self.outcome;
        if !self.account.balances() {
            return Some("the book of ticks does not balance: report this as a defect of specgen".to_owned());
        }
        let run: u64 = self.account.on_time() + self.account.late().iter().sum::<u64>();
        if outcome.rows + self.lost_rows != run {
            return Some(format!(
                "{run} ticks were run, but {} rows came and {} were lost",
                outcome.rows, self.lost_rows
            ));
        }
        if allocation::noticed() > 0 {
            return Some(format!("the real-time thread used the allocator {} times", allocation::noticed()));
        }
        if let Some((path, Err(error))) = &outcome.record {
            return Some(format!("{}: the record is not whole: {error}", path.display()));
        }
        if self.lost_rows > 0 && outcome.record.is_some() {
            let lost = self.lost_rows;
            return Some(format!(
                "the record lacks {lost} ticks: the disk was slower than the loop; write it to a faster one"
            ));
        }
        if let Some(failure) = &outcome.failure {
            return Some(failure.clone());
        }
        if let Some((path, Err(error))) = &outcome.capture {
            return Some(format!("{}: what the recorder kept could not be written: {error}", path.display()));
        }
        outcome.incidents.first().map(words)
    }

    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{} at {} Hz on {}\n", controller::SPEC_NAME, hertz(self.period), self.device);
        // Writing to a String cannot fail, here and below.
        for missing in &self.missing_rights {
            let _ = writeln!(text, "without {missing}");
        }
        text += &self.account.to_text();
        let _ = writeln!(
            text,
            "real-time thread: {} allocations, {} ticks that waited in their work, {} rows lost, {} device faults",
            allocation::noticed(),
            self.account.blocked(),
            self.lost_rows,
            self.device_faults
        );
        for incident in &self.outcome.incidents {
            let _ = writeln!(text, "{}", words(incident));
        }
        for (name, file) in [("record", &self.outcome.record), ("recorder", &self.outcome.capture)] {
            let _ = match file {
                Some((path, Ok(rows))) => writeln!(text, "{name}: {rows} ticks in {}", path.display()),
                Some((path, Err(error))) => writeln!(text, "{name}: {} is not whole: {error}", path.display()),
                None => Ok(()),
            };
        }
        if let Some(Traffic { hosts, requests, errors, closed }) = &self.outcome.link {
            let _ = writeln!(
                text,
                "link: {requests} requests of {hosts} hosts, {errors} frames not believed, {closed} hosts closed: others took the orders or the room"
            );
        }
        text
    }

    /// For programs. By hand: a few numbers are no reason for a library.
    #[must_use]
    pub fn to_json(&self) -> String {
        let account = self.account;
        let mut causes = Vec::new();
        for cause in Late::ALL {
            let (late, skipped) = (account.late()[cause as usize], account.skipped()[cause as usize]);
            if late + skipped > 0 {
                let longest = account.worst(cause).unwrap_or(0);
                causes.push(format!(
                    "    {{ \"cause\": {}, \"late\": {late}, \"skipped\": {skipped}, \"longest_ns\": {longest} }}",
                    quoted(cause.name())
                ));
            }
        }
        let times: Vec<String> = account
            .histograms()
            .iter()
            .map(|(name, histogram)| {
                let [median, high, higher] = [0.5, 0.99, 0.999].map(|share| histogram.quantile(share));
                let octaves: Vec<String> =
                    histogram.octaves().iter().map(|(end, count)| format!("[{end}, {count}]")).collect();
                format!(
                    "    {}: {{ \"p50_ns\": {median}, \"p99_ns\": {high}, \"p999_ns\": {higher}, \"max_ns\": {}, \"below_ns\": [{}] }}",
                    quoted(name),
                    histogram.largest(),
                    octaves.join(", ")
                )
            })
            .collect();
        let incidents: Vec<String> = self
            .outcome
            .incidents
            .iter()
            .map(|Incident { tick, phase, cause }| {
                let [phase, cause] = [format!("{phase:?}"), format!("{cause:?}")].map(|text| quoted(&text));
                format!("{{ \"tick\": {tick}, \"phase\": {phase}, \"cause\": {cause} }}")
            })
            .collect();
        let link = self.outcome.link.map_or_else(
            || "null".to_owned(),
            |Traffic { hosts, requests, errors, closed }| {
                format!("{{ \"hosts\": {hosts}, \"requests\": {requests}, \"errors\": {errors}, \"closed_hosts\": {closed} }}")
            },
        );
        let missing: Vec<String> = self.missing_rights.iter().map(|text| quoted(text)).collect();
        let [record, capture] = [&self.outcome.record, &self.outcome.capture].map(|file| match file {
            Some((path, Ok(rows))) => {
                format!("{{ \"file\": {}, \"ticks\": {rows} }}", quoted(&path.display().to_string()))
            }
            _ => "null".to_owned(),
        });
        let phase = self.outcome.last.map_or_else(|| "null".to_owned(), |said| quoted(&format!("{:?}", said.phase)));
        format!(
            "{{
  \"name\": {},
  \"digest\": {},
  \"device\": {},
  \"period_ns\": {},
  \"missing_rights\": [{}],
  \"planned\": {},
  \"on_time\": {},
  \"late\": {},
  \"skipped\": {},
  \"balances\": {},
  \"causes\": [{}{}{}],
  \"times\": {{\n{}\n  }},
  \"allocations\": {},
  \"waiting_ticks\": {},
  \"lost_rows\": {},
  \"device_faults\": {},
  \"incidents\": [{}],
  \"link\": {link},
  \"last_phase\": {phase},
  \"record\": {record},
  \"recorder\": {capture},
  \"failure\": {}
}}
",
            quoted(controller::SPEC_NAME),
            quoted(controller::SPEC_DIGEST),
            quoted(&self.device),
            self.period,
            missing.join(", "),
            account.planned(),
            account.on_time(),
            account.late().iter().sum::<u64>(),
            account.skipped().iter().sum::<u64>(),
            account.balances(),
            if causes.is_empty() { "" } else { "\n" },
            causes.join(",\n"),
            if causes.is_empty() { "" } else { "\n  " },
            times.join(",\n"),
            allocation::noticed(),
            account.blocked(),
            self.lost_rows,
            self.device_faults,
            incidents.join(", "),
            self.failure().map_or_else(|| "null".to_owned(), |text| quoted(&text)),
        )
    }
}

fn words(incident: &Incident) -> String {
    let Incident { tick, phase, cause } = incident;
    let did = if *phase == Phase::Faulted { "faulted" } else { "held" };
    format!("the machine {did} at tick {tick}: {}", cause.name())
}

fn hertz(period: u64) -> f64 {
    (1e12 / period as f64).round() / 1e3
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c < ' ' => out += &format!("\\u{:04x}", c as u32),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
