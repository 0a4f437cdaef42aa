//! The guidance's and the sensors' reasons against arming, as answers and as reported in advance.

use crate::common::{Bench, STATION};
use afbc_comms::services::{health::sensor, modes, status::SensorBits};
use afbc_comms::{AuxSensors, CALIBRATES, Comms, Setup};
use afbc_estimator::Measurement;
use afbc_flight_core::Refusal;
use afbc_guidance::{FailsafeSettings, FlightMode, Settings};
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_mavlink::{
    Address, CalibrationRequest, CommandResult, Downlink, ParameterRequest, StatusText, Telemetry, Uplink,
    VehicleCommand,
};
use afbc_onboard::{Aged, Configuration, Flight, Readings};
use afbc_types::State;
use nalgebra::Vector3;
use proptest::prelude::*;

const ARM_DISARM: u16 = 400;

/// Returns a vehicle with a monitored three-cell battery, inside its geofence of 10 m.
fn bench() -> Bench {
    let failsafe = FailsafeSettings { cells: 3, fence_radius_m: 10.0, ..FailsafeSettings::DEFAULT };
    let guidance = Settings { failsafe, ..Settings::DEFAULT };
    let mut bench = Bench::new();
    bench.flight = Flight::new(&Configuration { guidance, ..Configuration::default() }).expect("valid");
    charge(&mut bench, 12_000);
    bench
}

fn charge(bench: &mut Bench, voltage_mv: u16) {
    let battery = BatteryStatus { voltage_mv, current_ca: -1, remaining_percent: -1, consumed_mah: -1, charge: 0 };
    bench.comms.set_aux_sensors(AuxSensors { battery: Some(battery), ..AuxSensors::default() });
}

fn stand(bench: &mut Bench, ticks: u32, state: &State, readings: &Readings) -> Vec<Downlink> {
    (0..ticks)
        .flat_map(|_| {
            bench.measure(state);
            bench.sense(readings).1
        })
        .collect()
}

/// Sets the sensors' state as a shell reports it.
fn report(bench: &mut Bench, present: u32, healthy: u32) {
    let sensors = SensorBits { present, healthy };
    let battery =
        BatteryStatus { voltage_mv: 12_000, current_ca: -1, remaining_percent: -1, consumed_mah: -1, charge: 0 };
    bench.comms.set_aux_sensors(AuxSensors { battery: Some(battery), sensors, ..AuxSensors::default() });
}

/// Returns the answer to an arm command, and whether SYS_STATUS showed the vehicle as ready just before.
fn arm(bench: &mut Bench, state: &State) -> (CommandResult, bool) {
    bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: 1, index: 0 }));
    let said = stand(bench, 3, state, &Readings::NONE);
    let system = said.iter().rev().find_map(|message| match message {
        Downlink::Telemetry(Telemetry::System(system)) => Some(*system),
        _ => None,
    });
    let armable = system.expect("sent").healthy & sensor::ARMING != 0;
    bench.hear(Uplink::Command(VehicleCommand::Arm));
    let said = stand(bench, 3, state, &Readings::NONE);
    let answer = said.iter().find_map(|message| match message {
        Downlink::CommandAck { command: ARM_DISARM, answer, .. } => Some(*answer),
        _ => None,
    });
    (answer.expect("answered"), armable)
}

/// A vehicle with a faulty sensor, or one that failed its self-test, is not armed, even if another IMU is used instead.
#[test]
fn a_faulty_sensor_is_not_started_with() {
    let here = State::default();
    let imus = [sensor::GYROSCOPE | sensor::ACCELEROMETER, sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2];
    let all = imus[0] | imus[1] | sensor::MAGNETOMETER;
    for faulty in [imus[0], imus[1], sensor::MAGNETOMETER, sensor::GYROSCOPE_2] {
        let mut bench = bench();
        report(&mut bench, all, all & !faulty);
        stand(&mut bench, 1500, &here, &Readings::NONE);
        assert_eq!(arm(&mut bench, &here), refused(Refusal::SensorFailed), "{faulty:#x}");
        report(&mut bench, all, all);
        assert_eq!(arm(&mut bench, &here), (CommandResult::Accepted, true), "{faulty:#x}");
    }
}

/// A self-test is requested once, if the vehicle has sensors, is disarmed and is not being calibrated.
#[test]
fn self_tests_are_for_a_disarmed_vehicle() {
    const SELF_TEST: u16 = 31_011;
    let here = State::default();
    let ask = |bench: &mut Bench| {
        bench.hear(Uplink::Command(VehicleCommand::SelfTest));
        let said = stand(bench, 3, &here, &Readings::NONE);
        let answer = said.iter().find_map(|message| match message {
            Downlink::CommandAck { command: SELF_TEST, answer, .. } => Some(*answer),
            _ => None,
        });
        (answer.expect("answered"), [(); 2].map(|()| bench.comms.wants_self_tests()))
    };
    let mut without = bench();
    assert_eq!(ask(&mut without), (CommandResult::Unsupported, [false; 2]));
    let mut bench = bench();
    bench.comms = Comms::with(Setup { calibrates: true, ..Setup::default() });
    charge(&mut bench, 12_000);
    stand(&mut bench, 1500, &here, &Readings::NONE);
    assert_eq!(ask(&mut bench), (CommandResult::Accepted, [true, false]));
    bench.hear(Uplink::Command(VehicleCommand::Calibrate(CalibrationRequest::Gyroscope)));
    assert_eq!(ask(&mut bench), (CommandResult::Refused(CALIBRATES), [false; 2]));
    bench.hear(Uplink::Command(VehicleCommand::Calibrate(CalibrationRequest::Cancel)));
    assert_eq!(arm(&mut bench, &here).0, CommandResult::Accepted);
    assert_eq!(ask(&mut bench), (CommandResult::Refused(Refusal::AlreadyArmed as i32), [false; 2]));
}

fn refused(refusal: Refusal) -> (CommandResult, bool) {
    (CommandResult::Refused(refusal as i32), false)
}

#[test]
fn the_guidance_refuses_with_its_reason_and_stations_know_before() {
    let here = State::default();
    let mut well = bench();
    stand(&mut well, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut well, &here), (CommandResult::Accepted, true));

    let mut empty = bench();
    charge(&mut empty, 10_900);
    stand(&mut empty, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut empty, &here), refused(Refusal::BatteryLow));

    let mut lands = bench();
    lands.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Land))));
    stand(&mut lands, 1500, &here, &Readings::NONE);
    assert_eq!(
        arm(&mut lands, &here),
        (CommandResult::Accepted, true),
        "a landing on the ground is refused, and leaves no trace"
    );

    let mut carried = bench();
    stand(&mut carried, 1100, &here, &Readings::NONE);
    let there = State { position_m: Vector3::new(8.0, 8.0, 0.0), ..here };
    stand(&mut carried, 1500, &there, &Readings::NONE);
    assert_eq!(arm(&mut carried, &there), refused(Refusal::OutsideFence));

    // This magnetometer is read once and never again.
    let mut silent = bench();
    let field = Measurement::MagneticField { field: Vector3::new(0.2, 0.0, -0.4), sigma: 0.01 };
    let readings = Readings { aids: [Some(Aged { value: field, age_us: 0 }), None], ..Readings::NONE };
    stand(&mut silent, 1, &here, &readings);
    stand(&mut silent, 1500, &here, &Readings::NONE);
    assert_eq!(arm(&mut silent, &here), refused(Refusal::SensorFailed));
    stand(&mut silent, 1, &here, &readings);
    assert_eq!(arm(&mut silent, &here), (CommandResult::Accepted, true));
}

/// A vehicle that reports itself ready can be armed. It is ready after 1.1 s at rest.
#[test]
fn what_is_reported_agrees_with_the_answer() {
    let (here, moves) = (State::default(), State { velocity_m_s: Vector3::new(0.6, 0.0, 0.0), ..State::default() });
    let mut armable = Vec::new();
    for rest_ms in (800..1300).step_by(20) {
        let mut bench = Bench::new();
        stand(&mut bench, 2000, &moves, &Readings::NONE);
        stand(&mut bench, rest_ms, &here, &Readings::NONE);
        let (answer, reported) = arm(&mut bench, &here);
        assert!(!reported || answer == CommandResult::Accepted, "{rest_ms} ms: {answer:?}");
        armable.push(reported);
    }
    assert_eq!((armable.first(), armable.last()), (Some(&false), Some(&true)));
    assert!(armable.iter().skip_while(|reported| !**reported).all(|reported| *reported));
}

/// Results of a check, a status request and an arm command at once: the answer, the texts in order, and whether
/// SYS_STATUS shows the vehicle as ready.
struct Told {
    answer: CommandResult,
    checks: Vec<StatusText>,
    armable: bool,
}

/// Requests the arming checks and SYS_STATUS and arms in one tick, then stops the motors.
fn ask(bench: &mut Bench, from: Address, stands: &Stands) -> Told {
    bench.hear_from(from, Uplink::Command(VehicleCommand::CheckArming));
    bench.hear_from(from, Uplink::Command(VehicleCommand::RequestMessage { message: 1, index: 0 }));
    bench.hear_from(from, Uplink::Command(VehicleCommand::Arm));
    let mut said = stands.tick(bench).1;
    for _ in 0..4 {
        bench.hear_from(from, Uplink::Command(VehicleCommand::Kill));
        said.extend(stands.tick(bench).1);
    }
    let answer = said.iter().find_map(|message| match message {
        Downlink::CommandAck { command: ARM_DISARM, answer, .. } => Some(*answer),
        _ => None,
    });
    let armable = said.iter().find_map(|message| match message {
        Downlink::Telemetry(Telemetry::System(system)) => Some(system.healthy & sensor::ARMING != 0),
        _ => None,
    });
    let texts = said.iter().filter_map(|message| match message {
        Downlink::Text { text, .. } => Some(*text),
        _ => None,
    });
    Told { answer: answer.expect("answered"), checks: texts.collect(), armable: armable.expect("sent") }
}

/// State of a standing vehicle for some time.
#[derive(Clone, Debug)]
struct Stands {
    ticks: u32,
    state: State,
    /// False if the tracker is silent.
    seen: bool,
    /// True if the IMU is read.
    sensed: bool,
    voltage_mv: u16,
    mode: Option<FlightMode>,
    /// An arming limit that is set at the beginning.
    limit: Option<(&'static str, f32)>,
}

impl Stands {
    fn tick(&self, bench: &mut Bench) -> (afbc_onboard::Report, Vec<Downlink>) {
        if self.seen {
            bench.measure(&self.state);
        }
        let sample = [Vector3::zeros(), Vector3::new(0.0, 0.0, 9.81)];
        let imu = self.sensed.then_some(Aged { value: sample, age_us: 0 });
        bench.sense(&Readings { imu, ..Readings::NONE })
    }

    fn begin(&self, bench: &mut Bench) {
        charge(bench, self.voltage_mv);
        if let Some(mode) = self.mode {
            bench.hear(Uplink::Command(VehicleCommand::SelectMode(modes::custom(mode))));
        }
        if let Some((name, value)) = self.limit {
            let mut padded = [0; 16];
            padded.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
            let (name, value) = (padded, value.to_le_bytes());
            bench.hear(Uplink::Parameter(ParameterRequest::Set { name, value, kind: 9 }));
        }
    }
}

/// Generates sizes from the smallest limit to beyond the largest motion, uniform in their logarithm.
fn size(most: f32) -> impl Strategy<Value = f32> {
    (0.005_f32.ln()..most.ln()).prop_map(f32::exp)
}

/// Generates limits within their ranges, close to the generated motions.
fn limit() -> impl Strategy<Value = (&'static str, f32)> {
    let name = prop::sample::select(vec!["ARM_SPEED_MAX", "ARM_RATE_MAX", "ARM_TILT_MAX", "ARM_DIST_MAX"]);
    (name, size(4.0))
        .prop_map(|(name, value)| (name, value.clamp(0.01, if name == "ARM_TILT_MAX" { 0.8 } else { 4.0 })))
}

fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    let along = || prop_oneof![2 => Just(0.0), 1 => size(most), 1 => size(most).prop_map(|x| -x)];
    // Most vectors are zero, since otherwise the vehicle would hardly ever be ready.
    prop_oneof![2 => Just(Vector3::zeros()), 1 => prop::array::uniform3(along()).prop_map(Vector3::from)]
}

fn stands() -> impl Strategy<Value = Stands> {
    let state = (vector(20.0), vector(3.0), vector(0.9), vector(3.0)).prop_map(|(position, velocity, tilt, rates)| {
        State { position_m: position, velocity_m_s: velocity, attitude_rad: tilt, rates_rad_s: rates }
    });
    let mode = prop::option::weighted(0.2, prop::sample::select(FlightMode::ALL.to_vec()));
    let voltage = prop_oneof![6 => Just(12_000_u16), 1 => Just(10_000)];
    let ticks = prop_oneof![1 => 1_u32..900, 2 => 980_u32..1100];
    let flags = (prop::bool::weighted(0.9), prop::bool::weighted(0.05));
    (ticks, state, flags, voltage, mode, prop::option::of(limit())).prop_map(
        |(ticks, state, (seen, sensed), voltage_mv, mode, limit)| Stands {
            ticks,
            state,
            seen,
            sensed,
            voltage_mv,
            mode,
            limit,
        },
    )
}

/// Returns a vehicle with these arming limits and a link fast enough for every text.
fn limited(limits: &[f32; 4]) -> Bench {
    let failsafe = FailsafeSettings { cells: 3, fence_radius_m: 10.0, ..FailsafeSettings::DEFAULT };
    let [speed_max_m_s, rate_max_rad_s, tilt_max_rad, setpoint_distance_max_m] = *limits;
    let arming = afbc_onboard::ArmingLimits {
        tilt_max_rad: tilt_max_rad.clamp(0.01, 0.8),
        setpoint_distance_max_m: setpoint_distance_max_m.max(0.01),
        speed_max_m_s: speed_max_m_s.max(0.01),
        rate_max_rad_s: rate_max_rad_s.max(0.01),
    };
    let configuration =
        Configuration { guidance: Settings { failsafe, ..Settings::DEFAULT }, arming, ..Configuration::default() };
    let mut bench = Bench::new();
    bench.flight = Flight::new(&configuration).expect("valid");
    bench.table = afbc_onboard::parameters::ParameterTable::new(configuration);
    bench.comms = Comms::with(Setup { bytes_per_s: 1_000_000, ..Setup::default() });
    bench
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// The checks say "ready to arm", and SYS_STATUS shows the vehicle as ready, exactly if an arm command is accepted
    /// in that tick. Otherwise the checks begin with the reason of the refusal. This holds for any limits and states,
    /// also if limits change meanwhile.
    #[test]
    fn the_report_is_what_the_flight_core_decides(
        limits in prop::array::uniform4(size(4.0)),
        spells in prop::collection::vec(stands(), 1..6),
    ) {
        let mut bench = limited(&limits);
        for spell in &spells {
            spell.begin(&mut bench);
            for _ in 0..spell.ticks {
                spell.tick(&mut bench);
            }
            let Told { answer, checks, armable } = ask(&mut bench, STATION, spell);
            let first = checks.first().copied();
            let expected = match answer {
                CommandResult::Accepted => StatusText::from("ready to arm"),
                CommandResult::Refused(number) => {
                    let refusal = Refusal::ALL.into_iter().find(|refusal| *refusal as i32 == number);
                    StatusText::from(refusal.expect("the flight core's").reason())
                }
                answer => return Err(TestCaseError::fail(format!("{answer:?}"))),
            };
            prop_assert_eq!(first, Some(expected), "{:?}, {:?}", answer, checks);
            prop_assert_eq!(armable, answer == CommandResult::Accepted);
            prop_assert_eq!(checks.contains(&StatusText::from("ready to arm")), answer == CommandResult::Accepted);
        }
    }
}

/// The checks must use the limits of the parameters. They once used the default limits.
#[test]
fn the_limits_of_the_parameters_count() {
    let creeps = |speed_m_s: f32| State { velocity_m_s: Vector3::new(speed_m_s, 0.0, 0.0), ..State::default() };
    for (limit, speed_m_s, ready) in [(0.01, 0.1, false), (0.5, 0.1, true), (0.5, 0.6, false), (2.0, 0.6, true)] {
        let mut bench = limited(&[limit, 0.5, 0.26, 2.0]);
        let spell = Stands {
            ticks: 1100,
            state: creeps(speed_m_s),
            seen: true,
            sensed: false,
            voltage_mv: 12_000,
            mode: None,
            limit: None,
        };
        spell.begin(&mut bench);
        for _ in 0..spell.ticks {
            spell.tick(&mut bench);
        }
        let reported = ask(&mut bench, STATION, &spell);
        let (answer, text) = if ready {
            (CommandResult::Accepted, "ready to arm")
        } else {
            (CommandResult::Refused(Refusal::NotAtRest as i32), Refusal::NotAtRest.reason())
        };
        assert_eq!((reported.answer, reported.armable), (answer, ready));
        assert_eq!(reported.checks.first(), Some(&StatusText::from(text)));
    }
}

/// A station that is not in control is told so, since its arm command would be refused.
#[test]
fn a_station_that_may_not_arm_does_not_read_that_it_may() {
    const OTHER: Address = Address { system: 245, component: 190 };
    let mut bench = limited(&[0.5, 0.5, 0.26, 2.0]);
    let spell = Stands {
        ticks: 1100,
        state: State::default(),
        seen: true,
        sensed: false,
        voltage_mv: 12_000,
        mode: Some(FlightMode::Hold),
        limit: None,
    };
    spell.begin(&mut bench);
    for _ in 0..spell.ticks {
        spell.tick(&mut bench);
    }
    let mine = StatusText::from("ready to arm");
    let theirs = StatusText::from("245/190 may not arm: 255/190 is in control");
    let reported = ask(&mut bench, OTHER, &spell);
    assert_eq!(reported.answer, CommandResult::Refused(afbc_comms::NOT_IN_CONTROL));
    assert!(reported.checks.contains(&theirs) && !reported.checks.contains(&mine), "{:?}", reported.checks);
    // If both stations ask at once, each gets its text.
    bench.hear_from(OTHER, Uplink::Command(VehicleCommand::CheckArming));
    let reported = ask(&mut bench, STATION, &spell);
    assert_eq!(reported.answer, CommandResult::Accepted);
    assert!(reported.checks.contains(&theirs) && reported.checks.contains(&mine), "{:?}", reported.checks);
}
