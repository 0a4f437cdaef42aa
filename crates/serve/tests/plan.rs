//! Plans of QGroundControl: reading, refusals, and a flight.
#![allow(clippy::indexing_slicing, clippy::type_complexity, clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_scenario::built_in;
use afbc_serve::{PlanEnd, QgcPlan, ServedVehicle, fleet, fly_plan};
use serde_json::{Value, json};

/// Home of the plan, other than the usual place of served vehicles.
const HOME: [f64; 2] = [-33.9, 18.4];

/// Returns the place at these distances north and east of home \[m\].
fn at(north: f64, east: f64) -> [f64; 2] {
    [HOME[0] + north / 110_923.0, HOME[1] + east / 92_469.0]
}

fn item(name: u32, command: u16, [a, b, c, d]: [Value; 4], place: [f64; 2], z: f64) -> Value {
    json!({
        "type": "SimpleItem", "autoContinue": true, "doJumpId": name, "command": command, "frame": 3,
        "params": [a, b, c, d, place[0], place[1], z],
    })
}

fn zeros() -> [Value; 4] {
    [json!(0), json!(0), json!(0), json!(null)]
}

/// Returns a plan with a jump in the mission, an inclusion and an exclusion area, and a rally point.
fn plan() -> Value {
    let square = [at(-60.0, -60.0), at(60.0, -60.0), at(60.0, 60.0), at(-60.0, 60.0)];
    json!({
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": {
            "version": 2, "plannedHomePosition": [HOME[0], HOME[1], 30.0], "hoverSpeed": 5,
            "items": [
                item(1, 22, zeros(), at(0.0, 0.0), 5.0),
                item(2, 178, [json!(1), json!(4), json!(-1), json!(0)], [0.0; 2], 0.0),
                item(3, 16, zeros(), at(25.0, 0.0), 8.0),
                item(4, 93, [json!(2), json!(-1), json!(-1), json!(-1)], [0.0; 2], 0.0),
                item(5, 16, zeros(), at(25.0, 20.0), 8.0),
                item(9, 177, [json!(3), json!(1), json!(0), json!(0)], [0.0; 2], 0.0),
                {
                    "type": "ComplexItem", "complexItemType": "survey",
                    "TransectStyleComplexItem": { "Items": [item(11, 16, zeros(), at(0.0, 20.0), 8.0)] },
                },
                item(12, 20, zeros(), [0.0; 2], 0.0),
            ],
        },
        "geoFence": {
            "version": 2,
            "polygons": [{ "version": 1, "inclusion": true, "polygon": square }],
            "circles": [{ "version": 1, "inclusion": false, "circle": { "center": at(-30.0, 0.0), "radius": 10.0 } }],
        },
        "rallyPoints": { "version": 2, "points": [[HOME[0], HOME[1], 20.0]] },
    })
}

fn read(plan: &Value) -> Result<QgcPlan, String> {
    QgcPlan::read("my.plan", &plan.to_string()).map_err(|error| error.to_string())
}

fn fly(plan: &QgcPlan) -> (Result<PlanEnd, String>, Vec<String>) {
    let scenario = built_in("outdoor").unwrap().read().unwrap();
    let mut vehicle = ServedVehicle::new(&fleet(&scenario, 1).unwrap()[0], 1, None).unwrap();
    let (place, altitude_m) = plan.home.unwrap();
    assert!(vehicle.move_origin(place, altitude_m.unwrap()));
    let mut lines = Vec::new();
    let end = fly_plan(&mut vehicle, plan, 600.0, &mut |line| lines.push(line.into()));
    (end, lines)
}

#[test]
fn a_plan_is_read() {
    let plan = read(&plan()).unwrap();
    assert_eq!((plan.mission.len(), plan.fence.len(), plan.rally.len()), (8, 5, 1));
    assert_eq!(plan.home, Some((HOME, Some(30.0))));
    let commands: Vec<_> = plan.mission.iter().map(|item| (item.number, item.command)).collect();
    assert_eq!(commands, [(0, 22), (1, 178), (2, 16), (3, 93), (4, 16), (5, 177), (6, 16), (7, 20)]);
    let waypoint = plan.mission[2];
    assert_eq!((waypoint.frame, waypoint.x, waypoint.z), (3, (at(25.0, 0.0)[0] * 1e7).round() as i32, 8.0));
    assert!(waypoint.parameters[3].is_nan());
    // The item with `doJumpId` 3 has the index 2.
    assert_eq!(plan.mission[5].parameters, [2.0, 1.0, 0.0, 0.0]);
    let fence: Vec<_> = plan.fence.iter().map(|item| (item.command, item.parameters[0])).collect();
    assert_eq!(fence, [(5001, 4.0), (5001, 4.0), (5001, 4.0), (5001, 4.0), (5004, 10.0)]);
    assert_eq!((plan.rally[0].command, plan.rally[0].frame, plan.rally[0].z), (5100, 3, 20.0));
}

/// Each error names the file, the item, the problem and the remedy.
#[test]
fn what_is_wrong_is_named() {
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut plan = plan();
        change(&mut plan);
        read(&plan).unwrap_err()
    };
    let cases: &[(&dyn Fn(&mut Value), &str)] = &[
        (
            &|plan| plan["fileType"] = json!("Mission"),
            "my.plan: the file is no plan of QGroundControl: its fileType is not Plan",
        ),
        (
            &|plan| plan["mission"]["items"][2]["command"] = json!("fly"),
            "my.plan: mission item 2.command: a whole number up to 65535 is needed here",
        ),
        (
            &|plan| plan["mission"]["items"][2]["params"] = json!([1, 2]),
            "my.plan: mission item 2.params: an item must have seven numbers; save the plan again in QGroundControl",
        ),
        (
            &|plan| plan["mission"]["items"][5]["params"][0] = json!(77),
            "my.plan: mission item 5: the jump's target doJumpId belongs to no item; correct the target",
        ),
        (
            &|plan| plan["mission"]["items"][6] = json!({ "type": "ComplexItem", "complexItemType": "StructureScan" }),
            "my.plan: mission item 6: a complex item without a list of Items cannot be flown; remove the item",
        ),
        (
            &|plan| plan["mission"]["items"][0]["type"] = json!(null),
            "my.plan: mission item 0: the item's type must be SimpleItem or ComplexItem",
        ),
        (
            &|plan| plan["geoFence"]["circles"][0]["circle"] = json!({ "center": [0, 0] }),
            "my.plan: geoFence circle 0.circle: radius is missing; save the plan again in QGroundControl",
        ),
        (
            &|plan| plan["geoFence"]["polygons"][0]["polygon"][1] = json!([91, 0]),
            "my.plan: geoFence polygon 0.polygon 1: latitude or longitude is out of range; write both in degrees",
        ),
        (
            &|plan| plan["geoFence"]["breachReturn"] = json!([1, 2, 3]),
            "my.plan: geoFence.breachReturn: return points are not supported; remove this one, since the vehicle \
             returns home",
        ),
        (&|plan| plan["rallyPoints"]["points"] = json!(7), "my.plan: rally point: a list is needed here"),
        (
            &|plan| plan["mission"]["items"][2]["autoContinue"] = json!(false),
            "my.plan: mission item 2: autoContinue must be true: a mission does not wait between items",
        ),
        (
            &|plan| plan["mission"]["items"][3]["doJumpId"] = json!(3),
            "my.plan: mission item 5: the jump's target doJumpId belongs to several items; correct the target",
        ),
        (
            &|plan| plan["geoFence"]["polygons"][0]["polygon"][1] = json!([HOME[0], HOME[1], 50.0]),
            "my.plan: geoFence polygon 0.polygon 1: an altitude has no effect here; remove it",
        ),
    ];
    for (change, line) in cases {
        assert_eq!(changed(change), *line);
    }
    let torn = QgcPlan::read("my.plan", "{\"fileType\": ").unwrap_err().to_string();
    assert!(torn.starts_with("my.plan: the file is not JSON: ") && torn.ends_with("; save the plan again"), "{torn}");
}

/// Unknown versions and unknown names are refused in every part of a plan: anything added to an object is read, known
/// to have no effect on the flight, or refused by its name.
#[test]
fn what_is_not_understood_is_refused_by_name() {
    fn objects(value: &Value, path: &str, found: &mut Vec<String>) {
        match value {
            Value::Object(object) => {
                // Only the list of computed simple items of a complex item is flown.
                let is_described = path.ends_with("/items/6") || path.contains("TransectStyle");
                if !is_described || path.ends_with("/Items/0") {
                    found.push(path.into());
                }
                object.iter().for_each(|(name, value)| objects(value, &format!("{path}/{name}"), found));
            }
            Value::Array(list) => {
                list.iter().enumerate().for_each(|(at, value)| objects(value, &format!("{path}/{at}"), found));
            }
            _ => (),
        }
    }
    let (whole, mut found) = (plan(), Vec::new());
    objects(&whole, "", &mut found);
    assert_eq!(found.len(), 15, "{found:?}");
    let mut versions = 0;
    for path in found {
        let mut other = whole.clone();
        other.pointer_mut(&path).unwrap()["speedLimit"] = json!(3);
        let line = read(&other).unwrap_err();
        assert!(line.ends_with(": speedLimit is unknown and cannot be flown; remove it"), "{path}: {line}");
        let Some(version) = whole.pointer(&path).unwrap().get("version").and_then(Value::as_u64) else { continue };
        versions += 1;
        for wrong in [json!(version + 1), json!(version - 1), json!(42), json!(1.5), json!("2"), json!(null)] {
            let mut other = whole.clone();
            other.pointer_mut(&path).unwrap()["version"] = wrong.clone();
            let line = read(&other).unwrap_err();
            let named = if wrong.is_null() { "version is missing" } else { "is unknown" };
            assert!(line.contains("version") && line.contains(named), "{path} {wrong}: {line}");
        }
    }
    assert_eq!(versions, 6);
    // The fence has an old format with other names.
    let mut old = whole.clone();
    old["geoFence"] = json!({ "version": 1, "polygon": [at(-60.0, -60.0), at(60.0, -60.0), at(60.0, 60.0)] });
    let cure = "save the plan again in a current QGroundControl";
    assert_eq!(
        read(&old).unwrap_err(),
        format!("my.plan: geoFence.version: version 1 is unknown, only 2 is known; {cure}")
    );
}

/// Flies from take-off to the landing at home inside the fence, with the loop flown twice.
#[test]
fn a_plan_is_flown() {
    let (end, lines) = fly(&read(&plan()).unwrap());
    let end = end.unwrap();
    assert_eq!(end.reached, [0, 1, 2, 3, 4, 5, 2, 3, 4, 5, 6, 7], "{lines:#?}");
    assert!(end.disarmed, "{lines:#?}");
}

/// If the vehicle refuses a plan, the error names the item.
#[test]
fn what_the_vehicle_refuses_is_named() {
    let refused = |change: &dyn Fn(&mut Value)| {
        let mut plan = plan();
        change(&mut plan);
        fly(&read(&plan).unwrap()).0.unwrap_err()
    };
    assert_eq!(
        refused(&|plan| plan["mission"]["items"][3]["command"] = json!(183)),
        "mission: the vehicle refuses this part: mission item 3: DO_SET_SERVO unsupported; change it in QGroundControl"
    );
    assert_eq!(
        refused(&|plan| plan["mission"]["items"][4]["params"][5] = json!(at(0.0, 70.0)[1])),
        "mission: the vehicle refuses this part: mission item 4: outside the geofence; change it in QGroundControl"
    );
    assert_eq!(
        refused(&|plan| plan["geoFence"]["circles"][0]["circle"]["center"] = json!(HOME)),
        "geoFence: the vehicle refuses this part: fence item 4: the vehicle is outside this fence; change it in \
         QGroundControl"
    );
    assert_eq!(refused(&|plan| plan["mission"]["items"] = json!([])), "the mission has no items; add some");
}

/// A return lands at a rally point that is nearer than home.
#[test]
fn a_return_lands_at_the_nearest_rally_point() {
    let mut plan = plan();
    let point = at(10.0, 20.0);
    plan["rallyPoints"]["points"] = json!([[point[0], point[1], 20.0], [HOME[0] + 0.5, HOME[1], 20.0]]);
    let plan = read(&plan).unwrap();
    let scenario = built_in("outdoor").unwrap().read().unwrap();
    let mut vehicle = ServedVehicle::new(&fleet(&scenario, 1).unwrap()[0], 1, None).unwrap();
    assert!(vehicle.move_origin(HOME, 30.0));
    let end = fly_plan(&mut vehicle, &plan, 600.0, &mut |_| ()).unwrap();
    let place = vehicle.world().plant().motion().position_m;
    // x is north, y is west. The GNSS receiver is off by a metre or two.
    assert!(end.disarmed && (place.x - 10.0).hypot(place.y + 20.0) < 3.0, "{place}");
}
