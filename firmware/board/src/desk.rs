//! What a board answers over the link.

use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Request as Wanted};
use controller::{CONFIG_WORDS, Config, DESCRIPTION};
use specgen_link::{Bytes, Counted, Counters, Device, Identity, Refusal, Reply, Request, Status, put_words};

use crate::exchange::{Exchange, Orders, Report};
use crate::words::COMMAND_WORDS;

/// Bytes of a piece of the description.
const CHUNK: usize = 256;

/// The background's copy of the [`Exchange`], and what requests made of it.
#[derive(Debug)]
pub struct Desk {
    orders: Orders,
    config: Config,
    report: Report,
    /// A request was carried out: the host is there, and orders may have changed.
    heard: bool,
    /// The settings changed.
    configured: bool,
    /// Events that the host has been told of.
    told: u32,
    /// Settings in an answer.
    words: [u8; size_of::<[u64; CONFIG_WORDS]>()],
}

impl Desk {
    /// With the copy of what is in force.
    #[must_use]
    pub const fn new(exchange: &Exchange) -> Self {
        Self {
            orders: exchange.orders,
            config: exchange.config,
            report: exchange.report,
            heard: false,
            configured: false,
            told: 0,
            words: [0; size_of::<[u64; CONFIG_WORDS]>()],
        }
    }

    /// Takes the latest report, before requests are looked at.
    pub const fn fetch(&mut self, exchange: &Exchange) {
        self.report = exchange.report;
    }

    /// Whether [`Self::publish`] has anything to do.
    #[must_use]
    pub const fn has_news(&self) -> bool {
        self.heard
    }

    /// Hands over what requests have changed, all of it between two ticks.
    pub fn publish(&mut self, exchange: &mut Exchange) {
        if self.heard {
            exchange.silence.heard();
            exchange.orders = self.orders;
            exchange.report.events &= !self.told;
        }
        if self.configured {
            exchange.config = self.config;
        }
        (self.heard, self.configured, self.told) = (false, false, 0);
    }

    fn describe(offset: u32) -> Reply<'static> {
        let text = DESCRIPTION.as_bytes();
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let rest = text.get(start..).unwrap_or_default();
        let piece = rest.get(..CHUNK).unwrap_or(rest);
        Reply::Chunk { offset, total: text.len() as u32, bytes: Bytes(piece) }
    }

    fn status(&mut self) -> Status {
        let report = &self.report;
        self.told = report.events;
        Status {
            tick: report.tick,
            phase: report.phase.word() as u8,
            cause: report.cause.word() as u8,
            amplifier_on: report.amplifier_on,
            status: report.status,
            events: report.events,
            late: report.missed,
            // The endpoint fills it in.
            link: Counters::NONE,
        }
    }

    fn command(&mut self, words: Bytes<'_>) -> Reply<'static> {
        let mut command = [0; COMMAND_WORDS];
        if !words.read_words(&mut command) {
            return Reply::Refused(Refusal::Length { expected: COMMAND_WORDS as u16 });
        }
        self.orders.command = command;
        Reply::Done
    }

    fn configure(&mut self, words: Bytes<'_>) -> Reply<'static> {
        let mut config = [0; CONFIG_WORDS];
        if !words.read_words(&mut config) {
            return Reply::Refused(Refusal::Length { expected: CONFIG_WORDS as u16 });
        }
        match Config::from_words(&config) {
            Ok(config) => {
                self.config = config;
                self.configured = true;
                Reply::Done
            }
            Err(error) => Reply::Refused(Refusal::Word { index: error.word as u16 }),
        }
    }
}

impl Device for Desk {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        self.heard = true;
        match *request {
            Request::Hello => {
                // A host that comes anew has asked for nothing yet.
                self.orders.request = Wanted::None;
                Reply::Identity(Identity {
                    config_words: CONFIG_WORDS as u16,
                    input_words: MACHINE_INPUT_WORDS as u16,
                    output_words: MACHINE_OUTPUT_WORDS as u16,
                    stages: 0,
                    counted: Counted::Nothing,
                    description: DESCRIPTION.len() as u32,
                })
            }
            Request::Describe { offset } => Self::describe(offset),
            Request::Status => Reply::Status(self.status()),
            Request::Supervise { request } => {
                let wanted = Wanted::from_word(u64::from(request));
                if wanted.word() != u64::from(request) {
                    return Reply::Refused(Refusal::Word { index: 0 });
                }
                self.orders.request = wanted;
                Reply::Done
            }
            Request::Setpoint { words } => self.command(words),
            Request::ReadConfig => match put_words(&self.config.to_words(), &mut self.words) {
                Some(words) => Reply::Config { words },
                None => Reply::Refused(Refusal::TooLong),
            },
            Request::WriteConfig { words } => self.configure(words),
            Request::LockstepReset { .. }
            | Request::LockstepStep { .. }
            | Request::LockstepStage { .. }
            | Request::Recorder { .. }
            | Request::Download { .. }
            | Request::Wave { .. } => Reply::Refused(Refusal::Unsupported),
        }
    }
}
