//! Settings of the estimator.

use afbc_types::parameters;

parameters! {
    /// Settings of the estimator: noise of the inertial sensors, limits of validity, gates.
    ///
    /// The noise of the other sensors comes with each measurement.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Settings {
        /// Acceleration of free fall.
        #[parameter(GRAVITY, "m/s2", 9.7..=9.9)]
        pub gravity_m_s2: f32 = 9.81,
        /// Noise density of the gyroscope, including vibration and model errors. The default suits any vehicle in
        /// flight; an ICM-42688-P alone has 5e-5.
        #[parameter(GYR_NOISE, "rad/s/rtHz", 1e-6..=0.1)]
        pub gyro_noise_rad_s_rthz: f32 = 1e-3,
        /// Noise density of the accelerometer, including vibration and model errors. The default suits any vehicle in
        /// flight; an ICM-42688-P alone has 7e-4.
        #[parameter(ACC_NOISE, "m/s2/rtHz", 1e-5..=1.0)]
        pub accel_noise_m_s2_rthz: f32 = 2e-2,
        /// Random walk of the gyroscope's bias, per root of a second.
        #[parameter(GYR_WALK, "rad/s/rts", 1e-8..=0.01)]
        pub gyro_walk_rad_s_rts: f32 = 5e-5,
        /// Random walk of the accelerometer's bias, per root of a second.
        #[parameter(ACC_WALK, "m/s2/rts", 1e-7..=0.1)]
        pub accel_walk_m_s2_rts: f32 = 3e-4,
        /// Standard deviation of the accelerometer's bias at the start. Levelling cannot distinguish this bias from a
        /// tilt.
        #[parameter(ACC_BIAS, "m/s2", 1e-3..=1.0)]
        pub accel_bias_m_s2: f32 = 0.1,
        /// Largest bias of the gyroscope; alignment refuses a larger rate.
        #[parameter(GYR_BIAS_MAX, "rad/s", 0.01..=1.0)]
        pub gyro_bias_max_rad_s: f32 = 0.35,
        /// Largest bias of the accelerometer.
        #[parameter(ACC_BIAS_MAX, "m/s2", 0.1..=5.0)]
        pub accel_bias_max_m_s2: f32 = 1.5,
        /// Random walk of the barometer's offset, per root of a second.
        #[parameter(BARO_WALK, "m/rts", 1e-4..=1.0)]
        pub baro_walk_m_rts: f32 = 0.02,

        /// Noise of a GNSS receiver's position from fix to fix, standard deviation per coordinate. The estimator takes
        /// the rest of the reported standard deviation as a slow error, which averaging does not reduce.
        #[parameter(GNSS_NOISE, "m", 0.01..=1000.0)]
        pub gnss_noise_m: f32 = 0.5,
        /// Correlation time of the GNSS position's slow error.
        #[parameter(GNSS_SLOW, "s", 1.0..=1e5)]
        pub gnss_slow_s: f32 = 120.0,
        /// Heading error caused by the vehicle's iron, magnets and currents, standard deviation along each of body x
        /// and y. This error is constant, so averaging does not reduce it; the standard deviation of a measurement only
        /// describes the noise. The default suits a compass that was calibrated once: 0.04 gauss of error in a field of
        /// 0.2 gauss. From 0.5 rad on, the estimator takes no heading from the compass.
        #[parameter(MAG_SLOW, "rad", 0.0..=1.0)]
        pub mag_slow_rad: f32 = 0.2,
        /// Time of identical poses or positions after which a tracker counts as frozen and is ignored; 0 for never.
        #[parameter(FROZEN, "s", 0.0..=10.0)]
        pub frozen_s: f32 = 0.2,

        /// Largest accepted innovation, in standard deviations.
        #[parameter(GATE, "1", 2.0..=20.0)]
        pub gate_sigmas: f32 = 5.0,
        /// Time without fusing an aid after which the estimator resets to the aid although it contradicts the state, as
        /// in PX4's EKF2. If no other aid holds the state, the reset comes earlier, after three fifths of `coast_s` at
        /// the latest, while the state is still valid.
        #[parameter(REACQUIRE, "s", 0.05..=60.0)]
        pub reacquire_s: f32 = 7.0,
        /// Time without any aid after which velocity and position are invalid.
        #[parameter(COAST, "s", 0.1..=60.0)]
        pub coast_s: f32 = 5.0,
        /// Largest standard deviation of a valid roll and pitch.
        #[parameter(TILT_SIGMA, "rad", 0.01..=1.0)]
        pub tilt_sigma_max_rad: f32 = 0.15,
        /// Largest standard deviation of a valid heading.
        #[parameter(HEAD_SIGMA, "rad", 0.01..=1.0)]
        pub heading_sigma_max_rad: f32 = 0.35,
        /// Largest standard deviation of a valid velocity, in any direction.
        #[parameter(VEL_SIGMA, "m/s", 0.01..=100.0)]
        pub velocity_sigma_max_m_s: f32 = 1.0,
        /// Largest standard deviation of a valid position, in any direction.
        #[parameter(POS_SIGMA, "m", 0.01..=1000.0)]
        pub position_sigma_max_m: f32 = 5.0,

        /// Time at rest that alignment takes.
        #[parameter(ALIGN, "s", 0.2..=30.0)]
        pub align_s: f32 = 1.0,
        /// Largest standard deviation of the gyroscope at rest, per axis.
        #[parameter(STILL_RATE, "rad/s", 1e-3..=1.0)]
        pub still_rate_rad_s: f32 = 0.015,
        /// Largest standard deviation of the accelerometer at rest, per axis. The mean may deviate from free fall by
        /// twice this value.
        #[parameter(STILL_ACC, "m/s2", 0.01..=5.0)]
        pub still_accel_m_s2: f32 = 0.3,
        /// Largest tilt at which alignment is allowed.
        #[parameter(ALIGN_TILT, "rad", 0.05..=1.5)]
        pub align_tilt_rad: f32 = 0.8,

        /// Magnetic declination: direction of magnetic north from true north, positive to the east.
        #[parameter(DECLINATION, "rad", -3.2..=3.2)]
        pub declination_rad: f32 = 0.0,
        /// Largest deviation of the magnetic field's strength from that at the start, as a share of it.
        #[parameter(FIELD, "1", 0.01..=10.0)]
        pub field_error_max: f32 = 0.2,
        /// Largest deviation of the magnetic field's inclination from that at the start.
        #[parameter(INCLINATION, "rad", 0.01..=1.6)]
        pub inclination_error_max_rad: f32 = 0.2,

        /// Cutoff frequency of the low-pass filter on the body rates, of second order; 0 for none.
        #[parameter(RATE_CUTOFF, "Hz", 0.0..=400.0)]
        pub rates_cutoff_hz: f32 = 120.0,
        /// Range of the gyroscope; a rate of at least 98 % of it counts as clipped.
        #[parameter(GYR_RANGE, "rad/s", 1.0..=100.0)]
        pub gyro_range_rad_s: f32 = 34.9,
        /// Range of the accelerometer; a specific force of at least 98 % of it counts as clipped.
        #[parameter(ACC_RANGE, "m/s2", 10.0..=1000.0)]
        pub accel_range_m_s2: f32 = 156.9,
        /// Time of identical samples after which the IMU counts as stuck; 0 for never.
        #[parameter(STUCK, "s", 0.0..=10.0)]
        pub stuck_s: f32 = 0.015,
        /// Change of the rates from sample to sample, root mean square, above which the IMU counts as noisy.
        #[parameter(GYR_NOISY, "rad/s", 0.01..=100.0)]
        pub gyro_noisy_rad_s: f32 = 2.0,
        /// Change of the specific force from sample to sample, root mean square, above which the IMU counts as noisy.
        #[parameter(ACC_NOISY, "m/s2", 0.1..=1000.0)]
        pub accel_noisy_m_s2: f32 = 40.0,
    }
}
