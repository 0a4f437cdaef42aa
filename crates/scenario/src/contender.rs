//! A contender: a named control law with its gains and settings.

pub use crate::laws::{ControllerKind, Law};

use crate::AnyController;
use crate::laws::law_gains;
use afbc::monitor::Bounds;
use afbc::{Guarded, LAG_S, Profile, Safeguards, Settings, adaptive, by_rule, slowness};
use afbc_control::FlightController;
use afbc_files::read::FileError;
use afbc_peers::slowed;
use afbc_types::{
    Airframe, Axis, Declaration, Declared, OutOfRange, Parameters, PerAxis, Rotor, ValueMut, with_rotors,
};
use afbc_vehicles::Vehicle;
use core::convert::Infallible;

/// Name of every law's limit on the tilt.
const TILT_MAX: &str = "tilt_max_rad";
/// Name of AFBC under its monitor, where it stands beside AFBC without.
pub const MONITORED: &str = "afbc-monitored";
/// Acceleration of free fall, for a limit \[m/s2\].
const G_M_S2: f32 = 9.81;

impl Law {
    /// Returns a law with the gains of `profile`; profiles differ for AFBC and backstepping only.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        Law::beside(kind, &profile.gains())
    }

    /// The law of this kind with its gains for this vehicle: by rule ([`Profile::gains_for`], [`slowed`]) or, in the
    /// profile `flight`, as the vehicle's file says.
    ///
    /// # Errors
    /// One line on what is wrong with the gains in the vehicle's file.
    pub fn on(kind: ControllerKind, vehicle: &Vehicle, profile: Profile) -> Result<Self, FileError> {
        let law = Law::beside(kind, &vehicle.gains(profile));
        // Those of the cascade are slowed already.
        let law = if kind.in_cascade() { law } else { slowed(law, slowness(vehicle.lag_s()), vehicle.lag_s()) };
        if profile == Profile::Flight { law_gains(vehicle, law) } else { Ok(law) }
    }
}

/// Returns name and title of a law of this kind as printed, if the profile `flight` adds to it.
const fn printed_names(kind: ControllerKind) -> Option<[&'static str; 2]> {
    match kind {
        ControllerKind::Afbc => Some(["afbc-as-printed", "AFBC as printed"]),
        ControllerKind::Backstepping => Some(["backstepping-as-printed", "backstepping as printed"]),
        _ => None,
    }
}

/// A named controller with its law, gains and settings.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Contender {
    /// Name in logs and files; unique within a scenario.
    pub name: String,
    /// The law and its gains.
    pub law: Law,
    /// Time step and rotor limit; for a law in the cascade also the cascade's settings.
    pub settings: Settings,
    /// Whether AFBC flies under its [monitor](afbc::guarded), with a fallback law; false for every other law.
    pub monitored: bool,
}

impl Contender {
    /// Returns the law of this kind under its own name, with gains and settings of `profile`, without a monitor.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        let (law, settings) = (Law::of(kind, profile), profile.settings());
        Contender { name: kind.name().into(), law, settings, monitored: false }
    }

    /// Returns the law of this kind with gains and settings of `profile`, under a name that tells a printed law from
    /// the one that flies.
    pub fn standard(kind: ControllerKind, profile: Profile) -> Self {
        let contender = Contender::of(kind, profile);
        match printed_names(kind).filter(|_| profile == Profile::Paper) {
            Some([name, _]) => Contender { name: name.into(), ..contender },
            None => contender,
        }
    }

    /// Returns the standard contenders: every law that flies, and those that differ from it as printed.
    pub fn all_standard() -> impl Iterator<Item = Contender> {
        let flies = |kind| Contender::standard(kind, Profile::Flight);
        let printed = ControllerKind::PAPER.map(|kind| Contender::standard(kind, Profile::Paper));
        ControllerKind::all().into_iter().map(flies).chain(printed)
    }

    /// Returns the standard contender called `name`: a law's own name is that of the law that flies.
    pub fn named(name: &str) -> Option<Self> {
        Contender::all_standard().find(|contender| contender.name == name)
    }

    /// Returns it under AFBC's monitor, if it flies AFBC.
    pub fn monitored(self) -> Self {
        Contender { monitored: self.gains().is_some(), ..self }
    }

    /// Returns it for another vehicle than the paper's: gains equal to a profile's become the profile's for this
    /// vehicle ([`Profile::gains_for`]); others are unchanged. The peers' laws scale with the vehicle themselves.
    pub fn for_vehicle(self, vehicle: &Parameters<f64>) -> Self {
        let Some(profile) = self.gains_of() else { return self };
        Contender { law: Law::beside(self.kind(), &profile.gains_for(&vehicle.to_f32(), LAG_S)), ..self }
    }

    /// Returns it free to tilt as far as `tilt_max_rad`, where it is limited more; the cascade's largest horizontal
    /// acceleration follows, g tan(tilt).
    #[must_use]
    pub fn free_to_tilt(mut self, tilt_max_rad: f32) -> Self {
        let limits = &mut self.settings.limits;
        limits.tilt_max_rad = limits.tilt_max_rad.max(tilt_max_rad);
        limits.acceleration_max_m_s2 = limits.acceleration_max_m_s2.max(G_M_S2 * libm::tanf(tilt_max_rad));
        let Ok(()) = self.law.visit_mut(&mut |declaration: &Declaration, value: ValueMut<'_>| {
            if let (TILT_MAX, ValueMut::Single([tilt])) = (declaration.range.name, value) {
                // No further than the law accepts, or its controller would be refused.
                *tilt = tilt.max(tilt_max_rad).min(declaration.range.max as f32);
            }
            Ok::<(), Infallible>(())
        });
        self
    }

    /// Returns the kind of its law.
    pub const fn kind(&self) -> ControllerKind {
        self.law.kind()
    }

    /// Returns the name for tables and figures, in which a printed law is called so, and a monitored one.
    pub fn title(&self) -> &str {
        let kind = self.kind();
        match printed_names(kind) {
            Some([name, title]) if self.name == name || (self.name == kind.name() && self.is_printed()) => title,
            _ if self.name == kind.name() => kind.title(),
            _ if self.name == MONITORED && self.monitored => "AFBC with monitor",
            _ => &self.name,
        }
    }

    /// Returns it under the printed law's name, if it flies that under the name of its law: for results of several
    /// scenarios, which have no other words for it.
    #[must_use]
    pub fn named_as_printed(self) -> Self {
        match printed_names(self.kind()).filter(|_| self.is_printed() && self.name == self.kind().name()) {
            Some([name, _]) => Contender { name: name.into(), ..self },
            None => self,
        }
    }

    /// True if the law is the printed one, whatever its gains: without anything that the profile `flight` adds.
    pub fn is_printed(&self) -> bool {
        let guarded = |gains: &adaptive::Gains| gains.safeguards != Safeguards::NONE;
        printed_names(self.kind()).is_some()
            && has_printed_cascade(&self.settings)
            && !self.gains().is_some_and(|gains| Axis::ALL.iter().any(|axis| guarded(&gains[*axis])))
    }

    /// Returns the profile that it flies on another vehicle.
    pub fn kept_profile(&self) -> Profile {
        if self.is_printed() { Profile::Paper } else { Profile::Flight }
    }

    /// Returns the profile with these gains and settings, if there is one.
    pub fn profile(&self) -> Option<Profile> {
        self.gains_of().filter(|profile| self.settings == profile.settings())
    }

    /// Returns the profile with these gains, for the paper's vehicle.
    fn gains_of(&self) -> Option<Profile> {
        let same = |profile: &Profile| self.law == Law::of(self.kind(), *profile);
        // The peers' gains are the same in every profile.
        Profile::ALL
            .into_iter()
            .find(|profile| same(profile) && (self.kind().in_cascade() || self.settings == profile.settings()))
    }

    /// Returns AFBC's gains, if it flies AFBC.
    pub const fn gains(&self) -> Option<&PerAxis<adaptive::Gains>> {
        match &self.law {
            Law::Afbc(gains) => Some(gains),
            _ => None,
        }
    }

    /// Returns the time step \[s\], rounded to remove the error of `f32` decimals.
    pub fn step_s(&self) -> f64 {
        decimal(self.settings.common.dt_s)
    }

    /// Returns the contender on another vehicle: that vehicle's gains and settings in `profile` replace its own; the
    /// time step and the monitor stay.
    ///
    /// # Errors
    /// One line on what is wrong with the gains in the vehicle's file.
    pub fn on(self, vehicle: &Vehicle, profile: Profile) -> Result<Self, FileError> {
        let law = Law::on(self.kind(), vehicle, profile)?;
        let settings = vehicle.settings(profile).with_dt_s(self.settings.common.dt_s);
        Ok(Contender { law, settings, ..self })
    }

    /// Returns the contender on another vehicle, its own gains and settings, for the paper's vehicle, scaled [by
    /// rule](by_rule).
    #[must_use]
    pub fn by_rule(self, vehicle: &Vehicle) -> Self {
        let slowness = slowness(vehicle.lag_s());
        let by_rule = |gains| by_rule(&gains, &vehicle.parameters.to_f32(), vehicle.lag_s());
        let law = match self.law {
            Law::Afbc(gains) => Law::Afbc(by_rule(gains)),
            Law::Backstepping(own) => {
                // The rule is for whole sets of AFBC's gains: those added here to make one are dropped after it.
                let gains = Profile::Flight.gains();
                let gains = PerAxis::from_fn(|axis| adaptive::Gains { backstepping: own[axis], ..gains[axis] });
                Law::Backstepping(by_rule(gains).map(|gains| gains.backstepping))
            }
            law => slowed(law, slowness, vehicle.lag_s()),
        };
        let settings =
            self.settings.slowed(slowness, vehicle.lag_s()).with_rotor_force_max_n(vehicle.force_max_n as f32);
        // What is known of the drag is the vehicle's, whoever's settings are scaled.
        let settings = settings.with_drag(vehicle.flight_settings.common.drag);
        Contender { law, settings, ..self }
    }

    /// Returns the controller of a vehicle with these nominal parameters and rotors.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    pub fn controller<const N: usize>(
        &self,
        parameters: &Parameters<f64>,
        rotors: &[Rotor<f64>],
    ) -> Result<AnyController<N>, OutOfRange> {
        let vehicle = Airframe::<N>::new(parameters, rotors)?;
        match &self.law {
            Law::Afbc(gains) if self.monitored => {
                let bounds = Bounds::new(gains, &vehicle.parameters, &self.settings);
                Ok(AnyController::Monitored(Guarded::new(vehicle, self.settings, *gains, bounds)?))
            }
            law => law.controller(vehicle, self.settings),
        }
    }

    /// Builds the controller, as a flight would, to check it.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range; also if the rotors cannot lift the vehicle [with a
    /// margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn check(&self, parameters: &Parameters<f64>, rotors: &[Rotor<f64>]) -> Result<(), OutOfRange> {
        with_rotors!(rotors.len(), N => {
            self.controller::<N>(parameters, rotors)?.mixer().check_hover(parameters.to_f32().weight_n())
        })
    }
}

/// True if the cascade has none of the additions of the profile `flight`. The numbers that the paper leaves open,
/// rotors, filters and limits, may be any.
pub(crate) fn has_printed_cascade(settings: &Settings) -> bool {
    let Settings { common, command_filter_rad_s, forward_rad_s, limits, .. } = *settings;
    *settings == Settings { common, command_filter_rad_s, forward_rad_s, limits, ..Profile::Paper.settings() }
}

/// Returns a time step rounded to remove the error of `f32` decimals \[s\].
pub fn decimal(dt_s: f32) -> f64 {
    (f64::from(dt_s) * 1e7).round() / 1e7
}
