//! Types shared by all crates: state, setpoint, control inputs, rotor speeds, physical parameters with their accepted
//! ranges, attitudes as quaternions, and a macro that declares parameters ([`parameters!`]).
//!
//! # Conventions
//!
//! The conventions of all crates:
//!
//! * **Units** are SI: metres, seconds, kilograms, newtons, radians. Field names carry them.
//! * **Earth frame**: inertial, right-handed, z up. Gravity points to -z.
//! * **Body frame**: right-handed, x forward, y left, z up (FLU), origin at the centre of mass.
//! * **Attitude**: Euler angles eta = \[phi, theta, psi\] = \[roll, pitch, yaw\] of the z-y-x sequence;
//!   `r_earth_body = Rz(psi) Ry(theta) Rx(phi)` turns body coordinates into earth coordinates. Each angle is
//!   right-handed about its axis: positive pitch tilts the thrust to +x, positive roll tilts it to -y.
//! * **Rates**: Omega = \[p, q, r\], the angular velocity of the body in body coordinates.
//! * **Rotors**: four to eight, anywhere in the body's x-y plane ([`Rotor`]). The paper's frame is [`PLUS`]: 1 at -y, 2
//!   at +x, 3 at +y, 4 at -x, each at the arm's length; rotors 1 and 3 push the body to positive yaw (they spin
//!   negatively about body z), rotors 2 and 4 to negative yaw.
//! * **Subsystems** i = 1..6 of the paper's (7): roll, pitch, yaw, z, x, y. See [`PerAxis`].
//!
//! "(n)" with a number always refers to an equation of Yacef, Bouhali, Hamerlain, *Adaptive Fuzzy Backstepping Control
//! for Trajectory Tracking of Unmanned Aerial Quadrotor*, as corrected in `docs/paper.md`.
//!
//! # Features
//!
//! Both features are off by default and work without std. `serde` reads and writes states, setpoints, inputs, rotor
//! forces, rotor speeds and physical parameters; `defmt` logs them on a board.
#![no_std]

mod actuation;
mod attitude;
mod axes;
mod declared;
mod frame;
mod motion;
mod mounting;
mod parameters;
mod pose;
mod range;
mod sensor_calibration;
mod stamped;
mod trigonometry;

pub use actuation::{Inputs, RotorForces, RotorSpeeds};
pub use attitude::euler_angles;
pub use axes::{Axis, PerAxis};
pub use declared::{
    Choice, Declaration, Declared, DeclaredValue, DeclaredValueMut, Name, ParameterNumber, ParameterType, Visitor,
    VisitorMut,
};
#[doc(hidden)]
pub use declared::{numbers, show_in_group};
pub use frame::{Airframe, PLUS, ROTOR_POSITION, ROTORS, ROTORS_MAX, Rotor, Rotors};
pub use motion::{ResetDelta, Setpoint, State};
pub use mounting::Mounting;
pub use nalgebra;
pub use parameters::Parameters;
pub use pose::{Pose, PoseSigmas};
pub use range::{OutOfRange, Range};
pub use sensor_calibration::SensorCalibration;
pub use stamped::Stamped;
pub use trigonometry::sin_cos;
