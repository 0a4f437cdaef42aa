//! A session with the server's vehicle and its stations.

use super::{Tick, Truth};
use afbc_comms::services::origin::EarthOrigin;
use afbc_ground::{Client, RetryPolicy};
use afbc_mavlink::{
    Address, Datum, Decoder, Downlink, GlobalPosition, Height, MissionItem, MissionType, Uplink, VehicleCommand,
};
use afbc_scenario::{Scenario, built_in};
use afbc_serve::{Server, fleet};
use nalgebra::Vector3;

pub const STATION: Address = Client::STATION;
pub const COMPANION: Address = Address { system: 245, component: 191 };
/// Message id of HIL_ACTUATOR_CONTROLS, which has the armed flag and the rotor commands of every tick.
const ROTORS: u32 = 93;
/// Time between heartbeats of a station, and between targets of a stream \[ms\].
const HEARTBEAT_MS: u64 = 500;
const TARGET_MS: u32 = 50;
/// Time between two attempts to arm \[ms\]. After `ARMS_MS`, arming counts as failed.
const TRY_MS: u32 = 250;
const ARMS_MS: u32 = 30_000;
/// Time in which the vehicle may ask for an item of a mission again, over links that lose most of it.
const UPLOAD: RetryPolicy = RetryPolicy { answer_ms: 60_000, tries: 1 };

/// A ground station or companion computer.
struct Station {
    address: Address,
    client: Client,
    /// False while nothing of it gets through.
    reaches: bool,
    /// One in this number of the station's frames is broken; 0 means none.
    breaks: u32,
    frames: u32,
    stream: Option<Uplink>,
}

impl Station {
    fn new(address: Address) -> Self {
        Station { address, client: Client::new(address), reaches: true, breaks: 0, frames: 0, stream: None }
    }
}

/// A vehicle, its stations, and their clock.
pub struct Session {
    server: Server,
    stations: [Station; 2],
    decoder: Decoder<Downlink>,
    time_ms: u32,
    garbage: Vec<u8>,
}

impl Session {
    /// Powers the vehicle up, indoors with a tracker or outdoors in a breeze.
    pub fn new(indoors: bool, seed: u64) -> Self {
        let scenario = built_in(if indoors { "mocap" } else { "outdoor" }).unwrap().read().unwrap();
        Session::of(&Scenario { seed, ..scenario })
    }

    /// Powers up the vehicle of a scenario.
    pub fn of(scenario: &Scenario) -> Self {
        let server = Server::new(&fleet(scenario, 1).unwrap(), 1).unwrap();
        let stations = [STATION, COMPANION].map(Station::new);
        let mut session = Session { server, stations, decoder: Decoder::new(STATION), time_ms: 0, garbage: Vec::new() };
        session.say(STATION, Uplink::Command(VehicleCommand::SetInterval { message: ROTORS, interval_us: 1000 }));
        // At first, only the first station is in reach.
        session.station(COMPANION).reaches = false;
        session
    }

    fn station(&mut self, address: Address) -> &mut Station {
        self.stations.iter_mut().find(|station| station.address == address).unwrap()
    }

    pub fn time_s(&self) -> f64 {
        f64::from(self.time_ms) * 1e-3
    }

    /// Queues a message of a station for the next tick.
    pub fn say(&mut self, from: Address, message: Uplink) {
        self.station(from).client.say(message);
    }

    /// Sets a parameter.
    pub fn set(&mut self, name: &str, value: f32) {
        self.station(STATION).client.set_parameter(name, value);
    }

    /// Sets whether the station's frames reach the vehicle.
    pub fn reach(&mut self, of: Address, reaches: bool) {
        self.station(of).reaches = reaches;
    }

    /// Sends a target repeatedly, or stops doing so.
    pub fn stream(&mut self, from: Address, target: Option<Uplink>) {
        self.station(from).stream = target;
    }

    /// Breaks one in `one_of` frames of a station; 0 breaks none.
    pub fn breaks(&mut self, of: Address, one_of: u32) {
        self.station(of).breaks = one_of;
    }

    /// Sends bytes that belong to no station's frames.
    pub fn noise(&mut self, bytes: &[u8]) {
        self.garbage.extend_from_slice(bytes);
    }

    /// Begins the upload of a mission. Its items follow when the vehicle requests them.
    pub fn upload(&mut self, from: Address, items: Vec<MissionItem>) {
        self.station(from).client.upload([(MissionType::MISSION, items)], UPLOAD);
    }

    /// Changes weather or faults with a line of the server's protocol.
    pub fn line(&mut self, line: &str) {
        assert_eq!(self.server.line(line).lines, [format!("ok {line}")]);
    }

    /// Runs one millisecond.
    pub fn step(&mut self) -> Tick {
        let time_ms = self.time_ms;
        let mut sent = Vec::new();
        for (peer, station) in (1..).zip(&mut self.stations) {
            let Station { address, client, reaches, breaks, frames, stream } = station;
            client.set_heartbeat_period(reaches.then_some(HEARTBEAT_MS));
            client.update(time_ms.into());
            if time_ms.is_multiple_of(TARGET_MS) {
                stream.iter().for_each(|target| client.say(*target));
            }
            client.send(|message, frame| {
                *frames += 1;
                if !*reaches {
                    return;
                }
                let mut frame = frame.to_vec();
                if *breaks > 0 && *frames % *breaks == 0 {
                    let place = *frames as usize * 31 % frame.len();
                    frame[place] ^= 1 << (*frames % 8);
                } else {
                    sent.push((*address, *message));
                }
                self.server.hear(0, peer, &frame);
            });
        }
        if !self.garbage.is_empty() {
            self.server.hear(0, 9, &std::mem::take(&mut self.garbage));
        }
        let mut heard = Vec::new();
        let Session { server, stations, decoder, .. } = self;
        let mut hear = |from, message| {
            for station in stations.iter_mut() {
                station.client.receive(from, &message);
            }
            heard.push(message);
        };
        let _ = server.step(|_, bytes| decoder.feed(bytes, &mut hear), |_| ());
        self.time_ms += 1;
        Tick { time_ms, sent, heard, truth: self.truth() }
    }

    /// Returns the true motion of the vehicle.
    pub fn truth(&self) -> Truth {
        let plant = self.server.vehicles()[0].world().plant();
        let (motion, telemetry) = (plant.motion(), plant.telemetry().unwrap());
        let [[roll, pitch, _]] = motion.attitude_rad.data.0;
        Truth {
            position_m: motion.position_m,
            velocity_m_s: motion.velocity_m_s,
            tilt_rad: (roll.cos() * pitch.cos()).clamp(-1.0, 1.0).acos(),
            on_ground: telemetry.on_ground,
            rotor_rad_s: telemetry.rotor_speeds_rad_s.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Arms the vehicle as soon as that is possible. Passes each tick to `see`.
    pub fn arm(&mut self, mut see: impl FnMut(&Tick)) {
        let begin_ms = self.time_ms;
        while self.time_ms < begin_ms + ARMS_MS {
            if self.time_ms.is_multiple_of(TRY_MS) {
                self.say(STATION, Uplink::Command(VehicleCommand::Arm));
            }
            let tick = self.step();
            see(&tick);
            if is_armed(&tick) == Some(true) {
                return;
            }
        }
        panic!("not armed in {ARMS_MS} ms");
    }
}

/// Returns whether the vehicle is armed, if the tick's messages say so.
pub fn is_armed(tick: &Tick) -> Option<bool> {
    tick.heard.iter().find_map(|message| match message {
        Downlink::Rotors { armed, .. } => Some(*armed),
        _ => None,
    })
}

/// Returns a place of the local frame \[m\] of the outdoor vehicle in global coordinates.
pub fn global(x: f32, y: f32, z: f32) -> GlobalPosition {
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).unwrap();
    let global = origin.global(&Vector3::new(x, y, z));
    let [latitude_e7, longitude_e7] = global.e7();
    let height = Height { metres: global.altitude_m as f32, above: Datum::Sea };
    GlobalPosition { latitude_e7, longitude_e7, height }
}

/// Returns a mission item at a place of the local frame \[m\]: north, west, up.
pub fn item(number: u16, command: u16, [x, y, z]: [f32; 3]) -> MissionItem {
    let e4 = |metres: f32| (metres * 1e4) as i32;
    MissionItem {
        number,
        command,
        frame: 1,
        goes_on: true,
        parameters: [0.0, 0.0, 0.0, f32::NAN],
        x: e4(x),
        y: e4(-y),
        z: -z,
        ..MissionItem::default()
    }
}
