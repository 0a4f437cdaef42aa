//! State estimator of a multirotor: position, velocity, attitude and biases from an IMU and aiding sensors.
//!
//! ```
//! use afbc_estimator::{Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
//! use nalgebra::Vector3;
//!
//! let estimator = Estimator::new(Settings::DEFAULT).unwrap();
//! let mut memory = Memory::default();
//! for ms in 1..=2000 {
//!     let at_us = 1000 * ms;
//!     // The last bits of a real sensor are never still; one that is counts as stuck.
//!     let noise = 1e-3 * (ms % 7) as f32;
//!     let specific_force_m_s2 = Vector3::new(noise, 0.0, 9.81);
//!     let sample = ImuSample { at_us, rates_rad_s: Vector3::zeros(), specific_force_m_s2 };
//!     let position_m = Vector3::new(1.0, 2.0, 0.0);
//!     if ms % 10 == 0 {
//!         // It took 8 ms to arrive.
//!         memory.offer(&Stamped { value: Measurement::Position { position_m, sigma_m: 0.001 }, at_us: at_us - 8000 });
//!     }
//!     let estimate = estimator.step(&mut memory, at_us, Some(&sample));
//!     assert_eq!(estimate.validity.attitude, ms > 1000);
//! }
//! let estimate = estimator.step(&mut memory, 2_001_000, None);
//! assert!(estimate.validity.position && (estimate.state.position_m.y - 2.0).abs() < 0.01);
//! // Nothing has measured a heading.
//! assert!(!estimate.validity.heading);
//! ```
//!
//! # The filter
//!
//! The estimator is an error-state Kalman filter (Sola, *Quaternion kinematics for the error-state Kalman filter*,
//! arXiv 1711.02508, 2017; PX4's EKF2; Mueller, Hamer, D'Andrea, *Fusing ultra-wideband range measurements with
//! accelerometers and rate gyroscopes for quadrocopter state estimation*, ICRA 2015, which the Crazyflie flies). The
//! [nominal state](nominal) follows every IMU sample. Its error is small and is estimated linearly. There are 15 errors
//! (rotation, velocity, position, biases of gyroscope and accelerometer) and a 16th, the barometer's offset. Five more,
//! the [slow errors](slow) of a GNSS receiver and a magnetometer, are considered but not estimated. [The
//! covariance](covariance) is predicted every 4 ms from the sum of the samples since then, block by block, because most
//! of the transition matrix is zeros and ones.
//!
//! **The filter runs at the present.** EKF2 runs its filter at a delayed time, when all measurements have arrived, and
//! bridges the delay with a second, simpler predictor. Here state and covariance are those of the newest sample, and
//! there is only one output. A [ring of past states](history) gives each measurement the state of its own time, up to
//! 250 ms ago. The filter's equations, solved backwards, turn the measurement's [Jacobian](horizon) into one of the
//! present errors. Only the IMU's noise during the delay is neglected: for 100 ms, less than a tenth of any receiver's
//! noise.
//!
//! **The rotation error is in the earth frame**, and is rotated along when the attitude is corrected. Between
//! corrections it has no transition of its own, which saves a sixth of the prediction. An unmeasured heading is a
//! single large variance, while the tilt variances stay small. Rotating the error along keeps tilt and accelerometer
//! bias correlated in the body frame; a hovering vehicle cannot tell the two apart. Without it, every heading
//! correction would look like a manoeuvre, and after hours at rest the filter would be certain of a bias that it never
//! observed. A little of this remains with the noise settings of the bare sensor: in ten hours at rest outdoors the
//! standard deviation of a horizontal bias falls from 0.1 to 0.05 m/s2, although it should stay, and errors reach three
//! standard deviations. With the default settings they do not reach two (`tests/soundness.rs`).
//!
//! **Scalars are fused one by one**: [one per step](fusion), two if measurements pile up, none in a step that predicts.
//! This bounds the longest step.
//!
//! # Sensors
//!
//! * A **tracker** and a **GNSS receiver** both measure the position in the earth frame and must have the same origin
//!   (on board, `afbc_onboard::EstimatorFrontEnd` sees to that). The first to arrive sets the position. While one is
//!   fused, the other is rejected if it contradicts. A receiver's height has its own gate. The receiver's antenna and
//!   the IMU are assumed at the centre of mass; [`ImuCalibration`] corrects the samples of an IMU elsewhere.
//! * [`Settings::gnss_noise_m`] of a receiver's reported standard deviation is noise. The rest is a [slow error that
//!   stays for minutes](slow). More fixes do not average the slow error, so the position is only as good as the
//!   receiver.
//! * A tracker that repeats exactly the same pose for [`Settings::frozen_s`] counts as frozen and is not fused.
//! * The **barometer**'s offset is a state. The first height sets it to agree with the position: z = 0 at the start,
//!   and the tracker's or receiver's z from the first fix on. Then the receiver's height corrects the offset's drift,
//!   and the barometer averages the receiver's noise. With neither tracker nor receiver, the barometer holds the
//!   height, and its standard deviation grows with the offset's random walk.
//! * The **magnetometer** corrects only the heading and the gyroscope bias, so a disturbed field cannot tilt the
//!   vehicle. The field of the vehicle's iron and currents, [`Settings::mag_slow_rad`], is a slow error too: it is not
//!   averaged, and it limits the accuracy of the heading. A field whose strength or inclination differs from that at
//!   the start is not used.
//! * A **heading** that neither tracker nor magnetometer measures is found from the motion once the vehicle
//!   accelerates. From positions alone it never counts as valid, because an error of nearly half a turn may stay with a
//!   small standard deviation. From a receiver's velocity it does.
//! * **At rest on the ground** the filter fuses zero velocity, as long as [the IMU shows rest](rest) and the motors are
//!   known not to carry the vehicle ([`Memory::set_on_ground`]). If that is unknown, it does so until the vehicle first
//!   moves after the alignment. A vehicle carried by hand is followed. In the air, after [`Settings::coast_s`] without
//!   any aid, a weak zero velocity keeps roll and pitch level. It assumes speeds of 5 m/s that last for 2.5 s, which is
//!   not white noise. The tilt then keeps to its stated standard deviation (`tests/unaided.rs`); velocity and position
//!   are invalid.
//!
//! # For a controller
//!
//! Each fix makes position and velocity jump, most of all when an aid comes back, and the rotors' vibration shakes the
//! velocity. [`OutputFilter`] gives a controller the state without jumps and vibration. It can also hand over resets of
//! position and heading ([`OutputFilter::handing_over`]), so that setpoints shift along and the vehicle does not move.
//!
//! # When something is wrong
//!
//! Each kind of measurement has a gate. A rejected measurement [is followed](follow) only if no other aid contradicts
//! it ([`aid`]). It is never followed while two others agree without it: barometer and receiver velocity about the
//! receiver's height, or receiver velocity and gyroscope about a compass. While something else holds the state, it is
//! followed after [`Settings::reacquire_s`] without a fused one. Otherwise it is followed after three fifths of
//! [`Settings::coast_s`], while the state is still valid. Its part of the state is then reset to the measurement and
//! counted ([`Resets`]). The new error is that of the measurement, including its covariances with the other errors. A
//! second reset within ten seconds also raises the variance of roll and pitch, and a heading reset that of the
//! gyroscope bias.
//!
//! **The heading from a receiver's velocity** comes from a [bank of filters](yaw_bank) that never use a compass. The
//! bank sets an unknown heading. It resets a known one if it contradicts that for two seconds by more than 20 degrees
//! and three standard deviations. So a compass that is disturbed along the body does not turn the vehicle away.
//!
//! Innovations with a mean to one side raise the bias variances, since a bias must have changed more than expected. A
//! clipped accelerometer sample raises the velocity variance, a clipped gyroscope sample the attitude variance, and
//! gaps of more than 20 ms raise both. After 250 ms without samples, or if the state becomes impossible, the filter
//! restarts where it is. The output is finite for any input, and the covariance stays valid (`tests/anything.rs`): each
//! prediction adds variance against rounding, and a block that is no valid covariance is found within 60 ms, reset and
//! counted.
//!
//! # Reading order
//!
//! * Input and output: [`measurement`], [`settings`], [`data_sheet`], [`estimate`].
//! * Correction of samples to body axes and centre of mass: [`calibration`], [`lever`].
//! * The step: [`estimator`]. Alignment: [`align`]. Rest: [`rest`].
//! * Prediction: [`nominal`], [`errors`], [`covariance`].
//! * Fusion of measurements: [`history`], [`horizon`], [`queue`], [`fusion`], [`slow`].
//! * Gates, resets, heading, starts, IMU health: [`aid`], [`follow`], [`yaw_bank`], [`restart`], [`imu`].
//! * Small mathematics: [`rotation`], [`geodetic`].
#![no_std]
#![allow(rustdoc::private_intra_doc_links, reason = "the modules' documentation is for their reader")]

mod aid;
mod align;
mod calibration;
mod covariance;
mod data_sheet;
mod errors;
mod estimate;
mod estimator;
mod follow;
mod fusion;
mod geodetic;
mod height_check;
mod height_watch;
mod history;
mod horizon;
mod imu;
mod inertial;
mod lever;
mod measurement;
mod memory;
mod nominal;
mod output_filter;
mod queue;
mod rest;
mod restart;
mod rotation;
mod settings;
mod slow;
mod yaw_bank;

pub use afbc_types::Stamped;
pub use aid::{AidRecord, AidRecords, AidSet, AidSource};
pub use align::Unready;
pub use calibration::ImuCalibration;
pub use data_sheet::{DataSheet, InertialSensorFigures};
pub use estimate::{DroppedMeasurements, Estimate, Resets, Sigmas, Validity};
pub use estimator::Estimator;
pub use geodetic::GeodeticOrigin;
pub use imu::{ImuHealth, MISSING_US};
pub use inertial::InertialState;
pub use lever::LeverArmEstimator;
pub use measurement::{ImuSample, Measurement};
pub use memory::Memory;
pub use output_filter::{OutputFilter, VelocityNotch};
pub use settings::Settings;

#[cfg(test)]
mod tests;
