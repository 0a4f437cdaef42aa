//! State of the vehicle, as its messages report it.

use afbc_mavlink::{Address, Downlink, MavSeverity};

/// `MAV_COMP_ID_AUTOPILOT1`.
const AUTOPILOT: u8 = 1;

/// Newest state that the vehicle has reported.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleState {
    /// Address of the first autopilot that was heard.
    pub address: Option<Address>,
    /// Number of its heartbeats that were received.
    pub heartbeats: u32,
    /// True if the motors may turn.
    pub armed: bool,
    /// Flight mode: `custom_mode` of HEARTBEAT.
    pub mode: u32,
    /// Status texts since they were last taken.
    pub texts: Vec<VehicleText>,
}

/// A STATUSTEXT of the vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleText {
    /// Time of arrival \[ms\].
    pub at_ms: u64,
    /// MAVLink severity.
    pub severity: MavSeverity,
    /// The text.
    pub text: String,
}

impl VehicleState {
    /// Handles a message; returns false if another vehicle sent it.
    pub(crate) fn hear(&mut self, from: Address, message: &Downlink, now_ms: u64) -> bool {
        // Only autopilots count: stations send heartbeats, too, and a wire may send back this station's own.
        if matches!(message, Downlink::Heartbeat { .. }) && from.component == AUTOPILOT {
            self.address.get_or_insert(from);
        }
        if self.address.is_some_and(|address| address != from) {
            return false;
        }
        match message {
            Downlink::Heartbeat { armed, mode, .. } if self.address.is_some() => {
                (self.armed, self.mode) = (*armed, *mode);
                self.heartbeats += 1;
            }
            Downlink::Text { severity, text } => {
                let text = text.to_str().unwrap_or("not readable").to_owned();
                self.texts.push(VehicleText { at_ms: now_ms, severity: *severity, text });
            }
            _ => (),
        }
        true
    }
}
