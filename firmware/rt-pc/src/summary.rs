//! The summary of a run: the account of its ticks, the machine's phases, the record.

use std::fmt::{self, Display, Formatter, Write as _};

use controller::supervised::Phase;
use specgen_rt::account::{Account, Cause as Late};
use specgen_rt::allocation;
use specgen_rt::histogram::Histogram;

use crate::operator::{SupervisorReport, why};
use crate::service::{Outcome, Traffic};

pub struct Summary<'a> {
    pub account: &'a Account,
    pub outcome: &'a Outcome,
    /// Rows that were lost.
    pub lost_rows: u64,
    /// Readings or outputs that failed.
    pub device_faults: u64,
    pub device: String,
    /// Control period, ns.
    pub period: u64,
    pub missing_rights: Vec<String>,
}

impl Summary<'_> {
    /// Reason why the run failed, if it did.
    pub fn failure(&self) -> Option<String> {
        let outcome = self.outcome;
        if !self.account.balances() {
            return Some("planned is not on time + late + skipped: report this as a defect of specgen".to_owned());
        }
        let run: u64 = self.account.on_time() + self.account.late().iter().sum::<u64>();
        if outcome.rows + self.lost_rows != run {
            return Some(format!(
                "{run} ticks ran, but {} rows were received and {} lost",
                outcome.rows, self.lost_rows
            ));
        }
        if allocation::noticed() > 0 {
            return Some(format!("the real-time thread used the allocator {} times", allocation::noticed()));
        }
        if let Some((path, Err(error))) = &outcome.record {
            return Some(format!("{}: the record is incomplete: {error}", path.display()));
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
            return Some(format!("{}: the recording could not be written: {error}", path.display()));
        }
        outcome.incidents.first().map(words)
    }

    /// The facts of a run, in order: name and value for programs, and text lines, if any.
    fn facts(&self) -> Vec<(&'static str, Json, String)> {
        let (account, outcome) = (self.account, self.outcome);
        let silent = |name, value| (name, value, String::new());
        let lines = |lines: Vec<String>| lines.iter().map(|line| format!("{line}\n")).collect::<String>();
        let of_loop = format!(
            "real-time thread: {} allocations, {} ticks that had to wait, {} rows lost, {} device faults\n",
            allocation::noticed(),
            account.blocked(),
            self.lost_rows,
            self.device_faults
        );
        let link = outcome.link.map_or((Json::Null, String::new()), |Traffic { hosts, requests, errors, closed }| {
            let numbers = [("hosts", hosts), ("requests", requests), ("errors", errors), ("closed_hosts", closed)];
            let numbers = Json::object(numbers.map(|(name, number)| (name, number.into())));
            let text = format!(
                "link: {requests} requests of {hosts} hosts, {errors} invalid frames, {closed} connections closed (control lost, or replaced)\n"
            );
            (numbers, text)
        });
        let [record, capture] =
            [("record", &outcome.record), ("recorder", &outcome.capture)].map(|(name, file)| match file {
                Some((path, Ok(rows))) => {
                    let path = path.display().to_string();
                    let text = format!("{name}: {rows} ticks in {path}\n");
                    (name, Json::object([("file", path.into()), ("ticks", (*rows).into())]), text)
                }
                Some((path, Err(error))) => {
                    (name, Json::Null, format!("{name}: {} is incomplete: {error}\n", path.display()))
                }
                None => silent(name, Json::Null),
            });
        let head = format!("{} at {} Hz on {}\n", controller::SPEC_NAME, hertz(self.period), self.device);
        vec![
            ("name", controller::SPEC_NAME.into(), head),
            silent("digest", controller::SPEC_DIGEST.into()),
            silent("device", self.device.as_str().into()),
            silent("period_ns", self.period.into()),
            (
                "missing_rights",
                Json::list(&self.missing_rights, |missing| missing.as_str().into()),
                lines(self.missing_rights.iter().map(|missing| format!("without {missing}")).collect()),
            ),
            ("planned", account.planned().into(), account.to_text()),
            silent("on_time", account.on_time().into()),
            silent("late", account.late().iter().sum::<u64>().into()),
            silent("skipped", account.skipped().iter().sum::<u64>().into()),
            silent("balances", Json::Flag(account.balances())),
            silent("causes", Json::List(Late::ALL.into_iter().filter_map(|cause| self.cause(cause)).collect())),
            silent("times", Json::Object(account.histograms().map(|(name, times)| (name, quantiles(times))).collect())),
            ("allocations", allocation::noticed().into(), of_loop),
            silent("waiting_ticks", account.blocked().into()),
            silent("lost_rows", self.lost_rows.into()),
            silent("device_faults", self.device_faults.into()),
            (
                "incidents",
                Json::list(&outcome.incidents, |SupervisorReport { tick, phase, cause, finding, .. }| {
                    let why = why(*cause, *finding);
                    let [phase, cause, why] = [format!("{phase:?}"), format!("{cause:?}"), why].map(Json::from);
                    Json::object([("tick", (*tick).into()), ("phase", phase), ("cause", cause), ("why", why)])
                }),
                lines(outcome.incidents.iter().map(words).collect()),
            ),
            record,
            capture,
            ("link", link.0, link.1),
            silent("last_phase", outcome.last.map_or(Json::Null, |said| format!("{:?}", said.phase).into())),
            silent("failure", self.failure().map_or(Json::Null, Json::from)),
        ]
    }

    /// Late and skipped ticks of a cause, if there were any.
    fn cause(&self, cause: Late) -> Option<Json> {
        let (late, skipped) = (self.account.late()[cause as usize], self.account.skipped()[cause as usize]);
        let longest = self.account.worst(cause);
        (late + skipped > 0).then(|| {
            let name = cause.name().into();
            Json::object([
                ("cause", name),
                ("late", late.into()),
                ("skipped", skipped.into()),
                ("longest_ns", longest.into()),
            ])
        })
    }

    pub fn to_text(&self) -> String {
        self.facts().into_iter().map(|(.., lines)| lines).collect()
    }

    /// JSON for programs, a line for each name.
    pub fn to_json(&self) -> String {
        let lines: Vec<String> =
            self.facts().into_iter().map(|(name, value, _)| format!("  {}: {value}", Json::from(name))).collect();
        format!("{{\n{}\n}}\n", lines.join(",\n"))
    }
}

fn quantiles(times: &Histogram) -> Json {
    let [median, high, higher] = [0.5, 0.99, 0.999].map(|share| times.quantile(share));
    let octaves = Json::list(&times.octaves(), |(end, count)| Json::List(vec![(*end).into(), (*count).into()]));
    Json::object([
        ("p50_ns", median.into()),
        ("p99_ns", high.into()),
        ("p999_ns", higher.into()),
        ("max_ns", times.largest().into()),
        ("below_ns", octaves),
    ])
}

fn words(incident: &SupervisorReport) -> String {
    let SupervisorReport { tick, phase, cause, finding, .. } = incident;
    let did = if *phase == Phase::Faulted { "faulted" } else { "held" };
    format!("the machine {did} at tick {tick}: {}", why(*cause, *finding))
}

fn hertz(period: u64) -> f64 {
    (1e12 / period as f64).round() / 1e3
}

/// Written by hand: a few numbers do not justify a library.
enum Json {
    Null,
    Flag(bool),
    Number(u64),
    Text(String),
    List(Vec<Self>),
    Object(Vec<(&'static str, Self)>),
}

impl Json {
    fn list<T>(items: &[T], of: impl Fn(&T) -> Self) -> Self {
        Self::List(items.iter().map(of).collect())
    }

    fn object<const N: usize>(fields: [(&'static str, Self); N]) -> Self {
        Self::Object(fields.into())
    }
}

impl From<u64> for Json {
    fn from(number: u64) -> Self {
        Self::Number(number)
    }
}

/// What was not measured is null.
impl From<Option<u64>> for Json {
    fn from(number: Option<u64>) -> Self {
        number.map_or(Self::Null, Self::Number)
    }
}

impl From<&str> for Json {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Json {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl Display for Json {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            Self::Flag(flag) => flag.fmt(f),
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => {
                f.write_char('"')?;
                for c in text.chars() {
                    match c {
                        '"' | '\\' => write!(f, "\\{c}")?,
                        c if c < ' ' => write!(f, "\\u{:04x}", c as u32)?,
                        c => f.write_char(c)?,
                    }
                }
                f.write_char('"')
            }
            Self::List(items) => {
                let items: Vec<String> = items.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", items.join(", "))
            }
            Self::Object(fields) => {
                let fields: Vec<String> =
                    fields.iter().map(|(name, value)| format!("{}: {value}", Self::from(*name))).collect();
                write!(f, "{{ {} }}", fields.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::said;
    use controller::supervised::{Cause, Finding};
    use specgen_rt::account::Stamps;
    use specgen_rt::clock::Usage;
    use std::io;
    use std::path::PathBuf;

    const INCIDENT: SupervisorReport = SupervisorReport {
        tick: 41,
        phase: Phase::Faulted,
        cause: Cause::EmergencyStop,
        finding: Finding::None,
        on: false,
        status: 0,
        commands: 0,
        waving: false,
        late: 0,
    };

    /// A book of three ticks, of which one is late, behind two that were skipped.
    fn account() -> Account {
        let mut account = Account::new(100, 50);
        let at = |planned: u64, written: u64| Stamps {
            planned,
            woken: planned + 1,
            read: planned + 2,
            computed: planned + 3,
            written,
            done: written,
        };
        for stamps in [at(100, 110), at(200, 290)] {
            account.tick(&stamps, &Usage::default(), false);
        }
        assert_eq!(account.arrive(300, 510, false), 2);
        account.tick(&at(500, 530), &Usage { voluntary_switches: 1, ..Usage::default() }, false);
        account
    }

    fn summary<'a>(account: &'a Account, outcome: &'a Outcome) -> Summary<'a> {
        Summary {
            account,
            outcome,
            lost_rows: 0,
            device_faults: 6,
            device: "made-up \"machine\"".to_owned(),
            period: 100_000,
            missing_rights: vec!["a\tright".to_owned()],
        }
    }

    fn failure(change: impl FnOnce(&mut Outcome, &mut u64)) -> Option<String> {
        let account = account();
        let (mut outcome, mut lost) = (Outcome { rows: 3, ..Outcome::default() }, 0);
        change(&mut outcome, &mut lost);
        Summary { lost_rows: lost, ..summary(&account, &outcome) }.failure()
    }

    #[test]
    fn a_run_fails_for_its_first_reason() {
        let file = || PathBuf::from("/some/file");
        let full = || Err(io::Error::other("full"));
        let found = |text: &str, change: &dyn Fn(&mut Outcome, &mut u64)| {
            let found = failure(|outcome, lost| change(outcome, lost));
            assert!(found.as_ref().is_some_and(|found| found.contains(text)), "{text}: {found:?}");
        };
        assert_eq!(failure(|_, _| {}), None);
        found("3 ticks ran, but 2 rows were received and 0 lost", &|outcome, _| outcome.rows = 2);
        found("but 3 rows were received and 1 lost", &|_, lost| *lost = 1);
        // Rows may be lost where nothing is recorded.
        assert_eq!(failure(|outcome, lost| (outcome.rows, *lost) = (2, 1)), None);
        found("the record lacks 1 ticks", &|outcome, lost| {
            (outcome.rows, *lost, outcome.record) = (2, 1, Some((file(), Ok(2))));
        });
        assert_eq!(failure(|outcome, _| outcome.record = Some((file(), Ok(3)))), None);
        found("/some/file: the record is incomplete: full", &|outcome, _| {
            (outcome.record, outcome.failure) = (Some((file(), full())), Some("other".to_owned()));
        });
        found("other", &|outcome, _| {
            (outcome.capture, outcome.failure) = (Some((file(), full())), Some("other".to_owned()));
        });
        found("the recording could not be written: full", &|outcome, _| {
            (outcome.capture, outcome.incidents) = (Some((file(), full())), vec![INCIDENT]);
        });
        found("the machine faulted at tick 41: emergency stop", &|outcome, _| {
            outcome.incidents = vec![INCIDENT, SupervisorReport { tick: 50, ..INCIDENT }];
        });
        found("the machine held at tick 41", &|outcome, _| {
            outcome.incidents = vec![SupervisorReport { phase: Phase::Holding, ..INCIDENT }];
        });
    }

    #[test]
    fn a_summary_says_the_same_to_people_and_to_programs() {
        let account = account();
        let outcome = Outcome {
            last: Some(said(Phase::Holding)),
            incidents: vec![INCIDENT],
            record: Some((PathBuf::from("/r\\x"), Ok(3))),
            capture: Some((PathBuf::from("/c"), Err(io::Error::other("full")))),
            link: Some(Traffic { hosts: 2, requests: 30, errors: 4, closed: 5 }),
            rows: 3,
            failure: None,
        };
        let summary = summary(&account, &outcome);
        let (text, json) = (summary.to_text(), summary.to_json());
        for part in [
            &format!("{} at 10000 Hz on made-up \"machine\"\n", controller::SPEC_NAME),
            "without a\tright\n",
            "ticks  planned 5 = on time 2 + late 1 + skipped 2",
            "0 rows lost, 6 device faults\n",
            "1 ticks that had to wait",
            "the machine faulted at tick 41: emergency stop\n",
            "record: 3 ticks in /r\\x\n",
            "recorder: /c is incomplete: full\n",
            "link: 30 requests of 2 hosts, 4 invalid frames, 5 connections closed",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(json.starts_with("{\n  \"name\": ") && json.ends_with("\n}\n"));
        for part in [
            r#""device": "made-up \"machine\"","#,
            r#""period_ns": 100000,"#,
            r#""missing_rights": ["a\u0009right"],"#,
            r#""planned": 5,"#,
            r#""on_time": 2,"#,
            r#""late": 1,"#,
            r#""skipped": 2,"#,
            r#""balances": true,"#,
            r#""waiting_ticks": 1,"#,
            r#""lost_rows": 0,"#,
            r#""device_faults": 6,"#,
            r#""incidents": [{ "tick": 41, "phase": "Faulted", "cause": "EmergencyStop", "why": "emergency stop" }],"#,
            r#""record": { "file": "/r\\x", "ticks": 3 },"#,
            r#""recorder": null,"#,
            r#""link": { "hosts": 2, "requests": 30, "errors": 4, "closed_hosts": 5 },"#,
            r#""last_phase": "Holding","#,
            r#""failure": "/c: the recording could not be written: full""#,
            r#""max_ns": 90,"#,
        ] {
            assert!(json.contains(part), "{part}\n{json}");
        }
        // A cause with late ticks, and one with skipped ones; none of those without any.
        let causes = json.lines().find(|line| line.contains("\"causes\"")).unwrap();
        assert_eq!(causes.matches("\"cause\"").count(), 2, "{causes}");
        for part in [r#""late": 1, "skipped": 0, "longest_ns": 90"#, r#""late": 0, "skipped": 2, "longest_ns": 210"#] {
            assert!(causes.contains(part), "{part} {causes}");
        }
        assert_eq!(hertz(3_000_000), 333.333);
        assert_eq!(Json::from(" a\u{1f}b".to_owned()).to_string(), "\" a\\u001fb\"");
        assert_eq!(Json::from(None::<u64>).to_string(), "null");
    }
}
