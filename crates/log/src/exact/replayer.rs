//! Replays the exact log: flies the recorded ticks again.

use crate::exact::record::{Given, Record, StartRecord};
use afbc_control::Trace;
use afbc_estimator::VelocityNotch;
use afbc_onboard::parameters::{ParameterTable, Reason};
use afbc_onboard::{AnyFlight, Configuration, ControlInputs, Prepare, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::OutOfRange;
use heapless::{Deque, Vec};

/// Largest number of configurations that wait to be flown, and of inputs that wait for their tick.
const WAITING: usize = 16;
/// Largest number of parameters that the caller may change.
const CHANGES_MAX: usize = 64;

/// Flies the ticks of a log again, under the firmware's law or the law of `P`.
pub struct Replayer<P: Prepare = ()> {
    prepare: P,
    image: Configuration,
    table: ParameterTable,
    /// Parameters that the caller changed from the log's values.
    changes: Vec<(RecordName, f32), CHANGES_MAX>,
    /// Start record whose parameters are still being read.
    start: Option<StartRecord>,
    flight: AnyFlight<P>,
    inputs: ControlInputs,
    taken: ControlInputs,
    /// Configurations by number that are recorded but not flown yet.
    waiting: Deque<(u16, Configuration), WAITING>,
    /// Inputs with the number of the tick that took them.
    coming: Deque<(u32, ControlInputs), WAITING>,
    /// True from a valid start record to the first gap. `next` is the number of the next tick.
    began: bool,
    next: u32,
}

/// Result of replaying one record.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one at a time")]
pub enum ReplayStep {
    /// The record is no tick, or a tick that cannot be flown because no valid start or a gap precedes it.
    Nothing,
    /// The tick has the same outputs as in the log.
    Same(Report),
    /// The outputs differ from the log's, or the tick cannot be flown.
    Differs(ReplayDifference, Option<Report>),
}

/// The way in which a replay differs from the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayDifference {
    /// The log's vehicle has another number of rotors or parameters.
    Start(StartRecord),
    /// This software rejects a parameter's name or value, or the vehicle that the parameters describe.
    Parameter,
    /// The parameters read do not match the start record: the vehicle is another one, or records are lost.
    Parameters(StartRecord),
    /// The log lacks ticks, beginning with this number.
    Missing(u32),
    /// The log lacks the configuration that this tick was the first to fly.
    Configuration(u32),
    /// The outputs of a tick differ.
    Given {
        /// Number of the tick.
        number: u32,
        /// Outputs in the log.
        then: Given,
        /// Outputs of the replay.
        now: Given,
    },
}

impl Replayer {
    /// Creates a replayer for the firmware's law. A log records its parameters as differences from the image's
    /// configuration.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(image: Configuration) -> Result<Self, OutOfRange> {
        Self::under((), image)
    }
}

impl<P: Prepare> Replayer<P> {
    /// Creates a replayer for the law of `prepare`.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn under(prepare: P, image: Configuration) -> Result<Self, OutOfRange> {
        let flight = AnyFlight::new(&prepare, &image)?;
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

    /// Sets a parameter from the next start on, whatever the log says. The outputs will then differ from the log's.
    ///
    /// # Errors
    /// The reason: the parameter is unknown, the value is out of range, or there are too many changes.
    pub fn change(&mut self, name: RecordName, value: f32) -> Result<(), Reason> {
        self.table.clone().put(name, value)?;
        self.changes.push((name, value)).map_err(|_| Reason::on(name, "too many changes"))
    }

    /// Returns the law's internal signals in the last tick.
    pub fn trace(&self) -> Trace {
        self.flight.trace()
    }

    /// Returns the log's parameters, without the caller's changes.
    pub fn parameters(&self) -> &ParameterTable {
        &self.table
    }

    /// Returns the configuration with the caller's changes.
    fn configuration(&self) -> Configuration {
        if self.changes.is_empty() {
            return self.table.configuration().clone();
        }
        let mut table = self.table.clone();
        for (name, value) in &self.changes {
            // The table accepted each change when it was checked alone.
            let _ = table.put(*name, *value);
        }
        table.configuration().clone()
    }

    /// Takes the next record of the log. If the record is a tick, flies the tick again.
    pub fn take(&mut self, record: &Record) -> ReplayStep {
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
                // The inputs always fit, because the oldest ones have been removed.
                let _ = self.coming.push_back((*tick, inputs.clone()));
                ReplayStep::Nothing
            }
            Record::Tick(tick, given) => self.tick(tick, *given),
        }
    }

    fn start(&mut self, start: &StartRecord) -> Result<(), ReplayDifference> {
        self.table = ParameterTable::new(self.image.clone());
        let is_mine = usize::from(start.rotors) == self.image.rotors.count() && start.parameters == self.table.count();
        (self.inputs, self.taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
        self.waiting.clear();
        self.coming.clear();
        // The flight itself begins with the first tick, because the start's parameters are still to come.
        (self.start, self.began, self.next) = (Some(start.clone()), is_mine, 0);
        if is_mine { Ok(()) } else { Err(ReplayDifference::Start(start.clone())) }
    }

    /// Stores a configuration until a tick flies it. The start's configuration is flown by the first tick in any case.
    fn configured(&mut self, number: u16, known: bool) -> ReplayStep {
        if self.waiting.is_full() {
            self.waiting.pop_front();
        }
        let _ = self.waiting.push_back((number, self.configuration()));
        if known { ReplayStep::Nothing } else { ReplayStep::Differs(ReplayDifference::Parameter, None) }
    }

    fn tick(&mut self, tick: &TickInputs, then: Given) -> ReplayStep {
        if !self.began {
            return ReplayStep::Nothing;
        }
        // A tick depends on all ticks before it. After a gap, nothing can be flown until the next start.
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
            match AnyFlight::new(&self.prepare, &self.configuration()) {
                Ok(flight) => self.flight = flight,
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
        // The battery comes with every tick, not from messages, and replaces the last one even if it is none.
        self.taken.battery = tick.battery;
        if tick.clock_failed {
            self.flight.distrust_clock();
        }
        // As in flight, the notch moves before another configuration is adopted.
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

    /// Flies the configuration of this number from now on. Removes older ones: they were replaced before they were
    /// flown.
    fn adopt(&mut self, number: u16) -> bool {
        while let Some((waiting, configuration)) = self.waiting.pop_front() {
            if waiting == number {
                let adopted = self.flight.adopt(&self.prepare, &configuration);
                // With the caller's changes the vehicle may be armed where it was disarmed in flight, so `adopt` may
                // refuse.
                return adopted.is_ok_and(|adopted| adopted || !self.changes.is_empty());
            }
        }
        false
    }
}
