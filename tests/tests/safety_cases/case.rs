//! A case of the safety tests: events and the expected result.

use crate::airborne::STATION;
use crate::airborne::checker::{Bounds, End};
use crate::airborne::session::{global, item};
use afbc_comms::services::modes;
use afbc_guidance::FlightMode;
use afbc_mavlink::{
    Address, AttitudeAndThrust, Datum, ExternalTarget, Height, ManualControl, MissionItem, Uplink, VehicleCommand,
};

/// An event.
#[derive(Clone, Debug)]
pub(crate) enum Do {
    Say(Address, Uplink),
    /// Changes weather or causes a fault, by a line of the server's protocol.
    Line(&'static str),
    Silent(Address),
    Back(Address),
    /// The station sends this target repeatedly, or stops doing so.
    Stream(Option<Uplink>),
    /// One in this number of the station's frames is broken.
    Breaks(u32),
    Upload(Vec<MissionItem>),
    /// This number of bytes arrives that belong to no frame.
    Noise(usize),
}

/// Start of a case.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Start {
    /// Disarmed, 12 s after power-up.
    PowerUp,
    /// The vehicle has just been armed.
    Ground,
    /// The vehicle holds at this height \[m\].
    Air(f32),
}

/// One or several faults, and the expected result.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) what: &'static str,
    pub(crate) indoors: bool,
    pub(crate) set: Vec<(&'static str, f32)>,
    pub(crate) start: Start,
    /// Events at power-up.
    pub(crate) before: Vec<Do>,
    /// Events by the time since the case began \[s\].
    pub(crate) steps: Vec<(f64, Do)>,
    pub(crate) lasts_s: f64,
    /// Texts that must be heard in this order. `never` lists texts that must not be heard.
    pub(crate) heard: Vec<&'static str>,
    pub(crate) never: Vec<&'static str>,
    pub(crate) bounds: Bounds,
    pub(crate) end: End,
    /// Position at the end, and the largest distance from it \[m\].
    pub(crate) near: Option<([f64; 2], f64)>,
}

/// Returns a case that begins and ends in hold, 3 m above the ground, indoors. All else must be added.
pub(crate) fn case(name: &'static str, what: &'static str) -> Case {
    let bounds = Bounds { height_m: 6.0, radius_m: 25.0, ..Bounds::DEFAULT };
    Case {
        name,
        what,
        indoors: true,
        set: Vec::new(),
        start: Start::Air(3.0),
        before: Vec::new(),
        steps: Vec::new(),
        lasts_s: 6.0,
        heard: Vec::new(),
        never: Vec::new(),
        bounds,
        end: End::Holds,
        near: None,
    }
}

impl Case {
    pub(crate) fn outdoors(self) -> Self {
        // The bounds are wider by the receiver's error.
        let bounds = Bounds { radius_m: 30.0, height_m: self.bounds.height_m + 4.0, ..self.bounds };
        Case { indoors: false, bounds, ..self }
    }

    pub(crate) fn on(self, start: Start) -> Self {
        Case { start, ..self }
    }

    pub(crate) fn set(mut self, name: &'static str, value: f32) -> Self {
        self.set.push((name, value));
        self
    }

    pub(crate) fn before(mut self, it: Do) -> Self {
        self.before.push(it);
        self
    }

    pub(crate) fn at(mut self, at_s: f64, it: Do) -> Self {
        self.steps.push((at_s, it));
        self
    }

    pub(crate) fn lasts(self, lasts_s: f64) -> Self {
        Case { lasts_s, ..self }
    }

    pub(crate) fn hears(mut self, texts: &[&'static str]) -> Self {
        self.heard.extend(texts);
        self
    }

    pub(crate) fn never(mut self, texts: &[&'static str]) -> Self {
        self.never.extend(texts);
        self
    }

    pub(crate) fn bound(mut self, change: fn(&mut Bounds)) -> Self {
        change(&mut self.bounds);
        self
    }

    /// Expects the vehicle to end disarmed on the ground.
    pub(crate) fn lands(self) -> Self {
        Case { end: End::Disarmed, ..self }
    }

    pub(crate) fn flies(self) -> Self {
        Case { end: End::Flies, ..self }
    }

    pub(crate) fn near(self, x: f64, y: f64, within_m: f64) -> Self {
        Case { near: Some(([x, y], within_m)), ..self }
    }

    /// Expects the flight core to stop the motors in the air, with this announcement.
    pub(crate) fn falls(self, text: &'static str) -> Self {
        let bounds = Bounds { cut: true, tilt_rad: 4.0, speed_m_s: 20.0, touch_m_s: 12.0, ..self.bounds };
        Case { bounds, end: End::Disarmed, ..self }.hears(&[text])
    }

    /// Follows a stream of targets from 0.1 s on.
    pub(crate) fn offboard(self, target: Uplink) -> Self {
        self.at(0.0, Do::Stream(Some(target))).at(0.2, say(select(FlightMode::Offboard)))
    }

    /// Flies a mission from the beginning of the case.
    pub(crate) fn mission(self, places: &[[f32; 3]]) -> Self {
        let items = (0..).zip(places).map(|(number, at)| item(number, WAYPOINT, *at)).collect();
        self.before(Do::Upload(items)).at(0.1, say(VehicleCommand::StartMission(0, None)))
    }

    /// Watches the battery, whose cells are known.
    pub(crate) fn watched(self) -> Self {
        let cells = [("BAT1_N_CELLS", 3.0), ("BAT1_V_EMPTY", 3.3), ("BAT1_V_CHARGED", 4.2), ("BAT1_R_INTERNAL", 0.02)];
        let charges = [("BAT_CRIT_THR", 0.1), ("BAT_EMERGEN_THR", 0.03)];
        cells.into_iter().chain(charges).fold(self, |case, (name, value)| case.set(name, value))
    }

    /// Adds a geofence with a radius of 10 m and a height of 8 m.
    pub(crate) fn fenced(self, action: f32) -> Self {
        self.set("GF_MAX_HOR_DIST", 10.0).set("GF_MAX_VER_DIST", 8.0).set("GF_ACTION", action)
    }
}

pub(crate) const WAYPOINT: u16 = 16;
pub(crate) const TAKE_OFF: u16 = 22;

pub(crate) fn say(command: VehicleCommand) -> Do {
    Do::Say(STATION, Uplink::Command(command))
}

pub(crate) fn select(mode: FlightMode) -> VehicleCommand {
    VehicleCommand::SelectMode(modes::custom(mode))
}

pub(crate) fn take_off(metres: f32) -> VehicleCommand {
    VehicleCommand::TakeOff(Height { metres, above: Datum::Here })
}

pub(crate) fn go_to(x: f32, y: f32, z: f32) -> VehicleCommand {
    VehicleCommand::Reposition { place: global(x, y, z), yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true }
}

/// Returns a target that tilts towards the north and climbs a little.
pub(crate) fn leaning() -> Uplink {
    let q = nalgebra::UnitQuaternion::from_euler_angles(0.0_f32, 0.15, 0.0);
    let attitude = [q.w, q.i, q.j, q.k];
    Uplink::Target(ExternalTarget::Attitude(AttitudeAndThrust { attitude, yaw_rate_rad_s: 0.0, thrust: 0.41 }))
}

pub(crate) fn sticks(pitch: f32, throttle: f32) -> Uplink {
    Uplink::Target(ExternalTarget::Sticks(ManualControl { roll: 0.0, pitch, throttle, yaw: 0.0 }))
}

pub(crate) const AWAY: [[f32; 3]; 2] = [[9.0, 0.0, 3.0], [9.0, 9.0, 3.0]];
pub(crate) const DESCENDS: &str = "no state for 0.25 s: descending";
