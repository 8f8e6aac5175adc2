//! Error codes, as `ERR?` answers them.

/// Why a command was not carried out, or that the platform was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Code {
    /// The parameters cannot be read.
    Syntax = 1,
    UnknownCommand = 2,
    TooLong = 3,
    /// Servo off, or switched off meanwhile.
    ServoOff = 5,
    /// Beyond what the platform can reach.
    Position = 7,
    /// Not the speed that the machine has.
    Velocity = 8,
    /// The pivot point cannot be set while the platform is turned.
    Pivot = 9,
    Stopped = 10,
    Axis = 15,
    ParameterRange = 17,
    AxisTwice = 22,
    ParameterCount = 24,
    /// Another client or another host is in control.
    NotNow = 89,
    InMotion = 93,
    WaveActive = 73,
    /// The gauges are not read, or one is not believed: nothing is known of the position.
    Sensor = 505,
}
