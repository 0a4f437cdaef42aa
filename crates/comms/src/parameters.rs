//! MAVLink's parameter protocol for the [parameters](afbc_onboard::parameters) of a running vehicle.
//! [`Comms::parameters`](crate::Comms::parameters) uses it.

use afbc_mavlink::{ParameterError, ParameterName, ParameterRequest, ParameterValue};
use afbc_onboard::parameters::{Parameter, ParameterTable, Reason, RecordChange, decode};
use afbc_store::RecordName;
use heapless::Deque;

/// Largest size of a PARAM_VALUE frame \[bytes\].
pub const VALUE_BYTES: u32 = 37;
/// Share of the link that answers to lists and reads may take \[%\].
pub const LINK_SHARE: u32 = 40;
/// Number of values that may be sent at once after a pause.
const BURST: u64 = 4;
/// Largest number of queued answers. A station asks again for values that it misses.
const WAITING_MAX: usize = 32;

/// Results of a station's message.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// Change of the table, to be flown and stored.
    pub change: Option<RecordChange>,
    /// Text to the stations that says why nothing has changed.
    pub refused: Option<Reason>,
    /// PARAM_ERROR to a station that has named a parameter that does not exist.
    pub error: Option<ParameterError>,
}

impl Heard {
    fn refused(reason: Reason) -> Self {
        Heard { refused: Some(reason), ..Heard::default() }
    }

    /// Answers that there is no such parameter.
    fn unknown(name: ParameterName, place: i16) -> Self {
        let error = ParameterError { name, index: place, error: ParameterError::DOES_NOT_EXIST };
        Heard { error: Some(error), ..Heard::default() }
    }
}

/// Answers the stations' requests about the parameters of a [`ParameterTable`].
#[derive(Clone, Debug, Default)]
pub struct Service {
    /// Parameters whose PARAM_SET is to be answered. Each answer has the value at the time of sending.
    set: Deque<RecordName, WAITING_MAX>,
    /// Places of the parameters to be read.
    read: Deque<u16, WAITING_MAX>,
    /// Next place of the list, and the number of places left.
    next: u16,
    left: u16,
    /// Time of the last call of `next_value`, and the bytes that may be sent \[1e-8 bytes\].
    at_us: u64,
    budget: u64,
    dropped: u32,
}

impl Service {
    /// Handles a station's message. The table is changed only while `disarmed`.
    pub fn hear(&mut self, ask: ParameterRequest, table: &mut ParameterTable, disarmed: bool) -> Heard {
        match ask {
            // A list in progress continues to its end and then restarts, so that every station gets all of it.
            ParameterRequest::List => self.left = table.count(),
            ParameterRequest::ReadIndex(place) if table.at(place).is_some() => {
                self.dropped += count(self.read.push_back(place))
            }
            // A place has 15 bits on the wire.
            ParameterRequest::ReadIndex(place) => return Heard::unknown([0; 16], place as i16),
            ParameterRequest::ReadName(name) => match named(name).and_then(|name| table.get(name)) {
                Some(parameter) => self.dropped += count(self.read.push_back(parameter.place)),
                None => return Heard::unknown(name, -1),
            },
            ParameterRequest::Set { name, value, kind } => {
                return self.set(name, decode(kind, value), table, disarmed);
            }
        }
        Heard::default()
    }

    /// Resets all parameters (MAV_CMD_PREFLIGHT_STORAGE with `param1` = 2) and lists them again.
    ///
    /// # Errors
    /// Returns the reason if the vehicle is armed.
    pub fn restore(&mut self, table: &mut ParameterTable, disarmed: bool) -> Result<RecordChange, Reason> {
        if !disarmed {
            return Err(Reason::new("parameters", "not while armed"));
        }
        table.restore();
        self.left = table.count();
        Ok(RecordChange::Restored)
    }

    /// Returns the next value to be sent at `now_us` over a link of `link_bytes_s` bytes per second. Call it until it
    /// returns none. Answers to PARAM_SET are sent at once; all others use at most [`LINK_SHARE`] of the link.
    pub fn next_value(&mut self, now_us: u64, link_bytes_s: u32, table: &ParameterTable) -> Option<ParameterValue> {
        const COST: u64 = VALUE_BYTES as u64 * 100_000_000;
        // One second fills the budget, and the limit prevents an overflow of the product below.
        let elapsed_us = now_us.saturating_sub(self.at_us).min(1_000_000);
        self.at_us = now_us;
        let earned = elapsed_us * u64::from(link_bytes_s) * u64::from(LINK_SHARE);
        self.budget = self.budget.saturating_add(earned).min(BURST * COST);
        if let Some(name) = self.set.pop_front() {
            self.budget = self.budget.saturating_sub(COST);
            return table.get(name).map(|parameter| value_message(&parameter, table.count()));
        }
        let rest = self.budget.checked_sub(COST)?;
        let place = self.read.pop_front().or_else(|| {
            self.left = self.left.checked_sub(1)?;
            let place = self.next;
            self.next = if place + 1 < table.count() { place + 1 } else { 0 };
            Some(place)
        })?;
        self.budget = rest;
        table.at(place).map(|parameter| value_message(&parameter, table.count()))
    }

    /// Returns the number of messages that were not answered because the queues were full.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    fn set(&mut self, asked: ParameterName, value: Option<f32>, table: &mut ParameterTable, disarmed: bool) -> Heard {
        let name = named(asked);
        let Some(before) = name.and_then(|name| table.get(name)) else {
            let reason = match name {
                Some(name) => Reason::on(name, "no such parameter"),
                None => Reason::new("parameters", "no such name"),
            };
            return Heard { refused: Some(reason), ..Heard::unknown(asked, -1) };
        };
        let name = before.name;
        // The answer is queued in any case, with the value that counts when it is sent.
        self.dropped += count(self.set.push_back(name));
        let Some(value) = value else { return Heard::refused(Reason::on(name, "value has the wrong type")) };
        if !disarmed {
            let is_news = before.value != value;
            return if is_news { Heard::refused(Reason::on(name, "not while armed")) } else { Heard::default() };
        }
        // An unchanged value is set too, in case it was never stored: a store writes a value only when it is set.
        match table.set(name, value) {
            Ok(Parameter { value, .. }) => {
                let is_default = table.default_of(name).is_some_and(|image| image.value.to_bits() == value.to_bits());
                Heard { change: Some(RecordChange::Set(name, (!is_default).then_some(value))), ..Heard::default() }
            }
            Err(reason) => Heard::refused(reason),
        }
    }
}

fn count<T>(pushed: Result<(), T>) -> u32 {
    u32::from(pushed.is_err())
}

fn named(bytes: ParameterName) -> Option<RecordName> {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    RecordName::new(str::from_utf8(bytes.get(..end)?).ok()?)
}

fn value_message(parameter: &Parameter, count: u16) -> ParameterValue {
    let Parameter { name, place, kind, value, .. } = *parameter;
    ParameterValue { name: name.to_bytes(), value: kind.encode(value), kind: kind.number(), count, index: place }
}
