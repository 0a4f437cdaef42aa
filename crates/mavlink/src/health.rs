//! Health of the flight core and the link: DEBUG_FLOAT_ARRAY named "health".

use crate::decoder::Counters;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX, extension, parse, put_extended};
use afbc_types::{Axis, PerAxis};
use mavlink::dialects::common::DEBUG_FLOAT_ARRAY_DATA;

/// State of the flight core and the link, in the order of the array's elements. Counts are sent as `f32`, so they are
/// exact up to 2^24.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HealthArray {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Duration of the last control tick \[us\].
    pub tick_us: f32,
    /// Longest duration of a control tick so far \[us\].
    pub tick_max_us: f32,
    /// Number of ticks in the last second \[Hz\].
    pub rate_hz: f32,
    /// Number of ticks since power-up that were late or early.
    pub late_ticks: u32,
    /// Number of ticks in which a rotor force outside its limits was commanded.
    pub saturated_ticks: u32,
    /// Age of the newest state \[us\].
    pub state_age_us: f32,
    /// Norm of Theta_hat of each subsystem.
    pub theta_norm: PerAxis<f32>,
    /// delta_hat of each subsystem.
    pub delta: PerAxis<f32>,
    /// Reception counts of the link.
    pub link: Counters,
    /// Number of commands since power-up that were neither carried out nor answered, since too many arrived at once.
    pub unanswered: u32,
    /// Number of states that were not used.
    pub states_refused: StatesRefused,
}

/// Number of states since power-up that were not used, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatesRefused {
    /// States that were out of order or duplicate.
    pub overtaken: u32,
    /// States that were too old on arrival.
    pub late: u32,
    /// States from a sender other than the sender in use.
    pub elsewhere: u32,
    /// States that repeat the last state in flight, or come from a tracker that is no longer trusted.
    pub frozen: u32,
}

/// Number of elements of DEBUG_FLOAT_ARRAY, which are its only extension field.
const ELEMENTS: usize = 58;
const NAME: &str = "health";

pub(crate) fn format() -> MessageFormat {
    MessageFormat::of::<DEBUG_FLOAT_ARRAY_DATA>(4 * ELEMENTS)
}

pub(crate) fn read(payload: &[u8]) -> Result<HealthArray, FrameFault> {
    let (data, extension): (_, [u8; 4 * ELEMENTS]) = (parse(payload)?, extension::<DEBUG_FLOAT_ARRAY_DATA, _>(payload));
    let DEBUG_FLOAT_ARRAY_DATA { time_usec: time_us, name, .. } = data;

    if name.to_str() != Ok(NAME) {
        return Err(FrameFault::Unsupported);
    }
    let (elements, _) = extension.as_chunks();
    let mut elements = elements.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let mut next = || elements.next().unwrap_or_default();
    Ok(HealthArray {
        time_us,
        tick_us: next(),
        tick_max_us: next(),
        rate_hz: next(),
        late_ticks: next() as u32,
        saturated_ticks: next() as u32,
        state_age_us: next(),
        theta_norm: PerAxis::from_fn(|_| next()),
        delta: PerAxis::from_fn(|_| next()),
        link: Counters::from_array(core::array::from_fn(|_| next() as u32)),
        unanswered: next() as u32,
        states_refused: StatesRefused {
            overtaken: next() as u32,
            late: next() as u32,
            elsewhere: next() as u32,
            frozen: next() as u32,
        },
    })
}

impl HealthArray {
    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let data = DEBUG_FLOAT_ARRAY_DATA { time_usec: self.time_us, array_id: 0, name: NAME.into() };
        put_extended(&data, self.elements().flat_map(f32::to_le_bytes), payload)
    }

    /// Returns the array's elements.
    fn elements(&self) -> impl Iterator<Item = f32> {
        let HealthArray { tick_us, tick_max_us, rate_hz, late_ticks, saturated_ticks, state_age_us, .. } = *self;
        let ticks = [tick_us, tick_max_us, rate_hz, late_ticks as f32, saturated_ticks as f32, state_age_us];
        let estimates = [self.theta_norm, self.delta].map(|estimate| Axis::ALL.map(|axis| estimate[axis]));
        let StatesRefused { overtaken, late, elsewhere, frozen } = self.states_refused;
        let counts = self.link.to_array().into_iter().chain([self.unanswered, overtaken, late, elsewhere, frozen]);
        ticks.into_iter().chain(estimates.into_iter().flatten()).chain(counts.map(|count| count as f32))
    }
}
