//! Masses and inertias against sizes.

use super::{Facts, Findings, figure, times_beyond};
use specgen_language::diagnostic::Diagnostic;

lints! {
    rules: leg_parts_have_size, mass_centres_off_the_joints, parts_are_bodies, centre_over_joints, moments_of_each_axis,
        moments_fit_symmetry, leg_parts_against_platform, moments_about_the_centre;

    /// # W0810: inertia of a leg part too small for the leg
    ///
    /// The radius of gyration of a part, sqrt(I/m), should be at least a fiftieth of
    /// the leg length.
    ///
    /// ## Why it matters
    ///
    /// A part extends over much of the leg. A smaller inertia is usually in the wrong
    /// unit.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [leg] @@
    /// -fixed_inertia      = "1.07e5 g mm^2"
    /// +fixed_inertia      = "1.07e2 g mm^2"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of inertia and mass of the part.
    ///
    /// ```toml
    /// fixed_inertia      = "1.07e5 g mm^2"
    /// ```
    LEG_PART_SMALL = "W0810";

    /// # W0811: mass centre almost in the joint
    ///
    /// The distance from the joint to the mass centre should be at least a fiftieth of
    /// the part's radius of gyration, or exactly 0.
    ///
    /// ## Why it matters
    ///
    /// A value close to zero is usually in um instead of mm. A part that is balanced
    /// about its joint has exactly 0.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [leg] @@
    /// -fixed_center       = "50 mm"
    /// +fixed_center       = "0.5 mm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or write 0.
    ///
    /// ```toml
    /// fixed_center       = "50 mm"
    /// ```
    CENTRE_AT_JOINT = "W0811";

    /// # W0856: mass, inertia and mass centre are inconsistent
    ///
    /// A part of a leg starts at its joint: its radius of gyration should be 0.25 to
    /// 1.05 times the distance from the joint to its mass centre.
    ///
    /// ## Why it matters
    ///
    /// A uniform rod has 0.58, and 1.15 about its joint. Otherwise mass, inertia (about
    /// the mass centre) or centre is wrong, and so is the leg's contribution to (4).
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [leg] @@
    /// -fixed_inertia      = "1.07e5 g mm^2"
    /// +fixed_inertia      = "1.07e4 g mm^2"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check all three values.
    ///
    /// ```toml
    /// fixed_inertia      = "1.07e5 g mm^2"
    /// ```
    LEG_PART_SHAPE = "W0856";

    /// # W0857: a centre of mass outside the legs
    ///
    /// `platform.center_of_mass` should lie within the joint circle, and at most three
    /// of its radii above or below it.
    ///
    /// ## Why it matters
    ///
    /// A centre of mass further out loads the legs unevenly. More often it was measured
    /// from a point other than P_C.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [platform] @@
    /// -center_of_mass = ["0 mm", "0 mm", "0 mm"]
    /// +center_of_mass = ["150 mm", "0 mm", "0 mm"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Measure from P_C, in {P}; check the unit.
    ///
    /// ```toml
    /// center_of_mass = ["0 mm", "0 mm", "0 mm"]
    /// ```
    CENTRE_FAR = "W0857";

    /// # W0812: moment of inertia inconsistent with the size
    ///
    /// About x and y the radius of gyration should be a tenth to three times the
    /// joint circle; about z 0.3 to 1.5 times.
    ///
    /// ## Why it matters
    ///
    /// The rim bounds the I_zz of a plate that carries its joints on the rim. A moment
    /// outside the range is usually in the wrong unit, or not about the mass centre.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [platform] @@
    /// -inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// +inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e5 g mm^2"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `platform.inertia`, about the mass centre, and `platform.mass`.
    ///
    /// ```toml
    /// inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// ```
    MOMENT_ODD = "W0812";

    /// # W0813: moments of inertia in the wrong order?
    ///
    /// On a platform whose joints are spread equally along x and y, I_xx and I_yy
    /// should be within a factor of two, and within 1.3 if one of them is close to
    /// I_zz.
    ///
    /// ## Why it matters
    ///
    /// `platform.inertia` is I_xx, I_yy, I_zz in {P}, with z along the axis of the
    /// hexapod. CAD programs often use y for that axis.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [platform] @@
    /// -inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// +inertia        = ["3.26e7 g mm^2", "9.7e6 g mm^2", "3.26e7 g mm^2"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Put the moments in this order.
    ///
    /// ```toml
    /// inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// ```
    MOMENTS_UNEVEN = "W0813";

    /// # W0814: leg and platform of very different mass
    ///
    /// The mass of a leg part should be between 1/5000 of the platform's mass and five
    /// times the platform's mass.
    ///
    /// ## Why it matters
    ///
    /// In (4) the legs add a few per cent to the platform. A very different proportion
    /// usually means grams for kilograms.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [leg] @@
    /// -extensible_mass    = "73.62 g"
    /// +extensible_mass    = "73.62 mg"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of both masses.
    ///
    /// ```toml
    /// extensible_mass    = "73.62 g"
    /// ```
    LEG_MASS_ODD = "W0814";

    /// # W0865: moments of inertia about another point?
    ///
    /// I_xx + I_yy − I_zz is twice the integral of z² dm about the centre of mass. The
    /// rms z from it should be less than the height of the platform above the base.
    ///
    /// ## Why it matters
    ///
    /// Moments about another point, such as the base or the origin of a CAD model, are
    /// larger by mass times distance squared (parallel axis theorem). The computed leg
    /// forces are then too large, and so is the feed-forward.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [platform] @@
    /// -inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// +inertia        = ["7.1e7 g mm^2", "7.1e7 g mm^2", "9.7e6 g mm^2"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Give moments of inertia about the centre of mass.
    ///
    /// ```toml
    /// inertia        = ["3.26e7 g mm^2", "3.26e7 g mm^2", "9.7e6 g mm^2"]
    /// ```
    MOMENTS_ELSEWHERE = "W0865";
}

/// Least radius of gyration of a leg part, in leg lengths: that of a rod a fifteenth of the leg long.
const THINNEST: f64 = 0.02;
/// Least distance from joint to mass centre, in radii of gyration of the part.
const NEAREST_CENTRE: f64 = 0.02;
/// Radius of gyration of a part over the distance from its joint to its mass centre. A rod that starts at the joint has 0.58,
/// half its mass at either end 1, a lump half as long as the distance 0.29. About its joint a rod has 1.15.
const SOUND_PART: core::ops::RangeInclusive<f64> = 0.25..=1.05;
/// Radius of gyration about one axis, in radii of the joint circle.
const SOUND_AXIS: core::ops::RangeInclusive<f64> = 0.1..=3.0;
/// The same about z. A uniform disc out to the joints has 0.71, one with less than half their radius 0.3, one with twice their
/// radius 1.41. About x and y a tall load adds its height.
const SOUND_TURN: core::ops::RangeInclusive<f64> = 0.3..=1.5;
/// Largest offset of the centre of mass from P_C along x, y and z, in radii of the joint circle.
const FARTHEST_CENTRE: [f64; 3] = [1.0, 1.0, 3.0];
/// Largest ratio of the moments about x and y on a platform whose joints are spread equally along both.
const UNEVEN: f64 = 2.0;
/// The same if the moment about z is within [`AS_THAT_ABOUT_Z`] of one of the two: I_zz should be the one that differs.
const ODD_ONE: f64 = 1.3;
const AS_THAT_ABOUT_Z: f64 = 1.15;
/// Mass of a leg part over that of the platform.
const SOUND_SHARE: core::ops::RangeInclusive<f64> = 2e-4..=5.0;

fn parts<'a>(facts: &Facts<'a>) -> [(&'static str, &'a f64, &'a f64, &'a f64); 2] {
    let leg = &facts.model.leg;
    [
        ("fixed", &leg.fixed_mass, &leg.fixed_inertia, &leg.fixed_center),
        ("extensible", &leg.extensible_mass, &leg.extensible_inertia, &leg.extensible_center),
    ]
}

/// Checks that leg parts are not too small. (The spec checks that they are not too large.)
fn leg_parts_have_size(facts: &Facts, found: &mut Findings) {
    let Some(legs) = &facts.legs else { return };
    for (part, mass, inertia, _) in parts(facts) {
        let (radius, length) = (libm::sqrt(inertia / mass), legs.shortest());
        if radius >= THINNEST * length {
            continue;
        }
        let [gyration, grams, moment, long] = [radius * 1e3, mass * 1e3, inertia * 1e9, length * 1e3].map(figure);
        found.add_off(
            THINNEST * length / radius,
            LEG_PART_SMALL,
            &format!("leg.{part}_inertia"),
            format!(
                "the {part} part of a leg has a radius of gyration of {gyration} mm (from {grams} g and {moment} g mm^2), in a leg of {long} mm"
            ),
            &format!("check the units of `leg.{part}_inertia` and `leg.{part}_mass`"),
        );
    }
}

/// Checks that mass centres are not almost in the joints.
fn mass_centres_off_the_joints(facts: &Facts, found: &mut Findings) {
    for (part, mass, inertia, center) in parts(facts) {
        let radius = libm::sqrt(inertia / mass);
        // Zero is intended: the part is balanced about its joint.
        if *center == 0.0 || *center >= NEAREST_CENTRE * radius {
            continue;
        }
        let [distance, gyration] = [center * 1e3, radius * 1e3].map(figure);
        found.add_off(
            NEAREST_CENTRE * radius / center,
            CENTRE_AT_JOINT,
            &format!("leg.{part}_center"),
            format!(
                                "the mass centre of the {part} part is {distance} mm from its joint, but the part's radius of gyration is {gyration} mm"
            ),
            "check the unit: mm or um",
        );
    }
}

/// Checks that mass, inertia and mass centre are consistent for a body that starts at its joint.
fn parts_are_bodies(facts: &Facts, found: &mut Findings) {
    for (part, mass, inertia, center) in parts(facts) {
        let radius = libm::sqrt(inertia / mass);
        let key = format!("leg.{part}_inertia");
        // Zero is intended: the part is balanced about its joint. One finding about these keys is enough.
        let is_known = |one: &Diagnostic| [key.as_str(), &format!("leg.{part}_center")].contains(&one.key.as_str());
        if *center == 0.0 || SOUND_PART.contains(&(radius / center)) || found.list.iter().any(is_known) {
            continue;
        }
        let [gyration, grams, moment, distance] = [radius * 1e3, mass * 1e3, inertia * 1e9, center * 1e3].map(figure);
        found.add_off(
            times_beyond(radius / center, &SOUND_PART),
            LEG_PART_SHAPE,
            &key,
            format!(
                "the {part} part of a leg has a radius of gyration of {gyration} mm (from {grams} g and {moment} g mm^2) about a mass centre {distance} mm from its joint"
            ),
            &format!(
                "a rod that starts at the joint would have {} mm: check `leg.{part}_inertia` (about the mass centre), `leg.{part}_mass` and `leg.{part}_center`",
                figure(center * 1e3 / libm::sqrt(3.0))
            ),
        );
    }
}

/// Checks that the centre of mass is near the joints.
fn centre_over_joints(facts: &Facts, found: &mut Findings) {
    let (body, size) = (&facts.model.platform, facts.model.geometry.joint_radius());
    for (axis, value) in body.center_of_mass.into_iter().enumerate() {
        if libm::fabs(value) <= FARTHEST_CENTRE[axis] * size {
            continue;
        }
        let (distance, along, joints) = (figure(value * 1e3), ["x", "y", "z"][axis], figure(size * 1e3));
        found.add_off(
            libm::fabs(value) / (FARTHEST_CENTRE[axis] * size),
            CENTRE_FAR,
            &format!("platform.center_of_mass[{axis}]"),
            format!(
                "the centre of mass is {distance} mm from P_C along {along}, but the platform's joints are only {joints} mm from its axis"
            ),
            "the load would be outside the legs: check the unit of `platform.center_of_mass` and the order of its axes",
        );
    }
}

/// Checks each moment against the joint circle. (The spec checks the largest against the other two.)
fn moments_of_each_axis(facts: &Facts, found: &mut Findings) {
    let (body, size) = (&facts.model.platform, facts.model.geometry.joint_radius());
    for (axis, moment) in body.inertia.into_iter().enumerate() {
        let radius = libm::sqrt(moment / body.mass);
        let sound = if axis == 2 { SOUND_TURN } else { SOUND_AXIS };
        if sound.contains(&(radius / size)) {
            continue;
        }
        let (name, gyration, moment) = (["x", "y", "z"][axis], figure(radius * 1e3), figure(moment * 1e9));
        let [kilograms, joints] = [body.mass, size * 1e3].map(figure);
        found.add_off(
            times_beyond(radius / size, &sound),
            MOMENT_ODD,
            &format!("platform.inertia[{axis}]"),
            format!(
                "about {name} the platform has a radius of gyration of {gyration} mm (from {moment} g mm^2 and {kilograms} kg), but its joints are {joints} mm from its axis"
            ),
            "check the units of `platform.inertia` (kg m^2 or g mm^2) and `platform.mass`; the moments are about the centre of mass",
        );
    }
}

/// Checks that a platform with equally spread joints has similar moments about x and y.
fn moments_fit_symmetry(facts: &Facts, found: &mut Findings) {
    let [xx, yy, zz] = facts.model.platform.inertia;
    let joints = &facts.model.geometry.platform_joints;
    let spread = |axis: usize| joints.iter().fold(0.0, |sum, joint| sum + joint[axis] * joint[axis]);
    let (along_x, along_y) = (spread(0), spread(1));
    let alike = along_x < 1.05 * along_y && along_y < 1.05 * along_x;
    let ratio = if xx > yy { xx / yy } else { yy / xx };
    let [from_xx, from_yy] = [xx, yy].map(|moment| libm::fabs(libm::log(moment / zz)));
    let nearest = if from_xx < from_yy { from_xx } else { from_yy };
    let exchanged = ratio > ODD_ONE && nearest < libm::log(AS_THAT_ABOUT_Z);
    if !alike || (ratio <= UNEVEN && !exchanged) {
        return;
    }
    // The one further from I_zz is suspected.
    let odd = usize::from(from_yy > from_xx);
    let [xx, yy, ratio] = [xx * 1e9, yy * 1e9, ratio].map(figure);
    found.add(
        MOMENTS_UNEVEN,
        &format!("platform.inertia[{odd}]"),
        format!(
            "I_xx is {xx} g mm^2 and I_yy {yy} g mm^2, a ratio of {ratio}, but the platform's joints are spread equally along x and y"
        ),
        "`platform.inertia` is I_xx, I_yy, I_zz in {P}, with z along the axis of the hexapod: check their order",
    );
}

/// Checks the masses of leg parts against that of the platform.
fn leg_parts_against_platform(facts: &Facts, found: &mut Findings) {
    let platform = facts.model.platform.mass;
    for (part, mass, _, _) in parts(facts) {
        if SOUND_SHARE.contains(&(mass / platform)) {
            continue;
        }
        found.add_off(
            times_beyond(mass / platform, &SOUND_SHARE),
            LEG_MASS_ODD,
            &format!("leg.{part}_mass"),
            format!("the {part} part of a leg weighs {} kg, the platform {} kg", figure(*mass), figure(platform)),
            &format!("check the units of `leg.{part}_mass` and `platform.mass`: kg or g"),
        );
    }
}

/// Checks that moments are about the centre of mass. About the base's origin they would be larger by m h².
fn moments_about_the_centre(facts: &Facts, found: &mut Findings) {
    let (body, height) = (&facts.model.platform, facts.model.geometry.height);
    let [xx, yy, zz] = body.inertia;
    // I_xx + I_yy − I_zz = 2 ∫ z² dm.
    let spread = libm::sqrt((xx + yy - zz) / (2.0 * body.mass));
    if spread.is_nan() || spread < height {
        return;
    }
    let [mass, spread, base] = [body.mass, spread * 1e3, height * 1e3].map(figure);
    found.add(
        MOMENTS_ELSEWHERE,
        "platform.inertia[0]",
        format!(
            "with these moments and {mass} kg the mass of the platform is spread {spread} mm (rms) along z about its centre, but the base is only {base} mm away"
        ),
        &format!(
            "`platform.inertia` is about the centre of mass: if they are about the base's origin, subtract mass x height^2 = {} g mm^2 from I_xx and I_yy; also check their unit",
            figure(body.mass * height * height * 1e9)
        ),
    );
}
