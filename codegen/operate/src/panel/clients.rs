//! Connected pages. One page is in control, the others watch; hold and ramp down work from every page.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Deserialize;
use serde_json::{Value, json};
use specgen_runtime::supervisor::Request;
use tungstenite::Message;

use super::browser::{ClientEvent, Outbox};

/// The page in control loses control after this silence.
const SILENCE: Duration = Duration::from_secs(2);
/// Time for the page in control to answer a request for control, and lifetime of an offer.
const ANSWER: Duration = Duration::from_secs(10);
/// Messages with samples that a page may have received but not shown: two seconds. Then it gets none until it catches up.
const BEHIND: u32 = 40;
/// For at most this time after a stop, commands of other pages are refused, until a page has shown newer samples: such a command
/// may be older than the stop.
const LATE: Duration = Duration::from_secs(1);
/// Largest number of waiting commands.
const WAITING: usize = 16;
/// Largest number of events per round.
const ROUND: usize = 128;
/// Number of log entries for pages that connect later.
const LOG: usize = 100;

/// A request of a page.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum PageRequest {
    /// It has shown the samples up to this message: its heartbeat.
    Seen {
        number: u32,
    },
    RampDown,
    Hold,
    RequestControl,
    OfferControl,
    /// Answers to a request for control.
    GrantControl,
    KeepControl,
    /// A command line of `specgen operate`.
    Command {
        id: u32,
        line: String,
    },
    /// An edge-triggered request to the supervisor.
    Begin {
        id: u32,
        request: EdgeRequest,
    },
    Wave {
        id: u32,
        name: String,
        text: String,
    },
    /// Sets all gains to those of the spec times this factor.
    Gain {
        id: u32,
        factor: f64,
    },
    /// Sets all settings to those of the spec.
    Restore {
        id: u32,
    },
    Download {
        id: u32,
    },
    /// The wiring check.
    Check {
        id: u32,
    },
    EndCheck,
    /// Begins or continues the commissioning.
    Commission {
        id: u32,
    },
}

#[derive(Debug, Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeRequest {
    Arm,
    Run,
    Acknowledge,
}

struct Page {
    number: u64,
    to: Outbox,
    heartbeat: Instant,
    /// The last message with samples sent to it, and the last that it has shown.
    sent: u32,
    seen: u32,
    /// Messages with samples that were skipped since it fell behind.
    left_out: u32,
}

/// All connected pages.
pub struct Clients {
    events: Receiver<ClientEvent>,
    pages: Vec<Page>,
    /// The page in control.
    holder: Option<u64>,
    /// The page that requests control, and since when.
    requested: Option<(u64, Instant)>,
    /// Since when control is offered to any page.
    offered: Option<Instant>,
    waiting: VecDeque<(u64, PageRequest)>,
    /// A requested hold or ramp-down, and its page. The last request wins, except that a hold does not replace a ramp-down.
    urgent: Option<(u64, Request)>,
    /// The page that last stopped the machine, the time, and the last message with samples before that.
    stopped: Option<(u64, Instant, u32)>,
    /// The page in control has gone, and no other has taken control.
    pub is_left: bool,
    /// A page requests the end of the wiring check.
    pub ends: bool,
    number: u32,
    log: VecDeque<Value>,
}

/// ms since 1970.
pub fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64() * 1e3)
}

fn text(value: &Value) -> Message {
    Message::text(value.to_string())
}

impl Clients {
    pub fn new(events: Receiver<ClientEvent>) -> Self {
        Self {
            events,
            pages: Vec::new(),
            holder: None,
            requested: None,
            offered: None,
            waiting: VecDeque::new(),
            urgent: None,
            stopped: None,
            is_left: false,
            ends: false,
            number: 0,
            log: VecDeque::new(),
        }
    }

    /// Handles events of pages, waiting at most `limit` for the first one; then takes control from a silent page.
    pub fn listen(&mut self, limit: Duration) {
        match self.events.recv_timeout(limit) {
            Ok(first) => self.handle(first),
            Err(RecvTimeoutError::Timeout) => {}
            // The listener has ended, so there are no more pages.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(limit),
        }
        for _ in 0..ROUND {
            let Ok(event) = self.events.try_recv() else { break };
            self.handle(event);
        }
        let gone = |page: &&Page| Some(page.number) == self.holder && page.heartbeat.elapsed() >= SILENCE;
        if let Some(number) = self.pages.iter().find(gone).map(|page| page.number) {
            self.lose(number, "stopped responding");
        }
        if self.requested.is_some_and(|(_, since)| since.elapsed() >= ANSWER) {
            self.hand_over();
        }
        if self.offered.is_some_and(|since| since.elapsed() >= ANSWER) {
            self.offered = None;
        }
    }

    /// Excuses the silence of pages up to now: they were not heard.
    pub fn excuse(&mut self) {
        self.pages.iter_mut().for_each(|page| page.heartbeat = Instant::now());
    }

    fn handle(&mut self, event: ClientEvent) {
        match event {
            ClientEvent::Connected { page, to } => {
                to.send(text(&json!({ "k": "hello", "you": name(page), "events": self.log })));
                let sent = self.number;
                self.pages.push(Page { number: page, to, heartbeat: Instant::now(), sent, seen: sent, left_out: 0 });
            }
            ClientEvent::Disconnected { page } => {
                self.pages.retain(|one| one.number != page);
                if self.holder == Some(page) {
                    self.lose(page, "was closed");
                }
                if self.requested.is_some_and(|(requester, _)| requester == page) {
                    self.requested = None;
                }
            }
            ClientEvent::Received { page, text } => {
                // An invalid message does not count as a heartbeat.
                if let Ok(request) = serde_json::from_str(&text) {
                    self.take(page, request);
                }
            }
        }
    }

    fn take(&mut self, page: u64, request: PageRequest) {
        let Some(index) = self.pages.iter().position(|one| one.number == page) else { return };
        self.pages[index].heartbeat = Instant::now();
        let is_mine = self.holder == Some(page);
        match request {
            PageRequest::Seen { number } => {
                let one = &mut self.pages[index];
                if number <= one.sent && number > one.seen {
                    one.seen = number;
                }
            }
            PageRequest::RampDown => self.stop(page, Request::RampDown),
            PageRequest::Hold if self.urgent.is_none() => self.stop(page, Request::Hold),
            PageRequest::Hold => {}
            PageRequest::RequestControl if is_mine => {}
            PageRequest::RequestControl if self.holder.is_none() || self.offered.is_some() => self.give_to(page),
            PageRequest::RequestControl if self.requested.is_none() => self.requested = Some((page, Instant::now())),
            PageRequest::RequestControl => self.answer(page, 0, Err("another page has already requested control")),
            PageRequest::GrantControl if is_mine && self.requested.is_some() => self.hand_over(),
            PageRequest::OfferControl if is_mine => self.offered = Some(Instant::now()),
            PageRequest::KeepControl if is_mine => {
                if let Some((requester, _)) = self.requested.take() {
                    self.answer(requester, 0, Err("the page in control keeps it"));
                }
                self.offered = None;
            }
            PageRequest::EndCheck if is_mine => self.ends = true,
            PageRequest::GrantControl
            | PageRequest::OfferControl
            | PageRequest::KeepControl
            | PageRequest::EndCheck => {}
            command if self.is_late(index) => {
                self.answer(page, command.id(), Err("another page has just stopped the machine"));
            }
            command if is_mine && self.waiting.len() < WAITING => self.waiting.push_back((page, command)),
            command => {
                let why = if is_mine { "too many commands are waiting" } else { "this page is not in control" };
                self.answer(page, command.id(), Err(why));
            }
        }
    }

    /// Requests a stop, and refuses waiting commands, which are older.
    fn stop(&mut self, page: u64, request: Request) {
        for (page, command) in std::mem::take(&mut self.waiting) {
            self.answer(page, command.id(), Err("the machine was stopped"));
        }
        (self.urgent, self.stopped) = (Some((page, request)), Some((page, Instant::now(), self.number)));
    }

    fn is_late(&self, index: usize) -> bool {
        let page = &self.pages[index];
        self.stopped
            .is_some_and(|(other, since, number)| other != page.number && page.seen <= number && since.elapsed() < LATE)
    }

    fn give_to(&mut self, page: u64) {
        let before = self.holder.replace(page);
        (self.requested, self.offered, self.is_left) = (None, None, false);
        // Waiting commands are from the page that was in control before.
        self.waiting.clear();
        let from = before.map_or(String::new(), |before| format!(", after {}", name(before)));
        self.note("note", &format!("{} is in control{from}.", named(page)), "", None);
    }

    fn hand_over(&mut self) {
        if let Some((requester, _)) = self.requested.take() {
            self.give_to(requester);
        }
    }

    /// The page in control has gone.
    fn lose(&mut self, page: u64, how: &str) {
        (self.holder, self.offered, self.is_left) = (None, None, true);
        self.waiting.clear();
        self.note("warning", &format!("{} was in control and {how}.", named(page)), "", None);
        self.hand_over();
    }

    /// The next waiting command, and its page.
    pub fn next(&mut self) -> Option<(u64, PageRequest)> {
        self.waiting.pop_front()
    }

    /// A requested stop, and the name of its page.
    pub fn urgent(&self) -> Option<(String, Request)> {
        self.urgent.map(|(page, request)| (named(page), request))
    }

    /// The machine has answered the requested stop.
    pub fn sent(&mut self) {
        (self.urgent, self.is_left) = (None, false);
    }

    /// Whether a page requests hold or ramp-down.
    pub fn is_pressed(&self) -> bool {
        self.urgent.is_some()
    }

    pub fn has_holder(&self) -> bool {
        self.holder.is_some()
    }

    /// Sends a page the result of a command.
    pub fn answer(&self, page: u64, id: u32, done: Result<Value, &str>) {
        let value = match done {
            Ok(value) => json!({ "k": "answer", "id": id, "ok": true, "value": value }),
            Err(why) => json!({ "k": "answer", "id": id, "ok": false, "why": why }),
        };
        self.tell(page, text(&value));
    }

    /// Sends to one page.
    pub fn tell(&self, page: u64, message: Message) {
        if let Some(one) = self.pages.iter().find(|one| one.number == page) {
            one.to.send(message);
        }
    }

    /// Logs an event: for all pages, and for those that connect later.
    pub fn note(&mut self, kind: &str, what: &str, advice: &str, code: Option<&str>) {
        let event = json!({ "k": "event", "t": now(), "kind": kind, "text": what, "do": advice, "code": code });
        for page in &self.pages {
            page.to.send(text(&event));
        }
        self.log.push_back(event);
        if self.log.len() > LOG {
            self.log.pop_front();
        }
    }

    /// Sends every page the state of the machine and of control.
    pub fn publish(&self, state: &Value) {
        let left = |since: Instant| ANSWER.saturating_sub(since.elapsed()).as_secs_f64();
        for page in &self.pages {
            let mut state = state.clone();
            state["you"] = json!(name(page.number));
            state["holder"] = json!(self.holder.map(name));
            state["mine"] = json!(self.holder == Some(page.number));
            state["asked"] = json!(
                self.requested
                    .map(|(requester, since)| json!({ "by": name(requester), "mine": requester == page.number, "left": left(since) }))
            );
            state["offered"] = json!(self.offered.map(left));
            state["pages"] = json!(self.pages.len());
            state["left_out"] = json!(page.left_out);
            page.to.send(text(&state));
        }
    }

    /// Number of the next message with samples.
    pub fn number(&mut self) -> u32 {
        self.number = self.number.wrapping_add(1);
        self.number
    }

    /// Sends samples to every page that keeps up.
    pub fn show(&mut self, number: u32, bytes: Vec<u8>) {
        let message = Message::binary(bytes);
        for page in &mut self.pages {
            let keeps_up = page.sent.wrapping_sub(page.seen) < BEHIND;
            if keeps_up && page.to.send(message.clone()) {
                page.sent = number;
                page.left_out = 0;
            } else {
                page.left_out += 1;
            }
        }
    }
}

impl PageRequest {
    /// The number of its answer.
    pub fn id(&self) -> u32 {
        match self {
            Self::Command { id, .. }
            | Self::Begin { id, .. }
            | Self::Wave { id, .. }
            | Self::Gain { id, .. }
            | Self::Restore { id }
            | Self::Download { id }
            | Self::Check { id }
            | Self::Commission { id } => *id,
            _ => 0,
        }
    }
}

fn name(page: u64) -> String {
    format!("page {page}")
}

/// At the beginning of a sentence.
fn named(page: u64) -> String {
    format!("Page {page}")
}
