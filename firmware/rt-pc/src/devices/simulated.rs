//! The machine that `specgen plant` simulates, by shared memory.

use std::path::Path;

use controller::sensing::CONVERTER;
use controller::triggers::LINES;
use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};
use specgen_rt::clock;
use specgen_rt::exchange::Client;

use super::{Contacts, Device};

/// How long the first reading may take, ns: the machine may be pre-cycling.
const FIRST: u64 = 60_000_000_000;

pub struct Simulated {
    client: Client,
    path: String,
    tick: u64,
    /// How long a reading may take, ns. While the machine is silent it is not waited for.
    timeout: u64,
    silent: bool,
    wrench: [f64; CHANNELS],
    codes: [i32; CHANNELS],
    enabled: bool,
    /// Ticks from rising edge to rising edge of the input line; none without.
    edges: Option<u64>,
}

impl Simulated {
    /// Opens it and waits until it gives its first reading. Later ones may take `timeout`, ns. Its input line rises every `edges` ticks.
    ///
    /// # Errors
    /// In words: if there is no such machine, it is of another spec, or it does not answer.
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

impl Gauges for Simulated {
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

impl Amplifiers for Simulated {
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

/// A simulated machine has nothing that outputs lead to: they stand in the record.
impl Lines for Simulated {
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

impl Device for Simulated {
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
