//! The machine that `specgen plant` simulates, by shared memory.

use std::path::Path;

use controller::sensing::CONVERTER;
use controller::triggers::LINES;
use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};
use specgen_rt::clock;
use specgen_rt::exchange::Client;

use super::{Contacts, Device};

/// Time limit of the first reading, ns: the machine may be pre-cycling.
const FIRST: u64 = 60_000_000_000;

pub struct SimulatedDevices {
    client: Client,
    path: String,
    tick: u64,
    /// Time limit of a reading, ns. A silent machine is not waited for.
    timeout: u64,
    silent: bool,
    wrench: [f64; CHANNELS],
    codes: [i32; CHANNELS],
    enabled: bool,
    /// Ticks from rising edge to rising edge of the input line; none without.
    edges: Option<u64>,
}

impl SimulatedDevices {
    /// Opens it and waits for its first reading. Later ones may take `timeout`, ns. Its input line rises every `edges`
    /// ticks.
    ///
    /// # Errors
    /// As text: if there is no such machine, it has another spec, or it does not respond.
    pub fn open(path: &Path, timeout: u64, edges: Option<u64>) -> Result<Self, String> {
        let client = Client::open(path, controller::SPEC_DIGEST).map_err(|error| error.to_string())?;
        let start = clock::now();
        while client.sense(0, FIRST / 100).is_none() {
            if client.is_abandoned() {
                let path = path.display();
                return Err(format!(
                    "{path}: the process that served this machine has ended; start `specgen plant` again"
                ));
            }
            if clock::now() - start > FIRST {
                let path = path.display();
                return Err(format!("{path}: the machine does not answer; is another controller moving it?"));
            }
        }
        Ok(Self {
            client,
            path: path.display().to_string(),
            tick: 0,
            timeout,
            silent: false,
            wrench: [0.0; CHANNELS],
            codes: [0; CHANNELS],
            enabled: false,
            edges,
        })
    }
}

impl Gauges for SimulatedDevices {
    /// Those of the spec.
    const BITS: u32 = u32::BITS - CONVERTER.highest.leading_zeros();

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        let timeout = if self.silent { 0 } else { self.timeout };
        match self.client.sense(self.tick, timeout) {
            Some(sensing) => {
                self.silent = false;
                self.wrench = sensing.wrench.map(f64::from_bits);
                Ok(sensing.codes)
            }
            None => {
                self.silent = true;
                Err(Fault::NotEnded)
            }
        }
    }
}

impl Amplifiers for SimulatedDevices {
    /// Those of the largest converter; the controller keeps codes within its own.
    const BITS: u32 = 31;

    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        self.codes = *codes;
        self.client.actuate(self.tick, self.enabled, codes);
        Ok(())
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        self.enabled = on;
        self.client.actuate(self.tick, on, &self.codes);
        Ok(())
    }
}

/// The trigger outputs of a simulated machine drive nothing; they are only recorded.
impl Lines for SimulatedDevices {
    const COUNT: usize = LINES;
    const INPUT: bool = true;

    fn set(&mut self, _high: u32) -> Result<(), Fault> {
        Ok(())
    }

    /// High for half of the time between two edges.
    fn input(&mut self) -> Result<bool, Fault> {
        Ok(self.edges.is_some_and(|edges| self.tick >= edges && self.tick % edges < edges.div_ceil(2)))
    }
}

impl Device for SimulatedDevices {
    fn tick(&mut self, tick: u64) {
        self.tick = tick;
    }

    /// Nothing is wired to it.
    fn beat(&mut self) -> Result<Contacts, Fault> {
        Ok(Contacts::default())
    }

    fn wrench(&self) -> [f64; CHANNELS] {
        self.wrench
    }

    fn describe(&self) -> String {
        format!("simulated machine {}", self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
    use specgen_rt::exchange::{Actuation, Sensing, Server};
    use std::path::PathBuf;
    use std::sync::{Arc, Mutex};
    use std::thread::JoinHandle;

    const TIMEOUT: u64 = 50_000_000;

    /// The machine's side: publishes requested sensings until it is silenced.
    struct Machine {
        path: PathBuf,
        silent_from: Arc<AtomicU64>,
        ends: Arc<AtomicBool>,
        seen: Arc<Mutex<Vec<Actuation>>>,
        thread: Option<JoinHandle<()>>,
    }

    impl Machine {
        /// It answers after `delay`, ns.
        fn new(name: &str, delay: u64) -> Self {
            let path = std::env::temp_dir().join(format!("rt-pc-machine-{name}-{}", std::process::id()));
            let server = Server::create(&path, controller::SPEC_DIGEST).unwrap();
            let (silent_from, ends, seen) = (Arc::new(AtomicU64::new(u64::MAX)), Arc::default(), Arc::default());
            let (silence, end, log) = (Arc::clone(&silent_from), Arc::clone(&ends), Arc::<Mutex<Vec<_>>>::clone(&seen));
            let start = clock::now();
            let thread = std::thread::spawn(move || {
                let mut count = 0;
                while !AtomicBool::load(&end, Ordering::Relaxed) {
                    let Some((actuation, [session, tick])) = server.wait(&mut count, 0, 5_000_000) else { continue };
                    log.lock().unwrap().push(actuation);
                    clock::sleep_until(start + delay);
                    if tick < silence.load(Ordering::Relaxed) {
                        let codes = [1, 2, 3, 4, 5, tick as i32];
                        server.publish(&Sensing { session, tick, codes, wrench: [0.5_f64.to_bits(); 6] });
                    }
                }
            });
            Self { path, silent_from, ends, seen, thread: Some(thread) }
        }

        fn acts(&self) -> Vec<(u64, bool, [i32; CHANNELS])> {
            std::thread::sleep(std::time::Duration::from_millis(20));
            let seen = self.seen.lock().unwrap();
            let mut acts: Vec<_> = seen.iter().map(|act| (act.tick, act.enable, act.codes)).collect();
            acts.dedup();
            acts
        }
    }

    impl Drop for Machine {
        fn drop(&mut self) {
            self.ends.store(true, Ordering::Relaxed);
            if let Some(thread) = self.thread.take() {
                let _ = thread.join();
            }
        }
    }

    #[test]
    fn readings_are_those_of_their_tick_and_a_silent_machine_is_not_waited_for_twice() {
        let machine = Machine::new("read", 700_000_000);
        // Its first reading may take long.
        let mut device = SimulatedDevices::open(&machine.path, TIMEOUT, None).unwrap();
        assert_eq!((device.wrench(), device.beat()), ([0.0; CHANNELS], Ok(Contacts::default())));
        for tick in [0, 1, 5] {
            device.tick(tick);
            assert_eq!(device.read(), Ok([1, 2, 3, 4, 5, tick as i32]));
            assert_eq!(device.wrench(), [0.5; CHANNELS]);
        }
        machine.silent_from.store(6, Ordering::Relaxed);
        for (tick, waits) in [(6, true), (7, false)] {
            device.tick(tick);
            let start = clock::now();
            assert_eq!(device.read(), Err(Fault::NotEnded));
            assert_eq!(clock::now() - start >= TIMEOUT, waits);
        }
        machine.silent_from.store(u64::MAX, Ordering::Relaxed);
        device.tick(8);
        let answered = (0..1000).any(|_| {
            clock::sleep_until(clock::now() + 1_000_000);
            device.read().is_ok()
        });
        assert!(answered, "it answers again");
        machine.silent_from.store(0, Ordering::Relaxed);
        let start = clock::now();
        device.tick(9);
        assert!(device.read().is_err() && clock::now() - start >= TIMEOUT, "a machine that answered is waited for");
        assert_eq!(device.describe(), format!("simulated machine {}", machine.path.display()));
        assert_eq!(<SimulatedDevices as Gauges>::BITS, 17);
    }

    #[test]
    fn codes_and_the_enable_line_go_out_with_their_tick() {
        let machine = Machine::new("write", 0);
        let mut device = SimulatedDevices::open(&machine.path, TIMEOUT, None).unwrap();
        let mut expected = Vec::new();
        device.tick(3);
        device.write(&[9; CHANNELS]).unwrap();
        expected.push((3, false, [9; CHANNELS]));
        assert_eq!(machine.acts().last(), expected.last());
        device.enable(true).unwrap();
        assert_eq!(machine.acts().last(), Some(&(3, true, [9; CHANNELS])));
        device.tick(4);
        device.write(&[8; CHANNELS]).unwrap();
        assert_eq!(machine.acts().last(), Some(&(4, true, [8; CHANNELS])));
        device.enable(false).unwrap();
        assert_eq!(machine.acts().last(), Some(&(4, false, [8; CHANNELS])));
        assert_eq!(device.set(1), Ok(()));
    }

    #[test]
    fn the_input_line_is_high_for_half_of_the_time_behind_the_first_edge() {
        let machine = Machine::new("edges", 0);
        for (edges, high) in
            [(None, &[][..]), (Some(4), &[4, 5, 8, 9, 12, 13][..]), (Some(5), &[5, 6, 7, 10, 11, 12][..])]
        {
            let mut device = SimulatedDevices::open(&machine.path, TIMEOUT, edges).unwrap();
            let found: Vec<u64> = (0..14)
                .filter(|tick| {
                    device.tick(*tick);
                    device.input().unwrap()
                })
                .collect();
            assert_eq!(found, high, "{edges:?}");
        }
    }

    #[test]
    fn a_machine_of_another_spec_or_of_nobody_is_refused() {
        let path = std::env::temp_dir().join(format!("rt-pc-machine-other-{}", std::process::id()));
        let open = |path: &Path| SimulatedDevices::open(path, TIMEOUT, None).err().unwrap();
        assert!(open(&path).contains("no simulated machine there"));
        let other = Server::create(&path, "0123456789abcdef0123456789abcdef").unwrap();
        assert!(open(&path).contains("the machine of another spec"));
        drop(other);
        // What is left of a machine that has ended.
        let left = path.with_extension("left");
        let _ = std::fs::remove_file(&left);
        let server = Server::create(&path, controller::SPEC_DIGEST).unwrap();
        std::fs::hard_link(&path, &left).unwrap();
        drop(server);
        assert!(open(&left).contains("has ended; start `specgen plant` again"));
        std::fs::remove_file(&left).unwrap();
    }
}
