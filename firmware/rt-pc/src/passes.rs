//! The player of passes, as the service sees it: away during a pass, here between passes.

use controller::passes;
use specgen_link::PassStatus;
use specgen_runtime::learning::Settings;
use specgen_runtime::pass::{self, Course, Stage};
use specgen_runtime::playback::Knot;

use crate::handover::Player;

/// Knots of its memory, one half of them for corrections: 3 MiB.
const MEMORY: usize = 1 << 17;
/// Steps of learning in a round of the service, which has others to serve: some milliseconds.
const STEPS: u32 = 1000;

/// The player's other side.
pub struct Passes {
    here: Option<Player>,
}

impl Passes {
    /// With a player, where the controller takes a correction.
    pub fn new() -> Self {
        let memory = || vec![[0; 6]; MEMORY].leak();
        Self { here: passes::POSSIBLE.then(|| Box::new(pass::Player::new(memory()))) }
    }

    /// Whether a pass is under way, or the order for it.
    pub fn is_running(&self) -> bool {
        passes::POSSIBLE && self.here.is_none()
    }

    /// Whether a pass is under way, or learned from.
    pub fn is_busy(&self) -> bool {
        passes::POSSIBLE && self.here.as_ref().is_none_or(|player| player.is_busy())
    }

    /// How it stands; none where there are no passes.
    pub fn status(&self) -> Option<PassStatus> {
        let away = PassStatus { stage: Stage::Running.word(), status: 0, knots: 0, capacity: MEMORY as u32 / 2 };
        passes::POSSIBLE.then(|| self.here.as_ref().map_or(away, standing))
    }

    /// Takes knots of the correction; false during a pass, or where there is no room.
    pub fn put(&mut self, first: u32, knots: impl ExactSizeIterator<Item = Knot>) -> bool {
        self.here.as_mut().is_some_and(|player| player.put(first as usize, knots))
    }

    /// The player for a pass; none during another one, or if it cannot make this one.
    pub fn begin(&mut self, course: Course) -> Option<Player> {
        self.here.take_if(|player| player.begin(course))
    }

    /// What the last pass kept of the error; none during one.
    pub fn errors(&self) -> Option<&[Knot]> {
        self.here.as_ref().map(|player| player.errors())
    }

    /// The correction that the next pass plays; none during one.
    pub fn correction(&self) -> Option<&[Knot]> {
        self.here.as_ref().map(|player| player.correction())
    }

    /// Makes the correction of the next pass from here on; false if no pass came to its end, or there is no plan for it.
    pub fn learn(&mut self, settings: Settings) -> bool {
        self.here.as_mut().is_some_and(|player| player.learn(settings))
    }

    /// Learns a little, where there is something to learn.
    pub fn work(&mut self) {
        if let Some(player) = &mut self.here {
            player.work(STEPS);
        }
    }

    /// The player comes back; the trajectory that it began.
    pub fn receive(&mut self, player: Player) -> Option<u32> {
        let begun = player.begun();
        self.here = Some(player);
        begun
    }
}

fn standing(player: &Player) -> PassStatus {
    PassStatus {
        stage: player.stage().word(),
        status: player.status(),
        knots: player.errors().len() as u32,
        capacity: player.capacity() as u32,
    }
}
