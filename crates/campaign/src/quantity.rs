//! Quantities that a campaign can draw.

use afbc_plant::instruments::{
    AccelerometerModel, BarometerModel, GyroscopeModel, ImuModel, MagnetometerModel, Preset,
};
use afbc_plant::{Deviations, Environment, InstrumentSuite, MeasurementDropouts, Payload, RotorFault, Turbulence};
use afbc_scenario::Scenario;
use afbc_types::{OutOfRange, Parameters, Range};
use core::f64::consts::TAU;
use nalgebra::Vector3;

/// A quantity that a campaign can draw.
pub struct Quantity {
    /// Name, ending in the unit, and accepted range. A quantity whose name ends in `ratio` multiplies the scenario's
    /// value.
    pub range: Range,
    /// Meaning in words.
    pub meaning: &'static str,
    /// True if only whole numbers are drawn.
    pub whole: bool,
    /// Name of another quantity that must be present, or else this quantity has no effect.
    pub needs: Option<&'static str>,
    /// Applies the value to a flight.
    apply: fn(&mut FlightAssembly, f64),
}

/// A flight under construction, while drawn values are applied to it.
struct FlightAssembly {
    scenario: Scenario,
    truth: Parameters<f64>,
    payload: Option<Payload>,
}

/// Applies `values` of `quantities`, in the order of [`QUANTITIES`], to `scenario`.
///
/// # Errors
/// The first parameter that the values put out of range.
pub(super) fn apply<'a>(
    scenario: Scenario,
    values: impl Iterator<Item = (&'a Quantity, f64)>,
) -> Result<Scenario, OutOfRange> {
    let truth = *scenario.environment.nominal();
    let mut flight = FlightAssembly { scenario, truth, payload: None };
    for (quantity, value) in values {
        (quantity.apply)(&mut flight, value);
    }
    let FlightAssembly { mut scenario, truth, payload } = flight;
    let old = &scenario.environment;
    let payloads = old.payloads().iter().copied().chain(payload).collect();
    scenario.environment =
        Environment::new(truth, old.changes().to_vec(), old.gusts().to_vec())?.with_payloads(payloads)?;
    Ok(scenario)
}

const fn quantity(
    name: &'static str,
    min: f64,
    max: f64,
    meaning: &'static str,
    apply: fn(&mut FlightAssembly, f64),
) -> Quantity {
    Quantity { range: Range::new(name, min, max), meaning, whole: false, needs: None, apply }
}

const fn needing(needs: &'static str, quantity: Quantity) -> Quantity {
    Quantity { needs: Some(needs), ..quantity }
}

const fn whole(quantity: Quantity) -> Quantity {
    Quantity { whole: true, ..quantity }
}

/// All quantities. A flight draws one number for each, used or not, in this order, so that adding a quantity to a
/// campaign does not change the others. New quantities are appended.
pub static QUANTITIES: [Quantity; 35] = [
    quantity("mass_ratio", 0.01, 100.0, "true mass divided by the scenario's", |f, x| f.truth.mass_kg *= x),
    quantity("inertia_ratio", 0.01, 100.0, "true Ix, Iy, Iz divided by the scenario's", |f, x| {
        f.truth.inertia_kg_m2 *= x
    }),
    quantity("thrust_factor_ratio", 0.01, 100.0, "true thrust factor divided by the scenario's", |f, x| {
        f.truth.thrust_factor_n_s2 *= x;
    }),
    quantity("drag_factor_ratio", 0.01, 100.0, "true rotor drag factor divided by the scenario's", |f, x| {
        f.truth.drag_factor_n_m_s2 *= x;
    }),
    quantity("rotor_time_constant_s", 0.0, 1.0, "lag of the rotors", |f, x| {
        f.scenario.realism.rotors.time_constant_s = x;
    }),
    quantity("rotor_delay_s", 0.0, 0.5, "delay from command to rotors", |f, x| f.scenario.realism.rotors.delay_s = x),
    quantity("rotor_efficiency", 0.0, 1.0, "remaining share of a failing rotor's thrust", |f, efficiency| {
        f.scenario.realism.rotors.faults.push(RotorFault { rotor: 1, efficiency, start_s: 0.0 });
    }),
    needing(
        "rotor_efficiency",
        Quantity {
            whole: true,
            ..quantity("fault_rotor", 1.0, 8.0, "number of the failing rotor; by default the first", |f, x| {
                f.scenario.realism.rotors.faults.last_mut().into_iter().for_each(|fault| fault.rotor = x as u8);
            })
        },
    ),
    needing(
        "rotor_efficiency",
        quantity("fault_start_s", 0.0, 36_000.0, "time of the failure; by default 0", |f, x| {
            f.scenario.realism.rotors.faults.last_mut().into_iter().for_each(|fault| fault.start_s = x);
        }),
    ),
    quantity("payload_kg", 0.0, 500.0, "mass of a payload, unknown to the law", |f, mass_kg| {
        f.payload =
            Some(Payload { mass_kg, below_m: 0.0, ahead_m: 0.0, left_m: 0.0, start_s: 0.0, end_s: f64::INFINITY });
    }),
    needing(
        "payload_kg",
        quantity(
            "payload_below_m",
            -10.0,
            10.0,
            "distance of the payload below the centre of mass; by default 0",
            |f, x| {
                f.payload.iter_mut().for_each(|payload| payload.below_m = x);
            },
        ),
    ),
    needing(
        "payload_kg",
        quantity("payload_start_s", 0.0, 36_000.0, "time at which the payload is picked up; by default 0", |f, x| {
            f.payload.iter_mut().for_each(|payload| payload.start_s = x);
        }),
    ),
    quantity("wind_m_s", 0.0, 50.0, "steady wind", |f, x| {
        f.scenario.realism.wind.steady_m_s = Vector3::new(x, 0.0, 0.0);
    }),
    needing(
        "wind_m_s",
        quantity(
            "wind_direction_rad",
            -TAU,
            TAU,
            "direction in which the wind blows, from +x toward +y; by default +x",
            |f, x| {
                let wind = &mut f.scenario.realism.wind.steady_m_s;
                let (sin, cos) = libm::sincos(x);
                // `wind_m_s` comes earlier in the list and has put the speed along x.
                *wind = Vector3::new(cos, sin, 0.0) * wind.x;
            },
        ),
    ),
    quantity("wind_20ft_m_s", 0.0, 50.0, "wind speed at 20 ft, which sets the intensity of the turbulence", |f, x| {
        let turbulence = &mut f.scenario.realism.wind.turbulence;
        *turbulence = Some(Turbulence { wind_20ft_m_s: x, ..turbulence.unwrap_or(Turbulence::MODERATE) });
    }),
    quantity("noise_ratio", 0.0, 100.0, "measurement noise divided by the scenario's", |f, x| {
        scale(&mut f.scenario.sensing.noise, x);
    }),
    quantity(
        "bias_ratio",
        0.0,
        100.0,
        "standard deviation of the measurement bias divided by the scenario's",
        |f, x| {
            scale(&mut f.scenario.sensing.bias, x);
        },
    ),
    quantity("sensor_delay_s", 0.0, 0.5, "delay from motion to measurement", |f, x| f.scenario.sensing.delay_s = x),
    quantity("dropout_rate_hz", 0.0, 1000.0, "rate of measurement dropouts", |f, rate_hz| {
        let dropouts = &mut f.scenario.sensing.dropouts;
        *dropouts = Some(MeasurementDropouts { rate_hz, ..dropouts.unwrap_or_default() });
    }),
    needing(
        "dropout_rate_hz",
        quantity(
            "dropout_mean_s",
            0.0,
            60.0,
            "mean length of a dropout; by default the scenario's, or 0.02",
            |f, x| {
                f.scenario.sensing.dropouts.iter_mut().for_each(|dropouts| dropouts.mean_s = x);
            },
        ),
    ),
    quantity("start_x_m", -100.0, 100.0, "offset of the start from the scenario's, along x", |f, x| {
        f.scenario.initial.position_m.x += x
    }),
    quantity("start_y_m", -100.0, 100.0, "offset of the start from the scenario's, along y", |f, x| {
        f.scenario.initial.position_m.y += x
    }),
    quantity("start_z_m", -100.0, 100.0, "offset of the start from the scenario's, along z", |f, x| {
        f.scenario.initial.position_m.z += x
    }),
    whole(quantity("imu_part", 1.0, 3.0, "inertial sensor: 1 ICM-42688-P, 2 BMI270, 3 MPU-6000", |f, x| {
        let chosen = part(&ImuModel::PRESETS, x);
        f.scenario.instruments.imu.iter_mut().zip(chosen).for_each(|(imu, chosen)| {
            // Vibration belongs to the vehicle, whichever sensor it has.
            let gyro = GyroscopeModel { vibration_rad_s: imu.gyro.vibration_rad_s, ..chosen.gyro };
            let accel = AccelerometerModel { vibration_m_s2: imu.accel.vibration_m_s2, ..chosen.accel };
            (imu.gyro, imu.accel) = (gyro, accel);
        });
    })),
    quantity("vibration_ratio", 0.0, 100.0, "vibration of the inertial sensor divided by the scenario's", |f, x| {
        f.scenario.instruments.imu.iter_mut().for_each(|imu| {
            imu.gyro.vibration_rad_s *= x;
            imu.accel.vibration_m_s2 *= x;
        });
    }),
    whole(quantity("barometer_part", 1.0, 2.0, "barometer: 1 DPS310, 2 BMP388", |f, x| {
        let chosen = part(&BarometerModel::PRESETS, x);
        f.scenario.instruments.barometer.iter_mut().zip(chosen).for_each(|(old, chosen)| *old = chosen);
    })),
    whole(quantity("magnetometer_part", 1.0, 2.0, "magnetometer: 1 IST8310, 2 QMC5883L", |f, x| {
        let chosen = part(&MagnetometerModel::PRESETS, x);
        f.scenario.instruments.magnetometer.iter_mut().zip(chosen).for_each(|(old, chosen)| *old = chosen);
    })),
    quantity("tracker_delay_s", 0.0, 1.0, "mean delay of the tracker", |f, x| {
        f.scenario.instruments.tracker.iter_mut().for_each(|tracker| tracker.delay_s = x);
    }),
    quantity("tracker_outliers", 0.0, 1.0, "share of the tracker's fixes that are outliers", |f, x| {
        f.scenario.instruments.tracker.iter_mut().for_each(|tracker| tracker.outliers = x);
    }),
    quantity("tracker_loss_rate_hz", 0.0, 1000.0, "rate of the tracker's dropouts", |f, x| {
        f.scenario.instruments.tracker.iter_mut().for_each(|tracker| tracker.loss.rate_hz = x);
    }),
    needing(
        "tracker_loss_rate_hz",
        quantity(
            "tracker_loss_mean_s",
            0.0,
            60.0,
            "mean length of the tracker's dropouts; by default the scenario's",
            |f, x| {
                f.scenario.instruments.tracker.iter_mut().for_each(|tracker| tracker.loss.mean_s = x);
            },
        ),
    ),
    quantity("gnss_delay_s", 0.0, 1.0, "mean delay of the GNSS receiver", |f, x| {
        f.scenario.instruments.gnss.iter_mut().for_each(|gnss| gnss.delay_s = x);
    }),
    quantity("gnss_loss_rate_hz", 0.0, 1000.0, "rate of the GNSS receiver's dropouts", |f, x| {
        f.scenario.instruments.gnss.iter_mut().for_each(|gnss| gnss.loss.rate_hz = x);
    }),
    needing(
        "gnss_loss_rate_hz",
        quantity(
            "gnss_loss_mean_s",
            0.0,
            60.0,
            "mean length of the GNSS receiver's dropouts; by default the scenario's",
            |f, x| {
                f.scenario.instruments.gnss.iter_mut().for_each(|gnss| gnss.loss.mean_s = x);
            },
        ),
    ),
    whole(quantity(
        "aiding",
        1.0,
        2.0,
        "instruments that aid the inertial sensor: 1 for the tracker only, 2 for all others without the tracker",
        |f, x| {
            let suite = &mut f.scenario.instruments;
            *suite = if x < 1.5 {
                InstrumentSuite { imu: suite.imu, tracker: suite.tracker, ..InstrumentSuite::default() }
            } else {
                InstrumentSuite { tracker: None, ..*suite }
            };
        },
    )),
];

/// Returns the settings of part number `number`, from 1 on.
fn part<T: Copy>(parts: &[Preset<T>], number: f64) -> Option<T> {
    parts.get((number as usize).checked_sub(1)?).map(|part| part.settings)
}

fn scale(spread: &mut Deviations, ratio: f64) {
    let Deviations { position_m, velocity_m_s, attitude_rad, rates_rad_s } = spread;
    for size in [position_m, velocity_m_s, attitude_rad, rates_rad_s] {
        *size *= ratio;
    }
}
