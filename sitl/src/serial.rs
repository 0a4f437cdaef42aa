//! Board connected to a serial port.

use afbc_hil::{Autopilot, Error, Station};
use afbc_mavlink::VehicleCommand;
use serialport::SerialPort;
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// Duration of one exchange.
const PERIOD: Duration = Duration::from_millis(1);
/// Longest wait between two reads.
const NAP: Duration = Duration::from_micros(200);
/// Longest time for the port to accept what is written.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);
/// Number of kill commands sent at the end, since a frame may get lost.
const KILL_REPEATS: usize = 3;

/// Board on a serial port, in real time. Dropping it stops the motors.
pub(crate) struct SerialBoard {
    port: Box<dyn SerialPort>,
    /// End of the current millisecond.
    deadline: Option<Instant>,
    late_max: Duration,
}

impl SerialBoard {
    /// Opens the port `device` at `baud`, 8N1.
    ///
    /// # Errors
    /// If the port cannot be opened, with a message for the user.
    pub(crate) fn open(device: &str, baud: u32) -> Result<Self, String> {
        Ok(SerialBoard::new(serialport::new(device, baud).timeout(WRITE_TIMEOUT).open().map_err(no_port)?))
    }

    /// Uses a port that is already open.
    pub(crate) fn new(port: Box<dyn SerialPort>) -> Self {
        SerialBoard { port, deadline: None, late_max: Duration::ZERO }
    }

    /// Returns the largest delay of this program behind real time, by which states were late.
    pub(crate) fn late_max(&self) -> Duration {
        self.late_max
    }

    /// Passes received bytes to `hear` until `deadline`.
    fn listen(&mut self, deadline: Instant, hear: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        let mut buffer = [0; 4096];
        loop {
            // The port is read only if bytes are waiting. Otherwise the read would block for the port's timeout, far
            // longer than a millisecond.
            if self.port.bytes_to_read()? > 0 {
                let length = self.port.read(&mut buffer)?;
                hear(buffer.get(..length).unwrap_or_default());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            thread::sleep(left.min(NAP));
        }
    }
}

impl Autopilot for SerialBoard {
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        let deadline = *self.deadline.get_or_insert_with(Instant::now);
        self.listen(deadline, hear).map_err(failed)?;
        self.late_max = self.late_max.max(deadline.elapsed());
        // The period counts from the former deadline, so that delays are made up for.
        self.deadline = Some(deadline + PERIOD);
        self.port.write_all(uplink).map_err(failed)
    }
}

impl Drop for SerialBoard {
    fn drop(&mut self) {
        let mut station = Station::new();
        // The motors are stopped by a kill, since a vehicle refuses to disarm in the air.
        (0..KILL_REPEATS).for_each(|_| station.command(VehicleCommand::Kill));
        // A failure can no longer be reported. A vehicle without states descends by itself.
        let _ = self.port.write_all(&station.take());
        let _ = self.port.flush();
    }
}

/// Returns the names of all serial ports.
///
/// # Errors
/// If the ports cannot be listed, with a message for the user.
pub(crate) fn ports() -> Result<Vec<String>, String> {
    let ports = serialport::available_ports().map_err(no_port)?;
    Ok(ports.into_iter().map(|port| port.port_name).collect())
}

fn no_port(error: serialport::Error) -> String {
    format!("the serial port cannot be opened ({error}); `sitl hitl --list` shows the ports")
}

fn failed(error: io::Error) -> Error {
    Error::Autopilot(format!("the serial port failed ({error}); check the cable").into())
}

/// Tests over a pseudo-terminal. The board at its other end ticks once per exchange of [`SerialBoard`], so a busy
/// machine slows both ends alike and changes no result.
#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use afbc_hil::{Host, LoopEnd, MessagePeriods, fly};
    use afbc_scenario::{Scenario, built_in};
    use core::ops::ControlFlow;
    use serialport::TTYPort;
    use std::io::{Read, Write};

    fn scenario(name: &str, duration_s: f64) -> Scenario {
        Scenario { duration_s, ..built_in(name).unwrap().read().unwrap() }
    }

    /// Firmware's code on the host, behind a serial port.
    struct Board {
        host: Host,
        port: TTYPort,
        /// Keeps the pseudo-terminal open. When the last handle of a side closes, unread bytes would be lost, unlike
        /// on a wire.
        _wire: TTYPort,
        armed: bool,
    }

    /// Port, and the board that ticks after each exchange.
    struct Wired<'a> {
        serial: SerialBoard,
        board: &'a mut Board,
    }

    impl Board {
        /// Creates the board, and the port connected to it.
        fn new() -> (Self, SerialBoard) {
            let (here, there) = TTYPort::pair().unwrap();
            let wire = there.try_clone_native().unwrap();
            let board = Board { host: Host::new().unwrap(), port: here, _wire: wire, armed: false };
            (board, SerialBoard::new(Box::new(there)))
        }

        fn tick(&mut self) {
            let mut buffer = [0; 4096];
            let length = if self.port.bytes_to_read().unwrap() > 0 { self.port.read(&mut buffer).unwrap() } else { 0 };
            let tick = self.host.next_tick(buffer.get(..length).unwrap());
            self.armed = tick.report.mode.armed();
            self.port.write_all(&tick.bytes).unwrap();
        }
    }

    impl Autopilot for Wired<'_> {
        fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
            self.serial.exchange(uplink, hear)?;
            self.board.tick();
            Ok(())
        }
    }

    #[test]
    fn a_flight_over_a_serial_port() {
        let (mut board, serial) = Board::new();
        let mut wired = Wired { serial, board: &mut board };
        let (mut station, mut furthest_m) = (Station::new(), 0.0_f64);
        let scenario = scenario("hover", 2.0);
        let start = std::time::Instant::now();
        let end = fly(&scenario, &mut station, &mut wired, MessagePeriods::at(921_600).unwrap(), |sample| {
            furthest_m = furthest_m.max((sample.motion.position_m - sample.reference.position_m).norm());
            ControlFlow::Continue(())
        });
        assert_eq!(end.unwrap(), LoopEnd { lost: None, interrupted: false, disarmed: true });
        assert!(start.elapsed() > Duration::from_secs(3), "in real time: a second to arm, two to fly");
        let start_m = (scenario.initial.position_m - scenario.trajectory.at(0.0).position_m).norm();
        assert!(furthest_m < start_m + 0.1, "{furthest_m} m away, {start_m} m at the start");

        let (here, there) = (station.counters(), station.heard().health.unwrap().link);
        for counters in [here, &there] {
            assert_eq!((counters.bad_checksum, counters.skipped_bytes, counters.lost), (0, 0, 0));
        }
        assert!(there.received > 750, "a state every 4 ms: {}", there.received);
        assert!(station.heard().rotor_commands > 750, "each of them is answered");
        assert!(station.round_trip_ms().count() > 20 && station.unanswered() < 3, "{:?}", station.round_trip_ms());
    }

    #[test]
    fn a_port_that_is_dropped_disarms() {
        let (mut board, serial) = Board::new();
        let mut wired = Wired { serial, board: &mut board };
        let flight = std::panic::AssertUnwindSafe(|| {
            let mut steps = 0;
            fly(&scenario("hover", 2.0), &mut Station::new(), &mut wired, MessagePeriods::at(921_600).unwrap(), |_| {
                steps += 1;
                assert!(steps < 200, "on purpose: a bug in flight");
                ControlFlow::Continue(())
            })
        });
        assert!(std::panic::catch_unwind(flight).is_err());
        let Wired { serial, board } = wired;
        assert!(board.armed);
        drop(serial);
        // The board ticks once per read of the bytes left on the wire. That is far less than the 2250 ticks after
        // which it would disarm by itself.
        let start = std::time::Instant::now();
        let mut ticks = 0;
        while board.armed && ticks < 200 {
            assert!(start.elapsed() < Duration::from_secs(60), "nothing more comes");
            if board.port.bytes_to_read().unwrap() > 0 {
                board.tick();
                ticks += 1;
            } else {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        assert!(!board.armed);
    }
}
