//! Simulates a vehicle flown by radio, from a receiver's bytes to the plant.
#![allow(dead_code, reason = "each test uses a part")]

use afbc::Profile;
use afbc_guidance::FlightMode;
use afbc_hil::Host;
use afbc_mavlink::{Address, Encoder, FRAME_MAX, ParameterRequest, Uplink};
use afbc_onboard::Report;
use afbc_rc::{Channels, CrsfFrame};
use afbc_scenario::{Scenario, load};
use afbc_sim::flight::World;
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use afbc_vehicles::Vehicle;
use nalgebra::Vector3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::path::Path;

/// Scenario that starts on the ground, outdoors, with an estimator.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../twin/scenarios/hover.toml");
/// MAV_PARAM_TYPE_REAL32.
const REAL32: u8 = 9;
pub(crate) const STATION: Address = Address { system: 255, component: 190 };

pub(crate) const ROLL: usize = 0;
pub(crate) const PITCH: usize = 1;
pub(crate) const THROTTLE: usize = 2;
pub(crate) const YAW: usize = 3;
pub(crate) const ARM: usize = 4;
pub(crate) const MODE: usize = 5;
pub(crate) const KILL: usize = 6;

/// Encodes the channels as a receiver's bytes, or returns no bytes.
pub(crate) type Receiver = Box<dyn FnMut(&Channels, &mut Xoshiro256PlusPlus) -> Vec<u8>>;

pub(crate) struct Flier {
    pub(crate) host: Host,
    pub(crate) world: World,
    pub(crate) speeds: RotorSpeeds<ROTORS_MAX>,
    pub(crate) channels: Channels,
    pub(crate) receiver: Receiver,
    /// Time between two frames \[ms\].
    pub(crate) every_ms: u64,
    pub(crate) ms: u64,
    pub(crate) random: Xoshiro256PlusPlus,
    pub(crate) report: Option<Report>,
    pub(crate) sender: Encoder,
    pub(crate) texts: Vec<u8>,
}

/// Returns a CRSF receiver that gets every frame.
pub(crate) fn crsf() -> Receiver {
    Box::new(|channels, _| CrsfFrame::Channels(*channels).encode().to_vec())
}

impl Flier {
    /// Creates a vehicle on the ground with a ready estimate. The radio is connected, sticks centred, switches off.
    pub(crate) fn new(seed: u64, receiver: Receiver, every_ms: u64, sbus: bool) -> Self {
        let mut flier = Self::of(None, false, seed, receiver, every_ms);
        flier.set("RC_PROTOCOL", u8::from(sbus).into());
        flier.fly(8_000);
        flier
    }

    /// Creates a vehicle whose estimate is not ready yet. `vehicle` selects its type, and `calm` removes the wind.
    pub(crate) fn of(vehicle: Option<&Vehicle>, calm: bool, seed: u64, receiver: Receiver, every_ms: u64) -> Self {
        let mut scenario = load(Path::new(SCENARIO)).unwrap();
        if calm {
            scenario.realism.wind = Default::default();
        }
        let (scenario, host) = match vehicle {
            None => (scenario, Host::new().unwrap()),
            Some(vehicle) => (scenario.on(vehicle, Profile::Flight).unwrap(), Host::for_vehicle(vehicle).unwrap()),
        };
        let mut us = [1000; 16];
        us[..4].fill(1500);
        let mut flier = Flier {
            host,
            world: World::released(&Scenario { seed, ..scenario }, 1e-3).unwrap(),
            speeds: RotorSpeeds::default(),
            channels: Channels::of(us),
            receiver,
            every_ms,
            ms: 0,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            report: None,
            sender: Encoder::new(STATION),
            texts: Vec::new(),
        };
        flier.set("RC_MAP_KILL_SW", KILL as f32 + 1.0);
        flier.set("COM_FLTMODE1", 2.0);
        flier
    }

    /// Sets a parameter.
    pub(crate) fn set(&mut self, name: &str, value: f32) {
        let mut letters = [0; 16];
        letters[..name.len()].copy_from_slice(name.as_bytes());
        let request = ParameterRequest::Set { name: letters, value: value.to_le_bytes(), kind: REAL32 };
        self.tick(Some(&Uplink::Parameter(request)));
    }

    pub(crate) fn tick(&mut self, message: Option<&Uplink>) {
        self.world.advance(&self.speeds);
        self.world.look();
        self.host.sense(&self.world.readings().copied().unwrap_or_default());
        self.ms += 1;
        if self.ms.is_multiple_of(self.every_ms) {
            let bytes = (self.receiver)(&self.channels, &mut self.random);
            self.host.hear_radio(&bytes);
        }
        let mut buffer = [0; FRAME_MAX];
        // A heartbeat is sent every second, since the vehicle would miss a station that falls silent.
        let message = message.or((self.ms % 1_000 == 500).then_some(&Uplink::Heartbeat));
        let bytes = message.map_or(Vec::new(), |message| self.sender.send(message, &mut buffer).to_vec());
        let tick = self.host.next_tick(&bytes);
        self.speeds = tick.report.motors;
        self.report = Some(tick.report);
        self.texts.extend(tick.bytes);
    }

    pub(crate) fn fly(&mut self, ms: u64) {
        (0..ms).for_each(|_| self.tick(None));
    }

    pub(crate) fn mode(&self) -> FlightMode {
        self.report.as_ref().unwrap().guided.mode
    }

    pub(crate) fn armed(&self) -> bool {
        self.report.as_ref().unwrap().mode.armed()
    }

    pub(crate) fn position_m(&self) -> Vector3<f64> {
        self.world.plant().motion().position_m
    }

    /// Flies for this time, and returns the largest tilt \[rad\].
    pub(crate) fn tilt_rad(&mut self, ms: u64) -> f64 {
        (0..ms).fold(0.0, |most: f64, _| {
            self.tick(None);
            let attitude_rad = self.world.plant().motion().attitude_rad;
            most.max((attitude_rad.x.cos() * attitude_rad.y.cos()).acos())
        })
    }

    /// Arms, takes off by the throttle and hovers some metres up.
    pub(crate) fn up(&mut self) {
        self.channels.us[THROTTLE] = 1000;
        self.fly(200);
        self.channels.us[ARM] = 2000;
        self.fly(300);
        assert!(
            self.armed(),
            "armed by its switch: {}",
            String::from_utf8_lossy(&self.texts).replace(|c: char| !c.is_ascii_graphic() && c != ' ', "")
        );
        assert_eq!(self.mode(), FlightMode::Position);
        self.channels.us[THROTTLE] = 1900;
        self.fly(5_000);
        self.channels.us[THROTTLE] = 1500;
        self.fly(3_000);
        assert!(self.position_m().z > 2.0, "took off: {:?}", self.position_m());
    }

    pub(crate) fn says(&self, text: &str) -> bool {
        self.texts.windows(text.len()).any(|window| window == text.as_bytes())
    }
}
