//! The cascade compensates observed and known moments in addition to the law's own inputs.

use crate::common::step;
use afbc::moments::AGE_S;
use afbc::{Adaptive, Controller, Profile, Settings};
use afbc_control::drag::KnownDrag;
use afbc_control::{Smoother, Validated};
use afbc_types::{Inputs, Parameters, Setpoint, State};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

const DT_S: f32 = 0.001;
/// Lag of the rotors for which the profile `flight` is made \[s\].
const LAG_S: f32 = 0.02;

/// A vehicle that flies at a constant velocity with AFBC in the profile `flight`.
struct Vehicle {
    controller: Controller<Adaptive>,
    smoother: Smoother,
    parameters: Parameters,
    drag: KnownDrag,
    state: State,
    /// Measured rates, delayed to the age that the observer assumes \[rad/s\].
    seen_rad_s: Vector3<f32>,
    along_m_s: Vector3<f32>,
    /// Thrust and moments that the rotors give.
    given: Inputs,
}

impl Vehicle {
    /// Creates a vehicle in trim: it leans into the drag, and its rotors already compensate the drag's moment.
    fn new(drag: KnownDrag, along_m_s: Vector3<f32>) -> Self {
        let flight = Profile::Flight.settings();
        let settings = Settings { common: afbc_control::Settings { drag, ..flight.common }, ..flight };
        let parameters = Parameters::PAPER.to_f32();
        let law = Adaptive::new(Profile::Flight.gains()).unwrap();
        let force_m_s2 = Vector3::z() * 9.81 - drag.acceleration(&along_m_s, &Vector3::z(), 1.0);
        let up = force_m_s2.normalize();
        let attitude_rad = Vector3::new(-up.y.asin(), up.x.atan2(up.z), 0.0);
        let mut vehicle = Vehicle {
            controller: Controller::new(parameters, settings, law).unwrap(),
            smoother: Smoother::new(&settings.smoothing, DT_S).unwrap(),
            drag,
            state: State { velocity_m_s: along_m_s, attitude_rad, ..State::default() },
            seen_rad_s: Vector3::zeros(),
            along_m_s,
            given: Inputs { thrust_n: parameters.mass_kg * force_m_s2.norm(), ..Inputs::default() },
            parameters,
        };
        let against_n = -vehicle.drag_turns().component_div(&parameters.effectiveness());
        (vehicle.given.roll_n, vehicle.given.pitch_n) = (against_n.x, against_n.y);
        vehicle
    }

    fn attitude(&self) -> UnitQuaternion<f32> {
        let [roll, pitch, yaw] = self.state.attitude_rad.into();
        UnitQuaternion::from_euler_angles(roll, pitch, yaw)
    }

    /// Returns the angular acceleration by the drag of the rotors above the centre of mass \[rad/s2\].
    fn drag_turns(&self) -> Vector3<f32> {
        let v = self.attitude().inverse() * self.state.velocity_m_s;
        let force = v * -(self.drag.rotor_drag_1_s * (self.given.thrust_n / self.parameters.weight_n()).sqrt());
        let moment = Vector3::new(0.0, 0.0, self.drag.rotor_height_m).cross(&force) * self.parameters.mass_kg;
        moment.component_div(&self.parameters.inertia_kg_m2)
    }

    /// Moves one step under this angular acceleration and the angular acceleration by the rotors.
    fn advance(&mut self, asked: &Inputs, moment_rad_s2: &Vector3<f32>) {
        let share = 1.0 - (-DT_S / LAG_S).exp();
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = &mut self.given;
        let places =
            [(roll_n, asked.roll_n), (pitch_n, asked.pitch_n), (yaw_n, asked.yaw_n), (thrust_n, asked.thrust_n)];
        places.into_iter().for_each(|(given, asked)| *given += (asked - *given) * share);
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = self.given;
        let attitude = self.attitude();
        let up = attitude * Vector3::z();
        let State { position_m, velocity_m_s, attitude_rad, rates_rad_s } = &mut self.state;
        let drag_m_s2 = self.drag.acceleration(velocity_m_s, &up, thrust_n / self.parameters.weight_n());
        *velocity_m_s += (up * (thrust_n / self.parameters.mass_kg) - Vector3::z() * 9.81 + drag_m_s2) * DT_S;
        *position_m += *velocity_m_s * DT_S;
        let by_rotors = Vector3::new(roll_n, pitch_n, yaw_n).component_mul(&self.parameters.effectiveness());
        *rates_rad_s += (by_rotors + moment_rad_s2) * DT_S;
        let (roll, pitch, yaw) = (attitude * UnitQuaternion::from_scaled_axis(*rates_rad_s * DT_S)).euler_angles();
        *attitude_rad = Vector3::new(roll, pitch, yaw);
    }

    /// Flies `steps` steps under `moment_rad_s2` in addition to the drag's moment. Returns two angular accelerations
    /// for each step \[rad/s2\]: the one asked of the rotors beyond the law's own inputs, and the one caused by the
    /// drag.
    fn fly(&mut self, steps: u16, moment_rad_s2: &Vector3<f32>) -> Vec<[Vector3<f32>; 2]> {
        let (mut memory, mut smoothed) = (Validated::default(), None);
        let mut made_up = |number: u16| {
            let position_m = self.along_m_s * (f32::from(number) * DT_S);
            let setpoint = Setpoint { position_m, velocity_m_s: self.along_m_s, ..Setpoint::default() };
            let drag_rad_s2 = self.drag_turns();
            self.seen_rad_s += (self.state.rates_rad_s - self.seen_rad_s) * (1.0 - (-DT_S / AGE_S).exp());
            let seen = State { rates_rad_s: self.seen_rad_s, ..self.state };
            let stepped = step(&self.controller, &mut memory, &seen, &setpoint);
            let law = &memory.control.last.inputs;
            let law = Inputs { roll_n: law.roll, pitch_n: law.pitch, yaw_n: law.yaw, thrust_n: law.z };
            let (law, asked) = (self.smoother.advance(&mut smoothed, &law), stepped.trace.inputs);
            let more_n = Vector3::new(asked.roll_n - law.roll_n, asked.pitch_n - law.pitch_n, asked.yaw_n - law.yaw_n);
            self.advance(&stepped.action.given, &(moment_rad_s2 + drag_rad_s2));
            [more_n.component_mul(&self.parameters.effectiveness()), drag_rad_s2]
        };
        (0..steps).map(&mut made_up).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, failure_persistence: None, ..ProptestConfig::default() })]

    /// A constant moment, as of a payload off the centre, is fully compensated, so that the law need not learn it.
    #[test]
    fn a_constant_moment_is_made_up_for(x in 1.0_f32..6.0, y in -6.0_f32..-1.0, z in 0.3_f32..1.0, turned: bool) {
        let moment = Vector3::new(x, y, z) * if turned { -1.0 } else { 1.0 };
        let flown = Vehicle::new(KnownDrag::NONE, Vector3::zeros()).fly(2_000, &moment);
        let [made_up, _] = flown[1_999];
        let off = (made_up + moment).component_div(&moment).amax();
        prop_assert!(off < 0.05, "{made_up:?} for {moment:?}");
    }

    /// A known drag's moment is compensated before it is observed, and not a second time afterwards.
    #[test]
    fn a_known_drag_turns_nothing(x in 2.0_f32..5.0, y in -5.0_f32..-2.0, height in 0.02_f32..0.1, below: bool) {
        let rotor_height_m = if below { -height } else { height };
        let drag = KnownDrag { rotor_drag_1_s: 0.4, body_drag_1_m: 0.01, rotor_height_m };
        let flown = Vehicle::new(drag, Vector3::new(x, y, 0.0)).fly(1_500, &Vector3::zeros());
        // In the first step the drag is unknown, because it depends on the last thrust. Until rotors and rates have
        // followed, the observer sees some of the moment. Without the compensation, or with it twice, the error would
        // be the whole moment.
        for (number, [made_up, drag]) in flown.into_iter().enumerate().skip(1) {
            let off = (made_up + drag).norm() / drag.norm();
            let most = if number < 300 { 0.6 } else { 0.1 };
            prop_assert!(off < most, "step {number}: {made_up:?} for {drag:?}");
        }
    }
}
