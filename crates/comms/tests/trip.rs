//! A trip of the monitor is reported once with its reason, and a command engages AFBC again.

use crate::common::{Bench, STATION};
use afbc::Trip;
use afbc_flight_core::{Mode, Request};
use afbc_mavlink::{CommandResult, Downlink, MavCmd, MavSeverity, StatusText, Uplink, VehicleCommand};
use afbc_types::{Axis, State};

fn text(reason: &str) -> Downlink {
    Downlink::Text { severity: MavSeverity::MAV_SEVERITY_WARNING, text: StatusText::from(reason) }
}

fn accepted(command: MavCmd) -> Downlink {
    Downlink::CommandAck { command: command as u16, answer: CommandResult::Accepted, to: STATION }
}

/// A vehicle that is held at a wrong attitude trips and reports it once. MAV_CMD_USER_1 engages AFBC again.
#[test]
fn a_trip_is_reported_once_and_ended_by_command() {
    let mut bench = Bench::new();
    for _ in 0..1000 {
        bench.tick(&State::default());
    }
    bench.follow();
    bench.tick(&State::default());
    bench.hear(Uplink::Command(VehicleCommand::Arm));
    let (report, said) = bench.tick(&State::default());
    assert_eq!((report.mode, said), (Mode::Flying, vec![accepted(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM)]));

    let mut askew = State::default();
    askew.attitude_rad.x = 1.2;
    let mut received = Vec::new();
    let mut reason = None;
    for _ in 0..9_000 {
        let (report, said) = bench.tick(&askew);
        received.extend(said);
        reason = report.health.control.fallback;
    }
    let reason = reason.expect("nine seconds on its side");
    assert_eq!(received, [text(reason)]);

    bench.hear(Uplink::Command(VehicleCommand::Engage));
    let (report, said) = bench.tick(&State::default());
    assert_eq!(report.answer.map(|answer| (answer.request, answer.result)), Some((Request::Engage, Ok(()))));
    assert_eq!(report.health.control.fallback, None);
    assert_eq!(said, [accepted(MavCmd::MAV_CMD_USER_1)]);
    let (report, said) = bench.tick(&State::default());
    assert_eq!((report.health.control.fallback, said), (None, vec![]), "AFBC flies");
}

/// A trip is reported again only if the monitor trips again, not if states return after a gap.
#[test]
fn a_gap_in_the_states_does_not_repeat_it() {
    let mut bench = Bench::new();
    let (idle, _) = bench.tick(&State::default());
    let reason = Trip::Theta(Axis::Roll).reason();
    let received = text(reason);
    let mut says = |mode, fallback| {
        let mut report = idle;
        (report.mode, report.health.control.fallback) = (mode, fallback);
        bench.said(&report).into_iter().filter(|message| *message == received).count()
    };
    assert_eq!(says(Mode::Flying, None), 0);
    assert_eq!(says(Mode::Flying, Some(reason)), 1);
    assert_eq!(says(Mode::Flying, Some(reason)), 0);
    assert_eq!(says(Mode::Coasting, None), 0);
    assert_eq!(says(Mode::Flying, Some(reason)), 0);
    assert_eq!(says(Mode::Flying, None), 0);
    assert_eq!(says(Mode::Flying, Some(reason)), 1);
}
