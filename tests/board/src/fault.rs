//! Faults that can be put in, by their names.

use crate::{ad5686r, ad7606};

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The emergency contact opens.
    Stop,
    /// An amplifier reports a fault: its contact opens.
    Amplifier,
    Adc(ad7606::Fault),
    /// Of the first part.
    Dac(ad5686r::Fault),
    /// One byte of the link with a framing error.
    Uart,
    /// Every third one.
    Noise,
    /// Nothing is wrong with the board: the host is gone, for the time to be written down.
    Host,
    /// The background does not come back from its sleep.
    Background,
    /// The core stands still.
    Hang,
    /// It does, and then the emergency contact opens.
    HangStop,
    /// The core takes a hard fault.
    Hard,
    /// A debugger holds the core for a second, and the watchdog with it.
    Halt,
    /// The clock at the HSE pin stops, until it is healed.
    Clock,
    /// The voltage detector finds the supply too low, at the beginning of a tick.
    Supply,
    /// The supply breaks down and comes back: a reset, with RAM that is no longer what it was.
    BrownOut,
}

/// Names, for commands.
pub const NAMES: [(&str, Fault); 21] = [
    ("stop", Fault::Stop),
    ("amplifier", Fault::Amplifier),
    ("adc-dead", Fault::Adc(ad7606::Fault::Dead)),
    ("adc-endless", Fault::Adc(ad7606::Fault::Endless)),
    ("adc-shifted", Fault::Adc(ad7606::Fault::Shifted)),
    ("adc-no-reference", Fault::Adc(ad7606::Fault::NoReference)),
    ("adc-blank", Fault::Adc(ad7606::Fault::Blank)),
    ("adc-again", Fault::Adc(ad7606::Fault::Again)),
    ("dac-stuck", Fault::Dac(ad5686r::Fault::Stuck)),
    ("dac-mute", Fault::Dac(ad5686r::Fault::Mute)),
    ("uart", Fault::Uart),
    ("uart-noise", Fault::Noise),
    ("host-killed", Fault::Host),
    ("background", Fault::Background),
    ("hang", Fault::Hang),
    ("hang-stop", Fault::HangStop),
    ("hard-fault", Fault::Hard),
    ("halt", Fault::Halt),
    ("clock", Fault::Clock),
    ("supply", Fault::Supply),
    ("brown-out", Fault::BrownOut),
];

impl Fault {
    pub fn of(name: &str) -> Option<Self> {
        NAMES.iter().find(|(known, _)| *known == name).map(|(_, fault)| *fault)
    }
}
