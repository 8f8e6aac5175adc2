//! The supervisor: the runtime's constants, and others for controller and hosts.

use std::ops::Deref;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use specgen_runtime::supervisor;

use super::LEGS;
use super::scalar::{Constant, Written};

/// The supervisor.
#[derive(Debug, Clone, PartialEq)]
pub struct Supervision {
    /// The runtime's constants, without the wiring check.
    pub constants: supervisor::Supervision<f64>,
    /// State of the legs at rest; none if rest is the lowest voltage, which erases the history.
    pub risen: Option<Rest>,
    /// Ticks without a request over a link after which its host is lost.
    pub host_ticks: u32,
    /// Largest number of consecutive missed ticks without a fault.
    pub stall_ticks: u32,
    /// The wiring check; none if the spec switches it off.
    pub wiring: Option<Wiring>,
    /// Reading of each gauge (rows) per leg displacement (columns); none if each leg has its own gauge.
    pub readings_per_leg: Option<[[f64; 6]; LEGS]>,
    /// Without a set-point generator: remaining fraction of the distance to the set-point after a tick.
    pub approach_keep: f64,
}

/// The wiring check, and data with which hosts explain its findings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wiring {
    /// The runtime's constants.
    #[serde(flatten, serialize_with = "Constant::write")]
    pub constants: supervisor::Wiring<f64>,
    /// Sets of single faults that cannot be distinguished on this geometry, as words of [`specgen_runtime::supervisor::Finding`].
    pub alike: Vec<Vec<u32>>,
    /// Single faults that the check cannot detect, as such words.
    pub unseen: Vec<u32>,
    /// Simultaneous rotations of the connectors of gauges and of legs that the check cannot detect.
    pub turned: Vec<[usize; 2]>,
}

/// The legs at rest above the lowest voltage, after a rise from there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// Cells of the Everett grid.
    pub drive: f64,
    /// E(`drive`, 0) of each leg, m.
    pub displacement: [f64; LEGS],
    /// The same with the second weight of (6), m per cell per tick; zero in other models.
    pub rate: [f64; LEGS],
    /// With a Bouc-Wen state: the table's part of the displacement, and z, of each leg, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bouc_wen: Option<[[f64; 2]; LEGS]>,
    /// With plays that widen: p_i − u of each leg, cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plays: Option<Box<[Vec<f64>; LEGS]>>,
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
    /// Sets of faults that the wiring check cannot distinguish; empty without a check.
    pub fn alike(&self) -> &[Vec<u32>] {
        self.wiring.as_ref().map_or(&[], |wiring| &wiring.alike)
    }

    /// Writes the entries that follow a constant.
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
