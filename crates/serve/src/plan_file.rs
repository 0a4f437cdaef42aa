//! Reads QGroundControl plans: `.plan` files with a mission, a geofence and rally points.
//!
//! Nothing in a file is ignored silently: unknown versions and names are refused. Known names include those that only
//! describe the plan.

use crate::waypoint_file;
use afbc_files::read::FileError;
use afbc_mavlink::{GlobalPosition, MissionItem};
use serde_json::Value;

/// MAVLink frames MAV_FRAME_GLOBAL and MAV_FRAME_LOCAL_NED.
const GLOBAL: u8 = 0;
const LOCAL_NED: u8 = 1;
/// MAV_CMD_DO_JUMP. In these files its first parameter is the target's `doJumpId`, not an item number.
const JUMP: u16 = 177;
/// Inclusion commands of the geofence; the exclusion command is each number plus 1.
const VERTEX: u16 = 5001;
const CIRCLE: u16 = 5003;
const RALLY_POINT: u16 = 5100;

/// Known names in each part of a file.
const PLAN: &[&str] = &["fileType", "version", "groundStation", "mission", "geoFence", "rallyPoints"];
const MISSION: &[&str] = &[
    "version",
    "items",
    "plannedHomePosition",
    "firmwareType",
    "vehicleType",
    "cruiseSpeed",
    "hoverSpeed",
    "globalPlanAltitudeMode",
];
const SIMPLE_ITEM: &[&str] = &[
    "type",
    "command",
    "frame",
    "params",
    "autoContinue",
    "doJumpId",
    "Altitude",
    "AltitudeMode",
    "AMSLAltAboveTerrain",
    "MISSION_ITEM_ID",
];
const FENCE: &[&str] = &["version", "polygons", "circles", "breachReturn"];
const POLYGON: &[&str] = &["version", "inclusion", "polygon"];
const CIRCLE_AREA: &[&str] = &["version", "inclusion", "circle"];
const CIRCLE_SHAPE: &[&str] = &["center", "radius"];
const RALLY: &[&str] = &["version", "points"];

/// A plan: mission, geofence and rally points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QgcPlan {
    /// Items of the mission.
    pub mission: Vec<MissionItem>,
    /// Items of the geofence.
    pub fence: Vec<MissionItem>,
    /// Rally points.
    pub rally: Vec<MissionItem>,
    /// Planned home: latitude and longitude \[deg\], and the altitude above the sea \[m\] if known.
    pub home: Option<([f64; 2], Option<f64>)>,
}

/// A part of the file, with its place for error messages.
struct PlanSection<'a> {
    file: &'a str,
    place: String,
    value: &'a Value,
}

impl<'a> PlanSection<'a> {
    fn wrong(&self, problem: &str) -> FileError {
        FileError::whole(self.file, format!("{}: {problem}", self.place))
    }

    fn at(&self, key: &str) -> Option<PlanSection<'a>> {
        let value = self.value.get(key).filter(|value| !value.is_null())?;
        Some(PlanSection { file: self.file, place: format!("{}.{key}", self.place), value })
    }

    fn get(&self, key: &str) -> Result<PlanSection<'a>, FileError> {
        self.at(key).ok_or_else(|| self.wrong(&format!("{key} is missing; save the plan again in QGroundControl")))
    }

    /// Checks the part's version, and that it has no unknown names.
    fn known(&self, version: Option<u64>, names: &[&str]) -> Result<(), FileError> {
        let object = self.value.as_object().ok_or_else(|| self.wrong("an object is needed here"))?;
        if let Some(known) = version {
            let found = self.get("version")?;
            if found.value.as_u64() != Some(known) {
                let cure = "save the plan again in a current QGroundControl";
                return Err(found.wrong(&format!("version {} is unknown, only {known} is known; {cure}", found.value)));
            }
        }
        match object.keys().find(|name| !names.contains(&name.as_str())) {
            Some(name) => Err(self.wrong(&format!("{name} is unknown and cannot be flown; remove it"))),
            None => Ok(()),
        }
    }

    fn list(&self) -> Result<Vec<PlanSection<'a>>, FileError> {
        let list = self.value.as_array().ok_or_else(|| self.wrong("a list is needed here"))?;
        let part = |(number, value)| PlanSection { file: self.file, place: format!("{} {number}", self.place), value };
        Ok(list.iter().enumerate().map(part).collect())
    }

    fn number(&self) -> Result<f64, FileError> {
        self.value.as_f64().ok_or_else(|| self.wrong("a number is needed here"))
    }

    fn whole(&self, most: u16) -> Result<u16, FileError> {
        let whole = self.value.as_u64().and_then(|number| u16::try_from(number).ok()).filter(|number| *number <= most);
        whole.ok_or_else(|| self.wrong(&format!("a whole number up to {most} is needed here")))
    }

    fn truth(&self) -> Result<bool, FileError> {
        self.value.as_bool().ok_or_else(|| self.wrong("true or false is needed here"))
    }

    /// Returns latitude and longitude \[deg\], and the altitude if there is one.
    fn coordinates(&self) -> Result<([f64; 2], Option<f64>), FileError> {
        let list = self.list()?;
        let [latitude, longitude, rest @ ..] = list.as_slice() else {
            return Err(self.wrong("a list of latitude and longitude is needed here"));
        };
        let place = [latitude.number()?, longitude.number()?];
        let [latitude, longitude] = place;
        if latitude.abs() > 90.0 || longitude.abs() > 180.0 {
            return Err(self.wrong("latitude or longitude is out of range; write both in degrees"));
        }
        let altitude = match rest {
            [] => None,
            [altitude] if altitude.value.is_null() => None,
            [altitude] => Some(altitude.number()?),
            _ => return Err(self.wrong("a list of latitude, longitude and altitude is needed here")),
        };
        Ok((place, altitude))
    }

    /// Returns latitude and longitude \[deg\]; refuses an altitude.
    fn flat(&self) -> Result<[f64; 2], FileError> {
        match self.coordinates()? {
            (place, None) => Ok(place),
            _ => Err(self.wrong("an altitude has no effect here; remove it")),
        }
    }
}

impl QgcPlan {
    /// Reads a plan from the `text` of `file`: a QGroundControl plan or a waypoint file.
    ///
    /// # Errors
    /// Fails with one line that names the file, the item, the problem and the remedy.
    pub fn read(file: &str, text: &str) -> Result<Self, FileError> {
        if waypoint_file::is_waypoint_file(text.as_bytes()) {
            let (mission, home) = waypoint_file::read(file, text)?;
            return Ok(QgcPlan { mission, home, ..QgcPlan::default() });
        }
        let value: Value = serde_json::from_str(text)
            .map_err(|error| FileError::whole(file, format!("the file is not JSON: {error}; save the plan again")))?;
        let whole = PlanSection { file, place: "plan".into(), value: &value };
        if value.get("fileType").and_then(Value::as_str) != Some("Plan") {
            return Err(FileError::whole(file, "the file is no plan of QGroundControl: its fileType is not Plan"));
        }
        whole.known(Some(1), PLAN)?;
        let part = |key: &str| whole.at(key).map(|part| PlanSection { place: key.into(), ..part });
        let mission = part("mission");
        Ok(QgcPlan {
            mission: mission.as_ref().map_or(Ok(Vec::new()), read_mission)?,
            fence: part("geoFence").as_ref().map_or(Ok(Vec::new()), read_fence)?,
            rally: part("rallyPoints").as_ref().map_or(Ok(Vec::new()), read_rally)?,
            home: mission.and_then(|it| it.at("plannedHomePosition")).map(|home| home.coordinates()).transpose()?,
        })
    }
}

/// Returns the items of the mission. Complex items are replaced by the simple items that QGroundControl computed.
fn read_mission(mission: &PlanSection<'_>) -> Result<Vec<MissionItem>, FileError> {
    mission.known(Some(2), MISSION)?;
    let items = PlanSection { place: "mission item".into(), ..mission.get("items")? };
    let mut simple = Vec::new();
    for item in items.list()? {
        match item.value.get("type").and_then(Value::as_str) {
            Some("SimpleItem") => simple.push(item),
            Some("ComplexItem") => match item.at("TransectStyleComplexItem").and_then(|style| style.at("Items")) {
                Some(worked_out) => simple.extend(worked_out.list()?),
                None => {
                    return Err(item.wrong("a complex item without a list of Items cannot be flown; remove the item"));
                }
            },
            _ => return Err(item.wrong("the item's type must be SimpleItem or ComplexItem")),
        }
    }
    let names: Vec<_> = simple.iter().map(|item| item.value.get("doJumpId").and_then(Value::as_u64)).collect();
    simple.iter().zip(0..).map(|(item, number)| simple_item(item, number, &names)).collect()
}

fn simple_item(item: &PlanSection<'_>, number: u16, names: &[Option<u64>]) -> Result<MissionItem, FileError> {
    item.known(None, SIMPLE_ITEM)?;
    if item.at("autoContinue").is_some_and(|goes_on| goes_on.value != &Value::Bool(true)) {
        return Err(item.wrong("autoContinue must be true: a mission does not wait between items"));
    }
    let command = item.get("command")?.whole(u16::MAX)?;
    let frame = item.get("frame")?.whole(u8::MAX.into())? as u8;
    let params = item.get("params")?;
    let numbers = params.list()?;
    let number_of = |part: &PlanSection<'_>| if part.value.is_null() { Ok(f64::NAN) } else { part.number() };
    let numbers = numbers.iter().map(number_of).collect::<Result<Vec<_>, _>>()?;
    let [first, second, third, fourth, x, y, z] = numbers.as_slice() else {
        return Err(params.wrong("an item must have seven numbers; save the plan again in QGroundControl"));
    };
    let mut parameters = [*first, *second, *third, *fourth].map(|number| number as f32);
    if command == JUMP {
        let mut places = (0..names.len()).filter(|place| names.get(*place) == Some(&Some(*first as u64)));
        let place = places.next().filter(|_| first.fract() == 0.0);
        let place =
            place.ok_or_else(|| item.wrong("the jump's target doJumpId belongs to no item; correct the target"))?;
        if places.next().is_some() {
            return Err(item.wrong("the jump's target doJumpId belongs to several items; correct the target"));
        }
        let [target, ..] = &mut parameters;
        *target = place as f32;
    }
    let units = if frame == LOCAL_NED { 1e4 } else { 1e7 };
    // Values out of range stay out of range. A missing coordinate must not become a place at 0.
    let in_units = |coordinate: f64| match coordinate {
        left_out if left_out.is_nan() => GlobalPosition::AS_IT_IS,
        coordinate => (coordinate * units).clamp(-2e9, 2e9).round() as i32,
    };
    Ok(MissionItem {
        number,
        command,
        frame,
        is_current: number == 0,
        goes_on: true,
        parameters,
        x: in_units(*x),
        y: in_units(*y),
        z: *z as f32,
    })
}

fn read_fence(fence: &PlanSection<'_>) -> Result<Vec<MissionItem>, FileError> {
    if let Some(point) = fence.at("breachReturn") {
        return Err(point.wrong("return points are not supported; remove this one, since the vehicle returns home"));
    }
    fence.known(Some(2), FENCE)?;
    let mut items = Vec::new();
    let kind = |area: &PlanSection<'_>, command: u16| Ok(command + u16::from(!area.get("inclusion")?.truth()?));
    let named = |key: &str, name: &str| match fence.at(key) {
        Some(list) => PlanSection { place: name.into(), ..list }.list(),
        None => Ok(Vec::new()),
    };
    for polygon in named("polygons", "geoFence polygon")? {
        polygon.known(Some(1), POLYGON)?;
        let command = kind(&polygon, VERTEX)?;
        let corners = polygon.get("polygon")?.list()?;
        for corner in &corners {
            items.push(point(command, corners.len() as f32, corner.flat()?));
        }
    }
    for circle in named("circles", "geoFence circle")? {
        circle.known(Some(1), CIRCLE_AREA)?;
        let command = kind(&circle, CIRCLE)?;
        let shape = circle.get("circle")?;
        let (centre, radius) = (shape.get("center")?.flat()?, shape.get("radius")?.number()?);
        shape.known(None, CIRCLE_SHAPE)?;
        items.push(point(command, radius as f32, centre));
    }
    Ok(numbered(items))
}

fn read_rally(rally: &PlanSection<'_>) -> Result<Vec<MissionItem>, FileError> {
    rally.known(Some(2), RALLY)?;
    let points = PlanSection { place: "rally point".into(), ..rally.get("points")? };
    let points = points.list()?;
    let items = points.iter().map(|part| {
        let (place, height) = part.coordinates()?;
        // MAV_FRAME_GLOBAL_RELATIVE_ALT: heights of rally points are above home.
        Ok(MissionItem { z: height.unwrap_or(0.0) as f32, frame: 3, ..point(RALLY_POINT, 0.0, place) })
    });
    Ok(numbered(items.collect::<Result<_, _>>()?))
}

fn point(command: u16, first: f32, [latitude, longitude]: [f64; 2]) -> MissionItem {
    let [x, y] = [latitude, longitude].map(|degrees| (degrees * 1e7).round() as i32);
    let parameters = [first, 0.0, 0.0, 0.0];
    MissionItem { command, frame: GLOBAL, goes_on: true, parameters, x, y, ..MissionItem::default() }
}

fn numbered(items: Vec<MissionItem>) -> Vec<MissionItem> {
    items.into_iter().zip(0..).map(|(item, number)| MissionItem { number, ..item }).collect()
}
