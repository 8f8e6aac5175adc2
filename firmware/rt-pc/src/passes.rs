//! The player of passes, as the service sees it: away during a pass, here between passes.

use controller::{Real, passes};
use specgen_board::pass_status;
use specgen_link::PassStatus;
use specgen_runtime::learning::Settings;
use specgen_runtime::pass::{self, Course, Stage};
use specgen_runtime::playback::Knot;

use crate::handover::Player;

/// Knots of its memory, one half of them for corrections: 3 MiB.
const MEMORY: usize = 1 << 17;
/// Steps of learning per round of the service, which also serves others: some milliseconds.
const STEPS: u32 = 1000;

/// The player's other side.
pub struct Passes {
    here: Option<Player>,
}

impl Passes {
    /// With a player, if the controller takes a correction.
    pub fn new() -> Self {
        let memory = || vec![[0; 6]; MEMORY].leak();
        Self { here: passes::POSSIBLE.then(|| Box::new(pass::Player::new(memory()))) }
    }

    /// Whether a pass is under way, or commanded.
    pub fn is_running(&self) -> bool {
        passes::POSSIBLE && self.here.is_none()
    }

    /// Whether a pass is under way, or learning from one.
    pub fn is_busy(&self) -> bool {
        passes::POSSIBLE && self.here.as_ref().is_none_or(|player| player.is_busy())
    }

    /// Its status; none if there are no passes.
    pub fn status(&self) -> Option<PassStatus> {
        let away = PassStatus { stage: Stage::Running.word(), status: 0, knots: 0, capacity: MEMORY as u32 / 2 };
        passes::POSSIBLE.then(|| self.here.as_ref().map_or(away, |player| pass_status(player)))
    }

    /// Stores knots of the correction; false during a pass, or if they do not fit.
    pub fn put(&mut self, first: u32, knots: impl ExactSizeIterator<Item = Knot>) -> bool {
        self.here.as_mut().is_some_and(|player| player.put(first as usize, knots))
    }

    /// The player for a pass; none during another one, or if the pass is invalid.
    pub fn begin(&mut self, course: Course) -> Option<Player> {
        self.here.take_if(|player| player.begin(course))
    }

    /// The player between two passes; none while it learns, when its knots are half-computed.
    pub fn player(&self) -> Option<&pass::Player<'static, Real>> {
        self.here.as_deref().filter(|player| !player.is_busy())
    }

    /// Starts to compute the correction of the next pass; false if no pass is complete, or there is no plan for it.
    pub fn learn(&mut self, settings: Settings) -> bool {
        self.here.as_mut().is_some_and(|player| player.learn(settings))
    }

    /// Does some steps of learning, if there are any.
    pub fn work(&mut self) {
        if let Some(player) = &mut self.here {
            player.work(STEPS);
        }
    }

    /// Takes the player back; returns the trajectory that it started.
    pub fn receive(&mut self, player: Player) -> Option<u32> {
        let begun = player.begun();
        self.here = Some(player);
        begun
    }
}

#[cfg(test)]
impl Passes {
    /// With a player of this many knots, even if the controller takes no correction.
    pub fn with(knots: usize) -> Self {
        Self { here: Some(Box::new(pass::Player::new(vec![[0; 6]; knots].leak()))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COURSE: Course = Course { spacing: 1, before: 1, ticks: 3, trajectory: 5 };

    #[test]
    fn a_player_is_away_for_its_pass_and_comes_back_with_what_it_kept() {
        let mut passes = Passes::with(8);
        let knots = [[1; 6], [2; 6], [3; 6]];
        assert!(passes.put(0, knots.into_iter()) && !passes.put(2, knots.into_iter()));
        assert!(!passes.learn(Settings { reach: 0, fade: [0, 0] }), "there was no pass");
        assert!(passes.begin(Course { ticks: 0, ..COURSE }).is_none());
        let mut player = passes.begin(COURSE).unwrap();
        assert!(passes.begin(COURSE).is_none() && !passes.put(0, knots.into_iter()));
        assert!(passes.player().is_none());
        assert_eq!((passes.is_running(), passes.is_busy()), (passes::POSSIBLE, passes::POSSIBLE));
        for _ in 0..4 {
            let _ = player.give();
            player.keep(&[1e-9; 6], &[0.0; 6], 4);
        }
        let found = pass_status(&player);
        assert_eq!((found.stage, found.status, found.knots, found.capacity), (Stage::Complete.word(), 4, 3, 4));
        assert_eq!(passes.receive(player), Some(5));
        assert_eq!(passes.player().unwrap().errors(), [[1000; 6]; 3]);
        assert_eq!(passes.player().unwrap().correction(), knots);
        assert!(!passes.is_running() && !passes.is_busy());
        // An aborted one had begun nothing.
        let mut player = passes.begin(COURSE).unwrap();
        player.abort();
        assert_eq!(passes.receive(player), None);
        assert_eq!(passes.status().is_some(), passes::POSSIBLE);
        assert_eq!(Passes::new().here.is_some(), passes::POSSIBLE);
    }

    #[test]
    fn a_pass_that_came_to_its_end_is_learned_from_with_the_plan_behind_its_knots() {
        let mut passes = Passes::with(64);
        let mut plan = [[0.0_f32; 6]; 14];
        for (place, row) in plan.iter_mut().enumerate() {
            match place {
                // Modes that are the axes; half of the error; all of the correction.
                0..12 => row[place % 6] = 1.0,
                12 => *row = [0.5; 6],
                _ => row[0] = 1.0,
            }
        }
        let rows = plan.map(|row| row.map(|number| number.to_bits() as i32));
        assert!(passes.put(0, [[1; 6], [2; 6], [3; 6]].into_iter()) && passes.put(3, rows.into_iter()));
        let mut player = passes.begin(COURSE).unwrap();
        for _ in 0..4 {
            let _ = player.give();
            player.keep(&[1e-9; 6], &[0.0; 6], 0);
        }
        passes.receive(player);
        assert!(passes.learn(Settings { reach: 0, fade: [0, 0] }));
        assert!(!passes.put(0, [[0; 6]].into_iter()) && passes.player().is_none(), "while it learns");
        passes.work();
        assert_eq!(passes.player().unwrap().correction(), [[501; 6], [502; 6], [503; 6]]);
        assert!(passes.begin(COURSE).is_some());
    }
}
