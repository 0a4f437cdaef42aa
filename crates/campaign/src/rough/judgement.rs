//! The judgement of a flight: errors of the estimate, and how the flight ended.

use afbc_scenario::Scenario;
use afbc_sim::flight::{EstimateErrors, Lost, Mode, Sample, fly};
use afbc_sim::metrics::is_settled;
use afbc_sim::run::MonitorTrip;
use afbc_types::OutOfRange;

/// Steps between two evaluations of the estimate. The normalised error is computed as often.
const EVERY: u64 = 10;
/// Number of standard deviations within which an error should be.
const SIGMAS: f32 = 3.0;

/// Quality of the estimate and actions of failsafes in a flight. The estimate is evaluated from the time at which
/// errors count until the motors stop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Number of evaluations.
    pub looks: u64,
    /// Number of evaluations with a valid estimate. The errors below are from these evaluations.
    pub valid: u64,
    /// Mean normalised estimation error squared. It is nine for a consistent estimate, and NaN if the covariance was
    /// ever not positive.
    pub nees: f64,
    /// Fraction of the errors, nine coordinates per evaluation, that are within three standard deviations.
    pub within: f64,
    /// True if the flight core flew without a fresh state at any time.
    pub coasted: bool,
    /// True if the flight core descended at any time.
    pub descended: bool,
    /// Time and reason of the monitor's switch to the fallback law, if any.
    pub tripped: Option<MonitorTrip>,
    /// Time and reason of the loss of the vehicle, if any.
    pub lost: Option<Lost>,
}

impl Judgement {
    /// Flies `scenario` under its first contender.
    pub(super) fn of(scenario: &Scenario) -> Result<Self, OutOfRange> {
        let mut judgement = Judgement::default();
        let (mut step, mut sum, mut within) = (0_u64, 0.0, 0);
        let mut see = |sample: &Sample| {
            let mode = sample.mode.unwrap_or_default();
            judgement.coasted |= mode == Mode::Coasting;
            judgement.descended |= mode == Mode::Descending;
            if let Some(reason) = sample.action.health.fallback {
                judgement.tripped.get_or_insert(MonitorTrip { time_s: sample.time_s, reason });
            }
            step += 1;
            if step % EVERY != 1 || mode == Mode::Disarmed || !is_settled(sample.time_s) {
                return;
            }
            let Some(estimated) = sample.estimated else { return };
            judgement.looks += 1;
            if estimated.valid {
                judgement.valid += 1;
                sum += f64::from(estimated.nees);
                within += inside(&estimated);
            }
        };
        let lost = match scenario.contenders.first() {
            Some(contender) => fly(scenario, contender, &mut see)?,
            None => None,
        };
        let valid = judgement.valid.max(1) as f64;
        Ok(Judgement { nees: sum / valid, within: within as f64 / (9.0 * valid), lost, ..judgement })
    }
}

/// Returns how many of the nine errors are within three standard deviations.
fn inside(estimated: &EstimateErrors) -> u64 {
    let pairs = [
        (&estimated.position_error_m, &estimated.position_sigma_m),
        (&estimated.velocity_error_m_s, &estimated.velocity_sigma_m_s),
        (&estimated.attitude_error_rad, &estimated.attitude_sigma_rad),
    ];
    let inside = pairs.into_iter().flat_map(|(error, sigma)| error.iter().zip(sigma.iter()));
    inside.filter(|(error, sigma)| error.abs() <= SIGMAS * **sigma).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn errors_are_inside_up_to_three_standard_deviations() {
        let estimated = EstimateErrors {
            position_error_m: Vector3::new(2.9, -2.9, 3.1),
            position_sigma_m: Vector3::repeat(1.0),
            velocity_error_m_s: Vector3::new(0.0, -0.31, 0.29),
            velocity_sigma_m_s: Vector3::repeat(0.1),
            attitude_error_rad: Vector3::new(f32::NAN, 0.02, -0.04),
            attitude_sigma_rad: Vector3::new(1.0, 0.01, 0.01),
            ..EstimateErrors::default()
        };
        assert_eq!(inside(&estimated), 5);
    }
}
