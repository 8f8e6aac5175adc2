//! Pages: who is there, who has the orders, what each is told. One page orders, the others look; hold and ramp down are anybody's.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Deserialize;
use serde_json::{Value, json};
use specgen_runtime::supervisor::Request;
use tungstenite::Message;

use super::browser::{Heard, Outbox};

/// A page that has the orders is gone when it is silent for so long.
const SILENCE: Duration = Duration::from_secs(2);
/// How long the page that has the orders may think about giving them, and an offer stands.
const ANSWER: Duration = Duration::from_secs(10);
/// Messages with samples that a page may have taken without showing them: two seconds of them. Then it is left out until it catches up.
const BEHIND: u32 = 40;
/// What other pages order after a hold or a ramp down they ordered before it, until they show samples that are newer, and for so long at most.
const LATE: Duration = Duration::from_secs(1);
/// Orders that wait.
const WAITING: usize = 16;
/// Messages that are heard in a round.
const ROUND: usize = 128;
/// Events that are kept for pages that come later.
const EVENTS: usize = 100;

/// What a page asks for.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub enum Asked {
    /// It has shown the samples up to this message: it is there.
    Seen {
        number: u32,
    },
    RampDown,
    Hold,
    /// The orders, or an answer to one who asks for them.
    Ask,
    Offer,
    Give,
    Keep,
    /// A line as `specgen operate` takes it.
    Order {
        id: u32,
        line: String,
    },
    /// A request to the supervisor that is to begin to be given.
    Begin {
        id: u32,
        request: Begin,
    },
    Wave {
        id: u32,
        name: String,
        text: String,
    },
    /// All gains by this factor of the spec's.
    Gain {
        id: u32,
        factor: f64,
    },
    Download {
        id: u32,
    },
    /// The wiring check.
    Check {
        id: u32,
    },
    EndCheck,
}

#[derive(Debug, Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Begin {
    Arm,
    Run,
    Acknowledge,
}

struct Page {
    number: u64,
    to: Outbox,
    heard: Instant,
    /// The last message with samples that it was sent, and the last that it has shown.
    sent: u32,
    seen: u32,
    /// Messages with samples that it was not sent since it fell behind.
    left_out: u32,
}

/// Everybody who looks.
pub struct Hall {
    heard: Receiver<Heard>,
    pages: Vec<Page>,
    holder: Option<u64>,
    /// Who asks for the orders, and since when.
    asked: Option<(u64, Instant)>,
    /// Since when the orders are anybody's who asks.
    offered: Option<Instant>,
    waiting: VecDeque<(u64, Asked)>,
    /// Hold or ramp down, and who wants it; the later counts, a hold does not end a ramp down.
    urgent: Option<(u64, Request)>,
    /// The page that asked for one last, when, and the last message with samples before it.
    stopped: Option<(u64, Instant, u32)>,
    /// The page that had the orders went away with them.
    pub is_left: bool,
    /// The check is to end.
    pub ends: bool,
    number: u32,
    events: VecDeque<Value>,
}

/// ms since 1970.
pub fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64() * 1e3)
}

fn text(value: &Value) -> Message {
    Message::text(value.to_string())
}

impl Hall {
    pub fn new(heard: Receiver<Heard>) -> Self {
        Self {
            heard,
            pages: Vec::new(),
            holder: None,
            asked: None,
            offered: None,
            waiting: VecDeque::new(),
            urgent: None,
            stopped: None,
            is_left: false,
            ends: false,
            number: 0,
            events: VecDeque::new(),
        }
    }

    /// Hears what pages say, for so long at most until the first says something; then looks who is there.
    pub fn listen(&mut self, limit: Duration) {
        match self.heard.recv_timeout(limit) {
            Ok(first) => self.hear(first),
            Err(RecvTimeoutError::Timeout) => {}
            // The door is closed: nobody comes any more.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(limit),
        }
        for _ in 0..ROUND {
            let Ok(heard) = self.heard.try_recv() else { break };
            self.hear(heard);
        }
        let gone = |page: &&Page| Some(page.number) == self.holder && page.heard.elapsed() >= SILENCE;
        if let Some(number) = self.pages.iter().find(gone).map(|page| page.number) {
            self.lose(number, "says nothing any more");
        }
        if self.asked.is_some_and(|(_, since)| since.elapsed() >= ANSWER) {
            self.hand_over();
        }
        if self.offered.is_some_and(|since| since.elapsed() >= ANSWER) {
            self.offered = None;
        }
    }

    fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Came { page, to } => {
                to.send(text(&json!({ "k": "hello", "you": name(page), "events": self.events })));
                let sent = self.number;
                self.pages.push(Page { number: page, to, heard: Instant::now(), sent, seen: sent, left_out: 0 });
            }
            Heard::Left { page } => {
                self.pages.retain(|one| one.number != page);
                if self.holder == Some(page) {
                    self.lose(page, "was closed");
                }
                if self.asked.is_some_and(|(asks, _)| asks == page) {
                    self.asked = None;
                }
            }
            Heard::Said { page, text } => {
                // What is no order is none: nothing comes of it, not even that somebody is there.
                if let Ok(asked) = serde_json::from_str(&text) {
                    self.take(page, asked);
                }
            }
        }
    }

    fn take(&mut self, page: u64, asked: Asked) {
        let Some(index) = self.pages.iter().position(|one| one.number == page) else { return };
        self.pages[index].heard = Instant::now();
        let is_mine = self.holder == Some(page);
        match asked {
            Asked::Seen { number } => {
                let one = &mut self.pages[index];
                if number <= one.sent && number > one.seen {
                    one.seen = number;
                }
            }
            Asked::RampDown => self.stop(page, Request::RampDown),
            Asked::Hold if self.urgent.is_none() => self.stop(page, Request::Hold),
            Asked::Hold => {}
            Asked::Ask if is_mine => {}
            Asked::Ask if self.holder.is_none() || self.offered.is_some() => self.give_to(page),
            Asked::Ask if self.asked.is_none() => self.asked = Some((page, Instant::now())),
            Asked::Ask => self.answer(page, 0, Err("another page asks already")),
            Asked::Give if is_mine && self.asked.is_some() => self.hand_over(),
            Asked::Offer if is_mine => self.offered = Some(Instant::now()),
            Asked::Keep if is_mine => {
                if let Some((asks, _)) = self.asked.take() {
                    self.answer(asks, 0, Err("the page that has the orders keeps them"));
                }
                self.offered = None;
            }
            Asked::EndCheck if is_mine => self.ends = true,
            Asked::Give | Asked::Offer | Asked::Keep | Asked::EndCheck => {}
            order if self.is_late(index) => {
                self.answer(page, order.id(), Err("another page has just stopped the machine"));
            }
            order if is_mine && self.waiting.len() < WAITING => self.waiting.push_back((page, order)),
            order => {
                let why = if is_mine { "too many orders wait" } else { "this page does not have the orders" };
                self.answer(page, order.id(), Err(why));
            }
        }
    }

    /// Whatever waits was asked for before that.
    fn stop(&mut self, page: u64, request: Request) {
        for (page, order) in std::mem::take(&mut self.waiting) {
            self.answer(page, order.id(), Err("the machine was stopped"));
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
        (self.asked, self.offered, self.is_left) = (None, None, false);
        // What another had asked for is not done in this one's name.
        self.waiting.clear();
        let from = before.map_or(String::new(), |before| format!(" from {}", name(before)));
        self.note("note", &format!("{} has the orders{from}.", named(page)), "", None);
    }

    fn hand_over(&mut self) {
        if let Some((asks, _)) = self.asked.take() {
            self.give_to(asks);
        }
    }

    /// The page with the orders is no longer there.
    fn lose(&mut self, page: u64, how: &str) {
        (self.holder, self.offered, self.is_left) = (None, None, true);
        self.waiting.clear();
        self.note("warning", &format!("{} had the orders and {how}.", named(page)), "", None);
        self.hand_over();
    }

    /// An order that waits, and whose it is.
    pub fn next(&mut self) -> Option<(u64, Asked)> {
        self.waiting.pop_front()
    }

    /// What anybody may ask for at once, and who did.
    pub fn urgent(&mut self) -> Option<(String, Request)> {
        let (page, request) = self.urgent.take()?;
        self.is_left = false;
        Some((named(page), request))
    }

    /// Whether anybody asks for hold or ramp down.
    pub fn is_pressed(&self) -> bool {
        self.urgent.is_some()
    }

    pub fn has_holder(&self) -> bool {
        self.holder.is_some()
    }

    /// Tells a page what became of an order.
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

    /// What happened, for every page, and for those that come.
    pub fn note(&mut self, kind: &str, what: &str, advice: &str, code: Option<&str>) {
        let event = json!({ "k": "event", "t": now(), "kind": kind, "text": what, "do": advice, "code": code });
        for page in &self.pages {
            page.to.send(text(&event));
        }
        self.events.push_back(event);
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
    }

    /// Tells every page how things stand: `state` of the machine, and what is between the pages.
    pub fn publish(&self, state: &Value) {
        let left = |since: Instant| ANSWER.saturating_sub(since.elapsed()).as_secs_f64();
        for page in &self.pages {
            let mut state = state.clone();
            state["you"] = json!(name(page.number));
            state["holder"] = json!(self.holder.map(name));
            state["mine"] = json!(self.holder == Some(page.number));
            state["asked"] = json!(
                self.asked
                    .map(|(asks, since)| json!({ "by": name(asks), "mine": asks == page.number, "left": left(since) }))
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

impl Asked {
    /// The number under which it is answered.
    pub fn id(&self) -> u32 {
        match self {
            Self::Order { id, .. }
            | Self::Begin { id, .. }
            | Self::Wave { id, .. }
            | Self::Gain { id, .. }
            | Self::Download { id }
            | Self::Check { id } => *id,
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
