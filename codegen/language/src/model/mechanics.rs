//! The platform as a mechanism: joints, bodies, legs, workspace.

use super::joints;
use crate::keys::declare::*;

/// Largest translation of a workspace or pose from rest, m.
pub const LARGEST_TRAVEL: f64 = 0.1;
/// Largest rotation, rad: the controller's small-angle series are sized for it.
pub const LARGEST_TURN: f64 = 0.5;

const RADIUS: Range = Range::closed(1e-3, 10.0);
const JOINT_ANGLE: Range = Range::open(0.0, 2.0 * std::f64::consts::FRAC_PI_3);
const CIRCLES: &[&str] = &["joint circles"];
const ANGLES: &[&str] = &["joint angles"];
const RADII: &[&str] = &["joint circles", "joint angles"];
const JOINTS: &[&str] = &["joints one by one"];
const FILE: &[&str] = &["joints from a file"];
const DIRECTION: Item = item(Dimension::ANGLE, Range::closed(-std::f64::consts::TAU, std::f64::consts::TAU), "deg");
const DIRECTIONS: Shape = list(&[DIRECTION; 6]);
/// The pose of a frame in another one.
const FRAME: Shape = list(FRAME_ITEMS);
const FRAME_ITEMS: &[Item] = &six(CENTER, DIRECTION);
const BASE_DIRECTIONS: &str = r#"["58.92 deg", "61.08 deg", "178.92 deg", "181.08 deg", "298.92 deg", "301.08 deg"]"#;
const PLATFORM_DIRECTIONS: &str =
    r#"["1.08 deg", "118.92 deg", "121.08 deg", "238.92 deg", "241.08 deg", "358.92 deg"]"#;
const OWN_FRAME: &str = r#"["0 mm", "0 mm", "0 mm", "0 deg", "0 deg", "0 deg"]"#;
const JOINT: &[Item] = &[CENTER; 3];
const BASE_JOINTS: &str = r#"[["78 mm", "128 mm", "0 mm"], ["72 mm", "132 mm", "0 mm"], ["-150 mm", "3 mm", "0 mm"], ["-150 mm", "-3 mm", "0 mm"], ["72 mm", "-132 mm", "0 mm"], ["78 mm", "-128 mm", "0 mm"]]"#;
const PLATFORM_JOINTS: &str = r#"[["100 mm", "2 mm", "0 mm"], ["-48 mm", "88 mm", "0 mm"], ["-52 mm", "86 mm", "0 mm"], ["-52 mm", "-86 mm", "0 mm"], ["-48 mm", "-88 mm", "0 mm"], ["100 mm", "-2 mm", "0 mm"]]"#;
const BODY_MASS: Range = Range::closed(1e-6, 1e4);
const MOMENT: Range = Range::above(0.0, 1e4);
const PRODUCT: Item = item(Dimension::INERTIA, Range::closed(-1e4, 1e4), "g mm^2");
const LEG_CENTER: Shape = one(Dimension::LENGTH, Range::closed(0.0, 10.0), "mm");
const TRAVEL: Item = item(Dimension::LENGTH, Range::closed(0.0, LARGEST_TRAVEL), "um");
const TURN: Item = item(Dimension::ANGLE, Range::closed(0.0, LARGEST_TURN), "mrad");

section! {
    /// Joints of base and platform, on circles as in equations (1) and (2), one by one or from a file, and the pose at rest.
    ///
    /// Every form of a spec, such as the radii and angles of (1) and (2), is already converted to joints. Lengths in m.
    "geometry" ["hexapod", "stewart", "kinematics"], Plain => Geometry {
        /// Radius of the circle through the six base joints.
        base_radius = one(Dimension::LENGTH, RADIUS, "mm"), Form(RADII), "r_B" ["base_circle", "bottom_radius"], "150 mm";
        /// Radius of the circle through the six platform joints.
        platform_radius = one(Dimension::LENGTH, RADIUS, "mm"), Form(RADII), "r_P" ["top_radius", "moving_radius", "plate_radius"], "100 mm";
        /// Angle between the two base joints of a pair: twice the half-angle of a data sheet.
        base_angle = one(Dimension::ANGLE, JOINT_ANGLE, "rad"), Form(CIRCLES), "alpha_B" ["base_joint_angle", "base_half_angle"], "0.012 pi rad";
        /// Angle between the two platform joints of a pair.
        platform_angle = one(Dimension::ANGLE, JOINT_ANGLE, "rad"), Form(CIRCLES), "alpha_P" ["platform_joint_angle", "top_angle", "platform_half_angle"], "0.012 pi rad";
        /// Directions of the six base joints about z, from x towards y, leg by leg, if the pairs are not alike.
        base_angles = DIRECTIONS, Form(ANGLES), "" ["base_directions"], BASE_DIRECTIONS;
        /// The same of the six platform joints.
        platform_angles = DIRECTIONS, Form(ANGLES), "" ["platform_directions"], PLATFORM_DIRECTIONS;
        /// Height of P_C, the origin of {P}, above that of {B} at rest; with joint circles, of the platform's joint plane above the base's.
        height: f64 = one(Dimension::LENGTH, RADIUS, "mm"), Required, "P_z" ["h", "z0", "z", "rest_height", "H_0"], "180 mm";
        /// The six base joints in {B}, leg by leg, if they do not lie on a circle.
        base_joints = Shape::Rows(6, JOINT), Form(JOINTS), "B_i", BASE_JOINTS;
        /// The six platform joints in {P}, leg by leg, if they do not lie on a circle.
        platform_joints = Shape::Rows(6, JOINT), Form(JOINTS), "P_i", PLATFORM_JOINTS;
        /// CSV file with the twelve joints, such as `leg,where,x_mm,y_mm,z_mm` with rows `0,base,78,128,0` and `0,platform,100,2,0`; legs from 0 or from 1.
        joints = Shape::One(Item::File), Form(FILE), "" ["joint_file", "coordinates"], "joints.csv";
        /// Pose of {B} in the frame in which the base joints are given, if that is another: x, y, z of its origin, then the angles of R = Rz Ry Rx.
        base_frame = FRAME, Optional, "" ["base_offset", "base_pose"], OWN_FRAME;
        /// The same of {P} and the platform joints, at rest.
        platform_frame = FRAME, Optional, "" ["platform_offset", "platform_pose"], OWN_FRAME;
    }
    and |fields, _table| {
        /// B_i in {B}, m.
        base_joints: [[f64; 3]; 6] = joints(fields)?[0];
        /// P_i in {P}, m.
        platform_joints: [[f64; 3]; 6] = joints(fields)?[1];
        /// The file that they were read from.
        joint_file: Option<String> = fields.name("geometry.joints").map(str::to_owned);
    }
}

/// B_i and P_i in any form of the spec; those of a file are already there as if they were given one by one.
fn joints(fields: &Fields) -> Option<[[[f64; 3]; 6]; 2]> {
    let number = |key: &str| fields.number(&join("geometry", key));
    let base: Option<[[f64; 3]; 6]> = fields.rows("geometry.base_joints");
    let directions = fields.list("geometry.base_angles");
    let given = match (base, directions) {
        (Some(base), _) => [base, fields.rows("geometry.platform_joints")?],
        (None, Some(base)) => {
            let platform = fields.list("geometry.platform_angles")?;
            let radii = [number("base_radius")?, number("platform_radius")?];
            [joints::on_circle(radii[0], base), joints::on_circle(radii[1], platform)]
        }
        (None, None) => {
            let base = joints::base_joints(number("base_radius")?, number("base_angle")?);
            [base, joints::platform_joints(number("platform_radius")?, number("platform_angle")?)]
        }
    };
    let [base, platform] = given;
    Some([("geometry.base_frame", base), ("geometry.platform_frame", platform)].map(|(key, joints)| {
        let frame = fields.list::<6>(key);
        frame.map_or(joints, |frame| joints::from_frame(&frame, joints))
    }))
}

impl Geometry {
    /// r₀ = P₀ + P_i − B_i (AI.2), the legs at rest from joint to joint in {B}, m.
    pub fn rest_legs(&self) -> [[f64; 3]; 6] {
        core::array::from_fn(|leg| {
            let ([bx, by, bz], [px, py, pz]) = (self.base_joints[leg], self.platform_joints[leg]);
            [px - bx, py - by, self.height + pz - bz]
        })
    }

    /// Largest distance of a platform joint from P_C, m.
    pub fn joint_radius(&self) -> f64 {
        let distances = self.platform_joints.map(|[x, y, z]| libm::sqrt(x * x + y * y + z * z));
        distances.into_iter().fold(0.0, |largest, d| if d > largest { d } else { largest })
    }
}

section! {
    /// The moving platform as a rigid body, in its own frame {P}, Table 4: its part of (4).
    ///
    /// In kg, kg m² and m; I_xy is −∫xy dm.
    "platform" ["plate", "load", "payload", "body", "top"], Plain => RigidBody {
        /// Mass including everything that is mounted on the platform.
        mass: f64 = one(Dimension::MASS, BODY_MASS, "kg"), Required, "m" ["payload", "weight", "load"], "1.195 kg";
        /// Moments of inertia about the centre of mass.
        inertia: [f64; 3] = list(&[item(Dimension::INERTIA, MOMENT, "g mm^2"); 3]), Required, "I_xx I_yy I_zz" ["I", "J", "moments", "moment_of_inertia", "radius_of_gyration", "radii_of_gyration"], ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"];
        /// Entries of the inertia matrix off the diagonal: I_xy is minus the integral of x y dm.
        products: [f64; 3] = list(&[PRODUCT; 3]), Default(["0 g mm^2", "0 g mm^2", "0 g mm^2"]), "I_xy I_xz I_yz" ["products_of_inertia", "cross_inertia"], ["0 g mm^2", "0 g mm^2", "0 g mm^2"];
        /// Centre of mass, from the centre of the platform joints.
        center_of_mass: [f64; 3] = POINT, Default(["0 mm", "0 mm", "0 mm"]), "" ["com", "cog", "centre_of_mass", "center_of_gravity"], ["0 mm", "0 mm", "0 mm"];
    }
}

section! {
    /// The two parts of a leg, the same for all six, Table 4: masses and inertias of (AI.9) and (AI.12).
    ///
    /// In kg, kg m², m and rad.
    "leg" ["strut"], Plain => LegBody {
        /// Mass of the part at the base joint.
        fixed_mass: f64 = one(Dimension::MASS, BODY_MASS, "g"), Required, "m_s" ["lower_mass", "base_mass"], "90.26 g";
        /// Mass of the part at the platform joint.
        extensible_mass: f64 = one(Dimension::MASS, BODY_MASS, "g"), Required, "m_e" ["upper_mass", "moving_mass"], "73.62 g";
        /// Moment of inertia of the base-side part about a transverse axis through its mass centre.
        fixed_inertia: f64 = one(Dimension::INERTIA, MOMENT, "g mm^2"), Required, "I_s" ["lower_inertia"], "1.07e5 g mm^2";
        /// The same of the platform-side part.
        extensible_inertia: f64 = one(Dimension::INERTIA, MOMENT, "g mm^2"), Required, "I_e" ["upper_inertia"], "5.27e4 g mm^2";
        /// Mass centre of the base-side part, from the base joint.
        fixed_center: f64 = LEG_CENTER, Required, "l_s" ["lower_center"], "50 mm";
        /// Mass centre of the platform-side part, from the platform joint.
        extensible_center: f64 = LEG_CENTER, Required, "l_e" ["upper_center"], "50 mm";
        /// Largest rotation of a leg's joints from rest, in either direction.
        joint_angle: Option<f64> = one(Dimension::ANGLE, Range::above(0.0, 1.5), "mrad"), Optional, "" ["joint_range"], "20 mrad";
    }
}

section! {
    /// Bounds on permitted poses, from rest.
    ///
    /// Translations in m, rotations in rad.
    "workspace" ["range", "limits", "travel"], Plain => Workspace {
        /// Bounds on |x|, |y|, |z|.
        translation: [f64; 3] = list(&[TRAVEL; 3]), Required, "" ["xyz", "position", "travel", "translations"], ["40 um", "40 um", "40 um"];
        /// Bounds on |theta_x|, |theta_y|, |theta_z|.
        rotation: [f64; 3] = list(&[TURN; 3]), Required, "" ["angles", "orientation", "tilt", "rotations"], ["0.4 mrad", "0.35 mrad", "0.5 mrad"];
    }
}

impl Workspace {
    /// Bounds on the magnitudes of x, y, z (m), θx, θy, θz (rad).
    pub fn bounds(&self) -> [f64; 6] {
        let ([x, y, z], [a, b, c]) = (self.translation, self.rotation);
        [x, y, z, a, b, c]
    }
}
