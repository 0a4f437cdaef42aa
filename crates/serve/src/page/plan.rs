//! Mission and geofence, as MAVLink items and as a web page draws them.

use crate::ServedVehicle;
use crate::page::local_frame::LocalFrame;
use afbc_comms::services::mission::to_guidance;
use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_guidance::Item;
use afbc_mavlink::{MavCmd, MissionItem};
use nalgebra::{Vector2, Vector3};
use serde::Serialize;

/// MAVLink frames MAV_FRAME_LOCAL_NED and MAV_FRAME_GLOBAL.
const LOCAL_NED: u8 = 1;
const GLOBAL: u8 = 0;
const TAKE_OFF: u16 = MavCmd::MAV_CMD_NAV_TAKEOFF as u16;
const WAYPOINT: u16 = MavCmd::MAV_CMD_NAV_WAYPOINT as u16;
const RETURN: u16 = MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH as u16;
/// Corners of inclusion and exclusion polygons, and inclusion circles.
const INSIDE: u16 = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION as u16;
const OUTSIDE: u16 = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION as u16;
const CIRCLE_INSIDE: u16 = MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION as u16;

/// A place on the mission.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MissionPoint {
    /// Number of the mission item.
    pub number: u16,
    /// Position of the place, earth frame \[m\].
    pub position_m: [f32; 3],
}

/// An area of the geofence.
#[derive(Clone, Debug, Serialize)]
pub struct FenceArea {
    /// Corners of a polygon, or the centre of a circle, earth frame \[m\].
    pub corners_m: Vec<[f32; 2]>,
    /// Radius of a circle \[m\]; `None` for a polygon.
    pub radius_m: Option<f32>,
    /// True for an inclusion area, false for an exclusion area.
    pub inside: bool,
}

/// Returns the items of a mission through these places of the local frame: take-off, waypoints, return.
pub(crate) fn mission_items(places_m: &[Vector3<f32>]) -> Vec<MissionItem> {
    let Some(first) = places_m.first() else { return Vec::new() };
    let at = |command: u16, place_m: &Vector3<f32>| MissionItem {
        command,
        frame: LOCAL_NED,
        goes_on: true,
        // Any heading is fine.
        parameters: [0.0, 0.0, 0.0, f32::NAN],
        x: (place_m.x * 1e4) as i32,
        // Positions here are north, west, up; the MAVLink frame is north, east, down.
        y: (place_m.y * -1e4) as i32,
        z: -place_m.z,
        ..MissionItem::default()
    };
    let mut items = vec![at(TAKE_OFF, first)];
    items.extend(places_m.iter().map(|place_m| at(WAYPOINT, place_m)));
    items.push(MissionItem { command: RETURN, goes_on: true, ..MissionItem::default() });
    (0..).zip(&mut items).for_each(|(number, item)| item.number = number);
    items
}

/// Returns the items of an inclusion polygon with these corners in the local frame.
pub(crate) fn fence_items(corners_m: &[Vector2<f32>], origin: &EarthOrigin) -> Vec<MissionItem> {
    let item = |(number, corner_m): (u16, &Vector2<f32>)| {
        let [latitude, longitude] = origin.global(&corner_m.push(0.0)).e7();
        let parameters = [corners_m.len() as f32, 0.0, 0.0, 0.0];
        let (x, y) = (latitude, longitude);
        MissionItem { number, command: INSIDE, frame: GLOBAL, parameters, x, y, ..MissionItem::default() }
    };
    (0..).zip(corners_m).map(item).collect()
}

/// Returns the places of a vehicle's mission, in order.
pub(crate) fn mission_points(vehicle: &ServedVehicle, frame: &LocalFrame) -> Vec<MissionPoint> {
    let [items, _] = vehicle.host().plan();
    let home_m = vehicle.report().and_then(|report| report.guided.home_m).unwrap_or_default();
    let place = |item: &MissionItem| {
        let position_m = match to_guidance(item, vehicle.origin().as_ref(), home_m.z)? {
            Item::TakeOff { height_m } => Vector3::new(home_m.x, home_m.y, height_m),
            Item::TakeOffTo { position_m } | Item::Waypoint { position_m, .. } | Item::Land { position_m } => {
                position_m
            }
            Item::Turns { centre_m, .. } => centre_m,
            Item::Return => home_m,
            _ => return None,
        };
        let position_m = frame.earth(&position_m);
        let known = position_m.iter().all(|number| number.is_finite());
        known.then(|| MissionPoint { number: item.number, position_m: position_m.into() })
    };
    items.iter().filter_map(place).collect()
}

/// Returns the areas of a vehicle's geofence.
pub(crate) fn fence_areas(vehicle: &ServedVehicle, frame: &LocalFrame) -> Vec<FenceArea> {
    let [_, items] = vehicle.host().plan();
    let Some(origin) = vehicle.origin() else { return Vec::new() };
    let corner = |item: &MissionItem| {
        let [latitude_deg, longitude_deg] = [item.x, item.y].map(|e7| f64::from(e7) * 1e-7);
        let place_m = frame.earth(&origin.local(&Global { latitude_deg, longitude_deg, ..origin.at() }));
        [place_m.x, place_m.y]
    };
    let (mut areas, mut rest) = (Vec::new(), items);
    while let Some(item) = rest.first() {
        let [first, ..] = item.parameters;
        let is_polygon = [INSIDE, OUTSIDE].contains(&item.command);
        // At least one item, so that the loop ends, and no more than are left, whatever the item says.
        let count = if is_polygon { (first as usize).clamp(1, rest.len()) } else { 1 };
        let (area, others) = rest.split_at(count);
        areas.push(FenceArea {
            corners_m: area.iter().map(corner).collect(),
            radius_m: (!is_polygon).then_some(first),
            inside: [INSIDE, CIRCLE_INSIDE].contains(&item.command),
        });
        rest = others;
    }
    areas
}
