//! Users' own laws, which are not in the list: a registered law flies wherever a law of the list does.

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_types::{
    Airframe, Declaration, Declared, DeclaredValue, DeclaredValueMut, Inputs, OutOfRange, Parameters, Range, Setpoint,
    State, Visitor, VisitorMut,
};
use core::cell::RefCell;
use core::fmt;
use core::slice;
use serde::{Serialize, Serializer};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

/// Largest number of gains of a user's law.
pub const OWN_GAINS_MAX: usize = 32;
/// Longest name of a user's law.
const NAME_LENGTH: usize = 32;
/// Names of standard contenders, which a user's law must not have.
const TAKEN: [&str; 3] = ["afbc-as-printed", "backstepping-as-printed", "afbc-monitored"];

/// A user's control law, which computes U1..U4 from state and setpoint. The harness adds mixer, sensors and the check
/// for loss.
///
/// A new instance is made for each flight, so it may keep its own memory.
pub trait OwnController: Send {
    /// Computes the demanded U1..U4 \[N\] of one step from a plausible state and setpoint. A state that is not `fresh`
    /// repeats the last state. An input that is not finite counts as zero.
    fn step(&mut self, state: &State, setpoint: &Setpoint, fresh: bool) -> Inputs;
}

/// Data of the vehicle for a user's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnVehicle {
    /// Nominal parameters.
    pub parameters: Parameters,
    /// Number of rotors.
    pub rotors: usize,
    /// Largest force of one rotor \[N\].
    pub rotor_force_max_n: f32,
    /// Time between steps \[s\].
    pub dt_s: f32,
    /// Gains of the law, in the order of their declaration; unused entries are zero.
    pub gains: [f32; OWN_GAINS_MAX],
}

/// Declaration of a gain of a user's law, for scenario files, vehicle files and the tuner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnGain {
    declaration: Declaration,
    value: f32,
}

impl OwnGain {
    /// Declares a gain with its key in files, unit, default value and the tuner's search range. On a slower vehicle, a
    /// gain in 1/s, 1/s2, 1/s3 or 1/s4 is reduced by that power, unless the vehicle's file has its own value.
    pub const fn new(name: &'static str, unit: &'static str, value: f32, [min, max]: [f64; 2]) -> Self {
        let range = Range::new(name, min, max);
        OwnGain { declaration: Declaration { id: name, group: "", range, unit, tuned: true, meaning: "" }, value }
    }

    /// Adds the gain's meaning.
    #[must_use]
    pub const fn meaning(self, meaning: &'static str) -> Self {
        OwnGain { declaration: Declaration { meaning, ..self.declaration }, ..self }
    }
}

type LawFactory = dyn Fn(&OwnVehicle) -> Box<dyn OwnController> + Send + Sync;

/// A user's law before it is [registered](Self::register).
pub struct OwnLaw {
    name: &'static str,
    title: &'static str,
    gains: Vec<OwnGain>,
    make: RwLock<Arc<LawFactory>>,
}

/// All registered laws.
static REGISTERED: Mutex<Vec<OwnKind>> = Mutex::new(Vec::new());

impl OwnLaw {
    /// Describes a law: its name in files and on the command line, and a function that makes its controller for a
    /// vehicle. `make` is called at the start of each flight, from many threads at once.
    pub fn new<C: OwnController + 'static>(
        name: &'static str,
        make: impl Fn(&OwnVehicle) -> C + Send + Sync + 'static,
    ) -> Self {
        let make = move |vehicle: &OwnVehicle| Box::new(make(vehicle)) as Box<dyn OwnController>;
        OwnLaw { name, title: name, gains: Vec::new(), make: RwLock::new(Arc::new(make)) }
    }

    /// Adds a title for tables and figures.
    #[must_use]
    pub fn title(self, title: &'static str) -> Self {
        OwnLaw { title, ..self }
    }

    /// Adds gains, which files may set and the tuner searches.
    #[must_use]
    pub fn gains(self, gains: impl Into<Vec<OwnGain>>) -> Self {
        OwnLaw { gains: gains.into(), ..self }
    }

    /// Registers the law, if its name is not among those `taken`.
    pub(super) fn keep(self, taken: &[&str]) -> Result<OwnKind, String> {
        self.check(taken).map_err(|problem| format!("law \"{}\": {problem}", self.name.escape_debug()))?;
        let mut all = REGISTERED.lock().unwrap_or_else(PoisonError::into_inner);
        let known = all.iter_mut().find(|known| known.0.name == self.name);
        // The same declaration again: existing kinds fly the new code, and no more memory is leaked.
        if let Some(OwnKind(same)) = known.as_deref().filter(|known| known.0.is_declared_as(&self)) {
            let make = self.make.into_inner().unwrap_or_else(PoisonError::into_inner);
            *same.make.write().unwrap_or_else(PoisonError::into_inner) = make;
            return Ok(OwnKind(same));
        }
        // Registered laws live as long as the program, like those of the list.
        let kind = OwnKind(Box::leak(Box::new(self)));
        match known {
            Some(known) => *known = kind,
            None => all.push(kind),
        }
        Ok(kind)
    }

    fn check(&self, taken: &[&str]) -> Result<(), String> {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        if !(1..=NAME_LENGTH).contains(&self.name.len()) || !self.name.chars().all(plain) {
            return Err(format!("the name must have 1 to {NAME_LENGTH} characters out of a to z, 0 to 9, - and _"));
        }
        if TAKEN.contains(&self.name) || taken.contains(&self.name) {
            return Err("a built-in law has this name; choose another".into());
        }
        if self.gains.len() > OWN_GAINS_MAX {
            return Err(format!("the law has {} gains; at most {OWN_GAINS_MAX} are possible", self.gains.len()));
        }
        for (index, OwnGain { declaration: Declaration { range, .. }, value }) in self.gains.iter().enumerate() {
            range.check(*value).map_err(|error| error.to_string())?;
            if self.gains.iter().take(index).any(|other| other.declaration.range.name == range.name) {
                return Err(format!("two gains are called {}; rename one of them", range.name));
            }
        }
        Ok(())
    }

    fn is_declared_as(&self, other: &OwnLaw) -> bool {
        (self.name, self.title, &self.gains) == (other.name, other.title, &other.gains)
    }
}

/// A registered law.
#[derive(Clone, Copy)]
pub struct OwnKind(&'static OwnLaw);

impl OwnKind {
    /// Returns every registered law in the order of registration.
    pub(super) fn all() -> Vec<OwnKind> {
        REGISTERED.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) const fn name(self) -> &'static str {
        self.0.name
    }

    pub(super) const fn title(self) -> &'static str {
        self.0.title
    }

    fn controller(self, vehicle: &OwnVehicle) -> Box<dyn OwnController> {
        // `make` is not called under the lock, since it may wait for a thread that registers a law.
        let make = Arc::clone(&self.0.make.read().unwrap_or_else(PoisonError::into_inner));
        make(vehicle)
    }
}

impl PartialEq for OwnKind {
    fn eq(&self, other: &Self) -> bool {
        // Each registered law has one address; its code cannot be compared.
        core::ptr::eq(self.0, other.0)
    }
}

impl Eq for OwnKind {}

impl fmt::Debug for OwnKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("OwnKind").field(&self.0.name).finish()
    }
}

/// A registered law with values of its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnGains {
    kind: OwnKind,
    values: [f32; OWN_GAINS_MAX],
}

impl OwnGains {
    /// Returns the law with the gains' default values.
    pub(super) fn of(kind: OwnKind) -> Self {
        let mut values = [0.0; OWN_GAINS_MAX];
        for (value, gain) in values.iter_mut().zip(&kind.0.gains) {
            *value = gain.value;
        }
        OwnGains { kind, values }
    }

    pub(super) const fn kind(&self) -> OwnKind {
        self.kind
    }

    /// Returns the law's controller for this vehicle.
    ///
    /// # Errors
    /// The first parameter or setting that is out of range.
    pub(super) fn controller<const N: usize>(
        &self,
        vehicle: Airframe<N>,
        settings: &afbc_control::Settings,
    ) -> Result<OwnFlight<N>, OutOfRange> {
        settings.validate()?;
        let mixer = Mixer::new(vehicle, settings.rotor_force_max_n)?;
        let vehicle = OwnVehicle {
            parameters: vehicle.parameters,
            rotors: N,
            rotor_force_max_n: settings.rotor_force_max_n,
            dt_s: settings.dt_s,
            gains: self.values,
        };
        Ok(OwnFlight { kind: self.kind, vehicle, mixer, law: RefCell::new(None) })
    }
}

impl Serialize for OwnGains {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let gains = self.kind.0.gains.iter().map(|gain| gain.declaration.range.name);
        let gains: Vec<(&str, f32)> = gains.zip(self.values).collect();
        (self.kind.0.name, gains).serialize(serializer)
    }
}

impl Declared for OwnGains {
    fn visit<E>(&self, visit: &mut impl Visitor<E>) -> Result<(), E> {
        let mut gains = self.kind.0.gains.iter().zip(&self.values);
        gains.try_for_each(|(gain, value)| visit(&gain.declaration, DeclaredValue::Single(slice::from_ref(value))))
    }

    fn visit_mut<E>(&mut self, visit: &mut impl VisitorMut<E>) -> Result<(), E> {
        let mut gains = self.kind.0.gains.iter().zip(&mut self.values);
        gains.try_for_each(|(gain, value)| visit(&gain.declaration, DeclaredValueMut::Single(slice::from_mut(value))))
    }

    fn together(&self) -> Result<(), OutOfRange> {
        Ok(())
    }
}

/// A user's law with the interface of all controllers.
pub struct OwnFlight<const N: usize> {
    kind: OwnKind,
    vehicle: OwnVehicle,
    mixer: Mixer<N>,
    /// The law's instance for the current flight; none before the first step.
    law: RefCell<Option<Box<dyn OwnController>>>,
}

/// True once the flight has begun, and the last demanded inputs.
#[derive(Clone, Copy, Debug, Default)]
pub struct OwnMemory {
    begun: bool,
    inputs: Inputs,
}

impl<const N: usize> Clone for OwnFlight<N> {
    /// Returns a controller that has not flown.
    fn clone(&self) -> Self {
        OwnFlight { kind: self.kind, vehicle: self.vehicle, mixer: self.mixer, law: RefCell::new(None) }
    }
}

impl<const N: usize> fmt::Debug for OwnFlight<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OwnFlight").field("kind", &self.kind).field("vehicle", &self.vehicle).finish_non_exhaustive()
    }
}

impl<const N: usize> FlightController<N> for OwnFlight<N> {
    type Memory = OwnMemory;

    fn dt_s(&self) -> f32 {
        self.vehicle.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.mixer
    }

    fn decide(&self, memory: &mut OwnMemory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let mut law = self.law.borrow_mut();
        // An empty memory begins a flight: a new instance must not remember an earlier flight.
        if !core::mem::replace(&mut memory.begun, true) {
            *law = None;
        }
        let law = law.get_or_insert_with(|| self.kind.controller(&self.vehicle));
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = law.step(state, setpoint, fresh);
        let [roll_n, pitch_n, yaw_n, thrust_n] =
            [roll_n, pitch_n, yaw_n, thrust_n].map(|input| if input.is_finite() { input } else { 0.0 });
        memory.inputs = Inputs { roll_n, pitch_n, yaw_n, thrust_n };
        self.mixer.action(&memory.inputs)
    }

    fn trace(memory: &OwnMemory) -> Trace {
        let mut trace = Trace::default();
        trace.inputs = memory.inputs;
        trace
    }
}
