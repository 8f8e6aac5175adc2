//! Conditioning of the geometry: singular values of J, with angles as motion at the joint radius.

use nalgebra::Matrix6;
use serde::Serialize;
use specgen_numerics::jacobian;
use specgen_runtime::Platform;

use super::Pose;

/// Singular values of J with the columns of angles divided by the joint radius, so that they have no unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conditioning {
    /// σ_max/σ_min at rest.
    pub at_rest: f64,
    /// Largest over corners and interior of the declared workspace.
    pub worst: f64,
    /// Where that is.
    pub worst_pose: Pose,
    /// Smallest σ over the same poses: 0 is a singular pose.
    pub smallest_singular_value: f64,
    /// Within this motion of the joints beyond the workspace there is no singular pose, m: a lower estimate, of
    /// first order in the motion.
    pub free_of_singularities: f64,
    /// Upper bound of the condition number over the declared workspace, to second order in the motion; `f64::MAX` if there is
    /// none.
    pub worst_bound: f64,
    /// Smallest and largest σ at rest.
    pub at_rest_values: [f64; 2],
}

impl Conditioning {
    /// Adds the bound over the whole box: from the largest motion of any joint, and the rate of change of the singular values as
    /// in `free_of_singularities`.
    pub(super) fn bounded(mut self, bounds: &Pose, shortest_leg: f64, joint_radius: f64) -> Self {
        let turn = bounds[3] + bounds[4] + bounds[5];
        let motion = libm::sqrt(bounds[0] * bounds[0] + bounds[1] * bounds[1] + bounds[2] * bounds[2])
            + libm::expm1(turn) * joint_radius;
        let change = libm::sqrt(6.0) * 2.0 * (1.0 / shortest_leg + 1.0 / joint_radius) * motion;
        let [smallest, largest] = self.at_rest_values;
        self.worst_bound = if smallest > change { (largest + change) / (smallest - change) } else { f64::MAX };
        self
    }

    /// The first of `poses` is rest.
    pub(super) fn over(
        platform: &Platform<f64>,
        poses: impl Iterator<Item = Pose>,
        shortest_leg: f64,
        joint_radius: f64,
    ) -> Self {
        let mut found: Option<Self> = None;
        for pose in poses {
            let [smallest, largest] = singular_values(&jacobian(platform, &pose), joint_radius);
            let condition = if smallest > 0.0 { largest / smallest } else { f64::MAX };
            let one = found.get_or_insert(Self {
                at_rest: condition,
                worst: condition,
                worst_pose: pose,
                smallest_singular_value: smallest,
                free_of_singularities: 0.0,
                worst_bound: f64::MAX,
                at_rest_values: [smallest, largest],
            });
            if condition > one.worst {
                one.worst = condition;
                one.worst_pose = pose;
            }
            if smallest < one.smallest_singular_value {
                one.smallest_singular_value = smallest;
            }
        }
        let mut found = found.unwrap_or(Self {
            at_rest: f64::MAX,
            worst: f64::MAX,
            worst_pose: [0.0; 6],
            smallest_singular_value: 0.0,
            free_of_singularities: 0.0,
            worst_bound: f64::MAX,
            at_rest_values: [0.0; 2],
        });
        // A joint that moves by ε turns its leg by up to ε/l and its arm by up to ε/r: a row of J changes by twice the sum
        // at most, the six of them by √6 times that, and J stays regular while that is below σ_min.
        found.free_of_singularities =
            found.smallest_singular_value / (libm::sqrt(6.0) * 2.0 * (1.0 / shortest_leg + 1.0 / joint_radius));
        found
    }
}

/// Smallest and largest.
fn singular_values(jacobian: &[[f64; 6]; 6], joint_radius: f64) -> [f64; 2] {
    let scaled = Matrix6::from_fn(|i, j| if j < 3 { jacobian[i][j] } else { jacobian[i][j] / joint_radius });
    let values = scaled.singular_values();
    [values.min(), values.max()]
}
