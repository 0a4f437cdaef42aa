//! The closed loop over the link.

use super::{Autopilot, Error, Heard, Pace, Station};
use crate::contender::{Contender, ControllerKind, Law};
use crate::flight::{Lost, Sample, lost};
use crate::scenario::Scenario;
use crate::trajectory::Reference;
use afbc::Profile;
use afbc_control::{Action, Trace};
use afbc_link::{Answer, Command};
use afbc_plant::{Measurement, Motion, Sensors};
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
pub struct End {
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// True if the observer broke off.
    pub interrupted: bool,
    /// True if the vehicle said that its motors are off.
    pub disarmed: bool,
}

/// Who flies in the loop: AFBC in the profile `flight`, under its monitor.
pub fn firmware() -> Contender {
    let Contender { settings, .. } = Contender::of(ControllerKind::Afbc, Profile::Flight);
    Contender { name: "firmware".into(), law: Law::Guarded(Profile::Flight.gains()), settings }
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
/// The vehicle is held where it starts until it is armed: that is t = 0. A step's [`Sample::command`] holds the rotor
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
    mut observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<End, Error> {
    check(scenario)?;
    let mut plant = scenario.plant(STEP_S)?;
    let mut line = Line {
        station,
        autopilot,
        sensors: scenario.sensors(STEP_S)?,
        measurement: None,
        pace,
        now_ms: 0,
        silent_ms: 0,
    };
    line.arm((&scenario.initial, &scenario.trajectory.at(0.0)))?;

    let thrust_factor_n_s2 = scenario.vehicle.to_f32().thrust_factor_n_s2;
    let steps = (scenario.duration_s / STEP_S).round() as u64;
    let mut end = End { lost: None, interrupted: false, disarmed: false };
    for step in 0..=steps {
        let (time_s, motion, telemetry) = (plant.time_s(), plant.motion(), plant.telemetry());
        let reference = scenario.trajectory.at(time_s);
        // The tick that armed the vehicle was the first.
        if step > 0 {
            line.turn(&motion, &reference)?;
        }
        let heard = line.station.heard();
        let forces = RotorForces(heard.speeds.0.map(|speed| thrust_factor_n_s2 * speed * speed));
        let sample = Sample {
            time_s,
            motion,
            measurement: line.measurement,
            telemetry,
            reference,
            action: Action { speeds: heard.speeds, forces, ..Action::default() },
            trace: Trace::default(),
            estimates: PerAxis::default(),
        };
        end.interrupted = observe(&sample).is_break();
        end.lost =
            lost(&sample).or((!heard.armed).then_some("it disarmed in flight")).map(|reason| Lost { time_s, reason });
        if end.interrupted || end.lost.is_some() {
            break;
        }
        if step < steps {
            plant.step(&heard.speeds, STEP_S);
        }
    }
    let (time_s, motion) = (plant.time_s(), plant.motion());
    end.disarmed = line.disarm((&motion, &scenario.trajectory.at(time_s)))?;
    Ok(end)
}

/// A station that talks with an autopilot, a millisecond at a time.
struct Line<'a, A> {
    station: &'a mut Station,
    autopilot: &'a mut A,
    sensors: Option<Sensors>,
    /// What they said last.
    measurement: Option<Measurement>,
    pace: Pace,
    now_ms: u64,
    /// Since the last rotor command.
    silent_ms: u64,
}

impl<A: Autopilot> Line<'_, A> {
    /// One millisecond: says what is due, hears what comes.
    fn turn(&mut self, motion: &Motion, reference: &Reference) -> Result<(), Error> {
        let Line { station, autopilot, sensors, measurement, pace, now_ms, silent_ms } = self;
        *measurement = sensors.as_mut().map(|sensors| sensors.measure(motion));
        let state = measurement.map_or(Some(motion.measure()), |m| m.fresh.then_some(m.state));
        if let Some(state) = state.filter(|_| now_ms.is_multiple_of(pace.state_ms)) {
            station.track(*now_ms * 1000, state);
        }
        if now_ms.is_multiple_of(pace.setpoint_ms) {
            station.lead(reference.setpoint());
        }
        if pace.ping_ms.is_some_and(|ping_ms| now_ms.is_multiple_of(ping_ms)) {
            station.ping();
        }
        *now_ms += 1;

        let (uplink, heard_before) = (station.take(), station.heard().rotor_commands);
        autopilot.exchange(&uplink, &mut |bytes| station.hear(bytes))?;
        *silent_ms = if station.heard().rotor_commands == heard_before { *silent_ms + 1 } else { 0 };
        if *silent_ms > SILENT_MS { Err(Error::Silent) } else { Ok(()) }
    }

    /// Asks for `command` again and again, until it is `done` or `within_ms` is over. True if it is done.
    fn ask(
        &mut self,
        command: Command,
        (motion, reference): (&Motion, &Reference),
        within_ms: u64,
        done: fn(&Heard) -> bool,
    ) -> Result<bool, Error> {
        for waited_ms in 0..within_ms {
            if waited_ms.is_multiple_of(ASK_EVERY_MS) {
                self.station.command(command);
            }
            self.turn(motion, reference)?;
            if done(self.station.heard()) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Arms a vehicle that is held at `place`, or that was left armed by whoever was here before.
    fn arm(&mut self, place: (&Motion, &Reference)) -> Result<(), Error> {
        if self.disarm(place)? && self.ask(Command::Arm, place, ARM_WITHIN_MS, |heard| heard.armed)? {
            return Ok(());
        }
        let reason = self.station.heard().refusal().unwrap_or("it does not answer");
        Err(Error::NotArmed(reason.into()))
    }

    /// True if the vehicle says that it has disarmed.
    fn disarm(&mut self, place: (&Motion, &Reference)) -> Result<bool, Error> {
        let done = |heard: &Heard| heard.answer == Some(Answer::Accepted) && !heard.armed;
        self.ask(Command::Kill, place, DISARM_WITHIN_MS, done)
    }
}
