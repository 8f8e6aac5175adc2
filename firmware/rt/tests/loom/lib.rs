//! The words of `specgen_rt::exchange`, the file itself, under loom: every interleaving of the two sides with at most
//! [`PREEMPTIONS`] switches that neither asked for, and within each every value that C11 lets a load see.
//!
//! That the checker would find a mistake is shown too: each order that the file asks for, weakened alone, breaks a model.
//! What is smaller here than there: one channel for six, and few tries, as a block's words are all treated alike.
#![cfg(test)]

#[path = "../../src/exchange/words.rs"]
#[allow(dead_code, reason = "what the file's header holds is read and written elsewhere")]
mod words;

/// Loom's atomics, an order of which may be weakened.
mod atomic {
    use std::sync::LazyLock;

    use loom::sync::atomic as checked;
    pub use loom::sync::atomic::Ordering;

    /// The order that this process leaves out: `store Release`, `load Acquire`, `fence Release`, `fence Acquire`, or `SeqCst`.
    static WEAKENED: LazyLock<String> = LazyLock::new(|| std::env::var(super::WEAKENED).unwrap_or_default());

    /// The order itself, or as if the file asked for none.
    fn of(operation: &str, order: Ordering) -> Ordering {
        if *WEAKENED == format!("{operation} {order:?}") { Ordering::Relaxed } else { order }
    }

    /// Loom takes an access in the one order of all such (`SeqCst`) for acquire and release. The fence before it gives that order
    /// back: it is what a compiler puts there for a processor that has fences alone.
    fn before(order: Ordering) {
        if order == Ordering::SeqCst && *WEAKENED != "SeqCst" {
            checked::fence(order);
        }
    }

    pub fn fence(order: Ordering) {
        match of("fence", order) {
            Ordering::Relaxed => {}
            order => checked::fence(order),
        }
    }

    macro_rules! atomic {
        ($name:ident, $integer:ty) => {
            #[derive(Default)]
            pub struct $name(checked::$name);

            #[allow(dead_code, reason = "each is used where the file needs it")]
            impl $name {
                pub fn load(&self, order: Ordering) -> $integer {
                    before(order);
                    self.0.load(of("load", order))
                }

                pub fn store(&self, value: $integer, order: Ordering) {
                    self.0.store(value, of("store", order));
                }

                pub fn fetch_add(&self, value: $integer, order: Ordering) -> $integer {
                    before(order);
                    self.0.fetch_add(value, order)
                }

                pub fn fetch_sub(&self, value: $integer, order: Ordering) -> $integer {
                    before(order);
                    self.0.fetch_sub(value, order)
                }
            }
        };
    }

    atomic!(AtomicU32, u32);
    atomic!(AtomicU64, u64);
}

use loom::hint;

const CHANNELS: usize = 1;
const TRIES: usize = 2;
/// Nobody looks before he sleeps: what looking sees, the look before sleeping sees.
const LOOK: u64 = 0;
const PREEMPTIONS: usize = 3;
/// Variable of the environment that names an order to leave out.
const WEAKENED: &str = "SPECGEN_WEAKENED";

mod clock {
    /// It stands still: nobody loses patience, so whoever is not woken sleeps for ever, which loom reports.
    pub fn now() -> u64 {
        0
    }
}

/// The kernel's futex: it looks at the word and lines up under one lock, and whoever wakes takes that lock too.
mod mapping {
    use loom::sync::{Condvar, Mutex};

    use super::atomic::{AtomicU32, Ordering};

    loom::lazy_static! {
        static ref QUEUE: (Mutex<()>, Condvar) = (Mutex::new(()), Condvar::new());
    }

    pub fn wake(_: &AtomicU32) {
        let _line = QUEUE.0.lock().unwrap();
        QUEUE.1.notify_all();
    }

    pub fn sleep(bell: &AtomicU32, seen: u32, _: u64) {
        let line = QUEUE.0.lock().unwrap();
        loom::sync::atomic::fence(Ordering::SeqCst);
        if bell.load(Ordering::Relaxed) == seen {
            drop(QUEUE.1.wait(line).unwrap());
        }
    }
}

mod tests {
    use std::process::Command;
    use std::sync::atomic::{AtomicU64, Ordering};

    use loom::sync::Arc;
    use loom::thread;

    use super::words::{Sensing, SharedWords};
    use super::{PREEMPTIONS, WEAKENED};

    const SESSION: u64 = 7;
    const FOR_EVER: u64 = u64::MAX;

    /// Runs a model in every way; `least` is less than there are.
    fn explore(name: &str, least: u64, model: fn()) {
        let runs = std::sync::Arc::new(AtomicU64::new(0));
        let count = runs.clone();
        let mut builder = loom::model::Builder::new();
        builder.preemption_bound = Some(PREEMPTIONS);
        builder.check(move || {
            count.fetch_add(1, Ordering::Relaxed);
            model();
        });
        let runs = runs.load(Ordering::Relaxed);
        println!("{name}: {runs} runs");
        assert!(runs > least, "{name}: {runs} runs");
    }

    /// A reading whose words all tell its tick.
    fn reading(tick: u64) -> Sensing {
        Sensing { session: SESSION, tick, codes: [tick as i32], wrench: [tick] }
    }

    /// A controller looks, without waiting, while readings are given out.
    fn looking() {
        let words = Arc::new(SharedWords::default());
        let machine = {
            let words = words.clone();
            thread::spawn(move || (1..=2).for_each(|tick| words.publish(&reading(tick))))
        };
        for tick in 1..=2 {
            if let Some(seen) = words.sense(SESSION, tick, 0) {
                assert_eq!(seen, reading(tick), "half written");
            }
        }
        machine.join().unwrap();
    }

    /// A machine waits for the second of two orders: it sees it, and each that it sees is whole.
    fn waiting() {
        let words = Arc::new(SharedWords::default());
        let controller = {
            let words = words.clone();
            thread::spawn(move || (1..=2).for_each(|tick| words.actuate(SESSION, tick, true, &[tick as i32])))
        };
        let mut seen = 0;
        let mut last = 0;
        while last < 2 {
            if let Some((order, _)) = words.wait(&mut seen, 0, FOR_EVER) {
                assert!(order.tick >= last, "an older order after a newer one");
                assert!(order.codes == [order.tick as i32] && (order.tick == 0 || order.enable), "half written");
                last = order.tick;
            }
        }
        controller.join().unwrap();
    }

    /// A controller gives two orders out and asks for the tick after them: no machine goes through that tick under an older order.
    fn asking() {
        let words = Arc::new(SharedWords::default());
        let controller = {
            let words = words.clone();
            thread::spawn(move || {
                (3..=4).for_each(|tick| words.actuate(SESSION, tick, true, &[9]));
                let _ = words.sense(SESSION, 5, 0);
            })
        };
        let mut seen = 0;
        let mut asked = 0;
        while asked != 5 {
            let Some((order, wanted)) = words.wait(&mut seen, 0, FOR_EVER) else { continue };
            asked = wanted[1];
            assert!(asked != 5 || order.tick == 4, "wanted without the order before it");
        }
        controller.join().unwrap();
    }

    /// Two ticks of a controller on a machine: each waits for the other, and nobody sleeps for ever.
    fn ticking() {
        let words = Arc::new(SharedWords::default());
        let machine = {
            let words = words.clone();
            thread::spawn(move || {
                let mut seen = 0;
                loop {
                    let Some((order, wanted)) = words.wait(&mut seen, 0, FOR_EVER) else { continue };
                    // Which tick is wanted is at least as new as of which session.
                    assert!(wanted[0] == 0 || [4, 5].contains(&wanted[1]), "wanted of no session: {wanted:?}");
                    if order.session == SESSION {
                        assert_eq!((order.tick, order.codes), (4, [9]), "half written");
                        return words.publish(&reading(5));
                    }
                    if wanted[0] == SESSION {
                        words.publish(&reading(4));
                    }
                }
            })
        };
        assert_eq!(words.sense(SESSION, 4, FOR_EVER), Some(reading(4)));
        words.actuate(SESSION, 4, true, &[9]);
        assert_eq!(words.sense(SESSION, 5, FOR_EVER), Some(reading(5)));
        machine.join().unwrap();
    }

    #[test]
    fn a_reading_is_never_half_written() {
        explore("looking", 100_000, looking);
    }

    #[test]
    fn an_order_is_never_half_written_nor_slept_through() {
        explore("waiting", 10_000, waiting);
    }

    #[test]
    fn who_sees_a_tick_asked_for_sees_the_order_of_the_one_before() {
        explore("asking", 1_000, asking);
    }

    #[test]
    fn neither_side_sleeps_for_ever() {
        explore("ticking", 10_000, ticking);
    }

    /// In processes of their own: one that sleeps for ever ends in an abort.
    #[test]
    fn the_checker_notices_each_order_that_is_left_out() {
        let reading = "a_reading_is_never_half_written";
        let order = "an_order_is_never_half_written_nor_slept_through";
        for (weakened, test, noticed) in [
            ("store Release", reading, "half written"),
            ("load Acquire", reading, "half written"),
            ("fence Release", reading, "half written"),
            ("fence Acquire", reading, "half written"),
            ("store Release", order, "half written"),
            ("SeqCst", order, "deadlock"),
        ] {
            let program = std::env::current_exe().unwrap();
            let run =
                Command::new(program).args(["--exact", &format!("tests::{test}")]).env(WEAKENED, weakened).output();
            let run = run.unwrap();
            let said = String::from_utf8_lossy(&[run.stdout, run.stderr].concat()).into_owned();
            assert!(!run.status.success() && said.contains(noticed), "without {weakened}: {said}");
        }
    }
}
