//! The machines of a study: nominal, corners, random.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use super::deviation::Deviation;
use super::factors::{Factor, Factors};
use crate::machine::StructureShares;

/// Up to this number of varied factors, every combination of their limits is a corner.
const FACTORIAL: usize = 4;
/// Separates its random numbers from those of noise, tolerances and deviations.
const STREAM: u64 = 22;

/// One machine of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// `nominal`, the name of a corner such as `mass-low`, or the seed of a random machine.
    pub name: String,
    /// Seed of the noise; for a random machine of everything.
    pub seed: u64,
    /// Whether it is a random machine.
    pub drawn: bool,
    /// Its deviation from nominal.
    pub deviation: Deviation,
}

/// All machines, in the order of reports.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The nominal machine, then corners, then random machines.
    pub members: Vec<Member>,
}

impl Plan {
    /// The nominal machine, corners with the noise of `seed`, and `samples` random machines with seeds from `seed`.
    pub fn new(factors: &Factors, samples: u32, seed: u64) -> Self {
        let mut members = corners(factors, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAM);
        // 53 bits, which every JSON reader preserves.
        members.extend((0..samples).map(|_| draw(factors, rng.next_u64() >> 11)));
        Self { members }
    }

    /// A single member: a random machine by its seed, or the nominal machine or a corner by its name.
    ///
    /// # Errors
    /// If there is no such machine; lists the existing names.
    pub fn alone(factors: &Factors, name: &str, seed: u64) -> Result<Self, String> {
        if let Ok(seed) = name.parse() {
            return Ok(Self { members: vec![draw(factors, seed)] });
        }
        let corners = corners(factors, seed);
        match corners.iter().find(|corner| corner.name == name) {
            Some(corner) => Ok(Self { members: vec![corner.clone()] }),
            None => {
                let names: Vec<&str> = corners.iter().map(|corner| corner.name.as_str()).collect();
                Err(format!(
                    "no machine is called `{name}`; give the seed of a random machine, or one of {}",
                    names.join(", ")
                ))
            }
        }
    }
}

fn draw(factors: &Factors, seed: u64) -> Member {
    Member { name: seed.to_string(), seed, drawn: true, deviation: Deviation::drawn(factors, seed) }
}

/// The limit of a factor's range that brings the loop closer to instability: more gain, more delay, less damping. Mass and
/// stiffness shift the modes, so both directions are tried.
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
        // Skips corners equal to an earlier one, such as a limit that is nominal.
        if members.iter().all(|other| other.deviation != deviation) {
            members.push(Member { name, seed, drawn: false, deviation });
        }
    };
    add("nominal".to_owned(), Deviation::common(Factor::nominal));
    let kinds = factors.range(Factor::Structure)[1] as usize;
    let structures = (0..kinds).map(|kind| (format!("structure-{}", kind + 1), StructureShares::worst(kind, kinds)));
    let structures: Vec<(String, StructureShares)> = structures.collect();
    for (name, shares) in &structures {
        add(name.clone(), Deviation { structure: Some(*shares), ..Deviation::common(Factor::nominal) });
    }
    let mut varied = Vec::new();
    for one in factors.iter() {
        let [low, high] = one.range;
        let alone =
            |value: f64| Deviation::common(|factor| if factor == one.factor { value } else { factor.nominal() });
        if high > low && one.factor != Factor::Structure {
            varied.push(one.factor);
            add(format!("{}-low", one.factor), alone(low));
            add(format!("{}-high", one.factor), alone(high));
        } else {
            add(one.factor.to_string(), alone(low));
        }
    }
    // Without a structural mode, and with each.
    let mut add = |name: String, deviation: Deviation| {
        add(name.clone(), deviation);
        for (structure, shares) in &structures {
            add(format!("{name}+{structure}"), Deviation { structure: Some(*shares), ..deviation });
        }
    };
    // A known deviation (without a range) is part of every combination.
    if varied.len() + usize::from(kinds > 0) <= FACTORIAL {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::StructureRange;
    use crate::robust::factors::UserRange;
    use host_sim::platform::{Imperfections, ModePlace, StructuralMode};
    use specgen_compiler::compile::compile;

    /// Factors of the spec of six legs, with `given` in place of its own.
    fn factors(given: &[&str]) -> Factors {
        factors_of("legs.toml", given)
    }

    fn factors_of(spec: &str, given: &[&str]) -> Factors {
        let spec = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs").join(spec);
        let given: Vec<UserRange> = given.iter().map(|text| UserRange::parse(text).unwrap()).collect();
        Factors::of(&compile(&spec).unwrap().model, &given)
    }

    fn names(plan: &Plan) -> Vec<&str> {
        plan.members.iter().filter(|member| !member.drawn).map(|member| member.name.as_str()).collect()
    }

    #[test]
    fn random_machines_fill_their_ranges_and_can_be_drawn_individually() {
        let factors = factors(&["delay_ticks=2", "gauge_lag=20%"]);
        let plan = Plan::new(&factors, 300, 7);
        let draws: Vec<&Member> = plan.members.iter().filter(|member| member.drawn).collect();
        assert_eq!(draws.len(), 300);
        let fills = |factor: Factor, of: &dyn Fn(&Deviation) -> f64| {
            let [low, high] = factors.range(factor);
            let values: Vec<f64> = draws.iter().map(|member| of(&member.deviation)).collect();
            assert!(values.iter().all(|value| *value >= low && *value <= high), "{factor}");
            let within = |part: f64| low + part * (high - low);
            assert!(values.iter().any(|v| *v < within(0.03)) && values.iter().any(|v| *v > within(0.97)), "{factor}");
            let mean = values.iter().sum::<f64>() / 300.0;
            // Five standard deviations of the mean of 300 uniform numbers; an integer from 0 to 2 spreads a little more.
            assert!((mean - within(0.5)).abs() < 5.0 * 0.41 / 300_f64.sqrt() * (high - low), "{factor} {mean}");
        };
        fills(Factor::Mass, &|d| d.mass);
        fills(Factor::Damping, &|d| d.damping);
        fills(Factor::Noise, &|d| d.noise);
        fills(Factor::DelayTicks, &|d| f64::from(d.delay_ticks));
        for leg in 0..6 {
            fills(Factor::Stiffness, &|d| d.legs[leg].stiffness);
            fills(Factor::Gain, &|d| d.legs[leg].gain);
            fills(Factor::Hysteresis, &|d| d.legs[leg].hysteresis);
            fills(Factor::Creep, &|d| d.legs[leg].creep);
            fills(Factor::Lag, &|d| d.legs[leg].lag);
            fills(Factor::GaugeLag, &|d| d.legs[leg].gauge_lag);
        }
        for (index, member) in draws.iter().enumerate() {
            assert!(draws[..index].iter().all(|other| other.seed != member.seed));
            assert!(member.deviation.legs.windows(2).all(|pair| pair[0] != pair[1]));
            assert_eq!(Plan::alone(&factors, &member.name, 99).unwrap().members, [(*member).clone()]);
        }
        assert_ne!(plan, Plan::new(&factors, 300, 8));
    }

    #[test]
    fn structure_is_drawn_after_everything_else_and_fills_its_ranges() {
        let [plain, structured] = [vec![], vec!["structure=1"]].map(|given| {
            let mut plan = Plan::new(&factors_of("reference.toml", &given), 300, 7);
            plan.members.retain(|member| !member.name.contains("structure"));
            plan
        });
        assert_eq!(Plan::new(&factors(&["structure=1"]), 30, 7), Plan::new(&factors(&[]), 30, 7), "six legs have none");
        let range = StructureRange {
            from_hz: 900.0,
            to_hz: 5000.0,
            damping_ratio: [0.01, 0.03],
            kinds: vec![
                (ModePlace::Leg(None), None),
                (ModePlace::Gauge(None), Some(0.5)),
                (ModePlace::Frame, Some(-0.1)),
            ],
        };
        let mut modes = Vec::new();
        assert_eq!(plain.members.len(), structured.members.len());
        for (plain, structured) in plain.members.iter().zip(&structured.members) {
            let bare = Deviation { structure: None, ..structured.deviation };
            assert_eq!(plain, &Member { deviation: bare, ..structured.clone() });
            assert_eq!(structured.deviation.structure.is_some(), structured.drawn);
            let Some(shares) = structured.deviation.structure else { continue };
            let mut machine = Imperfections::default();
            shares.add_to(&mut machine, &range);
            assert!(machine.joint_stiffness_share <= 0.05 && machine.mains[0].amplitude_m <= 2e-9, "{machine:?}");
            assert!(machine.gauge_drift_m_per_s.iter().all(|drift| drift.abs() <= 20e-9), "{machine:?}");
            assert!(machine.mains[0].gauge.is_some_and(|gauge| (1..=6).contains(&gauge)), "{machine:?}");
            modes.extend(machine.modes);
        }
        assert_eq!(modes.len(), 300);
        // 100 of each kind; the median of a logarithmic range is its geometric mean.
        for (place, participation) in range.kinds {
            let some = modes.iter().filter(|mode| mode.place == place && mode.participation == participation).count();
            assert!((60..140).contains(&some), "{place}: {some}");
        }
        let median = |of: &dyn Fn(&StructuralMode) -> f64, low: f64, high: f64| {
            let mut values: Vec<f64> = modes.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            assert!(values[0] >= low && values[0] < 1.1 * low && values[299] <= high && values[299] > 0.9 * high);
            values[150] / (low * high).sqrt()
        };
        assert!((0.85..1.18).contains(&median(&|mode| mode.frequency_hz, 900.0, 5000.0)));
        assert!((0.85..1.18).contains(&median(&|mode| mode.damping_ratio, 0.01, 0.03)));
    }

    #[test]
    fn corners_are_the_limits_of_each_factor_and_two_worst_cases() {
        let plan = Plan::new(&factors(&["delay_ticks=0", "creep=1:1", "lag=1.5:1.5"]), 1, 1);
        let names = names(&plan);
        assert_eq!(names[..3], ["nominal", "mass-low", "mass-high"]);
        assert_eq!(names[names.len() - 3..], ["noise-high", "all-soft", "all-stiff"]);
        // A nominal limit has no corner; a known deviation has one.
        assert!(names.contains(&"lag") && !names.iter().any(|name| name.contains("delay") || name.contains("creep")));
        let soft = &plan.members.iter().find(|member| member.name == "all-soft").unwrap().deviation;
        assert_eq!((soft.mass, soft.damping, soft.legs[3].stiffness, soft.legs[3].lag), (1.05, 0.7, 0.95, 1.5));
        assert_eq!(soft.legs[0].gain, 1.1);
    }

    #[test]
    fn a_corner_may_have_one_structural_mode_at_its_lowest_frequency_and_least_damping() {
        let factors = factors_of("reference.toml", &["structure=1"]);
        assert_eq!(factors.range(Factor::Structure), [1.0, 3.0]);
        let plan = Plan::new(&factors, 0, 1);
        let kinds = [ModePlace::Leg(None), ModePlace::Gauge(None), ModePlace::Frame];
        let participations = [None, Some(0.5), Some(-0.1)];
        let range = StructureRange {
            from_hz: 900.0,
            to_hz: 5000.0,
            damping_ratio: [0.01, 0.03],
            kinds: kinds.into_iter().zip(participations).collect(),
        };
        for corner in ["nominal", "all-soft", "all-stiff"] {
            let plain = plan.members.iter().find(|member| member.name == corner).unwrap();
            for (number, (place, participation)) in (1..).zip(range.kinds.clone()) {
                let name = if corner == "nominal" { String::new() } else { format!("{corner}+") };
                let name = format!("{name}structure-{number}");
                let member = plan.members.iter().find(|member| member.name == name).unwrap();
                assert_eq!(Deviation { structure: None, ..member.deviation }, plain.deviation, "{name}");
                let mut machine = Imperfections::default();
                member.deviation.structure.unwrap().add_to(&mut machine, &range);
                let expected = StructuralMode { place, frequency_hz: 900.0, damping_ratio: 0.01, participation };
                assert_eq!(machine.modes, [expected], "{name}");
                assert!(machine.mains[0].amplitude_m == 0.0 && machine.gauge_drift_m_per_s == [0.0; 6], "{name}");
            }
        }
        assert_eq!(plan.members.iter().filter(|member| member.deviation.structure.is_some()).count(), 9);
    }

    #[test]
    fn with_few_factors_every_combination_is_a_corner_once() {
        let fixed = ["mass=1:1", "stiffness=1:1", "damping=1:1", "creep=1:1", "lag=1:1", "noise=1:1", "delay_ticks=0"];
        let plan = Plan::new(&factors(&fixed), 1, 1);
        let expected = [
            "nominal",
            "gain-low",
            "gain-high",
            "hysteresis-low",
            "hysteresis-high",
            "gain-low+hysteresis-low",
            "gain-high+hysteresis-low",
            "gain-low+hysteresis-high",
            "gain-high+hysteresis-high",
        ];
        assert_eq!(names(&plan), expected);
        let error = Plan::alone(&factors(&fixed), "gain", 1).unwrap_err();
        assert!(error.contains("one of nominal, gain-low"), "{error}");
    }
}
