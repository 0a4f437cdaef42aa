//! Tests that a replay repeats the flight, and names what a log lacks or has wrong.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_control::Trace;
use afbc_estimator::{Measurement, VelocityNotch};
use afbc_flight_core::{Request, Stamped, Ticketed};
use afbc_guidance::{BatteryReading, Order};
use afbc_log::exact::{Given, Record, Recorder, ReplayDifference, ReplayStep, Replayer, StartRecord, decode};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Aged, Configuration, ControlInputs, Flight, Prepared, Readings, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::{PLUS, Rotors, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// A parameter that changes the estimate, even while disarmed.
const OFFSET: &str = "CAL_GYRO0_OFF_X";

fn name(name: &str) -> RecordName {
    RecordName::new(name).unwrap()
}

/// Inputs of a tick besides its readings and messages.
#[derive(Clone, Copy, Debug, Default)]
struct Beside {
    battery: Option<BatteryReading>,
    clock_failed: bool,
    notch_rad_s: Option<f32>,
}

/// A vehicle and the records of its log.
struct Vehicle {
    flight: Flight,
    table: ParameterTable,
    recorder: Recorder,
    records: Vec<Record>,
    mail: ControlInputs,
    taken: ControlInputs,
    number: u32,
    adopted: Option<u16>,
    /// Inputs for the next tick.
    beside: Beside,
}

impl Vehicle {
    fn new() -> Self {
        Vehicle::with(|_| ())
    }

    /// Creates a vehicle whose parameters differ from the image's.
    fn with(set: impl FnOnce(&mut ParameterTable)) -> Self {
        let mut table = ParameterTable::new(Configuration::default());
        set(&mut table);
        let flight = Flight::new(table.configuration()).unwrap();
        let (mail, taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
        let (recorder, records, beside) = (Recorder::default(), Vec::new(), Beside::default());
        let mut vehicle = Vehicle { flight, table, recorder, records, mail, taken, number: 0, adopted: None, beside };
        vehicle.record(|recorder, table, send| recorder.start(["x", "afbc"], table, send));
        vehicle
    }

    fn record<T>(&mut self, what: impl FnOnce(&mut Recorder, &ParameterTable, &mut dyn FnMut(&[u8])) -> T) -> T {
        let Vehicle { recorder, table, records, .. } = self;
        what(recorder, table, &mut |frame| records.push(decode(&mut frame[..frame.len() - 1].to_vec()).unwrap()))
    }

    /// Sets a parameter. The next tick flies it, unless the vehicle is armed.
    fn set(&mut self, parameter: &str, value: f32) {
        let value = self.table.set(name(parameter), value).unwrap().value;
        let change = RecordChange::Set(name(parameter), Some(value));
        let number = self.record(|recorder, table, send| recorder.change(table, change, send));
        if self.flight.adopt(&Prepared::new(self.table.configuration()).unwrap()) {
            self.adopted = Some(number);
        }
    }

    fn tick(&mut self, news: &ControlInputs, readings: Readings) -> Report {
        let (number, time_us) = (self.number, 1_000 * u64::from(self.number + 1));
        self.number += 1;
        self.mail.merge(news);
        self.record(|recorder, _, send| recorder.inputs(number, news, send));
        self.mail.take_into(&mut self.taken);
        let Beside { battery, clock_failed, notch_rad_s } = std::mem::take(&mut self.beside);
        self.taken.battery = battery;
        if clock_failed {
            self.flight.distrust_clock();
        }
        if let Some(notch) = notch_rad_s.and_then(VelocityNotch::at) {
            self.flight.move_notch(&notch);
        }
        let report = self.flight.tick(time_us, &mut self.taken, &readings);
        let adopted = self.adopted.take();
        let inputs = TickInputs { number, time_us, clock_failed, readings, battery, adopted, notch_rad_s };
        self.record(|recorder, _, send| recorder.tick(&inputs, &report, send));
        report
    }

    /// Runs ticks of a vehicle that stands still.
    fn stand(&mut self, ticks: u32) {
        for number in 0..ticks {
            self.tick(&ControlInputs::EMPTY, stands(number));
        }
    }

    /// Returns a vehicle that flies on states from the link and is armed at 1,050 ms.
    fn armed() -> Self {
        let mut vehicle = Vehicle::new();
        for ms in 0..1_100 {
            let report = vehicle.tick(&seen(ms, ms == 1_050), Readings::NONE);
            assert_eq!(report.mode.armed(), ms >= 1_050, "{:?}", report.answer);
        }
        vehicle
    }
}

/// Returns a state from the link, with a request to arm if `arm` is true.
fn seen(ms: u64, arm: bool) -> ControlInputs {
    let mut news = ControlInputs::EMPTY;
    let position_m = Vector3::new(0.0, 0.0, 1e-6 * (ms % 2) as f32);
    let value = State { position_m, ..State::default() };
    news.inbox.put_state(Stamped { value, at_us: 1_000 * (ms + 1) });
    if arm {
        assert!(news.inbox.request(Ticketed { value: Request::Arm, ticket: 3 }));
    }
    news
}

/// Returns readings of a vehicle that stands still.
fn stands(ms: u32) -> Readings {
    let noise = 1e-3 * (ms % 7) as f32;
    let imu = Some(Aged { value: [Vector3::new(0.0, noise, 0.0), Vector3::new(noise, 0.0, 9.81)], age_us: 0 });
    Readings { imu, ..Readings::NONE }
}

/// Returns readings of a vehicle that stands still, with a tracker's pose in every tenth tick.
fn seen_to_stand(ms: u32) -> Readings {
    let position_m = Vector3::new(1e-3 * (ms % 3) as f32, 0.0, 0.0);
    let attitude = [1.0, 0.0, 0.0, 0.0];
    let pose = Measurement::Pose { position_m, attitude, position_sigma_m: 0.01, attitude_sigma_rad: 0.01 };
    let pose = ms.is_multiple_of(10).then_some(Aged { value: pose, age_us: 0 });
    Readings { aids: [pose, None], ..stands(ms) }
}

fn replayer() -> Replayer {
    Replayer::new(Configuration::default()).unwrap()
}

/// Replays records. Returns the number of matching ticks, and the differences.
fn replay(replayer: &mut Replayer, records: &[Record]) -> (usize, Vec<ReplayDifference>) {
    let (mut same, mut differences) = (0, Vec::new());
    for record in records {
        match replayer.take(record) {
            ReplayStep::Nothing => {}
            ReplayStep::Same(_) => same += 1,
            ReplayStep::Differs(difference, _) => differences.push(difference),
        }
    }
    (same, differences)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// With parameter changes at any time, a replay repeats every report and ends with the same parameters. If the log
    /// lacks a change, the tick that first flew it is named.
    #[test]
    fn a_flight_is_flown_again(
        sets in prop::collection::btree_map(40..300_u32, -0.3..0.3_f32, 1..30),
        dropped in any::<prop::sample::Index>(),
    ) {
        let (mut vehicle, mut reports) = (Vehicle::new(), Vec::new());
        for number in 0..300 {
            if let Some(value) = sets.get(&number) {
                vehicle.set(OFFSET, *value);
            }
            reports.push(vehicle.tick(&ControlInputs::EMPTY, stands(number)));
        }
        let mut replayer = replayer();
        let again: Vec<_> = vehicle.records.iter().filter_map(|record| match replayer.take(record) {
            ReplayStep::Nothing => None,
            ReplayStep::Same(report) => Some(report),
            ReplayStep::Differs(difference, _) => panic!("{difference:?}"),
        }).collect();
        prop_assert_eq!(again, reports);
        prop_assert!(replayer.parameters().iter().eq(vehicle.table.iter()));
        let is_set = |record: &&Record| matches!(record, Record::Parameter { .. });
        let dropped = dropped.index(sets.len());
        let mut lacking = vehicle.records.clone();
        let gone = vehicle.records.iter().filter(is_set).nth(dropped).unwrap().clone();
        lacking.retain(|record| *record != gone);
        let number = *sets.keys().nth(dropped).unwrap();
        prop_assert_eq!(
            replay(&mut self::replayer(), &lacking),
            (number as usize, vec![ReplayDifference::Configuration(number)])
        );
    }

    /// A log that lacks a tick is replayed up to the gap, and again from the next start. A tick with changed outputs is
    /// named.
    #[test]
    fn what_is_missing_or_else_is_named(at in 0..50_usize, throttle in 1..2_000_u16) {
        let mut vehicle = Vehicle::new();
        vehicle.stand(50);
        let mut lacking = vehicle.records.clone();
        lacking.remove(1 + at);
        let mut replayer = replayer();
        let missing = if at < 49 { vec![ReplayDifference::Missing(at as u32)] } else { Vec::new() };
        prop_assert_eq!(replay(&mut replayer, &lacking), (at, missing));
        prop_assert_eq!(replay(&mut replayer, &vehicle.records), (50, Vec::new()));
        let mut changed = vehicle.records.clone();
        let Record::Tick(tick, given) = &mut changed[1 + at] else { panic!("a tick") };
        let now = *given;
        given.throttles[at % 4] = throttle;
        let (number, then) = (tick.number, *given);
        prop_assert_eq!(
            replay(&mut replayer, &changed),
            (49, vec![ReplayDifference::Given { number, then, now }])
        );
    }
}

/// Replays records. Returns all replayed reports, whether they match or not.
fn reports(replayer: &mut Replayer, records: &[Record]) -> Vec<Report> {
    let report = |record: &Record| match replayer.take(record) {
        ReplayStep::Same(report) | ReplayStep::Differs(_, Some(report)) => Some(report),
        ReplayStep::Nothing | ReplayStep::Differs(_, None) => None,
    };
    records.iter().filter_map(report).collect()
}

/// Returns the messages' inputs for a tick of a vehicle that takes off.
fn takes_off(number: usize) -> ControlInputs {
    let mut news = ControlInputs::EMPTY;
    match number {
        3_000 => assert!(news.inbox.request(Ticketed { value: Request::Arm, ticket: 3 })),
        3_020 => news.order().given.push_back(Ticketed { value: Order::TakeOff(None), ticket: 4 }).unwrap(),
        _ => (),
    }
    news
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4, failure_persistence: None, ..ProptestConfig::default() })]

    /// The battery, a failed clock and the notch are replayed: leaving out any of them changes the reports. The law's
    /// signals match as well.
    #[test]
    fn what_a_tick_takes_beside_its_readings_is_taken_again(
        volts in prop::collection::vec(11.8..12.5_f32, 4_000),
        clock in 3_100..4_000_usize,
        notches in prop::collection::btree_map(3_500..3_900_usize, 100.0..400.0_f32, 1..5),
    ) {
        let mut vehicle = Vehicle::with(|table| assert!(table.set(name("BAT1_N_CELLS"), 3.0).is_ok()));
        let mut flown = Vec::new();
        for (number, voltage_v) in volts.into_iter().enumerate() {
            vehicle.beside = Beside {
                battery: Some(BatteryReading { voltage_v, current_a: 1.0, charge: None }),
                clock_failed: number == clock,
                notch_rad_s: notches.get(&number).copied(),
            };
            flown.push(vehicle.tick(&takes_off(number), seen_to_stand(number as u32)));
        }
        let (mut replayer, last) = (replayer(), &flown[3_999]);
        prop_assert!(last.mode.armed() && last.throttles[..4].iter().all(|throttle| *throttle > 100), "{last:?}");
        prop_assert!(reports(&mut replayer, &vehicle.records) == flown);
        prop_assert_eq!(replayer.trace(), vehicle.flight.trace());
        prop_assert!(replayer.trace() != Trace::default());
        let without = |change: fn(&mut TickInputs)| {
            let mut records = vehicle.records.clone();
            records.iter_mut().for_each(|record| if let Record::Tick(tick, _) = record { change(tick) });
            reports(&mut self::replayer(), &records)
        };
        prop_assert!(without(|tick| tick.battery = None) != flown);
        prop_assert!(without(|tick| tick.clock_failed = false) != flown);
        prop_assert!(without(|tick| tick.notch_rad_s = None) != flown);
    }
}

/// An armed vehicle's flight is replayed. The replay names a configuration that an armed vehicle cannot have flown.
/// With the caller's changes it accepts that, for the vehicle may then be armed where it was not.
#[test]
fn an_armed_vehicle_flies_no_other_configuration() {
    let mut vehicle = Vehicle::armed();
    let mut replayer = replayer();
    assert_eq!(replay(&mut replayer, &vehicle.records), (1_100, Vec::new()));
    // A parameter set while armed is not flown.
    vehicle.set(OFFSET, 0.1);
    assert_eq!(vehicle.adopted, None);
    vehicle.tick(&seen(1_100, false), Readings::NONE);
    assert_eq!(replay(&mut self::replayer(), &vehicle.records), (1_101, Vec::new()));
    let mut wrong = vehicle.records.clone();
    let Some(Record::Tick(last, _)) = wrong.last_mut() else { panic!("a tick") };
    last.adopted = Some(1);
    let impossible = (1_100, vec![ReplayDifference::Configuration(1_100)]);
    assert_eq!(replay(&mut self::replayer(), &wrong), impossible);
    let mut changed = self::replayer();
    // The changed parameter has no effect on this flight.
    changed.change(name("EST_GATE"), 4.0).unwrap();
    assert_eq!(replay(&mut changed, &wrong), (1_101, Vec::new()));
    // Adopts a configuration that is not in the log.
    let Some(Record::Tick(last, _)) = wrong.last_mut() else { panic!("a tick") };
    last.adopted = Some(2);
    assert_eq!(replay(&mut self::replayer(), &wrong), impossible);
}

/// The caller's changes are flown from the start on, but `parameters` returns the log's values. Impossible changes, and
/// one too many, are refused.
#[test]
fn changes_are_flown_or_refused() {
    let mut vehicle = Vehicle::new();
    vehicle.stand(50);
    let mut replayer = replayer();
    assert!(replayer.change(name("NO_SUCH"), 1.0).is_err());
    assert!(replayer.change(name(OFFSET), 50.0).is_err());
    assert_eq!(replay(&mut replayer, &vehicle.records), (50, Vec::new()));
    replayer.change(name(OFFSET), 0.2).unwrap();
    let (same, differences) = replay(&mut replayer, &vehicle.records);
    assert!(same < 10 && matches!(differences[0], ReplayDifference::Given { .. }), "{same}");
    assert!(replayer.parameters().iter().eq(vehicle.table.iter()));
    // A vehicle that really has this parameter gives the same outputs.
    let mut other = Vehicle::new();
    other.set(OFFSET, 0.2);
    let wanted = (0..50).map(|number| other.tick(&ControlInputs::EMPTY, stands(number))).last().unwrap();
    let told = differences.last().unwrap();
    assert!(matches!(told, ReplayDifference::Given { now, .. } if *now == Given::of(&wanted)), "{told:?}");
    let more = (0..100).take_while(|_| replayer.change(name(OFFSET), 0.2).is_ok()).count();
    assert_eq!(more, 63);
}

/// A log of another vehicle is not replayed: the number of rotors or of parameters, a parameter's name or value, or the
/// digest differs.
#[test]
fn another_vehicle_is_named() {
    let mut vehicle = Vehicle::new();
    vehicle.stand(20);
    let Record::Start(start) = vehicle.records[0].clone() else { panic!("a start") };
    for start in
        [StartRecord { rotors: 6, ..start.clone() }, StartRecord { parameters: start.parameters + 1, ..start.clone() }]
    {
        let records = [&[Record::Start(start.clone())], &vehicle.records[1..]].concat();
        let mut replayer = replayer();
        assert_eq!(replay(&mut replayer, &records), (0, vec![ReplayDifference::Start(start)]));
        assert_eq!(replay(&mut replayer, &vehicle.records), (20, Vec::new()));
    }
    let digest = StartRecord { digest: start.digest ^ 1, ..start.clone() };
    let records = [&[Record::Start(digest.clone())], &vehicle.records[1..]].concat();
    assert_eq!(replay(&mut replayer(), &records), (0, vec![ReplayDifference::Parameters(digest)]));
    for (parameter, value) in [("NO_SUCH", 1.0), (OFFSET, 50.0)] {
        let unknown = Record::Parameter { configuration: 0, name: name(parameter), value };
        let records = [&vehicle.records[..1], &[unknown], &vehicle.records[1..]].concat();
        assert_eq!(replay(&mut replayer(), &records), (20, vec![ReplayDifference::Parameter]));
    }
    // Ticks before a start are ignored.
    assert_eq!(replay(&mut replayer(), &vehicle.records[1..]), (0, Vec::new()));
}

/// A vehicle whose parameters differ from the image's is replayed with them. A displaced rotor means another vehicle.
#[test]
fn a_start_brings_its_parameters() {
    let mut vehicle = Vehicle::with(|table| assert!(table.set(name(OFFSET), 0.1).is_ok()));
    vehicle.stand(50);
    assert_eq!(replay(&mut replayer(), &vehicle.records), (50, Vec::new()));
    // Changes every parameter that can be changed, and then another one in flight.
    let mut changed = 0;
    let mut vehicle = Vehicle::with(|table| {
        for parameter in table.clone().iter() {
            changed += u32::from(table.set(parameter.name, parameter.value * 1.001).is_ok());
        }
    });
    assert!(changed > 100, "{changed}");
    vehicle.stand(50);
    vehicle.set(OFFSET, 0.2);
    vehicle.stand(50);
    assert_eq!(replay(&mut replayer(), &vehicle.records), (100, Vec::new()));
    let mut rotors = PLUS;
    rotors[0].x += 1e-3;
    let moved = Configuration { rotors: Rotors::new(&rotors), ..Configuration::default() };
    let (same, differences) = replay(&mut Replayer::new(moved).unwrap(), &vehicle.records);
    assert!(same == 0 && matches!(differences[..], [ReplayDifference::Parameters(_)]), "{same} {differences:?}");
}
