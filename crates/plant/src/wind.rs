//! Wind: steady wind, discrete gusts, turbulence.

use crate::noise::{Noise, NoiseStream};
use crate::turbulence::{SimulatedTurbulence, Turbulence};
use afbc_types::{Declared, OutOfRange, parameters};
use alloc::vec::Vec;
use core::f64::consts::PI;
use libm::{cos, sqrt};
use nalgebra::Vector3;

parameters! {
    /// Velocity of the air relative to the earth, the sum of steady wind, gusts and turbulence. Acts on the vehicle
    /// through [`Drag`](crate::Drag).
    ///
    /// The wind is constant during a step, at its value at the start of the step.
    #[derive(Clone, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Wind {
        /// Velocity of the steady wind, earth frame.
        #[parameter(STEADY, "m/s", -50.0..=50.0)]
        pub steady_m_s: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0),
        /// Discrete gusts, which may overlap.
        pub gusts: Vec<CosineGust> = Vec::new(),
        /// Turbulence. Its longitudinal axis follows the steady wind, or x without wind.
        pub turbulence: Option<Turbulence> = None,
    }
    together(wind) {
        wind.gusts.iter().try_for_each(CosineGust::validate)?;
        wind.turbulence.map_or(Ok(()), |turbulence| turbulence.validate())
    }
}

/// Gust that rises as V_m/2 (1 - cos(pi t/T)), holds, and falls like the rise.
///
/// MIL-F-8785C's discrete gust rises over a distance d_m, which a vehicle at airspeed V crosses in T = d_m/V, and then
/// persists (infinite `hold_s`). With a `hold_s` of zero it is the full 1-cosine gust of CS-25.341.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct CosineGust {
    /// V_m: peak velocity, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Onset \[s\].
    pub start_s: f64,
    /// T: time to the peak \[s\].
    pub rise_s: f64,
    /// Time from the end of the rise to the beginning of the fall \[s\].
    pub hold_s: f64,
}

/// Accepted ranges of a gust.
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod limits {
    use afbc_types::Range;
    pub const GUST: Range = Range::new("velocity_m_s", -50.0, 50.0);
    pub const START: Range = Range::new("start_s", 0.0, f64::INFINITY);
    pub const RISE: Range = Range::new("rise_s", 0.001, 1000.0);
    pub const HOLD: Range = Range::new("hold_s", 0.0, f64::INFINITY);
}

impl CosineGust {
    /// # Errors
    /// Returns the first number that is out of range, by name.
    fn validate(&self) -> Result<(), OutOfRange> {
        self.velocity_m_s.iter().try_for_each(|&speed| limits::GUST.check(speed))?;
        limits::START.check(self.start_s)?;
        limits::RISE.check(self.rise_s)?;
        limits::HOLD.check(self.hold_s)
    }

    /// Returns the velocity at time `t` \[s\], earth frame \[m/s\].
    pub fn at(&self, t: f64) -> Vector3<f64> {
        let since = t - self.start_s;
        // The fall is the rise reversed.
        let before_end = since.min(2.0 * self.rise_s + self.hold_s - since);
        if before_end <= 0.0 {
            Vector3::zeros()
        } else if before_end >= self.rise_s {
            self.velocity_m_s
        } else {
            self.velocity_m_s * (0.5 * (1.0 - cos(PI * before_end / self.rise_s)))
        }
    }
}

/// Wind in simulation.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedWind {
    wind: Wind,
    /// Cosine and sine of the steady wind's direction.
    heading: (f64, f64),
    eddies: Option<SimulatedTurbulence>,
    seed: u64,
    step_s: f64,
}

impl SimulatedWind {
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub(crate) fn new(wind: Wind, seed: u64, step_s: f64) -> Result<Self, OutOfRange> {
        wind.validate()?;
        let (x, y) = (wind.steady_m_s.x, wind.steady_m_s.y);
        let speed = sqrt(x * x + y * y);
        let heading = if speed > 0.0 { (x / speed, y / speed) } else { (1.0, 0.0) };
        let eddies = wind
            .turbulence
            .map(|turbulence| SimulatedTurbulence::new(turbulence, Noise::new(seed, NoiseStream::Wind), step_s));
        Ok(SimulatedWind { wind, heading, eddies, seed, step_s })
    }

    /// Changes the wind. Turbulence with unchanged settings continues; otherwise it starts anew.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range, and changes nothing then.
    pub(crate) fn change(&mut self, wind: &Wind) -> Result<(), OutOfRange> {
        let mut changed = SimulatedWind::new(wind.clone(), self.seed, self.step_s)?;
        if wind.turbulence == self.wind.turbulence {
            changed.eddies = self.eddies.take();
        }
        *self = changed;
        Ok(())
    }

    /// Returns the velocity of the air at the vehicle at time `t` \[s\], earth frame \[m/s\]. Every call advances one
    /// step.
    #[inline]
    pub(crate) fn advance(&mut self, t: f64, height_m: f64, velocity_m_s: &Vector3<f64>) -> Vector3<f64> {
        let mut air = self.wind.steady_m_s;
        for gust in &self.wind.gusts {
            air += gust.at(t);
        }
        if let Some(eddies) = &mut self.eddies {
            // The turbulence field drifts with the steady wind.
            let steady = &self.wind.steady_m_s;
            let local = eddies.advance(height_m, || sqrt((velocity_m_s - steady).norm_squared()));
            let (c, s) = self.heading;
            air += Vector3::new(c * local.x - s * local.y, s * local.x + c * local.y, local.z);
        }
        air
    }
}
