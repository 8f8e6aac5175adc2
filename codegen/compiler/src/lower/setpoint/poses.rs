//! Poses of the platform along the declared trajectories, for checks.

use super::{User, paper, table};
use crate::ir::{Path, Setpoints};
use specgen_language::diagnostic::Diagnostic;
use specgen_language::model::{Model, TaskSpace, TrajectoryKind};

/// Poses per analytic piece; its fastest motion makes a few turns.
const A_PIECE: u32 = 4000;
/// Poses between two rows of a table.
const A_ROW: u32 = 4;

/// Poses at even intervals, without a joint between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// s from one pose to the next.
    pub interval: f64,
    /// Poses from rest, m and rad, bias and frames included.
    pub poses: Vec<[f64; 6]>,
}

/// For each trajectory, in the order of the spec: its stretches from joint to joint.
///
/// # Errors
/// Frames that [`super::lower`] refuses.
pub fn stretches(model: &Model, task: &TaskSpace, setpoints: &Setpoints) -> Result<Vec<Vec<Stretch>>, Vec<Diagnostic>> {
    let user = User::of(model, task)?;
    let lowered = task.trajectories.iter().zip(&setpoints.trajectories);
    Ok(lowered
        .map(|(declared, lowered)| {
            let mut stretches = along(&declared.kind, &lowered.path);
            for stretch in &mut stretches {
                stretch.poses = stretch.poses.iter().filter_map(|pose| user.pose(*pose)).collect();
            }
            stretches
        })
        .collect())
}

/// The same of one trajectory, in the user's coordinates.
pub(super) fn along(kind: &TrajectoryKind, path: &Path) -> Vec<Stretch> {
    match (paper::formula(kind), path) {
        (Some((pieces, frequency)), _) => analytic(frequency, &pieces),
        (None, Path::Table { rows, .. }) => {
            let between = rows.windows(2).flat_map(|pair| {
                (0..A_ROW).map(|k| table::at(&pair[0], &pair[1], f64::from(k) / f64::from(A_ROW), 1.0).0)
            });
            let poses = between.chain(rows.last().map(|row| row.pose)).collect();
            vec![Stretch { interval: kind.rate().1 / f64::from(A_ROW), poses }]
        }
        (None, Path::Segments { .. }) => Vec::new(),
    }
}

fn analytic(frequency: f64, pieces: &[paper::Piece]) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    let mut begin = 0.0;
    for piece in pieces {
        let interval = (piece.end - begin) / f64::from(A_PIECE);
        let at = |k: u32| piece.at(begin + interval * f64::from(k), frequency).0;
        stretches.push(Stretch { interval, poses: (0..=A_PIECE).map(at).collect() });
        begin = piece.end;
    }
    stretches
}
