//! What the gauges see: six legs at rest, or the machine that `specgen plant` serves in another process.

use std::path::Path;

use specgen_rt::exchange::{CHANNELS, Client, path_of};

use crate::time::Time;

/// How long a reading may take, ns: at first the machine may be pre-cycling.
const LIMIT: u64 = 60_000_000_000;

pub enum Plant {
    /// Every gauge in the middle of its range.
    Still,
    /// A served one.
    Served(BoardServer),
}

pub struct BoardServer {
    client: Client,
    /// Control period.
    period: Time,
    /// Time of the first reading, which is tick 0, and the latest.
    first: Option<Time>,
    tick: u64,
    /// Whether codes went out in it: the machine then stands at the next.
    over: bool,
}

impl Plant {
    /// The machine of this name, of the spec with this digest.
    ///
    /// # Errors
    /// In words: there is none.
    pub fn served(name: &str, digest: &str, period: Time) -> Result<Self, String> {
        let path = path_of(name)?;
        let client = Client::open(Path::new(&path), digest).map_err(|error| error.to_string())?;
        Ok(Self::Served(BoardServer { client, period, first: None, tick: 0, over: false }))
    }

    /// Codes of `bits` bits, 0 at the lower end of the range.
    pub fn sample(&mut self, now: Time, bits: u32) -> Result<[u32; CHANNELS], String> {
        match self {
            Self::Still => Ok([1 << (bits - 1); CHANNELS]),
            Self::Served(served) => {
                let first = *served.first.get_or_insert(now);
                let tick = (now - first + served.period / 2) / served.period;
                // Two within one period, where the second began late and the first early: the machine goes on in whole ones.
                served.tick = tick.max(served.tick + u64::from(served.over));
                served.over = false;
                let sensed = served.client.sense(served.tick, LIMIT);
                let sensed = sensed.ok_or("the plant does not answer; is `specgen plant` still running?")?;
                Ok(sensed.codes.map(|code| code.max(0) as u32))
            }
        }
    }

    /// Amplifiers and codes from now on.
    pub fn actuate(&mut self, enable: bool, codes: [u16; CHANNELS]) {
        if let Self::Served(served) = self {
            served.over = true;
            served.client.actuate(served.tick, enable, &codes.map(i32::from));
        }
    }
}
