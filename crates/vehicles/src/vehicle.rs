//! A vehicle as described by its file.

use afbc::adaptive::Gains;
use afbc::guarded::Guarded;
use afbc::monitor::MonitorBounds;
use afbc::{Profile, Settings};
use afbc_estimator::Settings as Estimation;
use afbc_files::read::{Example, FileError, Table};
use afbc_flight_core::ArmingLimits;
use afbc_flight_core::motor::{Curve, Response};
use afbc_flight_core::protocol::MotorOutputs;
use afbc_onboard::{Configuration, EscSettings, Link};
use afbc_plant::Realism;
use afbc_plant::instruments::ImuModel;
use afbc_rc::RadioSettings;
use afbc_types::{
    Airframe, Declaration, Declared, DeclaredValue, DeclaredValueMut, Mounting, OutOfRange, Parameters, PerAxis, Rotor,
    SensorCalibration, with_rotors,
};
use core::convert::Infallible;

/// Name of the table in the file with the settings of AFBC's cascade; it is next to the tables of the laws' gains.
pub const CASCADE: &str = "cascade";
/// A valid vehicle file.
pub(crate) const SAMPLE: Example =
    Example { command: "vehicles paper", text: include_str!("../../../vehicles/paper.toml") };

/// A vehicle as described by its file. Its serialised form holds everything that decides how it flies, but not the
/// file's name, location and comments.
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
    /// Rotors with lag, limits and battery; drag and ground contact. Still air.
    pub realism: Realism,
    /// Throttle curve of the motors.
    pub curve: Curve,
    /// Mounting of the inertial sensor.
    pub imu: Mounting<f64>,
    /// Inertial sensor, if the file names a part or states its noise figures. Not serialised: the estimator's settings
    /// follow from it and are.
    #[serde(skip)]
    pub imu_part: Option<ImuModel>,
    /// Settings of the firmware's estimator.
    pub estimation: Estimation,
    /// Names of the estimator settings that the file states; they override those derived from parts.
    pub estimation_stated: Vec<&'static str>,
    /// Limits for arming the firmware.
    pub arming: ArmingLimits,
    /// Settings of the firmware's modes, limits and safety net.
    pub guidance: afbc_guidance::Settings,
    /// AFBC's gains in the profile `flight`: by rule ([`Profile::gains_for`]) unless the file states them.
    pub flight_gains: PerAxis<Gains>,
    /// Settings of AFBC's cascade in the profile `flight`: by rule ([`Profile::settings_for`]) unless the file states
    /// them.
    pub flight_settings: Settings,
    /// Text and name of the file, from which other laws read their gains. Not serialised: the laws that fly serialise
    /// their gains.
    #[serde(skip)]
    pub(crate) text: String,
    #[serde(skip)]
    pub(crate) file: String,
}

impl Vehicle {
    /// Returns the rotors' time constant \[s\].
    pub fn lag_s(&self) -> f32 {
        self.realism.rotors.time_constant_s as f32
    }

    /// Returns the rotors' response for the flight software: their [time constant](Self::lag_s), clamped to the
    /// accepted range.
    pub fn response(&self) -> Response {
        let range = Response::LAG.range;
        Response { time_constant_s: self.realism.rotors.time_constant_s.clamp(range.min, range.max) as f32 }
    }

    /// Returns `settings`, overridden by the estimator settings that the file states.
    #[must_use]
    pub fn stated_over(&self, mut settings: Estimation) -> Estimation {
        let mut stated: Vec<(&str, Vec<f64>)> = Vec::new();
        let Ok(()) = self.estimation.visit(&mut |declaration: &Declaration, value: DeclaredValue<'_>| {
            let name = declaration.range.name;
            stated.extend(self.estimation_stated.contains(&name).then(|| (name, value.numbers().collect())));
            Ok::<(), Infallible>(())
        });
        let Ok(()) = settings.visit_mut(&mut |declaration: &Declaration, value: DeclaredValueMut<'_>| {
            let own = stated.iter().find(|(name, _)| *name == declaration.range.name);
            if let (Some((_, own)), DeclaredValueMut::Single(numbers)) = (own, value) {
                numbers.iter_mut().zip(own).for_each(|(number, own)| *number = *own as f32);
            }
            Ok::<(), Infallible>(())
        });
        settings
    }

    /// Returns AFBC's gains in `profile`.
    pub fn gains(&self, profile: Profile) -> PerAxis<Gains> {
        if profile == Profile::Flight {
            return self.flight_gains;
        }
        profile.gains_for(&self.parameters.to_f32(), self.lag_s())
    }

    /// Returns the settings of AFBC's cascade in `profile`.
    pub fn settings(&self, profile: Profile) -> Settings {
        if profile == Profile::Flight {
            return self.flight_settings;
        }
        profile.settings_for(self.force_max_n as f32, self.lag_s())
    }

    /// Returns the flight software's configuration of the vehicle. The firmware's image, the simulation and a ground
    /// station's parameter file use it.
    ///
    /// # Errors
    /// If it does not have four to eight rotors. Does not occur, for a vehicle is checked when its file is read.
    pub fn configuration(&self) -> Result<Configuration, OutOfRange> {
        Ok(Configuration {
            parameters: self.parameters.to_f32(),
            rotors: self.rotors.as_slice().try_into()?,
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

    /// Returns the vehicle with the file from which other laws read their gains replaced by `file`, which holds `text`.
    #[must_use]
    pub fn with_law_gains(self, file: &str, text: &str) -> Self {
        Vehicle { file: file.into(), text: text.into(), ..self }
    }

    /// Calls `read` with the table `[gains.flight]` of the file, which has one table per law. Returns none without such
    /// a table.
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
    /// The first parameter, setting or gain out of range. The rotors must lift and turn the vehicle with a margin
    /// ([`Guarded::new`]).
    pub fn check(&self) -> Result<(), OutOfRange> {
        let (settings, gains) = (self.settings(Profile::Flight), self.flight_gains);
        let bounds = MonitorBounds::new(&gains, &self.parameters.to_f32(), &settings);
        with_rotors!(self.rotors.len(), N => {
            let airframe = Airframe::<N>::new(&self.parameters, &self.rotors)?;
            Guarded::new(airframe, settings, gains, bounds).map(drop)
        })
    }
}
