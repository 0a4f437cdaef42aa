//! Detector of a vehicle that stands on the ground, where its errors must not be learnt. Not in the paper; similar to
//! land detectors of autopilots: in the air, a vehicle whose law demands too little thrust soon moves too fast to be
//! standing. (The thrust produced is no indication, since roll and pitch have priority over thrust and may increase
//! it.)
//!
//! The flight core's land detector is separate: it knows the commands to the rotors but not the law's demands, and
//! disarms, so it takes a second to be sure. This detector only stops the adaptation, and takes 0.2 s.
//!
//! A vehicle that takes off touches the ground for longer than it stands: its feet hold it while its rotors carry most
//! of it, and give way at once. What they hold against is no wind and no weak rotor, and an observer that has made up
//! for it tips the vehicle over when they let go; likewise a tilt that the law has asked for in vain while the wind
//! pushed. So a vehicle touches the ground until it has risen from where it stood, and is asked to tilt little until
//! then.

use afbc_types::State;

/// Share of the weight below which the demanded thrust does not carry the vehicle.
pub const LIFT_SHARE: f32 = 0.4;
/// Speed along each axis below which the vehicle is at rest \[m/s\].
pub const STILL_M_S: f32 = 0.3;
/// Speed along an axis at which a vehicle no longer stands \[m/s\]: more than rocking on its feet, and reached in 0.1 s
/// of falling.
pub const MOVING_M_S: f32 = 0.5;
/// Time for which both must last \[s\].
pub const STILL_S: f32 = 0.2;
/// Change of height at which a vehicle has left the ground \[m\].
pub const LEFT_M: f32 = 0.05;
/// Tangent of the largest tilt that is asked of a vehicle on its feet: 12 degrees, as autopilots have it.
pub const TOUCHING_TAN: f32 = 0.21;
/// Time after which a vehicle whose rotors carry it no longer touches the ground, wherever it is \[s\].
pub const IN_AIR_S: f32 = 3.0;

/// Detector of a vehicle that stands on the ground, or touches it. It begins in the air.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standstill {
    still_s: f32,
    /// None in the air.
    touched: Option<Touched>,
}

/// A vehicle that touches the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Touched {
    /// Height at which it stood \[m\]; not known before the first step.
    height_m: Option<f32>,
    /// Time since then \[s\].
    since_s: f32,
}

impl Standstill {
    /// A vehicle that stands on the ground, from where it is to take off.
    pub fn land(&mut self) {
        self.touched = Some(Touched { height_m: None, since_s: 0.0 });
    }

    /// Processes one step, with the demanded U4 \[N\].
    #[inline]
    pub fn advance(&mut self, thrust_n: f32, weight_n: f32, state: &State, dt_s: f32) {
        let slower = |speed_max| state.velocity_m_s.iter().all(|v| v.abs() < speed_max);
        let speed_max = if self.stands() { MOVING_M_S } else { STILL_M_S };
        self.still_s = if thrust_n < LIFT_SHARE * weight_n && slower(speed_max) { self.still_s + dt_s } else { 0.0 };
        if self.stands() {
            self.land();
        }
        if let Some(Touched { height_m, since_s }) = &mut self.touched {
            let z_m = state.position_m.z;
            let risen_m = (z_m - *height_m.get_or_insert(z_m)).abs();
            *since_s += dt_s;
            // Sideways it may slide in the wind.
            if risen_m > LEFT_M || *since_s > IN_AIR_S || state.velocity_m_s.z.abs() > MOVING_M_S {
                self.touched = None;
            }
        }
    }

    /// True if the vehicle stands on the ground.
    #[inline]
    pub fn stands(&self) -> bool {
        self.still_s > STILL_S
    }

    /// True if the vehicle may touch the ground: it has not left where it stood.
    #[inline]
    pub fn touches(&self) -> bool {
        self.touched.is_some()
    }
}
