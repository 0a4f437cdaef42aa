//! Calibration from a station's point of view: commands, texts, and the parameters that are set.

use crate::common::Bench;
use afbc_calibration::{RawSample, Side};
use afbc_comms::{BUSY, Calibrator, Comms, Setup};
use afbc_flight_core::{Mode, Refusal};
use afbc_mavlink::{CalibrationRequest, CommandResult, Downlink, MavSeverity, Storage, Uplink, VehicleCommand};
use afbc_onboard::Report;
use nalgebra::{Matrix3, Rotation3, Vector3};

const CALIBRATION: u16 = 241;
const GRAVITY: f32 = 9.81;
const INFO: MavSeverity = MavSeverity::MAV_SEVERITY_INFO;
const WARNING: MavSeverity = MavSeverity::MAV_SEVERITY_WARNING;

/// A disarmed vehicle with sensors.
struct Vehicle {
    bench: Bench,
    calibrator: Calibrator,
    idle: Report,
    mode: Mode,
    answers: Vec<CommandResult>,
    texts: Vec<(MavSeverity, String)>,
}

/// Returns a sample of a level vehicle at rest.
fn level() -> RawSample {
    let specific_force_m_s2 = Vector3::new(0.0, 0.0, GRAVITY);
    RawSample { at_us: 0, rates_rad_s: Vector3::zeros(), specific_force_m_s2, field_ut: None }
}

impl Vehicle {
    fn new() -> Self {
        let mut bench = Bench::new();
        bench.comms = Comms::with(Setup { calibrates: true, bytes_per_s: 100_000, ..Setup::default() });
        let (idle, _) = bench.step();
        let calibrator = Calibrator::new();
        Vehicle { bench, calibrator, idle, mode: Mode::Disarmed, answers: Vec::new(), texts: Vec::new() }
    }

    fn ask(&mut self, what: CalibrationRequest) {
        self.bench.hear(Uplink::Command(VehicleCommand::Calibrate(what)));
    }

    /// Runs a tick of 20 ms with a sample, if there is one.
    fn tick(&mut self, sample: Option<RawSample>) {
        self.bench.now_us += 20_000;
        let sample = sample.map(|sample| RawSample { at_us: self.bench.now_us, ..sample });
        let report = Report { time_us: self.bench.now_us, mode: self.mode, ..self.idle };
        let said = self.bench.said(&report);
        let Bench { comms, table, .. } = &mut self.bench;
        comms.calibrate(&mut self.calibrator, sample, table, |_| panic!("no station has asked for the samples"));
        for message in said {
            match message {
                Downlink::CommandAck { command: CALIBRATION, answer, .. } => self.answers.push(answer),
                Downlink::Text { severity, text } => {
                    self.texts.push((severity, text.to_str().expect("words").to_owned()));
                }
                _ => (),
            }
        }
    }

    /// Runs ticks for a time. Returns the texts.
    fn pass(&mut self, seconds: f32, sample: Option<RawSample>) -> Vec<String> {
        let before = self.texts.len();
        (0..(50.0 * seconds) as u32).for_each(|_| self.tick(sample));
        self.texts[before..].iter().map(|(_, text)| text.clone()).collect()
    }

    fn value(&self, name: &str) -> f32 {
        let found = self.bench.table.iter().find(|parameter| parameter.name.as_str() == name);
        found.expect("a parameter").value
    }

    fn values(&self, group: &str) -> Vector3<f32> {
        Vector3::from(["X", "Y", "Z"].map(|axis| self.value(&format!("{group}{axis}"))))
    }

    /// Returns the changes of parameters.
    fn set(&self) -> Vec<String> {
        self.bench.changes.iter().map(|change| format!("{change:?}")).collect()
    }
}

#[test]
fn the_gyroscopes_offset_is_found() {
    let mut vehicle = Vehicle::new();
    let offset = Vector3::new(0.1, -0.2, 0.3);
    vehicle.ask(CalibrationRequest::Gyroscope);
    assert!(vehicle.bench.comms.takes_samples());
    let texts = vehicle.pass(4.0, Some(RawSample { rates_rad_s: offset, ..level() }));
    let mut expected = vec!["[cal] calibration started: 2 gyro".to_owned()];
    expected.extend((1..10).map(|tenth| format!("[cal] progress <{tenth}0>")));
    expected.push("[cal] calibration done: gyro".to_owned());
    assert_eq!(texts, expected);
    assert!(vehicle.texts.iter().all(|(severity, _)| *severity == INFO));
    assert!((vehicle.values("CAL_GYRO0_OFF_") - offset).amax() < 1e-5);
    // Each value is set once, and no others.
    assert_eq!(vehicle.set().len(), 3, "{:?}", vehicle.set());
    assert_eq!(
        (vehicle.answers.as_slice(), vehicle.bench.comms.takes_samples()),
        (&[CommandResult::Accepted][..], false)
    );
    // The next calibration starts afresh and finds its own offset.
    vehicle.ask(CalibrationRequest::Gyroscope);
    let texts = vehicle.pass(4.0, Some(RawSample { rates_rad_s: -offset, ..level() }));
    assert_eq!(texts.last().map(String::as_str), Some("[cal] calibration done: gyro"));
    assert!((vehicle.values("CAL_GYRO0_OFF_") + offset).amax() < 1e-5);
}

/// A cancelled calibration does not affect the next one.
#[test]
fn the_mounting_is_found() {
    let mut vehicle = Vehicle::new();
    vehicle.ask(CalibrationRequest::Gyroscope);
    vehicle.pass(1.0, Some(level()));
    vehicle.ask(CalibrationRequest::Cancel);
    vehicle.pass(0.1, Some(level()));
    let attitude = Rotation3::from_euler_angles(0.05, -0.1, 0.0);
    let specific_force_m_s2 = attitude.inverse() * Vector3::new(0.0, 0.0, GRAVITY);
    vehicle.ask(CalibrationRequest::Level);
    let texts = vehicle.pass(3.0, Some(RawSample { specific_force_m_s2, ..level() }));
    assert_eq!(texts, ["[cal] calibration started: 2 level", "[cal] progress <50>", "[cal] calibration done: level"]);
    let found = vehicle.values("IMU_ATT_");
    let turned = Rotation3::from_euler_angles(found.x, found.y, found.z) * specific_force_m_s2;
    assert!((turned - Vector3::new(0.0, 0.0, GRAVITY)).amax() < 1e-3, "{found}");
    assert_eq!(vehicle.set().len(), 3, "{:?}", vehicle.set());
}

#[test]
fn the_accelerometers_errors_are_found() {
    let mut vehicle = Vehicle::new();
    let (offset, scale) = (Vector3::new(0.2, -0.3, 0.1), Vector3::new(1.02, 0.98, 1.05));
    vehicle.ask(CalibrationRequest::Accelerometer);
    let names = ["back", "front", "left", "right", "up", "down"];
    for (place, (side, name)) in Side::ALL.into_iter().zip(names).enumerate() {
        let read = (side.up() * GRAVITY).component_div(&scale) + offset;
        let texts = vehicle.pass(3.0, Some(RawSample { specific_force_m_s2: read, ..level() }));
        let mut expected = Vec::new();
        if place == 0 {
            expected.push("[cal] calibration started: 2 accel".to_owned());
            expected.push("[cal] pending: back front left right up down".to_owned());
            expected.push("[cal] hold vehicle still on a pending side".to_owned());
        }
        expected.push(format!("[cal] {name} orientation detected"));
        expected.push(format!("[cal] {name} side done, rotate to a different side"));
        expected.push(format!("[cal] progress <{}>", [17, 34, 50, 67, 84, 100][place]));
        if place < 5 {
            expected.push(format!("[cal] pending: {}", names[place + 1..].join(" ")));
            expected.push("[cal] hold vehicle still on a pending side".to_owned());
        } else {
            expected.push("[cal] calibration done: accel".to_owned());
        }
        assert_eq!(texts, expected);
    }
    assert!((vehicle.values("CAL_ACC0_OFF_") - offset).amax() < 1e-3);
    assert!((vehicle.values("CAL_ACC0_SCALE_") - scale).amax() < 1e-4);
    assert_eq!(vehicle.set().len(), 6, "{:?}", vehicle.set());
}

/// Texts tell the user about a movement, a side that is already done and an orientation between sides.
#[test]
fn what_a_hand_does_wrong_is_said() {
    let mut vehicle = Vehicle::new();
    vehicle.ask(CalibrationRequest::Accelerometer);
    let rest = |side: Side| Some(RawSample { specific_force_m_s2: side.up() * GRAVITY, ..level() });
    vehicle.pass(3.0, rest(Side::Left));
    vehicle.pass(0.1, rest(Side::Up));
    assert_eq!(vehicle.pass(1.0, rest(Side::Left)), ["[cal] left side already completed"]);
    let askew = Rotation3::from_euler_angles(0.8, 0.0, 0.0) * Vector3::new(0.0, 0.0, GRAVITY);
    let texts = vehicle.pass(1.0, Some(RawSample { specific_force_m_s2: askew, ..level() }));
    assert_eq!(texts, ["[cal] no side faces down, rotate to one"]);
    vehicle.pass(1.0, rest(Side::Down));
    assert_eq!(vehicle.pass(0.2, rest(Side::Up)), ["[cal] detected motion, hold still..."]);
}

#[test]
fn the_magnetometers_errors_are_found() {
    let mut vehicle = Vehicle::new();
    let offset = Vector3::new(12.0, -7.0, 20.0);
    let matrix = Matrix3::new(1.05, 0.02, -0.01, 0.02, 0.97, 0.03, -0.01, 0.03, 1.01);
    let iron = matrix.try_inverse().expect("regular");
    let field = Vector3::new(21.0, 0.0, -43.0);
    vehicle.ask(CalibrationRequest::Magnetometer);
    for side in Side::ALL {
        let up = Rotation3::rotation_between(&side.up(), &Vector3::z());
        let up = up.unwrap_or_else(|| Rotation3::from_euler_angles(std::f32::consts::PI, 0.0, 0.0));
        for tick in 0..450 {
            // The vehicle rests for one second, then makes one turn in seven seconds.
            let turned = (tick as f32 - 50.0).max(0.0) / 350.0 * std::f32::consts::TAU;
            let to_body = (Rotation3::from_axis_angle(&Vector3::z_axis(), turned) * up).inverse();
            let spin = if tick < 50 { 0.0 } else { std::f32::consts::TAU / 7.0 };
            vehicle.tick(Some(RawSample {
                at_us: 0,
                rates_rad_s: to_body * Vector3::new(0.0, 0.0, spin),
                specific_force_m_s2: to_body * Vector3::new(0.0, 0.0, GRAVITY),
                field_ut: Some(iron * (to_body * field) + offset),
            }));
        }
    }
    let said = |text: &str| vehicle.texts.iter().filter(|(_, said)| said == text).count();
    assert_eq!(said("[cal] calibration started: 2 mag"), 1);
    assert_eq!(said("[cal] rotate vehicle around the vertical"), 6, "{:?}", vehicle.texts);
    assert_eq!(said("[cal] calibration done: mag"), 1, "{:?}", vehicle.texts);
    assert!((vehicle.values("CAL_MAG0_OFF_") - offset).amax() < 0.1);
    // The scale is known up to a factor, since the field's strength is not known.
    let [s, d] = ["CAL_MAG0_SCALE_", "CAL_MAG0_ODIAG_"].map(|group| vehicle.values(group));
    let found = Matrix3::new(s.x, d.x, d.y, d.x, s.y, d.z, d.y, d.z, s.z);
    let found = found * (matrix.trace() / found.trace());
    assert!((found - matrix).amax() < 2e-3, "{found}");
    assert_eq!(vehicle.set().len(), 9, "{:?}", vehicle.set());
}

/// Calibration fails with a reason, and sets nothing, if the vehicle moves or is armed, or if the sensors are silent or
/// implausible.
#[test]
fn a_failure_is_told_with_its_reason() {
    let rocks = |tick: u32| RawSample { rates_rad_s: Vector3::repeat((tick % 2) as f32), ..level() };
    let mut vehicle = Vehicle::new();
    vehicle.ask(CalibrationRequest::Gyroscope);
    (0..1100).for_each(|tick| vehicle.tick(Some(rocks(tick))));
    assert_eq!(vehicle.texts.last(), Some(&(WARNING, "[cal] calibration failed: vehicle moved".to_owned())));
    assert!(!vehicle.bench.comms.takes_samples());

    vehicle.ask(CalibrationRequest::Gyroscope);
    let texts = vehicle.pass(4.0, Some(RawSample { rates_rad_s: Vector3::repeat(0.9), ..level() }));
    assert_eq!(texts.last().map(String::as_str), Some("[cal] calibration failed: sensor errors too large"));

    // The sensors may be silent, or give what is no number, for up to a second, at the beginning and later.
    let broken = RawSample { specific_force_m_s2: Vector3::repeat(f32::NAN), ..level() };
    for (before, silence) in [(0.0, None), (1.0, None), (0.0, Some(broken)), (1.0, Some(broken))] {
        vehicle.ask(CalibrationRequest::Gyroscope);
        vehicle.pass(before, Some(level()));
        vehicle.pass(0.96, silence);
        assert!(vehicle.bench.comms.takes_samples());
        let texts = vehicle.pass(0.1, silence);
        assert_eq!(texts, ["[cal] calibration failed: no sensor readings"], "after {before} s");
        assert!(vehicle.pass(2.0, None).is_empty(), "once");
    }

    vehicle.ask(CalibrationRequest::Gyroscope);
    vehicle.pass(1.0, Some(level()));
    vehicle.mode = Mode::Flying;
    assert_eq!(vehicle.pass(4.0, Some(level())), ["[cal] calibration failed: armed"]);
    vehicle.answers.clear();
    vehicle.ask(CalibrationRequest::Gyroscope);
    assert!(vehicle.pass(4.0, Some(level())).is_empty());
    assert_eq!(vehicle.answers, [CommandResult::Refused(Refusal::AlreadyArmed as i32)]);
    assert_eq!(vehicle.set(), Vec::<String>::new());
}

/// Calibration fails if the parameters differ from the result in the end, here because a station resets them meanwhile.
#[test]
fn a_result_is_what_the_parameters_have() {
    let mut vehicle = Vehicle::new();
    vehicle.ask(CalibrationRequest::Gyroscope);
    let offset = RawSample { rates_rad_s: Vector3::repeat(0.01), ..level() };
    let found = (0..250).any(|_| {
        vehicle.tick(Some(offset));
        !vehicle.bench.changes.is_empty()
    });
    assert!(found);
    vehicle.bench.hear(Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    vehicle.pass(5.0, Some(offset));
    assert_eq!(vehicle.texts.last(), Some(&(WARNING, "[cal] calibration failed: values not accepted".to_owned())));
}

/// Only one calibration runs at a time. Cancelling it sends a text only if one is running.
#[test]
fn one_is_calibrated_at_a_time() {
    let mut vehicle = Vehicle::new();
    vehicle.ask(CalibrationRequest::Level);
    vehicle.tick(Some(level()));
    vehicle.ask(CalibrationRequest::Gyroscope);
    vehicle.bench.hear(Uplink::Command(VehicleCommand::Arm));
    vehicle.pass(0.1, Some(level()));
    assert_eq!(vehicle.answers, [CommandResult::Accepted, CommandResult::Refused(BUSY)]);
    assert_eq!(
        vehicle.texts,
        [(INFO, "[cal] calibration started: 2 level".into()), (WARNING, "arming refused: calibrating".into())]
    );
    for _ in 0..2 {
        vehicle.ask(CalibrationRequest::Cancel);
        vehicle.pass(0.1, Some(level()));
    }
    assert_eq!(vehicle.texts[2..], [(INFO, "[cal] calibration cancelled".to_owned())]);
    assert_eq!(vehicle.answers[2..], [CommandResult::Accepted; 2]);
    assert!(vehicle.pass(4.0, Some(level())).is_empty());
    // A vehicle without sensors supports neither calibration nor its cancellation.
    let mut without = Vehicle::new();
    without.bench.comms = Comms::new();
    for what in [CalibrationRequest::Gyroscope, CalibrationRequest::Cancel] {
        without.ask(what);
        without.tick(None);
        without.tick(None);
    }
    assert_eq!((without.answers, without.texts), (vec![CommandResult::Unsupported; 2], vec![]));
}
