//! Connects a web page to the server's first vehicle: shows its state and carries out the page's commands.

use crate::command::{ServerCommand, parse};
use crate::page::command::PageCommand;
use crate::page::description::VehicleDescription;
use crate::page::frame::{PageFrame, PageText};
use crate::page::local_frame::LocalFrame;
use crate::page::plan::{fence_areas, fence_items, mission_items, mission_points};
use crate::page::station::PageStation;
use crate::page::views;
use crate::{Server, ServerAction, TimeFlow, TimeRate};
use afbc_comms::services::modes::custom;
use afbc_flight_core::Mode;
use afbc_guidance::FlightMode;
use afbc_mavlink::{Datum, GlobalPosition, Height, MavSeverity, MissionType, VehicleCommand};
use nalgebra::{Vector2, Vector3};
use serde_json::json;
use std::collections::VecDeque;

/// Time for which a text is sent again with every frame, as frames may be lost \[s\], and most texts per frame.
const TEXTS_S: f64 = 3.0;
const TEXTS_MAX: usize = 40;
/// Largest number of places in a plan.
const PLACES_MAX: usize = 50;
/// Largest coordinate of a place, relative to the origin \[m\].
const FAR_M: f32 = 10_000.0;

/// Shows the first vehicle of a server to a web page, and carries out the page's commands.
pub struct PageBackend {
    station: PageStation,
    frame: LocalFrame,
    texts: VecDeque<PageText>,
    next: u32,
}

/// Answer to a command of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PageReply {
    /// Messages to the page that sent the command, as JSON.
    pub messages: Vec<String>,
    /// Action that the server's caller must carry out.
    pub action: ServerAction,
}

impl Default for PageBackend {
    fn default() -> Self {
        Self::new()
    }
}

impl PageBackend {
    /// Creates a backend; call this before the server's first step.
    pub fn new() -> Self {
        PageBackend { station: PageStation::new(), frame: LocalFrame::default(), texts: VecDeque::new(), next: 0 }
    }

    /// Returns what does not change, as JSON; `None` without a vehicle.
    pub fn description(&self, server: &Server) -> Option<String> {
        let description = VehicleDescription::new(server.vehicles().first()?);
        serde_json::to_string(&description).ok()
    }

    /// Returns the values of all parameters, as JSON.
    pub fn values(&self, server: &Server) -> Option<String> {
        let values = server.vehicles().first()?.host().parameter_values();
        let values: serde_json::Map<_, _> =
            values.into_iter().map(|(name, value)| (name.to_string(), json!(short(value)))).collect();
        Some(json!({ "kind": "values", "values": values }).to_string())
    }

    /// Takes the bytes that the vehicle with this index sent in a step.
    pub fn sent(&mut self, vehicle: usize, bytes: &[u8]) {
        self.station.hear(vehicle, bytes);
    }

    /// Updates the state after a step.
    pub fn update(&mut self, server: &mut Server) {
        let mut said = Vec::new();
        self.station.update(server, &mut |severity, text| said.push((severity, text)));
        said.into_iter().for_each(|(severity, text)| self.say(server.now_s(), severity, text));
        if let Some(vehicle) = server.vehicles().first() {
            self.frame.update(vehicle);
        }
    }

    /// Queues a text for the page.
    pub fn say(&mut self, time_s: f64, severity: MavSeverity, text: String) {
        self.texts.push_back(PageText { number: self.next, time_s, severity: severity as u8, text });
        self.next = self.next.wrapping_add(1);
        if self.texts.len() > TEXTS_MAX {
            self.texts.pop_front();
        }
    }

    /// Returns the current state as JSON; `None` without a vehicle.
    pub fn frame(&mut self, server: &Server, flow: TimeFlow) -> Option<String> {
        let vehicle = server.vehicles().first()?;
        let now_s = server.now_s();
        self.texts.retain(|text| text.time_s >= now_s - TEXTS_S);
        let (report, frame) = (vehicle.report(), &self.frame);
        let (wind_m_s, battery) = views::air_and_battery(vehicle);
        let guided = report.map(|report| report.guided);
        let shown = PageFrame {
            kind: "frame",
            time_s: now_s,
            speed: match flow.rate {
                TimeRate::Times(speed) => Some(speed),
                TimeRate::Lockstep => None,
            },
            paused: flow.paused,
            armed: report.is_some_and(|report| report.mode.armed()),
            airborne: guided.is_some_and(|guided| guided.airborne),
            core: report.map_or("disarmed", |report| core_name(report.mode)),
            mode: guided.map_or("", |guided| guided.mode.name()),
            failsafe: guided.is_some_and(|guided| guided.failsafe.is_some()),
            law: vehicle.law().name(),
            fallback: report.and_then(|report| report.health.control.fallback),
            truth: views::truth(&vehicle.world().plant().motion()),
            reference: views::reference(vehicle, frame),
            estimate: views::estimate(vehicle, frame),
            rotors: views::rotors(vehicle),
            wind_m_s,
            battery,
            payload_kg: views::payload_kg(vehicle),
            adaptation: views::adaptation(vehicle),
            home_m: guided.and_then(|guided| guided.home_m).map(|home_m| frame.earth(&home_m).into()),
            mission: mission_points(vehicle, frame),
            item: guided.map_or(0, |guided| guided.wanted),
            fence: fence_areas(vehicle, frame),
            faults: vehicle.faults(),
            texts: self.texts.iter().cloned().collect(),
            parameter_changes: self.station.parameter_changes(),
        };
        serde_json::to_string(&shown).ok()
    }

    /// Carries out a command of the page, given as JSON; returns the answer.
    pub fn command(&mut self, server: &mut Server, json: &str) -> PageReply {
        match serde_json::from_str(json) {
            Ok(command) => self.carry_out(server, command),
            Err(error) => PageReply::refused(&format!("no such command ({error})")),
        }
    }

    fn carry_out(&mut self, server: &mut Server, command: PageCommand) -> PageReply {
        let station = &mut self.station;
        match command {
            PageCommand::Values {} => {
                return PageReply {
                    messages: self.values(server).into_iter().collect(),
                    action: ServerAction::Nothing,
                };
            }
            PageCommand::Line { text } => return line(server, &text),
            PageCommand::Arm {} => station.command(server, VehicleCommand::Arm),
            PageCommand::Disarm {} => station.command(server, VehicleCommand::Disarm),
            PageCommand::Kill {} => station.command(server, VehicleCommand::Kill),
            PageCommand::Engage {} => station.command(server, VehicleCommand::Engage),
            PageCommand::Land {} => station.command(server, VehicleCommand::Land),
            PageCommand::Return {} => station.command(server, VehicleCommand::Return),
            PageCommand::Hold {} => station.command(server, VehicleCommand::SelectMode(custom(FlightMode::Hold))),
            PageCommand::StartMission {} => station.command_armed(server, VehicleCommand::StartMission(0, None)),
            PageCommand::TakeOff { height_m } => {
                if !(0.3..=500.0).contains(&height_m) {
                    return PageReply::refused("the height must be 0.3 to 500 m");
                }
                let height = Height { metres: height_m, above: Datum::Here };
                station.command_armed(server, VehicleCommand::TakeOff(height));
            }
            PageCommand::GoTo { position_m } => return self.go_to(server, Vector3::from(position_m)),
            PageCommand::Plan { waypoints_m, fence_m } => return self.plan(server, &waypoints_m, &fence_m),
            PageCommand::Parameter { name, value } => {
                if name.len() > 16 || !value.is_finite() {
                    return PageReply::refused("a parameter needs a name and a number");
                }
                station.set(server, &name, value);
            }
        }
        PageReply::default()
    }

    fn go_to(&mut self, server: &mut Server, place_m: Vector3<f32>) -> PageReply {
        if !place_m.iter().all(|number| number.abs() <= FAR_M) {
            return PageReply::refused("the place is more than 10 km from the origin; choose a nearer one");
        }
        let local_m = self.frame.local(&place_m);
        let origin = server.vehicles().first().and_then(|vehicle| vehicle.origin());
        // DO_REPOSITION needs a place on the earth. Without one, targets in the local frame lead the vehicle.
        let Some(origin) = origin else {
            self.station.fly_to(server, local_m, VehicleCommand::SelectMode(custom(FlightMode::Offboard)));
            return PageReply::default();
        };
        let there = origin.global(&local_m);
        let [latitude_e7, longitude_e7] = there.e7();
        let height = Height { metres: there.altitude_m as f32, above: Datum::Sea };
        let place = GlobalPosition { latitude_e7, longitude_e7, height };
        let go = VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true };
        self.station.command(server, go);
        PageReply::default()
    }

    fn plan(&mut self, server: &mut Server, waypoints_m: &[[f32; 3]], fence_m: &[[f32; 2]]) -> PageReply {
        let is_near = |number: &f32| number.abs() <= FAR_M;
        let known = waypoints_m.iter().flatten().all(is_near) && fence_m.iter().flatten().all(is_near);
        if !known || waypoints_m.len().max(fence_m.len()) > PLACES_MAX {
            return PageReply::refused("a plan has at most 50 places, each within 10 km of the origin");
        }
        let local = |place_m: &[f32; 3]| self.frame.local(&Vector3::from(*place_m));
        let places_m: Vec<_> = waypoints_m.iter().map(local).collect();
        let corner = |corner_m: &[f32; 2]| self.frame.local(&Vector2::from(*corner_m).push(0.0)).xy();
        let corners_m: Vec<_> = fence_m.iter().map(corner).collect();
        let origin = server.vehicles().first().and_then(|vehicle| vehicle.origin());
        let fence = match origin {
            Some(origin) => fence_items(&corners_m, &origin),
            None if corners_m.is_empty() => Vec::new(),
            None => return PageReply::refused("a geofence needs a GNSS receiver; serve an outdoor scenario"),
        };
        // The fence comes first: the vehicle checks the mission against it.
        let mut plans = vec![(MissionType::FENCE, fence), (MissionType::MISSION, mission_items(&places_m))];
        plans.retain(|(plan, _)| origin.is_some() || *plan == MissionType::MISSION);
        self.station.upload(server, plans);
        PageReply::default()
    }
}

/// Carries out a line of the text protocol.
fn line(server: &mut Server, text: &str) -> PageReply {
    if let Ok(Some(line)) = parse(text)
        && matches!(line.command, ServerCommand::Quit | ServerCommand::Step(_))
    {
        return PageReply::refused("quit and step cannot be used from a page");
    }
    let reply = server.line(text);
    let messages = reply.lines.iter().map(|line| json!({ "kind": "reply", "text": line }).to_string());
    PageReply { messages: messages.collect(), action: reply.action }
}

impl PageReply {
    fn refused(problem: &str) -> Self {
        let text = format!("error {problem}");
        PageReply {
            messages: vec![json!({ "kind": "reply", "text": text }).to_string()],
            action: ServerAction::Nothing,
        }
    }
}

/// Returns the shortest decimal number that reads back as the same `f32`.
fn short(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(value.into())
}

fn core_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Disarmed => "disarmed",
        Mode::Flying => "flying",
        Mode::Coasting => "coasting",
        Mode::Descending => "descending",
        _ => "in another mode",
    }
}
