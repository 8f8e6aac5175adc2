//! Six legs with their own gauges whose constants are read at run time.

use specgen_compiler::constants::Numbers as _;
use specgen_compiler::ir::Ir;
use specgen_law::legs::{self, Lead, LegSpace, SixLegs, State};
use specgen_runtime::Real;

use crate::InvalidIr;
use crate::common::{AtRunTime, Common, Constants, Number, accessors};
use crate::convert::Convert;
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
    leg_setpoint: [T; 2],
    leg_gain: T,
    period_seconds: f64,
    approach_keep: T,
    approach_negligible: T,
}

impl<T: Number> SixLegs for AtRunTime<LegConstants<T>> {
    type Lead = Optional<Lead<T, 1>>;

    accessors! { constants =>
        lead -> T = constants.lead;
        lead_limit -> T = constants.lead_limit;
        leg_setpoint -> &[T; 2] = &constants.leg_setpoint;
        leg_gain -> T = constants.leg_gain;
        period_seconds -> f64 = constants.period_seconds;
        approach_keep -> T = constants.approach_keep;
        approach_negligible -> T = constants.approach_negligible;
    }
}

impl<T: Number> Constants for LegConstants<T> {
    type Real = T;
    type Law = LegSpace;

    fn common(&self) -> &Common<T> {
        &self.common
    }

    fn complete(&self, state: &mut State<AtRunTime<Self>>) {
        for leg in &mut state.legs {
            leg.lead.given = self.led;
        }
    }
}

/// The constants of a compiled spec.
pub fn constants<T: Number>(ir: &Ir) -> Result<LegConstants<T>, InvalidIr> {
    let convert = &Convert::new();
    let (ticks, limit) = ir.hysteresis.lead.as_ref().map_or((0.0, 0.0), |lead| (lead.ticks, lead.limit));
    let constants = LegConstants {
        common: Common::new(ir, convert, [&legs::tick::INPUT_NAMES, &legs::tick::OUTPUT_NAMES])?,
        led: ir.hysteresis.lead.is_some(),
        lead: convert.real(ticks),
        lead_limit: convert.real(limit),
        leg_setpoint: convert.vector(&ir.bounds.leg),
        leg_gain: convert.real(ir.defaults.leg_gain),
        period_seconds: ir.defaults.period,
        approach_keep: convert.real(ir.supervision.approach_keep),
        approach_negligible: convert.real(APPROACH_NEGLIGIBLE),
    };
    convert.finish()?;
    Ok(constants)
}
