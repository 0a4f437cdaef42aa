//! Parameters of radio control, with PX4's names and meanings.

use crate::channels::Channels;
use crate::curves::StickCurves;
use afbc_guidance::FlightMode;
use afbc_types::{Choice, Range, parameters};

parameters! {
    /// Calibration of a channel.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ChannelCalibration {
        /// Shortest pulse.
        #[parameter(MIN, "us", 800.0..=1500.0)]
        pub min_us: f32 = 1000.0,
        /// Pulse at the centre. For the throttle, the centre is halfway between the ends.
        #[parameter(TRIM, "us", 800.0..=2200.0)]
        pub trim_us: f32 = 1500.0,
        /// Longest pulse.
        #[parameter(MAX, "us", 1500.0..=2200.0)]
        pub max_us: f32 = 2000.0,
        /// Distance from the centre within which the channel counts as centred.
        #[parameter(DZ, "us", 0.0..=100.0)]
        pub dead_band_us: f32 = 10.0,
        /// Direction; the channel is reversed below 0.
        #[parameter(REV, "number", -1.0..=1.0)]
        pub direction: f32 = 1.0,
    }
    together(channel) {
        let ChannelCalibration { min_us, max_us, .. } = *channel;
        // Leaves at least half of the usual stick travel on either side, so that nothing is divided by zero.
        Range { max: (max_us - 300.0).into(), ..ChannelCalibration::MIN.range }.check(min_us)?;
        let room = Range { min: min_us.into(), max: max_us.into(), ..ChannelCalibration::TRIM.range };
        room.check(channel.trim_us)
    }
}

parameters! {
    /// Channel for each function, counted from 1; 0 for none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct RadioFunctions {
        /// Roll.
        #[parameter(RC_MAP_ROLL, "number", 0.0..=18.0)]
        pub roll: u32 = 1,
        /// Pitch.
        #[parameter(RC_MAP_PITCH, "number", 0.0..=18.0)]
        pub pitch: u32 = 2,
        /// Throttle.
        #[parameter(RC_MAP_THROTTLE, "number", 0.0..=18.0)]
        pub throttle: u32 = 3,
        /// Yaw.
        #[parameter(RC_MAP_YAW, "number", 0.0..=18.0)]
        pub yaw: u32 = 4,
        /// Switch that arms and disarms.
        #[parameter(RC_MAP_ARM_SW, "number", 0.0..=18.0)]
        pub arm: u32 = 5,
        /// Switch of six positions that selects the mode.
        #[parameter(RC_MAP_FLTMODE, "number", 0.0..=18.0)]
        pub mode: u32 = 6,
        /// Switch that stops the motors, also in flight.
        #[parameter(RC_MAP_KILL_SW, "number", 0.0..=18.0)]
        pub kill: u32 = 0,
        /// Switch that selects return.
        #[parameter(RC_MAP_RETURN_SW, "number", 0.0..=18.0)]
        pub return_home: u32 = 0,
        /// Switch that selects hold.
        #[parameter(RC_MAP_LOITER_SW, "number", 0.0..=18.0)]
        pub hold: u32 = 0,
        /// Channel by which the receiver reports a lost link, for receivers without another way; 0 for the throttle.
        #[parameter(RC_MAP_FAILSAFE, "number", 0.0..=18.0)]
        pub failsafe: u32 = 0,
        /// Threshold above which the arming switch is on, as a share of its range. If negative, the switch is on below
        /// the threshold.
        #[parameter(RC_ARMSWITCH_TH, "share", -1.0..=1.0)]
        pub arm_share: f32 = 0.75,
        /// Threshold of the kill switch, with the same meaning as `RC_ARMSWITCH_TH`.
        #[parameter(RC_KILLSWITCH_TH, "share", -1.0..=1.0)]
        pub kill_share: f32 = 0.75,
        /// Threshold of the return switch, with the same meaning as `RC_ARMSWITCH_TH`.
        #[parameter(RC_RETURN_TH, "share", -1.0..=1.0)]
        pub return_share: f32 = 0.75,
        /// Threshold of the hold switch, with the same meaning as `RC_ARMSWITCH_TH`.
        #[parameter(RC_LOITER_TH, "share", -1.0..=1.0)]
        pub hold_share: f32 = 0.75,
        /// Pulse by which the receiver reports a lost link, outside the range of the channel `failsafe_channel`; 0 for
        /// none.
        #[parameter(RC_FAILS_THR, "us", 0.0..=2200.0)]
        pub failsafe_us: f32 = 0.0,
    }
}

parameters! {
    /// Modes of the six positions of the mode switch, by PX4's numbers: 0 and 8 stabilised, 1 altitude, 2 position, 3
    /// mission, 4 hold, 5 return, 6 acro, 7 offboard, 10 takeoff, 11 land.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SwitchModes {
        /// First position.
        #[parameter(COM_FLTMODE1, "number", 0.0..=11.0)]
        pub first: u32 = 2,
        /// Second position.
        #[parameter(COM_FLTMODE2, "number", 0.0..=11.0)]
        pub second: u32 = 2,
        /// Third position.
        #[parameter(COM_FLTMODE3, "number", 0.0..=11.0)]
        pub third: u32 = 2,
        /// Fourth position.
        #[parameter(COM_FLTMODE4, "number", 0.0..=11.0)]
        pub fourth: u32 = 2,
        /// Fifth position.
        #[parameter(COM_FLTMODE5, "number", 0.0..=11.0)]
        pub fifth: u32 = 4,
        /// Sixth position.
        #[parameter(COM_FLTMODE6, "number", 0.0..=11.0)]
        pub sixth: u32 = 4,
        /// Whether moving the sticks ends an autonomous mode.
        #[switch(COM_RC_OVERRIDE)]
        pub overrides: bool = true,
        /// Stick movement that ends an autonomous mode, as a share of full deflection.
        #[parameter(COM_RC_STICK_OV, "share", 0.05..=0.8)]
        pub override_share: f32 = 0.3,
    }
    together(modes) {
        for (declaration, number) in SwitchModes::DECLARED.iter().zip(modes.numbers()) {
            if mode_of(number).is_none() {
                // PX4's slow position mode (9) does not exist here.
                let next = f64::from(number) + 1.0;
                Range { min: next, ..declaration.range }.check(number as f32)?;
            }
        }
        Ok(())
    }
}

/// Protocol of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadioProtocol {
    /// CRSF: Crossfire, ExpressLRS.
    Crsf,
    /// SBUS: Futaba, FrSky and others.
    Sbus,
}

impl Choice for RadioProtocol {
    const ALL: &'static [Self] = &[RadioProtocol::Crsf, RadioProtocol::Sbus];
    const WORDS: &'static [&'static str] = &["crsf", "sbus"];
}

parameters! {
    /// The receiver.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct RadioReceiver {
        /// Number of the link that reads the receiver in place of MAVLink, counted from 1; 0 for the board's receiver
        /// input, if any; from the next start on. Link 1 always carries MAVLink.
        #[parameter(RC_PORT, "number", 0.0..=4.0)]
        pub port: u32 = 0,
        /// Protocol of the receiver, from the next start on.
        #[choice(RC_PROTOCOL)]
        pub protocol: RadioProtocol = RadioProtocol::Crsf,
        /// Source of the sticks: 0 the receiver, 1 a station's joystick (MANUAL_CONTROL), 4 none, 5 the receiver, or
        /// the joystick while the receiver is silent. The receiver's switches always work.
        #[parameter(COM_RC_IN_MODE, "number", 0.0..=5.0)]
        pub source: u32 = 5,
    }
    together(receiver) {
        let least = match receiver.source {
            // PX4's modes 2 and 3, which choose between receiver and joystick, do not exist here.
            2 | 3 => 4.0,
            _ => 0.0,
        };
        Range { min: least, ..RadioReceiver::COM_RC_IN_MODE.range }.check(receiver.source as f32)
    }
}

impl RadioReceiver {
    /// True if the receiver's sticks are in use.
    pub fn takes_receiver(&self) -> bool {
        matches!(self.source, 0 | 5)
    }

    /// True if a ground station's joystick is in use, at least while the receiver's sticks are not available.
    pub fn takes_joystick(&self) -> bool {
        matches!(self.source, 1 | 5)
    }
}

parameters! {
    /// All parameters of radio control.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct RadioSettings {
        /// The receiver.
        #[group("")]
        pub receiver: RadioReceiver = RadioReceiver::DEFAULT,
        /// Channel for each function.
        #[group("")]
        pub functions: RadioFunctions = RadioFunctions::DEFAULT,
        /// Modes.
        #[group("")]
        pub modes: SwitchModes = SwitchModes::DEFAULT,
        /// Curves of the sticks.
        #[group("")]
        pub curves: StickCurves = StickCurves::DEFAULT,
        /// Channel 1.
        #[group("RC1_")]
        pub channel_1: ChannelCalibration = ChannelCalibration::DEFAULT,
        /// Channel 2.
        #[group("RC2_")]
        pub channel_2: ChannelCalibration = ChannelCalibration::DEFAULT,
        /// Channel 3.
        #[group("RC3_")]
        pub channel_3: ChannelCalibration = ChannelCalibration::DEFAULT,
        /// Channel 4.
        #[group("RC4_")]
        pub channel_4: ChannelCalibration = ChannelCalibration::DEFAULT,
    }
}

/// Returns the flight mode with PX4's number.
fn mode_of(number: u32) -> Option<FlightMode> {
    Some(match number {
        0 | 8 => FlightMode::Stabilised,
        1 => FlightMode::Altitude,
        2 => FlightMode::Position,
        3 => FlightMode::Mission,
        4 => FlightMode::Hold,
        5 => FlightMode::Return,
        6 => FlightMode::Acro,
        7 => FlightMode::Offboard,
        10 => FlightMode::Takeoff,
        11 => FlightMode::Land,
        _ => return None,
    })
}

impl SwitchModes {
    const DECLARED: [afbc_types::Declaration; 6] = [
        Self::COM_FLTMODE1,
        Self::COM_FLTMODE2,
        Self::COM_FLTMODE3,
        Self::COM_FLTMODE4,
        Self::COM_FLTMODE5,
        Self::COM_FLTMODE6,
    ];

    fn numbers(&self) -> [u32; 6] {
        [self.first, self.second, self.third, self.fourth, self.fifth, self.sixth]
    }

    /// Returns the mode of a switch position, -1 to 1.
    pub(crate) fn mode(&self, stick: f32) -> Option<FlightMode> {
        let position = ((stick + 1.0) * 3.0) as usize;
        // The upper end of the travel would be a seventh position.
        self.numbers().get(position.min(5)).copied().and_then(mode_of)
    }
}

impl ChannelCalibration {
    /// Returns a pulse as a share of the travel from `trim_us`, -1 to 1.
    fn share(&self, us: u16, trim_us: f32) -> f32 {
        let off_us = f32::from(us) - trim_us;
        let is_below = off_us < 0.0;
        let outside_us = off_us.abs() - self.dead_band_us;
        let room_us = (if is_below { trim_us - self.min_us } else { self.max_us - trim_us }) - self.dead_band_us;
        if outside_us <= 0.0 || room_us <= 0.0 {
            return 0.0;
        }
        let share = (outside_us / room_us).min(1.0);
        if is_below == (self.direction < 0.0) { share } else { -share }
    }

    /// Returns the position of a stick, -1 to 1.
    pub(crate) fn stick(&self, us: u16) -> f32 {
        self.share(us, self.trim_us)
    }

    /// Returns the position of a stick or switch centred between its ends, -1 to 1.
    pub(crate) fn centred(&self, us: u16) -> f32 {
        self.share(us, 0.5 * (self.min_us + self.max_us))
    }
}

impl RadioSettings {
    fn calibrations(&self) -> [&ChannelCalibration; 4] {
        [&self.channel_1, &self.channel_2, &self.channel_3, &self.channel_4]
    }

    /// Returns the calibration and pulse of a channel.
    pub(crate) fn channel(&self, channels: &Channels, number: u32) -> Option<(&ChannelCalibration, u16)> {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        // Channels above 4 are switches and use the default calibration.
        let calibration = self.calibrations().get(index).copied().unwrap_or(&ChannelCalibration::DEFAULT);
        Some((calibration, channels.channel(number)?))
    }

    /// True if moved sticks end an autonomous mode.
    pub(crate) fn overrides(&self) -> bool {
        self.modes.overrides && self.receiver.takes_receiver()
    }

    /// True if the failsafe channel shows that the receiver has lost the transmitter.
    pub(crate) fn has_failed(&self, channels: &Channels) -> bool {
        let RadioFunctions { failsafe, throttle, failsafe_us, .. } = self.functions;
        let number = if failsafe == 0 { throttle } else { failsafe };
        let Some((calibration, us)) = self.channel(channels, number).filter(|_| failsafe_us > 0.0) else {
            return false;
        };
        let us = f32::from(us);
        // A threshold within the channel's range is ignored: moving the stick past it would look like a lost link.
        failsafe_us < calibration.min_us && us < failsafe_us || failsafe_us > calibration.max_us && us > failsafe_us
    }
}

#[cfg(test)]
mod tests;
