//! The supervisor: the runtime's own constants, and what a controller and its hosts need beside them.

use std::ops::Deref;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use specgen_runtime::supervisor;

use super::LEGS;
use super::scalar::{Constant, Written};

/// The supervisor.
#[derive(Debug, Clone, PartialEq)]
pub struct Supervision {
    /// As the runtime has them, but for the wiring check, which is none here.
    pub constants: supervisor::Supervision<f64>,
    /// How the legs stand at rest; none at the lowest voltage, where every history is forgotten.
    pub risen: Option<Rest>,
    /// Ticks without a request over a link after which its host is lost.
    pub host_ticks: u32,
    /// Missed ticks in a row of which more are a fault.
    pub stall_ticks: u32,
    /// The wiring check; none where the spec switches it off.
    pub wiring: Option<Wiring>,
    /// Reading of each gauge (rows) per leg displacement (columns); none where each leg has its own gauge.
    pub readings_per_leg: Option<[[f64; 6]; LEGS]>,
    /// What is left of the way to the set-point after a tick, where there is no generator.
    pub approach_keep: f64,
}

/// The wiring check, and what hosts say of findings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wiring {
    /// As the runtime has them.
    #[serde(flatten, serialize_with = "Constant::write")]
    pub constants: supervisor::Wiring<f64>,
    /// Sets of single faults that look alike on this geometry, as words of [`specgen_runtime::supervisor::Finding`].
    pub alike: Vec<Vec<u32>>,
    /// Single faults that the check lets pass, as such words.
    pub unseen: Vec<u32>,
    /// Places by which the connectors of gauges and of legs may be turned at once without the check seeing it.
    pub turned: Vec<[usize; 2]>,
}

/// The legs at rest above the lowest voltage, risen to it from there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// Cells of the Everett grid.
    pub drive: f64,
    /// E(`drive`, 0) of each leg, m.
    pub displacement: [f64; LEGS],
    /// The same of the second weight of (6), m per cell a tick; zero in other models.
    pub rate: [f64; LEGS],
}

impl Deref for Supervision {
    type Target = supervisor::Supervision<f64>;

    fn deref(&self) -> &Self::Target {
        &self.constants
    }
}

impl Deref for Wiring {
    type Target = supervisor::Wiring<f64>;

    fn deref(&self) -> &Self::Target {
        &self.constants
    }
}

impl Supervision {
    /// Sets of faults that look alike to the wiring check; none where there is no check.
    #[must_use]
    pub fn alike(&self) -> &[Vec<u32>] {
        self.wiring.as_ref().map_or(&[], |wiring| &wiring.alike)
    }

    /// Writes what stands behind a constant.
    fn write_behind<M: SerializeMap>(&self, constant: &str, map: &mut M) -> Result<(), M::Error> {
        match (constant, &self.risen, &self.wiring) {
            ("rest", Some(risen), _) => map.serialize_entry("risen", risen),
            ("ramp_every", ..) => {
                map.serialize_entry("host_ticks", &self.host_ticks)?;
                map.serialize_entry("stall_ticks", &self.stall_ticks)
            }
            ("wiring", _, Some(wiring)) => map.serialize_entry("wiring", wiring),
            _ => Ok(()),
        }
    }
}

macro_rules! serialized {
    ($name:ident: $($field:ident)+) => {
        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                $(
                    if stringify!($field) != "wiring" {
                        map.serialize_entry(stringify!($field), &Written(&self.constants.$field))?;
                    }
                    self.write_behind(stringify!($field), &mut map)?;
                )+
                if let Some(rows) = &self.readings_per_leg {
                    map.serialize_entry("readings_per_leg", rows)?;
                }
                map.serialize_entry("approach_keep", &self.approach_keep)?;
                map.end()
            }
        }
    };
}
specgen_runtime::supervision_fields!(serialized);
