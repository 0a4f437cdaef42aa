//! State estimator of a multirotor: position, velocity, attitude and biases from an IMU and whatever aids it.
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
//! An error-state Kalman filter (Sola, *Quaternion kinematics for the error-state Kalman filter*, arXiv 1711.02508,
//! 2017; PX4's EKF2; Mueller, Hamer, D'Andrea, *Fusing ultra-wideband range measurements with accelerometers and rate
//! gyroscopes for quadrocopter state estimation*, ICRA 2015, which the Crazyflie flies). The [nominal state](nominal)
//! follows every sample of the inertial sensors. Its error is small, so it is estimated linearly: 15 errors (rotation,
//! velocity, position, biases of gyroscope and accelerometer) and a 16th, the barometer's offset; five more, the
//! [slow errors](slow) of a GNSS receiver and of a magnetometer, are considered without being estimated. [Their
//! covariance](covariance) is predicted every 4 ms from what the samples since then add up to, block by block, since
//! most of the transition matrix is zeros and ones.
//!
//! **It runs at the present.** Others (EKF2) run the filter at a time in the past, when all measurements are there, and
//! bridge the rest by a second, simpler predictor. Here state and covariance are those of the newest sample, so an
//! output is as good as the filter, and there is one of it. A [ring of past states](history) gives each measurement the
//! state of its own time, up to 250 ms ago, and the filter's equations, solved backwards, [make its
//! Jacobian](horizon) that of the present errors. What is lost is the noise of the inertial sensors during the delay:
//! for 100 ms, less than a tenth of any receiver's.
//!
//! **The rotation error is in the earth frame**, and is carried along when the attitude is corrected. Between
//! corrections it has no transition of its own, which saves a sixth of the prediction; a heading that nothing has
//! measured is one large variance, and the tilt's stay small. Carrying it along keeps tilt and accelerometer bias,
//! which a hovering vehicle cannot tell apart, tied to one another in the body. Without that, every correction of the
//! heading looks like a manoeuvre, and after hours at rest the filter is sure of a bias that it has never seen. A
//! little of this remains if the settings are those of the bare part: in ten hours at rest outdoors the standard
//! deviation of a horizontal bias falls from 0.1 to 0.05 m/s2, where it should stay, and errors reach three of it. With
//! the default settings they do not reach two (`tests/soundness.rs`).
//!
//! **Scalars are fused one by one**, [one per step](fusion), two if measurements pile up, none in a step that predicts:
//! that bounds the worst step.
//!
//! # Sensors
//!
//! * A **tracker** and a **GNSS receiver** both measure the position in the earth frame. Their origins must be the same
//!   (on board `afbc_onboard::EstimatorFrontEnd` sees to that); whichever comes first sets the position, and one that
//!   contradicts the other is rejected as long as the other is there. A receiver's height has a gate of its own. The
//!   receiver's antenna is taken to be at the centre of mass, as is the IMU, whose samples [`ImuCalibration`] corrects
//!   where it is not.
//! * Of the standard deviation that a receiver reports, [`Settings::gnss_noise_m`] is noise, and the rest an
//!   [error that stays for minutes](slow), which further fixes do not average: the position is as good as the receiver.
//! * A tracker that repeats its pose in every bit for [`Settings::frozen_s`] is frozen, and not believed.
//! * The **barometer**'s offset is a state. It is set so that the first height agrees with the position then: with
//!   z = 0 at the start, and with the tracker's or the receiver's z from their first fix on. The receiver's height then
//!   corrects the offset's drift and the barometer the receiver's noise; without either of these two, the barometer
//!   holds the height, and the standard deviation grows with the offset's random walk.
//! * The **magnetometer** corrects the heading and the gyroscope's bias, nothing else: a disturbed field cannot tilt
//!   the vehicle. What iron and currents of the vehicle add to the field, [`Settings::mag_slow_rad`], is a slow error
//!   too: further fields do not average it, and the heading is as good as that. A field whose strength or inclination
//!   is not that of the start is not used.
//! * A **heading** that neither tracker nor magnetometer measures follows from the motion once the vehicle accelerates.
//!   By positions alone it never counts as valid, since an error of nearly half a turn may stay with a small standard
//!   deviation; by a receiver's velocity it does.
//! * **At rest on the ground** the velocity is held at zero, as long as [the inertial sensor shows rest](rest) and the
//!   motors are known not to carry the vehicle ([`Memory::set_on_ground`]), or that is unknown and it has not moved
//!   since the alignment. A vehicle carried by hand is followed. In the air without any aid for [`Settings::coast_s`] a
//!   weak zero keeps roll and pitch level: of 5 m/s that stay for 2.5 s, which is no white noise. The tilt is then as
//!   good as is said (`tests/unaided.rs`); velocity and position are invalid.
//!
//! # For a controller
//!
//! Each fix makes position and velocity jump, those of an aid that comes back most, and the rotors shake the velocity.
//! [`OutputFilter`] gives a controller the same state without either. A position or heading that is set anew, it can
//! hand over instead ([`OutputFilter::handing_over`]), so that setpoints shift with it and the vehicle does not move.
//!
//! # When something is wrong
//!
//! Each kind of measurement has a gate. One that contradicts the state [is followed](follow) only when nothing that it
//! could be held against is left ([`aid`]): never while two others agree without it, as barometer and a receiver's
//! velocity do about its height, and that velocity with the gyroscope about a compass; after [`Settings::reacquire_s`]
//! without a fused one, while something else holds the state; and after three fifths of [`Settings::coast_s`] where
//! nothing does, before the state is not valid any more. Its part of the state is then set to it and counted
//! ([`Resets`]); the new error is that of the measurement, with every covariance that it has by the others' errors. A
//! second reset within ten seconds doubts roll and pitch too, and one of the heading the gyroscope's bias.
//!
//! **The heading by a receiver's velocity** comes from a [bank of filters](yaw_bank) that take nothing from a compass.
//! It sets a heading that nobody has told, or that it contradicts for two seconds by more than 20 degrees and three
//! standard deviations: a compass that is disturbed along the body turns no vehicle away.
//!
//! Innovations that lean to one side doubt the biases, which have changed by more than was told. A clipped sample adds
//! to the variance of what was clipped: the accelerometer's to the velocity, the gyroscope's to the attitude. Gaps of
//! more than 20 ms raise both; after 250 ms without samples, or if the state is not possible any more, the filter
//! starts again where it is. It has no output that is not finite, whatever is put in, and the covariance stays one
//! (`tests/anything.rs`): a prediction adds what rounding may have taken, and a block of it that no covariance can have
//! is found within 60 ms, forgotten and counted.
//!
//! # Reading order
//!
//! [`measurement`], [`settings`], [`data_sheet`], [`estimate`]: in and out. [`calibration`], [`lever`]: samples to body
//! axes and the centre of mass.
//! [`estimator`]: a step. [`align`]: the start. [`rest`]: rest. [`nominal`], [`errors`], [`covariance`]: prediction.
//! [`history`], [`horizon`], [`queue`], [`fusion`], [`slow`]: measurements. [`aid`], [`follow`], [`yaw_bank`],
//! [`restart`], [`imu`]: gates, resets, heading, starts, health. [`rotation`], [`geodetic`]: small mathematics.
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
pub use aid::{Aid, AidRecord, Aids};
pub use align::Unready;
pub use calibration::ImuCalibration;
pub use data_sheet::{DataSheet, Triad};
pub use estimate::{Dropped, Estimate, Resets, Sigmas, Validity};
pub use estimator::Estimator;
pub use geodetic::Origin;
pub use imu::{ImuHealth, MISSING_US};
pub use inertial::Inertial;
pub use lever::LeverFinder;
pub use measurement::{ImuSample, Measurement};
pub use memory::Memory;
pub use output_filter::{OutputFilter, VelocityNotch};
pub use settings::Settings;

#[cfg(test)]
mod tests;
