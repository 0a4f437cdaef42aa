//! The declared values of a scenario file.

use super::document::{Case, Document};
use super::subject::{Responses, Subject, change_each, compare, fields};
use afbc_scenario::Scenario;
use afbc_scenario::contender::ControllerKind;
use afbc_sim::flight::{Sample, fly};
use afbc_types::Axis;
use std::collections::BTreeSet;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

impl Subject for Scenario {
    fn read(text: &str) -> Result<Self, String> {
        afbc_scenario::parse("f", text, "f").map_err(|error| error.to_string())
    }

    fn document(&self) -> Document {
        let seed = self.seed.to_string();
        let mut document = Document::default().plain(
            "",
            &[
                ("duration_s", format!("{:?}", self.duration_s), &[]),
                ("seed", seed, &[]),
                ("profile", "\"flight\"".into(), &[]),
            ],
        );
        let is_measured = self.instruments.imu.is_none();
        let centre_m = if is_measured { "[0.0, 0.0, 9.0]" } else { "[0.0, 0.0, 1.0]" };
        document = document
            .plain(
                "[trajectory]",
                &[
                    ("kind", "\"circle\"".into(), &[]),
                    ("centre_m", centre_m.into(), &[]),
                    ("radius_m", "1.0".into(), &[]),
                    ("acceleration_m_s2", "1.0".into(), &[]),
                ],
            )
            .plain("[initial]", &[("position_m", format!("{:?}", self.initial.position_m.data.0[0]), &[])])
            .group("[vehicle]", &self.vehicle, "", &[])
            .group("[truth]", self.environment.nominal(), "", &[]);
        let realism = &self.realism;
        document = document.group("[rotors]", &realism.rotors, "", &[]);
        if let Some(battery) = &realism.rotors.battery {
            document = document.group("[battery]", battery, "", &[]);
        }
        if let Some(drag) = &realism.drag {
            document = document.group("[drag]", drag, "", &[]).group("[wind]", &realism.wind, "", &[]);
        }
        if let Some(turbulence) = &realism.wind.turbulence {
            document = document.group("[wind.turbulence]", turbulence, "", &[]);
        }
        if let (Some(contact), Some(effect)) = (&realism.contact, &realism.ground_effect) {
            document = document.group("[ground]", contact, "", &[]).group("[ground]", effect, "", &["rotor_height_m"]);
        }
        if let Some(dropouts) = &self.sensing.dropouts {
            document = document
                .group("[sensors]", &self.sensing, "", &[])
                .group("[sensors.noise]", &self.sensing.noise, "", &[])
                .group("[sensors.bias]", &self.sensing.bias, "", &[])
                .group("[sensors.dropouts]", dropouts, "", &[]);
        }
        let suite = &self.instruments;
        if let (Some(imu), Some(tracker)) = (&suite.imu, &suite.tracker) {
            document = ["", "gyro", "accel"]
                .into_iter()
                .fold(document, |document, group| document.group(&sub("instruments.imu", group), imu, group, &[]));
            document = ["", "loss", "freeze"].into_iter().fold(document, |document, group| {
                document.group(&sub("instruments.tracker", group), tracker, group, &[])
            });
        }
        if let (Some(gnss), Some(barometer), Some(magnetometer)) = (&suite.gnss, &suite.barometer, &suite.magnetometer)
        {
            document = ["", "loss"]
                .into_iter()
                .fold(document, |document, group| document.group(&sub("instruments.gnss", group), gnss, group, &[]));
            document = document.group("[instruments.barometer]", barometer, "", &[]);
            document = document.group("[instruments.magnetometer]", magnetometer, "", &[]);
        }
        // The time step belongs to the file, all other settings to a contender.
        let dt_s = format!("{:?}", self.contenders[0].settings.common.dt_s);
        // With an estimator, the step must be a millisecond.
        let others: &[&str] = if is_measured { &["0.0005"] } else { &[] };
        document = document.plain("[settings]", &[("dt_s", dt_s, others)]);
        self.contenders.iter().fold(document, |document, contender| {
            let name = format!("{:?}", contender.name);
            let document = document.plain("[[contender]]", &[("name", name.clone(), &[]), ("controller", name, &[])]);
            let groups = if contender.kind().in_cascade() { Axis::ALL.map(Axis::name).to_vec() } else { vec![""] };
            let document = groups.into_iter().fold(document, |document, group| {
                document.group(&sub("contender.gains", group), &contender.law, group, &[])
            });
            // Laws outside the cascade only have their gains.
            if !contender.kind().in_cascade() {
                return document;
            }
            document.group("[contender.settings]", &contender.settings, "", &["dt_s"]).group(
                "[contender.limits]",
                &contender.settings,
                "limits",
                &[],
            )
        })
    }

    fn scenario(&self) -> Scenario {
        self.clone()
    }

    fn responds(&self, base: &Self, _: &Case) -> bool {
        // Flies under the law whose values differ, or under all laws in turn.
        let differs = |kind: &ControllerKind| self.contender(*kind) != base.contender(*kind);
        let changed = ControllerKind::ALL.into_iter().find(differs);
        let kinds = changed.map_or(ControllerKind::ALL.to_vec(), |kind| vec![kind]);
        kinds.into_iter().any(|kind| trace(self, kind) != trace(base, kind))
    }
}

fn sub(header: &str, group: &str) -> String {
    if group.is_empty() { format!("[{header}]") } else { format!("[{header}.{group}]") }
}

/// Returns a hash of every step of a flight under the first contender of this kind.
pub(crate) fn trace(scenario: &Scenario, kind: ControllerKind) -> Vec<u64> {
    let Some(contender) = scenario.contender(kind) else { return Vec::new() };
    let mut trace = Vec::new();
    let see = |sample: &Sample| {
        let mut hasher = DefaultHasher::new();
        let speeds = sample.action.speeds.0.iter().map(|speed| f64::from(*speed));
        let motion = sample.motion.position_m.iter().chain(&sample.motion.attitude_rad).copied();
        motion.chain(speeds).for_each(|number| number.to_bits().hash(&mut hasher));
        trace.push(hasher.finish());
    };
    fly(scenario, contender, see).unwrap();
    trace
}

/// Returns a flight with measured states, from the ground to a circle far above and away, with every kind of weather.
fn measured() -> Scenario {
    let controllers = ControllerKind::ALL.map(ControllerKind::name);
    let text = format!(
        "controllers = {controllers:?}\nprofile = \"flight\"\nduration_s = 2.0\nseed = 1\n\
         [trajectory]\nkind = \"circle\"\ncentre_m = [0.0, 0.0, 9.0]\nradius_m = 1.0\nacceleration_m_s2 = 1.0\n\
         [rotors]\ntime_constant_s = 0.02\ndelay_s = 0.002\nforce_max_n = 3.0\nmin_rad_s = 50.0\nstart = \"idle\"\n\
         [battery]\neffect = \"speed\"\n[drag]\n[ground]\n\
         [initial]\nposition_m = [9.0, 0.0, 0.08]\n[wind]\nsteady_m_s = [2.0, 1.0, 0.5]\nturbulence = \"light\"\n\
         [sensors]\ndelay_s = 0.004\nperiod_s = 0.004\nnoise = 0.001\nbias = 0.001\n\
         dropouts = {{ rate_hz = 2.0, mean_s = 0.05 }}\n"
    );
    let mut scenario = Scenario::read(&text).unwrap();
    scenario.contenders.iter_mut().for_each(|it| it.settings.common.drag.rotor_drag_1_s = 0.1);
    // The flight would not reach the profile's bound, so the bound is lower here.
    scenario.contenders.iter_mut().for_each(|it| it.settings.common.raised_thrust_max = 0.1);
    // One law has no reference model, which would keep it away from its limits.
    let law =
        scenario.contenders.iter_mut().find(|contender| contender.kind() == ControllerKind::Backstepping).unwrap();
    let reference = &mut law.settings.reference;
    (reference.reference_xy_rad_s, reference.reference_z_rad_s, reference.reference_yaw_rad_s) = (0.0, 0.0, 0.0);
    Scenario::read(&scenario.document().text()).unwrap()
}

/// Returns a flight on an estimate, with every instrument.
fn estimated() -> Scenario {
    let text = "controllers = [\"afbc\"]\nprofile = \"flight\"\nduration_s = 2.0\nseed = 1\n\
         [trajectory]\nkind = \"circle\"\ncentre_m = [0.0, 0.0, 1.0]\nradius_m = 1.0\nacceleration_m_s2 = 1.0\n\
         [rotors]\ntime_constant_s = 0.02\nforce_max_n = 3.0\n\
         [instruments]\ngnss = { part = \"m10\", loss = { rate_hz = 2.0, mean_s = 0.05 } }\n\
         barometer = \"dps310\"\nmagnetometer = \"ist8310\"\n\
         tracker = { part = \"mocap-100\", outliers = 0.05, loss = { rate_hz = 2.0, mean_s = 0.05 }, \
         freeze = { rate_hz = 2.0, mean_s = 0.05 } }\n\
         [instruments.imu]\npart = \"icm-42688-p\"\ngyro = { vibration_rad_s = 0.02 }\n\
         accel = { vibration_m_s2 = 1.0 }\n";
    Scenario::read(text).unwrap()
}

/// Keys to which no flight responds, with the reasons.
const IDLE: &[(&str, &[&str])] = &[
    (
        "beyond what the flight measures",
        &["instruments.imu.accel.range_m_s2", "instruments.imu.gyro.range_rad_s", "instruments.magnetometer.range_ut"],
    ),
    ("faster than the setpoints turn", &["contender.settings.reference_yaw_rate_rad_s"]),
    ("it takes off at once", &["contender.settings.freeze_on_ground"]),
];
/// Prefixes of the fields that this test covers. `FIXED` lists the fields among them that no key of a declared struct
/// changes.
const PARTS: [&str; 5] = ["vehicle.", "realism.", "sensing.", "instruments.", "contenders."];
const FIXED: &[(&str, &str)] = &[
    ("contenders.name", "not declared: crates/campaign/tests/fingerprint.rs"),
    ("contenders.monitored", "not declared, as above"),
    ("instruments.imu.mounting.attitude_rad", "a vehicle file's"),
    ("instruments.imu.mounting.position_m", "a vehicle file's"),
    ("realism.rotors.faults", "a list of its own, not declared"),
    ("realism.wind.gusts", "a list of its own, not declared"),
    ("realism.seed", "the scenario's takes its place"),
];

#[test]
fn every_declared_value_of_a_scenario_counts() {
    let (mut all, mut changed, mut responses) = (BTreeSet::new(), BTreeSet::new(), Responses::new());
    for base in [measured(), estimated()] {
        let now = change_each(&base, &mut responses);
        all.extend(fields(&base).into_keys());
        changed.extend(now);
    }
    let fixed: BTreeSet<&str> = FIXED.iter().map(|(field, _)| *field).collect();
    let unchanged: Vec<_> = all
        .difference(&changed)
        .filter(|field| PARTS.iter().any(|part| field.starts_with(part)) && !fixed.contains(field.as_str()))
        // A field missing in one of the two scenarios may be present in the other.
        .filter(|field| !all.iter().any(|other| other.starts_with(&format!("{field}."))))
        .collect();
    assert!(unchanged.is_empty(), "no key of a file changes {unchanged:#?}");
    compare(&responses, IDLE);
}
