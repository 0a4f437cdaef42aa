//! Flights of the server's vehicle with a story each: messages sent and received and the true motion, tick by tick.

use super::document::Case;
use crate::airborne::session::{is_armed, item};
use crate::airborne::{STATION, Session, Tick, velocity};
use afbc_comms::services::modes;
use afbc_guidance::FlightMode;
use afbc_mavlink::{ExternalTarget, ManualControl, Uplink, VehicleCommand};
use afbc_scenario::Scenario;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

/// Event in a flight after take-off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Story {
    /// Flies a mission, returns and lands.
    Journey,
    /// Stays on the ground after arming.
    Ground,
    /// Flies through the geofence: outwards, or upwards for `Ceiling`.
    Fence,
    Ceiling,
    /// Loses the station; the other two lose the targets of offboard mode, or the sticks.
    Silence,
    Targets,
    Sticks,
    /// Loses the barometer.
    Sensors,
    /// Empties the battery.
    Battery,
}

/// Times of the first and the last attempt to arm \[ms\]. `BEGINS_MS` is the time of the first event.
const ARMS_MS: [u32; 2] = [4_000, 10_000];
const BEGINS_MS: u32 = 10_000;

enum Act {
    Say(VehicleCommand),
    Stream(Option<Uplink>),
    Line(&'static str),
    Mission,
    Silent,
}

fn select(mode: FlightMode) -> Act {
    Act::Say(VehicleCommand::SelectMode(modes::custom(mode)))
}

impl Story {
    /// Returns the flight that shows the effect of a key.
    pub(crate) fn of(case: &Case) -> Self {
        match case.key.as_str() {
            "fence_radius_m" | "fence_action" => Story::Fence,
            "fence_height_m" => Story::Ceiling,
            "station_lost_s" | "station_action" => Story::Silence,
            "targets_action" | "targets_lost_s" => Story::Targets,
            "sticks_action" | "sticks_lost_s" | "stick_tilt_rad" => Story::Sticks,
            "sensors_action" => Story::Sensors,
            "cells" | "empty_v" | "full_v" | "resistance_ohm" | "low" | "critical" | "emergency" | "battery_action"
                if case.header == "guidance" =>
            {
                Story::Battery
            }
            "disarm_before_s" => Story::Ground,
            key if ["baro_", "declination_", "field_", "gnss_", "heading_", "inclination_", "mag_"]
                .iter()
                .any(|start| case.header == "estimator" && key.starts_with(start)) =>
            {
                Story::Sensors
            }
            _ => Story::Journey,
        }
    }

    /// Returns the scenario to fly: outdoors if the story needs a barometer.
    pub(crate) fn scenario(self) -> &'static str {
        if self == Story::Sensors { "outdoor" } else { "mocap" }
    }

    /// Returns the events with their times since the first event \[ms\], and the duration of the story.
    fn acts(self) -> (Vec<(u32, Act)>, u32) {
        let (offboard, hold) = (|| select(FlightMode::Offboard), 5_000);
        let mut acts = vec![(0, select(FlightMode::Takeoff))];
        let then: (Vec<(u32, Act)>, u32) = match self {
            Story::Ground => return (Vec::new(), 5_000),
            Story::Journey => (vec![(0, Act::Mission), (8_000, Act::Say(VehicleCommand::Return))], 34_000),
            Story::Fence => (vec![(0, Act::Stream(Some(velocity(5.0, 0.0, 0.0)))), (200, offboard())], 7_000),
            Story::Ceiling => (vec![(0, Act::Stream(Some(velocity(0.0, 0.0, 3.0)))), (200, offboard())], 7_000),
            Story::Silence => (vec![(0, Act::Silent)], 6_000),
            Story::Targets => {
                let streams = [(0, Act::Stream(Some(velocity(2.0, 0.0, 0.0)))), (200, offboard())];
                (streams.into_iter().chain([(2_000, Act::Stream(None))]).collect(), 5_000)
            }
            Story::Sticks => {
                let sticks = ManualControl { roll: 0.3, pitch: 1.0, throttle: 0.0, yaw: 0.0 };
                let sticks = Uplink::Target(ExternalTarget::Sticks(sticks));
                let streams = [(0, Act::Stream(Some(sticks))), (200, select(FlightMode::Altitude))];
                (streams.into_iter().chain([(1_500, Act::Stream(None))]).collect(), 5_000)
            }
            Story::Sensors => (vec![(0, Act::Line("fault barometer lost"))], 5_000),
            Story::Battery => {
                let lines = ["battery 0.12", "battery 0.06", "battery 0.02"].map(Act::Line);
                ((0..).step_by(4_000).zip(lines).collect(), 15_000)
            }
        };
        acts.extend(then.0.into_iter().map(|(at_ms, act)| (hold + at_ms, act)));
        (acts, hold + then.1)
    }

    /// Flies the scenario. Calls `see` with a hash of each tick until it returns false.
    fn fly(self, scenario: &Scenario, mut see: impl FnMut(u64) -> bool) {
        let mut session = Session::of(scenario);
        let (acts, lasts_ms) = self.acts();
        let (mut acts, mut armed) = (acts.into_iter().peekable(), false);
        for time_ms in 0..BEGINS_MS + lasts_ms {
            let arms = (ARMS_MS[0]..ARMS_MS[1]).contains(&time_ms) && time_ms.is_multiple_of(250);
            if arms && !armed {
                session.say(STATION, Uplink::Command(VehicleCommand::Arm));
            }
            while let Some((_, act)) = acts.next_if(|(at_ms, _)| BEGINS_MS + at_ms <= time_ms) {
                match act {
                    Act::Say(command) => session.say(STATION, Uplink::Command(command)),
                    Act::Stream(target) => session.stream(STATION, target),
                    Act::Line(line) => session.line(line),
                    Act::Silent => session.reach(STATION, false),
                    Act::Mission => {
                        let places = [[6.0, 0.0, 3.0], [6.0, 4.0, 4.0]];
                        let items = (0..).zip(places).map(|(number, at)| item(number, 16, at)).collect();
                        session.upload(STATION, items);
                    }
                }
            }
            if self == Story::Journey && time_ms == BEGINS_MS + 6_000 {
                session.say(STATION, Uplink::Command(VehicleCommand::StartMission(0, None)));
            }
            let tick = session.step();
            armed = is_armed(&tick).unwrap_or(armed);
            if !see(hash(&tick)) {
                return;
            }
        }
    }

    /// Returns the hashes of a whole flight.
    pub(crate) fn trace(self, scenario: &Scenario) -> Vec<u64> {
        let mut trace = Vec::new();
        self.fly(scenario, |hash| {
            trace.push(hash);
            true
        });
        trace
    }

    /// True if a flight differs from the flight with this trace.
    pub(crate) fn differs(self, scenario: &Scenario, trace: &[u64]) -> bool {
        let mut trace = trace.iter();
        let mut differs = false;
        self.fly(scenario, |hash| {
            differs = trace.next() != Some(&hash);
            !differs
        });
        differs
    }
}

fn hash(tick: &Tick) -> u64 {
    let mut hasher = DefaultHasher::new();
    let truth = &tick.truth;
    let numbers = truth.position_m.iter().chain(&truth.velocity_m_s).chain([&truth.tilt_rad, &truth.rotor_rad_s]);
    numbers.for_each(|number| number.to_bits().hash(&mut hasher));
    format!("{:?}", tick.heard).hash(&mut hasher);
    hasher.finish()
}
