//! ESC telemetry, from the plant's rotors to stations, the notch filter and the detection of rotor failures.

use afbc::Profile;
use afbc_campaign::random::{FeedbackSource, RandomFlights};
use afbc_flight_core::Mode;
use afbc_guidance::FlightMode;
use afbc_hil::{Autopilot, Error, Host, MessagePeriods, Station, firmware, fly};
use afbc_log::exact::{Frames, Record, ReplayStep, Replayer};
use afbc_mavlink::{
    Address, Datum, Decoder, Downlink, Encoder, FRAME_MAX, Height, ParameterRequest, Telemetry, Uplink, VehicleCommand,
};
use afbc_onboard::{Configuration, Readings, Report};
use afbc_plant::{Motion, Payload, Plant, RotorFault};
use afbc_scenario::{Scenario, load};
use afbc_sim::flight::World;
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use afbc_vehicles::{BUILT_IN, Vehicle};
use nalgebra::Vector3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;

/// A scenario outdoors on the estimate, which begins on the ground.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../twin/scenarios/hover.toml");
/// Value of MAV_PARAM_TYPE for whole numbers.
const INT32: u8 = 6;
const STATION: Address = Address { system: 255, component: 190 };
/// Time at which the vehicle is armed and takes off \[ms\]. `ALOFT_MS` is the time at which it is in the air.
const READY_MS: u64 = 8_000;
const ALOFT_MS: u64 = 18_000;

/// Parameters that turn ESC telemetry on: over the telemetry line, or by bidirectional DSHOT on the motors' lines.
const LISTENS: [(&str, i32); 2] = [("DSHOT_TEL_CFG", 1), ("DSHOT_BIDIR_EN", 1)];

/// Returns the request to set a parameter.
fn setting(name: &str, value: i32) -> ParameterRequest {
    let mut letters = [0; 16];
    letters[..name.len()].copy_from_slice(name.as_bytes());
    ParameterRequest::Set { name: letters, value: value.to_le_bytes(), kind: INT32 }
}

/// Sets parameters of a vehicle. Calls `tick` with the frame of each.
fn set(sender: &mut Encoder, parameters: &[(&str, i32)], tick: &mut dyn FnMut(&[u8])) {
    let mut buffer = [0; FRAME_MAX];
    for (name, value) in parameters {
        tick(sender.send(&Uplink::Parameter(setting(name, *value)), &mut buffer));
    }
}

struct Flier {
    host: Host,
    world: World,
    speeds: RotorSpeeds<ROTORS_MAX>,
    ms: u64,
    sender: Encoder,
    decoder: Decoder<Downlink>,
    report: Option<Report>,
    /// Texts with their times \[ms\].
    texts: Vec<(u64, String)>,
    /// Newest rotor speeds in ESC_STATUS, for up to eight rotors \[rev/min\].
    told_rpm: Option<[i32; ROTORS_MAX]>,
    /// True rotor speeds in the last 0.25 s \[rad/s\].
    turned: std::collections::VecDeque<Vec<f64>>,
    /// Sum of |dU1| over the steps \[N\].
    kicks_n: f64,
    thrust_n: f64,
}

impl Flier {
    fn new(scenario: &Scenario, parameters: &[(&str, i32)]) -> Self {
        Flier::of(scenario, parameters, |_| ())
    }

    /// Makes a flight whose exact log is passed to `write`.
    fn recording(scenario: &Scenario, parameters: &[(&str, i32)], write: impl FnMut(&[u8]) + 'static) -> Self {
        Flier::of(scenario, parameters, |host| host.record(write))
    }

    fn of(scenario: &Scenario, parameters: &[(&str, i32)], set_up: impl FnOnce(&mut Host)) -> Self {
        let mut host = scenario.vehicle_file.as_ref().map_or_else(Host::new, Host::for_vehicle).unwrap();
        set_up(&mut host);
        let mut flier = Flier {
            host,
            world: World::released(scenario, 1e-3).unwrap(),
            speeds: RotorSpeeds::default(),
            ms: 0,
            sender: Encoder::new(STATION),
            decoder: Decoder::new(STATION),
            report: None,
            texts: Vec::new(),
            told_rpm: None,
            turned: std::collections::VecDeque::new(),
            kicks_n: 0.0,
            thrust_n: 0.0,
        };
        for (name, value) in parameters {
            flier.tick(Some(&Uplink::Parameter(setting(name, *value))));
        }
        flier
    }

    fn tick(&mut self, message: Option<&Uplink>) {
        self.world.advance(&self.speeds);
        self.world.look();
        self.host.sense(&self.world.readings().copied().unwrap_or_default());
        self.host.hear_simulated_escs(self.world.plant());
        self.turned.push_back(self.world.plant().truth().rotor_speeds_rad_s.iter().copied().collect());
        if self.turned.len() > 250 {
            self.turned.pop_front();
        }
        self.ms += 1;
        let mut buffer = [0; FRAME_MAX];
        let message = message.or((self.ms % 1_000 == 500).then_some(&Uplink::Heartbeat));
        let bytes = message.map_or(Vec::new(), |message| self.sender.send(message, &mut buffer).to_vec());
        let tick = self.host.next_tick(&bytes);
        self.speeds = tick.report.motors;
        let thrust_n: f64 = self.speeds.0.iter().map(|speed| f64::from(speed * speed) * 2.984e-5).sum();
        self.kicks_n += (thrust_n - self.thrust_n).abs();
        self.thrust_n = thrust_n;
        self.report = Some(tick.report);
        let Flier { decoder, texts, told_rpm, ms, .. } = self;
        decoder.feed_accepted(
            &tick.bytes,
            |_| true,
            |_, message| match message {
                Downlink::Text { text, .. } => texts.push((*ms, text.to_str().unwrap().to_owned())),
                Downlink::Telemetry(Telemetry::EscStatus(status)) => {
                    let all = told_rpm.get_or_insert_default();
                    all[usize::from(status.first)..][..4].copy_from_slice(&status.speeds_rpm);
                }
                _ => (),
            },
        );
    }

    fn until(&mut self, ms: u64) {
        while self.ms < ms {
            self.tick(None);
        }
    }

    /// Arms and takes off.
    fn lift_off(&mut self) {
        self.until(READY_MS);
        self.tick(Some(&Uplink::Command(VehicleCommand::Arm)));
        self.until(READY_MS + 500);
        self.tick(Some(&Uplink::Command(VehicleCommand::TakeOff(Height { metres: 5.0, above: Datum::Here }))));
        self.until(ALOFT_MS);
        assert_eq!(self.report.as_ref().unwrap().mode, Mode::Flying, "{:?}", self.texts);
    }

    fn about(&self, what: &str) -> Option<u64> {
        self.texts.iter().find(|(_, text)| text.contains(what)).map(|(ms, _)| *ms)
    }
}

/// Returns a hover in a breeze, on a given vehicle or on the scenario's own.
fn hover(seed: u64, vehicle: Option<&Vehicle>) -> Scenario {
    let mut scenario = Scenario { seed, ..load(Path::new(SCENARIO)).unwrap() };
    scenario.realism.seed = seed;
    vehicle.map_or(scenario.clone(), |vehicle| scenario.on(vehicle, Profile::Flight).unwrap())
}

/// Returns the vehicles whose ESCs speak DSHOT: all except the Crazyflie, which weighs 28 g.
fn vehicles() -> Vec<Vehicle> {
    BUILT_IN.iter().filter(|built_in| built_in.name != "crazyflie").map(|built_in| built_in.read().unwrap()).collect()
}

#[test]
fn speeds_reach_stations() {
    for (vehicle, listens) in
        vehicles().into_iter().flat_map(|vehicle| LISTENS.map(|listens| (vehicle.clone(), listens)))
    {
        let mut flier = Flier::new(&hover(1, Some(&vehicle)), &[listens]);
        flier.lift_off();
        let told = flier.told_rpm.unwrap();
        // The message is up to 0.2 s old, so its speed is one that the rotor had since then, to 1 %.
        for (rotor, told) in told.into_iter().enumerate().take(flier.turned[0].len()) {
            let rpm = flier.turned.iter().map(|speeds| speeds[rotor] * 60.0 / core::f64::consts::TAU);
            let (least, most) =
                rpm.fold((f64::INFINITY, 0.0_f64), |(least, most), rpm| (least.min(rpm), most.max(rpm)));
            let range = 0.99 * least..=1.01 * most;
            assert!(range.contains(&f64::from(told)), "{}: {told}, not {range:?}", vehicle.name);
        }
        assert_eq!(flier.about("rotor"), None, "{:?}", flier.texts);
    }
}

/// By default, no telemetry is requested or sent, and the notch does not move.
#[test]
fn by_default_nobody_listens() {
    let mut flier = Flier::new(&hover(1, None), &[]);
    flier.lift_off();
    assert_eq!(flier.told_rpm, None);
}

/// A rotor that stops in flight is reported within 0.1 s, on every vehicle, at any time and in any wind.
#[test]
fn a_stopped_rotor_is_noticed_within_100_ms() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut latest_ms = [0; 2];
    for vehicle in vehicles() {
        for seed in 0..8 {
            let kind = seed as usize % 2;
            let mut flier = Flier::new(&hover(seed, Some(&vehicle)), &[LISTENS[kind]]);
            flier.lift_off();
            flier.until(ALOFT_MS + random.next_u64() % 3_000);
            let rotor = (random.next_u64() % vehicle.rotors.len() as u64) as u8 + 1;
            let start_s = flier.world.plant().time_s();
            let fault = RotorFault { rotor, efficiency: 0.0, start_s };
            flier.world.plant_mut().set_rotor_faults(vec![fault]).unwrap();
            let (stops_ms, before) = (flier.ms, flier.texts.len());
            flier.until(stops_ms + 300);
            let told = flier.texts[before..].iter().find(|(_, text)| text.starts_with(&format!("rotor {rotor} ")));
            let Some((told_ms, _)) = told else { panic!("{} {seed}: {:?}", vehicle.name, flier.texts) };
            latest_ms[kind] = latest_ms[kind].max(told_ms - stops_ms);
            assert!(told_ms - stops_ms <= 100, "{} {seed}: {} ms", vehicle.name, told_ms - stops_ms);
            let others = flier.texts[before..].iter().filter(|(ms, text)| ms <= told_ms && text.contains("rotor "));
            assert_eq!(others.count(), 1, "{:?}", flier.texts);
        }
    }
    // With bidirectional DSHOT, the ESCs answer every frame.
    assert!(latest_ms[0] > latest_ms[1] && latest_ms[1] > 15, "{latest_ms:?}");
}

/// A vehicle with six rotors loses one and holds, lands or returns, as the parameter COM_ACT_FAIL_ACT says.
#[test]
fn a_failure_has_the_consequence_that_is_set() {
    let vehicle = BUILT_IN.iter().find(|built_in| built_in.name == "f550").unwrap().read().unwrap();
    for (action, mode) in [(0, FlightMode::Hold), (2, FlightMode::Land), (3, FlightMode::Return)] {
        let mut flier = Flier::new(&hover(1, Some(&vehicle)), &[LISTENS[0], ("COM_ACT_FAIL_ACT", action)]);
        flier.lift_off();
        assert_eq!(flier.report.as_ref().unwrap().guided.mode, FlightMode::Hold);
        let fault = RotorFault { rotor: 4, efficiency: 0.0, start_s: flier.world.plant().time_s() };
        flier.world.plant_mut().set_rotor_faults(vec![fault]).unwrap();
        flier.until(ALOFT_MS + 110);
        assert_eq!(flier.report.as_ref().unwrap().guided.mode, mode, "{action}: {:?}", flier.texts);
    }
}

/// The firmware with ESC telemetry, and its messages.
struct Heard {
    host: Host,
    decoder: Decoder<Downlink>,
    texts: Vec<String>,
    statuses: u32,
}

impl Autopilot for Heard {
    fn sense(&mut self, readings: &Readings) -> bool {
        self.host.sense(readings);
        true
    }

    fn turn_rotors(&mut self, plant: &Plant) {
        self.host.hear_simulated_escs(plant);
    }

    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        let bytes = self.host.next_tick(uplink).bytes;
        let Heard { decoder, texts, statuses, .. } = self;
        decoder.feed_accepted(
            &bytes,
            |_| true,
            |_, message| match message {
                Downlink::Text { text, .. } => texts.push(text.to_str().unwrap().to_owned()),
                Downlink::Telemetry(Telemetry::EscStatus(_)) => *statuses += 1,
                _ => (),
            },
        );
        hear(&bytes);
        Ok(())
    }
}

/// Randomly drawn flights of every vehicle, fast and slow, with worn rotors, changing masses, gusts and low batteries,
/// raise no alarm.
#[test]
fn no_drawn_flight_raises_an_alarm() {
    for seen in [FeedbackSource::Mocap, FeedbackSource::Outdoor] {
        let drawn = RandomFlights { seeds: 1..3, flights: 6, seen, vehicles: vehicles() }.draw().unwrap();
        let (mut flown, mut lost) = (0, Vec::new());
        for (flight, listens) in drawn.into_iter().zip(LISTENS.into_iter().cycle()) {
            let mut scenario = flight.scenario;
            // The vehicle must be level and at rest to arm.
            scenario.initial = Motion {
                position_m: scenario.initial.position_m,
                attitude_rad: Vector3::new(0.0, 0.0, scenario.initial.attitude_rad.z),
                ..Motion::default()
            };
            let contenders = vec![firmware(&scenario).unwrap()];
            let scenario = Scenario { contenders, ..scenario };
            let vehicle = scenario.vehicle_file.clone().unwrap();
            let mut host = Host::for_vehicle(&vehicle).unwrap();
            set(&mut Encoder::new(STATION), &[listens], &mut |bytes| drop(host.next_tick(bytes)));
            let mut heard = Heard { host, decoder: Decoder::new(STATION), texts: Vec::new(), statuses: 0 };
            let end =
                fly(
                    &scenario,
                    &mut Station::new(),
                    &mut heard,
                    MessagePeriods::LOCKSTEP,
                    |_| ControlFlow::Continue(()),
                );
            let what = format!("{} {} {}", flight.vehicle, flight.seed, flight.number);
            match end {
                Ok(end) if end.lost.is_none() => flown += 1,
                Ok(end) => lost.push(format!("{what}: {:?}, {:?}", end.lost, heard.texts)),
                Err(error) => lost.push(format!("{what}: {error}")),
            }
            let alarms: Vec<_> = heard.texts.iter().filter(|text| text.starts_with("rotor ")).collect();
            assert!(alarms.is_empty(), "{what}: {alarms:?}");
            assert!(heard.statuses > 20, "{what}");
        }
        assert!(flown > 58, "{flown}: {lost:#?}");
    }
}

/// Returns the mean |dU1| of a hover with a payload of the fraction `load` of the mass \[N\]. The notch follows the
/// measured speeds if `follows` is true, and is fixed otherwise.
fn kicks_n(vehicle: &Vehicle, load: f64, follows: bool, seed: u64) -> f64 {
    let mut scenario = hover(seed, Some(vehicle));
    scenario.realism.wind.turbulence = None;
    scenario.realism.wind.steady_m_s = Vector3::zeros();
    let mass_kg = load * vehicle.parameters.mass_kg;
    let payload = Payload { mass_kg, below_m: 0.0, ahead_m: 0.0, left_m: 0.0, start_s: 0.0, end_s: f64::INFINITY };
    scenario.environment = scenario.environment.clone().with_payloads(vec![payload]).unwrap();
    let follow = [LISTENS[seed as usize % 2], ("MOT_NOTCH_FOLLOW", i32::from(follows))];
    let mut flier = Flier::new(&scenario, &follow);
    flier.lift_off();
    flier.kicks_n = 0.0;
    flier.until(ALOFT_MS + 5_000);
    flier.kicks_n / 5_000.0
}

/// With a payload, the rotors turn faster than in hover without one. A fixed notch then passes their vibration; a notch
/// that follows the measured speeds does not.
#[test]
fn a_notch_that_follows_beats_one_that_stands() {
    let paper = BUILT_IN.iter().find(|built_in| built_in.name == "paper").unwrap().read().unwrap();
    for (load, at_most) in [(0.0, 1.05), (0.25, 0.95), (0.5, 0.85)] {
        for seed in 1..4 {
            let [stands, follows] = [false, true].map(|follows| kicks_n(&paper, load, follows, seed));
            // Measured ratios: 1.00 to 1.02 without a payload, 0.73 to 0.90 with a quarter of the mass, 0.57 to 0.79
            // with half.
            assert!(follows < at_most * stands, "load {load}, seed {seed}: {follows} of {stands} N");
        }
    }
}

/// A replay repeats the inputs and outputs of a flight with measured speeds. A notch at another frequency is noticed.
#[test]
fn flights_with_measured_speeds_replay_exactly() {
    LISTENS.into_iter().for_each(flies_and_replays);
}

fn flies_and_replays(listens: (&str, i32)) {
    let bytes = Rc::new(RefCell::new(Vec::new()));
    let taken = Rc::clone(&bytes);
    let mut flier =
        Flier::recording(&hover(3, None), &[listens], move |frame| taken.borrow_mut().extend_from_slice(frame));
    flier.lift_off();
    let start_s = flier.world.plant().time_s();
    let payload = Payload { mass_kg: 0.2, below_m: 0.0, ahead_m: 0.0, left_m: 0.0, start_s, end_s: f64::INFINITY };
    let environment = flier.world.plant().environment().clone().with_payloads(vec![payload]).unwrap();
    flier.world.plant_mut().set_environment(environment);
    flier.until(ALOFT_MS + 4_000);

    let mut frames = Frames::default();
    let records: Vec<_> = bytes.borrow().iter().filter_map(|byte| frames.take(*byte)).collect();
    let moved = |record: &&Record| matches!(record, Record::Tick(tick, _) if tick.notch_rad_s.is_some());
    assert!(records.iter().filter(moved).count() > 10);

    let replay = |changed: &dyn Fn(u32) -> f32| {
        let mut replayer = Replayer::new(Configuration::default()).unwrap();
        let mut same = 0;
        for record in &records {
            let mut record = record.clone();
            if let Record::Tick(tick, _) = &mut record {
                tick.notch_rad_s = tick.notch_rad_s.map(|notch| notch + changed(tick.number));
            }
            match replayer.take(&record) {
                ReplayStep::Nothing => (),
                ReplayStep::Same(_) => same += 1,
                ReplayStep::Differs(..) => break,
            }
        }
        same
    };
    assert_eq!(replay(&|_| 0.0), flier.ms);
    let last = records.iter().rev().find(moved).unwrap();
    let Record::Tick(last, _) = last else { unreachable!() };
    let differs = replay(&|number| if number == last.number { 1.0 } else { 0.0 });
    assert!((u64::from(last.number)..u64::from(last.number) + 100).contains(&differs), "{differs} {}", last.number);
}
