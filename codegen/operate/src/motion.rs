//! Workspace, speed and coordinates of a platform, from its controller's description.

use specgen_runtime::setpoint::{Frames, Target, Tool, Work};

/// Share of the stroke at either end that is kept free for corrections; `specgen check` warns of a bias there.
const ROOM: f64 = 0.01;
/// Tolerance for rounding, as a share of the stroke.
const SLACK: f64 = 1e-9;
/// Iterations of the inverse coordinates. Each multiplies the residual by at most the largest angle, 0.3 rad.
const PASSES: u32 = 60;
/// Bisection steps for the end of a range.
const HALVINGS: u32 = 60;

/// Conversion between poses of the user and of the platform, m and rad, and limits. The device decides: it may compute in f32.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Pose of the platform, from rest, at the user's zero.
    origin: [f64; 6],
    /// Largest |component| of a pose of the platform.
    bound: [f64; 6],
    speed: [f64; 6],
    /// Stroke of every leg, m.
    stroke: f64,
    /// Part of the stroke at either end that is kept free for corrections, m.
    room: f64,
    /// Each leg at rest in the base frame, and its joint in the platform's, m.
    legs: [Leg; 6],
    frames: Coordinates,
    trajectories: Vec<String>,
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    rest: [f64; 3],
    joint: [f64; 3],
}

/// The limit that a pose exceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Binding {
    /// The workspace.
    Axis {
        /// Index of the axis in a pose.
        axis: usize,
        /// Position relative to rest, including the bias, m or rad.
        at: f64,
        /// Its bound, m or rad.
        bound: f64,
    },
    /// The stroke of a leg, less the room for corrections.
    Leg {
        /// Its number.
        leg: usize,
        /// Its displacement, m.
        at: f64,
        /// Permitted range, m.
        range: [f64; 2],
    },
}

#[derive(Debug, Clone, Copy)]
enum Coordinates {
    Parallel,
    Tool(Tool<f64>),
    Work(Work<f64>),
}

impl Motion {
    /// Parses a controller's description; none for six legs, which have no pose.
    ///
    /// # Errors
    /// The description of a platform lacks a line, or it is invalid.
    pub fn parse(text: &str) -> Result<Option<Self>, String> {
        let line = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
        if line("kind") != Some("platform") {
            return Ok(None);
        }
        let lacks = |key| format!("the controller's description lacks `{key}`: build and flash it with this specgen");
        let six = |key| line(key).and_then(numbers).ok_or_else(|| lacks(key));
        let angle =
            || line("largest_angle").and_then(numbers).map(|[angle]: [f64; 1]| angle).ok_or(lacks("largest_angle"));
        let frames = match line("tool").map(|text| numbers(text).ok_or_else(|| lacks("tool"))).transpose()? {
            None => Coordinates::Parallel,
            Some(point) => match line("axes") {
                None => Coordinates::Tool(Tool { point, largest_angle: angle()? }),
                Some(axes) => {
                    let [a, b, c, d, e, f, g, h, i] = numbers(axes).ok_or_else(|| lacks("axes"))?;
                    Coordinates::Work(Work { axes: [[a, b, c], [d, e, f], [g, h, i]], point, largest_angle: angle()? })
                }
            },
        };
        let names = line("trajectories").ok_or_else(|| lacks("trajectories"))?;
        let trajectories = names.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        let joints = |key| line(key).and_then(numbers::<18>).ok_or_else(|| lacks(key));
        let (rest, joint) = (joints("rest_leg")?, joints("platform_joint")?);
        let three = |all: &[f64; 18], leg: usize| core::array::from_fn(|axis| all[3 * leg + axis]);
        let legs = core::array::from_fn(|leg| Leg { rest: three(&rest, leg), joint: three(&joint, leg) });
        let [stroke] = line("stroke").and_then(numbers).ok_or_else(|| lacks("stroke"))?;
        let [origin, bound, speed] = [six("origin")?, six("bound")?, six("speed")?];
        let mut motion = Self { origin, bound, speed, stroke, room: ROOM * stroke, legs, frames, trajectories };
        if !motion.admits(&[0.0; 6]) {
            // The spec leaves no room at the bias: permit the whole stroke, with a tolerance for rounding.
            motion.room = -SLACK * stroke;
        }
        Ok(Some(motion))
    }

    /// Largest speed of moves, m/s and rad/s.
    #[must_use]
    pub fn speed(&self) -> &[f64; 6] {
        &self.speed
    }

    /// Trajectories of the controller, by the value of the word `selector`.
    #[must_use]
    pub fn trajectories(&self) -> &[String] {
        &self.trajectories
    }

    /// Converts to a pose of the platform relative to rest, which may be outside its workspace; none if an angle is too large.
    #[must_use]
    pub fn platform(&self, user: &[f64; 6]) -> Option<[f64; 6]> {
        let target = Target::at(*user);
        let moved = match &self.frames {
            Coordinates::Parallel => Some(target),
            Coordinates::Tool(frames) => frames.to_platform(&target),
            Coordinates::Work(frames) => frames.to_platform(&target),
        };
        let mut pose = moved?.pose;
        for (value, origin) in pose.iter_mut().zip(self.origin) {
            *value += origin;
        }
        Some(pose)
    }

    /// Converts a pose of the platform to the user's coordinates, m and rad.
    #[must_use]
    pub fn user(&self, pose: &[f64; 6]) -> Option<[f64; 6]> {
        let axes = match &self.frames {
            Coordinates::Work(Work { axes, .. }) => Some(axes),
            Coordinates::Parallel | Coordinates::Tool(_) => None,
        };
        inverse(|user| self.platform(user), axes, pose)
    }

    /// Displacement of each leg from rest at a pose of the platform, m.
    #[must_use]
    pub fn displacements(&self, pose: &[f64; 6]) -> [f64; 6] {
        let [x, y, z, tilt_x, tilt_y, tilt_z] = *pose;
        let turn = rotation([tilt_x, tilt_y, tilt_z]);
        self.legs.map(|Leg { rest, joint }| {
            let [[now_x, old_x], [now_y, old_y], [now_z, old_z]] = core::array::from_fn(|row| {
                let turned: f64 = (0..3).map(|column| turn[row][column] * joint[column]).sum();
                [rest[row] + [x, y, z][row] + (turned - joint[row]), rest[row]]
            });
            let length = |x: f64, y: f64, z: f64| libm::sqrt(x * x + y * y + z * z);
            length(now_x, now_y, now_z) - length(old_x, old_y, old_z)
        })
    }

    /// Whether the platform can reach a pose: within its workspace, and with room for every leg.
    #[must_use]
    pub fn admits(&self, user: &[f64; 6]) -> bool {
        self.binding(user).is_none()
    }

    /// The limit that a pose exceeds most; none if it can be reached.
    #[must_use]
    pub fn binding(&self, user: &[f64; 6]) -> Option<Binding> {
        let pose = self.platform(user).unwrap_or(*user);
        // A value that is not finite exceeds every limit.
        let excess = |value: f64, bound: f64| if value.is_finite() { value.abs() / bound } else { f64::INFINITY };
        let axes = (0..6).map(|axis| {
            (excess(pose[axis], self.bound[axis]), Binding::Axis { axis, at: pose[axis], bound: self.bound[axis] })
        });
        let range = [self.room, self.stroke - self.room];
        let half = 0.5 * self.stroke;
        let legs = self.displacements(&pose).into_iter().enumerate();
        let legs = legs.map(|(leg, at)| (excess(at - half, half - self.room), Binding::Leg { leg, at, range }));
        let worst = |worst: Option<(f64, Binding)>, one: (f64, Binding)| match worst {
            Some(worst) if worst.0 >= one.0 => Some(worst),
            _ => Some(one),
        };
        axes.chain(legs).filter(|(excess, _)| *excess > 1.0).fold(None, worst).map(|(_, binding)| binding)
    }
}

/// Least and largest value of one axis that `admits`, with the others as in `pose`.
#[must_use]
pub fn limits(admits: impl Fn(&[f64; 6]) -> bool, pose: &[f64; 6], axis: usize) -> [f64; 2] {
    let way = |sign: f64| core::array::from_fn(|other| if other == axis { sign } else { 0.0 });
    [pose[axis] - reach(&admits, pose, &way(-1.0)), pose[axis] + reach(&admits, pose, &way(1.0))]
}

/// R = Rz Ry Rx (AI.1) of three angles, rad.
pub(crate) fn rotation(angles: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(|angle| (libm::sin(angle), libm::cos(angle)));
    [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
}

/// The pose that `forward` maps to `wanted`. Its Jacobian must be near `axes`, or near the identity without them.
pub(crate) fn inverse(
    forward: impl Fn(&[f64; 6]) -> Option<[f64; 6]>,
    axes: Option<&[[f64; 3]; 3]>,
    wanted: &[f64; 6],
) -> Option<[f64; 6]> {
    let mut pose = [0.0; 6];
    for _ in 0..PASSES {
        let found = forward(&pose)?;
        let left: [f64; 6] = core::array::from_fn(|axis| wanted[axis] - found[axis]);
        if left == [0.0; 6] {
            break;
        }
        for (axis, value) in pose.iter_mut().enumerate() {
            let (column, first) = (axis % 3, axis - axis % 3);
            *value += axes.map_or(left[axis], |axes| (0..3).map(|row| axes[row][column] * left[first + row]).sum());
        }
    }
    Some(pose)
}

/// Distance from `start` along `way` up to which `admits` holds, as a multiple of `way`; 0 if `start` is not admitted.
pub(crate) fn reach(admits: impl Fn(&[f64; 6]) -> bool, start: &[f64; 6], way: &[f64; 6]) -> f64 {
    let at = |far: f64| -> [f64; 6] { core::array::from_fn(|axis| start[axis] + far * way[axis]) };
    if !admits(start) || way.iter().all(|value| *value == 0.0) {
        return 0.0;
    }
    // Any unit: the bracket grows from far below the resolution to far beyond any range.
    let (mut inside, mut outside) = (0.0, 1e-12);
    while admits(&at(outside)) && outside < 1e12 {
        (inside, outside) = (outside, 2.0 * outside);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if admits(&at(middle)) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let values: Option<Vec<f64>> =
        text.split(',').map(|text| text.parse().ok().filter(|value: &f64| value.is_finite())).collect();
    values?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Upright legs: the displacement of each is that of its joint in z.
    fn described(origin_z: f64, more: &str) -> String {
        let joints = "0.1,0,0,0.05,0.08,0,-0.05,0.08,0,-0.1,0,0,-0.05,-0.08,0,0.05,-0.08,0";
        let rest = ["0,0,0.2"; 6].join(",");
        format!(
            "kind=platform\norigin=0.0,0.0,{origin_z:?},0.0,0.0,0.0\nbound=5e-5,5e-5,5.2e-5,4e-4,3.5e-4,5e-4\n\
             speed=1e-4,1e-4,1e-4,1e-3,1e-3,1e-3\nstroke=7e-5\nrest_leg={rest}\nplatform_joint={joints}\n\
             trajectories=a,b\n{more}"
        )
    }

    fn of(more: &str) -> Motion {
        Motion::parse(&described(1e-5, more)).unwrap().unwrap()
    }

    #[test]
    fn the_box_about_the_bias_is_what_can_be_reached() {
        let motion = of("");
        assert!(Motion::parse("kind=legs\n").unwrap().is_none());
        assert!(Motion::parse("kind=platform\n").unwrap_err().contains("lacks `trajectories`"));
        assert_eq!(motion.trajectories(), ["a", "b"]);
        let close = |found: [f64; 2], expected: [f64; 2]| {
            assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-13), "{found:?}");
        };
        // Upwards the workspace limits z, downwards the stroke of the legs less a hundredth.
        close(limits(|pose| motion.admits(pose), &[0.0; 6], 2), [-9.3e-6, 4.2e-5]);
        close(limits(|pose| motion.admits(pose), &[4e-5, 0.0, 0.0, 0.0, 0.0, 0.0], 0), [-5e-5, 5e-5]);
        assert!(motion.admits(&[0.0, 0.0, 4.199e-5, 0.0, 0.0, 0.0]) && !motion.admits(&[f64::NAN; 6]));
        assert_eq!(motion.binding(&[0.0; 6]), None);
        let Some(Binding::Axis { axis: 2, at, bound }) = motion.binding(&[6e-5, 0.0, 9e-5, 0.0, 0.0, 0.0]) else {
            panic!("{:?}", motion.binding(&[6e-5, 0.0, 9e-5, 0.0, 0.0, 0.0]))
        };
        assert!((at - 1e-4).abs() < 1e-18 && (bound - 5.2e-5).abs() < 1e-18, "{at} {bound}");
        // A turn by 200 urad about y lowers the joint at 0.1 m by 20 um.
        let Some(Binding::Leg { leg: 0, at, range }) = motion.binding(&[0.0, 0.0, 0.0, 0.0, 2e-4, 0.0]) else {
            panic!("{:?}", motion.binding(&[0.0, 0.0, 0.0, 0.0, 2e-4, 0.0]))
        };
        assert!((at + 1e-5).abs() < 1e-8 && (range[0] - 7e-7).abs() < 1e-18, "{at} {range:?}");
        // If the user's zero leaves no room, none is required.
        let bare = Motion::parse(&described(0.0, "")).unwrap().unwrap();
        close(limits(|pose| bare.admits(pose), &[0.0; 6], 2), [0.0, 5.2e-5]);
        // From outside the reach is zero.
        assert_eq!(reach(|pose| motion.admits(pose), &[1.0; 6], &[-1.0; 6]).to_bits(), 0);
    }

    #[test]
    fn poses_come_back_from_every_kind_of_frame() {
        let (sine, cosine) = (0.5, 0.866_025_403_784_438_6);
        let turned =
            format!("tool=0.01,-0.02,0.05\naxes={cosine},-{sine},0,{sine},{cosine},0,0,0,1\nlargest_angle=0.2\n");
        for more in ["", "tool=0.01,-0.02,0.05\nlargest_angle=0.7\n", turned.as_str()] {
            let motion = of(more);
            let user = [3e-6, -2e-6, 1e-6, 1e-4, -2e-4, 3e-4];
            let pose = motion.platform(&user).unwrap();
            let back = motion.user(&pose).unwrap();
            assert!(back.iter().zip(user).all(|(a, b)| (a - b).abs() < 1e-15), "{more}: {back:?}");
        }
    }
}
