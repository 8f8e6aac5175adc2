//! What a board answers, and that a refused request changes nothing.

#![allow(clippy::unwrap_used)]

use controller::supervised::Request as Wanted;
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use specgen_board::{COMMAND_WORDS, Desk, Exchange};
use specgen_link::{Bytes, Device, Refusal, Reply, Request};

fn bytes(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

#[test]
fn orders_reach_the_tick_all_at_once_and_only_when_published() {
    let mut exchange = Exchange::new();
    let mut desk = Desk::new(&exchange);
    assert!(!desk.has_news());
    let words: Vec<u64> = (100..100 + COMMAND_WORDS as u64).collect();
    assert_eq!(desk.execute(&Request::Setpoint { words: Bytes(&bytes(&words)) }), Reply::Done);
    assert_eq!(desk.execute(&Request::Supervise { request: 2 }), Reply::Done);
    assert_eq!(exchange.orders.request, Wanted::None);
    assert!(desk.has_news());
    desk.publish(&mut exchange);
    assert_eq!(exchange.orders.command[..], words);
    assert_eq!(exchange.orders.request, Wanted::Run);
    assert!(!exchange.silence.tick(), "the host was heard");
    assert!(!desk.has_news());
    // A host that comes anew has not asked for anything.
    desk.execute(&Request::Hello);
    desk.publish(&mut exchange);
    assert_eq!(exchange.orders.request, Wanted::None);
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut exchange = Exchange::new();
    let mut desk = Desk::new(&exchange);
    let mut config = Config::new().to_words();
    config[0] = u64::MAX;
    let refused = [
        (Request::Supervise { request: 6 }, Refusal::Word { index: 0 }),
        (Request::Supervise { request: 255 }, Refusal::Word { index: 0 }),
        (Request::Setpoint { words: Bytes(&[0; 8]) }, Refusal::Length { expected: COMMAND_WORDS as u16 }),
        (Request::WriteConfig { words: Bytes(&[0; 7]) }, Refusal::Length { expected: CONFIG_WORDS as u16 }),
        (Request::WriteConfig { words: Bytes(&bytes(&config)) }, Refusal::Word { index: 0 }),
        (Request::LockstepStage { index: 0 }, Refusal::Unsupported),
    ];
    let (orders, settings) = (exchange.orders, exchange.config.to_words());
    for (request, refusal) in refused {
        assert_eq!(desk.execute(&request), Reply::Refused(refusal), "{request:?}");
        desk.publish(&mut exchange);
        assert_eq!(exchange.orders.command, orders.command);
        assert_eq!(exchange.orders.request, orders.request);
        assert_eq!(exchange.config.to_words(), settings);
    }
}

#[test]
fn settings_go_in_and_come_out() {
    let mut exchange = Exchange::new();
    let mut desk = Desk::new(&exchange);
    let mode = Config::new().with_mode(controller::ControlMode::from_word(0).unwrap()).to_words();
    assert_ne!(mode, exchange.config.to_words());
    assert_eq!(desk.execute(&Request::WriteConfig { words: Bytes(&bytes(&mode)) }), Reply::Done);
    desk.publish(&mut exchange);
    assert_eq!(exchange.config.to_words(), mode);
    assert_eq!(desk.execute(&Request::ReadConfig), Reply::Config { words: Bytes(&bytes(&mode)) });
}

#[test]
fn the_description_comes_in_pieces() {
    let mut desk = Desk::new(&Exchange::new());
    let mut text = Vec::new();
    loop {
        let Reply::Chunk { offset, total, bytes } = desk.execute(&Request::Describe { offset: text.len() as u32 }) else {
            unreachable!()
        };
        assert_eq!((offset as usize, total as usize), (text.len(), DESCRIPTION.len()));
        if bytes.0.is_empty() {
            break;
        }
        text.extend_from_slice(bytes.0);
    }
    assert_eq!(text, DESCRIPTION.as_bytes());
    let beyond = desk.execute(&Request::Describe { offset: u32::MAX });
    assert!(matches!(beyond, Reply::Chunk { bytes: Bytes(&[]), .. }));
}

/// Events that come up after the status was given out are still there for the next one.
#[test]
fn events_are_kept_until_the_host_was_told() {
    let mut exchange = Exchange::new();
    let mut desk = Desk::new(&exchange);
    exchange.report.events = 0b0101;
    desk.fetch(&exchange);
    let Reply::Status(status) = desk.execute(&Request::Status) else { unreachable!() };
    assert_eq!(status.events, 0b0101);
    exchange.report.events |= 0b1000;
    desk.publish(&mut exchange);
    assert_eq!(exchange.report.events, 0b1000);
    desk.execute(&Request::ReadConfig);
    desk.publish(&mut exchange);
    assert_eq!(exchange.report.events, 0b1000);
}
