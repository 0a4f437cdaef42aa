//! The reading side: the flight again.

use crate::record::{Given, Record, StartRecord, TickRecord, VERSION};
use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{Configuration, ControlInputs, Flight, Prepared, Report};
use afbc_types::OutOfRange;
use heapless::Deque;

/// Configurations that may wait to be flown, and inputs that may wait for their tick.
const WAITING: usize = 16;

/// Runs the ticks of a log.
#[derive(Debug)]
pub struct Replayer<const N: usize> {
    image: Configuration<N>,
    table: ParameterTable<N>,
    flight: Flight<N>,
    inputs: ControlInputs,
    taken: ControlInputs,
    /// Configurations that were made and not flown yet.
    waiting: Deque<(u16, Configuration<N>), WAITING>,
    /// Inputs with the number of the tick that took them.
    coming: Deque<(u32, ControlInputs), WAITING>,
    /// True if the parameters are those of the start, and the flight is not made of them yet.
    starts: bool,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayDifference {
    /// The log is of another version of this software, or of a vehicle with other rotors or parameters.
    Start(StartRecord),
    /// A parameter has a name, a value, or makes a vehicle that this software does not know.
    Parameter,
    /// The log lacks the ticks from this number on, or the configuration that one of them flew.
    Missing(u32),
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
        let flight = Flight::new(&image)?;
        Ok(Replayer {
            table: ParameterTable::new(image.clone()),
            image,
            flight,
            inputs: ControlInputs::EMPTY,
            taken: ControlInputs::EMPTY,
            waiting: Deque::new(),
            coming: Deque::new(),
            starts: false,
            began: false,
            next: 0,
        })
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
                let _ = self.coming.push_back((*tick, inputs.clone()));
                ReplayStep::Nothing
            }
            Record::Tick(tick) => self.tick(tick),
        }
    }

    fn start(&mut self, start: &StartRecord) -> Result<(), ReplayDifference> {
        self.table = ParameterTable::new(self.image.clone());
        let is_mine =
            start.version == VERSION && usize::from(start.rotors) == N && start.parameters == self.table.count();
        (self.inputs, self.taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
        self.waiting.clear();
        self.coming.clear();
        (self.starts, self.began, self.next) = (true, is_mine, 0);
        if is_mine { Ok(()) } else { Err(ReplayDifference::Start(*start)) }
    }

    /// Notes a configuration; that of the start is flown at once.
    fn configured(&mut self, number: u16, known: bool) -> ReplayStep<N> {
        if number > 0 {
            if self.waiting.is_full() {
                self.waiting.pop_front();
            }
            let _ = self.waiting.push_back((number, self.table.configuration().clone()));
        }
        if known { ReplayStep::Nothing } else { ReplayStep::Differs(ReplayDifference::Parameter, None) }
    }

    fn tick(&mut self, tick: &TickRecord) -> ReplayStep<N> {
        if !self.began {
            return ReplayStep::Nothing;
        }
        if tick.number != self.next {
            self.began = false;
            return ReplayStep::Differs(ReplayDifference::Missing(self.next), None);
        }
        self.next = self.next.wrapping_add(1);
        if core::mem::take(&mut self.starts) {
            match Flight::new(self.table.configuration()) {
                Ok(flight) => self.flight = flight,
                Err(_) => return ReplayStep::Differs(ReplayDifference::Parameter, None),
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
        if let Some(number) = tick.adopted
            && !self.adopt(number)
        {
            return ReplayStep::Differs(ReplayDifference::Missing(tick.number), None);
        }
        let report = self.flight.tick(tick.time_us, &mut self.taken, &tick.readings);
        let (number, then, now) = (tick.number, tick.given, Given::of(&report));
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
                return Prepared::new(&configuration).is_ok_and(|prepared| self.flight.adopt(&prepared));
            }
        }
        false
    }
}
