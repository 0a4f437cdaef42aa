//! Uploaded geofence and rally points: which orders and mission items they permit, where a return lands, and what the
//! guidance is told.

use crate::commands::{bench, origin};
use crate::common::{Bench, STATION};
use afbc_flight_core::Mode;
use afbc_guidance::{FenceStatus, FlightMode, Item, OrderRefusal, RequestedItem};
use afbc_mavlink::{
    CommandResult, Datum, Downlink, Encoder, FRAME_MAX, GlobalPosition, Height, MissionItem, MissionMessage,
    MissionResult, MissionType, Uplink, VehicleCommand,
};
use afbc_onboard::{ControlInputs, Report};
use afbc_types::{PoseSigmas, Setpoint, State};
use nalgebra::{Vector2, Vector3};

const HOME: [f32; 2] = [1.0, 2.0];
const HERE: [f32; 2] = [10.0, -5.0];
/// MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION and MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION.
const INCLUSION: u16 = 5001;
const NO_CIRCLE: u16 = 5004;
const RALLY: u16 = 5100;

/// A vehicle with a guidance that the test controls.
pub(crate) struct Vehicle {
    bench: Bench,
    pub(crate) report: Report,
    state: State,
    /// Inputs for the guidance since the test last cleared them.
    inputs: ControlInputs,
}

fn at([x, y]: [f32; 2]) -> [i32; 2] {
    origin().global(&Vector3::new(x, y, 0.0)).e7()
}

fn item(command: u16, first: f32, place_m: [f32; 2]) -> MissionItem {
    let [x, y] = at(place_m);
    MissionItem { command, frame: 5, goes_on: true, parameters: [first, 0.0, 0.0, 0.0], x, y, ..MissionItem::default() }
}

/// Returns a mission item.
pub(crate) fn way(command: u16, place_m: [f32; 2]) -> MissionItem {
    let parameters = if command == 18 { [1.0, 0.0, 3.0, f32::NAN] } else { [0.0, 0.0, 0.0, f32::NAN] };
    MissionItem { frame: 6, z: 5.0, parameters, ..item(command, 0.0, place_m) }
}

fn rally(place_m: [f32; 2]) -> MissionItem {
    MissionItem { frame: 3, z: 5.0, ..item(RALLY, 0.0, place_m) }
}

/// Returns a fence: a square of 100 m by 100 m and an excluded disc.
fn fence(disc_m: [f32; 2], radius_m: f32) -> Vec<MissionItem> {
    let corners = [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]];
    let mut items: Vec<_> = corners.map(|corner| item(INCLUSION, 4.0, corner)).into();
    items.push(item(NO_CIRCLE, radius_m, disc_m));
    items
}

impl Vehicle {
    pub(crate) fn new() -> Self {
        let mut bench = bench(true);
        let state = State { position_m: Vector3::new(HERE[0], HERE[1], 3.0), ..State::default() };
        bench.measure(&state);
        let (report, _) = bench.step();
        Vehicle { bench, report, state, inputs: ControlInputs::EMPTY }
    }

    fn hear(&mut self, message: &Uplink) {
        let mut buffer = [0; FRAME_MAX];
        let update = self.bench.receive(Encoder::new(STATION).send(message, &mut buffer));
        self.inputs.merge(&update);
    }

    fn tick(&mut self) -> Vec<Downlink> {
        self.bench.now_us += 1000;
        self.state.position_m.z += 1e-6;
        self.hear(&Uplink::State { sent_us: self.bench.now_us, state: self.state, sigmas: PoseSigmas::UNKNOWN });
        self.report.time_us = self.bench.now_us;
        self.bench.said(&self.report)
    }

    fn put(&mut self, place_m: [f32; 2]) {
        (self.state.position_m.x, self.state.position_m.y) = place_m.into();
    }

    pub(crate) fn pass(&mut self, ticks: u32) -> Vec<Downlink> {
        (0..ticks).flat_map(|_| self.tick()).collect()
    }

    /// Uploads a plan. Returns the result.
    pub(crate) fn upload(&mut self, plan: MissionType, items: &[MissionItem]) -> MissionResult {
        self.hear(&Uplink::Mission(MissionMessage::Count(items.len() as u16, plan)));
        for _ in 0..10 * (items.len() + 1) {
            for message in self.tick() {
                match message {
                    Downlink::Mission { message: MissionMessage::Request(number, _), .. } => {
                        let item = MissionItem { number, ..items[usize::from(number)] };
                        self.hear(&Uplink::Mission(MissionMessage::Item(item, plan)));
                    }
                    Downlink::Mission { message: MissionMessage::Ack(result, _), .. } => return result,
                    _ => (),
                }
            }
        }
        panic!("not answered")
    }

    /// Returns true if a command's order reaches the guidance. Otherwise checks that the station is told the reason.
    fn allows(&mut self, command: VehicleCommand) -> bool {
        self.pass(5);
        self.inputs = ControlInputs::EMPTY;
        self.hear(&Uplink::Command(command));
        let given = self.inputs.orders.given.iter().next().copied();
        self.report.guided.answer = given.map(|given| (given.ticket, Ok(())));
        let mut said = self.tick();
        self.report.guided.answer = None;
        said.extend(self.pass(2));
        let is = |wanted: CommandResult| {
            said.iter().any(|it| matches!(it, Downlink::CommandAck { answer, .. } if *answer == wanted))
        };
        let text = said
            .iter()
            .any(|it| matches!(it, Downlink::Text { text, .. } if text.to_str().is_ok_and(|it| it.contains("fence"))));
        let refused = is(CommandResult::Refused(OrderRefusal::OutsideFence as i32));
        assert_eq!(
            (refused, text, is(CommandResult::Accepted)),
            (given.is_none(), given.is_none(), given.is_some()),
            "{said:?}"
        );
        given.is_some()
    }

    /// Returns the place where a return lands, if the guidance is told a new one.
    fn safe(&mut self, ticks: u32) -> Option<[f32; 2]> {
        self.inputs = ControlInputs::EMPTY;
        self.pass(ticks);
        // Coordinates on the wire are accurate to about a centimetre.
        self.inputs.orders.safe_m.map(|place| [place.x, place.y].map(|x| (x * 20.0).round() / 20.0))
    }

    /// Returns the mission item that the guidance gets when it asks for this number.
    pub(crate) fn leg(&mut self, wanted: u16) -> RequestedItem {
        self.inputs = ControlInputs::EMPTY;
        self.report.guided.wanted = wanted;
        self.pass(3);
        self.inputs.orders.leg.expect("handed over")
    }

    /// Returns the state of the fence that the guidance is told while the vehicle moves at this velocity.
    fn view(&mut self, position_m: [f32; 2], velocity_m_s: [f32; 2]) -> FenceStatus {
        self.put(position_m);
        (self.state.velocity_m_s.x, self.state.velocity_m_s.y) = velocity_m_s.into();
        self.pass(20);
        self.inputs.orders.fence.expect("told")
    }
}

fn go(place_m: [f32; 2]) -> VehicleCommand {
    let [latitude_e7, longitude_e7] = at(place_m);
    let place = GlobalPosition { latitude_e7, longitude_e7, height: Height { metres: 5.0, above: Datum::Home } };
    VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true }
}

fn circle(centre_m: Option<[f32; 2]>, radius_m: f32) -> VehicleCommand {
    let [latitude_e7, longitude_e7] = centre_m.map_or([GlobalPosition::AS_IT_IS; 2], at);
    let place = GlobalPosition { latitude_e7, longitude_e7, height: Height { metres: 5.0, above: Datum::Home } };
    VehicleCommand::Orbit { place, radius_m, speed_m_s: f32::NAN, angle_deg: 0, heading: 0 }
}

/// The destination of an order and the straight path to it must be inside with a margin. A circle must be inside as a
/// whole, in either direction.
#[test]
fn orders_must_stay_inside() {
    let mut vehicle = Vehicle::new();
    let places = [
        ([48.0, 0.0], true),
        ([49.5, 0.0], false),
        ([51.0, 0.0], false),
        ([30.0, 22.0], true),
        ([30.0, 24.5], false),
        ([30.0, 30.0], false),
        // The place is behind the excluded disc.
        ([36.0, 40.5], false),
        ([10.0, 45.0], true),
    ];
    let circles = [
        (Some([0.0, 0.0]), 20.0, true),
        (Some([0.0, 0.0]), 55.0, false),
        (Some([0.0, 0.0]), 40.0, false),
        (Some([30.0, 30.0]), 10.0, true),
        (Some([60.0, 0.0]), 5.0, false),
        (None, 30.0, true),
        (None, 44.0, false),
    ];
    for has_fence in [false, true] {
        for (place_m, allowed) in places {
            assert_eq!(vehicle.allows(go(place_m)), allowed || !has_fence, "{place_m:?}");
        }
        for (centre_m, radius_m, allowed) in circles {
            for radius_m in [radius_m, -radius_m] {
                assert_eq!(
                    vehicle.allows(circle(centre_m, radius_m)),
                    allowed || !has_fence,
                    "{centre_m:?} {radius_m}"
                );
            }
        }
        // These orders stay at the present place at another height, or have no place.
        let height = Height { metres: 20.0, above: Datum::Home };
        let place =
            GlobalPosition { latitude_e7: GlobalPosition::AS_IT_IS, longitude_e7: GlobalPosition::AS_IT_IS, height };
        let up = VehicleCommand::Reposition { place, yaw_rad: f32::NAN, speed_m_s: None, changes_mode: true };
        assert!(
            vehicle.allows(up) && vehicle.allows(VehicleCommand::Land) && vehicle.allows(VehicleCommand::Speed(2.0))
        );
        if !has_fence {
            assert_eq!(vehicle.upload(MissionType::FENCE, &fence([30.0, 30.0], 5.0)), MissionResult::ACCEPTED);
        }
    }
}

/// In flight a return needs a clear path to its landing place. On the ground it can always be selected.
#[test]
fn a_return_must_have_a_clear_way() {
    let mut vehicle = Vehicle::new();
    vehicle.report.guided.airborne = true;
    let back = VehicleCommand::Return;
    assert!(vehicle.allows(back));
    assert_eq!(vehicle.upload(MissionType::FENCE, &fence([30.0, 30.0], 5.0)), MissionResult::ACCEPTED);
    assert!(vehicle.allows(back));
    let between = [0, 1].map(|axis| 0.5 * (HOME[axis] + HERE[axis]));
    assert_eq!(vehicle.upload(MissionType::FENCE, &fence(between, 2.0)), MissionResult::ACCEPTED);
    assert!(!vehicle.allows(back));
    vehicle.report.guided.airborne = false;
    assert!(vehicle.allows(back));
    vehicle.report.guided.airborne = true;
    // Home is inside an excluded disc. Then a nearer rally point with a clear path is added.
    assert_eq!(vehicle.upload(MissionType::FENCE, &fence(HOME, 2.0)), MissionResult::ACCEPTED);
    assert!(!vehicle.allows(back));
    assert_eq!(vehicle.upload(MissionType::RALLY, &[rally([15.0, -10.0])]), MissionResult::ACCEPTED);
    vehicle.pass(600);
    assert!(vehicle.allows(back));
}

/// Mission items outside the fence are given to the guidance with NaN as their place, so that it refuses them. For a
/// landing NaN would mean the present position, so its place is infinite.
#[test]
fn items_outside_are_handed_over_without_a_place() {
    let mut vehicle = Vehicle::new();
    let (inside, outside) = ([20.0, -20.0], [60.0, 0.0]);
    let land_here = MissionItem { x: 0, y: 0, ..way(21, inside) };
    let items: Vec<_> = [16, 22, 18, 21]
        .into_iter()
        .flat_map(|command| [way(command, inside), way(command, outside)])
        .chain([land_here])
        .collect();
    let place = |leg: &RequestedItem| match leg.item {
        Item::Waypoint { position_m, .. } | Item::TakeOffTo { position_m } | Item::Land { position_m } => position_m,
        Item::Turns { centre_m, .. } => centre_m,
        other => panic!("{other:?}"),
    };
    // The mission is uploaded first: an existing fence would refuse it.
    assert_eq!(vehicle.upload(MissionType::MISSION, &items), MissionResult::ACCEPTED);
    for has_fence in [false, true] {
        if has_fence {
            assert_eq!(vehicle.upload(MissionType::FENCE, &fence([30.0, 30.0], 5.0)), MissionResult::ACCEPTED);
        }
        for number in (0..items.len() as u16).rev() {
            let leg = vehicle.leg(number);
            let found = place(&leg);
            let expected = Vector2::from(if number % 2 == 0 { inside } else { outside });
            assert_eq!(leg.number, number);
            match number {
                8 => assert!(found.iter().all(|x| x.is_nan()), "here: {found}"),
                7 if has_fence => assert!(found.iter().all(|x| x.is_infinite()), "nowhere: {found}"),
                1 | 3 | 5 if has_fence => assert!(found.iter().all(|x| x.is_nan()), "{number}: {found}"),
                _ => assert!((found.xy() - expected).norm() < 0.05, "{number}: {found}"),
            }
        }
    }
}

/// A return lands at the nearest of home and the rally points. The nearest is searched twice per second, and the
/// guidance is told if it changes. It does not change during a return.
#[test]
fn a_return_lands_at_the_nearest_place() {
    let mut vehicle = Vehicle::new();
    assert_eq!(vehicle.safe(1200), None, "home, which the guidance knows");
    let points = [[12.0, -6.0], [-40.0, 0.0], [60.0, 60.0]];
    assert_eq!(vehicle.upload(MissionType::RALLY, &points.map(rally)), MissionResult::ACCEPTED);
    assert_eq!(vehicle.safe(501), Some(points[0]));
    assert_eq!((vehicle.safe(1200), vehicle.bench.comms.has_mail()), (None, false), "once");
    for (here_m, nearest) in [([-30.0, 3.0], points[1]), ([50.0, 70.0], points[2]), ([-8.0, 3.0], HOME)] {
        vehicle.put(here_m);
        assert_eq!(vehicle.safe(510), Some(nearest));
    }
    // A search runs half a second after the previous search, not earlier.
    vehicle.put(points[0]);
    assert!((0..510).any(|_| vehicle.safe(1) == Some(points[0])));
    vehicle.put(points[2]);
    assert_eq!((vehicle.safe(490), vehicle.safe(20)), (None, Some(points[2])));
    vehicle.report.guided.mode = FlightMode::Return;
    vehicle.put(HERE);
    assert_eq!(vehicle.safe(1200), None);
    vehicle.report.guided.mode = FlightMode::Hold;
    assert_eq!(vehicle.safe(10), Some(points[0]), "at once: it has not been looked for");
    // Without rally points, home is the nearest safe place again.
    vehicle.hear(&Uplink::Mission(MissionMessage::Clear(MissionType::RALLY)));
    assert_eq!((vehicle.safe(510), vehicle.safe(1200)), (Some(HOME), None));
    // A vehicle without a position has no nearest place.
    assert_eq!(vehicle.upload(MissionType::RALLY, &points.map(rally)), MissionResult::ACCEPTED);
    vehicle.report.health.state_age_us = u32::MAX;
    assert_eq!(vehicle.safe(1200), None);
}

/// The guidance is told when the vehicle, or the setpoint that it follows, could not stop inside the fence, and when
/// the vehicle is outside. Each change is told once.
#[test]
fn the_guidance_learns_whether_the_vehicle_leaves() {
    let mut vehicle = Vehicle::new();
    vehicle.pass(50);
    assert_eq!(vehicle.inputs.orders.fence, None, "there is none");
    assert_eq!(vehicle.upload(MissionType::FENCE, &fence([30.0, 30.0], 5.0)), MissionResult::ACCEPTED);
    vehicle.pass(50);
    assert_eq!(vehicle.inputs.orders.fence, None, "well inside");
    let [well, leaves, outside] =
        [(false, false), (true, false), (true, true)].map(|(leaves, outside)| FenceStatus { leaves, outside });
    assert_eq!(vehicle.view([45.0, 0.0], [8.0, 0.0]), leaves);
    assert_eq!(vehicle.view([55.0, 0.0], [8.0, 0.0]), outside);
    vehicle.inputs = ControlInputs::EMPTY;
    vehicle.pass(50);
    assert_eq!((vehicle.inputs.orders.fence, vehicle.bench.comms.has_mail()), (None, false), "no news");
    vehicle.inputs.order().fence = Some(outside);
    assert_eq!(vehicle.view([45.0, 0.0], [-8.0, 0.0]), leaves, "until it has stopped");
    vehicle.view([40.0, 0.0], [0.0, 0.0]);
    vehicle.pass(600);
    assert_eq!(vehicle.inputs.orders.fence, Some(well));

    // The setpoint counts only while the vehicle is armed and follows it.
    let runs = Setpoint {
        position_m: Vector3::new(45.0, 0.0, 3.0),
        velocity_m_s: Vector3::new(8.0, 0.0, 0.0),
        ..Setpoint::default()
    };
    vehicle.report.guided.setpoint = Some(runs);
    assert_eq!(vehicle.view([30.0, 0.0], [0.0, 0.0]), well);
    vehicle.report.mode = Mode::Flying;
    assert_eq!(vehicle.view([30.0, 0.0], [0.0, 0.0]), leaves);
    // The setpoint's acceleration counts as the vehicle's: a vehicle that already brakes stops earlier.
    vehicle.report.guided.setpoint = None;
    vehicle.pass(600);
    assert_eq!(vehicle.inputs.orders.fence, Some(well));
    let still = Setpoint { position_m: Vector3::new(30.0, 0.0, 3.0), ..Setpoint::default() };
    let places = (0..200).map(|place| 20.0 + 0.15 * place as f32);
    let mut first = [0.0; 2];
    for (first, acceleration) in first.iter_mut().zip([-2.0, 2.0]) {
        let acceleration_m_s2 = Vector3::new(acceleration, 0.0, 0.0);
        vehicle.report.guided.setpoint = Some(Setpoint { acceleration_m_s2, ..still });
        *first = places.clone().find(|x| vehicle.view([*x, 0.0], [6.0, 0.0]).leaves).expect("leaves in the end");
        vehicle.report.guided.setpoint = None;
        vehicle.view([20.0, 0.0], [0.0, 0.0]);
        vehicle.pass(600);
    }
    assert!(first[0] > first[1] + 0.5, "{first:?}");
}
