//! Reading at a part's data-ready interrupt, or by the board's clock if no interrupt comes. A broken interrupt wire
//! thus costs only a little delay.

use crate::driver::PartTiming;
use embassy_futures::select::{Either, select};

/// Pin of a data-ready interrupt.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait DataReadyPin {
    /// Waits for the next edge and returns its time since power-up \[us\]. Only edges after the call count. The future
    /// may be dropped.
    async fn next(&mut self) -> u64;
}

impl<E: DataReadyPin> DataReadyPin for &mut E {
    async fn next(&mut self) -> u64 {
        (**self).next().await
    }
}

/// Timing of a part whose interrupt is wired.
///
/// A part that measures at the wanted rate is read at each edge. A faster part is read once per period of the board's
/// clock, at the first edge in the period, so that there is exactly one reading per period. A reading has the time of
/// its edge.
///
/// If no edge comes within two periods, the part is read at the beginning of each period, without an interrupt time,
/// until there is an edge again. An edge within a quarter of a sample time after the last edge is noise and is ignored.
#[derive(Debug)]
pub struct DataReady<E, C> {
    edge: E,
    clock: C,
    /// Period of the board's clock \[us\].
    period_us: u32,
    /// True if the last wait ended with a valid edge.
    is_wired: bool,
    /// Time of the edge found by the last wait.
    edge_us: Option<u64>,
    /// Time of the last edge, valid or not.
    last_us: Option<u64>,
}

impl<E: DataReadyPin, C: PartTiming> DataReady<E, C> {
    /// Creates the timing of a part with this pin. The board's `clock` is ready at the beginning of every period of
    /// `period_us`.
    pub fn new(edge: E, clock: C, period_us: u32) -> Self {
        DataReady { edge, clock, period_us, is_wired: false, edge_us: None, last_us: None }
    }

    /// True if the last wait ended with a valid edge.
    pub fn is_wired(&self) -> bool {
        self.is_wired
    }

    /// Waits for an edge, at most until this number of periods has begun.
    async fn edge(&mut self, us: u32, periods: u32) -> Option<u64> {
        let DataReady { edge, clock, .. } = self;
        let end = async {
            for _ in 0..periods {
                clock.ready(us).await;
            }
        };
        match select(edge.next(), end).await {
            Either::First(at_us) => Some(at_us),
            Either::Second(()) => None,
        }
    }
}

impl<E: DataReadyPin, C: PartTiming> PartTiming for DataReady<E, C> {
    fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    async fn wait(&self, us: u32) {
        self.clock.wait(us).await;
    }

    /// Waits as described at [`DataReady`]; `us` is twice the sample time.
    async fn ready(&mut self, us: u32) -> bool {
        let is_faster = us < self.period_us.saturating_mul(2);
        self.edge_us = None;
        if is_faster && self.is_wired {
            self.clock.ready(us).await;
        }
        // The wait lasts two periods in all. For a faster part, one of them is over already. Without edges, the clock
        // alone decides.
        let periods = if self.is_wired && !is_faster { 2 } else { 1 };
        let edge_us = self.edge(us, periods).await;
        let sample_us = u64::from(us / 2);
        let is_noise =
            |edge_us: u64| self.last_us.is_some_and(|last_us| edge_us < last_us.saturating_add(sample_us / 4));
        match edge_us {
            Some(edge_us) if is_noise(edge_us) => {
                // Waits for the clock, so that noise on the wire cannot cause readings without limit.
                self.clock.ready(us).await;
                self.is_wired = false;
            }
            Some(_) => (self.is_wired, self.edge_us) = (true, edge_us),
            None => self.is_wired = false,
        }
        self.last_us = edge_us.or(self.last_us);
        true
    }

    fn ready_us(&self) -> Option<u64> {
        self.edge_us
    }
}
