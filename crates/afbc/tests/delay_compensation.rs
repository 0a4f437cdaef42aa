//! The shift of predictable inputs compensates the lag that the filters leave, tested through the filters themselves.

use afbc::delay_compensation::DelayCompensation;
use afbc_control::{Smoother, Smoothing};
use afbc_types::Inputs;
use nalgebra::{Vector2, Vector3};

const DT_S: f32 = 0.001;
const LAG_S: f32 = 0.033;
const FILTERS: Smoothing =
    Smoothing { smooth_tilt_rad_s: 160.0, smooth_yaw_rad_s: 290.0, smooth_lift_rad_s: 90.0, lead_s: 0.03 };

/// After filters and rotors a ramp of roll, pitch or thrust has no lag. Without the shift, and for yaw, it lags by what
/// the lead leaves.
#[test]
fn a_ramp_arrives_in_time() {
    let ahead = DelayCompensation::new(LAG_S, &FILTERS, 50.0, DT_S);
    let smoother = Smoother::new(&FILTERS, DT_S).unwrap();
    let arrives = |ahead: Option<&DelayCompensation>| {
        let (mut late, mut smoothed, mut rotors) = (None, None, Inputs::default());
        let slope = 20.0;
        let mut off = Vector3::zeros();
        for k in 0..2_000 {
            let now = slope * k as f32 * DT_S;
            let more = ahead.map_or(Vector2::zeros(), |ahead| ahead.advance(&mut late, &Vector2::repeat(now)));
            let thrust_n = now + ahead.map_or(0.0, |ahead| ahead.thrust_s * slope);
            let [roll_n, pitch_n] = (Vector2::repeat(now) + more).into();
            let given = smoother.advance(&mut smoothed, &Inputs { roll_n, pitch_n, yaw_n: now, thrust_n });
            let share = 1.0 - (-DT_S / LAG_S).exp();
            let follow = |rotor: f32, given: f32| rotor + (given - rotor) * share;
            rotors = Inputs {
                roll_n: follow(rotors.roll_n, given.roll_n),
                pitch_n: follow(rotors.pitch_n, given.pitch_n),
                yaw_n: follow(rotors.yaw_n, given.yaw_n),
                thrust_n: follow(rotors.thrust_n, given.thrust_n),
            };
            // In seconds.
            off = Vector3::new(now - rotors.roll_n, now - rotors.yaw_n, now - rotors.thrust_n) / slope;
        }
        off
    };
    let [tilt, yaw, lift] = [LAG_S + 2.0 / 160.0 - 0.03, LAG_S + 2.0 / 290.0, LAG_S + 2.0 / 90.0 - 0.03];
    // The discrete filters are faster than the continuous ones by half a step each.
    let close = |is: Vector3<f32>, should: Vector3<f32>| (is - should).abs().max() < 2.0 * DT_S;
    let without = arrives(None);
    assert!(close(without, Vector3::new(tilt, yaw, lift)), "{without}");
    let with = arrives(Some(&ahead));
    assert!(close(with, Vector3::new(0.0, yaw, 0.0)), "{with}");
}

/// A lead larger than the lag is not reversed. Without filters the whole rotor lag is left.
#[test]
fn lags_are_not_negative() {
    let led = DelayCompensation::new(0.01, &Smoothing { lead_s: 0.3, ..FILTERS }, 50.0, DT_S);
    assert_eq!(led.thrust_s, 0.0);
    let mut late = None;
    led.advance(&mut late, &Vector2::zeros());
    let more = led.advance(&mut late, &Vector2::repeat(1.0));
    assert_eq!(more, Vector2::zeros());
    let bare = DelayCompensation::new(LAG_S, &Smoothing { smooth_lift_rad_s: 0.0, ..FILTERS }, 50.0, DT_S);
    assert_eq!(bare.thrust_s, LAG_S);
}

/// The first value causes no change, so an engaged law does not jump.
#[test]
fn the_first_is_no_change() {
    let mut late = None;
    let more = DelayCompensation::new(LAG_S, &FILTERS, 50.0, DT_S).advance(&mut late, &Vector2::repeat(7.0));
    assert_eq!(more, Vector2::zeros());
}
