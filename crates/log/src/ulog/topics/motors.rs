//! Topics of the motor commands.

use crate::ulog::known::MOTORS;
use crate::ulog::layout::message;
use crate::ulog::moment::Moment;

/// Number of outputs in a message.
const OUTPUTS: usize = 16;

message! {
    /// Thrust of each motor, in PX4's order on an X frame of four.
    "actuator_motors" ActuatorMotors {
        timestamp_sample: u64 = "us",
        control: [f32; MOTORS] = "share of the largest thrust; not a number while disarmed",
    }
}

impl ActuatorMotors {
    pub(crate) fn of(moment: &Moment<'_>) -> Self {
        let armed = moment.report.mode.armed();
        let share = |rotor: &usize| {
            let speed = moment.report.motors.0.get(*rotor).filter(|_| armed && *rotor < moment.known.rotors);
            speed.map_or(f32::NAN, |speed| speed * speed * moment.known.share_per_speed_squared)
        };
        ActuatorMotors {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            control: moment.known.rotor_of_motor.each_ref().map(share),
        }
    }
}

message! {
    /// Throttles, in the same order.
    "actuator_outputs" ActuatorOutputs {
        noutputs: u32 = "",
        output: [f32; OUTPUTS] = "DSHOT: 0, or 48 to 2047",
    }
}

impl ActuatorOutputs {
    pub(crate) fn of(moment: &Moment<'_>) -> Self {
        let mut output = [0.0; OUTPUTS];
        for (to, rotor) in output.iter_mut().zip(moment.known.rotor_of_motor) {
            *to = moment.report.throttles.get(rotor).map_or(0.0, |throttle| f32::from(*throttle));
        }
        ActuatorOutputs { timestamp: moment.now_us(), noutputs: moment.known.rotors as u32, output }
    }
}
