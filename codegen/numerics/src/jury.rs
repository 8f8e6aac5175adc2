//! Jury tests of Appendix B for a leg without dynamics.

/// λ below which EWMA is stable, from the pole 1 − λω of (AII.15): 2/ω. (AII.18) prints 2, which is its ω = 1 case.
pub fn ewma_limit(weight: f64) -> f64 {
    2.0 / weight
}

/// λ below which PCC is stable, from the poles of (AII.17): 4/(2ω_Σ − ω_Π), the third inequality of (AII.19); the others never bind for weights in (0, 1].
pub fn pcc_limit(level_weight: f64, drift_weight: f64) -> f64 {
    4.0 / (2.0 * (level_weight + drift_weight) - level_weight * drift_weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All three inequalities of (AII.19) as printed.
    fn pcc_satisfies_jury(level_weight: f64, drift_weight: f64, gain_ratio: f64) -> bool {
        let (sum, product) = (level_weight + drift_weight, level_weight * drift_weight);
        (gain_ratio * (product - sum) + 1.0).abs() < 1.0
            && gain_ratio * product > 0.0
            && 4.0 + gain_ratio * (product - 2.0 * sum) > 0.0
    }

    /// Error of a static leg of gain λ under the law, run by run, starting from a step disturbance.
    fn settles(level_weight: f64, drift_weight: Option<f64>, gain_ratio: f64) -> bool {
        let (mut level, mut drift, mut disturbance_error) = (0.0, 0.0, 1.0_f64);
        for _ in 0..4000 {
            let request = -level - drift;
            let measured = gain_ratio * request + 1.0;
            let model_error = measured - request;
            let old = level;
            level = level_weight * model_error + (1.0 - level_weight) * old;
            if let Some(weight) = drift_weight {
                drift = weight * (model_error - old) + (1.0 - weight) * drift;
            }
            disturbance_error = measured;
            if disturbance_error.abs() > 1e6 {
                return false;
            }
        }
        disturbance_error.abs() < 1e-3
    }

    /// (AII.18) corrected, (AII.19).
    #[test]
    fn the_paper_s_weights_have_the_limits_of_appendix_b() {
        assert!((ewma_limit(0.252) - 7.937).abs() < 1e-3);
        assert!((pcc_limit(0.252, 0.011) - 7.645).abs() < 1e-3);
    }

    /// The poles of (AII.15) and (AII.17): (AII.18) corrected and (AII.19) against the loop itself.
    #[test]
    fn jury_predicts_whether_the_loop_settles() {
        for level in [0.05, 0.252, 0.6, 1.0] {
            for factor in [0.9, 0.98, 1.02, 1.2] {
                assert_eq!(settles(level, None, ewma_limit(level) * factor), factor < 1.0, "EWMA {level} × {factor}");
            }
            for drift in [0.05, 0.3, 0.9] {
                for factor in [0.9, 0.98, 1.02, 1.2] {
                    let ratio = pcc_limit(level, drift) * factor;
                    assert_eq!(settles(level, Some(drift), ratio), factor < 1.0, "PCC {level} {drift} × {factor}");
                    assert_eq!(
                        pcc_satisfies_jury(level, drift, ratio),
                        factor < 1.0,
                        "Jury {level} {drift} × {factor}"
                    );
                }
            }
        }
    }
}
