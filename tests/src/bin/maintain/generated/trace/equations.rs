//! The equations of the paper, by their own numbers.

/// One equation.
#[derive(Debug)]
pub struct Equation {
    /// Number as printed; citations put it in parentheses.
    pub number: &'static str,
    /// Its subject.
    pub what: &'static str,
    /// Correction, if the print is wrong; else empty.
    pub remark: &'static str,
    /// Reason why there is no code for it; none if there is.
    pub absent: Option<&'static str>,
}

const fn used(number: &'static str, what: &'static str, remark: &'static str) -> Equation {
    Equation { number, what, remark, absent: None }
}

const fn absent(number: &'static str, what: &'static str, why: &'static str) -> Equation {
    Equation { number, what, remark: "", absent: Some(why) }
}

/// In the order of the paper: sections 2 to 4, Appendix A, Appendix B.
pub const EQUATIONS: &[Equation] = &[
    used("1", "joint angles of the base", ""),
    used("2", "joint angles of the platform", ""),
    used("3", "equation of motion in task space", ""),
    used(
        "4",
        "inertia of the platform and its legs",
        "the sum runs over all six legs; ω = T(θ) θ̇ where Euler rates are equated with the angular velocity",
    ),
    used("5", "force of an environment with stiffness", ""),
    used("6", "dynamic Preisach model", ""),
    used("7", "computed torque with PID and stiffness", ""),
    used(
        "8",
        "closed loop of (7) in (3)",
        "holds for the rigid platform; the sampled loop with modes is what is checked",
    ),
    used("9", "cost of the tuning", ""),
    used("AI.1", "attitude by three angles about fixed axes", ""),
    used("AI.2", "leg vectors", ""),
    used("AI.3", "joints of the base", ""),
    used("AI.4", "joints of the platform", ""),
    used("AI.5", "velocity of a platform joint", ""),
    used("AI.6", "cross product as a matrix", ""),
    used("AI.7", "acceleration of a platform joint", ""),
    used("AI.8", "angular velocity and acceleration of a leg", ""),
    used("AI.9", "kinetic energy of a leg", ""),
    used(
        "AI.10",
        "velocity of the extensible part",
        "its mass centre is at l − l_e from the base joint; the last term is zero as printed",
    ),
    used("AI.11", "cross product with the leg's direction", ""),
    used("AI.12", "inertia of a leg about its joint", ""),
    used(
        "AI.13",
        "inertia of a leg at its platform joint",
        "derived from the kinetic energy; the print has a wrong sign",
    ),
    used("AI.14", "gravity of a leg", ""),
    used("AI.15", "gravity of a leg at its platform joint", "lost in print, derived"),
    used("AI.16", "Coriolis force of a leg", "derived; damaged in print"),
    used("AI.17", "force on a leg at its platform joint", ""),
    used("AII.1", "linear model of a leg", ""),
    used("AII.2", "next drive under EWMA", ""),
    used("AII.3", "EWMA", ""),
    used("AII.4", "next drive under PCC", ""),
    used("AII.5", "level of PCC", ""),
    used("AII.6", "drift of PCC", "with the old level, as printed"),
    used("AII.7", "EWMA as an integrator of e = Y − Ŷ", ""),
    absent(
        "AII.8",
        "transfer function of (AII.7)",
        "the filter form is built: fed with another error, the integrator diverges",
    ),
    used("AII.9", "level of PCC as an integrator", ""),
    used("AII.10", "drift of PCC as an integrator", ""),
    absent("AII.11", "transfer function of (AII.9)", "see (AII.8)"),
    absent("AII.12", "transfer function of (AII.10)", "see (AII.8)"),
    absent("AII.13", "both in one", "see (AII.8)"),
    absent("AII.14", "error under EWMA from the demand", "zero for λ = 1; the loop is judged by its poles, (AII.15)"),
    used("AII.15", "error under EWMA from the disturbance", "r^v means the demand in µm"),
    absent("AII.16", "error under PCC from the demand", "ζ in print is λ; the loop is judged by its poles, (AII.17)"),
    used("AII.17", "error under PCC from the disturbance", ""),
    used("AII.18", "stability of EWMA", "0 < λω < 2: the print is its ω = 1 case"),
    used("AII.19", "stability of PCC", "its last inequality binds: λ < 4/(2ω_Σ − ω_Π)"),
];
