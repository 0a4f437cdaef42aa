//! Reads a simulated vehicle's instruments as its software receives them.

use super::sensor_model;
use afbc_estimator::{Measurement, Stamped};
use afbc_onboard::{AIDS_MAX, Aged, Readings};
use afbc_plant::{InstrumentSuite, SimulatedInstruments, Truth};
use afbc_scenario::{Outage, Scenario};
use afbc_types::OutOfRange;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Time before t = 0 for which a vehicle with its own estimator stands and is then carried to its start \[s\].
pub const STANDS_S: f64 = 4.0;
/// Time before t = 0 for which a rested vehicle is accelerated to its initial position and velocity, so that its
/// sensors see no jump \[s\].
pub const CARRIED_S: f64 = 1.0;

/// Instruments of a vehicle, and the measurements that no tick has taken yet.
#[derive(Clone)]
pub(super) struct VehicleInstruments {
    instruments: SimulatedInstruments,
    /// The instruments' noise and rates as the vehicle's software is told.
    told: InstrumentSuite,
    outages: Vec<Outage>,
    readings: Readings,
    /// Measurements that wait for a tick with room for them.
    waiting: VecDeque<Stamped<Measurement>>,
}

impl VehicleInstruments {
    /// Creates the instruments of `scenario`; none if the scenario has no IMU.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub(super) fn new(scenario: &Scenario, step_s: f64) -> Result<Option<Self>, OutOfRange> {
        let instruments = scenario.instruments(step_s)?.filter(|_| scenario.instruments.imu.is_some());
        Ok(instruments.map(|instruments| VehicleInstruments {
            instruments,
            told: scenario.told(),
            outages: scenario.outages.clone(),
            readings: Readings::NONE,
            waiting: VecDeque::new(),
        }))
    }

    pub(super) fn instruments_mut(&mut self) -> &mut SimulatedInstruments {
        &mut self.instruments
    }

    /// Returns the last readings.
    pub(super) fn readings(&self) -> &Readings {
        &self.readings
    }

    /// Reads the instruments in `truth` for the tick at that time. `at_us` converts to the vehicle's clock.
    pub(super) fn read(&mut self, truth: &Truth, at_us: impl Fn(f64) -> u64) -> &Readings {
        let VehicleInstruments { instruments, told, outages, readings, waiting } = self;
        let read = instruments.measure(truth);
        // The tracker is on the ground: its measurements are lost while the link is out.
        let heard = !outages.iter().any(|outage| (outage.start_s..outage.end_s).contains(&truth.time_s));
        if let Some(tracker) = told.tracker.filter(|_| heard) {
            waiting.extend(read.tracker.iter().map(|fix| sensor_model::pose(fix, &tracker, &at_us)));
        }
        waiting.extend(read.gnss.iter().map(|fix| sensor_model::gnss(fix, &at_us)));
        if let Some(barometer) = told.barometer {
            waiting.extend(read.barometer.iter().map(|fix| sensor_model::height(fix, &barometer, &at_us)));
        }
        if let Some(magnetometer) = told.magnetometer {
            waiting.extend(read.magnetometer.iter().map(|fix| sensor_model::field(fix, &magnetometer, &at_us)));
        }
        let now_us = at_us(truth.time_s);
        let age_us = |at_us: u64| u32::try_from(now_us.saturating_sub(at_us)).unwrap_or(u32::MAX);
        readings.imu = read.imu.map(|sample| Aged {
            value: [sample.rates_rad_s.cast(), sample.specific_force_m_s2.cast()],
            age_us: age_us(at_us(sample.at_s)),
        });
        readings.aids = [None; AIDS_MAX];
        for slot in &mut readings.aids {
            *slot = waiting.pop_front().map(|Stamped { value, at_us }| Aged { value, age_us: age_us(at_us) });
        }
        readings
    }
}

/// Returns the truth of a vehicle that stands at the place of `start` with its rotors still.
pub(super) fn still(start: &Truth, time_s: f64) -> Truth {
    Truth {
        time_s,
        velocity_m_s: Vector3::zeros(),
        acceleration_m_s2: Vector3::zeros(),
        rates_rad_s: Vector3::zeros(),
        angular_acceleration_rad_s2: Vector3::zeros(),
        rotor_speeds_rad_s: start.rotor_speeds_rad_s * 0.0,
        thrust_share: 0.0,
        ..*start
    }
}

/// Returns the truth of a vehicle before t = 0: it stands, and is carried to its start in the last [`CARRIED_S`]. A
/// constant acceleration reaches the start and its velocity exactly at t = 0.
pub(super) fn carried(start: &Truth, time_s: f64) -> Truth {
    let moving_s = (time_s + CARRIED_S).max(0.0);
    let acceleration_m_s2 = start.velocity_m_s * if moving_s > 0.0 { 1.0 / CARRIED_S } else { 0.0 };
    let still_m = start.position_m - start.velocity_m_s * (0.5 * CARRIED_S);
    Truth {
        position_m: still_m + acceleration_m_s2 * (0.5 * moving_s * moving_s),
        velocity_m_s: acceleration_m_s2 * moving_s,
        acceleration_m_s2,
        ..still(start, time_s)
    }
}

/// Returns the number of steps for which a vehicle stands before t = 0.
fn steps(step_s: f64) -> u64 {
    (STANDS_S / step_s).round() as u64
}

/// Sensors of a vehicle that runs its own estimator.
#[derive(Clone)]
pub(super) struct WiredInstruments {
    sensing: VehicleInstruments,
    step_s: f64,
    /// Number of looks so far.
    looks: u64,
}

impl WiredInstruments {
    /// Creates the sensors of `scenario`; none if the scenario has no IMU.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub(super) fn new(scenario: &Scenario, step_s: f64) -> Result<Option<Box<Self>>, OutOfRange> {
        let wired = |sensing| Box::new(WiredInstruments { sensing, step_s, looks: 0 });
        Ok(VehicleInstruments::new(scenario, step_s)?.map(wired))
    }

    /// Returns the sensors of a vehicle that does not stand still before t = 0.
    pub(super) fn at_once(mut self: Box<Self>) -> Box<Self> {
        self.looks = steps(self.step_s);
        self
    }

    pub(super) fn instruments(&self) -> &SimulatedInstruments {
        &self.sensing.instruments
    }

    pub(super) fn instruments_mut(&mut self) -> &mut SimulatedInstruments {
        self.sensing.instruments_mut()
    }

    /// Returns true if the vehicle still stands before t = 0.
    pub(super) fn stands(&self) -> bool {
        self.looks < steps(self.step_s)
    }

    /// Returns the readings of the last look.
    pub(super) fn readings(&self) -> &Readings {
        self.sensing.readings()
    }

    /// Reads all sensors. Before t = 0 they sense a vehicle at rest that is then carried to its start.
    pub(super) fn look(&mut self, truth: &Truth) {
        let step_s = self.step_s;
        let before_s = if self.stands() { self.looks as f64 * step_s - STANDS_S } else { 0.0 };
        let seen = if self.stands() { carried(truth, before_s) } else { *truth };
        self.looks += 1;
        // The clock starts one step before the first look, so no time is zero.
        let at_us = |time_s: f64| ((time_s + STANDS_S + step_s) * 1e6).round().max(0.0) as u64;
        let _ = self.sensing.read(&seen, at_us);
    }
}
