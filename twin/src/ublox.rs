//! Factory-new u-blox receiver at the board's UART. It covers configuration and baud rate, which the board's own
//! receiver model does not have.

#[allow(dead_code, reason = "shared with the drivers' tests, which use all of it")]
#[path = "../../crates/drivers/tests/ublox_model/mod.rs"]
mod ublox_model;

use crate::machine::{Divider, Machine};
use afbc_estimator::Measurement;
use afbc_onboard::Readings;
use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::emulator::{AccessKind, Settled};
use rigless::machine::flight::Signals;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;
use std::sync::{Arc, Mutex};
pub(crate) use ublox_model::Generation;
use ublox_model::{Model, Truth};

/// Margin by which fixes may come earlier than the configured period, because of the instruments' jitter [us].
const JITTER_US: u64 = 50_000;

#[derive(Debug)]
struct UbloxLine {
    model: Model,
    divider: Divider,
    /// Baud rate of the board's UART.
    baud: u64,
    sent_us: u64,
}

impl UbloxLine {
    /// Returns a byte as it arrives at the other end of the line.
    fn carry(&self, byte: u8) -> u8 {
        // Baud rates within 2 % work together.
        let is_good = self.baud.abs_diff(self.model.baud.into()) * 50 <= self.baud;
        if is_good { byte } else { byte.rotate_left(3) ^ 0x5A }
    }
}

/// u-blox receiver. Clones share one receiver.
#[derive(Clone, Debug)]
pub struct UbloxPeer(Arc<Mutex<UbloxLine>>);

impl UbloxPeer {
    /// Creates a receiver at a UART with this divider.
    pub fn new(generation: Generation, divider: Divider) -> Self {
        UbloxPeer(Arc::new(Mutex::new(UbloxLine { model: Model::new(generation), divider, baud: 0, sent_us: 0 })))
    }

    fn with<T>(&self, change: impl FnOnce(&mut UbloxLine) -> T) -> T {
        change(&mut self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Observes the image's writes to the UART's divider, for the baud rate.
    pub fn watch(&self, settled: &Settled) {
        let Settled::Access { access, value } = settled else { return };
        if access.kind == AccessKind::Write {
            self.with(|line| {
                if access.address == line.divider.register {
                    line.baud = line.divider.clock_hz / (*value).max(1);
                }
            });
        }
    }

    /// Passes signals to the board, and queues a new fix in this receiver. The instruments' fixes already have their
    /// delay.
    pub fn sense(&self, board: &mut impl Machine, at: VirtualNanos, (readings, signals): (&Readings, &Signals)) {
        let now_us = at.0 / 1000;
        self.with(|line| {
            let period_us = line.model.period_us.saturating_sub(JITTER_US);
            for aid in readings.aids.iter().flatten() {
                let Measurement::Gnss { horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s, .. } = aid.value else {
                    continue;
                };
                // The instruments may have fixes more often than this receiver is configured to send.
                if now_us - line.sent_us < period_us {
                    continue;
                }
                line.sent_us = now_us;
                let position = signals.position;
                let sigmas = [horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s];
                let truth = Truth {
                    place: [position.latitude, position.longitude],
                    altitude_mm: position.altitude,
                    velocity_mm_s: signals.velocity,
                    accuracies: sigmas.map(|sigma| (sigma * 1e3).round().max(1.0) as u32),
                    ..Truth::ZURICH
                };
                line.model.report(now_us.saturating_sub(aid.age_us.into()), &truth);
            }
        });
        board.sense_with_own_receiver(signals);
        board.attach_receiver(Box::new(self.clone()));
    }

    /// True if the receiver is configured to send only solutions, at 5 Hz or more.
    pub fn is_configured(&self) -> bool {
        self.with(|line| line.model.solves && !line.model.nmea && line.model.period_us <= 200_000)
    }

    /// Returns the receiver's configuration as text.
    pub fn summary(&self) -> String {
        self.with(|line| {
            let Model { baud, period_us, solves, nmea, dynamic_model, .. } = &line.model;
            format!(
                "u-blox: {baud} baud, {} ms, NAV-PVT {solves}, NMEA {nmea}, dynamic model {dynamic_model}",
                period_us / 1000
            )
        })
    }
}

impl Store for UbloxPeer {}

impl Peer for UbloxPeer {
    fn receive(&mut self, word: u16, _: &mut Timeline<'_, '_>) {
        self.with(|line| {
            let byte = line.carry(word as u8);
            line.model.hear(byte);
        });
    }

    fn transmit(&mut self, _: VirtualNanos) -> Option<u16> {
        self.with(|line| line.model.says.pop_front().map(|byte| line.carry(byte))).map(u16::from)
    }
}
