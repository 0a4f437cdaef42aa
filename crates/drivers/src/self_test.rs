//! Tests that parts have of their own: a stimulus on what senses, whose response the data sheet bounds.
//!
//! For a vehicle that is at rest on the ground, and of which nobody needs a reading: a test takes up to half a second,
//! and the part is set up again after it. An [`Mpu`](crate::mpu) or [`Icm426xx`](crate::icm426xx) that is turned or
//! shaken meanwhile fails.

use crate::bus::Registers;
use crate::driver::{Driver, PartTiming};
use crate::part::{PartFault, SelfTest, SelfTestResponse, SensorPart, Step};
use crate::reading::InertialReading;

impl<P: SensorPart, B: Registers, T: PartTiming> Driver<P, B, T> {
    /// Sets the part up and runs its test, if it has one. The next reading sets it up again.
    ///
    /// # Errors
    /// [`PartFault::SelfTest`] if it fails, or what has kept it from being run.
    pub async fn self_test(&mut self) -> Result<(), PartFault> {
        let Some(test) = &P::SELF_TEST else { return Ok(()) };
        let result = self.respond(test).await;
        // Before an error is returned: a test that was broken off leaves the part stimulated.
        self.forget();
        if (test.passes)(&result?) { Ok(()) } else { Err(PartFault::SelfTest) }
    }

    async fn respond(&mut self, test: &SelfTest<P::Reading>) -> Result<SelfTestResponse, PartFault> {
        let SelfTest { quiet, trims, between, stimulated, .. } = *test;
        let mut response = SelfTestResponse::default();
        self.set_up().await?;
        self.run(quiet).await?;
        for ((step, register), bytes) in trims.iter().zip(&mut response.trims) {
            self.run(&[*step]).await?;
            for (register, byte) in (*register..).zip(bytes) {
                *byte = self.byte(register).await?;
            }
        }
        self.run(between).await?;
        response.quiet = self.mean(test).await?;
        self.run(stimulated).await?;
        let excited = self.mean(test).await?;
        for ((change, excited), quiet) in response.change.iter_mut().zip(excited).zip(response.quiet) {
            *change = excited - quiet;
        }
        Ok(response)
    }

    async fn run(&mut self, steps: &[Step]) -> Result<(), PartFault> {
        for step in steps {
            self.step(step).await?;
        }
        Ok(())
    }

    async fn mean(&mut self, test: &SelfTest<P::Reading>) -> Result<[f32; 6], PartFault> {
        let SelfTest { skipped, averaged, axes, .. } = *test;
        let (mut sums, mut taken) = ([0.0; 6], 0);
        // A part may need several cycles for a reading.
        for _ in 0..4 * (skipped + averaged) {
            let mut reading = None;
            for step in P::CYCLE {
                reading = self.step(step).await?.or(reading);
            }
            let Some(reading) = reading else { continue };
            taken += 1;
            if taken <= skipped {
                continue;
            }
            sums.iter_mut().zip(axes(&reading.value)).for_each(|(sum, axis): (&mut f32, f32)| *sum += axis);
            if taken == skipped + averaged {
                return Ok(sums.map(|sum| sum / averaged as f32));
            }
        }
        Err(PartFault::Late)
    }
}

/// Returns rates and specific force of a part in its numbers, of which 32768 are 2000 deg/s and 16 g at set-up.
pub(crate) fn numbers(reading: &InertialReading) -> [f32; 6] {
    let rates = reading.rates_rad_s * (32768.0 / 2000.0 * 180.0 / core::f32::consts::PI);
    let force = reading.specific_force_m_s2 * (32768.0 / 16.0 / 9.806_65);
    [rates.x, rates.y, rates.z, force.x, force.y, force.z]
}

/// A response of TDK's parts at 250 deg/s and 2 g: the numbers of a degree a second and of a g, largest rate at rest,
/// least response of a rate that the factory has not written \[deg/s\], and bounds of that of a force \[g\].
const PER_DEG_S: f32 = 131.0;
const PER_G: f32 = 16_384.0;
const REST_MAX_DEG_S: f32 = 20.0;
const RATE_MIN_DEG_S: f32 = 60.0;

/// True if a part of TDK's, whose factory has written what it responded there, responds likewise: a rate by more than
/// half of that, a force by half to one and a half of it. `bounds_g` is for a force that the factory has not written.
pub(crate) fn as_at_the_factory(response: &SelfTestResponse, bounds_g: [f32; 2]) -> bool {
    let SelfTestResponse { quiet, change, trims: [rates, forces] } = response;
    let [min_g, max_g] = bounds_g;
    let mut axes = quiet.iter().zip(change).map(|(quiet, change)| (quiet.abs(), change.abs()));
    let rates_pass = rates.iter().zip(axes.by_ref()).all(|(trim, (quiet, change))| {
        let least = expected(*trim).map_or(RATE_MIN_DEG_S * PER_DEG_S, |expected| 0.5 * expected);
        quiet <= REST_MAX_DEG_S * PER_DEG_S && change > least
    });
    let forces_pass = forces.iter().zip(axes).all(|(trim, (_, change))| match expected(*trim) {
        Some(expected) => change > 0.5 * expected && change < 1.5 * expected,
        None => (min_g * PER_G..=max_g * PER_G).contains(&change),
    });
    rates_pass && forces_pass
}

/// Returns the response that a byte of the factory's stands for; none if it has written none.
fn expected(trim: u8) -> Option<f32> {
    let steps = trim.checked_sub(1)?;
    Some((0..steps).fold(2_620.0, |response, _| response * 1.01))
}
