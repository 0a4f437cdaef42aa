//! Control allocation: U1..U4 to rotor forces and rotor speeds, and back, for rotors anywhere in the body's x-y plane.
//!
//! U = B F, where B has one column \[y/l, -x/l, spin, 1\] per rotor. Forces are F = P U with the pseudo-inverse
//! P = B^T (B B^T)^-1: of all exact solutions the one of least norm. When it violates a rotor's limits, desaturation
//! gives priority to roll and pitch, then thrust, yaw last:
//!
//! 1. roll and pitch are scaled down together until their forces P \[U1, U2, 0, 0\] fit the limits at some thrust;
//! 2. thrust changes as little as necessary to make room for them;
//! 3. yaw is scaled down to the room that is left.
//!
//! For four rotors on a cross, no allocation gives more roll and pitch. With more rotors, other solutions than the
//! pseudo-inverse may give more; they are not searched. Yaw forces that would make room for roll and pitch are used
//! only where all four inputs fit. In a frame without symmetry, a little pitch may make room for roll, so a larger
//! demand does not always yield more.

use crate::settings::Settings;
use crate::{Action, math};
use afbc_types::{Airframe, Declared, Inputs, OutOfRange, ROTOR_POSITION, Range, Rotor, RotorForces, RotorSpeeds};
use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

/// Accepted determinant of B B^T over the product of its diagonal. It is 1 for a symmetric frame; near 0 the rotors
/// cannot give all four inputs independently.
pub const AUTHORITY: Range = Range::new("rotor_authority", 1e-3, 1.001);
/// Accepted share of one rotor in a pure thrust. With a smaller or negative share, the frame cannot hover.
pub const THRUST_SHARE: Range = Range::new("rotor_thrust_share", 1e-3, 1.0);

/// Least ratio of a rotor's largest force to its share of the weight. Less leaves too little for roll and pitch, for
/// battery sag and for a climb. Not in the paper.
pub const HOVER_MARGIN: f32 = 1.3;

/// Inputs are clamped to this size \[N\]: beyond what any rotors give, small enough for exact enough arithmetic.
const ASKED_MAX: f32 = 1e9;
/// Unallocated input that is explained by rounding, relative to the largest force.
const ROUNDING: f32 = 1e-6;

/// The mixer of a frame of `N` rotors, usually four to eight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer<const N: usize = 4> {
    /// B
    effectiveness: SMatrix<f32, 4, N>,
    /// P
    inverse: SMatrix<f32, N, 4>,
    /// Each rotor's share of a pure thrust, and its inverse.
    share: SVector<f32, N>,
    inverse_share: SVector<f32, N>,
    /// b
    thrust_factor: f32,
    /// 1/b
    inverse_thrust_factor: f32,
    force_max: f32,
}

/// Rotor forces within the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the forces are not applied"]
#[non_exhaustive]
pub struct Allocation<const N: usize = 4> {
    /// Forces that the rotors can give.
    pub forces: RotorForces<N>,
    /// U1..U4 of those forces, B F.
    pub given: Inputs,
    /// Part of the demand that is not given: U - B F, 0 where rounding explains the difference.
    pub unallocated: Inputs,
    /// True if a rotor force was limited.
    pub saturated: bool,
}

impl<const N: usize> Mixer<N> {
    /// Makes the mixer of a vehicle whose rotors give 0 to `force_max_n` each.
    ///
    /// # Errors
    /// If a parameter, a position or the limit is out of range, or if the rotors cannot give all four inputs and hover.
    pub fn new(vehicle: impl Into<Airframe<N>>, force_max_n: f32) -> Result<Self, OutOfRange> {
        let Airframe { parameters, rotors } = vehicle.into();
        parameters.validate()?;
        Settings::FORCE_MAX.range.check(force_max_n)?;
        for rotor in &rotors {
            ROTOR_POSITION.check(rotor.x)?;
            ROTOR_POSITION.check(rotor.y)?;
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
        let b = parameters.thrust_factor_n_s2;
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

    /// Checks that the rotors lift a vehicle of this weight with a margin of [`HOVER_MARGIN`].
    ///
    /// # Errors
    /// The largest force of one rotor is too small; the error states the least accepted one.
    pub fn check_hover(&self, weight_n: f32) -> Result<(), OutOfRange> {
        // Rounded up, for a readable number.
        let needed_n = libm::ceil(f64::from(HOVER_MARGIN * weight_n * self.share.max()) * 1e4) / 1e4;
        Range { min: needed_n, ..Settings::FORCE_MAX.range }.check(self.force_max)
    }

    /// What the rotors do for `inputs`, as far as their limits allow.
    #[inline]
    pub fn action(&self, inputs: &Inputs) -> Action<N> {
        self.carry_out(&self.allocate(inputs))
    }

    /// The action that gives the rotors what was allocated.
    #[inline]
    pub fn carry_out(&self, allocation: &Allocation<N>) -> Action<N> {
        let Allocation { forces, given, saturated, .. } = *allocation;
        Action::new(self.speeds(&forces), forces, given, saturated)
    }

    /// Thrust of all rotors at their limit \[N\].
    pub fn thrust_max_n(&self) -> f32 {
        N as f32 * self.force_max
    }

    /// Returns the largest U1 and the largest U2 that are possible in both directions at hover with this weight \[N\];
    /// 0 if the rotors do not lift it.
    pub fn tilt_authority_n(&self, weight_n: f32) -> [f32; 2] {
        [0, 1].map(|input| {
            let column = self.inverse.column(input);
            let largest = |most, (share, part): (&f32, &f32)| {
                let hover_n = share * weight_n;
                let room_n = math::max(math::min(hover_n, self.force_max - hover_n), 0.0);
                if *part == 0.0 { most } else { math::min(most, room_n / part.abs()) }
            };
            self.share.iter().zip(column.iter()).fold(f32::MAX, largest)
        })
    }

    /// Returns rotor forces that give `inputs`, as far as the rotors' limits allow. NaN counts as 0 and is reported as
    /// saturation.
    #[inline(always)]
    pub fn allocate(&self, inputs: &Inputs) -> Allocation<N> {
        let wanted = Vector4::new(inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n);
        let forces = self.inverse * wanted;
        // One NaN makes every force NaN, which is not within any limits.
        if forces.iter().all(|&force| 0.0 <= force && force <= self.force_max) {
            let forces = RotorForces(forces);
            return Allocation {
                forces,
                given: self.inputs(&forces),
                unallocated: Inputs::default(),
                saturated: false,
            };
        }
        // False of NaN, too.
        let wanted = if wanted.norm_squared() <= ASKED_MAX * ASKED_MAX {
            wanted
        } else {
            wanted.map(|u| if u.is_nan() { 0.0 } else { u.clamp(-ASKED_MAX, ASKED_MAX) })
        };
        let forces = RotorForces(self.within_limits(&wanted));
        let given = self.inputs(&forces);
        let least = ROUNDING * self.force_max;
        let missing = |wanted: f32, given: f32| if (wanted - given).abs() > least { wanted - given } else { 0.0 };
        let unallocated = Inputs {
            roll_n: missing(wanted.x, given.roll_n),
            pitch_n: missing(wanted.y, given.pitch_n),
            yaw_n: missing(wanted.z, given.yaw_n),
            thrust_n: missing(wanted.w, given.thrust_n),
        };
        Allocation { forces, given, unallocated, saturated: true }
    }

    /// Desaturates by priority.
    // Always, as its caller: the allocation stays in registers instead of being copied.
    #[inline(always)]
    fn within_limits(&self, wanted: &Vector4<f32>) -> SVector<f32, N> {
        let column = |i: usize, u: f32| self.inverse.column(i) * u;
        let tilt = column(0, wanted.x) + column(1, wanted.y);
        // The least thrust at which no rotor force is negative, and the largest force at that thrust.
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
            // Rounding may leave negative room; the `max` prevents 0/0 for zero yaw.
            let room = math::max(if *yaw > 0.0 { self.force_max - force } else { *force }, 0.0);
            if yaw.abs() > room {
                fits = math::min(fits, room / yaw.abs());
            }
        }
        // Not `max`: `max` of 0 and -0 may be either.
        (upright + yaw * fits).map(|force| if force > 0.0 { math::min(force, self.force_max) } else { 0.0 })
    }

    /// Returns omega_i = sqrt(F_i / b) of forces that are not negative.
    #[inline]
    pub fn speeds(&self, forces: &RotorForces<N>) -> RotorSpeeds<N> {
        RotorSpeeds(forces.0.map(|force| math::sqrt(force * self.inverse_thrust_factor)))
    }

    /// Returns F_i = b omega_i^2.
    #[inline]
    pub fn forces(&self, speeds: &RotorSpeeds<N>) -> RotorForces<N> {
        RotorForces(speeds.0.map(|speed| self.thrust_factor * speed * speed))
    }

    /// The residual omega of (6): speeds of the rotors that push to positive yaw less those of the others \[rad/s\].
    #[inline]
    pub fn residual_rad_s(&self, speeds: &RotorSpeeds<N>) -> f32 {
        let columns = self.effectiveness.column_iter();
        speeds.0.iter().zip(columns).fold(0.0, |sum, (speed, column)| sum + speed * column.z)
    }

    /// Returns U = B F.
    #[inline]
    pub fn inputs(&self, forces: &RotorForces<N>) -> Inputs {
        let total =
            |weighted: SVector<f32, N>| weighted.iter().copied().reduce(|sum, part| sum + part).unwrap_or_default();
        let by = |row: usize| total(self.effectiveness.row(row).transpose().component_mul(&forces.0));
        // The last row of B is ones.
        Inputs { roll_n: by(0), pitch_n: by(1), yaw_n: by(2), thrust_n: total(forces.0) }
    }
}
