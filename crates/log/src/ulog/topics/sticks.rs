//! Topic of the pilot's sticks.

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;

/// PX4's data source number of a radio.
const RADIO: u8 = 1;

message! {
    /// The pilot's sticks.
    "manual_control_setpoint" ManualControl {
        timestamp_sample: u64 = "us",
        roll: f32 = "-1 to 1, to the right",
        pitch: f32 = "-1 to 1, forward",
        yaw: f32 = "-1 to 1, clockwise",
        throttle: f32 = "-1 to 1, up",
        valid: bool = "",
        data_source: u8 = "1: radio or joystick",
    }
}

impl ManualControl {
    /// Returns none until a pilot has moved a stick.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let sticks = moment.details.sticks?;
        Some(ManualControl {
            timestamp: moment.now_us(),
            timestamp_sample: sticks.at_us,
            roll: sticks.value.roll,
            pitch: sticks.value.pitch,
            yaw: sticks.value.yaw,
            throttle: sticks.value.throttle,
            valid: true,
            data_source: RADIO,
        })
    }
}
