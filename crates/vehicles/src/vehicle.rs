//! A vehicle as its file describes it.

use afbc::adaptive::Gains;
use afbc::guarded::Guarded;
use afbc::monitor::Bounds;
use afbc::{Profile, Settings};
use afbc_estimator::Settings as Estimation;
use afbc_files::read::{Example, FileError, Table};
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::{Curve, Response};
use afbc_flight_core::protocol::MotorOutputs;
use afbc_onboard::{Configuration, EscSettings, Link};
use afbc_plant::Realism;
use afbc_plant::instruments::Imu;
use afbc_radio::RadioSettings;
use afbc_types::{
    Airframe, Declaration, Declared, Mounting, OutOfRange, Parameters, PerAxis, Rotor, SensorCalibration, Value,
    ValueMut, with_rotors,
};
use core::convert::Infallible;

/// Table of the settings of AFBC's cascade, beside those of the laws' gains.
pub const CASCADE: &str = "cascade";
/// A valid vehicle file.
pub(crate) const SAMPLE: Example =
    Example { command: "vehicles paper", text: include_str!("../../../vehicles/paper.toml") };

/// A vehicle as its file describes it. Written by serde, it is what the vehicle is, wherever its file lies, whatever
/// that is called and whatever comments it has.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Vehicle {
    /// Short name.
    #[serde(skip)]
    pub name: String,
    /// One-line description.
    #[serde(skip)]
    pub description: String,
    /// Masses, arm and rotor factors.
    pub parameters: Parameters<f64>,
    /// Four to eight rotors, in the order of the motors' outputs.
    pub rotors: Vec<Rotor<f64>>,
    /// Largest force of one rotor \[N\].
    pub force_max_n: f64,
    /// Rotors with their lag, limits and battery; drag and ground. The air is still.
    pub realism: Realism,
    /// Throttle curve of the motors.
    pub curve: Curve,
    /// Mounting of the inertial sensor.
    pub imu: Mounting<f64>,
    /// The inertial sensor's part, if the file names it or its figures. The estimator's settings follow, with which it
    /// is written.
    #[serde(skip)]
    pub imu_part: Option<Imu>,
    /// Settings of the firmware's estimator.
    pub estimation: Estimation,
    /// Names of those that the file states, whatever the parts are.
    pub estimation_stated: Vec<&'static str>,
    /// Limits for arming the firmware.
    pub arming: ArmingLimits,
    /// Settings of the firmware's modes, limits and safety net.
    pub guidance: afbc_guidance::Settings,
    /// Gains of AFBC in the profile `flight`: by rule ([`Profile::gains_for`]), or as the file says.
    pub flight_gains: PerAxis<Gains>,
    /// Settings of AFBC's cascade in the profile `flight`: by rule ([`Profile::settings_for`]), or as the file says.
    pub flight_settings: Settings,
    /// Text and name of the file, from which the gains of other laws are read: into the laws that fly it, with which
    /// they are written.
    #[serde(skip)]
    pub(crate) text: String,
    #[serde(skip)]
    pub(crate) file: String,
}

impl Vehicle {
    /// Lag of the rotors \[s\].
    pub fn lag_s(&self) -> f32 {
        self.realism.rotors.time_constant_s as f32
    }

    /// How the rotors respond, as flight software knows it: their [lag](Self::lag_s), or the nearest that is accepted.
    pub fn response(&self) -> Response {
        let range = Response::LAG.range;
        Response { time_constant_s: self.realism.rotors.time_constant_s.clamp(range.min, range.max) as f32 }
    }

    /// Returns `settings` with what the file states of the estimator in their place.
    #[must_use]
    pub fn stated_over(&self, mut settings: Estimation) -> Estimation {
        let mut stated: Vec<(&str, Vec<f64>)> = Vec::new();
        let Ok(()) = self.estimation.visit(&mut |declaration: &Declaration, value: Value<'_>| {
            let name = declaration.range.name;
            stated.extend(self.estimation_stated.contains(&name).then(|| (name, value.numbers().collect())));
            Ok::<(), Infallible>(())
        });
        let Ok(()) = settings.visit_mut(&mut |declaration: &Declaration, value: ValueMut<'_>| {
            let own = stated.iter().find(|(name, _)| *name == declaration.range.name);
            if let (Some((_, own)), ValueMut::Single(numbers)) = (own, value) {
                numbers.iter_mut().zip(own).for_each(|(number, own)| *number = *own as f32);
            }
            Ok::<(), Infallible>(())
        });
        settings
    }

    /// Gains of AFBC in `profile`.
    pub fn gains(&self, profile: Profile) -> PerAxis<Gains> {
        if profile == Profile::Flight {
            return self.flight_gains;
        }
        profile.gains_for(&self.parameters.to_f32(), self.lag_s())
    }

    /// Settings of AFBC's cascade in `profile`.
    pub fn settings(&self, profile: Profile) -> Settings {
        if profile == Profile::Flight {
            return self.flight_settings;
        }
        profile.settings_for(self.force_max_n as f32, self.lag_s())
    }

    /// Returns what flight software knows of the vehicle: the firmware's image, the same code in simulation, and a
    /// station's file of parameters.
    ///
    /// # Errors
    /// If it does not have `N` rotors.
    pub fn configuration<const N: usize>(&self) -> Result<Configuration<N>, OutOfRange> {
        Ok(Configuration {
            airframe: Airframe::new(&self.parameters, &self.rotors)?,
            settings: self.settings(Profile::Flight),
            gains: self.gains(Profile::Flight),
            curve: self.curve,
            response: self.response(),
            outputs: MotorOutputs::DEFAULT,
            escs: EscSettings::DEFAULT,
            imu: self.imu.to_f32(),
            calibration: SensorCalibration::DEFAULT,
            estimation: self.estimation,
            arming: self.arming,
            guidance: self.guidance,
            radio: RadioSettings::DEFAULT,
            link: Link::DEFAULT,
        })
    }

    /// Returns the vehicle with the gains of other laws from the file `file` that holds `text`.
    #[must_use]
    pub fn with_law_gains(self, file: &str, text: &str) -> Self {
        Vehicle { file: file.into(), text: text.into(), ..self }
    }

    /// Calls `read` with the gains of the profile `flight` in the file, a table per law, if there are any.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn law_gains<T>(&self, read: impl Fn(Table<'_>) -> Result<T, FileError>) -> Result<Option<T>, FileError> {
        afbc_files::read::document(&self.file, &self.text, SAMPLE, |mut root| {
            let Some(mut all) = root.table("gains")? else { return Ok(None) };
            all.table(Profile::Flight.name())?.map(&read).transpose()
        })
    }

    /// Checks that AFBC can fly the vehicle with a margin, under its monitor.
    ///
    /// # Errors
    /// The first parameter, setting or gain out of range; the rotors must lift the vehicle and turn it with a margin
    /// ([`Guarded::new`]).
    pub fn check(&self) -> Result<(), OutOfRange> {
        let (settings, gains) = (self.settings(Profile::Flight), self.flight_gains);
        let bounds = Bounds::new(&gains, &self.parameters.to_f32(), &settings);
        with_rotors!(self.rotors.len(), N => {
            let airframe = Airframe::<N>::new(&self.parameters, &self.rotors)?;
            Guarded::new(airframe, settings, gains, bounds).map(drop)
        })
    }
}
