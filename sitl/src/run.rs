//! One flight with everything that is reported of it.

use crate::flight::{Lost, Sample, fly};
use crate::metrics::{Accumulator, Metrics};
use crate::scenario::{ControllerKind, Scenario};
use airframe::OutOfRange;

/// A flown scenario under one law.
#[derive(Clone, Debug)]
pub struct Run {
    /// The law that flew.
    pub controller: ControllerKind,
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// Figures of merit over every step.
    pub metrics: Metrics,
    /// Every `log_every`-th step, and the last one.
    pub log: Vec<Sample>,
}

impl Run {
    /// Flies `scenario` under `controller`, keeping every `log_every`-th step (at least 1).
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range; nothing has been flown then.
    pub fn fly(scenario: &Scenario, controller: ControllerKind, log_every: u64) -> Result<Self, OutOfRange> {
        let mut metrics = Accumulator::default();
        let mut log = Vec::new();
        let mut last = None;
        let mut step = 0;
        let lost = fly(scenario, controller, |sample| {
            metrics.add(sample);
            if step % log_every.max(1) == 0 {
                log.push(*sample);
                last = None;
            } else {
                last = Some(*sample);
            }
            step += 1;
        })?;
        log.extend(last);
        Ok(Run { controller, lost, metrics: metrics.finish(), log })
    }
}
