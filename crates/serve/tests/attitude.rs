//! Offboard targets of attitude and thrust in closed loop, without clock and sockets.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc::Trip;
use afbc_comms::services::modes;
use afbc_guidance::FlightMode;
use afbc_mavlink::{Address, AttitudeAndThrust, Encoder, ExternalTarget, FRAME_MAX, Uplink, VehicleCommand};
use afbc_plant::Motion;
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};
use afbc_types::Axis;
use nalgebra::{UnitQuaternion, Vector3};

const STATION: Address = Address { system: 255, component: 190 };

struct Flown {
    server: Server,
    lines: Vec<String>,
}

impl Flown {
    fn hear(&mut self, message: Uplink) {
        self.server.hear(0, 1, Encoder::new(STATION).send(&message, &mut [0; FRAME_MAX]));
    }

    fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            let Flown { server, lines } = self;
            let _ = server.step(|_, _| (), |line| lines.push(line.into()));
        }
    }

    fn motion(&self) -> Motion {
        self.server.vehicles().first().unwrap().world().plant().motion()
    }

    /// Takes off and holds some metres above the ground.
    fn hovering(scenario: &str) -> Self {
        let scenario = built_in(scenario).unwrap().read().unwrap();
        let mut flown = Flown { server: Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap(), lines: Vec::new() };
        flown.run(15_000);
        flown.hear(Uplink::Command(VehicleCommand::Arm));
        flown.run(100);
        flown.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Takeoff))));
        flown.run(10_000);
        flown
    }

    /// Follows a velocity for this time.
    fn fly(&mut self, [x, y, z]: [f32; 3], milliseconds: u32) {
        let velocity_m_s = Vector3::new(x, y, z);
        for time_ms in 0..milliseconds {
            if time_ms % 50 == 0 {
                self.hear(Uplink::Target(ExternalTarget::Motion(afbc_mavlink::PositionTarget {
                    velocity_m_s,
                    ..afbc_mavlink::PositionTarget::NONE
                })));
            }
            if time_ms == 50 {
                self.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Offboard))));
            }
            self.run(1);
        }
    }

    /// Follows an attitude and a thrust for this time; returns the motion every tenth of a second.
    fn lean(&mut self, roll_rad: f32, pitch_rad: f32, thrust: f32, milliseconds: u32) -> Vec<Motion> {
        let yaw_rad = self.motion().attitude_rad.z as f32;
        let q = UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
        let target = AttitudeAndThrust { attitude: [q.w, q.i, q.j, q.k], yaw_rate_rad_s: f32::NAN, thrust };
        let mut motions = Vec::new();
        for time_ms in 0..milliseconds {
            if time_ms % 20 == 0 {
                self.hear(Uplink::Target(ExternalTarget::Attitude(target)));
            }
            if time_ms == 20 {
                self.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Offboard))));
            }
            if time_ms % 100 == 0 {
                motions.push(self.motion());
            }
            self.run(1);
        }
        motions
    }

    /// Checks that the monitor has not switched AFBC off.
    fn has_not_tripped(&self, what: &str) {
        let tripped = |line: &&String| {
            Axis::ALL.iter().any(|axis| {
                [Trip::Theta(*axis), Trip::Delta(*axis), Trip::Error(*axis), Trip::LimitCycle(*axis), Trip::Saturation]
                    .iter()
                    .any(|trip| line.contains(trip.reason()))
            })
        };
        assert_eq!(self.lines.iter().find(tripped), None, "{what}");
    }
}

/// An attitude is held, whatever the law has adapted to before: wind, or a manoeuvre.
#[test]
fn an_attitude_is_held() {
    for name in ["mocap", "outdoor"] {
        for (roll_rad, pitch_rad) in [(-0.1_f32, 0.0_f32), (0.06, 0.12)] {
            let mut flown = Flown::hovering(name);
            if roll_rad < 0.0 {
                // Start at high speed.
                flown.fly([3.0, -2.0, 0.3], 2500);
            }
            let motions = flown.lean(roll_rad, pitch_rad, 0.4, 3000);
            for motion in motions.iter().skip(12) {
                let off_rad = motion.attitude_rad.xy() - nalgebra::Vector2::new(roll_rad, pitch_rad).cast::<f64>();
                assert!(off_rad.norm() < 0.04, "{name}: {} of {roll_rad} {pitch_rad}", motion.attitude_rad);
            }
            flown.has_not_tripped(name);
        }
    }
}

/// With more thrust than the weight the vehicle climbs, at most at the limit; with less it sinks.
#[test]
fn thrust_climbs_and_sinks_within_limits() {
    for name in ["mocap", "outdoor"] {
        let mut flown = Flown::hovering(name);
        for motion in flown.lean(0.0, 0.0, 0.5, 25_000).iter().skip(30) {
            assert!((2.5..3.5).contains(&motion.velocity_m_s.z), "{name}: {}", motion.velocity_m_s);
        }
        for motion in flown.lean(0.0, 0.0, 0.2, 20_000).iter().skip(40) {
            assert!((-2.0..-1.0).contains(&motion.velocity_m_s.z), "{name}: {}", motion.velocity_m_s);
        }
        flown.has_not_tripped(name);
    }
}

#[test]
fn a_return_ends_on_the_ground_without_a_trip() {
    for name in ["mocap", "outdoor"] {
        let mut flown = Flown::hovering(name);
        flown.fly([4.0, 3.0, 0.0], 4000);
        flown.hear(Uplink::Command(VehicleCommand::Return));
        flown.run(60_000);
        assert!(flown.lines.last().unwrap().contains("disarmed"), "{name}: {:?}", flown.lines);
        flown.has_not_tripped(name);
    }
}
