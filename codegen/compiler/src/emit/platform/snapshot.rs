//! `src/snapshot.rs` of a platform: how its state, and what a tick reads, become words.

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::snapshot;

pub fn emit() -> TokenStream {
    let imports = quote! {
        use specgen_runtime::setpoint::{CommandKind, Generator};
        use specgen_runtime::snapshot::{LARGEST, LARGEST_PLACE};
        use specgen_runtime::{ControlMode, Estimate, Integral, Interaction, NotchState, Rate, Transfer};
    };
    let input = quote! {
        words.word(match input.tick.command.kind {
            CommandKind::Hold => 0,
            CommandKind::Stream => 1,
            CommandKind::Move => 2,
            CommandKind::Trajectory => 3,
            CommandKind::Unknown => 4,
        });
        words.word(input.tick.command.selector as u64);
        words.word(input.tick.command.sequence as u64);
        words.reals(&input.tick.command.target.pose);
        words.reals(&input.tick.command.target.rate);
        words.reals(&input.tick.command.target.acceleration);
        words.reals(&input.tick.gauge);
        words.reals(&input.tick.wrench);
    };
    let leg = snapshot::Leg {
        words: quote! { <Memory as Snapshot>::WORDS + 3 },
        save: quote! { words.reals(&[self.requested, self.excess]); },
        restore: quote! {
            self.requested = words.real(LARGEST_PLACE)?;
            self.excess = words.real(words.sizes().request)?;
        },
    };
    let state = quote! {
        impl Snapshot for State {
            const WORDS: usize = LEGS * <LegState as Snapshot>::WORDS
                + 6 * <Estimate<Real> as Snapshot>::WORDS
                + 8 * 6
                + <Rate<Real> as Snapshot>::WORDS
                + <Generator<Real> as Snapshot>::WORDS
                + 2 * <NotchState<Real> as Snapshot>::WORDS
                + <Integral<Real> as Snapshot>::WORDS
                + <Transfer<Real> as Snapshot>::WORDS
                + 3;

            fn save(&self, words: &mut Writer<'_>) {
                for leg in &self.legs {
                    leg.save(words);
                }
                for estimate in &self.estimates {
                    estimate.save(words);
                }
                for vector in [
                    &self.pose,
                    &self.error,
                    &self.deflection,
                    &self.demand,
                    &self.load,
                    &self.wrench,
                    &self.environment.stiffness,
                    &self.environment.rest,
                ] {
                    words.reals(vector);
                }
                self.rate.save(words);
                self.generator.save(words);
                self.error_notch.save(words);
                self.innovation_notch.save(words);
                self.integral.save(words);
                self.transfer.save(words);
                words.flag(self.limited);
                words.word(match self.mode {
                    None => 0,
                    Some(mode) => 1 + mode.word(),
                });
                words.word(self.interaction.word());
            }

            fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
                for leg in &mut self.legs {
                    leg.restore(words)?;
                }
                for estimate in &mut self.estimates {
                    estimate.restore(words)?;
                }
                words.reals(&mut self.pose, LARGEST_PLACE)?;
                words.reals(&mut self.error, LARGEST_PLACE)?;
                words.reals(&mut self.deflection, words.sizes().request)?;
                words.reals(&mut self.demand, LARGEST_PLACE)?;
                words.reals(&mut self.load, words.sizes().request)?;
                words.reals(&mut self.wrench, LARGEST)?;
                words.reals(&mut self.environment.stiffness, words.sizes().stiffness)?;
                words.reals(&mut self.environment.rest, LARGEST_PLACE)?;
                self.rate.restore(words)?;
                self.generator.restore(words)?;
                self.error_notch.restore(words)?;
                self.innovation_notch.restore(words)?;
                self.integral.restore(words)?;
                self.transfer.restore(words)?;
                self.limited = words.flag()?;
                self.mode = match words.word(u64::MAX)? {
                    0 => None,
                    word => match ControlMode::from_word(word - 1) {
                        Some(mode) => Some(mode),
                        None => return Err(words.refused()),
                    },
                };
                let Some(interaction) = Interaction::from_word(words.word(u64::MAX)?) else {
                    return Err(words.refused());
                };
                self.interaction = interaction;
                Ok(())
            }
        }
    };
    snapshot::emit(&imports, &input, &leg, &state)
}
