//! Physical dimensions: exponents of the base units, and the names that messages use.

/// Exponents of m, kg, s, V, rad, byte and √Hz.
///
/// Volt is the electrical base unit. Radian is a dimension of its own, so that a torque is not taken for a rotational
/// stiffness, nor hertz for rad/s. So is √Hz, which occurs in noise densities only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimension {
    exponents: [i8; 7],
}

const SYMBOLS: [&str; 7] = ["m", "kg", "s", "V", "rad", "B", "√Hz"];

impl Dimension {
    /// No dimension.
    pub const NONE: Self = Self::new([0; 6]);
    /// m
    pub const LENGTH: Self = Self::new([1, 0, 0, 0, 0, 0]);
    /// kg
    pub const MASS: Self = Self::new([0, 1, 0, 0, 0, 0]);
    /// s
    pub const TIME: Self = Self::new([0, 0, 1, 0, 0, 0]);
    /// V
    pub const VOLTAGE: Self = Self::new([0, 0, 0, 1, 0, 0]);
    /// rad
    pub const ANGLE: Self = Self::new([0, 0, 0, 0, 1, 0]);
    /// bytes
    pub const MEMORY: Self = Self::new([0, 0, 0, 0, 0, 1]);
    /// 1/s (Hz)
    pub const FREQUENCY: Self = Self::new([0, 0, -1, 0, 0, 0]);
    /// rad/s
    pub const ANGULAR_RATE: Self = Self::new([0, 0, -1, 0, 1, 0]);
    /// kg m²
    pub const INERTIA: Self = Self::new([2, 1, 0, 0, 0, 0]);
    /// m/V
    pub const PIEZO_GAIN: Self = Self::new([1, 0, 0, -1, 0, 0]);
    /// V/s
    pub const SLEW_RATE: Self = Self::new([0, 0, -1, 1, 0, 0]);
    /// A = W/V
    pub const CURRENT: Self = Self::new([2, 1, -3, -1, 0, 0]);
    /// F = A s/V
    pub const CAPACITANCE: Self = Self::new([2, 1, -2, -2, 0, 0]);
    /// N
    pub const FORCE: Self = Self::new([1, 1, -2, 0, 0, 0]);
    /// N/m
    pub const STIFFNESS: Self = Self::new([0, 1, -2, 0, 0, 0]);
    /// N/(m s)
    pub const STIFFNESS_RATE: Self = Self::new([0, 1, -3, 0, 0, 0]);
    /// N s/m
    pub const DAMPING: Self = Self::new([0, 1, -1, 0, 0, 0]);
    /// N m/rad
    pub const TURN_STIFFNESS: Self = Self::new([2, 1, -2, 0, -1, 0]);
    /// N m/(rad s)
    pub const TURN_STIFFNESS_RATE: Self = Self::new([2, 1, -3, 0, -1, 0]);
    /// N m s/rad
    pub const TURN_DAMPING: Self = Self::new([2, 1, -1, 0, -1, 0]);

    /// √Hz
    pub const ROOT_HERTZ: Self = Self { exponents: [0, 0, 0, 0, 0, 0, 1] };
    /// m/s
    pub const SPEED: Self = Self::new([1, 0, -1, 0, 0, 0]);
    /// m/s²
    pub const ACCELERATION: Self = Self::new([1, 0, -2, 0, 0, 0]);
    /// m/s³
    pub const JERK: Self = Self::new([1, 0, -3, 0, 0, 0]);
    /// rad/s²
    pub const ANGULAR_ACCELERATION: Self = Self::new([0, 0, -2, 0, 1, 0]);
    /// rad/s³
    pub const ANGULAR_JERK: Self = Self::new([0, 0, -3, 0, 1, 0]);

    /// From the exponents of m, kg, s, V, rad, byte.
    pub const fn new(exponents: [i8; 6]) -> Self {
        let [m, kg, s, volt, rad, byte] = exponents;
        Self { exponents: [m, kg, s, volt, rad, byte, 0] }
    }

    /// The product with `other` to the power `power`; `None` if an exponent leaves the range of `i8`.
    pub fn times(self, other: Self, power: i8) -> Option<Self> {
        let mut exponents = self.exponents;
        for (own, more) in exponents.iter_mut().zip(other.exponents) {
            *own = own.checked_add(more.checked_mul(power)?)?;
        }
        Some(Self { exponents })
    }

    /// The same with radians left out.
    #[must_use]
    pub const fn without_angle(self) -> Self {
        let [m, kg, s, volt, _, byte, root] = self.exponents;
        Self { exponents: [m, kg, s, volt, 0, byte, root] }
    }

    /// Whether it contains a mass, as a force does.
    pub const fn contains_mass(self) -> bool {
        self.exponents[1] == 1
    }

    /// Whether this is a spectral density of `of`: "nm/√Hz" of a length.
    pub fn is_density_of(self, of: Self) -> bool {
        self.times(Self::ROOT_HERTZ, 1) == Some(of)
    }

    /// With article, for messages: "a length"; dimensions without a name of their own are spelt in base units.
    pub fn describe(self) -> String {
        NAMES
            .iter()
            .find(|(dimension, _)| *dimension == self)
            .map(|(_, name)| (*name).to_owned())
            .or_else(|| {
                let of = self.times(Self::ROOT_HERTZ, 1).filter(|_| self.exponents[6] == -1)?;
                Some(format!("the noise density of {}", of.describe()))
            })
            .unwrap_or_else(|| format!("a quantity in {}", self.in_base_units()))
    }

    /// The dimension in base units: "kg m^2 s^-2".
    pub fn in_base_units(self) -> String {
        let factors: Vec<String> = [1, 0, 2, 3, 4, 5, 6]
            .into_iter()
            .filter(|i| self.exponents[*i] != 0)
            .map(|i| match self.exponents[i] {
                1 => SYMBOLS[i].to_owned(),
                power => format!("{}^{power}", SYMBOLS[i]),
            })
            .collect();
        factors.join(" ")
    }
}

const NAMES: &[(Dimension, &str)] = &[
    (Dimension::NONE, "a plain number"),
    (Dimension::LENGTH, "a length"),
    (Dimension::MASS, "a mass"),
    (Dimension::TIME, "a time"),
    (Dimension::VOLTAGE, "a voltage"),
    (Dimension::ANGLE, "an angle"),
    (Dimension::MEMORY, "an amount of memory"),
    (Dimension::FREQUENCY, "a frequency"),
    (Dimension::ANGULAR_RATE, "an angular rate"),
    (Dimension::INERTIA, "a moment of inertia"),
    (Dimension::PIEZO_GAIN, "a displacement per volt"),
    (Dimension::SLEW_RATE, "a voltage per time"),
    (Dimension::CURRENT, "a current"),
    (Dimension::CAPACITANCE, "a capacitance"),
    (Dimension::FORCE, "a force"),
    (Dimension::STIFFNESS, "a stiffness"),
    (Dimension::STIFFNESS_RATE, "a stiffness per time"),
    (Dimension::DAMPING, "a damping"),
    (Dimension::TURN_STIFFNESS, "a rotational stiffness"),
    (Dimension::TURN_STIFFNESS_RATE, "a rotational stiffness per time"),
    (Dimension::TURN_DAMPING, "a rotational damping"),
    (Dimension::new([2, 1, -2, 0, 0, 0]), "a torque or an energy"),
    (Dimension::new([2, 1, -3, 0, 0, 0]), "a power"),
    (Dimension::new([-1, 1, -2, 0, 0, 0]), "a pressure"),
    (Dimension::SPEED, "a speed"),
    (Dimension::ACCELERATION, "an acceleration"),
    (Dimension::JERK, "a jerk"),
    (Dimension::ANGULAR_ACCELERATION, "an angular acceleration"),
    (Dimension::ANGULAR_JERK, "an angular jerk"),
    (Dimension::new([2, 0, 0, 0, 0, 0]), "an area"),
    (Dimension::new([3, 0, 0, 0, 0, 0]), "a volume"),
    (Dimension::new([1, 1, 0, 0, 0, 0]), "a mass times a length"),
];
