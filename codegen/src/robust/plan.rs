//! Which machines are tried: the nominal one, corners, random draws.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Serialize;

use super::deviation::Deviation;
use super::factors::{Factor, Factors};

/// With so many factors or fewer, every combination of their ends is a corner.
const FACTORIAL: usize = 4;
/// Apart from the streams of noise, tolerances and deviations.
const STREAM: u64 = 22;

/// One machine of a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Member {
    /// `nominal`, of a corner such as `mass-low`, or the seed of a draw.
    pub name: String,
    /// Seed of the noise; of a draw of everything.
    pub seed: u64,
    /// Whether it was drawn.
    pub drawn: bool,
    /// What it is.
    pub deviation: Deviation,
}

/// All of them, in the order in which they are reported.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal machine first, then corners, then draws.
    pub members: Vec<Member>,
}

impl Plan {
    /// The nominal machine, corners with the noise of `seed`, and `samples` draws whose seeds come from `seed`.
    #[must_use]
    pub fn new(factors: &Factors, samples: u32, seed: u64) -> Self {
        let mut members = corners(factors, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAM);
        // 53 bits, which every reader of JSON keeps.
        members.extend((0..samples).map(|_| draw(factors, rng.next_u64() >> 11)));
        Self { members }
    }

    /// One member alone: a draw by its seed, or the nominal machine or a corner by its name.
    ///
    /// # Errors
    /// If nothing is called so: what there is.
    pub fn alone(factors: &Factors, name: &str, seed: u64) -> Result<Self, String> {
        if let Ok(seed) = name.parse() {
            return Ok(Self { members: vec![draw(factors, seed)] });
        }
        let corners = corners(factors, seed);
        match corners.iter().find(|corner| corner.name == name) {
            Some(corner) => Ok(Self { members: vec![corner.clone()] }),
            None => {
                let names: Vec<&str> = corners.iter().map(|corner| corner.name.as_str()).collect();
                Err(format!("no machine is called `{name}`; name the seed of a draw, or one of {}", names.join(", ")))
            }
        }
    }
}

fn draw(factors: &Factors, seed: u64) -> Member {
    Member { name: seed.to_string(), seed, drawn: true, deviation: Deviation::drawn(factors, seed) }
}

/// The end of a factor's range that brings the loop nearer to its edge: more gain, more delay, less damping. Mass and
/// stiffness move the modes, for which both directions are tried.
fn bad_end(factor: Factor, stiff: bool) -> usize {
    match factor {
        Factor::Damping => 0,
        Factor::Mass => usize::from(!stiff),
        Factor::Stiffness => usize::from(stiff),
        _ => 1,
    }
}

fn corners(factors: &Factors, seed: u64) -> Vec<Member> {
    let mut members: Vec<Member> = Vec::new();
    let mut add = |name: String, deviation: Deviation| {
        // An end that is nominal, or a combination that is one end alone, is not tried twice.
        if members.iter().all(|other| other.deviation != deviation) {
            members.push(Member { name, seed, drawn: false, deviation });
        }
    };
    add("nominal".to_owned(), Deviation::common(Factor::nominal));
    let mut varied = Vec::new();
    for one in factors.iter() {
        let [low, high] = one.range;
        for (end, value) in [("low", low), ("high", high)] {
            let value = |factor: Factor| if factor == one.factor { value } else { factor.nominal() };
            add(format!("{}-{end}", one.factor), Deviation::common(value));
        }
        if high > low {
            varied.push(one.factor);
        }
    }
    // What is known and differs from 1 is so in every combination.
    if varied.len() <= FACTORIAL {
        for combination in 0..1_usize << varied.len() {
            let end = |factor: Factor| {
                let place = varied.iter().position(|other| *other == factor);
                place.map_or(0, |place| combination >> place & 1)
            };
            let parts: Vec<String> = varied
                .iter()
                .map(|factor| format!("{factor}-{}", if end(*factor) == 1 { "high" } else { "low" }))
                .collect();
            let name = if parts.is_empty() { "all".to_owned() } else { parts.join("+") };
            add(name, Deviation::common(|factor| factors.range(factor)[end(factor)]));
        }
    } else {
        for (name, stiff) in [("all-soft", false), ("all-stiff", true)] {
            add(name.to_owned(), Deviation::common(|factor| factors.range(factor)[bad_end(factor, stiff)]));
        }
    }
    members
}
