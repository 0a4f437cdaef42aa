//! For arbitrary inputs, setpoints are finite and within the limits.

use afbc_flight_core::{Mode, Queue, Stamped, Ticketed};
use afbc_guidance::*;
use afbc_types::{Setpoint, State};
use nalgebra::{Quaternion, Unit, Vector3};
use proptest::prelude::*;

/// Any number, often an invalid one.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -20.0_f32..20.0,
        2 => Just(f32::NAN),
        1 => proptest::sample::select(vec![f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MAX, f32::MIN_POSITIVE]),
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => -1e5_f32..1e5,
    ]
}

fn vector() -> impl Strategy<Value = Vector3<f32>> {
    [any_number(), any_number(), any_number()].prop_map(Vector3::from)
}

/// A plausible state, an arbitrary one, or none.
fn state() -> impl Strategy<Value = Option<State>> {
    let sane = ([-50.0_f32..50.0, -50.0_f32..50.0, 0.0_f32..50.0], [-9.0_f32..9.0, -9.0_f32..9.0, -3.0_f32..3.0])
        .prop_map(|(p, v)| State { position_m: p.into(), velocity_m_s: v.into(), ..State::default() });
    let wild = (vector(), vector(), vector(), vector()).prop_map(|(p, v, attitude_rad, rates_rad_s)| State {
        position_m: p,
        velocity_m_s: v,
        attitude_rad,
        rates_rad_s,
    });
    prop_oneof![1 => Just(None), 5 => sane.prop_map(Some), 2 => wild.prop_map(Some)]
}

fn order() -> impl Strategy<Value = Order> {
    prop_oneof![
        4 => proptest::sample::select(FlightMode::ALL.to_vec()).prop_map(Order::Select),
        2 => proptest::option::of(any_number()).prop_map(Order::TakeOff),
        2 => (vector(), any_number(), proptest::option::of(any_number()))
            .prop_map(|(position_m, yaw_rad, speed_m_s)| Order::GoTo { position_m, yaw_rad, speed_m_s }),
        1 => any_number().prop_map(Order::Speed),
        2 => (vector(), any_number(), any_number(), any::<u16>(), heading()).prop_map(
            |(centre_m, radius_m, speed_m_s, angle_deg, heading)| Order::Orbit {
                centre_m,
                radius_m,
                speed_m_s,
                angle_deg,
                heading
            }
        ),
        1 => proptest::option::of(vector()).prop_map(Order::Home),
        1 => any::<u16>().prop_map(Order::Resume),
    ]
}

fn heading() -> impl Strategy<Value = OrbitHeading> {
    proptest::sample::select(vec![OrbitHeading::Centre, OrbitHeading::Kept, OrbitHeading::Along])
}

fn target() -> impl Strategy<Value = OffboardTarget> {
    let motion = (vector(), vector(), vector(), any_number(), any_number(), any::<bool>()).prop_map(
        |(position_m, velocity_m_s, acceleration_m_s2, yaw_rad, yaw_rate_rad_s, body)| {
            OffboardTarget::Motion(MotionTarget {
                position_m,
                velocity_m_s,
                acceleration_m_s2,
                yaw_rad,
                yaw_rate_rad_s,
                body,
            })
        },
    );
    let attitude = ([any_number(), any_number(), any_number(), any_number()], any_number(), any_number()).prop_map(
        |([w, x, y, z], yaw_rate_rad_s, thrust)| {
            let attitude = Unit::new_unchecked(Quaternion::new(w, x, y, z));
            OffboardTarget::Attitude(AttitudeTarget { attitude, yaw_rate_rad_s, thrust })
        },
    );
    prop_oneof![3 => motion, 1 => attitude]
}

fn item() -> impl Strategy<Value = Item> {
    prop_oneof![
        any_number().prop_map(|height_m| Item::TakeOff { height_m }),
        (vector(), any_number(), any_number(), any_number(), any::<bool>()).prop_map(
            |(position_m, yaw_rad, hold_s, within_m, fly_through)| Item::Waypoint {
                position_m,
                yaw_rad,
                hold_s,
                within_m,
                fly_through
            }
        ),
        vector().prop_map(|position_m| Item::Land { position_m }),
        Just(Item::Return),
        any_number().prop_map(Item::Speed),
        any_number().prop_map(Item::Wait),
        (vector(), any_number(), any_number()).prop_map(|(centre_m, radius_m, turns)| Item::Turns {
            centre_m,
            radius_m,
            turns
        }),
        (any_number(), any::<bool>(), any::<i8>()).prop_map(|(yaw_rad, relative, direction)| Item::Yaw {
            yaw_rad,
            relative,
            direction
        }),
        vector().prop_map(|at_m| Item::Look { at_m }),
        (0_u16..4).prop_map(Item::Jump),
    ]
}

/// Several ticks with the same input.
#[derive(Clone, Debug)]
struct Spell {
    ticks: u16,
    step_us: i64,
    dt_s: f32,
    state: Option<State>,
    core: Mode,
    airborne: bool,
    battery: Option<(f32, f32)>,
    order: Option<Order>,
    target: Option<OffboardTarget>,
    sticks: Option<[f32; 4]>,
    item: Option<(u16, u16, Item, bool)>,
    fence: Option<(bool, bool)>,
    lift: (f32, f32),
    fresh: bool,
}

fn spell() -> impl Strategy<Value = Spell> {
    let modes = vec![Mode::Disarmed, Mode::Flying, Mode::Flying, Mode::Flying, Mode::Coasting, Mode::Descending];
    let clock = (
        1_u16..400,
        prop_oneof![6 => Just(1000_i64), 1 => Just(0), 1 => any::<i64>(), 1 => -5000_i64..50_000],
        prop_oneof![4 => Just(0.001_f32), 1 => any_number()],
    );
    let seen = (
        state(),
        proptest::sample::select(modes),
        any::<bool>(),
        proptest::option::of((any_number(), any_number())),
        prop_oneof![4 => Just((19.6_f32, 9.81_f32)), 1 => (any_number(), any_number())],
    );
    let asked = (
        proptest::option::of(order()),
        proptest::option::of(target()),
        proptest::option::of([any_number(), any_number(), any_number(), any_number()]),
        (
            proptest::option::of((0_u16..3, 0_u16..2, item(), any::<bool>())),
            proptest::option::of(any::<(bool, bool)>()),
        ),
        any::<bool>(),
    );
    (clock, seen, asked).prop_map(
        |(
            (ticks, step_us, dt_s),
            (state, core, airborne, battery, lift),
            (order, target, sticks, (item, fence), fresh),
        )| {
            Spell {
                ticks,
                step_us,
                dt_s,
                state,
                core,
                airborne,
                battery,
                order,
                target,
                sticks,
                item,
                fence,
                lift,
                fresh,
            }
        },
    )
}

fn check(
    settings: &Settings,
    sight: &GuidanceInputs<'_>,
    orders: &Orders,
    guided: &GuidanceOutputs,
) -> Result<(), TestCaseError> {
    prop_assert_eq!(guided.answer.is_some(), !orders.given.is_empty());
    prop_assert!(guided.notices.iter().all(|notice| notice.to_string().len() <= 50));
    prop_assert!(guided.charge.is_none_or(|charge| (0.0..=1.0).contains(&charge)));
    prop_assert!(!guided.idle_on_ground || sight.core.armed());
    prop_assert!(guided.home_m.is_none_or(|home_m| home_m.iter().all(|value| value.is_finite())));
    let Some(setpoint) = &guided.setpoint else { return Ok(()) };
    prop_assert!(setpoint.is_plausible(), "{:?}", setpoint);
    let direct =
        matches!(guided.mode, FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro | FlightMode::Offboard);
    if direct || !sight.core.armed() {
        return Ok(());
    }
    let (limits, hair) = (&settings.limits, 1.0 + 1e-3);
    let Setpoint { velocity_m_s: v, acceleration_m_s2: a, .. } = setpoint;
    prop_assert!(v.xy().norm() <= limits.speed_m_s * hair, "{:?}", setpoint);
    prop_assert!(v.z <= limits.up_m_s * hair && -v.z <= limits.down_m_s * hair, "{:?}", setpoint);
    // While landing, the setpoint may command a thrust well below the weight.
    let lands = matches!(guided.mode, FlightMode::Land | FlightMode::Return);
    let off = a + Vector3::new(0.0, 0.0, 0.7 * sight.available_thrust.gravity_m_s2);
    let settles = lands && off.xy().norm() <= 5.0 * hair && off.z.abs() <= 5.0 * hair;
    prop_assert!(settles || a.xy().norm() <= limits.acceleration_max_m_s2 * hair, "{:?}", setpoint);
    prop_assert!(settles || a.z.abs() <= limits.vertical_acceleration_m_s2 * hair, "{:?}", setpoint);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn nothing_absurd_comes_out(spells in proptest::collection::vec(spell(), 1..40)) {
        let failsafe = FailsafeSettings { cells: 3, ..FailsafeSettings::DEFAULT };
        let settings = Settings { failsafe, ..Settings::DEFAULT };
        let mut guidance = Guidance::new(settings).unwrap();
        let mut now_us = 5_000_000_u64;
        for spell in spells {
            for tick in 0..spell.ticks {
                now_us = now_us.wrapping_add_signed(spell.step_us);
                let at_us = if spell.fresh { now_us } else { now_us.wrapping_sub(u64::from(tick) * 1000) };
                let sticks = spell.sticks.map(|[roll, pitch, throttle, yaw]| Sticks { roll, pitch, throttle, yaw });
                let given = spell.order.filter(|_| tick == 0).map(|order| Ticketed { value: order, ticket: 1 });
                let mut orders = Orders {
                    target: spell.target.map(|value| Stamped { value, at_us }),
                    sticks: sticks.map(|value| Stamped { value, at_us }),
                    leg: spell
                        .item
                        .map(|(number, upload, item, is_last)| RequestedItem { number, upload, item, is_last }),
                    heard_us: Some(at_us),
                    safe_m: spell.target.and_then(|target| match target {
                        OffboardTarget::Motion(motion) => Some(motion.velocity_m_s.xy()),
                        OffboardTarget::Attitude(_) => None,
                    }),
                    fence: spell.fence.map(|(leaves, outside)| FenceStatus { leaves, outside }),
                    given: Queue::new(),
                };
                orders.given.extend(given);
                let sight = GuidanceInputs {
                    now_us,
                    dt_s: spell.dt_s,
                    state: spell.state.as_ref(),
                    reset: None,
                    core: spell.core,
                    airborne: spell.airborne,
                    rested: spell.fresh,
                    battery: spell
                        .battery
                        .map(|(voltage_v, current_a)| BatteryReading { voltage_v, current_a, charge: None }),
                    sensors: FailedSensors { gnss: !spell.fresh, ..FailedSensors::default() },
                    available_thrust: AvailableThrust {
                        most_m_s2: spell.lift.0,
                        gravity_m_s2: spell.lift.1,
                        given_m_s2: Some(spell.lift.0),
                    },
                };
                let guided = guidance.tick(&sight, &orders);
                check(&settings, &sight, &orders, &guided)?;
            }
        }
    }
}
