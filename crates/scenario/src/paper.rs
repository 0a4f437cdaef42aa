//! The paper's experiment, Section IV, in each of its readings.

use crate::Scenario;
use crate::case::{Case, Reading, Uncertainty};
use crate::contender::{Contender, ControllerKind};
use crate::told::AssumedInstruments;
use crate::trajectory::Trajectory;
use afbc::Profile;
use afbc_plant::{
    Environment, Gust, GustKind, InstrumentSuite, Motion, PlantModel, PlantParameter, PlantParameterChange, Realism,
    Sensing,
};
use afbc_types::{Axis, OutOfRange, PLUS, Parameters};
use nalgebra::Vector3;

/// Duration of the experiment \[s\].
pub const DURATION_S: f64 = 60.0;

/// Interval in which the parameters deviate \[s\].
pub const UNCERTAIN_S: [f64; 2] = [20.0, 40.0];

/// Axis and onset of each gust \[s\].
pub const GUSTS_S: [(Axis, f64); 6] =
    [(Axis::X, 7.5), (Axis::Roll, 15.0), (Axis::Y, 22.5), (Axis::Pitch, 30.0), (Axis::Z, 37.5), (Axis::Yaw, 45.0)];

/// Size of each gust, in m/s2 and rad/s2 or in N and N m.
const GUST: f64 = 1.2;

/// Returns a variant of the experiment with this model of the vehicle.
///
/// # Errors
/// Never fails: the paper's parameters are in range.
pub fn scenario(model: PlantModel, case: Case) -> Result<Scenario, OutOfRange> {
    let gusts = case.reading.map_or(Vec::new(), |reading| {
        let (kind, length_s) = match reading {
            Reading::Persistent => (GustKind::Acceleration, f64::INFINITY),
            Reading::Pulses => (GustKind::Acceleration, 1.0),
            Reading::Forces => (GustKind::Force, f64::INFINITY),
        };
        GUSTS_S.map(|(axis, start_s)| Gust { axis, kind, size: GUST, start_s, end_s: start_s + length_s }).to_vec()
    });
    let changes = case.uncertainty.map_or(Vec::new(), |Uncertainty { inertia, thrust }| {
        let [start_s, end_s] = UNCERTAIN_S;
        let change = |quantity, factor| PlantParameterChange { quantity, factor, start_s, end_s };
        vec![
            change(PlantParameter::Inertia, inertia.factor(0.75)),
            change(PlantParameter::ThrustFactor, thrust.factor(0.4)),
        ]
    });
    Ok(Scenario {
        name: case.name().into(),
        description: "the paper's flight, Section IV".into(),
        case: Some(case),
        duration_s: DURATION_S,
        model,
        vehicle: Parameters::PAPER,
        rotors: PLUS.map(|rotor| rotor.to_f64()).to_vec(),
        vehicle_file: None,
        environment: Environment::new(Parameters::PAPER, changes, gusts)?,
        realism: Realism::default(),
        sensing: Sensing::default(),
        sensor_faults: Vec::new(),
        instruments: InstrumentSuite::default(),
        told: AssumedInstruments::Stated,
        instrument_faults: Vec::new(),
        outages: Vec::new(),
        flight_core: false,
        seed: 0,
        initial: Motion {
            position_m: Vector3::new(0.0, 0.0, 0.5),
            attitude_rad: Vector3::new(0.0, 0.0, 0.35),
            ..Motion::default()
        },
        trajectory: Trajectory::Paper,
        contenders: ControllerKind::PAPER.map(|kind| Contender::of(kind, Profile::Paper)).to_vec(),
    })
}
