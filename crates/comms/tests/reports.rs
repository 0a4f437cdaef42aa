//! The vehicle's periodic reports.

use crate::common::{Bench, STATION};
use afbc_comms::services::streams::id;
use afbc_mavlink::{Decoder, Downlink, Encoder, FRAME_MAX, Telemetry, Uplink, VehicleCommand};
use afbc_onboard::{Readings, Report};

/// HEARTBEAT is sent once per second over many seconds.
#[test]
fn heartbeats_come_once_per_second() {
    let mut bench = Bench::new();
    let beats: Vec<_> = (1..=3500_u32)
        .filter(|_| bench.step().1.iter().any(|message| matches!(message, Downlink::Heartbeat { .. })))
        .collect();
    assert_eq!(beats, [3, 1003, 2003, 3003]);
}

/// DEBUG_FLOAT_ARRAY "health" has the longest tick, the dropped frames and the unanswered commands.
#[test]
fn health_reports_counts_and_times() {
    let mut bench = Bench::new();
    let health = |bench: &mut Bench, tick_us: f32| {
        let mut decoder = Decoder::<Downlink>::new(STATION);
        bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::DEBUG_FLOAT_ARRAY, index: 0 }));
        bench.now_us += 1000;
        bench.inputs.take_into(&mut bench.taken);
        let report: Report = bench.flight.tick(bench.now_us, &mut bench.taken, &Readings::NONE);
        let mut reported = None;
        bench.comms.report(&report, tick_us, |bytes| {
            decoder.feed(bytes, |_, message| {
                if let Downlink::Health(health) = message {
                    reported = Some(health);
                }
            });
        });
        reported.expect("sent")
    };
    let first = health(&mut bench, 1000.0);
    assert_eq!((first.tick_us, first.tick_max_us, bench.comms.bad_frames()), (1000.0, 1000.0, 0));
    let second = health(&mut bench, 100.0);
    assert_eq!((second.tick_us, second.tick_max_us), (100.0, 1000.0));
    // The first frame is damaged; the zeros that follow are no frame.
    let mut frame = [0; FRAME_MAX];
    let mut bytes = Encoder::new(STATION).send(&Uplink::Heartbeat, &mut frame).to_vec();
    bytes[12] ^= 1;
    bench.hear_bytes(&bytes);
    bench.hear_bytes(&[0; 300]);
    assert_eq!(bench.comms.bad_frames(), 1);
    bench.step();
    bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::SYS_STATUS, index: 0 }));
    let said = bench.step().1;
    let dropped = said.iter().find_map(|it| match it {
        Downlink::Telemetry(Telemetry::System(system)) => Some(system.dropped_frames),
        _ => None,
    });
    assert_eq!(dropped, Some(1));
}
