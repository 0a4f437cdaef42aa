//! Searches for the control tick with the most instructions: first random plausible states, then hill climbing from the
//! worst of them.
//!
//! A tick's cost also depends on the law's memory. So the search is one long flight: every candidate is flown for a few
//! ticks and starts from the adaptive estimates that the previous ones left. The search finds a bad tick; it does not
//! prove that there is no worse one.

use crate::{Emulator, Error};
use afbc_estimator::Measurement;
use afbc_hil::Station;
use afbc_mavlink::{Uplink, VehicleCommand};
use afbc_onboard::{AIDS_MAX, Aged, Readings};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Ticks for which a candidate is flown, and then its mirror image. A tracker with constant pose but non-zero velocity
/// would soon be distrusted.
const HOLD: u64 = 8;
/// Ticks at rest before the vehicle is armed.
const REST: u64 = 1_050;
/// Numbers per candidate.
const NUMBERS: usize = 19;
/// Scale of each number. State: position \[m\], velocity \[m/s\], attitude \[rad\], rates \[rad/s\]. Setpoint: position
/// \[m\], velocity \[m/s\], yaw \[rad\].
const SCALES: [f32; NUMBERS] =
    [2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 0.6, 0.6, 3.0, 5.0, 5.0, 5.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 3.0];

/// The worst tick found by a search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorstTick {
    /// Number of instructions in the worst tick.
    pub instructions: u32,
    /// Index of the candidate in which the tick occurred.
    pub candidate: u64,
    /// Number of candidates flown.
    pub candidates: u64,
    /// Number of ticks flown with the motors on.
    pub ticks: u64,
}

/// Source of the state on which the vehicle flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateSource {
    /// States from the link.
    Link,
    /// The vehicle's own estimate. It gets more measurements than it can fuse, which contradict the IMU samples and one
    /// another.
    Estimate,
}

/// Flies `candidates` candidates, which depend only on `seed`, and returns the worst tick.
///
/// # Errors
/// Fails if the emulator fails or the vehicle does not arm.
pub fn search(emulator: Emulator, source: StateSource, seed: u64, candidates: u64) -> Result<WorstTick, Error> {
    let random = SplitMix64::seed_from_u64(seed);
    let mut flight = EmulatedFlight { emulator, source, station: Station::default(), tick: 0, random };
    let mut worst = WorstTick { candidates, ..WorstTick::default() };
    let (mut summit, mut height) = ([0.0; NUMBERS], 0);
    for candidate in 0..candidates {
        // The first half of the candidates is random; the second half climbs.
        let numbers = if candidate < candidates / 2 { flight.anywhere() } else { flight.near(&summit) };
        let mut instructions = 0;
        for tick in 0..2 * HOLD {
            // Repeated, since the monitor trips and the safety net leaves the mode.
            if tick == 0 {
                flight.station.say(&Uplink::Command(VehicleCommand::Engage));
                flight.station.follow();
            }
            let (state, setpoint) = flight.inputs(&numbers, tick >= HOLD);
            match flight.fly(state, setpoint)? {
                Some(this) => {
                    worst.ticks += 1;
                    instructions = instructions.max(this);
                }
                None => flight.arm()?,
            }
        }
        // The search also accepts equal candidates, so that the climb can cross plateaus.
        if instructions >= height {
            (summit, height) = (numbers, instructions);
        }
        if instructions > worst.instructions {
            (worst.instructions, worst.candidate) = (instructions, candidate);
        }
    }
    Ok(worst)
}

struct EmulatedFlight {
    emulator: Emulator,
    source: StateSource,
    station: Station,
    tick: u64,
    random: SplitMix64,
}

impl EmulatedFlight {
    /// Draws a number in -1..1.
    fn number(&mut self) -> f32 {
        // An f32 holds 24 random bits exactly.
        (self.random.next_u64() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn anywhere(&mut self) -> [f32; NUMBERS] {
        // Some candidates are far from hover, some near it.
        let reach = (self.number() + 1.0) / 2.0;
        [0.0; NUMBERS].map(|_| reach * self.number())
    }

    /// Draws a candidate near `numbers`.
    fn near(&mut self, numbers: &[f32; NUMBERS]) -> [f32; NUMBERS] {
        numbers.map(|number| match self.random.next_u64() % 8 {
            0 => self.number(),
            1..=3 => (number + 0.1 * self.number()).clamp(-1.0, 1.0),
            _ => number,
        })
    }

    fn inputs(&mut self, numbers: &[f32; NUMBERS], mirrored: bool) -> (State, Setpoint) {
        let sign = if mirrored { -1.0 } else { 1.0 };
        // Noise, since real measurements never repeat exactly.
        let noise = 1e-5 * self.number();
        let mut scaled = numbers.iter().zip(SCALES).map(|(number, scale)| number * scale);
        let mut next = || scaled.next().unwrap_or(0.0);
        let mut vector = || Vector3::new(next(), next(), next());
        let state = State {
            position_m: vector().add_scalar(noise),
            velocity_m_s: sign * vector(),
            attitude_rad: vector(),
            rates_rad_s: sign * vector(),
        };
        let (position_m, velocity_m_s) = (vector(), vector());
        (state, Setpoint { position_m, velocity_m_s, yaw_rad: next(), ..Setpoint::default() })
    }

    /// Flies one tick; returns its instructions if the motors were on.
    fn fly(&mut self, state: State, setpoint: Setpoint) -> Result<Option<u32>, Error> {
        self.tick += 1;
        match self.source {
            StateSource::Link => self.station.track(self.tick * 1000, state),
            StateSource::Estimate => {
                let readings = self.readings(&state);
                self.emulator.sense(&readings);
            }
        }
        self.station.say(&Uplink::Setpoint(setpoint));
        let reply = self.emulator.exchange(&self.station.take())?;
        Ok((reply.throttles.iter().any(|throttle| *throttle != 0)).then_some(reply.instructions))
    }

    /// Returns an IMU sample and measurements of any age for a vehicle in this state. On the ground they are mostly a
    /// tracker's.
    fn readings(&mut self, state: &State) -> Readings {
        let [noise, other] = [1e-3 * self.number(), 1e-3 * self.number()];
        let force_m_s2 = Vector3::new(noise, other, 9.81) + 0.1 * state.velocity_m_s;
        let imu = Some(Aged { value: [state.rates_rad_s.add_scalar(noise), force_m_s2], age_us: 0 });
        let q = state.quaternion().coords;
        let pose = Measurement::Pose {
            position_m: state.position_m.add_scalar(other),
            attitude: [q.w, q.x, q.y, q.z],
            position_sigma_m: 0.01,
            attitude_sigma_rad: 0.02,
        };
        let kinds = [
            pose,
            Measurement::Gnss {
                position_m: state.position_m,
                velocity_m_s: state.velocity_m_s,
                horizontal_sigma_m: 1.0,
                vertical_sigma_m: 2.0,
                speed_sigma_m_s: 0.1,
                climb_sigma_m_s: 0.1,
            },
            Measurement::Height { height_m: state.position_m.z, sigma_m: 0.1 },
            Measurement::MagneticField { field: Vector3::new(20.0, other, -40.0), sigma: 0.5 },
            Measurement::Heading { heading_rad: state.attitude_rad.z, sigma_rad: 0.1 },
        ];
        if *state == State::default() {
            // The other measurements come now and then, since a silent sensor forbids arming.
            let other = kinds.get(self.tick as usize / 100 % kinds.len()).filter(|_| self.tick.is_multiple_of(100));
            let aids = [Some(pose), other.copied()].map(|value| Some(Aged { value: value?, age_us: 2_000 }));
            return Readings { imu, aids };
        }
        let mut aid = |_| {
            let random = self.random.next_u64();
            let value = kinds.get(random as usize % (kinds.len() + 1)).copied()?;
            Some(Aged { value, age_us: (random >> 32) as u32 % 250_000 })
        };
        let mut readings = Readings { imu, aids: [None; AIDS_MAX] };
        let drawn = [aid(0), aid(1)].into_iter().flatten();
        readings.aids.iter_mut().zip(drawn).for_each(|(slot, aid)| *slot = Some(aid));
        readings
    }

    /// Puts the vehicle on the ground and arms it.
    fn arm(&mut self) -> Result<(), Error> {
        for tick in 0..3 * REST {
            if tick >= REST && tick.is_multiple_of(10) {
                self.station.say(&Uplink::Command(VehicleCommand::Arm));
            }
            if self.fly(State::default(), Setpoint::default())?.is_some() {
                return Ok(());
            }
        }
        Err(Error::Protocol("the vehicle does not arm".into()))
    }
}
