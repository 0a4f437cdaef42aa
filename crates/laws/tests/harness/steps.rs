//! Controllers for single steps, and random scenes.

use super::{Random, SETTINGS, vehicle};
use afbc_control::{Action, FlightController, Trace, Validated};
use afbc_laws::{Dfbc, Geometric, Indi, L1, Mpc, Pid, dfbc, geometric, indi, l1, mpc, pid};
use afbc_types::{Setpoint, State};
use nalgebra::{Rotation3, Vector3};

pub(crate) fn pid() -> Pid {
    Pid::new(vehicle(), SETTINGS, pid::Gains::PAPER_VEHICLE).unwrap()
}

pub(crate) fn lee() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::LEE_2010).unwrap()
}

pub(crate) fn goodarzi() -> Geometric {
    Geometric::new(vehicle(), SETTINGS, geometric::Gains::GOODARZI_2013).unwrap()
}

pub(crate) fn indi() -> Indi {
    Indi::new(vehicle(), SETTINGS, indi::Gains::PAPER_VEHICLE).unwrap()
}

/// Returns L1 on the geometric controller of [`lee`].
pub(crate) fn l1() -> L1 {
    let gains = l1::Gains { geometric: geometric::Gains::LEE_2010, ..l1::Gains::BY_HAND };
    L1::new(vehicle(), SETTINGS, gains).unwrap()
}

pub(crate) fn dfbc() -> Dfbc {
    Dfbc::new(vehicle(), SETTINGS, dfbc::Gains::PAPER_VEHICLE).unwrap()
}

pub(crate) fn mpc() -> Mpc {
    Mpc::new(vehicle(), SETTINGS, mpc::Gains::PAPER_VEHICLE).unwrap()
}

/// Returns action and trace after `steps` steps with constant input.
pub(crate) fn after<C: FlightController>(
    controller: &C,
    steps: usize,
    state: &State,
    setpoint: &Setpoint,
) -> (Action, Trace) {
    let mut memory = Validated::<C::Memory>::default();
    let mut action = Action::default();
    for _ in 0..steps {
        action = controller.step(&mut memory, Some(state), setpoint);
    }
    (action, C::trace(&memory.control))
}

/// Returns the Euler angles of a rotation; nalgebra uses the same z-y-x sequence.
pub(crate) fn euler(r: &Rotation3<f64>) -> Vector3<f32> {
    let (roll, pitch, yaw) = r.euler_angles();
    Vector3::new(roll as f32, pitch as f32, yaw as f32)
}

pub(crate) fn vector(random: &mut Random, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * random.uniform() - 1.0))
}

pub(crate) const WEIGHT_N: f32 = 0.486 * 9.81;
