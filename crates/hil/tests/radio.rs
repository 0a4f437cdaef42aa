//! Tests flights by radio, from a receiver's bytes to the plant, with receivers that are stuck, noisy, faulty or
//! silent.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

mod flier;

use afbc_comms::AuxSensors;
use afbc_comms::services::{health::sensor, status::SensorBits};
use afbc_guidance::FlightMode;
use afbc_mavlink::{ChannelsOverride, ExternalTarget, ManualControl, Uplink, VehicleCommand};
use afbc_rc::{Channels, CrsfFrame, SbusFrame};
use flier::{ARM, Flier, KILL, MODE, PITCH, ROLL, Receiver, THROTTLE, crsf};
use rand_xoshiro::rand_core::Rng;

#[test]
fn a_flight_by_radio() {
    let mut flier = Flier::new(1, crsf(), 4, false);
    flier.up();
    let before_m = flier.position_m();
    flier.channels.us[PITCH] = 1800;
    flier.fly(4_000);
    flier.channels.us[PITCH] = 1500;
    flier.fly(4_000);
    let moved_m = flier.position_m() - before_m;
    assert!(moved_m.x > 5.0 && moved_m.y.abs() < 2.0, "forward: {moved_m:?}");
    flier.channels.us[ROLL] = 1250;
    flier.fly(3_000);
    flier.channels.us[ROLL] = 1500;
    flier.fly(3_000);
    let moved_m = flier.position_m() - before_m;
    assert!(moved_m.y > 2.0, "a stick to the left: {moved_m:?}");
    // Lands, and then disarms by the switch.
    flier.channels.us[THROTTLE] = 1000;
    flier.fly(20_000);
    assert!(flier.position_m().z < 0.2, "landed: {:?}", flier.position_m());
    flier.channels.us[ARM] = 1000;
    flier.fly(100);
    assert!(!flier.armed());
}

/// Arming on the ground is refused, and the reason is reported.
#[test]
fn arming_is_refused_with_a_reason() {
    let mut flier = Flier::new(2, crsf(), 4, false);
    flier.channels.us[THROTTLE] = 1800;
    flier.fly(100);
    flier.channels.us[ARM] = 2000;
    flier.fly(1_500);
    assert!(!flier.armed() && flier.says("lower the throttle"));
    flier.channels.us[THROTTLE] = 1000;
    flier.fly(1_000);
    assert!(!flier.armed(), "the switch was not moved");

    let faulty = SensorBits { present: sensor::GYROSCOPE_2, healthy: 0 };
    flier.host.comms().set_aux_sensors(AuxSensors { sensors: faulty, ..AuxSensors::default() });
    flier.channels.us[ARM] = 1000;
    flier.fly(200);
    flier.channels.us[ARM] = 2000;
    flier.fly(1_500);
    assert!(!flier.armed() && flier.says("arming refused: IMU 2 is faulty"));
}

/// The kill switch stops the motors within 20 ms.
#[test]
fn the_kill_switch_stops_the_motors() {
    for every_ms in [2, 4, 6] {
        let mut flier = Flier::new(3, crsf(), every_ms, false);
        flier.up();
        flier.channels.us[KILL] = 2000;
        flier.fly(20);
        assert!(!flier.armed() && flier.report.as_ref().unwrap().throttles.iter().all(|throttle| *throttle == 0));
    }
}

/// After a loss, the last sticks hold for half a second, then the vehicle holds its position. A returning pilot takes
/// over by moving a switch.
#[test]
fn a_lost_pilot_is_waited_for() {
    let mut flier = Flier::new(4, crsf(), 4, false);
    flier.up();
    flier.receiver = Box::new(|_, _| Vec::new());
    flier.fly(400);
    assert_eq!(flier.mode(), FlightMode::Position);
    flier.fly(700);
    assert_eq!(flier.mode(), FlightMode::Hold);
    assert!(flier.says("radio: lost"));
    let place_m = flier.position_m();
    flier.fly(10_000);
    assert!((flier.position_m() - place_m).norm() < 3.0);
    flier.receiver = crsf();
    flier.fly(5_000);
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
    flier.channels.us[MODE] = 2000;
    flier.fly(100);
    flier.channels.us[MODE] = 1000;
    flier.fly(100);
    assert_eq!(flier.mode(), FlightMode::Position);
}

/// Flies with a receiver that loses or damages nine frames of ten, and with SBUS, which has no checksum.
#[test]
fn a_bad_receiver_is_flown_with() {
    let half_dead: Receiver = Box::new(|channels, random| match random.next_u32() % 10 {
        0 => CrsfFrame::Channels(*channels).encode().to_vec(),
        1..4 => {
            let mut bytes = CrsfFrame::Channels(*channels).encode().to_vec();
            let at = random.next_u32() as usize % bytes.len();
            bytes[at] ^= 1 << (random.next_u32() % 8);
            bytes
        }
        4..6 => (0..random.next_u32() % 60).map(|_| random.next_u32() as u8).collect(),
        _ => Vec::new(),
    });
    let mut flier = Flier::new(5, crsf(), 4, false);
    flier.up();
    flier.receiver = half_dead;
    let tilt_rad = flier.tilt_rad(20_000);
    assert!(flier.armed() && tilt_rad < 0.5, "{tilt_rad}");
    assert_eq!(flier.mode(), FlightMode::Position);

    // One frame of fifty has a wrong bit in its channels.
    let noisy: Receiver = Box::new(|channels, random| {
        let mut bytes = SbusFrame { channels: *channels, frame_lost: false, failsafe: false }.encode().to_vec();
        if random.next_u32() % 50 == 0 {
            bytes[1 + random.next_u32() as usize % 22] ^= 1 << (random.next_u32() % 8);
        }
        bytes
    });
    let mut flier = Flier::new(6, noisy, 9, true);
    flier.up();
    let place_m = flier.position_m();
    let tilt_rad = flier.tilt_rad(20_000);
    assert!(flier.armed() && tilt_rad < 0.5, "{tilt_rad}");
    assert!((flier.position_m() - place_m).norm() < 8.0, "{:?}", flier.position_m() - place_m);
}

/// A receiver that gives up sets SBUS's failsafe flag, while its channels show other switches.
#[test]
fn a_receiver_that_gives_up_is_a_loss() {
    let mut flier = Flier::new(
        7,
        Box::new(|channels, _| SbusFrame { channels: *channels, frame_lost: false, failsafe: false }.encode().to_vec()),
        9,
        true,
    );
    flier.up();
    flier.receiver = Box::new(|_, _| {
        let channels = Channels::of([1000; 16]);
        SbusFrame { channels, frame_lost: true, failsafe: true }.encode().to_vec()
    });
    flier.fly(1_500);
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
}

/// A station's sticks are ignored while the radio is connected.
#[test]
fn the_pilots_sticks_go_first() {
    let mut flier = Flier::new(8, crsf(), 4, false);
    flier.up();
    let place_m = flier.position_m();
    let sticks = ManualControl { roll: 0.0, pitch: 1.0, throttle: 0.0, yaw: 0.0 };
    for _ in 0..3_000 {
        flier.tick(Some(&Uplink::Target(ExternalTarget::Sticks(sticks))));
    }
    assert!((flier.position_m() - place_m).norm() < 2.0);
    flier.receiver = Box::new(|_, _| Vec::new());
    flier.fly(600);
    for ms in 0..3_000 {
        if ms == 100 {
            // MAV_STANDARD_MODE_POSITION_HOLD.
            flier.tick(Some(&Uplink::Command(VehicleCommand::SelectStandardMode(1))));
        }
        flier.tick(Some(&Uplink::Target(ExternalTarget::Sticks(sticks))));
    }
    assert!((flier.position_m() - place_m).norm() > 4.0);
}

/// Sends the channels from a station, every 40 ms, instead of from a receiver.
fn relayed(flier: &mut Flier, ms: u64) {
    for _ in 0..ms {
        let message = Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(flier.channels.us)));
        let is_due = flier.ms.is_multiple_of(40);
        flier.tick(is_due.then_some(&message));
    }
}

fn silent() -> Receiver {
    Box::new(|_, _| Vec::new())
}

/// RC_CHANNELS_OVERRIDE arms, flies and kills with the same switches as a receiver. If it stops, the radio counts as
/// lost. A receiver that is connected has priority.
#[test]
fn a_flight_by_a_stations_channels() {
    let mut flier = Flier::new(9, silent(), 4, false);
    flier.channels.us[THROTTLE] = 1000;
    relayed(&mut flier, 1_000);
    flier.channels.us[ARM] = 2000;
    relayed(&mut flier, 300);
    assert!(flier.armed());
    flier.channels.us[THROTTLE] = 1900;
    relayed(&mut flier, 5_000);
    flier.channels.us[THROTTLE] = 1500;
    relayed(&mut flier, 3_000);
    assert!(flier.position_m().z > 2.0, "took off: {:?}", flier.position_m());
    let before_m = flier.position_m();
    flier.channels.us[PITCH] = 1800;
    relayed(&mut flier, 4_000);
    flier.channels.us[PITCH] = 1500;
    relayed(&mut flier, 3_000);
    assert!(flier.position_m().x - before_m.x > 3.0, "{:?}", flier.position_m());

    // The pilot's receiver connects with the arm switch off. That does not disarm in the air.
    flier.receiver = crsf();
    flier.channels.us[ARM] = 1000;
    flier.fly(500);
    let place_m = flier.position_m();
    flier.channels.us[ROLL] = 2000;
    let stations = flier.channels;
    flier.channels.us[ROLL] = 1500;
    for ms in 0..3_000 {
        let message = Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(stations.us)));
        flier.tick((ms % 40 == 0).then_some(&message));
    }
    assert!(flier.armed() && (flier.position_m() - place_m).norm() < 2.0, "{:?}", flier.position_m() - place_m);

    // Without receiver and station, the radio counts as lost, and the vehicle holds its position.
    flier.receiver = silent();
    flier.fly(1_200);
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
    assert!(flier.says("radio: lost"));

    // A station that is back can kill within two messages.
    relayed(&mut flier, 1_000);
    assert!(flier.armed());
    flier.channels.us[KILL] = 2000;
    relayed(&mut flier, 100);
    assert!(!flier.armed());
}

/// If a station stops sending one stick's channel, that stick counts as centred, even if other channels go on. If every
/// channel says "leave alone", the radio counts as lost.
#[test]
fn channels_that_are_not_refreshed_are_lost() {
    const ALONE: u16 = u16::MAX;
    let mut flier = Flier::new(11, silent(), 4, false);
    flier.channels.us[THROTTLE] = 1000;
    relayed(&mut flier, 1_000);
    flier.channels.us[ARM] = 2000;
    relayed(&mut flier, 300);
    flier.channels.us[THROTTLE] = 1900;
    relayed(&mut flier, 5_000);
    flier.channels.us[THROTTLE] = 1500;
    flier.channels.us[PITCH] = 1800;
    relayed(&mut flier, 3_000);
    let moved_m = |flier: &mut Flier, us: [u16; 18]| {
        let before_m = flier.position_m();
        let message = Uplink::Target(ExternalTarget::Channels(ChannelsOverride::new(us)));
        (0..3_000).for_each(|ms| flier.tick((ms % 40 == 0).then_some(&message)));
        (flier.position_m() - before_m).norm()
    };
    let all = flier.channels.us;
    assert!(moved_m(&mut flier, all) > 4.0);
    let mut others = flier.channels.us;
    others[PITCH] = ALONE;
    moved_m(&mut flier, others);
    assert!(moved_m(&mut flier, others) < 1.0, "centred");
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Position, true));
    relayed(&mut flier, 2_000);
    moved_m(&mut flier, [ALONE; 18]);
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
    assert!(flier.says("radio: lost"));
    assert!(moved_m(&mut flier, [ALONE; 18]) < 1.0, "holds");
}

/// Flies with a receiver that alternates between full reception, one frame of three, and one of twenty.
#[test]
fn a_receiver_that_switches_is_flown_with() {
    let mut frames = 0;
    let switching: Receiver = Box::new(move |channels, random| {
        frames += 1;
        let heard = match frames / 200 % 3 {
            0 => true,
            1 => random.next_u32() % 3 == 0,
            _ => frames % 20 == 0,
        };
        let frame = CrsfFrame::Channels(*channels).encode();
        let cut = if heard { frame.len() } else { random.next_u32() as usize % frame.len() };
        frame[..cut].to_vec()
    });
    let mut flier = Flier::new(10, crsf(), 4, false);
    flier.up();
    flier.receiver = switching;
    let place_m = flier.position_m();
    assert!(flier.tilt_rad(20_000) < 0.5 && flier.armed());
    assert_eq!(flier.mode(), FlightMode::Position);
    assert!((flier.position_m() - place_m).norm() < 3.0);
}
