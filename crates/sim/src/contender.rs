//! Who flies: a control law with its gains and settings, under a name.

pub use crate::laws::{ControllerKind, Law};

use afbc::monitor::Bounds;
use afbc::{Guarded, Profile, Settings, adaptive};
use afbc_control::{FlightController, Mixer};
use afbc_types::{OutOfRange, Parameters, PerAxis};

impl Law {
    /// A law with the gains of `profile`; a profile speaks of AFBC and backstepping, the others have one set each.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        Law::beside(kind, &profile.gains())
    }
}

/// A controller as it flies: a name, a law with its gains, the settings around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Contender {
    /// What tells it from others in logs and files; unique within a scenario.
    pub name: String,
    /// The law and its gains.
    pub law: Law,
    /// Time step and rotor limit; for a law in the cascade those of the cascade too.
    pub settings: Settings,
    /// Whether AFBC flies under its [monitor](afbc::guarded), with a law to fall back on; false for every other law.
    pub monitored: bool,
}

impl Contender {
    /// The law of this kind under its own name, gains and settings as in `profile`, without a monitor.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        let (law, settings) = (Law::of(kind, profile), profile.settings());
        Contender { name: kind.name().into(), law, settings, monitored: false }
    }

    /// The same under AFBC's monitor, if it flies AFBC.
    pub fn monitored(self) -> Self {
        Contender { monitored: self.gains().is_some(), ..self }
    }

    /// The same for another vehicle than the paper's: gains of a profile are those of the profile for this vehicle
    /// ([`Profile::gains_for`]); others stay. The peers' are scaled by their own laws.
    pub fn for_vehicle(self, vehicle: &Parameters<f64>) -> Self {
        let Some(profile) = self.gains_of() else { return self };
        Contender { law: Law::beside(self.kind(), &profile.gains_for(&vehicle.to_f32())), ..self }
    }

    /// Which law it flies.
    pub const fn kind(&self) -> ControllerKind {
        self.law.kind()
    }

    /// Name for people.
    pub fn title(&self) -> &str {
        if self.name == self.kind().name() { self.kind().title() } else { &self.name }
    }

    /// The profile whose gains and settings these are, if there is one.
    pub fn profile(&self) -> Option<Profile> {
        self.gains_of().filter(|profile| self.settings == profile.settings())
    }

    /// The profile whose gains these are, for the paper's vehicle.
    fn gains_of(&self) -> Option<Profile> {
        let same = |profile: &Profile| self.law == Law::of(self.kind(), *profile);
        // The peers' are the same in every profile.
        Profile::ALL
            .into_iter()
            .find(|profile| same(profile) && (self.kind().in_cascade() || self.settings == profile.settings()))
    }

    /// AFBC's gains, if it flies that.
    pub const fn gains(&self) -> Option<&PerAxis<adaptive::Gains>> {
        match &self.law {
            Law::Afbc(gains) => Some(gains),
            _ => None,
        }
    }

    /// Time from step to step \[s\]: the settings', without the noise that `f32` adds to a decimal.
    pub fn step_s(&self) -> f64 {
        decimal(self.settings.common.dt_s)
    }

    /// Does something with the controller of a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range, or what `task` returns.
    pub fn build<T: Task>(&self, vehicle: Parameters, task: T) -> Result<T::Output, OutOfRange> {
        match &self.law {
            Law::Afbc(gains) if self.monitored => {
                let bounds = Bounds::new(gains, &vehicle);
                task.with(Guarded::new(vehicle, self.settings, *gains, bounds)?)
            }
            law => law.build(vehicle, self.settings, task),
        }
    }

    /// Builds the controller, as a flight would.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range; the rotors must lift the vehicle
    /// [with a margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn check(&self, vehicle: Parameters) -> Result<(), OutOfRange> {
        let mixer = Mixer::new(&vehicle, self.settings.common.rotor_force_max_n)?;
        mixer.check_hover(vehicle.mass_kg * vehicle.gravity_m_s2)?;
        self.build(vehicle, Check)
    }
}

/// A time step without the noise that `f32` adds to a decimal \[s\].
pub fn decimal(dt_s: f32) -> f64 {
    (f64::from(dt_s) * 1e7).round() / 1e7
}

/// What is to be done with a controller, whatever its type.
pub trait Task {
    /// What comes of it.
    type Output;

    /// Does it.
    ///
    /// # Errors
    /// What else turns out to be out of range.
    fn with<C: FlightController>(self, controller: C) -> Result<Self::Output, OutOfRange>;
}

/// Nothing: the controller can be built.
struct Check;

impl Task for Check {
    type Output = ();

    fn with<C: FlightController>(self, _: C) -> Result<(), OutOfRange> {
        Ok(())
    }
}
