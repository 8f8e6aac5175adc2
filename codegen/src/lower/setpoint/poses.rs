//! Poses of the platform along the declared trajectories, for checks that need them all.

use super::{User, paper, table};
use crate::diagnostic::Diagnostic;
use crate::ir::{Path, Setpoints};
use crate::model::{Model, TaskSpace, TrajectoryKind};

/// Poses looked at on an analytic piece; its fastest motion makes a few turns.
const A_PIECE: u32 = 4000;
/// Poses looked at between two rows of a table.
const A_ROW: u32 = 4;

/// For each trajectory, in the order of the spec: poses from rest along it, m and rad, bias and frames included.
///
/// # Errors
/// Frames that [`super::lower`] refuses.
pub fn poses(model: &Model, task: &TaskSpace, setpoints: &Setpoints) -> Result<Vec<Vec<[f64; 6]>>, Vec<Diagnostic>> {
    let user = User::of(model, task)?;
    let along = |kind: &TrajectoryKind, path: &Path| match (kind, path) {
        (TrajectoryKind::Paper { path, as_printed, frequency }, _) => {
            analytic(*frequency, &paper::pieces(*path, *as_printed, *frequency))
        }
        (TrajectoryKind::Waveform { .. }, Path::Table { rows, .. }) => {
            let between = rows.windows(2).flat_map(|pair| {
                (0..A_ROW).map(|k| table::at(&pair[0], &pair[1], f64::from(k) / f64::from(A_ROW), 1.0).0)
            });
            between.chain(rows.last().map(|row| row.pose)).collect()
        }
        (TrajectoryKind::Waveform { .. }, Path::Segments { .. }) => Vec::new(),
    };
    let lowered = task.trajectories.iter().zip(&setpoints.trajectories);
    Ok(lowered
        .map(|(declared, lowered)| {
            let poses: Vec<[f64; 6]> = along(&declared.kind, &lowered.path);
            poses.into_iter().filter_map(|pose| user.pose(pose)).collect()
        })
        .collect())
}

fn analytic(frequency: f64, pieces: &[paper::Piece]) -> Vec<[f64; 6]> {
    let mut poses = Vec::new();
    let mut begin = 0.0;
    for piece in pieces {
        for k in 0..=A_PIECE {
            let time = begin + (piece.end - begin) * f64::from(k) / f64::from(A_PIECE);
            poses.push(piece.at(time, frequency).0);
        }
        begin = piece.end;
    }
    poses
}
