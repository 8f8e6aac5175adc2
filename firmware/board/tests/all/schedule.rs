//! When ticks are due, and whether the watchdog is fed.

#![allow(clippy::unwrap_used)]

use std::num::NonZeroU32;

use controller::limits::CODES;
use controller::supervision::SUPERVISION;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_board::{BACKGROUND_SILENCE, DueTick, Health, RAMPED_DOWN, Schedule};
use specgen_runtime::supervisor::toward;

/// Against a counter that never wraps: the grid of due times is never left, and every grid point is a tick or is counted.
#[test]
fn every_due_time_is_a_tick_or_is_counted_as_missed() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for period in [1_u32, 7, 20_000, 9_000, 1 << 20] {
        // Close below the wrap.
        let start = u64::from(u32::MAX) - 10 * u64::from(period);
        let mut schedule = Schedule::new(NonZeroU32::new(period).unwrap(), start as u32);
        let mut grid = start + u64::from(period);
        let mut now = start;
        let (mut ticks, mut missed) = (0_u64, 0_u64);
        for _ in 0..2000 {
            // Now and then long after it was due.
            let delay =
                if random.next_u32() % 5 == 0 { random.next_u32() % (4 * period) } else { random.next_u32() % period };
            now = now.max(grid) + u64::from(delay);
            let due = schedule.begin(now as u32);
            let skipped = (now - grid) / u64::from(period);
            let expected = DueTick {
                late: ((now - grid) % u64::from(period)) as u32,
                missed: skipped as u32,
                next: (grid + (skipped + 1) * u64::from(period)) as u32,
            };
            assert_eq!(due, expected);
            grid += (skipped + 1) * u64::from(period);
            ticks += 1;
            missed += skipped;
        }
        assert_eq!(ticks + missed, (grid - start) / u64::from(period) - 1);
        assert!(missed > 0);
    }
}

#[test]
fn a_tick_before_its_time_is_in_time_and_a_restart_counts_nothing() {
    let mut schedule = Schedule::new(NonZeroU32::new(100).unwrap(), 0);
    assert_eq!(schedule.begin(90), DueTick { late: 0, missed: 0, next: 200 });
    assert_eq!(schedule.next(), 200);
    assert_eq!(schedule.restart(1234), 1334);
    assert_eq!(schedule.begin(1340), DueTick { late: 6, missed: 0, next: 1434 });
    assert_eq!(schedule.begin(1734), DueTick { late: 0, missed: 3, next: 1834 });
}

/// Up to a turn of the counter less a period; half a turn is 9 s of 240 MHz.
#[test]
fn a_tick_that_comes_long_after_its_time_is_not_one_before_it() {
    let period = NonZeroU32::new(24_000).unwrap();
    for missed in [9_999, u32::MAX / 2 / 24_000 + 1, u32::MAX / 24_000 - 2] {
        let mut schedule = Schedule::new(period, 0);
        let due = schedule.begin(24_000_u32.wrapping_add(24_000 * missed).wrapping_add(7));
        assert_eq!((due.missed, due.late), (missed, 7));
    }
}

#[test]
fn a_dead_background_ramps_down_and_then_starves_the_watchdog() {
    // Two seconds of 100 µs, then the way of the codes from the highest to rest.
    let (mut code, mut ramp) = (CODES[1], 0);
    while code != CODES[0] {
        code = toward(code, CODES[0], SUPERVISION.ramp_step);
        ramp += SUPERVISION.ramp_every;
    }
    assert!(ramp > 10_000);
    assert_eq!((BACKGROUND_SILENCE, RAMPED_DOWN), (10_001, 2 * 10_001 + ramp));
    let mut health = Health::new();
    for beat in 0..3 * BACKGROUND_SILENCE {
        assert!(health.tick(1 + beat / 100, 0, false));
    }
    let beat = 77;
    assert!(health.tick(beat, 0, true) && !health.is_orphaned());
    for silent in 1..RAMPED_DOWN {
        assert!(health.tick(beat, 0, true), "{silent}");
        assert_eq!(health.is_orphaned(), silent >= BACKGROUND_SILENCE);
    }
    assert!(!health.tick(beat, 0, true), "a ramp that does not end is ended");
    assert!(!health.tick(beat, 0, false));
    assert!(health.tick(beat + 1, 0, false));
    for silent in 1..BACKGROUND_SILENCE {
        assert!(health.tick(beat + 1, 0, false), "{silent}");
    }
    assert!(!health.tick(beat + 1, 0, false));
}

#[test]
fn the_watchdog_is_starved_by_a_controller_that_is_too_slow_for_good() {
    let mut health = Health::new();
    for beat in 0..63 {
        assert!(health.tick(beat, 1, true));
    }
    assert!(health.tick(100, 0, true));
    for beat in 0..63 {
        assert!(health.tick(beat, 1, true));
    }
    assert!(!health.tick(200, 1, true));
}
