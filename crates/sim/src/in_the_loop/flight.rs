//! The closed loop over the link.

use super::{Autopilot, Error, Heard, Pace, Station};
use crate::contender::{Contender, ControllerKind};
use crate::flight::{Lost, Pilot, Sample, View, World, lockstep};
use crate::scenario::Scenario;
use afbc::Profile;
use afbc_control::{Action, Trace};
use afbc_link::{Answer, Command};
use afbc_types::{Parameters, PerAxis, RotorForces};
use core::ops::ControlFlow;

/// Time between control ticks, and one step of the plant \[s\].
const STEP_S: f64 = 0.001;
/// How often arming and disarming are asked for until they are answered \[ms\].
const ASK_EVERY_MS: u64 = 200;
/// How long arming may take \[ms\]. The vehicle measures its rate over a second first, and ignores for three a sender
/// whose clock was set back, which is what starting this program again looks like.
const ARM_WITHIN_MS: u64 = 6_000;
/// How long disarming may take \[ms\].
const DISARM_WITHIN_MS: u64 = 1_000;
/// A vehicle that has sent no rotor command for this long is gone \[ms\].
const SILENT_MS: u64 = 500;

/// How a flight came to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopEnd {
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// True if the observer broke off.
    pub interrupted: bool,
    /// True if the vehicle said that its motors are off.
    pub disarmed: bool,
}

/// Who flies in the loop: AFBC in the profile `flight`, under its monitor.
pub fn firmware() -> Contender {
    Contender { name: "firmware".into(), ..Contender::of(ControllerKind::Afbc, Profile::Flight).monitored() }
}

/// Whether the firmware can fly `scenario`. The [`firmware`] has its own profile; a scenario that leaves gains and settings
/// as they are in any profile does not mind.
///
/// # Errors
/// [`Error::Mismatch`] names what the firmware holds otherwise.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    let afbc = scenario.contender(ControllerKind::Afbc);
    let profile = |same: fn(&Contender, Profile) -> bool| {
        afbc.is_none_or(|afbc| Profile::ALL.into_iter().any(|profile| same(afbc, profile)))
    };
    let agreed = [
        (scenario.vehicle == Parameters::PAPER, "another vehicle"),
        (afbc.is_some(), "another law"),
        (profile(|afbc, profile| afbc.gains() == Some(&profile.gains())), "other gains"),
        (profile(|afbc, profile| afbc.settings == profile.settings()), "other settings"),
    ];
    match agreed.into_iter().find(|(agreed, _)| !agreed) {
        Some((_, what)) => Err(Error::Mismatch(what)),
        None => Ok(()),
    }
}

/// Flies `scenario`, showing every step from t = 0 to the end.
///
/// The vehicle is held where it starts until it is armed: that is t = 0. A step's [`Sample::action`] holds the rotor
/// speeds and forces only, and nothing is known of the estimates. A vehicle that disarms in flight is lost. It is disarmed at
/// the end, whatever the end is; after an error, the autopilot has to see to that itself.
///
/// # Errors
/// If the firmware cannot fly the scenario, the vehicle does not arm, or the autopilot fails.
pub fn fly(
    scenario: &Scenario,
    station: &mut Station,
    autopilot: &mut impl Autopilot,
    pace: Pace,
    observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<LoopEnd, Error> {
    check(scenario)?;
    let mut world = World::new(scenario, STEP_S)?;
    let mut line = Line {
        station,
        autopilot,
        pace,
        thrust_factor_n_s2: scenario.vehicle.to_f32().thrust_factor_n_s2,
        now_ms: 0,
        silent_ms: 0,
        has_armed: false,
    };
    let flight = lockstep(&mut world, &mut line, scenario.duration_s, observe)?;
    let disarmed = line.disarm(&mut world)?;
    Ok(LoopEnd { lost: flight.lost, interrupted: flight.interrupted, disarmed })
}

/// A station that talks with an autopilot, a millisecond at a time.
struct Line<'a, A> {
    station: &'a mut Station,
    autopilot: &'a mut A,
    pace: Pace,
    thrust_factor_n_s2: f32,
    now_ms: u64,
    /// Since the last rotor command.
    silent_ms: u64,
    has_armed: bool,
}

impl<A: Autopilot> Pilot for Line<'_, A> {
    type Error = Error;

    /// The tick that arms the vehicle is the first.
    fn step(&mut self, world: &mut World) -> Result<Sample, Error> {
        let view = if self.has_armed { self.turn(world)? } else { self.arm(world)? };
        let speeds = self.station.heard().speeds;
        let forces = RotorForces(speeds.0.map(|speed| self.thrust_factor_n_s2 * speed * speed));
        Ok(view.sample(Action::new(speeds, forces, false), Trace::default(), PerAxis::default()))
    }

    fn gave_up(&self) -> Option<&'static str> {
        (!self.station.heard().armed).then_some("it disarmed in flight")
    }
}

impl<A: Autopilot> Line<'_, A> {
    /// One millisecond: says what is due, hears what comes.
    fn turn(&mut self, world: &mut World) -> Result<View, Error> {
        let Line { station, autopilot, pace, now_ms, silent_ms, .. } = self;
        let view = world.look();
        if let Some(state) = view.state.filter(|_| now_ms.is_multiple_of(pace.state_ms)) {
            station.track(*now_ms * 1000, state);
        }
        if now_ms.is_multiple_of(pace.setpoint_ms) {
            station.lead(view.reference.setpoint());
        }
        if pace.ping_ms.is_some_and(|ping_ms| now_ms.is_multiple_of(ping_ms)) {
            station.ping();
        }
        *now_ms += 1;

        let (uplink, heard_before) = (station.take(), station.heard().rotor_commands);
        autopilot.exchange(&uplink, &mut |bytes| station.hear(bytes))?;
        *silent_ms = if station.heard().rotor_commands == heard_before { *silent_ms + 1 } else { 0 };
        if *silent_ms > SILENT_MS { Err(Error::Silent) } else { Ok(view) }
    }

    /// Asks for `command` again and again, until it is `done` or `within_ms` is over; what was to be seen when it was done.
    fn ask(
        &mut self,
        command: Command,
        world: &mut World,
        within_ms: u64,
        done: fn(&Heard) -> bool,
    ) -> Result<Option<View>, Error> {
        for waited_ms in 0..within_ms {
            if waited_ms.is_multiple_of(ASK_EVERY_MS) {
                self.station.command(command);
            }
            let view = self.turn(world)?;
            if done(self.station.heard()) {
                return Ok(Some(view));
            }
        }
        Ok(None)
    }

    /// Arms a vehicle that is held where it is, or that was left armed by whoever was here before.
    fn arm(&mut self, world: &mut World) -> Result<View, Error> {
        if self.disarm(world)?
            && let Some(view) = self.ask(Command::Arm, world, ARM_WITHIN_MS, |heard| heard.armed)?
        {
            self.has_armed = true;
            return Ok(view);
        }
        let reason = self.station.heard().refusal().unwrap_or("it does not answer");
        Err(Error::NotArmed(reason.into()))
    }

    /// True if the vehicle says that it has disarmed.
    fn disarm(&mut self, world: &mut World) -> Result<bool, Error> {
        let done = |heard: &Heard| heard.answer == Some(Answer::Accepted) && !heard.armed;
        Ok(self.ask(Command::Kill, world, DISARM_WITHIN_MS, done)?.is_some())
    }
}
