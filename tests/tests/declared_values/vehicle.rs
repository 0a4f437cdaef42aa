//! The declared values of a vehicle file.

use super::document::{Case, Document};
use super::stories::Story;
use super::subject::{Responses, Subject, change_each, compare, fields};
use crate::airborne::STATION;
use afbc::Profile;
use afbc_guidance::{FailsafeSettings, FlightModeSettings};
use afbc_hil::Host;
use afbc_mavlink::{Decoder, Downlink, Encoder, FRAME_MAX, ParameterRequest, Uplink};
use afbc_onboard::parameters::ParameterTable;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_scenario::{Scenario, built_in};
use afbc_types::Axis;
use afbc_vehicles::Vehicle;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, OnceLock};

/// Tables of a file, and the prefixes of their parameters at a station.
const PREFIXES: [(&str, &str); 8] = [
    ("vehicle", "V_"),
    ("motor", "MOT_"),
    ("imu", "IMU_"),
    ("arming", "ARM_"),
    ("estimator", "EST_"),
    ("guidance", ""),
    ("gains.flight.cascade", "C_"),
    ("gains.flight.afbc", "A_"),
];

impl Subject for Vehicle {
    fn read(text: &str) -> Result<Self, String> {
        let vehicle = afbc_vehicles::parse("f", text, "f").map_err(|error| error.to_string())?;
        in_scenario("mocap", &vehicle).map(|_| vehicle)
    }

    fn document(&self) -> Document {
        let (drag, contact) = (self.realism.drag.unwrap(), self.realism.contact.unwrap());
        let height = drag.rotor_height_m;
        let mut document = Document::default().group("[vehicle]", &self.parameters, "", &[]);
        for rotor in &self.rotors {
            let [x, y] = [rotor.x, rotor.y].map(|along| along * self.parameters.arm_m);
            let further = format!("{:?}", [x * 1.001, y, height]);
            let spin = if rotor.pushes_left { "cw" } else { "ccw" };
            document = document.plain(
                "[[rotor]]",
                &[("position_m", format!("{:?}", [x, y, height]), &[&further]), ("spin", format!("{spin:?}"), &[])],
            );
        }
        let force_max_n = format!("{:?}", self.force_max_n);
        // On rotors this weak, a flight meets their limit.
        let weaker = format!("{:?}", self.force_max_n * 0.9);
        let document = document
            .group("[rotors]", &self.realism.rotors, "", &["max_rad_s"])
            .plain("[rotors]", &[("force_max_n", force_max_n, &[&weaker])])
            .group("[motor]", &self.curve, "", &[])
            .group("[battery]", &self.realism.rotors.battery.unwrap(), "", &[])
            .group("[drag]", &drag, "", &["rotor_height_m"])
            .group("[ground]", &contact, "", &["rotor_height_m"])
            .group("[ground]", &self.realism.ground_effect.unwrap_or_default(), "", &["rotor_height_m"])
            .plain("[ground]", &[("ground_effect", self.realism.ground_effect.is_some().to_string(), &[])])
            .group("[imu]", &self.imu, "", &[])
            .group("[arming]", &self.arming, "", &[])
            .group("[estimator]", &self.estimation, "", &["gravity_m_s2"])
            .group("[guidance]", &self.guidance, "", &[])
            .group("[gains.flight.cascade]", &self.flight_settings, "", &["dt_s", "rotor_force_max_n"])
            .group("[gains.flight.cascade]", &self.flight_settings, "limits", &[]);
        ControllerKind::ALL.into_iter().fold(document, |document, kind| {
            let law = Law::on(kind, self, Profile::Flight).unwrap();
            let header = format!("[gains.flight.{}", kind.name());
            if !kind.in_cascade() {
                return document.group(&format!("{header}]"), &law, "", &[]);
            }
            let axes = Axis::ALL.map(Axis::name).into_iter();
            axes.fold(document, |document, axis| document.group(&format!("{header}.{axis}]"), &law, axis, &[]))
        })
    }

    /// All laws, with a tracker. Stories begin on the ground.
    fn scenario(&self) -> Scenario {
        in_scenario("mocap", self).unwrap()
    }

    fn check_on_board(&self, base: &Self, case: &Case, changed: &str) {
        let table = case.header.rsplit_once('.').filter(|(table, _)| *table == "gains.flight.afbc");
        let table = table.map_or(case.header.as_str(), |(table, _)| table);
        let prefix = PREFIXES.iter().find(|(it, _)| *it == table);
        let (Some((_, prefix)), Some(declaration)) = (prefix, case.declaration) else { return };
        let name = declaration.name(prefix, case.coordinate).to_string();
        let value = read_by_station(self, &name);
        let index = ['X', 'Y', 'Z'].iter().position(|it| Some(*it) == case.coordinate).unwrap_or(0);
        let number = changed.trim_matches(['[', ']']).split(", ").nth(index).unwrap();
        let expected = match number {
            "true" => 1.0,
            "false" => 0.0,
            number => number.parse().unwrap_or(value),
        };
        assert_eq!(value, expected, "{case} as {name}");
        assert_ne!(value, read_by_station(base, &name), "{case} as {name}");
        let differing = |one: &str, other: &str| one.lines().zip(other.lines()).filter(|(it, is)| it != is).count();
        assert!(differing(&self.image(), &base.image()) >= 1, "{case}: the image is the same");
    }

    fn responds(&self, base: &Self, case: &Case) -> bool {
        let law = ControllerKind::ALL.into_iter().find(|kind| case.header.split('.').nth(2) == Some(kind.name()));
        match law {
            Some(kind) if kind != ControllerKind::Afbc => flown(self, kind) != flown(base, kind),
            _ => {
                let story = Story::of(case);
                let trace = trace(story, base);
                story.differs(&in_scenario(story.scenario(), self).unwrap(), &trace)
            }
        }
    }
}

/// Returns a built-in scenario on a vehicle, or an error if the vehicle cannot fly it.
fn in_scenario(name: &str, vehicle: &Vehicle) -> Result<Scenario, String> {
    built_in(name).unwrap().read().unwrap().on(vehicle, Profile::Flight).map_err(|error| error.to_string())
}

/// Returns the trace of a story with the unchanged vehicle, which is flown only once.
fn trace(story: Story, base: &Vehicle) -> Vec<u64> {
    static TRACES: OnceLock<Mutex<BTreeMap<Story, Vec<u64>>>> = OnceLock::new();
    let mut traces = TRACES.get_or_init(Mutex::default).lock().unwrap();
    traces.entry(story).or_insert_with(|| story.trace(&in_scenario(story.scenario(), base).unwrap())).clone()
}

/// Returns the trace of a short flight under a law.
fn flown(vehicle: &Vehicle, kind: ControllerKind) -> Vec<u64> {
    let scenario = in_scenario("wind", vehicle).unwrap();
    super::scenario::trace(&Scenario { duration_s: 3.0, ..scenario }, kind)
}

/// Returns a parameter as a station reads it over the link.
fn read_by_station(vehicle: &Vehicle, name: &str) -> f32 {
    let (mut host, mut sender) = (Host::for_vehicle(vehicle).unwrap(), Encoder::new(STATION));
    let mut letters = [0; 16];
    letters.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from);
    let mut buffer = [0; FRAME_MAX];
    let ask = Uplink::Parameter(ParameterRequest::ReadName(letters));
    let mut frame = sender.send(&ask, &mut buffer).to_vec();
    let (mut decoder, mut read) = (Decoder::<Downlink>::new(STATION), None);
    for _ in 0..1000 {
        let bytes = host.next_tick(&std::mem::take(&mut frame)).bytes;
        decoder.feed(&bytes, |_, message| {
            if let Downlink::Parameter(answer) = message {
                assert_eq!(answer.name, letters);
                let float = f32::from_le_bytes(answer.value);
                read = Some(if answer.kind == 6 { i32::from_le_bytes(answer.value) as f32 } else { float });
            }
        });
        if let Some(value) = read {
            return value;
        }
    }
    panic!("no answer about {name}")
}

/// Returns a vehicle whose limits and battery are reached in the stories.
fn base() -> Vehicle {
    let mut vehicle = afbc_vehicles::built_in("iris").unwrap().read().unwrap();
    let battery = vehicle.realism.rotors.battery.unwrap();
    let (net, flying) = (vehicle.guidance.failsafe, vehicle.guidance.flying);
    vehicle.guidance.failsafe = FailsafeSettings {
        fence_radius_m: 10.0,
        fence_height_m: 8.0,
        station_lost_s: 2.0,
        cells: 3,
        empty_v: (battery.empty_v / 3.0) as f32,
        full_v: (battery.full_v / 3.0) as f32,
        resistance_ohm: (battery.resistance_ohm / 3.0) as f32,
        critical: 0.1,
        emergency: 0.03,
        ..net
    };
    vehicle.guidance.flying = FlightModeSettings {
        takeoff_height_m: 3.0,
        return_height_m: 5.0,
        disarm_before_s: 3.0,
        near_home_m: 1.0,
        land_slow_m: 2.0,
        ..flying
    };
    // The bound is large enough to lift the vehicle without feed-forward.
    vehicle.flight_gains.z.safeguards.theta_max = 80.0;
    Vehicle::read(&vehicle.document().text()).unwrap()
}

/// Keys to which no flight responds, with the reasons.
const IDLE: &[(&str, &[&str])] = &[
    ("armed at rest on level ground, where it is to be", &["arming.setpoint_distance_max_m", "arming.tilt_max_rad"]),
    (
        "what an estimate is accepted with, or a sensor fails by, far from what they are in a flight without faults",
        &[
            "estimator.accel_bias_max_m_s2",
            "estimator.accel_noisy_m_s2",
            "estimator.align_tilt_rad",
            "estimator.coast_s",
            "estimator.frozen_s",
            "estimator.gyro_bias_max_rad_s",
            "estimator.gyro_noisy_rad_s",
            "estimator.position_sigma_max_m",
            "estimator.reacquire_s",
            "estimator.stuck_s",
            "estimator.tilt_sigma_max_rad",
        ],
    ),
    (
        "bounds that a calm flight stays within",
        &[
            "gains.flight.afbc.z.theta_max",
            "gains.flight.cascade.climb_max_m_s",
            "gains.flight.cascade.reference_yaw_rate_rad_s",
            "gains.flight.cascade.speed_max_m_s",
            "gains.flight.indi.speed_max_m_s",
            "gains.flight.pid.speed_max_m_s",
        ],
    ),
    (
        "limits together with a target that accelerates, and none does",
        &["guidance.acceleration_max_m_s2", "guidance.jerk_max_m_s3"],
    ),
    ("what a board's converter measures of a battery", &["guidance.current_a_v", "guidance.divider"]),
    ("it lands by the mode return, which disarms at once", &["guidance.disarm_after_s"]),
    (
        "acro is flown by the tests of afbc-hil",
        &["guidance.acro_pitch_deg_s", "guidance.acro_roll_deg_s", "guidance.acro_yaw_deg_s"],
    ),
    (
        "a served vehicle begins with its rotors at rest, and flies on faster ones",
        &["rotors.min_rad_s", "rotors.start"],
    ),
];
/// Fields that no key of a file changes.
const FIXED: &[(&str, &str)] = &[
    ("estimation_stated", "names of keys that there are: crates/campaign/tests/fingerprint.rs"),
    ("flight_settings.common.dt_s", "a millisecond on board, and the scenario's elsewhere"),
    ("rotors.pushes_left", "spin: not declared, and one rotor cannot change it alone"),
    ("realism.contact.rotor_height_m", "from position_m of the rotors, as the next two"),
    ("realism.drag.rotor_height_m", "from position_m"),
    ("realism.ground_effect.rotor_height_m", "from position_m"),
    ("realism.rotors.faults", "the scenario's, as all that follows"),
    ("realism.seed", "the scenario's"),
    ("realism.wind.gusts", "the scenario's"),
    ("realism.wind.steady_m_s", "the scenario's"),
    ("realism.wind.turbulence", "the scenario's"),
];

#[test]
fn every_value_of_a_vehicles_file_counts() {
    let base = base();
    let mut responses = Responses::new();
    let changed = change_each(&base, &mut responses);
    let fixed: BTreeSet<&str> = FIXED.iter().map(|(field, _)| *field).collect();
    let fields = fields(&base);
    let unchanged: Vec<_> =
        fields.keys().filter(|field| !changed.contains(*field) && !fixed.contains(field.as_str())).collect();
    assert!(unchanged.is_empty(), "no key of a file changes {unchanged:#?}");
    compare(&responses, IDLE);
}

/// Every parameter of a station is in the vehicle file, except those that follow from another key or do not belong to
/// the vehicle.
#[test]
fn every_parameter_of_a_station_is_in_the_file() {
    const ELSEWHERE: [(&str, &str); 27] = [
        ("CAL_", "those of calibrations: of each vehicle's own sensors"),
        ("COM_ACT_FAIL_ACT", "the motor controllers'"),
        ("DSHOT_BIDIR_EN", "the motor controllers'"),
        ("DSHOT_TEL_CFG", "the motor controllers'"),
        ("FD_ACT_EN", "the motor controllers'"),
        ("MOT_NOTCH_FOLLOW", "the motor controllers'"),
        ("MOT_POLE_COUNT", "the motors'"),
        ("MC_ACRO_EXPO", "the pilot's"),
        ("MC_ACRO_EXPO_Y", "the pilot's"),
        ("MC_ACRO_SUPEXPO", "the pilot's"),
        ("MC_ACRO_SUPEXPOY", "the pilot's"),
        ("MPC_HOLD_DZ", "the pilot's"),
        ("MPC_XY_MAN_EXPO", "the pilot's"),
        ("MPC_YAW_EXPO", "the pilot's"),
        ("MPC_Z_MAN_EXPO", "the pilot's"),
        ("COM_FLTMODE", "the pilot's"),
        ("COM_RC_", "the pilot's"),
        ("LOG_PORT", "the link's"),
        ("RC", "the pilot's and the receiver's"),
        ("SDLOG_MODE", "the log's"),
        ("MOT_PROTOCOL", "what its motor controllers understand"),
        ("MOT_LAG", "time_constant_s of [rotors]"),
        ("C_FORCE_MAX", "force_max_n of [rotors]"),
        ("EST_GRAVITY", "gravity_m_s2 of [vehicle]"),
        ("C_DT", "the firmware's"),
        ("MAV_SYS_ID", "the link's"),
        ("SER_TEL1_BAUD", "the link's"),
    ];
    let base = base();
    let in_file: BTreeSet<String> = base
        .document()
        .cases()
        .iter()
        .filter_map(|case| {
            let table = case.header.strip_suffix(case.declaration?.group).unwrap_or(&case.header);
            let table = table.trim_end_matches('.');
            let (_, prefix) = PREFIXES.iter().find(|(it, _)| *it == table || *it == case.header)?;
            Some(case.declaration?.name(prefix, case.coordinate).to_string())
        })
        .collect();
    let seen: BTreeSet<String> =
        ParameterTable::new(base.configuration().unwrap()).iter().map(|it| it.name.to_string()).collect();
    let groups = ["CAL_", "COM_FLTMODE", "COM_RC_", "RC"];
    let mut missing: Vec<&str> = seen
        .difference(&in_file)
        .map(|name| groups.into_iter().find(|group| name.starts_with(group)).unwrap_or(name))
        .collect();
    missing.dedup();
    let mut elsewhere = ELSEWHERE.map(|(name, _)| name).to_vec();
    elsewhere.sort_unstable();
    assert_eq!(missing, elsewhere);
}

/// The configuration without a vehicle file equals that of the paper's vehicle.
#[test]
fn the_default_configuration_is_the_papers() {
    let paper = afbc_vehicles::built_in("paper").unwrap().read().unwrap();
    assert_eq!(paper.configuration().unwrap(), afbc_onboard::Configuration::default());
}
