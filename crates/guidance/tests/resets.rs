//! Estimator resets: the vehicle does not move while it holds, climbs or lands, and still flies to the ordered places.

use crate::bench::{Bench, settings};
use afbc_guidance::*;
use afbc_types::ResetDelta;
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;

/// Largest movement that a reset may cause \[m\].
const MOVES_M: f32 = 0.1;

/// Resets the estimate. Returns the change of the setpoint relative to the vehicle, of position \[m\] plus heading
/// \[rad\].
fn reset(bench: &mut Bench, delta: ResetDelta) -> f32 {
    let off_m = |bench: &Bench| {
        let setpoint = bench.last.unwrap().setpoint.unwrap();
        (setpoint.position_m - bench.state.position_m, setpoint.yaw_rad - bench.state.attitude_rad.z)
    };
    let before = off_m(bench);
    bench.reset(delta);
    bench.tick();
    let after = off_m(bench);
    (after.0 - before.0).norm() + afbc_control::math::wrap_angle(after.1 - before.1).abs()
}

fn jump() -> impl Strategy<Value = ResetDelta> {
    let axis = || prop_oneof![-100.0_f32..100.0, -1.0_f32..1.0];
    ([axis(), axis(), axis()], -3.0_f32..3.0)
        .prop_map(|(by, yaw_rad)| ResetDelta { position_m: Vector3::from(by) / 3.0_f32.sqrt(), yaw_rad })
}

/// Limits the vertical reset, so that places a few metres above the ground stay above it.
fn above_ground(delta: ResetDelta) -> ResetDelta {
    let [[x, y, z]] = delta.position_m.data.0;
    ResetDelta { position_m: Vector3::new(x, y, z.min(3.0)), ..delta }
}

fn go_to(position_m: Vector3<f32>, yaw_rad: f32) -> Order {
    Order::GoTo { position_m, yaw_rad, speed_m_s: None }
}

/// Returns a bench that holds: 0 where it stopped, 1 at an ordered place, 2 with a heading, 3 and 4 with centred
/// sticks.
fn holding(which: usize) -> Bench {
    let mut bench = Bench::hovering(settings());
    bench.orders.sticks = None;
    match which {
        0 => {}
        1 => bench.order(go_to(Vector3::new(3.0, 2.0, 4.0), f32::NAN)).unwrap(),
        2 => bench.order(go_to(Vector3::new(3.0, 2.0, 4.0), 1.0)).unwrap(),
        _ => {
            centre(&mut bench);
            let mode = if which == 3 { FlightMode::Position } else { FlightMode::Altitude };
            bench.select(mode).unwrap();
        }
    }
    run(&mut bench, 10.0);
    bench
}

fn centre(bench: &mut Bench) {
    let value = Sticks { roll: 0.0, pitch: 0.0, throttle: 0.0, yaw: 0.0 };
    bench.orders.sticks = Some(afbc_flight_core::Stamped { value, at_us: bench.now_us });
}

/// Flies on. Keeps the sticks fresh if there are any.
fn run(bench: &mut Bench, time_s: f32) {
    for _ in 0..(time_s * 10.0) as u32 {
        if bench.orders.sticks.is_some() {
            centre(bench);
        }
        bench.run(0.1);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Held places and headings move along with any number of resets.
    #[test]
    fn what_is_held_does_not_move(
        which in 0_usize..5,
        jumps in proptest::collection::vec((jump(), 0.05_f32..2.0), 1..4),
    ) {
        let mut bench = holding(which);
        let (true_m, true_rad) = (bench.true_m(), bench.true_rad());
        for (delta, wait_s) in jumps {
            let kick = reset(&mut bench, delta);
            prop_assert!(kick < 2e-3, "{}", kick);
            run(&mut bench, wait_s);
        }
        run(&mut bench, 3.0);
        let off_m = (bench.true_m() - true_m).norm();
        prop_assert!(off_m < MOVES_M, "{} m", off_m);
        let turned = afbc_control::math::wrap_angle(bench.true_rad() - true_rad).abs();
        prop_assert!(turned < 0.02, "{} rad", turned);
    }

    /// A reset during a flight causes no jump of the setpoint relative to the vehicle. The flight still ends at the
    /// ordered place of the local frame, or at the ordered height above the ground.
    #[test]
    fn what_was_ordered_is_reached_from_there(delta in jump(), after_s in 0.1_f32..4.0, takes_off: bool) {
        let mut bench = if takes_off {
            let mut bench = Bench::new(settings());
            bench.run(1.5);
            bench.arm();
            bench.order(Order::TakeOff(Some(8.0))).unwrap();
            bench.run(0.6);
            bench
        } else {
            let mut bench = Bench::hovering(settings());
            bench.order(go_to(Vector3::new(60.0, 0.0, 12.0), f32::NAN)).unwrap();
            bench
        };
        bench.run(after_s);
        let kick = reset(&mut bench, if takes_off { delta } else { above_ground(delta) });
        prop_assert!(kick < 2e-2, "{}", kick);
        bench.run(60.0);
        let (true_m, position_m) = (bench.true_m(), bench.state.position_m);
        prop_assert_eq!(bench.guidance.mode(), FlightMode::Hold);
        if takes_off {
            prop_assert!((true_m - Vector3::new(0.0, 0.0, 8.0)).norm() < 0.2, "{:?}", true_m);
        } else {
            prop_assert!((position_m - Vector3::new(60.0, 0.0, 12.0)).norm() < 0.2, "{:?}", position_m);
        }
    }

    /// A landing goes straight down despite a reset.
    #[test]
    fn a_landing_goes_straight_down(delta in jump(), after_s in 0.1_f32..3.0) {
        let mut bench = holding(1);
        let true_m = bench.true_m();
        bench.select(FlightMode::Land).unwrap();
        bench.run(after_s);
        // The bench's ground does not move with a reset: keep the height.
        let level = ResetDelta { position_m: Vector3::new(delta.position_m.x, delta.position_m.y, 0.0), ..delta };
        reset(&mut bench, level);
        bench.run(20.0);
        prop_assert!(!bench.core.armed());
        let off_m: Vector2<f32> = (bench.true_m() - true_m).xy();
        prop_assert!(off_m.norm() < MOVES_M, "{:?}", off_m);
    }

    /// A mission's waypoints do not move with a reset.
    #[test]
    fn waypoints_stay_where_they_are(delta in jump(), after_s in 0.5_f32..6.0) {
        let mut bench = Bench::hovering(settings());
        let place_m = Vector3::new(20.0, -10.0, 8.0);
        let fly_through = false;
        bench.items =
            vec![Item::Waypoint { position_m: place_m, yaw_rad: 0.5, hold_s: 0.0, within_m: 0.3, fly_through }];
        bench.tick();
        bench.select(FlightMode::Mission).unwrap();
        bench.run(after_s);
        let kick = reset(&mut bench, above_ground(delta));
        prop_assert!(kick < 2e-2, "{}", kick);
        bench.run(60.0);
        prop_assert_eq!(&bench.reached, &[0]);
        prop_assert!((bench.state.position_m - place_m).norm() < 0.3, "{:?}", bench.state);
    }
}

/// The first state after an outage is no reset of an earlier one.
#[test]
fn the_first_state_after_an_outage_shifts_nothing() {
    let mut bench = holding(1);
    bench.sees = false;
    bench.run(0.1);
    bench.sees = true;
    bench.reset(ResetDelta { position_m: Vector3::new(0.0, -4.0, 0.0), yaw_rad: 0.0 });
    bench.run(10.0);
    assert!((bench.state.position_m - Vector3::new(3.0, 2.0, 4.0)).norm() < 0.1, "{:?}", bench.state);
}
