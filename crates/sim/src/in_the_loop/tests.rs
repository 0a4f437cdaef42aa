//! The loop around the host's autopilot, in lockstep and over a pseudo-terminal.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, reason = "tests")]

use super::*;
use crate::contender::Law;
use crate::metrics::{Accumulator, Metrics};
use crate::run::Run;
use crate::scenario::{Scenario, built_in};
use core::ops::ControlFlow;

fn scenario(name: &str, duration_s: f64) -> Scenario {
    Scenario { duration_s, ..built_in(name).unwrap().scenario().unwrap() }
}

fn fly_host(scenario: &Scenario) -> (End, Metrics) {
    let (mut station, mut host, mut metrics) = (Station::new(), Host::new().unwrap(), Accumulator::default());
    let end = fly(scenario, &mut station, &mut host, Pace::LOCKSTEP, |sample| {
        metrics.add(sample);
        ControlFlow::Continue(())
    });
    (end.unwrap(), metrics.finish())
}

#[test]
fn the_link_in_between_changes_nothing_that_matters() {
    let scenario = scenario("paper", 60.0);
    let (end, looped) = fly_host(&scenario);
    assert_eq!(end, End { lost: None, interrupted: false, disarmed: true });
    let plain = Run::fly(&scenario, &firmware(), u64::MAX).unwrap().metrics;
    // The wire rounds the attitude to a quaternion of f32, and has no yaw acceleration.
    assert!((looped.rmse - plain.rmse).amax() < 1e-3, "{} {}", looped.rmse, plain.rmse);
    assert!((looped.max_abs - plain.max_abs).amax() < 5e-3, "{} {}", looped.max_abs, plain.max_abs);
}

#[test]
fn a_flight_is_the_same_every_time() {
    let scenario = scenario("paper", 8.0);
    assert_eq!(fly_host(&scenario), fly_host(&scenario));
}

#[test]
fn what_the_firmware_does_not_hold_is_refused() {
    let mut heavier = scenario("hover", 1.0);
    heavier.vehicle.mass_kg *= 2.0;
    let mut livelier = scenario("hover", 1.0);
    if let Law::Afbc(gains) = &mut livelier.contenders[0].law {
        gains.z.gamma *= 2.0;
    }
    let mut slower = scenario("hover", 1.0);
    slower.contenders[0].settings.command_filter_rad_s = 20.0;
    let mut baseline = scenario("hover", 1.0);
    baseline.contenders.remove(0);
    for (scenario, what) in
        [(heavier, "another vehicle"), (livelier, "other gains"), (slower, "other settings"), (baseline, "another law")]
    {
        let error = check(&scenario).unwrap_err().to_string();
        assert!(error.contains(what) && !error.contains('\n'), "{error}");
    }
    assert!(check(&scenario("hover", 1.0)).is_ok());
}

#[test]
fn a_vehicle_that_does_not_arm_says_why() {
    let mut tilted = scenario("hover", 1.0);
    tilted.initial.attitude_rad.x = 0.5;
    let error =
        fly(&tilted, &mut Station::new(), &mut Host::new().unwrap(), Pace::LOCKSTEP, |_| ControlFlow::Continue(()));
    assert_eq!(error.unwrap_err().to_string(), "the vehicle did not arm: arming refused: tilt too large");
}

#[test]
fn a_dead_line_is_noticed() {
    struct Nobody;
    impl Autopilot for Nobody {
        fn exchange(&mut self, _: &[u8], _: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
            Ok(())
        }
    }
    let scenario = scenario("hover", 1.0);
    let error = fly(&scenario, &mut Station::new(), &mut Nobody, Pace::LOCKSTEP, |_| ControlFlow::Continue(()));
    assert!(matches!(error, Err(Error::Silent)));
}

#[test]
fn the_observer_can_break_off() {
    let scenario = scenario("hover", 5.0);
    let mut steps = 0;
    let end = fly(&scenario, &mut Station::new(), &mut Host::new().unwrap(), Pace::LOCKSTEP, |_| {
        steps += 1;
        if steps == 100 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(end.unwrap(), End { lost: None, interrupted: true, disarmed: true });
    assert_eq!(steps, 100);
}

/// A pseudo-terminal is a serial port without a wire. Its other end ticks once for each millisecond that [`Serial`] waits,
/// so that a busy machine slows both down and disturbs neither.
#[cfg(unix)]
mod serial {
    use super::*;
    use serialport::{SerialPort, TTYPort};
    use std::io::{Read, Write};
    use std::time::Duration;

    /// The host's autopilot behind a serial port.
    struct Board {
        host: Host,
        port: TTYPort,
        /// A pseudo-terminal ends with the last program that uses it, and what is in it is lost; a wire does not.
        _wire: TTYPort,
        armed: bool,
    }

    /// The port, and the board that ticks after each exchange over it.
    struct Wired<'a> {
        serial: Serial,
        board: &'a mut Board,
    }

    impl Board {
        /// The board, and the port that leads to it.
        fn new() -> (Self, Serial) {
            let (here, there) = TTYPort::pair().unwrap();
            let wire = there.try_clone_native().unwrap();
            let board = Board { host: Host::new().unwrap(), port: here, _wire: wire, armed: false };
            (board, Serial::new(Box::new(there)))
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
        let end = fly(&scenario, &mut station, &mut wired, Pace::at(921_600).unwrap(), |sample| {
            furthest_m = furthest_m.max((sample.motion.position_m - sample.reference.position_m).norm());
            ControlFlow::Continue(())
        });
        assert_eq!(end.unwrap(), End { lost: None, interrupted: false, disarmed: true });
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
            fly(&scenario("hover", 2.0), &mut Station::new(), &mut wired, Pace::at(921_600).unwrap(), |_| {
                steps += 1;
                assert!(steps < 200, "on purpose: a bug in flight");
                ControlFlow::Continue(())
            })
        });
        assert!(std::panic::catch_unwind(flight).is_err());
        let Wired { serial, board } = wired;
        assert!(board.armed);
        drop(serial);
        // A tick for each piece of what is left on the wire, however long that takes to come: far fewer than the 2250 after
        // which it would give up by itself.
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
