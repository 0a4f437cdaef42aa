//! Handling of companion computers' setpoints, joysticks and RC overrides.

use super::Comms;
use afbc_flight_core::Stamped;
use afbc_guidance::{AttitudeTarget, MotionTarget};
use afbc_mavlink::{Address, ExternalTarget, PositionTarget, TargetFrame};
use afbc_onboard::ControlInputs;
use afbc_rc::SILENT_US;
use afbc_types::Setpoint;
use nalgebra::{Quaternion, UnitQuaternion};

impl Comms {
    /// Handles a complete setpoint.
    pub(super) fn setpoint(&mut self, setpoint: Setpoint, from: Address, inputs: &mut ControlInputs) {
        if self.may(from, inputs) {
            let at_us = self.now_us;
            let value = afbc_guidance::OffboardTarget::Motion(motion(&PositionTarget::from(&setpoint), false));
            inputs.order().target = Some(Stamped { value, at_us });
        }
    }

    /// Handles any other target, a joystick or an RC override.
    pub(super) fn target(&mut self, target: ExternalTarget, from: Address, inputs: &mut ControlInputs) {
        if !self.may(from, inputs) {
            return;
        }
        let at_us = self.now_us;
        let value = match target {
            ExternalTarget::Motion(target) => {
                let Some(target) = self.in_local_frame(&target) else { return };
                afbc_guidance::OffboardTarget::Motion(target)
            }
            ExternalTarget::GlobalPosition(place, target) => {
                let Ok(position_m) = self.local(&place) else { return };
                afbc_guidance::OffboardTarget::Motion(MotionTarget { position_m, ..motion(&target, false) })
            }
            ExternalTarget::Attitude(target) => {
                let [w, x, y, z] = target.attitude;
                let attitude = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                let (yaw_rate_rad_s, thrust) = (target.yaw_rate_rad_s, target.thrust);
                afbc_guidance::OffboardTarget::Attitude(AttitudeTarget { attitude, yaw_rate_rad_s, thrust })
            }
            ExternalTarget::Channels(channels) => {
                // The newest channels replace older ones, as with a receiver.
                self.overrides = Some(channels);
                return;
            }
            ExternalTarget::Sticks(sticks) => {
                // The pilot's radio sticks take precedence over a joystick.
                let radio_us = self.radio_us.filter(|radio_us| at_us.saturating_sub(*radio_us) <= SILENT_US);
                if !self.takes_joystick || radio_us.is_some() {
                    return;
                }
                let afbc_mavlink::ManualControl { roll, pitch, throttle, yaw } = sticks;
                let sticks = afbc_guidance::Sticks { roll, pitch, throttle, yaw };
                let value = self.curves.shape(self.status.guided.mode, &sticks);
                inputs.order().sticks = Some(Stamped { value, at_us });
                return;
            }
        };
        inputs.order().target = Some(Stamped { value, at_us });
    }

    /// Converts a target to the guidance's type. Returns none if the target needs an unknown position.
    fn in_local_frame(&self, target: &PositionTarget) -> Option<MotionTarget> {
        Some(match target.axes {
            TargetFrame::Local => motion(target, false),
            TargetFrame::Offset => {
                let here = self.status.is_located().then(|| self.here())?;
                MotionTarget { position_m: here + target.position_m, ..motion(target, false) }
            }
            // A target in the body frame has either a position or a velocity: the decoder accepts no other.
            TargetFrame::Body => motion(target, target.position_m.iter().all(|number| number.is_nan())),
            TargetFrame::BodyOffset => motion(target, true),
        })
    }
}

fn motion(target: &PositionTarget, body: bool) -> MotionTarget {
    let PositionTarget { position_m, velocity_m_s, acceleration_m_s2, yaw_rad, yaw_rate_rad_s, .. } = *target;
    MotionTarget { position_m, velocity_m_s, acceleration_m_s2, yaw_rad, yaw_rate_rad_s, body }
}
