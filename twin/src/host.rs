//! Flies a scenario with the firmware's code in this process, for comparison with the image, and to see the effect of a
//! change within a second. The GNSS receiver is the board's model, which sends NMEA; the other readings are passed on
//! directly.

use crate::pilot::GroundPilot;
use crate::wire::UartWire;
use crate::world::at_the_place;
use afbc_drivers::nmea::NmeaDecoder;
use afbc_drivers::ublox::DELAY_US;
use afbc_estimator::Measurement;
use afbc_hil::Host;
use afbc_onboard::sensors::FixFrame;
use afbc_onboard::{Aged, Readings};
use afbc_scenario::load;
use rigless::chip::nmea::Receiver;
use rigless::chip::uart::Peer;
use rigless::machine::flight::Signals;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

/// Flies a scenario, with a mission if `is_mission` is set.
pub fn fly(file: &Path, is_mission: bool) -> Result<(), Box<dyn Error>> {
    let wire = UartWire::default();
    let pilot = GroundPilot::new(&load(file)?, wire.clone())?;
    let mut pilot = if is_mission { pilot.with_mission() } else { pilot };
    let (mut host, mut gnss) = (Host::new()?, SimulatedGnss::new());
    let (mut now_ms, mut bytes) = (0, Vec::new());
    while let Some((mut readings, signals)) = pilot.advance(now_ms) {
        gnss.replace(&mut readings, &signals, now_ms);
        host.sense(&readings);
        let tick = host.next_tick(&wire.exchange(&bytes));
        bytes = tick.bytes;
        pilot.command(tick.report.throttles.map(Some));
        now_ms += 1;
    }
    pilot.verdict()
}

/// GNSS receiver, its UART at 38,400 baud, and its driver.
struct SimulatedGnss {
    receiver: Receiver,
    decoder: NmeaDecoder,
    frame: FixFrame,
    /// Times of the epoch's first byte and of the newest byte \[ms\].
    began_ms: u64,
    last_ms: u64,
}

impl SimulatedGnss {
    fn new() -> Self {
        let (receiver, decoder) = (Receiver::new(), NmeaDecoder::new());
        SimulatedGnss { receiver, decoder, frame: FixFrame::NEW, began_ms: 0, last_ms: 0 }
    }

    /// Replaces the instruments' fix by the fix that the receiver completes in this millisecond, if any.
    fn replace(&mut self, readings: &mut Readings, signals: &Signals, now_ms: u64) {
        self.receiver.set_position(signals.position);
        self.receiver.set_velocity(signals.velocity);
        let mut aids: Vec<_> = readings.aids.into_iter().flatten().collect();
        aids.retain(|aid| !matches!(aid.value, Measurement::Gnss { .. }));
        // 38,400 baud are four bytes per millisecond. Nothing is sent before the first position.
        for _ in 0..if signals.position == at_the_place().position { 0 } else { 4 } {
            let Some(byte) = self.receiver.transmit(VirtualNanos(now_ms * 1_000_000)) else { break };
            // The bytes of an epoch follow each other without a pause, so a pause marks the start of the next epoch.
            if now_ms - self.last_ms > 20 {
                self.began_ms = now_ms;
            }
            self.last_ms = now_ms;
            let fix = self.decoder.take(byte as u8).flatten();
            if let Some((value, _)) = fix.and_then(|fix| self.frame.measure(&fix)) {
                aids.push(Aged { value, age_us: ((now_ms - self.began_ms) * 1000 + DELAY_US) as u32 });
            }
        }
        readings.aids = std::array::from_fn(|index| aids.get(index).copied());
    }
}
