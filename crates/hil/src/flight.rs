//! Flies a scenario in a closed loop over the link.

use super::{Autopilot, Error, MessagePeriods, ReceivedMessages, Station};
use afbc::Profile;
use afbc_control::{Action, Trace};
use afbc_files::read::FileError;
use afbc_mavlink::{CommandResult, VehicleCommand};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_sim::flight::{FlightSoftware, Lost, Sample, World, WorldView, lockstep};
use afbc_types::{Inputs, Parameters, Rotor, RotorForces, Setpoint};
use core::ops::ControlFlow;
use nalgebra::Vector3;

/// Time between control ticks, which is also the plant's step \[s\].
const STEP_S: f64 = 0.001;
/// Interval at which arming or disarming is requested again, until there is an answer \[ms\].
const ASK_EVERY_MS: u64 = 200;
/// Longest time for arming \[ms\]. The vehicle first measures its tick rate for a second. For three seconds it ignores
/// a sender whose clock was set back, as after a restart of this program.
const ARM_WITHIN_MS: u64 = 6_000;
/// Longest time for disarming \[ms\].
const DISARM_WITHIN_MS: u64 = 1_000;
/// Time without a rotor command after which the vehicle counts as silent \[ms\].
const SILENT_MS: u64 = 500;

/// Result of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopEnd {
    /// Time and reason of the vehicle's loss, if it was lost.
    pub lost: Option<Lost>,
    /// True if the observer ended the flight.
    pub interrupted: bool,
    /// True if the vehicle has confirmed that its motors are off.
    pub disarmed: bool,
}

/// Returns the firmware's contender: AFBC with its monitor, in the profile `flight`, for the vehicle of `scenario`.
///
/// # Errors
/// One line about a wrong gain in the vehicle's file.
pub fn firmware(scenario: &Scenario) -> Result<Contender, FileError> {
    let afbc =
        Contender { name: "firmware".into(), ..Contender::of(ControllerKind::Afbc, Profile::Flight).monitored() };
    scenario.vehicle_file.as_ref().map_or(Ok(afbc.clone()), |vehicle| afbc.clone().on(vehicle, Profile::Flight))
}

/// Checks whether the firmware can fly `scenario`. The [`firmware`] has its own profile, which also replaces the
/// profile of a scenario with unmodified gains and settings.
///
/// # Errors
/// [`Error::Mismatch`] names the difference from the firmware.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    let afbc = scenario.contender(ControllerKind::Afbc);
    let any = |same: &dyn Fn(&Contender, Profile) -> bool| {
        afbc.is_none_or(|afbc| Profile::ALL.into_iter().any(|profile| same(afbc, profile)))
    };
    let file = scenario.vehicle_file.as_ref();
    let gains = |profile: Profile| file.map_or(profile.gains(), |file| file.gains(profile));
    let settings = |profile: Profile| file.map_or(profile.settings(), |file| file.settings(profile));
    let agreed = [
        (scenario.vehicle == file.map_or(Parameters::PAPER, |file| file.parameters), "another vehicle"),
        (afbc.is_some(), "another law"),
        (any(&|afbc, profile| afbc.gains() == Some(&gains(profile))), "other gains"),
        (any(&|afbc, profile| afbc.settings == settings(profile)), "other settings"),
    ];
    match agreed.into_iter().find(|(agreed, _)| !agreed) {
        Some((_, what)) => Err(Error::Mismatch(what)),
        None => Ok(()),
    }
}

/// Flies `scenario`, and passes every step from t = 0 to the end to `observe`.
///
/// The vehicle is held at its start until it is armed, at t = 0. A step's [`Sample::action`] only has rotor speeds and
/// forces, and the law's estimates are unknown. A vehicle that disarms in flight is lost. At the end the vehicle is
/// always disarmed; after an error, the autopilot itself has to disarm it.
///
/// A vehicle with instruments and no tracker has its own local frame. The reference is shifted to begin at the position
/// that the vehicle reports. `observe` gets motion and reference in the scenario's frame.
///
/// # Errors
/// If the firmware cannot fly the scenario, the vehicle does not arm, or the autopilot fails.
pub fn fly(
    scenario: &Scenario,
    station: &mut Station,
    autopilot: &mut impl Autopilot,
    pace: MessagePeriods,
    observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<LoopEnd, Error> {
    check(scenario)?;
    let mut world = World::wired(scenario, STEP_S)?;
    let mut line = LoopLine {
        station,
        autopilot,
        pace,
        rotors: scenario.rotors.iter().map(|rotor| rotor.to_f32()).collect(),
        thrust_factor_n_s2: scenario.vehicle.to_f32().thrust_factor_n_s2,
        now_ms: 0,
        silent_ms: 0,
        has_armed: false,
        is_placed: scenario.instruments.tracker.is_some() || world.readings().is_none(),
        shift_m: Vector3::zeros(),
    };
    let flight = lockstep(&mut world, &mut line, scenario.duration_s, observe)?;
    let disarmed = line.disarm(&mut world)?;
    Ok(LoopEnd { lost: flight.lost, interrupted: flight.interrupted, disarmed })
}

/// A station connected to an autopilot, advanced in milliseconds.
struct LoopLine<'a, A> {
    station: &'a mut Station,
    autopilot: &'a mut A,
    pace: MessagePeriods,
    rotors: Vec<Rotor>,
    thrust_factor_n_s2: f32,
    now_ms: u64,
    /// Time since the last rotor command \[ms\].
    silent_ms: u64,
    has_armed: bool,
    /// True if the vehicle's local frame is the scenario's frame.
    is_placed: bool,
    /// Shift of the setpoints into the vehicle's local frame \[m\].
    shift_m: Vector3<f32>,
}

impl<A: Autopilot> FlightSoftware for LoopLine<'_, A> {
    type Error = Error;

    /// Runs one step. The first step is the tick that arms the vehicle.
    fn step(&mut self, world: &mut World) -> Result<Sample, Error> {
        let view = if self.has_armed { self.turn(world)? } else { self.arm(world)? };
        let speeds = self.station.heard().speeds;
        let forces = RotorForces(speeds.0.map(|speed| self.thrust_factor_n_s2 * speed * speed));
        let given = Inputs::of(&self.rotors, forces.0.as_slice());
        Ok(view.sample(Action::new(speeds, forces, given, false), Trace::default(), None))
    }

    fn gave_up(&self) -> Option<&'static str> {
        (!self.station.heard().armed).then_some("the vehicle disarmed in flight")
    }
}

impl<A: Autopilot> LoopLine<'_, A> {
    /// Runs one millisecond: sends the messages that are due, and receives.
    fn turn(&mut self, world: &mut World) -> Result<WorldView, Error> {
        let LoopLine { station, autopilot, pace, now_ms, silent_ms, has_armed, is_placed, shift_m, .. } = self;
        let view = world.look();
        if let Some(readings) = world.readings() {
            if !autopilot.sense(readings) {
                return Err(Error::Unread);
            }
        } else if let Some(state) = view.state.filter(|_| now_ms.is_multiple_of(pace.state_ms)) {
            station.track(*now_ms * 1000, state);
        }
        // In its own local frame the vehicle starts at the position that it reports, just as a pilot would read it.
        if let Some(position_m) = station.heard().position_m.filter(|_| !*is_placed && !*has_armed) {
            *shift_m = position_m - view.motion.position_m.cast::<f32>();
        }
        if now_ms.is_multiple_of(pace.setpoint_ms) {
            let setpoint = view.reference.setpoint();
            station.lead(Setpoint { position_m: setpoint.position_m + *shift_m, ..setpoint });
        }
        // The request or its answer may be lost.
        if *silent_ms > 0 && silent_ms.is_multiple_of(ASK_EVERY_MS) {
            station.ask_for_rotors();
        }
        if pace.ping_ms.is_some_and(|ping_ms| now_ms.is_multiple_of(ping_ms)) {
            station.ping();
        }
        *now_ms += 1;

        autopilot.turn_rotors(world.plant());
        let (uplink, heard_before) = (station.take(), station.heard().rotor_commands);
        autopilot.exchange(&uplink, &mut |bytes| station.hear(bytes))?;
        *silent_ms = if station.heard().rotor_commands == heard_before { *silent_ms + 1 } else { 0 };
        if *silent_ms > SILENT_MS { Err(Error::Silent) } else { Ok(view) }
    }

    /// Repeats `command` until it is `done` or `within_ms` have passed. Returns the view of the world when it was done.
    fn ask(
        &mut self,
        command: VehicleCommand,
        world: &mut World,
        within_ms: u64,
        done: fn(&ReceivedMessages) -> bool,
    ) -> Result<Option<WorldView>, Error> {
        for waited_ms in 0..within_ms {
            if waited_ms.is_multiple_of(ASK_EVERY_MS) {
                if command == VehicleCommand::Arm {
                    // The vehicle must follow setpoints as soon as it is armed.
                    self.station.follow();
                }
                self.station.command(command);
            }
            let view = self.turn(world)?;
            if done(self.station.heard()) {
                return Ok(Some(view));
            }
        }
        Ok(None)
    }

    /// Arms the vehicle while it is held. First disarms it, if a previous run has left it armed.
    fn arm(&mut self, world: &mut World) -> Result<WorldView, Error> {
        let is_silent = self.disarm(world)?;
        while world.stands() {
            self.turn(world)?;
        }
        // Own sensors leave 5 ms: their time does not advance from t = 0 until the vehicle flies.
        let within_ms = if world.readings().is_some() { 5 } else { ARM_WITHIN_MS };
        if is_silent && let Some(view) = self.ask(VehicleCommand::Arm, world, within_ms, |heard| heard.armed)? {
            self.has_armed = true;
            return Ok(view);
        }
        let reason = self.station.heard().refusal().unwrap_or("the vehicle does not answer");
        Err(Error::NotArmed(reason.into()))
    }

    /// Disarms the vehicle. Returns true if the vehicle confirms it.
    fn disarm(&mut self, world: &mut World) -> Result<bool, Error> {
        let done = |heard: &ReceivedMessages| heard.answer == Some(CommandResult::Accepted) && !heard.armed;
        // Uses the kill command, since a plain disarm is refused in the air.
        Ok(self.ask(VehicleCommand::Kill, world, DISARM_WITHIN_MS, done)?.is_some())
    }
}
