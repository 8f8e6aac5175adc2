//! Every message survives the way through a frame, and sizes are what the crate says.

use crate::support;
use std::time::Duration;

use crate::support::{IDENTITY, Tap, answered, leaked};
use specgen_link::client::{Client, ClientError, Timeout};
use specgen_link::{
    Bytes, Counters, Device, Endpoint, FRAME, Health, MESSAGE, RecorderAction, RecorderStatus, Refusal, Reply, Request,
    Stage, Status, WORDS, WaveAction,
};

const STATUS: Status = Status {
    tick: u64::MAX,
    phase: 4,
    cause: 12,
    finding: u16::MAX,
    amplifier_on: true,
    status: 1 << 18,
    events: 31,
    late: 7,
    age: Some(u64::MAX),
    link: Counters::NONE,
};

const HEALTH: Health = Health {
    events: 31,
    converter_faults: u32::MAX,
    faults: 0x1fe,
    gauge_faults: 7,
    overruns: Some(1),
    clock: 400_000_000,
    tick: Some([22_000, u64::MAX]),
    output: Some([16_000, 17_000]),
    latest: None,
    stack: Some([7_932, 8_192]),
    reset_cause: 0b0001_0100,
};

fn requests() -> Vec<Request<'static>> {
    vec![
        Request::Describe { offset: u32::MAX },
        Request::Status,
        Request::Supervise { request: 5 },
        Request::Setpoint { words: leaked(21, 1) },
        Request::ReadConfig,
        Request::WriteConfig { words: leaked(55, 2) },
        Request::LockstepReset { config: leaked(WORDS, 3) },
        Request::LockstepStep { input: leaked(35, 4) },
        Request::LockstepStage { index: 255 },
        Request::Recorder { action: RecorderAction::Look },
        Request::Recorder { action: RecorderAction::Arm { after: 70_000 } },
        Request::Recorder { action: RecorderAction::Trigger },
        Request::Recorder { action: RecorderAction::Stop },
        Request::Download { offset: 1 << 20 },
        Request::Wave { action: WaveAction::Start, words: leaked(9, 5) },
        Request::Wave { action: WaveAction::Stop, words: Bytes(&[]) },
        Request::Stop,
        Request::Health,
        Request::Place,
        Request::Stream { every: u32::MAX },
        Request::Samples,
    ]
}

fn replies() -> Vec<Reply<'static>> {
    let refusals = [
        Refusal::Unsupported,
        Refusal::Length { expected: u16::MAX },
        Refusal::Word { index: 54 },
        Refusal::State,
        Refusal::TooLong,
        Refusal::Rate { least: u32::MAX },
    ];
    let stage = Stage { name: "supervise", calls: 3, smallest: 0, sum: u64::MAX, largest: 1 << 40, stack: Some(4096) };
    let recorder = RecorderStatus { running: true, triggered: false, ticks: 100, capacity: 4096 };
    let mut all: Vec<Reply<'static>> = refusals.map(Reply::Refused).to_vec();
    all.extend([
        Reply::Done,
        Reply::Health(HEALTH),
        Reply::Place { tick: u64::MAX, phase: 2, status: 1 << 18, measured: Some(u64::MAX), words: leaked(24, 8) },
        Reply::Place { tick: 0, phase: 0, status: 0, measured: None, words: leaked(24, 8) },
        Reply::Identity(IDENTITY),
        Reply::Config { words: leaked(WORDS, 6) },
        Reply::Stepped { cost: u32::MAX, digest: u64::MAX, output: leaked(WORDS, 7) },
        Reply::Stage(stage),
        Reply::Recorder(recorder),
        Reply::Chunk { offset: 5, total: u32::MAX, bytes: Bytes(b"0123") },
        Reply::Samples { number: u32::MAX, tick: u64::MAX, every: 1, more: true, rows: Bytes(b"01234") },
    ]);
    all
}

/// Gives one answer after the other.
struct Script {
    answers: Vec<Reply<'static>>,
    asked: Vec<String>,
}

impl Device for Script {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        self.asked.push(format!("{request:?}"));
        if *request == Request::Hello { Reply::Identity(IDENTITY) } else { self.answers.remove(0) }
    }
}

/// Runs requests against a script; the answers as the client sees them.
fn converse(requests: &[Request<'_>], answers: Vec<Reply<'static>>) -> (Vec<String>, Vec<String>) {
    let (mut endpoint, mut device) = (Endpoint::new(), Script { answers, asked: Vec::new() });
    let mut sent = Vec::new();
    let mut seen = Vec::new();
    {
        let mut answer = |bytes: &[u8]| answered(&mut endpoint, &mut device, bytes);
        let (mut client, _) = Client::open(Tap(&mut sent, &mut answer, Vec::new()), 9, Timeout::PIPE).unwrap();
        for request in requests {
            seen.push(match client.ask(request) {
                Ok(reply) => format!("{reply:?}"),
                Err(ClientError::Refused(refusal)) => format!("{:?}", Reply::Refused(refusal)),
                Err(error) => panic!("{error}"),
            });
        }
    }
    (device.asked.split_off(1), seen)
}

#[test]
fn every_request_arrives_as_it_was_sent() {
    let all = requests();
    let (arrived, _) = converse(&all, vec![Reply::Done; all.len()]);
    assert_eq!(arrived, all.iter().map(|request| format!("{request:?}")).collect::<Vec<_>>());
}

#[test]
fn every_reply_arrives_as_it_was_sent() {
    let all = replies();
    let (_, seen) = converse(&vec![Request::Status; all.len()], all.clone());
    assert_eq!(seen, all.iter().map(|reply| format!("{reply:?}")).collect::<Vec<_>>());
}

#[test]
fn a_status_carries_the_counters_of_the_endpoint() {
    let (_, seen) = converse(&[Request::ReadConfig, Request::Status], vec![Reply::Done, Reply::Status(STATUS)]);
    let counted = Status { link: Counters { executed: 3, ..Counters::NONE }, ..STATUS };
    assert_eq!(seen[1], format!("{:?}", Reply::Status(counted)));
}

#[test]
fn what_does_not_fit_is_refused_on_both_sides() {
    let long = Bytes(&[1; MESSAGE]);
    let (mut sent, mut nobody) = (Vec::new(), |_: &[u8]| Vec::new());
    let refused =
        Client::open(Tap(&mut sent, &mut nobody, Vec::new()), 9, Timeout { limit: Duration::ZERO, attempts: 3 });
    // Nobody answers.
    let Err(ClientError::Silent { attempts: 3, .. }) = refused else { panic!("not silent") };
    assert_eq!(sent.len(), 1 + 3, "a zero, then three times the same frame");
    assert!(sent[1] == sent[2] && sent[2] == sent[3] && sent[1].len() < FRAME);

    let (_, seen) = converse(&[Request::ReadConfig], vec![Reply::Config { words: long }]);
    assert_eq!(seen, [format!("{:?}", Reply::Refused(Refusal::TooLong))]);
}

#[test]
fn telemetry_is_kept_and_is_no_answer() {
    let mut out = [0; FRAME];
    let said = specgen_link::telemetry(&STATUS, 3, &mut out).to_vec();
    assert_eq!((said.len() < 64, said.last()), (true, Some(&0)));
    let (mut endpoint, mut device) = (Endpoint::new(), support::Notebook::default());
    let mut answer = |bytes: &[u8]| [said.clone(), answered(&mut endpoint, &mut device, bytes)].concat();
    let mut sent = Vec::new();
    let (mut client, identity) = Client::open(Tap(&mut sent, &mut answer, Vec::new()), 1, Timeout::PIPE).unwrap();
    assert_eq!(identity, IDENTITY);
    assert_eq!(client.telemetry(), Some(&STATUS));
    assert_eq!(client.ask(&Request::ReadConfig).unwrap(), Reply::Done);
    assert_eq!(client.damaged(), 0);
}
