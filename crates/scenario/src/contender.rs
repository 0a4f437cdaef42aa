//! A contender: a named control law with its gains and settings.

pub use crate::laws::{ControllerKind, Law};

use crate::AnyController;
use crate::laws::law_gains;
use afbc::monitor::MonitorBounds;
use afbc::{Guarded, LAG_S, Profile, Safeguards, Settings, adaptive, by_rule, slowness};
use afbc_control::FlightController;
use afbc_files::read::FileError;
use afbc_laws::slowed;
use afbc_types::{
    Airframe, Axis, Declaration, Declared, DeclaredValueMut, OutOfRange, Parameters, PerAxis, Rotor, with_rotors,
};
use afbc_vehicles::Vehicle;
use core::convert::Infallible;

/// Name of the tilt limit in every law's gains.
const TILT_MAX: &str = "tilt_max_rad";
/// Name of AFBC with its monitor, where it flies next to AFBC without the monitor.
pub const MONITORED: &str = "afbc-monitored";
/// Acceleration of gravity, for limits \[m/s2\].
const G_M_S2: f32 = 9.81;

impl Law {
    /// Returns a law with the gains of `profile`; only the gains of AFBC and backstepping depend on the profile.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        Law::beside(kind, &profile.gains())
    }

    /// Returns the law of this kind with its gains for this vehicle. The gains follow by rule ([`Profile::gains_for`],
    /// [`slowed`]). In the profile `flight`, gains in the vehicle's file replace them.
    ///
    /// # Errors
    /// One line on the mistake in the gains of the vehicle's file.
    pub fn on(kind: ControllerKind, vehicle: &Vehicle, profile: Profile) -> Result<Self, FileError> {
        let law = Law::beside(kind, &vehicle.gains(profile));
        // The gains of laws in the cascade are slowed already.
        let law = if kind.in_cascade() { law } else { slowed(law, slowness(vehicle.lag_s()), vehicle.lag_s()) };
        if profile == Profile::Flight { law_gains(vehicle, law) } else { Ok(law) }
    }
}

/// Returns name and title of the printed law of this kind, if the profile `flight` adds to the printed law.
const fn printed_names(kind: ControllerKind) -> Option<[&'static str; 2]> {
    match kind {
        ControllerKind::Afbc => Some(["afbc-as-printed", "AFBC as printed"]),
        ControllerKind::Backstepping => Some(["backstepping-as-printed", "backstepping as printed"]),
        _ => None,
    }
}

/// A controller with its name, law, gains and settings.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Contender {
    /// Name in logs and files; unique within a scenario.
    pub name: String,
    /// The law and its gains.
    pub law: Law,
    /// Time step and rotor limit; for a law in the cascade also the cascade's settings.
    pub settings: Settings,
    /// True if AFBC flies under its [monitor](afbc::guarded) with a fallback law; false for every other law.
    pub monitored: bool,
}

impl Contender {
    /// Returns the law of this kind under its own name, with gains and settings of `profile`, without a monitor.
    pub fn of(kind: ControllerKind, profile: Profile) -> Self {
        let (law, settings) = (Law::of(kind, profile), profile.settings());
        Contender { name: kind.name().into(), law, settings, monitored: false }
    }

    /// Returns the law of this kind with gains and settings of `profile`. Its name tells a printed law from the one
    /// that flies.
    pub fn standard(kind: ControllerKind, profile: Profile) -> Self {
        let contender = Contender::of(kind, profile);
        match printed_names(kind).filter(|_| profile == Profile::Paper) {
            Some([name, _]) => Contender { name: name.into(), ..contender },
            None => contender,
        }
    }

    /// Returns the standard contenders: every law as it flies, and the printed laws that differ.
    pub fn all_standard() -> impl Iterator<Item = Contender> {
        let flies = |kind| Contender::standard(kind, Profile::Flight);
        let printed = ControllerKind::PAPER.map(|kind| Contender::standard(kind, Profile::Paper));
        ControllerKind::all().into_iter().map(flies).chain(printed)
    }

    /// Returns the standard contender called `name`; a law's plain name means the law as it flies.
    pub fn named(name: &str) -> Option<Self> {
        Contender::all_standard().find(|contender| contender.name == name)
    }

    /// Returns the contender with AFBC's monitor, if its law is AFBC.
    pub fn monitored(self) -> Self {
        Contender { monitored: self.gains().is_some(), ..self }
    }

    /// Returns the contender for another vehicle than the paper's. Gains equal to a profile's become the profile's
    /// gains for this vehicle ([`Profile::gains_for`]); others are unchanged. The peers' laws scale with the vehicle
    /// themselves.
    pub fn for_vehicle(self, vehicle: &Parameters<f64>) -> Self {
        let Some(profile) = self.gains_of() else { return self };
        Contender { law: Law::beside(self.kind(), &profile.gains_for(&vehicle.to_f32(), LAG_S)), ..self }
    }

    /// Returns the contender with its tilt limit raised to at least `tilt_max_rad`. The cascade's largest horizontal
    /// acceleration is raised to g tan(tilt).
    #[must_use]
    pub fn free_to_tilt(mut self, tilt_max_rad: f32) -> Self {
        let limits = &mut self.settings.limits;
        limits.tilt_max_rad = limits.tilt_max_rad.max(tilt_max_rad);
        limits.acceleration_max_m_s2 = limits.acceleration_max_m_s2.max(G_M_S2 * libm::tanf(tilt_max_rad));
        let Ok(()) = self.law.visit_mut(&mut |declaration: &Declaration, value: DeclaredValueMut<'_>| {
            if let (TILT_MAX, DeclaredValueMut::Single([tilt])) = (declaration.range.name, value) {
                // The tilt stays within the law's range, or the law's controller would be refused.
                *tilt = tilt.max(tilt_max_rad).min(declaration.range.max as f32);
            }
            Ok::<(), Infallible>(())
        });
        self
    }

    /// Returns the kind of the contender's law.
    pub const fn kind(&self) -> ControllerKind {
        self.law.kind()
    }

    /// Returns the title for tables and figures; it marks a printed law and AFBC with its monitor.
    pub fn title(&self) -> &str {
        let kind = self.kind();
        match printed_names(kind) {
            Some([name, title]) if self.name == name || (self.name == kind.name() && self.is_printed()) => title,
            _ if self.name == kind.name() => kind.title(),
            _ if self.name == MONITORED && self.monitored => "AFBC with monitor",
            _ => &self.name,
        }
    }

    /// Returns the contender under the printed law's name, if it flies the printed law under the law's plain name.
    /// Results of several scenarios need it, since only the name tells the laws apart there.
    #[must_use]
    pub fn named_as_printed(self) -> Self {
        match printed_names(self.kind()).filter(|_| self.is_printed() && self.name == self.kind().name()) {
            Some([name, _]) => Contender { name: name.into(), ..self },
            None => self,
        }
    }

    /// Returns true if the law is the printed one, with any gains but without the additions of the profile `flight`.
    pub fn is_printed(&self) -> bool {
        let guarded = |gains: &adaptive::Gains| gains.safeguards != Safeguards::NONE;
        printed_names(self.kind()).is_some()
            && has_printed_cascade(&self.settings)
            && !self.gains().is_some_and(|gains| Axis::ALL.iter().any(|axis| guarded(&gains[*axis])))
    }

    /// Returns the profile that the contender uses on another vehicle.
    pub fn kept_profile(&self) -> Profile {
        if self.is_printed() { Profile::Paper } else { Profile::Flight }
    }

    /// Returns the profile with the contender's gains and settings; none if no profile has these.
    pub fn profile(&self) -> Option<Profile> {
        self.gains_of().filter(|profile| self.settings == profile.settings())
    }

    /// Returns the profile with the contender's gains on the paper's vehicle.
    fn gains_of(&self) -> Option<Profile> {
        let same = |profile: &Profile| self.law == Law::of(self.kind(), *profile);
        // The peers' gains are the same in every profile, so settings must match, too.
        Profile::ALL
            .into_iter()
            .find(|profile| same(profile) && (self.kind().in_cascade() || self.settings == profile.settings()))
    }

    /// Returns AFBC's gains; none for another law.
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

    /// Returns the contender on another vehicle: the vehicle's gains and settings in `profile` replace the contender's
    /// own. The time step and the monitor stay.
    ///
    /// # Errors
    /// One line on the mistake in the gains of the vehicle's file.
    pub fn on(self, vehicle: &Vehicle, profile: Profile) -> Result<Self, FileError> {
        let law = Law::on(self.kind(), vehicle, profile)?;
        let settings = vehicle.settings(profile).with_dt_s(self.settings.common.dt_s);
        Ok(Contender { law, settings, ..self })
    }

    /// Returns the contender on another vehicle. Its own gains and settings count as those for the paper's vehicle and
    /// are scaled [by rule](by_rule).
    #[must_use]
    pub fn by_rule(self, vehicle: &Vehicle) -> Self {
        let slowness = slowness(vehicle.lag_s());
        let by_rule = |gains| by_rule(&gains, &vehicle.parameters.to_f32(), vehicle.lag_s());
        let law = match self.law {
            Law::Afbc(gains) => Law::Afbc(by_rule(gains)),
            Law::Backstepping(own) => {
                // The rule needs a full set of AFBC's gains: the gains added here are dropped afterwards.
                let gains = Profile::Flight.gains();
                let gains = PerAxis::from_fn(|axis| adaptive::Gains { backstepping: own[axis], ..gains[axis] });
                Law::Backstepping(by_rule(gains).map(|gains| gains.backstepping))
            }
            law => slowed(law, slowness, vehicle.lag_s()),
        };
        let settings =
            self.settings.slowed(slowness, vehicle.lag_s()).with_rotor_force_max_n(vehicle.force_max_n as f32);
        // The known drag is always the vehicle's own.
        let settings = settings.with_drag(vehicle.flight_settings.common.drag);
        Contender { law, settings, ..self }
    }

    /// Returns the controller for a vehicle with these nominal parameters and rotors.
    ///
    /// # Errors
    /// The first parameter, gain or setting that is out of range.
    pub fn controller<const N: usize>(
        &self,
        parameters: &Parameters<f64>,
        rotors: &[Rotor<f64>],
    ) -> Result<AnyController<N>, OutOfRange> {
        let vehicle = Airframe::<N>::new(parameters, rotors)?;
        match &self.law {
            Law::Afbc(gains) if self.monitored => {
                let bounds = MonitorBounds::new(gains, &vehicle.parameters, &self.settings);
                Ok(AnyController::Monitored(Guarded::new(vehicle, self.settings, *gains, bounds)?))
            }
            law => law.controller(vehicle, self.settings),
        }
    }

    /// Checks the contender by building its controller like a flight does.
    ///
    /// # Errors
    /// The first parameter, gain or setting that is out of range; also an error if the rotors cannot lift the vehicle
    /// [with a margin](afbc_control::mixer::HOVER_MARGIN).
    pub fn check(&self, parameters: &Parameters<f64>, rotors: &[Rotor<f64>]) -> Result<(), OutOfRange> {
        with_rotors!(rotors.len(), N => {
            self.controller::<N>(parameters, rotors)?.mixer().check_hover(parameters.to_f32().weight_n())
        })
    }
}

/// Returns true if the cascade has none of the additions of the profile `flight`. Numbers that the paper leaves open
/// (rotors, filters and limits) may have any value.
pub(crate) fn has_printed_cascade(settings: &Settings) -> bool {
    let Settings { common, command_filter_rad_s, forward_rad_s, limits, .. } = *settings;
    *settings == Settings { common, command_filter_rad_s, forward_rad_s, limits, ..Profile::Paper.settings() }
}

/// Returns a time step rounded to remove the error of `f32` decimals \[s\].
pub fn decimal(dt_s: f32) -> f64 {
    (f64::from(dt_s) * 1e7).round() / 1e7
}
