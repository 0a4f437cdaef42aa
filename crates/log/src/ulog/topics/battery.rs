//! Topic of the battery.

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;

message! {
    /// The battery.
    "battery_status" BatteryVoltage {
        voltage_v: f32 = "V",
        current_a: f32 = "A",
        remaining: f32 = "0 to 1; -1 if unknown",
        connected: bool = "",
    }
}

impl BatteryVoltage {
    /// Returns none if the battery is not measured.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let reading = moment.details.inputs.battery?;
        Some(BatteryVoltage {
            timestamp: moment.now_us(),
            voltage_v: reading.voltage_v,
            current_a: reading.current_a,
            remaining: moment.report.guided.charge.unwrap_or(-1.0),
            connected: true,
        })
    }
}
