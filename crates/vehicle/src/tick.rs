//! The control tick: take the newest inputs, supervise, control, gate the motors, check the rate.

use crate::blind::{Blind, Reckoning};
use crate::descent::Descent;
use crate::inbox::{Inbox, Stamped};
use crate::rate;
use crate::supervisor::{ArmingLimits, Mode, Observed, RIDE_US, Refusal, Request, SETPOINT_STALE_US};
use afbc::allocation::Mixer;
use afbc::{Command, FlightController, Settings};
use airframe::{Inputs, OutOfRange, Parameters, Range, RotorSpeeds, Setpoint, State};

/// Accepted time between steps of a law that flies: the tick's \[s\].
pub const DT: Range = Range::new("dt_s", 0.001, 0.001);

/// A vehicle with its controller: fixed from here on. What changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle<C> {
    controller: C,
    mixer: Mixer,
    blind: Blind,
    limits: ArmingLimits,
    dt_s: f32,
}

/// What a vehicle remembers between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<M> {
    mode: Mode,
    rate: rate::Counter,
    /// The newest plausible state.
    state: Option<Stamped<State>>,
    flight: Option<Flight<M>>,
}

/// What a vehicle remembers of one flight, from arming on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Flight<M> {
    control: M,
    reckoning: Reckoning,
    /// What the rotors were last told.
    applied: Inputs,
    /// Where to stay while there is no setpoint.
    hold: Option<Setpoint>,
    descent: Option<Descent>,
}

impl<M> Memory<M> {
    /// What the vehicle is doing.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// What the controller remembers of this flight, or of the last one; none before the first.
    pub fn control(&self) -> Option<&M> {
        self.flight.as_ref().map(|flight| &flight.control)
    }
}

/// What a tick says about itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Of the law's step.
    pub control: afbc::Health,
    /// Of the tick's rate.
    pub rate: rate::Report,
    /// Age of the newest plausible state \[us\]; `u64::MAX` if there is none.
    pub state_age_us: u64,
    /// True if there is no plausible setpoint younger than 500 ms: an armed vehicle holds its position.
    pub setpoint_stale: bool,
}

/// What a tick decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What the motors get: zero if disarmed.
    pub motors: RotorSpeeds,
    /// What the vehicle is doing.
    pub mode: Mode,
    /// How well.
    pub health: Health,
    /// The answer to this tick's request.
    pub answer: Option<Result<Request, Refusal>>,
}

impl<C: FlightController> Vehicle<C> {
    /// A vehicle with these nominal parameters under `controller`, which was built with the same settings.
    ///
    /// # Errors
    /// The first parameter, setting or limit out of range; the time step must be the tick's, 1 ms.
    pub fn new(
        airframe: Parameters,
        settings: Settings,
        limits: ArmingLimits,
        controller: C,
    ) -> Result<Self, OutOfRange> {
        limits.validate()?;
        DT.check(settings.dt_s)?;
        Ok(Vehicle {
            controller,
            mixer: Mixer::new(&airframe, settings.rotor_force_max_n)?,
            blind: Blind::new(&airframe, settings.dt_s),
            limits,
            dt_s: settings.dt_s,
        })
    }

    /// One tick, to be called every millisecond; `now_us` is the time since power-up and never goes back. Cannot fail.
    #[inline]
    pub fn tick(&self, memory: &mut Memory<C::Memory>, now_us: u64, inbox: &Inbox) -> Outcome {
        self.traced_tick(memory, now_us, inbox).0
    }

    /// The same tick, with the command behind it: while blind, rotor speeds, forces and inputs only; disarmed, all zero.
    // Always: a command that nobody looks at is then never put together.
    #[inline(always)]
    pub fn traced_tick(&self, memory: &mut Memory<C::Memory>, now_us: u64, inbox: &Inbox) -> (Outcome, Command) {
        // Take the newest inputs.
        let rate = memory.rate.tick(now_us);
        let measured = memory.take_state(inbox, now_us);
        let state_age_us = memory.state.map_or(u64::MAX, |state| state.age_us(now_us));
        let fresh = memory.state.filter(|_| state_age_us <= RIDE_US).map(|state| state.value);
        let setpoint =
            inbox.setpoint.filter(|s| s.age_us(now_us) <= SETPOINT_STALE_US && s.value.is_plausible()).map(|s| s.value);

        // Supervise.
        let ready = self.limits.ready(fresh.as_ref(), setpoint.as_ref(), rate.healthy());
        let answer = inbox.request.map(|request| memory.mode.answer(request, ready));
        let landed = memory.flight.as_ref().is_some_and(|flight| flight.landed(now_us));
        memory.mode = memory.mode.next(&Observed { request: inbox.request, ready, state_age_us, landed });
        let mode = memory.mode;
        if let (Some(Ok(Request::Arm)), Some(state)) = (answer, &fresh) {
            memory.flight = Some(Flight::new(self.blind.start(state)));
        }
        if let (Some(Ok(Request::Engage)), Some(flight)) = (answer, &mut memory.flight) {
            self.controller.engage(&mut flight.control);
        }

        // Control.
        let command = match &mut memory.flight {
            Some(flight) if mode.armed() => {
                flight.reckon(&self.blind, measured.as_ref());
                match fresh {
                    Some(state) => {
                        let target = flight.target(mode, &state, setpoint, now_us, self.dt_s);
                        // Screened above: both are plausible.
                        let command = self.controller.decide(&mut flight.control, &state, &target, true);
                        flight.applied = Mixer::inputs(&command.forces);
                        self.blind.trim(&mut flight.reckoning, &flight.applied);
                        command
                    }
                    None => {
                        let command = self.blind_command(flight, mode);
                        flight.applied = Mixer::inputs(&command.forces);
                        command
                    }
                }
            }
            _ => Command::default(),
        };

        // Gate the motors.
        let motors = if mode.armed() { command.speeds } else { RotorSpeeds::default() };
        let health = Health { control: command.health, rate, state_age_us, setpoint_stale: setpoint.is_none() };
        (Outcome { motors, mode, health, answer }, command)
    }

    /// Rotor commands without a state.
    #[inline(always)]
    fn blind_command<M>(&self, flight: &mut Flight<M>, mode: Mode) -> Command {
        flight.descent = None;
        let inputs = match mode {
            Mode::Descending => self.blind.descend(&flight.reckoning),
            _ => self.blind.ride(&flight.reckoning),
        };
        let allocation = self.mixer.allocate(&inputs);
        let health = afbc::Health { saturated: allocation.saturated, ..afbc::Health::default() };
        let speeds = self.mixer.speeds(&allocation.forces);
        Command { speeds, forces: allocation.forces, inputs, health, ..Command::default() }
    }
}

impl<M> Memory<M> {
    /// Keeps the inbox's state, and returns it, if it is plausible, newer than the one at hand, and not stale already: a
    /// stream of states that are always late is no stream of states.
    fn take_state(&mut self, inbox: &Inbox, now_us: u64) -> Option<State> {
        let newer = |state: &Stamped<State>| {
            state.age_us(now_us) <= RIDE_US
                && state.value.is_plausible()
                && self.state.is_none_or(|held| state.at_us > held.at_us)
        };
        let taken = inbox.state.filter(newer);
        self.state = taken.or(self.state);
        taken.map(|state| state.value)
    }
}

impl<M: Default> Flight<M> {
    fn new(reckoning: Reckoning) -> Self {
        Flight { control: M::default(), reckoning, applied: Inputs::default(), hold: None, descent: None }
    }
}

impl<M> Flight<M> {
    /// Dead reckoning over the last period, corrected by what was measured.
    fn reckon(&mut self, blind: &Blind, measured: Option<&State>) {
        blind.advance(&mut self.reckoning, &self.applied);
        if let Some(state) = measured {
            blind.measure(&mut self.reckoning, state);
        }
    }

    /// Where to go from a fresh `state`: down, to the setpoint, or nowhere if there is none.
    fn target(&mut self, mode: Mode, state: &State, setpoint: Option<Setpoint>, now_us: u64, dt_s: f32) -> Setpoint {
        if mode == Mode::Descending {
            let descent = self.descent.get_or_insert(Descent::new(state, now_us));
            descent.advance(state, now_us, dt_s);
            return *descent.setpoint();
        }
        match setpoint {
            Some(setpoint) => {
                self.hold = None;
                setpoint
            }
            None => *self.hold.get_or_insert(Setpoint::hold(state)),
        }
    }

    fn landed(&self, now_us: u64) -> bool {
        self.descent.is_some_and(|descent| descent.landed(now_us))
    }
}
