//! A station calibrates a served vehicle while a hand turns it. Checked are the texts as MAVSDK and QGroundControl
//! parse them, the parameters, and the sensors' true errors.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_mavlink::{
    Address, CalibrationRequest, CommandResult, Decoder, Downlink, Encoder, FRAME_MAX, Uplink, VehicleCommand,
};
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{ImuModel, MagnetometerModel};
use afbc_scenario::built_in;
use afbc_serve::{Server, fleet};
use afbc_types::nalgebra::Vector3;
use std::collections::BTreeMap;

const STATION: Address = Address { system: 255, component: 190 };
const CALIBRATE: u16 = 241;

/// Result of MAVSDK's parser, `CalibrationStatustextParser`, for one text; by the formats of its `sscanf`.
#[derive(Clone, Debug, PartialEq)]
enum Status {
    Started(String),
    Done(String),
    Failed(String),
    Cancelled,
    Progress(u32),
    Instruction(String),
}

fn parse(text: &str) -> Option<Status> {
    let rest = text.strip_prefix("[cal] ")?;
    if let Some(percent) = rest.strip_prefix("progress <") {
        let percent = percent.strip_suffix('>').unwrap().parse().unwrap();
        assert!(percent <= 100);
        return Some(Status::Progress(percent));
    }
    if let Some(started) = rest.strip_prefix("calibration started: ") {
        // QGroundControl expects the version and one word, as MAVSDK does.
        let words: Vec<_> = started.split(' ').collect();
        assert_eq!((words.len(), words[0]), (2, "2"), "{text}");
        return Some(Status::Started(words[1].into()));
    }
    if let Some(done) = rest.strip_prefix("calibration done: ") {
        return Some(Status::Done(done.into()));
    }
    if let Some(reason) = rest.strip_prefix("calibration failed: ") {
        assert!(!reason.is_empty() && reason.len() <= 63);
        return Some(Status::Failed(reason.into()));
    }
    if rest == "calibration cancelled" {
        return Some(Status::Cancelled);
    }
    assert!(rest.len() <= 63);
    Some(Status::Instruction(rest.into()))
}

struct Served {
    server: Server,
    decoder: Decoder<Downlink>,
    texts: Vec<String>,
    answers: Vec<CommandResult>,
    parameters: BTreeMap<String, f32>,
}

impl Served {
    fn new(suite: impl FnOnce(InstrumentSuite) -> InstrumentSuite, seed: u64) -> Self {
        let mut scenario = built_in("outdoor").unwrap().read().unwrap();
        scenario.instruments = suite(scenario.instruments);
        scenario.seed = seed;
        let server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        let mut served = Served {
            server,
            decoder: Decoder::new(STATION),
            texts: Vec::new(),
            answers: Vec::new(),
            parameters: BTreeMap::new(),
        };
        served.run(2_000);
        served
    }

    fn run(&mut self, milliseconds: u32) {
        let Served { server, decoder, texts, answers, parameters } = self;
        for _ in 0..milliseconds {
            let hear = |_: usize, bytes: &[u8]| {
                decoder.feed(bytes, |_, message| match message {
                    Downlink::Text { text, .. } => texts.push(text.to_str().unwrap_or_default().into()),
                    Downlink::CommandAck { command: CALIBRATE | 400, answer, .. } => answers.push(answer),
                    Downlink::Parameter(value) => {
                        let name: String =
                            value.name.iter().take_while(|it| **it != 0).map(|it| char::from(*it)).collect();
                        parameters.insert(name, f32::from_le_bytes(value.value));
                    }
                    _ => (),
                });
            };
            let _ = server.step(hear, |_| ());
        }
    }

    fn ask(&mut self, command: VehicleCommand) {
        self.server.hear(0, 1, Encoder::new(STATION).send(&Uplink::Command(command), &mut [0; FRAME_MAX]));
        self.answers.clear();
        self.run(20);
    }

    fn begin(&mut self, what: CalibrationRequest) {
        self.texts.clear();
        self.ask(VehicleCommand::Calibrate(what));
        assert_eq!(self.answers, [CommandResult::Accepted]);
    }

    fn line(&mut self, line: &str) {
        assert_eq!(self.server.line(line).lines, [format!("ok {line}")]);
    }

    fn statuses(&self) -> Vec<Status> {
        self.texts.iter().filter_map(|text| parse(text)).collect()
    }

    fn vector(&self, prefix: &str) -> Vector3<f32> {
        let at = |axis| self.parameters.get(&format!("{prefix}_{axis}")).copied().unwrap_or(f32::NAN);
        Vector3::new(at('X'), at('Y'), at('Z'))
    }
}

fn cheap(suite: InstrumentSuite) -> InstrumentSuite {
    let magnetometer = MagnetometerModel { hard_iron_ut: 20.0, soft_iron: 0.03, ..MagnetometerModel::QMC5883L };
    InstrumentSuite { imu: Some(ImuModel::MPU_6000), magnetometer: Some(magnetometer), ..suite }
}

fn instruction(text: &str) -> Status {
    Status::Instruction(text.into())
}

/// Runs all four calibrations in a row, as for a new vehicle. The results match the sensors' true errors to a tenth of
/// an MPU-6000's usual errors and are sent to the station. The vehicle can be armed afterwards.
#[test]
fn a_new_vehicle_is_set_up() {
    let mut served = Served::new(cheap, 11);
    let truth = |served: &mut Served| {
        let bias = served.server.vehicles()[0].world().imu_bias().unwrap();
        (bias.rates_rad_s.cast::<f32>(), bias.specific_force_m_s2.cast::<f32>())
    };

    served.begin(CalibrationRequest::Gyroscope);
    served.run(5_000);
    let mut expected = vec![Status::Started("gyro".into())];
    expected.extend((1..10).map(|tenth| Status::Progress(10 * tenth)));
    expected.push(Status::Done("gyro".into()));
    assert_eq!(served.statuses(), expected);
    let gyro = served.vector("CAL_GYRO0_OFF");
    assert!((gyro - truth(&mut served).0).amax() < 6e-4, "{gyro}");

    served.begin(CalibrationRequest::Accelerometer);
    let sides = ["down", "left", "right", "up", "front", "back"];
    for side in sides {
        served.line(&format!("hold {side}"));
        served.run(4_000);
    }
    let statuses = served.statuses();
    assert_eq!(statuses[1], instruction("pending: back front left right up down"));
    assert_eq!(statuses[2], instruction("hold vehicle still on a pending side"));
    for side in sides {
        let place = |text: String| statuses.iter().position(|status| *status == instruction(&text)).unwrap();
        let detected = place(format!("{side} orientation detected"));
        assert!(detected < place(format!("{side} side done, rotate to a different side")));
    }
    assert_eq!(statuses.last(), Some(&Status::Done("accel".into())));
    let percents = |statuses: &[Status]| -> Vec<u32> {
        statuses.iter().filter_map(|it| if let Status::Progress(it) = it { Some(*it) } else { None }).collect()
    };
    assert_eq!(percents(&statuses), [17, 34, 50, 67, 84, 100]);
    let accel = served.vector("CAL_ACC0_OFF");
    assert!((accel - truth(&mut served).1).amax() < 0.04, "{accel}");
    assert!((served.vector("CAL_ACC0_SCALE") - Vector3::repeat(1.0)).amax() < 0.05);

    served.begin(CalibrationRequest::Magnetometer);
    for side in sides {
        served.line(&format!("hold {side} 60"));
        served.run(10_000);
    }
    assert_eq!(served.statuses().last(), Some(&Status::Done("mag".into())), "{:?}", served.texts);
    assert!(served.statuses().contains(&instruction("rotate vehicle around the vertical")));
    let offset = served.vector("CAL_MAG0_OFF").norm();
    assert!((5.0..80.0).contains(&offset), "{offset}");

    served.line("hold none");
    served.run(3_000);
    served.begin(CalibrationRequest::Level);
    served.run(4_000);
    assert_eq!(
        served.statuses(),
        [Status::Started("level".into()), Status::Progress(50), Status::Done("level".into())]
    );
    // The vehicle stands level; the accelerometer's misalignment remains, at most 2 %.
    assert!(served.vector("IMU_ATT").xy().norm() < 0.02);

    // After a new alignment, the heading is the true one.
    served.run(15_000);
    served.ask(VehicleCommand::Arm);
    assert_eq!(served.answers, [CommandResult::Accepted], "{:?}", served.texts);
}

/// Calibration is refused while armed, and arming while calibrating. Calibrations can be cancelled, and only one runs
/// at a time.
#[test]
fn calibration_and_flight_exclude_each_other() {
    let mut served = Served::new(cheap, 12);
    served.run(15_000);
    served.begin(CalibrationRequest::Accelerometer);
    served.ask(VehicleCommand::Arm);
    assert!(matches!(served.answers[..], [CommandResult::Refused(_)]));
    assert_eq!(served.texts.last().map(String::as_str), Some("arming refused: calibrating"));
    served.ask(VehicleCommand::Calibrate(CalibrationRequest::Gyroscope));
    assert!(matches!(served.answers[..], [CommandResult::Refused(_)]));
    served.ask(VehicleCommand::Calibrate(CalibrationRequest::Cancel));
    assert_eq!(served.answers, [CommandResult::Accepted]);
    assert_eq!(served.statuses().last(), Some(&Status::Cancelled));
    // MAVSDK sends the cancellation twice.
    let told = served.statuses();
    served.ask(VehicleCommand::Calibrate(CalibrationRequest::Cancel));
    assert_eq!((served.answers.as_slice(), served.statuses()), ([CommandResult::Accepted].as_slice(), told));

    served.ask(VehicleCommand::Arm);
    assert_eq!(served.answers, [CommandResult::Accepted], "{:?}", served.texts);
    for what in [
        CalibrationRequest::Gyroscope,
        CalibrationRequest::Accelerometer,
        CalibrationRequest::Level,
        CalibrationRequest::Magnetometer,
    ] {
        served.ask(VehicleCommand::Calibrate(what));
        assert!(matches!(served.answers[..], [CommandResult::Refused(_)]));
    }
    assert!(served.parameters.is_empty());
}

/// A failed calibration tells its reason: a dead sensor, a tilted vehicle, missing magnetometer readings, or a
/// calibration that does not exist.
#[test]
fn reasons_are_told() {
    let mut served = Served::new(cheap, 13);
    let failed = |served: &Served| match served.statuses().last() {
        Some(Status::Failed(reason)) => reason.clone(),
        other => panic!("{other:?}"),
    };
    served.line("hold down 20");
    served.run(1_100);
    served.begin(CalibrationRequest::Level);
    served.line("hold left");
    served.run(6_000);
    assert_eq!(failed(&served), "tilted above 15 degrees");
    served.line("hold none");
    served.run(2_000);
    served.begin(CalibrationRequest::Gyroscope);
    served.line("fault imu dead");
    served.run(1_500);
    assert_eq!(failed(&served), "no sensor readings");
    served.line("clear");
    served.begin(CalibrationRequest::Magnetometer);
    served.line("fault magnetometer lost");
    served.run(1_500);
    assert_eq!(failed(&served), "no magnetometer readings");
    assert!(served.parameters.is_empty());
    served.ask(VehicleCommand::Denied(CALIBRATE));
    assert_eq!(served.answers, [CommandResult::Denied]);
}
