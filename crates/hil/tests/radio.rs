//! Flights by radio: from a receiver's bytes to the plant, with receivers that are stuck, noisy, half dead or silent.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

use afbc_guidance::FlightMode;
use afbc_hil::Host;
use afbc_link::{Address, Command, ExternalTarget, FRAME_MAX, ManualControl, ParameterRequest, Sender, Uplink};
use afbc_onboard::Report;
use afbc_radio::{Channels, CrsfFrame, SbusFrame};
use afbc_scenario::load;
use afbc_sim::flight::World;
use afbc_station::AuxSensors;
use afbc_station::services::{health::sensor, status::SensorBits};
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use nalgebra::Vector3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::path::Path;

/// From the ground, outdoors, on the estimate.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../twin/scenarios/hover.toml");
/// Types of parameters, as MAV_PARAM_TYPE.
const INT32: u8 = 6;
const STATION: Address = Address { system: 255, component: 190 };

const ROLL: usize = 0;
const PITCH: usize = 1;
const THROTTLE: usize = 2;
const ARM: usize = 4;
const MODE: usize = 5;
const KILL: usize = 6;

/// What a receiver makes of a frame: its bytes, or nothing.
type Receiver = Box<dyn FnMut(&Channels, &mut Xoshiro256PlusPlus) -> Vec<u8>>;

struct Flier {
    host: Host,
    world: World,
    speeds: RotorSpeeds<ROTORS_MAX>,
    channels: Channels,
    receiver: Receiver,
    /// Time between two frames \[ms\].
    every_ms: u64,
    ms: u64,
    random: Xoshiro256PlusPlus,
    report: Option<Report<ROTORS_MAX>>,
    sender: Sender,
    texts: Vec<u8>,
}

/// Every frame arrives.
fn crsf() -> Receiver {
    Box::new(|channels, _| CrsfFrame::Channels(*channels).encode().to_vec())
}

impl Flier {
    /// On the ground, its estimate ready; the pilot is heard, sticks centred, switches off.
    fn new(seed: u64, receiver: Receiver, every_ms: u64, sbus: bool) -> Self {
        let scenario = load(Path::new(SCENARIO)).unwrap();
        let mut us = [1000; 16];
        us[..4].fill(1500);
        let mut flier = Flier {
            host: Host::new().unwrap(),
            world: World::released(&afbc_scenario::Scenario { seed, ..scenario }, 1e-3).unwrap(),
            speeds: RotorSpeeds::default(),
            channels: Channels { us },
            receiver,
            every_ms,
            ms: 0,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            report: None,
            sender: Sender::new(STATION),
            texts: Vec::new(),
        };
        for (name, value) in
            [("RC_MAP_KILL_SW", KILL as i32 + 1), ("RC_PROTOCOL", i32::from(sbus)), ("COM_FLTMODE1", 2)]
        {
            let mut letters = [0; 16];
            letters[..name.len()].copy_from_slice(name.as_bytes());
            let request = ParameterRequest::Set { name: letters, value: value.to_le_bytes(), kind: INT32 };
            flier.tick(Some(&Uplink::Parameter(request)));
        }
        flier.fly(8_000);
        flier
    }

    fn tick(&mut self, message: Option<&Uplink>) {
        self.world.advance(&self.speeds);
        self.world.look();
        self.host.sense(&self.world.readings().copied().unwrap_or_default());
        self.ms += 1;
        if self.ms.is_multiple_of(self.every_ms) {
            let bytes = (self.receiver)(&self.channels, &mut self.random);
            self.host.hear_radio(&bytes);
        }
        let mut buffer = [0; FRAME_MAX];
        // A station that was heard is missed when it is silent.
        let message = message.or((self.ms % 1_000 == 500).then_some(&Uplink::Heartbeat));
        let bytes = message.map_or(Vec::new(), |message| self.sender.send(message, &mut buffer).to_vec());
        let tick = self.host.next_tick(&bytes);
        self.speeds = tick.report.motors;
        self.report = Some(tick.report);
        self.texts.extend(tick.bytes);
    }

    fn fly(&mut self, ms: u64) {
        (0..ms).for_each(|_| self.tick(None));
    }

    fn mode(&self) -> FlightMode {
        self.report.as_ref().unwrap().guided.mode
    }

    fn armed(&self) -> bool {
        self.report.as_ref().unwrap().mode.armed()
    }

    fn position_m(&self) -> Vector3<f64> {
        self.world.plant().motion().position_m
    }

    /// Largest tilt from now on for a time \[rad\].
    fn tilt_rad(&mut self, ms: u64) -> f64 {
        (0..ms).fold(0.0, |most: f64, _| {
            self.tick(None);
            let attitude_rad = self.world.plant().motion().attitude_rad;
            most.max((attitude_rad.x.cos() * attitude_rad.y.cos()).acos())
        })
    }

    /// Arms, takes off by the throttle and hovers some metres up.
    fn up(&mut self) {
        self.channels.us[THROTTLE] = 1000;
        self.fly(200);
        self.channels.us[ARM] = 2000;
        self.fly(300);
        assert!(self.armed(), "armed by its switch");
        assert_eq!(self.mode(), FlightMode::Position);
        self.channels.us[THROTTLE] = 1900;
        self.fly(5_000);
        self.channels.us[THROTTLE] = 1500;
        self.fly(3_000);
        assert!(self.position_m().z > 2.0, "took off: {:?}", self.position_m());
    }

    fn says(&self, text: &str) -> bool {
        self.texts.windows(text.len()).any(|window| window == text.as_bytes())
    }
}

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
        let channels = Channels { us: [1000; 16] };
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
