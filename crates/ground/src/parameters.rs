//! Download of the vehicle's parameters.

use crate::retry::{RetriedRequest, RetryAction, RetryPolicy};
use afbc_mavlink::{ParameterRequest, ParameterValue};
use std::collections::BTreeMap;

/// Time without a new parameter after which missing ones are requested \[ms\], how many times that is done, and how
/// many parameters each time requests.
const STALLED: RetryPolicy = RetryPolicy { answer_ms: 1_000, tries: 20 };
const MISSING_MAX: usize = 10;

/// The vehicle's parameters that have been received.
#[derive(Default)]
pub struct VehicleParameters {
    count: Option<u16>,
    values: BTreeMap<u16, ParameterValue>,
    download: Option<RetriedRequest>,
}

impl VehicleParameters {
    /// Returns the number of the vehicle's parameters, once the vehicle has reported it.
    pub fn count(&self) -> Option<u16> {
        self.count
    }

    /// Returns the received parameters, in the vehicle's order.
    pub fn values(&self) -> impl ExactSizeIterator<Item = &ParameterValue> {
        self.values.values()
    }

    /// Returns true once every parameter has been received.
    pub fn are_complete(&self) -> bool {
        self.count.is_some_and(|count| self.values.len() == usize::from(count))
    }

    /// Returns true while parameters are being read.
    pub fn are_being_read(&self) -> bool {
        self.download.is_some()
    }

    pub(crate) fn read(&mut self, now_ms: u64) -> ParameterRequest {
        (self.count, self.download) = (None, Some(RetriedRequest::new(STALLED, now_ms)));
        self.values.clear();
        ParameterRequest::List
    }

    pub(crate) fn hear(&mut self, value: &ParameterValue, now_ms: u64) {
        self.count = Some(value.count);
        if value.index >= value.count || self.values.insert(value.index, *value).is_some() {
            return;
        }
        if self.are_complete() {
            self.download = None;
        }
        self.download.iter_mut().for_each(|download| download.progresses(now_ms));
    }

    /// Passes to `say` the requests that are due to be repeated.
    pub(crate) fn update(&mut self, now_ms: u64, mut say: impl FnMut(ParameterRequest)) {
        match self.download.as_mut().map_or(RetryAction::Nothing, |download| download.due(now_ms)) {
            RetryAction::Nothing => (),
            RetryAction::GiveUp => self.download = None,
            RetryAction::Again => match self.count {
                // No parameter has come, so the request itself was lost.
                None => say(ParameterRequest::List),
                Some(count) => {
                    let missing = (0..count).filter(|place| !self.values.contains_key(place)).take(MISSING_MAX);
                    missing.map(ParameterRequest::ReadIndex).for_each(say);
                }
            },
        }
    }
}
