//! Who flies: a control law with its gains and settings, under a name.

use afbc::monitor::Bounds;
use afbc::{Adaptive, Backstepping, Controller, Guarded, Profile, Settings, adaptive, backstepping};
use afbc_control::{FlightController, Mixer};
use afbc_peers::{Geometric, Indi, Pid, geometric, indi, pid};
use afbc_types::{Declared, OutOfRange, Parameters, PerAxis, Visit};

/// A kind of control law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerKind {
    /// Adaptive fuzzy backstepping (20)-(22).
    Afbc,
    /// Classical backstepping (16), (21).
    Backstepping,
    /// Cascaded PID, as autopilots fly.
    Pid,
    /// Geometric tracking on SE(3) with integral terms.
    Geometric,
    /// Incremental nonlinear dynamic inversion.
    Indi,
}

impl ControllerKind {
    /// Every law.
    pub const ALL: [ControllerKind; 5] = [
        ControllerKind::Afbc,
        ControllerKind::Backstepping,
        ControllerKind::Pid,
        ControllerKind::Geometric,
        ControllerKind::Indi,
    ];

    /// The two that the paper compares.
    pub const PAPER: [ControllerKind; 2] = [ControllerKind::Afbc, ControllerKind::Backstepping];

    /// Lower-case name, as in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            ControllerKind::Afbc => "afbc",
            ControllerKind::Backstepping => "backstepping",
            ControllerKind::Pid => "pid",
            ControllerKind::Geometric => "geometric",
            ControllerKind::Indi => "indi",
        }
    }

    /// Name for people.
    pub const fn title(self) -> &'static str {
        match self {
            ControllerKind::Afbc => "AFBC",
            ControllerKind::Backstepping => "backstepping",
            ControllerKind::Pid => "PID",
            ControllerKind::Geometric => "geometric",
            ControllerKind::Indi => "INDI",
        }
    }
}

/// A control law with its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// See [`ControllerKind::Afbc`].
    Afbc(PerAxis<adaptive::Gains>),
    /// AFBC under its [monitor](afbc::guarded), with a law to fall back on.
    Guarded(PerAxis<adaptive::Gains>),
    /// See [`ControllerKind::Backstepping`].
    Backstepping(PerAxis<backstepping::Gains>),
    /// See [`ControllerKind::Pid`].
    Pid(pid::Gains),
    /// See [`ControllerKind::Geometric`].
    Geometric(geometric::Gains),
    /// See [`ControllerKind::Indi`].
    Indi(indi::Gains),
}

impl Law {
    /// A law with the gains of `profile`; a profile speaks of AFBC and backstepping, the others have one set each.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        match kind {
            ControllerKind::Afbc => Law::Afbc(profile.gains()),
            ControllerKind::Backstepping => Law::Backstepping(backstepping_part(&profile.gains())),
            ControllerKind::Pid => Law::Pid(pid::Gains::TUNED),
            ControllerKind::Geometric => Law::Geometric(geometric::Gains::TUNED),
            ControllerKind::Indi => Law::Indi(indi::Gains::TUNED),
        }
    }

    /// Which law it is.
    pub const fn kind(&self) -> ControllerKind {
        match self {
            Law::Afbc(_) | Law::Guarded(_) => ControllerKind::Afbc,
            Law::Backstepping(_) => ControllerKind::Backstepping,
            Law::Pid(_) => ControllerKind::Pid,
            Law::Geometric(_) => ControllerKind::Geometric,
            Law::Indi(_) => ControllerKind::Indi,
        }
    }

    /// True if it stands outside AFBC's cascade, with one set of gains for the whole vehicle.
    pub const fn is_peer(&self) -> bool {
        matches!(self, Law::Pid(_) | Law::Geometric(_) | Law::Indi(_))
    }
}

impl Declared for Law {
    /// Shows each gain; AFBC's and backstepping's in a group for each axis.
    fn visit_mut<E>(&mut self, visit: Visit<'_, E>) -> Result<(), E> {
        match self {
            Law::Afbc(gains) | Law::Guarded(gains) => gains.visit_mut(visit),
            Law::Backstepping(gains) => gains.visit_mut(visit),
            Law::Pid(gains) => gains.visit_mut(visit),
            Law::Geometric(gains) => gains.visit_mut(visit),
            Law::Indi(gains) => gains.visit_mut(visit),
        }
    }

    fn together(&self) -> Result<(), OutOfRange> {
        match self {
            Law::Afbc(gains) | Law::Guarded(gains) => gains.together(),
            Law::Backstepping(gains) => gains.together(),
            Law::Pid(gains) => gains.together(),
            Law::Geometric(gains) => gains.together(),
            Law::Indi(gains) => gains.together(),
        }
    }
}

/// alpha_1 and alpha_2, which AFBC shares with backstepping.
pub fn backstepping_part(gains: &PerAxis<adaptive::Gains>) -> PerAxis<backstepping::Gains> {
    PerAxis::from_fn(|axis| gains[axis].backstepping)
}

/// A controller as it flies: a name, a law with its gains, the settings around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Contender {
    /// What tells it from others in logs and files; unique within a scenario.
    pub name: String,
    /// The law and its gains.
    pub law: Law,
    /// Time step and rotor limit; for AFBC and backstepping those of the cascade too.
    pub settings: Settings,
}

impl Contender {
    /// The law of this kind under its own name, gains and settings as in `profile`.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        Contender { name: kind.name().into(), law: Law::of(kind, profile), settings: profile.settings() }
    }

    /// The same for another vehicle than the paper's: gains of a profile are those of the profile for this vehicle
    /// ([`Profile::gains_for`]); others stay. The peers' are scaled by their own laws.
    pub fn for_vehicle(self, vehicle: &Parameters<f64>) -> Self {
        let Some(profile) = self.gains_of() else { return self };
        let gains = profile.gains_for(&vehicle.to_f32());
        let law = match self.law {
            Law::Afbc(_) => Law::Afbc(gains),
            Law::Guarded(_) => Law::Guarded(gains),
            Law::Backstepping(_) => Law::Backstepping(backstepping_part(&gains)),
            peer => peer,
        };
        Contender { law, ..self }
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
        // Under its monitor or not, the gains are the same.
        let law = if let Law::Guarded(gains) = self.law { Law::Afbc(gains) } else { self.law };
        // The peers' are the same in every profile.
        let same = |profile: &Profile| law == Law::of(law.kind(), *profile);
        Profile::ALL
            .into_iter()
            .find(|profile| same(profile) && (!law.is_peer() || self.settings == profile.settings()))
    }

    /// AFBC's gains, if it flies that.
    pub const fn gains(&self) -> Option<&PerAxis<adaptive::Gains>> {
        match &self.law {
            Law::Afbc(gains) | Law::Guarded(gains) => Some(gains),
            _ => None,
        }
    }

    /// Time from step to step \[s\]: the settings', without the noise that `f32` adds to a decimal.
    pub fn step_s(&self) -> f64 {
        decimal(self.settings.common.dt_s)
    }

    /// Builds the controller, as a flight would.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range; the rotors must lift the vehicle
    /// [with a margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn check(&self, vehicle: Parameters) -> Result<(), OutOfRange> {
        let mixer = Mixer::new(&vehicle, self.settings.common.rotor_force_max_n)?;
        mixer.check_hover(vehicle.mass_kg * vehicle.gravity_m_s2)?;
        match &self.law {
            Law::Afbc(gains) => gains.controller(vehicle, self.settings).map(drop),
            Law::Guarded(gains) => Monitored(gains).controller(vehicle, self.settings).map(drop),
            Law::Backstepping(gains) => gains.controller(vehicle, self.settings).map(drop),
            Law::Pid(gains) => gains.controller(vehicle, self.settings).map(drop),
            Law::Geometric(gains) => gains.controller(vehicle, self.settings).map(drop),
            Law::Indi(gains) => gains.controller(vehicle, self.settings).map(drop),
        }
    }
}

/// A time step without the noise that `f32` adds to a decimal \[s\].
pub fn decimal(dt_s: f32) -> f64 {
    (f64::from(dt_s) * 1e7).round() / 1e7
}

/// Gains that make a controller.
pub trait Build {
    /// What they make.
    type Controller: FlightController;

    /// The controller of a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Self::Controller, OutOfRange>;
}

impl Build for PerAxis<adaptive::Gains> {
    type Controller = Controller<Adaptive>;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Self::Controller, OutOfRange> {
        Controller::new(vehicle, settings, Adaptive::new(*self)?)
    }
}

/// Gains of AFBC that is to fly under its monitor, with the bounds that go with them.
pub struct Monitored<'a>(pub &'a PerAxis<adaptive::Gains>);

impl Build for Monitored<'_> {
    type Controller = Guarded;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Guarded, OutOfRange> {
        let bounds = Bounds::new(self.0, &vehicle);
        Guarded::new(vehicle, settings, *self.0, bounds)
    }
}

impl Build for PerAxis<backstepping::Gains> {
    type Controller = Controller<Backstepping>;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Self::Controller, OutOfRange> {
        Controller::new(vehicle, settings, Backstepping::new(&vehicle, *self)?)
    }
}

impl Build for pid::Gains {
    type Controller = Pid;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Pid, OutOfRange> {
        Pid::new(vehicle, settings.common, *self)
    }
}

impl Build for geometric::Gains {
    type Controller = Geometric;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Geometric, OutOfRange> {
        Geometric::new(vehicle, settings.common, *self)
    }
}

impl Build for indi::Gains {
    type Controller = Indi;

    fn controller(&self, vehicle: Parameters, settings: Settings) -> Result<Indi, OutOfRange> {
        Indi::new(vehicle, settings.common, *self)
    }
}
