//! Error codes of `ERR?`.

/// Why a command failed, or that the platform was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Code {
    /// A parameter cannot be parsed.
    Syntax = 1,
    UnknownCommand = 2,
    TooLong = 3,
    /// The servo is off.
    ServoOff = 5,
    /// Out of reach of the platform.
    Position = 7,
    /// Below the speed of the machine.
    Velocity = 8,
    /// The pivot point cannot be set while the platform is rotated.
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
    /// A gauge is not read or implausible, so the position is unknown.
    Sensor = 505,
}
