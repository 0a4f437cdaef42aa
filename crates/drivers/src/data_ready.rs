//! A part's interrupt, and the board's clock while none comes: a broken wire costs a little time, no part.

use crate::driver::PartTiming;
use embassy_futures::select::{Either, select};

/// The pin of a part's interrupt.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait Edge {
    /// Waits for the next edge, and returns its time since power-up \[us\]. Edges count from the call on; it may be
    /// given up.
    async fn next(&mut self) -> u64;
}

impl<E: Edge> Edge for &mut E {
    async fn next(&mut self) -> u64 {
        (**self).next().await
    }
}

/// The timing of a part whose interrupt is wired.
///
/// A part that measures as often as it is wanted is read at each of its edges. One that measures more often is read
/// once in a period of the board's clock, at the first edge after its beginning: so no reading is left out and none is
/// there twice. Either reading has the time of its edge.
///
/// When no edge comes within two periods, the part is read by the clock, at the beginning of each period, without a
/// time of its own, until there is an edge again. An edge that comes within a quarter of the time of a sample after the
/// last one is noise on the wire, and counts as none.
#[derive(Debug)]
pub struct DataReady<E, C> {
    edge: E,
    clock: C,
    /// Period of the clock \[us\].
    period_us: u32,
    /// True if the last wait has met an edge.
    is_wired: bool,
    /// Time of the edge for which the last wait has waited.
    edge_us: Option<u64>,
    /// Time of the last edge.
    last_us: Option<u64>,
}

impl<E: Edge, C: PartTiming> DataReady<E, C> {
    /// A part with this pin, on a board whose `clock` is ready at the beginning of every period of so many \[us\].
    pub fn new(edge: E, clock: C, period_us: u32) -> Self {
        DataReady { edge, clock, period_us, is_wired: false, edge_us: None, last_us: None }
    }

    /// True if the last wait has met an edge.
    pub fn is_wired(&self) -> bool {
        self.is_wired
    }

    /// Waits for an edge, at most until so many periods have begun.
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

impl<E: Edge, C: PartTiming> PartTiming for DataReady<E, C> {
    fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    async fn wait(&self, us: u32) {
        self.clock.wait(us).await;
    }

    /// Waits as the type says; `us` is twice the time of a sample.
    async fn ready(&mut self, us: u32) -> bool {
        let is_faster = us < self.period_us.saturating_mul(2);
        self.edge_us = None;
        if is_faster && self.is_wired {
            self.clock.ready(us).await;
        }
        // Two in all: a faster part has waited for one of them already. Without edges the clock alone counts.
        let periods = if self.is_wired && !is_faster { 2 } else { 1 };
        let edge_us = self.edge(us, periods).await;
        let sample_us = u64::from(us / 2);
        let is_noise =
            |edge_us: u64| self.last_us.is_some_and(|last_us| edge_us < last_us.saturating_add(sample_us / 4));
        match edge_us {
            Some(edge_us) if is_noise(edge_us) => {
                // Bounded, whatever the wire does.
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
