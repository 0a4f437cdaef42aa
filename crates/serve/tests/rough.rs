//! Whole flights with bad sensors: a tracker whose frame jumps, GNSS that comes back, vibrating rotors.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_mavlink::{Address, Datum, Encoder, FRAME_MAX, Height, Uplink, VehicleCommand};
use afbc_scenario::{Scenario, built_in};
use afbc_serve::{Server, fleet};
use nalgebra::Vector3;

const STATION: Address = Address { system: 255, component: 190 };
/// Times of the commands, and time from which the vehicle holds \[ms\].
const ARM: u64 = 6_000;
const TAKE_OFF: u64 = 6_300;
const HOLDS: u64 = 16_000;
/// Farthest distance that a jump may move the vehicle \[m\].
const MOVES_M: f64 = 0.5;

/// A vehicle that takes off, and its logged lines.
struct Session {
    server: Server,
    sender: Encoder,
    ms: u64,
    lines: Vec<String>,
}

impl Session {
    fn new(scenario: Scenario) -> Self {
        let server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        Session { server, sender: Encoder::new(STATION), ms: 0, lines: Vec::new() }
    }

    fn named(name: &str, seed: u64) -> Self {
        Session::new(Scenario { seed, ..built_in(name).unwrap().read().unwrap() })
    }

    fn say(&mut self, command: VehicleCommand) {
        let message = Uplink::Command(command);
        self.server.hear(0, 1, self.sender.send(&message, &mut [0; FRAME_MAX]));
    }

    fn line(&mut self, line: &str) {
        assert_eq!(self.server.line(line).lines, [format!("ok {line}")]);
    }

    /// Flies until this time; returns the largest distance from the start of this call \[m\].
    fn run(&mut self, until_ms: u64) -> f64 {
        let (from_m, mut off_m) = (self.true_m(), 0.0_f64);
        while self.ms < until_ms {
            match self.ms {
                ARM => self.say(VehicleCommand::Arm),
                TAKE_OFF => self.say(VehicleCommand::TakeOff(Height { metres: 6.0, above: Datum::Here })),
                _ if self.ms.is_multiple_of(1_000) => {
                    self.server.hear(0, 1, self.sender.send(&Uplink::Heartbeat, &mut [0; FRAME_MAX]));
                }
                _ => {}
            }
            let lines = &mut self.lines;
            let _ = self.server.step(|_, _| (), |line| lines.push(line.to_owned()));
            self.ms += 1;
            off_m = off_m.max((self.true_m() - from_m).norm());
        }
        off_m
    }

    fn true_m(&self) -> Vector3<f64> {
        self.server.vehicles().first().unwrap().world().plant().motion().position_m
    }

    fn says(&self, text: &str) -> bool {
        self.lines.iter().any(|line| line.contains(text))
    }
}

/// A jump of the tracker's frame, of any size, does not move a vehicle in hold.
#[test]
fn a_frame_that_jumps_does_not_move_the_vehicle() {
    for (seed, length_m) in (1..).zip([0.3, 1.0, 3.0, 10.0, 30.0, 100.0]) {
        let mut session = Session::named("mocap", seed);
        session.run(HOLDS);
        assert!(session.true_m().z > 5.0, "{:?}", session.lines);
        let angle = seed as f64 * 2.4;
        let by_m = Vector3::new(angle.cos(), angle.sin(), (seed as f64 * 1.7).sin()).normalize() * length_m;
        session.line(&format!("fault tracker jumped {} {} {} 0", by_m.x, by_m.y, by_m.z));
        let off_m = session.run(HOLDS + 10_000);
        assert!(off_m < MOVES_M, "{length_m} m: {off_m} m, {:#?}", session.lines);
    }
}

/// GNSS fails twice for 5.5 s. Afterwards the vehicle accepts commands, and does not land.
#[test]
fn gnss_that_comes_back_gives_back_what_was_flown() {
    let mut session = Session::named("outdoor", 3);
    session.run(HOLDS);
    session.line("fault gnss lost 5.5");
    session.run(HOLDS + 9_000);
    assert!(session.says("hold: the state estimate is back"), "{:#?}", session.lines);
    session.line("fault gnss lost 5.5");
    session.run(HOLDS + 9_000 + 5_800);
    // GNSS is back, but the descent has not ended yet: it continues for another second.
    session.say(VehicleCommand::Return);
    session.run(HOLDS + 9_000 + 7_000);
    assert!(session.says("return: ordered") && !session.says("refused"), "{:#?}", session.lines);
    assert!(!session.says("AFBC off"), "{:#?}", session.lines);
}

/// The rotors shake the IMU. The cases give rates, accelerations and whether a text warns of vibration. AFBC flies on,
/// up to and including the landing.
#[test]
fn vibration_does_not_hand_afbc_over() {
    let cases = [(0.02, 1.0, false), (0.1, 1.5, false), (0.2, 1.5, false), (0.1, 4.0, true), (0.2, 5.0, true)];
    let cases = cases.into_iter().flat_map(|case| ["mocap", "outdoor"].map(|name| (name, case)));
    for (name, (gyro_rad_s, accel_m_s2, told)) in cases {
        let mut scenario = built_in(name).unwrap().read().unwrap();
        let imu = scenario.instruments.imu.as_mut().unwrap();
        (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (gyro_rad_s, accel_m_s2);
        let mut session = Session::new(scenario);
        session.run(HOLDS + 4_000);
        session.say(VehicleCommand::Land);
        session.run(HOLDS + 24_000);
        assert!(!session.says("AFBC off"), "{name} {gyro_rad_s}: {:#?}", session.lines);
        assert!(session.says("disarmed"), "{name} {gyro_rad_s}: {:#?}", session.lines);
        assert_eq!(session.says("vibration above"), told, "{name} {accel_m_s2}: {:#?}", session.lines);
    }
}
