//! The reading side: the flight again.

use crate::exact::record::{Given, Record, StartRecord};
use afbc_control::Trace;
use afbc_estimator::VelocityNotch;
use afbc_onboard::parameters::{ParameterTable, Reason};
use afbc_onboard::{Configuration, ControlInputs, Flight, Prepare, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::OutOfRange;
use heapless::{Deque, Vec};

/// Configurations that may wait to be flown, and inputs that may wait for their tick.
const WAITING: usize = 16;
/// Parameters that may be changed.
const CHANGES_MAX: usize = 64;

/// Runs the ticks of a log, under the firmware's law or that of `P`.
#[derive(Debug)]
pub struct Replayer<const N: usize, P: Prepare<N> = ()> {
    prepare: P,
    image: Configuration<N>,
    table: ParameterTable<N>,
    /// Parameters that are not as in the log.
    changes: Vec<(RecordName, f32), CHANGES_MAX>,
    /// The start whose parameters are being read.
    start: Option<StartRecord>,
    flight: Flight<N, P::Law>,
    inputs: ControlInputs,
    taken: ControlInputs,
    /// Configurations that were made and not flown yet.
    waiting: Deque<(u16, Configuration<N>), WAITING>,
    /// Inputs with the number of the tick that took them.
    coming: Deque<(u32, ControlInputs), WAITING>,
    /// True from a start on; number of the next tick.
    began: bool,
    next: u32,
}

/// What became of a record.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum ReplayStep<const N: usize> {
    /// It is no tick, or one before the start.
    Nothing,
    /// The tick gives the same again.
    Same(Report<N>),
    /// It gives something else, or cannot be run.
    Differs(ReplayDifference, Option<Report<N>>),
}

/// What differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayDifference {
    /// The log is of a vehicle with other rotors or parameters.
    Start(StartRecord),
    /// A parameter has a name, a value, or makes a vehicle that this software does not know.
    Parameter,
    /// The parameters of the start are not those of the log: it is another vehicle, or some of them are lost.
    Parameters(StartRecord),
    /// The log lacks the ticks from this number on.
    Missing(u32),
    /// The log lacks the configuration that the tick of this number was the first to fly.
    Configuration(u32),
    /// The tick of this number gave this, and gives this again.
    Given {
        /// Number of the tick.
        number: u32,
        /// What it gave.
        then: Given,
        /// What it gives again.
        now: Given,
    },
}

impl<const N: usize> Replayer<N> {
    /// Begins with the image's configuration: a log starts with what differs from it.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(image: Configuration<N>) -> Result<Self, OutOfRange> {
        Self::under((), image)
    }
}

impl<const N: usize, P: Prepare<N>> Replayer<N, P> {
    /// The same under the law of `prepare`.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn under(prepare: P, image: Configuration<N>) -> Result<Self, OutOfRange> {
        let flight = Flight::of(prepare.prepare(&image)?);
        Ok(Replayer {
            table: ParameterTable::new(image.clone()),
            prepare,
            image,
            changes: Vec::new(),
            start: None,
            flight,
            inputs: ControlInputs::EMPTY,
            taken: ControlInputs::EMPTY,
            waiting: Deque::new(),
            coming: Deque::new(),
            began: false,
            next: 0,
        })
    }

    /// Flies with this parameter from the next start on, whatever the log says of it: what it commands then is not what
    /// the log says, of course.
    ///
    /// # Errors
    /// The reason: no such parameter, a value out of its range, or too many changes.
    pub fn change(&mut self, name: RecordName, value: f32) -> Result<(), Reason> {
        self.table.clone().put(name, value)?;
        self.changes.push((name, value)).map_err(|_| Reason::on(name, "too many changes"))
    }

    /// Returns the law's internal signals of the last tick.
    pub fn trace(&self) -> Trace {
        self.flight.trace()
    }

    /// Returns the parameters as the log has them.
    pub fn parameters(&self) -> &ParameterTable<N> {
        &self.table
    }

    /// Returns the configuration that is flown with the changes.
    fn configuration(&self) -> Configuration<N> {
        if self.changes.is_empty() {
            return self.table.configuration().clone();
        }
        let mut table = self.table.clone();
        for (name, value) in &self.changes {
            // Each has been checked alone.
            let _ = table.put(*name, *value);
        }
        table.configuration().clone()
    }

    /// Takes the next record of the log; a tick is run again.
    pub fn take(&mut self, record: &Record) -> ReplayStep<N> {
        match record {
            Record::Start(start) => match self.start(start) {
                Ok(()) => ReplayStep::Nothing,
                Err(difference) => ReplayStep::Differs(difference, None),
            },
            Record::Parameter { configuration, name, value } => {
                let known = self.table.put(*name, *value).is_ok();
                self.configured(*configuration, known)
            }
            Record::Restored { configuration } => {
                self.table.restore();
                self.configured(*configuration, true)
            }
            Record::Inputs { tick, inputs } => {
                if self.coming.is_full() {
                    self.coming.pop_front();
                }
                // There is room: the oldest has given way.
                let _ = self.coming.push_back((*tick, inputs.clone()));
                ReplayStep::Nothing
            }
            Record::Tick(tick, given) => self.tick(tick, *given),
        }
    }

    fn start(&mut self, start: &StartRecord) -> Result<(), ReplayDifference> {
        self.table = ParameterTable::new(self.image.clone());
        let is_mine = usize::from(start.rotors) == N && start.parameters == self.table.count();
        (self.inputs, self.taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
        self.waiting.clear();
        self.coming.clear();
        // The flight itself begins with the first tick: the parameters of this start are still to come.
        (self.start, self.began, self.next) = (Some(start.clone()), is_mine, 0);
        if is_mine { Ok(()) } else { Err(ReplayDifference::Start(start.clone())) }
    }

    /// Notes a configuration, until a tick flies it; that of the start is flown at once, whatever waits.
    fn configured(&mut self, number: u16, known: bool) -> ReplayStep<N> {
        if self.waiting.is_full() {
            self.waiting.pop_front();
        }
        let _ = self.waiting.push_back((number, self.configuration()));
        if known { ReplayStep::Nothing } else { ReplayStep::Differs(ReplayDifference::Parameter, None) }
    }

    fn tick(&mut self, tick: &TickInputs, then: Given) -> ReplayStep<N> {
        if !self.began {
            return ReplayStep::Nothing;
        }
        // A tick needs all before it: what follows a gap cannot be run, up to the next start.
        if tick.number != self.next {
            self.began = false;
            return ReplayStep::Differs(ReplayDifference::Missing(self.next), None);
        }
        self.next = self.next.wrapping_add(1);
        if let Some(start) = self.start.take() {
            if StartRecord::of(&start.vehicle, &start.law, &self.table) != start {
                self.began = false;
                return ReplayStep::Differs(ReplayDifference::Parameters(start), None);
            }
            match self.prepare.prepare(&self.configuration()) {
                Ok(prepared) => self.flight = Flight::of(prepared),
                Err(_) => {
                    self.began = false;
                    return ReplayStep::Differs(ReplayDifference::Parameter, None);
                }
            }
        }
        while let Some((_, inputs)) = self.coming.front().filter(|(number, _)| *number <= tick.number) {
            self.inputs.merge(inputs);
            self.coming.pop_front();
        }
        self.inputs.take_into(&mut self.taken);
        // Not from messages, and not only what is new.
        self.taken.battery = tick.battery;
        if tick.clock_failed {
            self.flight.distrust_clock();
        }
        // Before what follows from another configuration, as it was.
        if let Some(notch) = tick.notch_rad_s.and_then(VelocityNotch::at) {
            self.flight.move_notch(&notch);
        }
        if let Some(number) = tick.adopted
            && !self.adopt(number)
        {
            self.began = false;
            return ReplayStep::Differs(ReplayDifference::Configuration(tick.number), None);
        }
        let report = self.flight.tick(tick.time_us, &mut self.taken, &tick.readings);
        let (number, now) = (tick.number, Given::of(&report));
        if then == now {
            ReplayStep::Same(report)
        } else {
            ReplayStep::Differs(ReplayDifference::Given { number, then, now }, Some(report))
        }
    }

    /// Flies the configuration of this number from now on; those before it were replaced before they were flown.
    fn adopt(&mut self, number: u16) -> bool {
        while let Some((waiting, configuration)) = self.waiting.pop_front() {
            if waiting == number {
                let prepared = self.prepare.prepare(&configuration);
                // With changes it may be armed where it was not.
                return prepared.is_ok_and(|prepared| self.flight.adopt(&prepared) || !self.changes.is_empty());
            }
        }
        false
    }
}
