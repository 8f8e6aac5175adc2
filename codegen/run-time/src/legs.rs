//! Six legs with their own gauges whose constants are read at run time.

use std::fmt::Debug;

use specgen_compiler::ir::{Ir, LEGS};
use specgen_law::legs::{self, Config, Lead, LegSpace, SixLegs, TickInput, TickOutput};
use specgen_law::{ConfigError, Reset, Spec, StateOf};
use specgen_runtime::snapshot::Sizes;
use specgen_runtime::supervisor::Supervision;
use specgen_runtime::{Dac, Permitted, Real};

use crate::InvalidIr;
use crate::common::{self, Common};
use crate::convert::Convert;
use crate::engine::Constants;
use crate::memory::{Memory, Table};
use crate::parts::Optional;

/// A way this short, m and rad, is none; as the emitted `APPROACH_NEGLIGIBLE`.
const APPROACH_NEGLIGIBLE: f64 = 1e-13;

/// The constants.
#[derive(Debug)]
pub struct LegConstants<T: Real> {
    common: Common<T>,
    /// Whether legs are asked to be ahead, for their dead time.
    led: bool,
    lead: T,
    lead_limit: T,
    gauge: [T; 2],
    leg_setpoint: [T; 2],
    leg_gain: T,
    period_seconds: f64,
    approach_keep: T,
    approach_negligible: T,
}

/// Them, for the law.
#[derive(Debug)]
pub struct LegSpec<T: Real>(&'static LegConstants<T>);

impl<T: Real> Clone for LegSpec<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real> Copy for LegSpec<T> {}

impl<T: Real> PartialEq for LegSpec<T> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl<T: Real + Debug> Spec for LegSpec<T> {
    type Real = T;
    type Law = LegSpace;
    type Table = Table<T>;
    type Memory = Memory<T>;

    #[inline(always)]
    fn tables(&self) -> &[Table<T>; LEGS] {
        &self.0.common.tables
    }

    #[inline(always)]
    fn dac(&self) -> &Dac<T> {
        &self.0.common.dac
    }

    #[inline(always)]
    fn supervision(&self) -> &Supervision<T> {
        &self.0.common.supervision
    }

    #[inline(always)]
    fn readings_per_leg(&self) -> &[[T; LEGS]; 6] {
        &self.0.common.readings_per_leg
    }

    #[inline(always)]
    fn geometry(&self) -> &specgen_runtime::Legs<'_, T> {
        &self.0.common.geometry
    }

    #[inline(always)]
    fn inverse_jacobian(&self) -> &[[T; LEGS]; 6] {
        &self.0.common.inverse_jacobian
    }

    #[inline(always)]
    fn corrections(&self) -> usize {
        self.0.common.corrections
    }

    #[inline(always)]
    fn pose_bound(&self) -> &[T; 6] {
        &self.0.common.pose_bound
    }

    #[inline(always)]
    fn permitted(&self) -> &[(Permitted<T>, usize)] {
        &self.0.common.permitted
    }

    #[inline(always)]
    fn sizes(&self) -> Sizes {
        self.0.common.sizes
    }

    fn reset(&self) -> Reset<Self> {
        let common = &self.0.common;
        Reset { memory: *common.memory, displacement: common.displacement, code: common.code }
    }
}

impl<T: Real + Debug> SixLegs for LegSpec<T> {
    type Lead = Optional<Lead<T, 1>>;

    #[inline(always)]
    fn lead(&self) -> T {
        self.0.lead
    }

    #[inline(always)]
    fn lead_limit(&self) -> T {
        self.0.lead_limit
    }

    #[inline(always)]
    fn gauge(&self) -> &[T; 2] {
        &self.0.gauge
    }

    #[inline(always)]
    fn leg_setpoint(&self) -> &[T; 2] {
        &self.0.leg_setpoint
    }

    #[inline(always)]
    fn leg_gain(&self) -> T {
        self.0.leg_gain
    }

    #[inline(always)]
    fn period_seconds(&self) -> f64 {
        self.0.period_seconds
    }

    #[inline(always)]
    fn approach_keep(&self) -> T {
        self.0.approach_keep
    }

    #[inline(always)]
    fn approach_negligible(&self) -> T {
        self.0.approach_negligible
    }
}

impl<T: Real + Debug + Send + Sync> Constants for LegSpec<T> {
    fn common(&self) -> &'static Common<T> {
        &self.0.common
    }

    fn read_config(self, words: &[u64]) -> Result<Config<Self>, ConfigError> {
        Config::read(self, words)
    }

    fn state_at_reset(self) -> StateOf<Self> {
        let mut state = legs::State::new(&self.reset());
        for leg in &mut state.legs {
            leg.lead.given = self.0.led;
        }
        state
    }

    fn step(self, config: &Config<Self>, state: &mut StateOf<Self>, input: &TickInput<Self>) -> TickOutput<Self> {
        legs::step(self, config, state, input)
    }

    fn words_per_leg(self, gauges: &[T; 6]) -> [[T; 6]; 6] {
        legs::sensing::words_per_leg(self, gauges)
    }
}

/// The constants of a compiled spec.
pub fn constants<T: Real + Debug>(ir: &Ir) -> Result<LegSpec<T>, InvalidIr> {
    let convert = &Convert::new();
    let (ticks, limit) = ir.hysteresis.lead.as_ref().map_or((0.0, 0.0), |lead| (lead.ticks, lead.limit));
    let constants = LegConstants {
        common: Common::new(ir, convert, [&legs::tick::INPUT_NAMES, &legs::tick::OUTPUT_NAMES])?,
        led: ir.hysteresis.lead.is_some(),
        lead: convert.real(ticks),
        lead_limit: convert.real(limit),
        gauge: convert.vector(&ir.bounds.sensor),
        leg_setpoint: convert.vector(&ir.bounds.leg),
        leg_gain: convert.real(ir.defaults.leg_gain),
        period_seconds: ir.defaults.period,
        approach_keep: convert.real(ir.supervision.approach_keep),
        approach_negligible: convert.real(APPROACH_NEGLIGIBLE),
    };
    convert.finish()?;
    Ok(LegSpec(common::constants(constants)))
}
