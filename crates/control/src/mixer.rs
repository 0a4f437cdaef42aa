//! Control allocation: converts U1..U4 to rotor forces and speeds, and back, for rotors anywhere in the body's x-y
//! plane.
//!
//! U = B F, where B has one column \[y/l, -x/l, spin, 1\] per rotor. The forces are F = P U with the pseudo-inverse P =
//! B^T (B B^T)^-1, the exact solution of least norm. If it violates a rotor's limits, desaturation gives priority to
//! roll and pitch, then thrust, then yaw:
//!
//! 1. Roll and pitch are scaled down together until their forces P \[U1, U2, 0, 0\] fit the limits at some thrust. The
//!    least such thrust must not exceed the larger of the demanded one and [`Mixer::with_raised_thrust_max_n`].
//! 2. Thrust changes as little as necessary to make room for them.
//! 3. Yaw is scaled down to the room that is left.
//!
//! A rotor's load is its force divided by its share of a pure thrust: L_i = Q_i \[U1, U2, U3\] + U4. It is limited to 0
//! and F_max divided by the share. Thrust thus adds equally to every load. The steps above choose the inputs; the
//! forces follow from them.
//!
//! For four rotors on a cross, no allocation gives more roll and pitch. With more rotors, solutions other than the
//! pseudo-inverse may give more, but are not searched. Yaw forces that would make room for roll and pitch are used only
//! if all four inputs fit. In a frame without symmetry, a little pitch may make room for roll, so a larger demand does
//! not always yield more.

use crate::settings::Settings;
use crate::{Action, math};
use afbc_types::{Airframe, Declared, Inputs, OutOfRange, ROTOR_POSITION, Range, Rotor, RotorForces, RotorSpeeds};
use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

/// Accepted determinant of B B^T divided by the product of its diagonal. It is 1 for a symmetric frame. Near 0, the
/// rotors cannot give all four inputs independently.
pub const AUTHORITY: Range = Range::new("rotor_authority", 1e-3, 1.001);
/// Accepted share of one rotor in a pure thrust. With a smaller or negative share, the frame cannot hover.
pub const THRUST_SHARE: Range = Range::new("rotor_thrust_share", 1e-3, 1.0);

/// Smallest accepted ratio of a rotor's largest force to its share of the weight. A smaller ratio leaves too little for
/// roll and pitch, battery sag and climbing. Not in the paper.
pub const HOVER_MARGIN: f32 = 1.3;

/// Size to which inputs are clamped \[N\]: more than any rotors give, but small enough for accurate arithmetic.
const ASKED_MAX: f32 = 1e9;
/// Smallest change of a rotor's load per newton of yaw input for which the rotor limits the yaw.
const YAW_LOAD_MIN: f32 = 1e-6;

/// Mixer of a frame of `N` rotors, usually four to eight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer<const N: usize = 4> {
    /// Effectiveness matrix B.
    effectiveness: SMatrix<f32, 4, N>,
    /// Columns of Q: load of each rotor per U1, U2 and U3.
    roll: SVector<f32, N>,
    pitch: SVector<f32, N>,
    yaw: SVector<f32, N>,
    /// Room for yaw to the left and to the right.
    room: [YawRoom<N>; 2],
    /// Each rotor's share of a pure thrust.
    share: SVector<f32, N>,
    /// Largest load of each rotor.
    most: SVector<f32, N>,
    /// Largest load, if it is the same for all rotors.
    common_most: Option<f32>,
    /// True if every rotor has a counterpart with the opposite loads by U1 and U2.
    balanced: bool,
    /// Thrust factor b.
    thrust_factor: f32,
    /// Inverse thrust factor 1/b.
    inverse_thrust_factor: f32,
    force_max: f32,
    /// Largest thrust to which roll and pitch may raise the demand.
    raised_thrust_max: f32,
}

/// Returns the smallest of the loads.
#[inline(always)]
fn lowest<const N: usize>(loads: &SVector<f32, N>) -> f32 {
    loads.iter().copied().reduce(math::min).unwrap_or_default()
}

/// Returns the largest of the loads.
#[inline(always)]
fn highest<const N: usize>(loads: &SVector<f32, N>) -> f32 {
    loads.iter().copied().reduce(math::max).unwrap_or_default()
}

/// Largest |U3| in one direction within each rotor's limits, as a line in the rotor's load: `unloaded` + `slope` load.
#[derive(Clone, Copy, Debug, PartialEq)]
struct YawRoom<const N: usize> {
    unloaded: SVector<f32, N>,
    slope: SVector<f32, N>,
}

impl<const N: usize> YawRoom<N> {
    /// Computes the room for a yaw direction that changes the loads by `yaw` per newton. The loads are limited to
    /// `most`.
    fn new(yaw: &SVector<f32, N>, most: &SVector<f32, N>) -> Self {
        // Yaw raises a rotor's load up to its limit, (most - load)/yaw, or lowers it down to zero, load/|yaw|. Both are
        // lines in the load, computed once, so that a tick need not divide.
        YawRoom {
            unloaded: yaw.zip_map(most, |yaw, most| match yaw {
                _ if yaw.abs() < YAW_LOAD_MIN => f32::MAX,
                _ if yaw > 0.0 => most / yaw,
                _ => 0.0,
            }),
            slope: yaw.map(|yaw| if yaw.abs() < YAW_LOAD_MIN { 0.0 } else { -1.0 / yaw }),
        }
    }

    /// Returns the largest |U3| that fits all rotors at these loads.
    #[inline(always)]
    fn of(&self, loads: &SVector<f32, N>) -> f32 {
        // Rounding may put a load slightly beyond its limits.
        math::max(lowest(&(self.slope.component_mul(loads) + self.unloaded)), 0.0)
    }
}

/// Result of the allocation: rotor forces within the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the motors need the allocated forces"]
#[non_exhaustive]
pub struct Allocation<const N: usize = 4> {
    /// Forces within the rotors' limits.
    pub forces: RotorForces<N>,
    /// Inputs U1..U4 that these forces give: B F, up to rounding.
    pub given: Inputs,
    /// Demanded minus given inputs.
    pub unallocated: Inputs,
    /// True if the demand violates a rotor's limits.
    pub saturated: bool,
}

impl Settings {
    /// Makes the mixer of `vehicle` with these settings' limits of rotor force and raised thrust.
    ///
    /// # Errors
    /// If a parameter, a position or the limit is out of range, or if the rotors cannot give all four inputs and hover.
    pub fn mixer<const N: usize>(&self, vehicle: impl Into<Airframe<N>>) -> Result<Mixer<N>, OutOfRange> {
        let vehicle = vehicle.into();
        let raised_thrust_max_n = self.raised_thrust_max * vehicle.parameters.weight_n();
        Ok(Mixer::new(vehicle, self.rotor_force_max_n)?.with_raised_thrust_max_n(raised_thrust_max_n))
    }
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
        // By Hadamard's inequality, the ratio is at most 1, up to rounding.
        AUTHORITY.check(gram.determinant() / gram.diagonal().product())?;
        // The default is unreachable: matrices without an inverse have been refused above.
        let inverse = effectiveness.transpose() * gram.try_inverse().unwrap_or_default();
        let share: SVector<f32, N> = inverse.column(3).into();
        for share in &share {
            THRUST_SHARE.check(*share)?;
        }
        // No share is zero: THRUST_SHARE has refused shares below 0.001.
        let load = |input| inverse.column(input).component_div(&share);
        // `most` is the largest load whose rounded force does not exceed the limit.
        let most = share.map(|share| {
            let most = force_max_n / share;
            if share * most > force_max_n { most.next_down() } else { most }
        });
        let (b, [roll, pitch, yaw]) = (parameters.thrust_factor_n_s2, [0, 1, 2].map(load));
        let tilts = || roll.iter().zip(pitch.iter());
        Ok(Mixer {
            effectiveness,
            balanced: tilts().all(|(roll, pitch)| tilts().any(|other| other == (&-roll, &-pitch))),
            roll,
            pitch,
            yaw,
            room: [YawRoom::new(&yaw, &most), YawRoom::new(&-yaw, &most)],
            share,
            most,
            common_most: (most.min() == most.max()).then_some(most.max()),
            thrust_factor: b,
            inverse_thrust_factor: 1.0 / b,
            force_max: force_max_n,
            raised_thrust_max: f32::MAX,
        })
    }

    /// Returns the mixer with a limit on the thrust to which roll and pitch may raise the demand. A larger demand is
    /// not lowered.
    #[must_use]
    pub fn with_raised_thrust_max_n(self, thrust_n: f32) -> Self {
        Mixer { raised_thrust_max: thrust_n, ..self }
    }

    /// Checks that the rotors can lift this weight with a margin of [`HOVER_MARGIN`].
    ///
    /// # Errors
    /// If the largest force of one rotor is too small. The error states the smallest accepted force.
    pub fn check_hover(&self, weight_n: f32) -> Result<(), OutOfRange> {
        // The force is rounded up to a readable number.
        let needed_n = libm::ceil(f64::from(HOVER_MARGIN * weight_n * self.share.max()) * 1e4) / 1e4;
        Range { min: needed_n, ..Settings::FORCE_MAX.range }.check(self.force_max)
    }

    /// Returns the action for `inputs`, within the rotors' limits.
    #[inline]
    pub fn action(&self, inputs: &Inputs) -> Action<N> {
        self.carry_out(&self.allocate(inputs))
    }

    /// Returns the action of an allocation.
    #[inline]
    pub fn carry_out(&self, allocation: &Allocation<N>) -> Action<N> {
        let Allocation { forces, given, saturated, .. } = *allocation;
        Action::new(self.speeds(&forces), forces, given, saturated)
    }

    /// Returns the thrust of all rotors at their limit \[N\].
    pub fn thrust_max_n(&self) -> f32 {
        N as f32 * self.force_max
    }

    /// Returns the largest U1 and U2 that are possible in both directions when hovering with this weight \[N\]; 0 if
    /// the rotors cannot lift it.
    pub fn tilt_authority_n(&self, weight_n: f32) -> [f32; 2] {
        [&self.roll, &self.pitch].map(|loads| {
            let largest = |possible, (load, most): (&f32, &f32)| {
                // At hover, every rotor's load is the weight. It may fall to zero or rise to its limit.
                let room = math::max(math::min(weight_n, most - weight_n), 0.0);
                if *load == 0.0 { possible } else { math::min(possible, room / load.abs()) }
            };
            loads.iter().zip(self.most.iter()).fold(f32::MAX, largest)
        })
    }

    /// Returns rotor forces that give `inputs` within the rotors' limits. NaN counts as 0, and is reported as
    /// saturation.
    // This function is always inlined, like its callees: the allocation stays in registers instead of being copied.
    #[inline(always)]
    pub fn allocate(&self, inputs: &Inputs) -> Allocation<N> {
        let tilt = self.tilt(inputs);
        let loads = self.loads(&tilt, inputs);
        // One NaN makes every load NaN, and the comparisons false.
        if loads.iter().zip(self.most.iter()).all(|(load, most)| 0.0 <= *load && load <= most) {
            let forces = RotorForces(loads.component_mul(&self.share));
            return Allocation { forces, given: *inputs, unallocated: Inputs::default(), saturated: false };
        }
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = *inputs;
        // The comparison is false for NaN.
        let usual = Vector4::new(roll_n, pitch_n, yaw_n, thrust_n).norm_squared() <= ASKED_MAX * ASKED_MAX;
        let (wanted, tilt) = if usual {
            (*inputs, tilt)
        } else {
            let tame = |u: f32| if u.is_nan() { 0.0 } else { u.clamp(-ASKED_MAX, ASKED_MAX) };
            let [roll_n, pitch_n, yaw_n, thrust_n] = [roll_n, pitch_n, yaw_n, thrust_n].map(tame);
            let tamed = Inputs { roll_n, pitch_n, yaw_n, thrust_n };
            (tamed, self.tilt(&tamed))
        };
        let (given, loads) = self.within_limits(&wanted, tilt);
        // Clamp rounding errors. Not with `max`, since `max` of 0 and -0 may be either.
        let loads = loads.zip_map(&self.most, |load, most| if load > 0.0 { math::min(load, most) } else { 0.0 });
        let unallocated = Inputs {
            roll_n: wanted.roll_n - given.roll_n,
            pitch_n: wanted.pitch_n - given.pitch_n,
            yaw_n: wanted.yaw_n - given.yaw_n,
            thrust_n: wanted.thrust_n - given.thrust_n,
        };
        Allocation { forces: RotorForces(loads.component_mul(&self.share)), given, unallocated, saturated: true }
    }

    /// Returns the loads due to roll and pitch.
    #[inline(always)]
    fn tilt(&self, inputs: &Inputs) -> SVector<f32, N> {
        self.roll * inputs.roll_n + self.pitch * inputs.pitch_n
    }

    /// Returns the loads due to all inputs, given those due to roll and pitch.
    #[inline(always)]
    fn loads(&self, tilt: &SVector<f32, N>, inputs: &Inputs) -> SVector<f32, N> {
        (tilt + self.yaw * inputs.yaw_n).add_scalar(inputs.thrust_n)
    }

    /// Desaturates by priority. Returns the inputs given instead of `wanted`, and their loads.
    #[inline(always)]
    fn within_limits(&self, wanted: &Inputs, mut tilt: SVector<f32, N>) -> (Inputs, SVector<f32, N>) {
        let Inputs { mut roll_n, mut pitch_n, mut yaw_n, mut thrust_n } = *wanted;
        // Roll and pitch fit the limits at thrusts from `least` to `most`. No thrust fits if `least` exceeds `most`.
        let least = -lowest(&tilt);
        let most = match self.common_most {
            // Loads come in pairs of opposite signs, so the highest is minus the lowest.
            Some(most) if self.balanced => most - least,
            Some(most) => most - highest(&tilt),
            None => lowest(&(self.most - tilt)),
        };
        let raised = math::max(thrust_n, self.raised_thrust_max);
        if least <= most && least <= raised {
            thrust_n = math::max(math::min(thrust_n, most), least);
        } else {
            // `excess` is the largest load at the least thrust, relative to its limit.
            let excess = match self.common_most {
                Some(own) => (least + own - most) / own,
                None => highest(&tilt.add_scalar(least).component_div(&self.most)),
            };
            // Roll and pitch give no net thrust. If they do not fit, some load due to them is negative, so `least` is
            // positive.
            let scale = math::min(1.0 / math::max(excess, 1.0), raised / least);
            (roll_n, pitch_n, tilt, thrust_n) = (roll_n * scale, pitch_n * scale, tilt * scale, least * scale);
        }

        let upright = tilt.add_scalar(thrust_n);
        let [left, right] = &self.room;
        let fits = if yaw_n > 0.0 { left } else { right }.of(&upright);
        if yaw_n.abs() > fits {
            yaw_n = fits.copysign(yaw_n);
        }
        (Inputs { roll_n, pitch_n, yaw_n, thrust_n }, upright + self.yaw * yaw_n)
    }

    /// Returns omega_i = sqrt(F_i / b), for forces that are not negative.
    #[inline]
    pub fn speeds(&self, forces: &RotorForces<N>) -> RotorSpeeds<N> {
        RotorSpeeds(forces.0.map(|force| math::sqrt(force * self.inverse_thrust_factor)))
    }

    /// Returns F_i = b omega_i^2.
    #[inline]
    pub fn forces(&self, speeds: &RotorSpeeds<N>) -> RotorForces<N> {
        RotorForces(speeds.0.map(|speed| self.thrust_factor * speed * speed))
    }

    /// Returns the residual omega of (6): sum of the speeds of rotors that push to positive yaw, minus those of the
    /// others \[rad/s\].
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
        // The last row of B is all ones.
        Inputs { roll_n: by(0), pitch_n: by(1), yaw_n: by(2), thrust_n: total(forces.0) }
    }
}
