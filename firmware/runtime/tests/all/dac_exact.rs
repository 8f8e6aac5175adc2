//! Voltage and slew limits by cases: all there are, or all kinds of them. In the full run every one of the 2³² drives in f32 on the
//! converter of the reference, and every pair of codes under its limits; else a part of those, with whatever is next to a boundary.

use specgen_runtime::{CodeLimits, Dac, Real};

/// 16 bits, 0 V to 150 V, of which the actuator takes 0 V to 100 V: the reference.
const FROM_ZERO: [f64; 5] = [0.0, 150.0 / 65535.0, 0.0, 150.0 / 65535.0 * 0.32, 65535.0 / 150.0 / 0.32];
/// 16 bits, −30 V to 150 V, of which the actuator takes −20 V to 130 V in 64 cells.
const FROM_BELOW: [f64; 5] =
    [-30.0, 180.0 / 65535.0, -10.0 * 64.0 / 150.0, 180.0 / 65535.0 * 64.0 / 150.0, 65535.0 / 180.0 * 150.0 / 64.0];
/// The same in 24 bits, the most that a spec may ask for.
const FINE: [f64; 5] = [
    -30.0,
    180.0 / 16_777_215.0,
    -10.0 * 64.0 / 150.0,
    180.0 / 16_777_215.0 * 64.0 / 150.0,
    16_777_215.0 / 180.0 * 150.0 / 64.0,
];

/// Limits of the reference; with one code in all; with a step that takes every way at once.
const LIMITS: [CodeLimits; 3] = [
    CodeLimits { min: 3641, max: 43_690, max_step: 1747 },
    CodeLimits { min: 20_000, max: 20_000, max_step: 1 },
    CodeLimits { min: 0, max: 65_535, max_step: 65_535 },
];
const NO_LIMITS: CodeLimits = CodeLimits { min: i32::MIN, max: i32::MAX, max_step: i32::MAX };

fn dac<T: Real>(constants: [f64; 5]) -> Dac<T> {
    let [volts_at_zero, volts_per_code, cells_at_zero, cells_per_code, codes_per_cell] = constants.map(T::from_f64);
    Dac { volts_at_zero, volts_per_code, cells_at_zero, cells_per_code, codes_per_cell }
}

fn in_full_run() -> bool {
    std::env::var_os("SPECGEN_FULL").is_some()
}

/// The permitted code nearest to `wanted`, by another way than the kernel's: where no permitted code is within reach, the one at
/// the end of the reach.
fn nearest(wanted: i64, previous: i64, limits: [i64; 3]) -> i64 {
    let [min, max, step] = limits;
    let reach = previous - step..=previous + step;
    let permitted = reach.clone().filter(|code| (min..=max).contains(code));
    let nearest = permitted.min_by_key(|code| (code - wanted).abs());
    nearest.unwrap_or(if previous < min { *reach.end() } else { *reach.start() })
}

/// A converter whose code is the drive itself.
fn plain(wanted: i32, previous: i32, limits: CodeLimits) -> (i32, bool) {
    dac::<f64>([0.0, 1.0, 0.0, 1.0, 1.0]).code(f64::from(wanted) - 0.5, previous, limits)
}

/// The kernel compares five numbers (the wanted code, both limits, both ends of the step) and returns one of them, so that only
/// their order decides which. Here all orders, ties among them, stand for all numbers; the test after this one shows that they do.
#[test]
fn in_every_order_of_wanted_limits_and_step_the_code_is_the_nearest_permitted_one() {
    let mut tried = 0;
    for previous in 0..8 {
        for (min, max) in (0..8).flat_map(|min| (min..8).map(move |max| (min, max))) {
            for (max_step, wanted) in (1..9).flat_map(|step| (-2..11).map(move |wanted| (step, wanted))) {
                let (code, held_back) = plain(wanted, previous, CodeLimits { min, max, max_step });
                let case = (wanted, previous, min, max, max_step);
                let expected = nearest(wanted.into(), previous.into(), [min, max, max_step].map(i64::from));
                assert_eq!((i64::from(code), held_back), (expected, code != wanted), "{case:?}");
                assert!((code - previous).abs() <= max_step, "{case:?}");
                assert!((min..=max).contains(&code) || !(min..=max).contains(&previous), "{case:?}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 8 * 36 * 8 * 13);
}

#[test]
fn numbers_of_the_same_order_have_the_same_code_up_to_both_ends_of_the_integers() {
    const EDGES: [i32; 15] = [
        i32::MIN,
        i32::MIN + 1,
        -65_537,
        -2,
        -1,
        0,
        1,
        2,
        255,
        43_690,
        65_535,
        65_536,
        16_777_215,
        i32::MAX - 1,
        i32::MAX,
    ];
    let mut tried = 0_u32;
    for (wanted, previous) in EDGES.iter().flat_map(|wanted| EDGES.map(|previous| (*wanted, previous))) {
        for (min, max) in EDGES.iter().flat_map(|min| EDGES.map(|max| (*min, max))).filter(|(min, max)| min <= max) {
            for max_step in EDGES.into_iter().filter(|step| *step > 0) {
                let five = [wanted, min, max, previous.saturating_sub(max_step), previous.saturating_add(max_step)];
                // Even numbers in the same order.
                let mut sorted = five;
                sorted.sort_unstable();
                let rank = five.map(|number| 2 * sorted.partition_point(|other| *other < number) as i32);
                let [small_wanted, small_min, small_max, low, high] = rank;
                let limits = CodeLimits { min: small_min, max: small_max, max_step: (high - low) / 2 };
                let (small, _) = plain(small_wanted, (low + high) / 2, limits);
                let (code, held_back) = plain(wanted, previous, CodeLimits { min, max, max_step });
                let same = five[rank.iter().position(|number| *number == small).unwrap()];
                assert_eq!((code, held_back), (same, same != wanted), "{wanted} {previous} {min} {max} {max_step}");
                tried += 1;
            }
        }
    }
    assert!(tried > 200_000, "{tried}");
}

#[test]
fn from_every_code_to_every_code_limits_and_step_hold() {
    for (number, limits) in LIMITS.into_iter().enumerate() {
        let stride = if in_full_run() && number == 0 { 1 } else { 251 };
        for previous in (limits.min..=limits.max).step_by(stride) {
            for wanted in -1..=65_536 {
                let (code, held_back) = plain(wanted, previous, limits);
                let moved = (code - previous).abs();
                assert!(code >= limits.min && code <= limits.max && moved <= limits.max_step, "{previous} {wanted}");
                // Not further from what is wanted than needed.
                let ends = code == limits.min || code == limits.max || moved == limits.max_step;
                assert!(held_back == (code != wanted) && (!held_back || ends), "{previous} {wanted}");
            }
        }
    }
}

/// Whatever the drive: its code alone, without limits, and the limits.
struct Walk<T> {
    dac: Dac<T>,
    /// Codes from which it starts.
    previous: [[i32; 3]; 3],
    last: i32,
    tried: u64,
}

impl<T: Real + Into<f64> + std::fmt::LowerExp> Walk<T> {
    fn new(constants: [f64; 5]) -> Self {
        let previous = LIMITS.map(|limits| [limits.min, (limits.min + limits.max) / 2, limits.max]);
        Self { dac: dac(constants), previous, last: i32::MIN, tried: 0 }
    }

    /// A drive that is no lower than the one before.
    fn up(&mut self, drive: T) {
        let (wanted, _) = self.dac.code(drive, 0, NO_LIMITS);
        assert!(wanted >= self.last, "{drive:e}: {wanted} after {}", self.last);
        self.last = wanted;
        // The nearest one: half a code, and the rounding of a difference, a product and a sum.
        let exact = (drive.into() - self.dac.cells_at_zero.into()) * self.dac.codes_per_cell.into();
        if exact.abs() < 1e9 && exact > 0.0 {
            let epsilon = if T::SINGLE { f64::from(f32::EPSILON) } else { f64::EPSILON };
            let start = (self.dac.cells_at_zero.into() * self.dac.codes_per_cell.into()).abs();
            let rounding = 2.0 * epsilon * (exact + start + 1.0);
            assert!((exact - f64::from(wanted)).abs() <= 0.5 + rounding, "{drive:e}: {wanted} for {exact}");
        }
        self.any(drive);
    }

    fn any(&mut self, drive: T) {
        for (limits, starts) in LIMITS.iter().zip(self.previous) {
            for previous in starts {
                let (code, _) = self.dac.code(drive, previous, *limits);
                assert!(code >= limits.min && code <= limits.max, "{drive:e} from {previous}: {code}");
                assert!((code - previous).abs() <= limits.max_step, "{drive:e} from {previous}: {code}");
            }
        }
        self.tried += 1;
    }
}

/// Bits of the k-th number from −∞ to +∞.
fn in_order(k: u32) -> u32 {
    if k & 1 << 31 == 0 { !k } else { k ^ 1 << 31 }
}

#[test]
fn whatever_the_bits_of_a_drive_in_f32_the_code_rises_with_it_and_keeps_limits_and_step() {
    // All of them, or every 4099th and whatever is next to a boundary between two codes.
    for (constants, all) in [(FROM_ZERO, in_full_run()), (FROM_BELOW, false)] {
        let mut walk = Walk::<f32>::new(constants);
        let mut visit = |k: u32| {
            let drive = f32::from_bits(in_order(k));
            if drive.is_nan() { walk.any(drive) } else { walk.up(drive) }
        };
        if all {
            (0..=u32::MAX).for_each(&mut visit);
            assert_eq!(walk.tried, 1 << 32);
        } else {
            let mut places: Vec<u32> = (0..=u32::MAX).step_by(4099).collect();
            let place =
                |drive: f32| if drive.to_bits() >> 31 == 0 { drive.to_bits() | 1 << 31 } else { !drive.to_bits() };
            let [_, _, at_zero, per_code, _] = constants;
            for code in -1..=65_536 {
                let boundary = place((at_zero + (f64::from(code) + 0.5) * per_code) as f32);
                places.extend((0..7).map(|k| boundary.wrapping_add(k).wrapping_sub(3)));
            }
            for special in [f32::NEG_INFINITY, f32::MIN, -0.0, 0.0, f32::MAX, f32::INFINITY, f32::NAN, -f32::NAN] {
                places.extend((0..5).map(|k| place(special).wrapping_add(k).wrapping_sub(2)));
            }
            places.sort_unstable();
            places.into_iter().for_each(&mut visit);
            assert!(walk.tried > 1_400_000, "{}", walk.tried);
        }
    }
}

/// In f64 all boundaries between codes with their neighbours, and all exponents with the ends and the middle of their numbers.
#[test]
fn next_to_every_boundary_and_at_every_exponent_in_f64_the_code_rises_with_the_drive_and_keeps_limits_and_step() {
    for (constants, last) in
        [(FROM_ZERO, 65_536), (FROM_BELOW, 65_536), (FINE, if in_full_run() { 1 << 24 } else { 1 << 17 })]
    {
        let mut drives = Vec::new();
        let [_, _, at_zero, per_code, _] = constants;
        for code in -1..=last {
            let boundary = (at_zero + (f64::from(code) + 0.5) * per_code).to_bits();
            drives.extend((0..7).map(|k| f64::from_bits(boundary.wrapping_add(k).wrapping_sub(3))));
        }
        for exponent in 0..2048_u64 {
            for part in [0, 1, 2, 0x8_0000_0000_0000, 0xf_ffff_ffff_fffe, 0xf_ffff_ffff_ffff] {
                let drive = f64::from_bits(exponent << 52 | part);
                drives.extend([drive, -drive]);
            }
        }
        let (numbers, nan): (Vec<f64>, Vec<f64>) = drives.into_iter().partition(|drive| !drive.is_nan());
        let mut numbers = numbers;
        numbers.sort_unstable_by(f64::total_cmp);
        let mut walk = Walk::<f64>::new(constants);
        numbers.iter().for_each(|drive| walk.up(*drive));
        nan.iter().for_each(|drive| walk.any(*drive));
        assert!(!nan.is_empty() && walk.tried > 480_000, "{}", walk.tried);
    }
}

fn every_code<T: Real + Into<f64>>(constants: [f64; 5], full_scale: i32) {
    let dac = dac::<T>(constants);
    let (lowest, highest): (f64, f64) = (dac.voltage(0).into(), dac.voltage(full_scale).into());
    let mut last = f64::NEG_INFINITY;
    for code in 0..=full_scale {
        let volts: f64 = dac.voltage(code).into();
        assert!(volts >= last && volts >= lowest && volts <= highest, "{code}: {volts} after {last}");
        assert!(volts != 0.0 || volts.is_sign_positive(), "{code}: −0");
        last = volts;
        let exact = constants[0] + f64::from(code) * constants[1];
        let epsilon = if T::SINGLE { f64::from(f32::EPSILON) } else { f64::EPSILON };
        assert!((volts - exact).abs() <= 2.0 * epsilon * (constants[0].abs() + highest.abs()), "{code}: {volts}");
        // A grid whose codes a scalar can tell apart: what a code stands for is that code again.
        if full_scale < 1 << 16 || !T::SINGLE {
            assert_eq!(dac.code(dac.drive(code), code, NO_LIMITS), (code, false));
        }
    }
}

#[test]
fn the_voltage_rises_with_the_code_from_the_lowest_to_the_highest_and_a_code_gives_itself() {
    for constants in [FROM_ZERO, FROM_BELOW] {
        every_code::<f64>(constants, 65_535);
        every_code::<f32>(constants, 65_535);
    }
    every_code::<f64>(FINE, 16_777_215);
    every_code::<f32>(FINE, 16_777_215);
}
