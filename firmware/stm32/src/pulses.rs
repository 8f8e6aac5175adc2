//! CONVST and LDAC from a timer: the instants of sampling and output do not depend on delays of the program.
//!
//! TIM2 triggers this timer when a tick is due ([`crate::timer`]): it counts once from 0 to its end and stops. CONVST rises at count
//! 1 and is low otherwise. LDAC is low from the output instant to the end, if the codes were written by then; if they are late, the
//! program generates the pulse.
//!
//! ```text
//! TIM2   ──┤ due                                        interrupt: tick
//! CONVST ___/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\_____
//! LDAC   ‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\__/‾‾‾‾‾   only where armed
//!           1                            output end
//! ```

use cortex_m::asm;
use specgen_board::PERIOD_NANOSECONDS;
use specgen_hal::{Edge, Fault};
use stm32_metapac::timer::TimGp16;
use stm32_metapac::timer::vals::{Mms, Sms, Ts};

/// Width of the LDAC pulse, ns: the AD5686R needs 15.
const LOW: u32 = 50;
/// With less time left until the output instant, ns, the program generates LDAC itself: arming takes that long.
const MARGIN: u32 = 150;
/// Polls of the timer before waiting for LDAC times out: more than the longest time to the output instant.
const LOOKS: u32 = 10_000;

/// OCxM: the channel is inactive, active, active from its compare value on. As numbers, because each family has its own type.
const INACTIVE: u32 = 4;
const ACTIVE: u32 = 5;
const FROM_COMPARE: u32 = 7;

/// A timer of 16 bits whose trigger ITR1 is TIM2.
#[derive(Clone, Copy)]
pub struct Pulses(TimGp16);

/// Generates the edge of CONVST.
pub struct Sampling(Pulses);

/// Generates LDAC on this channel of the timer, counted from 0.
pub struct Output<const CHANNEL: usize> {
    pulses: Pulses,
    /// Count of the output instant, and of the margin before it.
    at: u16,
    margin: u16,
    /// Whether the timer will generate it.
    armed: bool,
}

impl Pulses {
    /// A timer that runs at `hertz`, with outputs `nanoseconds` after sampling, or sooner in a short control period, so that an
    /// eighth of the period remains. Both lines are idle; the pins are connected after this.
    #[must_use]
    pub fn edges<const SAMPLING: usize, const OUTPUT: usize>(
        timer: TimGp16,
        hertz: u32,
        nanoseconds: u32,
    ) -> (Sampling, Output<OUTPUT>) {
        let longest = PERIOD_NANOSECONDS / 8 * 7;
        let until = if nanoseconds < longest { nanoseconds } else { longest };
        // Time starts with CONVST, at count one.
        let counts =
            |time: u32| u16::try_from(u64::from(time) * u64::from(hertz) / 1_000_000_000 + 1).unwrap_or(u16::MAX);
        let (at, low) = (counts(until), counts(LOW));
        let pulses = Self(timer);
        timer.cr1().write(|w| w.set_opm(true));
        timer.arr().write(|w| w.set_arr(at.saturating_add(low)));
        timer.ccr(SAMPLING).write(|w| w.set_ccr(1));
        timer.ccr(OUTPUT).write(|w| w.set_ccr(at));
        pulses.mode::<SAMPLING>(FROM_COMPARE);
        pulses.mode::<OUTPUT>(INACTIVE);
        timer.ccer().write(|w| {
            w.set_cce(SAMPLING, true);
            w.set_cce(OUTPUT, true);
            w.set_ccp(OUTPUT, true);
        });
        pulses.follow(true);
        (Sampling(pulses), Output { pulses, at, margin: counts(MARGIN), armed: false })
    }

    #[inline]
    fn mode<const CHANNEL: usize>(self, mode: u32) {
        let place = if CHANNEL % 2 == 0 { 4 } else { 12 };
        self.0.ccmr_output(CHANNEL / 2).modify(|w| w.0 = w.0 & !(7 << place) | mode << place);
    }

    /// Whether TIM2 starts it.
    fn follow(self, follows: bool) {
        self.0.smcr().write(|w| {
            w.set_ts(Ts::ITR1);
            w.set_sms(if follows { Sms::TRIGGER_MODE } else { Sms::DISABLED });
        });
    }

    #[inline]
    fn runs(self) -> bool {
        self.0.cr1().read().cen()
    }
}

impl Edge for Sampling {
    /// Starts the timer if TIM2 has not started it in this tick.
    #[inline]
    fn give(&mut self) -> Result<(), Fault> {
        if !self.0.runs() {
            self.0.follow(true);
            self.0.0.cr1().write(|w| {
                w.set_opm(true);
                w.set_cen(true);
            });
        }
        Ok(())
    }

    fn hold(&mut self) {
        self.0.follow(false);
        self.0.0.cr1().write(|w| w.set_opm(true));
        self.0.0.cnt().write(|w| w.set_cnt(0));
    }
}

impl<const CHANNEL: usize> Output<CHANNEL> {
    /// Whether the output instant has passed since arming.
    #[inline]
    fn is_out(&self) -> bool {
        self.pulses.0.sr().read().ccif(CHANNEL)
    }

    #[inline]
    fn now(&mut self) {
        self.pulses.mode::<CHANNEL>(ACTIVE);
        asm::dsb();
        // Reading the register back takes longer than the pulse needs.
        self.pulses.mode::<CHANNEL>(INACTIVE);
    }
}

impl<const CHANNEL: usize> Edge for Output<CHANNEL> {
    #[inline]
    fn give(&mut self) -> Result<(), Fault> {
        let timer = self.pulses.0;
        // In this order: if the count has wrapped to 0, the timer has stopped.
        let count = timer.cnt().read().cnt();
        self.armed = self.pulses.runs() && count.saturating_add(self.margin) < self.at;
        if self.armed {
            // Writing 0 clears a flag, 1 leaves it.
            timer.sr().write(|w| {
                w.0 = u32::MAX;
                w.set_ccif(CHANNEL, false);
            });
            self.pulses.mode::<CHANNEL>(FROM_COMPARE);
        } else {
            self.now();
        }
        Ok(())
    }

    #[inline]
    fn hold(&mut self) {
        if self.armed {
            self.armed = false;
            if self.is_out() { self.pulses.mode::<CHANNEL>(INACTIVE) } else { self.now() }
        }
    }

    fn settle(&mut self) {
        for _ in 0..LOOKS {
            if !self.armed || self.is_out() {
                return;
            }
        }
    }
}

/// TIM2 triggers at each tick.
pub(crate) const LEADS: Mms = Mms::COMPARE_PULSE;
