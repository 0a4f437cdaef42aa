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
    guide: Guide,
}

/// Where to go when no setpoint says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Guide {
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
        let measured = memory.take_state(inbox, now_us);
        let Memory { mode, rate, state, flight } = memory;
        let rate = rate.tick(now_us);
        let state_age_us = state.map_or(u64::MAX, |state| state.age_us(now_us));
        let fresh = state.as_ref().filter(|_| state_age_us <= RIDE_US).map(|state| &state.value);
        let setpoint = inbox.setpoint().filter(|s| s.age_us(now_us) <= SETPOINT_STALE_US).map(|s| &s.value);

        // Supervise.
        let ready = match mode.armed() {
            true => Err(Refusal::AlreadyArmed),
            false => self.limits.ready(fresh, setpoint, rate.healthy()),
        };
        let request = inbox.request();
        let answer = request.map(|request| mode.answer(request, ready));
        let landed = flight.as_ref().is_some_and(|flight| flight.guide.landed(now_us));
        *mode = mode.next(&Observed { request, ready, state_age_us, landed });
        let mode = *mode;
        // Arming takes a tick of its own, in which the motors idle: setting up a flight and a step are too much for one.
        let arms = answer == Some(Ok(Request::Arm));
        if let (true, Some(state)) = (arms, fresh) {
            Flight::begin(flight, self.blind.start(state));
        }

        // Control.
        let command = match flight {
            Some(flight) if mode.armed() && !arms => {
                flight.reckon(&self.blind, fresh.filter(|_| measured));
                let engaged = answer == Some(Ok(Request::Engage)) && self.controller.engage(&mut flight.control);
                match fresh {
                    // Taking over and a step would be too much, too: the rotors stay as they are.
                    _ if engaged => self.allocated(flight.applied),
                    Some(state) => {
                        let target = flight.guide.target(mode, state, setpoint, now_us, self.dt_s);
                        // The inbox let plausible ones pass only.
                        let command = self.controller.decide(&mut flight.control, state, target, true);
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
        flight.guide.descent = None;
        let inputs = match mode {
            Mode::Descending => self.blind.descend(&flight.reckoning),
            _ => self.blind.ride(&flight.reckoning),
        };
        self.allocated(inputs)
    }

    /// The command for these inputs, without a law.
    #[inline(always)]
    fn allocated(&self, inputs: Inputs) -> Command {
        let allocation = self.mixer.allocate(&inputs);
        let health = afbc::Health { saturated: allocation.saturated, ..afbc::Health::default() };
        let speeds = self.mixer.speeds(&allocation.forces);
        Command { speeds, forces: allocation.forces, inputs, health, ..Command::default() }
    }
}

impl<M> Memory<M> {
    /// Keeps the inbox's state if it is newer than the one at hand and not stale already: a stream of states that are
    /// always late is no stream of states. Tells whether it did.
    fn take_state(&mut self, inbox: &Inbox, now_us: u64) -> bool {
        let newer = |state: &&Stamped<State>| {
            state.age_us(now_us) <= RIDE_US && self.state.is_none_or(|held| state.at_us > held.at_us)
        };
        let taken = inbox.state().filter(newer);
        if let Some(state) = taken {
            self.state = Some(*state);
        }
        taken.is_some()
    }
}

impl<M: Default> Flight<M> {
    /// Begins a flight where the last one was remembered.
    // Out of line, so that the new memory is not put together on the tick's stack and copied.
    #[cold]
    #[inline(never)]
    fn begin(flight: &mut Option<Self>, reckoning: Reckoning) {
        *flight =
            Some(Flight { control: M::default(), reckoning, applied: Inputs::default(), guide: Guide::default() });
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
}

impl Guide {
    /// Where to go from a fresh `state`: down, to the setpoint, or nowhere if there is none.
    fn target<'a>(
        &'a mut self,
        mode: Mode,
        state: &State,
        setpoint: Option<&'a Setpoint>,
        now_us: u64,
        dt_s: f32,
    ) -> &'a Setpoint {
        if mode == Mode::Descending {
            let descent = self.descent.get_or_insert_with(|| Descent::new(state, now_us));
            descent.advance(state, now_us, dt_s);
            return descent.setpoint();
        }
        match setpoint {
            Some(setpoint) => {
                self.hold = None;
                setpoint
            }
            None => self.hold.get_or_insert_with(|| Setpoint::hold(state)),
        }
    }

    fn landed(&self, now_us: u64) -> bool {
        self.descent.is_some_and(|descent| descent.landed(now_us))
    }
}
