//! Nominal vehicle and rotors: converts thrust and angular acceleration to an action.

use crate::attitude::roll_pitch;
use afbc_control::command_filter::Filtered;
use afbc_control::mixer::{Allocation, Mixer};
use afbc_control::{Action, Errors, Settings, Smoothed, Smoother, Smoothing, Trace, math};
use afbc_types::{Airframe, Declared, Inputs, OutOfRange, PerAxis, RotorSpeeds};
use nalgebra::{Matrix3, Vector3};

/// Nominal vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NominalVehicle<const N: usize> {
    pub(crate) mixer: Mixer<N>,
    smoother: Smoother,
    pub(crate) mass_kg: f32,
    pub(crate) inertia_kg_m2: Vector3<f32>,
    /// l/Ix, l/Iy, (d/b)/Iz: angular acceleration per newton of U1..U3 \[rad/s2 per N\].
    effectiveness: Vector3<f32>,
}

/// Demand of a controller, with its internal signals for the trace.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Demand {
    /// U4 \[N\].
    pub(crate) thrust_n: f32,
    /// Part of d Omega/dt by U1..U3 \[rad/s2\].
    pub(crate) angular_acceleration_rad_s2: Vector3<f32>,
    /// Demanded acceleration, earth frame \[m/s2\].
    pub(crate) acceleration_m_s2: Vector3<f32>,
    /// Desired attitude.
    pub(crate) desired: Matrix3<f32>,
    /// Angular velocity of the desired attitude, in the desired frame \[rad/s\].
    pub(crate) desired_rates_rad_s: Vector3<f32>,
    /// Setpoint minus state: position, velocity, attitude, rates.
    pub(crate) errors: [Vector3<f32>; 4],
}

impl<const N: usize> NominalVehicle<N> {
    /// Creates the vehicle with these parameters and filters on its inputs.
    pub(crate) fn new(vehicle: &Airframe<N>, settings: &Settings, smoothing: &Smoothing) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let mixer = settings.mixer(*vehicle)?;
        let smoother = Smoother::new(smoothing, settings.dt_s)?;
        let vehicle = &vehicle.parameters;
        let (inertia_kg_m2, effectiveness) = (vehicle.inertia_kg_m2, vehicle.effectiveness());
        Ok(NominalVehicle { mixer, smoother, mass_kg: vehicle.mass_kg, inertia_kg_m2, effectiveness })
    }

    /// Returns d Omega/dt that the rotors cause with `inputs` \[rad/s2\].
    #[inline]
    pub(crate) fn angular_acceleration(&self, inputs: &Inputs) -> Vector3<f32> {
        Vector3::new(inputs.roll_n, inputs.pitch_n, inputs.yaw_n).component_mul(&self.effectiveness)
    }

    /// Returns -(I^-1)(Omega x I Omega): the gyroscopic part of d Omega/dt \[rad/s2\].
    #[inline]
    pub(crate) fn coupling(&self, rates: &Vector3<f32>) -> Vector3<f32> {
        -rates.cross(&self.inertia_kg_m2.component_mul(rates)).component_div(&self.inertia_kg_m2)
    }

    /// Returns the rotor speeds in hover \[rad/s\].
    pub(crate) fn hover(&self, weight_n: f32) -> RotorSpeeds<N> {
        let inputs = Inputs { thrust_n: weight_n, ..Inputs::default() };
        self.mixer.speeds(&self.mixer.allocate(&inputs).forces)
    }

    /// Returns the action for `demand` after the filters, its trace, and the unallocated part of U1..U3 \[N\].
    // This function is always inlined: a result returned in memory would be read back while its stores are still
    // pending.
    #[inline(always)]
    pub(crate) fn act(&self, demand: &Demand, smoothed: &mut Option<Smoothed>) -> (Action<N>, Trace, Vector3<f32>) {
        let wanted = demand.angular_acceleration_rad_s2.component_div(&self.effectiveness);
        let inputs = Inputs { roll_n: wanted.x, pitch_n: wanted.y, yaw_n: wanted.z, thrust_n: demand.thrust_n };
        let inputs = self.smoother.advance(smoothed, &inputs);
        let allocation = self.mixer.allocate(&inputs);
        let Allocation { unallocated, .. } = allocation;

        let desired_rad = roll_pitch(&demand.desired);
        let [roll, pitch] = desired_rad;
        let [p, q] = [demand.desired_rates_rad_s.x, demand.desired_rates_rad_s.y];
        let [position, velocity, attitude, rates] = demand.errors;
        // Errors that decay become zero, so that later products are no subnormal numbers.
        let errors = |e1, e1_dot| Errors { e1: math::settled(e1), e1_dot: math::settled(e1_dot), e2: 0.0 };
        let action = self.mixer.carry_out(&allocation);
        let mut trace = Trace::default();
        trace.inputs = inputs;
        trace.virtual_m_s2 = [demand.acceleration_m_s2.x, demand.acceleration_m_s2.y];
        trace.desired_rad = desired_rad;
        trace.filtered = [Filtered { angle: roll, rate: p }, Filtered { angle: pitch, rate: q }];
        trace.errors = PerAxis {
            roll: errors(attitude.x, rates.x),
            pitch: errors(attitude.y, rates.y),
            yaw: errors(attitude.z, rates.z),
            z: errors(position.z, velocity.z),
            x: errors(position.x, velocity.x),
            y: errors(position.y, velocity.y),
        };
        (action, trace, Vector3::new(unallocated.roll_n, unallocated.pitch_n, unallocated.yaw_n))
    }
}
