//! Allocation of U1..U4 to rotor forces and rotor speeds, and back, for rotors anywhere in the body's x-y plane.
//!
//! U = B F with one column of B a rotor: \[y/l, -x/l, spin, 1\]. Forces are F = P U with the pseudo-inverse
//! P = B^T (B B^T)^-1: exact, and of all exact ones the smallest. When that breaks a rotor's limits, roll and pitch are
//! served first, then thrust, yaw last:
//!
//! 1. roll and pitch are scaled down together until some thrust makes their forces P \[U1, U2, 0, 0\] fit the limits;
//! 2. thrust moves by as little as makes room for them;
//! 3. yaw gets the share that still fits.
//!
//! For four rotors on a cross, no other forces give more roll and pitch. More rotors leave a choice that is not searched:
//! other forces may give more. Yaw that happens to make room is counted on only where all four inputs fit, and in a frame
//! without symmetry a little pitch may make room for roll, so that more of one asked is not always more given.

use crate::settings::Settings;
use crate::{Action, math};
use afbc_types::{Declared, Inputs, OutOfRange, Parameters, Range, RotorForces, RotorSpeeds};
use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

/// Accepted position of a rotor along x and along y, in arm's lengths.
pub const POSITION: Range = Range::new("rotor_position", -10.0, 10.0);
/// Accepted determinant of B B^T over the product of its diagonal, 1 for a symmetric frame: near 0 the rotors cannot give
/// all four inputs apart from each other.
pub const AUTHORITY: Range = Range::new("rotor_authority", 1e-3, 1.001);
/// Accepted share of one rotor in a thrust without moments: a frame that hovers on less does not hover.
pub const THRUST_SHARE: Range = Range::new("rotor_thrust_share", 1e-3, 1.0);

/// Least largest force of a rotor over its part of the weight. Less leaves too little for roll and pitch, for a battery
/// that sags, for a climb. Ours.
pub const HOVER_MARGIN: f32 = 1.3;

/// Larger inputs than this are taken for it \[N\]: beyond what any rotors give, and within what can be reckoned with.
const ASKED_MAX: f32 = 1e9;
/// What is missing of an input by rounding alone, as a share of the largest force.
const ROUNDING: f32 = 1e-6;

/// Where a rotor is, and which way it turns the body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotor {
    /// Along body x, in arm's lengths.
    pub x: f32,
    /// Along body y, in arm's lengths.
    pub y: f32,
    /// True if its drag pushes the body to positive yaw.
    pub pushes_left: bool,
}

/// The frame described in [`afbc_types`]: rotor 1 at -y, 2 at +x, 3 at +y, 4 at -x.
pub const PLUS: [Rotor; 4] = [
    Rotor { x: 0.0, y: -1.0, pushes_left: true },
    Rotor { x: 1.0, y: 0.0, pushes_left: false },
    Rotor { x: 0.0, y: 1.0, pushes_left: true },
    Rotor { x: -1.0, y: 0.0, pushes_left: false },
];

/// The mixer of a frame of `N` rotors, four to eight of them in practice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer<const N: usize = 4> {
    /// B
    effectiveness: SMatrix<f32, 4, N>,
    /// P
    inverse: SMatrix<f32, N, 4>,
    /// Of a thrust of 1 N, each rotor's part; and 1 over it.
    share: SVector<f32, N>,
    inverse_share: SVector<f32, N>,
    /// b
    thrust_factor: f32,
    /// 1/b
    inverse_thrust_factor: f32,
    force_max: f32,
}

/// Forces within the rotors' limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the forces are not applied"]
#[non_exhaustive]
pub struct Allocation<const N: usize = 4> {
    /// What the rotors can give of what was asked.
    pub forces: RotorForces<N>,
    /// What was asked and is not given: U - B F, or 0 where rounding explains it.
    pub unallocated: Inputs,
    /// True if a rotor was asked for less than nothing or more than its limit.
    pub saturated: bool,
}

impl Mixer {
    /// The mixer of the [`PLUS`] frame, for a vehicle whose rotors give 0 to `force_max_n`.
    ///
    /// # Errors
    /// If a parameter or the limit is out of range.
    pub fn new(vehicle: &Parameters, force_max_n: f32) -> Result<Self, OutOfRange> {
        Self::of(PLUS, vehicle, force_max_n)
    }

    /// What the rotors do for `inputs`, as far as their limits allow.
    #[inline]
    pub fn action(&self, inputs: &Inputs) -> Action {
        let Allocation { forces, saturated, .. } = self.allocate(inputs);
        Action::new(self.speeds(&forces), forces, saturated)
    }

    /// U1..U4 of the [`PLUS`] frame's rotor forces, (6).
    #[inline]
    pub fn inputs(forces: &RotorForces) -> Inputs {
        let [f1, f2, f3, f4] = forces.0.into();
        Inputs { roll_n: f3 - f1, pitch_n: f4 - f2, yaw_n: f1 - f2 + f3 - f4, thrust_n: f1 + f2 + f3 + f4 }
    }
}

impl<const N: usize> Mixer<N> {
    /// The mixer of any frame.
    ///
    /// # Errors
    /// If a parameter, a position or the limit is out of range, or the rotors cannot give all four inputs and hover.
    pub fn of(rotors: [Rotor; N], vehicle: &Parameters, force_max_n: f32) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        Settings::FORCE_MAX.range.check(force_max_n)?;
        for rotor in &rotors {
            POSITION.check(rotor.x)?;
            POSITION.check(rotor.y)?;
        }
        let spin = |rotor: &Rotor| if rotor.pushes_left { 1.0 } else { -1.0 };
        let columns = rotors.map(|rotor| Vector4::new(rotor.y, -rotor.x, spin(&rotor), 1.0));
        let effectiveness = SMatrix::<f32, 4, N>::from_columns(&columns);
        let gram: Matrix4<f32> = effectiveness * effectiveness.transpose();
        AUTHORITY.check(gram.determinant() / gram.diagonal().product())?;
        let inverse = effectiveness.transpose() * gram.try_inverse().unwrap_or_default();
        let share: SVector<f32, N> = inverse.column(3).into();
        for share in &share {
            THRUST_SHARE.check(*share)?;
        }
        let inverse_share = share.map(|share| 1.0 / share);
        let b = vehicle.thrust_factor_n_s2;
        Ok(Mixer {
            effectiveness,
            inverse,
            share,
            inverse_share,
            thrust_factor: b,
            inverse_thrust_factor: 1.0 / b,
            force_max: force_max_n,
        })
    }

    /// Whether the rotors lift a vehicle of this weight with a margin of [`HOVER_MARGIN`].
    ///
    /// # Errors
    /// The largest force of one rotor, and what it would have to be at least.
    pub fn check_hover(&self, weight_n: f32) -> Result<(), OutOfRange> {
        // Rounded up to what people read.
        let needed_n = libm::ceil(f64::from(HOVER_MARGIN * weight_n * self.share.max()) * 1e4) / 1e4;
        Range { min: needed_n, ..Settings::FORCE_MAX.range }.check(self.force_max)
    }

    /// Rotor forces that give `inputs`, as far as the rotors' limits allow. A NaN is taken for 0, and reported as
    /// saturation.
    #[inline]
    pub fn allocate(&self, inputs: &Inputs) -> Allocation<N> {
        let wanted = Vector4::new(inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n);
        let forces = self.inverse * wanted;
        // One NaN makes every force a NaN, which is within no limits.
        if forces.iter().all(|&force| 0.0 <= force && force <= self.force_max) {
            return Allocation { forces: RotorForces(forces), unallocated: Inputs::default(), saturated: false };
        }
        // The usual case by one comparison, which a NaN fails, too.
        let wanted = if wanted.norm_squared() <= ASKED_MAX * ASKED_MAX {
            wanted
        } else {
            wanted.map(|u| if u.is_nan() { 0.0 } else { u.clamp(-ASKED_MAX, ASKED_MAX) })
        };
        let forces = self.within_limits(&wanted);
        let least = ROUNDING * self.force_max;
        let missing = (wanted - self.effectiveness * forces).map(|u| if u.abs() > least { u } else { 0.0 });
        let unallocated = Inputs { roll_n: missing.x, pitch_n: missing.y, yaw_n: missing.z, thrust_n: missing.w };
        Allocation { forces: RotorForces(forces), unallocated, saturated: true }
    }

    /// The forces nearest to what is wanted, by priority.
    fn within_limits(&self, wanted: &Vector4<f32>) -> SVector<f32, N> {
        let column = |i: usize, u: f32| self.inverse.column(i) * u;
        let tilt = column(0, wanted.x) + column(1, wanted.y);
        // The least thrust at which no rotor has to pull down, and the largest force then.
        let (mut least, mut largest) = (f32::MIN, f32::MIN);
        for (force, inverse_share) in tilt.iter().zip(self.inverse_share.iter()) {
            least = math::max(least, -force * inverse_share);
        }
        for (force, share) in tilt.iter().zip(self.share.iter()) {
            largest = math::max(largest, force + share * least);
        }
        let scale = if largest > self.force_max { self.force_max / largest } else { 1.0 };
        let (tilt, least) = (tilt * scale, least * scale);

        let mut most = f32::MAX;
        for (force, inverse_share) in tilt.iter().zip(self.inverse_share.iter()) {
            most = math::min(most, (self.force_max - force) * inverse_share);
        }
        let upright = tilt + self.share * math::max(math::min(wanted.w, most), least);

        let yaw = column(2, wanted.z);
        let mut fits = 1.0_f32;
        for (force, yaw) in upright.iter().zip(yaw.iter()) {
            // By rounding, less than none may be left: of no yaw, that takes no share.
            let room = math::max(if *yaw > 0.0 { self.force_max - force } else { *force }, 0.0);
            if yaw.abs() > room {
                fits = math::min(fits, room / yaw.abs());
            }
        }
        // Not `max`: that of 0 and -0 is either.
        (upright + yaw * fits).map(|force| if force > 0.0 { math::min(force, self.force_max) } else { 0.0 })
    }

    /// omega_i = sqrt(F_i / b), for forces that are not negative.
    #[inline]
    pub fn speeds(&self, forces: &RotorForces<N>) -> RotorSpeeds<N> {
        RotorSpeeds(forces.0.map(|force| math::sqrt(force * self.inverse_thrust_factor)))
    }

    /// F_i = b omega_i^2.
    #[inline]
    pub fn forces(&self, speeds: &RotorSpeeds<N>) -> RotorForces<N> {
        RotorForces(speeds.0.map(|speed| self.thrust_factor * speed * speed))
    }

    /// U = B F.
    #[inline]
    pub fn inputs_of(&self, forces: &RotorForces<N>) -> Inputs {
        let u = self.effectiveness * forces.0;
        Inputs { roll_n: u.x, pitch_n: u.y, yaw_n: u.z, thrust_n: u.w }
    }
}
