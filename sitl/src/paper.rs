//! The paper's experiment, Section IV, in each of its readings.

use crate::scenario::{Contender, ControllerKind, Scenario};
use crate::trajectory::Trajectory;
use afbc::Profile;
use afbc_plant::{Environment, Gust, GustKind, Model, Motion, ParameterChange, Quantity, Realism, Sensing};
use afbc_types::{Axis, OutOfRange, Parameters};
use nalgebra::Vector3;

/// How the paper's "1.2 N" and "1.2 N m" are read (decision 3 in `docs/paper.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Accelerations of 1.2 m/s2 and 1.2 rad/s2 that stay on from their onset: the paper's claims hold.
    Persistent,
    /// The same accelerations for one second each.
    Pulses,
    /// Physical forces and moments that stay on: 1.2 N m is 316 rad/s2 here, and loses the vehicle.
    Forces,
}

impl Reading {
    /// Every reading.
    pub const ALL: [Reading; 3] = [Reading::Persistent, Reading::Pulses, Reading::Forces];

    /// Lower-case name, as on the command line and in logs.
    pub const fn name(self) -> &'static str {
        match self {
            Reading::Persistent => "persistent",
            Reading::Pulses => "pulses",
            Reading::Forces => "forces",
        }
    }
}

/// The direction of an uncertainty whose size alone is printed (decision 4 there).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// More than nominal.
    Plus,
    /// Less than nominal.
    Minus,
}

impl Sign {
    /// 1 + or - `size`.
    const fn factor(self, size: f64) -> f64 {
        match self {
            Sign::Plus => 1.0 + size,
            Sign::Minus => 1.0 - size,
        }
    }

    /// "+" or "-".
    pub const fn symbol(self) -> &'static str {
        match self {
            Sign::Plus => "+",
            Sign::Minus => "-",
        }
    }
}

/// Signs of the parameter uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uncertainty {
    /// Inertia +-75 %.
    pub inertia: Sign,
    /// Thrust factor +-40 %.
    pub thrust: Sign,
}

impl Uncertainty {
    /// Inertia up, thrust down: the hardest, and the default.
    pub const DEFAULT: Self = Uncertainty { inertia: Sign::Plus, thrust: Sign::Minus };

    /// All four combinations, the default first.
    pub const ALL: [Self; 4] = [
        Self::DEFAULT,
        Uncertainty { inertia: Sign::Plus, thrust: Sign::Plus },
        Uncertainty { inertia: Sign::Minus, thrust: Sign::Minus },
        Uncertainty { inertia: Sign::Minus, thrust: Sign::Plus },
    ];
}

/// Length of the experiment \[s\].
pub const DURATION_S: f64 = 60.0;

/// When parameters are off \[s\].
pub const UNCERTAIN_S: [f64; 2] = [20.0, 40.0];

/// Onset of each gust \[s\].
pub const GUSTS_S: [(Axis, f64); 6] =
    [(Axis::X, 7.5), (Axis::Roll, 15.0), (Axis::Y, 22.5), (Axis::Pitch, 30.0), (Axis::Z, 37.5), (Axis::Yaw, 45.0)];

/// Size of each gust: m/s2 and rad/s2, or N and N m.
const GUST: f64 = 1.2;

/// One reading of the experiment; `None` leaves gusts or uncertainty out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// How the gusts are read.
    pub reading: Option<Reading>,
    /// Which way the parameters are off.
    pub uncertainty: Option<Uncertainty>,
}

impl Case {
    /// The default reading of Section IV.
    pub const DEFAULT: Self = Case { reading: Some(Reading::Persistent), uncertainty: Some(Uncertainty::DEFAULT) };

    /// Short name: `calm`, `uncertain`, `gusts`, `pulses`, `forces`, or `paper` when both gusts and uncertainty are on.
    pub const fn name(self) -> &'static str {
        match (self.reading, self.uncertainty) {
            (None, None) => "calm",
            (None, Some(_)) => "uncertain",
            (Some(Reading::Persistent), None) => "gusts",
            (Some(Reading::Pulses), None) => "pulses",
            (Some(Reading::Forces), None) => "forces",
            (Some(_), Some(_)) => "paper",
        }
    }
}

/// The experiment in one reading, on one model of the vehicle.
///
/// # Errors
/// None in fact: the paper's parameters are in range.
pub fn scenario(model: Model, case: Case) -> Result<Scenario, OutOfRange> {
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
        let change = |quantity, factor| ParameterChange { quantity, factor, start_s, end_s };
        vec![change(Quantity::Inertia, inertia.factor(0.75)), change(Quantity::ThrustFactor, thrust.factor(0.4))]
    });
    Ok(Scenario {
        name: case.name().into(),
        description: "the paper's flight, Section IV".into(),
        case: Some(case),
        duration_s: DURATION_S,
        model,
        vehicle: Parameters::PAPER,
        environment: Environment::new(Parameters::PAPER, changes, gusts)?,
        realism: Realism::default(),
        sensing: Sensing::default(),
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
