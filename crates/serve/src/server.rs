//! Several vehicles, and commands for them.

use crate::ParameterFile;
use crate::command::{COMMANDS, Line, ServerCommand, WorldChange, parse};
use crate::systems::listed;
use crate::vehicle::ServedVehicle;
use afbc_hil::{LogFile, UlogFiles};
use afbc_scenario::Scenario;
use afbc_types::OutOfRange;

/// Longest line \[bytes\], and most lines to come.
pub(crate) const LINE_MAX: usize = 512;
const AGENDA_MAX: usize = 1000;

/// The vehicles, on one clock, which begins when they are powered up.
pub struct Server {
    vehicles: Vec<ServedVehicle>,
    /// Milliseconds since the start.
    now_ms: u64,
    /// Lines to come, in the order of their times, then of their arrival.
    agenda: Vec<(u64, Line, String)>,
}

/// Answer to a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reply {
    /// Lines; the last one begins with `ok` or `error`. None for an empty line.
    pub lines: Vec<String>,
    /// What is left to do by whoever runs the server.
    pub then: Then,
}

/// What is left to do by whoever runs the server.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Then {
    /// Nothing.
    #[default]
    Nothing,
    /// So many steps, and then the answer.
    Step(u32),
    /// To run at this speed.
    Speed(f64),
    /// To let time stand still, or go on.
    Pause(bool),
    /// To end.
    Quit,
}

impl Server {
    /// Powers up a vehicle for each of `scenarios`, with system ids counted up from `first`, unless parameters say
    /// others.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn new(scenarios: &[Scenario], first: u8) -> Result<Self, OutOfRange> {
        let vehicles =
            scenarios.iter().zip(first..).map(|(scenario, system)| ServedVehicle::new(scenario, system, None));
        Ok(Server { vehicles: vehicles.collect::<Result<_, _>>()?, now_ms: 0, agenda: Vec::new() })
    }

    /// As [`new`](Self::new), with a store for the parameters of each vehicle.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn kept(scenarios: &[Scenario], first: u8, keepers: Vec<ParameterFile>) -> Result<Self, OutOfRange> {
        let vehicles = scenarios.iter().zip(first..).zip(keepers);
        let vehicles = vehicles.map(|((scenario, system), keeper)| ServedVehicle::new(scenario, system, Some(keeper)));
        Ok(Server { vehicles: vehicles.collect::<Result<_, _>>()?, now_ms: 0, agenda: Vec::new() })
    }

    /// Keeps the exact log of each vehicle in one of `files`, in order, from now on, before the first step. No step
    /// waits for a disk.
    pub fn record(&mut self, files: Vec<LogFile>) {
        self.vehicles.iter_mut().zip(files).for_each(|(vehicle, file)| vehicle.record(file.live()));
    }

    /// Keeps the black box of each vehicle in one of `logs`, likewise.
    pub fn log(&mut self, logs: Vec<UlogFiles>) {
        self.vehicles.iter_mut().zip(logs).for_each(|(vehicle, files)| vehicle.log(files.live()));
    }

    /// Ends the black boxes; returns a line on each that has ended early and was not reported.
    pub fn end_logs(&mut self) -> Vec<String> {
        self.vehicles.iter_mut().filter_map(ServedVehicle::close_log).collect()
    }

    /// Returns the time since the start \[s\].
    pub fn now_s(&self) -> f64 {
        self.now_ms as f64 / 1e3
    }

    /// Returns the vehicles' system ids.
    pub fn systems(&self) -> Vec<u8> {
        self.vehicles.iter().map(ServedVehicle::system).collect()
    }

    /// Returns a system id that several vehicles have: no station can distinguish them.
    pub fn ambiguous(&self) -> Option<u8> {
        let mut systems = self.systems();
        systems.sort_unstable();
        systems.windows(2).find_map(|pair| (pair.first() == pair.last()).then(|| pair.first().copied())?)
    }

    /// Returns the vehicles.
    pub fn vehicles(&self) -> &[ServedVehicle] {
        &self.vehicles
    }

    /// Sets whether those that connect from now on count as holding the vehicles: they may set the key of signatures.
    pub fn set_wired(&mut self, wired: bool) {
        self.vehicles.iter_mut().for_each(|vehicle| vehicle.set_wired(wired));
    }

    /// Receives, for the next step, what `peer` of the vehicle at this place has sent; returns whether that completes a
    /// frame that counts ([`ServedVehicle::hear`]).
    pub fn hear(&mut self, vehicle: usize, peer: u32, bytes: &[u8]) -> bool {
        self.vehicles.get_mut(vehicle).is_some_and(|it| it.hear(peer, bytes))
    }

    /// Forgets what is left of a peer that is gone.
    pub fn forget(&mut self, vehicle: usize, peer: u32) {
        self.vehicles.get_mut(vehicle).into_iter().for_each(|it| it.forget(peer));
    }

    /// Runs a millisecond. Passes to `send` what each vehicle has sent, whole frames, by its place, and to `log` what
    /// is worth a line, one each.
    pub fn step(&mut self, mut send: impl FnMut(usize, &[u8]), mut log: impl FnMut(&str)) -> Then {
        let then = self.turn_to_agenda(&mut log);
        let (now_s, mut changed) = (self.now_s(), false);
        for (place, vehicle) in self.vehicles.iter_mut().enumerate() {
            let system = vehicle.system();
            let bytes = vehicle.step(|text| log(&format!("{now_s:.3} vehicle {system}: {text}")));
            send(place, &bytes);
            changed |= vehicle.system() != system;
        }
        if changed && let Some(system) = self.ambiguous() {
            log(&format!("{now_s:.3} several vehicles have the system id {system}: set MAV_SYS_ID of one of them"));
        }
        self.now_ms += 1;
        then
    }

    /// Carries out what is due.
    fn turn_to_agenda(&mut self, log: &mut impl FnMut(&str)) -> Then {
        let mut then = Then::Nothing;
        let due = self.agenda.partition_point(|(at_ms, ..)| *at_ms <= self.now_ms);
        for (_, line, text) in self.agenda.drain(..due).collect::<Vec<_>>() {
            let reply = self.carry_out(&line, &text);
            let now_s = self.now_s();
            reply.lines.iter().for_each(|text| log(&format!("{now_s:.3} {text}")));
            if reply.then != Then::Nothing {
                then = reply.then;
            }
        }
        then
    }

    /// Takes a line of the [text protocol](crate::command); returns its answer.
    pub fn line(&mut self, text: &str) -> Reply {
        if text.len() > LINE_MAX {
            return Reply::refused(&format!("a line has at most {LINE_MAX} characters"));
        }
        let line = match parse(text) {
            Ok(None) => return Reply::default(),
            Ok(Some(line)) => line,
            Err(problem) => return Reply::refused(&problem),
        };
        if let Some(refused) = self.refused(&line) {
            return Reply::refused(&refused);
        }
        let Some(at_s) = line.at_s else { return self.carry_out(&line, text.trim()) };
        let at_ms = (at_s * 1e3).round() as u64;
        let place = self.agenda.partition_point(|(earlier_ms, ..)| *earlier_ms <= at_ms);
        self.agenda.insert(place, (at_ms, line, text.trim().into()));
        Reply::accepted(text.trim())
    }

    /// Returns why a line cannot be carried out at any time, if so.
    fn refused(&self, line: &Line) -> Option<String> {
        let known = |system: u8| self.vehicles.iter().any(|vehicle| vehicle.system() == system);
        match line {
            Line { vehicle: Some(system), .. } if !known(*system) => {
                Some(format!("there is no vehicle {system}; they are {}", listed(&self.systems())))
            }
            Line { at_s: Some(_), command: ServerCommand::Step(_), .. } => Some("step cannot be put off".into()),
            Line { at_s: Some(_), .. } if self.agenda.len() >= AGENDA_MAX => {
                Some(format!("{AGENDA_MAX} lines wait for their time already; send this one later"))
            }
            Line { at_s: Some(at_s), .. } if *at_s < self.now_s() => {
                Some(format!("{at_s} s are over; it is {:.3} s", self.now_s()))
            }
            _ => None,
        }
    }

    fn carry_out(&mut self, line: &Line, text: &str) -> Reply {
        match &line.command {
            ServerCommand::WorldChange(change) => match self.apply(line.vehicle, change) {
                Ok(()) => Reply::accepted(text),
                Err(problem) => Reply::refused(&problem),
            },
            ServerCommand::Status => {
                let wanted = |vehicle: &&ServedVehicle| line.vehicle.is_none_or(|system| vehicle.system() == system);
                let lines = self.vehicles.iter().filter(wanted).map(ServedVehicle::status);
                Reply::with(lines.collect(), &format!("{text}, {:.3} s", self.now_s()))
            }
            ServerCommand::Help => {
                let lines = COMMANDS
                    .iter()
                    .map(|[name, arguments, meaning]| format!("{:<46} {meaning}", format!("{name} {arguments}")));
                Reply::with(lines.collect(), text)
            }
            ServerCommand::Step(steps) => Reply { then: Then::Step(*steps), ..Reply::accepted(text) },
            ServerCommand::Speed(speed) => Reply { then: Then::Speed(*speed), ..Reply::accepted(text) },
            ServerCommand::Pause(stands) => Reply { then: Then::Pause(*stands), ..Reply::accepted(text) },
            ServerCommand::Law(kind) => {
                match self.wanted(line.vehicle).try_for_each(|vehicle| vehicle.change_law(*kind)) {
                    Ok(()) => Reply::accepted(text),
                    Err(problem) => Reply::refused(&problem),
                }
            }
            ServerCommand::Quit => Reply { then: Then::Quit, ..Reply::accepted(text) },
        }
    }

    /// Changes weather or faults of one vehicle or all.
    fn apply(&mut self, system: Option<u8>, change: &WorldChange) -> Result<(), String> {
        self.wanted(system).try_for_each(|vehicle| vehicle.apply(change))
    }

    /// Returns the vehicle of this system id, or all.
    fn wanted(&mut self, system: Option<u8>) -> impl Iterator<Item = &mut ServedVehicle> {
        self.vehicles.iter_mut().filter(move |vehicle| system.is_none_or(|it| vehicle.system() == it))
    }
}

impl Reply {
    fn accepted(what: &str) -> Self {
        Self::with(Vec::new(), what)
    }

    fn with(mut lines: Vec<String>, what: &str) -> Self {
        lines.push(format!("ok {what}"));
        Reply { lines, then: Then::Nothing }
    }

    fn refused(problem: &str) -> Self {
        Reply { lines: vec![format!("error {problem}")], then: Then::Nothing }
    }
}
