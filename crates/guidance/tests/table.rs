//! Compares the transitions with a second version of the table in docs/modes.md, for every mode and all conditions.
//! Random walks check that every change of mode is in the table and announced.

use crate::bench::{Bench, motion, settings};
use afbc_flight_core::{Mode, Stamped, Ticketed};
use afbc_guidance::table::{forced, select};
use afbc_guidance::*;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::collections::BTreeSet;

const ACTIONS: [FailsafeAction; 5] =
    [FailsafeAction::None, FailsafeAction::Warn, FailsafeAction::Hold, FailsafeAction::Return, FailsafeAction::Land];

/// Returns all combinations of conditions.
fn all() -> impl Iterator<Item = TransitionInputs> {
    (0..128_u32).flat_map(|bits| {
        let bit = move |n: u32| bits >> n & 1 == 1;
        ACTIONS.into_iter().map(move |held| TransitionInputs {
            armed: bit(0),
            airborne: bit(1),
            positioned: bit(2),
            descends: bit(3),
            mission: bit(4),
            targets: bit(5),
            sticks: bit(6),
            held,
        })
    })
}

/// Returns the table's row of a mode: its conditions in order, each with the refusal if not met.
fn needs(mode: FlightMode, seen: &TransitionInputs) -> Vec<(bool, OrderRefusal)> {
    let position = (seen.positioned, OrderRefusal::NoPosition);
    match mode {
        FlightMode::Land => vec![(seen.armed, OrderRefusal::NotArmed)],
        FlightMode::Hold => vec![position],
        FlightMode::Takeoff => vec![position, (!seen.airborne, OrderRefusal::InFlight)],
        FlightMode::Return => vec![position, (seen.airborne, OrderRefusal::OnGround)],
        FlightMode::Mission => vec![position, (seen.mission, OrderRefusal::NoMission)],
        FlightMode::Offboard => vec![position, (seen.targets, OrderRefusal::NoTargets)],
        FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro => {
            vec![position, (seen.sticks, OrderRefusal::NoSticks)]
        }
    }
}

/// Returns the strength of a mode as a response to a failure.
fn strength(mode: FlightMode) -> usize {
    match mode {
        FlightMode::Land => 4,
        FlightMode::Return => 3,
        FlightMode::Hold => 2,
        _ => 1,
    }
}

#[test]
fn a_mode_may_be_selected_by_the_table() {
    for seen in all() {
        let strongest = if seen.armed && seen.descends { 4 } else { seen.held as usize };
        for mode in FlightMode::ALL {
            let mut expected = Ok(());
            if strength(mode) < strongest {
                expected = Err(OrderRefusal::Failsafe);
            } else if let Some((_, declined)) = needs(mode, &seen).into_iter().find(|(met, _)| !met) {
                expected = Err(declined);
            }
            assert_eq!(select(mode, &seen), expected, "{mode:?} {seen:?}");
        }
    }
}

#[test]
fn a_failure_forces_its_mode_and_nothing_weaker() {
    use FlightMode::{Hold, Land, Return};
    for seen in all() {
        for mode in FlightMode::ALL {
            let expected = match (seen.armed, seen.descends, seen.airborne, seen.held) {
                (false, ..) => None,
                (true, true, ..) => (mode != Land).then_some(Land),
                (true, false, _, FailsafeAction::None | FailsafeAction::Warn) => None,
                (true, false, false, _) | (true, false, true, FailsafeAction::Hold) => {
                    (![Hold, Return, Land].contains(&mode)).then_some(Hold)
                }
                (true, false, true, FailsafeAction::Return) => (![Return, Land].contains(&mode)).then_some(Return),
                (true, false, true, FailsafeAction::Land) => (mode != Land).then_some(Land),
            };
            assert_eq!(forced(mode, &seen), expected, "{mode:?} {seen:?}");
        }
    }
}

#[test]
fn every_text_is_short_and_every_severity_one_of_mavlinks() {
    let reasons = [ModeReason::Ordered, ModeReason::Done, ModeReason::Mission, ModeReason::Cleared, ModeReason::NoLift];
    let reasons = reasons
        .into_iter()
        .chain([ModeReason::Disarmed, ModeReason::Back])
        .chain(FailsafeCause::ALL.map(ModeReason::Failsafe));
    let modes = reasons.flat_map(|reason| FlightMode::ALL.map(|mode| GuidanceNotice::Mode(mode, reason)));
    let causes =
        FailsafeCause::ALL.into_iter().flat_map(|cause| [GuidanceNotice::Found(cause), GuidanceNotice::Over(cause)]);
    let mut texts = BTreeSet::new();
    for notice in modes.chain(causes).chain([GuidanceNotice::Disarms, GuidanceNotice::ItemRefused]) {
        let text = notice.to_string();
        assert!(text.len() <= 50, "{text}");
        assert!((2..=6).contains(&(notice.severity() as u8)));
        assert!(texts.insert(text), "{notice:?}");
    }
}

/// One step of a random walk.
#[derive(Clone, Copy, Debug)]
enum Step {
    Arm,
    Kill,
    Order(Order),
    Target(OffboardTarget),
    Sticks(Sticks),
    Heard(bool),
    Sees(bool),
    Battery(f32),
    Sensor(bool),
    /// The flight core descends. False: without a state; true: with a state that has just come back.
    Descends(bool),
    Mission(u8),
    Wind(f32),
    Wait(u16),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let place = || [-40.0_f32..40.0, -40.0_f32..40.0, -2.0_f32..30.0].prop_map(Vector3::from);
    let mode = proptest::sample::select(FlightMode::ALL.to_vec());
    let step = prop_oneof![
        2 => Just(Step::Arm),
        1 => Just(Step::Kill),
        8 => mode.prop_map(|mode| Step::Order(Order::Select(mode))),
        4 => (0.5_f32..8.0).prop_map(|height_m| Step::Order(Order::TakeOff(Some(height_m)))),
        3 => place().prop_map(|position_m| {
            Step::Order(Order::GoTo { position_m, yaw_rad: f32::NAN, speed_m_s: None })
        }),
        1 => (0_u16..6).prop_map(|number| Step::Order(Order::Resume(number))),
        1 => (-1.0_f32..5.0).prop_map(|speed_m_s| Step::Order(Order::Speed(speed_m_s))),
        4 => place().prop_map(|position_m| Step::Target(OffboardTarget::Motion(motion(position_m)))),
        1 => (0.0_f32..1.0).prop_map(|thrust| Step::Target(OffboardTarget::Attitude(AttitudeTarget {
            attitude: UnitQuaternion::identity(),
            yaw_rate_rad_s: 0.0,
            thrust,
        }))),
        2 => (-1.0_f32..1.0, -1.0_f32..1.0).prop_map(|(pitch, throttle)| {
            Step::Sticks(Sticks { pitch, throttle, ..Sticks::default() })
        }),
        2 => any::<bool>().prop_map(Step::Heard),
        1 => any::<bool>().prop_map(Step::Sees),
        1 => (3.3_f32..4.2).prop_map(Step::Battery),
        1 => any::<bool>().prop_map(Step::Sensor),
        2 => any::<bool>().prop_map(Step::Descends),
        2 => (0_u8..3).prop_map(Step::Mission),
        1 => (-2.0_f32..2.0).prop_map(Step::Wind),
        12 => (1_u16..6000).prop_map(Step::Wait),
    ];
    proptest::collection::vec(step, 1..60)
}

fn mission(kind: u8) -> Vec<Item> {
    let waypoint = |x: f32, fly_through| Item::Waypoint {
        position_m: Vector3::new(x, 3.0, 5.0),
        yaw_rad: f32::NAN,
        hold_s: 0.5,
        within_m: 0.5,
        fly_through,
    };
    match kind {
        0 => vec![],
        1 => vec![Item::TakeOff { height_m: 3.0 }, waypoint(5.0, true), waypoint(8.0, false), Item::Return],
        _ => vec![waypoint(3.0, false), Item::Speed(2.0), Item::Land { position_m: Vector3::repeat(f32::NAN) }],
    }
}

/// Runs a tick, and checks the changes of mode against a model that sees the vehicle from outside.
fn follow(bench: &mut Bench, asked: Option<Order>) -> Result<(), TestCaseError> {
    let (before, was_armed) = (bench.guidance.mode(), bench.core.armed());
    let said = bench.said.len();
    let guided = bench.tick();
    let new = &bench.said[said..];
    let changes: Vec<_> = new
        .iter()
        .filter_map(|notice| match notice {
            GuidanceNotice::Mode(mode, reason) => Some((*mode, *reason)),
            _ => None,
        })
        .collect();
    // Every transition is announced, and every announcement is a transition.
    let mut mode = before;
    for (next, reason) in &changes {
        prop_assert!(*next != mode, "{:?} announced twice", next);
        let fits = match reason {
            ModeReason::Ordered => match asked {
                Some(Order::Select(wanted)) => *next == wanted,
                Some(Order::TakeOff(_)) => *next == FlightMode::Takeoff,
                Some(Order::GoTo { .. }) => *next == FlightMode::Hold,
                _ => false,
            },
            ModeReason::Done => [FlightMode::Takeoff, FlightMode::Mission].contains(&mode) && *next == FlightMode::Hold,
            ModeReason::Cleared => (mode, *next) == (FlightMode::Mission, FlightMode::Hold),
            ModeReason::Mission => mode == FlightMode::Mission && [FlightMode::Land, FlightMode::Return].contains(next),
            ModeReason::NoLift => [FlightMode::Hold, FlightMode::Land].contains(next),
            ModeReason::Disarmed => *next == FlightMode::Hold,
            ModeReason::Back => mode == FlightMode::Land && bench.core == Mode::Flying,
            ModeReason::Failsafe(_) => strength(*next) > strength(mode) && was_armed,
        };
        prop_assert!(fits, "{:?} to {:?} by {:?}, asked {:?}", mode, next, reason, asked);
        mode = *next;
    }
    prop_assert_eq!(mode, guided.mode, "announced {:?}", changes);
    prop_assert_eq!(asked.is_some(), guided.answer.is_some());
    // A refused order has no effect.
    if let Some((_, Err(_))) = guided.answer {
        prop_assert!(changes.iter().all(|(_, reason)| *reason != ModeReason::Ordered));
    }
    if let (Some(Order::Select(wanted)), Some((_, Ok(())))) = (asked, guided.answer) {
        let ended = changes.iter().any(|(_, reason)| *reason != ModeReason::Ordered);
        prop_assert!(guided.mode == wanted || ended);
    }
    // Motors idle only when armed, and disarming is requested on the ground only.
    prop_assert!(!guided.idle_on_ground || was_armed);
    if bench.airborne() {
        prop_assert!(guided.request.is_none());
        // In the air, idle motors mean a touchdown during a landing.
        let lands = matches!(guided.mode, FlightMode::Land | FlightMode::Return);
        prop_assert!(!guided.idle_on_ground || lands && bench.state.position_m.z < 0.1, "{:?}", bench.state);
    }
    if let Some(setpoint) = guided.setpoint {
        prop_assert!(setpoint.is_plausible());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    /// After random orders and failures and a quiet minute, the vehicle is disarmed on the ground, or flies as it
    /// should.
    #[test]
    fn random_walks_follow_the_table(steps in steps()) {
        let mut settings = settings();
        (settings.failsafe.cells, settings.failsafe.fence_radius_m, settings.failsafe.fence_height_m) = (1, 35.0, 25.0);
        let mut bench = Bench::new(settings);
        bench.battery = Some(BatteryReading { voltage_v: 4.0, current_a: 0.0, charge: None });
        bench.run(1.5);
        for step in steps {
            let mut asked = None;
            match step {
                Step::Arm => {
                    if bench.core == Mode::Disarmed && bench.rested() && bench.guidance.arming_refusals().is_empty() {
                        bench.core = Mode::Flying;
                        bench.landing = afbc_flight_core::landing::LandDetector::new(&bench.state, 9.81);
                    }
                }
                Step::Kill => bench.core = Mode::Disarmed,
                Step::Order(order) => {
                    let queued = bench.orders.given.push_back(Ticketed { value: order, ticket: 9 });
                    prop_assert!(queued.is_ok());
                    asked = Some(order);
                }
                Step::Target(target) => bench.aim(target),
                Step::Sticks(value) => bench.orders.sticks = Some(Stamped { value, at_us: bench.now_us }),
                Step::Heard(heard) => bench.heard = heard,
                Step::Sees(sees) => {
                    bench.sees = sees || bench.core.armed();
                    if bench.core == Mode::Descending {
                        bench.core = Mode::Flying;
                    }
                }
                Step::Battery(voltage_v) => {
                    bench.battery = Some(BatteryReading { voltage_v, current_a: 0.0, charge: None });
                }
                Step::Sensor(inertial) => bench.sensors.inertial = inertial,
                Step::Descends(sees) => {
                    if bench.core.armed() {
                        (bench.core, bench.sees) = (Mode::Descending, sees);
                    }
                }
                Step::Mission(kind) => bench.items = mission(kind),
                Step::Wind(wind_m_s2) => bench.wind_m_s2.x = wind_m_s2,
                Step::Wait(ticks) => {
                    for _ in 0..ticks {
                        follow(&mut bench, None)?;
                    }
                }
            }
            follow(&mut bench, asked)?;
        }
        for _ in 0..60_000 {
            follow(&mut bench, None)?;
        }
        let hovers = bench.state.velocity_m_s.norm() < 0.3;
        let flies = bench.airborne() && (hovers || bench.guidance.mode() != FlightMode::Hold);
        prop_assert!(!bench.core.armed() || flies, "{:?} {:?}", bench.state, bench.last);
    }
}
