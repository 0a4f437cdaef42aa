//! Text commands, one per line, that change weather and faults while vehicles fly.

use crate::handheld::{Grip, SIDES};
use afbc_files::read::words::{nearest, out_of_range};
use afbc_plant::instruments::{FailureKind, limits as failure};
use afbc_plant::rotors::limits as rotor;
use afbc_plant::wind::limits as gust;
use afbc_plant::{BatteryModel, GUST_SIZE, PAYLOAD_BELOW, PAYLOAD_MASS, PlantParameter, Turbulence, Wind};
use afbc_scenario::contender::ControllerKind;
use afbc_types::Range;
use nalgebra::Vector3;
use std::str::SplitWhitespace;

/// A parsed line.
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledLine {
    /// Time at which the command is carried out, by the vehicles' clock \[s\]; `None`: at once.
    pub at_s: Option<f64>,
    /// System id of the vehicle that the command is for; `None`: all.
    pub vehicle: Option<u8>,
    /// The command.
    pub command: ServerCommand,
}

/// A command to the server.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerCommand {
    /// Changes weather or faults.
    WorldChange(WorldChange),
    /// Reports the state of the vehicles.
    Status,
    /// Runs this many milliseconds, in lockstep.
    Step(u32),
    /// Runs at this multiple of real time; 0: as fast as possible.
    Speed(f64),
    /// Pauses (true) or resumes (false).
    Pause(bool),
    /// Switches to this control law.
    Law(ControllerKind),
    /// Lists the commands.
    Help,
    /// Ends the server.
    Quit,
}

/// A change of weather or faults that takes effect at once. Axes are those of the earth frame: north, west, up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorldChange {
    /// Steady wind \[m/s\].
    Wind(Vector3<f64>),
    /// Turbulence; `None` for calm air.
    Turbulence(Option<Turbulence>),
    /// A gust that rises, holds and falls.
    Gust {
        /// Velocity at the peak \[m/s\].
        velocity_m_s: Vector3<f64>,
        /// Time to the peak \[s\].
        rise_s: f64,
        /// Time at the peak \[s\].
        hold_s: f64,
    },
    /// A force on the vehicle.
    Push {
        /// Force \[N\].
        force_n: Vector3<f64>,
        /// Duration \[s\]; `None`: permanent.
        seconds: Option<f64>,
    },
    /// A change of a vehicle parameter.
    Change {
        /// The parameter that changes.
        quantity: PlantParameter,
        /// Factor on the parameter's original value.
        factor: f64,
        /// Duration \[s\]; `None`: permanent.
        seconds: Option<f64>,
    },
    /// The payload that the vehicle carries; a mass of 0 drops it.
    Payload {
        /// Mass \[kg\].
        mass_kg: f64,
        /// Distance below the centre of mass \[m\].
        below_m: f64,
    },
    /// A failure of an instrument.
    Fault {
        /// Kind of failure.
        failure: FailureKind,
        /// Duration \[s\]; `None`: permanent.
        seconds: Option<f64>,
    },
    /// A rotor that keeps only a part of its thrust.
    Rotor {
        /// Number of the rotor, from 1.
        rotor: u8,
        /// Remaining share of the thrust; 1 repairs the rotor.
        efficiency: f64,
    },
    /// Charge of the battery, 0 to 1.
    Battery(f64),
    /// A hand takes hold of the vehicle, or puts it down.
    Hold(Grip),
    /// Removes all faults; weather and payload are the scenario's again.
    Clear,
}

/// Name, arguments and meaning of each command.
pub const COMMANDS: [[&str; 3]; 20] = [
    ["wind", "X Y Z", "steady wind towards north, west, up [m/s]"],
    ["turbulence", "none|light|moderate|severe", "strength of the turbulence"],
    [
        "gust",
        "X Y Z [RISE [HOLD]]",
        "gust with this peak [m/s], towards north, west, up; rises for RISE (1 s), stays for HOLD (2 s)",
    ],
    ["push", "X Y Z [SECONDS]", "force on the vehicle towards north, west, up [N]"],
    ["payload", "KG [BELOW]", "mass of the payload, BELOW metres below the centre of mass; 0 drops it"],
    [
        "change",
        "QUANTITY FACTOR [SECONDS]",
        "multiplies a quantity: mass, inertia, thrust-factor, drag-factor, roll-moment, ...",
    ],
    [
        "fault",
        "INSTRUMENT FAILURE [NUMBERS] [SECONDS]",
        "failure of an instrument: gnss lost, imu dead, tracker frozen 3, gnss jumped 5 0 0, ...",
    ],
    ["rotor", "NUMBER SHARE", "remaining share of a rotor's thrust; 1 repairs the rotor"],
    ["battery", "SHARE", "charge of the battery, 0 to 1"],
    [
        "hold",
        "SIDE [DEG_S]|none",
        "holds the vehicle by hand with this side down: down, up, left, right, front, back; turns it about the \
         vertical",
    ],
    ["law", "NAME", "changes the control law, also in flight: afbc (the firmware's), backstepping, pid, ..."],
    ["clear", "", "ends all faults, and restores the scenario's weather and load"],
    ["status", "", "prints each vehicle's position and its faults"],
    ["speed", "FACTOR", "speed of time relative to real time; 0: as fast as possible"],
    ["pause", "", "time stands still"],
    ["resume", "", "lets time go on"],
    ["step", "MILLISECONDS", "lets this much time pass, if started with --lockstep"],
    ["help", "", "lists the commands"],
    ["quit", "", "ends the program"],
    [
        "at",
        "SECONDS COMMAND",
        "runs a command at this time of the vehicles' clock; `vehicle N COMMAND` is for one vehicle",
    ],
];

/// Accepted range of times \[s\].
const AT: Range = Range::new("at", 0.0, 1e6);
const SECONDS: Range = Range::new("seconds", 0.0, 1e6);
/// Accepted range of the speed factor.
const SPEED: Range = Range::new("speed", 0.0, 1000.0);
/// Accepted factors on a parameter, and on a moment.
const FACTOR: Range = Range::new("factor", 0.01, 100.0);
const MOMENT_FACTOR: Range = Range::new("factor", -10.0, 10.0);
/// Accepted turn rate of a held vehicle about the vertical, positive to the left \[deg/s\].
const TURN: Range = Range::new("turn", -180.0, 180.0);
/// Largest duration of one `step` command, an hour \[ms\].
const STEP_MAX: u32 = 3_600_000;
/// Default rise and hold time of a gust \[s\].
const RISE_S: f64 = 1.0;
const HOLD_S: f64 = 2.0;

const QUANTITIES: [(&str, PlantParameter); 7] = [
    ("mass", PlantParameter::Mass),
    ("inertia", PlantParameter::Inertia),
    ("thrust-factor", PlantParameter::ThrustFactor),
    ("drag-factor", PlantParameter::DragFactor),
    ("roll-moment", PlantParameter::RollMoment),
    ("pitch-moment", PlantParameter::PitchMoment),
    ("yaw-moment", PlantParameter::YawMoment),
];

const TURBULENCE: [(&str, Option<Turbulence>); 4] = [
    ("none", None),
    ("light", Some(Turbulence::LIGHT)),
    ("moderate", Some(Turbulence::MODERATE)),
    ("severe", Some(Turbulence::SEVERE)),
];

/// Parses a line; returns `None` for an empty line or a comment.
///
/// # Errors
/// Fails with one line that says what is wrong with the text.
pub fn parse(text: &str) -> Result<Option<ScheduledLine>, String> {
    let text = text.split('#').next().unwrap_or_default();
    let mut words = CommandWords { command: "", rest: text.split_whitespace() };
    let (mut at_s, mut vehicle) = (None, None);
    loop {
        let Some(word) = words.rest.next() else {
            return if at_s.is_none() && vehicle.is_none() { Ok(None) } else { Err("a command is missing".into()) };
        };
        words.command = word;
        match word {
            "at" if at_s.is_some() => return Err("at: a second time".into()),
            "vehicle" if vehicle.is_some() => return Err("vehicle: a second one".into()),
            "at" => at_s = Some(words.number(&AT)?),
            "vehicle" => vehicle = Some(words.whole("a system id", u8::MAX.into())? as u8),
            _ => {
                let command = command(word, &mut words)?;
                words.finish()?;
                return Ok(Some(ScheduledLine { at_s, vehicle, command }));
            }
        }
    }
}

fn command(word: &str, words: &mut CommandWords<'_>) -> Result<ServerCommand, String> {
    Ok(match word {
        "status" => ServerCommand::Status,
        "help" => ServerCommand::Help,
        "quit" => ServerCommand::Quit,
        "step" => ServerCommand::Step(words.whole("milliseconds", STEP_MAX)?),
        "speed" => ServerCommand::Speed(words.number(&SPEED)?),
        "pause" => ServerCommand::Pause(true),
        "resume" => ServerCommand::Pause(false),
        "law" => ServerCommand::Law(law(words)?),
        _ => ServerCommand::WorldChange(change(word, words)?),
    })
}

fn change(word: &str, words: &mut CommandWords<'_>) -> Result<WorldChange, String> {
    Ok(match word {
        "wind" => WorldChange::Wind(words.vector(&Wind::STEADY.range)?),
        "turbulence" => WorldChange::Turbulence(words.choice(&TURBULENCE)?),
        "gust" => WorldChange::Gust {
            velocity_m_s: words.vector(&gust::GUST)?,
            rise_s: words.optional(&gust::RISE)?.unwrap_or(RISE_S),
            hold_s: words.optional(&Range { max: SECONDS.max, ..gust::HOLD })?.unwrap_or(HOLD_S),
        },
        "push" => WorldChange::Push {
            force_n: words.vector(&Range { name: "push", ..GUST_SIZE })?,
            seconds: words.optional(&SECONDS)?,
        },
        "payload" => WorldChange::Payload {
            mass_kg: words.number(&PAYLOAD_MASS)?,
            below_m: words.optional(&PAYLOAD_BELOW)?.unwrap_or(0.0),
        },
        "change" => {
            let quantity = words.choice(&QUANTITIES)?;
            let is_moment = matches!(
                quantity,
                PlantParameter::RollMoment | PlantParameter::PitchMoment | PlantParameter::YawMoment
            );
            let factor = words.number(if is_moment { &MOMENT_FACTOR } else { &FACTOR })?;
            WorldChange::Change { quantity, factor, seconds: words.optional(&SECONDS)? }
        }
        "fault" => WorldChange::Fault { failure: fault(words)?, seconds: words.optional(&SECONDS)? },
        "rotor" => WorldChange::Rotor {
            rotor: words.whole("the number of a rotor", rotor::ROTOR.max as u32)? as u8,
            efficiency: words.number(&rotor::EFFICIENCY)?,
        },
        "battery" => WorldChange::Battery(words.number(&BatteryModel::CHARGE.range)?),
        "hold" => WorldChange::Hold(grip(words)?),
        "clear" => WorldChange::Clear,
        _ => {
            let cure = match nearest(word, COMMANDS.iter().map(|[name, ..]| *name)) {
                Some(known) => format!("did you mean {known}?"),
                None => "help lists the commands".into(),
            };
            return Err(format!("{}: no such command; {cure}", shown(word)));
        }
    })
}

/// Parses the name of a control law.
fn law(words: &mut CommandWords<'_>) -> Result<ControllerKind, String> {
    let name = words.word(&format!("one of {}", ControllerKind::names()))?;
    ControllerKind::named(name)
        .ok_or_else(|| format!("law: {}: no such law; {}", shown(name), ControllerKind::cure(name)))
}

/// Parses how a hand holds the vehicle, such as `left 60`.
fn grip(words: &mut CommandWords<'_>) -> Result<Grip, String> {
    let sides = SIDES.map(|(name, level_rad)| (name, Some(level_rad)));
    let options: Vec<_> = sides.into_iter().chain([("none", None)]).collect();
    let Some(level_rad) = words.choice(&options)? else { return Ok(Grip::Down) };
    let turn_rad_s = words.optional(&TURN)?.unwrap_or(0.0).to_radians();
    Ok(Grip::Held { level_rad, turn_rad_s })
}

/// Parses how an instrument fails, such as `gnss jumped 5 0 0`.
fn fault(words: &mut CommandWords<'_>) -> Result<FailureKind, String> {
    let instrument = words.word("an instrument, as in: fault gnss lost")?;
    let of = |failure: &&FailureKind| failure.name().split_once('-').is_some_and(|(of, _)| of == instrument);
    let known: Vec<FailureKind> = FailureKind::ALL.iter().filter(of).copied().collect();
    if known.is_empty() {
        let wanted = "write imu, tracker, gnss, barometer or magnetometer";
        return Err(format!("fault: {} is no instrument; {wanted}", shown(instrument)));
    }
    let kind = |failure: FailureKind| failure.name().split_once('-').map_or("", |(_, kind)| kind);
    let kinds = known.iter().map(|failure| kind(*failure)).collect::<Vec<_>>().join(", ");
    let how = words.word(&format!("a failure of the {instrument}: {kinds}"))?;
    let Some(failure) = known.iter().find(|failure| kind(**failure) == how) else {
        return Err(format!("fault {instrument}: {} is none of {kinds}", shown(how)));
    };
    Ok(match failure {
        FailureKind::ImuNoisy { .. } => FailureKind::ImuNoisy {
            rates_rad_s: words.number(&failure::RATES)?,
            specific_force_m_s2: words.number(&failure::FORCE)?,
        },
        FailureKind::ImuClipped { .. } => FailureKind::ImuClipped {
            rates_rad_s: words.number(&failure::RATES)?,
            specific_force_m_s2: words.number(&failure::FORCE)?,
        },
        FailureKind::ImuBiased { .. } => FailureKind::ImuBiased {
            rates_bias_rad_s: words.vector(&failure::RATES_BIAS)?,
            force_bias_m_s2: words.vector(&failure::FORCE_BIAS)?,
        },
        FailureKind::TrackerJumped { .. } => {
            FailureKind::TrackerJumped { by_m: words.vector(&failure::JUMP)?, yaw_rad: words.number(&failure::YAW)? }
        }
        FailureKind::GnssJumped { .. } => FailureKind::GnssJumped { by_m: words.vector(&failure::JUMP)? },
        FailureKind::GnssMultipath { .. } => FailureKind::GnssMultipath {
            deviation_m: words.number(&failure::DEVIATION)?,
            correlation_time_s: words.number(&failure::CORRELATION)?,
        },
        FailureKind::MagnetometerDisturbed { .. } => {
            FailureKind::MagnetometerDisturbed { field_ut: words.vector(&failure::FIELD)? }
        }
        plain => *plain,
    })
}

/// The name of a command, and the words after it.
struct CommandWords<'a> {
    command: &'a str,
    rest: SplitWhitespace<'a>,
}

impl<'a> CommandWords<'a> {
    fn word(&mut self, wanted: &str) -> Result<&'a str, String> {
        self.rest.next().ok_or_else(|| format!("{}: it needs {wanted}", self.usage()))
    }

    fn number(&mut self, range: &Range) -> Result<f64, String> {
        match self.optional(range)? {
            Some(number) => Ok(number),
            None => Err(format!("{}: {} is missing", self.usage(), range.name)),
        }
    }

    fn optional(&mut self, range: &Range) -> Result<Option<f64>, String> {
        let Some(word) = self.rest.next() else { return Ok(None) };
        let number = word.parse().map_err(|_| format!("{}: {} is no number", self.usage(), shown(word)))?;
        range.check(number).map_err(|error| format!("{}: {}", self.command, out_of_range(&error)))?;
        Ok(Some(number))
    }

    fn vector(&mut self, range: &Range) -> Result<Vector3<f64>, String> {
        let mut next = || match self.optional(range)? {
            Some(number) => Ok(number),
            None => Err(format!("{}: three numbers are needed", self.usage())),
        };
        Ok(Vector3::new(next()?, next()?, next()?))
    }

    fn whole(&mut self, wanted: &str, max: u32) -> Result<u32, String> {
        let word = self.word(wanted)?;
        let number = word.parse().ok().filter(|number| (1..=max).contains(number));
        number.ok_or_else(|| format!("{}: {} is not {wanted}, 1 to {max}", self.command, shown(word)))
    }

    fn choice<T: Copy>(&mut self, options: &[(&'static str, T)]) -> Result<T, String> {
        let names: Vec<&str> = options.iter().map(|(name, _)| *name).collect();
        let wanted = format!("one of {}", names.join(", "));
        let word = self.word(&wanted)?;
        let found = options.iter().find(|(name, _)| *name == word);
        found.map(|(_, option)| *option).ok_or_else(|| format!("{}: {} is not {wanted}", self.command, shown(word)))
    }

    fn finish(&mut self) -> Result<(), String> {
        match self.rest.next() {
            Some(word) => Err(format!("{}: {} is too much", self.usage(), shown(word))),
            None => Ok(()),
        }
    }

    /// Returns the command's syntax.
    fn usage(&self) -> String {
        let known = COMMANDS.iter().find(|[name, ..]| *name == self.command);
        known.map_or(self.command.into(), |[name, arguments, _]| format!("{name} {arguments}").trim_end().into())
    }
}

/// Returns a word for an error message: shortened, with control characters escaped.
fn shown(word: &str) -> String {
    const LONGEST: usize = 40;
    let start: String = word.chars().take(LONGEST).flat_map(char::escape_default).collect();
    if word.chars().count() > LONGEST { format!("\"{start}...\"") } else { format!("\"{start}\"") }
}
