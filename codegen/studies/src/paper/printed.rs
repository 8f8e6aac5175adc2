//! Values printed in the paper. Those of Tables 5 to 9 are with the simulator's tables of the same runs.

/// Rows of Table 1: frequency (Hz), "bias α" (µm, one stack), "gain slope β" (µm/V, one stack).
pub const TABLE_1: [[f64; 3]; 6] = [
    [0.1, 0.682, 0.1282],
    [1.0, 0.5694, 0.1262],
    [10.0, 0.6035, 0.1256],
    [20.0, 0.5440, 0.1253],
    [40.0, 0.5580, 0.1248],
    [50.0, 0.5530, 0.1244],
];

/// Table 2, nm, by mode and frequency (0.1, 1, 10 Hz).
pub const TABLE_2: [(&str, [f64; 3]); 3] =
    [("invhys", [127.039, 232.143, 504.539]), ("ewma", [103.086, 117.305, 191.409]), ("pcc", [80.5, 81.783, 156.25])];

/// Slope of a row of [`TABLE_1`] relative to that at 0.1 Hz.
pub fn slope_ratio(row: usize) -> f64 {
    TABLE_1.get(row).map_or(f64::NAN, |values| values[2] / TABLE_1[0][2])
}

/// Weights ω1 and ω2 of section 3.
pub const WEIGHTS: [f64; 2] = [0.252, 0.011];

/// Settings of the genetic algorithm, Table 3: name, as printed, as implemented.
pub const TABLE_3: [[&str; 3]; 8] = [
    ["population type", "bit string", "bit string, 10 bits a number"],
    ["population size", "100", "100"],
    ["selection function", "roulette", "roulette, fitness 1/√rank"],
    ["crossover type", "two-point", "two-point"],
    ["crossover fraction", "0.9", "0.9 of the children; two elite strings are kept unchanged"],
    ["mutation function", "uniform", "uniform: a bit is redrawn"],
    ["mutation rate", "0.03", "0.03"],
    ["weights of (9)", "a1 = 0.998, a2 = 0.002", "a1 = 0.998 of t |h̃| (µm s), a2 = 0.002 of η² (µm² s)"],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tuning::evaluate::COST_WEIGHTS;
    use crate::tuning::genetic::Settings;

    #[test]
    fn the_settings_in_the_table_are_in_use() {
        let paper = Settings::PAPER;
        assert_eq!(TABLE_3[1][2], paper.population.to_string());
        assert!(TABLE_3[4][2].starts_with(&paper.crossover.to_string()));
        assert_eq!(TABLE_3[6][2], paper.mutation.to_string());
        for weight in COST_WEIGHTS {
            assert!(TABLE_3[7][2].contains(&weight.to_string()));
        }
    }

    #[test]
    fn slopes_fall_with_the_frequency() {
        let ratios: Vec<f64> = (0..TABLE_1.len()).map(slope_ratio).collect();
        assert!(ratios.windows(2).all(|pair| pair[0] > pair[1]) && (ratios[5] - 0.9704).abs() < 1e-4, "{ratios:?}");
    }
}
