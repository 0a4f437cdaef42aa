//! Telemetry of a flying vehicle reports what the vehicle does.

use crate::common::Bench;
use afbc_comms::services::streams::id;
use afbc_mavlink::{Downlink, PositionTarget, Uplink, VehicleCommand};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

/// POSITION_TARGET_LOCAL_NED has the setpoint of the control law, four times per second, while the vehicle is armed.
#[test]
fn the_setpoint_that_is_followed_is_reported() {
    let mut bench = Bench::new();
    let mut reported = Vec::new();
    for tick in 0..4000_u32 {
        match tick {
            1100 => bench.follow(),
            1200 => bench.hear(Uplink::Command(VehicleCommand::Arm)),
            3200 => bench.hear(Uplink::Command(VehicleCommand::Kill)),
            _ => (),
        }
        bench.measure(&State::default());
        let position_m = Vector3::new(0.5, -0.25, 0.5);
        bench.hear(Uplink::Setpoint(Setpoint { position_m, ..Setpoint::default() }));
        let (report, said) = bench.step();
        for message in said {
            if let Downlink::PositionTarget(time_ms, motion) = message {
                assert!(report.mode.armed());
                assert_eq!(u64::from(time_ms), report.time_us / 1000);
                let followed = report.guided.setpoint.expect("it has a state");
                assert_eq!(format!("{motion:?}"), format!("{:?}", PositionTarget::from(&followed)));
                reported.push((tick, motion.position_m));
            }
        }
    }
    assert!((7..=9).contains(&reported.len()), "{reported:?}");
    let (_, last) = reported.last().expect("some");
    assert!((last - Vector3::new(0.5, -0.25, 0.5)).norm() < 0.2, "{last}");
    // There is no setpoint after disarming, so the request is refused.
    bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::POSITION_TARGET_LOCAL_NED, index: 0 }));
    let refused = bench.step().1.iter().any(|it| {
        matches!(it, Downlink::CommandAck { command: 512, answer, .. }
        if *answer == afbc_mavlink::CommandResult::Refused(afbc_comms::NOT_KNOWN))
    });
    assert!(refused);
}
