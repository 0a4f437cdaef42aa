//! Several vehicles on a common clock, and text commands for them.

use crate::ParameterFile;
use crate::command::{COMMANDS, ScheduledLine, ServerCommand, WorldChange, parse};
use crate::systems::listed;
use crate::vehicle::ServedVehicle;
use afbc_hil::{LogFile, UlogFiles};
use afbc_scenario::Scenario;
use afbc_types::OutOfRange;

/// Longest line \[bytes\], and most lines that wait for their time.
pub(crate) const LINE_MAX: usize = 512;
const AGENDA_MAX: usize = 1000;

/// Several vehicles on one clock, which starts at their power-up.
pub struct Server {
    vehicles: Vec<ServedVehicle>,
    /// Milliseconds since the start.
    now_ms: u64,
    /// Lines that wait for their time, sorted by time, then by arrival.
    agenda: Vec<(u64, ScheduledLine, String)>,
}

/// Answer to a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineReply {
    /// Lines of the answer. The last line begins with `ok` or `error`. An empty line has an empty answer.
    pub lines: Vec<String>,
    /// Action that the server's caller must carry out.
    pub action: ServerAction,
}

/// Action that the server's caller must carry out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ServerAction {
    /// Nothing.
    #[default]
    Nothing,
    /// Run this many steps, then send the answer.
    Step(u32),
    /// Run at this multiple of real time.
    Speed(f64),
    /// Pause (true) or resume (false).
    Pause(bool),
    /// End the run.
    Quit,
}

impl Server {
    /// Powers up a vehicle for each scenario. System ids count up from `first`, unless a vehicle's parameters set
    /// another.
    ///
    /// # Errors
    /// Fails with the first setting out of range.
    pub fn new(scenarios: &[Scenario], first: u8) -> Result<Self, OutOfRange> {
        let vehicles =
            scenarios.iter().zip(first..).map(|(scenario, system)| ServedVehicle::new(scenario, system, None));
        Ok(Server { vehicles: vehicles.collect::<Result<_, _>>()?, now_ms: 0, agenda: Vec::new() })
    }

    /// As [`new`](Self::new), with a store for each vehicle's parameters.
    ///
    /// # Errors
    /// Fails with the first setting out of range.
    pub fn with_parameter_files(
        scenarios: &[Scenario],
        first: u8,
        parameter_files: Vec<ParameterFile>,
    ) -> Result<Self, OutOfRange> {
        let vehicles = scenarios.iter().zip(first..).zip(parameter_files);
        let vehicles = vehicles
            .map(|((scenario, system), parameter_file)| ServedVehicle::new(scenario, system, Some(parameter_file)));
        Ok(Server { vehicles: vehicles.collect::<Result<_, _>>()?, now_ms: 0, agenda: Vec::new() })
    }

    /// Records each vehicle's exact log to one of `files`, in order. Call this before the first step. No step waits for
    /// the disk.
    pub fn record(&mut self, files: Vec<LogFile>) {
        self.vehicles.iter_mut().zip(files).for_each(|(vehicle, file)| vehicle.record(file.live()));
    }

    /// Records each vehicle's black box to one of `logs`, in order. Call this before the first step.
    pub fn log(&mut self, logs: Vec<UlogFiles>) {
        self.vehicles.iter_mut().zip(logs).for_each(|(vehicle, files)| vehicle.log(files.live()));
    }

    /// Closes the black boxes; returns one line for each that ended early, unless that was already reported.
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

    /// Returns a system id that several vehicles share; stations cannot tell these vehicles apart.
    pub fn ambiguous(&self) -> Option<u8> {
        let mut systems = self.systems();
        systems.sort_unstable();
        systems.windows(2).find_map(|pair| (pair.first() == pair.last()).then(|| pair.first().copied())?)
    }

    /// Returns the vehicles.
    pub fn vehicles(&self) -> &[ServedVehicle] {
        &self.vehicles
    }

    /// Sets whether peers that connect from now on count as wired to the vehicles: they may set the signing key.
    pub fn set_wired(&mut self, wired: bool) {
        self.vehicles.iter_mut().for_each(|vehicle| vehicle.set_wired(wired));
    }

    /// Queues bytes of `peer` for the vehicle with this index, for the next step. Returns whether they complete a valid
    /// frame; see [`ServedVehicle::hear`].
    pub fn hear(&mut self, vehicle: usize, peer: u32, bytes: &[u8]) -> bool {
        self.vehicles.get_mut(vehicle).is_some_and(|it| it.hear(peer, bytes))
    }

    /// Forgets an unfinished frame of a peer that is gone.
    pub fn forget(&mut self, vehicle: usize, peer: u32) {
        self.vehicles.get_mut(vehicle).into_iter().for_each(|it| it.forget(peer));
    }

    /// Runs one millisecond. Passes to `send` the index of each vehicle and the complete frames that it has sent, and
    /// to `log` lines about events.
    pub fn step(&mut self, mut send: impl FnMut(usize, &[u8]), mut log: impl FnMut(&str)) -> ServerAction {
        let action = self.run_agenda(&mut log);
        let (now_s, mut changed) = (self.now_s(), false);
        for (place, vehicle) in self.vehicles.iter_mut().enumerate() {
            let system = vehicle.system();
            let bytes = vehicle.step(|text| log(&format!("{now_s:.3} vehicle {system}: {text}")));
            send(place, &bytes);
            changed |= vehicle.system() != system;
        }
        if changed && let Some(system) = self.ambiguous() {
            log(&format!("{now_s:.3} several vehicles have the system id {system}: change MAV_SYS_ID of all but one"));
        }
        self.now_ms += 1;
        action
    }

    /// Carries out the lines that are due.
    fn run_agenda(&mut self, log: &mut impl FnMut(&str)) -> ServerAction {
        let mut action = ServerAction::Nothing;
        let due = self.agenda.partition_point(|(at_ms, ..)| *at_ms <= self.now_ms);
        for (_, line, text) in self.agenda.drain(..due).collect::<Vec<_>>() {
            let reply = self.carry_out(&line, &text);
            let now_s = self.now_s();
            reply.lines.iter().for_each(|text| log(&format!("{now_s:.3} {text}")));
            if reply.action != ServerAction::Nothing {
                action = reply.action;
            }
        }
        action
    }

    /// Handles a line of the [text protocol](crate::command); returns its answer.
    pub fn line(&mut self, text: &str) -> LineReply {
        if text.len() > LINE_MAX {
            return LineReply::refused(&format!("a line has at most {LINE_MAX} characters"));
        }
        let line = match parse(text) {
            Ok(None) => return LineReply::default(),
            Ok(Some(line)) => line,
            Err(problem) => return LineReply::refused(&problem),
        };
        if let Some(refused) = self.refused(&line) {
            return LineReply::refused(&refused);
        }
        let Some(at_s) = line.at_s else { return self.carry_out(&line, text.trim()) };
        let at_ms = (at_s * 1e3).round() as u64;
        let place = self.agenda.partition_point(|(earlier_ms, ..)| *earlier_ms <= at_ms);
        self.agenda.insert(place, (at_ms, line, text.trim().into()));
        LineReply::accepted(text.trim())
    }

    /// Returns why a line cannot be carried out at any time, if so.
    fn refused(&self, line: &ScheduledLine) -> Option<String> {
        let known = |system: u8| self.vehicles.iter().any(|vehicle| vehicle.system() == system);
        match line {
            ScheduledLine { vehicle: Some(system), .. } if !known(*system) => {
                Some(format!("there is no vehicle {system}; they are {}", listed(&self.systems())))
            }
            ScheduledLine { at_s: Some(_), command: ServerCommand::Step(_), .. } => {
                Some("step cannot be scheduled for later".into())
            }
            ScheduledLine { at_s: Some(_), .. } if self.agenda.len() >= AGENDA_MAX => {
                Some(format!("{AGENDA_MAX} scheduled lines are waiting already; send this line later"))
            }
            ScheduledLine { at_s: Some(at_s), .. } if *at_s < self.now_s() => {
                Some(format!("{at_s} s has passed; the time is now {:.3} s", self.now_s()))
            }
            _ => None,
        }
    }

    fn carry_out(&mut self, line: &ScheduledLine, text: &str) -> LineReply {
        match &line.command {
            ServerCommand::WorldChange(change) => match self.apply(line.vehicle, change) {
                Ok(()) => LineReply::accepted(text),
                Err(problem) => LineReply::refused(&problem),
            },
            ServerCommand::Status => {
                let wanted = |vehicle: &&ServedVehicle| line.vehicle.is_none_or(|system| vehicle.system() == system);
                let lines = self.vehicles.iter().filter(wanted).map(ServedVehicle::status);
                LineReply::with(lines.collect(), &format!("{text}, {:.3} s", self.now_s()))
            }
            ServerCommand::Help => {
                let lines = COMMANDS
                    .iter()
                    .map(|[name, arguments, meaning]| format!("{:<46} {meaning}", format!("{name} {arguments}")));
                LineReply::with(lines.collect(), text)
            }
            ServerCommand::Step(steps) => LineReply { action: ServerAction::Step(*steps), ..LineReply::accepted(text) },
            ServerCommand::Speed(speed) => {
                LineReply { action: ServerAction::Speed(*speed), ..LineReply::accepted(text) }
            }
            ServerCommand::Pause(paused) => {
                LineReply { action: ServerAction::Pause(*paused), ..LineReply::accepted(text) }
            }
            ServerCommand::Law(kind) => {
                match self.wanted(line.vehicle).try_for_each(|vehicle| vehicle.change_law(*kind)) {
                    Ok(()) => LineReply::accepted(text),
                    Err(problem) => LineReply::refused(&problem),
                }
            }
            ServerCommand::Quit => LineReply { action: ServerAction::Quit, ..LineReply::accepted(text) },
        }
    }

    /// Changes weather or faults of one vehicle or all.
    fn apply(&mut self, system: Option<u8>, change: &WorldChange) -> Result<(), String> {
        self.wanted(system).try_for_each(|vehicle| vehicle.apply(change))
    }

    /// Returns the vehicle with this system id, or all vehicles for `None`.
    fn wanted(&mut self, system: Option<u8>) -> impl Iterator<Item = &mut ServedVehicle> {
        self.vehicles.iter_mut().filter(move |vehicle| system.is_none_or(|it| vehicle.system() == it))
    }
}

impl LineReply {
    fn accepted(what: &str) -> Self {
        Self::with(Vec::new(), what)
    }

    fn with(mut lines: Vec<String>, what: &str) -> Self {
        lines.push(format!("ok {what}"));
        LineReply { lines, action: ServerAction::Nothing }
    }

    fn refused(problem: &str) -> Self {
        LineReply { lines: vec![format!("error {problem}")], action: ServerAction::Nothing }
    }
}
