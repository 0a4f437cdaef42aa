//! Built-in self-tests of parts: a stimulus to the sensing element, whose response the data sheet bounds.
//!
//! Only for a vehicle at rest on the ground that needs no readings meanwhile: a test takes up to half a second, and the
//! part is set up again afterwards. An [`Mpu`](crate::mpu) or [`Icm426xx`](crate::icm426xx) fails if it is turned or
//! shaken during the test.

use crate::bus::Registers;
use crate::driver::{Driver, PartTiming};
use crate::part::{PartFault, ScriptStep, SelfTest, SelfTestResponse, SensorPart};
use crate::reading::InertialReading;

impl<P: SensorPart, B: Registers, T: PartTiming> Driver<P, B, T> {
    /// Sets the part up and runs its self-test, if it has one. The next reading sets the part up again.
    ///
    /// # Errors
    /// [`PartFault::SelfTest`] if the test fails, or the fault that prevented it.
    pub async fn self_test(&mut self) -> Result<(), PartFault> {
        let Some(test) = &P::SELF_TEST else { return Ok(()) };
        let result = self.respond(test).await;
        // Before an error is returned: an aborted test leaves the stimulus on.
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

    async fn run(&mut self, steps: &[ScriptStep]) -> Result<(), PartFault> {
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

/// Returns a part's rates and specific force in raw numbers, where 32768 is 2000 deg/s and 16 g as at set-up.
pub(crate) fn numbers(reading: &InertialReading) -> [f32; 6] {
    let rates = reading.rates_rad_s * (32768.0 / 2000.0 * 180.0 / core::f32::consts::PI);
    let force = reading.specific_force_m_s2 * (32768.0 / 16.0 / 9.806_65);
    [rates.x, rates.y, rates.z, force.x, force.y, force.z]
}

/// Responses of TDK's parts at 250 deg/s and 2 g, in raw numbers and units: raw number of 1 deg/s and of 1 g, largest
/// rate at rest \[deg/s\], and smallest rate response without a factory response \[deg/s\].
const PER_DEG_S: f32 = 131.0;
const PER_G: f32 = 16_384.0;
const REST_MAX_DEG_S: f32 = 20.0;
const RATE_MIN_DEG_S: f32 = 60.0;

/// True if a TDK part responds like it did at the factory. A rate must respond by more than half of the factory's
/// response, a force by 0.5 to 1.5 of it. `bounds_g` are the limits for a force without a factory response.
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

/// Returns the response for a factory code; none for 0, which means no factory response.
fn expected(trim: u8) -> Option<f32> {
    let steps = trim.checked_sub(1)?;
    Some((0..steps).fold(2_620.0, |response, _| response * 1.01))
}
