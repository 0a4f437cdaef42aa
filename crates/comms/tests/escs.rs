//! ESC telemetry: which ESC is asked, the messages for stations, and the reaction to a rotor failure.

use crate::common::{Bench, STATION};
use afbc_comms::services::streams::id;
use afbc_comms::{EscAction, EscReports, EscsHeard};
use afbc_drivers::esc_telemetry::EscReading;
use afbc_estimator::OutputFilter;
use afbc_flight_core::Mode;
use afbc_guidance::{FlightMode, Order};
use afbc_mavlink::telemetry::{EscInfo, EscStatus};
use afbc_mavlink::{Downlink, MavSeverity, Telemetry, Uplink, VehicleCommand};
use afbc_onboard::{Configuration, EscSettings, Report, RotorFailure};
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use nalgebra::SVector;

/// Commanded speed of all rotors [rad/s].
const SPEED: f32 = 500.0;
const POLES: u32 = 14;

const SERIAL: EscSettings = EscSettings { serial: true, ..EscSettings::DEFAULT };
const ANSWERS: EscSettings = EscSettings { answers: true, ..EscSettings::DEFAULT };

/// A vehicle with four rotors whose ESCs send telemetry.
struct Vehicle {
    bench: Bench,
    reports: EscReports,
    idle: Report,
    mode: Mode,
    airborne: bool,
    commanded: f32,
}

fn configuration(escs: EscSettings) -> Configuration {
    Configuration { escs, ..Configuration::default() }
}

impl Vehicle {
    fn new(escs: EscSettings) -> Self {
        let mut bench = Bench::new();
        let (idle, _) = bench.step();
        let reports = EscReports::new(&configuration(escs));
        Vehicle { bench, reports, idle, mode: Mode::Flying, airborne: true, commanded: SPEED }
    }

    /// Runs a tick. Returns the resulting action and the messages.
    fn tick(&mut self, heard: &EscsHeard<'_>) -> (EscAction, Vec<Downlink>) {
        self.bench.now_us += 1000;
        let motors = RotorSpeeds(SVector::repeat(self.commanded));
        let mut report = Report { time_us: self.bench.now_us, mode: self.mode, motors, ..self.idle };
        report.guided.airborne = self.airborne;
        let said = self.bench.said(&report);
        (self.bench.comms.escs(&mut self.reports, heard, &report), said)
    }

    /// Runs ticks in which the ESCs answer each frame with these speeds [rad/s]. Returns texts and orders.
    fn turn(&mut self, ticks: u32, speeds: [f32; 4]) -> (Vec<(MavSeverity, String)>, Vec<Order>) {
        let (mut texts, mut orders) = (Vec::new(), Vec::new());
        for _ in 0..ticks {
            let (action, said) = self.tick(&EscsHeard { bytes: &[], speeds_rev_min: electrical(&speeds) });
            texts.extend(said.iter().filter_map(|message| match message {
                Downlink::Text { severity, text } => Some((*severity, text.to_str().expect("words").to_owned())),
                _ => None,
            }));
            orders.extend(action.inputs.iter().flat_map(|inputs| &inputs.orders.given).map(|given| given.value));
        }
        (texts, orders)
    }

    /// Returns the readings and their count.
    fn readings(&self) -> (Vec<Option<EscReading>>, u16) {
        let known = self.bench.comms.esc_telemetry();
        (known.readings.iter().map(|reading| reading.map(|it| it.value)).collect(), known.counter)
    }
}

/// Converts rotor speeds [rad/s] to electrical speeds [rev/min].
fn electrical(speeds: &[f32]) -> [Option<u32>; ROTORS_MAX] {
    let mut rev_min = [None; ROTORS_MAX];
    for (to, speed) in rev_min.iter_mut().zip(speeds) {
        *to = Some((speed * 60.0 / std::f32::consts::TAU * (POLES / 2) as f32) as u32);
    }
    rev_min
}

fn reading(rotor: u8) -> EscReading {
    EscReading {
        temperature_c: 40 + rotor as i8,
        voltage_cv: 1600 - u16::from(rotor),
        current_ca: 500 + 100 * u16::from(rotor),
        consumed_mah: 7,
        erpm_hundreds: EscReading::erpm_hundreds_of(SPEED, POLES) + u16::from(rotor),
    }
}

/// Over the serial line the ESCs are asked one after the other. The request goes with a DSHOT frame, and the answer
/// arrives in a later tick.
#[test]
fn each_is_asked_in_turn() {
    let mut vehicle = Vehicle::new(SERIAL);
    let (mut asked, mut answer) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let (action, _) = vehicle.tick(&EscsHeard { bytes: &answer, ..EscsHeard::default() });
        answer = action.ask.map_or(Vec::new(), |rotor| reading(rotor).to_bytes().to_vec());
        asked.extend(action.ask);
    }
    let turns = asked.iter().zip([0, 1, 2, 3].into_iter().cycle());
    assert!(asked.len() >= 16 && turns.into_iter().all(|(rotor, turn)| *rotor == turn), "{asked:?}");
    let expected: Vec<_> = (0..ROTORS_MAX as u8).map(|rotor| Some(reading(rotor)).filter(|_| rotor < 4)).collect();
    assert_eq!(vehicle.readings(), (expected, asked.len() as u16 - u16::from(!answer.is_empty())));
    assert_eq!((vehicle.reports.line().bad_answers(), vehicle.reports.line().missing_answers()), (0, 0));
    let newest = vehicle.bench.comms.esc_telemetry().readings[usize::from(asked[asked.len() - 2])];
    assert!(newest.is_some_and(|newest| vehicle.bench.now_us - newest.at_us <= 2000), "{newest:?}");
}

/// If telemetry is turned off, no ESC is asked and all data are ignored.
#[test]
fn what_is_not_wanted_is_not_taken() {
    for settings in [EscSettings::DEFAULT, ANSWERS] {
        let mut vehicle = Vehicle::new(settings);
        for _ in 0..20 {
            let (action, _) = vehicle.tick(&EscsHeard { bytes: &reading(0).to_bytes(), ..EscsHeard::default() });
            assert_eq!(action.ask, None);
        }
        assert_eq!(vehicle.readings(), (vec![None; ROTORS_MAX], 0));
    }
    for settings in [EscSettings::DEFAULT, SERIAL] {
        let mut vehicle = Vehicle::new(settings);
        vehicle.turn(20, [SPEED; 4]);
        assert_eq!(vehicle.readings(), (vec![None; ROTORS_MAX], 0));
    }
}

/// Speeds by bidirectional DSHOT are used for each rotor of the vehicle, rounded down to 100 rev/min. The other values
/// of a reading come over the serial line and do not change.
#[test]
fn speeds_of_each_frame_are_taken() {
    let mut vehicle = Vehicle::new(EscSettings { serial: true, ..ANSWERS });
    let (action, _) = vehicle.tick(&EscsHeard::default());
    assert_eq!(action.ask, Some(0));
    vehicle.tick(&EscsHeard { bytes: &reading(0).to_bytes(), ..EscsHeard::default() });
    let mut speeds_rev_min = [Some(40_000); ROTORS_MAX];
    (speeds_rev_min[0], speeds_rev_min[1], speeds_rev_min[2]) = (Some(12_399), None, Some(9_999_999));
    let (_, said) = vehicle.tick(&EscsHeard { bytes: &[], speeds_rev_min });
    let of = |erpm_hundreds| Some(EscReading { erpm_hundreds, ..EscReading::default() });
    let mut expected = vec![None; ROTORS_MAX];
    expected[0] = Some(EscReading { erpm_hundreds: 123, ..reading(0) });
    (expected[2], expected[3]) = (of(u16::MAX), of(400));
    assert_eq!(vehicle.readings(), (expected, 4), "{said:?}");
    let known = vehicle.bench.comms.esc_telemetry();
    assert_eq!(known.poles, 14);
    assert!(known.readings.iter().flatten().skip(1).all(|it| it.at_us == vehicle.bench.now_us));
    // A silent ESC keeps its last reading.
    vehicle.tick(&EscsHeard::default());
    assert_eq!(vehicle.readings().1, 4);
}

/// Stations get four ESCs per message: a requested group, or all groups in turn.
#[test]
fn stations_see_what_controllers_tell() {
    let mut vehicle = Vehicle::new(ANSWERS);
    let eight: [f32; 8] = std::array::from_fn(|rotor| 100.0 * (rotor + 1) as f32);
    let heard = EscsHeard { bytes: &[], speeds_rev_min: electrical(&eight) };
    let step = |vehicle: &mut Vehicle| {
        vehicle.bench.now_us += 1000;
        let report = Report { time_us: vehicle.bench.now_us, rotors: 8, ..vehicle.idle };
        let (mut messages, mut decoder) = (Vec::new(), afbc_mavlink::Decoder::new(STATION));
        vehicle.bench.comms.report(&report, 0.0, |bytes| {
            decoder.feed_accepted(bytes, |_| true, |_, message: Downlink| messages.push(message));
        });
        vehicle.bench.comms.escs(&mut vehicle.reports, &heard, &report);
        messages
    };
    let mut ask = |message, index| {
        vehicle.bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message, index }));
        let said: Vec<_> = (0..5).flat_map(|_| step(&mut vehicle)).collect();
        said.into_iter().find_map(|message| match message {
            Downlink::Telemetry(told @ (Telemetry::EscInfo(_) | Telemetry::EscStatus(_))) => Some(told),
            _ => None,
        })
    };
    assert_eq!(ask(id::ESC_STATUS, 1), None, "nobody has answered yet");
    for (index, first) in [(1, 0), (2, 4), (3, 0)] {
        let Some(Telemetry::EscStatus(EscStatus { first: at, speeds_rpm, .. })) = ask(id::ESC_STATUS, index) else {
            panic!("page {index}");
        };
        assert_eq!(at, first);
        for (rpm, speed) in speeds_rpm.iter().zip(&eight[usize::from(first)..]) {
            let expected = speed * 60.0 / std::f32::consts::TAU;
            assert!((*rpm as f32 - expected).abs() < 16.0, "{rpm}, not {expected}");
        }
        let Some(Telemetry::EscInfo(info)) = ask(id::ESC_INFO, index) else { panic!("page {index}") };
        let EscInfo { first: at, count, online, failures, temperatures_cc, counter, .. } = info;
        assert_eq!((at, count, online, failures, counter % 8), (first, 8, 0xFF, [0; 4], 0));
        // Bidirectional DSHOT transmits no temperature, so it reads 0 degrees.
        assert_eq!(temperatures_cc, [0; 4]);
    }
    // A stream sends the two groups in turn, one per interval.
    vehicle.bench.hear(Uplink::Command(VehicleCommand::SetInterval { message: id::ESC_STATUS, interval_us: 50_000 }));
    let pages: Vec<_> = (0..1000)
        .flat_map(|_| step(&mut vehicle))
        .filter_map(|message| match message {
            Downlink::Telemetry(Telemetry::EscStatus(status)) => Some(status.first),
            _ => None,
        })
        .collect();
    assert!((18..=21).contains(&pages.len()), "{pages:?}");
    assert!(
        pages.windows(2).all(|two| two[0] != two[1] && two.iter().all(|first| [0, 4].contains(first))),
        "{pages:?}"
    );
}

/// Voltage, current and temperature belong to each ESC. An ESC that has not answered has none.
#[test]
fn what_has_come_over_the_line_is_shown() {
    let mut vehicle = Vehicle::new(SERIAL);
    let mut answer = Vec::new();
    for _ in 0..4 {
        let (action, _) = vehicle.tick(&EscsHeard { bytes: &answer, ..EscsHeard::default() });
        let rotor = action.ask.expect("nothing else is under way");
        answer = if rotor < 3 { reading(rotor).to_bytes().to_vec() } else { Vec::new() };
    }
    for message in [id::ESC_STATUS, id::ESC_INFO] {
        vehicle.bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message, index: 0 }));
    }
    let said: Vec<_> = (0..5).flat_map(|_| vehicle.tick(&EscsHeard::default()).1).collect();
    let status = said.iter().find_map(|message| match message {
        Downlink::Telemetry(Telemetry::EscStatus(status)) => Some(*status),
        _ => None,
    });
    let info = said.iter().find_map(|message| match message {
        Downlink::Telemetry(Telemetry::EscInfo(info)) => Some(*info),
        _ => None,
    });
    let (status, info) = (status.expect("sent"), info.expect("sent"));
    for (told, expected) in status.voltages_v.iter().zip([16.0, 15.99, 15.98, 0.0]) {
        assert!((told - expected).abs() < 1e-3, "{status:?}");
    }
    for (told, expected) in status.currents_a.iter().zip([5.0, 6.0, 7.0, 0.0]) {
        assert!((told - expected).abs() < 1e-3, "{status:?}");
    }
    let rpm = SPEED * 60.0 / std::f32::consts::TAU;
    assert!(status.speeds_rpm[..3].iter().all(|told| (*told as f32 - rpm).abs() < 45.0), "{status:?}");
    assert_eq!((status.first, status.speeds_rpm[3]), (0, 0));
    assert_eq!((info.first, info.counter, info.count, info.online), (0, 3, 4, 0b0111));
    assert_eq!(info.temperatures_cc, [4000, 4100, 4200, i16::MAX]);
}

/// A rotor that stops or does not turn as commanded is announced once, numbered from 1, and shown in ESC_INFO. Its
/// recovery is announced too.
#[test]
fn a_failed_rotor_is_reported() {
    let critical = MavSeverity::MAV_SEVERITY_CRITICAL;
    for (rotor, slow, text, failure) in [
        (2, 0.0, "rotor 3 has stopped", RotorFailure::Stopped),
        (0, 0.4 * SPEED, "rotor 1 does not turn as commanded", RotorFailure::Desynchronised),
    ] {
        let mut vehicle = Vehicle::new(ANSWERS);
        assert_eq!(vehicle.turn(2000, [SPEED; 4]).0, []);
        let mut speeds = [SPEED; 4];
        speeds[rotor] = slow;
        let (texts, orders) = vehicle.turn(100, speeds);
        assert_eq!(texts, [(critical, text.to_owned())]);
        assert_eq!(orders, [], "a warning alone");
        let mut failures = [None; ROTORS_MAX];
        failures[rotor] = Some(failure);
        assert_eq!(vehicle.bench.comms.esc_telemetry().failures, failures);
        vehicle.bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: id::ESC_INFO, index: 0 }));
        let heard = EscsHeard { bytes: &[], speeds_rev_min: electrical(&speeds) };
        let said: Vec<_> = (0..3).flat_map(|_| vehicle.tick(&heard).1).collect();
        let flags = said.iter().find_map(|message| match message {
            Downlink::Telemetry(Telemetry::EscInfo(info)) => Some(info.failures),
            _ => None,
        });
        assert_eq!(flags, Some(failures.map(|it| if it.is_some() { 64 } else { 0 })[..4].try_into().expect("four")));
        let (texts, orders) = vehicle.turn(500, [SPEED; 4]);
        let again = format!("rotor {} turns as commanded again", rotor + 1);
        assert_eq!((texts, orders), (vec![(MavSeverity::MAV_SEVERITY_NOTICE, again)], vec![]));
        assert_eq!(vehicle.bench.comms.esc_telemetry().failures, [None; ROTORS_MAX]);
    }
}

/// In the air a failure selects the parameter's mode once. Recovery does not. On the ground a failure is only
/// announced. With detection off, it is not even announced.
#[test]
fn a_failed_rotor_leads_to_its_action_in_flight() {
    let stopped = [SPEED, 0.0, SPEED, SPEED];
    for (action, mode) in
        [(0, None), (1, Some(FlightMode::Hold)), (2, Some(FlightMode::Land)), (3, Some(FlightMode::Return))]
    {
        for (detects, airborne) in [(true, true), (true, false), (false, true)] {
            let mut vehicle = Vehicle::new(EscSettings { action, detects, ..ANSWERS });
            vehicle.airborne = airborne;
            vehicle.turn(2000, [SPEED; 4]);
            let (texts, orders) = vehicle.turn(100, stopped);
            assert_eq!(texts.len(), usize::from(detects));
            let expected = mode.filter(|_| airborne && detects).map(Order::Select);
            assert_eq!(orders, expected.into_iter().collect::<Vec<_>>(), "{action} {detects} {airborne}");
            let failed = vehicle.bench.comms.esc_telemetry().failures[1];
            assert_eq!(failed, Some(RotorFailure::Stopped).filter(|_| detects));
            assert_eq!(vehicle.turn(500, [SPEED; 4]).1, []);
        }
    }
}

/// Rotors of a disarmed vehicle that turn in the wind are ignored. Arming starts the detection afresh.
#[test]
fn rotors_of_a_disarmed_vehicle_are_not_judged() {
    let mut vehicle = Vehicle::new(ANSWERS);
    (vehicle.mode, vehicle.commanded) = (Mode::Disarmed, 0.0);
    assert_eq!(vehicle.turn(3000, [SPEED; 4]).0, []);
    (vehicle.mode, vehicle.commanded) = (Mode::Flying, SPEED);
    assert_eq!(vehicle.turn(1000, [SPEED; 4]).0, []);
    assert_eq!(vehicle.turn(100, [SPEED, SPEED, SPEED, 0.0]).0.len(), 1);
    vehicle.mode = Mode::Disarmed;
    assert_eq!(vehicle.turn(1000, [0.0; 4]).0, []);
    assert_eq!(vehicle.bench.comms.esc_telemetry().failures, [None; ROTORS_MAX]);
}

/// While the vehicle is armed, the notch filter follows the mean rotor speed, and then returns. It does not move if
/// following is off or speeds are missing.
#[test]
fn the_notch_follows_the_rotors_of_an_armed_vehicle() {
    let home = OutputFilter::of(&Configuration::default().parameters, 4);
    let home_rad_s = home.notch().expect("one").centre_rad_s();
    let speeds = [1.1, 1.2, 1.3, 1.2].map(|share| share * home_rad_s);
    let moves = |vehicle: &mut Vehicle, speeds: &[f32]| {
        let heard = EscsHeard { bytes: &[], speeds_rev_min: electrical(speeds) };
        let moved = (0..50).filter_map(|_| vehicle.tick(&heard).0.notch);
        moved.map(|notch| notch.centre_rad_s() / home_rad_s).collect::<Vec<_>>()
    };
    let mut vehicle = Vehicle::new(ANSWERS);
    let [moved] = moves(&mut vehicle, &speeds)[..] else { panic!("once") };
    assert!((moved - 1.2).abs() < 0.01, "{moved}");
    // When the vehicle is disarmed, the notch returns to the frequency of the vehicle's file.
    vehicle.mode = Mode::Disarmed;
    assert_eq!(moves(&mut vehicle, &speeds), [1.0]);
    vehicle.mode = Mode::Flying;
    assert_eq!(moves(&mut vehicle, &speeds).len(), 1);
    // One of four speeds is missing.
    assert_eq!((0..10).flat_map(|_| moves(&mut vehicle, &speeds[..3])).collect::<Vec<_>>(), [1.0]);
    for settings in [EscSettings { follows: false, ..ANSWERS }, SERIAL, EscSettings::DEFAULT] {
        assert!(moves(&mut Vehicle::new(settings), &speeds).is_empty(), "{settings:?}");
    }
}

/// A new configuration of a disarmed vehicle takes effect.
#[test]
fn another_configuration_is_adopted() {
    let mut vehicle = Vehicle::new(EscSettings::DEFAULT);
    assert_eq!(vehicle.tick(&EscsHeard::default()).0.ask, None);
    let mut changed = configuration(EscSettings { poles: 12, serial: true, answers: true, ..EscSettings::DEFAULT });
    changed.parameters.mass_kg *= 1.44;
    vehicle.reports.adopt(&changed);
    let (action, _) = vehicle.tick(&EscsHeard::default());
    assert_eq!((action.ask, vehicle.bench.comms.esc_telemetry().poles), (Some(0), 12));
    // 1.44 times the mass needs rotors that turn 1.2 times as fast, and the notch moves with them.
    let home = OutputFilter::of(&changed.parameters, 4);
    vehicle.mode = Mode::Disarmed;
    let moved = (0..50).find_map(|_| vehicle.tick(&EscsHeard::default()).0.notch);
    assert_eq!(moved.map(|notch| notch.centre_rad_s()), home.notch().map(|home| home.centre_rad_s()));
}
