//! What a device learns between passes, by the formula.

use specgen_runtime::learning::{HEAD, Learning, Settings, plan_rows};
use specgen_runtime::pass::{Course, Player, Stage};
use specgen_runtime::playback::Knot;

const KNOTS: usize = 50;
const REACH: usize = 7;
const SETTINGS: Settings = Settings { reach: REACH as u32, fade: [3, 5] };

/// A plan, a correction and errors without a pattern.
struct Plan {
    rows: Vec<[f32; 6]>,
    played: Vec<Knot>,
    errors: Vec<Knot>,
}

fn given() -> Plan {
    let mut state = 1_u32;
    let mut draw = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    let rows = (0..plan_rows(REACH)).map(|_| std::array::from_fn(|_| draw())).collect();
    let mut knots = || (0..KNOTS).map(|_| std::array::from_fn(|_| (2e6 * draw()) as i32)).collect();
    Plan { rows, played: knots(), errors: knots() }
}

fn words(rows: &[[f32; 6]]) -> Vec<Knot> {
    rows.iter().map(|row| row.map(|value| value.to_bits() as i32)).collect()
}

impl Plan {
    fn memory(&self) -> [Vec<Knot>; 2] {
        let table = [self.played.clone(), words(&self.rows)].concat();
        let mut errors = self.errors.clone();
        errors.resize(KNOTS + KNOTS.div_ceil(6), [0; 6]);
        [table, errors]
    }

    /// So many steps at a time.
    fn learned(&self, steps: u32) -> Vec<Knot> {
        let [mut table, mut errors] = self.memory();
        let mut learning = Learning::new(SETTINGS, KNOTS, &table, &errors).unwrap();
        while learning.work(steps, &mut table, &mut errors) {}
        assert!(!learning.is_busy() && !learning.work(1, &mut table, &mut errors));
        assert_eq!(table[KNOTS..], words(&self.rows), "the plan stays");
        table.truncate(KNOTS);
        table
    }

    /// c_j ← w_j V (Σ q_|m| V⁻¹ c_{j−m} + Σ h_m V⁻¹ e_{j−m}) in double precision.
    fn formula(&self) -> Vec<[f64; 6]> {
        let number = |row: usize, column: usize| f64::from(self.rows[row][column]);
        let map = |first: usize, vector: [f64; 6]| -> [f64; 6] {
            std::array::from_fn(|i| (0..6).map(|k| number(first + i, k) * vector[k]).sum())
        };
        let modal =
            |knots: &[Knot]| -> Vec<[f64; 6]> { knots.iter().map(|knot| map(0, knot.map(f64::from))).collect() };
        let [played, errors] = [modal(&self.played), modal(&self.errors)];
        let smoothing = |m: usize| number(HEAD + 2 * REACH + 1 + m / 6, m % 6);
        let fade = |inward: usize, over: u32| {
            let s = (inward as f64 / f64::from(over)).min(1.0);
            s * s * (3.0 - 2.0 * s)
        };
        (0..KNOTS)
            .map(|j| {
                let share = fade(j, SETTINGS.fade[0]) * fade(KNOTS - 1 - j, SETTINGS.fade[1]);
                let sums = std::array::from_fn(|mode| {
                    (0..KNOTS)
                        .filter(|i| i.abs_diff(j) <= REACH)
                        .map(|i| {
                            let tap = number(HEAD + REACH + j - i, mode);
                            smoothing(i.abs_diff(j)) * played[i][mode] + tap * errors[i][mode]
                        })
                        .sum()
                });
                map(6, sums).map(|value| share * value)
            })
            .collect()
    }
}

#[test]
fn a_device_learns_by_its_formula_in_pieces_of_any_size() {
    let given = given();
    let learned = given.learned(u32::MAX);
    for steps in [1, 7, 64] {
        assert_eq!(given.learned(steps), learned, "{steps} steps");
    }
    for (found, expected) in learned.iter().flatten().zip(given.formula().iter().flatten()) {
        // A hundred sums of f32 of some 10⁶, and the rounding to whole numbers.
        assert!((f64::from(*found) - expected).abs() < 4.0, "{found} {expected}");
    }
    let mut off = Plan { rows: given.rows.clone(), ..given };
    off.rows[HEAD + REACH][2] = f32::from_bits(off.rows[HEAD + REACH][2].to_bits() + 64);
    assert_ne!(off.learned(u32::MAX), learned, "a tap that is off by some ulp is seen");
}

#[test]
fn a_plan_that_is_none_is_refused() {
    let given = given();
    let [table, errors] = given.memory();
    let refused = |table: &[Knot], errors: &[Knot], settings: Settings, knots: usize| {
        Learning::new(settings, knots, table, errors).is_none()
    };
    assert!(!refused(&table, &errors, SETTINGS, KNOTS));
    assert!(refused(&table, &errors, SETTINGS, 0));
    assert!(refused(&table[1..], &errors, SETTINGS, KNOTS), "a row is missing");
    assert!(refused(&table, &errors[1..], SETTINGS, KNOTS), "no room to work in");
    for reach in [REACH as u32 + 1, u32::MAX] {
        assert!(refused(&table, &errors, Settings { reach, ..SETTINGS }, KNOTS), "{reach}");
    }
    for bad in [f32::NAN, f32::INFINITY] {
        let mut table = table.clone();
        table[KNOTS + HEAD][4] = bad.to_bits() as i32;
        assert!(refused(&table, &errors, SETTINGS, KNOTS), "{bad}");
    }
    // Numbers that overflow on the way give a correction all the same, which the tick limits.
    let mut huge = table.clone();
    huge[KNOTS..].fill([f32::MAX.to_bits() as i32; 6]);
    let mut errors = errors;
    let mut learning = Learning::new(SETTINGS, KNOTS, &huge, &errors).unwrap();
    while learning.work(100, &mut huge, &mut errors) {}
}

/// A player learns from a pass that came to its end, once, and begins no other meanwhile.
#[test]
fn a_player_learns_between_passes_only() {
    let given = given();
    let mut memory = vec![[0; 6]; 2 * (KNOTS + plan_rows(REACH))];
    let mut player = Player::<f64>::new(&mut memory);
    let course = Course { spacing: 2, before: 10, ticks: 2 * KNOTS as u32, trajectory: 0 };
    assert!(player.put(0, given.played.iter().copied()) && player.put(KNOTS, words(&given.rows).into_iter()));
    assert!(!player.learn(SETTINGS), "no pass was made");
    assert!(player.begin(course) && !player.learn(SETTINGS));
    while player.is_running() {
        assert!(player.give().is_some());
        player.keep(&[1e-9; 6], &[0.0; 6], 0);
    }
    let errors = player.errors().to_vec();
    assert_eq!(errors.len(), KNOTS);
    assert!(player.learn(SETTINGS) && player.stage() == Stage::Learning);
    assert!(!player.learn(SETTINGS) && !player.begin(course) && !player.put(0, [[0; 6]].into_iter()));
    while player.work(3) {}
    assert_eq!(player.stage(), Stage::Complete);
    assert_eq!(player.correction(), Plan { errors, ..given }.learned(u32::MAX));
    assert!(!player.learn(SETTINGS), "what the pass kept is used up");
    assert!(player.begin(course));
}
