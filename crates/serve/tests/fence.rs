//! Geofences in closed loop, uploaded as stations do: the vehicle stays inside, whatever it is commanded.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_comms::services::modes;
use afbc_comms::services::origin::EarthOrigin;
use afbc_guidance::FlightMode;
use afbc_mavlink::{
    Address, Datum, Decoder, Downlink, Encoder, ExternalTarget, FRAME_MAX, GlobalPosition, Height, ManualControl,
    MissionItem, MissionMessage, MissionResult, MissionType, PositionTarget, Uplink, VehicleCommand,
};
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};
use nalgebra::{Vector2, Vector3};
use std::f32::consts::TAU;

const STATION: Address = Address { system: 255, component: 190 };

/// Random numbers by SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn within(&mut self, from: f32, to: f32) -> f32 {
        from + (to - from) * ((self.next() >> 40) as f32 / 16_777_216.0)
    }

    fn below(&mut self, most: u64) -> u64 {
        self.next() % most
    }
}

/// A fence area, computed independently of the firmware: corners, or centre and radius, in the local frame.
#[derive(Clone, Debug)]
enum Shape {
    Polygon(Vec<Vector2<f32>>),
    Circle(Vector2<f32>, f32),
}

impl Shape {
    fn star(random: &mut Random, centre: Vector2<f32>, least: f32, most: f32) -> Self {
        let count = 3 + random.below(7);
        let corner = |place: u64, radius: f32| {
            let (s, c) = (place as f32 * TAU / count as f32).sin_cos();
            centre + Vector2::new(c, s) * radius
        };
        Shape::Polygon((0..count).map(|place| corner(place, random.within(least, most))).collect())
    }

    /// Returns the distance to the boundary, positive inside \[m\].
    fn depth(&self, place: Vector2<f32>) -> f32 {
        match self {
            Shape::Circle(centre, radius) => radius - (place - centre).norm(),
            Shape::Polygon(corners) => {
                let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
                let near = edges().map(|(a, b)| {
                    let line = b - a;
                    let share = ((place - a).dot(&line) / line.norm_squared()).clamp(0.0, 1.0);
                    (place - a - line * share).norm()
                });
                let seen: f32 =
                    edges().map(|(a, b)| (a - place).perp(&(b - place)).atan2((a - place).dot(&(b - place)))).sum();
                near.fold(f32::MAX, f32::min) * if seen.abs() > 3.0 { 1.0 } else { -1.0 }
            }
        }
    }

    fn items(&self, included: bool) -> Vec<MissionItem> {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).unwrap();
        let (corners, first, command) = match self {
            Shape::Polygon(corners) => (corners.clone(), corners.len() as f32, 5001),
            Shape::Circle(centre, radius) => (vec![*centre], *radius, 5003),
        };
        let command = command + u16::from(!included);
        let item = |corner: &Vector2<f32>| {
            let [x, y] = origin.global(&Vector3::new(corner.x, corner.y, 0.0)).e7();
            MissionItem { command, frame: 5, parameters: [first, 0.0, 0.0, 0.0], x, y, ..MissionItem::default() }
        };
        corners.iter().map(item).collect()
    }
}

struct Flown {
    server: Server,
    lines: Vec<String>,
    decoder: Decoder<Downlink>,
    estimate: Vector2<f32>,
    acks: Vec<MissionResult>,
    areas: Vec<(Shape, bool)>,
    /// Least distance to a boundary so far, of the estimated and of the true position \[m\].
    least: [f32; 2],
}

impl Flown {
    fn new(seed: u64) -> Self {
        let mut scenario = built_in("outdoor").unwrap().read().unwrap();
        scenario.seed = seed;
        Flown {
            server: Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap(),
            lines: Vec::new(),
            decoder: Decoder::new(STATION),
            estimate: Vector2::zeros(),
            acks: Vec::new(),
            areas: Vec::new(),
            least: [f32::MAX; 2],
        }
    }

    fn hear(&mut self, message: Uplink) {
        self.server.hear(0, 1, Encoder::new(STATION).send(&message, &mut [0; FRAME_MAX]));
    }

    fn command(&mut self, command: VehicleCommand) {
        self.hear(Uplink::Command(command));
    }

    fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            let Flown { server, lines, decoder, estimate, acks, .. } = self;
            let _ = server.step(
                |_, bytes| {
                    decoder.feed(bytes, |_, message| match message {
                        Downlink::Position { position_m, .. } => *estimate = position_m.xy(),
                        Downlink::Mission { message: MissionMessage::Ack(result, _), .. } => acks.push(result),
                        _ => (),
                    });
                },
                |line| lines.push(line.into()),
            );
            let truth = self.server.vehicles()[0].world().plant().motion().position_m.xy().cast::<f32>();
            for (least, place) in self.least.iter_mut().zip([self.estimate, truth]) {
                for (shape, included) in &self.areas {
                    let depth = if *included { shape.depth(place) } else { -shape.depth(place) };
                    *least = least.min(depth);
                }
            }
        }
    }

    fn upload(&mut self, areas: Vec<(Shape, bool)>) {
        let items: Vec<_> = areas.iter().flat_map(|(shape, included)| shape.items(*included)).collect();
        self.acks.clear();
        self.hear(Uplink::Mission(MissionMessage::Count(items.len() as u16, MissionType::FENCE)));
        self.run(5);
        for (item, number) in items.into_iter().zip(0..) {
            self.hear(Uplink::Mission(MissionMessage::Item(MissionItem { number, ..item }, MissionType::FENCE)));
            self.run(5);
        }
        assert_eq!(self.acks, [MissionResult::ACCEPTED], "{:?}", self.lines);
        self.areas = areas;
    }

    /// Takes off and holds some metres above the ground.
    fn take_off(&mut self, rest_ms: u32) {
        self.run(rest_ms);
        self.command(VehicleCommand::Arm);
        self.run(100);
        self.command(VehicleCommand::SelectMode(modes::custom(FlightMode::Takeoff)));
        self.run(6_000);
    }

    /// Gives a random command of a station, companion computer or pilot.
    fn ask_for_anything(&mut self, random: &mut Random) {
        let origin = EarthOrigin::new(EarthOrigin::SIMULATED).unwrap();
        let to = Vector3::new(random.within(-60.0, 60.0), random.within(-60.0, 60.0), random.within(3.0, 12.0));
        let [latitude_e7, longitude_e7] = origin.global(&to).e7();
        let place = GlobalPosition { latitude_e7, longitude_e7, height: Height { metres: to.z, above: Datum::Home } };
        let full = |random: &mut Random| [-1.0, 0.0, 1.0, random.within(-1.0, 1.0)][random.below(4) as usize];
        let last_ms = 1000 + random.below(6000) as u32;
        match random.below(6) {
            0 => {
                self.command(VehicleCommand::Reposition {
                    place,
                    yaw_rad: f32::NAN,
                    speed_m_s: Some(12.0),
                    changes_mode: true,
                });
                self.run(last_ms);
            }
            1 => {
                let (radius_m, speed_m_s) = (random.within(2.0, 20.0), f32::NAN);
                self.command(VehicleCommand::Orbit { place, radius_m, speed_m_s, angle_deg: 0, heading: 0 });
                self.run(last_ms);
            }
            2 => {
                self.command(VehicleCommand::Return);
                self.run(last_ms);
            }
            3 => {
                let sticks = ManualControl {
                    roll: full(random),
                    pitch: full(random),
                    throttle: 0.2 * full(random),
                    yaw: full(random),
                };
                let mode = [FlightMode::Position, FlightMode::Altitude][random.below(2) as usize];
                self.stream(ExternalTarget::Sticks(sticks), mode, last_ms.min(4000));
            }
            _ => {
                let velocity_m_s = Vector3::new(random.within(-12.0, 12.0), random.within(-12.0, 12.0), 0.0);
                let motion = if random.below(2) == 0 {
                    PositionTarget { velocity_m_s, ..PositionTarget::NONE }
                } else {
                    PositionTarget { position_m: to, ..PositionTarget::NONE }
                };
                self.stream(ExternalTarget::Motion(motion), FlightMode::Offboard, last_ms);
            }
        }
    }

    /// Sends a target or sticks 20 times per second, and selects the mode once per second.
    fn stream(&mut self, target: ExternalTarget, mode: FlightMode, milliseconds: u32) {
        for time_ms in 0..milliseconds {
            if time_ms % 50 == 0 {
                self.hear(Uplink::Target(target));
            }
            if time_ms % 1000 == 100 {
                self.command(VehicleCommand::SelectMode(modes::custom(mode)));
            }
            self.run(1);
        }
    }
}

#[test]
fn whatever_is_ordered_the_vehicle_stays_inside() {
    let mut holds = 0;
    for seed in 0..12 {
        let mut random = Random(seed);
        let mut flown = Flown::new(seed);
        let wind = [random.within(-5.0, 5.0), random.within(-5.0, 5.0)];
        let _ = flown.server.line(&format!("wind {} {} 0", wind[0], wind[1]));
        flown.take_off(15_000);
        let around = if seed % 3 == 0 {
            Shape::Circle(Vector2::new(random.within(-9.0, 9.0), random.within(-9.0, 9.0)), random.within(20.0, 45.0))
        } else {
            Shape::star(&mut random, Vector2::zeros(), 15.0, 50.0)
        };
        let mut areas = vec![(around, true)];
        if seed % 2 == 0 {
            let (s, c) = random.within(0.0, TAU).sin_cos();
            areas.push((Shape::Circle(Vector2::new(c, s) * 18.0, random.within(3.0, 9.0)), false));
            areas.push((Shape::star(&mut random, Vector2::new(-s, c) * 20.0, 3.0, 9.0), false));
        }
        flown.upload(areas);
        for _ in 0..15 {
            if flown.server.vehicles()[0].world().plant().telemetry().is_none_or(|it| it.on_ground) {
                flown.take_off(2_000);
            }
            flown.ask_for_anything(&mut random);
        }
        let [estimate, truth] = flown.least;
        holds += flown.lines.iter().filter(|line| line.contains("geofence")).count();
        println!("seed {seed}: {estimate:.2} m, in truth {truth:.2} m");
        // The fence's margin covers wind and tracking errors. Beyond it, only the estimate's error can lead outside.
        assert!(estimate > 0.0 && truth > -2.0, "seed {seed}: {estimate} m, in truth {truth} m, {:#?}", flown.lines);
    }
    assert!(holds > 60, "{holds}");
}
