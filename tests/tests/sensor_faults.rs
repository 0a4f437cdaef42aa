//! Faults of the vehicle's own sensors inside the flight core, and their results. Compares the table of
//! `docs/reference/sensor-faults.md`, or writes it with `WRITE=1`.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs)] // a failed flight must stop the test

use afbc::Profile;
use afbc_campaign::suite::SUITES;
use afbc_plant::instruments::{FailureKind, InstrumentFault, TrackerModel};
use afbc_plant::{Environment, PlantParameter, PlantParameterChange};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_sim::flight::{LOST_DISTANCE_M, fly};
use nalgebra::Vector3;
use std::{env, fs, thread};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/reference/sensor-faults.md");
const BEGIN: &str = "<!-- sensor faults: tests/tests/sensor_faults.rs -->\n";
const END: &str = "<!-- end -->\n";

/// Onset of every fault \[s\].
const ONSET_S: f64 = 10.0;
/// Height below which a vehicle that descends from 15 m is about to touch the ground \[m\].
const NEARLY_DOWN_M: f64 = 0.5;
/// Height of the centre of mass below which a vehicle touches the ground \[m\].
const GROUND_M: f64 = 0.15;
/// Fastest touch-down of a vehicle that knows its attitude \[m/s\]. `HEIGHTLESS_M_S` applies to a vehicle without a
/// height.
const TOUCH_M_S: f64 = 0.8;
const HEIGHTLESS_M_S: f64 = 2.0;
/// Flights without a height.
const HEIGHTLESS: [&str; 2] = ["tracker-and-barometer-lost", "gnss-and-barometer-lost"];
/// Number of seeds of every fault.
const SEEDS: u64 = 4;
/// Flights without inertial sensor and tracker. They have no attitude, so they descend blind and end in a fall.
const BLIND: [&str; 4] = ["imu-stuck-outdoors", "imu-dead-outdoors", "tracker-and-imu-lost", "imu-then-tracker-lost"];
/// Flights with a sudden gyroscope error of two degrees per second. The filter may need longer to find the bias than
/// the vehicle needs to fall.
const TOO_MUCH: [&str; 1] = ["gyro-biased-outdoors"];
/// Flights without a position outdoors. The vehicle drifts, touches the ground at up to 4 m/s sideways and may tip over
/// there, or the flight ends because it is too far away when it has nearly come down.
const ADRIFT: [&str; 2] = ["gnss-lost", "magnetometer-and-gnss-lost"];

/// Result of a flight from the onset on.
#[derive(Clone, Debug, Default)]
struct Outcome {
    /// Largest distance from the reference before the vehicle touched the ground \[m\].
    off_m: f64,
    /// Largest tilt before the vehicle touched the ground \[rad\].
    tilt_rad: f64,
    /// Vertical speed of the first touch-down \[m/s\].
    touched_m_s: Option<f64>,
    /// Height at which the motors stopped \[m\].
    stopped_m: Option<f64>,
    tumbled: bool,
    /// Height at the end of the flight \[m\].
    end_m: f64,
    /// Fastest touch-down that counts as a landing \[m/s\].
    gentle_m_s: f64,
}

impl Outcome {
    fn of(scenario: &Scenario) -> Self {
        let is_heightless = HEIGHTLESS.contains(&scenario.name.as_str());
        let gentle_m_s = if is_heightless { HEIGHTLESS_M_S } else { TOUCH_M_S };
        let mut outcome = Outcome { gentle_m_s, ..Outcome::default() };
        let contender = Contender::of(ControllerKind::Afbc, Profile::Flight).monitored();
        let lost = fly(scenario, &contender, |sample| {
            if sample.time_s < ONSET_S {
                return;
            }
            let (p, eta) = (&sample.motion.position_m, &sample.motion.attitude_rad);
            outcome.end_m = p.z;
            if p.z < GROUND_M {
                outcome.touched_m_s.get_or_insert(sample.motion.velocity_m_s.z.abs());
            }
            if outcome.touched_m_s.is_none() {
                outcome.tilt_rad = outcome.tilt_rad.max((eta.x.cos() * eta.y.cos()).acos());
                outcome.off_m = outcome.off_m.max((p - sample.reference.position_m).norm());
            }
            if sample.action.speeds.0.iter().all(|speed| *speed == 0.0) {
                outcome.stopped_m.get_or_insert(p.z);
            }
        });
        outcome.tumbled = lost.unwrap().is_some();
        outcome
    }

    fn flies_on(&self) -> bool {
        !self.tumbled && self.touched_m_s.is_none() && self.stopped_m.is_none()
    }

    /// True if the vehicle came down upright and gently, and the motors stopped on the ground.
    fn lands(&self) -> bool {
        !self.tumbled
            && self.touched_m_s.is_some_and(|speed| speed < self.gentle_m_s)
            && self.stopped_m.is_some_and(|height| height < GROUND_M)
    }

    /// True if the vehicle came down upright and gently, and then tipped over on the ground.
    fn tips_over(&self) -> bool {
        self.tumbled && self.tilt_rad < 0.5 && self.touched_m_s.is_some_and(|speed| speed < self.gentle_m_s)
    }

    /// True if the flight ended too far away, with the vehicle upright and nearly down.
    fn drifts_off(&self) -> bool {
        self.off_m > LOST_DISTANCE_M && self.tilt_rad < 0.5 && self.end_m < NEARLY_DOWN_M && self.stopped_m.is_none()
    }

    fn words(&self) -> String {
        let touched = self.touched_m_s.map(|speed| format!(", touches the ground at {speed:.1} m/s"));
        let stopped = self.stopped_m.filter(|height| *height > GROUND_M);
        match (self.flies_on(), self.lands(), self.tumbled, stopped) {
            (true, ..) => "flies on".into(),
            (_, true, ..) => format!("lands{}", touched.unwrap_or_default()),
            _ if self.drifts_off() => "drifts off, nearly down where the flight ends".into(),
            _ if self.tips_over() => format!("lands{}, tips over", touched.unwrap_or_default()),
            (_, _, true, _) => "descends blind, tumbles".into(),
            (.., Some(height)) => {
                format!("descends blind, motors stop at {height:.1} m{}", touched.unwrap_or_default())
            }
            _ => format!("descends blind{}", touched.unwrap_or_default()),
        }
    }
}

fn suite() -> Vec<Scenario> {
    let suite = SUITES.iter().find(|suite| suite.name == "sensors").unwrap().read().unwrap();
    suite.flights.into_iter().map(|flight| flight.scenario).collect()
}

/// Flies every flight of the suite with this seed.
fn flown(seed: u64) -> Vec<(Scenario, Outcome)> {
    all(suite().into_iter().map(|scenario| Scenario { seed, ..scenario }))
}

fn all(scenarios: impl IntoIterator<Item = Scenario>) -> Vec<(Scenario, Outcome)> {
    thread::scope(|threads| {
        let fly = |scenario: Scenario| {
            threads.spawn(move || {
                let outcome = Outcome::of(&scenario);
                (scenario, outcome)
            })
        };
        let flights: Vec<_> = scenarios.into_iter().map(fly).collect();
        flights.into_iter().map(|flight| flight.join().unwrap()).collect()
    })
}

/// A vehicle that knows its attitude flies on or lands, wherever it is.
#[test]
fn no_fault_stops_the_motors_in_the_air_but_the_loss_of_the_attitude() {
    for seed in 1..=SEEDS {
        for (scenario, outcome) in flown(seed) {
            let among = |names: &[&str]| names.contains(&scenario.name.as_str());
            let is_blind = among(&BLIND);
            let name = format!("{}, seed {seed}: {outcome:?}", scenario.name);
            let may_end = among(&ADRIFT) && (outcome.tips_over() || outcome.drifts_off());
            assert!(is_blind || among(&TOO_MUCH) || may_end || outcome.flies_on() || outcome.lands(), "{name}");
            // A flight listed as blind must not fly on.
            assert!(!is_blind || !outcome.flies_on(), "{name}");
        }
    }
}

/// With a tracker's poses alone, the vehicle is flown with a model of itself. The model may be wrong: half or twice the
/// thrust, 0.6 or 1.5 times the inertia, a payload of two fifths of the weight. Other trackers are tried as well: 30
/// Hz, 40 ms late, noise of 5 mm and 0.01 rad, one outlier in fifty, a frame that jumps.
#[test]
fn the_model_that_stands_in_for_the_inertial_sensor_need_not_be_right() {
    let base = suite().into_iter().find(|scenario| scenario.name == "imu-dead-indoors").unwrap();
    let changed = |quantity, factor| {
        let mut scenario = Scenario { name: format!("{quantity:?} {factor}"), ..base.clone() };
        let change = PlantParameterChange { quantity, factor, start_s: 0.0, end_s: f64::INFINITY };
        scenario.environment = Environment::new(scenario.vehicle, vec![change], Vec::new()).unwrap();
        scenario
    };
    let tracked = |name: &str, change: &dyn Fn(&mut TrackerModel)| {
        let mut scenario = Scenario { name: name.into(), ..base.clone() };
        scenario.instruments.tracker.iter_mut().for_each(change);
        scenario
    };
    let mut jumped = Scenario { name: "jumped".into(), ..base.clone() };
    let failure = FailureKind::TrackerJumped { by_m: Vector3::new(0.5, 0.0, 0.0), yaw_rad: 0.3 };
    jumped.instrument_faults.push(InstrumentFault { failure, start_s: 15.0, end_s: jumped.duration_s, rise_s: 0.0 });
    let scenarios = [
        changed(PlantParameter::ThrustFactor, 0.5),
        changed(PlantParameter::ThrustFactor, 2.0),
        changed(PlantParameter::Inertia, 0.6),
        changed(PlantParameter::Inertia, 1.5),
        changed(PlantParameter::Mass, 1.4),
        tracked("slow", &|tracker| tracker.rate_hz = 30.0),
        tracked("late", &|tracker| tracker.delay_s = 0.04),
        tracked("noisy", &|tracker| (tracker.position_m, tracker.attitude_rad) = (0.005, 0.01)),
        tracked("wild", &|tracker| tracker.outliers = 0.02),
        jumped,
    ];
    for (scenario, outcome) in all(scenarios.into_iter().map(|flight| Scenario { duration_s: 30.0, ..flight })) {
        let name = format!("{}: {outcome:?}", scenario.name);
        // The frame jumps by 0.5 m, and its turn moves a point 1 m from the origin by 0.3 m.
        let allowed_m = if scenario.name == "jumped" { 0.9 } else { 0.1 };
        assert!(outcome.flies_on() && outcome.off_m < allowed_m, "{name}");
    }
}

#[test]
fn the_page_is_what_flies() {
    let row = |(scenario, outcome): &(Scenario, Outcome)| {
        let Outcome { off_m, tilt_rad, .. } = outcome;
        let (name, what) = (&scenario.name, &scenario.description);
        format!("| `{name}`: {what} | {} | {off_m:.2} | {:.0} |\n", outcome.words(), tilt_rad.to_degrees())
    };
    let rows: String = flown(1).iter().map(row).collect();
    let table = format!("| fault | outcome | off \\[m\\] | tilt \\[deg\\] |\n|---|---|--:|--:|\n{rows}");
    let page = fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (kept, after) = rest.split_once(END).unwrap();
    if env::var_os("WRITE").is_some() {
        fs::write(PAGE, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
    } else {
        assert_eq!(kept, table, "WRITE=1 writes it");
    }
}
