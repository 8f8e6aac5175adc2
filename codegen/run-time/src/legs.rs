//! Six legs with their own gauges, with constants at run time.

use specgen_ir::scalar::Numbers as _;
use specgen_ir::{self as ir, Ir};
use specgen_law::legs::{Change, Lead, LegSpace, SixLegs, State};
use specgen_runtime::Real;

use crate::InvalidIr;
use crate::common::{AtRunTime, Common, Constants, Number, law_constants};
use crate::convert::Convert;
use crate::parts::Optional;

/// Negligible distance of an approach, m and rad; as the emitted `APPROACH_NEGLIGIBLE`.
const APPROACH_NEGLIGIBLE: f64 = 1e-13;

law_constants! {
    /// The constants.
    LegConstants: SixLegs {
        type Lead = Optional<Lead<T, 1>>;
        type Change = Optional<Change<T, 1>>;
    }
    of (convert, ir: &Ir, asked: Option<&ir::Lead>);
    own led: bool = asked.is_some();
    own bent: bool = asked.is_some_and(|lead| lead.resonance.is_some());
    copy lead: T = convert.real(asked.map_or(0.0, |lead| lead.ticks));
    copy lag: T = convert.real(resonance(asked).lag);
    copy bend: T = convert.real(resonance(asked).bend);
    copy gain_growth: T = convert.real(resonance(asked).gain_growth);
    copy lead_limit: T = convert.real(asked.map_or(0.0, |lead| lead.limit));
    lend leg_setpoint: [T; 2] = convert.vector(&ir.bounds.leg);
    copy leg_gain: T = convert.real(ir.defaults.leg_gain);
    copy period_seconds: f64 = ir.defaults.period;
    copy approach_keep: T = convert.real(ir.supervision.approach_keep);
    copy approach_negligible: T = convert.real(APPROACH_NEGLIGIBLE);
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
            leg.change.given = self.bent;
        }
    }
}

/// That of `lead`, or none.
fn resonance(lead: Option<&ir::Lead>) -> ir::Resonance {
    lead.and_then(|lead| lead.resonance.clone()).unwrap_or_default()
}

/// The constants of a compiled spec.
pub fn constants<T: Number>(ir: &Ir) -> Result<LegConstants<T>, InvalidIr> {
    let convert = &Convert::new();
    let common = Common::new(ir, convert)?;
    let made = LegConstants::new(common, convert, ir, ir.hysteresis.lead.as_ref())?;
    convert.finish()?;
    Ok(made)
}
