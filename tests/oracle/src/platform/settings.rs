//! Settings of a platform controller.

use crate::design::{Gains, Plant, Rule};
use crate::preisach::Table;
use host_sim::closed_loop::LEGS;
use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};
use host_sim::platform::{Probe, Six, Specimen};

/// Converter and limits of the drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Full drive of the Everett tables, V.
    pub max: f64,
    /// Converter step, V, code 0 at 0 V.
    pub lsb: f64,
    /// Highest code.
    pub code_max: i64,
    /// Largest change of the code per tick.
    pub step_max: i64,
    /// ρ̂ of a leg, m/V: the linear gain that P alone uses.
    pub gain: f64,
}

impl Drive {
    /// 16 bits over 150 V, limited to 100 V and 40 V/ms; 0.631 µm/V.
    pub fn reference(period: f64) -> Self {
        let lsb = 150.0 / 65535.0;
        Self {
            max: 100.0,
            lsb,
            code_max: (100.0 / lsb) as i64,
            step_max: (40e3 * period / lsb) as i64,
            gain: 5.0 * 0.1262e-6,
        }
    }
}

/// Settings of a platform controller, SI.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Nominal plant, lag and control period.
    pub plant: Plant,
    /// ζ_d of the modal notch, if there is one.
    pub notch_damping: Option<f64>,
    /// P/F gains and bandwidths.
    pub combined: Gains,
    /// Gains of P alone.
    pub position: Gains,
    /// k_v of P/F and of P alone, N s/m and N m s/rad.
    pub velocity: Six,
    /// Cut-off of the filter of the pose's derivative, rad/s.
    pub velocity_cutoff: f64,
    /// Lead of the leg displacements, s.
    pub lead: f64,
    /// The gauges; their words are metres.
    pub probes: [Probe; 6],
    /// Everett tables of the legs.
    pub tables: [Table; LEGS],
    /// Converter and limits.
    pub drive: Drive,
    /// Bias pose.
    pub bias: Six,
    /// Time to reach it, s.
    pub bias_time: f64,
}

impl Settings {
    /// Settings for a machine, from its nominal data and reversal curves of every leg (32 intervals, 20 V/s), at a control period
    /// (s): gains by the study's rule, bias 10 µm up in 0.3 s.
    pub fn of(specimen: &Specimen, period: f64, notch_damping: Option<f64>) -> Self {
        let rule = Rule::of(&specimen.nominal, LegParameters::reference().tau_amp_s, period, notch_damping);
        let design = rule.design();
        Self {
            plant: rule.plant().clone(),
            notch_damping,
            combined: design.combined,
            position: design.position,
            velocity: [0.0; 6],
            velocity_cutoff: 3e3,
            lead: 0.0,
            probes: specimen.nominal.probes,
            tables: tables(&specimen.legs),
            drive: Drive::reference(period),
            bias: [0.0, 0.0, 10e-6, 0.0, 0.0, 0.0],
            bias_time: 0.3,
        }
    }

    /// Base N of the study for a machine, at 10 kHz: notch of ζ_d = 1 and gains by hand; P alone as tuned there.
    pub fn base_n(specimen: &Specimen) -> Self {
        Self {
            combined: Gains { proportional: 0.05, integral: 150.0, level: 450.0, drift: 19.6 },
            position: Gains { proportional: 0.056, integral: 1007.0, level: 0.0, drift: 0.0 },
            ..Self::of(specimen, 1e-4, Some(1.0))
        }
    }
}

/// Everett tables of six legs as built, each from its own record with its gauge's noise; equal legs share one.
fn tables(legs: &[LegParameters; LEGS]) -> [Table; LEGS] {
    let of = |leg: usize| {
        let parameters = &legs[leg];
        let experiment = ReversalExperiment {
            rows_per_interval: 1,
            update: parameters.step_s,
            drive_max: parameters.u_max,
            ..ReversalExperiment::reference(32)
        };
        let mut gauge = Gauge::new(&parameters.noise, 1, leg as u64);
        let record = experiment.run(&mut LegPlant::new(parameters), &mut gauge);
        Table::from_record(&record, 32, parameters.u_max)
    };
    let first = of(0);
    std::array::from_fn(|leg| if legs[leg] == legs[0] { first.clone() } else { of(leg) })
}
