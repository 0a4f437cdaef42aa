//! The configuration of a vehicle, which adapts the firmware to it.

use crate::esc_settings::EscSettings;
use crate::link::Link;
use afbc::adaptive::Gains;
use afbc::monitor::MonitorBounds;
use afbc::{Guarded, Profile, Settings};
use afbc_control::drag::KnownDrag;
use afbc_estimator::Settings as Estimation;
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::{Curve, Response};
use afbc_flight_core::protocol::MotorOutputs;
use afbc_rc::RadioSettings;
use afbc_types::{Airframe, Declared, Mounting, OutOfRange, PLUS, Parameters, PerAxis, Rotors, SensorCalibration};

/// Everything that the firmware knows about its vehicle. The vehicles' configurations are in `vehicles/`.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Nominal parameters.
    pub parameters: Parameters,
    /// Rotors, in the order of the motor outputs.
    pub rotors: Rotors,
    /// Settings of AFBC, including the largest force of a rotor.
    pub settings: Settings,
    /// Gains of AFBC.
    pub gains: PerAxis<Gains>,
    /// Throttle curve of the motors.
    pub curve: Curve,
    /// Dynamic response of the rotors to their commands.
    pub response: Response,
    /// Outputs to the motor controllers.
    pub outputs: MotorOutputs,
    /// Telemetry of the motor controllers.
    pub escs: EscSettings,
    /// Mounting of the inertial sensor.
    pub imu: Mounting,
    /// Sensor errors, found by calibration on the vehicle.
    pub calibration: SensorCalibration,
    /// Settings of the estimator.
    pub estimation: Estimation,
    /// Limits for arming.
    pub arming: ArmingLimits,
    /// Settings of flight modes, limits and failsafes.
    pub guidance: afbc_guidance::Settings,
    /// Settings of radio control.
    pub radio: RadioSettings,
    /// Parameters of the link.
    pub link: Link,
}

impl Configuration {
    /// Returns the configuration of a vehicle with these parameters and rotors, and declared defaults for everything
    /// else.
    #[must_use]
    pub const fn plain(parameters: Parameters, rotors: Rotors) -> Self {
        const GAINS: Gains = Gains::DEFAULT;
        Configuration {
            parameters,
            rotors,
            settings: Settings::DEFAULT,
            gains: PerAxis { roll: GAINS, pitch: GAINS, yaw: GAINS, z: GAINS, x: GAINS, y: GAINS },
            curve: Curve::DEFAULT,
            response: Response::DEFAULT,
            outputs: MotorOutputs::DEFAULT,
            escs: EscSettings::DEFAULT,
            imu: Mounting::PLAIN,
            calibration: SensorCalibration::DEFAULT,
            estimation: Estimation::DEFAULT,
            arming: ArmingLimits::DEFAULT,
            guidance: afbc_guidance::Settings::DEFAULT,
            radio: RadioSettings::DEFAULT,
            link: Link::DEFAULT,
        }
    }

    /// Returns the airframe of a vehicle with `N` rotors.
    ///
    /// # Errors
    /// If there are not `N` rotors.
    pub fn airframe<const N: usize>(&self) -> Result<Airframe<N>, OutOfRange> {
        Ok(Airframe { parameters: self.parameters, rotors: self.rotors.array()? })
    }

    /// Returns the firmware's own law for this vehicle: AFBC with its monitor.
    ///
    /// # Errors
    /// The first parameter, setting or gain out of range. Also if there are not `N` rotors.
    // This function is always inlined: otherwise the controller is on the stack of the firmware's start-up twice.
    #[inline(always)]
    pub fn controller<const N: usize>(&self) -> Result<Guarded<N>, OutOfRange> {
        let Configuration { parameters, settings, gains, .. } = self;
        // The controller only checks combinations, and assumes that each value is in its own range.
        parameters.validate()?;
        settings.validate()?;
        gains.validate()?;
        let bounds = MonitorBounds::new(gains, parameters, settings);
        Guarded::new(self.airframe()?, *settings, *gains, bounds)
    }
}

impl Default for Configuration {
    /// Returns the paper's vehicle in the profile `flight`.
    fn default() -> Self {
        Configuration {
            settings: Profile::Flight.settings().with_drag(KnownDrag::PAPER),
            gains: Profile::Flight.gains(),
            ..Configuration::plain(Parameters::PAPER.to_f32(), Rotors::new(&PLUS))
        }
    }
}
