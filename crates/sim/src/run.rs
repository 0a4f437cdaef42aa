//! One flight with its log and metrics.

use crate::flight::{Lost, Sample, fly_until};
use crate::metrics::{Accumulator, Metrics, inputs};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_types::OutOfRange;
use core::ops::ControlFlow;
use nalgebra::Vector4;

/// Steps between two calls of `is_over`: they take milliseconds.
pub const LOOK_STEPS: u64 = 1024;

/// A flight of a scenario under one contender.
#[derive(Clone, Debug)]
pub struct FlightResult {
    /// Contender that flew.
    pub contender: Contender,
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// When and why AFBC's monitor switched to the fallback law, if it did.
    pub tripped: Option<MonitorTrip>,
    /// Figures of merit, evaluated over every step.
    pub metrics: Metrics,
    /// Samples of every `log_every`-th step and of the last step.
    pub log: Vec<Sample>,
    /// Lowest and highest U1..U4 \[N\] since the previous log row, for each row: chatter is faster than the log.
    pub input_extremes: Vec<[Vector4<f64>; 2]>,
}

/// A trip of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorTrip {
    /// Time \[s\].
    pub time_s: f64,
    /// Reason in words.
    pub reason: &'static str,
}

impl FlightResult {
    /// Returns true if the flight reached the time from which errors are evaluated.
    pub fn is_settled(&self) -> bool {
        self.metrics.settled
    }

    /// Flies `scenario` under `contender`, logging every `log_every`-th step (at least 1).
    ///
    /// # Errors
    /// Returns the first parameter, gain or setting that is out of range; nothing is flown then.
    pub fn fly(scenario: &Scenario, contender: &Contender, log_every: u64) -> Result<Self, OutOfRange> {
        FlightResult::fly_unless(scenario, contender, log_every, || false)
    }

    /// Flies like [`FlightResult::fly`], but ends early once `is_over` returns true. It is called every [`LOOK_STEPS`].
    ///
    /// # Errors
    /// The same as for [`FlightResult::fly`].
    pub fn fly_unless(
        scenario: &Scenario,
        contender: &Contender,
        log_every: u64,
        is_over: impl Fn() -> bool,
    ) -> Result<Self, OutOfRange> {
        let log_every = log_every.max(1);
        let mut metrics = Accumulator::default();
        let (mut log, mut input_extremes) = (Vec::new(), Vec::new());
        let mut unlogged: Option<(Sample, [Vector4<f64>; 2])> = None;
        let (mut step, mut tripped) = (0, None);
        let lost = fly_until(scenario, contender, |sample| {
            metrics.add(sample);
            if let Some(reason) = sample.action.health.fallback {
                tripped.get_or_insert(MonitorTrip { time_s: sample.time_s, reason });
            }
            let u = inputs(sample);
            let extremes = match unlogged.take() {
                Some((_, [low, high])) => [u.inf(&low), u.sup(&high)],
                None => [u, u],
            };
            if step % log_every == 0 {
                log.push(*sample);
                input_extremes.push(extremes);
            } else {
                unlogged = Some((*sample, extremes));
            }
            step += 1;
            if step % LOOK_STEPS == 0 && is_over() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        if let Some((last, extremes)) = unlogged {
            log.push(last);
            input_extremes.push(extremes);
        }
        Ok(FlightResult { contender: contender.clone(), lost, tripped, metrics: metrics.finish(), log, input_extremes })
    }
}
