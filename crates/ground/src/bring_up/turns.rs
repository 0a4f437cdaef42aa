//! Turns of the board by hand, which check the signs of gyroscope, accelerometer and attitude.

use super::conversation::Conversation;
use super::error::Error;
use super::latest::LatestMessages;
use super::log::BringUpStep;
use super::steps::senses;
use nalgebra::Vector3;

/// Longest wait for the person to do what is asked \[ms\].
const PATIENCE_MS: u64 = 60_000;
/// Largest angle between gravity and the axis that should be vertical \[rad\]: 30 degrees.
const ASIDE_MAX_RAD: f32 = 0.52;
/// Largest time between two samples that is integrated \[s\]. A longer time counts as this time.
const GAP_MAX_S: f64 = 0.1;

/// A turn of the board by hand from level. It has a name, an instruction and the body axis that points up after the
/// turn (x forward, y left, z up). `axis` and `sign` are the rotation that gyroscope and attitude must show.
struct TurnCheck {
    name: &'static str,
    order: &'static str,
    up: [f32; 3],
    axis: usize,
    sign: f64,
}

const TURNS: [TurnCheck; 4] = [
    TurnCheck {
        name: "right side down",
        order: "turn the board onto its right side",
        up: [0.0, 1.0, 0.0],
        axis: 0,
        sign: 1.0,
    },
    TurnCheck {
        name: "left side down",
        order: "turn the board onto its left side",
        up: [0.0, -1.0, 0.0],
        axis: 0,
        sign: -1.0,
    },
    TurnCheck {
        name: "nose down",
        order: "turn the board's nose straight down",
        up: [-1.0, 0.0, 0.0],
        axis: 1,
        sign: 1.0,
    },
    TurnCheck { name: "nose up", order: "turn the board's nose straight up", up: [1.0, 0.0, 0.0], axis: 1, sign: -1.0 },
];

/// Runs all turns.
pub(crate) fn turns(
    talk: &mut Conversation<'_>,
    is_attended: bool,
    tell: &mut dyn FnMut(&str),
    add: &mut dyn FnMut(BringUpStep),
) -> Result<(), Error> {
    for turn in &TURNS {
        let mut step = BringUpStep::new(turn.name);
        if !is_attended || !senses(talk) {
            add(step.skipped("nobody is there to turn the board, or there is no inertial sensor"));
            continue;
        }
        tell("hold the board level");
        let mut level = TurnProgress::default();
        let is_level = talk.wait(PATIENCE_MS, |talk| level.follow(&mut talk.latest, &Vector3::z()))?;
        step.check(is_level, "the board was not held level");
        tell(turn.order);
        // A new `TurnProgress` counts the angle from the level attitude.
        let mut turned = TurnProgress::default();
        let is_done = talk.wait(PATIENCE_MS, |talk| turned.follow(&mut talk.latest, &turn.up.into()))?;
        let angle_rad = turned.angle_rad.get(turn.axis).copied().unwrap_or_default() * turn.sign;
        let attitude_rad = talk.latest.attitude_rad.and_then(|attitude_rad| attitude_rad.get(turn.axis).copied());
        let attitude_rad = f64::from(attitude_rad.unwrap_or_default()) * turn.sign;
        step.found("specific force, forward, left, up [m/s2]", three(turned.force_m_s2));
        step.found("turn angle from the gyroscope, 90 expected", format!("{:.0} degrees", angle_rad.to_degrees()));
        step.found("turn angle from the estimate, 90 expected", format!("{:.0} degrees", attitude_rad.to_degrees()));
        step.check(is_done, "the accelerometer does not show the requested side facing up; check the IMU's rotation");
        // The gyroscope must show a turn between 45 and 135 degrees.
        step.check(
            (0.78..2.36).contains(&angle_rad),
            "the gyroscope does not show this turn; check the IMU's rotation",
        );
        step.check(attitude_rad > 0.5, "the estimated attitude does not show this turn");
        add(step);
    }
    Ok(())
}

/// Result of following the samples during a turn.
#[derive(Default)]
struct TurnProgress {
    force_m_s2: Vector3<f32>,
    angle_rad: Vector3<f64>,
    last_us: Option<u64>,
    /// Number of consecutive samples in the requested attitude.
    held: u32,
}

impl TurnProgress {
    /// Takes the new samples; returns true once `up` has pointed up for half a second.
    fn follow(&mut self, latest: &mut LatestMessages, up: &Vector3<f32>) -> bool {
        const HELD: u32 = 25;
        for sample in latest.samples.drain(..) {
            let elapsed_s = sample.time_us.saturating_sub(self.last_us.unwrap_or(sample.time_us)) as f64 * 1e-6;
            self.last_us = Some(sample.time_us);
            self.angle_rad += sample.rates_rad_s.cast::<f64>() * elapsed_s.min(GAP_MAX_S);
            self.force_m_s2 = sample.specific_force_m_s2;
            let is_up = sample.specific_force_m_s2.angle(up) < ASIDE_MAX_RAD;
            self.held = if is_up { self.held + 1 } else { 0 };
        }
        self.held >= HELD
    }
}

fn three(vector: Vector3<f32>) -> String {
    let [x, y, z]: [f32; 3] = vector.into();
    format!("{x:.2} {y:.2} {z:.2}")
}
