//! The vehicle's state, as it tells it.

use afbc_link::{Address, Downlink, MavSeverity};

/// `MAV_COMP_ID_AUTOPILOT1`.
const AUTOPILOT: u8 = 1;

/// What the vehicle has said of itself last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleState {
    /// Who it is: the first autopilot that was heard.
    pub address: Option<Address>,
    /// Number of its heartbeats.
    pub heartbeats: u32,
    /// True if the motors may turn.
    pub armed: bool,
    /// Mode, as `custom_mode` of HEARTBEAT.
    pub mode: u32,
    /// Its texts, since they were last taken.
    pub texts: Vec<VehicleText>,
}

/// A STATUSTEXT.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleText {
    /// When it came \[ms\].
    pub at_ms: u64,
    /// How grave it is.
    pub severity: MavSeverity,
    /// The text.
    pub text: String,
}

impl VehicleState {
    /// Takes a message; false if it is another's.
    pub(crate) fn hear(&mut self, from: Address, message: &Downlink, now_ms: u64) -> bool {
        // Stations have heartbeats too, this one's own among them where a wire sends it back.
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
