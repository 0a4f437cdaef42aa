//! Flights by radio: from a receiver's bytes to the plant, with receivers that are stuck, noisy, half dead or silent.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

mod flier;

use afbc_guidance::FlightMode;
use afbc_link::{ChannelsOverride, Command, ExternalTarget, ManualControl, Uplink};
use afbc_radio::{Channels, CrsfFrame, SbusFrame};
use afbc_station::AuxSensors;
use afbc_station::services::{health::sensor, status::SensorBits};
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
    // Down, and off when it has landed.
    flier.channels.us[THROTTLE] = 1000;
    flier.fly(20_000);
    assert!(flier.position_m().z < 0.2, "landed: {:?}", flier.position_m());
    flier.channels.us[ARM] = 1000;
    flier.fly(100);
    assert!(!flier.armed());
}

/// On the ground, with what speaks against it named.
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

/// Within 20 ms, whoever is in control and whatever it does.
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

/// It holds what was last heard for half a second, then its place; a pilot who is back takes over by moving something.
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

/// Nine frames of ten are lost, or arrive damaged, in bursts; SBUS has no checksum.
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

    // A frame of fifty with a wrong bit in its channels.
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

/// A receiver that has given up says so, or sends its last frame for ever: then the pilot has the switches of another.
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

/// A station's sticks do not count while the pilot's own are there.
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
            flier.tick(Some(&Uplink::Command(Command::SelectStandardMode(1))));
        }
        flier.tick(Some(&Uplink::Target(ExternalTarget::Sticks(sticks))));
    }
    assert!((flier.position_m() - place_m).norm() > 4.0);
}

/// Channels of a station in place of a receiver's, as many times per second.
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

/// RC_CHANNELS_OVERRIDE arms, flies and kills by the same switches; when it stops, that is a loss; a receiver that
/// hears
/// its pilot goes first.
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

    // The pilot's receiver hears its transmitter, which has its switches off: that disarms nothing in the air.
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

    // Both are silent: lost, and held.
    flier.receiver = silent();
    flier.fly(1_200);
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
    assert!(flier.says("radio: lost"));

    // A station that comes back kills within two messages.
    relayed(&mut flier, 1_000);
    assert!(flier.armed());
    flier.channels.us[KILL] = 2000;
    relayed(&mut flier, 100);
    assert!(!flier.armed());
}

/// What a station does not send any more is lost as a stick is, whatever else it sends: one stick is centred, and with
/// nothing but "leave alone" in every channel the pilot is lost.
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

/// Two receivers on one transmitter, of which either falls silent in turn, or both at once for a while.
#[test]
fn a_receiver_that_switches_is_flown_with() {
    let mut frames = 0;
    let switching: Receiver = Box::new(move |channels, random| {
        frames += 1;
        // One in CRSF's full range, the other with what it heard last and some noise of its own.
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
