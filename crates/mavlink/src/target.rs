//! Targets from a companion computer, and a pilot's sticks from a ground station.

use crate::address::Address;
use crate::channels::ChannelsOverride;
use crate::frames::{flip, flip_turn};
use crate::global_position::{GlobalPosition, Height, datum, frame};
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use afbc_types::Setpoint;
use mavlink::MessageData;
use mavlink::dialects::common::{
    MANUAL_CONTROL_DATA, POSITION_TARGET_LOCAL_NED_DATA, RC_CHANNELS_OVERRIDE_DATA, SET_ATTITUDE_TARGET_DATA,
    SET_POSITION_TARGET_GLOBAL_INT_DATA, SET_POSITION_TARGET_LOCAL_NED_DATA,
};
use nalgebra::Vector3;

/// Reference of a target's coordinates, from `MAV_FRAME`. The vehicle's axes are horizontal and vertical: forward,
/// left, up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TargetFrame {
    /// MAV_FRAME_LOCAL_NED: position and axes of the local frame.
    #[default]
    Local,
    /// MAV_FRAME_LOCAL_OFFSET_NED: position relative to the vehicle, axes of the local frame.
    Offset,
    /// MAV_FRAME_BODY_NED: position in the local frame; velocity and acceleration along the vehicle's axes.
    Body,
    /// MAV_FRAME_BODY_OFFSET_NED or MAV_FRAME_BODY_FRD: everything along the vehicle's axes, position relative to the
    /// vehicle.
    BodyOffset,
}

/// A target of position, velocity and acceleration; NaN for each number that is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionTarget {
    /// Reference of the coordinates.
    pub axes: TargetFrame,
    /// Position \[m\].
    pub position_m: Vector3<f32>,
    /// Velocity \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Acceleration \[m/s2\].
    pub acceleration_m_s2: Vector3<f32>,
    /// Heading, always in the earth frame \[rad\].
    pub yaw_rad: f32,
    /// Yaw rate \[rad/s\].
    pub yaw_rate_rad_s: f32,
}

impl From<&Setpoint> for PositionTarget {
    fn from(setpoint: &Setpoint) -> Self {
        PositionTarget {
            axes: TargetFrame::Local,
            position_m: setpoint.position_m,
            velocity_m_s: setpoint.velocity_m_s,
            acceleration_m_s2: setpoint.acceleration_m_s2,
            yaw_rad: setpoint.yaw_rad,
            yaw_rate_rad_s: setpoint.yaw_rate_rad_s,
        }
    }
}

impl PositionTarget {
    /// A target that gives nothing.
    pub const NONE: Self = {
        let none = Vector3::new(f32::NAN, f32::NAN, f32::NAN);
        let (position_m, velocity_m_s, acceleration_m_s2) = (none, none, none);
        let (yaw_rad, yaw_rate_rad_s) = (f32::NAN, f32::NAN);
        PositionTarget {
            axes: TargetFrame::Local,
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            yaw_rad,
            yaw_rate_rad_s,
        }
    };

    /// Returns the setpoint of a target that gives a position in the local frame and a heading; other numbers that are
    /// not given become zero.
    pub fn setpoint(&self) -> Option<Setpoint> {
        let or_zero = |value: f32| if value.is_nan() { 0.0 } else { value };
        let setpoint = Setpoint {
            position_m: self.position_m,
            velocity_m_s: self.velocity_m_s.map(or_zero),
            acceleration_m_s2: self.acceleration_m_s2.map(or_zero),
            yaw_rad: self.yaw_rad,
            yaw_rate_rad_s: or_zero(self.yaw_rate_rad_s),
            // The message has no jerk, snap or angular acceleration.
            ..Setpoint::default()
        };
        // A velocity along the vehicle's axes cannot be used in the local frame.
        let is_local = match self.axes {
            TargetFrame::Local => true,
            TargetFrame::Body => self.velocity_m_s.iter().chain(&self.acceleration_m_s2).all(|number| number.is_nan()),
            TargetFrame::Offset | TargetFrame::BodyOffset => false,
        };
        (is_local && setpoint.is_plausible()).then_some(setpoint)
    }

    /// Returns the setpoint of a target that gives every number in the local frame.
    pub(crate) fn complete(&self) -> Option<Setpoint> {
        let numbers = [&self.position_m, &self.velocity_m_s, &self.acceleration_m_s2].into_iter().flatten();
        let all = numbers.chain([&self.yaw_rad, &self.yaw_rate_rad_s]).all(|number| number.is_finite());
        (all && self.axes == TargetFrame::Local).then(|| self.setpoint()).flatten()
    }

    /// Returns the numbers of the message, and its type mask of ignored numbers.
    fn fields(&self) -> ([Vector3<f32>; 3], [f32; 2], u16) {
        let vectors = [self.position_m, self.velocity_m_s, self.acceleration_m_s2].map(flip);
        let yaw = [-self.yaw_rad, -self.yaw_rate_rad_s];
        let places = (0..9).zip(vectors.iter().flatten()).chain([(10, &yaw[0]), (11, &yaw[1])]);
        let mask = places.fold(0, |mask, (bit, number)| mask | u16::from(number.is_nan()) << bit);
        let or_zero = |number: f32| if number.is_nan() { 0.0 } else { number };
        (vectors.map(|vector| vector.map(or_zero)), yaw.map(or_zero), mask)
    }

    /// Reads a target from numbers and their type mask. Forces are not supported, nor is a target that gives nothing.
    fn read(axes: TargetFrame, vectors: [[f32; 3]; 3], yaw: [f32; 2], mask: u16) -> Result<Self, FrameFault> {
        if mask & FORCE != 0 || mask & NOTHING == NOTHING {
            return Err(FrameFault::Unsupported);
        }
        let bits = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        // A number that is not ignored must be finite, so that a NaN from the sender does not count as "not given".
        let unless = |bit: u16, value: f32| match mask & (1 << bit) {
            0 if value.is_finite() => Ok(value),
            0 => Err(FrameFault::Implausible),
            _ => Ok(f32::NAN),
        };
        let mut read = PositionTarget { axes, ..PositionTarget::NONE };
        let targets = [&mut read.position_m, &mut read.velocity_m_s, &mut read.acceleration_m_s2];
        for ((target, bits), [x, y, z]) in targets.into_iter().zip(bits).zip(vectors) {
            let [at_x, at_y, at_z] = bits;
            *target = flip(Vector3::new(unless(at_x, x)?, unless(at_y, y)?, unless(at_z, z)?));
        }
        let [heading, rate] = yaw;
        (read.yaw_rad, read.yaw_rate_rad_s) = (-unless(10, heading)?, -unless(11, rate)?);
        let or_zero = |number: f32| if number.is_nan() { 0.0 } else { number };
        // Ignored numbers count as zero, so that only the others are checked.
        let whole = Setpoint {
            position_m: read.position_m.map(or_zero),
            velocity_m_s: read.velocity_m_s.map(or_zero),
            acceleration_m_s2: read.acceleration_m_s2.map(or_zero),
            yaw_rad: or_zero(read.yaw_rad),
            yaw_rate_rad_s: or_zero(read.yaw_rate_rad_s),
            ..Setpoint::default()
        };
        if whole.is_plausible() { Ok(read) } else { Err(FrameFault::Implausible) }
    }
}

/// Bit of the type mask: forces instead of accelerations.
const FORCE: u16 = 1 << 9;
/// All bits of the type mask that ignore a number.
const NOTHING: u16 = 0b1101_1111_1111;

/// A target of attitude and thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeAndThrust {
    /// Attitude as a quaternion w, x, y, z from body to earth, of any nonzero norm.
    pub attitude: [f32; 4],
    /// Yaw rate; NaN if not given \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Thrust, 0 to 1.
    pub thrust: f32,
}

/// MANUAL_CONTROL (69), -1 to 1. A throttle of 500 on the wire is 0, as ground stations send it. Positive yaw turns to
/// the right; this is what ground stations mean, although the specification says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ManualControl {
    /// Roll to the right.
    pub roll: f32,
    /// Pitch forward.
    pub pitch: f32,
    /// Throttle up.
    pub throttle: f32,
    /// Yaw clockwise, seen from above.
    pub yaw: f32,
}

/// A target from a companion computer, or a pilot's sticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExternalTarget {
    /// SET_POSITION_TARGET_LOCAL_NED (84) with ignored numbers, or in a frame other than MAV_FRAME_LOCAL_NED. A
    /// complete one in that frame is [`Uplink::Setpoint`](crate::Uplink::Setpoint).
    Motion(PositionTarget),
    /// SET_POSITION_TARGET_GLOBAL_INT (86): a position on the earth, each coordinate of which may be ignored.
    GlobalPosition(GlobalPosition, PositionTarget),
    /// SET_ATTITUDE_TARGET (82) with attitude and thrust. Body rates without an attitude are unsupported.
    Attitude(AttitudeAndThrust),
    /// MANUAL_CONTROL (69).
    Sticks(ManualControl),
    /// RC_CHANNELS_OVERRIDE (70).
    Channels(ChannelsOverride),
}

/// Fields: time, nine numbers, heading and yaw rate, type mask, receiver, frame.
type MotionFields = (u32, [[f32; 3]; 3], [f32; 2], u16, Address, u8);
const MOTION: MessageLayout<SET_POSITION_TARGET_LOCAL_NED_DATA, MotionFields> = MessageLayout::NEW;
type PlaceFields = (u32, [i32; 2], f32, [[f32; 3]; 2], [f32; 2], u16, Address, u8);
const PLACE: MessageLayout<SET_POSITION_TARGET_GLOBAL_INT_DATA, PlaceFields> = MessageLayout::NEW;
/// Fields: time, quaternion, rates, thrust, receiver, type mask, thrust in three dimensions.
type AttitudeFields = (u32, [f32; 4], [f32; 3], f32, Address, u8, [f32; 3]);
const ATTITUDE: MessageLayout<SET_ATTITUDE_TARGET_DATA, AttitudeFields> = MessageLayout::NEW;
/// Fields: x, y, z, r; buttons, receiver; further buttons and axes.
const STICKS: MessageLayout<MANUAL_CONTROL_DATA, ([i16; 4], u16, u8, u16, u8, [i16; 8])> = MessageLayout::NEW;
const TARGET: MessageLayout<POSITION_TARGET_LOCAL_NED_DATA, (u32, [[f32; 3]; 3], [f32; 2], u16, u8)> =
    MessageLayout::NEW;

/// Value of an axis of MANUAL_CONTROL that the sender does not have.
const NO_AXIS: i16 = i16::MAX;
/// MAV_FRAME_LOCAL_NED.
const LOCAL_NED: u8 = 1;

impl ExternalTarget {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            SET_POSITION_TARGET_LOCAL_NED_DATA::ID => MOTION.format(),
            SET_POSITION_TARGET_GLOBAL_INT_DATA::ID => PLACE.format(),
            SET_ATTITUDE_TARGET_DATA::ID => ATTITUDE.format(),
            MANUAL_CONTROL_DATA::ID => STICKS.format(),
            RC_CHANNELS_OVERRIDE_DATA::ID => ChannelsOverride::format(),
            _ => return None,
        })
    }

    /// Reads the message; `is_meant` tells whether a receiver is this vehicle.
    pub(crate) fn read(id: u32, payload: &[u8], is_meant: impl Fn(Address) -> bool) -> Result<Self, FrameFault> {
        let mine = |to| if is_meant(to) { Ok(()) } else { Err(FrameFault::Elsewhere) };
        match id {
            SET_POSITION_TARGET_LOCAL_NED_DATA::ID => {
                let (_, vectors, yaw, mask, to, frame) = MOTION.read(payload);
                mine(to)?;
                let axes = match frame {
                    LOCAL_NED => TargetFrame::Local,
                    7 => TargetFrame::Offset,
                    8 => TargetFrame::Body,
                    9 | 12 => TargetFrame::BodyOffset,
                    _ => return Err(FrameFault::Unsupported),
                };
                let motion = PositionTarget::read(axes, vectors, yaw, mask)?;
                // A position in the local frame and motion along the vehicle's axes cannot be combined.
                let moves = motion.velocity_m_s.iter().chain(&motion.acceleration_m_s2).any(|it| it.is_finite());
                if axes == TargetFrame::Body && moves && motion.position_m.iter().any(|it| it.is_finite()) {
                    return Err(FrameFault::Unsupported);
                }
                Ok(ExternalTarget::Motion(motion))
            }
            SET_POSITION_TARGET_GLOBAL_INT_DATA::ID => {
                let (_, [latitude, longitude], altitude_m, [velocity, acceleration], yaw, mask, to, frame) =
                    PLACE.read(payload);
                mine(to)?;
                let above = datum(frame).ok_or(FrameFault::Unsupported)?;
                // The position is passed as zeros here and checked below.
                let motion = PositionTarget::read(TargetFrame::Local, [[0.0; 3], velocity, acceleration], yaw, mask)?;
                let unless =
                    |bit: u16, value: i32| if mask & (1 << bit) == 0 { value } else { GlobalPosition::AS_IT_IS };
                let metres = if mask & 4 == 0 { altitude_m } else { f32::NAN };
                let height = Height { metres, above };
                let place =
                    GlobalPosition { latitude_e7: unless(0, latitude), longitude_e7: unless(1, longitude), height };
                let is_whole = mask & 4 != 0 || altitude_m.is_finite();
                let motion = PositionTarget { position_m: PositionTarget::NONE.position_m, ..motion };
                if is_whole && place.is_plausible() {
                    Ok(ExternalTarget::GlobalPosition(place, motion))
                } else {
                    Err(FrameFault::Implausible)
                }
            }
            SET_ATTITUDE_TARGET_DATA::ID => {
                let (_, attitude, [_, _, yaw_rate], thrust, to, mask, _) = ATTITUDE.read(payload);
                mine(to)?;
                // Refuses ignored thrust or attitude, and thrust in three dimensions.
                if mask & 0b1110_0000 != 0 {
                    return Err(FrameFault::Unsupported);
                }
                let yaw_rate_rad_s = if mask & 4 == 0 { -yaw_rate } else { f32::NAN };
                let norm = attitude.iter().map(|number| number * number).sum::<f32>();
                let is_rate = mask & 4 != 0 || yaw_rate.abs() <= 1e3;
                if !(is_rate && (0.25..=4.0).contains(&norm) && (0.0..=1.0).contains(&thrust)) {
                    return Err(FrameFault::Implausible);
                }
                let attitude = flip_turn(attitude);
                Ok(ExternalTarget::Attitude(AttitudeAndThrust { attitude, yaw_rate_rad_s, thrust }))
            }
            MANUAL_CONTROL_DATA::ID => {
                let (axes, _, system, ..) = STICKS.read(payload);
                mine(Address { system, component: 0 })?;
                if axes.contains(&NO_AXIS) {
                    return Err(FrameFault::Unsupported);
                }
                let [pitch, roll, up, yaw] = axes.map(|axis| (f32::from(axis) / 1000.0).clamp(-1.0, 1.0));
                // Below 0 would be thrust in the opposite direction, which no vehicle here has.
                Ok(ExternalTarget::Sticks(ManualControl { roll, pitch, throttle: 2.0 * up.max(0.0) - 1.0, yaw }))
            }
            RC_CHANNELS_OVERRIDE_DATA::ID => {
                let (channels, to) = ChannelsOverride::read(payload);
                mine(to)?;
                Ok(ExternalTarget::Channels(channels))
            }
            _ => Err(FrameFault::Unknown),
        }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let to = Address::default();
        match self {
            ExternalTarget::Motion(motion) => write_motion(motion, payload),
            ExternalTarget::GlobalPosition(place, motion) => {
                let ([_, velocity, acceleration], yaw, mask) = motion.fields();
                let given = |value: i32| if value == GlobalPosition::AS_IT_IS { 0 } else { value };
                let height_m = place.height.metres;
                let ignored = u16::from(place.latitude_e7 == GlobalPosition::AS_IT_IS)
                    | u16::from(place.longitude_e7 == GlobalPosition::AS_IT_IS) << 1
                    | u16::from(height_m.is_nan()) << 2;
                let vectors = [velocity.into(), acceleration.into()];
                let xy = [given(place.latitude_e7), given(place.longitude_e7)];
                let z = if height_m.is_nan() { 0.0 } else { height_m };
                PLACE.write(&(0, xy, z, vectors, yaw, mask & !7 | ignored, to, frame(place.height.above)), payload)
            }
            ExternalTarget::Attitude(AttitudeAndThrust { attitude, yaw_rate_rad_s, thrust }) => {
                let (rate, mask) = if yaw_rate_rad_s.is_nan() { (0.0, 7) } else { (-yaw_rate_rad_s, 3) };
                let rates = [0.0, 0.0, rate];
                ATTITUDE.write(&(0, flip_turn(*attitude), rates, *thrust, to, mask, [0.0; 3]), payload)
            }
            ExternalTarget::Channels(channels) => channels.write(payload),
            ExternalTarget::Sticks(ManualControl { roll, pitch, throttle, yaw }) => {
                let up = (throttle + 1.0) / 2.0;
                // Rounds to the nearest integer, without the platform's rounding function.
                let axis = |value: f32| (value * 1000.0 + if value < 0.0 { -0.5 } else { 0.5 }) as i16;
                STICKS.write(&([*pitch, *roll, up, *yaw].map(axis), 0, 0, 0, 0, [0; 8]), payload)
            }
        }
    }
}

/// Writes SET_POSITION_TARGET_LOCAL_NED.
pub(crate) fn write_motion(motion: &PositionTarget, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    let (vectors, yaw, mask) = motion.fields();
    let frame = match motion.axes {
        TargetFrame::Local => LOCAL_NED,
        TargetFrame::Offset => 7,
        TargetFrame::Body => 8,
        TargetFrame::BodyOffset => 9,
    };
    MOTION.write(&(0, vectors.map(Into::into), yaw, mask, Address::default(), frame), payload)
}

/// Returns the format of POSITION_TARGET_LOCAL_NED (85), which reports the target that the vehicle follows.
pub(crate) fn followed_format() -> MessageFormat {
    TARGET.format()
}

pub(crate) fn read_followed(payload: &[u8]) -> Result<(u32, PositionTarget), FrameFault> {
    let (time_ms, vectors, yaw, mask, frame) = TARGET.read(payload);
    if frame != LOCAL_NED {
        return Err(FrameFault::Unsupported);
    }
    Ok((time_ms, PositionTarget::read(TargetFrame::Local, vectors, yaw, mask)?))
}

pub(crate) fn write_followed(time_ms: u32, motion: &PositionTarget, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    let (vectors, yaw, mask) = motion.fields();
    TARGET.write(&(time_ms, vectors.map(Into::into), yaw, mask, LOCAL_NED), payload)
}
