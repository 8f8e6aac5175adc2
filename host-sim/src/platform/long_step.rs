//! A long step of the plant, legs in lanes: used by simulations.
//!
//! The same equations as the plant of small steps. Effects that a step of 20 µs may neglect are included: the shape of
//! free displacements within a step from the amplifiers' lag and current limit, and plays that start late in it
//! ([`StructureLanes`], [`Actuators`]). `tests/tests/platform_tables/steps.rs` compares the tables with those of small
//! steps.
//!
//! The step is compiled a second time for AVX2, whose additions and multiplications give the same bits: nothing is
//! fused, sums keep their written order.
// Unsafe: the call of that second version, after a check that the processor supports it.
#![allow(unsafe_code)]

use super::linear::{LANES, Lane, Six, lanes_of};
use super::structure::StructureLanes;
use crate::plant::Actuators;

/// Holds six voltages (V) for a step. `rest` are the free displacements at rest, µm; returns those since rest, m.
pub(super) fn advance(
    actuators: &mut Actuators<LANES>,
    structure: &mut StructureLanes,
    rest: &Lane,
    voltages: &Six,
) -> Lane {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor supports the instructions of the function.
        return unsafe { advance_avx2(actuators, structure, rest, voltages) };
    }
    advance_anywhere(actuators, structure, rest, voltages)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn advance_avx2(actuators: &mut Actuators<LANES>, structure: &mut StructureLanes, rest: &Lane, voltages: &Six) -> Lane {
    advance_anywhere(actuators, structure, rest, voltages)
}

#[inline(always)]
pub(super) fn advance_anywhere(
    actuators: &mut Actuators<LANES>,
    structure: &mut StructureLanes,
    rest: &Lane,
    voltages: &Six,
) -> Lane {
    let mut free = actuators.advance_long(&lanes_of(voltages));
    for k in 0..LANES {
        free.end[k] = (free.end[k] - rest[k]) * 1e-6;
        free.mean[k] *= 1e-6;
        free.skew[k] *= 1e-6;
    }
    structure.advance(&free);
    free.end
}
