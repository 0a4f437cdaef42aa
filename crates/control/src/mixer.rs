//! Control allocation: U1..U4 to rotor forces and rotor speeds, and back, for rotors anywhere in the body's x-y plane.
//!
//! U = B F, where B has one column \[y/l, -x/l, spin, 1\] per rotor. Forces are F = P U with the pseudo-inverse
//! P = B^T (B B^T)^-1: of all exact solutions the one of least norm. When it violates a rotor's limits, desaturation
//! gives priority to roll and pitch, then thrust, yaw last:
//!
//! 1. roll and pitch are scaled down together until their forces P \[U1, U2, 0, 0\] fit the limits at some thrust, and
//!    until the least thrust that they need does not exceed the demanded one or [`Mixer::with_raised_thrust_max_n`];
//! 2. thrust changes as little as necessary to make room for them;
//! 3. yaw is scaled down to the room that is left.
//!
//! A rotor's load is its force over its share of a pure thrust: L_i = Q_i \[U1, U2, U3\] + U4, within 0 and F_max over
//! the share. So thrust adds to every load alike. The steps above choose the inputs; forces follow from those.
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
/// Yaw by which a rotor's load changes less than this share of it leaves the rotor's limits alone.
const YAW_LOAD_MIN: f32 = 1e-6;

/// The mixer of a frame of `N` rotors, usually four to eight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixer<const N: usize = 4> {
    /// B
    effectiveness: SMatrix<f32, 4, N>,
    /// Columns of Q: load of each rotor by U1, by U2 and by U3.
    roll: SVector<f32, N>,
    pitch: SVector<f32, N>,
    yaw: SVector<f32, N>,
    /// Room for yaw to the left and to the right.
    room: [YawRoom<N>; 2],
    /// Each rotor's share of a pure thrust.
    share: SVector<f32, N>,
    /// Largest load of each rotor.
    most: SVector<f32, N>,
    /// The same, if all rotors have the same share.
    common_most: Option<f32>,
    /// True if every rotor has another whose loads by U1 and U2 are its own with the other sign.
    balanced: bool,
    /// b
    thrust_factor: f32,
    /// 1/b
    inverse_thrust_factor: f32,
    force_max: f32,
    /// Largest thrust that is raised for roll and pitch.
    raised_thrust_max: f32,
}

/// Returns the smallest of some loads.
#[inline(always)]
fn lowest<const N: usize>(loads: &SVector<f32, N>) -> f32 {
    loads.iter().copied().reduce(math::min).unwrap_or_default()
}

/// Returns the largest of some loads.
#[inline(always)]
fn highest<const N: usize>(loads: &SVector<f32, N>) -> f32 {
    loads.iter().copied().reduce(math::max).unwrap_or_default()
}

/// Largest |U3| in one direction that leaves each rotor within its limits: `unloaded` + `slope` times its load.
#[derive(Clone, Copy, Debug, PartialEq)]
struct YawRoom<const N: usize> {
    unloaded: SVector<f32, N>,
    slope: SVector<f32, N>,
}

impl<const N: usize> YawRoom<N> {
    /// Computes it for yaw that changes the loads, which are at most `most`, by `yaw` per newton.
    fn new(yaw: &SVector<f32, N>, most: &SVector<f32, N>) -> Self {
        // Up to its limit (most - load)/yaw of a rotor that yaw loads, down to zero load/|yaw| of one that it unloads:
        // both are lines in the load, found once so that a tick does not divide.
        YawRoom {
            unloaded: yaw.zip_map(most, |yaw, most| match yaw {
                _ if yaw.abs() < YAW_LOAD_MIN => f32::MAX,
                _ if yaw > 0.0 => most / yaw,
                _ => 0.0,
            }),
            slope: yaw.map(|yaw| if yaw.abs() < YAW_LOAD_MIN { 0.0 } else { -1.0 / yaw }),
        }
    }

    /// Returns the largest |U3| for all rotors with these loads.
    #[inline(always)]
    fn of(&self, loads: &SVector<f32, N>) -> f32 {
        // Rounding may leave a load beyond its limits.
        math::max(lowest(&(self.slope.component_mul(loads) + self.unloaded)), 0.0)
    }
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
    /// U1..U4 of those forces: B F, up to rounding.
    pub given: Inputs,
    /// Part of the demand that is not given: demanded less given inputs.
    pub unallocated: Inputs,
    /// True if the demand violates a rotor's limits.
    pub saturated: bool,
}

impl Settings {
    /// Makes the mixer of `vehicle` within these limits of rotors and thrust.
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
        // By Hadamard's inequality at most 1, but for rounding.
        AUTHORITY.check(gram.determinant() / gram.diagonal().product())?;
        // The default is never taken: a matrix without an inverse has just been refused.
        let inverse = effectiveness.transpose() * gram.try_inverse().unwrap_or_default();
        let share: SVector<f32, N> = inverse.column(3).into();
        for share in &share {
            THRUST_SHARE.check(*share)?;
        }
        // No share is zero: THRUST_SHARE has refused less than 0.001.
        let load = |input| inverse.column(input).component_div(&share);
        // The largest load whose force, rounded, does not exceed the limit.
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

    /// Returns the same mixer, but roll and pitch raise the thrust to `thrust_n` at most; they do not lower a larger
    /// demand.
    #[must_use]
    pub fn with_raised_thrust_max_n(self, thrust_n: f32) -> Self {
        Mixer { raised_thrust_max: thrust_n, ..self }
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
        [&self.roll, &self.pitch].map(|loads| {
            let largest = |possible, (load, most): (&f32, &f32)| {
                // The load of every rotor at hover is the weight: it may fall to zero or rise to its limit.
                let room = math::max(math::min(weight_n, most - weight_n), 0.0);
                if *load == 0.0 { possible } else { math::min(possible, room / load.abs()) }
            };
            loads.iter().zip(self.most.iter()).fold(f32::MAX, largest)
        })
    }

    /// Returns rotor forces that give `inputs`, as far as the rotors' limits allow. NaN counts as 0 and is reported as
    /// saturation.
    // Always, as what it calls: the allocation stays in registers instead of being copied.
    #[inline(always)]
    pub fn allocate(&self, inputs: &Inputs) -> Allocation<N> {
        let tilt = self.tilt(inputs);
        let loads = self.loads(&tilt, inputs);
        // One NaN makes every load NaN, which is not within any limits.
        if loads.iter().zip(self.most.iter()).all(|(load, most)| 0.0 <= *load && load <= most) {
            let forces = RotorForces(loads.component_mul(&self.share));
            return Allocation { forces, given: *inputs, unallocated: Inputs::default(), saturated: false };
        }
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = *inputs;
        // False of NaN, too.
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
        // What rounding leaves outside. Not `max`: `max` of 0 and -0 may be either.
        let loads = loads.zip_map(&self.most, |load, most| if load > 0.0 { math::min(load, most) } else { 0.0 });
        let unallocated = Inputs {
            roll_n: wanted.roll_n - given.roll_n,
            pitch_n: wanted.pitch_n - given.pitch_n,
            yaw_n: wanted.yaw_n - given.yaw_n,
            thrust_n: wanted.thrust_n - given.thrust_n,
        };
        Allocation { forces: RotorForces(loads.component_mul(&self.share)), given, unallocated, saturated: true }
    }

    /// Returns the loads by roll and pitch.
    #[inline(always)]
    fn tilt(&self, inputs: &Inputs) -> SVector<f32, N> {
        self.roll * inputs.roll_n + self.pitch * inputs.pitch_n
    }

    /// Returns the loads by all inputs, given those by roll and pitch.
    #[inline(always)]
    fn loads(&self, tilt: &SVector<f32, N>, inputs: &Inputs) -> SVector<f32, N> {
        (tilt + self.yaw * inputs.yaw_n).add_scalar(inputs.thrust_n)
    }

    /// Desaturates by priority: returns the inputs that are given instead of `wanted`, and their loads.
    #[inline(always)]
    fn within_limits(&self, wanted: &Inputs, mut tilt: SVector<f32, N>) -> (Inputs, SVector<f32, N>) {
        let Inputs { mut roll_n, mut pitch_n, mut yaw_n, mut thrust_n } = *wanted;
        // Thrusts at which the loads by roll and pitch are within limits; none if the first exceeds the second.
        let least = -lowest(&tilt);
        let most = match self.common_most {
            // Loads come in pairs of opposite signs: the highest is minus the lowest, and need not be looked for.
            Some(most) if self.balanced => most - least,
            Some(most) => most - highest(&tilt),
            None => lowest(&(self.most - tilt)),
        };
        let raised = math::max(thrust_n, self.raised_thrust_max);
        if least <= most && least <= raised {
            thrust_n = math::max(math::min(thrust_n, most), least);
        } else {
            // Of the largest load at the least thrust.
            let excess = match self.common_most {
                Some(own) => (least + own - most) / own,
                None => highest(&tilt.add_scalar(least).component_div(&self.most)),
            };
            // Roll and pitch give no thrust, so some load by them is negative where they do not fit: least is positive.
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
