//! A board at the other end of a pseudo-terminal: the firmware's side of the link with the host library.

use std::fs::File;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use host_sim::controller::Supervised;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use specgen_link::lockstep::{Lockstep, Machine};
use specgen_link::{CostUnit, Counters, Endpoint, Stage};

/// A controller stepped by a board.
pub struct SteppedMachine {
    host: Supervised,
    text: String,
    ticks: u64,
    /// Flips the lowest bit of this output word in this tick.
    pub flip: Option<(u64, usize)>,
}

impl SteppedMachine {
    pub fn new(host: Supervised) -> Self {
        let text = host.controller().description_text();
        Self { host, text, ticks: 0, flip: None }
    }

    /// Makes it report another spec.
    pub fn pretend(mut self, digest: &str) -> Self {
        let own = format!("digest={}", self.host.controller().digest_text());
        self.text = self.text.replace(&own, &format!("digest={digest}"));
        self
    }
}

/// Access to a controller's description.
trait Text {
    fn description_text(&self) -> String;
    fn digest_text(&self) -> String;
}

impl<T: host_sim::controller::TickController> Text for T {
    fn description_text(&self) -> String {
        self.description().to_text()
    }

    fn digest_text(&self) -> String {
        self.description().digest.clone()
    }
}

impl Machine for SteppedMachine {
    fn description(&self) -> &str {
        &self.text
    }

    fn words(&self) -> [usize; 3] {
        let config = self.host.controller();
        let config = host_sim::controller::TickController::default_config(config).len();
        [config, self.host.input_names().len(), self.host.output_names().len()]
    }

    fn stages(&self) -> usize {
        1
    }

    fn counted(&self) -> CostUnit {
        CostUnit::Cycles
    }

    fn configure(&mut self, config: &[u64]) -> Result<(), usize> {
        self.host.configure(config).map_err(|_| 0)
    }

    fn reset(&mut self) {
        self.host.reset();
        self.ticks = 0;
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32) {
        self.host.step(input, output);
        if let Some((tick, word)) = self.flip
            && tick == self.ticks
        {
            output[word] ^= 1;
        }
        self.ticks += 1;
        (self.host.digest(), 1)
    }

    fn stage(&self, index: usize) -> Option<Stage<'_>> {
        let stage =
            Stage { name: "supervise", calls: self.ticks, smallest: 1, sum: self.ticks, largest: 1, stack: None };
        (index == 0).then_some(stage)
    }
}

/// The board, in a separate thread. Dropping it unplugs the board.
pub struct Board {
    pub port: PathBuf,
    unplugged: Arc<AtomicBool>,
    thread: Option<JoinHandle<Counters>>,
}

impl Board {
    /// Plugs it in. One in `noise` bytes is corrupted in either direction, none if 0. Without a machine it does not answer.
    pub fn plug(machine: Option<SteppedMachine>, noise: u32) -> Self {
        let line = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&line).unwrap();
        unlockpt(&line).unwrap();
        let port = PathBuf::from(ptsname(&line, Vec::new()).unwrap().into_string().unwrap());
        let unplugged = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&unplugged);
        let thread = std::thread::spawn(move || serve(File::from(line), machine, noise, &seen));
        Self { port, unplugged, thread: Some(thread) }
    }

    /// Unplugs it. Returns the counters of its endpoint.
    pub fn unplug(mut self) -> Counters {
        self.unplugged.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.unplugged.store(true, Ordering::Relaxed);
    }
}

fn serve(mut line: File, machine: Option<SteppedMachine>, noise: u32, unplugged: &AtomicBool) -> Counters {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut damage = |byte: u8| {
        let hit = noise > 0 && random.next_u32().is_multiple_of(noise);
        if hit { byte ^ (1 << (random.next_u32() % 8)) } else { byte }
    };
    let mut endpoint = Endpoint::new();
    let mut device = machine.map(Lockstep::new);
    let mut bytes = [0; 1024];
    let limit = Timespec::try_from(Duration::from_millis(20)).unwrap();
    while !unplugged.load(Ordering::Relaxed) {
        let ready = poll(&mut [PollFd::new(&line, PollFlags::IN)], Some(&limit)).unwrap();
        // Reads fail until the other end is opened.
        let count = if ready == 0 { 0 } else { line.read(&mut bytes).unwrap_or(0) };
        if count == 0 {
            std::thread::sleep(Duration::from_micros(200));
        }
        let Some(device) = &mut device else { continue };
        for byte in &bytes[..count] {
            if let Some(reply) = endpoint.push(damage(*byte), device) {
                let reply: Vec<u8> = reply.iter().map(|byte| damage(*byte)).collect();
                line.write_all(&reply).unwrap();
            }
        }
    }
    *endpoint.counters()
}
