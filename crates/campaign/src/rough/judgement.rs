//! The judgement of a flight: its estimate's errors, and how it ended.

use afbc_scenario::Scenario;
use afbc_sim::flight::{Estimated, Lost, Mode, Sample, fly};
use afbc_sim::metrics::is_settled;
use afbc_sim::run::Tripped;
use afbc_types::OutOfRange;

/// Steps between two looks: as often as the normalised error is evaluated.
const EVERY: u64 = 10;
/// Standard deviations within which an error should be.
const SIGMAS: f32 = 3.0;

/// How good the estimate was in a flight, from the time on at which errors count until the motors stop, and what
/// failsafes did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Number of looks.
    pub looks: u64,
    /// Number of those at which the estimate was valid; of these are the figures below.
    pub valid: u64,
    /// Mean normalised estimation error squared; nine if the estimate is consistent, not a number if its covariance was
    /// not positive at any look.
    pub nees: f64,
    /// Share of errors, of nine coordinates each, that are within three standard deviations.
    pub within: f64,
    /// Whether the flight core flew without a fresh state at any time.
    pub coasted: bool,
    /// Whether it descended.
    pub descended: bool,
    /// When and why the monitor handed the vehicle over.
    pub tripped: Option<Tripped>,
    /// When and why the vehicle was lost.
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
                judgement.tripped.get_or_insert(Tripped { time_s: sample.time_s, reason });
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
fn inside(estimated: &Estimated) -> u64 {
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
        let estimated = Estimated {
            position_error_m: Vector3::new(2.9, -2.9, 3.1),
            position_sigma_m: Vector3::repeat(1.0),
            velocity_error_m_s: Vector3::new(0.0, -0.31, 0.29),
            velocity_sigma_m_s: Vector3::repeat(0.1),
            attitude_error_rad: Vector3::new(f32::NAN, 0.02, -0.04),
            attitude_sigma_rad: Vector3::new(1.0, 0.01, 0.01),
            ..Estimated::default()
        };
        assert_eq!(inside(&estimated), 5);
    }
}
